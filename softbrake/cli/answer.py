"""The answer of a drop, printed and judged."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from softbrake.cli.exits import FAILED, fail

if TYPE_CHECKING:
    from collections.abc import Iterable

    from softbrake.case.case import Case
    from softbrake.case.sections.limits import Limit
    from softbrake.sim.summary import Summary


def check_scale(tension_scale: float | None) -> None:
    """Refuse dimensionless tensions where there is no pressure."""
    if tension_scale == 0.0:
        fail("--dimensionless: the case has no pressure, and so no scale for tensions")


def show(summary: Summary, json: bool, tension_scale: float | None, limits: Iterable[Limit]) -> None:
    """Print the answer and how it keeps the limits of its case, for people or as JSON."""
    from softbrake.sim.limits import judge

    verdicts = judge(limits, summary)
    if json:
        from softbrake.report.as_json import summary_json

        typer.echo(summary_json(summary, tension_scale, verdicts))
    else:
        from softbrake.report.console.summary import print_summary

        print_summary(summary, tension_scale, verdicts=verdicts)


def check_sound(case: Case, summary: Summary, *, limits: bool = False) -> None:
    """Exit code 1 where a run made energy of nothing, missed the tolerance asked for, or could not be kept in its file.

    limits: also where it misses a limit of its case.
    """
    from softbrake.report.words import missed_in_words
    from softbrake.sim.limits import judge
    from softbrake.studies.error_control import reached

    faults = [summary.results_fault] if summary.results_fault is not None else []
    if summary.doubt is not None and summary.outcome != "diverged":
        faults.append(f"{summary.doubt}; try fabric.law=tension_field, or a smaller time.courant; docs/explanation/stability.md")
    if not reached(case, summary):
        faults.append(f"the tolerance of {case.tolerance:.3g} was not reached: {summary.fidelity_reason}")
    if limits and (missed := missed_in_words(judge(case.limits, summary))):
        faults.append(missed)
    if faults:
        fail("\n".join(faults), FAILED)
