"""Profiles other than the cylinder: geometry, statics against a boundary-value solver and balances, drops on all fidelities."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from softbrake.case.case import Case, case_to_dict
from softbrake.case.case_file import CaseError, parse_case
from softbrake.case.generatrix import Generatrix, bulging, straight, through, zone
from softbrake.case.sections.shell import shell_of
from softbrake.core.arrays import Floats
from softbrake.core.columns import History
from softbrake.sim.build import build_model, grid_view
from softbrake.sim.inflate import inflate
from softbrake.sim.simulation import Simulation, simulate

SHAPES = {
    "cone": "{profile: cone, lower_diameter: 1.2 m, upper_diameter: 0.8 m, height: 0.9 m}",
    "barrel": "{profile: barrel, lower_diameter: 0.9 m, upper_diameter: 0.7 m, height: 0.8 m, bulge: 0.7 m}",
    "sphere": "{profile: sphere, diameter: 1.2 m, lower_diameter: 0.6 m, upper_diameter: 0.5 m}",
    "table": "{profile: table, heights: [0 m, 0.3 m, 0.7 m], diameters: [0.8 m, 1.1 m, 0.7 m]}",
}
REST = """
fabric: {{E: {stiffness} kN/m, areal_density: 0.1 kg/m^2, damping_ratio: 3 %, law: {law}}}
cargo: {{mass: 100 kg, velocity: 6 m/s, diameter: {box} m}}
pressure: {{law: constant, value: 10 kPa}}
gravity: {gravity}
model: {{fidelity: {fidelity}}}
grid: {{generatrix: {cells}, hoop: {hoop}}}
"""
P = 10e3  # Pa


def case_of(shape: str, cells: int = 24, fidelity: str = "axisymmetric", law: str = "nominal_tension", **more: object) -> Case:
    asked = {"stiffness": 60, "gravity": 0, "law": law, "fidelity": fidelity, "cells": cells, "hoop": 64, "box": 0.4} | more
    return parse_case(f"shell: {SHAPES.get(shape, shape)}" + REST.format(**asked), "shape.yaml")


GENERATRICES = [
    straight(0.9, 0.6, 0.4),
    bulging(0.8, 0.45, 0.35, 0.7),
    zone(1.2, 0.3, 0.25),
    through([(0, 0.4), (0.3, 0.55), (0.7, 0.35)]),
]


@pytest.mark.parametrize("generatrix", GENERATRICES, ids=["cone", "arc", "ball", "table"])
def test_lengths_areas_and_volumes_are_those_of_many_frusta(generatrix: Generatrix) -> None:
    z, r = np.array([generatrix.at(each) for each in np.linspace(0.0, generatrix.length, 30_001).tolist()]).T
    along, rise = np.hypot(np.diff(z), np.diff(r)), np.diff(z)
    assert generatrix.length == pytest.approx(along.sum(), rel=1e-5)
    assert generatrix.area == pytest.approx((math.pi * (r[1:] + r[:-1]) * along).sum(), rel=1e-5)
    assert generatrix.volume == pytest.approx((math.pi / 3 * rise * (r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2)).sum(), rel=1e-5)
    assert (generatrix.height, generatrix.widest, generatrix.narrowest) == pytest.approx((z[-1], r.max(), r.min()), abs=1e-5)
    for share in (0.0, 0.2, 0.51, 1.0):
        height, _ = generatrix.at(share * generatrix.length)
        assert generatrix.along(height) == pytest.approx(share * generatrix.length, abs=1e-9)


def test_a_ball_is_a_ball() -> None:
    """Archimedes: the zone's area is 2 pi R h; its volume that of the ball less two caps."""
    ball = zone(1.2, 0.3, 0.25)
    assert ball.area == pytest.approx(2.0 * math.pi * 0.6 * ball.height)
    below, above = math.sqrt(0.6**2 - 0.3**2), math.sqrt(0.6**2 - 0.25**2)
    caps = sum(math.pi * (0.6 - z) ** 2 * (2 * 0.6 + z) / 3.0 for z in (below, above))
    assert ball.height == pytest.approx(below + above) and ball.volume == pytest.approx(4.0 / 3.0 * math.pi * 0.6**3 - caps)


