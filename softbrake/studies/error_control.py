"""The cheapest model that is good enough, on evidence: grids of the axisymmetric shell, beside it disturbed full shells.

Axisymmetric shells cost milliseconds, so neighbouring grids of theirs tell what a grid does to the answer. Full shells of coarse
grids, disturbed as sewing and handling leave them, tell whether the shell stays round and by how much the answer departs from
that of a round one. Where it does not stay round, the answer is the mean of an ensemble of full shells, and its bar holds 19 of
20 drops.
What was tried stands in the table of trials. Budgets are CPU seconds, so that no answer depends on what else a machine does.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from statistics import fmean
from typing import Any

from softbrake.case.case import Case
from softbrake.case.case_file import load_case
from softbrake.case.level import LongStep, level, long_steps
from softbrake.case.sections.numerics import Fidelity
from softbrake.core.arrays import Outcome
from softbrake.core.columns import History
from softbrake.sim.result_file import ResultError, ResultFile
from softbrake.sim.simulation import CLOCK, REFINED, Diverged, Progress, Simulation, prepare, recorded, simulate
from softbrake.sim.summary import Ensemble, Summary, Trial
from softbrake.studies.convergence import Estimate, estimate_of_neighbours, prediction

COURANT = 0.9  # where runs are to be compared at one; a refinement takes `auto`
BUDGET = 60.0  # CPU s
CELLS = (9.0, 10.8, 13.0, 15.6, 18.7)  # in a radius, of the first axisymmetric grids; 1.2 times as many from one to the next
FINER = 1.2
NEIGHBOURS = 5  # grids behind an error
TWICE = 2.0  # times as fine is the grid that has to agree with them
COARSE, SCREEN, FINE = 9.0, 12.0, 18.0  # cells in a radius of full shells
OTHERS = 2.0  # times the largest of a few distances, for those of grids and disturbances that were not computed
LEAST_MEMBERS, MOST_MEMBERS = 6, 8  # of an ensemble on one grid, least to stop at and most

# Of the radius, disturbances of the places at the start: from what sewing leaves to what nobody could measure. No case says how
# round its shell is, and where symmetry is lost the answer depends on when, so an ensemble takes each.
SEEDS = (1e-3, 1e-4, 1e-5, 1e-6)
OUT_OF_ROUND = 0.05  # of the radius: more, and the shell is not axisymmetric; its square, 0.25 %, is what the answer feels
LEAST_SPEED = 0.05  # of the free-fall velocity: tolerances of smaller impact velocities are parts of this
PEAKS = ("peak_deceleration", "peak_tension_generatrix", "peak_tension_hoop", "peak_tension_belt", "peak_pressure")
PART = 0.5  # of the allowed error, that grids of the axisymmetric shell may take up
COSTLIER = {"axisymmetric": FINER**3, "full": (FINE / SCREEN) ** 3.5}  # a run on the next finer grid, at most
RATIOS = (0.57, 0.69, 0.83)  # of the cells, of the coarser neighbours of a grid that a case asks for
SETTLED = 0.1  # of the period of the breathing hoop, after which disturbances have spread; the first peak comes at a half
SHOTS = 50  # looks at how round a shell is


@dataclass(frozen=True)
class Refined:
    """Where the refinement ended."""

    case: Case  # of the level and grid chosen
    summary: Summary  # of its run, with velocity, peaks, errors, reason, trials and wall seconds of the refinement
    seed: int = 0  # of the run's disturbance, see `disturbance`; 0 for none


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a refinement that has an answer already; `found` holds it, with outcome "interrupted"."""

    def __init__(self, found: Refined) -> None:
        super().__init__()
        self.found = found


class CutOff(Exception):
    """A run of a refinement met `time.end` above the ground: it has no answer."""

    def __init__(self, case: Case, summary: Summary) -> None:
        super().__init__(f"the run ends before impact, at time.end = {case.time.end:g} s, and has no answer; raise time.end")
        self.case, self.summary = case, summary


