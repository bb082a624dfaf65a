"""Bodies at rest under pressure between ground and cover against exact solutions; virtual work of what contact transmits."""

from math import inf
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from exact import Floats, Membrane, pressed_shell, stadium
from numba import uint64
from test_energy import fitted_order, gas_volume, stored_energy

from softbrake.case.case_file import load_case
from softbrake.core.arrays import PAD, Outcome, Step
from softbrake.core.columns import History
from softbrake.core.contact.constants import GAP
from softbrake.core.contact.obstacles import press_row
from softbrake.core.jit import kernel
from softbrake.core.loop.fields import sample_fields
from softbrake.core.loop.push import push_row
from softbrake.core.loop.step_size import stable_step
from softbrake.core.membrane.area import update_area_vectors
from softbrake.core.membrane.edges import clear_forces, update_edge_forces, update_edges
from softbrake.core.membrane.tension import update_hoop_tension
from softbrake.core.pressure import update_damped_pressure
from softbrake.sim.build import build_model, build_state, build_workspace, grid_view
from softbrake.sim.simulation import Simulation

NO_BELTS = Path(__file__).resolve().parents[1] / "configs" / "no-belts.yaml"
PRESSURE, RADIUS = 15696.0, 0.25  # Pa, m
STIFF = 4e6  # N/m, stretched by no more than 0.1 %
WIDE = 10.0  # m, radius of a cover that nothing lies beside
ONE = uint64(1)
FIRST = uint64(PAD)

# --- lying cylinder --------------------------------------------------------------------------------------------------------


@kernel
def squeeze(model, state, workspace, start, end, lowering, steps, dt):
    """Lower a plate on a lying tube: the middle of three rows of nodes, the others its copies a cell away along y.

    The plate goes from height start to end (m) in the first `lowering` steps of dt (s). Forces on plate and ground in the
    last step stand in sweep.by_column over dt.
    """
    nodes, work, fabric, obstacles, n2 = state.nodes, state.work, model.fabric, model.obstacles, model.n2
    g, h, force, area = workspace.generatrix, workspace.hoop, workspace.force, workspace.area
    gas, by_column, mass = workspace.pressure, workspace.by_column, model.mass[1]
    stride = uint64(model.stride)
    node = stride + FIRST
    for k in range(steps):
        height = start + (end - start) * min(k / lowering, 1.0)
        lower = start + (end - start) * min((k + 1) / lowering, 1.0)
        step = Step(dt, dt, 0.0, height, lower, GAP)
        by_column.impulse[:] = 0.0
        by_column.on_cargo[:] = 0.0
        for values in (nodes.x, nodes.z, nodes.u, nodes.v, nodes.w):
            for j in range(stride):
                values[j] = values[stride + j]
                values[2 * stride + j] = values[stride + j]
        for row in range(2):
            below = uint64(row) * stride + FIRST
            update_edges(nodes, g, below - ONE, stride, below - ONE, n2 + 2, fabric.h1)
        for row in range(3):
            middle = uint64(row) * stride + FIRST
            update_edges(nodes, h, middle - ONE, ONE, middle - ONE, n2 + 1, fabric.h2)
        update_area_vectors(g, h, area, node, FIRST, node, node + stride, FIRST, n2)
        update_hoop_tension(fabric, h, g, workspace.tension_2, node, FIRST, node, n2)
        clear_forces(g, FIRST, n2)
        clear_forces(g, node, n2)
        update_edge_forces(g, h, force, node, FIRST, node, n2)
        update_damped_pressure(model.pressure, model.pressure.value * model.hoop.gas, nodes, area, gas, node, n2)
        push_row(nodes, force, area, gas, workspace.mean, work, by_column, obstacles, step, mass, node, FIRST, n2)
        press_row(nodes, force, area, gas, workspace.mean, work, by_column, obstacles, step, mass, node, FIRST, n2)


