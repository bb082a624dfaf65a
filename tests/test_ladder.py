"""The choice of level and grid for a tolerance: errors that are kept, levels left on evidence, limits said."""

import json
import math
import os
import statistics
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

import softbrake
from softbrake import drop, ladder
from softbrake.case import Case, level
from softbrake.drop import Diverged, Drop
from softbrake.ladder import Climb, Interrupted, allowed, climb, disturbance, least_cells, reached, speed_of
from softbrake.results import read_history, read_summary
from softbrake.summary import Summary

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
SOLID = "contact=[ground, cover, cargo]"
SMALL = (
    "shell={diameter: 0.3, height: 0.3}",
    "cargo={mass: 10, velocity: 4}",
    "pressure.value=3600",
    "fabric.viscosity=0.05",
    "fabric.E=8 kN/m",
)


def case(name: str = "no-belts", *overrides: str) -> Case:
    return softbrake.load_case(CONFIGS / f"{name}.yaml", [SOLID, *overrides])


def fine(of: Case, cells: int = 288) -> float:
    """Impact velocity (m/s) of the axisymmetric shell on a grid beyond those of a climb."""
    return speed_of(softbrake.run(level(of, "axisymmetric", cells, 10_000)))


@pytest.mark.parametrize("tolerance", [0.05, 0.01, 0.005])
def test_round_shell_is_answered_by_the_axisymmetric_one(tolerance: float) -> None:
    """Within its error bar of a far finer grid, for the tolerance asked, and no finer than that needs."""
    found = climb(case(), tolerance)
    summary = found.summary
    assert found.case.model.fidelity == "axisymmetric"
    assert summary.impact_velocity is not None and summary.impact_velocity_error is not None
    assert summary.impact_velocity_error <= tolerance * summary.impact_velocity
    assert abs(summary.impact_velocity - fine(case())) <= summary.impact_velocity_error
    assert [rung.fidelity for rung in summary.ladder][:3] == ["lumped", "full", "axisymmetric"]
    assert "round: " in summary.ladder[1].verdict
    if tolerance == 0.05:
        assert found.case.grid.generatrix <= 72


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Case, int, Summary]]:
    """Case, seed and answer of the runs of a climb, as they are done."""
    done: list[tuple[Case, int, Summary]] = []
    timed = ladder._timed

    def watched(case: Case, seed: int = 0) -> tuple[Summary, float]:
        summary, seconds = timed(case, seed)
        done.append((case, seed, summary))
        return summary, seconds

    monkeypatch.setattr(ladder, "_timed", watched)
    return done


