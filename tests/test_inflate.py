"""Static inflation against exact shapes, and what it says where there is none."""

import json
import re
from math import cos, pi
from pathlib import Path

import numpy as np
import pytest
from conftest import Command
from exact import Membrane, newton, static_cylinder, step
from numpy.typing import NDArray

import softbrake
from softbrake.case.case import Case
from softbrake.case.case_file import CaseError, load_case
from softbrake.core.arrays import Model, Outcome
from softbrake.core.columns import History
from softbrake.sim.build import meridian_view
from softbrake.sim.inflate import inflate
from softbrake.sim.relax import relax
from softbrake.sim.result_file import read_inflation, read_snapshots
from softbrake.sim.simulation import NotInflated, Simulation

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
FINE = ("model.fidelity=axisymmetric", "grid={generatrix: 112, hoop: 720}", "gravity=0")
OWN = ()  # of the file, 36 x 90 cells of the full shell
STIFFNESS = 20e3 / (1 - 0.25**2)


def case(*overrides: str, config: str = "no-belts") -> Case:
    return load_case(CONFIGS / f"{config}.yaml", overrides)


@pytest.mark.parametrize("law", ["tension_field", "true_tension", "nominal_tension"])
@pytest.mark.parametrize("grid", [FINE, ("grid={generatrix: 60, hoop: 120}", "gravity=0"), OWN])
def test_cylinder_between_covers(law: str, grid: tuple[str, ...]) -> None:
    """field.md 2: radius 0.301913 m, tensions 1641.04 and 4563.31 N/m, 1381.70 N on the cover with the paper's law."""
    exact = static_cylinder(STIFFNESS, 0.25, 15696.0, 0.25, 0.6, law == "true_tension")
    found = inflate(case(f"fabric.law={law}", *grid))
    assert found.largest_radius == pytest.approx(exact.radius, rel=1e-3)
    assert found.middle_tension_generatrix == pytest.approx(exact.tension_1, rel=4e-3 if grid is OWN else 2e-3)
    assert found.middle_tension_hoop == pytest.approx(exact.tension_2, rel=1.2e-3 if grid is OWN else 1e-3)
    assert found.wall_pull == pytest.approx(exact.pull, rel=6e-3 if grid is OWN else 3e-3)
    assert found.cover_force == pytest.approx(15696.0 * pi / 16 - exact.pull, rel=6e-3)
    if grid is FINE:
        assert found.middle_tension_generatrix == pytest.approx(exact.tension_1, rel=1e-3)
        assert found.wall_pull == pytest.approx(exact.pull, rel=1e-3)
        assert found.cover_force == pytest.approx(15696.0 * pi / 16 - exact.pull, rel=1e-3)


def test_cylinder_of_unequal_moduli() -> None:
    """Twice as stiff along the generatrix: the shooting of exact.py with both moduli, c12 = nu21 E22' = nu12 E11'."""
    contraction = 1 - 0.1 * 0.2
    membrane = Membrane(40e3 / contraction, 20e3 / contraction, 4e3 / contraction, 15696.0, 0.25, True)

    def end(unknown: NDArray[np.float64]) -> NDArray[np.float64]:
        return step(membrane.free, np.array([unknown[0], 0.0, 0.0, membrane.force_1(*unknown)]), 0.3, 200)[-1]

    radius, stretch = newton(lambda unknown: end(unknown)[:2] - np.array([0.25, 0.3]), np.array([0.305, 1.02]))
    last = end(np.array([radius, stretch]))
    found = inflate(case("fabric.E11=40 kN/m", "fabric.nu12=0.1", "fabric.nu21=0.2", *FINE))
    assert found.largest_radius == pytest.approx(radius, rel=1e-3)
    assert found.middle_tension_generatrix == pytest.approx(membrane.force_1(radius, stretch) / (radius / 0.25), rel=1e-3)
    assert found.wall_pull == pytest.approx(2 * pi * 0.25 * last[3] * cos(last[2]), rel=1e-3)


def mylar(radius: float, cut: float) -> tuple[float, float, float]:
    """Meridian length, thickness and volume of the Mylar balloon of an inflated radius, between cuts at a smaller radius.

    Slack hoops make T r the same everywhere, so the curvature of the meridian is p/T = 2 r/a², its angle from the axis cos β =
    r²/a², a the inflated radius: ds = dr/sqrt(1 - (r/a)^4), dz = (r/a)² ds. With r = a sin θ, ds = a dθ/sqrt(1 + sin² θ).
    """
    theta = np.linspace(np.arcsin(cut / radius), pi / 2, 200_001)
    ds = radius / np.sqrt(1 + np.sin(theta) ** 2)
    parts = (ds, np.sin(theta) ** 2 * ds, pi * radius**2 * np.sin(theta) ** 4 * ds)
    length, thickness, volume = (2 * float(np.trapezoid(part, theta)) for part in parts)
    return length, thickness, volume


