"""Inputs of a case fitted to tests by least squares, with what the tests tell of them.

A channel is sampled at fixed times of its own, half a period of its class's corner apart: closer samples repeat one another. The
shift of each test is fitted beside the inputs, so that their intervals count what is not known of it.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from softbrake.case.case import Case
from softbrake.case.case_file import CaseError
from softbrake.core.arrays import Floats
from softbrake.signals.channel import QUANTITIES, Channel
from softbrake.sim.filters import BOTH
from softbrake.sim.result_file import as_history, history_dtype
from softbrake.studies.batch import run_batch
from softbrake.studies.comparison import Curve, computed_curve, found_shift, measured_curve
from softbrake.studies.design_space import Variable, twice
from softbrake.studies.estimates import TooFewSamples, known_by
from softbrake.studies.sampling import latin_hypercube

STARTS = 16  # places looked at for each input
REFINED = 3, 8  # of them, the best: at least, and at most until two end at the same values
STEPS = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0)  # to both sides, of a reach, over which slopes are taken
REACHES = (0.1, 0.2, 0.4)  # of the range; the first whose slope is sure
SURE = 0.05  # of itself
BENT = 4.0  # times what scatter makes of it, from which on the cube of a step counts
LATE = 0.1  # of the shorter one of test and drop, by which a test may begin after first contact
AT_END = 1e-3  # of the range, within which a value counts as its end
SAME = 0.02  # of the range, by which fits from two starts may differ
ROUNDS = 8  # of fits, each with the noise and the end of the drop that the last one found
SETTLED = 0.05  # of a channel's noise, that it may still change by
LIKE = 0.7  # correlation, from which on two curves are alike
COARSER = 2 / 3  # cells of the grid beside which the model is seen
NEEDED = "calibrate needs scipy: pip install 'softbrake[chance]'"

Place = tuple[float, ...]  # parts of the ranges, 0 to 1
Load = Callable[[Mapping[str, float]], Case]


class NotCalibrated(Exception):
    """The tests tell no values; the message says why."""


@dataclass(frozen=True)
class DropTest:
    """Channels of a test in the terms of the drop, each of another quantity, and the drop as that test had it."""

    name: str
    channels: tuple[Channel, ...]
    load: Load  # the case with values (SI) by path; without a tolerance
    added: float = 0.0  # m/s^2, what its accelerometer reads above the net deceleration


@dataclass(frozen=True)
class FittedInput:
    """A value and what the tests tell of it; SI."""

    variable: Variable
    value: float
    interval: tuple[float, float] | None  # of 95 %
    why_not: str  # there is none; else empty
    grid: float | None  # how much more or less a coarser grid asks for; None without one


@dataclass(frozen=True)
class FittedChannel:
    """A channel beside the fitted drop; SI."""

    test: str
    name: str
    quantity: str  # of QUANTITIES
    unit: str  # of the channel
    time: Floats  # s, of the drop
    measured: Floats
    computed: Floats
    misfit: float  # root mean square
    scatter: float  # likewise, of what the model changes by on a coarser grid, or with round-off
    correlation: float  # of what is left, from one sample to the next


@dataclass(frozen=True)
class Calibration:
    """Inputs fitted to tests."""

    inputs: tuple[FittedInput, ...]
    correlations: Floats  # of the inputs with each other; nan where one has no interval
    channels: tuple[FittedChannel, ...]
    shifts: tuple[float, ...]  # s, added to the times of each test
    undetermined: tuple[str, ...]  # what the tests do not tell, in words
    slope_errors: tuple[float, ...]  # of the slope of the drop over each input, relative
    starts: int  # places looked at
    refined: int  # of them
    agreeing: int  # of these, that ended at the values
    rivals: tuple[tuple[float, ...], ...]  # values (SI) of other ends as near to the tests as noise and scatter tell
    drops: int  # computed
    faults: dict[str, int]  # of those without an answer, and how often
    opposed: tuple[str, ...]  # channels that run against most starts and against the drop, in words


class _Window(NamedTuple):
    """What of a test is compared."""

    start: float  # s, of the drop
    stop: float
    time: Floats  # s, of the test
    measured: tuple[Floats, ...]  # SI, of each channel


class _End(NamedTuple):
    """Where a fit from one start ended."""

    place: Place
    shifts: Floats  # s, of each test
    cost: float  # sum of squared weighted differences

    def near(self, other: _End) -> bool:
        """Whether another end is the same, as far as fits are."""
        return bool(np.allclose(self.place, other.place, rtol=0.0, atol=SAME))


def calibrate(
    tests: Sequence[DropTest],
    variables: Sequence[Variable],
    case_values: Sequence[float | None],
    *,
    cfc: int,
    shift: float | None = None,
    interval: tuple[float, float] | None = None,
    starts: int | None = None,
    seed: int = 0,
    report: Callable[[str], None] | None = None,
) -> Calibration:
    """Fit variables to tests.

    case_values: SI, of the variables in the case; None where it has none. shift: s, of all tests; that of each is fitted where it
    is None. interval: s, of the drop; by default what test and drop share, but a period of the class's corner at both ends.
    starts: places looked at beside the case's values, by default 16 for each variable. The best of all are refined: three, or up
    to eight until two end at the same values.
    report: told what is found on the way. Raises NotCalibrated; ValueError for channels and intervals that do not fit;
    ImportError without scipy.
    """
    try:
        import scipy.optimize  # noqa: F401
    except ImportError as error:
        raise ImportError(NEEDED) from error
    if name := twice([test.name for test in tests]):
        raise ValueError(f"{name}: a name of two tests; names of their own are expected")
    fit = _Fit(tests, variables, cfc, shift, interval, report or (lambda _: None))
    wanted = STARTS * len(variables) if starts is None else starts
    places = [tuple(place) for place in latin_hypercube(len(variables), wanted, seed)] if wanted else []
    if all(value is not None for value in case_values):
        own = tuple(map(_share, variables, case_values))
        places[:0] = [own] if all(0.0 <= share <= 1.0 for share in own) else []
    return fit.run(places)


def _share(variable: Variable, value: float | None) -> float:
    """The part of the range at which a value stands."""
    assert value is not None
    low, high = variable.low, variable.high
    if low > 0.0:
        return math.log(value / low) / math.log(high / low) if value > 0.0 else -1.0
    return (value - low) / (high - low)


class _Fit:
    """Least squares over parts of the ranges and shifts in units of the spacing."""

    def __init__(
        self,
        tests: Sequence[DropTest],
        variables: Sequence[Variable],
        cfc: int,
        shift: float | None,
        interval: tuple[float, float] | None,
        say: Callable[[str], None],
    ) -> None:
        self.tests, self.variables, self.cfc, self.shift, self.interval, self.say = tests, variables, cfc, shift, interval, say
        self.period = 1.0 / (BOTH * cfc)
        self.spacing = 0.5 * self.period
        self.measured = [self.behind_class(test) for test in tests]
        self.steps = np.full(len(variables), 0.5 * REACHES[0])
        self.known: dict[Place, list[list[Curve]] | None] = {}
        self.known_coarser: dict[Place, list[list[Curve]] | None] = {}
        self.faults: dict[str, int] = {}
        self.drops = 0
        self.weight = "tests' spread"
        self.opposed: set[str] = set()

    def behind_class(self, test: DropTest) -> list[Curve]:
        """The channels of a test behind the class."""
        try:
            return [measured_curve(channel, self.cfc) for channel in test.channels]
        except ValueError as error:
            raise ValueError(f"{test.name}: {error}") from error

    def run(self, places: Sequence[Place]) -> Calibration:
        """As `find`; a refusal names the channels that run against the drop."""
        try:
            return self.find(places)
        except (NotCalibrated, ValueError) as error:
            if self.opposed:
                raise type(error)("; ".join((str(error), *sorted(self.opposed)))) from error
            raise

    def find(self, places: Sequence[Place]) -> Calibration:
        """Look at places, refine the best, and say what the tests tell at the best end."""
        ranked, noise, sooner = self.look(places)
        windows = self.windows(ranked[0].shifts, sooner)
        ends: list[_End] = []
        for start in ranked[: REFINED[1]]:
            try:
                ends.append(self.refine(start, windows, noise))
            except NotCalibrated as none:
                self.lost(str(none))
                continue
            best = min(ends, key=lambda end: end.cost)
            if len(ends) >= REFINED[0] and sum(map(best.near, ends)) > 1:
                break
        if not ends:
            raise NotCalibrated(f"no start can be refined: {self.told_faults()}")
        first_noise = noise
        for _ in range(ROUNDS):
            self.good_slopes(best, windows, noise)
            new, before = self.windows(best.shifts, self.ends_around(best)), noise
            moved = any(abs(a.stop - b.stop) > 0.5 * self.spacing for a, b in zip(new, windows, strict=True))
            windows = new if moved else windows
            noise, self.weight = self.noise(best, windows), "last misfit"
            if not moved and (len(noise) == 1 or np.all(np.abs(noise / before - 1.0) < SETTLED)):
                break
            best = self.refine(best, windows, noise)
        return self.told(best, windows, noise, ends, first_noise, len(places))

    # Drops

    def values(self, place: Place) -> dict[str, float]:
        """Values (SI) by path."""
        return {each.path: float(each.at(share)) for each, share in zip(self.variables, place, strict=True)}

    def curves(self, places: Sequence[Place], coarser: float = 1.0) -> list[list[list[Curve]] | None]:
        """Curves of all channels of all tests at places, computed at once; None where a drop has no answer.

        coarser: part of the cells of the grid.
        """
        known = self.known if coarser == 1.0 else self.known_coarser
        if not (new := [place for place in dict.fromkeys(places) if place not in known]):
            return [known[place] for place in places]
        cases: dict[Place, list[Case]] = {}
        for place in new:
            try:
                cases[place] = [self.on_grid(test.load(self.values(place)), coarser) for test in self.tests]
            except (CaseError, ValueError) as error:
                self.lost(error.faults[0] if isinstance(error, CaseError) else str(error))
        alike = list(dict.fromkeys(case for each in cases.values() for case in each))  # tests of one drop are computed once
        answers = dict(zip(alike, run_batch(alike, histories=True), strict=True))
        self.drops += len(alike)
        for answer in answers.values():
            if answer.fault is not None:
                self.lost(answer.fault)
        for place in new:
            known[place] = None
            if place in cases and all(answers[case].fault is None for case in cases[place]):
                pairs = zip(self.tests, cases[place], strict=True)
                try:
                    known[place] = [self.filtered(test, case, answers[case].history) for test, case in pairs]
                except ValueError as error:  # too short a drop for the class, or rows too far apart
                    self.lost(str(error))
        return [known[place] for place in places]

    def lost(self, fault: str) -> None:
        """Count a drop without an answer."""
        short = fault.split(",")[0]
        self.faults[short] = self.faults.get(short, 0) + 1

    def on_grid(self, case: Case, coarser: float) -> Case:
        """The case with a part of its cells."""
        cells = round(case.grid.generatrix * coarser), round(case.grid.hoop * coarser)
        return replace(case, grid=replace(case.grid, generatrix=cells[0], hoop=cells[1]))

    def filtered(self, test: DropTest, case: Case, rows: Floats | None) -> list[Curve]:
        """The drop's curves of the channels of a test."""
        assert rows is not None
        history = as_history(rows, history_dtype(case))
        return [computed_curve(history, str(channel.quantity), self.cfc, test.added) for channel in test.channels]

    # What is compared

    def look(self, places: Sequence[Place]) -> tuple[list[_End], Floats, list[float]]:
        """Places that have an answer, nearest to the tests first, the spread of each channel, and when the middle drop ends."""
        found = []
        for place, curves in zip(places, self.curves(places), strict=True):
            if curves is None:
                continue
            try:
                found.append((place, np.array([self.first_shift(*pair) for pair in zip(self.measured, curves, strict=True)])))
            except ValueError as error:
                self.lost(str(error))
        if not found:
            raise NotCalibrated(f"none of {len(places)} starts has an answer: {self.told_faults() or 'none lies in the ranges'}")
        named = Counter(name for place, _ in found for name in self.opposed_to(place))
        self.opposed = {name for name, count in named.items() if count > 0.5 * len(found)}
        sooner = [float(np.quantile([self.end_of(place, test) for place, _ in found], 0.5)) for test in range(len(self.tests))]
        ranked, noise, none = [], np.empty(0), ValueError()
        for place, shifts in found:
            try:
                windows = self.windows(shifts, sooner)
            except ValueError as error:  # a drop unlike the test, whose shift leaves nothing of it
                none = error
                continue
            if not len(noise):
                noise = np.array([float(np.std(each)) or 1.0 for window in windows for each in window.measured])
            ranked.append(_End(place, shifts, float(np.mean(self.differences(place, shifts, windows, noise) ** 2))))
        if not ranked:
            raise none
        ranked.sort(key=lambda end: end.cost)
        self.say(f"{len(ranked)} of {len(places)} starts have an answer to compare")
        return ranked, noise, sooner

    def first_shift(self, measured: Sequence[Curve], computed: Sequence[Curve]) -> float:
        """The shift of a test that is given, or else the one that lays it over a drop, whose first contact is in it."""
        if self.shift is not None:
            return self.shift
        latest = min(drop.time[0] - test.time[0] for test, drop in zip(measured, computed, strict=True))
        shorter = min(float(np.ptp(curve.time)) for curve in (*measured, *computed))
        return found_shift(list(zip(measured, computed, strict=True)), most=latest + LATE * shorter)

    def opposed_to(self, place: Place) -> set[str]:
        """Channels that run against the drop of a place, in words."""
        curves = self.known[place]
        assert curves is not None
        return {
            f"{test.name}: '{channel.name}' runs against the drop; --invert '{channel.name}' turns it"
            for test, measured, computed in zip(self.tests, self.measured, curves, strict=True)
            for channel, one, other in zip(test.channels, measured, computed, strict=True)
            if _against(one, other, self.spacing)
        }

    def end_of(self, place: Place, test: int) -> float:
        """When (s) the drop of a test ends."""
        curves = self.known[place]
        assert curves is not None
        return min(float(curve.time[-1]) for curve in curves[test])

    def windows(self, shifts: Floats, ends: Sequence[float]) -> list[_Window]:
        """What is compared of each test, whose drop ends at a time (s). Raises ValueError where that is nothing."""
        found = []
        for test, measured, shift, end in zip(self.tests, self.measured, shifts, ends, strict=True):
            first = max(0.0, *(curve.time[0] + shift for curve in measured))
            last = min(curve.time[-1] + shift for curve in measured)
            start, stop = (first + self.period, min(last, end) - self.period) if self.interval is None else self.interval
            if self.interval is not None and (start < first or stop > last):
                shared = f"{test.name}, shifted by {shift:.4g} s, has the drop's {first:.4g} to {last:.4g} s"
                raise ValueError(f"--interval {start:g}:{stop:g}: {shared}")
            count = math.floor((stop - start) / self.spacing + 1e-6) + 1
            if count < 2 * (len(self.variables) + 1):
                lasts = f"{max(stop - start, 0.0) * 1e3:.3g} ms to compare, {max(count, 0)} samples behind CFC {self.cfc}"
                raise ValueError(f"{test.name}: {lasts}; {2 * (len(self.variables) + 1)} are expected")
            time = start - shift + self.spacing * np.arange(count)
            found.append(_Window(start, stop, time, tuple(np.interp(time, *curve) for curve in measured)))
        return found

    def differences(self, place: Place, shifts: Floats, windows: Sequence[_Window], noise: Floats) -> Floats:
        """Test less drop over noise, all channels one behind the other; the drop keeps its last value beyond its end."""
        return np.concatenate([each / one for each, one in zip(self.left(place, shifts, windows), noise, strict=True)])

    def left(self, place: Place, shifts: Floats, windows: Sequence[_Window]) -> list[Floats]:
        """Test less drop of each channel, SI; nan where the drop has no answer."""
        curves = self.curves([place])[0]
        found: list[Floats] = []
        for test, (window, shift) in enumerate(zip(windows, shifts, strict=True)):
            for k, measured in enumerate(window.measured):
                at = window.time + shift
                found.append(measured - (np.nan if curves is None else np.interp(at, *curves[test][k])))
        return found

    # Fits

    def refine(self, start: _End, windows: Sequence[_Window], noise: Floats) -> _End:
        """Where least squares lead to from a start."""
        from scipy.optimize import least_squares

        n = len(self.variables)
        free = 0 if self.shift is not None else len(self.tests)

        def parts(z: Floats) -> tuple[Place, Floats]:
            return tuple(map(float, z[:n])), z[n:] * self.spacing if free else start.shifts

        inside = np.clip(start.place, 1e-6, 1.0 - 1e-6)
        begin = np.concatenate((inside, start.shifts / self.spacing if free else ()))
        bounds = np.concatenate((np.zeros(n), np.full(free, -np.inf))), np.concatenate((np.ones(n), np.full(free, np.inf)))
        if self.curves([tuple(map(float, inside))])[0] is None:
            raise self.no_slope(start.place, 0)
        found = least_squares(
            lambda z: self.differences(*parts(z), windows, noise),
            begin,
            lambda z: self.slopes(*parts(z), windows, noise, self.steps),
            bounds=bounds,
            ftol=1e-6,
            xtol=1e-6,
            gtol=1e-9,
            max_nfev=40,
        )
        place, shifts = parts(found.x)
        near = np.round(place)
        outwards = (np.abs(place - near) < AT_END) & (found.grad[:n] * (0.5 - near) > 0.0)
        ends = tuple(map(float, np.where(outwards, near, place)))
        place = ends if self.curves([ends])[0] is not None else place
        cost = float(np.sum(self.differences(place, shifts, windows, noise) ** 2))
        self.say(f"{self.in_words(place)}: misfit {math.sqrt(cost / len(found.fun)):.4g} of the {self.weight}")
        return _End(place, shifts, cost)

    def in_words(self, place: Place) -> str:
        """Values in their units."""
        return ", ".join(f"{each.path} {each.in_unit(each.at(share))}" for each, share in zip(self.variables, place, strict=True))

    def around(self, place: Place, variable: int, step: float) -> tuple[Place, Place]:
        """Places a step of the range below and above, as far as the range goes."""
        ends = (max(place[variable] - float(step), 0.0), min(place[variable] + float(step), 1.0))
        low, high = ((*place[:variable], end, *place[variable + 1 :]) for end in ends)
        return low, high

    def slopes(self, place: Place, shifts: Floats, windows: Sequence[_Window], noise: Floats, steps: Floats) -> Floats:
        """Change of the differences by part of the range, by central differences, and by spacing that a test is shifted."""
        pairs = [self.around(place, k, step) for k, step in enumerate(steps)]
        self.curves([one for pair in pairs for one in pair])
        columns = []
        for k, (low, high) in enumerate(pairs):
            low, high = (place if self.known[one] is None else one for one in (low, high))
            if low == high:
                raise self.no_slope(place, k)
            change = self.differences(high, shifts, windows, noise) - self.differences(low, shifts, windows, noise)
            columns.append(change / (high[k] - low[k]))
        if self.shift is None:
            curves = self.known[place]
            assert curves is not None
            for moved in range(len(self.tests)):
                parts = []
                for test, window in enumerate(windows):
                    for k in range(len(window.measured)):
                        time, values = curves[test][k]
                        slope = np.interp(window.time + shifts[test], time, np.gradient(values, time))
                        parts.append(-slope * self.spacing if test == moved else np.zeros(len(slope)))
                columns.append(np.concatenate([part / one for part, one in zip(parts, noise, strict=True)]))
        return np.column_stack(columns)

    def no_slope(self, place: Place, variable: int) -> NotCalibrated:
        """Of a place around which drops have no answer."""
        path = self.variables[variable].path
        return NotCalibrated(f"too few drops around {self.in_words(place)} tell the slope over {path}: {self.told_faults()}")

    def told_faults(self) -> str:
        """Why drops had no answer, in words."""
        return "; ".join(f"{fault} ({count} times)" for fault, count in self.faults.items())

    def noise(self, end: _End, windows: Sequence[_Window]) -> Floats:
        """Root mean square of what is left of each channel."""
        tiny = [1e-12 * float(np.abs(each).max()) or 1e-300 for window in windows for each in window.measured]
        left = [float(np.sqrt(np.mean(one**2))) for one in self.left(end.place, end.shifts, windows)]
        return np.maximum(left, tiny)

    def ends_around(self, end: _End) -> list[float]:
        """When (s) the first of the drops ends that slopes at an end are taken from."""
        places = [end.place, *(one for k, step in enumerate(self.steps) for one in self.around(end.place, k, step))]
        there = [place for place, curves in zip(places, self.curves(places), strict=True) if curves is not None]
        return [min(self.end_of(place, test) for place in there) for test in range(len(self.tests))]

    # What the tests tell

    def good_slopes(self, end: _End, windows: Sequence[_Window], noise: Floats) -> tuple[Floats, Floats]:
        """Slopes over each input by many steps, and norms of their errors; from now on single steps are those that err least.

        A line through half the differences at +h and -h, with a cube where it shows. On a grid such differences hold what
        crumpling fabric makes of a step: slopes over narrow steps are exact, and tell nothing of wider ones. What is off the
        lines is that scatter, pooled over the inputs.
        """
        n, room = len(self.variables), [max(min(share, 1.0 - share), AT_END) for share in end.place]
        slopes, errors = np.empty((0, 0)), np.empty(0)
        reaches = [REACHES[0]] * n
        for wider in (*REACHES[1:], None):
            slopes, errors = self.slopes_over(end, windows, noise, [min(*each) for each in zip(reaches, room, strict=True)])
            unsure = errors > SURE * np.linalg.norm(slopes, axis=0)
            if wider is None or not unsure.any():
                break
            reaches = [wider if one else reach for one, reach in zip(unsure, reaches, strict=True)]
        return slopes, errors

    def slopes_over(
        self, end: _End, windows: Sequence[_Window], noise: Floats, reaches: Sequence[float]
    ) -> tuple[Floats, Floats]:
        """As `good_slopes`, over a reach of each input."""
        pairs = [[self.around(end.place, k, reach * step) for step in STEPS] for k, reach in enumerate(reaches)]
        self.curves([one for each in pairs for pair in each for one in pair])
        fits = []
        for k, each in enumerate(pairs):
            there = [pair for pair in each if all(self.known[one] is not None for one in pair)]
            if len(there) < 4:
                raise self.no_slope(end.place, k)
            ends = [[self.differences(one, end.shifts, windows, noise) for one in pair] for pair in there]
            halves = np.array([0.5 * (high - low) for low, high in ends])
            fits.append((np.array([0.5 * (high[k] - low[k]) for low, high in there]), halves))
        bent, straight = ([_odd(steps, halves, powers) for steps, halves in fits] for powers in ((1, 3), (1,)))
        off = sum(each.off for each in bent) / sum(len(steps) - 2 for steps, _ in fits)  # of a step, over all samples
        slopes, errors = [], []
        for k, (one, other) in enumerate(zip(straight, bent, strict=True)):
            best = other if one.off - other.off > BENT * off else one
            slopes.append(best.lines[0])
            errors.append(math.sqrt(off * best.inverse))
            tried = reaches[k] * np.array(STEPS)
            mistaken = math.sqrt(off) / tried + float(np.linalg.norm(other.lines[1])) * tried**2
            self.steps[k] = tried[int(np.argmin(mistaken))]
        return np.column_stack(slopes), np.array(errors)

    def scatter(self, end: _End, windows: Sequence[_Window]) -> tuple[list[Floats], list[Floats] | None]:
        """What the model changes by with round-off, and on a coarser grid; None without a grid. Of each channel, SI."""
        sign = [1.0 if share < 0.5 else -1.0 for share in end.place]
        moved = [tuple(share + k * 1e-8 * way for share, way in zip(end.place, sign, strict=True)) for k in (1, 2)]
        three = [self.left(place, end.shifts, windows) for place in (end.place, *moved)]
        rounded = [(a - 2.0 * b + c) / math.sqrt(6.0) for a, b, c in zip(*three, strict=True)]
        if all(test.load(self.values(end.place)).model.fidelity == "lumped" for test in self.tests):
            return rounded, None
        own, coarser = self.known[end.place], self.curves([end.place], COARSER)[0]
        if own is None or coarser is None:
            raise NotCalibrated(f"a coarser grid has no answer to compare the model with: {self.told_faults()}")
        changes = []
        for test, (window, shift) in enumerate(zip(windows, end.shifts, strict=True)):
            at = window.time + shift
            for one, other in zip(own[test], coarser[test], strict=True):
                both = at <= other.time[-1] - self.period
                changes.append(np.where(both, np.interp(at, *one) - np.interp(at, *other), 0.0))
        return rounded, changes

    def told(
        self, end: _End, windows: list[_Window], noise: Floats, ends: Sequence[_End], first_noise: Floats, starts: int
    ) -> Calibration:
        """What the tests tell at an end. ends: of all starts refined, by the noise of then."""
        n = len(self.variables)
        slopes = self.slopes(end.place, end.shifts, windows, noise, self.steps)
        slopes[:, :n], errors = self.good_slopes(end, windows, noise)
        for test, window in enumerate(windows):
            if (last := self.end_of(end.place, test)) < window.time[-1] + end.shifts[test]:
                ends_at = f"the drop fitted to {self.tests[test].name} ends at {last:.4g} s"
                raise NotCalibrated(f"{ends_at}, before {window.stop:.4g} s; --interval up to there is expected")
        left = self.left(end.place, end.shifts, windows)
        rounded, coarser = self.scatter(end, windows)
        floors = [_rms(one) for one in rounded]
        if coarser is not None:
            floors = [math.hypot(floor, _rms(one)) for floor, one in zip(floors, coarser, strict=True)]
        channels = self.fitted_channels(end, windows, left, floors)
        _refuse_scatter(channels, coarser is not None)
        at_end = np.array([share in (0.0, 1.0) for share in end.place])
        try:
            known = known_by(slopes, errors, at_end, [one / size for one, size in zip(left, noise, strict=True)])
        except TooFewSamples as error:
            raise NotCalibrated(str(error)) from error
        half = known.half_widths[:n]
        hidden = {k for direction in known.unseen for k in direction}
        bias = np.zeros(n)
        if coarser is not None:
            bias = (known.inverse @ np.concatenate([one / size for one, size in zip(coarser, noise, strict=True)]))[:n]
        inputs = []
        for k, (each, share) in enumerate(zip(self.variables, end.place, strict=True)):
            side = "upper" if share else "lower"
            why = f"at the {side} end of its range" if at_end[k] else "not determined" if k in hidden else ""
            interval = None if why else (float(each.at(share - half[k])), float(each.at(share + half[k])))
            grid = None if why or coarser is None else float(abs(each.at(share + bias[k]) - each.at(share)))
            inputs.append(FittedInput(each, float(each.at(share)), interval, why, grid))
        silent = [k for k, one in enumerate(inputs) if one.interval is None]
        deviations = np.sqrt(np.diag(known.covariance)[:n])
        deviations[silent] = np.nan
        undetermined = [self.named(direction, end.place) for direction in known.unseen or known.wide(n)]
        first = min(ends, key=lambda one: one.cost)
        apart = [one for one in ends if not first.near(one)]
        scattered = sum(len(one) * (floor / size) ** 2 for one, floor, size in zip(left, floors, first_noise, strict=True))
        rivals = [one for one in apart if one.cost < first.cost * known.allowed + scattered]
        with np.errstate(invalid="ignore"):
            correlations = known.covariance[:n, :n] / np.outer(deviations, deviations)
        return Calibration(
            inputs=tuple(inputs),
            correlations=correlations,
            channels=tuple(replace(each, correlation=one) for each, one in zip(channels, known.correlations, strict=True)),
            shifts=tuple(map(float, end.shifts)),
            undetermined=tuple(undetermined),
            slope_errors=tuple(map(float, errors / np.maximum(np.linalg.norm(slopes[:, :n], axis=0), 1e-300))),
            starts=starts,
            refined=len(ends),
            agreeing=len(ends) - len(apart),
            rivals=() if undetermined else tuple(tuple(self.values(one.place).values()) for one in rivals),
            drops=self.drops,
            faults=self.faults,
            opposed=tuple(sorted(self.opposed & self.opposed_to(end.place))),
        )

    def fitted_channels(
        self, end: _End, windows: Sequence[_Window], left: Sequence[Floats], floors: Sequence[float]
    ) -> list[FittedChannel]:
        """The channels of all tests beside the drop."""
        found: list[FittedChannel] = []
        for test, window, shift in zip(self.tests, windows, end.shifts, strict=True):
            for channel, measured in zip(test.channels, window.measured, strict=True):
                difference, floor = left[len(found)], floors[len(found)]
                of = test.name, channel.name, str(channel.quantity), channel.unit
                pair = window.time + shift, measured, measured - difference
                found.append(FittedChannel(*of, *pair, misfit=_rms(difference), scatter=floor, correlation=0.0))
        return found

    def named(self, direction: Mapping[int, float], place: Place) -> str:
        """Inputs whose change by parts of their ranges the tests do not show, in words."""
        if len(direction) == 1:
            each = self.variables[next(iter(direction))]
            return f"{each.path}: the tests do not tell it from {each.in_unit(each.low)} to {each.in_unit(each.high)}"
        scale = max(
            abs(part) * (math.log(self.variables[k].high / self.variables[k].low) if self.variables[k].low > 0.0 else 1.0)
            for k, part in direction.items()
        )
        changes = []
        for k, part in direction.items():
            each, share = self.variables[k], part * math.log(1.1) / scale
            change = each.at(place[k] + share) - each.at(place[k])
            by = f"{change / each.at(place[k]):+.1%}" if each.low > 0.0 else f"{change / each.size:+.3g} {each.shown}".rstrip()
            changes.append(f"{each.path} by {by}")
        names = " and ".join(self.variables[k].path for k in direction)
        return f"{names}: the tests tell one combination of them; {' with '.join(changes)} changes nothing that they show"


