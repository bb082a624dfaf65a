"""What the commands print: the summary for people and for programs, and the progress of a run."""

from __future__ import annotations

import json
import math
import shlex
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import BarColumn, TextColumn
from rich.progress import Progress as Bar
from rich.table import Table

from softbrake.sim.summary import Ensemble, Inflation, Peak, Sensitivities, Summary, Trial, contact_in_words

if TYPE_CHECKING:
    from softbrake.case.full_stop import FullStop
    from softbrake.sim.simulation import Progress
    from softbrake.studies.inverse_design import Design, Point, Question
    from softbrake.studies.work_precision import WorkPrecision

Piston = tuple["FullStop", list[tuple[float, Summary]]]
STANDARD_GRAVITY = 9.80665  # m/s^2
SHOWN = 1e-5  # of the initial energy: less than that is what steps of finite length leave
SECONDS_BETWEEN_LINES = 2.0
TENSIONS = ("generatrix", "hoop", "belt")


def summary_json(summary: Summary, tension_scale: float | None = None) -> str:
    """The summary as one JSON object; numbers that are not finite become null.

    With `tension_scale` (N/m) it has one more member, `dimensionless`: the scale and the peak tensions divided by it.
    """
    answer = asdict(summary)
    if tension_scale is not None:
        peaks = {name: answer[name] for name in (f"peak_tension_{tension}" for tension in TENSIONS)}
        answer["dimensionless"] = {"tension_scale": tension_scale} | {
            name: None if value is None else value / tension_scale for name, value in peaks.items()
        }
    return json.dumps(_finite(answer), indent=2, ensure_ascii=False, allow_nan=False)


def row_json(row: dict[str, float]) -> str:
    """The last history row of a run that did not finish, as one JSON object."""
    return json.dumps(_finite({"outcome": "unfinished", "last_row": row}), indent=2, allow_nan=False)


