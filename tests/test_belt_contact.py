"""Condition (2.5) at the belts, and friction: against surfaces of known curvature and exact motions."""

from collections.abc import Callable
from math import cos, inf, pi, sin
from pathlib import Path

import numpy as np
import pytest

import softbrake
from softbrake.core.arrays import PAD, Floats, Impulses, Nodes, Outcome, Step
from softbrake.core.columns import History
from softbrake.core.contact.belt_contact import deviation, inward_normal, resolve_belt_contact, separate_nodes
from softbrake.core.contact.constants import GAP
from softbrake.core.contact.obstacles import press_row, rub_row
from softbrake.core.contact.scene import scene_of_shell
from softbrake.core.lanes import close_nodes
from softbrake.core.loop.push import push_row
from softbrake.sim.build import build_model, build_state, build_workspace, grid_view
from softbrake.sim.simulation import Simulation

pytestmark = pytest.mark.kernels

PAPER = Path(__file__).resolve().parents[1] / "configs" / "paper.yaml"
SURFACES: dict[str, tuple[Callable[[float, float], tuple[float, float, float]], float, float]] = {
    # place at arc lengths (s1 up, s2 around) from M, curvatures towards the inward normal -(e1 x e2)... of both lines
    "plane": (lambda s1, s2: (1.0, s2, s1), 0.0, 0.0),
    "cylinder": (lambda s1, s2: (2 * cos(s2 / 2), 2 * sin(s2 / 2), s1), 0.0, 0.5),
    "sphere": (lambda s1, s2: (2 * cos(s1 / 2) * cos(s2 / 2), 2 * cos(s1 / 2) * sin(s2 / 2), 2 * sin(s1 / 2)), 0.5, 0.5),
    "outside of a torus": (
        lambda s1, s2: ((2 + cos(s1)) * cos(s2 / 3), (2 + cos(s1)) * sin(s2 / 3), sin(s1)),
        1.0,
        1 / 3,
    ),
    "inside of a torus": (
        lambda s1, s2: ((4 - cos(s1)) * cos(s2 / 3), (4 - cos(s1)) * sin(s2 / 3), sin(s1)),
        -1.0,
        1 / 3,
    ),
}


def patch(place: Callable[[float, float], tuple[float, float, float]], spacing: float) -> tuple[Nodes, int, int]:
    """Nodes of 3 x 3 places, the offset of the middle one and the stride."""
    stride = 8
    parts = [np.zeros(3 * stride) for _ in Nodes._fields]
    for i in range(3):
        for j in range(3):
            for part, value in zip(parts, place((i - 1) * spacing, (j - 1) * spacing), strict=False):
                part[i * stride + j] = value
    return Nodes(*parts), stride + 1, stride


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("way", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (-1.0, 0.5)])
def test_deviation_of_surfaces_with_known_curvature(surface: str, way: tuple[float, float]) -> None:
    """I2/2 = (k1 ds1^2 + k2 ds2^2)/2 along lines of curvature; the error falls with the fourth power of the spacing."""
    place, curvature_1, curvature_2 = SURFACES[surface]
    errors = []
    for spacing in (0.04, 0.02):
        nodes, middle, stride = patch(place, spacing)
        exact = 0.5 * spacing**2 * (curvature_1 * way[0] ** 2 + curvature_2 * way[1] ** 2)
        found = deviation(nodes, np.uint64(middle), np.uint64(stride), *way)
        errors.append(abs(found - exact))
        assert found == pytest.approx(exact, rel=2e-4, abs=1e-15)
    assert errors[1] < errors[0] / 12 or errors[0] < 1e-13


def test_deviation_of_a_twisted_surface() -> None:
    """z = c x y has only b12: along the diagonals it rises and falls from its tangent plane by c ds1 ds2."""
    nodes, middle, stride = patch(lambda s1, s2: (0.3 * s1 * s2, s2, s1), 0.1)
    for way in ((1.0, 1.0), (1.0, -1.0), (-1.0, 0.5)):
        found = deviation(nodes, np.uint64(middle), np.uint64(stride), *way)
        assert found == pytest.approx(-0.3 * 0.01 * way[0] * way[1], rel=1e-12)


