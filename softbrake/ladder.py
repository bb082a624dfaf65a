"""The cheapest model that is good enough: from gas alone over the axisymmetric shell to the full one, on evidence.

A level is left only where something speaks against it: a grid that has not converged, an answer that hangs on the grid or on a
disturbance too small to matter, a full shell that does not stay round. What was tried stands in the table of rungs.
"""

from __future__ import annotations

import math
import statistics
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

from softbrake import drop
from softbrake.build import in_halves
from softbrake.case import Case, Fidelity, LongStep, auto_courant, long_steps
from softbrake.convergence import Estimate, estimate
from softbrake.drop import Diverged, Drop, Progress, compile_kernels, kernels_of
from softbrake.keys import CONTACT_SETS, UNKNOWN_CONTACT
from softbrake.state import History, Outcome
from softbrake.summary import Rung, Summary

ROUND = 720  # cells around the hoop of an axisymmetric shell: no cost but in the result file; 1e-5 short of the circle's area
COURANT = 0.9  # where runs are to be compared at one; a climb takes `auto`
BUDGET = 60.0  # s
COARSEST = 18  # cells along the generatrix
DOUBLINGS = 6
PROBE = 36  # cells along the generatrix of the full shell that is asked whether it stays round, and half of those around it
# Of the radius, disturbances of the places at the start: from what sewing leaves to what nobody could measure. No case says how
# round its shell is, and where symmetry is lost the answer hangs on when, so an ensemble takes one of each.
SEEDS = (1e-3, 1e-4, 1e-5, 1e-6)
DOUBTFUL = 10.0  # times a disturbance: a shell that is round but let it grow by more is asked on a finer grid
FINER = 10.0  # times the seconds of a full shell, for one on twice as fine a grid
OUT_OF_ROUND = 0.05  # of the radius: more, and the shell is not axisymmetric; its square, 0.25 %, is what the answer feels
STEPPED = 1.5  # refinement of the full shell
LEAST_SPEED = 0.05  # of the free-fall velocity: tolerances of smaller impact velocities are parts of this
PEAKS = ("peak_deceleration", "peak_tension_generatrix", "peak_tension_hoop", "peak_tension_belt")
PART_UNMOVED = 0.5  # of the allowed error, for grid and loss of symmetry together where the axisymmetric shell is to stand for it
STALLED = 0.44  # times the scatter on a grid 2.25 times as coarse, first order: if it falls less, finer grids are no help
NO_COMPANION = "no error bar: a coarser grid diverges"
BESIDE = 0.2  # of the budget left, for an axisymmetric shell that only tells which grid resolves the scene
SHOTS = 100  # looks at how round the shell is
CLIMBED: tuple[Fidelity, ...] = ("lumped", "axisymmetric", "full")


