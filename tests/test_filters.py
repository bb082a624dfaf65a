"""Peaks behind a channel frequency class of SAE J211, and peaks told apart by the phase of the drop."""

from dataclasses import asdict
from math import cos, exp, pi, sin, sqrt, tan
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT, Command

import softbrake
from softbrake.case.case import Case
from softbrake.case.case_file import load_case
from softbrake.core.arrays import Floats, Outcome, Peak
from softbrake.core.columns import History
from softbrake.core.loop.time_loop import FILTER_TIME, filter_deceleration
from softbrake.sim.filters import COLUMNS, CORNER, SAMPLES, filtered, filtered_peaks, filtered_slope, low_pass, unfit
from softbrake.sim.result_file import read_history, read_summary
from softbrake.sim.simulation import Simulation
from softbrake.sim.summary import FilteredPeaks

CLASSES = (60, 180, 600, 1000)
SMALL = ("grid.generatrix=12", "grid.hoop=30", "contact=solid")


def case(*overrides: str) -> Case:
    return load_case(ROOT / "configs" / "paper.yaml", [*SMALL, *overrides])


def j211(values: Floats, step: float, cfc: float) -> Floats:
    """SAE J211-1, appendix C, word by word: its recursion over even samples (step in s) and over them in reverse.

    Both ends are mirrored by 10 ms; before the first sample the record is taken to have been what it is there.
    """
    wd = 2.0 * pi * cfc * 2.0775
    wa = sin(wd * step / 2.0) / cos(wd * step / 2.0)
    below = 1.0 + sqrt(2.0) * wa + wa**2
    a0 = wa**2 / below
    a1, a2 = 2.0 * a0, a0
    b1 = -2.0 * (wa**2 - 1.0) / below
    b2 = (-1.0 + sqrt(2.0) * wa - wa**2) / below
    ends = round(0.01 / step)
    data = [*values[ends:0:-1], *values, *values[-2 : -ends - 2 : -1]]
    for _ in range(2):
        x1 = x2 = y1 = y2 = data[0]
        passed = []
        for x in data:
            y = a0 * x + a1 * x1 + a2 * x2 + b1 * y1 + b2 * y2
            x1, x2, y1, y2 = x, x1, y, y1
            passed.append(y)
        data = passed[::-1]
    return np.array(data[ends : ends + len(values)])


def half_sine(time: Floats) -> Floats:
    """A pulse of 1 from 20 to 30 ms."""
    return np.where((time > 0.02) & (time < 0.03), np.sin(pi * (time - 0.02) / 0.01), 0.0)


# The filter


@pytest.mark.parametrize("cfc", CLASSES)
def test_even_samples_are_filtered_as_by_appendix_c(cfc: int) -> None:
    """A half sine of 10 ms, noise that does not vanish at the ends, and a record shorter than both mirrors."""
    step = 1e-4
    time = step * np.arange(500)
    noise = np.random.default_rng(1).normal(size=500).cumsum()
    for values in (half_sine(time), noise, noise[:101]):
        twin = j211(values, step, cfc)
        np.testing.assert_allclose(low_pass(values, 1.0 / step, cfc), twin, rtol=0, atol=1e-11 * np.abs(values).max())


@pytest.mark.parametrize("cfc", CLASSES)
def test_peak_of_a_half_sine(cfc: int) -> None:
    """Its convolution with the transform of 1/(1 + (w/wc)^4), the filter in continuous time: 0.951 at CFC 60."""
    w, t = 2.0 * pi * CORNER * cfc / sqrt(2.0), np.linspace(-0.005, 0.005, 20_001)
    response = 0.5 * w * np.exp(-w * np.abs(t)) * (np.cos(w * t) + np.sin(w * np.abs(t)))
    time = np.linspace(0.0, 0.05, 20_001)
    pulse = filtered(time, half_sine(time), cfc)
    assert pulse is not None
    assert pulse[1].max() == pytest.approx(np.trapezoid(response * np.cos(pi * t / 0.01), t), rel=2e-4)
    assert pulse[0][np.argmax(pulse[1])] == pytest.approx(0.025, abs=1e-4)


