"""The answer of a run."""

from __future__ import annotations

from dataclasses import asdict

from rich.console import Console
from rich.table import Table

from softbrake.report.console.tables import plain, quantities
from softbrake.report.console.trials import trials_table
from softbrake.report.words import SHOWN, STANDARD_GRAVITY, TENSIONS, disturbed_in_words, made_in_words, outcome_in_words
from softbrake.sim.summary import PeakValue, Sensitivities, Summary, contact_in_words


def print_summary(summary: Summary, tension_scale: float | None = None, console: Console | None = None) -> None:
    """Print the summary in at most 80 columns; only the path and the title may be longer, and are never broken.

    With `tension_scale` (N/m) the tensions stand in the paper's dimensionless form as well (section 3.2).
    """
    console = console or plain()
    console.print(summary.title, style="bold", soft_wrap=True, markup=False, highlight=False)
    console.print(outcome_in_words(summary), markup=False, highlight=False)
    for table in (_motion(summary), _tensions(summary, tension_scale), _work(summary)):
        console.print()
        console.print(table)
    console.print()
    if summary.trials:
        console.print(trials_table(summary.trials))
        console.print()
    if summary.sensitivity is not None:
        console.print(_sensitivity(summary.sensitivity))
        if any(row.changes[name] is None for row in summary.sensitivity.inputs for name in summary.sensitivity.errors):
            console.print("–: no answer at 0.2 % more or less, as the cargo stops or the run fails")
        for path, fault in summary.sensitivity.left_out.items():
            console.print(f"{path} is not varied alone: {fault}")
        console.print()
    model = summary.model
    for line in (
        f"{model.fidelity}, {model.scheme} scheme, {model.generatrix} x {model.hoop} cells, Courant {model.courant:g}",
        *(() if model.fabric is None else (f"fabric: {model.fabric}",)),
        *(() if model.contact is None else (f"contact: {contact_in_words(model.fidelity, model.contact)}",)),
        f"{summary.steps} steps of {summary.time_step * 1e6:.4g} us on average; "
        f"kernels {summary.kernel_seconds:.2f} s of CPU, wall {summary.wall_seconds:.2f} s",
    ):
        console.print(line, markup=False, highlight=False)
    if summary.doubt is not None:
        console.print(f"doubtful: {summary.doubt}", markup=False, highlight=False)
    if summary.fidelity_reason is not None:
        console.print(f"error bar: {summary.fidelity_reason}", markup=False, highlight=False)
    if summary.results:
        console.print(f"results in {summary.results}", soft_wrap=True, markup=False, highlight=False)


def _motion(summary: Summary) -> Table:
    table = quantities()
    if summary.impact_velocity is not None or summary.impact_velocity_error is not None:
        bar = "" if summary.impact_velocity_error is None else f"± {summary.impact_velocity_error:.2g} m/s"
        when = "" if summary.impact_time is None else f"at {summary.impact_time:.5f} s"
        table.add_row("impact velocity", f"{summary.impact_velocity or 0.0:.5f}", "m/s", ", ".join(filter(None, (bar, when))))
    if (found := summary.ensemble) is not None:
        table.add_row(
            f"  of {found.members} drops", f"{found.least:.5f}", "m/s", f"to {found.most:.5f} m/s, {disturbed_in_words(found)}"
        )
    table.add_row("free-fall velocity", f"{summary.free_fall_velocity:.5f}", "m/s", "over the shell's height")
    if summary.velocity_reduction is not None:
        share = summary.velocity_reduction / summary.free_fall_velocity if summary.free_fall_velocity else 0.0
        table.add_row("reduction", f"{summary.velocity_reduction:.5f}", "m/s", f"{share:.1%} of free fall")
    peak = summary.peak_deceleration
    when = f", {_when(summary.peaks['peak_deceleration'])}" if "peak_deceleration" in summary.peaks else ""
    bar = ("doubtful, " if summary.doubt is not None else "") + _bar(summary, "peak_deceleration", 1.0)
    table.add_row("peak deceleration, 1 kHz", f"{peak:.2f}", "m/s^2", f"{bar}{peak / STANDARD_GRAVITY:.2f} g net{when}")
    _add_other_peaks(table, summary, "peak_deceleration", 2, 1.0, "m/s^2")
    if summary.filtered is not None and summary.filtered.fault is not None:
        table.add_row(f"  CFC {summary.filtered.cfc}", "–", "", summary.filtered.fault)
    return table