def test_normal_points_to_the_gas() -> None:
    case = softbrake.load_case(PAPER)
    model = build_model(case)
    nodes = build_state(case, model).nodes
    normal = inward_normal(nodes, np.uint64(5 * model.stride + PAD + 3), np.uint64(model.stride))
    angle = 2 * pi * 3 / model.n2
    assert normal == pytest.approx((-cos(angle), -sin(angle), 0.0), abs=1e-12)


def groove(contact: str, *others: str) -> Simulation:
    """A shell whose lobes fold over the belt in the middle and fly at each other, the upper one at 10 m/s, the lower at 4."""
    drop = Simulation(
        softbrake.load_case(
            PAPER,
            [
                f"contact={contact}",
                "belts.count=1",
                "grid={generatrix: 24, hoop: 16}",
                "pressure.value=0",
                "gravity=0",
                "cargo.velocity=0.1 m/s",
                "fabric.E=1 N/m",
                *others,
            ],
        )
    )
    model, nodes = drop.model, drop.state.nodes
    angle = 2 * pi * np.arange(-PAD, model.stride - PAD) / model.n2
    shape = (model.n1 + 1, model.stride)
    x, y, z, w = (part.reshape(shape) for part in (nodes.x, nodes.y, nodes.z, nodes.w))
    for away in (1, 2, 3):  # rows next to the belt: level, outwards, one sixth of a cell off its plane
        for side in (-1, 1):
            row = 12 + side * away
            radius = 0.25 + 0.025 * away
            x[row], y[row] = radius * np.cos(angle), radius * np.sin(angle)
            z[row] = 0.3 + side * 0.004
            w[row] = -10.0 if side > 0 else 4.0
    mass = model.hoop.whole * model.n2 * model.mass
    moving = model.hoop.whole * model.cargo_mass + mass[-1]
    kinetic = 0.5 * (mass[1:-1] * grid_view(nodes.w, model)[1:-1, 0] ** 2).sum() + 0.5 * moving * 0.1**2
    drop.state.now[History.KINETIC_ENERGY] = drop.state.kinetic_start[0] = kinetic
    return drop


@pytest.mark.parametrize(("contact", "apart"), [("paper", True), ("ground", False)])
def test_lobes_at_a_belt_stay_apart(contact: str, apart: bool) -> None:
    """With (2.5) the rows next to the belt do not cross, without it they do; momentum and energy stay closed, energy falls."""
    drop = groove(contact)
    model, nodes = drop.model, drop.state.nodes
    nearest = inf
    momentum = (grid_view(nodes.w, model)[1:-1] * model.mass[1:-1, None]).sum()
    energy = drop.now(History.KINETIC_ENERGY)
    while drop.now(History.TIME) < 1e-3:
        assert drop.advance(most=1)[1] == Outcome.RUNNING
        z = grid_view(nodes.z, model)
        nearest = min(nearest, (z[13] - z[11]).min())
        assert abs(drop.energy_error()) < 1e-13
        both = (grid_view(nodes.w, model)[1:-1] * model.mass[1:-1, None]).sum()
        assert both == pytest.approx(momentum, rel=0.02)  # the cloth at the edge of the lobes pulls a little
    if apart:
        assert nearest > 0.0
        assert drop.now(History.WORK_CONTACT) < -0.1 * energy
    else:
        assert nearest < -1e-3