@pytest.mark.parametrize("cfc", CLASSES)
def test_gain_at_rest_at_the_corner_and_at_3_db(cfc: int) -> None:
    """1/(1 + (wa/wc)^4) of both passes, wa the warped frequency: 1 at 0, 1/2 at 2.0775 CFC, 1/sqrt(2) at 1.667 CFC."""
    rate = 50.0 * CORNER * cfc
    time = np.arange(8000) / rate

    def gain(frequency: float) -> float:
        wave = low_pass(np.sin(2.0 * pi * frequency * time), rate, cfc)[2000:6000]
        sine, cosine = (f(2.0 * pi * frequency * time[2000:6000]) for f in (np.sin, np.cos))
        (along, across), *_ = np.linalg.lstsq(np.stack((sine, cosine), 1), wave, rcond=None)
        assert abs(across) < 1e-6  # no phase
        return float(along)

    assert low_pass(np.full(100, 7.0), rate, cfc) == pytest.approx(np.full(100, 7.0), rel=1e-12)
    assert gain(CORNER * cfc) == pytest.approx(0.5, abs=1e-6)
    warped = tan(pi * CORNER * cfc / rate) * (sqrt(2.0) - 1.0) ** 0.25
    assert gain(np.arctan(warped) * rate / pi) == pytest.approx(sqrt(0.5), abs=1e-6)
    assert gain(5.0 / 3.0 * cfc) == pytest.approx(sqrt(0.5), abs=1e-3)


@pytest.mark.parametrize("cfc", CLASSES)
def test_sampling_is_fast_enough_or_refused(cfc: int) -> None:
    """The standard asks for 10 kHz; at pi/2 of wd T/2 the corner is the highest frequency that samples can show."""
    pulse = filtered(np.linspace(0.0, 0.1, 10_001), np.zeros(10_001), cfc)
    assert pulse is not None and 1.0 / np.diff(pulse[0]).max() > 10e3
    assert np.isfinite(low_pass(np.ones(50), 2.0 * CORNER * cfc * 1.001, cfc)).all()
    for rate in (2.0 * CORNER * cfc, CORNER * cfc):
        with pytest.raises(ValueError):
            low_pass(np.ones(50), rate, cfc)


def test_uneven_rows_give_what_even_ones_do() -> None:
    random = np.random.default_rng(2)
    even = np.linspace(0.0, 0.08, 4001)
    uneven = np.concatenate(([0.0], np.sort(random.uniform(0.0, 0.08, 4000)), [0.08]))
    for cfc in (60, 180):
        first, second = filtered(even, half_sine(even), cfc), filtered(uneven, half_sine(uneven), cfc)
        assert first is not None and second is not None
        np.testing.assert_array_equal(first[0], second[0])
        np.testing.assert_allclose(first[1], second[1], atol=1e-3)
        step = float(np.diff(first[0])[0])
        assert step == pytest.approx(1.0 / (SAMPLES * CORNER * cfc), rel=1e-3)
        np.testing.assert_allclose(first[1], j211(half_sine(first[0]), step, cfc), atol=1e-3)


def test_samples_are_means_of_the_record() -> None:
    """A record whose rows are finer than the samples: one row that stands out keeps its area, wherever it is."""
    time = np.linspace(0.0, 0.1, 100_001)
    for row in (40_000, 50_003):
        values = np.zeros_like(time)
        values[row] = 1e3  # a triangle of 1e3 high and 2 us wide
        pulse = filtered(time, values, 180)
        assert pulse is not None
        assert np.trapezoid(pulse[1], pulse[0]) == pytest.approx(1e-3, rel=1e-6)
        assert pulse[0][np.argmax(pulse[1])] == pytest.approx(time[row], abs=np.diff(pulse[0])[0])


def test_deceleration_keeps_the_momentum_between_rows() -> None:
    """SI in, SI out: 20 m/s^2 all along, and a blow of 0.5 m/s within one row, the same on all rows."""
    peaks = []
    for rows in (401, 4001, 40_001):
        time = np.linspace(0.0, 0.1, rows)
        even = filtered_slope(time, 20.0 * time - 6.0, 180)
        assert even is not None
        assert even[1] == pytest.approx(np.full_like(even[1], 20.0), rel=1e-9)
        blow = filtered_slope(time, np.where(time > 0.0501, 0.5, 0.0), 180)
        assert blow is not None
        assert np.trapezoid(blow[1], blow[0]) == pytest.approx(0.5, rel=1e-6)
        peaks.append(blow[1].max())
    assert peaks == pytest.approx([peaks[-1]] * 3, rel=0.02)


