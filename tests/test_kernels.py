"""Each kernel against its slow twin in naive.py, on small shells out of shape; what the kernels rely on; events in a step.

Compiled once more with NUMBA_BOUNDSCHECK=1 these tests show that no kernel leaves its arrays.
"""

import re
from collections.abc import Callable
from functools import cache
from math import cos, exp, pi, sin, sqrt
from typing import Any, NamedTuple

import naive
import numpy as np
import pytest
from numba import njit, typeof
from numba.core.compiler import Flags
from numpy.testing import assert_allclose, assert_array_equal
from whole_shell import area_vectors, at, on_row, whole_grid

from softbrake.case.case_file import parse_case
from softbrake.core import pressure
from softbrake.core.arrays import (
    PAD,
    BeltRow,
    Cells,
    Edges,
    Floats,
    GasPressure,
    Law,
    Model,
    Nodes,
    Outcome,
    Peak,
    PressureLaw,
    Vectors,
)
from softbrake.core.columns import History
from softbrake.core.contact.obstacles import lying_area
from softbrake.core.inlining import NoAlias
from softbrake.core.jit import kernel
from softbrake.core.loop.contact_work import take_jumps
from softbrake.core.loop.fields import sample_fields
from softbrake.core.loop.ledger import add_shear_work
from softbrake.core.loop.step import advance
from softbrake.core.loop.step_size import stable_step
from softbrake.core.loop.time_loop import FILTER_TIME, event_time
from softbrake.core.membrane.belts import add_belt_forces, update_belt_tension
from softbrake.core.membrane.edges import add_cell_forces, clear_forces, update_edge_forces
from softbrake.core.membrane.shear import add_diagonal_tension, add_shear_forces, update_shear
from softbrake.core.membrane.tension import update_cell_tension, update_generatrix_tension, update_hoop_tension
from softbrake.sim.build import _pulls as row_pulls
from softbrake.sim.build import grid_view
from softbrake.sim.simulation import Simulation

pytestmark = pytest.mark.kernels

CASE = """
shell:    {diameter: 0.5 m, height: 0.6 m}
contact:  ground
fabric:   {E11: 20 kN/m, E22: 16 kN/m, nu12: 0.25, G12: 300 N/m, areal_density: 0.05 kg/m^2, viscosity: 0.2 N*s/m}
belts:
  - {height: 0.23 m, layers: 5, width: 50 mm}
  - {height: 0.37 m, stiffness: 8 kN, line_density: 20 g/m, width: 130 mm}
cargo:    {mass: 100 kg, velocity: 6 m/s}
pressure: {law: sine, value: 15 kPa, peak_time: 2 ms, end_time: 0.2 s, damping: 0.01 s/m}
grid:     {generatrix: 6, hoop: 10}
time:     {courant: 0.5}
"""
TABLE = "{law: table, times: [0 s, 1 ms, 0.1 s], values: [5 kPa, 15 kPa, 0 Pa], damping: 0.01 s/m}"
VARIANTS = {
    "edge": (),
    "edge, true": ("fabric.law=true_tension",),
    "edge, nominal, compression": ("fabric.law=nominal_tension", "fabric.slack=compression"),
    "edge, stiff in shear": ("fabric.G12=20 kN/m",),
    "cell": ("model.scheme=cell",),
    "cell, true, table": ("model.scheme=cell", "fabric.law=true_tension", f"pressure={TABLE}"),
    "cell, nominal, compression, no belts, no shear, no damping": (
        "model.scheme=cell",
        "fabric.law=nominal_tension",
        "fabric.slack=compression",
        "fabric.G12=0",
        "belts=[]",
        "pressure={law: constant, value: 15 kPa}",
    ),
    "edge, true, odd grid": (
        "fabric.law=true_tension",
        "grid.generatrix=5",
        "grid.hoop=9",
        "belts={count: 2, layers: 5, width: 0.15 m}",
    ),
}


class Shell(NamedTuple):
    """A drop on its way with a shell out of shape, and the same fields for the twins."""

    drop: Simulation
    x: Floats
    v: Floats

    @property
    def model(self) -> Model:
        return self.drop.model

    @property
    def nodes(self) -> Nodes:
        return self.drop.state.nodes

    @property
    def fields(self) -> tuple[Floats, Floats]:
        return fields_of(self.drop)


def fields_of(drop: Simulation) -> tuple[Floats, Floats]:
    """Places and velocities as they are now, (n1+1, n2, 3)."""
    views = [grid_view(part, drop.model) for part in drop.state.nodes]
    return np.stack(views[:3], axis=-1), np.stack(views[3:], axis=-1)


def make_drop(*overrides: str) -> Simulation:
    return Simulation(parse_case(CASE, "kernels.yaml", overrides))


def shell_with(drop: Simulation, x: Floats, v: Floats) -> Shell:
    """Write fields to the state of a drop, with the copied columns."""
    parts = [*np.moveaxis(x, -1, 0), *np.moveaxis(v, -1, 0)]
    for flat, values in zip(drop.state.nodes, parts, strict=True):
        flat.reshape(len(values), -1)[:, PAD - 1 : PAD + drop.model.n2 + 1] = np.pad(values, ((0, 0), (1, 1)), mode="wrap")
    drop.state.stored[:] = np.inf  # whatever is stored in this shape
    drop.state.now[History.KINETIC_ENERGY] = drop.state.kinetic_start[0] = naive.kinetic_energy(drop.model, v)
    return Shell(drop, x, v)