def _against(test: Curve, drop: Curve, spacing: float) -> bool:
    """Whether a test is most like the drop turned about, over all shifts that share half of the shorter one.

    The sign at one shift does not tell: the shift that fits best lays a turned pulse beside that of the drop.
    """
    from scipy.signal import correlate

    t, d = (np.interp(np.arange(curve.time[0], curve.time[-1], spacing), *curve) for curve in (test, drop))
    t, d, one, other = t - t.mean(), d - d.mean(), np.ones(len(t)), np.ones(len(d))
    shared = np.rint(correlate(one, other))
    of_t, of_d = correlate(t, other), correlate(one, d)
    products = np.where(shared >= 0.5 * min(len(t), len(d)), correlate(t, d) - of_t * of_d / shared, 0.0)
    k = int(np.argmin(products))
    if products[k] >= -products.max():
        return False
    squares = correlate(t**2, other) - of_t**2 / shared, correlate(one, d**2) - of_d**2 / shared
    return bool(products[k] < -LIKE * math.sqrt(squares[0][k] * squares[1][k]))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


class _Odd(NamedTuple):
    """Odd powers through half differences."""

    lines: Floats  # (powers, samples)
    off: float  # sum of squares beside them
    inverse: float  # variance of the slope over that of a half difference


def _odd(steps: Floats, halves: Floats, powers: Sequence[int]) -> _Odd:
    """Fit powers of steps to half differences, (steps, samples)."""
    basis = steps[:, None] ** np.array(powers)
    lines = np.linalg.lstsq(basis, halves, rcond=None)[0]
    return _Odd(lines, float(np.sum((halves - basis @ lines) ** 2)), float(np.linalg.inv(basis.T @ basis)[0, 0]))


def _refuse_scatter(channels: Sequence[FittedChannel], gridded: bool) -> None:
    """Raise NotCalibrated where the model changes by more than what is left between it and the tests."""
    ratios = [each.scatter / each.misfit if each.misfit else math.inf for each in channels]
    if math.sqrt(sum(ratio**2 for ratio in ratios) / len(ratios)) < 1.0:
        return
    worst = channels[ratios.index(max(ratios))]
    unit = QUANTITIES[worst.quantity].unit
    cause, cure = (f"on a grid of {COARSER:.0%} of the cells", "a finer grid") if gridded else ("with round-off", "another model")
    raise NotCalibrated(
        f"the model itself changes by {worst.scatter:.3g} {unit} {cause}, and differs by {worst.misfit:.3g} {unit} from "
        f"{worst.test} in '{worst.name}' (root mean squares): intervals would be of the model's own error; {cure} is expected"
    )