class Tube(NamedTuple):
    """A lying tube at rest between ground and plate."""

    on_plate: float  # N/m
    on_ground: float  # N/m
    tension: float  # N/m, T22, mean
    uneven: float  # N/m, largest difference of a tension from the mean
    width_plate: float  # m, between the outermost nodes that touch
    width_ground: float  # m
    edge: float  # m, between two nodes, longest
    area: float  # m^2, of the polygon of its nodes


def squeezed(stiffness: float, gap: float, columns: int) -> Tube:
    """Lower the plate in 20 ms and wait 60 ms; stiffness is E/(1 - ν²), N/m."""
    overrides = ["grid.generatrix=4", f"grid.hoop={columns}", "shell.height=0.2", "gravity=0", "contact=[ground, cover]"]
    overrides += [f"fabric.E={stiffness * (1 - 0.25**2)}", "fabric.viscosity=0.5", "pressure.damping=0.004"]
    case = load_case(NO_BELTS, overrides)
    model = build_model(case)
    model = model._replace(obstacles=model.obstacles._replace(cover_radius=WIDE))
    state, workspace = build_state(case, model), build_workspace(model)
    nodes = state.nodes
    x, y, z = nodes.y.copy(), nodes.z.copy(), nodes.x + RADIUS  # laid down, turned so that outwards stays outwards
    nodes.x[:], nodes.y[:], nodes.z[:], nodes.w[:] = x, y, z, 0.0
    dt = 0.7 * stable_step(model, nodes, workspace)
    squeeze(model, state, workspace, 2 * RADIUS, gap, int(0.02 / dt), int(0.08 / dt), dt)
    per_length = model.hoop.whole / (dt * model.fabric.h1)
    impulses = workspace.by_column.on_cargo[:columns], workspace.by_column.impulse[:columns]
    x, z = grid_view(nodes.x, model)[1], grid_view(nodes.z, model)[1]
    right, above = np.roll(x, -1), np.roll(z, -1)
    tension = workspace.tension_2[PAD : PAD + columns]
    return Tube(
        *(per_length * impulse.sum() for impulse in impulses),
        tension.mean(),
        np.abs(tension - tension.mean()).max(),
        *(np.ptp(x[impulse > 0.0]) for impulse in impulses),
        np.hypot(right - x, above - z).max(),
        0.5 * abs(np.sum(x * above - z * right)),
    )


@pytest.mark.slow
@pytest.mark.kernels
@pytest.mark.parametrize("gap", [0.35, 0.25, 0.1])
def test_inextensible_tube_between_plates(gap: float) -> None:
    """Force per length πp(R - h/2), tension ph/2, contact π(R - h/2): 36, 60, 96 edges, so that one node is 1 % at least."""
    exact, tube = stadium(inf, PRESSURE, RADIUS, gap), squeezed(STIFF, gap, 240)
    assert (tube.on_plate, tube.on_ground) == pytest.approx([exact.force] * 2, rel=0.0025)
    assert tube.tension == pytest.approx(exact.tension, rel=0.0005)
    assert tube.uneven < 0.01 * exact.tension
    assert (tube.width_plate, tube.width_ground) == pytest.approx([exact.width] * 2, rel=0.001)
    assert tube.area == pytest.approx(exact.area, rel=0.001)


@pytest.mark.slow
@pytest.mark.kernels
@pytest.mark.parametrize("gap", [0.35, 0.25, 0.1])
def test_stretching_tube_converges_with_second_order(gap: float) -> None:
    """The paper's fabric. The force jumps a little as nodes leave the plate one by one, so its error has an envelope only."""
    stiffness = 20e3 / (1 - 0.25**2)
    exact = stadium(stiffness, PRESSURE, RADIUS, gap)
    errors = []
    for columns in (30, 60, 120, 240):
        tube = squeezed(stiffness, gap, columns)
        assert (tube.on_plate, tube.on_ground) == pytest.approx([exact.force] * 2, rel=15 / columns**2)
        assert (tube.width_plate, tube.width_ground) == pytest.approx([exact.width] * 2, abs=tube.edge)
        errors.append(tube.area / exact.area - 1)
    assert fitted_order(errors) == pytest.approx(2, abs=0.2)
    assert tube.tension == pytest.approx(exact.tension, rel=1e-3)


