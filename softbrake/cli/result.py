"""softbrake info, plot, export and report: what is in a result."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softbrake.cli.answer import check_scale, show
from softbrake.cli.exits import fail
from softbrake.cli.files import check_place, writing
from softbrake.cli.options import Dimensionless, Json, ResultPath


def info(result: ResultPath, json: Json = False, dimensionless: Dimensionless = False) -> None:
    """Print the summary of a result file again."""
    from softbrake.case.sections.limits import limits_of
    from softbrake.report import as_json
    from softbrake.report.console.inflation import print_inflation
    from softbrake.report.console.summary import print_unfinished
    from softbrake.sim.result_file import ResultError, read_case, read_history, read_inflation, read_summary, read_tension_scale

    try:
        inflation = read_inflation(result)
        summary = read_summary(result)
        scale = read_tension_scale(result) if dimensionless else None
        history = read_history(result)
    except ResultError as error:
        fail(error)
    if inflation is not None:
        typer.echo(as_json.inflation_json(inflation)) if json else print_inflation(inflation)
    elif summary is not None:
        check_scale(scale)
        show(summary, json, scale, limits_of(read_case(result).get("limits", {})))
    else:
        row = {name: float(history[name][-1]) for name in history.dtype.names or () if len(history)}
        if json:
            typer.echo(as_json.row_json(row))
        else:
            print_unfinished(row)


def plot(
    result: ResultPath,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="PICTURE", help="PNG, SVG or PDF; default: RESULT with .png.")
    ] = None,
    dimensionless: Dimensionless = False,
) -> None:
    """Draw the curves and the deformed profiles of a result file."""
    from softbrake.report.plots.drop import plot_result
    from softbrake.report.plots.style import PlotError
    from softbrake.sim.result_file import ResultError

    picture = output or _beside(result, ".png")
    check_place(picture)
    try:
        with writing(picture):
            plot_result(result, picture, dimensionless)
    except (PlotError, ResultError) as error:
        fail(error)
    typer.echo(f"{picture} written")


def export(
    result: ResultPath,
    form: Annotated[
        str,
        typer.Option(
            "--format",
            metavar="FORMAT",
            help="csv: the history, a row a recorded step. xdmf: a sidecar for ParaView before 5.12, which points into RESULT. "
            "iso-mme, uff: what a test measures, at 10 kHz, for test data software.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="PATH", help="Default: RESULT with .csv, .xdmf or .uff; folder RESULT-iso-mme."),
    ] = None,
) -> None:
    """Write what is in a result file for other programs."""
    from softbrake.report.curves_csv import write_curves
    from softbrake.report.test_files import write_iso_mme, write_uff
    from softbrake.report.xdmf import write_xdmf
    from softbrake.signals import SignalError
    from softbrake.sim.result_file import ResultError, read_inflation

    forms = {
        "csv": (write_curves, ".csv"),
        "xdmf": (write_xdmf, ".xdmf"),
        "iso-mme": (write_iso_mme, "-iso-mme"),
        "uff": (write_uff, ".uff"),
    }
    if form not in forms:
        fail(f"--format {form}: csv, xdmf, iso-mme or uff is expected")
    write, ending = forms[form]
    file = output or _beside(result, ending)
    if form in ("xdmf", "uff") and file.suffix != ending:
        reader = "the name of the sidecar ends in .xdmf, for ParaView to know it" if form == "xdmf" else "the name ends in .uff"
        fail(f"{file}: {reader}")
    if file.resolve() == result.resolve():
        fail(f"{file}: is the result; --output must name another file")
    if form == "iso-mme" and file.exists():
        fail(f"{file}: is there already; --output must name a new folder")
    check_place(file)
    try:
        if form != "xdmf" and read_inflation(result) is not None:
            fail(f"{result}: an inflated shell has no history; softbrake info and report show it")
        with writing(file):
            write(result, file)
    except (ResultError, SignalError) as error:
        fail(error)
    typer.echo(f"{file} written" + (f"; it needs {result} at its place" if form == "xdmf" else ""))


def report(
    result: Annotated[Path, typer.Argument(metavar="RESULT", help="Result file of a run (*.vtkhdf), or folder of a sweep.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="PAGE", help="HTML file; default: RESULT with .html.")
    ] = None,
) -> None:
    """Write all about a result or a sweep as one HTML page."""
    from softbrake.report.html.write import write_report
    from softbrake.report.plots.style import PlotError
    from softbrake.sim.result_file import ResultError

    page = output or _beside(result, ".html")
    if page.suffix != ".html":
        fail(f"{page}: the name of a page ends in .html")
    if page.resolve() == result.resolve():
        fail(f"{page}: is the result; --output must name another file")
    check_place(page)
    try:
        with writing(page):
            write_report(result, page)
    except (PlotError, ResultError) as error:
        fail(error)
    typer.echo(f"{page} written")


def _beside(result: Path, suffix: str) -> Path:
    """Name of a file beside a result or a folder; dots in the name of a folder end nothing."""
    named = result if result.name not in ("", "..") else result.resolve()
    return named.parent / f"{named.stem if named.suffix == '.vtkhdf' else named.name}{suffix}"
