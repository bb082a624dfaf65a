"""The choice of level and grid for a tolerance: errors that are kept, levels left on evidence, limits said.

Most drops are made up, for what they answer, how round they stay and what they cost: a refinement cannot tell.
"""

import json
import math
import re
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest
from conftest import Command
from typer.testing import CliRunner

import softbrake
from softbrake.case.case import Case
from softbrake.case.full_stop import full_stop
from softbrake.case.level import level
from softbrake.cli.app import app
from softbrake.sim import simulation as drop
from softbrake.sim.result_file import read_history, read_summary
from softbrake.sim.simulation import Diverged, Simulation
from softbrake.sim.summary import Ensemble, PeakValue, Summary, Trial
from softbrake.studies import error_control
from softbrake.studies.convergence import NEIGHBOURLY, prediction
from softbrake.studies.error_control import (
    COARSE,
    FINE,
    LEAST_MEMBERS,
    NEIGHBOURS,
    OTHERS,
    SCREEN,
    SEEDS,
    Interrupted,
    Refined,
    allowed,
    disturbance,
    kinetic,
    least_cells,
    reached,
    refine,
    speed_of,
    speed_range,
)

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
NO_BELTS = CONFIGS / "no-belts.yaml"
SOLID = "contact=[ground, cover, cargo]"
STOPPING = ("pressure.value=30 kPa", "cargo.velocity=4")


def case(name: str = "no-belts", *overrides: str) -> Case:
    return softbrake.load_case(CONFIGS / f"{name}.yaml", [SOLID, *overrides])


def fine(of: Case, cells: int = 288) -> float:
    """Impact velocity (m/s) of the axisymmetric shell on a grid beyond those of a refinement."""
    return _speed(level(of, "axisymmetric", cells, 10_000))


@cache
def _speed(of: Case) -> float:
    return speed_of(softbrake.run(of))


def in_radius(of: Case) -> float:
    """Cells in a radius."""
    return of.grid.generatrix * 0.5 * of.shell.diameter / of.shell.height


# Made-up drops


@dataclass
class MadeUp:
    """Drops that answer what is asked of them; `done` holds those of shells."""

    base: Summary  # of a lumped run
    energy: Callable[[Case, int], float] = lambda of, seed: 9.0  # m^2/s^2, as of `kinetic`
    out: Callable[[Case, int], float] = lambda of, seed: SEEDS[(seed - 1) % len(SEEDS)] if seed else 0.0  # of the radius
    seconds: Callable[[Case], float] = lambda of: 1.0 if of.model.fidelity == "full" else 1e-3
    fate: Callable[[Case, int], str] = lambda of, seed: ""  # another than to end: diverged, time_limit or interrupted
    done: list[tuple[Case, int]] = field(default_factory=list)
    now: float = 0.0  # s

    def probe(self, of: Case, seed: int = 0) -> tuple[Summary, float]:
        self.now += self.seconds(of)
        if of.model.fidelity == "lumped":
            return self.base, 0.0
        fate = self.fate(of, seed)
        if fate == "interrupted":
            raise KeyboardInterrupt
        self.done.append((of, seed))
        answer = self.answer(of, seed)
        if fate == "diverged":
            raise Diverged("diverged at 0.01 s", replace(answer, outcome="diverged", impact_velocity=None))
        if fate == "time_limit":
            answer = replace(answer, outcome="time_limit", impact_velocity=None, lowest_height=0.1)
        return answer, self.out(of, seed)

    def answer(self, of: Case, seed: int) -> Summary:
        energy = self.energy(of, seed)
        peaks = {"peak_deceleration": 10.0 * energy, "peak_tension_generatrix": 100.0 * energy, "peak_tension_hoop": 1e3 * energy}
        return replace(
            self.base,
            outcome="impact" if energy > 0.0 else "stopped",
            impact_velocity=math.sqrt(energy) if energy > 0.0 else None,
            lowest_height=0.0 if energy > 0.0 else of.shell.height * energy / (energy - of.cargo.velocity**2),
            peaks={name: PeakValue(value, 0.1) for name, value in peaks.items()},
            model=replace(self.base.model, fidelity=of.model.fidelity, generatrix=of.grid.generatrix, hoop=of.grid.hoop),
            **peaks,
        )

    def of(self, fidelity: str) -> list[tuple[Case, int]]:
        return [one for one in self.done if one[0].model.fidelity == fidelity]


@pytest.fixture(scope="module")
def base() -> Summary:
    return drop.simulate(level(case(), "lumped", 8, 8))


@pytest.fixture
def made_up(base: Summary, monkeypatch: pytest.MonkeyPatch) -> MadeUp:
    """Drops of a refinement, and its clock, made up; by default all answer 3 m/s and stay round."""
    drops = MadeUp(base)
    monkeypatch.setattr(error_control, "probe", drops.probe)
    monkeypatch.setattr(error_control, "CLOCK", lambda: drops.now)
    monkeypatch.setattr(error_control, "Simulation", lambda of: SimpleNamespace(advance=lambda most: None))  # nothing to compile
    return drops


def not_round(of: Case, seed: int) -> float:
    return 0.1 if seed else 0.0


def scattered(of: Case, seed: int) -> float:
    """Full shells about 3.2 m/s, axisymmetric ones at 3 m/s."""
    return 9.0 if of.model.fidelity == "axisymmetric" else (3.2 + 0.01 * ((7 * seed) % 5 - 2)) ** 2


def bar(summary: Summary) -> float:
    return math.inf if summary.impact_velocity_error is None else summary.impact_velocity_error


# Grids of the axisymmetric shell


