"""Gas in a shell: its volume and adiabat, statics and drops of the elastic cylinder, limits of stiff and of light walls."""

from dataclasses import replace
from itertools import pairwise
from math import pi
from typing import Any, NamedTuple

import naive
import numpy as np
import pytest
from exact import Floats
from gas_scenes import AMBIENT, GRAVITY, finish, gas_case, keeps, orifice
from naive_gas import mass_flux
from test_gas import fitted_order, full_stop

from benchmarks.gas import Found
from softbrake.case.case import Case
from softbrake.core.arrays import GasState, Model, Outcome
from softbrake.core.columns import History
from softbrake.sim.build import grid_view, meridian_view
from softbrake.sim.inflate import volume
from softbrake.sim.relax import relax
from softbrake.sim.simulation import Simulation
from softbrake.sim.stored import stored_energy
from softbrake.sim.summary import Summary

pytestmark = pytest.mark.kernels

LENGTH, FILLED = 0.6, AMBIENT + 15.7e3  # m, Pa
STRIDE = 40  # steps between looks


def shell_case(
    generatrix: int, hoop: int = 720, fidelity: str = "axisymmetric", piston: str = "S3", contact: str = "solid", **more: Any
) -> Case:
    return gas_case(piston, grid={"generatrix": generatrix, "hoop": hoop}, model={"fidelity": fidelity}, contact=contact, **more)


def answer(case: Case) -> Summary:
    drop = Simulation(case)
    return drop.finish(finish(drop)[1])


def places(drop: Simulation) -> Floats:
    """Of the whole shell's nodes (m), (n1+1, n2, 3)."""
    model, nodes = drop.whole_shell()
    return np.stack([grid_view(part, model) for part in nodes[:3]], axis=-1)


def volume_of_twin(drop: Simulation) -> float:
    """Volume (m^3) by patches, or of the axisymmetric shell by truncated cones."""
    if drop.case.model.fidelity == "full":
        x, model = places(drop), drop.model
        return model.hoop.whole * (model.hoop.gas * naive.wall_volume(x) + model.cover_area * float(x[-1, 0, 2]) / 3.0)
    nodes = meridian_view(drop.state.nodes, drop.model)
    r, z = nodes.x, nodes.z
    return float(pi / 3.0 * (np.diff(z) * (r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2)).sum())


# --- volume ----------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fidelity", "grid", "contact", "most"),
    [
        ("axisymmetric", (24, 720), "solid", 1e-9),
        ("axisymmetric", (24, 720), "full", 1e-9),
        ("full", (12, 24), "full", 5e-7),  # carried on from step to step, where folds do not meet
        ("full", (12, 24), "solid", 5e-7),
        ("full", (24, 48), "solid", 1e-8),
    ],
)
def test_closed_shell_keeps_the_adiabat_of_its_volume(fidelity: str, grid: tuple[int, int], contact: str, most: float) -> None:
    """P V^gamma over the whole drop, V from the nodes alone, by other ways than the kernels'; it does not drift."""
    drop = Simulation(shell_case(*grid, fidelity, contact=contact))
    start, begun = drop.volume(), float(drop.state.gas[GasState.MASS])
    assert drop.now(History.VOLUME) == start
    if fidelity == "full":
        drop.disturb(1e-4, 1)
    errors, outcome = [], Outcome.RUNNING
    while outcome == Outcome.RUNNING:
        now = volume_of_twin(drop)
        assert drop.volume() == pytest.approx(now, rel=1e-13)
        assert volume(places(drop), drop.whole_shell()[0]) == pytest.approx(now, rel=1e-13)
        rows, outcome = drop.advance(most=1)  # its row is of the time of those nodes
        if drop.state.steps[0] > 1:
            errors.append(float((AMBIENT + rows[0, History.PRESSURE]) / FILLED * (now / start) ** 1.4 - 1.0))
        keeps(drop, begun)
        if outcome == Outcome.RUNNING:
            _, outcome = drop.advance(most=STRIDE)
    assert outcome == Outcome.REBOUND
    assert len(errors) > 50
    assert np.abs(errors).max() < most
    assert abs(np.mean(errors[-20:])) < max(2.0 * abs(np.mean(errors[:-20])), most)


@pytest.mark.slow
def test_volume_of_the_full_shell_is_carried_on_with_order_three() -> None:
    """What a step foretells of the volume at its end, against the nodes there."""
    errors = []
    for courant in (0.8, 0.4, 0.2):
        drop, outcome, off = Simulation(shell_case(12, 24, "full", time={"courant": courant})), Outcome.RUNNING, []
        while outcome == Outcome.RUNNING:
            _, outcome = drop.advance(most=7)
            if outcome == Outcome.RUNNING:
                off.append(abs(drop.state.gas[GasState.NEXT_VOLUME] / volume_of_twin(drop) - 1.0))
        errors.append(float(np.median(off)))
    assert fitted_order(errors) == pytest.approx(3.0, abs=0.2)


