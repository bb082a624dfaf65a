"""softbrake inflate."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softbrake.cli import cases
from softbrake.cli.exits import FAILED, INTERRUPTED, compile_for, fail
from softbrake.cli.files import result_file
from softbrake.cli.options import CasePath, Force, Json, NoResults, Overrides


def inflate(
    case_file: CasePath,
    overrides: Overrides = None,
    json: Json = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Result file; default: CASE's name with -inflated.vtkhdf, here."),
    ] = None,
    no_results: NoResults = False,
    force: Force = False,
    residual: Annotated[
        float,
        typer.Option(
            "--residual", metavar="RATIO", min=1e-12, max=0.1, help="Of the forces out of balance over those of the gas."
        ),
    ] = 1e-6,
) -> None:
    """Inflate the shell under its cover, held: shape, tensions, force on the cover."""
    if no_results and output is not None:
        fail("--output and --no-results exclude each other")
    opened = cases.read(case_file, overrides)
    case = opened.case
    if case.insists:
        typer.echo(cases.SET_ASIDE, err=True)
    results = result_file(case_file, case, output, no_results=no_results, force=force, ending="-inflated.vtkhdf")
    cases.refuse_too_large([case], results=results is not None)

    from softbrake.report.as_json import inflation_json
    from softbrake.report.console.inflation import print_inflation
    from softbrake.sim.inflate import inflate as at_rest
    from softbrake.sim.simulation import NotInflated

    if case.model.fidelity != "lumped":
        compile_for([cases.at_fidelity(case, "axisymmetric")], quiet=False)
    try:
        answer = at_rest(case, results, residual)
    except ValueError as error:
        fail(f"{opened.name}: {error}")
    except NotInflated as error:
        fail(error, FAILED)
    except KeyboardInterrupt:
        fail("interrupted", INTERRUPTED)
    if json:
        typer.echo(inflation_json(answer))
    else:
        print_inflation(answer)
    if answer.results_fault is not None:
        fail(answer.results_fault, FAILED)