@dataclass(frozen=True)
class Climb:
    """Where the climb ended."""

    case: Case  # of the level and grid chosen
    summary: Summary  # of its run, with velocity, peaks, errors, reason, rungs and wall seconds of the climb
    seed: int = 0  # of the run's disturbance, see `disturbance`; 0 for none


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a climb that has an answer already; `found` holds it, with outcome "interrupted"."""

    def __init__(self, found: Climb) -> None:
        super().__init__()
        self.found = found


class CutOff(Exception):
    """A run of a climb met `time.end` above the ground: it has no answer."""

    def __init__(self, case: Case, summary: Summary) -> None:
        super().__init__(f"the run ends before impact, at time.end = {case.time.end:g} s, and has no answer; raise time.end")
        self.case, self.summary = case, summary


def climb(case: Case, tolerance: float, budget: float = BUDGET, report: Callable[[Rung], None] | None = None) -> Climb:
    """Find the cheapest level and grid whose impact velocity is within a tolerance, relative. The Courant number is `auto`.

    budget (s): no rung is begun that would take more, from what the last one took. report: told each rung as it is done.
    Raises Interrupted at Ctrl-C once there is an answer, Diverged where no grid of the level wanted has one.
    """
    return _Climber(case, tolerance, budget, report).climb()


def run(
    case: Case,
    results: str | Path | None = None,
    progress: Callable[[Progress], None] | None = None,
    *,
    budget: float = BUDGET,
    report: Callable[[Rung], None] | None = None,
    with_error_bar: bool = False,
) -> Summary:
    """Run a drop to impact, full stop or `time.end` and return its answer.

    A case with a tolerance, or with `model.fidelity: auto`, is climbed first; `ladder` and `impact_velocity_error` of the answer
    then say how far it got, and the result file holds one run of the level chosen: of an ensemble the member nearest the answer.
    Else `with_error_bar` asks for two coarser companions. Ctrl-C during a climb, or while its result file is written, gives
    outcome "interrupted" and what was found. Warns (LongStep) of a `time.courant` above 1. Other arguments and errors as of
    `climb` and `drop.run`; ValueError where a grid is too coarse for companions.
    """
    if case.tolerance is not None:
        try:
            found = climb(case, case.tolerance, budget, report)
        except Interrupted as interrupted:
            return interrupted.found.summary
        return found.summary if results is None else _write(found, results, progress)
    if said := long_steps([case]):
        warnings.warn(said, LongStep, stacklevel=2)
    if not with_error_bar:
        return drop.run(case, results, progress)
    try:
        coarser = companions(case)
    except Diverged:
        return drop.run(case, results, progress, lambda summary: replace(summary, fidelity_reason=NO_COMPANION))
    return drop.run(case, results, progress, lambda summary: _with_error_bar(summary, coarser))


def _write(found: Climb, results: str | Path, progress: Callable[[Progress], None] | None) -> Summary:
    """Run the drop of a climb once more for the result file, disturbed as it was."""
    answer = found.summary
    disturbed = (disturbance(found.case, found.seed), found.seed) if found.seed else None
    try:
        kept = drop.run(found.case, results, progress, lambda summary: _with_errors(summary, answer), disturbed)
    except Diverged as diverged:
        reason = f"{answer.fidelity_reason}; the run that was to fill the result file diverged"
        return replace(answer, results=diverged.summary.results, fidelity_reason=reason)
    if kept.outcome == "interrupted":
        return replace(kept, fidelity_reason="interrupted while the result file was written", ladder=answer.ladder)
    return kept


def reached(case: Case, summary: Summary) -> bool:
    """Whether the answer of a climb is within the case's tolerance."""
    return case.tolerance is None or (
        summary.impact_velocity_error is not None
        and summary.impact_velocity_error <= allowed(case.tolerance, speed_of(summary), summary.free_fall_velocity)
    )


def allowed(tolerance: float, speed: float, free_fall: float) -> float:
    """Allowed error (m/s) of an impact velocity; that of a small one is a part of the free-fall velocity."""
    return tolerance * max(speed, LEAST_SPEED * free_fall)


def _with_errors(summary: Summary, climbed: Summary) -> Summary:
    """A run of the level chosen, with the answer of the climb; filtered peaks are those of the run."""
    wall_seconds = climbed.wall_seconds + summary.wall_seconds
    return replace(
        climbed,
        results=summary.results,
        wall_seconds=wall_seconds,
        kernel_seconds=summary.kernel_seconds,
        filtered=summary.filtered,
    )


def least_cells(case: Case) -> int:
    """Cells along the generatrix that keep the belts half a cell off the covers."""
    nearest = min((min(b.height, case.shell.height - b.height) - b.width / 2 for b in case.belts), default=math.inf)
    return math.ceil(0.5 * case.shell.height / nearest + 1e-9)


def speed_of(summary: Summary) -> float:
    """Impact velocity (m/s); 0 where the cargo does not reach the ground."""
    return summary.impact_velocity or 0.0


def disturbance(case: Case, seed: int) -> float:
    """Size (m) of the disturbance of a seed, 1 and up."""
    return SEEDS[(seed - 1) % len(SEEDS)] * 0.5 * case.shell.diameter


def level(case: Case, fidelity: Fidelity, generatrix: int, hoop: int, courant: float | None = None) -> Case:
    """The case at another level and grid, with the contact that this level knows; courant: None for `auto`."""
    contact = case.contact
    if fidelity == "axisymmetric" and "folds" in contact and "axis" not in contact:
        contact = tuple(part for part in CONTACT_SETS["full"] if part in (*contact, "axis"))
    contact = tuple(part for part in contact if part not in UNKNOWN_CONTACT[fidelity])
    grid = replace(case.grid, generatrix=generatrix, hoop=hoop)
    if courant is None:
        courant = auto_courant(case.shell, case.fabric, grid)
    return replace(
        case,
        contact=contact,
        grid=grid,
        time=replace(case.time, courant=courant),
        model=replace(case.model, fidelity=fidelity, sector=None),
        tolerance=None,
    )