def out_of_shape(*overrides: str) -> Shell:
    """A shell with taut and slack edges in every direction, two of its nodes about to reach the ground."""
    drop = make_drop(*overrides)
    x, v = fields_of(drop)
    random = np.random.default_rng(20170501)
    free = x[1:-1].shape
    x[1:-1, :, :2] *= 1.1
    x[1:-1] += 0.2 * min(drop.model.fabric.h1, drop.model.fabric.h2) * random.uniform(-1.0, 1.0, free)
    v[1:-1] += random.normal(0.0, 3.0, free)
    x[1, [2, 6], 2] = 1e-4
    v[1, [2, 6], 2] = -200.0
    return shell_with(drop, x, v)


def taut(drop: Simulation) -> Shell:
    """The shell of a drop at rest, larger in all directions."""
    x, v = fields_of(drop)
    return shell_with(drop, 1.2 * x, 0.0 * v)


@pytest.fixture(params=VARIANTS)
def shell(request: pytest.FixtureRequest) -> Shell:
    return out_of_shape(*VARIANTS[request.param])


def close(actual: Any, expected: Any, tolerance: float = 1e-12) -> None:
    """Assert equality to round-off of the largest value."""
    assert_allclose(actual, expected, rtol=0.0, atol=tolerance * max(np.abs(expected).max(), 1e-12))


def vectors(rows: Any, model: Model) -> Floats:
    return np.stack([grid_view(part, model) for part in (rows.x, rows.y, rows.z)], axis=-1)


def gather(model: Model, rows: range, add: Callable[[int, Vectors, Vectors], None]) -> Floats:
    """Sum on the whole shell what kernels add to a row and to the one above it."""
    total = np.zeros((model.n1 + 1, model.n2, 3))
    for i in rows:
        row, above = (Vectors(*(np.zeros(model.stride) for _ in Vectors._fields)) for _ in range(2))
        add(i, row, above)
        total[i] += on_row(row, model)
        total[i + 1] += on_row(above, model)
    return total


# Geometry


def test_edges(shell: Shell) -> None:
    model, whole = shell.model, whole_grid(shell.model, shell.nodes)
    edge, stretch = naive.differences(shell.x), naive.stretches(model.fabric, shell.x, shell.v)
    for edges, rows, vector, e, rate in (
        (whole.generatrix, slice(model.n1), edge.along_1, stretch.e1, stretch.rate_1),
        (whole.hoop, slice(None), edge.along_2, stretch.e2, stretch.rate_2),
    ):
        close(vectors(edges, model)[rows], vector)
        close(grid_view(edges.inverse, model)[rows], 1.0 / naive.length(vector))
        close(grid_view(edges.e, model)[rows], e)
        close(grid_view(edges.rate, model)[rows], rate)


def test_area_vectors(shell: Shell) -> None:
    close(area_vectors(shell.model, shell.nodes), naive.area_vectors(shell.x))


def test_area_vectors_are_the_gradient_of_the_enclosed_volume(shell: Shell) -> None:
    """The volume is linear in each coordinate, so a difference over any length is its derivative but for round-off."""
    area, far = area_vectors(shell.model, shell.nodes), 0.1
    for node in [(1, 2), (3, 0), (3, shell.model.n2 - 1), (shell.model.n1 - 1, 5)]:
        for component in range(3):
            moved = shell.x.copy()
            moved[(*node, component)] += far
            slope = (naive.wall_volume(moved) - naive.wall_volume(shell.x)) / far
            assert area[(*node, component)] == pytest.approx(slope, abs=1e-12 * np.abs(area).max())


# Fabric and belts


def test_edge_tensions_and_forces(shell: Shell) -> None:
    model, cloth, (g, h, _) = shell.model, shell.model.fabric, whole_grid(shell.model, shell.nodes)
    generatrix, hoop = naive.edge_tensions(cloth, shell.x, shell.v)
    tension = np.zeros(model.stride)
    for i in range(model.n1):
        here, above = at(model, i), at(model, i + 1)
        update_generatrix_tension(cloth, g, h, tension, here, here, above, model.n2)
        close(tension[PAD : PAD + model.n2], generatrix.whole[i])
        if i > 0:
            update_hoop_tension(cloth, h, g, tension, here, at(model, i - 1), here, model.n2)
            close(tension[PAD : PAD + model.n2], hoop.whole[i - 1])
    for held in (0, model.n1):
        clear_forces(h, at(model, held), model.n2)
    clear_forces(g, at(model, model.n1), model.n2)

    def forces(g: Edges, h: Edges) -> Floats:
        # Hoops of rows 0 and n1, which are held, have no forces here, nor has row n1 of generatrix edges: it serves as row -1.
        row, forces = Vectors(*(np.zeros(model.stride) for _ in Vectors._fields)), []
        for i in range(model.n1 + 1):
            update_edge_forces(g, h, row, at(model, i), at(model, i - 1 if i > 0 else model.n1), at(model, i), model.n2)
            forces.append(on_row(row, model))
        return np.array(forces)

    whole, elastic = naive.edge_forces(cloth, shell.x, shell.v)
    close(forces(g, h), whole)
    close(forces(g._replace(force=g.elastic), h._replace(force=h.elastic)), elastic)