@pytest.mark.parametrize("fidelity", ["axisymmetric", "full", "lumped"])
def test_a_cylinder_by_any_name_is_the_same_to_the_last_bit(fidelity: str) -> None:
    def model(shape: str) -> list[Floats]:
        found = build_model(case_of(shape, fidelity=fidelity))
        return [*found.shape[:3], found.mass, found.per_mass, np.array([found.cover_area, found.base_area])]

    plain = model("{diameter: 0.8 m, height: 0.7 m}")
    for other in (
        "{profile: cone, lower_diameter: 0.8 m, upper_diameter: 0.8 m, height: 0.7 m}",
        "{profile: table, heights: [0 m, 0.7 m], diameters: [0.8 m, 0.8 m]}",
    ):
        for one, two in zip(plain, model(other), strict=True):
            np.testing.assert_allclose(one, two, rtol=1e-15 if "table" not in other else 1e-13)


def membrane(case: Case) -> tuple[Callable[[Floats], Floats], float]:
    """Height and radius over the unloaded length, and the axial force N of the wall at the upper rim, by a collocation solver.

    Nominal tensions. Forces per angle P, Q (N/rad) of the generatrix along r and z; pressure follows the deformed wall:
    P' = N22 - p r z', Q' = p r r', with r0 N11 (r', z')/lambda1 = (P, Q), N11 = c11 e1 + c12 e2, N22 = c12 e1 + c22 e2.
    """
    cloth, generatrix = case.fabric, case.shell.generatrix
    c11, c22 = cloth.E11 / cloth.contraction, cloth.E22 / cloth.contraction
    c12 = cloth.nu12 * c11
    s = np.linspace(0.0, generatrix.length, 401)

    def radius(at: Floats) -> Floats:
        return np.array([generatrix.at(each)[1] for each in at])

    def slopes(at: Floats, y: Floats) -> Floats:
        r, _, pull_r, pull_z = y
        r0, pull = radius(at), np.hypot(pull_r, pull_z)
        e2 = r / r0 - 1.0
        e1 = (pull / r0 - c12 * e2) / c11
        dr, dz = (1.0 + e1) * pull_r / pull, (1.0 + e1) * pull_z / pull
        return np.array([dr, dz, c12 * e1 + c22 * e2 - P * r * dz, P * r * dr])

    ends = [generatrix.at(0.0), generatrix.at(generatrix.length)]

    def held(first: Floats, last: Floats) -> Floats:
        return np.array([first[0] - ends[0][1], first[1] - ends[0][0], last[0] - ends[1][1], last[1] - ends[1][0]])

    r0, z0 = np.array([generatrix.at(each)[::-1] for each in s]).T
    pull = 0.5 * P * r0 * r0
    start = np.array([r0, z0, pull * np.gradient(r0, s), pull * np.gradient(z0, s)])
    found = solve_bvp(slopes, held, s, start, tol=1e-7, max_nodes=20_000)
    assert found.success, found.message
    return (lambda at: found.sol(at)[:2]), float(2.0 * math.pi * found.sol(generatrix.length)[3])


@pytest.mark.parametrize("shape", ["cone", "barrel", "sphere"])
def test_inflated_shapes_are_those_of_a_boundary_value_solver(shape: str) -> None:
    """Places and the pull on the cover, of second order in the cells."""
    cells = np.array([24, 48, 96])
    places_off, pull_off = [], []
    for count in cells:
        case = case_of(shape, int(count))
        exact, pull = membrane(case)
        drop = Simulation(case)
        drop.inflate()
        x, z = drop.state.nodes.x[: count + 1], drop.state.nodes.z[: count + 1]
        r0, z0 = exact(np.linspace(0.0, case.shell.wall, count + 1))
        places_off.append(float(np.hypot(x - r0, z - z0).max()))
        pull_off.append(abs(inflate(case).wall_pull - pull) / (P * math.pi * case.shell.upper_diameter**2 / 4))
    orders = [-np.polyfit(np.log(cells), np.log(off), 1)[0] for off in (places_off, pull_off)]
    print(shape, places_off, pull_off, orders)
    assert orders == pytest.approx([2.0, 2.0], abs=0.3)
    assert places_off[-1] < 1e-4 and pull_off[-1] < 2e-3