def test_mylar_integrals_give_the_published_values() -> None:
    length, thickness, volume = mylar(1.0, 0.0)
    assert (length / 2, thickness / 2, volume) == pytest.approx((1.3110287771, 0.5990701173, 2.745812), rel=1e-6)


@pytest.mark.slow
def test_mylar_balloon() -> None:
    """The stiff limit of fabric whose hoops carry nothing: covers that replace both poles feel no force."""
    radius, cut = 0.3, 0.1
    length, thickness, volume = mylar(radius, cut)
    stiff = "fabric={E11: 2 MN/m, E22: 0.01 N/m, areal_density: 0.05, viscosity: 0, law: nominal_tension, slack: cut}"
    shell = f"shell={{diameter: {2 * cut}, height: {length!r}}}"
    grid = ("model.fidelity=axisymmetric", "grid={generatrix: 96, hoop: 720}", "gravity=0", "contact=[ground]")
    drop = Simulation(case(stiff, shell, "pressure.value=1 kPa", *grid))
    nodes = meridian_view(drop.state.nodes, drop.model)
    nodes.z[:] *= thickness / length
    nodes.x[:] += 0.1 * np.sin(pi * np.linspace(0, 1, len(nodes.x)))
    drop.state.now[History.HEIGHT] = thickness
    drop.inflate(1e-5)
    assert nodes.x.max() == pytest.approx(radius, rel=1e-3)
    assert abs(drop.now(History.COVER_FORCE)) < 2e-3 * 1e3 * pi * radius**2
    rings = pi * (nodes.x[1:] ** 2 + nodes.x[1:] * nodes.x[:-1] + nodes.x[:-1] ** 2) / 3 * np.diff(nodes.z)
    assert rings.sum() == pytest.approx(volume, rel=1e-3)


def test_volume_of_the_unloaded_cylinder() -> None:
    """No pressure to speak of: the circle's area times the height, on a grid of twelve chords."""
    found = inflate(case("pressure.value=1e-3", "grid={generatrix: 6, hoop: 12}", "gravity=0", "fabric.slack=compression"))
    assert found.volume == pytest.approx(pi * 0.25**2 * 0.6, rel=1e-5)


def test_shapes_of_both_fidelities_agree() -> None:
    grid = ("grid={generatrix: 12, hoop: 24}", "belts.width=30 mm")
    full, one = (
        inflate(case(*grid, f"model.fidelity={part}", config="paper"), tolerance=1e-9) for part in ("full", "axisymmetric")
    )
    assert full.cover_force == pytest.approx(one.cover_force, rel=1e-6)
    assert full.tension_belt == pytest.approx(one.tension_belt, rel=1e-6)
    assert full.volume == pytest.approx(one.volume, rel=1e-6)
    finer = inflate(case(grid[0].replace("24", "96"), grid[1], "model.fidelity=axisymmetric", config="paper"), tolerance=1e-9)
    assert finer.volume == pytest.approx(one.volume, rel=1e-9)  # one column stands for the whole hoop, however wide


@pytest.mark.parametrize("part", ["full", "axisymmetric"])
def test_drop_starts_from_the_inflated_shell(part: str) -> None:
    """Its first row has the tensions and the force of the shell at rest; the ledger closes, as from the unloaded shape."""
    others = ("grid={generatrix: 12, hoop: 24}", f"model.fidelity={part}", "cargo.velocity=1e-3")
    at_rest = inflate(case(*others))
    drop = Simulation(case("initial=inflated", *others))
    first, _ = drop.advance(most=1)
    assert first[0, History.TENSION_HOOP] == pytest.approx(at_rest.tension_hoop, rel=1e-4)
    assert first[0, History.COVER_FORCE] == pytest.approx(at_rest.cover_force, rel=1e-4)
    summary = Simulation(case("initial=inflated", *others[:2])).to_end()
    assert summary.outcome == "impact"
    assert abs(summary.energy_error) < 1e-11
    unloaded = softbrake.run(case(*others[:2]))
    assert abs(summary.impact_velocity - unloaded.impact_velocity) > 0.01  # it brakes from the first moment on