def test_cell_tensions_and_forces(shell: Shell) -> None:
    model, cloth, (g, h, cells) = shell.model, shell.model.fabric, whole_grid(shell.model, shell.nodes)
    generatrix, hoop = naive.cell_tensions(cloth, shell.x, shell.v)
    tension_1, tension_2 = np.zeros(model.stride), np.zeros(model.stride)
    for i in range(model.n1):
        here, above = at(model, i), at(model, i + 1)
        update_cell_tension(cloth, g, h, cells, tension_1, tension_2, here, here, above, here, model.n2)
        close(tension_1[PAD : PAD + model.n2], generatrix.whole[i])
        close(tension_2[PAD : PAD + model.n2], hoop.whole[i])

    def forces(cells: Cells) -> Floats:
        def add(i: int, row: Vectors, above: Vectors) -> None:
            here, upper = at(model, i), at(model, i + 1)
            add_cell_forces(g, h, cells, row, above, here, here, upper, here, model.n2)

        return gather(model, range(model.n1), add)

    whole, elastic = naive.cell_forces(cloth, shell.x, shell.v)
    close(forces(cells), whole)
    close(forces(cells._replace(force_1=cells.elastic_1, force_2=cells.elastic_2)), elastic)


def test_shear_forces(shell: Shell) -> None:
    """In a tension field with those of the wrinkles that it straightens."""
    model, (g, h, cells), wrinkled = shell.model, whole_grid(shell.model, shell.nodes), []
    cloth, tensions = model.fabric._replace(g12=300.0), np.zeros((2, model.stride))

    def add(i: int, row: Vectors, above: Vectors) -> None:
        here, upper = at(model, i), at(model, i + 1)
        wrinkled.append(update_shear(cloth, g, h, cells, here, here, upper, here, model.n2))
        add_shear_forces(g, h, cells, row, above, here, here, upper, here, model.n2)
        if wrinkled[-1]:
            add_diagonal_tension(cloth, g, h, cells, *tensions, here, here, upper, here, model.n2, False)
            add_cell_forces(g, h, cells, row, above, here, here, upper, here, model.n2)

    close(gather(model, range(model.n1), add), naive.shear_forces(cloth, shell.x))
    assert any(wrinkled) == (cloth.law == Law.TENSION_FIELD)


def test_belt_tensions_and_forces(shell: Shell) -> None:
    model, (g, h, _) = shell.model, whole_grid(shell.model, shell.nodes)
    loads = naive.belt_loads(model, shell.x, shell.v)
    rows = np.flatnonzero(model.belts.width)

    def forces(which: str) -> Floats:
        def add(i: int, row: Vectors, above: Vectors) -> None:
            if i not in rows:
                return
            belt, tension = BeltRow(*(np.zeros(model.stride) for _ in BeltRow._fields)), np.zeros(model.stride)
            here, below = at(model, i), at(model, i - 1)
            update_belt_tension(model.belts, i, h, g, belt, tension, here, below, here, model.n2)
            close(tension[PAD : PAD + model.n2], loads.whole[i - 1] / model.belts.width[i])
            add_belt_forces(belt._replace(force=getattr(belt, which)), h, row, here, model.n2)

        return gather(model, range(model.n1), add)

    whole, elastic = naive.belt_forces(model, shell.x, shell.v)
    close(forces("force"), whole)
    close(forces("elastic"), elastic)


# Pressure


NONE = np.array([])
LAWS = {
    "constant": GasPressure(PressureLaw.CONSTANT, 15e3, 0.0, 0.0, NONE, NONE, 0.0, 15e3),
    "sine": GasPressure(PressureLaw.SINE, 15e3, 0.05, 0.2, NONE, NONE, 0.0, 15e3),
    "table": GasPressure(PressureLaw.TABLE, 0.0, 0.0, 0.0, np.array([0.01, 0.05, 0.2]), np.array([5e3, 15e3, -1e3]), 0.0, 15e3),
}


@pytest.mark.parametrize("law", LAWS)
def test_pressure_law(law: str) -> None:
    constants = LAWS[law]._replace(law=int(LAWS[law].law))
    times = [0.0, 0.005, 0.01, 0.03, 0.05, 0.1, 0.19, 0.2, 0.25]
    close([pressure.pressure_at(constants, t) for t in times], [naive.pressure_at(constants, t) for t in times])


def test_damped_pressure(shell: Shell) -> None:
    """Strong enough to change the sign of 1 - ν V on some nodes."""
    model = shell.model
    law = model.pressure._replace(damping=0.3)
    area = naive.area_vectors(shell.x)
    expected = naive.damped_pressure(law, 15e3, shell.v, area)
    assert expected.min() < 0.0 < expected.max()
    for i in range(model.n1 + 1):
        rows, found = Vectors(*(np.zeros(model.stride) for _ in Vectors._fields)), np.zeros(model.stride)
        for component, flat in enumerate(rows):
            flat[PAD : PAD + model.n2] = area[i, :, component]
        pressure.update_damped_pressure(law, 15e3, shell.nodes, rows, found, at(model, i), model.n2)
        close(found[: model.n2], expected[i])


