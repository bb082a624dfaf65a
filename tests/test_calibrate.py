"""Inputs fitted to made tests: intervals that hold what they promise, what the tests do not tell, the fitted case as a file."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from conftest import Command
from scipy.signal import butter, sosfilt

from softbrake.case.case import Case
from softbrake.case.case_file import CaseFile, case_file, open_case
from softbrake.case.edited_text import edited
from softbrake.core.arrays import Floats
from softbrake.report.words import fitted_in_words, fitted_value
from softbrake.signals.channel import QUANTITIES, Channel
from softbrake.sim.result_file import as_history, history_dtype
from softbrake.studies import calibration
from softbrake.studies.batch import run_batch
from softbrake.studies.calibration import Calibration, DropTest, FittedInput, NotCalibrated, calibrate
from softbrake.studies.comparison import COLUMNS
from softbrake.studies.design_space import Variable, variable

VENTED = Path(__file__).resolve().parents[1] / "configs" / "airdrop-vented.yaml"
RATE = 10_000  # Hz
TRUTH = {"vents.0.discharge": 0.66, "cargo.velocity": 8.2}
FITS = {"vents.0.discharge": "0.3:1", "cargo.velocity": "6:11"}
Noise = Callable[[int], Floats]


@pytest.fixture(scope="module")
def lumped() -> CaseFile:
    return open_case(VENTED, ["model.fidelity=lumped"])


def measured(case: Case, quantities: Sequence[str] = ("deceleration",), shift: float = 0.0) -> list[Channel]:
    """Channels of a drop sampled at 10 kHz, `shift` s earlier."""
    (found,) = run_batch([case], histories=True)
    assert found.history is not None
    history = as_history(found.history, history_dtype(case))
    time = np.arange(int(history["time"][-1] * RATE) + 1) / RATE
    return [
        Channel(one, time - shift, np.interp(time, history["time"], history[COLUMNS[one]]), QUANTITIES[one].unit)
        for one in quantities
    ]


def with_noise(channels: Sequence[Channel], noise: Sequence[Floats]) -> tuple[Channel, ...]:
    return tuple(
        Channel(one.name, one.time, one.values + added[: len(one.time)], one.unit)
        for one, added in zip(channels, noise, strict=True)
    )


def variables(file: CaseFile, fits: dict[str, str]) -> list[Variable]:
    return [variable(file, path, between) for path, between in fits.items()]


def fitted(
    file: CaseFile, channels: Sequence[Channel], fits: dict[str, str] = FITS, cfc: int = 60, **more: object
) -> Calibration:
    asked = variables(file, fits)
    test = DropTest("made", tuple(channels), file.vary)
    return calibrate([test], asked, [file.quantity(each.path) for each in asked], cfc=cfc, **more)  # type: ignore[arg-type]


def test_values_and_shift_are_found_without_noise(lumped: CaseFile) -> None:
    found = fitted(lumped, measured(lumped.vary(TRUTH), shift=0.013))
    assert [each.value for each in found.inputs] == pytest.approx(list(TRUTH.values()), rel=1e-4)
    assert found.shifts == pytest.approx([0.013], abs=1e-5)
    assert found.agreeing == found.refined
    assert not found.undetermined and not found.rivals


def white(seed: int, deviation: float = 2.0) -> Floats:
    return deviation * np.random.default_rng(seed).standard_normal(20_000)


def logged(corner: float) -> Noise:
    """Noise as an analog filter of four poles leaves it."""
    section = butter(4, corner, fs=RATE, output="sos")
    return lambda seed: np.asarray(sosfilt(section, white(seed))[5_000:])


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say(lumped: CaseFile) -> None:
    """95 %, of 100 seeds, half of them behind a logger: outside of 88 to 99 of them by chance once in fifty."""
    drop = measured(lumped.vary(TRUTH), shift=0.013)
    held = np.zeros(len(TRUTH))
    for seed in range(100):
        found = fitted(lumped, with_noise(drop, [(white, logged(300.0))[seed % 2](seed)]), starts=0)
        assert not found.undetermined
        for k, (each, true) in enumerate(zip(found.inputs, TRUTH.values(), strict=True)):
            assert each.interval is not None
            held[k] += each.interval[0] <= true <= each.interval[1]
    assert np.all((held >= 88) & (held <= 99)), held


def test_intervals_widen_with_the_noise_and_with_its_length(lumped: CaseFile) -> None:
    """As the deviation of white noise; and by more of noise below the corner, of which fewer samples are independent."""
    drop = measured(lumped.vary(TRUTH))

    def width(noise: Floats) -> float:
        (found, _) = fitted(lumped, with_noise(drop, [noise]), starts=0).inputs
        assert found.interval is not None
        return found.interval[1] - found.interval[0]

    narrow, slow = width(white(1)), logged(30.0)(1)
    assert width(3.0 * white(1)) == pytest.approx(3.0 * narrow, rel=0.1)
    level = fitted(lumped, with_noise(drop, [white(1)]), starts=0).channels[0].misfit
    same = slow * level / fitted(lumped, with_noise(drop, [slow]), starts=0).channels[0].misfit
    assert width(same) > 1.5 * narrow


def test_inputs_that_only_act_by_their_product_are_named(lumped: CaseFile) -> None:
    fits = {"vents.0.area": "200cm^2:2000cm^2", "vents.0.discharge": "0.2:1", "cargo.velocity": "6:11"}
    found = fitted(lumped, with_noise(measured(lumped.vary(TRUTH)), [white(0)]), fits)
    (named,) = found.undetermined
    assert "vents.0.area and vents.0.discharge: the tests tell one combination" in named
    area, discharge, velocity = found.inputs
    assert area.interval is None and discharge.interval is None
    assert area.why_not == discharge.why_not == "not determined"
    assert velocity.interval is not None and velocity.interval[0] < 8.2 < velocity.interval[1]
    assert area.value * discharge.value == pytest.approx(0.06 * 0.66, rel=0.02)


def test_an_input_that_does_nothing_is_named(lumped: CaseFile) -> None:
    fits = {"fabric.E": "50kN/m:200kN/m", "cargo.velocity": "6:11"}
    found = fitted(lumped, with_noise(measured(lumped.vary({"cargo.velocity": 8.2})), [white(0)]), fits)
    assert found.undetermined == ("fabric.E: the tests do not tell it from 50 kN/m to 200 kN/m",)
    assert found.inputs[1].interval is not None


def test_a_value_beyond_its_range_is_said_to_be_at_the_end(lumped: CaseFile) -> None:
    fits = FITS | {"vents.0.discharge": "0.3:0.6"}
    discharge, velocity = fitted(lumped, with_noise(measured(lumped.vary(TRUTH)), [white(0)]), fits).inputs
    assert discharge.value == 0.6
    assert (discharge.interval, discharge.why_not) == (None, "at the upper end of its range")
    assert velocity.interval is not None


def test_several_tests_and_channels_tell_more(lumped: CaseFile) -> None:
    """Two drops from other speeds, each with its own shift, and pressures beside decelerations."""
    quantities = ("deceleration", "pressure")
    tests = []
    for k, speed in enumerate((7.5, 9.0)):
        own = lumped.set([f"cargo.velocity={speed}"])
        drop = measured(own.vary({"vents.0.discharge": 0.66}), quantities, shift=0.01 * (k + 1))
        tests.append(DropTest(f"drop {k}", with_noise(drop, [white(k), white(k + 9, 200.0)]), own.vary))
    asked = variables(lumped, {"vents.0.discharge": "0.3:1", "gas.pressure": "500:8000"})
    values = [lumped.quantity(each.path) for each in asked]
    both = calibrate(tests, asked, values, cfc=60)
    alone = calibrate(tests[:1], asked, values, cfc=60)
    assert both.shifts == pytest.approx([0.01, 0.02], abs=5e-4)
    assert [each.test for each in both.channels] == ["drop 0", "drop 0", "drop 1", "drop 1"]
    for one, other, true in zip(both.inputs, alone.inputs, (0.66, 2000.0), strict=True):
        assert one.interval is not None and other.interval is not None
        assert one.interval[0] < true < one.interval[1]
        assert one.interval[1] - one.interval[0] < other.interval[1] - other.interval[0]


def turned(channels: Sequence[Channel], name: str) -> list[Channel]:
    return [Channel(one.name, one.time, -one.values if one.name == name else one.values, one.unit) for one in channels]


@pytest.mark.parametrize("quantities", [("deceleration",), ("velocity",), ("deceleration", "pressure")])
def test_a_channel_with_the_other_sign_is_named(lumped: CaseFile, quantities: tuple[str, ...]) -> None:
    """At the end that the fit is led to, or in the refusal; the last channel is turned. With the right sign none is."""
    drop, wrong = measured(lumped.vary(TRUTH), quantities, shift=0.013), quantities[-1]
    hint = f"made: '{wrong}' runs against the drop; --invert '{wrong}' turns it"
    assert fitted(lumped, turned(drop, wrong), starts=8).opposed == (hint,)
    assert fitted(lumped, drop, starts=2).opposed == ()


def test_a_refusal_names_the_channel_with_the_other_sign(lumped: CaseFile) -> None:
    """Turned, it is laid over the drop where next to nothing is left to compare."""
    drop = measured(lumped.vary(TRUTH), ("pressure",), shift=0.013)
    with pytest.raises(
        ValueError, match="ms to compare.*; made: 'pressure' runs against the drop; --invert 'pressure' turns it$"
    ):
        fitted(lumped, turned(drop, "pressure"), starts=8)


def test_a_coarse_test_is_named(lumped: CaseFile) -> None:
    (drop,) = measured(lumped.vary(TRUTH))
    with pytest.raises(ValueError, match="^made: deceleration: CFC 60: rows 4 ms apart"):
        fitted(lumped, [Channel(drop.name, drop.time[::40], drop.values[::40], drop.unit)])


def test_two_tests_of_one_name_are_refused(lumped: CaseFile) -> None:
    test = DropTest("made", tuple(measured(lumped.case)), lumped.vary)
    with pytest.raises(ValueError, match="made: a name of two tests"):
        calibrate([test, test], variables(lumped, FITS), [0.6, 8.5], cfc=60)


@pytest.mark.parametrize(
    ("value", "interval", "shown", "between"),
    [
        (0.668512, (0.653512, 0.683912), "0.669", "0.654 to 0.684 (95 %)"),
        (0.60001, (0.60000977, 0.60001023), "0.60001000", "0.60000977 to 0.60001023 (95 %)"),
        (0.99, (0.96, 1.02), "0.990", "0.960 to 1.020 (95 %)"),
        (12345.0, (10000.0, 15000.0), "12300", "10000 to 15000 (95 %)"),
        (1.2343e-7, (1.2e-7, 1.27e-7), "1.234e-07", "1.200e-07 to 1.270e-07 (95 %)"),
        (0.6, (0.6, 0.6), "0.60000000000000", "0.60000000000000 to 0.60000000000000 (95 %)"),
        (0.668512, None, "0.66851", "no interval, not determined"),
    ],
)
def test_digits_are_those_of_the_interval(value: float, interval: tuple[float, float] | None, shown: str, between: str) -> None:
    """Two of its half width; a value to the same place."""
    ratio = Variable("vents.0.discharge", "", 0.1, 1.0, "", 1.0, "--fit")
    one = FittedInput(ratio, value, interval, "" if interval else "not determined", None)
    assert (fitted_value(one), fitted_in_words(one)) == (shown, between)


def test_without_scipy_a_line_says_what_to_install(lumped: CaseFile, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy", None)
    monkeypatch.setitem(sys.modules, "scipy.optimize", None)
    with pytest.raises(ImportError, match=r"pip install 'softbrake\[chance\]'"):
        fitted(lumped, [])


def test_starts_without_an_answer_are_counted(lumped: CaseFile, monkeypatch: pytest.MonkeyPatch) -> None:
    batch, dropped = calibration.run_batch, []

    def failing(cases: Sequence[Case], **options: bool) -> list[object]:
        answers = list(batch(cases, **options))  # type: ignore[arg-type]
        for k, case in enumerate(cases):
            if case.cargo.velocity > 9.0:
                dropped.append(case)
                answers[k] = answers[k]._replace(fault="diverged at 0.1 s, of nothing")
        return answers  # type: ignore[return-value]

    drop = measured(lumped.vary(TRUTH))
    monkeypatch.setattr(calibration, "run_batch", failing)
    found = fitted(lumped, drop)
    assert found.faults == {"diverged at 0.1 s": len(dropped)}
    assert found.inputs[1].value == pytest.approx(8.2, rel=1e-3)
    with pytest.raises(NotCalibrated, match=r"none of 32 starts has an answer: diverged at 0.1 s \(32 times\)"):
        fitted(lumped, drop, FITS | {"cargo.velocity": "9.5:11"})


@pytest.mark.slow
def test_no_values_are_told_below_the_scatter_of_the_grid() -> None:
    """A test without noise, made by the same model: what is left is less than what the grid makes."""
    shell = open_case(VENTED, ["grid.generatrix=12", "output.history_interval=2"])
    with pytest.raises(NotCalibrated, match="the model itself changes by .* on a grid of 67% of the cells"):
        fitted(shell, measured(shell.case), {"cargo.velocity": "8:9"}, starts=0)


# The fitted case as a file

TEXT = """\
# a drop
shell: {diameter: 1.2 m, height: 1.0 m}   # flow
fabric:
  E: 100 kN/m   # of the weave
  areal_density: 0.3 kg/m^2
  damping_ratio: 3 %