@pytest.mark.parametrize("fidelity", ["axisymmetric", "full"])
def test_stiff_shapes_obey_the_balance_of_the_membrane(fidelity: str) -> None:
    """Cone: T22 = p r/cos(alpha), and T11 2 pi r cos(alpha) = N + p pi (r² - R²). Ball: T11 + T22 = p R. To 0.1 %."""
    case = case_of("cone", 96 if fidelity == "axisymmetric" else 48, fidelity, stiffness=60_000)
    found = inflate(case)
    slant = case.shell.wall / case.shell.height
    r = case.shell.at(0.5 * case.shell.wall)[1]
    assert found.middle_tension_hoop == pytest.approx(P * r * slant, rel=1e-3)
    pull = found.wall_pull + P * math.pi * (r * r - 0.4**2)
    assert found.middle_tension_generatrix == pytest.approx(pull * slant / (2.0 * math.pi * r), rel=1e-3)
    ball = inflate(case_of("sphere", 96 if fidelity == "axisymmetric" else 48, fidelity, stiffness=60_000))
    assert ball.middle_tension_generatrix + ball.middle_tension_hoop == pytest.approx(P * 0.6, rel=1e-3)


def test_two_discs_sewn_together_become_the_mylar_balloon() -> None:
    """Radius a/1.3110287771 and volume 1.218524 a³ of inextensible cloth, hoops slack; small covers at its poles change nothing.

    Stretch is p a/E, 2e-4, and what the hoops carry at the equator.
    """
    r = 1.0 / 1.3110287771
    t = np.linspace(0.0, 0.06, 20_001)
    below = np.sqrt(r**4 - t**4)
    cut = float(np.trapezoid(r * r / below, t))  # of cloth under a cover of 60 mm
    lost = float(np.trapezoid(t * t / below, t))  # of the thickness there
    thickness, cloth, rim = 2.0 * (0.5990701173 * r - lost), 1.0 - cut, 2.0 * cut
    shell = f"{{profile: pattern, height: {thickness}, lengths: [0, {cloth}, {2 * cloth}], diameters: [{rim}, 2, {rim}]}}"
    case = case_of(shell, 128, law="tension_field", stiffness=50_000, hoop=120, box=0.1)
    case = replace(case, fabric=replace(case.fabric, nu12=0.0))
    found = inflate(case)
    assert found.largest_radius == pytest.approx(r, rel=5e-4)
    assert found.volume == pytest.approx(1.218524, rel=6e-4)
    softer = inflate(replace(case, fabric=replace(case.fabric, E11=5e6, E22=5e6)))
    assert 5.0 < (softer.largest_radius - r) / (found.largest_radius - r) < 15.0  # as 1/E


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("fidelity", ["axisymmetric", "full", "lumped"])
def test_cargo_falls_freely_above_a_wall_without_gas(shape: str, fidelity: str) -> None:
    """A light wall hangs slack, without pressure and contact nothing brakes. The piston is exact."""
    case = case_of(shape, 16, fidelity, law="tension_field", gravity="9.81 m/s^2")
    assert case.pressure is not None
    case = replace(case, pressure=replace(case.pressure, value=0.0), contact=(), fabric=replace(case.fabric, viscosity=0.0))
    found = simulate(case)
    assert found.impact_velocity == pytest.approx(math.sqrt(36.0 + 2.0 * 9.81 * case.shell.height), rel=2e-3)
    if fidelity == "lumped":
        assert found.impact_velocity == pytest.approx(math.sqrt(36.0 + 2.0 * 9.81 * case.shell.height), rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("fidelity", ["axisymmetric", "full"])
def test_books_of_drops_close(shape: str, fidelity: str) -> None:
    """Energy to round-off, nothing from nowhere; momentum: what the ground gave is what cargo and wall lost."""
    case = case_of(shape, 20, fidelity, law="tension_field", gravity="9.81 m/s^2")
    drop = Simulation(case)
    drop.interval = 1
    rows = []
    while True:
        new, outcome = drop.advance(most=500)
        rows.append(new.copy())
        if outcome:
            break
    found = drop.finish(outcome)
    assert abs(found.energy_error) < 1e-10
    assert max(found.energy_made.values()) < 1e-3
    assert found.doubt is None and found.missed_collisions in (0, None)
    if fidelity == "full":
        history, model = np.concatenate(rows), drop.model
        steps = history[:-1, History.TIME_STEP]
        dt = 0.5 * (np.concatenate(([0.0], steps[:-1])) + steps)
        weight = model.hoop.whole * (model.n2 * model.mass.sum() + model.cargo_mass) * model.gravity
        impulse = float(np.sum(dt * (history[:-1, History.GROUND_FORCE] - weight)))
        w = grid_view(drop.state.nodes.w, model)
        after = model.hoop.whole * float(model.mass @ w.sum(axis=1) + model.cargo_mass * w[-1, 0])
        before = -6.0 * model.hoop.whole * float(model.n2 * model.mass[1:].sum() + model.cargo_mass)
        assert after - before == pytest.approx(impulse, abs=1e-10 * abs(before))


REFUSED = [
    (
        "{profile: barrel, lower_diameter: 1 m, upper_diameter: 1 m, height: 1 m, bulge: 0.4 m}",
        "shell.bulge: an arc of 0.4 m does not",
    ),
    (
        "{profile: barrel, lower_diameter: 2 m, upper_diameter: 1 m, height: 0.6 m, bulge: 0.4 m}",
        "is cut by a cover; a larger radius",
    ),
    ("{profile: sphere, diameter: 1 m, lower_diameter: 1 m, upper_diameter: 0.5 m}", "a cover as wide as the ball or wider"),
    (
        "{profile: table, heights: [0 m, 0.5 m, 0.4 m], diameters: [1 m, 1 m, 1 m]}",
        "shell.heights.2: not above the value before it",
    ),
    (
        "{profile: table, heights: [0.1 m, 0.5 m], diameters: [1 m, 1 m]}",
        "shell.heights.0: not at the lower cover; 0 m is expected",
    ),
    (
        "{profile: table, heights: [0, 0.33, 1], diameters: [1.8, 0.0994, 1.9]}",
        "shell.diameters.1: the wall comes to 0.0497 m from",
    ),
    (
        "{profile: cone, lower_diameter: 1 m, upper_diameter: 0.04 m, height: 1 m}",
        "shell.upper_diameter: the wall comes to 0.02 m",
    ),
    (
        "{profile: pattern, height: 1.5 m, lengths: [0 m, 1 m], diameters: [1 m, 1 m]}",
        "1 m of cloth do not reach from cover to cover",
    ),
    (
        "{profile: pattern, height: 0.1 m, lengths: [0 m, 0.2 m, 1 m], diameters: [0.4 m, 1 m, 1 m]}",
        "row 1: the radius changes by 0.3 m; 0.2 m",
    ),
    ("{profile: pattern, height: 1.8, lengths: [0, 0.94, 1.88], diameters: [2, 0.5, 2]}", "row 2: a hoop of 0.5 m would hang at"),
    ("{profile: cone, diameter: 1 m, height: 1 m}", "shell.diameter: not a key of the profile cone; profile, lower_diameter"),
]


@pytest.mark.parametrize(("shape", "message"), REFUSED, ids=[message[:30] for _, message in REFUSED])
def test_profiles_that_cannot_be_are_refused(shape: str, message: str) -> None:
    with pytest.raises(CaseError) as caught:
        case_of(shape, box=0.02)
    assert any(message in fault for fault in caught.value.faults), caught.value.faults


def test_a_pattern_has_no_piston() -> None:
    with pytest.raises(CaseError, match="a pattern no volume before it is blown up; another fidelity, or another profile"):
        case_of("{profile: pattern, height: 0.9, lengths: [0, 1], diameters: [1, 1]}", fidelity="lumped")


@pytest.mark.parametrize("shape", [*SHAPES, "{profile: pattern, height: 0.9, lengths: [0, 0.5, 1.1], diameters: [1, 1.2, 0.9]}"])
def test_a_resolved_case_has_the_same_shell(shape: str) -> None:
    case = case_of(shape)
    written = json.loads(json.dumps(case_to_dict(case)))
    assert parse_case(json.dumps(written), "shape.yaml") == case
    assert shell_of(written["shell"]) == case.shell


def test_mass_does_not_depend_on_where_rows_meet_a_kink() -> None:
    """Of the wall of a table: that of its cloth, for rows that meet no kink as well, but for hoops cut at it."""
    areas = []
    for cells in (20, 21, 22, 23):
        model = build_model(case_of("table", cells))
        areas.append(model.hoop.whole * model.n2 * float(model.mass.sum()) / 0.1)
    assert areas == pytest.approx([case_of("table").shell.area] * 4, rel=2e-3)
