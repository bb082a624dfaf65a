"""The search for a value that meets a target."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from rich.console import Console

from softbrake.report.console.summary import print_summary
from softbrake.report.console.tables import plain, quantities
from softbrake.sim.summary import Summary

if TYPE_CHECKING:
    from softbrake.case.full_stop import FullStop
    from softbrake.studies.inverse_design import DesignAnswer, DesignPoint, Question


def print_point(question: Question, point: DesignPoint) -> None:
    """One value of a search as soon as it is tried, on stderr."""
    unit = f" {question.unit}".rstrip()
    print(f"{question.path} {point.value:.6g}{unit}: {point.in_words(question.target)}", file=sys.stderr, flush=True)


def print_design(
    question: Question, stop: tuple[FullStop, list[tuple[float, Summary]]], found: DesignAnswer, console: Console | None = None
) -> None:
    """Print section 2.2, the value found by the model with its error, and the answer there, in at most 80 columns."""
    from softbrake.studies.inverse_design import answer

    console = console or plain()
    energy, tried = stop
    goal, unit = question.target, f" {question.unit}".rstrip()
    table = quantities()
    table.add_row("energy of the cargo", f"{energy.energy:.1f}", "J", "m g l1 + m V²/2")
    table.add_row("mean pressure", f"{energy.mean:.1f}", "Pa", "full stop over the shell's height")
    table.add_row("largest, of a sine", f"{energy.largest:.1f}", "Pa", "pi/2 of the mean")
    table.add_row("end of a sine", f"{energy.end_time:.5f}", "s", "")
    for when, summary in tried:
        table.add_row("  with its peak at", f"{when:.5f}", "s", answer(summary, goal))
    console.print("By section 2.2, for a piston of the cover's area", style="bold")
    console.print(table)
    console.print()
    console.print(f"By the model, for {goal}", style="bold")
    table = quantities()
    width = "no error bar" if found.error is None else f"± {found.error:.2g}{unit}"
    table.add_row(question.path, f"{found.value:.6g}", question.unit, f"{width}: {found.basis}")
    console.print(table)
    if found.others:
        console.print(f"The answer crosses the target at {found.others + 1} values in the range; this is the lowest.")
    console.print()
    print_summary(found.summary, console=console)
