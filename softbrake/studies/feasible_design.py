"""The design that keeps all its answers below their bounds by the largest margin, or that none does.

The margin of a design is the smallest of its answers' margins, see `Target.margin`: above 0 it meets all bounds. It has an edge
where one answer takes over from another, so the search compares designs, and takes no slopes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product

from softbrake.case.case import Case
from softbrake.case.case_file import CaseError, CaseFile
from softbrake.sim.simulation import Diverged, NotInflated
from softbrake.sim.summary import Summary, Trial
from softbrake.studies.batch import Dropped, run_batch
from softbrake.studies.convergence import estimate_of_neighbours
from softbrake.studies.design_space import Searched, Variable, ranges_of, searched, twice, variable
from softbrake.studies.error_control import BUDGET, Refined, neighbours
from softbrake.studies.inverse_design import NotReached
from softbrake.studies.sampling import latin_hypercube
from softbrake.studies.targets import Target, target_of

SCAN = {1: 25, 2: 9}  # places along each variable of the first look
SAMPLES = 60  # places of the first look for each variable, of three and more
MOST_VARIABLES = 6  # whose range has 64 corners
STEPS = (-2 / 3, -1 / 3, 0.0, 1 / 3, 2 / 3)  # of a closer look along each variable, over the distance of places before
STARTS = 3  # places of the first look that are looked at more closely
FIRST_LOOKS, LOOKS = 2, 12  # closer ones around each of them, and at most around the best
NARROWEST = 1e-4  # of the range, distance of places at which the search ends
SETTLED = 1e-3  # of a bound: where margins around the best design differ by less, the search ends

Place = tuple[float, ...]  # parts of the ranges, 0 to 1


@dataclass(frozen=True)
class DesignProblem:
    """A case, the variables of its design, and the bounds that its answers shall meet."""

    case: Case  # as the file gives it
    variables: tuple[Variable, ...]
    bounds: tuple[Target, ...]
    model: Searched

    def load(self, values: Sequence[float]) -> Case:
        """The case with values (SI) of the variables. Raises CaseError where there is none."""
        return self.model.load(self.by_path(values))

    def by_path(self, values: Sequence[float]) -> dict[str, float]:
        """Values (SI) of the variables by their paths."""
        return dict(zip((each.path for each in self.variables), values, strict=True))

    def in_words(self, values: Sequence[float]) -> str:
        """Values of the variables in their units."""
        pairs = zip(self.variables, values, strict=True)
        return ", ".join(f"{each.path} {each.in_unit(value)}" for each, value in pairs)


@dataclass(frozen=True)
class TriedDesign:
    """One design that was tried."""

    values: tuple[float, ...]  # SI, of the variables
    summary: Summary | None
    margins: tuple[float, ...]  # of the bounds; empty where there is no answer
    fault: str = ""  # then why

    @property
    def margin(self) -> float:
        """The smallest one; minus infinity where there is no answer."""
        return min(self.margins, default=-math.inf)

    @property
    def meets(self) -> bool:
        """Whether no answer is above its bound."""
        return self.margin >= 0.0

    def answers(self, bounds: Sequence[Target]) -> str:
        """What the design gave, in words."""
        if self.summary is None or not self.margins:
            return self.fault.split(",")[0]
        return ", ".join(f"{bound.name} {bound.answer(self.summary)}" for bound in bounds)


@dataclass(frozen=True)
class DesignFound:
    """The design of the largest margin; where it is below 0, none that was tried meets all bounds."""

    best: TriedDesign
    summary: Summary  # of the best; that of the refinement there, where the case asks for a tolerance
    margins: tuple[float, ...]  # likewise
    errors: tuple[float | None, ...]  # of the margins, numerical; None without one
    basis: str  # what the errors rest on
    tried: list[TriedDesign]  # in the order of the search
    missed: str = ""  # what the refinement gives, where it is above a bound by more than all errors, or has no answer

    @property
    def meeting(self) -> list[TriedDesign]:
        """Designs that meet all bounds."""
        return [one for one in self.tried if one.meets]

    def claimed(self, bound: int) -> bool:
        """Whether the margin of a bound is larger than its numerical error."""
        error = self.errors[bound]
        return error is not None and self.margins[bound] > error


def pose(
    file: CaseFile,
    paths: Sequence[str],
    targets: Sequence[str],
    ranges: Sequence[str] = (),
    budget: float = BUDGET,
    report: Callable[[Trial], None] | None = None,
) -> DesignProblem:
    """Return the problem that texts ask for: paths, ANSWER<=VALUE, and PATH=LOW:HIGH, of a single path LOW:HIGH as well.

    Without a range a variable has that of `variable`. A case with a tolerance is refined (`budget` s, `report`) for the level and
    the grid to search on, and once more at the design found. Raises ValueError for texts that are no problem.
    """
    between = ranges_of(paths, ranges)
    if len(paths) > MOST_VARIABLES:
        raise ValueError(f"--find: {len(paths)} quantities; up to {MOST_VARIABLES} are expected")
    bounds = tuple(target_of(target, file.case) for target in targets)
    for bound, text in zip(bounds, targets, strict=True):
        if not bound.at_most:
            raise ValueError(f"--target {text}: of several quantities or targets each has a bound; '{bound.name}<=' is expected")
    if repeated := twice([bound.name for bound in bounds]):
        raise ValueError(f"--target {repeated}: given twice; one bound of an answer is expected")
    variables = tuple(variable(file, path, between.get(path)) for path in paths)
    _check_ends(file, variables)
    return DesignProblem(file.case, variables, bounds, searched(file, budget, report))


def _check_ends(file: CaseFile, variables: Sequence[Variable]) -> None:
    """Refuse an end of a range that no case has, whichever ends the others take."""
    faults: list[tuple[Place, str]] = []
    corners = list(product((0.0, 1.0), repeat=len(variables)))
    for corner in corners:
        try:
            file.vary({each.path: each.at(share) for each, share in zip(variables, corner, strict=True)})
        except CaseError as error:
            faults.append((corner, error.faults[0]))
    for k, each in enumerate(variables):
        for end in (0.0, 1.0):
            found = [fault for corner, fault in faults if corner[k] == end]
            if len(found) == len(corners) // 2:
                raise each.refused(next((fault for fault in found if each.path in fault), found[0]))


def solve(problem: DesignProblem, report: Callable[[TriedDesign], None] | None = None) -> DesignFound:
    """Find the design of the largest margin, as far as the designs tried show it; report: told each.

    A look at the whole range, then closer looks around the best places of it, a third as wide from one to the next: a few around
    each, all that are needed around the best. They end where margins change by less than SETTLED. Raises NotReached where no
    design has an answer.
    """
    tried: dict[Place, TriedDesign] = {}

    def look(places: Iterable[Place]) -> dict[Place, TriedDesign]:
        asked = list(dict.fromkeys(tuple(round(share, 12) for share in place) for place in places))
        new = [place for place in asked if place not in tried]
        values = [tuple(each.at(share) for each, share in zip(problem.variables, place, strict=True)) for place in new]
        for place, one in zip(new, _tried(problem, values), strict=True):
            tried[place] = one
            if report is not None:
                report(one)
        return {place: tried[place] for place in asked}

    def climb(centre: Place, distance: float, looks: int) -> tuple[Place, float]:
        """Look more closely around a place, and on from the best of each look; return the last one, and how far others are."""
        for number in range(looks):
            around = look([centre, *_closer(centre, distance, number)])
            best = _best(around)
            inside, centre = _inside(best, centre, distance), best
            if not inside:
                continue
            margins = [one.margin for one in around.values() if one.margins]
            if max(margins) - min(margins) < SETTLED or distance < NARROWEST:
                break
            distance /= 3.0
        return centre, distance

    places, distance = _scan(len(problem.variables))
    scan = look(places)
    if not tried[_best(scan)].margins:
        designs = list(tried.values())
        raise NotReached(f"none of {len(designs)} designs has an answer: {designs[0].fault}{longer(designs)}")
    ends = [climb(start, distance, FIRST_LOOKS) for start in _starts(scan, distance)]
    climb(*max(ends, key=lambda end: tried[end[0]].margin), LOOKS)
    best = tried[_best(tried)]
    assert best.summary is not None
    errors, basis = _numerical_errors(problem, best)
    found = DesignFound(best, best.summary, best.margins, errors, basis, list(tried.values()))
    return found if problem.model.check is None or not best.meets else _checked(problem, problem.model.check, found)


def _scan(variables: int) -> tuple[list[Place], float]:
    """Places all over the range, and their distance from one another."""
    if count := SCAN.get(variables):
        steps = [k / (count - 1) for k in range(count)]
        return list(product(steps, repeat=variables)), 1.0 / (count - 1)
    samples = SAMPLES * variables
    corners = product((0.0, 1.0), repeat=variables)
    return [*corners, *latin_hypercube(variables, samples, 0)], samples ** (-1.0 / variables)


def _closer(centre: Place, distance: float, seed: int) -> list[Place]:
    """Places around a design, within the range: all combinations of STEPS, of three variables and more each alone and samples."""
    variables = len(centre)
    if variables in SCAN:
        offsets = list(product(STEPS, repeat=variables))
    else:
        alone = [tuple(step * (k == which) for k in range(variables)) for which in range(variables) for step in STEPS]
        width = STEPS[-1] - STEPS[0]
        sampled = latin_hypercube(variables, SAMPLES * variables // 3, seed)
        offsets = [*alone, *(tuple(STEPS[0] + width * share for share in place) for place in sampled)]
    return [
        tuple(min(max(middle + distance * step, 0.0), 1.0) for middle, step in zip(centre, offset, strict=True))
        for offset in offsets
    ]


def _starts(scan: dict[Place, TriedDesign], distance: float) -> list[Place]:
    """The best places of a look, none beside a better one."""
    starts: list[Place] = []
    for place in sorted((place for place in scan if scan[place].margins), key=lambda place: -scan[place].margin):
        if all(max(abs(a - b) for a, b in zip(place, other, strict=True)) > 1.5 * distance for other in starts):
            starts.append(place)
    return starts[:STARTS]


def _best(tried: dict[Place, TriedDesign]) -> Place:
    return max(tried, key=lambda place: tried[place].margin)


def _inside(place: Place, centre: Place, distance: float) -> bool:
    """Whether a place is not at the border of a closer look, unless that is the end of the range."""
    reach = (STEPS[-1] - 1e-9) * distance
    return all(share in (0.0, 1.0) or abs(share - middle) < reach for share, middle in zip(place, centre, strict=True))


def _tried(problem: DesignProblem, designs: Sequence[tuple[float, ...]]) -> list[TriedDesign]:
    """Run designs; those that are no case have their fault."""
    cases: list[Case | None] = []
    faults: dict[tuple[float, ...], str] = {}
    for values in designs:
        try:
            cases.append(problem.load(values))
        except CaseError as error:
            cases.append(None)
            faults[values] = error.faults[0].partition(": ")[2]
    answers = run_batch(case for case in cases if case is not None)
    return [
        TriedDesign(values, None, (), faults[values]) if case is None else _judged(problem, case, values, next(answers))
        for values, case in zip(designs, cases, strict=True)
    ]


def _judged(problem: DesignProblem, case: Case, values: tuple[float, ...], dropped: Dropped) -> TriedDesign:
    summary, fault, _ = dropped
    if fault is not None or summary is None:
        return TriedDesign(values, summary, (), fault or "")
    try:
        return TriedDesign(values, summary, _margins(problem.bounds, case, summary))
    except ValueError as none:
        return TriedDesign(values, summary, (), str(none))


def _margins(bounds: Sequence[Target], case: Case, summary: Summary) -> tuple[float, ...]:
    """Raises ValueError where a run was cut off: its peaks may be yet to come."""
    if summary.cut_off:
        raise ValueError(f"neither impact nor stop by {summary.end_time:g} s")
    return tuple(bound.margin(case, summary) for bound in bounds)


def _numerical_errors(problem: DesignProblem, best: TriedDesign) -> tuple[tuple[float | None, ...], str]:
    """Errors of the margins by neighbouring grids, and in words what they rest on."""
    case = problem.load(best.values)
    if case.model.fidelity == "lumped":
        return (0.0,) * len(problem.bounds), "gas alone has no grid"
    assert best.summary is not None
    try:
        runs = [*neighbours(case), best.summary]
        margins = [_margins(problem.bounds, case, one) for one in runs]
    except (Diverged, NotInflated, ValueError) as fault:
        return (None,) * len(problem.bounds), f"no error bar: a coarser grid has no answer ({str(fault).split(';')[0]})"
    cells = [one.model.generatrix for one in runs]
    errors = tuple(estimate_of_neighbours(cells, values).error for values in zip(*margins, strict=True))
    return errors, "four grids beside one another"


def _checked(problem: DesignProblem, check: Callable[[dict[str, float]], Refined], found: DesignFound) -> DesignFound:
    """The design found with the answer of the refinement there."""
    try:
        refined = check(problem.by_path(found.best.values))
        margins = _margins(problem.bounds, refined.case, refined.summary)
    except (Diverged, NotInflated, ValueError) as fault:
        return replace(found, missed=f"the check has no answer: {fault}")
    errors, missed = [], []
    for bound, margin, searched_error in zip(problem.bounds, margins, found.errors, strict=True):
        own = bound.error(refined.summary)
        error = searched_error if own is None else own / bound.scale(refined.case)
        errors.append(error)
        if -margin > (error or 0.0) + (searched_error or 0.0):
            missed.append(f"{bound.name} {bound.answer(refined.summary)}, not {bound}")
    words = f"the check gives {'; '.join(missed)}" if missed else ""
    return replace(
        found, summary=refined.summary, margins=margins, errors=tuple(errors), basis="the refinement at the design", missed=words
    )


def longer(tried: Sequence[TriedDesign]) -> str:
    """What helps where most designs are cut off."""
    return "; raise time.end" if 2 * sum("neither impact" in one.fault for one in tried) > len(tried) else ""
