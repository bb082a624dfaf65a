"""The cheapest model that is good enough: from gas alone over the axisymmetric shell to the full one, on evidence.

A level is left only where something speaks against it: a grid that has not converged, an answer that hangs on the grid or on a
disturbance too small to matter, a full shell that does not stay round. What was tried stands in the table of rungs.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from softbrake import drop
from softbrake.case import Case, Fidelity
from softbrake.convergence import Estimate, estimate
from softbrake.drop import Diverged, Drop, Progress
from softbrake.keys import CONTACT_SETS, UNKNOWN_CONTACT
from softbrake.state import History, Outcome
from softbrake.summary import Rung, Summary

ROUND = 720  # cells around the hoop of an axisymmetric shell: no cost but in the result file; 1e-5 short of the circle's area
COURANT = 0.9
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
BESIDE = 0.2  # of the budget left, for an axisymmetric shell that only tells which grid resolves the scene
SHOTS = 100  # looks at how round the shell is
CLIMBED: tuple[Fidelity, ...] = ("lumped", "axisymmetric", "full")


@dataclass(frozen=True)
class Climb:
    """Where the climb ended."""

    case: Case  # of the level and grid chosen
    summary: Summary  # of its run, with velocity, errors, reason and rungs of the climb


def climb(case: Case, tolerance: float, budget: float = BUDGET, report: Callable[[Rung], None] | None = None) -> Climb:
    """Find the cheapest level, grid and Courant number whose impact velocity is within a tolerance, relative.

    budget (s): no rung is begun that would take more, from what the last one took. report: told each rung as it is done.
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
    then say how far it got, and the result file holds one run of the level chosen. Else `with_error_bar` asks for two coarser
    companions. Other arguments and errors as of `climb` and `drop.run`; ValueError where a grid is too coarse for companions.
    """
    if case.tolerance is not None:
        found = climb(case, case.tolerance, budget, report)
        if results is not None:
            drop.run(found.case, results, progress, lambda summary: _with_errors(summary, found.summary))
            return replace(found.summary, results=str(results))
        return found.summary
    coarser = companions(case) if with_error_bar else []
    return drop.run(case, results, progress, (lambda summary: _with_error_bar(summary, coarser)) if coarser else None)


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
    """A run of the level chosen, with the answer of the climb."""
    return replace(climbed, results=summary.results, wall_seconds=summary.wall_seconds, kernel_seconds=summary.kernel_seconds)


def least_cells(case: Case) -> int:
    """Cells along the generatrix that keep the belts half a cell off the covers."""
    nearest = min((min(b.height, case.shell.height - b.height) - b.width / 2 for b in case.belts), default=math.inf)
    return math.ceil(0.5 * case.shell.height / nearest + 1e-9)


def speed_of(summary: Summary) -> float:
    """Impact velocity (m/s); 0 where the cargo does not reach the ground."""
    return summary.impact_velocity or 0.0


def level(case: Case, fidelity: Fidelity, generatrix: int, hoop: int, courant: float = COURANT) -> Case:
    """The case at another level and grid, with the contact that this level knows."""
    contact = case.contact
    if fidelity == "axisymmetric" and "folds" in contact and "axis" not in contact:
        contact = tuple(part for part in CONTACT_SETS["full"] if part in (*contact, "axis"))
    contact = tuple(part for part in contact if part not in UNKNOWN_CONTACT[fidelity])
    return replace(
        case,
        contact=contact,
        grid=replace(case.grid, generatrix=generatrix, hoop=hoop),
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
    sensitive: bool = False


class _Climber:
    def __init__(self, case: Case, tolerance: float, budget: float, report: Callable[[Rung], None] | None) -> None:
        self.case, self.tolerance, self.budget, self.report = case, tolerance, budget, report
        self.rungs: list[Rung] = []
        self.apart = 0.0  # m/s, by which a disturbance of the full shell moves the answer of a round one
        self.free_fall = math.sqrt(case.cargo.velocity**2 + 2.0 * case.gravity * case.shell.height)
        self.coarsest = max(COARSEST, least_cells(case))
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

    def climb(self) -> Climb:
        gas = level(self.case, "lumped", self.coarsest, ROUND)
        summary, seconds = _timed(gas)
        self.book(gas, speed_of(summary), None, seconds, "no shell: for comparison only")
        reason, found = None, None
        if self.case.model.scheme == "cell":
            reason = "only the full shell has the printed scheme"
        else:
            reason = self.out_of_round()
            found = self.axisymmetric(1.0 if reason is None else BESIDE)
        if reason is None:
            if found is None:
                raise ValueError("the axisymmetric shell diverges on every grid")
            reason = "the full shell stays round"
            if found.error > self.allowed(found.value):
                found = self.spread(found)
        else:
            settled = found is not None and found.error <= self.allowed(found.value)
            found = self.full(found.value if found is not None and settled else None)
        within = found.error <= self.allowed(found.value)
        return self.done(found, f"{reason}{', and ' if within else '; '}{self.in_words(found, within)}")

    def axisymmetric(self, part: float) -> _Found | None:
        """Double the grid until answers settle, index of three grids, or until a part of the budget left is used.

        None where all diverge.
        """
        found: list[tuple[int, Summary]] = []
        cells, last = self.coarsest, 0.0
        best = None
        for _ in range(DOUBLINGS + 1):
            case = level(self.case, "axisymmetric", cells, ROUND)
            try:
                summary, last = _timed(case)
            except Diverged as diverged:
                self.book(case, None, None, 0.0, f"diverged: {str(diverged)[:60]}")
                found.clear()
                cells *= 2
                continue
            found.append((cells, summary))
            value = speed_of(summary)
            if len(found) < 3:
                self.book(case, value, None, last, "three grids are wanted for an error")
                best = _Found(case, summary, value, math.inf)
            else:
                best = self.settled(case, [summary for _, summary in found[-3:]])
                within = best.error <= self.allowed(value)
                self.book(case, value, best.error, last, "within the tolerance" if within else "not settled")
                if within:
                    return best
            if 10.0 * last > part * self.left():
                break
            cells *= 2
        return best

    def settled(self, case: Case, summaries: Sequence[Summary]) -> _Found:
        """Answer and error of the finest of three grids; two grids beside it tell whether it is an accident of the grid."""
        value = speed_of(summaries[-1])
        error = _estimate(summaries, "impact_velocity").error
        if error + self.apart <= self.allowed(value):
            cells = case.grid.generatrix
            for beside in (round(0.85 * cells), round(0.93 * cells)):
                summary, _ = _timed(level(self.case, "axisymmetric", beside, ROUND))
                error = max(error, abs(speed_of(summary) - value))
        peaks = {name: _estimate(summaries, name).error for name in PEAKS if getattr(summaries[-1], name) is not None}
        return _Found(case, summaries[-1], value, error + self.apart, peaks)

    def spread(self, best: _Found) -> _Found:
        """The answer of an ensemble: disturbed shells on grids about the finest that the budget allows several times."""
        cells = best.case.grid.generatrix
        cost = self.rungs[-1].seconds
        while 12.0 * cost > max(self.left(), 1.0) and cells > 2 * self.coarsest:
            cells //= 2
            cost /= 8.0
        runs, seconds = [], 0.0
        for seed, share in enumerate((0.8, 0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2)):
            case = level(self.case, "axisymmetric", round(share * cells), ROUND)
            try:
                summary, cost = _timed(case, seed + 1)
            except Diverged as diverged:
                self.book(case, None, None, 0.0, f"diverged: {str(diverged)[:60]}")
                return best
            runs.append(summary)
            seconds += cost
        values = [speed_of(summary) for summary in runs]
        mean, error = statistics.mean(values), 2.0 * statistics.stdev(values) + self.apart
        case = level(self.case, "axisymmetric", cells, ROUND)
        within = error <= self.allowed(mean)
        verdict = f"mean of {len(runs)} disturbed shells on grids about this one" + ("" if within else "; they do not agree")
        self.book(case, mean, error, seconds, verdict)
        peaks = {name: _spread(runs, name) for name in best.peaks}
        return _Found(case, runs[4], mean, error, peaks, sensitive=True)

    def out_of_round(self) -> str | None:
        """Ask the full shell, disturbed, whether it stays round; errors take up by how much its answer moves.

        A coarse grid may hide what a finer one shows: if it lets the disturbance grow much, twice as fine a grid is asked.
        """
        cells = max(PROBE, self.coarsest)
        started = time.perf_counter()
        reason, grown = self.not_round(cells)
        if reason is not None or grown <= DOUBTFUL * SEEDS[0]:
            return reason
        if FINER * (time.perf_counter() - started) > self.left():
            return "whether the shell stays round takes a finer grid than the budget allows"
        return self.not_round(2 * cells)[0]

    def not_round(self, cells: int) -> tuple[str | None, float]:
        """Say why the full shell on a grid is not round, None if it is; and how far it gets out of round, over the radius."""
        case = level(self.case, "full", cells, 2 * cells)
        started = time.perf_counter()
        try:
            probed, lopsided = probe(case)
            value = speed_of(probed)
            twin, _ = _timed(level(self.case, "axisymmetric", cells, 2 * cells))
        except Diverged as diverged:
            self.book(case, None, None, time.perf_counter() - started, f"diverged: {str(diverged)[:60]}")
            return "the shell diverges on a coarse grid", math.inf
        apart = abs(value - speed_of(twin))
        seconds = time.perf_counter() - started
        part = lopsided / (0.5 * self.case.shell.diameter)
        grown = f"a disturbance of {SEEDS[0]:g} R grows to {lopsided * 1e3:.2g} mm and moves the answer by {apart:.2g} m/s"
        if part > OUT_OF_ROUND or apart > self.allowed(value):
            self.book(case, value, None, seconds, f"not round: {grown}")
            return "the shell does not stay round", part
        self.book(case, value, None, seconds, f"round: {grown}")
        self.apart = apart
        return None, part

    def full(self, settled: float | None) -> _Found:
        """Refine ensembles of disturbed full shells: the error is their spread and that of the grid.

        The latter is by how much the mean moved over the last two of three grids, which at second order and refinement by 1.5
        is the index of `convergence`: two grids may agree by accident. settled: answer (m/s) of the axisymmetric shell where it
        has one. A grid on which that shell is off by more has not resolved the scene, however well full shells agree on it.
        """
        cells = float(max(24, self.coarsest))
        means: list[float] = []
        best, cost = None, 0.0
        while True:
            n1 = round(cells)
            hoop = 2 * n1
            case = level(self.case, "full", n1, hoop)
            runs, seconds = [], 0.0
            for seed in range(len(SEEDS)):
                try:
                    summary, cost = _timed(case, seed + 1)
                except Diverged:
                    continue
                runs.append(summary)
                seconds += cost
            if len(runs) < len(SEEDS):
                self.book(case, None, None, seconds, f"{len(SEEDS) - len(runs)} of {len(SEEDS)} diverged")
            else:
                values = [speed_of(summary) for summary in runs]
                means.append(statistics.mean(values))
                scatter = 2.0 * statistics.stdev(values)
                moved = max(abs(means[-1] - means[-2]), abs(means[-2] - means[-3])) if len(means) > 2 else math.inf
                error = scatter + max(moved, self.unresolved(case, settled))
                within = error <= self.allowed(means[-1])
                far = f", grid ±{error - scatter:.2g} m/s" if len(means) > 2 else "; three grids are wanted"
                word = "within the tolerance" if within else f"spread ±{scatter:.2g} m/s{far}"
                self.book(case, means[-1], error if math.isfinite(error) else None, seconds, word)
                peaks = {name: _spread(runs, name) for name in PEAKS if getattr(runs[0], name) is not None}
                sensitive = scatter > self.allowed(means[-1])
                best = _Found(case, runs[0], means[-1], error, peaks, sensitive)
                if within or (sensitive and error < 2.0 * scatter):
                    return best
            if STEPPED**3.5 * len(SEEDS) * cost > self.left():
                break
            cells *= STEPPED
        if best is None:
            raise ValueError("the full shell diverges on every grid")
        return best

    def unresolved(self, case: Case, settled: float | None) -> float:
        """By how much the axisymmetric shell on the grid of a case is off its settled answer (m/s)."""
        if settled is None:
            return 0.0
        try:
            summary, _ = _timed(level(self.case, "axisymmetric", case.grid.generatrix, case.grid.hoop))
        except Diverged:
            return math.inf
        return abs(speed_of(summary) - settled)

    def in_words(self, found: _Found, within: bool) -> str:
        if within and not found.sensitive:
            return "the answer is within the tolerance"
        if found.sensitive:
            word = "viscosity, damping of the gas or narrower belts would"
            bar = f"±{found.error:.2g} m/s"
            return f"this scene does not determine the impact velocity better than {bar}; {word}" + (
                "" if not within else " (the tolerance allows that)"
            )
        return "the budget does not reach the tolerance"

    def done(self, found: _Found, reason: str) -> Climb:
        impact = found.value if found.summary.impact_velocity is not None else None
        summary = replace(
            found.summary,
            impact_velocity=impact,
            velocity_reduction=None if impact is None else found.summary.free_fall_velocity - impact,
            impact_velocity_error=found.error if math.isfinite(found.error) else None,
            peak_errors={name: error if math.isfinite(error) else None for name, error in found.peaks.items()},
            fidelity_reason=reason,
            ladder=self.rungs,
        )
        return Climb(found.case, summary)


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
    velocity = _estimate(runs, "impact_velocity", 1.5)
    peaks = {name: _estimate(runs, name, 1.5).error for name in PEAKS if getattr(summary, name) is not None}
    if math.isfinite(velocity.error):
        order = "no observed order" if velocity.order is None else f"observed order {velocity.order:.2g}"
        reason = f"grid convergence index of three grids, {order}"
    else:
        reason = "no error bar: differences between three grids do not fall"
    return replace(
        summary,
        impact_velocity_error=velocity.error if math.isfinite(velocity.error) else None,
        peak_errors={name: error if math.isfinite(error) else None for name, error in peaks.items()},
        fidelity_reason=reason,
    )


def _timed(case: Case, seed: int = 0) -> tuple[Summary, float]:
    """Run a case without a file, its places disturbed if there is a seed, 1 and up. Returns its answer and the seconds."""
    started = time.perf_counter()
    falling = Drop(case)
    if seed:
        falling.disturb(SEEDS[(seed - 1) % len(SEEDS)] * 0.5 * case.shell.diameter, seed)
    summary = falling.run(None, None)
    if summary.outcome == "interrupted":
        raise KeyboardInterrupt
    return summary, time.perf_counter() - started


def probe(case: Case) -> tuple[Summary, float]:
    """Answer of a disturbed full shell, and how far it got out of round (m). Raises Diverged."""
    falling = Drop(case)
    falling.disturb(SEEDS[0] * 0.5 * case.shell.diameter, 1)
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
    coarse, medium, fine = (getattr(summary, name) or 0.0 for summary in summaries)
    return estimate(coarse, medium, fine, ratio)


def _spread(summaries: Sequence[Summary], name: str) -> float:
    values: list[float] = [getattr(summary, name) for summary in summaries]
    return 2.0 * statistics.stdev(values)