@pytest.mark.slow
@pytest.mark.kernels
def test_contact_force_is_pressure_times_change_of_area() -> None:
    """Virtual work on an inextensible tube: F dh = p dA, with the area of two neighbouring states, that of arcs."""
    above, at, below = (squeezed(STIFF, gap, 240) for gap in (0.26, 0.25, 0.24))
    arcs = np.pi / 240 / np.sin(np.pi / 240) / np.cos(np.pi / 240)
    expected = PRESSURE * arcs * (above.area - below.area) / 0.02
    assert (at.on_plate, at.on_ground) == pytest.approx([expected] * 2, rel=0.005)


# --- upright shell ---------------------------------------------------------------------------------------------------------

# Soft hoops: those of the paper's fabric hold the bulge so tight that its generatrices go slack on the ground and crumple.
SOFT_HOOPS = ("fabric.E11=20 kN/m", "fabric.E22=1 kN/m", "fabric.nu12=0.0125")
SLOW = ("gravity=0", "cargo.mass=1e12", "cargo.velocity=5 m/s", "pressure.damping=0.002", "time.courant=0.9", "time.end=10")
REST = 0.03  # s, to come to rest in
HELD = 1e-6  # m/s: a cover that stood still would end the run


def upright(law: str, rows: int, columns: int, *others: str, plates: bool) -> Simulation:
    """An upright shell under a cover that nothing stops; plates: no cargo on it, and as wide as the wall may ever lie."""
    overrides = (*SOFT_HOOPS, *SLOW, f"fabric.law={law}", f"grid.generatrix={rows}", f"grid.hoop={columns}", *others)
    falling = Simulation(load_case(NO_BELTS, ["contact=[ground, cover, cargo]", *overrides]))
    if plates:
        falling.model = falling.model._replace(obstacles=falling.model.obstacles._replace(cover_radius=WIDE, cargo=0))
    return falling


def run_to(falling: Simulation, end: float) -> None:
    """Advance to a time (s)."""
    while falling.now(History.TIME) < end:
        assert falling.advance(end)[1] == Outcome.RUNNING


def lower(falling: Simulation, height: float) -> None:
    """Lower the cover to a height (m), to within the way of one step, and let all come to rest."""
    ends = ((falling.now(History.HEIGHT) - height) / 5.0, -5.0), (REST, -HELD)
    for duration, velocity in ends:
        falling.state.nodes.w.reshape(falling.model.n1 + 1, -1)[-1] = velocity
        run_to(falling, falling.now(History.TIME) + duration)


def cloth(falling: Simulation) -> tuple[Floats, Floats, Floats]:
    """Radii and heights of the nodes (m) and T11 (N/m), by row, means over the columns."""
    model, nodes = falling.model, falling.state.nodes
    fields = [np.empty((model.n1 + 1, model.n2)) for _ in range(4)]
    sample_fields(model, nodes, falling.workspace, *fields)
    radius = np.hypot(grid_view(nodes.x, model), grid_view(nodes.y, model))
    return radius.mean(axis=1), grid_view(nodes.z, model).mean(axis=1), fields[2].mean(axis=1)


