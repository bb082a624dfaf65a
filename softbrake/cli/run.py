"""softbrake run."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softbrake.cli import cases
from softbrake.cli.answer import check_scale, check_sound, show
from softbrake.cli.exits import FAILED, INTERRUPTED, compile_for, fail
from softbrake.cli.files import result_file
from softbrake.cli.options import CasePath, Dimensionless, Force, Json, NoResults, Overrides, Quiet

if TYPE_CHECKING:
    from softbrake.case.case import Case

Output = Annotated[
    Path | None, typer.Option("--output", "-o", metavar="FILE", help="Result file; default: CASE's name with .vtkhdf, here.")
]
Tolerance = Annotated[
    str | None,
    typer.Option("--tolerance", metavar="RATIO", help="As 1%: choose fidelity, grid and Courant number for this error."),
]
Budget = Annotated[float, typer.Option("--budget", metavar="SECONDS", min=0.0, help="Most CPU time to spend on a tolerance.")]
WithErrorBar = Annotated[bool, typer.Option("--error-bar", help="Estimate the numerical error from three coarser neighbours.")]
WithSensitivity = Annotated[
    bool, typer.Option("--sensitivity", help="What 1 % of each input of CASE does to the answer; four runs an input or more.")
]


FailOnLimits = Annotated[bool, typer.Option("--fail-on-limits", help="Exit code 1 where the answer misses a limit of CASE.")]


def run(
    case_file: CasePath,
    overrides: Overrides = None,
    json: Json = False,
    output: Output = None,
    no_results: NoResults = False,
    force: Force = False,
    dimensionless: Dimensionless = False,
    tolerance: Tolerance = None,
    budget: Budget = 60.0,
    with_error_bar: WithErrorBar = False,
    with_sensitivity: WithSensitivity = False,
    fail_on_limits: FailOnLimits = False,
    quiet: Quiet = False,
) -> None:
    """Simulate the drop of a case file."""
    from softbrake.case.overrides import Override
    from softbrake.case.yaml_nodes import Place

    if no_results and output is not None:
        fail("--output and --no-results exclude each other")
    changes: list[str | Override] = [*(overrides or ())]
    if tolerance is not None:
        changes.append(Override(f"tolerance={tolerance}", Place((1, len(changes), 0), f"--tolerance {tolerance}")))
    opened = cases.read(case_file, changes)
    case = opened.case
    if fail_on_limits and not case.limits:
        fail(f"--fail-on-limits: {opened.name} has no section limits")
    if with_error_bar and case.insists:
        fail("--error-bar: a run for a tolerance has one already")
    results = result_file(case_file, case, output, no_results=no_results, force=force)

    from softbrake.report.console.progress import progress, runs_progress
    from softbrake.report.console.trials import print_trial
    from softbrake.sim.result_file import tension_scale
    from softbrake.studies.error_control import run as answer
    from softbrake.studies.sensitivity import with_sensitivities

    scale = tension_scale(case) if dimensionless else None
    check_scale(scale)
    cases.warn_of_long_steps([case])
    cases.warn_of_grid(case)
    cases.consider([case], opened, results=results is not None)
    if case.insists and not quiet:
        typer.echo("tolerance: fidelity, grid and Courant number are chosen, those of the case set aside", err=True)
    compile_for([case], quiet)
    told = None if quiet else print_trial
    with _failures(case, json, scale):
        with progress(case.shell.height, quiet=quiet) as callback:
            summary = answer(case, results, callback, budget=budget, report=told, with_error_bar=with_error_bar)
        if with_sensitivity and summary.outcome != "interrupted":
            with runs_progress(quiet=quiet) as count:
                summary = with_sensitivities(opened, summary, results, count)
    show(summary, json, scale, case.limits)
    if summary.outcome == "interrupted":
        if summary.results_fault is not None:
            typer.echo(summary.results_fault, err=True)
        raise typer.Exit(INTERRUPTED)
    check_sound(case, summary, limits=fail_on_limits)


@contextmanager
def _failures(case: Case, json: bool, scale: float | None) -> Iterator[None]:
    """Exit with the cause where a run fails; of one that diverged, what was computed is shown with --json."""
    from softbrake.sim.result_file import ResultError
    from softbrake.sim.simulation import Diverged, NotInflated

    try:
        yield
    except Diverged as error:
        if json:
            show(error.summary, json, scale, case.limits)
        fail("\n".join(filter(None, (str(error), error.summary.results_fault))), FAILED)
    except (NotInflated, ResultError) as error:  # also: disk full, folder gone
        fail(error, FAILED)
    except ValueError as error:
        fail(error)
    except KeyboardInterrupt:  # before the first step, or after the last, when the result file is whole
        fail("interrupted", INTERRUPTED)