@dataclass
class _Found:
    """Best answer of a level."""

    case: Case
    summary: Summary
    value: float  # m/s
    error: float  # m/s
    peaks: dict[str, float] = field(default_factory=dict)  # estimated errors
    grids: int = 0  # behind the error
    stalled: bool = False  # three grids were run, and their differences no longer fall: a finer one is no help
    seed: int = 0  # of the run's disturbance
    means: dict[str, float] = field(default_factory=dict)  # of an ensemble's peaks


class _Climber:
    def __init__(self, case: Case, tolerance: float, budget: float, report: Callable[[Rung], None] | None) -> None:
        self.case, self.tolerance, self.budget, self.report = case, tolerance, budget, report
        self.rungs: list[Rung] = []
        self.diverged: Diverged  # the last one
        self.apart = 0.0  # m/s, by which a disturbance of the full shell moves the axisymmetric answer
        self.best: _Found | None = None  # the last answer, for Ctrl-C
        self.free_fall = math.sqrt(case.cargo.velocity**2 + 2.0 * case.gravity * case.shell.height)
        self.least = least_cells(case)
        self.coarsest = max(COARSEST, self.least)
        for fidelity in CLIMBED:
            Drop(level(case, fidelity, self.coarsest, 2 * self.coarsest)).advance(most=0)  # compiling is no cost of a level
        self.start = time.perf_counter()

    def allowed(self, value: float) -> float:
        """Allowed error (m/s) of an impact velocity."""
        return allowed(self.tolerance, value, self.free_fall)

    def left(self) -> float:
        return self.budget - (time.perf_counter() - self.start)

    def book(self, case: Case, value: float | None, error: float | None, seconds: float, verdict: str) -> None:
        grid = case.grid
        rung = Rung(case.model.fidelity, grid.generatrix, grid.hoop, value, error, seconds, verdict)
        self.rungs.append(rung)
        if self.report is not None:
            self.report(rung)

    def keep(self, found: _Found) -> _Found:
        self.best = found
        return found

    def timed(self, case: Case, seed: int = 0) -> tuple[Summary, float]:
        """Answer of a run and its seconds. Raises Diverged, and CutOff where it meets time.end."""
        summary, seconds = _timed(case, seed)
        self.check(case, summary, seconds)
        return summary, seconds

    def check(self, case: Case, summary: Summary, seconds: float) -> None:
        if summary.outcome == "time_limit":
            self.book(case, None, None, seconds, "cut off by time.end")
            raise CutOff(case, summary)

    def climb(self) -> Climb:
        gas = level(self.case, "lumped", self.coarsest, ROUND)
        summary, seconds = _timed(gas)
        there = summary.outcome != "time_limit"
        self.book(gas, speed_of(summary) if there else None, None, seconds, "no shell: for comparison only")
        try:
            return self.shell()
        except CutOff as cut:
            return self.done(_Found(cut.case, cut.summary, 0.0, math.inf), str(cut))
        except KeyboardInterrupt:
            if self.best is None:
                raise
            found = self.done(self.best, "interrupted; the best answer so far")
            raise Interrupted(replace(found, summary=replace(found.summary, outcome="interrupted"))) from None

    def shell(self) -> Climb:
        """Climb from the axisymmetric shell on."""
        reason, found, unmoved = "only the full shell has the printed scheme", None, False
        if self.case.model.scheme != "cell":
            reason, unmoved = self.out_of_round()
            found = self.axisymmetric(BESIDE if reason else 1.0, PART_UNMOVED if unmoved else 1.0)
        if not reason:
            if found is None:
                raise self.diverged
            reason = "the full shell stays round"
            if found.error > self.allowed(found.value) and found.grids == 3:
                found = self.spread(found)
        elif unmoved and found is not None and found.error <= PART_UNMOVED * self.allowed(found.value):
            reason = f"the full shell does not stay round, but that moves the answer by {self.apart:.2g} m/s at most"
        else:
            settled = found is not None and found.error <= self.allowed(found.value)
            found = self.full(found.value if found is not None and settled else None)
        within = found.error <= self.allowed(found.value)
        return self.done(found, f"{reason}{', and ' if within else '; '}{self.in_words(found, within)}")

    def axisymmetric(self, part: float, share: float) -> _Found | None:
        """Double the grid until answers settle, index of three grids, or until a part of the budget left is used.

        share: of the allowed error that is to be met. None where all diverge.
        """
        found: list[Summary] = []
        cells, best = self.coarsest, None
        for _ in range(DOUBLINGS + 1):
            case = level(self.case, "axisymmetric", cells, ROUND)
            started = time.perf_counter()
            try:
                summary, last = self.timed(case)
            except Diverged as diverged:
                last = self.lost(case, diverged, started)
                found.clear()
            else:
                found.append(summary)
                value = speed_of(summary)
                if len(found) < 3:
                    self.book(case, value, None, last, "three grids are wanted for an error")
                    best = self.keep(_Found(case, summary, value, math.inf))
                else:
                    best = self.keep(self.settled(case, found[-3:], share))
                    within = best.error <= share * self.allowed(value)
                    self.book(case, value, best.error, last, "within the tolerance" if within else "not settled")
                    if within:
                        return best
            if 10.0 * last > part * self.left():
                break
            cells *= 2
        return best

    def lost(self, case: Case, diverged: Diverged, started: float) -> float:
        """Book a run that diverged. Returns its seconds."""
        self.diverged = diverged
        seconds = time.perf_counter() - started
        self.book(case, None, None, seconds, f"diverged: {str(diverged)[:60]}")
        return seconds

    def settled(self, case: Case, summaries: Sequence[Summary], share: float) -> _Found:
        """Answer and error of the finest of three grids; two grids beside it tell whether it is an accident of the grid."""
        value = speed_of(summaries[-1])
        error = _estimate(summaries, "impact_velocity").error
        stalled = math.isinf(error)
        if error + self.apart <= share * self.allowed(value):
            cells = case.grid.generatrix
            for beside in (round(0.85 * cells), round(0.93 * cells)):
                try:
                    summary, _ = self.timed(level(self.case, "axisymmetric", max(beside, self.least), ROUND))
                except Diverged:
                    error = math.inf
                else:
                    error = max(error, abs(speed_of(summary) - value))
        peaks = {name: _estimate(summaries, name).error for name in PEAKS if getattr(summaries[-1], name) is not None}
        return _Found(case, summaries[-1], value, error + self.apart, peaks, 3, stalled)

    def spread(self, best: _Found) -> _Found:
        """The answer of an ensemble: disturbed shells on grids about the finest that the budget allows several times.

        The error is their spread and by how much their mean is off the finest shell, best.
        """
        cells = best.case.grid.generatrix
        cost = self.rungs[-1].seconds
        while 12.0 * cost > max(self.left(), 1.0) and cells > 2 * self.coarsest:
            cells //= 2
            cost /= 8.0
        started = time.perf_counter()
        runs = []
        for seed, share in enumerate((0.8, 0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2)):
            case = level(self.case, "axisymmetric", max(round(share * cells), self.least), ROUND)
            try:
                runs.append((case, self.timed(case, seed + 1)[0]))
            except Diverged as diverged:
                self.lost(case, diverged, started)
                return best
        found = self.ensemble(runs)
        error = found.error + abs(found.value - best.value) + self.apart
        within = error <= self.allowed(found.value)
        verdict = f"mean of {len(runs)} disturbed shells on grids about this one" + ("" if within else "; they do not agree")
        seconds = time.perf_counter() - started
        self.book(level(self.case, "axisymmetric", cells, ROUND), found.value, error, seconds, verdict)
        peaks = {name: found.peaks[name] + abs(found.means[name] - getattr(best.summary, name)) for name in found.peaks}
        return self.keep(replace(found, error=error, peaks=peaks, stalled=best.stalled))

    def ensemble(self, runs: Sequence[tuple[Case, Summary]]) -> _Found:
        """Means of disturbed runs, seeds from 1 on, and twice their standard deviations; the member nearest the mean."""
        values = [speed_of(summary) for _, summary in runs]
        mean = statistics.mean(values)
        nearest = min(range(len(runs)), key=lambda member: abs(values[member] - mean))
        case, summary = runs[nearest]
        peaks = {name: [getattr(one, name) for _, one in runs] for name in PEAKS if getattr(summary, name) is not None}
        return _Found(
            case,
            summary,
            mean,
            2.0 * statistics.stdev(values),
            {name: 2.0 * statistics.stdev(those) for name, those in peaks.items()},
            seed=nearest + 1,
            means={name: statistics.mean(those) for name, those in peaks.items()},
        )

    def out_of_round(self) -> tuple[str, bool]:
        """Ask the full shell, disturbed, whether it stays round: why it does not, "" if it does, errors then take up its move.

        A coarse grid may hide what a finer one shows: if it lets the disturbance grow much, twice as fine a grid is asked. Also
        returns whether the answer of a shell that does not stay round is that of a round one nevertheless.
        """
        cells = max(PROBE, self.coarsest)
        for n1 in (cells, 2 * cells):
            case = self.whole(n1)
            started = time.perf_counter()
            reason, part = self.not_round(case)
            seconds = time.perf_counter() - started
            if reason:
                return reason, n1 == cells and OUT_OF_ROUND < part < math.inf and self.unmoved(cells, seconds)
            if part <= DOUBTFUL * SEEDS[0]:
                break
            if n1 == cells and FINER * seconds > self.left():
                return "whether the shell stays round takes a finer grid than the budget allows", False
        return "", False

    def whole(self, cells: int) -> Case:
        """The full shell on a grid. The kernel of a large one is another to compile, which is no cost of a rung."""
        case = level(self.case, "full", cells, 2 * cells)
        if in_halves(cells, 2 * cells):
            started = time.perf_counter()
            compile_kernels(kernels_of([case]))
            self.start += time.perf_counter() - started
        return case

    def not_round(self, case: Case) -> tuple[str, float]:
        """Say why a full shell is not round, "" if it is; and how far it gets out of round, over the radius."""
        cells = case.grid.generatrix
        started = time.perf_counter()
        try:
            probed, lopsided = probe(case)
            seconds = time.perf_counter() - started
            self.check(case, probed, seconds)
            twin, _ = self.timed(level(self.case, "axisymmetric", cells, 2 * cells))
        except Diverged as diverged:
            self.lost(case, diverged, started)
            return "the shell diverges on a coarse grid", math.inf
        value = speed_of(probed)
        self.apart = abs(value - speed_of(twin))
        part = lopsided / (0.5 * self.case.shell.diameter)
        grown = f"a disturbance of {SEEDS[0]:g} R grows to {lopsided * 1e3:.2g} mm and moves the answer by {self.apart:.2g} m/s"
        if part > OUT_OF_ROUND:
            self.book(case, value, None, seconds, f"not round: {grown}")
            return "the shell does not stay round", part
        if self.apart > self.allowed(value):
            self.book(case, value, None, seconds, f"touchy: {grown}")
            return "the shell stays round, but what sewing leaves moves its answer by more than the tolerance", part
        self.book(case, value, None, seconds, f"round: {grown}")
        return "", part

    def unmoved(self, cells: int, seconds: float) -> bool:
        """Whether full shells that lose their symmetry answer as the axisymmetric one: every seed, and one on a finer grid.

        Within half the part of the allowed error that they and the grid may take up together. seconds: of one such shell.
        """
        allowed = 0.5 * PART_UNMOVED * self.allowed(self.rungs[-1].impact_velocity or 0.0)
        for n1, seed in ((cells, 2), (cells, 3), (cells, 4), (2 * cells, 1)):
            if self.apart > allowed or (seconds if n1 == cells else FINER * seconds) > self.left():
                return False
            case = self.whole(n1)
            started = time.perf_counter()
            try:
                summary, _ = self.timed(case, seed)
                twin, _ = self.timed(level(self.case, "axisymmetric", n1, 2 * n1))
            except Diverged as diverged:
                self.lost(case, diverged, started)
                return False
            value = speed_of(summary)
            apart = abs(value - speed_of(twin))
            verdict = f"a disturbance of {SEEDS[seed - 1]:g} R moves the answer by {apart:.2g} m/s"
            self.book(case, value, None, time.perf_counter() - started, verdict)
            self.apart = max(self.apart, apart)
            allowed = 0.5 * PART_UNMOVED * self.allowed(value)
        return self.apart <= allowed

    def full(self, settled: float | None) -> _Found:
        """Refine ensembles of disturbed full shells: the error is their spread and that of the grid.

        The latter is by how much the mean moved over the last two of three grids, which at second order and refinement by 1.5
        is the index of `convergence`: two grids may agree by accident. settled: answer (m/s) of the axisymmetric shell where it
        has one. A grid on which that shell is off by more has not resolved the scene, however well full shells agree on it.
        """
        cells = float(max(24, self.coarsest))
        found: list[_Found] = []
        best = None
        while True:
            n1 = round(cells)
            case = self.whole(n1)
            runs, started = [], time.perf_counter()
            for seed in range(len(SEEDS)):
                try:
                    runs.append((case, self.timed(case, seed + 1)[0]))
                except Diverged as diverged:
                    self.diverged = diverged
            seconds = time.perf_counter() - started
            if len(runs) < len(SEEDS):
                self.book(case, None, None, seconds, f"{len(SEEDS) - len(runs)} of {len(SEEDS)} diverged")
            else:
                found = [*found[-2:], self.ensemble(runs)]
                best = self.keep(self.of_grids(case, found, settled))
                scatter, allowed = found[-1].error, self.allowed(best.value)
                within = best.error <= allowed
                far = f", grid ±{best.error - scatter:.2g} m/s" if best.grids == 3 else "; three grids are wanted"
                word = "within the tolerance" if within else f"spread ±{scatter:.2g} m/s{far}"
                self.book(case, best.value, best.error if math.isfinite(best.error) else None, seconds, word)
                if within or (best.stalled and best.error < 2.0 * scatter):
                    return best
            if STEPPED**3.5 * seconds > self.left():
                break
            cells *= STEPPED
        if best is None:
            raise self.diverged
        return best

    def of_grids(self, case: Case, found: Sequence[_Found], settled: float | None) -> _Found:
        """The finest of up to three ensembles, with the error of the grid."""
        last = found[-1]
        if len(found) < 3:
            return replace(last, error=math.inf, peaks=dict.fromkeys(last.peaks, math.inf), grids=len(found))
        moved = max(abs(b.value - a.value) for a, b in pairwise(found))
        peaks = {
            name: last.peaks[name] + max(abs(b.means[name] - a.means[name]) for a, b in pairwise(found)) for name in last.peaks
        }
        stalled = last.error > max(self.allowed(last.value), STALLED * found[0].error)
        return replace(last, error=last.error + max(moved, self.unresolved(case, settled)), peaks=peaks, grids=3, stalled=stalled)

    def unresolved(self, case: Case, settled: float | None) -> float:
        """By how much the axisymmetric shell on the grid of a case is off its settled answer (m/s)."""
        if settled is None:
            return 0.0
        try:
            summary, _ = self.timed(level(self.case, "axisymmetric", case.grid.generatrix, case.grid.hoop))
        except Diverged:
            return math.inf
        return abs(speed_of(summary) - settled)

    def in_words(self, found: _Found, within: bool) -> str:
        if within and not found.stalled:
            return "the answer is within the tolerance"
        if found.stalled:
            better = f" better than ±{found.error:.2g} m/s" if math.isfinite(found.error) else ""
            allows = " (the tolerance allows that)" if within else ""
            word = "viscosity, damping of the gas or narrower belts would"
            return f"this scene does not determine the impact velocity{better} on the grids tried; {word}{allows}"
        return "the budget does not reach the tolerance"

    def done(self, found: _Found, reason: str) -> Climb:
        base = found.summary
        impact = found.value if base.impact_velocity is not None else None
        if found.seed:
            reason += f"; all but velocity and peaks is of the run nearest the mean, {speed_of(base):.4g} m/s"
        summary = replace(
            _with_means(base, found.means),
            impact_velocity=impact,
            velocity_reduction=None if impact is None else base.free_fall_velocity - impact,
            impact_velocity_error=found.error if math.isfinite(found.error) else None,
            peak_errors={name: error if math.isfinite(error) else None for name, error in found.peaks.items()},
            fidelity_reason=reason,
            ladder=self.rungs,
            wall_seconds=time.perf_counter() - self.start,
        )
        return Climb(found.case, summary, found.seed)


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


