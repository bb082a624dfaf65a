"""A drop beside a test: marks of known pulses, the shift, the rating against an implementation of its own, the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from conftest import Command
from numpy.typing import NDArray

from softbrake.core.arrays import Floats
from softbrake.signals.channel import Channel, SignalError
from softbrake.signals.choice import chosen, in_terms_of_drop
from softbrake.studies.comparison import RATE, Curve, Pair, compare, found_shift, marks_of, rate

G = 9.80665
LASTS = 0.12  # s


def history_of(time: Floats, velocity: Floats, acceleration: Floats, pressure: Floats, height: Floats) -> NDArray[np.void]:
    names = ("time", "velocity", "acceleration", "pressure", "height")
    rows = np.zeros(len(time), [(name, float) for name in names])
    for name, values in zip(names, (time, velocity, acceleration, pressure, height), strict=True):
        rows[name] = values
    return rows


def half_sine(peak: float = 80.0, start: float = 0.02, length: float = 0.06, rows: int = 12_001) -> NDArray[np.void]:
    """A cargo at 8 m/s that a half sine of deceleration, net of gravity, brakes."""
    time = np.linspace(0.0, LASTS, rows)
    within = np.clip((time - start) / length, 0.0, 1.0)
    acceleration = peak * np.sin(np.pi * within)
    velocity = -8.0 + peak * length / np.pi * (1.0 - np.cos(np.pi * within))
    height = 1.0 + np.concatenate(([0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time))))
    return history_of(time, velocity, acceleration, 10e3 + 100.0 * acceleration, height)


def channel(time: Floats, values: Floats, unit: str = "g", **more: object) -> Channel:
    return Channel("a", time, values, unit, **more)  # type: ignore[arg-type]


def test_marks_of_a_half_sine_are_those_of_its_formula() -> None:
    """Peak A, width of half the peak 2/3 of the length, change of velocity 2 A T / pi; gravity is no part of the change."""
    drop = half_sine()
    pulse = channel(drop["time"] + 0.5, drop["acceleration"] + G, "m/s^2")
    found = compare(drop, [pulse], cfc=None, added=G, shift=-0.5)
    (one,) = found.quantities
    for marks in (one.test, one.computed):
        assert marks.peak == pytest.approx(80.0 + G, rel=1e-6)
        assert marks.time == pytest.approx(0.05, abs=1e-4)
        assert marks.change == pytest.approx(2.0 * 80.0 * 0.06 / np.pi, rel=1e-5)
    plain = marks_of("deceleration", one.pair.time, one.pair.test - G, 0.0)
    assert plain.width == pytest.approx(0.04, abs=2.1 / RATE)
    assert one.rms < 1e-9


def test_velocity_and_height_are_marked_by_their_lowest_values() -> None:
    drop = half_sine()
    at = np.arange(601) / 5000.0
    channels = [
        Channel("v", at, np.interp(at, drop["time"], drop["velocity"]), "m/s"),
        Channel("h", at, np.interp(at, drop["time"], drop["height"]), "mm"),
        Channel("p", at, np.interp(at, drop["time"], drop["pressure"]) + 101325.0, "kPa"),
    ]
    found = compare(drop, in_terms_of_drop(channels, turned=(), ambient=101325.0), cfc=None, added=0.0, shift=0.0)
    velocity, height, pressure = found.quantities
    assert velocity.test.peak == pytest.approx(-8.0) and velocity.test.change == pytest.approx(2 * 80 * 0.06 / np.pi, rel=1e-4)
    assert height.test.peak == pytest.approx(drop["height"].min(), rel=1e-5) and height.test.width is None
    assert pressure.test.peak == pytest.approx(18e3, rel=1e-4) and pressure.test.change is None
    assert max(one.rms / abs(one.test.peak) for one in found.quantities) < 1e-3


@pytest.mark.parametrize("shift", [-0.3137, 0.0, 0.01234, 2.5])
def test_a_shift_is_found_again(shift: float) -> None:
    """To a hundredth of the step of the axis on smooth curves; noise and a long quiet record beside it change little."""
    drop = half_sine()
    computed = Curve(drop["time"], drop["acceleration"])
    time = np.arange(-1000, 20_000) / 8000.0
    clean = np.interp(time, drop["time"], drop["acceleration"])
    assert found_shift([(Curve(time + 0.7, clean), computed)], least=-0.8, most=-0.6) == pytest.approx(-0.7, abs=1e-6)
    noisy = clean + np.random.default_rng(1).normal(0.0, 4.0, len(time))
    assert found_shift([(Curve(time - shift, noisy), computed)]) == pytest.approx(shift, abs=2e-4)


def test_a_shift_minimises_the_mean_square_over_what_is_shared() -> None:
    """Against the sums written out, shift by shift, on short records."""
    rng = np.random.default_rng(3)
    test = Curve(np.arange(40) / RATE, np.cumsum(rng.normal(size=40)))
    drop = Curve((np.arange(25) + 7) / RATE, np.cumsum(rng.normal(size=25)))

    def misfit(steps: int) -> float:
        shared = [(i, i + steps - 7) for i in range(40) if 0 <= i + steps - 7 < 25]
        return float(np.mean([(test.values[i] - drop.values[k]) ** 2 for i, k in shared])) if len(shared) >= 12.5 else np.inf

    steps = np.arange(-60, 60)
    best = int(steps[np.argmin([misfit(step) for step in steps])])
    assert abs(found_shift([(test, drop)]) * RATE - best) <= 0.5


def test_both_are_filtered_alike_and_a_filtered_channel_once() -> None:
    drop = half_sine()
    at = np.arange(2401) / 20_000.0
    raw = np.interp(at, drop["time"], drop["acceleration"])
    noise = 20.0 * np.sin(2.0 * np.pi * 3000.0 * at)  # which a class of 60 lets not through
    found = compare(drop, [channel(at, (raw + noise), "m/s^2")], cfc=60, added=0.0, shift=0.0)
    assert found.quantities[0].rms < 0.1
    assert found.quantities[0].test.peak < 80.0  # of the class, a little below the formula's
    once = compare(drop, [channel(at, raw, "m/s^2", cfc=60)], cfc=60, added=0.0, shift=0.0)
    assert once.quantities[0].test.peak == pytest.approx(80.0, rel=1e-5)


def test_what_is_compared_is_within_both() -> None:
    drop = half_sine()
    pulse = channel(drop["time"][2000:] + 1.0, drop["acceleration"][2000:], "m/s^2")
    found = compare(drop, [pulse], cfc=None, added=0.0, shift=-1.0)
    assert found.interval == pytest.approx((0.02, LASTS)) and not found.shift_found
    part = compare(drop, [pulse], cfc=None, added=0.0, shift=-1.0, interval=(0.03, 0.05)).quantities[0].pair
    assert (part.time[0], part.time[-1], len(part.time)) == pytest.approx((0.03, 0.05, 201))
    with pytest.raises(ValueError, match=r"they share 0.02 to 0.05 s; an interval within is expected"):
        compare(drop, [pulse], cfc=None, added=0.0, shift=-1.0, interval=(0.0, 0.05))
    with pytest.raises(ValueError, match="they share no time"):
        compare(drop, [pulse], cfc=None, added=0.0, shift=5.0)
    with pytest.raises(ValueError, match="0 to 0.2 s of a drop known from 0 to 0.12 s"):
        compare(drop, [pulse], cfc=None, added=0.0, shift=-1.0, interval=(0.0, 0.2))


def test_what_comes_after_the_drop_is_no_part_of_it() -> None:
    """A blow on the ground of ten times the peak, from the end of the drop on, moves neither shift nor marks."""
    drop = half_sine()
    at = np.arange(0.0, 0.2, 1e-4)
    quiet = np.interp(at, drop["time"], drop["acceleration"])
    blow = np.where((at > LASTS) & (at < LASTS + 0.008), 800.0 * np.sin(np.pi * (at - LASTS) / 0.008), 0.0)
    plain, struck = (compare(drop, [channel(at, each, "m/s^2")], cfc=60, added=0.0) for each in (quiet, quiet + blow))
    assert plain.interval == struck.interval == pytest.approx((0.01, LASTS - 0.01), abs=1e-4)
    assert struck.shift == pytest.approx(0.0, abs=2e-4)
    assert struck.quantities[0].test.peak == pytest.approx(plain.quantities[0].test.peak, rel=1e-3)
    assert struck.quantities[0].rms < 0.01 * 80.0


def test_a_channel_of_the_other_sign_is_named_and_no_other() -> None:
    """Whether or not the shift is given; a constant, as gravity or the ambient pressure, turns nothing."""
    drop = half_sine()
    at = np.arange(0.0, LASTS, 1e-4)
    acceleration, pressure = (np.interp(at, drop["time"], drop[name]) for name in ("acceleration", "pressure"))
    for shift in (None, 0.0):
        for sign, off, expected in ((-1.0, 0.0, ["a"]), (1.0, 101325.0, []), (1.0, 0.0, [])):
            both = [channel(at, sign * acceleration, "m/s^2"), Channel("p", at, pressure + off, "Pa")]
            assert compare(drop, both, cfc=None, added=0.0, shift=shift).opposed == expected


def test_ten_samples_a_second_and_class_are_enough_however_times_are_written() -> None:
    drop = half_sine()
    at = np.round(np.arange(721) / 6000.0, 6)
    pulse = channel(at, np.interp(at, drop["time"], drop["acceleration"]), "m/s^2")
    assert compare(drop, [pulse], cfc=600, added=0.0, shift=0.0).quantities[0].rms < 0.1
    with pytest.raises(ValueError, match=r"CFC 1000: rows 0.167 ms apart, 0.1 allowed"):
        compare(drop, [pulse], cfc=1000, added=0.0, shift=0.0)
    with pytest.raises(ValueError, match="'a' has passed CFC 60; this class or a lower one is expected"):
        compare(drop, [channel(at, pulse.values, "m/s^2", cfc=60)], cfc=180, added=0.0, shift=0.0)


# The rating of ISO/TS 18571 once more, from the standard's formulas.


def corridor(test: Floats, drop: Floats) -> float:
    norm = np.abs(test).max()
    inner, outer = 0.05 * norm, 0.5 * norm
    scores = [1.0 if d <= inner else 0.0 if d >= outer else ((outer - d) / (outer - inner)) ** 2 for d in np.abs(test - drop)]
    return float(np.mean(scores))


def best_lag(test: Floats, drop: Floats) -> int:
    """Samples that the drop is early or late by, at most a fifth of all, where both correlate best."""
    n, best, lag = len(test), -np.inf, 0
    for shift in range(int(0.2 * n) + 1):
        for sign in (1, -1):
            one, two = (test[: n - shift], drop[shift:]) if sign > 0 else (test[shift:], drop[: n - shift])
            if (found := float(np.corrcoef(one, two)[0, 1])) > best + 1e-15:
                best, lag = found, sign * shift
    return lag


def aligned(test: Floats, drop: Floats) -> tuple[Floats, Floats]:
    n, lag = len(test), best_lag(test, drop)
    return (test[: n - lag], drop[lag:]) if lag >= 0 else (test[-lag:], drop[: n + lag])


def magnitude(test: Floats, drop: Floats) -> float:
    """By dynamic time warping in a window of a tenth, its path from the end."""
    one, two = aligned(test, drop)
    n, window = len(one), int(np.ceil(0.1 * len(one))) - 1
    cost = np.full((n + 1, n + 1), np.inf)
    cost[0, 0] = 0.0
    for i in range(n):
        for k in range(max(0, i - window), min(n, i + window + 1)):
            cost[i + 1, k + 1] = (one[i] - two[k]) ** 2 + min(cost[i, k + 1], cost[i + 1, k], cost[i, k])
    i = k = n
    apart, size = 0.0, 0.0
    while i > 0:
        apart += abs(one[i - 1] - two[k - 1])
        size += abs(one[i - 1])
        ways = {(i - 1, k - 1): cost[i - 1, k - 1], (i - 1, k): cost[i - 1, k], (i, k - 1): cost[i, k - 1]}
        i, k = min(ways, key=ways.__getitem__)
    return max(0.0, 1.0 - apart / size / 0.5)


def slope(test: Floats, drop: Floats) -> float:
    def smooth(values: Floats) -> Floats:
        raw = np.gradient(values, 1.0 / RATE)
        half = [min(k, len(raw) - 1 - k, 4) for k in range(len(raw))]
        return np.array([raw[k - h : k + h + 1].mean() for k, h in enumerate(half)])

    one, two = (smooth(values) for values in aligned(test, drop))
    return max(0.0, 1.0 - float(np.abs(one - two).sum() / np.abs(one).sum()) / 2.0)


def pair_of(test: Floats, drop: Floats) -> Pair:
    return Pair(np.arange(len(test)) / RATE, test, drop)


X = np.arange(400) / RATE
PULSE = 60.0 * np.sin(np.pi * X / X[-1]) ** 2 + 4.0 * np.sin(40.0 * np.pi * X / X[-1])


@pytest.mark.parametrize(
    "drop",
    [PULSE * 1.1, np.roll(PULSE, 13), np.roll(PULSE, -9) * 0.93, PULSE + 5.0, PULSE**2 / 60.0, -PULSE],
    ids=["higher", "late", "early", "off", "sharper", "turned"],
)
def test_the_rating_is_that_of_the_standards_formulas(drop: Floats) -> None:
    rated, why = rate(pair_of(PULSE, drop))
    assert rated is not None and why is None
    late = abs(best_lag(PULSE, drop))
    phase = max(0.0, 1.0 - late / (0.2 * len(PULSE)))
    assert rated.corridor == pytest.approx(corridor(PULSE, drop), abs=1e-12)
    assert rated.phase == pytest.approx(phase, abs=1e-12)
    assert rated.magnitude == pytest.approx(magnitude(PULSE, drop), abs=2e-3)  # paths of equal cost differ
    assert rated.slope == pytest.approx(slope(PULSE, drop), abs=1e-12)
    parts = 0.4 * rated.corridor + 0.2 * (rated.phase + rated.magnitude + rated.slope)
    assert rated.overall == pytest.approx(parts, abs=1e-12)


def test_ratings_have_the_properties_of_the_standard() -> None:
    """Identical curves 1; early and late by as much the same phase; of a turned pair of curves the same rating."""
    same, _ = rate(pair_of(PULSE, PULSE))
    assert same is not None and (same.overall, same.corridor, same.phase, same.magnitude, same.slope) == (1.0,) * 5
    late, _ = rate(pair_of(PULSE, np.roll(PULSE, 11)))
    early, _ = rate(pair_of(PULSE, np.roll(PULSE, -11)))
    assert late is not None and early is not None and late.phase == early.phase == pytest.approx(1.0 - 11.0 / 80.0)
    one, _ = rate(pair_of(PULSE, 0.9 * PULSE))
    other, _ = rate(pair_of(-PULSE, -0.9 * PULSE))
    assert one is not None and one == other


def test_flat_curves_get_no_rating() -> None:
    assert rate(pair_of(np.zeros(200), PULSE[:200])) == (None, "the test is flat")
    assert rate(pair_of(PULSE[:200], np.full(200, 3.0))) == (None, "the drop is flat")
    long = np.sin(np.arange(7001.0))
    assert rate(pair_of(long, long)) == (None, "0.7 s are too long, up to 0.6 s are expected; --interval")


def test_channels_are_chosen_by_quantity_or_name() -> None:
    time = np.arange(3.0)
    a, b = (Channel(name, time, time, "g") for name in ("acc z", "acc z 2"))
    p, strain = Channel("P1", time, time, "kPa", "10PRESS0000000PR"), Channel("S", time, time, "")
    assert chosen([a, p, strain], (), "t.csv") == [a, p]
    assert chosen([a, b, p], ["acc z 2", "10PRESS0000000PR"], "t.csv") == [b, p]
    gap = Channel("h", time, time, "m", fault="t.mme: 'h': sample 2 is no number")
    assert chosen([a, gap], ["acc z"], "t.mme") == [a]
    for channels, names, message in (
        ([a, gap], (), "t.mme: 'h': sample 2 is no number"),
        ([a, b], (), "t.csv: 'acc z' and 'acc z 2' are both a deceleration; --channel NAME chooses one"),
        ([a, p], ["accz"], "t.csv: no channel 'accz'; did you mean 'acc z'?"),
        ([a, strain], ["S"], "t.csv: 'S' is without a unit, none of deceleration, pressure, velocity, height; --unit 'S=g'"),
        ([strain], (), "t.csv: no channel of deceleration, pressure, velocity, height: 'S' in ''; --unit"),
    ):
        with pytest.raises(SignalError) as fault:
            chosen(channels, names, "t.csv")
        assert str(fault.value).startswith(message)


BAG = """\
shell: {diameter: 0.8 m, height: 0.7 m}
cargo: {mass: 200 kg, velocity: 6 m/s}
fabric: {E: 60 kN/m, areal_density: 0.1 kg/m^2, damping_ratio: 3 %}
gas: {pressure: 8 kPa}
vents: [{area: 120 cm^2, discharge: 0.7}]
model: {fidelity: lumped}
"""


@pytest.fixture
def dropped(softbrake: Command, tmp_path: Path) -> Path:
    (tmp_path / "bag.yaml").write_text(BAG, encoding="utf-8")
    assert softbrake("run", "bag.yaml", "-q").returncode == 0
    return tmp_path


def test_a_drop_beside_its_own_export_is_the_same(softbrake: Command, dropped: Path) -> None:
    assert softbrake("export", "bag.vtkhdf", "--format", "csv").returncode == 0
    asked = ("--channel", "acceleration", "--channel", "pressure", "--channel", "velocity", "--channel", "height")
    known = ("--gravity", "out", "--pressure", "gauge", "--cfc", "none")
    done = softbrake("compare", "bag.vtkhdf", "bag.csv", *asked, *known, "--json", "-o", "over.png", "-o", "page.html")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert abs(found["shift"]) < 1e-6 and found["shift_found"]
    for each in found["quantities"]:
        assert each["rms"] < 1e-4 * abs(each["test"]["peak"])
        assert each["rating"]["overall"] == pytest.approx(1.0, abs=1e-6)
    assert (dropped / "over.png").stat().st_size > 10_000
    assert "Beside the test" in (dropped / "page.html").read_text(encoding="utf-8")
    printed = softbrake("compare", "bag.vtkhdf", "bag.csv", *asked[:4], *known, "--interval", "50ms:200ms")
    assert "ISO/TS 18571" in printed.stdout and max(map(len, printed.stdout.splitlines())) <= 80


def test_what_no_record_tells_is_asked(softbrake: Command, dropped: Path) -> None:
    (dropped / "t.csv").write_text(
        "t [s],acc z [g],p [kPa]\n" + "".join(f"{k * 1e-3},{k % 7},{100 + k}\n" for k in range(200)), encoding="utf-8"
    )
    for words, message in (
        ((), "t.csv: 'acc z' is a deceleration: --gravity in or --gravity out is expected"),
        (("--gravity", "in"), "t.csv: 'p' is a pressure: --pressure gauge or --pressure absolute is expected"),
        (("--gravity", "up"), "--gravity up: --gravity in or --gravity out is expected"),
        (("--channel", "acc x"), "t.csv: no channel 'acc x'; did you mean 'acc z'?"),
        (("--channel", "acc z", "--gravity", "in", "--cfc", "100"), "--cfc 100: 60, 180, 600, 1000 or none is expected"),
        (
            ("--channel", "p", "--pressure", "gauge", "--shift", "3kg"),
            "--shift 3kg: 'kg' is a mass; a time such as 12ms is expected",
        ),
        (("--channel", "acc z", "--gravity", "in", "--interval", "9ms"), "--interval 9ms: FROM:TO is expected, as 20ms:120ms"),
        (("--channel", "acc z", "--gravity", "in", "--invert", "b"), "--invert b: is not compared; 'acc z' are"),
        (("--unit", "acc z"), "--unit acc z: NAME=UNIT is expected, as 'acc z=g'"),
    ):
        done = softbrake("compare", "bag.vtkhdf", "t.csv", *words)
        assert (done.returncode, done.stderr.strip()) == (2, message)
        assert done.stdout == ""


def test_a_channel_of_unknown_unit_is_named(softbrake: Command, dropped: Path) -> None:
    rows = "".join(f"{k * 1e-3},{k % 7},{1 + k},{k}\n" for k in range(200))
    (dropped / "t.csv").write_text("t [s],acc z [G],p [kPa],E [J]\n" + rows, encoding="utf-8")
    done = softbrake("compare", "bag.vtkhdf", "t.csv", "--pressure", "gauge", "--cfc", "none")
    assert done.returncode == 0
    assert done.stderr.splitlines()[0] == "t.csv: 'acc z' is in 'G', and not compared; --unit 'acc z=g' gives it one"
    assert "'E'" not in done.stderr