def test_not_converged_is_said() -> None:
    drop = Simulation(case("grid={generatrix: 8, hoop: 16}"))
    assert not relax(drop.model, drop.state, drop.step, most=50).converged

    def stuck(_: Model) -> Outcome:
        return Outcome.DIVERGED

    assert relax(drop.model, drop.state, stuck).residual == np.inf
    with pytest.raises(NotInflated, match="grows without end; most likely the fabric is too soft"):
        inflate(case("fabric.E=1 kN/m", "grid={generatrix: 8, hoop: 16}"))
    with pytest.raises(NotInflated):
        softbrake.run(case("fabric.E=1 kN/m", "grid={generatrix: 8, hoop: 16}", "initial=inflated"))


@pytest.mark.parametrize(
    ("overrides", "fault"),
    [
        (("model.fidelity=lumped",), "the lumped model has no shell to inflate"),
        (("pressure={law: sine, peak_time: 0.1 s}",), "the sine law starts without pressure"),
        (("pressure.value=0",), "the constant law starts without pressure"),
    ],
)
def test_faults(overrides: tuple[str, ...], fault: str) -> None:
    with pytest.raises(CaseError) as caught:
        case("initial=inflated", *overrides)
    assert len(caught.value.faults) == 1
    assert fault in caught.value.faults[0]


@pytest.mark.slow
def test_a_law_that_starts_without_pressure_inflates_by_its_largest(softbrake: Command, paper: Path) -> None:
    """As `stability` does, and says so; a drop from the inflated shape is another matter."""
    small = ("--set", "grid={generatrix: 8, hoop: 16}", "--set", "belts.width=30 mm", "--set", "initial=unloaded")
    sine = softbrake("inflate", paper, *small, "--set", "pressure={law: sine, value: 12 kPa, peak_time: 0.1 s}", "--json")
    assert sine.returncode == 0, sine.stderr
    steady = softbrake("inflate", paper, *small, "--set", "pressure.value=12 kPa", "--json", "--force")
    late, at_once = json.loads(sine.stdout), json.loads(steady.stdout)
    assert (late["pressure_late"], at_once["pressure_late"]) == (True, False)
    same = ("pressure", "volume", "cover_force", "tension_hoop", "steps")
    assert [late[name] for name in same] == [at_once[name] for name in same]
    table = ("--set", "pressure={law: table, times: [0 s, 0.1 s, 0.2 s], values: [0, 12 kPa, 3 kPa]}")
    shown = softbrake("inflate", paper, *small, *table, "--force").stdout
    assert re.search(r"pressure +12 kPa +the largest; the law starts without\n", re.sub(" +\n", "\n", shown))


@pytest.mark.parametrize(
    ("override", "fault"),
    [
        ("pressure.value=0", "there is no pressure to inflate the shell with"),
        ("model.fidelity=lumped", "fidelity lumped has no grid of a shell"),
    ],
)
def test_nothing_to_inflate(softbrake: Command, paper: Path, override: str, fault: str) -> None:
    done = softbrake("inflate", paper, "--set", override)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith(f"{paper}: ") and fault in done.stderr
    assert "Traceback" not in done.stderr


def test_command(softbrake: Command, paper: Path, tmp_path: Path) -> None:
    small = ("--set", "grid={generatrix: 12, hoop: 24}", "--set", "belts.width=30 mm")
    done = softbrake("inflate", paper, *small)
    assert done.returncode == 0, done.stderr
    assert "Inflated: at rest to a residual of" in done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 80
    answer = read_inflation(tmp_path / "paper-inflated.vtkhdf")
    assert answer is not None
    assert answer.cover_force == pytest.approx(1700, rel=0.1)
    assert len(read_snapshots(tmp_path / "paper-inflated.vtkhdf").times) == 1
    again = softbrake("info", "paper-inflated.vtkhdf")
    assert again.stdout == done.stdout
    failed = softbrake(
        "inflate", paper, *small, "--set", "fabric.E11=500 N/m", "--set", "fabric.E22=500 N/m", "-o", "burst.vtkhdf"
    )
    assert failed.returncode == 1
    assert "not inflated" in failed.stderr
    assert not (tmp_path / "burst.vtkhdf").exists()


def test_file_of_a_gas_holds_what_a_drop_starts_with(tmp_path: Path) -> None:
    gas = case("model.fidelity=axisymmetric", "grid={generatrix: 12, hoop: 24}", config="airdrop-vented")
    inflate(gas, tmp_path / "inflated.vtkhdf")
    history, drop = softbrake.read_result(tmp_path / "inflated.vtkhdf").history, Simulation(gas)
    for column in (History.PRESSURE, History.TEMPERATURE, History.GAS_MASS, History.VOLUME, History.GAS_ENERGY):
        assert history[column.name.lower()] == pytest.approx(drop.now(column), rel=1e-9)