@pytest.mark.parametrize("twist", [0.064, 0.0])
@pytest.mark.parametrize(("column", "around"), [(5, 1), (5, -1), (0, -1), (15, 1)])
def test_lobe_that_strays_beside_the_place_where_it_touches(column: int, around: int, twist: float) -> None:
    """Lobes that touch at one M, one of them twisted so that delta2 < 0 at N on the generatrix beside it (all of b11, b12, b22).

    N2 there flies at N1, 16 mm apart, by 20 mm in the step, and they are kept apart; without the twist delta2 > 0, and they pass.
    """
    drop = groove("paper")
    model, state, dt, beside = drop.model, drop.state, 1e-3, (column + around) % 16
    z, w = (part.reshape(model.n1 + 1, model.stride) for part in (state.nodes.z, state.nodes.w))
    w[:] = 0.0
    for row, height in ((10, -0.02), (11, -1e-3), (12, 0.0), (13, 1e-3), (14, 0.02)):
        z[row] = 0.3 + height
    at, there = PAD + column, PAD + beside
    z[11, at] = z[13, at] = 0.3
    z[14, there], z[14, PAD + (column - around) % 16] = 0.3 - 0.004, 0.3 + 0.02 + twist
    w[13, at], w[14, there] = -1e-3, -20.0
    for row in range(10, 15):
        close_nodes(state.nodes, np.uint64(row * model.stride + PAD), model.n2)
    z += dt * w
    momentum = model.mass @ grid_view(state.nodes.w, model).sum(axis=1)
    assert z[14, there] < z[10, there]
    step = Step(dt=dt, length=dt, gravity=0.0, cover=0.6, next_cover=0.6, gap=GAP)
    resolve_belt_contact(model, state.nodes, state.work, drop.workspace.by_column, drop.workspace.before_contact, step, False)
    assert z[13, at] - z[11, at] == pytest.approx(0.0, abs=1e-12)
    assert model.mass @ grid_view(state.nodes.w, model).sum(axis=1) == pytest.approx(momentum, rel=1e-12)
    if twist == 0.0:
        assert w[14, there] == -20.0
    else:
        assert 0.0 < z[14, there] - z[10, there] < 1e-4
        assert state.work.contact[beside] < 0.0


def test_cargo_has_the_last_word_where_lobes_are_parted() -> None:
    """A node 0.1 mm beside the cargo, on which another falls along the radius at 20 m/s: both are held at its side."""
    drop = groove("[ground, belts, cover, cargo]")
    model, state, dt = drop.model, drop.state, 1e-4
    nodes, impulse = state.nodes, np.zeros(2)
    a, b = (np.uint64(row * model.stride + PAD) for row in (11, 13))
    step = Step(dt=dt, length=dt, gravity=0.0, cover=0.1, next_cover=0.1, gap=GAP)
    for node, radius, u in ((a, 0.2501, 0.0), (b, 0.2511, -20.0)):
        nodes.x[node], nodes.y[node], nodes.z[node] = radius + dt * u, 0.0, 0.3
        nodes.u[node], nodes.v[node], nodes.w[node] = u, 0.0, 0.0
    impulses = Impulses(state.work.contact, drop.workspace.by_column.kinetic, impulse)
    scene = scene_of_shell(model, step, True)
    assert separate_nodes(nodes, impulses, scene, a, b, 0, (1.0, 0.0, 0.0)) == 1
    for node in (a, b):
        assert nodes.x[node] == pytest.approx(model.obstacles.cargo_radius, rel=1e-12)
    assert nodes.u[a] == pytest.approx(-1.0, rel=1e-9)
    assert nodes.w[a] == impulse[0] == 0.0


@pytest.mark.parametrize("law", ["true_tension", "tension_field"])
@pytest.mark.parametrize("scheme", ["edge", "cell"])
def test_contact_works_its_impulses_times_the_mean_velocity(scheme: str, law: str) -> None:
    """Those of n-1/2 and n+1/2, with gas, its damping, weight, viscous, sheared and belted cloth at work beside it."""
    fabric = (f"fabric.law={law}", "fabric.E=1 kN/m", "fabric.G12=50", "fabric.viscosity=0.5", "belts.layers=3")
    drop = groove(
        "paper",
        *fabric,
        f"model.scheme={scheme}",
        "pressure.value=5 kPa",
        "pressure.damping=0.01",
        "gravity=9.8 m/s^2",
        "time.courant=0.5",
    )
    model, state, met = drop.model, drop.state, 0
    random = np.random.default_rng(4)
    for part in state.nodes[:2]:
        grid_view(part, model)[1:-1] += 2e-3 * random.standard_normal((model.n1 - 1, model.n2))
    for row in range(1, model.n1):
        close_nodes(state.nodes, np.uint64(row * model.stride + PAD), model.n2)
    state.kinetic_start[0] = 1e6  # J: what is stretched at the start is no divergence
    jump = drop.workspace.before_contact.jump  # type: ignore[union-attr]
    mass = model.mass[1:-1, None]

    def velocities(parts: tuple[Floats, ...]) -> Floats:
        return np.stack([grid_view(part, model)[1:-1].copy() for part in parts])

    for _ in range(60):
        old, worked = velocities(state.nodes[3:]), drop.now(History.WORK_CONTACT)
        assert drop.advance(most=1)[1] == Outcome.RUNNING
        new = velocities(state.nodes[3:])
        jumps = velocities(tuple(jump))
        work = model.hoop.whole * float((mass * jumps * 0.5 * (old + new)).sum())
        met += work != 0.0
        assert drop.now(History.WORK_CONTACT) - worked == pytest.approx(work, rel=1e-9, abs=1e-12)
    assert met > 10
    assert drop.now(History.WORK_GROUND) == 0.0