def companions(case: Case) -> list[Summary]:
    """Answers on grids 2.25 and 1.5 times as coarse both ways. ValueError where a grid is too coarse for that."""
    coarser = []
    for ratio in (2.25, 1.5):
        n1, hoop = round(case.grid.generatrix / ratio), round(case.grid.hoop / ratio)
        sector = case.model.sector
        if sector is not None:
            sector = max(round(sector / ratio), 1)
            hoop = sector * (case.grid.hoop // (case.model.sector or 1))
        if n1 < 4 or hoop < 8:
            raise ValueError(f"a grid of {case.grid.generatrix} x {case.grid.hoop} cells is too coarse for an error bar")
        grid = replace(case.grid, generatrix=n1, hoop=hoop)
        coarser.append(_timed(replace(case, grid=grid, model=replace(case.model, sector=sector)))[0])
    return coarser


def _with_error_bar(summary: Summary, coarser: Sequence[Summary]) -> Summary:
    """The answer with the errors that its coarser companions show."""
    runs = [*coarser, summary]
    ratio = refinement(runs)
    velocity = _estimate(runs, "impact_velocity", ratio)
    peaks = {name: _estimate(runs, name, ratio).error for name in PEAKS if getattr(summary, name) is not None}
    outcomes = {run.outcome for run in runs}
    if math.isfinite(velocity.error):
        order = "no observed order" if velocity.order is None else f"observed order {velocity.order:.2g}"
        reason = f"grid convergence index of three grids, {order}"
    elif "time_limit" in outcomes:
        reason = "no error bar: a run ends before impact; raise time.end"
    elif len(outcomes) > 1:
        reason = "no error bar: the cargo meets the ground on some of three grids only"
    else:
        reason = "no error bar: differences between three grids do not fall as they should"
    return replace(
        summary,
        impact_velocity_error=velocity.error if math.isfinite(velocity.error) else None,
        peak_errors={name: error if math.isfinite(error) else None for name, error in peaks.items()},
        fidelity_reason=reason,
    )


def refinement(runs: Sequence[Summary]) -> float:
    """Least refinement from one grid to the next, as rounded: the bars are the larger for it."""
    return min(
        min(fine.model.generatrix / coarse.model.generatrix, fine.model.hoop / coarse.model.hoop)
        for coarse, fine in pairwise(runs)
    )


def _timed(case: Case, seed: int = 0) -> tuple[Summary, float]:
    """Run a case without a file, its places disturbed if there is a seed, 1 and up. Returns its answer and the seconds."""
    started = time.perf_counter()
    falling = Drop(case)
    if seed:
        falling.disturb(disturbance(case, seed), seed)
    summary = falling.run(None, None)
    if summary.outcome == "interrupted":
        raise KeyboardInterrupt
    return summary, time.perf_counter() - started


def probe(case: Case) -> tuple[Summary, float]:
    """Answer of a disturbed full shell, and how far it got out of round (m). Raises Diverged."""
    falling = Drop(case)
    falling.disturb(disturbance(case, 1), 1)
    largest, outcome = 0.0, Outcome.RUNNING
    interval = case.shell.height / case.cargo.velocity / SHOTS
    while outcome == Outcome.RUNNING:
        due = falling.now(History.TIME) + interval
        while outcome == Outcome.RUNNING and falling.now(History.TIME) < due:
            _, outcome = falling.advance(due)
        if outcome == Outcome.RUNNING:  # at the end all is crushed
            largest = max(largest, falling.lopsided())
    return falling.finish(outcome), largest


def _estimate(summaries: Sequence[Summary], name: str, ratio: float = 2.0) -> Estimate:
    """Error of the finest of three; no bound where they end otherwise. A cargo that stops has an impact velocity of 0."""
    coarse, medium, fine = (getattr(summary, name) or 0.0 for summary in summaries)
    if len({summary.outcome for summary in summaries}) > 1 or summaries[-1].outcome == "time_limit":
        return Estimate(fine, None, None, math.inf, False)
    return estimate(coarse, medium, fine, ratio)
