"""The work ledger: it closes to round-off, each of its terms is what another route gives, and closed shells feel no net force."""

from itertools import pairwise
from math import inf, pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from exact import Floats
from whole_shell import area_vectors

from softbrake.case.case_file import load_case
from softbrake.core.arrays import PAD, ContactCount, Law, Membrane, Outcome
from softbrake.core.columns import History
from softbrake.core.membrane.tension import update_generatrix_tension, update_hoop_tension
from softbrake.sim.build import build_model, build_workspace, grid_view
from softbrake.sim.simulation import Simulation

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
COARSE = ("grid.generatrix=12", "grid.hoop=30")
LAST = History.WORK_CONTACT


def drop(*overrides: str, config: str = "no-belts") -> Simulation:
    return Simulation(load_case(CONFIGS / f"{config}.yaml", overrides))


def finish(falling: Simulation) -> tuple[Floats, Outcome]:
    """Advance to the end; return the whole history."""
    rows, outcome = [], Outcome.RUNNING
    while outcome == Outcome.RUNNING:
        new, outcome = falling.advance()
        rows.append(new.copy())
    return np.concatenate(rows), outcome


def fitted_order(errors: list[float]) -> float:
    """Slope of the errors of steps, each half of the one before it."""
    return -float(np.polyfit(np.arange(len(errors)), np.log2(np.abs(errors)), 1)[0])


def places_of_ledger(falling: Simulation) -> Floats:
    """Places of the nodes (m) at n-1/2, the time to which the works are summed; (n1+1, n2, 3)."""
    nodes, model = falling.state.nodes, falling.model
    places = np.stack([grid_view(part, model) for part in (nodes.x, nodes.y, nodes.z)], axis=-1)
    velocities = np.stack([grid_view(part, model) for part in (nodes.u, nodes.v, nodes.w)], axis=-1)
    return places - 0.5 * falling.state.last_step[0] * velocities


def perturb(falling: Simulation, size: float) -> None:
    """Move the free nodes by random lengths (m), so that no symmetry is left."""
    model, random = falling.model, np.random.default_rng(3)
    for part in falling.state.nodes[:3]:
        rows = part.reshape(model.n1 + 1, model.stride)
        free = rows[1:-1, PAD : PAD + model.n2]
        free += random.normal(0.0, size, free.shape)
        rows[:, PAD - 1] = rows[:, PAD + model.n2 - 1]
        rows[:, PAD + model.n2] = rows[:, PAD]


# --- the ledger as a whole -------------------------------------------------------------------------------------------------

# Without a potential tensions gain energy undamped, at any step, until the run ends with an error: tests/test_failures.py.
POTENTIAL = ("fabric.law=nominal_tension", "fabric.slack=cut", "fabric.nu12=0")
RUNS = {
    "paper": ("paper", ()),
    "belts, shear, tension field": ("belts-list", COARSE),
    "belts, shear, nominal tension": ("belts-list", (*COARSE, "fabric.law=nominal_tension")),
    "compression": ("no-belts", (*COARSE, "fabric.slack=compression", "fabric.viscosity=1")),
    "undamped": ("no-belts", (*COARSE, *POTENTIAL, "fabric.viscosity=0", "fabric.G12=2000")),
    "undamped, tension field": ("no-belts", (*COARSE, "fabric.law=tension_field", "fabric.viscosity=0", "fabric.G12=1000")),
    "undamped, no potential": ("no-belts", (*COARSE, "fabric.viscosity=0", "fabric.G12=2000", "time.end=20 ms")),
    "pressure damped": ("sine", (*COARSE, "pressure.damping=0.02")),
    "printed scheme": ("paper", (*COARSE, "model.scheme=cell", "time.end=20 ms", "fabric.G12=400")),
    "printed scheme, tension field": ("belts-list", (*COARSE, "model.scheme=cell", "time.end=20 ms")),
    "printed scheme, nominal tension": (
        "belts-list",
        (*COARSE, "model.scheme=cell", "time.end=20 ms", "fabric.law=nominal_tension"),
    ),
}


