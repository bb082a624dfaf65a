"""The answer of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

from rich.console import Console

from softbrake.case.units import STANDARD_GRAVITY
from softbrake.report.console.tables import Column, plain, print_columns, print_quantities
from softbrake.report.console.trials import print_trials
from softbrake.report.words import (
    SHOWN,
    TENSIONS,
    disturbed_in_words,
    gas_energy_rows,
    made_in_words,
    margin_in_words,
    named,
    openings_in_words,
    outcome_in_words,
    thread_rows,
    vented_in_words,
    verdict_rows,
    when_in_words,
)
from softbrake.sim.limits import Verdict
from softbrake.sim.summary import PeakValue, Sensitivities, Summary, contact_in_words

VERDICTS = (Column("limit", False, True), Column("answer"), Column("margin"), Column("", False, True))
Line = tuple[str, ...]  # name, value, unit, note, as far as there are


def print_summary(
    summary: Summary,
    tension_scale: float | None = None,
    console: Console | None = None,
    verdicts: Sequence[Verdict] = (),
) -> None:
    """Print the summary in at most 80 columns; only the path and the title may be longer, and are never broken.

    verdicts: on the limits of the case.
    With `tension_scale` (N/m) the tensions stand in the paper's dimensionless form as well (section 3.2).
    """
    console = console or plain()
    console.print(summary.title, style="bold", soft_wrap=True, markup=False, highlight=False)
    console.print(outcome_in_words(summary), markup=False, highlight=False)
    console.print()
    tables = [_motion(summary), _gas(summary), _tensions(summary, tension_scale), _work(summary)]
    print_quantities(console, *filter(None, tables))
    console.print()
    if verdicts:
        print_columns(console, VERDICTS, verdict_rows(verdicts), gap=2)
        console.print()
    if summary.trials:
        print_trials(summary.trials, console)
        console.print()
    if summary.sensitivity is not None:
        _print_sensitivity(summary.sensitivity, console)
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
    if summary.results and summary.results_fault is None:
        console.print(f"results in {summary.results}", soft_wrap=True, markup=False, highlight=False)


def _motion(summary: Summary) -> list[Line]:
    table: list[Line] = []
    if summary.impact_velocity is not None or (summary.impact_velocity_error is not None and summary.outcome != "rebound"):
        bar = "" if summary.impact_velocity_error is None else f"± {summary.impact_velocity_error:.2g} m/s"
        when = "" if summary.impact_time is None else f"at {summary.impact_time:.5f} s"
        table.append(("impact velocity", f"{summary.impact_velocity or 0.0:.5f}", "m/s", ", ".join(filter(None, (bar, when)))))
    if (found := summary.ensemble) is not None:
        table.append(
            (f"  of {found.members} drops", f"{found.least:.5f}", "m/s", f"to {found.most:.5f} m/s, {disturbed_in_words(found)}")
        )
    table.append(("free-fall velocity", f"{summary.free_fall_velocity:.5f}", "m/s", "over the shell's height"))
    if summary.velocity_reduction is not None:
        share = summary.velocity_reduction / summary.free_fall_velocity if summary.free_fall_velocity else 0.0
        table.append(("reduction", f"{summary.velocity_reduction:.5f}", "m/s", f"{share:.1%} of free fall"))
    if summary.rest_time is not None:
        table.append(("lowest height", f"{summary.lowest_height:.5f}", "m", f"first at rest at {summary.rest_time:.5f} s"))
    if summary.rebound_velocity is not None:
        table.append(("rebound velocity", f"{summary.rebound_velocity:.5f}", "m/s", f"upwards, at {summary.end_time:.5f} s"))
    peak = summary.peak_deceleration
    notes = [f"{peak / STANDARD_GRAVITY:.2f} g net"]
    if (found_peak := summary.peaks.get("peak_deceleration")) is not None:
        notes.append(when_in_words(found_peak, mean=summary.ensemble))
    bar = ("doubtful, " if summary.doubt is not None else "") + _bar(summary, "peak_deceleration", 1.0)
    name = "peak deceleration" if summary.model.fidelity == "lumped" else named("peak_deceleration")
    table.append((name, f"{peak:.2f}", "m/s^2", bar + ", ".join(filter(None, notes))))
    _add_other_peaks(table, summary, "peak_deceleration", 2, 1.0, "m/s^2")
    if summary.filtered is not None and summary.filtered.fault is not None:
        table.append((f"  CFC {summary.filtered.cfc}", "–", "", summary.filtered.fault))
    return table


def _gas(summary: Summary) -> list[Line]:
    """What became of a gas with a state; empty for a pressure law."""
    if summary.peak_pressure is None or summary.peak_temperature is None or summary.vented_mass is None:
        return []
    pressure, temperature = summary.peaks["peak_pressure"], summary.peaks["peak_temperature"]
    when = _bar(summary, "peak_pressure", 1e-3) + when_in_words(pressure, mean=summary.ensemble)
    return [
        ("peak pressure, gauge", f"{summary.peak_pressure / 1e3:.4f}", "kPa", when),
        ("peak temperature", f"{summary.peak_temperature:.2f}", "K", when_in_words(temperature)),
        *([("vented mass", f"{summary.vented_mass:.5f}", "kg", vented_in_words(summary))] if summary.vented_mass else []),
        *openings_in_words(summary),
    ]


def _tensions(summary: Summary, scale: float | None) -> list[Line]:
    table: list[Line] = []
    for tension in TENSIONS:
        name = f"peak_tension_{tension}"
        value: float | None = getattr(summary, name)
        if value is None:
            continue
        notes = ["doubtful"] if summary.doubt is not None else []
        if scale is not None:
            notes.append(f"{value / scale:.3f} T0/L")
        if (peak := summary.peaks.get(name)) is not None:
            notes.append(when_in_words(peak, mean=summary.ensemble))
        table.append(
            (f"peak tension, {tension}", f"{value / 1e3:.3f}", "kN/m", _bar(summary, name, 1e-3) + ", ".join(filter(None, notes)))
        )
        _add_other_peaks(table, summary, name, 3, 1e-3, "kN/m")
    for name, margin in (("fabric", summary.fabric_margin), ("belts", summary.belt_margin)):
        if margin is not None:
            word = "of strength over peak tension" if margin >= 0.0 else "the strength is EXCEEDED"
            table.append((f"margin, {name}", margin_in_words(margin, 1), "", word))
    return table


def _add_other_peaks(table: list[Line], summary: Summary, name: str, digits: int, scale: float, unit: str) -> None:
    """Rows for a peak in the other phase and behind the filter, as far as there are; scale: of the SI value."""
    found, mean = summary.peaks.get(name), summary.ensemble
    filtered: PeakValue | None = None if summary.filtered is None else getattr(summary.filtered, name)
    if found is not None and found.other is not None:
        table.append(
            (
                f"  {found.other.phase}",
                f"{found.other.value * scale:.{digits}f}",
                unit,
                when_in_words(found.other, mean=mean, phase=False),
            )
        )
    if summary.filtered is not None and filtered is not None:
        table.append(
            (f"  CFC {summary.filtered.cfc}", f"{filtered.value * scale:.{digits}f}", unit, when_in_words(filtered, mean=mean))
        )


def _bar(summary: Summary, name: str, unit: float) -> str:
    """Estimated error of a peak, in its unit, where one was asked for."""
    errors = summary.peak_errors or {}
    if name not in errors:
        return ""
    error = errors[name]
    return "± no bound, " if error is None else f"± {error * unit:.2g}, "


def _work(summary: Summary) -> list[Line]:
    table: list[Line] = []
    for name, value in asdict(summary.work).items():
        table.append((f"work, {name}", f"{value:.3f}", "J"))
    if summary.gas is not None:
        table += [(name, f"{value:.3f}", "J", note) for name, value, note in gas_energy_rows(summary.gas)]
    if summary.missed_collisions:
        depth = f"of folds, to {100.0 * summary.largest_penetration:.2g}% of a cell"
        table.append(("missed collisions", str(summary.missed_collisions), "", depth))
    table += [(name, number, "", note) for name, number, note in thread_rows(summary)]
    table.append(("energy residual", f"{summary.energy_error:.2e}", "", "of the initial energy"))
    if made_in_words(summary) == "none":
        table.append(("energy from nowhere", "none"))
    for name, made in summary.energy_made.items():
        if made >= SHOWN:
            table.append((f"energy made by {name}", f"{100 * made:.2g} %", "", "of the initial energy, from nowhere"))
    return table


def _print_sensitivity(found: Sensitivities, console: Console) -> None:
    """Change in % of the answers per 1 % of each input."""
    heads = {"impact_velocity": "impact", "peak_deceleration": "1 kHz peak"} | {f"peak_tension_{part}": part for part in TENSIONS}
    names = [name for name in heads if name in found.errors]
    rows = [
        [row.path, *("–" if (change := row.changes[name]) is None else f"{change:+.2f}" for name in names)]
        for row in found.inputs
    ]
    rows.append(["standard error", *(f"{found.errors[name]:.2g}" for name in names)])
    rows.append(["scatter, %", *(f"{100 * found.noise[name]:.2g}" for name in names)])
    rows.append(["widest change, %", *(f"{100 * found.steps[name]:g}" for name in names)])
    columns = [Column("% per 1 % of", right=False, breaks=True), *(Column(heads[name]) for name in names)]
    print_columns(console, columns, rows, gap=1)


def print_unfinished(row: dict[str, float]) -> None:
    """Print the last history row of a run that was killed, by names of `History` in lower case."""
    from softbrake.core.columns import History

    console = plain()
    last = "Last recorded row:" if row else "No row was recorded."
    console.print(f"The run did not finish: the file has no summary. {last}")
    print_quantities(console, [(name, f"{value:.4g}", History[name.upper()].unit) for name, value in row.items()])
