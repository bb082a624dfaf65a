"""The search for a value that meets a target, and for a design that meets several bounds."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from rich.console import Console

from softbrake.report.console.summary import print_summary
from softbrake.report.console.tables import Column, plain, print_columns, print_quantities
from softbrake.report.words import margin_in_words
from softbrake.sim.summary import Summary

if TYPE_CHECKING:
    from softbrake.case.full_stop import FullStop
    from softbrake.studies.feasible_design import DesignFound, DesignProblem, TriedDesign
    from softbrake.studies.inverse_design import DesignAnswer, DesignPoint, Question

BOUNDS = (Column("bound", False, True), Column("found", False, True), Column("margin"), Column("error"))


def print_point(question: Question, point: DesignPoint) -> None:
    """One value of a search as soon as it is tried, on stderr."""
    print(f"{question.path} {question.in_unit(point.value)}: {point.in_words(question.target)}", file=sys.stderr, flush=True)


def print_design(
    question: Question,
    stop: tuple[FullStop, list[tuple[float, Summary]]] | None,
    found: DesignAnswer,
    console: Console | None = None,
) -> None:
    """Print section 2.2, the value found by the model with its error, and the answer there, in at most 80 columns.

    stop: of `piston`; None of a case with gas.
    """
    console = console or plain()
    if stop is not None:
        _print_piston(console, *stop, question)
    console.print(f"By the model, for {question.target}", style="bold")
    width = "no error bar" if found.error is None else f"± {question.in_unit(found.error, '.2g')}"
    value = f"{found.value / question.size:.6g}"
    print_quantities(console, [(question.path, value, question.shown, f"{width}: {found.basis}")])
    if found.others:
        console.print(f"The places looked at show {found.others + 1} values that meet the target; this is the lowest.")
    console.print()
    print_summary(found.summary, console=console)


def _print_piston(console: Console, energy: FullStop, tried: list[tuple[float, Summary]], question: Question) -> None:
    rows = [
        ("energy of the cargo", f"{energy.energy:.1f}", "J", "m g l1 + m V²/2"),
        ("mean pressure", f"{energy.mean:.1f}", "Pa", "full stop over the shell's height"),
        ("largest, of a sine", f"{energy.largest:.1f}", "Pa", "pi/2 of the mean"),
        ("end of a sine", f"{energy.end_time:.5f}", "s", ""),
        *(("  with its peak at", f"{when:.5f}", "s", question.target.answer(summary)) for when, summary in tried),
    ]
    console.print("By section 2.2, for a piston of the cover's area", style="bold")
    print_quantities(console, rows)
    console.print()


def print_tried(problem: DesignProblem, one: TriedDesign) -> None:
    """One design of a search as soon as it is tried, on stderr."""
    print(f"{problem.in_words(one.values)}: {one.answers(problem.bounds)}", file=sys.stderr, flush=True)


def print_feasible(problem: DesignProblem, found: DesignFound, console: Console | None = None) -> None:
    """Print the design of the largest margin, its answers beside their bounds, and the answer there, in at most 80 columns."""
    console = console or plain()
    console.print("By the model, the design of the largest margin", style="bold")
    rows = []
    for k, each in enumerate(problem.variables):
        meeting = [one.values[k] for one in found.meeting]
        ends = f"{min(meeting) / each.size:.6g} to {each.in_unit(max(meeting))} in designs that meet all bounds"
        rows.append((each.path, f"{found.best.values[k] / each.size:.6g}", each.shown, ends))
    print_quantities(console, rows)
    console.print()
    lines = []
    for k, bound in enumerate(problem.bounds):
        error, margin = found.errors[k], margin_in_words(found.margins[k], 1) if found.claimed(k) else "none"
        lines.append([str(bound), bound.answer(found.summary), margin, "–" if error is None else f"± {error:.1%}"])
    print_columns(console, BOUNDS, lines)
    console.print()
    console.print(f"error: {found.basis}")
    shares = "Margin and error are parts of the bound"
    speeds = any(bound.is_speed for bound in problem.bounds)
    console.print(f"{shares}; those of velocities are of their squares." if speeds else f"{shares}.")
    if not all(map(found.claimed, range(len(problem.bounds)))):
        console.print("A margin that is not larger than its numerical error is none.")
    console.print(f"{len(found.meeting)} of the {len(found.tried)} designs tried meet all bounds.")
    console.print()
    print_summary(found.summary, console=console)


def none_meets(problem: DesignProblem, found: DesignFound) -> str:
    """In words that no design meets all bounds: the nearest, and what it misses by how much."""
    from softbrake.studies.feasible_design import longer

    missed = []
    for bound, margin in zip(problem.bounds, found.margins, strict=True):
        if margin < 0.0:
            squares = " of its square" if bound.is_speed else ""
            missed.append(f"{bound.name} {bound.answer(found.summary)} misses {bound} by {-margin:.1%}{squares}")
    lost = sum(not one.margins for one in found.tried)
    without = f", {lost} of them without an answer" if lost else ""
    return (
        f"none of the {len(found.tried)} designs tried meets all bounds{without}; nearest is "
        f"{problem.in_words(found.best.values)}: {'; '.join(missed)}{longer(found.tried)}"
    )
