"""softbrake stability."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softbrake.cli import cases
from softbrake.cli.exits import FAILED, INTERRUPTED, compile_for, fail
from softbrake.cli.files import check_place, drawing, stem, writing
from softbrake.cli.options import CasePath, Overrides

if TYPE_CHECKING:
    from softbrake.case.case import Case
    from softbrake.case.case_file import CaseFile
    from softbrake.studies.stability_map import Axis, MapPoint


def stability(
    case_file: CasePath,
    overrides: Overrides = None,
    over: Annotated[
        list[str] | None,
        typer.Option("--over", metavar="PATH=A,B,...", help="Axis of a map, as fabric.viscosity=0,0.2,2. Repeatable."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="PICTURE", help="Map as PNG, SVG or PDF; its points beside it as CSV."),
    ] = None,
) -> None:
    """Find the longest stable step by trial, beside the predicted one; map it over keys of the case."""
    opened = cases.read(case_file, overrides)

    from softbrake.studies.stability_map import edge_in_words, find_limit, read_axes, write_csv

    try:
        axes = read_axes(over or ())
    except ValueError as error:
        fail(error)
    if output is not None and not axes:
        fail("--output: a map needs at least one axis, --over")
    picture = output or Path(f"{stem(case_file)}-stability.png")
    table = picture.with_suffix(".csv")
    if axes:
        _check_files(picture, table)
    case = cases.at_fidelity(opened.case, "full")
    each = [case, *_cases_along(opened, axes)]
    if any(one.model.fidelity == "lumped" for one in each):
        fail(f"{opened.name}: a case of fidelity lumped has no grid whose waves could grow; --set model.fidelity=full")
    if case.insists:
        typer.echo(cases.SET_ASIDE, err=True)
    cases.refuse_too_large(each, results=False)
    compile_for(each, quiet=False)
    points: list[MapPoint] = []
    try:
        if axes:
            _survey(opened, axes, points)
        own = find_limit(case)
    except KeyboardInterrupt:
        if points:
            with writing(table):
                write_csv(points, axes, table)
        fail(f"interrupted{f'; {len(points)} points in {table}' if points else ''}", INTERRUPTED)
    if own.edge_found:
        typer.echo(edge_in_words(own))
    if axes:
        from softbrake.report.plots.stability_map import draw_map

        with writing(table):
            write_csv(points, axes, table)
        with drawing(picture):
            draw_map(points, axes, picture)
        typer.echo(f"{picture} and {table} written")
    if not own.edge_found:
        fail(f"{opened.name}: {edge_in_words(own)}", FAILED)


def _check_files(picture: Path, table: Path) -> None:
    """Say before the first trial what would fail after the last."""
    from softbrake.report.plots.style import PlotError, check_picture

    try:
        check_picture(picture)
    except PlotError as error:
        fail(error)
    for file in (picture, table):
        check_place(file)


def _cases_along(file: CaseFile, axes: Sequence[Axis]) -> list[Case]:
    """Return the case with each value of each axis alone, so that faults are said before the first trial."""
    found: list[Case] = []
    for path, values in axes:
        along: list[Case] = []
        for value in values:
            one = cases.changed(file, [f"{path}={value}"])
            if one in along:
                fail(f"--over {path}: the value {value} is there twice, the first time as {values[along.index(one)]}")
            along.append(one)
        found += along
    return [cases.at_fidelity(one, "full") for one in found]


def _survey(file: CaseFile, axes: Sequence[Axis], points: list[MapPoint]) -> None:
    """Find the limits of the map, print each and append it to the points as soon as it is found."""
    from softbrake.report.console.stability import print_head, print_point
    from softbrake.studies.stability_map import survey

    def at(values: Sequence[str]) -> Case:
        return cases.at_fidelity(cases.changed(file, values), "full")

    def report(point: MapPoint) -> None:
        points.append(point)
        print_point(point)

    print_head(axes)
    survey(at, axes, report)
