"""softbrake design."""

from __future__ import annotations

from typing import Annotated

import typer

from softbrake.cli import cases
from softbrake.cli.answer import check_sound
from softbrake.cli.exits import FAILED, INTERRUPTED, compile_for, fail
from softbrake.cli.options import CasePath, Json, Overrides, Quiet

Find = Annotated[str, typer.Option("--find", metavar="PATH", help="Quantity of the case to find.")]
Goal = Annotated[str, typer.Option("--target", metavar="ANSWER=VALUE", help="As impact_velocity=1.5m/s; 0 is a full stop.")]
Range = Annotated[
    str | None,
    typer.Option(
        "--range",
        metavar="LOW:HIGH",
        help="To search; default: a third to three times the case's, of pressure.value that of section 2.2.",
    ),
]
Budget = Annotated[
    float,
    typer.Option("--budget", metavar="SECONDS", min=0.0, help="Most CPU time to choose a level, where a tolerance is set."),
]


def design(
    case_file: CasePath,
    overrides: Overrides = None,
    path: Find = "pressure.value",
    target: Goal = "impact_velocity=0",
    between: Range = None,
    budget: Budget = 60.0,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find the pressure, or another value, that meets a target."""
    import shlex

    opened = cases.read(case_file, overrides)
    case = opened.case

    from softbrake.case.case_file import CaseError
    from softbrake.report.as_json import design_json
    from softbrake.report.console.design import print_design, print_point
    from softbrake.report.console.trials import print_trial
    from softbrake.sim.simulation import Diverged
    from softbrake.studies.inverse_design import NotReached, ask, find, piston

    cases.warn_of_long_steps([case])
    cases.consider([case], opened)
    compile_for([case], quiet)
    try:
        question = ask(opened, path, target, between, budget, None if quiet else print_trial)
        stop = piston(question.case)
        found = find(question, None if quiet else lambda point: print_point(question, point))
    except (CaseError, ValueError) as error:
        fail(error)
    except NotReached as error:
        fail(f"{path}: {error}", FAILED)
    except Diverged as error:  # on every grid tried for the tolerance
        fail(error, FAILED)
    except KeyboardInterrupt:
        fail("interrupted", INTERRUPTED)
    if json:
        typer.echo(design_json(question, stop, found))
    else:
        print_design(question, stop, found)
        options = [
            word
            for change in [*(overrides or ()), f"{path}={found.value / question.size:.6g}{question.shown}"]
            for word in ("--set", change)
        ]
        typer.echo(f"next: {shlex.join(['softbrake', 'run', str(case_file), *options])}")
    if found.missed:
        fail(f"{path}: {found.missed}", FAILED)
    check_sound(case, found.summary)