# On the ground


def test_lying_area_is_the_load_that_the_ground_bears() -> None:
    """Cloth at rest under gas and weight: all of its area; half of that load borne: half; never more than there is."""
    area, gas, weight = 2e-4, 15e3, 0.01
    load = area * gas + weight
    for borne, part in ((0.0, 0.0), (0.5 * load, 0.5), (load, 1.0), (3.0 * load, 1.0)):
        assert lying_area(area, gas, weight, borne) == pytest.approx(part * area, rel=1e-15)
    assert lying_area(area, 0.0, 0.0, 0.0) == 0.0


# Works


def test_shear_work_is_that_of_the_shear_forces() -> None:
    """By the cells, T12 times what they are sheared, and by the nodes, forces times velocities: the same sum over the shell."""
    shell = out_of_shape(*VARIANTS["edge, nominal, compression"])
    model, (g, h, cells) = shell.model, whole_grid(shell.model, shell.nodes)
    dt, mean, elastic = (
        1e-3,
        shell.drop.workspace.mean._make(np.zeros((3, model.stride * (model.n1 + 1)))),
        np.zeros(model.stride),
    )
    for part, values in zip(mean, np.moveaxis(shell.v, -1, 0), strict=True):
        part.reshape(len(values), -1)[:, PAD - 1 : PAD + model.n2 + 1] = np.pad(values, ((0, 0), (1, 1)), mode="wrap")
    for i in range(model.n1):
        here, above = at(model, i), at(model, i + 1)
        update_shear(model.fabric, g, h, cells, here, here, above, here, model.n2)
        add_shear_work(g, h, cells, mean, elastic, here, here, above, here, here, above, dt, model.n2)
    expected = dt * (naive.shear_forces(model.fabric, shell.x) * shell.v).sum()
    assert abs(expected) > 1e-3
    assert elastic[: model.n2].sum() == pytest.approx(expected, rel=1e-12)


def test_jumps_are_taken_with_their_copies() -> None:
    """A part of each, for the nodes of a row and the copies at both ends."""
    shell = out_of_shape(*VARIANTS["edge"])
    model, row = shell.model, shell.drop.workspace.mean._make
    jump, mean = row(shell.nodes[3:]), row(np.zeros((3, shell.nodes.x.size)))
    take_jumps(jump, mean, 0.75, at(model, 2), at(model, 0), model.n2)
    for part, values in zip(mean, np.moveaxis(shell.v, -1, 0), strict=True):
        assert part[PAD - 1 : PAD + model.n2 + 1] == pytest.approx(np.pad(0.75 * values[2], 1, mode="wrap"), rel=1e-15, abs=1e-15)


# The step


