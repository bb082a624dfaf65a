"""softbrake check, schema and init: about a case file, without running it. They load nothing slow."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softbrake.case.case_file import name_of
from softbrake.cli import cases
from softbrake.cli.exits import fail
from softbrake.cli.files import check_place, writing
from softbrake.cli.options import CasePath, Overrides


def check(case_file: CasePath, overrides: Overrides = None) -> None:
    """Check a case file and print what it means, without running it."""
    from softbrake.sim.summary import contact_in_words, fabric_in_words

    opened = cases.read(case_file, overrides)
    case, designs = opened.case, cases.designs(opened)
    cloth = case.fabric
    chosen = f"chosen for an error of {case.tolerance:.2g}" if case.tolerance is not None else ""
    cells = chosen or f"{case.grid.generatrix} x {case.grid.hoop} cells (generatrix x hoop)"
    heights = ", ".join(f"{belt.height:.4g}" for belt in case.belts)
    free_fall = (case.cargo.velocity**2 + 2 * case.gravity * case.shell.height) ** 0.5
    pressure = case.pressure
    last = f"  pressure            {pressure.values[-1]:.4g} Pa from {pressure.times[-1]:.4g} s on\n" if pressure.times else ""
    idle = f"  without effect      {', '.join(case.without_contact)}\n" if case.without_contact else ""
    typer.echo(
        f"{name_of(case_file)}: OK\n"
        f"  {case.title}\n"
        f"  grid                {cells}, {case.model.scheme} scheme\n"
        f"  fidelity            {case.model.fidelity}\n"
        f"  belts               {len(case.belts)}{f' at {heights} m' if heights else ''}\n"
        f"  contact             {contact_in_words(case.model.fidelity, case.contact)}\n"
        f"{idle}"
        f"{last}"
        f"  fabric              {fabric_in_words(cloth.law, cloth.slack, cloth.G12, cloth.E11, cloth.E22)}\n"
        f"  viscosity           {case.fabric.viscosity:.4g} N*s/m\n"
        f"  free-fall velocity  {free_fall:.5f} m/s"
    )
    cases.warn_of_grid(case)
    if designs.axes:
        typer.echo(f"  sweep               {len(designs.all)} runs over {', '.join(axis.path for axis in designs.axes)}")


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