def refine(case: Case, tolerance: float, budget: float = BUDGET, report: Callable[[Trial], None] | None = None) -> Refined:
    """Find the cheapest level and grid whose impact velocity is within a tolerance, relative. The Courant number is `auto`.

    budget (CPU s): no run is begun that would take more, from what the last one took, but for the first of each level. report:
    told each trial when done. Raises Interrupted at Ctrl-C once there is an answer, Diverged where no grid of the level wanted
    has one.
    """
    return _Refinement(case, tolerance, budget, report).refine()


def run(
    case: Case | str | PathLike[str] | Mapping[str, Any],
    results: str | Path | None = None,
    progress: Callable[[Progress], None] | None = None,
    *,
    budget: float = BUDGET,
    report: Callable[[Trial], None] | None = None,
    with_error_bar: bool = False,
) -> Summary:
    """Run a drop to impact, full stop or `time.end` and return its answer.

    A case with a tolerance, or with `model.fidelity: auto`, is tried at several levels and grids first. `trials` and
    `impact_velocity_error` of the answer then say how far that got, and the result file holds one run of the level chosen: of an
    ensemble the member nearest the answer.

    case: a Case, or what `load_case` makes one of: the path of a case file, or a mapping.
    results: path of the result file to write, which ends in .vtkhdf; an older one is replaced. None for none.
    progress: called after each chunk of steps of the run, some 15 ms, with an object of fields time (s), height (m), velocity
    (m/s, downwards positive), steps and end_time (s).
    budget: most CPU time (s) for the trials; none is begun that would take more, but for the first of each level.
    report: called after each trial, with an element of `trials`.
    with_error_bar: run three coarser grids as well, for `impact_velocity_error` and `peak_errors`; where the case has no
    tolerance.

    Ctrl-C ends the run early: the outcome is "interrupted", and the result file is whole up to there. Before anything is
    computed it raises KeyboardInterrupt. A disk that gets full ends no run: `results_fault` of the answer tells of it.
    Warns (LongStep) of a `time.courant` above 1.

    Raises CaseError where the case has faults; Diverged where the computation fails, with the result file readable up to there;
    NotInflated where `initial: inflated` finds no shape of rest; ResultError where the result file cannot be begun; ValueError
    where a grid is too coarse for an error bar; MemoryError where the grid is too large for the machine.
    """
    if not isinstance(case, Case):
        case = load_case(case)
    if case.tolerance is not None:
        try:
            found = refine(case, case.tolerance, budget, report)
        except Interrupted as interrupted:
            return interrupted.found.summary
        return found.summary if results is None else _write(found, results, progress)
    if said := long_steps([case]):
        warnings.warn(said, LongStep, stacklevel=2)
    if not with_error_bar:
        return simulate(case, results, progress)
    try:
        coarser = neighbours(case)
    except Diverged:
        coarser = []
    falling = prepare(case)
    with recorded(case, results) as file:
        return _kept(file, _with_error_bar(case, falling.to_end(file, progress), coarser))


def _kept(file: ResultFile | None, answer: Summary) -> Summary:
    """An answer, which is now in its file."""
    return answer if file is None else file.write_summary(answer)


def _write(found: Refined, results: str | Path, progress: Callable[[Progress], None] | None) -> Summary:
    """Run the drop of a refinement once more for the result file, disturbed as it was."""
    answer = found.summary
    disturbed = (disturbance(found.case, found.seed), found.seed) if found.seed else None
    try:
        falling = prepare(found.case, disturbed)
        with recorded(found.case, results) as file:
            kept = _kept(file, _with_errors(falling.to_end(file, progress), answer))
    except Diverged as diverged:
        reason = f"{answer.fidelity_reason}; the run that was to fill the result file diverged"
        return replace(answer, results=diverged.summary.results, fidelity_reason=reason)
    except ResultError as error:
        return replace(answer, results_fault=str(error))
    if kept.outcome == "interrupted":
        return replace(kept, fidelity_reason="interrupted while the result file was written", trials=answer.trials)
    return kept