@pytest.mark.parametrize("name", RUNS)
def test_ledger_closes_to_round_off(name: str) -> None:
    """At every step: the change of kinetic energy is the sum of the works."""
    config, overrides = RUNS[name]
    falling = drop(*overrides, config=config)
    rows, outcome = finish(falling)
    assert outcome in (Outcome.IMPACT, Outcome.TIME_LIMIT, Outcome.STOPPED)
    assert abs(falling.energy_error()) < 1e-11
    works = rows[:, History.WORK_PRESSURE : LAST + 1]
    residual = rows[:, History.KINETIC_ENERGY] - falling.state.kinetic_start[0] - works.sum(axis=1)
    assert np.abs(residual).max() < 1e-11 * falling.state.kinetic_start[0]
    at_least = 2 if name.startswith("undamped") else 3  # of pressure, fabric, viscosity
    assert (np.abs(works[:, :3]).max(axis=0) > 0.1).sum() >= at_least  # J
    steps = rows[:-2, History.TIME_STEP]
    assert np.ptp(steps) > 1e-3 * steps.max()  # with variable steps


@pytest.mark.parametrize("config", ["paper", "belts-list", "sine"])
def test_dissipation_only_takes(config: str) -> None:
    """Viscous work and that of the ground fall from step to step.

    The viscous tension at n comes from the rate at n-1/2, hence gives a little back where the rate turns within a step, as at a
    blow on the cargo.
    """
    coarse = ("grid.generatrix=18", "grid.hoop=45") if config != "paper" else ()
    rows, _ = finish(drop(*coarse, config=config))
    for column in (History.WORK_VISCOUS, History.WORK_GROUND):
        work = rows[:, column]
        assert np.diff(work).max() < 1e-6 * rows[0, History.KINETIC_ENERGY]
        assert work[-1] < -0.01


# --- each work by another route --------------------------------------------------------------------------------------------


def test_gravity_work_is_potential_energy() -> None:
    """Up to the square of the step where the step changes, since dt means of two velocities and of two steps."""
    falling = drop(*COARSE, config="paper")
    before = places_of_ledger(falling)
    falling.advance(until=0.05)
    fallen = (before - places_of_ledger(falling))[..., 2]
    model = falling.model
    expected = model.hoop.whole * model.gravity * (model.mass @ fallen.sum(axis=1) + model.cargo_mass * fallen[-1, 0])
    assert falling.now(History.WORK_GRAVITY) == pytest.approx(expected, rel=1e-7)


def volume(places: Floats) -> float:
    """Volume (m³) between wall and covers: ∮ x·n dA/3 over bilinear patches, exact by two Gauss points each way, and the covers.

    The lower cover is at z = 0, the upper one a polygon about the axis.
    """
    a, b = places[:-1], places[1:]
    c, d = np.roll(a, -1, axis=1), np.roll(b, -1, axis=1)
    gauss = 0.5 + np.array([-0.5, 0.5]) / sqrt(3)
    wall = 0.0
    for s in gauss:
        for t in gauss:
            x = (1 - s) * ((1 - t) * a + t * b) + s * ((1 - t) * c + t * d)
            x_s = (1 - t) * (c - a) + t * (d - b)
            x_t = (1 - s) * (b - a) + s * (d - c)
            wall += 0.25 * np.sum(x * np.cross(x_s, x_t)) / 3
    rim = places[-1]
    following = np.roll(rim, -1, axis=0)
    area = 0.5 * np.sum(rim[:, 0] * following[:, 1] - rim[:, 1] * following[:, 0])
    return float(wall + rim[0, 2] * area / 3)


def gas_volume(falling: Simulation) -> float:
    """Volume (m³) of the gas: that between wall and covers with what lies between chords and arcs."""
    hoop = falling.model.hoop
    return hoop.whole * hoop.gas * volume(places_of_ledger(falling))


@pytest.mark.parametrize("columns", [8, 90])
def test_volume_of_a_cylinder(columns: int) -> None:
    assert gas_volume(drop(f"grid.hoop={columns}")) == pytest.approx(0.6 * pi * 0.25**2, rel=1e-12)


def test_pressure_work_is_pressure_times_volume() -> None:
    """Constant pressure has the potential -pV on the discrete shell too, perturbed as it may be; error falling as step²."""
    errors = []
    for courant in (0.4, 0.2, 0.1):
        falling = drop(*COARSE, f"time.courant={courant}", "time.end=5 ms", "fabric.G12=400", config="paper")
        perturb(falling, 2e-3)
        before = gas_volume(falling)
        finish(falling)
        work = 15696.0 * (gas_volume(falling) - before)
        assert work > 100.0
        errors.append(falling.now(History.WORK_PRESSURE) / work - 1)
    assert fitted_order(errors) == pytest.approx(2, abs=0.2)
    assert abs(errors[-1]) < 5e-4


