"""What the commands print: the summary for people and for programs, and the progress of a run."""

from __future__ import annotations

import json
import math
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

from softbrake.summary import Inflation, Rung, Summary

if TYPE_CHECKING:
    from softbrake.drop import Progress

STANDARD_GRAVITY = 9.80665  # m/s^2
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
    if summary.ladder:
        console.print(_ladder(summary))
        console.print()
    model = summary.model
    for line in (
        f"{model.fidelity}, {model.scheme} scheme, {model.generatrix} x {model.hoop} cells, Courant {model.courant:g}",
        f"{summary.steps} steps of {summary.time_step * 1e6:.4g} us on average; "
        f"kernels {summary.kernel_seconds:.2f} s, wall {summary.wall_seconds:.2f} s",
    ):
        console.print(line, markup=False, highlight=False)
    if summary.fidelity_reason is not None:
        console.print(f"error bar: {summary.fidelity_reason}", markup=False, highlight=False)
    if summary.results:
        console.print(f"results in {summary.results}", soft_wrap=True, markup=False, highlight=False)


def inflation_json(inflation: Inflation) -> str:
    """The static inflation as one JSON object."""
    return json.dumps(asdict(inflation), indent=2, ensure_ascii=False, allow_nan=False)


def print_inflation(inflation: Inflation) -> None:
    """Print the static inflation in at most 80 columns."""
    console = Console(highlight=False, markup=False, emoji=False)
    console.print(inflation.title, style="bold", soft_wrap=True)
    console.print(f"Inflated: at rest to a residual of {inflation.residual:.1e} after {inflation.steps} steps.")
    table = _table()
    for name, value, unit, note in (
        ("pressure", f"{inflation.pressure / 1e3:.4g}", "kPa", ""),
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
        ("frequency", f"{inflation.frequency:.1f}", "Hz", "of the motion that came to rest last"),
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
    if summary.impact_velocity is not None and summary.impact_time is not None:
        bar = "" if summary.impact_velocity_error is None else f"± {summary.impact_velocity_error:.2g} m/s, "
        table.add_row("impact velocity", f"{summary.impact_velocity:.5f}", "m/s", f"{bar}at {summary.impact_time:.5f} s")
    table.add_row("free-fall velocity", f"{summary.free_fall_velocity:.5f}", "m/s", "over the shell's height")
    if summary.velocity_reduction is not None:
        share = summary.velocity_reduction / summary.free_fall_velocity if summary.free_fall_velocity else 0.0
        table.add_row("reduction", f"{summary.velocity_reduction:.5f}", "m/s", f"{share:.1%} of free fall")
    peak = summary.peak_deceleration
    when = f", at {summary.peaks['peak_deceleration'].time:.5f} s" if "peak_deceleration" in summary.peaks else ""
    bar = _bar(summary, "peak_deceleration", 1.0)
    table.add_row("peak deceleration", f"{peak:.2f}", "m/s^2", f"{bar}{peak / STANDARD_GRAVITY:.2f} g{when}")
    return table


def _tensions(summary: Summary, scale: float | None) -> Table:
    table = _table()
    for tension in TENSIONS:
        name = f"peak_tension_{tension}"
        value: float | None = getattr(summary, name)
        if value is None:
            continue
        notes = [] if scale is None else [f"{value / scale:.3f} T0/L"]
        if (peak := summary.peaks.get(name)) is not None:
            notes.append(f"at {peak.time:.5f} s" + ("" if peak.height is None else f", {peak.height:.3f} m up"))
        table.add_row(f"peak tension, {tension}", f"{value / 1e3:.3f}", "kN/m", _bar(summary, name, 1e-3) + ", ".join(notes))
    return table


def _bar(summary: Summary, name: str, unit: float) -> str:
    """Estimated error of a peak, in its unit, where there is one."""
    error = (summary.peak_errors or {}).get(name)
    return "" if error is None else f"± {error * unit:.2g}, "


def _ladder(summary: Summary) -> Table:
    """What was tried for a tolerance."""
    table = Table(box=None, padding=(0, 1, 0, 0), show_edge=False, header_style="")
    for name in ("level", "grid", "m/s", "error", "s", ""):
        table.add_column(name, justify="left" if name in ("level", "") else "right", overflow="fold")
    for rung in summary.ladder:
        table.add_row(*_rung(rung))
    return table


def _rung(rung: Rung) -> tuple[str, ...]:
    hoop = "" if rung.fidelity in ("axisymmetric", "lumped") else f" x {rung.hoop}"
    value = "–" if rung.impact_velocity is None else f"{rung.impact_velocity:.4f}"
    error = "–" if rung.error is None or not math.isfinite(rung.error) else f"{rung.error:.2g}"
    return rung.fidelity, f"{rung.generatrix}{hoop}", value, error, f"{rung.seconds:.2f}", rung.verdict


def print_rung(rung: Rung) -> None:
    """One level of a climb as soon as it is done, on stderr."""
    level, grid, value, error, seconds, verdict = _rung(rung)
    print(f"{level} {grid}: {value} m/s, error {error}, {seconds} s: {verdict}", file=sys.stderr, flush=True)


def _work(summary: Summary) -> Table:
    table = _table()
    for name, value in asdict(summary.work).items():
        table.add_row(f"work, {name}", f"{value:.3f}", "J")
    if summary.crossings:
        depth = f"of folds, to {summary.largest_penetration:.1%} of a cell"
        table.add_row("crossings", str(summary.crossings), "", depth)
    table.add_row("energy residual", f"{summary.energy_error:.2e}", "", "of the initial energy")
    return table


def _table() -> Table:
    table = Table.grid(padding=(0, 1, 0, 0))
    table.add_column(width=24)
    table.add_column(justify="right", width=10)
    table.add_column(width=6)
    table.add_column(overflow="fold")
    return table


def print_unfinished(row: dict[str, float]) -> None:
    """Print the last history row of a run that was killed, by names of `state.History` in lower case."""
    from softbrake.state import UNITS, History

    console = Console(highlight=False, markup=False, emoji=False)
    last = "Last recorded row:" if row else "No row was recorded."
    console.print(f"The run did not finish: the file has no summary. {last}")
    table = _table()
    for name, value in row.items():
        table.add_row(name, f"{value:.4g}", UNITS[History[name.upper()]])
    console.print(table)


@contextmanager
def progress(height: float, *, quiet: bool) -> Iterator[Callable[[Progress], None] | None]:
    """Give the callback for a run of a shell of this `height` (m).

    On a terminal it draws a live bar, elsewhere a plain line every few seconds, both on stderr; None if `quiet`.
    """
    console = Console(stderr=True, highlight=False)
    if quiet:
        yield None
    elif sys.stderr.isatty() and console.is_interactive:
        with Bar(BarColumn(20), TextColumn("{task.description}", markup=False), console=console, transient=True) as bar:
            task = bar.add_task("", total=1.0)

            def move(now: Progress) -> None:
                # The run ends on the ground or at its end time, whichever comes first.
                bar.update(task, completed=max(now.time / now.end_time, 1.0 - now.height / height), description=_line(now))

            yield move
    else:
        yield _plain_lines()


def _plain_lines() -> Callable[[Progress], None]:
    last = time.monotonic()

    def write(now: Progress) -> None:
        nonlocal last
        if time.monotonic() - last >= SECONDS_BETWEEN_LINES:
            last = time.monotonic()
            print(_line(now), file=sys.stderr, flush=True)

    return write


def _line(now: Progress) -> str:
    return f"t {now.time:.4f} s  V {now.velocity:6.3f} m/s  H {now.height:.4f} m  {now.steps} steps"
