"""Work against precision: one drop by many fidelities, grids, steps and schemes, each judged by a reference beyond them all.

The reference is the axisymmetric shell on a grid four times as fine as any shown, where the full shell stays round; else the mean
of disturbed full shells on a grid 1.5 times as fine as that of any full shell shown. It has an error of its own: what
is nearer to it is not ranked.
"""

from __future__ import annotations

import csv
import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Literal, NamedTuple

from softbrake.case.case import Case
from softbrake.case.level import level
from softbrake.case.sections.contact import UNKNOWN
from softbrake.case.sections.numerics import ONE_COLUMN, Fidelity
from softbrake.sim.files import draft_of
from softbrake.sim.simulation import Diverged, Simulation, compile_kernels, kernels_of
from softbrake.sim.summary import Summary
from softbrake.studies.convergence import CAUTION, estimate
from softbrake.studies.error_control import COURANT, LEAST_SPEED, OUT_OF_ROUND, SEEDS, least_cells, probe, speed_of

MOST_TIME = 120.0  # s
TOLERANCES = (0.05, 0.02, 0.01, 0.005)
COURANTS = (0.9, 0.5, 0.1, 0.02)
GRIDS = tuple(round(36 * 2.0 ** (k / 2)) for k in range(-4, 5))  # cells along the generatrix, 9 to 144
CHARTED: tuple[tuple[Fidelity, Literal["edge", "cell"], tuple[float, ...]], ...] = (
    ("lumped", "edge", COURANTS[:1]),
    ("axisymmetric", "edge", COURANTS),
    ("full", "edge", COURANTS),
    ("full", "cell", (0.5, 0.02)),
)
POWERS = {"lumped": 1.0, "axisymmetric": 3.0, "full": 3.5}  # of the grid, by which seconds rise at most
REPEATED = 1.0  # s, runs below are timed three times
SHARE = 2 / 3  # of the budget, at most, for the reference
OVER = 0.2  # of the time spent, that a coarse grid of the reference may take after its share
ROUND = 720  # cells around the hoop of an axisymmetric shell, which does not feel them
COARSEST = 16  # cells along the generatrix of the first full shells of an ensemble
PROBE = 36  # cells along the generatrix of the full shell that is asked whether it stays round
DOUBLINGS = 6
DOUBTFUL = 10.0  # times a disturbance: a shell that let it grow by more is asked on a finer grid
STEPPED = 1.5  # refinement of the full shell

# The reference's grid over the finest shown, at least, by its fidelity and that of the run: they share the error of their grid.
# Others, as the axisymmetric shell beside full ones, show the difference of the models, whatever their grid.
BEYOND: dict[str, dict[str, float]] = {"axisymmetric": {"axisymmetric": 4.0}, "full": {"full": STEPPED}}
TOO_FINE = "too fine for the reference to judge"
INTERRUPTED = "not run: interrupted"
UNITS = {"impact_velocity": "m/s", "stroke": "m", "peak_deceleration": "m/s^2", "peak_tension": "N/m"}


class Setting(NamedTuple):
    """How a drop is computed."""

    fidelity: Fidelity
    scheme: Literal["edge", "cell"]
    courant: float
    generatrix: int
    hoop: int

    @property
    def family(self) -> tuple[str, str, float]:
        """What settings have in common that differ by their grid."""
        return self[:3]

    @property
    def columns(self) -> int:
        """How many columns of nodes are computed."""
        return self.hoop if self.fidelity == "full" else 1

    def apply(self, case: Case) -> Case:
        """Return the case so computed, with the contact that this fidelity knows."""
        case = level(case, self.fidelity, self.generatrix, self.hoop, self.courant)
        return replace(case, model=replace(case.model, scheme=self.scheme))

    def overrides(self, case: Case) -> list[str]:
        """Return what `--set` makes a case file of this case compute it so."""
        chosen = self.apply(case)
        return [
            f"model.fidelity={self.fidelity}",
            f"model.scheme={self.scheme}",
            f"grid.generatrix={self.generatrix}",
            f"grid.hoop={self.hoop}",
            f"time.courant={self.courant:g}",
            f"contact=[{', '.join(chosen.contact)}]",
        ]

    def __str__(self) -> str:
        if self.fidelity == "lumped":
            return self.fidelity
        cells = f"{self.generatrix}" if self.fidelity in ONE_COLUMN else f"{self.generatrix} x {self.hoop}"
        return f"{cells} {in_words(self.family)}"