@pytest.mark.parametrize("tolerance", [0.05, 0.01, 0.002])
@pytest.mark.parametrize("order", [1, 2])
def test_bar_holds_the_limit_of_grids_beside_one_another(order: int, tolerance: float, made_up: MadeUp) -> None:
    """Full shells follow the same law, on their own grids."""
    made_up.energy = lambda of, seed: 9.0 + 0.5 * (10.0 / in_radius(of)) ** order
    made_up.seconds = lambda of: 1e-6
    found = refine(case(), tolerance)
    summary = found.summary
    assert found.case.model.fidelity == "axisymmetric"
    assert reached(replace(case(), tolerance=tolerance, insists=True), summary)
    assert abs(speed_of(summary) - 3.0) <= bar(summary) <= tolerance * speed_of(summary)
    assert summary.impact_velocity == pytest.approx(math.sqrt(made_up.energy(found.case, 0)))
    assert summary.peak_errors is not None
    assert abs(summary.peak_tension_hoop - 9000.0) <= summary.peak_errors["peak_tension_hoop"]  # type: ignore[operator]


def test_finer_grids_are_asked_only_where_the_tolerance_wants_them(made_up: MadeUp) -> None:
    made_up.energy = lambda of, seed: 9.0 + 0.5 * (10.0 / in_radius(of)) ** 2
    counts = []
    for tolerance in (0.1, 0.01, 0.002):
        made_up.done.clear()
        found = refine(case(), tolerance)
        cells = [of.grid.generatrix for of, _ in made_up.of("axisymmetric")]
        *refined, twice = cells[: cells.index(found.case.grid.generatrix) + 1]
        assert all(1.1 < b / a < 1.3 for a, b in pairwise(refined))
        assert twice == 2 * refined[-1]
        counts.append(len(refined))
    assert counts[0] == NEIGHBOURS < counts[1] < counts[2]


def test_neighbours_that_agree_on_their_way_elsewhere_are_no_claim(made_up: MadeUp) -> None:
    """Grids of 9 to 19 cells in a radius agree; beyond 30 the answer is another one."""
    made_up.energy = lambda of, seed: 9.0 + (2.0 if of.model.fidelity == "axisymmetric" and in_radius(of) > 30.0 else 0.0)
    found = refine(case(), 0.02)
    summary = found.summary
    assert in_radius(found.case) > 60.0
    assert speed_of(summary) == pytest.approx(math.sqrt(11.0))


def test_grid_twice_as_fine_that_diverges_is_no_claim(made_up: MadeUp) -> None:
    made_up.fate = lambda of, seed: "diverged" if of.model.fidelity == "axisymmetric" and in_radius(of) > 30.0 else ""
    summary = refine(case(), 0.05).summary
    assert summary.impact_velocity_error is None
    assert "a finer one diverges" in str(summary.fidelity_reason)