def test_shell_that_loses_its_symmetry_is_answered_by_the_full_one(
    runs: list[tuple[Case, int, Summary]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fast, hence short drop; velocity and peaks are means of four, which the axisymmetric shell is kept from answering."""
    monkeypatch.setattr(ladder, "PART_UNMOVED", 0.0)
    fast = case("paper", "contact=ground", "cargo.velocity=20", "tolerance=0.1")
    found = climb(fast, 0.1)
    summary = found.summary
    members = [(seed, one) for of, seed, one in runs if of.model.fidelity == "full" and of.grid == found.case.grid]
    assert [seed for seed, _ in members] == [1, 2, 3, 4]
    for name in ("impact_velocity", "peak_deceleration", "peak_tension_hoop", "peak_tension_belt"):
        assert getattr(summary, name) == pytest.approx(statistics.mean(getattr(one, name) for _, one in members))
    assert summary.peaks["peak_tension_hoop"].value == summary.peak_tension_hoop
    nearest = min(members, key=lambda member: abs(speed_of(member[1]) - speed_of(summary)))
    assert found.seed == nearest[0]
    assert summary.impact_time == nearest[1].impact_time
    assert found.case.model.fidelity == "full"
    assert "not round" in summary.ladder[1].verdict
    assert "does not stay round" in str(summary.fidelity_reason)
    assert reached(fast, summary)
    assert [rung.generatrix for rung in summary.ladder if "three grids" in rung.verdict and rung.fidelity == "full"] == [24, 36]


def test_shell_that_is_round_on_a_coarse_grid_only_is_asked_on_a_finer_one() -> None:
    """Two unlike belts, light cargo: 36 x 72 cells stay round, 72 x 144 do not."""
    belts = "belts=[{height: 0.15, width: 8 mm, layers: 3}, {height: 0.4, width: 4 mm, layers: 6}]"
    light = case("paper", belts, "cargo.mass=60", "pressure={law: constant, value: 9500, damping: 0.0003}")
    in_doubt = climb(light, 0.2, budget=1.0).summary
    assert in_doubt.ladder[1].verdict.startswith("round: ")
    assert "takes a finer grid than the budget allows" in str(in_doubt.fidelity_reason)
    found = climb(light, 0.2, budget=120.0)
    coarse, finer = found.summary.ladder[1:3]
    assert (coarse.generatrix, finer.generatrix) == (36, 72)
    assert coarse.verdict.startswith("round: ")
    assert finer.verdict.startswith("not round: ")
    assert found.case.model.fidelity == "full"


def test_hoops_in_compression_are_for_the_full_shell_where_they_buckle() -> None:
    """Without contact of the cover the axisymmetric shell, which cannot buckle, answers 3.2 m/s and the full one 3.8 m/s."""
    buckling = case("no-belts", "fabric.slack=compression", "contact=paper")
    found = climb(buckling, 0.5, budget=5.0)
    assert found.case.model.fidelity == "full"
    assert "not round" in found.summary.ladder[1].verdict
    assert speed_of(found.summary) > 1.1 * fine(buckling, 36)
    assert climb(case("no-belts", "fabric.slack=compression"), 0.05).case.model.fidelity == "axisymmetric"


def test_two_grids_that_agree_are_no_error_bar() -> None:
    """A small shell of little viscosity: 2.65 m/s on full grids of 24 and 36 cells, 2.51 m/s where the grid resolves it."""
    small = case("no-belts", *SMALL)
    found = climb(small, 0.01, budget=4.0)
    ensembles = [rung for rung in found.summary.ladder[2:] if rung.fidelity == "full" and rung.impact_velocity is not None]
    assert [(rung.generatrix, rung.error) for rung in ensembles[:2]] == [(24, None), (36, None)]
    assert all(rung.error is not None and abs(speed_of(found.summary) - fine(small)) <= rung.error for rung in ensembles[2:])
    assert not reached(replace(small, tolerance=0.01), found.summary)


def test_without_budget_nothing_is_called_converged() -> None:
    found = climb(case("paper"), 0.001, budget=0.0)
    summary = found.summary
    assert not reached(softbrake.load_case(CONFIGS / "paper.yaml", ["tolerance=0.001"]), summary)
    assert not any(rung.verdict == "within the tolerance" for rung in summary.ladder)
    assert "the budget does not reach the tolerance" in str(summary.fidelity_reason)
    assert summary.impact_velocity_error is None  # of less than three grids


def test_one_grid_is_no_claim() -> None:
    """A round shell: shells on grids about the coarsest agree, and are wrong alike."""
    found = climb(case(), 0.025, budget=0.0)
    assert [rung.verdict for rung in found.summary.ladder][2:] == ["three grids are wanted for an error"]
    assert found.summary.impact_velocity_error is None
    assert str(found.summary.fidelity_reason) == "the full shell stays round; the budget does not reach the tolerance"


def test_mean_of_an_ensemble_is_no_better_than_its_distance_from_the_finest_grid() -> None:
    climber = ladder._Climber(case(), 0.05, 10.0, None)
    at = level(case(), "axisymmetric", 36, ladder.ROUND)
    summary = softbrake.run(at)
    climber.book(at, speed_of(summary), None, 1e-3, "")
    near = climber.spread(ladder._Found(at, summary, speed_of(summary), math.inf, grids=3))
    far = climber.spread(ladder._Found(at, summary, speed_of(summary) + 1.0, math.inf, grids=3))
    assert far.value == near.value
    assert far.error - near.error > 0.9


def test_shell_out_of_round_is_answered_by_the_axisymmetric_one_where_that_is_no_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    """Free fall: slack fabric crumples, and weighs nearly nothing."""
    monkeypatch.setattr(ladder, "PROBE", 18)
    found = climb(case("free-fall"), 0.01)
    summary = found.summary
    assert found.case.model.fidelity == "axisymmetric"
    assert [rung.generatrix for rung in summary.ladder if rung.fidelity == "full"] == [18, 18, 18, 18, 36]
    moves = [abs(rung.impact_velocity - 6.91144) for rung in summary.ladder[1:6] if rung.impact_velocity is not None]
    assert summary.impact_velocity_error is not None
    assert 0.9 * max(moves) < summary.impact_velocity_error < 0.005 * 6.9
    assert str(summary.fidelity_reason).startswith("the full shell does not stay round, but that moves the answer by")


def test_round_shell_that_is_moved_by_more_than_the_tolerance_is_not_called_out_of_round() -> None:
    summary = climb(case(), 1e-5, budget=0.0).summary
    assert summary.ladder[1].verdict.startswith("touchy: ")
    assert str(summary.fidelity_reason).startswith("the shell stays round, but what sewing leaves moves its answer")
    assert not any("inf" in str(text) for text in (summary.fidelity_reason, *(rung.verdict for rung in summary.ladder)))


def test_run_cut_off_by_the_end_of_time_is_no_answer() -> None:
    """Three grids agree on 0 m/s there."""
    short = case("no-belts", "time.end=0.05", "tolerance=1%")
    summary = softbrake.run(short)
    assert not reached(short, summary)
    assert summary.impact_velocity is None and summary.impact_velocity_error is None
    assert summary.outcome == "time_limit"
    assert "raise time.end" in str(summary.fidelity_reason)
    barred = softbrake.run(case("no-belts", "time.end=0.05", "model.fidelity=axisymmetric"), with_error_bar=True)
    assert barred.impact_velocity_error is None
    assert "raise time.end" in str(barred.fidelity_reason)


def test_grids_that_do_not_agree_whether_the_cargo_stops_give_no_bar() -> None:
    """18 cells let it stop, or 36, as the pressure has it: an impact velocity of 0 is no value of the same sort."""
    summary = softbrake.run(level(case(), "axisymmetric", 18, 90))
    stopped = replace(summary, outcome="stopped", impact_velocity=None)
    assert ladder._estimate([summary, stopped, stopped], "impact_velocity").error == math.inf
    assert ladder._estimate([stopped, stopped, stopped], "impact_velocity").error == 0.0


def test_shell_that_diverges_on_every_grid_says_why_within_the_budget() -> None:
    rungs: list[softbrake.summary.Rung] = []
    with pytest.raises(Diverged, match="the fabric bursts"):
        climb(case("no-belts", "fabric.E=1 kN/m"), 0.05, budget=0.0, report=rungs.append)
    assert [(rung.fidelity, rung.generatrix) for rung in rungs if rung.fidelity == "full"] == [("full", 36), ("full", 24)]
    assert all(rung.seconds > 0.0 for rung in rungs)


def test_grid_beside_that_diverges_is_no_claim(monkeypatch: pytest.MonkeyPatch) -> None:
    timed = ladder._timed
    lost = Diverged("diverged", softbrake.run(level(case(), "lumped", 18, 90)))

    def watched(of: Case, seed: int = 0) -> tuple[Summary, float]:
        if of.grid.generatrix == round(0.85 * 72):
            raise lost
        return timed(of, seed)

    monkeypatch.setattr(ladder, "_timed", watched)
    rungs = climb(case(), 0.01, budget=20.0).summary.ladder
    assert next(rung for rung in rungs if rung.fidelity == "axisymmetric" and rung.generatrix == 72).verdict == "not settled"


def test_companion_that_diverges_costs_the_error_bar_only(monkeypatch: pytest.MonkeyPatch) -> None:
    of = level(case(), "axisymmetric", 36, 90)
    lost = Diverged("diverged", softbrake.run(of))

    def timed(of: Case, seed: int = 0) -> tuple[Summary, float]:
        raise lost

    monkeypatch.setattr(ladder, "_timed", timed)
    summary = softbrake.run(of, with_error_bar=True)
    assert summary.impact_velocity == lost.summary.impact_velocity
    assert summary.impact_velocity_error is None
    assert summary.fidelity_reason == "no error bar: a coarser grid diverges"


@pytest.fixture
def member() -> Climb:
    """A climb that ended at the third member of an ensemble of small full shells."""
    small = level(case("paper"), "full", 12, 24)
    fallen = Drop(small)
    fallen.disturb(disturbance(small, 3), 3)
    return Climb(small, replace(fallen.run(), impact_velocity=3.21, fidelity_reason="as found"), 3)


def test_result_file_holds_the_disturbed_drop(member: Climb, tmp_path: Path) -> None:
    kept = ladder._write(member, tmp_path / "a.vtkhdf", None)
    assert kept.impact_velocity == 3.21
    assert read_history(tmp_path / "a.vtkhdf")["time"][-1] == pytest.approx(kept.impact_time, rel=1e-12)
    assert softbrake.run(member.case).impact_time != pytest.approx(kept.impact_time, rel=1e-6)


def test_answer_survives_a_result_file_that_diverges(member: Climb, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def lost(*_: object) -> Summary:
        raise Diverged("diverged", replace(member.summary, outcome="diverged", results="a.vtkhdf"))

    monkeypatch.setattr(drop, "run", lost)
    kept = ladder._write(member, tmp_path / "a.vtkhdf", None)
    assert (kept.impact_velocity, kept.outcome, kept.results) == (3.21, "impact", "a.vtkhdf")
    assert str(kept.fidelity_reason).endswith("the run that was to fill the result file diverged")


def test_interrupt_is_told(member: Climb, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """While the result file is written, and during the climb, which then returns what it has."""
    with monkeypatch.context() as patched:
        patched.setattr(drop, "run", lambda *_: replace(member.summary, outcome="interrupted"))
        assert ladder._write(member, tmp_path / "a.vtkhdf", None).outcome == "interrupted"
    timed = ladder._timed

    def stopped(of: Case, seed: int = 0) -> tuple[Summary, float]:
        if of.model.fidelity == "axisymmetric" and of.grid.generatrix == 36 and of.grid.hoop == ladder.ROUND:
            raise KeyboardInterrupt
        return timed(of, seed)

    monkeypatch.setattr(ladder, "_timed", stopped)
    with pytest.raises(Interrupted):
        climb(case(), 0.01)
    summary = softbrake.run(replace(case(), tolerance=0.01))
    assert summary.outcome == "interrupted"
    assert summary.impact_velocity == pytest.approx(2.836, abs=1e-2)
    assert len(summary.ladder) == 3


def test_contact_has_one_default_where_the_level_is_chosen() -> None:
    file = CONFIGS / "free-fall.yaml"
    changes = (["tolerance=1%"], ["model.fidelity=auto"], ["model.fidelity=axisymmetric", "tolerance=1%"])
    assert {softbrake.load_case(file, change).contact for change in changes} == {("ground", "cover", "cargo")}


def test_climb_takes_the_courant_number_that_the_damping_allows() -> None:
    assert level(case(), "axisymmetric", 36, 720).time.courant == 0.95
    assert level(case("no-belts", "fabric.viscosity=0"), "axisymmetric", 36, 720).time.courant == 0.35


def test_wall_seconds_are_of_the_whole_climb() -> None:
    summary = climb(case(), 0.05).summary
    assert summary.wall_seconds >= sum(rung.seconds for rung in summary.ladder) - 1e-2


def test_kernel_of_a_large_grid_is_compiled_outside_the_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled: list[tuple[str, bool, bool]] = []

    def compile_slowly(wanted: set[tuple[str, bool, bool]]) -> None:
        compiled.extend(wanted)
        time.sleep(0.1)

    monkeypatch.setattr(ladder, "compile_kernels", compile_slowly)
    climber = ladder._Climber(case(), 0.01, 60.0, None)
    start = climber.start
    assert climber.whole(81).grid.hoop == 162
    assert (compiled, climber.start) == ([], start)
    assert climber.whole(122).grid.hoop == 244
    assert compiled == [("full", False, True)]
    assert climber.start >= start + 0.09


def test_cargo_that_stops_has_a_tolerance_too() -> None:
    """Of the free-fall velocity, since the impact velocity is none."""
    summary = climb(case("no-belts", "pressure.value=30 kPa", "cargo.velocity=4"), 0.01).summary
    assert summary.impact_velocity is None
    assert summary.outcome == "stopped"
    assert summary.impact_velocity_error == pytest.approx(0.0, abs=allowed(0.01, 0.0, summary.free_fall_velocity))


def test_belts_keep_off_the_covers_on_every_grid(runs: list[tuple[Case, int, Summary]]) -> None:
    many = case("paper", "belts.count=60", "grid.generatrix=90", "belts.width=2 mm")
    climb(many, 0.2, budget=2.0)
    assert least_cells(many) > 30
    assert min(of.grid.generatrix for of, _, _ in runs) == least_cells(many)
    narrow = case("paper", "belts=[{height: 8 mm, width: 2 mm, layers: 5}]", "grid.generatrix=60")
    assert min(rung.generatrix for rung in climb(narrow, 0.2, budget=2.0).summary.ladder) == 43  # 0.3 m/7 mm


@pytest.mark.parametrize("fidelity", [(), ("model.fidelity=axisymmetric",), ("model.fidelity=sector", "model.sector=9")])
def test_error_bar_holds(fidelity: tuple[str, ...]) -> None:
    of = case("no-belts", "grid.generatrix=54", "grid.hoop=90", *fidelity)
    summary = softbrake.run(of, with_error_bar=True)
    assert summary.impact_velocity is not None and summary.impact_velocity_error is not None
    assert abs(summary.impact_velocity - fine(of)) < summary.impact_velocity_error < 0.05 * summary.impact_velocity
    assert "grid convergence index" in str(summary.fidelity_reason)


def command(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"COLUMNS": "80", "PYTHONPATH": str(CONFIGS.parent)}
    return subprocess.run(
        [sys.executable, "-m", "softbrake", *arguments], capture_output=True, text=True, cwd=folder, env=environment, check=False
    )


def test_command_prints_and_keeps_what_was_tried(tmp_path: Path) -> None:
    ran = command("run", str(CONFIGS / "no-belts.yaml"), "--set", SOLID, "--tolerance", "1%", "--json", folder=tmp_path)
    assert ran.returncode == 0, ran.stderr
    answer = json.loads(ran.stdout)
    assert answer["impact_velocity_error"] <= 0.01 * answer["impact_velocity"]
    assert answer["ladder"][0]["fidelity"] == "lumped"
    assert answer["fidelity_reason"]
    assert "full 36 x 72" in ran.stderr
    kept = read_summary(tmp_path / "no-belts.vtkhdf")
    assert kept is not None
    assert kept.impact_velocity == answer["impact_velocity"]
    assert len(kept.ladder) == len(answer["ladder"])
    shown = command("info", "no-belts.vtkhdf", folder=tmp_path)
    assert "axisymmetric" in shown.stdout and "±" in shown.stdout


def test_command_fails_where_the_tolerance_is_not_reached(tmp_path: Path) -> None:
    ran = command(
        "run", str(CONFIGS / "paper.yaml"), "--tolerance", "0.01%", "--budget", "0", "--no-results", "-q", folder=tmp_path
    )
    assert ran.returncode == 1
    assert "was not reached" in ran.stderr
    assert "impact velocity" in ran.stdout and "±" in ran.stdout


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (("--tolerance", "2"), "--set tolerance=2: tolerance: 2 is out of range"),
        (("--tolerance", "small"), "--set tolerance=small: tolerance: 'small' is not a number with a unit"),
        (("--tolerance", "1%", "--error-bar"), "--error-bar: a run for a tolerance has one already"),
        (("--error-bar", "--set", "grid.hoop=9"), "too coarse for an error bar"),
    ],
)
def test_bad_input(arguments: tuple[str, ...], fault: str, tmp_path: Path) -> None:
    ran = command("run", str(CONFIGS / "no-belts.yaml"), *arguments, "-q", folder=tmp_path)
    assert ran.returncode == 2
    assert fault in ran.stderr
    assert not list(tmp_path.iterdir())
