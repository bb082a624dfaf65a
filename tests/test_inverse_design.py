"""Section 2.2, and the search for the value that brings an answer to its target: exact for a piston, honest elsewhere."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from math import isclose, pi, sqrt
from pathlib import Path

import numpy as np
import pytest
import synthetic_drop
from conftest import Command
from typer.testing import CliRunner

import softbrake
from softbrake.case.case import Case
from softbrake.case.case_file import load_case, open_case
from softbrake.case.full_stop import full_stop
from softbrake.case.level import level
from softbrake.cli.app import app
from softbrake.core.arrays import GasPressure, PressureLaw
from softbrake.core.pressure import pressure_at
from softbrake.sim.simulation import Diverged
from softbrake.studies import design_space
from softbrake.studies.design_space import variable
from softbrake.studies.error_control import Refined
from softbrake.studies.inverse_design import (
    NUDGE,
    POINTS,
    SEARCH_WIDTH,
    DesignPoint,
    NotReached,
    Question,
    _close_in,
    ask,
    find,
    piston,
)
from softbrake.studies.targets import NEAR, Target

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
NO_BELTS = CONFIGS / "no-belts.yaml"
VENTED = CONFIGS / "airdrop-vented.yaml"
AXISYMMETRIC, LUMPED = "model.fidelity=axisymmetric", "model.fidelity=lumped"
AREA = pi * 0.25**2  # m^2, of the cover
MASS, SPEED, HEIGHT, GRAVITY = 100.0, 6.0, 0.6, 9.80665


# Section 2.2


def test_a_rebound_is_told_from_a_stop() -> None:
    stopped = replace(synthetic_drop.summary(), outcome="stopped", impact_velocity=None, lowest_height=0.1234)
    for summary, words in (
        (stopped, "stopped at a height of 0.1234 m"),
        (replace(stopped, outcome="rebound", rebound_velocity=3.0), "rebounded from a height of 0.1234 m"),
    ):
        assert Target("impact_velocity", 1.0).answer(summary) == words


@pytest.mark.parametrize("share", [1e-6, 0.1, 0.25, 0.5, 0.8, 1 - 1e-6])
def test_mean_of_two_sinusoids_wherever_the_peak_stands(share: float) -> None:
    """The assertion of section 2.2 on the law (2.10) as the drop computes it: the mean over time is 2/pi of the largest value."""
    end, none = 0.2, np.zeros(1)
    law = GasPressure(PressureLaw.SINE, 1.0, share * end, end, none, none, 0.0, 1.0)
    x, weight = np.polynomial.legendre.leggauss(40)
    mean = 0.0
    for start, stop in ((0.0, share * end), (share * end, end)):  # a smooth half each
        times = start + (stop - start) * (x + 1) / 2
        mean += (stop - start) / 2 * sum(w * pressure_at(law, t) for w, t in zip(weight, times, strict=True)) / end
    assert mean == pytest.approx(2 / pi, rel=1e-9)
    stop = full_stop(MASS, SPEED, GRAVITY, HEIGHT, 0.5)
    assert stop.largest * mean == pytest.approx(stop.mean, rel=1e-9)


def test_full_stop_is_that_of_uniform_deceleration() -> None:
    """P~ F = m (g + a) with a = V²/(2 l1), over the time 2 l1/V; and the energy is the force times the way."""
    stop = full_stop(MASS, SPEED, GRAVITY, HEIGHT, 0.5)
    area = pi * 0.25**2
    assert stop.mean * area == pytest.approx(MASS * (GRAVITY + SPEED**2 / (2 * HEIGHT)))
    assert stop.energy == pytest.approx(stop.mean * area * HEIGHT)
    assert stop.end_time == pytest.approx(SPEED / (stop.mean * area / MASS - GRAVITY))


def test_mean_in_time_is_no_full_stop_over_the_way() -> None:
    """A piston under the sinusoids: an early peak stops it high above the ground, a late one lets it through."""
    stop, tried = piston(load_case(NO_BELTS))
    assert stop == full_stop(MASS, SPEED, GRAVITY, HEIGHT, 0.5)
    assert tried[0][1].outcome == "stopped" and tried[0][1].lowest_height > 0.1
    speeds = [summary.impact_velocity for _, summary in tried[1:]]
    assert speeds == sorted(speeds) and speeds[-1] > 4.0
    assert 0.0 < speeds[0] < 0.05 * SPEED  # by symmetry it would be back on the ground at t_k, so it was below


# The search


def exact_pressure(speed: float) -> float:
    """Constant pressure (Pa) with which a piston lands at a speed (m/s)."""
    return MASS * (GRAVITY + (SPEED**2 - speed**2) / (2 * HEIGHT)) / AREA


@pytest.mark.parametrize("speed", [0.0, 1.5, 4.0])
def test_piston_lands_as_asked(speed: float) -> None:
    """Against the exact pressure, within the last bracket, the width of which is the error: the area under the cover is exact."""
    found = find(ask(open_case(NO_BELTS, [LUMPED]), target=f"impact_velocity={speed} m/s"))
    assert found.value == pytest.approx(exact_pressure(speed), rel=SEARCH_WIDTH)
    assert found.bracket[0] * (1 - 1e-12) <= exact_pressure(speed) <= found.bracket[1] * (1 + 1e-12)
    assert found.error is not None
    assert found.value - exact_pressure(speed) < found.error < 2e-3 * found.value
    assert (found.summary.impact_velocity or 0.0) <= speed
    assert found.others == 0
    assert len(found.points) < 20


def test_score_is_smooth_where_impact_turns_into_stop() -> None:
    """For a piston it is a line in the pressure on both sides of the full stop, so that interpolation sees no corner there."""
    target, full = Target("impact_velocity", 0.0), exact_pressure(0.0)
    scores = []
    for share in (0.999, 1.0 - 1e-9, 1.001):
        case = load_case(NO_BELTS, [LUMPED, f"pressure.value={share * full!r}"])
        scores.append(target.score(case, softbrake.run(case)))
    assert scores[0] > 0.0 > scores[2]
    assert abs(scores[1]) < 1e-6
    assert -scores[2] == pytest.approx(scores[0], rel=0.01)
    assert scores[0] == pytest.approx(0.001 * full * AREA / MASS * HEIGHT, rel=1e-6)


def test_other_paths_and_answers() -> None:
    """The largest deceleration of a piston under constant pressure is p F/m - g, and the speed of landing exact by energy."""
    found = find(ask(open_case(NO_BELTS, [LUMPED]), path="cargo.mass", target="peak_deceleration=10 m/s^2"))
    assert found.value == pytest.approx(15696.0 * AREA / (GRAVITY + 10.0), rel=2 * SEARCH_WIDTH)
    found = find(ask(open_case(NO_BELTS, [LUMPED]), path="cargo.velocity", target="impact_velocity=1 m/s"))
    assert found.value == pytest.approx(sqrt(1.0 + 2 * HEIGHT * (15696.0 * AREA / MASS - GRAVITY)), rel=2 * SEARCH_WIDTH)


@pytest.mark.slow
def test_shell_stops_at_the_pressure_found_and_its_bar_holds() -> None:
    """The full stop of the axisymmetric shell: a run with the value stops, one a little below does not; finer grids agree."""
    found = find(ask(open_case(NO_BELTS, [AXISYMMETRIC])))
    assert softbrake.run(load_case(NO_BELTS, [AXISYMMETRIC, f"pressure.value={found.value!r}"])).outcome == "stopped"
    below = load_case(NO_BELTS, [AXISYMMETRIC, f"pressure.value={found.value * (1 - 2 * SEARCH_WIDTH)!r}"])
    assert softbrake.run(below).outcome == "impact"
    fine = find(ask(open_case(NO_BELTS, [AXISYMMETRIC, "grid.generatrix=108", "grid.hoop=720"])))
    assert found.error is not None
    assert abs(fine.value - found.value) < found.error < 0.02 * found.value


def test_values_at_which_the_fabric_bursts_do_no_harm() -> None:
    soft = find(ask(open_case(NO_BELTS, [AXISYMMETRIC, "fabric.E=3 kN/m"])))
    faults = [point.fault for point in soft.points if point.score is None]
    assert faults and all("diverged" in fault for fault in faults)
    assert soft.summary.outcome == "stopped"


@pytest.mark.slow
def test_tolerance_chooses_the_level_and_checks_the_value_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """By two refinements, made up: of the case, and of it with the value found."""
    refined: list[float] = []

    def made_up(case: Case, tolerance: float, budget: float, report: object) -> Refined:
        refined.append(case.pressure.value)
        chosen = level(case, "axisymmetric", 18, 120)
        answer = replace(softbrake.run(chosen), impact_velocity_error=0.1, fidelity_reason=f"{tolerance:g} in {budget:g} s")
        return Refined(chosen, answer)

    monkeypatch.setattr(design_space, "refine", made_up)
    question = ask(open_case(NO_BELTS, ["tolerance=2%", "contact=solid"]), budget=7.0)
    case = question.load(18e3)
    assert (case.model.fidelity, case.grid.generatrix, case.tolerance) == ("axisymmetric", 18, None)
    assert case.pressure.value == 18e3
    found = find(question)
    assert not found.missed
    assert refined == [15696.0, found.value]
    assert found.summary.fidelity_reason == "0.02 in 7 s"


def test_check_beside_the_target_is_said() -> None:
    """A refinement that answers as the search did is within its errors, one that a tenth of the pressure is lost to is not."""
    question = ask(open_case(NO_BELTS, [LUMPED]), target="impact_velocity=1.5 m/s")

    def check(value: float) -> Refined:
        case = question.load(share * value)
        return Refined(case, replace(softbrake.run(case), impact_velocity_error=0.01))

    share = 1.0
    assert find(replace(question, check=check)).missed == ""
    share = 0.9
    found = find(replace(question, check=check))
    speed = sqrt(1.5**2 + 2 * HEIGHT * 0.1 * exact_pressure(1.5) * AREA / MASS)
    assert found.summary.impact_velocity == pytest.approx(speed, rel=1e-2)
    assert found.missed == f"the check gives {found.summary.impact_velocity:.5g} m/s, not impact_velocity = 1.5 m/s"


def test_paper_s_case_meets_its_target() -> None:
    found = find(ask(open_case(CONFIGS / "paper.yaml", [AXISYMMETRIC]), target="impact_velocity=2 m/s"))
    assert found.summary.impact_velocity == pytest.approx(2.0, rel=3e-3)
    assert found.summary.impact_velocity <= 2.0


# The root


@pytest.mark.parametrize(
    ("function", "root"),
    [
        (lambda x: x**3 - 2.0, 2 ** (1 / 3)),
        (lambda x: np.tanh(20 * (x - 1.3)), 1.3),
        (lambda x: 1.0 if x > 1.7 else -1e-3, 1.7),
        (lambda x: np.sign(x - 1.2) * abs(x - 1.2) ** 0.3, 1.2),
    ],
)
def test_bracket_closes_in(function, root: float) -> None:
    tried = []

    def attempt(value: float) -> DesignPoint:
        tried.append(value)
        return DesignPoint(value, None, function(value))

    ends = _close_in(attempt, attempt(1.0), attempt(2.0))
    low, high = sorted(point.value for point in ends)
    assert low <= root <= high and high - low <= SEARCH_WIDTH * high
    assert len(tried) < 20


def test_smooth_functions_take_few_steps() -> None:
    tried = []
    _close_in(
        lambda x: tried.append(x) or DesignPoint(x, None, x**2 - 2.0), DesignPoint(1.0, None, -1.0), DesignPoint(2.0, None, 2.0)
    )
    assert len(tried) <= 7


def test_jump_is_no_crossing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("softbrake.studies.inverse_design._tried", lambda load, target, values: [
        DesignPoint(value, None, 1.0 if value < 20e3 else -1.0, "no run") for value in values
    ])  # fmt: skip
    with pytest.raises(NotReached, match=r"jumps across impact_velocity = 0 m/s between \d+\.\d+ Pa \(no run\)"):
        find(ask(open_case(NO_BELTS, [LUMPED])))


def test_exact_hits_are_no_jumps() -> None:
    """The peak of a piston under constant pressure is p F/m - g, and a line is met exactly by interpolation."""
    piston_case = open_case(NO_BELTS, [LUMPED])
    for k in range(100):
        wanted = 5.0 + 0.5 * k
        found = find(ask(piston_case, target=f"peak_deceleration={wanted} m/s^2", between="5 kPa:80 kPa"))
        exact = MASS * (GRAVITY + wanted) / AREA
        assert found.bracket[0] <= exact * (1 + 1e-9) and exact <= found.bracket[1] * (1 + 1e-9)
        assert found.value == pytest.approx(exact, rel=SEARCH_WIDTH)
        assert found.summary.peak_deceleration == pytest.approx(wanted, rel=NEAR)


@pytest.mark.parametrize("share", [1.0, 1 - 1e-7, 1 + 1e-7])
@pytest.mark.parametrize("end", ["low", "high"])
def test_value_at_an_end_of_the_range_is_found(end: str, share: float) -> None:
    exact = share * MASS * (GRAVITY + 25.0) / AREA
    between = f"{exact!r}:60 kPa" if end == "low" else f"5 kPa:{exact!r} Pa"
    found = find(ask(open_case(NO_BELTS, [LUMPED]), target="peak_deceleration=25 m/s^2", between=between))
    assert found.value == pytest.approx(exact, rel=SEARCH_WIDTH)
    assert found.error is not None and found.others == 0


def test_low_impact_velocity_is_met() -> None:
    """Near a full stop the speed changes by a tenth within SEARCH_WIDTH."""
    for speed in (0.2, 0.5, 1.0):
        question = ask(open_case(NO_BELTS, [LUMPED]), path="shell.diameter", target=f"impact_velocity={speed} m/s")
        found = find(question)
        assert found.summary.impact_velocity is not None
        assert speed * (1 - NEAR) <= found.summary.impact_velocity <= speed


def made_up(monkeypatch: pytest.MonkeyPatch, score: Callable[[float], float], between: str) -> Question:
    """A question with made-up scores of a peak deceleration of 10 m/s²."""
    summary = synthetic_drop.summary()
    monkeypatch.setattr("softbrake.studies.inverse_design._tried", lambda load, target, values: [
        DesignPoint(value, replace(summary, peak_deceleration=10.0 + score(value)), score(value)) for value in values
    ])  # fmt: skip
    return ask(open_case(NO_BELTS, [LUMPED]), target="peak_deceleration=10 m/s^2", between=between)


def test_valley_between_two_places_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A valley a hundredth as wide as the range, and one that stays above the target."""
    place = 10e3 * 2.0 ** (5.4 / 8)  # beside the sixth place
    found = find(made_up(monkeypatch, lambda value: 100 * abs(value / place - 1) - 0.5, "10kPa:20kPa"))
    assert found.value == pytest.approx(place * 0.995, rel=SEARCH_WIDTH)
    assert found.others == 1
    with pytest.raises(NotReached, match=r"none of (\d+) places in the range reaches .* nearest is 15\.9") as caught:
        find(made_up(monkeypatch, lambda value: 100 * abs(value / place - 1) + 0.1, "10kPa:20kPa"))
    assert int(re.search(r"none of (\d+)", str(caught.value))[1]) > POINTS  # type: ignore[index]


