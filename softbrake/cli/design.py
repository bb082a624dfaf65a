"""softbrake design."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from softbrake.cli import cases
from softbrake.cli.answer import check_sound
from softbrake.cli.exits import FAILED, INTERRUPTED, compile_for, fail
from softbrake.cli.options import CasePath, Json, Overrides, Quiet

if TYPE_CHECKING:
    from softbrake.case.case_file import CaseFile
    from softbrake.sim.summary import Summary

    Found = tuple[list[str], str, Summary]  # overrides of the design found, what a check there misses, and its answer

Find = Annotated[
    list[str] | None,
    typer.Option("--find", metavar="PATH", help="Quantity to find; default: pressure.value or gas.pressure. Repeatable."),
]
Goal = Annotated[
    list[str] | None,
    typer.Option(
        "--target",
        metavar="ANSWER=VALUE",
        help="As impact_velocity=1.5m/s; 0, the default, is a full stop. Or a bound, as 'peak_deceleration<=8g'; repeatable.",
    ),
]
Range = Annotated[
    list[str] | None,
    typer.Option(
        "--range",
        metavar="[PATH=]LOW:HIGH",
        help="To search; PATH where there are several; default: a third to three times the case's, "
        "of pressure.value that of section 2.2. Repeatable.",
    ),
]
Budget = Annotated[
    float,
    typer.Option("--budget", metavar="SECONDS", min=0.0, help="Most CPU time to choose a level, where a tolerance is set."),
]


def design(
    case_file: CasePath,
    overrides: Overrides = None,
    paths: Find = None,
    targets: Goal = None,
    ranges: Range = None,
    budget: Budget = 60.0,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find the pressure, or other values, that meet a target, or several bounds."""
    import shlex

    opened = cases.read(case_file, overrides)
    case = opened.case

    cases.warn_of_long_steps([case])
    cases.consider([case], opened)
    compile_for([case], quiet)
    paths = paths or ["pressure.value" if case.gas is None else "gas.pressure"]
    targets = targets or ["impact_velocity=0"]
    single = len(paths) == len(targets) == 1 and "<=" not in targets[0]
    search = _meet_target if single else _meet_bounds
    changes, missed, summary = search(opened, paths, targets, ranges or [], budget, json, quiet)
    if not json:
        options = [word for change in [*(overrides or ()), *changes] for word in ("--set", change)]
        typer.echo(f"next: {shlex.join(['softbrake', 'run', str(case_file), *options])}")
    if missed:
        fail(f"{', '.join(paths)}: {missed}", FAILED)
    check_sound(case, summary)


def _meet_target(
    opened: CaseFile, paths: list[str], targets: list[str], ranges: list[str], budget: float, json: bool, quiet: bool
) -> Found:
    """Find a value that brings an answer to its target, and print it."""
    from softbrake.report.as_json import design_json
    from softbrake.report.console.design import print_design, print_point
    from softbrake.report.console.trials import print_trial
    from softbrake.studies.design_space import ranges_of
    from softbrake.studies.inverse_design import ask, find, piston

    with _failing(paths):
        between = ranges_of(paths, ranges).get(paths[0])
        question = ask(opened, paths[0], targets[0], between, budget, None if quiet else print_trial)
        stop = None if opened.case.gas is not None else piston(question.case)
        found = find(question, None if quiet else lambda point: print_point(question, point))
    if json:
        typer.echo(design_json(question, stop, found))
    else:
        print_design(question, stop, found)
    return [question.override(found.value)], found.missed, found.summary


def _meet_bounds(
    opened: CaseFile, paths: list[str], targets: list[str], ranges: list[str], budget: float, json: bool, quiet: bool
) -> Found:
    """Find the design that meets bounds by the largest margin, and print it."""
    from softbrake.report.as_json import feasible_json
    from softbrake.report.console.design import none_meets, print_feasible, print_tried
    from softbrake.report.console.trials import print_trial
    from softbrake.studies.feasible_design import pose, solve

    with _failing(paths):
        problem = pose(opened, paths, targets, ranges, budget, None if quiet else print_trial)
        found = solve(problem, None if quiet else lambda one: print_tried(problem, one))
    if json:
        typer.echo(feasible_json(problem, found))
    if not found.best.meets:
        fail(f"{', '.join(paths)}: {none_meets(problem, found)}", FAILED)
    if not json:
        print_feasible(problem, found)
    values = zip(problem.variables, found.best.values, strict=True)
    return [each.override(value) for each, value in values], found.missed, found.summary


@contextmanager
def _failing(paths: list[str]) -> Iterator[None]:
    """End the command where there is no question, or no answer."""
    from softbrake.case.case_file import CaseError
    from softbrake.sim.simulation import Diverged, NotInflated
    from softbrake.studies.inverse_design import NotReached

    try:
        yield
    except (CaseError, ValueError) as error:
        fail(error)
    except NotReached as error:
        fail(f"{', '.join(paths)}: {error}", FAILED)
    except (Diverged, NotInflated) as error:  # on every grid tried for the tolerance
        fail(error, FAILED)
    except KeyboardInterrupt:
        fail("interrupted", INTERRUPTED)