def in_words(family: tuple[str, str, float]) -> str:
    """Name a family."""
    return f"{model_in_words(*family[:2])}, Courant {family[2]:g}"


def model_in_words(fidelity: str, scheme: str) -> str:
    """Name a fidelity and scheme."""
    return fidelity + (", cell scheme" if scheme == "cell" else "")


PAPER = Setting("full", "edge", 0.02, 36, 90)


@dataclass(frozen=True)
class Measurement:
    """One drop."""

    setting: Setting
    summary: Summary
    values: dict[str, float]  # keys of UNITS
    seconds: float  # of CPU, in the kernels; median of three below a second
    disturbed: float = 0.0  # of the radius, for a run of the reference

    @property
    def nanoseconds(self) -> float | None:
        """CPU time of the kernels per node and step, ns; None for gas alone, which has no nodes."""
        nodes = (self.setting.generatrix + 1) * self.setting.columns
        return None if self.setting.fidelity == "lumped" else 1e9 * self.seconds / (nodes * max(self.summary.steps, 1))


@dataclass(frozen=True)
class Reference:
    """What all runs are compared with."""

    values: dict[str, float]  # of the quantities charted
    errors: dict[str, float]  # estimated bounds of their errors, in their units; inf where there is none
    outcomes: frozenset[str]  # more than one where disturbed shells end in different ways
    basis: str  # what it is and what its error rests on
    setting: Setting
    least: float  # m/s; errors of impact velocities are parts of at least this

    def scale(self, name: str) -> float:
        """Return what errors of a quantity are parts of."""
        return max(abs(self.values[name]), self.least if name == "impact_velocity" else 0.0)

    def error(self, name: str) -> float:
        """Return the relative error of the reference itself."""
        return self.errors[name] / self.scale(name)


