"""softbrake compare."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from softbrake.cli.exits import fail
from softbrake.cli.files import check_place, writing
from softbrake.cli.options import Json, ResultPath

if TYPE_CHECKING:
    from softbrake.signals.channel import Channel
    from softbrake.studies.comparison import Comparison

TestPath = Annotated[Path, typer.Argument(metavar="TEST", help="Of a drop test: CSV, ISO-MME (.mme), UFF 58 or TDMS.")]
Channels = Annotated[
    list[str] | None,
    typer.Option("--channel", metavar="NAME", help="Name or code; default: the only one of each quantity. Repeatable."),
]
Units = Annotated[list[str] | None, typer.Option("--unit", metavar="NAME=UNIT", help="Of a channel, or of the time. Repeatable.")]
Turned = Annotated[
    list[str] | None,
    typer.Option("--invert", metavar="NAME", help="Channel with the other sign: here up is positive. Repeatable."),
]
TimeName = Annotated[str | None, typer.Option("--time", metavar="NAME", help="Column of the time; default: the first.")]
Class = Annotated[
    str | None, typer.Option("--cfc", metavar="CLASS", help="SAE J211 class for test and drop, or none; default: the case's.")
]
Gravity = Annotated[
    str | None, typer.Option("--gravity", metavar="in|out", help="Whether the test's accelerometer at rest reads 1 g or 0.")
]
Pressure = Annotated[str | None, typer.Option("--pressure", metavar="gauge|absolute", help="What the test's pressures are.")]
Shift = Annotated[
    str | None, typer.Option("--shift", metavar="TIME", help="Added to the test's times; default: found by least squares.")
]
Interval = Annotated[
    str | None, typer.Option("--interval", metavar="FROM:TO", help="To compare, by the drop's times; default: all they share.")
]


def compare(
    result: ResultPath,
    test: TestPath,
    channels: Channels = None,
    units: Units = None,
    time: TimeName = None,
    turned: Turned = None,
    gravity: Gravity = None,
    pressure: Pressure = None,
    cfc: Class = None,
    shift: Shift = None,
    interval: Interval = None,
    output: Annotated[
        list[Path] | None,
        typer.Option("--output", "-o", metavar="FILE", help="Overlay (PNG, SVG, PDF), or the report with it (HTML). Repeatable."),
    ] = None,
    json: Json = False,
) -> None:
    """Lay a drop test beside a result: peaks, differences and the rating of ISO/TS 18571."""
    from softbrake.report.as_json import comparison_json
    from softbrake.report.console.comparison import print_comparison
    from softbrake.report.plots.style import PlotError, check_picture
    from softbrake.sim.result_file import ResultError, read_case, read_history, read_inflation
    from softbrake.studies.comparison import compare as laid_beside

    for file in output or ():
        check_place(file)
        try:
            check_picture(file.with_suffix(".png") if file.suffix == ".html" else file)
        except PlotError as error:
            fail(error)
    try:
        if read_inflation(result) is not None:
            fail(f"{result}: an inflated shell has no history to compare")
        case, history = read_case(result), read_history(result)
    except ResultError as error:
        fail(error)
    found = read_test(test, case, channels, units, time, turned, gravity, pressure)
    added = case["gravity"] if gravity == "in" else 0.0
    try:
        comparison = laid_beside(
            history,
            found,
            cfc=read_class(cfc, case),
            added=added,
            shift=read_time("--shift", shift),
            interval=read_interval(interval),
        )
    except ValueError as error:
        fail(f"{result} beside {test}: {error}")
    if json:
        typer.echo(comparison_json(comparison))
    else:
        print_comparison(comparison)
    for name in comparison.opposed:
        typer.echo(f"{test}: '{name}' comes nearer to the drop with the other sign; --invert '{name}' turns it", err=True)
    for file in output or ():
        _write(result, comparison, file)


def read_test(
    test: Path,
    case: dict[str, Any],
    names: list[str] | None,
    units: list[str] | None,
    time: str | None,
    turned: list[str] | None,
    gravity: str | None,
    pressure: str | None,
) -> list[Channel]:
    """Return the channels of a test that a drop has too, in its terms; end the command where they are not clear."""
    from softbrake.signals import read_channels
    from softbrake.signals.channel import SignalError
    from softbrake.signals.choice import chosen, in_terms_of_drop, unknown_units

    pairs = [unit.partition("=") for unit in units or ()]
    for name, equals, unit in pairs:
        if not (name and equals and unit):
            fail(f"--unit {name}{equals}{unit}: NAME=UNIT is expected, as 'acc z=g'")
    try:
        there = read_channels(test, units={name: unit for name, _, unit in pairs}, time=time)
        found = chosen(there, names or (), str(test))
    except (SignalError, OSError) as error:
        fail(error if isinstance(error, SignalError) else f"{test}: cannot be read: {error.strerror or error}")
    for channel in () if names else unknown_units(there):
        unit = f"in '{channel.unit}'" if channel.unit else "without a unit"
        typer.echo(f"{test}: '{channel.name}' is {unit}, and not compared; --unit '{channel.name}=g' gives it one", err=True)
    known = {name for channel in found for name in (channel.name, channel.code)}
    if strange := [name for name in turned or () if name not in known]:
        fail(f"--invert {strange[0]}: is not compared; {', '.join(repr(channel.name) for channel in found)} are")
    _asked("--gravity", gravity, ("in", "out"), test, found, "deceleration")
    _asked("--pressure", pressure, ("gauge", "absolute"), test, found, "pressure")
    ambient = case["ambient"]["pressure"] if pressure == "absolute" else 0.0
    return in_terms_of_drop(found, turned=turned or (), ambient=ambient)


def _asked(option: str, given: str | None, allowed: tuple[str, str], test: Path, channels: list[Channel], quantity: str) -> None:
    """End the command where what nobody can see in a record is not said."""
    expected = f"{option} {allowed[0]} or {option} {allowed[1]} is expected"
    if given is not None and given not in allowed:
        fail(f"{option} {given}: {expected}")
    if given is None and (names := [channel.name for channel in channels if channel.quantity == quantity]):
        fail(f"{test}: '{names[0]}' is a {quantity}: {expected}")


def read_class(text: str | None, case: dict[str, Any]) -> int | None:
    """The class asked for, None for none; without one that of the case."""
    from softbrake.case.sections.output import CFC, CFC_DEFAULT

    if text is None:
        return int(case["output"].get("cfc", CFC_DEFAULT))
    if text == "none":
        return None
    if text not in map(str, CFC):
        fail(f"--cfc {text}: {', '.join(map(str, CFC))} or none is expected")
    return int(text)


def read_time(option: str, text: str | None) -> float | None:
    """A time with its unit, s."""
    from softbrake.case.units import Dimension, parse_quantity

    if text is None:
        return None
    try:
        return parse_quantity(text, Dimension.TIME)
    except ValueError as error:
        fail(f"{option} {text}: {error}; a time such as 12ms is expected")


def read_interval(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    start, colon, stop = text.partition(":")
    first, last = read_time("--interval", start), read_time("--interval", stop or None)
    if not colon or first is None or last is None or last <= first:
        fail(f"--interval {text}: FROM:TO is expected, as 20ms:120ms")
    return first, last


def _write(result: Path, comparison: Comparison, file: Path) -> None:
    from softbrake.report.html.write import write_report
    from softbrake.report.plots.comparison import draw_comparison
    from softbrake.report.plots.style import PlotError
    from softbrake.sim.result_file import ResultError

    try:
        with writing(file):
            if file.suffix == ".html":
                write_report(result, file, comparison)
            else:
                draw_comparison(comparison, file)
    except (PlotError, ResultError) as error:
        fail(error)
    typer.echo(f"{file} written", err=True)