cargo: {mass: 500 kg, velocity: 8.5 m/s}
gas:
  pressure: 2 kPa               # gauge, as the bag hangs
vents:
  - area: 600 cm^2              # a first guess
    discharge: 0.6
    opens: {pressure: '20 kPa'}   # a burst disk
model: {fidelity: lumped}
"""


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_text_is_edited_at_its_places(end: str) -> None:
    text = TEXT.replace("    discharge: 0.6\n", "").replace("\n", end)
    changes = {
        "gas.pressure": "2.5 kPa",
        "vents.0.opens.pressure": "17 kPa",
        "vents.0.discharge": "0.7",
        "cargo.velocity": "8.25 m/s",
        "friction": "0.3",
        "fabric.damping_ratio": "2 %",
        "time.end": "2 s",
    }
    new = edited(text, changes, {"gas.pressure": "fitted", "vents.0.discharge": "new", "time.end": "longer"})
    wanted = case_file(text, "a", [f"{path}={value}" for path, value in changes.items()]).case
    assert case_file(new, "a").case == wanted
    for comment in ("# a drop", "# flow", "# of the weave", "# gauge, as the bag hangs", "# a first guess", "# a burst disk"):
        assert comment in new
    lines = new.split(end)
    assert lines[lines.index("  # fitted") + 1] == "  pressure: 2.5 kPa               # gauge, as the bag hangs"
    assert lines[lines.index("  # new") + 1] == "  - discharge: 0.7"
    assert lines[-4:] == ["time:", "  # longer", "  end: 2 s", ""]
    with pytest.raises(ValueError, match="vents.1.area"):
        edited(text, {"vents.1.area": "1 cm^2"}, {})


# The command


@pytest.fixture
def record(tmp_path: Path, lumped: CaseFile) -> Path:
    """A record of deceleration with gravity, in g, and of absolute pressure."""
    drop = measured(lumped.vary(TRUTH), ("deceleration", "pressure"), shift=0.02)
    (a, p) = with_noise(drop, [white(0), white(1, 200.0)])
    rows = np.column_stack((a.time, (a.values + 9.80665) / 9.80665, (p.values + lumped.case.ambient.pressure) / 1e3))
    file = tmp_path / "test.csv"
    np.savetxt(file, rows, delimiter=",", header="time [s],acc [g],bag [kPa]", comments="", fmt="%.7g")
    return file


ASKED = ("--fit", "vents.0.discharge=0.3:1", "--fit", "cargo.velocity=6m/s:11m/s", "--gravity", "in", "--pressure", "absolute")


def test_command_writes_a_case_that_runs_and_keeps_its_comments(softbrake: Command, tmp_path: Path, record: Path) -> None:
    case = tmp_path / "drop.yaml"
    case.write_text(TEXT)
    words = ("calibrate", "drop.yaml", "test.csv", *ASKED, "--cfc", "60", "--set", "output.history_interval=5", "--starts", "4")
    done = softbrake(*words, "-o", "fitted.yaml", "-o", "left.png", "--json")
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    found = {each["path"]: each for each in answer["inputs"]}
    for path, true in TRUTH.items():
        assert found[path]["interval"][0] < true < found[path]["interval"][1]
    text = (tmp_path / "fitted.yaml").read_text()
    assert "# a first guess" in text and "# fitted to test.csv: " in text
    written = open_case(tmp_path / "fitted.yaml")
    assert written.case.output.history_interval == 5
    assert written.quantity("cargo.velocity") == pytest.approx(found["cargo.velocity"]["value"], rel=1e-5)
    assert written.quantity("vents.0.discharge") == pytest.approx(found["vents.0.discharge"]["value"], rel=1e-5)
    assert (tmp_path / "left.png").stat().st_size > 10_000

    refused = softbrake(*words, "-o", "fitted.yaml")
    assert refused.returncode == 2
    assert refused.stderr == "fitted.yaml: is there already; --output names another file, --force replaces it\n"
    assert (tmp_path / "fitted.yaml").read_text() == text

    told = softbrake(*words, "-o", "other.yaml", "--quiet").stdout
    assert all(len(line) <= 80 for line in told.splitlines()), told
    assert "(95 %)" in told and "vents.0.discharge" in told


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "--fit: what is to be fitted is not said"),
        (("--fit", "shell"), "--fit shell: not a quantity of the drop"),
        (("--fit", "gas.pressure=1"), "--fit gas.pressure=1: 'gas.pressure=1' is not LOW:HIGH"),
        (("--fit", "vents.0.discharge=0.5:2"), "--fit vents.0.discharge from 0.5 to 2: "),
        (("--fit", "gas.pressure", "--fit", "gas.pressure"), "--fit gas.pressure: given twice"),
        (("--fit", "gas.pressure", "--gravity", "in", "--pressure", "absolute", "--cfc", "none"), "--cfc none: "),
        (("--fit", "gas.pressure", "-o", "a.txt"), "ends in .png, .svg or .pdf; that of a case in .yaml"),
        (("--fit", "gas.pressure", "-o", "drop.yaml"), "drop.yaml: is the case file"),
        (("--fit", "gas.pressure", "--set", "vents.0.opens=20kPa"), "vents.0.opens"),
        (("--fit", "vents.3.area"), "--fit vents.3.area: vents.3: vents is a list without a '3'; its numbers are 0"),
        (("--fit", "vents.3.area=1cm^2:5cm^2"), "--fit vents.3.area: vents.3: vents is a list without a '3'; its numbers are 0"),
        (
            ("other.csv:cargo.mass=510kg,cargo.velocity=7", "--fit", "cargo.velocity"),
            "cargo.velocity is fitted, one value for all",
        ),
        (("other.csv:vents.0={area: 500cm^2}", "--fit", "vents.0.discharge"), "vents.0.discharge is fitted, one value for all"),
        (
            ("./test.csv:cargo.mass=500kg", "--fit", "gas.pressure"),
            "./test.csv:cargo.mass=500kg: given twice with the same values",
        ),
    ],
)
def test_mistakes_are_told_in_a_line(
    softbrake: Command, tmp_path: Path, record: Path, words: tuple[str, ...], message: str
) -> None:
    (tmp_path / "drop.yaml").write_text(TEXT)
    done = softbrake("calibrate", "drop.yaml", "test.csv", *words)
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr and done.stderr.count("\n") == 1, done.stderr


def test_a_test_may_have_values_of_its_own(softbrake: Command, tmp_path: Path, record: Path) -> None:
    (tmp_path / "drop.yaml").write_text(TEXT)
    words = (
        "--fit",
        "vents.0.discharge=0.3:1",
        "--gravity",
        "in",
        "--pressure",
        "absolute",
        "--cfc",
        "60",
        "--starts",
        "2",
        "--json",
    )
    done = softbrake("calibrate", "drop.yaml", "test.csv:cargo.velocity=8.2m/s,cargo.mass=500kg", *words)
    assert done.returncode == 0, done.stderr
    (only,) = json.loads(done.stdout)["inputs"]
    assert only["interval"][0] < 0.66 < only["interval"][1]
    tests = ["test.csv:cargo.mass=500kg", "test.csv:cargo.mass=510kg"]
    told = softbrake("calibrate", "drop.yaml", *tests, *words[:-1], "--invert", "bag", "--force")
    for test in tests:
        assert f"Times of {test} are shifted by" in told.stdout, told
        assert f"{test}: 'bag' runs against the drop; --invert 'bag' turns it\n" in told.stderr
    assert f"# fitted to {', '.join(tests)}: " in (tmp_path / "drop-fitted.yaml").read_text()
    negative = softbrake("calibrate", "drop.yaml", "test.csv", *words, "--seed", "-3", "--force")
    assert negative.returncode == 2 and "'--seed'" in negative.stderr
    wrong = softbrake("calibrate", "drop.yaml", "test.csv:cargo.speed=8.2m/s", *words, "--force")
    assert wrong.returncode == 2
    assert wrong.stderr.startswith("test.csv:cargo.speed=8.2m/s: cargo.speed: unknown key")