@pytest.mark.parametrize(
    ("time", "cfc", "words"),
    [
        (np.linspace(0.0, 0.1, 101), 60, None),
        (np.linspace(0.0, 0.1, 101), 180, "rows 1 ms apart, 0.556 allowed"),
        (np.delete(np.linspace(0.0, 0.1, 1001), slice(500, 520)), 60, "rows 2.1 ms apart, 1.67 allowed"),
        (np.linspace(0.0, 0.005, 1001), 60, "5 ms long, 24 expected"),
        (np.linspace(0.0, 0.005, 1001), 600, None),
        (np.zeros(1), 60, "fewer than two rows"),
        (np.zeros(0), 60, "fewer than two rows"),
    ],
)
def test_a_record_too_coarse_or_too_short_has_no_answer(time: Floats, cfc: int, words: str | None) -> None:
    assert unfit(time, cfc) == words
    assert (filtered(time, time, cfc) is None) == (filtered_slope(time, time, cfc) is None) == (words is not None)


def test_filtered_peaks_of_a_record_by_phase() -> None:
    """The cover passes 0.54 m at 10 ms; deceleration is larger before, the hoop's tension after."""
    time = np.linspace(0.0, 0.1, 5001)
    rows = np.zeros((len(time), len(COLUMNS)))
    rows[:, COLUMNS.index(History.TIME)] = time
    rows[:, COLUMNS.index(History.HEIGHT)] = 0.6 - 6.0 * time
    rows[:, COLUMNS.index(History.VELOCITY)] = np.where(time < 0.01, 30.0 * time, 0.3 + 10.0 * (time - 0.01)) - 6.0
    rows[:, COLUMNS.index(History.TENSION_HOOP)] = 5e3 * half_sine(time) + 1e3
    names = ["peak_deceleration", "peak_tension_hoop"]
    found = filtered_peaks(rows, 600, 0.54, names)
    assert found.fault is None and found.peak_tension_belt is None
    filtered_deceleration, hoop = found.peak_deceleration, found.peak_tension_hoop
    assert (
        filtered_deceleration is not None
        and filtered_deceleration.other is not None
        and hoop is not None
        and hoop.other is not None
    )
    assert (filtered_deceleration.phase, filtered_deceleration.other.phase) == ("overshoot", "crushing")
    assert filtered_deceleration.value == pytest.approx(30.0, rel=0.05)
    assert (
        10.0 < filtered_deceleration.other.value < 20.5 and 0.01 < filtered_deceleration.other.time < 0.0101
    )  # the flank between
    assert (hoop.phase, hoop.other.phase) == ("crushing", "overshoot")
    assert (hoop.value, hoop.time) == pytest.approx((6e3, 0.025), rel=1e-2)
    assert hoop.other.value == pytest.approx(1e3, rel=1e-6)
    short = filtered_peaks(rows, 600, 0.0, names).peak_deceleration
    assert short is not None and short.phase == "overshoot" and short.other is None
    rows[-1] = np.nan
    assert filtered_peaks(rows, 600, 0.54, names) == FilteredPeaks(600, "rows that are no numbers")


# Phases in the kernels


