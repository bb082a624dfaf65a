"""The choice of level and grid for a tolerance: errors that are kept, levels left on evidence, limits said."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import softbrake
from softbrake.case import Case
from softbrake.ladder import allowed, climb, level, reached, speed_of
from softbrake.results import read_summary

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


def test_shell_that_loses_its_symmetry_is_answered_by_the_full_one() -> None:
    """A fast, hence short drop."""
    fast = case("paper", "contact=ground", "cargo.velocity=20", "tolerance=0.1")
    found = climb(fast, 0.1)
    summary = found.summary
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
    error = found.summary.impact_velocity_error
    assert error is None or abs(speed_of(found.summary) - fine(small)) <= error
    assert not reached(replace(small, tolerance=0.01), found.summary)


def test_without_budget_nothing_is_called_converged() -> None:
    found = climb(case("paper"), 0.001, budget=0.0)
    summary = found.summary
    assert not reached(softbrake.load_case(CONFIGS / "paper.yaml", ["tolerance=0.001"]), summary)
    assert not any(rung.verdict == "within the tolerance" for rung in summary.ladder)
    assert "tolerance" in str(summary.fidelity_reason) or "does not determine" in str(summary.fidelity_reason)


def test_cargo_that_stops_has_a_tolerance_too() -> None:
    """Of the free-fall velocity, since the impact velocity is none."""
    summary = climb(case("no-belts", "pressure.value=30 kPa", "cargo.velocity=4"), 0.01).summary
    assert summary.impact_velocity is None
    assert summary.outcome == "stopped"
    assert summary.impact_velocity_error == pytest.approx(0.0, abs=allowed(0.01, 0.0, summary.free_fall_velocity))


def test_belts_keep_off_the_covers_on_every_grid() -> None:
    many = case("paper", "belts.count=30", "grid.generatrix=90", "belts.width=2 mm")
    summary = climb(many, 0.2, budget=2.0).summary
    assert all(rung.generatrix >= 18 for rung in summary.ladder)
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