def test_pressure_work_on_the_shell_is_that_of_the_gas() -> None:
    """Over nodes and cargo, against the gas's own first law less the work on the air around: of order two in the step."""
    errors = []
    for courant in (0.8, 0.4, 0.2, 0.1):
        drop = Simulation(shell_case(12, time={"courant": courant, "end": 0.12}, vents=orifice(0.005, 0.6)))
        filled = drop.volume()
        rows = finish(drop)[0][1:-1]
        between = 0.5 * (rows[:-1, History.WORK_PRESSURE] + rows[1:, History.WORK_PRESSURE])
        gas = rows[:-1, History.GAS_WORK] - AMBIENT * (rows[:-1, History.VOLUME] - filled)
        errors.append(float(np.sqrt(np.mean((between - gas) ** 2))))
        assert np.abs(gas).max() > 1e3 * errors[-1]
    assert fitted_order(errors) == pytest.approx(2.0, abs=0.2)


# --- statics ---------------------------------------------------------------------------------------------------------------

# The elastic closed cylinder squeezed between ground and cargo, wall without mass, adiabatic: by height over length the gauge
# pressure (Pa), force on the cover (N), volume (m^3), largest radius (m). Shooting along the meridian: free, on the ground and on
# the cargo's side it obeys N1' = N2 sin psi/R and N1 psi' = N2 cos psi/R - p l1 l2, as exact.Membrane says.
SQUEEZED = {
    1.0: (15700.0000, 1645.88400, 0.162185444, 0.3038135),
    0.9: (17840.2653, 3663.85595, 0.160099400, 0.3149893),
    0.8: (21061.1683, 4809.42913, 0.157078368, 0.3292506),
    0.7: (24998.2361, 5912.79851, 0.153565729, 0.3459977),
    0.6: (29536.3522, 7298.33462, 0.149742686, 0.3639540),
    0.5: (34965.4407, 9125.62583, 0.145457335, 0.3827120),
    0.4: (41611.0551, 11604.34503, 0.140593995, 0.4016949),
    0.3: (49672.6405, 14927.05714, 0.135190604, 0.4201558),
    0.1: (69214.0087, 24154.89969, 0.123934996, 0.4531660),
}


class AtRest(NamedTuple):
    """A shell under a held cover."""

    pressure: float  # Pa, gauge
    force: float  # N
    volume: float  # m^3
    radius: float  # m, largest
    energy: float  # J, of fabric, gas and air


class Press:
    """A closed shell between ground and a held cover that is lowered, its gas on the adiabat of the volume."""

    def __init__(self, generatrix: int) -> None:
        self.drop = Simulation(shell_case(generatrix, gravity=0))
        self.steady = self.drop.model._replace(gas=self.drop.model.gas._replace(exponent=0.0))
        self.start, self.height = self.drop.volume(), LENGTH

    def step(self, model: Model) -> Outcome:
        gauge = FILLED * (self.start / volume_of_twin(self.drop)) ** 1.4 - AMBIENT
        return self.drop.step(model._replace(pressure=model.pressure._replace(value=gauge, most=gauge)))

    def lower(self, height: float) -> AtRest:
        """Go to a height (m) by steps of a fiftieth of the length, and let the shell come to rest there."""
        drop, nodes = self.drop, meridian_view(self.drop.state.nodes, self.drop.model)
        for target in np.linspace(self.height, height, 1 + int(np.ceil(abs(self.height - height) / (0.02 * LENGTH))))[1:]:
            nodes.z[:] *= target / self.height
            drop.state.now[History.HEIGHT] = self.height = float(target)
            relax(self.steady, drop.state, self.step, 1e-2)
        assert relax(self.steady, drop.state, self.step, 1e-7).converged
        filled = volume_of_twin(drop)
        inner = FILLED * (self.start / filled) ** 1.4 * filled / 0.4
        stored = sum(stored_energy(drop.model, drop.state.nodes))
        return AtRest(
            drop.now(History.PRESSURE),
            drop.now(History.COVER_FORCE),
            filled,
            float(nodes.x.max()),
            inner + AMBIENT * filled + stored,
        )


@pytest.mark.slow
def test_elastic_cylinder_squeezed() -> None:
    """At every height to 0.3 %: in tension everywhere, on the ground from 0.916, on the cargo's side from 0.808 of its length."""
    press = Press(72)
    for part, exact in SQUEEZED.items():
        found = press.lower(part * LENGTH)
        assert found[:4] == pytest.approx(exact, rel=3e-3)
        assert found.volume == pytest.approx(exact[2], rel=4e-4)


