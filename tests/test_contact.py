"""Contact of the fabric with cover and cargo: nothing passes, nothing sticks, momentum and energy stay closed."""

from math import hypot, inf
from pathlib import Path

import numpy as np
import pytest

import softbrake
from softbrake.core.arrays import Floats, Obstacles, Outcome
from softbrake.core.columns import History
from softbrake.core.contact.constants import GAP
from softbrake.core.contact.obstacles import allowed_place
from softbrake.sim.build import grid_view
from softbrake.sim.simulation import Simulation

pytestmark = pytest.mark.kernels

PAPER = Path(__file__).resolve().parents[1] / "configs" / "paper.yaml"
WIDE = Obstacles(ground=0.0, friction=0.0, cover=1, cover_radius=1.0, cargo=1, cargo_radius=1.0, cargo_height=inf, axis=0)
NARROW = WIDE._replace(cargo_radius=0.5, cargo_height=0.8)


def touching(*overrides: str) -> Simulation:
    return Simulation(softbrake.load_case(PAPER, ["contact=[ground, cover, cargo]", *overrides]))


@pytest.mark.parametrize(
    ("obstacles", "old", "new", "allowed"),
    [
        (WIDE, (0.5, 0.0, -0.2), (0.5, 0.1, 0.1), (0.5, 0.1, -GAP)),  # from below against the cover
        (WIDE, (1.2, 0.0, 0.5), (0.6, 0.8, 0.4), (0.6, 0.8, 0.4)),  # along the cargo's side, radius 1
        (WIDE, (1.2, 0.0, 0.5), (0.3, 0.4, 0.4), (0.6, 0.8, 0.4)),  # against the cargo's side
        (WIDE, (1.1, 0.0, -0.1), (0.95, 0.0, 0.2), (1.0, 0.0, 0.2)),  # past the rim, the plane of the cover crossed outside
        (WIDE, (0.98, 0.0, -0.1), (1.1, 0.0, 0.9), (1.1, 0.0, -GAP)),  # past the rim, that plane crossed inside
        (WIDE, (1.5, 0.0, 0.1), (1.4, 0.0, -0.1), (1.4, 0.0, -0.1)),  # outside both
        (WIDE._replace(cover=0, cargo=0), (0.5, 0.0, -0.2), (0.5, 0.1, 0.1), (0.5, 0.1, 0.1)),  # no contact asked for
        (NARROW, (0.7, 0.0, 0.2), (0.7, 0.0, -0.1), (0.7, 0.0, GAP)),  # from above on the free part of the cover
        (NARROW, (0.7, 0.0, 0.2), (0.3, 0.0, 0.1), (0.5, 0.0, 0.1)),  # there against the cargo
        (WIDE, (1.0, 0.0, 0.001), (0.999, 0.0, -0.002), (1.0, 0.0, -0.002)),  # down the side and past the rim: no trap
        (NARROW, (0.2, 0.0, 0.9), (0.2, 0.0, 0.7), (0.2, 0.0, 0.8 + GAP)),  # on the cargo's top
        (NARROW, (0.2, 0.0, 0.8 + GAP), (0.2, 0.0, 0.7), (0.2, 0.0, 0.8 + GAP)),  # lying there
        (NARROW, (0.2, 0.0, 0.8 - 1e-9), (0.2, 0.0, 0.7), (0.2, 0.0, 0.8 + GAP)),  # where the cover rose more than foreseen
        (NARROW, (0.7, 0.0, 0.9), (0.3, 0.0, 0.6), (0.5, 0.0, 0.6)),  # from above, the plane of the top crossed beside it
        (NARROW, (0.6, 0.0, 0.7), (0.4, 0.0, 0.9), (0.4, 0.0, 0.9)),  # past its rim
    ],
)
def test_face_that_a_node_meets(obstacles: Obstacles, old: Floats, new: Floats, allowed: Floats) -> None:
    assert allowed_place(obstacles, GAP, *old, *new) == pytest.approx(allowed, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("obstacles", [WIDE, NARROW])
def test_random_walk_never_passes(obstacles: Obstacles) -> None:
    """Each straight way from old to allowed place misses the disc, no place is inside the cargo, none is further than the way.

    But for the gap, and where a node that came down beside the cargo is behind its rim.
    """
    random = np.random.default_rng(7)
    place = np.array([0.3, 0.2, -0.4])
    met = 0
    for _ in range(30_000):
        wish = place + 0.05 * random.standard_normal(3)
        wish *= min(1.0, 2.0 / np.abs(wish).max())
        allowed = np.array(allowed_place(obstacles, GAP, *place, *wish))
        met += not np.array_equal(wish, allowed)
        if place[2] * allowed[2] < 0.0:
            share = place[2] / (place[2] - allowed[2])
            assert hypot(*(place + share * (allowed - place))[:2]) >= obstacles.cover_radius - 5e-3  # chords of the circle
        inside = hypot(*allowed[:2]) < obstacles.cargo_radius - 1e-12 and 1e-12 < allowed[2] < obstacles.cargo_height - 1e-12
        assert not inside
        assert np.linalg.norm(allowed - wish) <= np.linalg.norm(wish - place) + 2 * GAP
        place = allowed
    assert met > 100


@pytest.mark.slow
@pytest.mark.parametrize(("contact", "courant"), [("solid", 0.2), ("full", 0.9)])
def test_drop_with_a_short_narrow_cargo(contact: str, courant: float) -> None:
    """Cloth on the top of the cargo stays there, or slides off: none is thrown out, or inside, in any step."""
    cargo = ("cargo.diameter=0.3 m", "cargo.height=0.1 m", "cargo.mass=100 kg")
    grid = ("grid={generatrix: 18, hoop: 45}", f"time.courant={courant}", f"contact={contact}")
    drop = Simulation(softbrake.load_case(PAPER.with_stem("paper-contact"), [*grid, *cargo]))
    model, nodes, on_top = drop.model, drop.state.nodes, 0
    while drop.advance(most=1)[1] == Outcome.RUNNING:
        x, y, z, u, v, w = (grid_view(part, model)[1:-1] for part in nodes)
        above, radius = z - drop.now(History.HEIGHT), np.hypot(x, y)
        assert not ((radius < 0.15 - 1e-9) & (above > 1e-5) & (above < 0.1 - 1e-9)).any()
        assert np.sqrt(u * u + v * v + w * w).max() < 200.0
        on_top = max(on_top, int(((radius < 0.15) & (above < 0.1 + 1e-5) & (above > 0.05)).sum()))
    assert on_top > 3
    assert drop.now(History.HEIGHT) == 0.0
    assert abs(drop.energy_error()) < 1e-11
    assert drop.now(History.WORK_CONTACT) < 0.0


def test_wall_thrown_at_the_cover() -> None:
    """Slack cloth below the cover flies up at 20 m/s: none of it passes, energy is lost, the cargo takes the momentum."""
    drop = touching(
        "pressure.value=0",
        "belts.count=0",
        "gravity=0",
        "cargo.velocity=0.1 m/s",
        "fabric.E=1 kN/m",
        "grid={generatrix: 12, hoop: 16}",
    )
    model, nodes, now = drop.model, drop.state.nodes, drop.state.now
    for name, factor in (("x", 0.9), ("y", 0.9)):
        grid_view(getattr(nodes, name), model)[6:-1] *= factor
    grid_view(nodes.w, model)[1:-1] = 20.0
    for values in nodes:  # the copied columns
        rows = values.reshape(model.n1 + 1, model.stride)
        rows[:, 7], rows[:, 8 + model.n2] = rows[:, 7 + model.n2], rows[:, 8]
    mass = model.hoop.whole * model.mass[1:-1].sum() * model.n2
    now[History.KINETIC_ENERGY] = drop.state.kinetic_start[0] = now[History.KINETIC_ENERGY] + 0.5 * mass * (20.0**2 - 0.1**2)
    energy = now[History.KINETIC_ENERGY]
    hit = False
    while drop.now(History.TIME) < 0.005:
        _, outcome = drop.advance(most=1)
        assert outcome == Outcome.RUNNING
        below = grid_view(nodes.z, model)[:-1] - drop.now(History.HEIGHT)
        radius = np.hypot(grid_view(nodes.x, model), grid_view(nodes.y, model))[:-1]
        assert (below[radius < model.obstacles.cover_radius - 1e-6] < 0.0).all()
        hit = hit or drop.now(History.CONTACT_FORCE) > 0.0
        assert drop.now(History.KINETIC_ENERGY) < energy * (1 + 1e-12)
    assert hit
    assert drop.now(History.WORK_CONTACT) < -0.02 * energy
    assert abs(drop.energy_error()) < 1e-12


@pytest.mark.parametrize(
    ("parts", "grid", "every"), [("ground, cover, cargo", (18, 45), 10), ("ground, belts, cover, cargo", (24, 48), 1)]
)
def test_nothing_in_the_cargo_in_a_whole_drop(parts: str, grid: tuple[int, int], every: int) -> None:
    """Also where lobes at a belt beside it are parted."""
    drop = touching(f"contact=[{parts}]", f"grid={{generatrix: {grid[0]}, hoop: {grid[1]}}}", "time.courant=0.9")
    model, nodes = drop.model, drop.state.nodes
    outcome = Outcome.RUNNING
    pressed = 0
    while outcome == Outcome.RUNNING:
        _, outcome = drop.advance(most=every)
        if outcome != Outcome.RUNNING:  # moved back to the instant of impact, along chords
            break
        above = grid_view(nodes.z, model)[:-1] - drop.now(History.HEIGHT)
        radius = np.hypot(grid_view(nodes.x, model), grid_view(nodes.y, model))[:-1]
        assert (radius[above > 1e-4] > model.obstacles.cargo_radius * (1 - 1e-9)).all()
        pressed = max(pressed, int(np.sum(np.isclose(radius, model.obstacles.cargo_radius, rtol=1e-9) & (above > 1e-4))))
    assert outcome == Outcome.IMPACT
    assert pressed > 100
    assert abs(drop.energy_error()) < 1e-12
    assert drop.now(History.WORK_CONTACT) < 0.0


def test_ring_pressed_on_the_side_of_the_cargo_carries_nothing_up() -> None:
    """The side is vertical and smooth: cloth on it slides, and the cargo feels no force from it."""
    _, _, z = allowed_place(WIDE, GAP, 1.1, 0.0, 0.3, 0.9, 0.0, 0.25)
    assert z == 0.25


@pytest.mark.slow
def test_impact_velocity_converges_with_the_grid() -> None:
    """Without belts the folding is regular: differences fall with the square of the cell, to less than 0.2 %."""
    found = []
    for cells in (18, 36, 72):
        overrides = ["contact=[ground, cover, cargo]", "belts.count=0", "pressure.damping=0.0005 s/m", "grid.hoop=24"]
        summary = softbrake.run(softbrake.load_case(PAPER, [*overrides, f"grid.generatrix={cells}"]))
        assert summary.impact_velocity is not None
        found.append(summary.impact_velocity)
    first, second = found[1] - found[0], found[2] - found[1]
    assert 0.0 < second < first / 3.0  # 4 for the second order
    assert second < 0.002 * found[2]


@pytest.mark.parametrize(
    "others", [("belts.count=0",), ("cargo.mass=20 kg", "fabric.E=2 kN/m", "time.courant=0.9", "pressure.value=2 kPa")]
)
@pytest.mark.parametrize("parts", ["contact=[ground, cover]", "cargo.diameter=0.2 m"])
def test_cloth_on_the_cover_stays_on_its_side(parts: str, others: tuple[str, ...]) -> None:
    """Also whole rows that lie on it, and where the cover's next place is foreseen badly: each step's way misses the disc."""
    drop = touching("grid={generatrix: 12, hoop: 24}", parts, *others)
    model, nodes = drop.model, drop.state.nodes

    def places() -> Floats:
        xyz = np.stack([grid_view(part, model)[:-1] for part in (nodes.x, nodes.y, nodes.z)])
        xyz[2] -= drop.now(History.HEIGHT)
        return xyz

    old = places()
    while drop.advance(most=1)[1] == Outcome.RUNNING:
        new = places()
        crossing = old[2] * new[2] < 0.0
        share = old[2] / np.where(crossing, old[2] - new[2], 1.0)
        radius = np.hypot(*(old + share * (new - old))[:2])
        assert not (crossing & (radius < model.obstacles.cover_radius - 1e-4)).any()
        old = new


def test_peak_deceleration_does_not_hang_on_the_step() -> None:
    """Cloth gives its momentum to the cover within one step; behind the low-pass the peak converges, grid and step alike."""
    peaks = {}
    for cells, courant in ((36, 0.9), (36, 0.1), (72, 0.9)):
        grid = (f"grid.generatrix={cells}", "grid.hoop=720", f"time.courant={courant}", "contact=full")
        case = softbrake.load_case(PAPER.with_stem("no-belts"), ["model.fidelity=axisymmetric", *grid])
        peaks[cells, courant] = softbrake.run(case).peak_deceleration
    assert peaks[36, 0.1] == pytest.approx(peaks[36, 0.9], rel=0.01)
    assert peaks[72, 0.9] == pytest.approx(peaks[36, 0.9], rel=0.03)