def test_scattered_grids_are_no_claim(made_up: MadeUp) -> None:
    """A tenth up and down from grid to grid is not settled, however many there are, nor where two of them agree by accident."""
    made_up.seconds = lambda of: 1e-6 * of.grid.generatrix**2
    for turn in (lambda n: n % 3 - 1.0, lambda n: (-1.0) ** (n // 2)):
        values: dict[int, float] = {}
        made_up.energy = lambda of, seed, turn=turn, values=values: values.setdefault(  # type: ignore[misc]
            of.grid.generatrix, 9.0 + turn(len(values))
        )
        summary = refine(case(), 0.01, budget=1.0).summary
        assert bar(summary) > 0.15
        assert not reached(replace(case(), tolerance=0.01, insists=True), summary)


def test_energy_goes_on_smoothly_from_impact_to_stop() -> None:
    """That of a piston is V² + 2 l1 (g - p F/m), on both sides of the full stop."""
    piston = case("no-belts", "model.fidelity=lumped")
    full = full_stop(100.0, 6.0, piston.gravity, 0.6, 0.5)
    for share in (0.5, 0.99, 1.0 - 1e-6, 1.0 + 1e-6, 1.01, 2.0):
        of = case("no-belts", "model.fidelity=lumped", f"pressure.value={share * full.mean!r}")
        answer = softbrake.run(of)
        assert answer.outcome == ("impact" if share < 1.0 else "stopped")
        assert kinetic(of, answer) == pytest.approx((1.0 - share) * 2.0 * full.energy / 100.0, rel=1e-3, abs=1e-8)


def test_energy_of_a_shell_goes_on_smoothly_from_impact_to_stop() -> None:
    """Where the cargo begins to reach the ground: no jump, and no corner but a slight one."""

    def of(pressure: float) -> tuple[str, float]:
        one = case("no-belts", "model.fidelity=axisymmetric", "grid.generatrix=24", f"pressure.value={pressure!r}")
        answer = softbrake.run(one)
        return answer.outcome, kinetic(one, answer)

    low, high = 15e3, 30e3
    assert (of(low)[0], of(high)[0]) == ("impact", "stopped")
    while high - low > 1e-6 * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if of(middle)[0] == "stopped" else (middle, high)
    (_, above), (_, below) = of(low), of(high)
    assert 0.0 <= above < 1e-2 and -1e-2 < below <= 0.0
    apart = 0.01 * low
    slopes = [(of(low - apart)[1] - above) / apart, (below - of(high + apart)[1]) / apart]
    assert slopes[0] > 0.0 and slopes[1] == pytest.approx(slopes[0], rel=0.5)


def test_speeds_are_continuous_where_the_cargo_begins_to_reach_the_ground() -> None:
    ranges = [speed_range(energy, 0.04) for energy in (-0.05, -0.04, -1e-9, 0.0, 1e-9, 0.04, 9.0)]
    assert ranges[0] == (0.0, 0.0)  # it stops, whatever the error
    assert ranges[1] == (0.0, 0.0)
    for speed, error in ranges[2:5]:
        assert speed == pytest.approx(0.0, abs=1e-4)
        assert error == pytest.approx(0.2, abs=1e-4)
    assert ranges[5] == pytest.approx((0.2, 0.2))  # it may stop
    assert ranges[6] == pytest.approx((3.0, 0.04 / 6.0), rel=1e-2)
    assert speed_range(9.0, math.inf) == (3.0, math.inf)


@pytest.mark.parametrize("energy", [0.02, -0.02])
def test_grids_that_do_not_agree_whether_the_cargo_stops_have_a_bar_that_holds_both(energy: float, made_up: MadeUp) -> None:
    """However many there are: each new grid says the other."""
    values: dict[int, float] = {}
    made_up.energy = lambda of, seed: values.setdefault(of.grid.generatrix, energy * (-1.0) ** len(values))
    made_up.seconds = lambda of: 1e-6 * of.grid.generatrix**2
    summary = refine(case(), 0.05, budget=1.0).summary
    assert not reached(replace(case(), tolerance=0.05, insists=True), summary)
    assert speed_of(summary) + bar(summary) >= math.sqrt(0.02)
    assert speed_of(summary) - bar(summary) <= 0.0


def test_cargo_that_stops_has_a_tolerance_too(made_up: MadeUp) -> None:
    """Of the free-fall velocity, since the impact velocity is none."""
    made_up.energy = lambda of, seed: -0.01 + 0.2 * (10.0 / in_radius(of)) ** 2
    summary = refine(case(), 0.01).summary
    assert summary.free_fall_velocity == pytest.approx(6.911, abs=1e-3)
    assert (
        bar(summary)
        <= allowed(0.01, speed_of(summary), summary.free_fall_velocity)
        == pytest.approx(0.01 * 0.05 * 6.911, rel=0.5)
    )
    made_up.energy = lambda of, seed: -1.0
    stopped = refine(case(), 0.01).summary
    assert (stopped.outcome, stopped.impact_velocity, stopped.velocity_reduction) == ("stopped", None, None)
    assert stopped.impact_velocity_error == 0.0


# Whether the shell stays round


def test_round_shells_move_the_bar_by_what_they_are_off(made_up: MadeUp) -> None:
    """By OTHERS times the largest distance, on the finer of their grids, where the axisymmetric shell is run beside them."""
    off = {(29, 1): 0.3, (44, 1): -0.04, (44, 5): 0.06}
    made_up.energy = lambda of, seed: 9.0 + 1.0 / in_radius(of) ** 2 + (off[of.grid.generatrix, seed] if seed else 0.0)
    found = refine(case(), 0.02)
    summary = found.summary
    assert found.case.model.fidelity == "axisymmetric"
    grids = NEIGHBOURLY / in_radius(found.case) ** 2  # of order 2 without scatter
    assert bar(summary) == pytest.approx(speed_range(made_up.energy(found.case, 0), grids + OTHERS * 0.06)[1], rel=1e-6)
    assert summary.peak_errors is not None
    assert summary.peak_errors["peak_deceleration"] == pytest.approx(10.0 * (grids + OTHERS * 0.06), rel=1e-6)
    assert str(summary.fidelity_reason).endswith("full shells stay round")
    assert [(of.grid.generatrix, seed) for of, seed in made_up.of("full")] == list(off)
    for screened, _ in made_up.of("full")[1:]:
        twins = [of for of, _ in made_up.of("axisymmetric") if of.grid == screened.grid]
        assert twins and twins[0].contact == screened.contact
    made_up.energy = lambda of, seed: 9.0 + (1.0 if of.model.fidelity == "full" else 0.0)
    moved = refine(case(), 0.02).summary
    assert not reached(replace(case(), tolerance=0.02, insists=True), moved)
    assert bar(moved) == pytest.approx(speed_range(9.0, OTHERS)[1], rel=1e-6)
    assert str(moved.fidelity_reason).endswith("full shells stay round, but are off it")


@pytest.mark.parametrize("growth", [0.1, 1.0, 3.0])
def test_shell_that_stays_round_is_asked_on_a_finer_grid(growth: float, made_up: MadeUp) -> None:
    """Whether or not it lets a disturbance grow; one that does not stay round is an ensemble's at once."""
    made_up.out = lambda of, seed: growth * SEEDS[(seed - 1) % len(SEEDS)] if seed else 0.0
    found = refine(case(), 0.02)
    assert [(of.grid.generatrix, seed) for of, seed in made_up.of("full")] == [(29, 1), (44, 1), (44, 5)]  # 12, 18 in a radius
    assert found.case.model.fidelity == "axisymmetric"
    assert reached(replace(case(), tolerance=0.02, insists=True), found.summary)
    made_up.out = not_round
    lost = refine(case(), 0.02).summary
    assert [trial.generatrix for trial in lost.trials if trial.verdict.startswith("not round")] == [29]
    assert not any(trial.verdict.startswith("round") for trial in lost.trials)


@pytest.mark.parametrize(
    ("budget", "grids"),
    [(5.0, [29]), (15.0, [29]), (50.0, [29]), (55.0, [29, 44]), (65.0, [29, 44, 29]), (85.0, [29, 44, 29]), (95.0, [29, 44, 44])],
)
def test_round_shell_is_no_claim_where_the_budget_allows_no_three_full_ones(
    budget: float, grids: list[int], made_up: MadeUp
) -> None:
    """Full shells of 10 s each; finer ones of 41 s at most, for all that is known before, and of 40 s each."""
    made_up.seconds = lambda of: 1e-3 if of.model.fidelity != "full" else 10.0 if of.grid.generatrix == 29 else 40.0
    summary = refine(case(), 0.02, budget).summary
    assert [of.grid.generatrix for of, _ in made_up.of("full")] == grids
    assert summary.impact_velocity == pytest.approx(3.0)
    claimed = len(grids) == 3
    assert (summary.impact_velocity_error is not None) == claimed
    assert reached(replace(case(), tolerance=0.02, insists=True), summary) == claimed
    said = "whether it stays round takes more full shells than the budget allows"
    assert (said in str(summary.fidelity_reason)) == (not claimed)


def test_shell_that_loses_its_symmetry_is_answered_by_the_mean_of_full_ones(made_up: MadeUp) -> None:
    made_up.out, made_up.energy = not_round, scattered
    found = refine(case(), 0.03)
    summary = found.summary
    members = [seed for of, seed in made_up.of("full") if of.grid == found.case.grid]
    energies = [scattered(found.case, seed) for seed in members]
    assert (found.case.model.fidelity, found.case.grid.generatrix) == ("full", 44)
    assert members == list(range(1, len(members) + 1)) and len(members) >= LEAST_MEMBERS
    beside = [scattered(of, seed) for of, seed in made_up.of("full") if of.grid != found.case.grid]
    mean, error = prediction(energies, beside)
    error = max(error, OTHERS * abs(sum(beside) / len(beside) - mean))
    assert summary.impact_velocity == pytest.approx(math.sqrt(mean))
    assert bar(summary) == pytest.approx(speed_range(mean, error)[1])
    for name, part in (("peak_deceleration", 10.0), ("peak_tension_hoop", 1e3)):
        assert getattr(summary, name) == pytest.approx(part * mean)
        assert summary.peaks[name].value == getattr(summary, name)
        assert summary.peak_errors is not None and summary.peak_errors[name] == pytest.approx(part * error)
    speeds = [math.sqrt(energy) for energy in energies]
    assert found.seed == min(members, key=lambda seed: abs(scattered(found.case, seed) - mean))
    assert summary.ensemble is not None
    assert (summary.ensemble.members, summary.ensemble.least, summary.ensemble.most) == (
        len(members),
        pytest.approx(min(speeds)),
        pytest.approx(max(speeds)),
    )
    assert (summary.ensemble.smallest, summary.ensemble.largest) == (min(SEEDS), max(SEEDS))
    assert "which do not stay round" in str(summary.fidelity_reason)
    assert summary.velocity_reduction == pytest.approx(summary.free_fall_velocity - speed_of(summary))
    assert reached(replace(case(), tolerance=0.03, insists=True), summary)
    assert any(trial.verdict.startswith("not round: a disturbance of 0.001 R") for trial in summary.trials)


def test_scene_that_determines_nothing_better_says_so(made_up: MadeUp) -> None:
    made_up.out, made_up.energy = not_round, lambda of, seed: 9.0 + (seed % 4)
    summary = refine(case(), 0.02, budget=600.0).summary
    assert not reached(replace(case(), tolerance=0.02, insists=True), summary)
    assert str(summary.fidelity_reason).endswith("this scene does not determine the impact velocity better")


@pytest.mark.parametrize("budget", [0.0, 5.0, 15.0, 60.0, 600.0])
@pytest.mark.parametrize("apart", [0.5, 4.0])
def test_shell_that_is_round_on_the_coarse_grid_only_has_a_bar_as_wide_as_grids_are_apart(
    apart: float, budget: float, made_up: MadeUp
) -> None:
    """However well the drops of either grid agree: 3 m/s where the shell stays round, another velocity where it does not."""

    def energy(of: Case, seed: int) -> float:
        return 9.0 + (apart if of.model.fidelity == "full" and in_radius(of) > SCREEN + 1 else 0.0)

    def out(of: Case, seed: int) -> float:
        return 0.0 if not seed else 0.1 if in_radius(of) > SCREEN + 1 else 2.0 * SEEDS[(seed - 1) % len(SEEDS)]

    made_up.energy, made_up.out = energy, out
    summary = refine(case(), 0.02, budget).summary
    assert bar(summary) >= math.sqrt(9.0 + apart) - 3.0 - 1e-9
    if any(in_radius(of) > SCREEN + 1 for of, _ in made_up.of("full")):
        assert summary.model.fidelity == "full"


@pytest.mark.parametrize("budget", [0.0, 3.0, 10.0, 30.0, 600.0])
def test_members_that_agree_on_one_grid_are_no_claim(budget: float, made_up: MadeUp) -> None:
    """They are wrong alike: another grid answers otherwise, and the bar is at least OTHERS times as wide as they are apart."""
    made_up.out = not_round
    level_of = {math.ceil(2.4 * cells): value for cells, value in ((COARSE, 8.5), (SCREEN, 9.0), (FINE, 12.25))}
    made_up.energy = lambda of, seed: level_of.get(of.grid.generatrix, 12.25) + 1e-3 * seed
    found = refine(case(), 0.02, budget)
    summary = found.summary
    used = {
        n: [made_up.energy(of, seed) for of, seed in made_up.of("full") if of.grid.generatrix == n]
        for n in sorted({of.grid.generatrix for of, _ in made_up.of("full")})
    }
    if budget == 0.0:
        assert found.case.grid.generatrix == 29 and summary.impact_velocity_error is None
        return
    assert list(used) == ([22, 29] if budget < 30.0 else [29, 44])
    rough, members = used.values()
    (coarser, _), (mean, error) = prediction(rough), prediction(members, rough)
    assert found.case.grid.generatrix == max(used)
    assert summary.ensemble is not None and summary.ensemble.members == len(members)
    assert summary.impact_velocity == pytest.approx(math.sqrt(mean))
    apart = OTHERS * abs(coarser - mean)
    assert bar(summary) >= speed_range(mean, apart)[1] * (1.0 - 1e-9)
    assert bar(summary) == pytest.approx(speed_range(mean, max(error, apart))[1])
    assert not reached(replace(case(), tolerance=0.02, insists=True), summary)
    if budget >= 30.0:
        assert speed_of(summary) - bar(summary) <= 3.0 and speed_of(summary) >= 3.5
    assert (summary.impact_velocity_error is None) == (budget < 10.0)


def test_printed_scheme_is_answered_by_full_shells(made_up: MadeUp) -> None:
    """The axisymmetric shell does not know it."""
    found = refine(case("no-belts", "model.scheme=cell"), 0.05)
    assert not made_up.of("axisymmetric")
    assert {of.model.scheme for of, _ in made_up.of("full")} == {"cell"}
    assert found.summary.ensemble is not None
    assert found.case.model.scheme == "cell"


@pytest.mark.parametrize("out", [None, not_round])
def test_belts_keep_off_the_covers_on_every_grid(out: Callable[[Case, int], float] | None, made_up: MadeUp) -> None:
    made_up.out = out or made_up.out
    many = case("paper", "belts.count=60", "grid.generatrix=90", "belts.width=2 mm")
    refine(many, 0.2)
    assert least_cells(many) > 30
    assert min(of.grid.generatrix for of, _ in made_up.done) == least_cells(many)
    made_up.done.clear()
    refine(case("paper", "belts=[{height: 8 mm, width: 2 mm, layers: 5}]", "grid.generatrix=60"), 0.2)
    assert min(of.grid.generatrix for of, _ in made_up.done) == 43  # 0.3 m/7 mm


# Budgets


def spent(made_up: MadeUp, budget: float) -> float:
    made_up.now = 0.0
    refine(case(), 1e-4, budget)
    return made_up.now


@pytest.mark.parametrize("out", [None, not_round])
def test_budget_is_kept(out: Callable[[Case, int], float] | None, made_up: MadeUp) -> None:
    """But for what any answer takes: one run of the axisymmetric shell, two full ones on the coarsest grid, their twins."""
    made_up.out = out or made_up.out
    made_up.energy = lambda of, seed: scattered(of, seed) + 0.3 * (of.grid.generatrix % 3)
    cost = {"lumped": 1e-3, "axisymmetric": 1e-7, "full": 1e-5}
    made_up.seconds = lambda of: cost[of.model.fidelity] * of.grid.generatrix ** (3 if of.model.fidelity != "lumped" else 0)
    least = spent(made_up, 0.0)
    assert least < 1.0
    for budget in (1.0, 4.0, 16.0, 64.0):
        assert spent(made_up, budget) <= budget + least
    assert spent(made_up, 64.0) > 2.0


@pytest.mark.parametrize(("budget", "runs", "members"), [(12.0, 1, 1), (25.0, 2, 1), (35.0, 3, 2), (45.0, 4, 3)])
def test_member_beyond_the_budget_is_not_begun(budget: float, runs: int, members: int, made_up: MadeUp) -> None:
    """Full shells of 10 s each, one of them on the coarser grid; one alone on the grid of the answer is no claim.

    The coarser one would take (9/12)^3.5 of the 10 s at least, and so more than the 2 s that 12 s leave.
    """
    made_up.out, made_up.energy = not_round, scattered
    made_up.seconds = lambda of: 10.0 if of.model.fidelity == "full" else 1e-3
    summary = refine(case(), 0.001, budget).summary
    assert len(made_up.of("full")) == runs
    assert summary.ensemble is not None and summary.ensemble.members == members
    assert (summary.impact_velocity_error is None) == (members == 1)


def test_shells_that_stop_are_said_to_stop(made_up: MadeUp) -> None:
    """One that a budget leaves alone is no claim of a speed of 0."""
    made_up.out, made_up.energy = not_round, lambda of, seed: -9.0
    made_up.seconds = lambda of: 10.0 if of.model.fidelity == "full" else 1e-3
    done = CliRunner().invoke(app, ["run", str(NO_BELTS), "--set", SOLID, "--no-results", "--tolerance", "5%", "--budget", "12"])
    assert done.exit_code == 1
    assert "the one nearest the mean, which stops; the budget allows no more of them" in done.stderr
    assert re.search(r"^full 29 x 80: stops, error –, 10.00 s: not round", done.stderr, re.MULTILINE)
    assert re.search(r"^full +29 x 80 +stops +– +10.00 not round", done.stdout, re.MULTILINE)
    assert "All trials took 10 s of CPU." in done.stdout
    assert "0.0000" not in done.stderr


def test_budget_is_of_processor_time(made_up: MadeUp, monkeypatch: pytest.MonkeyPatch) -> None:
    """What else a machine does changes no trial: an hour passes on the clock of the wall at each look at it."""
    if sys.platform != "win32":
        assert drop.CLOCK is time.thread_time
    made_up.out, made_up.energy = not_round, scattered
    calm = refine(case(), 0.02).summary
    hours = iter(range(10**6))
    monkeypatch.setattr(error_control, "time", SimpleNamespace(perf_counter=lambda: 3600.0 * next(hours)))
    busy = refine(case(), 0.02).summary
    assert busy.wall_seconds >= 3600.0
    for trial, other in zip(busy.trials, calm.trials, strict=True):
        assert replace(trial, seconds=0.0) == replace(other, seconds=0.0)
        assert trial.seconds == pytest.approx(other.seconds)
    assert replace(busy, wall_seconds=0.0, trials=[]) == replace(calm, wall_seconds=0.0, trials=[])


def test_rungs_are_told_as_they_are_done(made_up: MadeUp) -> None:
    made_up.out, made_up.energy = not_round, scattered
    told: list[tuple[Trial, int]] = []
    summary = refine(case(), 0.02, report=lambda trial: told.append((trial, len(made_up.done)))).summary
    assert [trial for trial, _ in told] == summary.trials
    assert [trial.fidelity for trial, _ in told][:4] == ["lumped", "axisymmetric", "axisymmetric", "full"]
    assert told[0][1] == 0 and [runs for _, runs in told] == sorted({runs for _, runs in told})
    assert sum(trial.seconds for trial in summary.trials) <= made_up.now


@pytest.mark.parametrize("out", [None, not_round])
def test_without_budget_nothing_is_called_converged(out: Callable[[Case, int], float] | None, made_up: MadeUp) -> None:
    made_up.out = out or made_up.out
    made_up.energy = lambda of, seed: 9.0 + 10.0 / in_radius(of) + 0.5 * (seed % 2)
    summary = refine(case(), 0.001, budget=0.0).summary
    assert summary.impact_velocity is not None
    assert not reached(replace(case(), tolerance=0.001, insists=True), summary)
    assert not any(trial.verdict.endswith((", within the tolerance", "grids beside it agree")) for trial in summary.trials)
    assert all(trial.error is None for trial in summary.trials)
    assert summary.impact_velocity_error is None
    if out is None:
        assert "1 grids are no error bar" in str(summary.fidelity_reason)
        assert "whether it stays round takes more full shells than the budget allows" in str(summary.fidelity_reason)
    else:
        assert str(summary.fidelity_reason).endswith("the budget allows no more of them")
        assert summary.ensemble is not None and summary.ensemble.members == 1
    assert not any("inf" in text for text in (str(summary.fidelity_reason), *(trial.verdict for trial in summary.trials)))


# Runs that fail, and runs that are stopped


def test_run_cut_off_by_the_end_of_time_is_no_answer() -> None:
    """All grids agree on 0 m/s there."""
    short = case("no-belts", "time.end=0.05", "tolerance=1%")
    summary = softbrake.run(short)
    assert not reached(short, summary)
    assert summary.impact_velocity is None and summary.impact_velocity_error is None
    assert summary.outcome == "time_limit"
    assert "raise time.end" in str(summary.fidelity_reason)
    barred = softbrake.run(case("no-belts", "time.end=0.05", "model.fidelity=axisymmetric"), with_error_bar=True)
    assert barred.impact_velocity_error is None
    assert "raise time.end" in str(barred.fidelity_reason)


@pytest.mark.parametrize("level_of", ["axisymmetric", "full"])
def test_level_that_is_cut_off_is_no_answer(level_of: str, made_up: MadeUp) -> None:
    made_up.fate = lambda of, seed: "time_limit" if of.model.fidelity == level_of else ""
    summary = refine(case(), 0.05).summary
    assert (summary.outcome, summary.impact_velocity, summary.impact_velocity_error) == ("time_limit", None, None)
    assert summary.trials[-1].verdict == "cut off by time.end"
    assert "raise time.end" in str(summary.fidelity_reason)


def test_shell_that_diverges_on_every_grid_says_why() -> None:
    trials: list[Trial] = []
    with pytest.raises(Diverged, match="the fabric bursts"):
        refine(case("no-belts", "fabric.E=1 kN/m"), 0.05, budget=0.0, report=trials.append)
    assert [trial.fidelity for trial in trials] == ["lumped", "axisymmetric"]
    assert trials[1].verdict.startswith("diverged: ") and trials[1].seconds > 0.0


@pytest.mark.parametrize("fidelity", ["axisymmetric", "full"])
def test_level_that_diverges_everywhere(fidelity: str, made_up: MadeUp) -> None:
    made_up.fate = lambda of, seed: "diverged" if of.model.fidelity == fidelity else ""
    if fidelity == "axisymmetric":
        with pytest.raises(Diverged):
            refine(case(), 0.05)
        return
    with pytest.raises(Diverged):
        refine(case("no-belts", "model.scheme=cell"), 0.05)
    alone = refine(case(), 0.05).summary
    assert alone.impact_velocity == pytest.approx(3.0)
    assert alone.impact_velocity_error is None
    assert "no full shell reaches its end" in str(alone.fidelity_reason)
    assert [trial.verdict for trial in alone.trials if trial.fidelity == "full"] == ["diverged: diverged at 0.01 s"] * 2


def test_finer_grid_that_diverges_is_no_claim(made_up: MadeUp) -> None:
    """Of the axisymmetric shell, where it is the twin of a full one as well."""
    made_up.fate = lambda of, seed: "diverged" if of.model.fidelity == "axisymmetric" and in_radius(of) > 14 else ""
    summary = refine(case(), 0.05).summary
    assert summary.impact_velocity == pytest.approx(3.0)
    assert summary.impact_velocity_error is None


def test_finer_full_shell_that_diverges_is_no_claim(made_up: MadeUp) -> None:
    """It is to show whether the shell stays round."""
    made_up.fate = lambda of, seed: "diverged" if of.model.fidelity == "full" and in_radius(of) > 14 else ""
    summary = refine(case(), 0.05).summary
    assert summary.impact_velocity == pytest.approx(3.0)
    assert summary.impact_velocity_error is None
    assert str(summary.fidelity_reason).endswith("; a finer full shell diverges")
    assert [trial.generatrix for trial in summary.trials if trial.verdict.startswith("diverged")] == [44]


@pytest.mark.parametrize(("lost", "last"), [(22, 108), (26, 130), (32, 156), (38, 188)])
def test_climb_goes_on_after_a_grid_that_diverges(lost: int, last: int, made_up: MadeUp) -> None:
    """With as many grids beside one another as ever, none of them coarser than the one that diverged."""
    made_up.energy = lambda of, seed: 9.0 + 1.0 / in_radius(of) ** 2
    made_up.fate = lambda of, seed: "diverged" if of.model.fidelity == "axisymmetric" and of.grid.generatrix == lost else ""
    found = refine(case(), 0.05)
    assert (found.case.model.fidelity, found.case.grid.generatrix) == ("axisymmetric", last)
    assert reached(replace(case(), tolerance=0.05, insists=True), found.summary)
    energy = made_up.energy(found.case, 0)
    assert bar(found.summary) == pytest.approx(speed_range(energy, NEIGHBOURLY * (energy - 9.0))[1], rel=1e-6)
    assert [trial.generatrix for trial in found.summary.trials if trial.verdict.startswith("diverged")] == [lost]


def test_members_that_diverge_are_left_out(made_up: MadeUp) -> None:
    made_up.out, made_up.energy = not_round, scattered
    made_up.fate = lambda of, seed: "diverged" if seed == 2 else ""
    found = refine(case(), 0.03)
    assert found.summary.ensemble is not None
    fallen = [seed for of, seed in made_up.of("full") if of.grid == found.case.grid and seed != 2]
    assert found.summary.ensemble.members == len(fallen) >= LEAST_MEMBERS


def test_companion_that_diverges_costs_the_error_bar_only(monkeypatch: pytest.MonkeyPatch) -> None:
    of = level(case(), "axisymmetric", 36, 90)
    lost = Diverged("diverged", softbrake.run(of))

    def diverging(of: Case, seed: int = 0) -> tuple[Summary, float]:
        raise lost

    monkeypatch.setattr(error_control, "probe", diverging)
    summary = softbrake.run(of, with_error_bar=True)
    assert summary.impact_velocity == lost.summary.impact_velocity
    assert summary.impact_velocity_error is None
    assert summary.fidelity_reason == "no error bar: a coarser grid diverges"


@pytest.mark.parametrize("out", [None, not_round])
def test_interrupted_climb_gives_the_best_answer_so_far(out: Callable[[Case, int], float] | None, made_up: MadeUp) -> None:
    """At each of its runs; nothing before the first is done. A shell that is known not to stay round has no bar of round ones."""
    made_up.out, made_up.energy = out or made_up.out, scattered if out else made_up.energy
    refine(case(), 0.03)
    runs = len(made_up.done)
    for last in range(runs):
        made_up.done.clear()
        made_up.fate = lambda of, seed, last=last: "interrupted" if len(made_up.done) == last else ""  # type: ignore[misc]
        if last == 0:
            with pytest.raises(KeyboardInterrupt) as caught:
                refine(case(), 0.03)
            assert not isinstance(caught.value, Interrupted)
            continue
        with pytest.raises(Interrupted):
            refine(case(), 0.03)
        made_up.done.clear()
        summary = softbrake.run(replace(case(), tolerance=0.03))
        assert (summary.outcome, summary.impact_velocity) == ("interrupted", pytest.approx(3.1, abs=0.15))
        assert "interrupted; the best answer so far" in str(summary.fidelity_reason)
        if out is not None and made_up.of("full"):
            assert speed_of(summary) + bar(summary) > 3.15


# Result files


@pytest.fixture
def member() -> Refined:
    """A refinement that ended at the third member of an ensemble of small full shells."""
    small = level(case("paper"), "full", 12, 24)
    fallen = Simulation(small)
    fallen.disturb(disturbance(small, 3), 3)
    return Refined(small, replace(fallen.to_end(), impact_velocity=3.21, fidelity_reason="as found"), 3)


def test_result_file_holds_the_disturbed_drop(member: Refined, tmp_path: Path) -> None:
    kept = error_control._write(member, tmp_path / "a.vtkhdf", None)
    assert kept.impact_velocity == 3.21
    assert read_history(tmp_path / "a.vtkhdf")["time"][-1] == pytest.approx(kept.impact_time, rel=1e-12)
    assert softbrake.run(member.case).impact_time != pytest.approx(kept.impact_time, rel=1e-6)


def test_result_file_gives_back_the_ensemble(member: Refined, tmp_path: Path) -> None:
    several = replace(member.summary, ensemble=Ensemble(4, 3.1, 3.3, 1e-6, 1e-3), peak_errors={"peak_deceleration": 1.0})
    kept = error_control._write(replace(member, summary=several), tmp_path / "a.vtkhdf", None)
    assert kept.ensemble == several.ensemble
    assert read_summary(tmp_path / "a.vtkhdf") == kept


def test_answer_survives_a_result_file_that_diverges(member: Refined, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def lost(*_: object) -> Summary:
        raise Diverged("diverged", replace(member.summary, outcome="diverged", results="a.vtkhdf"))

    monkeypatch.setattr(drop.Simulation, "to_end", lost)
    kept = error_control._write(member, tmp_path / "a.vtkhdf", None)
    assert (kept.impact_velocity, kept.outcome, kept.results) == (3.21, "impact", "a.vtkhdf")
    assert str(kept.fidelity_reason).endswith("the run that was to fill the result file diverged")


def test_interrupt_while_the_result_file_is_written_is_told(
    member: Refined, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(drop.Simulation, "to_end", lambda *_: replace(member.summary, outcome="interrupted"))
    assert error_control._write(member, tmp_path / "a.vtkhdf", None).outcome == "interrupted"


# Drops as they are


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [0.05, 0.005])
def test_round_shell_is_answered_by_the_axisymmetric_one(tolerance: float) -> None:
    """Within its error bar of a far finer grid, for the tolerance asked, and no finer than that needs."""
    found = refine(case(), tolerance)
    summary = found.summary
    assert found.case.model.fidelity == "axisymmetric"
    assert abs(speed_of(summary) - fine(case())) <= bar(summary) <= tolerance * speed_of(summary)
    assert [trial.fidelity for trial in summary.trials][:2] == ["lumped", "axisymmetric"]
    assert {trial.verdict.split(":")[0] for trial in summary.trials if trial.fidelity == "full"} == {"round"}
    if tolerance == 0.05:
        assert found.case.grid.generatrix == 90  # twice 45, the fifth of the coarsest grids


@pytest.mark.slow
def test_slack_fabric_that_crumples_is_answered_by_full_shells_and_kept(tmp_path: Path) -> None:
    """Free fall: it does not stay round, and weighs nearly nothing. The file holds the member nearest the mean."""
    falling = case("free-fall", "tolerance=1%")
    summary = softbrake.run(falling, tmp_path / "a.vtkhdf")
    assert reached(falling, summary)
    assert abs(speed_of(summary) - 6.91144) <= bar(summary) <= 0.01 * 6.91144
    assert summary.ensemble is not None and summary.ensemble.members >= LEAST_MEMBERS
    assert summary.ensemble.least <= speed_of(summary) <= summary.ensemble.most
    kept, history = read_summary(tmp_path / "a.vtkhdf"), read_history(tmp_path / "a.vtkhdf")
    assert kept is not None
    assert (kept.impact_velocity, kept.trials) == (summary.impact_velocity, summary.trials)
    assert summary.ensemble.least - 1e-9 <= -history["velocity"][-1] <= summary.ensemble.most + 1e-9
    assert f"{-history['velocity'][-1]:.4g} m/s" in str(summary.fidelity_reason)


@pytest.mark.slow
def test_hoops_in_compression_are_for_the_full_shell_where_they_buckle() -> None:
    """Without contact of the cover the axisymmetric shell, which cannot buckle, answers less than the full one."""
    buckling = case("no-belts", "fabric.law=nominal_tension", "fabric.slack=compression", "contact=paper")
    found = refine(buckling, 0.5, budget=0.0)
    assert found.case.model.fidelity == "full"
    assert any("not round" in trial.verdict for trial in found.summary.trials)
    assert speed_of(found.summary) > 1.1 * fine(buckling, 36)


def test_contact_has_one_default_where_the_level_is_chosen() -> None:
    file = CONFIGS / "free-fall.yaml"
    changes = (["tolerance=1%"], ["model.fidelity=auto"], ["model.fidelity=axisymmetric", "tolerance=1%"])
    assert {softbrake.load_case(file, change).contact for change in changes} == {("ground", "cover", "cargo")}


def test_climb_takes_the_courant_number_that_the_damping_allows() -> None:
    assert level(case(), "axisymmetric", 36, 720).time.courant == 0.95
    assert level(case("no-belts", "fabric.viscosity=0"), "axisymmetric", 36, 720).time.courant == 0.35


@pytest.mark.slow
@pytest.mark.parametrize(
    "grid",
    [
        ("grid={generatrix: 36, hoop: 60}",),
        ("grid={generatrix: 54, hoop: 90}", "model.fidelity=axisymmetric"),
    ],
)
def test_error_bar_holds(grid: tuple[str, ...]) -> None:
    of = case("no-belts", *grid)
    summary = softbrake.run(of, with_error_bar=True)
    assert abs(speed_of(summary) - fine(of)) < bar(summary) < 0.05 * speed_of(summary)
    assert str(summary.fidelity_reason).startswith("four grids beside one another, ")
    assert summary.peak_errors is not None and summary.peak_errors.keys() >= {"peak_deceleration", "peak_tension_hoop"}


# The command


@pytest.mark.slow
def test_command_prints_and_keeps_what_was_tried(softbrake: Command, tmp_path: Path) -> None:
    ran = softbrake("run", NO_BELTS, "--set", SOLID, "--tolerance", "2%", "--json")
    assert ran.returncode == 0, ran.stderr
    answer = json.loads(ran.stdout)
    assert answer["impact_velocity_error"] <= 0.02 * answer["impact_velocity"]
    assert answer["trials"][0]["fidelity"] == "lumped"
    assert answer["fidelity_reason"] and answer["ensemble"] is None
    assert answer["peak_errors"].keys() == {"peak_deceleration", "peak_tension_generatrix", "peak_tension_hoop"}
    assert "full 29 x 80" in ran.stderr
    kept = read_summary(tmp_path / "no-belts.vtkhdf")
    assert kept is not None
    assert kept.impact_velocity == answer["impact_velocity"]
    assert len(kept.trials) == len(answer["trials"])
    shown = softbrake("info", "no-belts.vtkhdf")
    assert "axisymmetric" in shown.stdout and "±" in shown.stdout


def invoke(*arguments: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a run of this process, without a result file."""
    done = CliRunner().invoke(app, ["run", str(NO_BELTS), "--set", SOLID, "--no-results", "-q", *arguments])
    return done.exit_code, done.stdout, done.stderr


def test_command_prints_an_ensemble(made_up: MadeUp) -> None:
    made_up.out, made_up.energy = not_round, scattered
    code, out, _ = invoke("--tolerance", "3%", "--json")
    answer = json.loads(out)
    assert code == 0
    assert answer["ensemble"].keys() == {"members", "least", "most", "smallest", "largest"}
    assert answer["ensemble"]["least"] < answer["impact_velocity"] < answer["ensemble"]["most"]
    assert answer["impact_velocity_error"] > 0.0
    code, out, _ = invoke("--tolerance", "3%")
    assert code == 0 and "±" in out and "shells" in out


def test_command_fails_where_the_tolerance_is_not_reached(made_up: MadeUp) -> None:
    """One that is asked for; without one, the answer is as good as it is."""
    made_up.energy = lambda of, seed: 9.0 + 10.0 / in_radius(of)
    made_up.seconds = lambda of: 0.05 if of.model.fidelity == "full" else 1e-6 * of.grid.generatrix**2
    code, out, err = invoke("--tolerance", "0.01%", "--budget", "1")
    assert code == 1
    assert "the tolerance of 0.0001 was not reached: " in err
    assert "impact velocity" in out and "±" in out
    calm = made_up.base
    made_up.base = replace(calm, doubt="energy of nothing")
    code, _, err = invoke("--tolerance", "0.01%", "--budget", "1")
    assert code == 1
    assert "energy of nothing; " in err and "the tolerance of 0.0001 was not reached: " in err
    made_up.base = calm
    code, _, err = invoke("--set", "model.fidelity=auto", "--budget", "0")
    assert (code, "was not reached" in err) == (0, False)


def test_command_that_is_interrupted_prints_what_it_has(made_up: MadeUp) -> None:
    made_up.fate = lambda of, seed: "interrupted" if of.model.fidelity == "full" else ""
    code, out, _ = invoke("--tolerance", "1%", "--json")
    assert code == 130
    assert json.loads(out)["outcome"] == "interrupted"
    made_up.fate = lambda of, seed: "interrupted"
    code, out, err = invoke("--tolerance", "1%", "--json")
    assert (code, out, err.strip().splitlines()[-1]) == (130, "", "interrupted")


def test_command_that_diverges(made_up: MadeUp) -> None:
    made_up.fate = lambda of, seed: "diverged"
    code, _, err = invoke("--tolerance", "1%")
    assert (code, err.strip().splitlines()[-1]) == (1, "diverged at 0.01 s")


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (("--tolerance", "2"), "--tolerance 2: tolerance: 2 is out of range"),
        (("--tolerance", "small"), "--tolerance small: tolerance: 'small' is not a number with a unit"),
        (("--tolerance", "1%", "--error-bar"), "--error-bar: a run for a tolerance has one already"),
        (("--error-bar", "--set", "grid.hoop=9"), "too coarse for an error bar"),
        (("--error-bar", "--set", "model.fidelity=lumped"), "a lumped run has no grid, and so no error bar of one"),
    ],
)
def test_bad_input(arguments: tuple[str, ...], fault: str) -> None:
    code, _, err = invoke(*arguments)
    assert code == 2
    assert fault in err
