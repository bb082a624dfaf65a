"""The value of one input that brings an answer to its target: by section 2.2 of the paper for a piston, and by the model."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from softbrake.case.case import Case
from softbrake.case.case_file import CaseError, CaseFile
from softbrake.case.full_stop import FullStop
from softbrake.case.level import level
from softbrake.sim.simulation import Diverged, NotInflated, simulate
from softbrake.sim.summary import Summary, Trial
from softbrake.studies.batch import run_batch
from softbrake.studies.convergence import estimate_of_neighbours
from softbrake.studies.design_space import Variable, searched, variable
from softbrake.studies.error_control import BUDGET, Refined, neighbours
from softbrake.studies.targets import Target, target_of

POINTS = 9  # of the look at the range before the search
ROUNDS = 4  # of a closer look around the nearest place, each a third as wide, where no place reaches the target
SEARCH_WIDTH = 5e-4  # of the value, at which the search ends: below any error of the grid
LEAST_WIDTH = 1e-6  # of the value, at which it ends where answers are not yet near the target
NUDGE = 0.03  # of the value, for its slope: above the scatter of crumpling cloth
JUMP = 0.02  # of the range of scores: a change by more within the last bracket is no crossing
PEAK_PLACES = (0.25, 0.5, 0.75, 1.0)  # of t_k, places of P_max tried with a piston


class NotReached(Exception):
    """No value of the range reaches the target; the message names what was found at both ends."""


@dataclass(frozen=True)
class DesignPoint:
    """One value that was tried."""

    value: float  # SI unit of the path
    summary: Summary | None
    score: float | None  # None where there is no answer
    fault: str = ""  # then why

    def in_words(self, target: Target) -> str:
        """What the value gave."""
        return self.fault.split(",")[0] if self.summary is None or self.score is None else target.answer(self.summary)


@dataclass(frozen=True)
class DesignAnswer:
    """The value found: of the two ends of the last bracket the one whose answer does not exceed the target."""

    value: float  # SI unit of the path
    bracket: tuple[float, float]
    error: float | None  # of the value: numerical error of the score over its slope, and the bracket; None without one
    basis: str  # what the error rests on
    summary: Summary  # at the value; that of the refinement there, where the case asks for a tolerance
    points: list[DesignPoint]  # all that was tried, in the order of the values
    others: int  # how often else answers at the places looked at meet the target
    missed: str = ""  # what the refinement at the value gives, where that is off the target by more than all errors


@dataclass(frozen=True)
class Question(Variable):
    """A variable of a case and the answer wanted of it."""

    case: Case  # as the file gives it
    load: Callable[[float], Case]  # the case with a value of the variable, SI unit
    target: Target
    check: Callable[[float], Refined] | None  # refines the case with a value, where it asks for a tolerance


def ask(
    file: CaseFile,
    path: str = "pressure.value",
    target: str = "impact_velocity=0",
    between: str | None = None,
    budget: float = BUDGET,
    report: Callable[[Trial], None] | None = None,
) -> Question:
    """Return the question about a case file; between: as of `variable`.

    A case with a tolerance is refined (`budget` s, `report`) for the level and the grid to search on, and once more at the value
    found, which may be another scene. Raises ValueError for texts that are no question.
    """
    goal, varied = target_of(target, file.case), variable(file, path, between)
    for end in (varied.low, varied.high):  # before the first run
        try:
            file.vary({path: end})
        except CaseError as error:
            raise varied.refused(error.faults[0]) from None
    load, check = searched(file, budget, report)
    return Question(
        **vars(varied),
        case=file.case,
        load=lambda value: load({path: value}),
        target=goal,
        check=None if check is None else lambda value: check({path: value}),
    )


def piston(case: Case) -> tuple[FullStop, list[tuple[float, Summary]]]:
    """Section 2.2, and what a piston does under its two sinusoids (2.10) with the peak at some times (s).

    Their mean over time is that of the full stop wherever the peak stands; the work is not, as it is a mean over the way.
    """
    stop = case.full_stop
    gas = level(case, "lumped", case.grid.generatrix, case.grid.hoop)
    tried = []
    for share in PEAK_PLACES:
        peak_time = share * (1 - 1e-9) * stop.end_time  # (2.10) divides by the rest
        law = replace(gas.filling, law="sine", value=stop.largest, peak_time=peak_time, end_time=stop.end_time)
        time = replace(gas.time, end=2 * stop.end_time)
        tried.append((peak_time, simulate(replace(gas.under(law), time=time))))
    return stop, tried


def find(question: Question, report: Callable[[DesignPoint], None] | None = None) -> DesignAnswer:
    """Find the lowest value of the range that brings the answer to its target, as far as the places looked at show it.

    report: told each value tried. The range is looked at in POINTS places, so that a value
    where the run diverges, or an answer that rises and falls again, does not mislead the search; where none of them reaches the
    target, more closely around the nearest. Raises NotReached.
    """
    target = question.target
    points: list[DesignPoint] = []

    def attempt(values: Sequence[float]) -> list[DesignPoint]:
        tried = _tried(question.load, target, values)
        points.extend(tried)
        for point in tried:
            if report is not None:
                report(point)
        return tried

    scan = _look(attempt, question)
    brackets = _brackets(scan, target)
    if not brackets:
        raise NotReached(_missed(scan, question))
    first, second = ends = brackets[0]
    if first is not second:  # else an exact hit
        first, second = _close_in(lambda value: attempt([value])[0], *ends, target.near or math.inf)
    scores = [point.score for point in points if point.score is not None]
    if abs((first.score or 0.0) - (second.score or 0.0)) > JUMP * (max(scores) - min(scores)):
        jump = " and ".join(f"{question.in_unit(end.value, '.8g')} ({end.in_words(target)})" for end in (first, second))
        raise NotReached(f"the answer jumps across {target} between {jump}")
    best = min((first, second), key=lambda point: point.score or 0.0)
    assert best.summary is not None
    nudge = NUDGE * abs(best.value) or NUDGE * (question.high - question.low)
    around = max(best.value - nudge, question.low), min(best.value + nudge, question.high)  # beyond the range may be no case
    slope = _slope(*attempt(around)) or _slope(*ends)
    numerical, basis = _numerical_error(question.load(best.value), target, best.summary)
    bracket = (min(first.value, second.value), max(first.value, second.value))
    if slope == 0.0:
        numerical, basis = None, "no error bar: the answer is the same around the value"
    error = None if numerical is None else numerical / abs(slope) + bracket[1] - bracket[0]
    points.sort(key=lambda point: point.value)
    found = DesignAnswer(best.value, bracket, error, basis, best.summary, points, len(brackets) - 1)
    return found if question.check is None else _checked(found, question.check, target, abs(slope) * (error or 0.0))


def _look(attempt: Callable[[Sequence[float]], list[DesignPoint]], question: Question) -> list[DesignPoint]:
    """Places all over the range; where none reaches the target, more of them around the nearest, in ROUNDS at most."""
    low, high = question.low, question.high
    ratio = high / low if low > 0.0 else math.inf
    steps = [k / (POINTS - 1) for k in range(1, POINTS - 1)]
    between = [low * ratio**share if ratio < math.inf else low + share * (high - low) for share in steps]
    scan = attempt([low, *between, high])
    for _ in range(ROUNDS):
        nearest = _nearest(scan)
        if nearest is None or _brackets(scan, question.target):
            break
        k = scan.index(nearest)
        gaps = pairwise(scan[max(k - 1, 0) : k + 2])
        closer = [a.value + share * (b.value - a.value) for a, b in gaps for share in (1 / 3, 2 / 3)]
        scan = sorted([*scan, *attempt(closer)], key=lambda point: point.value)
        if nearest in (scan[0], scan[-1]) and _nearest(scan) is nearest:  # answers fall off from the end of the range
            break
    return scan


def _nearest(scan: Sequence[DesignPoint]) -> DesignPoint | None:
    """The place whose answer is nearest the target; None where none has one."""
    return min((point for point in scan if point.score is not None), key=lambda point: abs(point.score or 0.0), default=None)


def _brackets(scan: Sequence[DesignPoint], target: Target) -> list[tuple[DesignPoint, DesignPoint]]:
    """Neighbours with the target between their answers, and places that hit it beside none such, twice; by rising value."""
    found: list[tuple[DesignPoint, DesignPoint]] = []
    for a, b in pairwise(scan):
        touches = a.score == 0.0 and found and found[-1][1] is a  # the target, from above: one value, not two
        if _across(a, b) and not touches:
            found.append((a, b))
    ends = {point.value for pair in found for point in pair}
    hits = [point for point in scan if point.score is not None and abs(point.score) <= target.near and point.value not in ends]
    return sorted([*found, *((point, point) for point in hits)], key=lambda pair: pair[0].value)


def _checked(found: DesignAnswer, check: Callable[[float], Refined], target: Target, error: float) -> DesignAnswer:
    """The answer with the refinement at its value; error: of the search, in units of the score."""
    try:
        refined = check(found.value)
        return replace(found, summary=refined.summary, missed=_missed_by(refined, target, error))
    except (Diverged, NotInflated, ValueError) as fault:
        return replace(found, missed=f"the check has no answer: {fault}")


def _missed_by(checked: Refined, target: Target, error: float) -> str:
    """In words what a refinement gives where its score is off 0 by more than its error and that of the search (of the score)."""
    summary = checked.summary
    score, own = target.score(checked.case, summary), target.error(summary) or 0.0
    return f"the check gives {target.answer(summary)}, not {target}" if abs(score) > own + error else ""


def _tried(load: Callable[[float], Case], target: Target, values: Sequence[float]) -> list[DesignPoint]:
    cases = [load(value) for value in values]
    tried = []
    for value, case, (summary, fault, _) in zip(values, cases, run_batch(cases), strict=True):
        if fault is not None or summary is None:
            tried.append(DesignPoint(value, None, None, fault or ""))
            continue
        try:
            tried.append(DesignPoint(value, summary, target.score(case, summary)))
        except ValueError as none:
            tried.append(DesignPoint(value, summary, None, str(none)))
    return tried


def _across(a: DesignPoint, b: DesignPoint) -> bool:
    return a.score is not None and b.score is not None and (a.score > 0.0) != (b.score > 0.0)


def _slope(a: DesignPoint, b: DesignPoint) -> float:
    """Change of the score per unit of the value; 0 where it is not known."""
    return 0.0 if a.score is None or b.score is None or a is b else (b.score - a.score) / (b.value - a.value)


def _close_in(
    attempt: Callable[[float], DesignPoint], a: DesignPoint, b: DesignPoint, near: float = math.inf
) -> tuple[DesignPoint, DesignPoint]:
    """Narrow a bracket to SEARCH_WIDTH, and on to LEAST_WIDTH until the lower score is within `near` of 0.

    Inverse quadratic interpolation where it is safe, else halves: Chandrupatla, 1997. A score of 0 counts as below, and its
    bracket closes in as any other.
    """
    share, width = 0.5, SEARCH_WIDTH
    while True:
        new = attempt(a.value + share * (b.value - a.value))
        if new.score is None:
            raise NotReached(f"between {a.value:.6g} and {b.value:.6g}, where the target lies, there is no answer: {new.fault}")
        last = a if not _across(new, a) else b
        a, b = new, b if last is a else a
        assert a.score is not None and b.score is not None and last.score is not None
        across = abs(b.value - a.value) / abs(a.value)
        while across <= width and width > LEAST_WIDTH and -min(a.score, b.score) > near:
            width /= 8
        least = width / across
        if least >= 1.0:
            return a, b
        share = 0.5
        xi, phi = (a.value - b.value) / (last.value - b.value), (a.score - b.score) / (last.score - b.score)
        if phi**2 < xi and (1 - phi) ** 2 < 1 - xi:
            beyond = (last.value - a.value) / (b.value - a.value)
            share = a.score / (b.score - a.score) * last.score / (b.score - last.score)
            share += beyond * a.score / (last.score - a.score) * b.score / (last.score - b.score)
        share = min(max(share, 0.5 * least), 1 - 0.5 * least)


def _numerical_error(case: Case, target: Target, summary: Summary) -> tuple[float | None, str]:
    """Error of the score by neighbouring grids, and in words what it rests on."""
    if case.model.fidelity == "lumped":
        return 0.0, "gas alone has no grid; the last bracket"
    try:
        runs = [*neighbours(case), summary]
        scores = [target.score(case, one) for one in runs]
    except (Diverged, NotInflated, ValueError) as fault:
        return None, f"no error bar: a coarser grid has no answer ({str(fault).split(';')[0]})"
    error = estimate_of_neighbours([one.model.generatrix for one in runs], scores).error
    return error, "four grids beside one another, and the last bracket"


def _missed(scan: Sequence[DesignPoint], question: Question) -> str:
    target, places = question.target, len(scan)
    ends = "; ".join(f"at {question.in_unit(point.value)}: {point.in_words(target)}" for point in (scan[0], scan[-1]))
    lost = sum(point.score is None for point in scan)
    late = sum("neither impact" in point.fault for point in scan)
    longer = "; raise time.end" if 2 * late > places else ""
    near = _nearest(scan)
    if near is None:
        return f"no place in the range reaches {target}: none of {places} has an answer; {ends}{longer}"
    without = f", {lost} of {places} without an answer" if lost else ""
    return (
        f"none of {places} places in the range reaches {target}: {ends}; nearest is {question.in_unit(near.value)}: "
        f"{near.in_words(target)}{without}{longer}"
    )