@dataclass
class WorkPrecision:
    """What was computed; `report.plots.work_precision` draws it."""

    case: Case
    reference: Reference | None = None  # None where it was interrupted
    reference_runs: list[Measurement] = field(default_factory=list)
    runs: list[Measurement] = field(default_factory=list)
    left_out: list[tuple[Setting, float | str]] = field(default_factory=list)  # and the seconds it may take, or why else
    interrupted: bool = False
    seconds: float = 0.0  # wall time of all, compiling apart
    budget: float = MOST_TIME  # s

    def failure(self, run: Measurement) -> str | None:
        """Say how a run ended, if not as the reference does."""
        if self.reference is None or run.summary.outcome in self.reference.outcomes:
            return None
        verb = "diverged" if run.summary.outcome == "diverged" else f"ends otherwise ({run.summary.outcome.replace('_', ' ')})"
        return f"{verb} at {run.summary.end_time:.4g} s"

    def error(self, run: Measurement, name: str) -> float:
        """Return the relative deviation of a run from the reference; inf where it failed."""
        if self.reference is None or self.failure(run) is not None:
            return math.inf
        return abs(run.values[name] - self.reference.values[name]) / self.reference.scale(name)

    def ranked(self, run: Measurement, name: str) -> float:
        """Return the error of a run, that of the reference where it is smaller: what lies below is not ranked."""
        return math.inf if self.reference is None else max(self.error(run, name), self.reference.error(name))

    def front(self, name: str) -> list[Measurement]:
        """Return the runs that no other beats in both time and error, cheapest first; gas alone is for comparison only."""
        runs = [run for run in self.runs if run.setting.fidelity != "lumped"]
        return [runs[k] for k in pareto([(run.seconds, self.ranked(run, name)) for run in runs])]

    def families(self) -> dict[tuple[str, str, float], list[Measurement]]:
        """Return the runs by family, coarse to fine; that of the paper's grid only where its cells are shaped as the case's."""
        found: dict[tuple[str, str, float], list[Measurement]] = {}
        alike = PAPER.hoop == _hoop(self.case, PAPER.fidelity, PAPER.generatrix)
        for run in sorted(self.runs, key=lambda run: run.setting.generatrix):
            if run.setting == PAPER and not alike:
                continue
            found.setdefault(run.setting.family, []).append(run)
        return found

    def failures(self) -> list[str]:
        """Say which runs failed, a line each."""
        return [f"{run.setting}: {why}" for run in self.runs if (why := self.failure(run)) is not None]

    def omissions(self) -> list[str]:
        """Say what was left out, a line for each family and reason."""
        kinds: dict[tuple[str, str], list[tuple[int, float]]] = {}
        for setting, why in self.left_out:
            who = setting.fidelity if why == TOO_FINE else in_words(setting.family)
            reason, seconds = (why, 0.0) if isinstance(why, str) else ("", why)
            kinds.setdefault((who, reason), []).append((setting.generatrix, seconds))
        lines = []
        for (who, reason), grids in kinds.items():
            least = min(seconds for _, seconds in grids)
            reason = reason or (f"may take {float(f'{least:.2g}'):g} s and more" if least else "no time left")
            lines.append(f"{who}: {', '.join(str(n1) for n1 in sorted({n1 for n1, _ in grids}))} cells, {reason}")
        return lines

    def order(self, family: Sequence[Measurement], name: str) -> float | None:
        """Return the fitted order of a family's errors, as far as they stand out from that of the reference."""
        if self.reference is None:
            return None
        return fitted_order(
            [run.setting.generatrix for run in family], [self.error(run, name) for run in family], self.reference.error(name)
        )

    def recommended(self, name: str, tolerance: float) -> Measurement | None:
        """Return the cheapest run that is within the tolerance, as all finer ones of its family are; None without such.

        At least one finer run must confirm it, so gas alone, which knows no grid, never is. The reference's error counts as well.
        """
        if self.reference is None:
            return None
        most = tolerance - self.reference.error(name)
        good = []
        for family in self.families().values():
            errors = [self.error(run, name) for run in family]
            good += [run for k, run in enumerate(family[:-1]) if max(errors[k:]) <= most]
        return min(good, key=lambda run: run.seconds, default=None)


def pareto(points: Sequence[tuple[float, float]]) -> list[int]:
    """Return which points (cost, error) no other equals or beats in both, by rising cost; points without finite error never."""
    front: list[int] = []
    for k in sorted(range(len(points)), key=lambda k: points[k]):
        if points[k][1] < (points[front[-1]][1] if front else math.inf):
            front.append(k)
    return front


def fitted_order(cells: Sequence[int], errors: Sequence[float], floor: float) -> float | None:
    """Return the power of the cell size by which errors fall: least squares of the logarithms.

    Of errors above twice the floor and within the loosest tolerance only, since coarser grids know no power yet. None where these
    are fewer than three, or where a power explains less than 0.8 of them.
    """
    points = [(-math.log(n), math.log(e)) for n, e in zip(cells, errors, strict=True) if 2 * floor < e <= TOLERANCES[0]]
    if len(points) < 3:
        return None
    x, y = [point[0] for point in points], [point[1] for point in points]
    if statistics.pstdev(y) == 0.0 or statistics.correlation(x, y) ** 2 < 0.8:
        return None
    return statistics.linear_regression(x, y).slope