@pytest.mark.kernels
def test_low_pass_of_the_peak_deceleration_is_one_of_1_khz() -> None:
    """A sine of 1 kHz comes out 1/√2 as high; one of 100 Hz all but whole."""
    length = 2e-6
    for frequency, gain in ((1000.0, sqrt(0.5)), (100.0, 1.0 / sqrt(1.01))):
        drop, passed = Simulation(case("model.fidelity=axisymmetric")), []
        state = drop.state
        for n in range(round(2.0 / frequency / length)):
            state.now[History.ACCELERATION] = sin(2.0 * pi * frequency * n * length)
            filter_deceleration(drop.model, state, length)
            state.steps[0] += 1
            passed.append(state.filtered_deceleration[0])
        assert max(passed[len(passed) // 2 :]) == pytest.approx(gain, rel=0.01)


@pytest.mark.kernels
@pytest.mark.parametrize("fidelity", ["full", "axisymmetric", "lumped"])
def test_peaks_of_both_phases_are_those_of_the_rows(fidelity: str) -> None:
    """Rows of every step, parted where the cover has come down by a tenth of the height."""
    drop, blocks, outcome = Simulation(case(f"model.fidelity={fidelity}")), [], Outcome.RUNNING
    while outcome == Outcome.RUNNING:
        rows, outcome = drop.advance()
        blocks.append(rows.copy())
    history = np.concatenate(blocks)[:-1]  # the last row is of the event
    time, height, acceleration = (history[:, one] for one in (History.TIME, History.HEIGHT, History.ACCELERATION))
    filtered_deceleration = acceleration.copy()
    for n in range(1, len(filtered_deceleration)):
        filtered_deceleration[n] = filtered_deceleration[n - 1] + (1.0 - exp(-history[n, History.TIME_STEP] / FILTER_TIME)) * (
            acceleration[n] - filtered_deceleration[n - 1]
        )
    columns = {
        Peak.DECELERATION: filtered_deceleration,
        Peak.TENSION_GENERATRIX: history[:, History.TENSION_GENERATRIX],
        Peak.TENSION_HOOP: history[:, History.TENSION_HOOP],
        Peak.TENSION_BELT: history[:, History.TENSION_BELT],
    }
    summary, before = drop.finish(outcome), height > 0.54
    assert 10 < before.sum() < len(before) - 10
    for which, values in columns.items():
        if fidelity == "lumped" and which != Peak.DECELERATION:
            continue
        found = summary.peaks[f"peak_{which.name.lower()}"]
        assert found.other is not None and found.other.other is None
        for phase, within in (("overshoot", before), ("crushing", ~before)):
            peak = found if found.phase == phase else found.other
            assert peak.phase == phase
            at = int(np.argmax(np.where(within, values, -np.inf)))
            assert (peak.value, peak.time) == pytest.approx((values[at], time[at]), rel=1e-9)
        assert found.value >= found.other.value
    assert summary.peak_deceleration == summary.peaks["peak_deceleration"].value


def test_a_run_that_ends_before_the_shell_is_crushed_has_one_phase() -> None:
    for found in softbrake.run(case("time.end=5 ms", "model.fidelity=axisymmetric")).peaks.values():
        assert (found.phase, found.other) == ("overshoot", None)


# In the answer


def test_rows_of_the_result_file_give_the_filtered_peaks(tmp_path: Path) -> None:
    """As their own columns do; a run without a file has none."""
    file, ours = tmp_path / "drop.vtkhdf", case("model.fidelity=axisymmetric", "output.cfc=600")
    summary = softbrake.run(ours, file)
    assert read_summary(file) == summary
    found, history = summary.filtered, read_history(file)
    assert found is not None and (found.cfc, found.fault) == (600, None)
    pulse = filtered_slope(history["time"], history["velocity"], 600)
    assert pulse is not None and found.peak_deceleration is not None
    assert found.peak_deceleration.value == pulse[1].max() == pytest.approx(summary.peak_deceleration, rel=0.1)
    for tension in ("generatrix", "hoop", "belt"):
        pulse, peak = filtered(history["time"], history[f"tension_{tension}"], 600), getattr(found, f"peak_tension_{tension}")
        assert pulse is not None
        assert peak.value == pulse[1].max() < summary.peaks[f"peak_tension_{tension}"].value
    assert softbrake.run(ours).filtered is None
    lumped = softbrake.run(case("model.fidelity=lumped"), file).filtered
    assert lumped is not None and lumped.cfc == 180 and lumped.peak_deceleration is not None
    assert [value for name, value in asdict(lumped).items() if "tension" in name] == [None] * 3


def test_rows_too_coarse_for_the_class_are_said_to_be(softbrake: Command, paper: Path) -> None:
    coarse = ("--set", "model.fidelity=lumped", "--set", "output.history_interval=30", "-q")
    done = softbrake("run", paper, *coarse)
    assert done.returncode == 0, done.stderr
    assert "  CFC 180                         –        rows 0.75 ms apart, 0.556 allowed" in done.stdout
    assert '"fault": "rows 0.75 ms apart, 0.556 allowed"' in softbrake("info", "paper.vtkhdf", "--json").stdout
