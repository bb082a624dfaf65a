"""Sensitivities: exact for a piston, as wide as the noise asks, and the same in table, JSON and file."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, replace
from math import pi
from pathlib import Path

import numpy as np
import pytest
import synthetic_drop
from conftest import Command

import softbrake
from softbrake.case.case import Case
from softbrake.case.case_file import load_case, open_case
from softbrake.sim.result_file import read_summary
from softbrake.studies.batch import Dropped
from softbrake.studies.sensitivity import NARROW, SMALL, WIDTHS, sensitivities

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
NO_BELTS = CONFIGS / "no-belts.yaml"
LUMPED = "model.fidelity=lumped"


def test_piston() -> None:
    """v² = V² + 2 l1 (g - p F/m) and the largest deceleration p F/m - g, differentiated by hand."""
    base = softbrake.run(load_case(NO_BELTS, [LUMPED]))
    found = sensitivities(open_case(NO_BELTS, [LUMPED]), base)
    push = 15696.0 * pi * 0.25**2 / 100.0
    speed = base.impact_velocity
    expected = {  # of impact velocity and of deceleration
        "cargo.velocity": (36.0 / speed**2, 0.0),
        "pressure.value": (-0.6 * push / speed**2, push / (push - 9.80665)),
        "cargo.mass": (0.6 * push / speed**2, -push / (push - 9.80665)),
        "shell.height": (0.6 * (9.80665 - push) / speed**2, 0.0),
        "shell.diameter": (-2 * 0.6 * push / speed**2, 2 * push / (push - 9.80665)),
        "fabric.E11": (0.0, 0.0),
    }
    changes = {row.path: row.changes for row in found.inputs}
    assert changes.keys() >= expected.keys()
    for path, (velocity, deceleration) in expected.items():
        assert changes[path]["impact_velocity"] == pytest.approx(velocity, rel=0.01, abs=1e-9)
        assert changes[path]["peak_deceleration"] == pytest.approx(deceleration, rel=0.01, abs=1e-9)
    assert found.errors["impact_velocity"] < SMALL
    assert found.steps == {
        "impact_velocity": WIDTHS[1],
        "peak_deceleration": WIDTHS[1],
    }  # answers without tensions have no change
    assert [row.path for row in found.inputs][:2] == ["shell.diameter", "cargo.velocity"]  # the strongest first


@pytest.mark.parametrize("scatter", [1e-6, 0.003])
def test_steps_widen_until_they_stand_above_the_noise(monkeypatch: pytest.MonkeyPatch, scatter: float) -> None:
    """An answer of known power in one input, with noise of a known size."""
    random = np.random.default_rng(1)

    def noisy(cases: Iterable[Case]) -> Iterator[Dropped]:
        for case in cases:
            value = 3.0 * (case.cargo.mass / 100.0) ** 0.8 * (1 + scatter * random.normal())
            yield Dropped(replace(synthetic_drop.summary(), impact_velocity=value, peak_deceleration=20.0), None, None)

    monkeypatch.setattr("softbrake.studies.sensitivity.run_batch", noisy)
    base = replace(synthetic_drop.summary(), impact_velocity=3.0, peak_deceleration=20.0)
    found = sensitivities(open_case(NO_BELTS, []), base)
    noise, error = found.noise["impact_velocity"], found.errors["impact_velocity"]
    if scatter < 1e-5:
        assert found.steps["impact_velocity"] == WIDTHS[1]
        assert noise < 1e-4  # what is off a straight line
    else:
        assert found.steps["impact_velocity"] > WIDTHS[1]
        assert noise == pytest.approx(scatter, rel=0.3)
        assert error < SMALL
    changes = {row.path: row.changes["impact_velocity"] for row in found.inputs}
    assert changes.pop("cargo.mass") == pytest.approx(0.8, abs=max(3 * error, 1e-3))
    assert max(abs(change) for change in changes.values() if change is not None) < 4 * error


FULL_STOP = 100.0 * (9.80665 + 6.0**2 / 2 / 0.6) / (pi * 0.25**2)  # Pa, of the piston


@pytest.mark.parametrize("share", [0.98, 0.995])
def test_near_a_full_stop_slopes_are_as_exact_as_far_from_it(share: float) -> None:
    """V is a square root there; half a per cent below it, a little more pressure or diameter stops the cargo."""
    case = [LUMPED, f"pressure.value={share * FULL_STOP}"]
    base = softbrake.run(load_case(NO_BELTS, case))
    found = sensitivities(open_case(NO_BELTS, case), base)
    push = share * FULL_STOP * pi * 0.25**2 / 100.0
    speed, changes = base.impact_velocity, {row.path: row.changes["impact_velocity"] for row in found.inputs}
    assert [row.path for row in found.inputs][:2] == ["shell.diameter", "cargo.velocity"]
    for path, work in (("shell.diameter", -1.2 * push), ("cargo.velocity", 36.0), ("pressure.value", -0.6 * push)):
        left_of_curvature = 1e-4 * abs(work) / speed**2  # the square of the widest step
        assert abs(changes[path] - work / speed**2) < 3 * found.errors["impact_velocity"] + left_of_curvature
    assert found.errors["impact_velocity"] < 1e-3 * abs(changes["shell.diameter"])
    assert found.steps["impact_velocity"] == (WIDTHS[1] if share < 0.99 else NARROW[1])


@pytest.mark.slow
def test_inputs_that_lose_an_answer_come_first(softbrake: Command) -> None:
    """At 0.05 % below the full stop, the least step stops the cargo."""
    case = [LUMPED, f"pressure.value={0.9995 * FULL_STOP}"]
    done = softbrake(
        "run", NO_BELTS, *(word for change in case for word in ("--set", change)), "--sensitivity", "--no-results", "-q"
    )
    rows = done.stdout.partition("% per 1 % of")[2].splitlines()[1:]
    assert {row.split()[0] for row in rows[:5]} >= {"pressure.value", "shell.diameter", "cargo.mass", "cargo.velocity"}
    assert rows[0].split()[1] == "–" and rows[0].split()[2] != "–"  # which still has a deceleration
    assert "–: no answer at 0.2 % more or less" in done.stdout


def test_inputs_that_must_fit_each_other_are_named(tmp_path: Path) -> None:
    """With both Poisson's ratios in a file neither modulus can be varied alone; a ratio takes the other one with it."""
    case, file = [LUMPED], tmp_path / "both.yaml"
    file.write_text(NO_BELTS.read_text(encoding="utf-8").replace("nu12: 0.25", "nu12: 0.25\n  nu21: 0.25"), encoding="utf-8")
    found = sensitivities(open_case(file, case), softbrake.run(load_case(file, case)))
    assert found.left_out.keys() == {"fabric.E11", "fabric.E22"}
    assert "nu12*E11 = 5025 N/m is not nu21*E22 = 5000 N/m" in found.left_out["fabric.E11"]
    assert "cargo.mass" in {row.path for row in found.inputs}
    alone = [LUMPED]  # of nu12 and nu21 one, and the other follows
    assert not sensitivities(open_case(NO_BELTS, alone), softbrake.run(load_case(NO_BELTS, alone))).left_out