def values_of(case: Case, summary: Summary) -> dict[str, float]:
    """Return the designer's quantities, keys and units as UNITS."""
    return {
        "impact_velocity": speed_of(summary),
        "stroke": case.shell.height - summary.lowest_height,
        "peak_deceleration": summary.peak_deceleration,
        "peak_tension": max(summary.peak_tension_generatrix or 0.0, summary.peak_tension_hoop or 0.0),  # of the fabric
    }


def _one_event(runs: Sequence[Measurement], name: str) -> bool:
    """Whether a peak is the same event in all runs: their times lie within 1 % of the drop of each other."""
    if not name.startswith("peak_"):
        return True
    names = ("peak_tension_generatrix", "peak_tension_hoop") if name == "peak_tension" else (name,)
    peaks = [max((run.summary.peaks[one] for one in names), key=lambda peak: peak.value) for run in runs]
    times = [peak.time for peak in peaks]
    return max(times) - min(times) <= 0.01 * runs[-1].summary.end_time


def plan(case: Case) -> list[Setting]:
    """Return all settings that know the case's contact, the likely cheapest first."""
    least = least_cells(case)
    settings = {PAPER} if least <= PAPER.generatrix else set()
    for fidelity, scheme, courants in CHARTED:
        if {*case.contact} & {*UNKNOWN[fidelity]} - {"axis"}:  # it would answer another question
            continue
        for courant in courants:
            grids = [n1 for n1 in GRIDS if n1 >= least] or [least]
            if fidelity == "lumped":
                grids = grids[:1]
            elif (fidelity, scheme, courant) not in (("axisymmetric", "edge", COURANT), ("full", "edge", COURANT)):
                grids = grids[::2]
            settings |= {Setting(fidelity, scheme, courant, n1, _hoop(case, fidelity, n1)) for n1 in grids}
    return sorted(settings, key=lambda one: (one.generatrix**2 * one.columns / one.courant, one))


def _hoop(case: Case, fidelity: Fidelity, n1: int) -> int:
    """Cells around the hoop, in the case's proportion where they cost anything."""
    if fidelity in ("lumped", "axisymmetric"):
        return ROUND
    return max(round(n1 * case.grid.hoop / case.grid.generatrix), 8)


def work_precision(case: Case, budget: float = MOST_TIME, report: Callable[[int, int, str], None] | None = None) -> WorkPrecision:
    """Compute a reference and as much of the plan as a budget (s) holds; Ctrl-C ends it early and keeps what was done.

    report: told runs done, runs planned, and what comes next. Compiling is no part of the budget, which is wall time: no run is
    begun that would end later, from what others took, but for the first of its kind. Raises Diverged where the
    reference does on every grid.
    """
    found = WorkPrecision(case, budget=budget)
    campaign = _Campaign(found, report or (lambda done, planned, doing: None))
    try:
        campaign.fill()
    except KeyboardInterrupt:
        found.interrupted = True
        done = {run.setting for run in found.runs} | {setting for setting, _ in found.left_out}
        found.left_out += [(setting, INTERRUPTED) for setting in plan(case) if setting not in done]
    found.seconds = time.perf_counter() - campaign.started
    return found