def reached(case: Case, summary: Summary) -> bool:
    """Whether the answer of a refinement is within the case's tolerance, if it names one."""
    return (
        case.tolerance is None
        or not case.insists
        or (
            summary.impact_velocity_error is not None
            and summary.impact_velocity_error <= allowed(case.tolerance, speed_of(summary), summary.free_fall_velocity)
        )
    )


def allowed(tolerance: float, speed: float, free_fall: float) -> float:
    """Allowed error (m/s) of an impact velocity; that of a small one is a part of the free-fall velocity."""
    return tolerance * max(speed, LEAST_SPEED * free_fall)


def _with_errors(summary: Summary, refined: Summary) -> Summary:
    """A run of the level chosen, with the answer found before; filtered peaks are those of the run."""
    if summary.outcome == "interrupted":
        return summary
    wall_seconds = refined.wall_seconds + summary.wall_seconds
    return replace(
        refined,
        results=summary.results,
        wall_seconds=wall_seconds,
        kernel_seconds=summary.kernel_seconds,
        filtered=summary.filtered,
    )


def least_cells(case: Case) -> int:
    """Cells along the generatrix that keep the belts half a cell off the covers."""
    wall = case.shell.wall
    places = [(case.shell.along(belt.height), belt.width) for belt in case.belts]
    nearest = min((min(along, wall - along) - width / 2 for along, width in places), default=math.inf)
    return math.ceil(0.5 * wall / nearest + 1e-9)


def speed_of(summary: Summary) -> float:
    """Impact velocity (m/s); 0 where the cargo does not reach the ground."""
    return summary.impact_velocity or 0.0


def disturbance(case: Case, seed: int) -> float:
    """Size (m) of the disturbance of a seed, 1 and up."""
    return SEEDS[(seed - 1) % len(SEEDS)] * 0.5 * case.shell.diameter


@dataclass(frozen=True)
class _Run:
    """One run of a refinement."""

    case: Case
    summary: Summary
    seed: int  # of its disturbance, 0 for none
    out_of_round: float  # over the radius
    seconds: float  # of CPU

    @property
    def cells(self) -> int:
        return self.case.grid.generatrix


@dataclass
class _Found:
    """Best answer so far."""

    run: _Run  # nearest to the answer
    energy: float  # m^2/s^2, see `kinetic`
    error: float  # m^2/s^2
    reason: str
    peaks: dict[str, float] = field(default_factory=dict)  # estimated errors
    means: dict[str, float] = field(default_factory=dict)  # of an ensemble's peaks
    ensemble: Ensemble | None = None
    members: tuple[_Run, ...] = ()  # of an ensemble
    doubt: str | None = None  # of any run behind it


def kinetic(case: Case, summary: Summary) -> float:
    """Twice the kinetic energy by the mass at the ground (m^2/s^2); below 0 what is missing to get there, at the mean braking.

    It goes on smoothly where a cargo that stops just above the ground begins to reach it, as the velocity does not.
    """
    if summary.impact_velocity is not None:
        return summary.impact_velocity**2
    stroke = case.shell.height - summary.lowest_height
    return -(case.cargo.velocity**2) * summary.lowest_height / max(stroke, 1e-9 * case.shell.height)


def speed_range(energy: float, error: float) -> tuple[float, float]:
    """Impact velocity (m/s) of an energy of `kinetic`, and by how much it may be off."""
    low, speed, high = (math.sqrt(max(part, 0.0)) for part in (energy - error, energy, energy + error))
    return speed, max(high - speed, speed - low)


def first_doubt(summaries: Iterable[Summary]) -> str | None:
    """The first doubt among answers."""
    return next((summary.doubt for summary in summaries if summary.doubt), None)


