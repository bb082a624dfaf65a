"""softbrake chart."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softbrake.cli import cases
from softbrake.cli.exits import FAILED, INTERRUPTED, compile_for, fail
from softbrake.cli.files import check_place, drawing, stem, writing
from softbrake.cli.options import CasePath, Overrides, Quiet


def chart(
    case_file: CasePath,
    overrides: Overrides = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="PICTURE", help="PNG, SVG or PDF; default: CASE's name with -chart.png, here."),
    ] = None,
    budget: Annotated[float, typer.Option("--budget", metavar="SECONDS", min=0.0, help="Most time, compiling apart.")] = 120.0,
    quiet: Quiet = False,
) -> None:
    """Chart error against time of all fidelities, grids and steps, and recommend one: a picture and a CSV file of its name."""
    import shlex

    case = cases.load(case_file, overrides)
    picture = output or Path(f"{stem(case_file)}-chart.png")
    table = picture.with_suffix(".csv")
    for file in (picture, table):
        check_place(file)

    from softbrake.report.console.progress import chart_progress
    from softbrake.report.console.work_precision import print_work_precision
    from softbrake.report.plots.style import PlotError, check_picture
    from softbrake.report.plots.work_precision import draw_work_precision
    from softbrake.sim.simulation import Diverged
    from softbrake.studies.work_precision import plan, work_precision, write_csv

    try:
        check_picture(picture)
    except PlotError as error:
        fail(error)
    compile_for((setting.apply(case) for setting in plan(case)), quiet)
    try:
        with chart_progress(quiet=quiet) as callback:
            found = work_precision(case, budget, callback)
    except (Diverged, ValueError) as error:
        fail(error, FAILED)
    if found.reference is None:
        fail("interrupted before there was a reference; nothing is written", INTERRUPTED)
    sets = "".join(f" --set {shlex.quote(text)}" for text in overrides or ())
    print_work_precision(found, f"softbrake run {shlex.quote(str(case_file))}{sets}")
    with writing(table):
        write_csv(found, table)
    with drawing(picture):
        draw_work_precision(found, picture)
    typer.echo(f"\n{picture}, {table} written")
    if found.interrupted:
        fail("interrupted", INTERRUPTED)