class _Campaign:
    def __init__(self, found: WorkPrecision, report: Callable[[int, int, str], None]) -> None:
        self.found, self.case, self.report = found, found.case, report
        self.settings = plan(self.case)
        self.costs: list[tuple[Setting, float]] = []  # wall seconds that settings took, as the budget counts
        compile_kernels(kernels_of(setting.apply(self.case) for setting in self.settings))
        self.started = time.perf_counter()
        self.due, self.end = self.started + SHARE * found.budget, self.started + found.budget  # of the reference, and of all
        self.planned = len(self.settings)
        self.coarse: Measurement | None = None  # first full shell, which tells what others take

    def fill(self) -> None:
        """The reference, the paper's setting if it fits, then all runs by rising cost as far as there is time."""
        found = self.found
        found.reference = reference = self.reference()
        first = [one for one in self.settings if one == PAPER and self.expected(one) < 0.5 * (self.end - time.perf_counter())]
        for setting in dict.fromkeys([*first, *self.settings]):
            doing = self.expected(setting)
            beyond = BEYOND[reference.setting.fidelity].get(setting.fidelity, 0.0)
            if beyond * setting.generatrix > reference.setting.generatrix:
                found.left_out.append((setting, TOO_FINE))
            elif time.perf_counter() + doing * (3.0 if doing < REPEATED else 1.0) > self.end:
                found.left_out.append((setting, doing))
            else:
                self.report(len(found.runs), self.planned - len(found.left_out), str(setting))
                found.runs.append(self.timed(setting))
        self.report(len(found.runs), len(found.runs), "done")

    def expected(self, setting: Setting) -> float:
        """Seconds of a run: the least that any coarser one of the same kernel lets expect; 0 where there is none.

        Seconds rise with the grid by POWERS at most, and with one over the Courant number at most.
        """
        return min(
            (
                seconds * (setting.generatrix / other.generatrix) ** POWERS[setting.fidelity] * other.courant / setting.courant
                for other, seconds in self.costs
                if other[:2] == setting[:2] and other.generatrix <= setting.generatrix and other.courant >= setting.courant
            ),
            default=0.0,
        )

    def timed(self, setting: Setting) -> Measurement:
        """One run of the plan, a short one three times."""
        run = self.run(setting)
        if run.seconds < REPEATED:
            seconds = statistics.median([run.seconds, self.run(setting).seconds, self.run(setting).seconds])
            run = replace(run, seconds=seconds)
        return run

    def run(self, setting: Setting, seed: int = 0) -> Measurement:
        """A drop, disturbed by the size of a seed, 1 and up."""
        drop = Simulation(setting.apply(self.case))
        size = SEEDS[seed - 1] if seed else 0.0
        if seed:
            drop.disturb(size * 0.5 * self.case.shell.diameter, seed)
        try:
            summary = drop.to_end()
        except Diverged as diverged:
            summary = diverged.summary
        if summary.outcome == "interrupted":
            raise KeyboardInterrupt
        if summary.outcome != "diverged":  # which cost less than a whole drop
            self.costs.append((setting, summary.wall_seconds))
        return Measurement(setting, summary, values_of(self.case, summary), summary.kernel_seconds, size)

    def refer(self, setting: Setting, seed: int = 0) -> Measurement:
        """A run of the reference; it is kept."""
        self.report(0, self.planned, f"reference, {setting}")
        run = self.run(setting, seed)
        self.found.reference_runs.append(run)
        return run

    def reference(self) -> Reference:
        """Fine axisymmetric shells where the full one stays round, else ensembles of disturbed full shells."""
        moved, lopsided = self.out_of_round()
        if moved is None:
            return self.ensemble(lopsided)
        return self.axisymmetric(moved, lopsided)

    def out_of_round(self) -> tuple[dict[str, float] | None, str]:
        """By how much a disturbance moves each quantity of a full shell from the axisymmetric one, None if not round; in words.

        A grid twice as fine is asked where a coarse one lets the disturbance grow much, as in `error_control`. A shell of the
        coarsest grid of an ensemble tells before what that takes.
        """
        moved = dict.fromkeys(UNITS, 0.0)
        words = ""
        cells, coarse = max(PROBE, least_cells(self.case)), max(COARSEST, least_cells(self.case))
        if coarse < cells:
            self.report(0, self.planned, f"what a full shell takes, {coarse} cells")
            self.coarse = self.run(Setting("full", "edge", COURANT, coarse, _hoop(self.case, "full", coarse)), 1)
        for n1 in (cells, 2 * cells):
            setting = Setting("full", "edge", COURANT, n1, _hoop(self.case, "full", n1))
            if self.expected(setting) > 0.5 * (self.due - time.perf_counter()):
                open_still = "whether the full shell stays round takes a finer grid than the budget allows"
                return None, ": ".join(filter(None, (open_still, words)))
            self.report(0, self.planned, f"does it stay round? {setting}")
            started = time.perf_counter()
            try:
                summary, lopsided = probe(setting.apply(self.case), 1)
            except Diverged:
                return None, "the full shell diverges on a coarse grid"
            self.costs.append((setting, time.perf_counter() - started))
            twin = self.run(setting._replace(fidelity="axisymmetric"))
            apart = {name: abs(value - twin.values[name]) for name, value in values_of(self.case, summary).items()}
            moved = {name: max(moved[name], apart[name]) for name in moved}
            words = f"a disturbance of {SEEDS[0]:g} R grows to {lopsided:.2g} R on {n1} x {setting.hoop} cells"
            least = TOLERANCES[-1] * max(speed_of(summary), LEAST_SPEED * summary.free_fall_velocity)
            if lopsided > OUT_OF_ROUND:
                return None, f"the full shell does not stay round: {words}"
            if twin.summary.outcome != summary.outcome:
                return None, f"the full shell ends otherwise than the axisymmetric one: {words}"
            if apart["impact_velocity"] > least:
                return None, f"{words} and moves the answer by {apart['impact_velocity']:.2g} m/s"
            if lopsided <= DOUBTFUL * SEEDS[0]:
                break
        return moved, f"the full shell stays round: {words}"

    def axisymmetric(self, moved: dict[str, float], why: str) -> Reference:
        """The finest of doubled grids; its error by the index of three, two grids beside it, and the move of a disturbance.

        Where the three tell no order, or their peaks are different events, the range of these three and those beside instead.
        Where there is time for fewer, there is no error.
        """
        cells = max(GRIDS[2], least_cells(self.case))
        runs: list[Measurement] = []
        for _ in range(DOUBLINGS):
            run = self.refer(Setting("axisymmetric", "edge", COURANT, cells, ROUND))
            runs = [*runs, run] if run.summary.outcome != "diverged" else []
            cells *= 2
            now, following = time.perf_counter(), self.expected(run.setting._replace(generatrix=cells))
            left = max(self.due - now, OVER * (now - self.started) if len(runs) < 3 else 0.0)
            if runs and 2.5 * following > left:  # there are two beside it as well
                break
        if not runs:
            raise Diverged("the axisymmetric shell diverges on every grid: there is no reference", run.summary)
        finest = runs[-1]
        basis = f"axisymmetric shell of {finest.setting.generatrix} cells; {why}"
        if len(runs) < 3:
            return self.made(finest.values, dict.fromkeys(UNITS, math.inf), [finest], basis, finest.setting)
        beside = [self.refer(finest.setting._replace(generatrix=round(x * finest.setting.generatrix))) for x in (0.85, 0.93)]
        errors = {}
        for name, value in finest.values.items():
            three, others = [one.values[name] for one in runs[-3:]], [one.values[name] for one in beside]
            bound = estimate(three[0], three[1], three[2], 2.0).error
            if math.isinf(bound) or not _one_event(runs[-3:], name):
                bound = max(three + others) - min(three + others)
            errors[name] = max(bound, *(abs(other - value) for other in others)) + moved[name]
        return self.made(finest.values, errors, [finest, *beside], basis, finest.setting)

    def ensemble(self, why: str) -> Reference:
        """The mean of disturbed full shells; its error is twice their scatter and the larger of its last two moves by grid.

        Of the coarsest grid there are as many as there is time for, one at least.
        """
        cells = float(max(COARSEST, least_cells(self.case)))
        means: list[dict[str, float]] = []
        last: list[Measurement] = []
        while True:
            n1 = round(cells)
            setting = Setting("full", "edge", COURANT, n1, _hoop(self.case, "full", n1))
            tried: list[Measurement] = []
            if self.coarse is not None and self.coarse.setting == setting:
                tried.append(self.coarse)
                self.found.reference_runs.append(self.coarse)
            for seed in range(len(tried), len(SEEDS)):
                if tried and time.perf_counter() + self.expected(setting) > self.due:
                    break
                tried.append(self.refer(setting, seed + 1))
            runs = [run for run in tried if run.summary.outcome != "diverged"]
            if len(runs) >= (len(SEEDS) - 1 if means else 1):
                means.append({name: statistics.mean(run.values[name] for run in runs) for name in UNITS})
                last = runs
            cells *= STEPPED
            following = self.expected(setting._replace(generatrix=round(cells)))
            if len(SEEDS) * following > self.due - time.perf_counter():
                break
        if not last:
            raise Diverged("the full shell diverges on every grid: there is no reference", tried[-1].summary)
        errors = {}
        for name in UNITS:
            moves = [abs(after[name] - before[name]) for before, after in pairwise(means[-3:])]
            grid = max(moves) if len(moves) == 2 else CAUTION * moves[0] if moves else math.inf
            spread = statistics.stdev([run.values[name] for run in last]) if len(last) > 1 else math.inf
            errors[name] = 2.0 * spread + grid
        setting = last[0].setting
        sizes = " to ".join(f"{size:g}" for size in dict.fromkeys((last[0].disturbed, last[-1].disturbed)))
        basis = (
            f"mean of {len(last)} full shell{'s' * (len(last) > 1)} of {setting.generatrix} x {setting.hoop} cells, "
            f"disturbed by {sizes} R; {why}"
        )
        return self.made(means[-1], errors, last, basis, setting)

    def made(
        self, values: dict[str, float], errors: dict[str, float], runs: Sequence[Measurement], basis: str, setting: Setting
    ) -> Reference:
        """The reference of those quantities that are there and are not zero."""
        outcomes = frozenset(run.summary.outcome for run in runs)
        names = ("impact_velocity" if "impact" in outcomes else "stroke", "peak_deceleration", "peak_tension")
        kept = {name: values[name] for name in names if values[name] > 0.0}
        basis += "".join(f"; no {name.replace('_', ' ')}" for name in names if name not in kept)
        least = LEAST_SPEED * runs[0].summary.free_fall_velocity
        return Reference(kept, {name: errors[name] for name in kept}, outcomes, basis, setting, least)