def of_neighbours(runs: Sequence[tuple[Case, Summary]]) -> tuple[Estimate, dict[str, float]]:
    """What grids beside one another say of the energy (see `kinetic`) and of the peaks' errors."""
    cells = [summary.model.generatrix for _, summary in runs]
    energy = estimate_of_neighbours(cells, [kinetic(case, summary) for case, summary in runs])
    peaks = {
        name: estimate_of_neighbours(cells, [getattr(summary, name) for _, summary in runs]).error
        for name in PEAKS
        if all(getattr(summary, name) is not None for _, summary in runs)
    }
    return energy, peaks


def of_members(value: Callable[[_Run], float], members: Sequence[_Run], beside: Sequence[_Run]) -> tuple[float, float]:
    """Mean of shells of a grid, and its error: what another drop may differ, and how far the mean of a grid beside is off.

    Shells beside that do not stay round tell of the spread too.
    """
    others = [value(run) for run in beside]
    crumpled = any(run.out_of_round > OUT_OF_ROUND for run in beside)
    middle, error = prediction([value(run) for run in members], others if crumpled else ())
    return middle, max(error, OTHERS * abs(fmean(others) - middle)) if others else error


class _Refinement:
    def __init__(self, case: Case, tolerance: float, budget: float, report: Callable[[Trial], None] | None) -> None:
        self.case, self.tolerance, self.budget, self.report = case, tolerance, budget, report
        self.trials: list[Trial] = []
        self.best: _Found | None = None  # the last answer, for Ctrl-C
        self.diverged: Diverged | None = None  # the last one
        self.radius = 0.5 * case.shell.diameter
        self.free_fall = case.free_fall_velocity
        self.least = least_cells(case)
        self.spent = 0.0  # CPU s
        self.started = time.perf_counter()
        for fidelity in REFINED:
            Simulation(self.at(fidelity, SCREEN)).advance(most=0)  # compiling is no cost of a level

    def at(self, fidelity: Fidelity, cells: float) -> Case:
        """The case at a level, so many cells in a radius."""
        n1 = max(math.ceil(cells * self.case.shell.wall / self.radius - 1e-9), 8, self.least)
        return level(self.case, fidelity, n1, 8 * math.ceil(2.0 * math.pi * cells / 8.0))

    def drop(self, case: Case, seed: int = 0) -> _Run:
        """Run to the end. Raises Diverged, and CutOff where it meets time.end."""
        before = CLOCK()
        try:
            summary, out = probe(case, seed)
        finally:
            seconds = CLOCK() - before
            self.spent += seconds
        if summary.cut_off:
            self.record(case, None, None, seconds, "cut off by time.end")
            raise CutOff(case, summary)
        return _Run(case, summary, seed, out, seconds)

    def record(self, case: Case, value: float | None, error: float | None, seconds: float, verdict: str) -> None:
        grid = case.grid
        trial = Trial(case.model.fidelity, grid.generatrix, grid.hoop, value, error, seconds, verdict)
        self.trials.append(trial)
        if self.report is not None:
            self.report(trial)

    def lost(self, case: Case, diverged: Diverged) -> None:
        self.diverged = diverged
        self.record(case, None, None, diverged.summary.kernel_seconds, f"diverged: {str(diverged)[:60]}")

    def within(self, found: _Found, part: float = 1.0) -> bool:
        """Whether an answer is within a part of the allowed error."""
        speed, error = speed_range(found.energy, found.error)
        return error <= part * allowed(self.tolerance, speed, self.free_fall)

    def left(self) -> float:
        return self.budget - self.spent

    def refine(self) -> Refined:
        gas = level(self.case, "lumped", 8, 8)
        before = CLOCK()
        summary, _ = probe(gas)
        self.record(gas, None if summary.cut_off else speed_of(summary), None, CLOCK() - before, "no shell: for comparison only")
        try:
            return self.done(self.shell())
        except CutOff as cut:
            run = _Run(cut.case, cut.summary, 0, 0.0, 0.0)
            return self.done(_Found(run, kinetic(cut.case, cut.summary), math.inf, str(cut)))
        except KeyboardInterrupt:
            if self.best is None:
                raise
            found = self.done(replace(self.best, reason="interrupted; the best answer so far"))
            raise Interrupted(replace(found, summary=replace(found.summary, outcome="interrupted"))) from None

    def shell(self) -> _Found:
        """The answer of the axisymmetric shell where full ones stay round, else of an ensemble of full ones."""
        plain = None
        if self.case.model.scheme != "cell":  # which only the full shell knows
            plain = self.axisymmetric()
            if plain is None:
                assert self.diverged is not None
                raise self.diverged
        full, doubt = self.screen()
        if plain is None or any(run.out_of_round > OUT_OF_ROUND for run in full):
            return self.ensemble(full)
        found = self.beside(plain, full)
        return replace(found, error=math.inf, reason=f"{found.reason}; {doubt}") if doubt else found

    def axisymmetric(self) -> _Found | None:
        """Refine until grids beside one another, and one twice as fine, agree to a part of the error; None if all diverge.

        Neighbours alone may agree on their way to another limit.
        """
        runs: list[_Run] = []
        found, cells = None, list(CELLS)
        while True:
            if not cells:
                cells.append(FINER * runs[-1].cells * self.radius / self.case.shell.wall)
            run = self.round(cells.pop(0), COSTLIER["axisymmetric"] * runs[-1].seconds if runs else 0.0)
            if run is None:
                if not self.diverged or not cells or self.left() <= 0.0:
                    return found
                runs.clear()
                continue
            runs.append(run)
            found = self.agreed(runs[-NEIGHBOURS:])
            if len(runs) < NEIGHBOURS or not self.within(found, PART):
                continue
            beyond = self.round(TWICE * run.cells * self.radius / self.case.shell.wall, TWICE**3 * run.seconds)
            if beyond is None:
                return replace(found, error=math.inf, reason=f"{found.reason}; a finer one diverges") if self.diverged else found
            found = self.agreed([*runs[-NEIGHBOURS:], beyond])
            if self.within(found, PART):
                return found

    def round(self, cells: float, price: float) -> _Run | None:
        """Run the axisymmetric shell; None where it diverges, or its price (CPU s) is more than a quarter of what is left."""
        case, self.diverged = self.at("axisymmetric", cells), None
        if price > 0.25 * max(self.left(), 0.0):
            return None
        try:
            return self.drop(case)
        except Diverged as diverged:
            self.lost(case, diverged)
            return None

    def agreed(self, runs: Sequence[_Run]) -> _Found:
        """The answer of grids beside one another, recorded as a trial."""
        found = self.best = self.settled(runs)
        if len(runs) >= NEIGHBOURS:
            speed, error = speed_range(found.energy, found.error)
            verdict = "grids beside it agree" if self.within(found, PART) else "grids beside it do not agree yet"
            self.record(runs[-1].case, speed, error, runs[-1].seconds, verdict)
        return found

    def settled(self, runs: Sequence[_Run]) -> _Found:
        """Answer of the finest of grids beside one another, and how far it is from what they tend to."""
        finest = max(runs, key=lambda run: run.cells)
        energy = kinetic(finest.case, finest.summary)
        if len(runs) < NEIGHBOURS:
            return _Found(finest, energy, math.inf, f"{len(runs)} grids are no error bar")
        found, peaks = of_neighbours([(run.case, run.summary) for run in runs])
        reason = f"the axisymmetric shell on {len(runs)} grids beside one another"
        return _Found(finest, energy, found.error, reason, peaks, doubt=first_doubt(run.summary for run in runs))

    def screen(self) -> tuple[list[_Run], str]:
        """A disturbed full shell on a coarse grid, one on a finer one if it stays round there, another there; what is left open.

        Where the budget does not allow the last one, it is taken from the coarse grid.
        """
        runs: list[_Run] = []
        for cells, seed in ((SCREEN, 1), (FINE, 1), (FINE, 1 + len(SEEDS))):
            if any(run.out_of_round > OUT_OF_ROUND for run in runs):
                break
            price = runs[-1].seconds * (COSTLIER["full"] if len(runs) == 1 else 1.0) if runs else 0.0
            if len(runs) == 2 and price > self.left():
                cells, price = SCREEN, runs[0].seconds
            if runs and price > self.left():
                return runs, "whether it stays round takes more full shells than the budget allows"
            case = self.at("full", cells)
            try:
                run = self.drop(case, seed)
            except Diverged as diverged:
                self.lost(case, diverged)
                if cells == FINE:
                    return runs, "a finer full shell diverges"
                continue
            runs.append(run)
            grown = f"{SEEDS[(seed - 1) % len(SEEDS)]:g} R grows to {run.out_of_round:.2g} R"
            word = "not round" if run.out_of_round > OUT_OF_ROUND else "round"
            self.record(case, speed_of(run.summary), None, run.seconds, f"{word}: a disturbance of {grown}")
        return runs, ""

    def beside(self, plain: _Found, full: Sequence[_Run]) -> _Found:
        """The answer of the axisymmetric shell; its error takes up how far full shells are off it on their finest grid."""
        apart, peaks = 0.0, dict(plain.peaks)
        finest = max((run.cells for run in full), default=0)
        for run in [run for run in full if run.cells == finest]:
            try:
                twin = self.drop(level(self.case, "axisymmetric", run.cells, run.case.grid.hoop))
            except Diverged as diverged:
                self.lost(level(self.case, "axisymmetric", run.cells, run.case.grid.hoop), diverged)
                return replace(plain, error=math.inf, reason=f"{plain.reason}; it diverges on the grid of the full shells")
            apart = max(apart, OTHERS * abs(kinetic(run.case, run.summary) - kinetic(twin.case, twin.summary)))
            for name in peaks:
                off = OTHERS * abs(getattr(run.summary, name) - getattr(twin.summary, name))
                peaks[name] = max(peaks[name], plain.peaks[name] + off)
        if not full:
            return replace(plain, error=math.inf, reason=f"{plain.reason}; no full shell reaches its end beside it")
        found = replace(plain, error=plain.error + apart, peaks=peaks, reason=f"{plain.reason}; full shells stay round")
        found.doubt = found.doubt or first_doubt(run.summary for run in full)
        if not self.within(found):
            found.reason += ", but are off it" if apart > plain.error else ", but its grids do not agree"
        return found

    def ensemble(self, screened: Sequence[_Run]) -> _Found:
        """The mean of disturbed full shells on the finer one of two grids, the finer two that the budget allows several of.

        Where only the finer grid of the screen shows that a shell is not round, the coarser one tells how far that may be off.
        """
        finest = self.at("full", FINE).grid.generatrix
        rough, fine = ([run for run in screened if (run.cells == finest) == which] for which in (False, True))
        if not screened:
            assert self.diverged is not None
            raise self.diverged
        self.best = replace(self.mean(rough or fine, None), error=math.inf)
        if fine:
            return self.gather(FINE, fine, 1.0, self.mean(rough, None) if rough else None)
        cost = max(run.seconds for run in rough)
        affordable = len(SEEDS) * (1.0 + COSTLIER["full"]) * cost < self.left()
        first, second = (SCREEN, FINE) if affordable else (COARSE, SCREEN)
        if not affordable and cost * (COARSE / SCREEN) ** 3.5 > self.left():
            return self.best
        found = self.gather(first, rough if affordable else [], 0.3, None)
        return self.gather(second, [] if affordable else rough, 1.0, found)

    def gather(self, cells: float, members: list[_Run], part: float, coarser: _Found | None) -> _Found:
        """Mean of shells of a grid with those of a coarser one beside it; part: of the budget left, that they may take."""
        case, allowed, before = self.at("full", cells), part * self.left(), self.spent
        for seed in range(1, MOST_MEMBERS + 1):
            longest = max((run.seconds for run in members), default=0.0)
            enough = len(members) >= LEAST_MEMBERS and coarser is not None and self.within(self.mean(members, coarser))
            if enough or (members and self.spent - before + longest > allowed):
                break
            if any(run.seed == seed for run in members):
                continue
            try:
                members.append(self.drop(case, seed))
            except Diverged as diverged:
                self.lost(case, diverged)
        if not members:
            if coarser is not None:
                return replace(coarser, error=math.inf)
            assert self.diverged is not None
            raise self.diverged
        found = self.best = self.mean(members, coarser)
        speed, error = speed_range(found.energy, found.error)
        word = "within the tolerance" if self.within(found) else "not within the tolerance"
        bar = error if math.isfinite(error) and coarser is not None else None
        self.record(
            case, speed, bar, self.spent - before, f"mean of {len(members)}" + (f", {word}" if coarser is not None else "")
        )
        return found

    def mean(self, members: Sequence[_Run], coarser: _Found | None) -> _Found:
        """Mean of shells of a grid, with what another drop may differ from it and by how much a coarser grid's mean is off."""
        beside = coarser.members if coarser is not None else ()
        energy, error = of_members(lambda run: kinetic(run.case, run.summary), members, beside)
        nearest = min(members, key=lambda run: abs(kinetic(run.case, run.summary) - energy))
        bars = {
            name: of_members(lambda run, name=name: getattr(run.summary, name), members, beside)  # type: ignore[misc]
            for name in PEAKS
            if getattr(nearest.summary, name) is not None
        }
        speeds = [speed_of(run.summary) for run in members]
        sizes = [SEEDS[(run.seed - 1) % len(SEEDS)] for run in members]
        grid = nearest.case.grid
        return _Found(
            nearest,
            energy,
            error,
            f"{len(members)} full shells of {grid.generatrix} x {grid.hoop} cells"
            + (", which do not stay round" if any(run.out_of_round > OUT_OF_ROUND for run in members) else ""),
            {name: bar for name, (_, bar) in bars.items()},
            {name: middle for name, (middle, _) in bars.items()},
            Ensemble(len(members), min(speeds), max(speeds), min(sizes), max(sizes)),
            tuple(members),
            first_doubt(run.summary for run in [*members, *beside]),
        )

    def done(self, found: _Found) -> Refined:
        base, run = found.run.summary, found.run
        speed, error = speed_range(found.energy, found.error)
        within = self.within(found)
        reason = found.reason
        if found.ensemble is not None:
            nearest = "which stops" if base.impact_velocity is None else f"{base.impact_velocity:.4g} m/s"
            reason += f"; all but velocity and peaks is of the one nearest the mean, {nearest}"
            if not within:
                enough = found.ensemble.members >= LEAST_MEMBERS
                reason += (
                    "; this scene does not determine the impact velocity better"
                    if enough
                    else "; the budget allows no more of them"
                )
        impact = speed if found.energy > 0.0 else None
        ending = "impact" if impact is not None else "stopped" if base.outcome == "impact" else base.outcome  # of the mean
        summary = replace(
            _with_means(base, found.means),
            outcome=base.outcome if base.outcome == "time_limit" else ending,
            impact_time=base.impact_time if impact is not None else None,
            doubt=base.doubt or found.doubt,
            impact_velocity=impact,
            velocity_reduction=None if impact is None else base.free_fall_velocity - impact,
            impact_velocity_error=error if math.isfinite(error) else None,
            peak_errors={name: bar if math.isfinite(bar) else None for name, bar in found.peaks.items()},
            fidelity_reason=reason,
            trials=self.trials,
            ensemble=found.ensemble,
            wall_seconds=time.perf_counter() - self.started,
        )
        return Refined(run.case, summary, run.seed)