def line_json(row: dict[str, Any]) -> str:
    """One run of a sweep as one JSON object on one line."""
    return json.dumps(_finite(row), ensure_ascii=False, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_summary(summary: Summary, tension_scale: float | None = None, console: Console | None = None) -> None:
    """Print the summary in at most 80 columns; only the path and the title may be longer, and are never broken.

    With `tension_scale` (N/m) the tensions stand in the paper's dimensionless form as well (section 3.2).
    """
    console = console or Console(highlight=False, markup=False, emoji=False)
    console.print(summary.title, style="bold", soft_wrap=True, markup=False, highlight=False)
    console.print(outcome_in_words(summary), markup=False, highlight=False)
    for table in (_motion(summary), _tensions(summary, tension_scale), _work(summary)):
        console.print()
        console.print(table)
    console.print()
    if summary.trials:
        console.print(_trials(summary))
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


def made_in_words(summary: Summary) -> str:
    """What made energy that no force gave, and how much of the initial energy."""
    makers = [f"{name} {100 * made:.2g} %" for name, made in summary.energy_made.items() if made >= SHOWN]
    return ", ".join(makers) or "none"


def inflation_json(inflation: Inflation) -> str:
    """The static inflation as one JSON object."""
    return json.dumps(asdict(inflation), indent=2, ensure_ascii=False, allow_nan=False)


def print_inflation(inflation: Inflation) -> None:
    """Print the static inflation in at most 80 columns."""
    console = Console(highlight=False, markup=False, emoji=False)
    console.print(inflation.title, style="bold", soft_wrap=True)
    console.print(f"Inflated: at rest to a residual of {inflation.residual:.1e} after {inflation.steps} steps.")
    table = _table()
    late = "the largest; the law starts without" if inflation.pressure_late else ""
    for name, value, unit, note in (
        ("pressure", f"{inflation.pressure / 1e3:.4g}", "kPa", late),
        ("height", f"{inflation.height:.5g}", "m", "held"),
        ("largest radius", f"{inflation.largest_radius:.5f}", "m", f"{inflation.largest_radius_height:.3f} m up"),
        ("volume", f"{inflation.volume:.5g}", "m^3", ""),
        ("force on the cover", f"{inflation.cover_force:.2f}", "N", ""),
        ("pull of the wall on it", f"{inflation.wall_pull:.2f}", "N", ""),
        *(
            (f"tension, {part}", f"{tension / 1e3:.4f}", "kN/m", note)
            for part, tension, note in (
                (
                    "generatrix",
                    inflation.tension_generatrix,
                    f"largest; {inflation.middle_tension_generatrix / 1e3:.4f} at mid-height",
                ),
                ("hoop", inflation.tension_hoop, f"largest; {inflation.middle_tension_hoop / 1e3:.4f} at mid-height"),
                ("belt", inflation.tension_belt, "largest"),
            )
            if tension is not None
        ),
    ):
        table.add_row(name, value, unit, note)
    console.print()
    console.print(table)
    if inflation.results:
        console.print(f"\nresults in {inflation.results}", soft_wrap=True)


def outcome_in_words(summary: Summary) -> str:
    """One sentence: how the run ended and when."""
    end = f"{summary.end_time:.5g} s"
    lowest = f"the cover came down to {summary.minimum_height:.4g} m"
    match summary.outcome:
        case "impact":
            return f"Impact: the cover reached the ground at {end}."
        case "stopped":
            return f"Stopped: the cargo came to rest at {end}; {lowest}."
        case "time_limit":
            return f"End of time: no impact by {end}; {lowest}."
        case "diverged":
            return f"Diverged at {end}: the numbers below are not an answer."
        case "interrupted":
            return f"Interrupted at {end}; {lowest}."


def _motion(summary: Summary) -> Table:
    table = _table()
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


def disturbed_in_words(found: Ensemble) -> str:
    """How little the shells of an ensemble are out of round at the start."""
    sizes = f"{found.smallest:g}" if found.smallest == found.largest else f"{found.smallest:g} to {found.largest:g}"
    return f"disturbed by {sizes} R"


def _tensions(summary: Summary, scale: float | None) -> Table:
    table = _table()
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
    filtered: Peak | None = None if summary.filtered is None else getattr(summary.filtered, name)
    if found is not None and found.other is not None:
        table.add_row(f"  {found.other.phase}", f"{found.other.value * scale:.{digits}f}", unit, _when(found.other, phase=False))
    if summary.filtered is not None and filtered is not None:
        table.add_row(f"  CFC {summary.filtered.cfc}", f"{filtered.value * scale:.{digits}f}", unit, _when(filtered))


def _when(peak: Peak, phase: bool = True) -> str:
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


def _trials(summary: Summary) -> Table:
    """What was tried for a tolerance."""
    table = Table(box=None, padding=(0, 1, 0, 0), show_edge=False, header_style="")
    for name in ("level", "grid", "m/s", "error", "s", ""):
        table.add_column(name, justify="left" if name in ("level", "") else "right", overflow="fold")
    for trial in summary.trials:
        table.add_row(*_trial(trial))
    return table


def _trial(trial: Trial) -> tuple[str, ...]:
    hoop = "" if trial.fidelity in ("axisymmetric", "lumped") else f" x {trial.hoop}"
    value = "–" if trial.impact_velocity is None else f"{trial.impact_velocity:.4f}"
    error = "–" if trial.error is None or not math.isfinite(trial.error) else f"{trial.error:.2g}"
    return trial.fidelity, f"{trial.generatrix}{hoop}", value, error, f"{trial.seconds:.2f}", trial.verdict


def print_trial(trial: Trial) -> None:
    """One level of a climb as soon as it is done, on stderr."""
    level, grid, value, error, seconds, verdict = _trial(trial)
    print(f"{level} {grid}: {value} m/s, error {error}, {seconds} s: {verdict}", file=sys.stderr, flush=True)


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


def _work(summary: Summary) -> Table:
    table = _table()
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


def _table() -> Table:
    table = Table.grid(padding=(0, 1, 0, 0))
    table.add_column(width=24)
    table.add_column(justify="right", width=10)
    table.add_column(width=6)
    table.add_column(overflow="fold")
    return table


def print_point(question: Question, point: Point) -> None:
    """One value of a search as soon as it is tried, on stderr."""
    unit = f" {question.unit}".rstrip()
    print(f"{question.path} {point.value:.6g}{unit}: {point.in_words(question.target)}", file=sys.stderr, flush=True)


def design_json(question: Question, stop: Piston, found: Design) -> str:
    """A search as one JSON object, SI units."""
    energy, tried = stop
    keys = ("outcome", "impact_velocity", "minimum_height", "peak_deceleration")
    answers = {
        "section_2_2": asdict(energy)
        | {"piston": [{"peak_time": when} | {key: getattr(summary, key) for key in keys[:3]} for when, summary in tried]},
        "find": question.path,
        "unit": question.unit,
        "target": asdict(question.target),
        "value": found.value,
        "error": found.error,
        "error_reason": found.basis,
        "missed": found.missed or None,
        "bracket": found.bracket,
        "other_crossings": found.others,
        "points": [
            {"value": point.value, "fault": point.fault or None}
            | {key: getattr(point.summary, key, None) for key in (*keys, question.target.name)}
            for point in found.points
        ],
        "summary": asdict(found.summary),
    }
    return json.dumps(_finite(answers), indent=2, ensure_ascii=False, allow_nan=False)


def print_design(question: Question, stop: Piston, found: Design, console: Console | None = None) -> None:
    """Print section 2.2, the value found by the model with its error, and the answer there, in at most 80 columns."""
    from softbrake.studies.inverse_design import answer

    console = console or Console(highlight=False, markup=False, emoji=False)
    energy, tried = stop
    goal, unit = question.target, f" {question.unit}".rstrip()
    table = _table()
    table.add_row("energy of the cargo", f"{energy.energy:.1f}", "J", "m g l1 + m V²/2")
    table.add_row("mean pressure", f"{energy.mean:.1f}", "Pa", "full stop over the shell's height")
    table.add_row("largest, of a sine", f"{energy.largest:.1f}", "Pa", "pi/2 of the mean")
    table.add_row("end of a sine", f"{energy.end_time:.5f}", "s", "")
    for when, summary in tried:
        table.add_row("  with its peak at", f"{when:.5f}", "s", answer(summary, goal))
    console.print("By section 2.2, for a piston of the cover's area", style="bold")
    console.print(table)
    console.print()
    console.print(f"By the model, for {goal}", style="bold")
    table = _table()
    width = "no error bar" if found.error is None else f"± {found.error:.2g}{unit}"
    table.add_row(question.path, f"{found.value:.6g}", question.unit, f"{width}: {found.basis}")
    console.print(table)
    if found.others:
        console.print(f"The answer crosses the target at {found.others + 1} values in the range; this is the lowest.")
    console.print()
    print_summary(found.summary, console=console)


def print_unfinished(row: dict[str, float]) -> None:
    """Print the last history row of a run that was killed, by names of `state.History` in lower case."""
    from softbrake.core.columns import UNITS, History

    console = Console(highlight=False, markup=False, emoji=False)
    last = "Last recorded row:" if row else "No row was recorded."
    console.print(f"The run did not finish: the file has no summary. {last}")
    table = _table()
    for name, value in row.items():
        table.add_row(name, f"{value:.4g}", UNITS[History[name.upper()]])
    console.print(table)


@contextmanager
def _display(*, quiet: bool, at_once: bool = False) -> Iterator[Callable[[float, str, bool], None] | None]:
    """Give a function that shows which share is done, and a line of words about it; None if `quiet`.

    On a terminal it moves a live bar, elsewhere it prints a plain line every few seconds, both on stderr. Plain lines begin with
    the first words if `at_once`; the function's last argument tells words that are not to wait.
    """
    console = Console(stderr=True, highlight=False)
    if quiet:
        yield None
    elif sys.stderr.isatty() and console.is_interactive:
        with Bar(BarColumn(20), TextColumn("{task.description}", markup=False), console=console, transient=True) as bar:
            task = bar.add_task("", total=1.0)
            yield lambda share, words, _: bar.update(task, completed=share, description=words)
    else:
        last = -math.inf if at_once else time.monotonic()

        def write(_: float, words: str, urgent: bool) -> None:
            nonlocal last
            if urgent or time.monotonic() - last >= SECONDS_BETWEEN_LINES:
                last = time.monotonic()
                print(words, file=sys.stderr, flush=True)

        yield write


@contextmanager
def progress(height: float, *, quiet: bool) -> Iterator[Callable[[Progress], None] | None]:
    """Give the callback for a run of a shell of this `height` (m), None if `quiet`: a live bar, or plain lines off a terminal."""
    with _display(quiet=quiet) as show:

        def tell(now: Progress) -> None:
            assert show is not None
            # The run ends on the ground or at its end time, whichever comes first.
            show(max(now.time / now.end_time, 1.0 - now.height / height), _line(now), False)

        yield None if show is None else tell


@contextmanager
def chart_progress(*, quiet: bool) -> Iterator[Callable[[int, int, str], None] | None]:
    """Give the callback for a chart, told runs done, runs planned and what comes next; where and how as `progress`."""
    with _display(quiet=quiet, at_once=True) as show:

        def tell(done: int, planned: int, doing: str) -> None:
            assert show is not None
            show(done / max(planned, 1), f"{done} of {planned} runs: {doing}", False)

        yield None if show is None else tell


def print_work_precision(found: WorkPrecision, command: str, console: Console | None = None) -> None:
    """Print reference, recommended settings, failures and what was left out; `command` is `softbrake run CASE` of the user."""
    from softbrake.studies.work_precision import TOLERANCES, UNITS

    console = console or Console(highlight=False, markup=False, emoji=False)
    console.print(found.case.title, style="bold", soft_wrap=True, markup=False, highlight=False)
    reference = found.reference
    assert reference is not None
    if found.interrupted:
        console.print(f"Interrupted after {len(found.runs)} runs: what is recommended may change.")
    console.print(f"Reference: {reference.basis}.")
    console.print()
    table = Table.grid(padding=(0, 2, 0, 0))
    for name, value in reference.values.items():
        table.add_row(name.replace("_", " "), f"{value:.5g} {UNITS[name]}", f"± {_percent(reference.error(name))}")
    console.print(table)
    console.print()
    table = Table(box=None, padding=(0, 2, 0, 0), show_edge=False, header_style="")
    for head in ("within", "choose", "error", "CPU s"):
        table.add_column(head, justify="left" if head == "choose" else "right", overflow="fold")
    for name in reference.values:
        table.add_row("", name.replace("_", " "), "", "", style="bold")
        for tolerance in TOLERANCES:
            run = found.recommended(name, tolerance)
            if run is None:
                table.add_row(f"{100 * tolerance:g} %", _why_none(reference.error(name), tolerance), "", "")
            else:
                error = max(found.error(run, name), reference.error(name))
                below = "< " if found.error(run, name) < reference.error(name) else ""
                table.add_row(f"{100 * tolerance:g} %", str(run.setting), below + _percent(error), f"{run.seconds:.2g}")
    console.print(table)
    for head, lines in (("failed", found.failures()), ("left out", found.omissions())):
        if lines:
            console.print(f"\n{head}")
            for line in lines:
                console.print(f"  {line}")
    first = next(iter(reference.values))
    chosen = [(tolerance, run) for tolerance in TOLERANCES if (run := found.recommended(first, tolerance)) is not None]
    if chosen and found.case.tolerance is None:
        tolerance, run = chosen[-1]
        sets = " ".join(f"--set {shlex.quote(text)}" for text in run.setting.overrides(found.case))
        console.print(f"\nFor {100 * tolerance:g} % of the {first.replace('_', ' ')}:")
        console.print(f"  {command} {sets}", soft_wrap=True)


def _why_none(known: float, tolerance: float) -> str:
    """Say why no run is recommended for a tolerance, beside a reference that is known to a relative error."""
    if math.isinf(known):
        return "none: the budget holds one grid, so the reference has no error bar; try a larger --budget"
    if known >= tolerance:
        return f"none: the reference is known to {_percent(known)} only"
    return f"none: no run within {100 * tolerance:g} % that a finer one confirms"


def _percent(error: float) -> str:
    return f"{100 * error:.{2 if error < 0.1 else 3}g} %" if math.isfinite(error) else "unknown"


def _line(now: Progress) -> str:
    return f"t {now.time:.4f} s  V {now.velocity:6.3f} m/s  H {now.height:.4f} m  {now.steps} steps"


@contextmanager
def runs_progress(*, quiet: bool) -> Iterator[Callable[[int, int, bool], None] | None]:
    """Give the callback of many runs: runs done, of all, and whether the last was computed now; else as `progress`."""
    started, computed = time.monotonic(), 0
    with _display(quiet=quiet) as show:

        def tell(done: int, total: int, fresh: bool) -> None:
            nonlocal computed
            assert show is not None
            computed += fresh
            seconds = time.monotonic() - started
            rate = computed / seconds if computed and seconds > 0.0 else 0.0
            speed = f", {rate:.3g} a second, {(total - done) / rate:.0f} s left" if rate > 0.0 else ""
            show(done / max(total, 1), f"{done} of {total} runs{speed}", not fresh and done > 0)

        yield None if show is None else tell