def field_energy(fabric: Membrane, e1: Floats, e2: Floats) -> Floats:
    """Energy (J/m²) of the tension field: the least of the orthotropic sheet's over wrinkles along either direction."""
    taut = 0.5 * fabric.c11 * e1**2 + 0.5 * fabric.c22 * e2**2 + fabric.c12 * e1 * e2
    slack_1, slack_2 = fabric.c11 * e1 + fabric.c12 * e2 <= 0, fabric.c22 * e2 + fabric.c12 * e1 <= 0
    along, around = 0.5 * fabric.e11 * np.maximum(e1, 0) ** 2, 0.5 * fabric.e22 * np.maximum(e2, 0) ** 2
    return np.where(slack_1 | slack_2, np.maximum(along, around), taut)


def shear_energy(fabric: Membrane, r1: Floats, r2: Floats) -> Floats:
    """Energy (J/m²) that shear adds to it: the least over wrinkles b along the diagonals, found by a search."""
    E1, E2 = 0.5 * (np.sum(r1 * r1, axis=-1) - 1), 0.5 * (np.sum(r2 * r2, axis=-1) - 1)
    sine = np.abs(np.sum(r1 * r2, axis=-1))

    def energy(b: Floats) -> Floats:
        return field_energy(fabric, E1 + b, E2 + b) + 0.5 * fabric.g12 * (sine - 2 * b) ** 2

    low, high = 0 * sine, 0.5 * sine
    for _ in range(100):  # convex in b
        one, two = low + (high - low) / 3, high - (high - low) / 3
        falls = energy(one) > energy(two)
        low, high = np.where(falls, one, low), np.where(falls, high, two)
    return energy(low) - field_energy(fabric, E1, E2)


def stored_energy(falling: Simulation) -> float:
    """Elastic energy (J) of fabric with a potential, by the definition of each.

    Nominal tensions: ½ C11 e1² and ½ C22 e2² per unloaded area on the edges, C12 e1 e2 and ½ G12 (r1 r2)² of the cells' means;
    where slack fabric is cut (and ν = 0), taut edges only. Tension field: the least over wrinkles at each corner of two edges,
    and what shear adds in each cell, the least over wrinkles along its diagonals. Belts ½ E2 e2² where taut. The printed scheme
    has none: its directions are not the gradients of its stretches where a cell's edges are not parallel.
    """
    model = falling.model
    places, fabric, whole = places_of_ledger(falling), model.fabric, model.hoop.whole
    up, right = np.diff(places, axis=0), np.roll(places, -1, axis=1) - places
    e1 = np.linalg.norm(up, axis=-1) / fabric.h1 - 1
    e2 = np.linalg.norm(right, axis=-1) / fabric.h2 - 1
    belts = 0.5 * fabric.h2 * np.sum(model.belts.stiffness[:, None] * np.maximum(e2, 0) ** 2)
    cell_e1, cell_e2 = 0.5 * (e1 + np.roll(e1, -1, axis=1)), 0.5 * (e2[:-1] + e2[1:])
    cell_up, cell_right = 0.5 * (up + np.roll(up, -1, axis=1)) / fabric.h1, 0.5 * (right[:-1] + right[1:]) / fabric.h2
    if fabric.law == Law.TENSION_FIELD:
        corners = (e2[:-1], np.roll(e2[:-1], 1, axis=1), e2[1:], np.roll(e2[1:], 1, axis=1))
        per_area = 0.25 * sum(float(field_energy(fabric, e1, e).sum()) for e in corners)
        return float(belts + fabric.h1 * fabric.h2 * (per_area + shear_energy(fabric, cell_up, cell_right).sum())) * whole
    least = 0.0 if fabric.floor == 0.0 else -inf
    per_area = 0.5 * fabric.c11 * np.sum(np.maximum(e1, least) ** 2) + 0.5 * fabric.c22 * np.sum(np.maximum(e2, least) ** 2)
    per_area += fabric.c12 * np.sum(cell_e1 * cell_e2) + 0.5 * fabric.g12 * np.sum(np.sum(cell_up * cell_right, axis=-1) ** 2)
    return float(belts + fabric.h1 * fabric.h2 * per_area) * whole


ELASTIC = {
    "fabric": ("no-belts", ()),
    "belts and shear": ("belts-list", ("fabric.G12=2000",)),
    "slack cut": ("belts-list", ("fabric.slack=cut", "fabric.nu12=0", "fabric.G12=0")),
    "tension field": ("belts-list", ("fabric.law=tension_field", "fabric.slack=cut", "fabric.G12=0")),
    "tension field in shear": ("belts-list", ("fabric.law=tension_field", "fabric.slack=cut", "fabric.G12=2000")),
}