def test_steps(shell: Shell) -> None:
    """Whole steps, beyond the second choice of the step: fields, history, works and peaks, all to round-off."""
    drop, model = shell.drop, shell.model
    x, v, time, last, stable, limit = shell.x, shell.v, 0.0, 0.0, 0.0, np.inf
    due, interval = 0, 1
    work = {name: 0.0 for name in History if name.name.startswith("WORK")}
    peaks = np.zeros((len(Peak), 3))
    rows, expected, filtered_deceleration = [], [], 0.0
    for n in range(20):
        if n == due:
            found, before = naive.stable_step(model, x), limit
            safe, limit = found * min(found / before, 1.0) if n > 0 else found, found
            stable = safe if n == 0 or safe < stable or safe > 1.2 * stable else stable
            interval = max(interval // 2, 1) if n > 0 and limit < 0.99 * before else min(2 * interval, 16)
            due += interval
        step = model.courant * stable
        twin = naive.step(model, x, v, time, 0.5 * (last + step), step)
        without_gas = {column: 0.0 for column in History if column >= History.TEMPERATURE}
        now = twin.now | work | {History.KINETIC_ENERGY: naive.kinetic_energy(model, v), History.CONTACT_FORCE: 0.0} | without_gas
        expected.append([now[column] for column in History])
        found, outcome = drop.advance(most=1)
        rows.append(found[0].copy())
        assert outcome == Outcome.RUNNING
        acceleration = twin.now[History.ACCELERATION]
        filtered_deceleration = (
            acceleration
            if n == 0
            else filtered_deceleration + (1.0 - exp(-step / FILTER_TIME)) * (acceleration - filtered_deceleration)
        )
        tops = [(filtered_deceleration, float(model.n1)), *twin.top.values()]
        for which, (value, row) in enumerate(tops):
            if value > peaks[which, 0]:
                peaks[which] = value, time, row
        work = {name: work[name] + twin.work.get(name, 0.0) for name in work}  # the twin knows no contact but the ground
        x, v, time, last = twin.x, twin.v, time + step, step
        for field, twin_field in zip(shell.fields, (x, v), strict=True):
            close(field, twin_field, 1e-11)
    for column in History:
        close(np.array(rows)[:, column], np.array(expected)[:, column], 1e-11)
    close(drop.state.peaks, peaks, 1e-11)
    assert drop.state.steps[0] == len(rows)
    assert work[History.WORK_GROUND] < 0.0
    assert abs(drop.energy_error()) < 1e-14


def test_stable_step(shell: Shell) -> None:
    assert stable_step(shell.model, shell.nodes, shell.drop.workspace) == pytest.approx(
        naive.stable_step(shell.model, shell.x), rel=1e-12
    )


@pytest.mark.parametrize(("stiff", "nu12"), [("fabric.E22=2 MN/m", 1e-4), ("fabric.E11=2 MN/m", 1e-2)])
def test_stable_step_of_a_light_stiff_belt(stiff: str, nu12: float) -> None:
    """The belt's row decides the step, by its stiffness along the hoop or by its tension across a stiff generatrix."""
    belt = "belts=[{height: 0.3 m, stiffness: 200 kN, line_density: 0.1 g/m, width: 50 mm}]"
    drop = make_drop(belt, stiff, f"fabric.nu12={nu12}")
    shell = taut(drop)
    without = naive.stable_step(drop.model._replace(belts=drop.model.belts._replace(stiffness=np.zeros(7))), shell.x)
    expected = naive.stable_step(drop.model, shell.x)
    assert expected < 0.99 * without
    assert stable_step(drop.model, shell.nodes, drop.workspace) == pytest.approx(expected, rel=1e-12)


def test_weights_of_rows_bound_a_chain_from_above() -> None:
    """Edges of stiffness 1 between rows of any masses: never below the largest eigenvalue, and nearer than without weights."""
    random, nearer = np.random.default_rng(3), []
    for _ in range(100):
        light = random.choice([1.0, 10.0], 9) * random.uniform(1.0, 2.0, 9)
        per_mass = np.concatenate(([0.0], light, [0.0]))
        stiffness = 2.0 * np.eye(9) - np.eye(9, k=1) - np.eye(9, k=-1)
        exact = np.linalg.eigvals(light[:, None] * stiffness).real.max()
        below, above = row_pulls(per_mass, np.zeros(11))
        bound, even = (below + above)[1:-1].max(), (2.0 * light + np.convolve(per_mass, [1.0, 0.0, 1.0], "valid")).max()
        assert exact * (1.0 - 1e-12) <= bound <= even
        nearer.append((bound - exact) / (even - exact))
    assert np.mean(nearer) < 0.5


def test_stable_step_of_an_unstretched_sheet() -> None:
    """(3.3), with c^2 = E/ρ: h/c; a chain of five nodes between held ends may take a little more, 2/ω of its fastest wave."""
    drop = make_drop("fabric.nu12=0", "fabric.G12=0", "fabric.viscosity=0", "pressure={law: constant, value: 0}", "belts=[]")
    cloth = drop.model.fabric
    infinite = cloth.h1 / sqrt(20e3 / 0.05)
    assert infinite < cloth.h2 / sqrt(16e3 / 0.05)
    exact = infinite / cos(pi / (2 * drop.model.n1))
    assert 0.99 * exact < stable_step(drop.model, drop.state.nodes, drop.workspace) <= exact
    assert infinite < 0.97 * exact


def test_sampled_fields(shell: Shell) -> None:
    model = shell.model
    found = [np.full((model.n1 + 1, model.n2), np.nan) for _ in range(4)]
    sample_fields(model, shell.nodes, shell.drop.workspace, *found)
    for values, expected in zip(found, naive.sampled_fields(model, shell.x, shell.v), strict=True):
        close(values, expected)


def test_no_column_is_special(shell: Shell) -> None:
    """A shell whose columns are counted from the next one moves the same."""
    rolled = shell_with(Simulation(shell.drop.case), np.roll(shell.x, 1, axis=1), np.roll(shell.v, 1, axis=1))
    for one in (shell, rolled):
        one.drop.advance(most=20)
    for field, rolled_field in zip(shell.fields, rolled.fields, strict=True):
        close(rolled_field, np.roll(field, 1, axis=1), 1e-11)
    for column in History:
        close(rolled.drop.state.now[column], shell.drop.state.now[column], 1e-11)


def test_columns_at_the_ends_stay_copies(shell: Shell) -> None:
    shell.drop.advance(most=20)
    for flat in shell.nodes:
        rows = flat.reshape(shell.model.n1 + 1, shell.model.stride)
        assert_array_equal(rows[:, PAD - 1], rows[:, PAD + shell.model.n2 - 1])
        assert_array_equal(rows[:, PAD + shell.model.n2], rows[:, PAD])


def test_chunks_of_steps_and_pictures_between_change_nothing(shell: Shell) -> None:
    whole = shell_with(Simulation(shell.drop.case), shell.x, shell.v)
    history, _ = whole.drop.advance(most=20)
    rows = []
    for most in (1, 7, 12):
        rows.append(shell.drop.advance(most=most)[0].copy())
        sample_fields(shell.model, shell.nodes, shell.drop.workspace, *np.empty((4, shell.model.n1 + 1, shell.model.n2)))
    assert_array_equal(np.concatenate(rows), history)
    assert_array_equal(shell.fields, whole.fields)


def test_start() -> None:
    """At first contact the shell falls with the cargo, unstretched and slack."""
    (row,), _ = make_drop().advance(most=1)
    assert row[History.TIME] == 0.0
    assert row[History.HEIGHT] == 0.6
    assert row[History.VELOCITY] == pytest.approx(-6.0, rel=1e-15)
    for column in (History.TENSION_GENERATRIX, History.TENSION_HOOP, History.TENSION_BELT):
        assert row[column] < 1e-6


def test_history_keeps_every_nth_step() -> None:
    every, third = make_drop(), make_drop("output.history_interval=3")
    rows, _ = every.advance(most=20)
    assert len(rows) == 20
    assert_array_equal(third.advance(most=20)[0], rows[::3])


# What the kernels rely on


def arrays(value: object) -> list[np.ndarray]:
    """All arrays in nested tuples."""
    if isinstance(value, tuple):
        return [array for part in value for array in arrays(part)]
    return [value] if isinstance(value, np.ndarray) else []


def test_arrays(shell: Shell) -> None:
    """Another type or layout would be compiled for silently; node and edge rows begin on cache lines."""
    drop = shell.drop
    for array in arrays((drop.model, drop.state, drop.workspace, drop.history)):
        assert array.dtype in (np.float64, np.int64)
        assert array.flags.c_contiguous
        assert array.flags.aligned
        assert array.flags.writeable
    assert drop.model.stride * 8 % 64 == 0
    for array in arrays((drop.state.nodes, *drop.workspace[: drop.workspace._fields.index("pressure")])):
        assert array.ctypes.data % 64 == 0


def test_cases_differ_in_values_not_in_types() -> None:
    drops = [make_drop(*overrides) for overrides in VARIANTS.values()]
    assert len({typeof((drop.model, drop.state, drop.workspace)) for drop in drops}) == 1
    for drop in drops:
        drop.advance(most=2)
        drop.advance(until=1e-3)
    types = typeof(drops[0].state), typeof(drops[0].workspace)
    assert [signature[1:3] for signature in advance.entry.signatures].count(types) == 1


def test_noalias_reaches_the_compiler() -> None:
    """inlining.NoAlias sets a flag of Numba's that has no public name."""

    def add(a: Floats, b: Floats) -> None:
        for i in range(a.size):
            a[i] += b[i]

    def promises(**options: Any) -> int:
        compiled = njit(**options)(add)
        compiled(np.zeros(4), np.ones(4))
        (code,) = compiled.inspect_llvm().values()
        return code.count(" noalias ")

    assert not Flags().noalias
    assert promises(pipeline_class=NoAlias) > promises()


@kernel
def square(a):
    return a * a


@kernel
def power(a):
    return square(a) * square(square(a))


@kernel
def one_more(a):
    return power(a) + 1.0


def test_kernels_are_parts_of_the_one_that_python_calls() -> None:
    """Machine code is made of the outermost, with all others inlined; Python and plain Numba may call any of them."""
    assert one_more(2.0) == 65.0
    afresh = njit(pipeline_class=NoAlias)(one_more.py_func)  # what comes from the cache shows no code
    assert afresh(2.0) == 65.0
    (code,) = afresh.inspect_llvm().values()
    assert len(re.findall(r"^define .*one_more", code, re.M)) == code.count("define ")  # and none of the two others
    assert square.signatures and not square.entry.signatures and not power.entry.signatures
    assert square(3.0) == 9.0
    assert njit(lambda a: power(a) + square(a))(2.0) == 68.0


# Events in a step


@pytest.mark.parametrize(
    ("height", "velocity", "acceleration"),
    [(1e-3, -6.0, -9.8), (1e-3, -6.0, 0.0), (1e-3, -6.0, 5e3), (1e-9, -6.0, -9.8), (4e-4, -1.0, 1100.0), (0.0, -6.0, 5.0)],
)
def test_impact_in_a_step(height: float, velocity: float, acceleration: float) -> None:
    """The first root of the parabola, where the cover would be below the ground at the end of the step."""
    within, outcome = event_time(height, velocity, acceleration, 1.2e-3)
    roots = np.roots([0.5 * acceleration, velocity, height])
    assert outcome == Outcome.IMPACT
    assert within == pytest.approx(min(root for root in roots if root >= 0.0), rel=1e-12)


@pytest.mark.parametrize(
    ("outcome", "overrides"),
    [
        (Outcome.IMPACT, ("pressure.value=1 kPa",)),
        (Outcome.STOPPED, ("pressure.value=60 kPa",)),
        (Outcome.TIME_LIMIT, ("time.end=1.2345 ms",)),
    ],
)
def test_last_row(outcome: Outcome, overrides: tuple[str, ...]) -> None:
    """The last row lies on the parabola that starts in the one before, where height, velocity or time meets the event."""
    drop = make_drop("fabric.damping_ratio=5 %", "pressure={law: constant, value: 0 Pa}", *overrides)
    rows, found = drop.advance()
    assert found == outcome
    before, end = rows[-2], rows[-1]
    assert_array_equal(end, drop.state.now)
    within, acceleration = end[History.TIME] - before[History.TIME], before[History.ACCELERATION]
    assert 0.0 < within <= before[History.TIME_STEP] * (1.0 + 1e-9)
    assert end[History.VELOCITY] == pytest.approx(before[History.VELOCITY] + within * acceleration, abs=1e-9)
    fallen = within * (before[History.VELOCITY] + 0.5 * within * acceleration)
    assert end[History.HEIGHT] == pytest.approx(before[History.HEIGHT] + fallen, abs=1e-12)
    column, value = {
        Outcome.IMPACT: (History.HEIGHT, 0.0),
        Outcome.STOPPED: (History.VELOCITY, 0.0),
        Outcome.TIME_LIMIT: (History.TIME, 1.2345e-3),
    }[outcome]
    assert end[column] == pytest.approx(value, abs=1e-15)


@pytest.mark.parametrize("damping", [0.0, 0.01])
def test_divergence(damping: float) -> None:
    """A step of four times the limit ends the run."""
    drop = make_drop(f"pressure.damping={damping}")
    drop.model = drop.model._replace(courant=4.0)
    assert drop.advance()[1] == Outcome.DIVERGED


def test_impact_in_a_step_that_ends_above_the_ground() -> None:
    """0.4 mm - 1 m/s t + 500 m/s² t² is zero at (1 -+ √0.2) ms, and the cover stands still between, below the ground."""
    within, outcome = event_time(4e-4, -1.0, 1000.0, 3e-3)
    assert outcome == Outcome.IMPACT
    assert within == pytest.approx((1.0 - sqrt(0.2)) * 1e-3, rel=1e-12)


def test_stop_in_a_step() -> None:
    assert event_time(0.1, -1.0, 1000.0, 1.5e-3) == (pytest.approx(1e-3, rel=1e-15), Outcome.STOPPED)
    assert event_time(0.1, -1.0, 1000.0, 0.9e-3) == (0.9e-3, Outcome.RUNNING)
    assert event_time(0.1, 1.0, -1000.0, 1.5e-3) == (1.5e-3, Outcome.RUNNING)


@pytest.mark.parametrize("step", [1e-3, 1.5e-3])
def test_stop_on_the_ground(step: float) -> None:
    """v² = 2ah: impact and stop at once."""
    within, outcome = event_time(5e-4, -1.0, 1000.0, step)
    assert outcome in (Outcome.IMPACT, Outcome.STOPPED)
    assert within == pytest.approx(1e-3, rel=1e-7)


# ---------------------------------------------------------------------------------------------------------------------------
# Slack fabric


known_drop = cache(make_drop)


def uniform_tensions(e1: float, e2: float, *overrides: str) -> tuple[float, float]:
    """Force per unloaded width (N/m), along the generatrix and around the hoop, of evenly stretched fabric."""
    drop = known_drop(*overrides)
    cloth, workspace = drop.model.fabric, drop.workspace
    for edges, e, spacing in ((workspace.generatrix, e1, cloth.h1), (workspace.hoop, e2, cloth.h2)):
        edges.e[:], edges.rate[:], edges.inverse[:] = e, 0.0, 1.0 / (spacing * (1.0 + e))
    row = np.uint64(PAD)
    update_generatrix_tension(cloth, workspace.generatrix, workspace.hoop, workspace.tension_1, row, row, row, drop.model.n2)
    update_hoop_tension(cloth, workspace.hoop, workspace.generatrix, workspace.tension_2, row, row, row, drop.model.n2)
    one = workspace.generatrix.force[PAD] * cloth.h1 * (1.0 + e1) / cloth.h2
    two = workspace.hoop.force[PAD] * cloth.h2 * (1.0 + e2) / cloth.h1
    return float(one), float(two)


ORTHOTROPIC = "fabric={E11: 20 kN/m, E22: 16 kN/m, nu12: 0.25, viscosity: 0, areal_density: 0.05 kg/m^2, G12: 0}"


def test_tension_field() -> None:
    """Taut both ways: Hooke. Wrinkled: a strip that pulls with E e. Slack: nothing."""
    part = 1.0 - 0.25 * 0.3125

    def hooke(e1: float, e2: float) -> tuple[float, float]:
        return (20e3 * e1 + 0.3125 * 16e3 * e2) / part, (16e3 * e2 + 0.25 * 20e3 * e1) / part

    taut = hooke(0.05, -0.01)  # e2 < 0, but less than the contraction 0.3125 e1 of a strip
    assert taut[1] > 0.0
    assert uniform_tensions(0.05, -0.01, ORTHOTROPIC) == pytest.approx(taut)
    assert uniform_tensions(0.05, -0.3, ORTHOTROPIC) == pytest.approx((20e3 * 0.05, 0.0))
    assert uniform_tensions(-0.2, 0.04, ORTHOTROPIC) == pytest.approx((0.0, 16e3 * 0.04))
    assert uniform_tensions(-0.1, -0.2, ORTHOTROPIC) == (0.0, 0.0)


def test_tension_field_is_continuous_and_has_a_potential() -> None:
    """Across the borders between taut, wrinkled and slack tensions go on, and no closed path of strains gives energy."""
    path = np.linspace(-0.05, 0.05, 2001)
    for line in ((path, 0.02 + 0.0 * path), (0.02 + 0.0 * path, path), (path, -path), (path, path)):
        tensions = np.array([uniform_tensions(e1, e2, ORTHOTROPIC) for e1, e2 in zip(*line, strict=True)])
        assert np.abs(np.diff(tensions, axis=0)).max() < 1.5e-4 * 20e3
    angle = np.linspace(0.0, 2.0 * pi, 2001)
    e1, e2 = 0.01 + 0.05 * np.cos(angle), 0.05 * np.sin(angle)  # taut, wrinkled either way, slack
    tensions = np.array([uniform_tensions(*at, ORTHOTROPIC) for at in zip(e1, e2, strict=True)])
    work = 0.5 * (tensions[1:] + tensions[:-1]) * np.diff(np.stack((e1, e2), axis=-1), axis=0)
    assert np.abs(work).sum() > 10.0
    assert abs(work.sum()) < 1e-6 * np.abs(work).sum()


def shear_of(e1: float, e2: float, angle: float, g12: float) -> tuple[float, float]:
    """T12 (N/m) of one cell that is stretched evenly and sheared by an angle (rad), and what shear adds to T11."""
    cloth = make_drop(ORTHOTROPIC).model.fabric._replace(g12=g12, h1=0.1, h2=0.1)
    edges = [Edges(*(np.zeros(4 * PAD) for _ in Edges._fields)) for _ in range(2)]
    cells, row = Cells(*(np.zeros(4 * PAD) for _ in Cells._fields)), np.uint64(2 * PAD)
    edges[0].z[:], edges[0].x[:] = 0.1 * (1.0 + e1) * cos(angle), 0.1 * (1.0 + e1) * sin(angle)
    edges[1].x[:] = 0.1 * (1.0 + e2)
    wrinkled = update_shear(cloth, *edges, cells, row, row, row, row, 1)
    add_diagonal_tension(cloth, *edges, cells, *np.zeros((2, 4 * PAD)), row, row, row, row, 1, False)
    assert wrinkled == (cells.force_1[row] > 0.0 or (wrinkled and e1 < 0.0 and e2 < 0.0))
    return 4.0 * float(cells.shear[row]), 4.0 * float(cells.force_1[row])


def test_shear_of_taut_and_slack_cloth() -> None:
    """Taut cloth resists shear with G12; cloth that is slack along both directions by half of it not at all; in between T12 stays
    below the mean of the tensions, so that neither diagonal is pressed."""
    sine = 1.02**2 * sin(0.05)
    assert shear_of(0.02, 0.02, 0.05, 1e3) == (pytest.approx(1e3 * sine), 0.0)
    assert shear_of(0.02, 0.02, -0.05, 1e3)[0] == pytest.approx(-1e3 * sine)
    slack = shear_of(-0.05, -0.05, 0.05, 1e3)  # Green's strains -0.049, half the sine 0.0226
    assert slack == (pytest.approx(0.0, abs=1e-12), 0.0)
    strained, added = shear_of(0.001, 0.001, 0.3, 1e3)  # no tension to speak of, much shear: the long diagonal pulls
    assert added > 0.0
    sine, green = 1.001**2 * sin(0.3), 0.5 * (1.001**2 - 1.0)
    both = (20e3 + 5e3 + 16e3 + 5e3) / (1.0 - 0.25 * 0.3125)  # of T1 + T2 over an even strain
    assert strained == pytest.approx(1e3 * both * (sine + 2.0 * green) / (both + 4e3))
    assert 0.0 < strained < 0.95 * 1e3 * sine
    contraction = (1e3 * sine - strained) / 2e3  # b
    assert both * (green + contraction) == pytest.approx(2.0 * strained)


def test_sheared_cloth_has_a_potential() -> None:
    """A cell goes round a closed path through taut, sheared and slack: shear and what it straightens give back what they took."""
    angle = np.linspace(0.0, 2.0 * pi, 4001)
    e1, e2, shear = 0.03 * np.cos(angle), 0.02 * np.sin(angle), 0.2 * np.sin(2.0 * angle + 0.3) + 0.1
    cloth = make_drop(ORTHOTROPIC).model.fabric._replace(g12=1e3, h1=0.1, h2=0.1)
    works = []
    for a, b, c in zip(e1, e2, shear, strict=True):
        edges = [Edges(*(np.zeros(4 * PAD) for _ in Edges._fields)) for _ in range(2)]
        cells, row = Cells(*(np.zeros(4 * PAD) for _ in Cells._fields)), np.uint64(2 * PAD)
        r1, r2 = np.array([(1.0 + a) * sin(c), (1.0 + a) * cos(c)]), np.array([1.0 + b, 0.0])
        edges[0].x[:], edges[0].z[:], edges[1].x[:] = 0.1 * r1[0], 0.1 * r1[1], 0.1 * r2[0]
        update_shear(cloth, *edges, cells, row, row, row, row, 1)
        add_diagonal_tension(cloth, *edges, cells, *np.zeros((2, 4 * PAD)), row, row, row, row, 1, False)
        t12, t1, t2 = (4.0 * float(part[row]) for part in (cells.shear, cells.force_1, cells.force_2))
        works.append((np.concatenate((r1, r2)), np.concatenate((t1 * r1 + t12 * r2, t2 * r2 + t12 * r1))))
    places, forces = (np.array(part) for part in zip(*works, strict=True))
    work = (0.5 * (forces[1:] + forces[:-1]) * np.diff(places, axis=0)).sum(axis=1)
    assert np.abs(work).sum() > 10.0
    assert abs(work.sum()) < 1e-5 * np.abs(work).sum()
