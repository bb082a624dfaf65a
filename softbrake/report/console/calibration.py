"""Inputs fitted to tests."""

from __future__ import annotations

from rich.console import Console

from softbrake.case.units import unit_size
from softbrake.report.console.tables import Column, plain, print_columns
from softbrake.report.words import fitted_in_words, fitted_value
from softbrake.signals.channel import QUANTITIES
from softbrake.studies.calibration import Calibration, FittedChannel

INPUTS = (Column("input", False), Column("value"), Column("", False), Column("interval", False, True), Column("coarser\ngrid"))
CHANNELS = (
    Column("test", False, True),
    Column("channel", False, True),
    Column("misfit"),
    Column("model's\nscatter"),
    Column("", False),
    Column("samples"),
    Column("correlation"),
)


def print_calibration(found: Calibration, console: Console | None = None) -> None:
    """Print values with intervals, correlations, and what is left between tests and drop, in at most 80 columns."""
    console = console or plain()
    console.print("Fitted by least squares", style="bold")
    rows = []
    for each in found.inputs:
        variable = each.variable
        grid = "–" if each.grid is None else f"± {each.grid / variable.size:.2g}"
        rows.append([variable.path, fitted_value(each), variable.shown, fitted_in_words(each), grid])
    print_columns(console, INPUTS, rows)
    known = [k for k, each in enumerate(found.inputs) if each.interval is not None]
    if len(known) > 1:
        paths = [found.inputs[k].variable.path for k in known]
        console.print("\nCorrelations", style="bold")
        lines = [[paths[at], *(f"{found.correlations[k, m]:+.2f}" for m in known)] for at, k in enumerate(known)]
        print_columns(console, [Column(right=False), *(Column(path.replace(".", ".\n")) for path in paths)], lines)
    console.print("\nTests less drop, root mean squares", style="bold")
    print_columns(console, CHANNELS, [_channel(each) for each in found.channels])
    shifts = zip(dict.fromkeys(each.test for each in found.channels), found.shifts, strict=True)
    console.print()
    for test, shift in shifts:
        console.print(f"Times of {test} are shifted by {shift * 1e3:.4g} ms.", soft_wrap=True)
    ended = (
        f"{found.agreeing} of the best {found.refined} of {found.starts} starts ended there" if found.refined > 1 else "one start"
    )
    console.print(f"{found.drops} drops; {ended}.")
    for fault, count in found.faults.items():
        console.print(f"{count} drops had no answer: {fault}", soft_wrap=True)
    for values in found.rivals:
        pairs = zip(found.inputs, values, strict=True)
        there = ", ".join(f"{one.variable.path} {one.variable.in_unit(value, '.4g')}" for one, value in pairs)
        console.print(f"As near to the tests as noise and the model's scatter tell: {there}.", soft_wrap=True)


def _channel(each: FittedChannel) -> list[str]:
    size = unit_size(each.unit, QUANTITIES[each.quantity])
    numbers = [
        f"{each.misfit / size:.3g}",
        f"{each.scatter / size:.2g}",
        each.unit,
        str(len(each.time)),
        f"{each.correlation:.2f}",
    ]
    return [each.test, each.name, *numbers]