def write_csv(found: WorkPrecision, path: Path) -> None:
    """Write every run to a CSV file, a line each, units in the heads; what was left out as well, without numbers."""
    names = list(found.reference.values) if found.reference is not None else []
    head = ["role", "fidelity", "scheme", "courant [1]", "generatrix [cells]", "hoop [cells]", "disturbed [radius]", "outcome"]
    head += ["end_time [s]", "steps [1]", "kernel_seconds [s]", "rate [ns per node and step]"]
    head += [f"{name} [{unit}]" for name, unit in UNITS.items()]
    head += [f"error of {name} [%]" for name in names] + [f"error of the reference's {name} [%]" for name in names]
    with draft_of(path) as draft, draft.open("w", newline="", encoding="utf-8") as stream:
        lines = csv.writer(stream)
        lines.writerow(head)
        known = [_percent(found.reference.error(name)) for name in names] if found.reference is not None else []
        for role, runs in (("reference", found.reference_runs), ("run", found.runs)):
            for run in runs:
                summary = run.summary
                line = [role, *run.setting, run.disturbed, summary.outcome, summary.end_time, summary.steps, run.seconds]
                line += [run.nanoseconds, *run.values.values(), *(_percent(found.error(run, name)) for name in names)]
                lines.writerow([*line, *known])
        for setting, _ in found.left_out:
            lines.writerow(["left out", *setting])


def _percent(error: float) -> float | str:
    return 100.0 * error if math.isfinite(error) else ""