def test_answer_that_touches_its_target_is_found_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the middle place, above the target on both sides, and as flat there as a parabola."""
    found = find(made_up(monkeypatch, lambda value: (value / 20e3 - 1) ** 2, "10kPa:40kPa"))
    assert found.value == pytest.approx(20e3, rel=1e-12)
    assert found.others == 0


def test_value_whose_answer_does_not_change_has_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    found = find(made_up(monkeypatch, lambda value: 0.0 if value <= 10e3 else -1.0 if value > 15e3 else 0.0, "10kPa:40kPa"))
    assert (found.value, found.error) == (10e3, None)
    assert "the same around the value" in found.basis


def test_places_beyond_the_range_are_not_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    found = find(made_up(monkeypatch, lambda value: value / 10.01e3 - 1, "10kPa:40kPa"))
    assert min(point.value for point in found.points) == 10e3


def test_check_that_diverges_keeps_the_value_found() -> None:
    def check(value: float) -> Refined:
        raise Diverged("diverged at 0.1 s", synthetic_drop.summary())

    found = find(replace(ask(open_case(NO_BELTS, [LUMPED])), check=check))
    assert found.value == pytest.approx(exact_pressure(0.0), rel=SEARCH_WIDTH)
    assert found.missed == "the check has no answer: diverged at 0.1 s"


def test_command_says_that_every_grid_diverges(monkeypatch: pytest.MonkeyPatch) -> None:
    def refine(*_: object) -> Refined:
        raise Diverged("diverged at 0.1 s", synthetic_drop.summary())

    monkeypatch.setattr(design_space, "refine", refine)
    told = CliRunner().invoke(app, ["design", str(NO_BELTS), "--set", "tolerance=2%", "-q"])
    assert (told.exit_code, told.stderr) == (1, "diverged at 0.1 s\n")


# Refusals


def test_refusal_names_what_was_found_at_both_ends() -> None:
    with pytest.raises(NotReached, match=r"at 1 kPa: 6\.\d+ m/s; at 5 kPa: 5\.\d+ m/s; nearest is 5 kPa") as caught:
        find(ask(open_case(NO_BELTS, [LUMPED]), between="1 kPa:5 kPa"))
    assert "impact_velocity = 0 m/s" in str(caught.value)
    with pytest.raises(
        NotReached, match=r"diverged at .* \d of \d+ without an answer"
    ):  # the fabric bursts before it brakes so hard
        find(ask(open_case(NO_BELTS, [AXISYMMETRIC, "fabric.E=3 kN/m"]), target="peak_deceleration=10000 m/s^2"))
    with pytest.raises(NotReached, match=r"none of 9 has an answer"):
        find(ask(open_case(NO_BELTS, [AXISYMMETRIC, "fabric.E=1 kN/m"]), between="40 kPa:80 kPa"))
    with pytest.raises(NotReached, match="neither impact nor stop by 0.001 s; raise time.end"):
        find(ask(open_case(NO_BELTS, [LUMPED, "time.end=1 ms"])))


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        ({"target": "impact=3"}, "--target impact=3: unknown answer 'impact'; known are"),
        ({"target": "impact_velocty=3"}, "did you mean 'impact_velocity'?"),
        ({"target": "impact_velocity=3kN"}, "'kN' is a force; a speed such as impact_velocity=1.5m/s is expected"),
        ({"target": "impact_velocity"}, "'' is not a number with a unit"),
        ({"target": "impact_velocity=-1"}, "out of range"),
        (
            {"target": "peak_deceleration=8kg"},
            "'kg' is a mass; an acceleration such as peak_deceleration=8g is expected",
        ),
        ({"target": "peak_tension_belt=3kN/m"}, "the case has no belts"),
        ({"path": "fabric.EE"}, "--find fabric.EE: not a quantity"),
        ({"path": "belts.count"}, "not a quantity"),
        ({"path": "tolerance", "between": "1%:2%"}, "not a quantity"),
        ({"path": "time.end", "between": "1:2"}, "not a quantity"),
        ({"path": "pressure.values"}, "not a quantity"),
        ({"path": "fabric.G12"}, "the case gives no value to start from; --range fabric.G12=LOW:HIGH is expected"),
        ({"between": "3:2"}, "not a range"),
        ({"between": "1kPa"}, "is not LOW:HIGH; a pressure on both sides of a colon is expected"),
        ({"between": "1kPa:2kN"}, "'kN' is a force"),
    ],
    ids=str,
)
def test_faults_of_a_question(words: dict[str, str], fault: str) -> None:
    with pytest.raises(ValueError) as caught:
        ask(open_case(NO_BELTS), **words)
    assert fault in str(caught.value)


@pytest.mark.parametrize(
    ("path", "low", "high"),
    [
        ("vents.0.discharge", 0.2, 1.0),  # at most 1
        ("gas.gamma", 1.0 + 0.4 / 3.0, 4.2),  # above 1
        ("vents.0.area", 0.02, 0.18),
    ],
)
def test_a_range_by_default_ends_where_its_key_does(path: str, low: float, high: float) -> None:
    file = open_case(VENTED, ["gas.gamma=1.4", "gas.gas_constant=287 J/kg/K"])
    found = variable(file, path, None)
    assert (found.low, found.high) == pytest.approx((low, high))
    for end in (found.low, found.high):
        assert file.vary({path: end})


@pytest.mark.parametrize("between", [None, "1cm^2:5cm^2"])
def test_a_number_that_a_list_has_not_is_named_before_its_range(between: str | None) -> None:
    file = open_case(VENTED)
    with pytest.raises(ValueError, match=r"^--find vents.3.area: vents.3: vents is a list without a '3'; its numbers are 0$"):
        variable(file, "vents.3.area", between)


def test_g_is_the_standard_gravity_where_an_acceleration_is_asked_for() -> None:
    moon = open_case(NO_BELTS, [LUMPED, "gravity=1.62 m/s^2"])
    assert ask(moon, target="peak_deceleration=8g").target.value == pytest.approx(8 * 9.80665)


def test_target_prints_in_the_unit_asked_for() -> None:
    told = CliRunner().invoke(app, ["design", str(NO_BELTS), "--set", LUMPED, "--target", "peak_deceleration=3g"])
    assert told.exit_code == 0, told.output
    assert "for peak_deceleration = 3 g\n" in told.stdout
    assert re.search(r"with its peak at +[0-9.]+ s +[0-9.]+ g *\n", told.stdout)
    assert re.search(r"pressure\.value [0-9.]+ Pa: [0-9.]+ g\n", told.stderr)
    told = CliRunner().invoke(app, ["design", str(NO_BELTS), "--set", LUMPED, "--target", "peak_deceleration=300g", "-q"])
    assert told.exit_code == 1
    assert re.search(r"reaches peak_deceleration = 300 g: at [0-9.]+ Pa: [0-9.]+ g; ", told.stderr)
    assert "m/s^2" not in told.stderr


def test_values_are_shown_in_the_unit_of_the_range_or_of_the_file() -> None:
    for words, unit, size in (
        ({}, "Pa", 1.0),
        ({"between": "10:40 kPa"}, "kPa", 1e3),
        ({"path": "shell.height"}, "m", 1.0),
        ({"path": "fabric.E"}, "kN/m", 1e3),
    ):
        found = ask(open_case(NO_BELTS, [LUMPED, "fabric.E=20 kN/m", "pressure.value=15696"]), **words)
        assert (found.shown, found.size) == (unit, size), words


def test_next_line_has_the_unit_asked_for() -> None:
    told = CliRunner().invoke(app, ["design", str(NO_BELTS), "--set", LUMPED, "--range", "10kPa:40kPa", "-q"])
    assert told.exit_code == 0, told.output
    value, unit = re.search(r"next: .* --set pressure\.value=([0-9.]+)(\w*)\n", told.stdout).groups()  # type: ignore[union-attr]
    assert unit == "kPa" and 1e3 * float(value) == pytest.approx(exact_pressure(0.0), rel=SEARCH_WIDTH)
    assert re.search(rf"pressure\.value +{value} kPa +± ", told.stdout)


def test_lumped_case_has_no_tensions_to_ask_for() -> None:
    assert softbrake.run(load_case(NO_BELTS, [LUMPED, "fabric.strength=1kN/m"])).fabric_margin is None
    with pytest.raises(ValueError, match="a lumped case has no shell, and so no tensions"):
        ask(open_case(NO_BELTS, [LUMPED]), target="peak_tension_hoop=3kN/m")


def test_ends_of_the_range_are_checked_before_the_first_run() -> None:
    with pytest.raises(ValueError, match=r"--find pressure.value from -0.001 kPa to 5 kPa: pressure.value: -1.0 is out"):
        ask(open_case(NO_BELTS), between="-1:5kPa")


# Strengths and inputs


def test_margins() -> None:
    strong = softbrake.run(load_case(CONFIGS / "paper.yaml", [AXISYMMETRIC, "fabric.strength=30 kN/m"]))
    assert strong.fabric_margin == pytest.approx(30e3 / max(strong.peak_tension_hoop, strong.peak_tension_generatrix) - 1)
    assert strong.belt_margin == pytest.approx(150e3 / strong.peak_tension_belt - 1)  # five layers of that fabric
    weak = softbrake.run(load_case(CONFIGS / "paper.yaml", [AXISYMMETRIC, "belts.strength=20 kN/m"]))
    assert weak.fabric_margin is None
    assert weak.belt_margin == pytest.approx(20e3 / weak.peak_tension_belt - 1) and weak.belt_margin < 0
    empty = softbrake.run(load_case(NO_BELTS, [AXISYMMETRIC, "fabric.strength=30 kN/m", "pressure.value=0", "time.end=5 ms"]))
    assert empty.peak_tension_hoop < 1e-3 and empty.fabric_margin is None  # round-off is no tension
    plain = softbrake.run(load_case(NO_BELTS, [AXISYMMETRIC, "fabric.strength=30 kN/m"]))
    assert plain.fabric_margin is not None and plain.belt_margin is None


def test_quantities_are_what_the_file_gives() -> None:
    found = open_case(CONFIGS / "belts-list.yaml", ["cargo.mass=50", "friction=0", "fabric.strength=1kN/m"]).quantities()
    assert found["cargo.mass"] == 50.0
    assert found["belts.1.stiffness"] == 6000.0
    assert isclose(found["fabric.damping_ratio"], 0.03)
    assert not {"friction", "fabric.strength", "fabric.viscosity", "grid.hoop", "time.courant"} & found.keys()
    table = ["pressure={law: table, times: [0, 0.1], values: [0, 15 kPa]}"]
    assert open_case(NO_BELTS, table).quantities()["pressure.values"] == (0.0, 15e3)


# The command


@pytest.mark.slow
def test_command_prints_what_it_found(softbrake: Command, tmp_path: Path) -> None:
    done = softbrake("design", NO_BELTS, "--set", LUMPED)
    assert done.returncode == 0, done.stderr
    assert "pi/2 of the mean" in done.stdout and "±" in done.stdout
    assert max(map(len, done.stdout.splitlines()[:-1])) <= 80
    assert len(done.stderr.splitlines()) == len(find(ask(open_case(NO_BELTS, [LUMPED]))).points)
    told = softbrake("design", NO_BELTS, "--set", LUMPED, "--target", "impact_velocity=2", "--json", "-q")
    answer = json.loads(told.stdout)
    assert told.stderr == ""
    assert answer["value"] == pytest.approx(exact_pressure(2.0), rel=SEARCH_WIDTH)
    assert answer["summary"]["impact_velocity"] == pytest.approx(2.0, rel=3e-3)
    assert answer["section_2_2"]["mean"] == pytest.approx(20273.36, rel=1e-6)
    values = [point["value"] for point in answer["points"]]
    assert values == sorted(values) and values[-1] / values[0] == pytest.approx(9.0)
    assert any(isclose(value, answer["value"] * (1 + NUDGE)) for value in values)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_command_refuses(softbrake: Command, tmp_path: Path) -> None:
    done = softbrake("design", NO_BELTS, "--set", LUMPED, "--range", "1kPa:5kPa", "-q")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith("pressure.value: none of 11 places in the range reaches")
    done = softbrake("design", NO_BELTS, "--find", "fabric.EE")
    assert (done.returncode, done.stdout) == (2, "")
    assert list(tmp_path.iterdir()) == []