def _tensions(summary: Summary, scale: float | None) -> Table:
    table = quantities()
    for tension in TENSIONS:
        name = f"peak_tension_{tension}"
        value: float | None = getattr(summary, name)
        if value is None:
            continue
        notes = ["doubtful"] if summary.doubt is not None else []
        if scale is not None:
            notes.append(f"{value / scale:.3f} T0/L")
        if (peak := summary.peaks.get(name)) is not None:
            notes.append(_when(peak))
        table.add_row(f"peak tension, {tension}", f"{value / 1e3:.3f}", "kN/m", _bar(summary, name, 1e-3) + ", ".join(notes))
        _add_other_peaks(table, summary, name, 3, 1e-3, "kN/m")
    for name, margin in (("fabric", summary.fabric_margin), ("belts", summary.belt_margin)):
        if margin is not None:
            word = "of strength over peak tension" if margin >= 0.0 else "the strength is EXCEEDED"
            table.add_row(f"margin, {name}", f"{margin:+.1%}", "", word)
    return table


def _add_other_peaks(table: Table, summary: Summary, name: str, digits: int, scale: float, unit: str) -> None:
    """Rows for a peak in the other phase and behind the filter, as far as there are; scale: of the SI value."""
    found = summary.peaks.get(name)
    filtered: PeakValue | None = None if summary.filtered is None else getattr(summary.filtered, name)
    if found is not None and found.other is not None:
        table.add_row(f"  {found.other.phase}", f"{found.other.value * scale:.{digits}f}", unit, _when(found.other, phase=False))
    if summary.filtered is not None and filtered is not None:
        table.add_row(f"  CFC {summary.filtered.cfc}", f"{filtered.value * scale:.{digits}f}", unit, _when(filtered))


def _when(peak: PeakValue, phase: bool = True) -> str:
    """Time of a peak, its height on the shell, and its phase if that is asked for."""
    height = "" if peak.height is None else f", {peak.height:.3f} m up"
    return f"at {peak.time:.5f} s{height}" + (f", {peak.phase}" if phase and peak.phase is not None else "")


def _bar(summary: Summary, name: str, unit: float) -> str:
    """Estimated error of a peak, in its unit, where one was asked for."""
    errors = summary.peak_errors or {}
    if name not in errors:
        return ""
    error = errors[name]
    return "± no bound, " if error is None else f"± {error * unit:.2g}, "


def _work(summary: Summary) -> Table:
    table = quantities()
    for name, value in asdict(summary.work).items():
        table.add_row(f"work, {name}", f"{value:.3f}", "J")
    if summary.missed_collisions:
        depth = f"of folds, to {100.0 * summary.largest_penetration:.2g}% of a cell"
        table.add_row("missed collisions", str(summary.missed_collisions), "", depth)
    table.add_row("energy residual", f"{summary.energy_error:.2e}", "", "of the initial energy")
    if made_in_words(summary) == "none":
        table.add_row("energy from nowhere", "none")
    for name, made in summary.energy_made.items():
        if made >= SHOWN:
            table.add_row(f"energy made by {name}", f"{100 * made:.2g} %", "", "of the initial energy, from nowhere")
    return table


def _sensitivity(found: Sensitivities) -> Table:
    """Change in % of the answers per 1 % of each input."""
    table = Table(box=None, padding=(0, 1, 0, 0), show_edge=False, header_style="")
    table.add_column("% per 1 % of", overflow="fold")
    columns = {"impact_velocity": "impact", "peak_deceleration": "peak g"}
    columns |= {f"peak_tension_{tension}": f"T {tension}" for tension in TENSIONS}
    columns = {name: head for name, head in columns.items() if name in found.errors}
    for head in columns.values():
        table.add_column(head, justify="right")
    for row in found.inputs:
        table.add_row(row.path, *("–" if row.changes[name] is None else f"{row.changes[name]:+.2f}" for name in columns))
    table.add_row("standard error", *(f"{found.errors[name]:.2g}" for name in columns))
    table.add_row("off straight lines, %", *(f"{100 * found.noise[name]:.2g}" for name in columns))
    table.add_row("steps up to, %", *(f"{100 * found.steps[name]:g}" for name in columns))
    return table


def print_unfinished(row: dict[str, float]) -> None:
    """Print the last history row of a run that was killed, by names of `History` in lower case."""
    from softbrake.core.columns import History

    console = plain()
    last = "Last recorded row:" if row else "No row was recorded."
    console.print(f"The run did not finish: the file has no summary. {last}")
    table = quantities()
    for name, value in row.items():
        table.add_row(name, f"{value:.4g}", History[name.upper()].unit)
    console.print(table)