@pytest.mark.slow
def test_elastic_cylinder_squeezed_converges_with_order_two() -> None:
    """The volume, and the force where nothing touches; elsewhere it jumps with the number of nodes that touch."""
    volumes: dict[float, list[float]] = {1.0: [], 0.9: [], 0.5: [], 0.3: []}
    forces = []
    for generatrix in (18, 36, 72):
        press = Press(generatrix)
        for part, errors in volumes.items():
            found, (_, force, filled, _) = press.lower(part * LENGTH), SQUEEZED[part]
            errors.append(found.volume / filled - 1.0)
            if part == 1.0:
                forces.append(found.force / force - 1.0)
    assert [fitted_order(errors) for errors in (*volumes.values(), forces)] == pytest.approx([2.0] * 5, abs=0.15)


# --- drops -----------------------------------------------------------------------------------------------------------------

DROPPED = (0.248935041, 0.0938019, 40533.6, 10.4060)  # m, s, Pa, g0: 100 kg at 6 m/s, wall without mass


def test_drop_of_the_elastic_cylinder() -> None:
    """A wall of 50 g/m^2 on 36 cells, to 0.5 %."""
    found = answer(shell_case(36))
    assert found.outcome == "rebound"
    here = (found.lowest_height, found.rest_time, found.peak_pressure, found.peak_deceleration / GRAVITY)
    assert here == pytest.approx(DROPPED, rel=2e-3)
    assert found.rebound_velocity == pytest.approx(6.0, rel=1e-3)


@pytest.mark.slow
def test_drop_of_the_elastic_cylinder_converges() -> None:
    """With order two in the edge, a wall of 5 g/m^2."""
    errors = []
    for generatrix in (18, 36, 72):
        found = answer(shell_case(generatrix, fabric={"areal_density": 0.005}, time={"after": "stop"}))
        errors.append((found.lowest_height / DROPPED[0] - 1.0, found.rest_time / DROPPED[1] - 1.0))
    for part in zip(*errors, strict=True):
        assert fitted_order(list(part)) == pytest.approx(2.0, abs=0.25)
    assert np.abs(errors[-1]).max() < 5e-4


def test_stiff_wall_tends_to_the_piston() -> None:
    """It can neither widen nor bear compression: what is left goes with 1/E. Wall nearly without mass."""
    exact, errors = full_stop("S1", 1.4), []
    for stiffness in (1e6, 1e7, 1e8):
        fabric = {"areal_density": 1e-3, "E": stiffness}
        found = answer(shell_case(12, piston="S1", fabric=fabric, time={"after": "stop"}))
        errors.append(found.lowest_height / exact - 1.0)
    assert abs(errors[-1]) < 1e-4
    assert [np.log10(before / after) for before, after in pairwise(errors)] == pytest.approx([1.0, 1.0], abs=0.05)


def test_light_wall_tends_to_one_without_mass() -> None:
    """Lowest heights less that at which fabric, gas and air at rest on the same grid have the energy: it goes with the mass."""
    press, case = Press(24), shell_case(24, time={"after": "stop"})
    begun = press.lower(LENGTH).energy

    def left(height: float) -> float:
        given = 0.5 * case.cargo.mass * case.cargo.velocity**2 + case.cargo.mass * GRAVITY * (LENGTH - height)
        return given - (press.lower(height).energy - begun)

    (before, height), missed = (0.26, 0.25), left(0.26)
    while abs(height - before) > 1e-9:  # secants
        here = left(height)
        before, height, missed = height, height - here * (height - before) / (here - missed), here
    errors, densities = [], (0.05, 0.005, 0.0005)
    for density in densities:
        light = replace(case, fabric=replace(case.fabric, areal_density=density, viscosity=density))
        errors.append(answer(light).lowest_height - height)
    order = float(np.polyfit(np.log(densities), np.log(np.abs(errors)), 1)[0])
    assert order == pytest.approx(1.0, abs=0.1)
    assert abs(errors[-1]) < 1e-4 * height