@pytest.mark.parametrize("name", ELASTIC)
def test_elastic_work_is_stored_energy(name: str) -> None:
    """On a perturbed shell, with viscosity beside it; the difference falls as step²."""
    config, overrides = ELASTIC[name]
    law = ("fabric.law=nominal_tension", "fabric.slack=compression", *overrides)
    errors = []
    for courant in (0.4, 0.2, 0.1):
        falling = drop(*COARSE, *law, f"time.courant={courant}", "time.end=2 ms", config=config)
        perturb(falling, 1e-3)
        before = stored_energy(falling)
        finish(falling)
        work = falling.now(History.WORK_ELASTIC) + falling.now(History.WORK_BELTS)
        stored = stored_energy(falling) - before
        errors.append(work / stored + 1)
    assert fitted_order(errors) == pytest.approx(2, abs=0.2)
    assert abs(errors[-1]) < 5e-3


NO_POISSON = ("fabric.law=nominal_tension", "fabric.nu12=0")  # cut at zero, that is what a potential takes
FIELD = ("fabric.law=tension_field",)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "contact", "g12", "size"),
    [
        (NO_POISSON, "full", 0.0, 0.0),
        (NO_POISSON, "full", 20.0, 0.0),
        (NO_POISSON, "paper", 0.0, 0.0),
        (FIELD, "full", 0.0, 0.0),
        (FIELD, "full", 1000.0, 1e-3),
    ],
)
def test_works_of_gas_and_fabric_where_lobes_and_folds_meet(law: tuple[str, ...], contact: str, g12: float, size: float) -> None:
    """Crumpling, to 3 cm above the ground: constant pressure and taut fabric keep their potentials.

    What has shear crumples because it is disturbed by a size (m). Both errors fall as step² in the mean of many impulses, as
    those of free flight. Contact only takes, and little.
    """
    gas, elastic = [], []
    for courant in (0.9, 0.3):
        others = (f"fabric.G12={g12}", f"contact={contact}")
        falling = drop(*law, *others, "grid={generatrix: 18, hoop: 45}", f"time.courant={courant}", config="paper-contact")
        falling.disturb(size, 1)
        filled, start = gas_volume(falling), stored_energy(falling)
        while falling.now(History.HEIGHT) > 0.03:
            assert falling.advance(most=20)[1] == Outcome.RUNNING
        work = 15696.0 * (gas_volume(falling) - filled)
        given = falling.now(History.WORK_ELASTIC) + falling.now(History.WORK_BELTS)
        gas.append(falling.now(History.WORK_PRESSURE) / work - 1)
        elastic.append((given + stored_energy(falling) - start) / work)
        assert -0.1 * abs(work) < falling.now(History.WORK_CONTACT) < -0.1
        if contact == "full":
            assert falling.state.self_contact.counts[ContactCount.PASSES] > 5000
    for errors, most in ((gas, 1e-3), (elastic, 1e-2)):
        assert abs(errors[0]) < most
        assert abs(errors[1]) < abs(errors[0]) / 5


# --- forces and momenta ----------------------------------------------------------------------------------------------------


@pytest.mark.kernels
def test_closed_shell_feels_no_net_force_or_moment() -> None:
    """The area vectors of a crooked shell and its two covers, and their moments about the origin, sum to zero."""
    falling = drop(*COARSE)
    perturb(falling, 0.02)
    areas = area_vectors(falling.model, falling.state.nodes)
    assert np.abs(areas[1:-1].sum(axis=(0, 1))).max() > 1e-3  # the free rows alone are not closed
    assert np.abs(areas.sum(axis=(0, 1))).max() < 1e-14  # the covers' own vectors are equal and opposite
    places = places_of_ledger(falling)
    assert np.abs(np.cross(places, areas).sum(axis=(0, 1))).max() < 1e-14


@pytest.mark.kernels
def test_area_vectors_are_the_gradient_of_the_volume() -> None:
    falling = drop(*COARSE)
    perturb(falling, 0.02)
    places, areas = places_of_ledger(falling), area_vectors(falling.model, falling.state.nodes)
    for node in ((1, 0), (5, 7), (11, 29)):
        for k in range(3):
            shift = np.zeros_like(places)
            shift[(*node, k)] = 1e-4
            slope = (volume(places + shift) - volume(places - shift)) / 2e-4  # exact: the volume is linear in a coordinate
            assert areas[(*node, k)] == pytest.approx(slope, abs=1e-12)


