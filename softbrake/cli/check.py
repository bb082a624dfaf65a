"""softbrake check, schema and init: about a case file, without running it. They load nothing slow."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softbrake.cli import cases
from softbrake.cli.exits import fail
from softbrake.cli.files import check_place, writing
from softbrake.cli.options import CasePath, Overrides


def check(case_file: CasePath, overrides: Overrides = None) -> None:
    """Check a case file and print what it means, without running it."""
    from softbrake.report.case_lines import case_lines

    opened = cases.read(case_file, overrides)
    case, designs = opened.case, cases.designs(opened)
    typer.echo(f"{opened.name}: OK\n  {case.title}")
    for name, said in case_lines(opened, designs):
        if said:
            typer.echo(f"  {name:19} {said}")
    cases.warn_of_grid(case)
    cases.consider([case, *(design.case for design in designs.all if designs.axes)], opened, results=not designs.axes)


def schema() -> None:
    """Print the JSON Schema of case files, for editors."""
    import json

    from softbrake.case.schema import schema as of_cases

    typer.echo(json.dumps(of_cases(), indent=2))


def init(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File to write; - for stdout.")] = Path("case.yaml"),
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
) -> None:
    """Write a commented starter case."""
    from softbrake.case.schema import starter
    from softbrake.sim.files import write_text

    if str(file) == "-":
        typer.echo(starter(), nl=False)
        return
    check_place(file)
    if file.exists() and not force:
        fail(f"{file}: exists already; --force replaces it")
    with writing(file):
        write_text(file, starter())
    typer.echo(f"{file} written; next: softbrake run {file}")