def _with_means(summary: Summary, means: dict[str, float]) -> Summary:
    """The answer of a member of an ensemble with the means of its peaks; times, places, other phases stay those of the member."""
    if not means:
        return summary
    margins = {}
    for name, of in (
        ("fabric_margin", ("peak_tension_generatrix", "peak_tension_hoop")),
        ("belt_margin", ("peak_tension_belt",)),
    ):
        margin: float | None = getattr(summary, name)
        if margin is not None:
            scale = max(getattr(summary, one) for one in of) / max(means[one] for one in of)
            margins[name] = (margin + 1.0) * scale - 1.0
    peaks = {name: replace(peak, value=means[name]) if name in means else peak for name, peak in summary.peaks.items()}
    return replace(summary, peaks=peaks, **means, **margins)  # type: ignore[arg-type]


def neighbours(case: Case) -> list[Summary]:
    """Answers on coarser grids, 0.57 to 0.83 as many cells both ways. ValueError where a grid is too coarse for that."""
    if case.model.fidelity == "lumped":
        raise ValueError("a lumped run has no grid, and so no error bar of one")
    coarser = []
    for ratio in RATIOS:
        n1, hoop = round(case.grid.generatrix * ratio), round(case.grid.hoop * ratio)
        if n1 < 4 or hoop < 8:
            raise ValueError(f"a grid of {case.grid.generatrix} x {case.grid.hoop} cells is too coarse for an error bar")
        coarser.append(probe(replace(case, grid=replace(case.grid, generatrix=n1, hoop=hoop)))[0])
    return coarser