@pytest.mark.parametrize(
    ("scheme", "end", "contact"),
    [("edge", "90 ms", "ground"), ("cell", "20 ms", "ground"), ("edge", "90 ms", "[ground, cover, cargo]")],
)
def test_momentum_changes_by_gravity_and_ground_only(scheme: str, end: str, contact: str) -> None:
    """Fabric and cargo: Σ dt (ground force - weight), with dt from n-1/2 to n+1/2, to round-off."""
    falling = drop(*COARSE, f"model.scheme={scheme}", "fabric.G12=400", f"time.end={end}", f"contact={contact}", config="paper")
    perturb(falling, 1e-3)
    model = falling.model

    def momentum() -> float:
        moving = model.mass @ grid_view(falling.state.nodes.w, model).sum(axis=1)
        return model.hoop.whole * float(moving + model.cargo_mass * grid_view(falling.state.nodes.w, model)[-1, 0])

    before = momentum()
    rows, _ = finish(falling)
    steps = rows[:-1, History.TIME_STEP]
    dt = 0.5 * (np.concatenate(([0.0], steps[:-1])) + steps)
    weight = model.hoop.whole * (model.n2 * model.mass.sum() + model.cargo_mass) * model.gravity
    impulse = np.sum(dt * (rows[:-1, History.GROUND_FORCE] - weight))
    assert (falling.now(History.WORK_GROUND) < 0.0) == (scheme == "edge")  # by then fabric has met the ground
    assert momentum() - before == pytest.approx(impulse, abs=1e-11 * abs(before))
    assert abs(impulse) > 10.0


# --- a property of the fabric law ------------------------------------------------------------------------------------------


def edge_forces(law: str, e1: float, e2: float) -> tuple[float, float]:
    """Forces per unloaded width (N/m) along the generatrix and the hoop, by the kernels, of a uniformly stretched sheet."""
    model = build_model(load_case(CONFIGS / "no-belts.yaml", [*COARSE, f"fabric.law={law}", "fabric.viscosity=0"]))
    fabric, workspace, first = model.fabric, build_workspace(model), np.uint64(PAD)
    for edges, e, spacing in ((workspace.generatrix, e1, fabric.h1), (workspace.hoop, e2, fabric.h2)):
        edges.e[:] = e
        edges.inverse[:] = 1 / ((1 + e) * spacing)
    update_generatrix_tension(fabric, workspace.generatrix, workspace.hoop, workspace.tension_1, first, first, first, model.n2)
    update_hoop_tension(fabric, workspace.hoop, workspace.generatrix, workspace.tension_2, first, first, first, model.n2)
    along = workspace.generatrix.force[PAD] * (1 + e1) * fabric.h1 / fabric.h2
    around = workspace.hoop.force[PAD] * (1 + e2) * fabric.h2 / fabric.h1
    return float(along), float(around)


@pytest.mark.kernels
@pytest.mark.parametrize(("law", "leak"), [("true_tension", 0.025), ("nominal_tension", 0.0)])
def test_true_tension_has_no_potential(law: str, leak: float) -> None:
    """Work (per unloaded area) around e1: 0 → 0.1, e2: 0 → 0.2, and back in the same order, over ½E'e2².

    With N1 = T11 λ2, N2 = T22 λ1 of (2.9), ∂N2/∂e1 - ∂N1/∂e2 = E'(1 - 2ν)(e2 - e1); by Green's theorem the work around
    a × b is E'(1 - 2ν) ab (b - a)/2, here 0.025 of ½E'b². A case for the ledger, which integrates the work; no fault of it.
    """
    path = [(0.0, 0.0), (0.1, 0.0), (0.1, 0.2), (0.0, 0.2), (0.0, 0.0)]
    work = 0.0
    for start, end in pairwise(path):
        forces = np.array([edge_forces(law, *start), edge_forces(law, *end)])
        work += forces.mean(axis=0) @ np.subtract(end, start)  # exact: along a leg the force is linear
    stiffness = 20e3 / (1 - 0.25**2)
    a, b = 0.1, 0.2
    assert work / (0.5 * stiffness * b**2) == pytest.approx(leak, abs=1e-12)
    assert leak == pytest.approx((1 - 2 * 0.25) * a * (b - a) / b if leak else 0.0)