@pytest.mark.slow
def test_tolerance_varies_the_level_that_it_chose() -> None:
    case = ["tolerance=2%", "contact=[ground, cover, cargo]"]
    base = softbrake.run(load_case(NO_BELTS, case))
    assert base.model.fidelity == "axisymmetric"
    found = sensitivities(open_case(NO_BELTS, case), base)
    changes = {row.path: row.changes for row in found.inputs}
    assert changes["cargo.velocity"]["impact_velocity"] == pytest.approx(4.4, abs=0.3)


@pytest.mark.slow
def test_command(softbrake: Command, tmp_path: Path) -> None:
    done = softbrake("run", NO_BELTS, "--set", LUMPED, "--sensitivity", "--json", "-q", "-o", "drop.vtkhdf")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert {row["path"] for row in told["sensitivity"]["inputs"]} >= {"cargo.mass", "shell.diameter"}
    kept = read_summary(tmp_path / "drop.vtkhdf")
    assert kept is not None
    assert json.loads(json.dumps(asdict(kept))) == told | {"results": str(tmp_path / "drop.vtkhdf")}
    shown = softbrake("info", "drop.vtkhdf").stdout
    assert "% per 1 % of" in shown and "standard error" in shown
    assert max(map(len, shown.splitlines())) <= 80
