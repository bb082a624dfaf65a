"""The search for a value that meets a target."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from rich.console import Console

from softbrake.report.console.summary import print_summary
from softbrake.report.console.tables import plain, print_quantities
from softbrake.sim.summary import Summary

if TYPE_CHECKING:
    from softbrake.case.full_stop import FullStop
    from softbrake.studies.inverse_design import DesignAnswer, DesignPoint, Question


def print_point(question: Question, point: DesignPoint) -> None:
    """One value of a search as soon as it is tried, on stderr."""
    print(f"{question.path} {question.in_unit(point.value)}: {point.in_words(question.target)}", file=sys.stderr, flush=True)


def print_design(
    question: Question, stop: tuple[FullStop, list[tuple[float, Summary]]], found: DesignAnswer, console: Console | None = None
) -> None:
    """Print section 2.2, the value found by the model with its error, and the answer there, in at most 80 columns."""
    from softbrake.studies.inverse_design import answer

    console = console or plain()
    energy, tried = stop
    goal = question.target
    rows = [
        ("energy of the cargo", f"{energy.energy:.1f}", "J", "m g l1 + m V²/2"),
        ("mean pressure", f"{energy.mean:.1f}", "Pa", "full stop over the shell's height"),
        ("largest, of a sine", f"{energy.largest:.1f}", "Pa", "pi/2 of the mean"),
        ("end of a sine", f"{energy.end_time:.5f}", "s", ""),
        *(("  with its peak at", f"{when:.5f}", "s", answer(summary, goal)) for when, summary in tried),
    ]
    console.print("By section 2.2, for a piston of the cover's area", style="bold")
    print_quantities(console, rows)
    console.print()
    console.print(f"By the model, for {goal}", style="bold")
    width = "no error bar" if found.error is None else f"± {question.in_unit(found.error, '.2g')}"
    value = f"{found.value / question.size:.6g}"
    print_quantities(console, [(question.path, value, question.shown, f"{width}: {found.basis}")])
    if found.others:
        console.print(f"The places looked at show {found.others + 1} values that meet the target; this is the lowest.")
    console.print()
    print_summary(found.summary, console=console)
