"""Unloaded lengths by row: a shell that is no cylinder, a cone between covers of two sizes."""

from pathlib import Path

import numpy as np
import pytest

from softbrake.case.case_file import load_case
from softbrake.core.columns import History
from softbrake.sim.build import build_meridian, grid_view
from softbrake.sim.simulation import Simulation

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
LOWER, UPPER, HEIGHT = 0.30, 0.25, 0.6  # m


def cone(fidelity: str, *more: str) -> Simulation:
    """A drop whose shell is a cone from the start; masses are those of the cylinder."""
    settings = ["grid={generatrix: 24, hoop: 48}", "contact=[]", "belts=[]", f"model.fidelity={fidelity}", *more]
    falling = Simulation(load_case(CONFIGS / "paper.yaml", settings))
    model, nodes = falling.model, falling.state.nodes
    rows = model.n1 + 1
    radius = np.linspace(LOWER, UPPER, rows)
    slope = np.hypot(HEIGHT, LOWER - UPPER) / model.n1
    h2 = model.shape.side * radius
    shape = model.shape._replace(
        h1=np.full(rows, slope), h2=h2, radius=radius, least_1=slope, least_2=h2.min(), widest=radius.max()
    )
    cover = model.cover_area * (UPPER / (0.5 * falling.case.shell.diameter)) ** 2
    falling.model = model._replace(shape=shape, fabric=model.fabric._replace(h1=slope, h2=h2[0]), cover_area=cover)
    scale = np.repeat(radius, model.stride) / (0.5 * falling.case.shell.diameter)
    for part in nodes[:2]:
        part[: scale.size] *= scale
    if fidelity == "axisymmetric":
        falling.workspace = build_meridian(falling.model)
    return falling


def test_unloaded_cone_feels_nothing() -> None:
    fields = cone("full").fields()
    for name in ("stretch_generatrix", "stretch_hoop"):
        assert fields[name] == pytest.approx(1.0, abs=1e-13)
    rim = slice(1, -1)  # hoops of held rows carry nothing by definition
    assert np.abs(fields["tension_generatrix"]).max() < 1e-8
    assert np.abs(fields["tension_hoop"][rim]).max() < 1e-8


def test_cone_is_the_same_by_rows_and_along_its_meridian() -> None:
    full, meridian = cone("full", "fabric.G12=0 kN/m"), cone("axisymmetric", "fabric.G12=0 kN/m")
    for falling in (full, meridian):
        falling.interval = 1
        while falling.now(History.TIME) < 0.01:
            falling.advance(until=0.01)
        assert abs(falling.energy_error()) < 1e-12
    late = full.now(History.TIME) - meridian.now(History.TIME)
    height = full.now(History.HEIGHT) - late * full.now(History.VELOCITY)
    assert height == pytest.approx(meridian.now(History.HEIGHT), rel=1e-6)
    radius, speed = (grid_view(part, full.model)[:, 0] for part in (full.state.nodes.x, full.state.nodes.u))
    assert radius - late * speed == pytest.approx(meridian.state.nodes.x[: radius.size], rel=2e-4)  # steps differ