@pytest.mark.parametrize("law", ["tension_field", "true_tension", "nominal_tension"])
@pytest.mark.parametrize("rows", [12, 24, pytest.param(48, marks=pytest.mark.slow)])
def test_shell_between_plates(law: str, rows: int) -> None:
    """Forces, contact, shape and T11. The forces jump as nodes lift off: their error has an envelope of second order.

    The area on the ground is that which bears gas and weight: where cloth lifts off within a cell, a part of it.
    """
    contraction = 1 - 0.25 * 0.0125
    membrane = Membrane(*(c / contraction for c in (20e3, 1e3, 250.0)), PRESSURE, RADIUS, law == "true_tension")
    falling = upright(law, rows, 2 * rows, plates=True)
    for height in (0.4, 0.3, 0.2):
        lower(falling, height)
        exact = pressed_shell(membrane, 0.6, falling.now(History.HEIGHT))
        forces = falling.now(History.GROUND_FORCE), falling.now(History.COVER_FORCE)
        assert forces == pytest.approx([exact.force] * 2, rel=6 / rows**2)
        radius, z, tension_1 = cloth(falling)
        half = slice(1, rows // 2 + 1)
        length, r, t = exact.meridian.T
        places = np.arange(rows // 2 + 1)[half] * 0.6 / rows
        assert radius[half] == pytest.approx(np.interp(places, length, r), rel=0.5 / rows**2)
        assert tension_1[half] == pytest.approx(np.interp(places, length, t), rel=12 / rows**2)
        lifts = radius[np.argmax(z > 1e-9) - 1 :][:2]  # the last row that lies, the first that does not
        cell = np.diff(lifts)[0]
        assert lifts[0] - 0.5 * cell < exact.contact < lifts[1]
        reached = np.sqrt(falling.now(History.GROUND_AREA) / np.pi)
        assert reached == pytest.approx(exact.contact, rel=10 / rows**2)


def potential(falling: Simulation) -> float:
    """Of fabric and gas at rest, J."""
    return stored_energy(falling) - PRESSURE * gas_volume(falling)


@pytest.mark.parametrize(
    ("plates", "at", "fabric"),
    [(True, 0.2, ()), (False, 0.2, ()), (False, 0.05, ("fabric.E22=4 kN/m", "fabric.nu12=0.05"))],
    ids=["plates", "cargo", "wall along the cargo"],
)
def test_force_on_the_cargo_is_the_slope_of_the_potential(plates: bool, at: float, fabric: tuple[str, ...]) -> None:
    """Virtual work: F = d(U - pV)/dH at rest, by places of nodes alone, whatever gas, fabric and contact each give of F.

    Nominal tensions, which have a potential U on the grid as constant pressure has; smooth contact does no work.
    """
    falling = upright("nominal_tension", 24, 48, *fabric, plates=plates)
    states = []
    for height in (at + 0.003, at, at - 0.003):
        lower(falling, height)
        states.append([falling.now(History.HEIGHT), potential(falling), falling.now(History.COVER_FORCE)])
        assert falling.now(History.GROUND_FORCE) == pytest.approx(states[-1][2], rel=1e-4)
    (upper, most, _), (_, _, force), (lowest, least, _) = states
    assert -force == pytest.approx((most - least) / (upper - lowest), rel=1e-3)
    radius, z, _ = cloth(falling)
    assert (z < 1e-9).sum() > 3  # rows on the ground
    pressed = plates or at == 0.05
    on_plate = z > lowest - 1e-4
    on_side = radius < RADIUS * (1 + 1e-9)
    assert ((on_plate if plates else on_side & on_plate).sum() > 3) == pressed


# --- a drop ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("plates", [False, True], ids=["drop", "between plates"])
def test_gas_works_by_change_of_volume_through_contact(plates: bool) -> None:
    """Cloth held by cover, cargo or ground stands still across them, whatever presses on it: the gas does no work there.

    A drop whose wall folds up beside the cargo, and a shell squeezed so fast that it never comes to rest. At any step, since the
    impulses of cover and ground belong to the step that they act in.
    """
    for courant in (0.4, 0.1):
        others = ("grid={generatrix: 12, hoop: 30}", "pressure.damping=0", f"time.courant={courant}")
        if plates:
            falling = upright("true_tension", 12, 30, *others, plates=True)
        else:
            falling = Simulation(load_case(NO_BELTS, ["contact=[ground, cover, cargo]", *others]))
        run_to(falling, 0.08)
        worked, filled = falling.now(History.WORK_PRESSURE), gas_volume(falling)
        run_to(falling, 0.1)
        work = PRESSURE * (gas_volume(falling) - filled)
        assert falling.now(History.WORK_PRESSURE) - worked == pytest.approx(work, rel=1e-3)
        radius, z, _ = cloth(falling)
        if plates:
            assert (z < 1e-9).sum() > 3 < (z > falling.now(History.HEIGHT) - 1e-4).sum()
        else:
            assert (radius < RADIUS * (1 + 1e-9)).sum() > 5