def _with_error_bar(case: Case, summary: Summary, coarser: Sequence[Summary]) -> Summary:
    """The answer with the errors that its coarser neighbours show; none where one diverged."""
    if summary.outcome == "interrupted":
        return summary
    if not coarser:
        return replace(summary, fidelity_reason="no error bar: a coarser grid diverges")
    runs = [*coarser, summary]
    if any(run.cut_off for run in runs):
        return replace(summary, fidelity_reason="no error bar: a run ends before impact; raise time.end")
    found, peaks = of_neighbours([(case, run) for run in runs])
    _, error = speed_range(found.value, found.error)
    order = "no clear order" if found.order is None else f"order {found.order:g}"
    reason = f"four grids beside one another, {order}; of the grid alone"
    return replace(summary, impact_velocity_error=error, peak_errors=dict(peaks), fidelity_reason=reason, doubt=first_doubt(runs))


def probe(case: Case, seed: int = 0) -> tuple[Summary, float]:
    """Return the answer of a case, and how far a full shell got out of round, over the radius.

    seed: of a disturbance of its places, see `disturbance`; 0 for none.
    Raises Diverged, and KeyboardInterrupt at Ctrl-C.
    """
    falling = Simulation(case)
    if seed:
        falling.disturb(disturbance(case, seed), seed)
        settled = SETTLED * math.pi * case.shell.diameter * math.sqrt(case.fabric.areal_density / case.fabric.E22)
        falling.advance(settled)
        falling.state.peaks[:] = 0.0  # what the disturbance stretched is no load
    if case.model.fidelity != "full":
        summary = falling.to_end()
        if summary.outcome == "interrupted":
            raise KeyboardInterrupt
        return summary, 0.0
    largest, outcome = 0.0, Outcome.RUNNING
    interval = case.shell.height / case.cargo.velocity / SHOTS
    while outcome == Outcome.RUNNING:
        due = falling.now(History.TIME) + interval
        while outcome == Outcome.RUNNING and falling.now(History.TIME) < due:
            _, outcome = falling.advance(due, falling.most)
        if outcome == Outcome.RUNNING:  # at the end all is crushed
            largest = max(largest, falling.lopsided())
    return falling.finish(outcome), largest / (0.5 * case.shell.diameter)