def test_no_contact_at_the_belts_while_the_shell_is_open() -> None:
    drop = Simulation(softbrake.load_case(PAPER, ["contact=belts", "grid={generatrix: 12, hoop: 16}"]))
    while drop.now(History.TIME) < 0.01:
        drop.advance(most=10)
    assert drop.now(History.WORK_CONTACT) == 0.0


def slide(friction: float, up: bool) -> tuple[Floats, Floats]:
    """Way and speed of a row of loose nodes sliding at 2 m/s on the ground, or pressed up against the cover, by steps of 1 ms."""
    case = softbrake.load_case(PAPER, [f"friction={friction}", "belts.count=0", "contact=[ground, cover]"])
    model, row, dt = build_model(case), 3, 1e-3
    state, workspace = build_state(case, model), build_workspace(model)
    nodes, work, by_column = state.nodes, state.work, workspace.by_column
    a = np.uint64(row * model.stride + PAD)
    obstacles = model.obstacles._replace(cover_radius=inf)
    gravity = -9.80665 if up else 9.80665
    step = Step(dt=dt, length=dt, gravity=gravity, cover=0.6, next_cover=0.6, gap=GAP)
    angle = 2 * pi * np.arange(-PAD, model.stride - PAD) / model.n2
    line = slice(row * model.stride, (row + 1) * model.stride)
    nodes.z[line] = 0.6 - GAP if up else 0.0
    nodes.w[line] = 0.0
    nodes.u[line], nodes.v[line] = 2.0 * np.cos(angle), 2.0 * np.sin(angle)
    for part in (*workspace.force, *workspace.area, workspace.pressure):
        part[:] = 0.0
    way, speed = [], []
    mass = model.mass[row]
    where, scratch = np.uint64(PAD), workspace.force_above
    row_of_arrays = (workspace.area, workspace.pressure, workspace.mean, work, by_column)
    for _ in range(500):
        push_row(nodes, workspace.force, *row_of_arrays, obstacles, step, mass, a, where, 90)
        rub_row(nodes, scratch, *row_of_arrays, obstacles, step, mass, a, where, 90)
        press_row(nodes, scratch, *row_of_arrays, obstacles, step, mass, a, where, 90)
        way.append(np.hypot(nodes.x[a], nodes.y[a]) - 0.25)
        speed.append(np.hypot(nodes.u[a + np.uint64(7)], nodes.v[a + np.uint64(7)]))
    assert work.contact.sum() == pytest.approx(0.5 * mass * 90 * (speed[-1] ** 2 - 2.0**2), rel=1e-9, abs=1e-12)
    return np.array(way), np.array(speed)


@pytest.mark.parametrize("up", [False, True])
@pytest.mark.parametrize("friction", [0.0, 0.1, 0.5])
def test_sliding_block(friction: float, up: bool) -> None:
    """v = v0 - mu g t until it rests at t = v0/(mu g), on the ground and under the cover alike."""
    way, speed = slide(friction, up)
    time = 1e-3 * np.arange(1, 501)
    deceleration = friction * 9.80665
    assert speed == pytest.approx(np.maximum(2.0 - deceleration * time, 0.0), abs=1e-9)
    moving = np.minimum(time, 2.0 / deceleration) if friction else time
    assert way == pytest.approx(2.0 * moving - 0.5 * deceleration * moving**2, abs=1.1e-3)
    if friction == 0.5:
        assert speed[-1] == 0.0