# --- hard presses, rebound -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fidelity", ["axisymmetric", "full"])
def test_wall_leaks_where_it_lies_on_nothing(fidelity: str) -> None:
    """All of a stiff cylinder, whose first outflow is that of an orifice; of a soft one pressed to half no more than is left."""
    stiff = Simulation(shell_case(24, 48, fidelity, "S1", fabric={"E": "100 MN/m"}, leakage=0.004))
    stiff.advance(most=2)
    wall = pi * 0.4 * 0.3
    assert stiff.state.gas[GasState.FREE_AREA] == pytest.approx(wall, rel=1e-4)
    flux = mass_flux(AMBIENT + stiff.now(History.PRESSURE), stiff.now(History.TEMPERATURE), AMBIENT, 1.4, 287.05287)
    assert stiff.now(History.VENT_FLOW) == pytest.approx(0.004 * wall * flux, rel=1e-3)
    soft = Simulation(shell_case(24, 48, fidelity, leakage=0.004))
    soft.advance(most=2)
    begun = soft.state.gas[GasState.FREE_AREA]
    while soft.now(History.HEIGHT) > 0.5 * LENGTH:
        soft.advance(most=20)
    lying = soft.now(History.GROUND_AREA) - pi * 0.25**2
    assert 0.03 < lying < 0.05
    assert soft.state.gas[GasState.FREE_AREA] < begun - 2.0 * lying  # as much lies at the cargo's side, and the wall is longer


def test_shell_pressed_to_a_fiftieth_of_its_volume() -> None:
    """A wall that can bear it: the cargo comes back with its energy, but for what viscosity and blows have taken."""
    case = shell_case(8, piston="S1", cargo={"mass": 800.0, "velocity": 9.0}, fabric={"E": 1e8})
    drop = Simulation(case)
    rows, outcome = finish(drop)
    found = drop.finish(outcome)
    assert rows[:, History.VOLUME].min() < 0.02 * rows[0, History.VOLUME]
    assert found.outcome == "rebound"
    begun = 0.5 * 800.0 * 9.0**2
    taken = found.work.viscous + found.work.contact + found.work.ground
    assert -0.03 * begun < taken < 0.0
    assert 0.5 * 800.0 * found.rebound_velocity**2 == pytest.approx(begun + taken, rel=5e-3)
    assert max(found.energy_made.values()) < 1e-6


def test_both_shells_and_their_pistons_rebound_alike() -> None:
    """The full shell as the axisymmetric one on the same cells; both as a piston where the wall is stiff."""
    names = (
        "lowest_height",
        "rest_time",
        "end_time",
        "rebound_velocity",
        "peak_pressure",
        "peak_temperature",
        "peak_deceleration",
    )

    def answers(case: Case) -> list[float]:
        found = answer(case)
        assert found.outcome == "rebound"
        return [getattr(found, name) for name in names]

    full, one = (answers(shell_case(12, 48, fidelity)) for fidelity in ("full", "axisymmetric"))
    assert full == pytest.approx(one, rel=1e-4)
    stiff = {"E": 1e7, "areal_density": 0.01}
    shell, piston = answers(shell_case(12, piston="S1", fabric=stiff)), answers(gas_case("S1"))
    assert shell == pytest.approx(piston, rel=5e-3)


def test_closed_bag_that_stays_on_the_ground_ends_at_the_top_of_its_first_rebound() -> None:
    """Nothing lower follows: its damping has taken more than the cargo came with."""
    case = shell_case(12, cargo={"mass": 300.0, "velocity": 0.01})
    drop = Simulation(case)
    rows, outcome = finish(drop)
    found = drop.finish(outcome)
    assert (found.outcome, found.rebound_velocity) == ("stopped", None)
    assert found.lowest_height < 0.95 * LENGTH
    assert found.lowest_height < drop.now(History.HEIGHT) < LENGTH
    assert found.rest_time < 0.6 * found.end_time
    assert drop.now(History.VELOCITY) == pytest.approx(0.0, abs=1e-9)
    assert (rows[rows[:, History.TIME] > found.rest_time + 1e-3, History.VELOCITY] > -1e-9).all()
    lowest = answer(replace(case, time=replace(case.time, after="stop")))
    assert (lowest.outcome, lowest.end_time) == ("stopped", pytest.approx(found.rest_time))
    assert lowest.lowest_height == pytest.approx(found.lowest_height, rel=1e-9)
    assert found.peak_pressure == pytest.approx(rows[:, History.PRESSURE].max(), rel=1e-12)


# --- random ----------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [range(10), range(10, 20), (116, 179, 463, 480)], ids=["0", "10", "pressed flat"])
def test_random_drops_come_to_an_end_and_make_no_energy(seeds: range | tuple[int, ...]) -> None:
    """A sample of the five hundred of benchmarks/gas.py, and of those whose last gas is pressed out on the ground."""
    found = Found()
    for seed in seeds:
        found.drop(seed)
    assert not found.failures
    assert max(found.made.values()) < 0.01
    assert all(made < 0.02 for made in found.undamped.values())
    assert found.energy < 1e-10
    assert found.mass < 5e-12
    assert sum(found.outcomes.values()) == len(seeds)
