"""The gas of a piston: exact strokes, a slow twin of all that flows, orders of convergence, limp walls, ledgers."""

from math import pi, sqrt
from typing import Any, NamedTuple

import numpy as np
import pytest
from exact import free_fall
from gas_scenes import AMBIENT, GRAVITY, MARS, PISTONS, at_height, entropy, finish, gas_case, orifice
from naive_gas import HEIGHT, MASS, VELOCITY, Orifice, Piston, critical_ratio, mass_flux

from softbrake.core.arrays import GasState, Outcome
from softbrake.core.columns import History
from softbrake.core.pressure import update_pressure
from softbrake.sim.simulation import Simulation

pytestmark = pytest.mark.kernels

VENT, DISK = orifice(0.03, 0.6), orifice(0.04, 0.7, opens={"pressure": 60e3})
THIN_AIR = {"gamma": 1.3, "constant": 188.92, "temperature": 220.0, "ambient": 600.0, "gravity": 3.72076}
COURANT = [0.95 / 2**k for k in range(5)]


def level(value: float) -> Any:
    """A discharge coefficient that is the same at all pressures."""
    return lambda _: value


def twin(name: str, *orifices: Orifice, **more: Any) -> Piston:
    return Piston(*PISTONS[name], orifices=orifices, **more)


def drop_to(end: float, name: str, courant: float | str = "auto", **more: Any) -> Simulation:
    """A drop to a time (s), exactly."""
    drop = Simulation(gas_case(name, time={"end": end, "courant": courant}, **more))
    assert finish(drop)[1] == Outcome.TIME_LIMIT
    return drop


def fitted_order(errors: list[float]) -> float:
    """Slope of the errors of steps, each half of the one before it."""
    return -float(np.polyfit(np.arange(len(errors)), np.log2(np.abs(errors)), 1)[0])


def bisect(rising: Any, low: float, high: float) -> float:
    """Zero of a function that is negative below it."""
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if rising(middle) < 0.0 else (low, middle)
    return 0.5 * (low + high)


# --- closed ----------------------------------------------------------------------------------------------------------------


def full_stop(name: str, exponent: float) -> float:
    """Height (m) at which the gas has all energy of the cargo: P V^n constant, no heat left out."""
    diameter, height, mass, velocity, pressure = PISTONS[name]
    area = 0.25 * pi * diameter**2

    def left(h: float) -> float:
        ratio = height / h
        stored = np.log(ratio) if exponent == 1.0 else (ratio ** (exponent - 1.0) - 1.0) / (exponent - 1.0)
        work = area * ((AMBIENT + pressure) * height * stored - AMBIENT * (height - h))
        return float(0.5 * mass * velocity**2 + mass * GRAVITY * (height - h) - work)

    return bisect(left, 1e-3 * height, height)


@pytest.mark.parametrize(
    ("name", "process", "peak", "net", "hottest", "lowest", "rest", "end"),
    [
        ("S1", "adiabatic", 149296.1, 39.9806, 319.222, 0.232239, 0.0210356, 0.0420711),
        ("S1", "isothermal", 142011.4, 33.7574, 288.15, 0.220387, 0.0247873, 0.0495746),
        ("S2", "adiabatic", 276555.8, 15.8407, 364.633, 0.555144, 0.0884504, 0.176901),
        ("S3", "adiabatic", 202991.5, 19.3557, 337.257, 0.404851, 0.0513413, 0.102683),
        ("S3", "isothermal", 187782.2, 16.3105, 288.15, 0.373917, 0.0599831, 0.119966),
    ],
)
def test_closed_pistons(
    name: str, process: str, peak: float, net: float, hottest: float, lowest: float, rest: float, end: float
) -> None:
    """The cargo stops where the gas has its energy, and leaves with it: at the default step to 1e-6."""
    diameter, height, mass, velocity, pressure = PISTONS[name]
    exponent = 1.0 if process == "isothermal" else 1.4
    drop = Simulation(gas_case(name, gas={"process": process}))
    rows, outcome = finish(drop)
    found = drop.finish(outcome)
    h = full_stop(name, exponent)
    absolute = (AMBIENT + pressure) * (height / h) ** exponent
    assert found.outcome == "rebound"
    assert found.lowest_height == pytest.approx(h, rel=1e-6)
    assert found.peak_pressure == pytest.approx(absolute - AMBIENT, rel=1e-6)
    assert found.peak_temperature == pytest.approx(288.15 * (height / h) ** (exponent - 1.0), rel=1e-6)
    by_force = (absolute - AMBIENT) * 0.25 * pi * diameter**2 / mass - GRAVITY
    assert found.peak_deceleration == pytest.approx(by_force, rel=1e-6)
    assert found.rebound_velocity == pytest.approx(velocity, rel=1e-6)
    assert found.end_time == pytest.approx(2.0 * found.rest_time, rel=1e-6)  # the way up is that down, reversed
    assert abs(found.peaks["peak_pressure"].time - found.rest_time) < rows[:, History.TIME_STEP].max()
    digits = (found.lowest_height, found.rest_time, found.end_time, found.peak_pressure + AMBIENT, found.peak_temperature)
    assert digits == pytest.approx((lowest, rest, end, peak, hottest), rel=5e-6)
    assert found.peak_deceleration == pytest.approx(net * GRAVITY, rel=3e-6)


@pytest.mark.parametrize("name", ["S1", "S2", "S3"])
def test_closed_piston_stops_at_the_root_of_its_energy(name: str) -> None:
    """At a fine step to 1e-9; the error is one of second order."""
    errors = []
    for courant in (0.08, 0.04, 0.02):
        drop = Simulation(gas_case(name, time={"courant": courant, "after": "stop"}))
        assert finish(drop)[1] == Outcome.STOPPED
        errors.append(drop.now(History.HEIGHT) / full_stop(name, 1.4) - 1.0)
    assert abs(errors[-1]) < 1e-9
    assert fitted_order(errors) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(("process", "exponent"), [("adiabatic", 1.4), ("isothermal", 1.0), ("polytropic", 1.2)])
def test_closed_gas_keeps_its_polytrope(process: str, exponent: float) -> None:
    """At every step, with heat as the first law has it: cv dT + P dV/m."""
    choice = {"process": process} | ({"exponent": exponent} if process == "polytropic" else {})
    drop = Simulation(gas_case("S2", gas=choice))
    rows, _ = finish(drop)
    kept = (AMBIENT + rows[:, History.PRESSURE]) * rows[:, History.VOLUME] ** exponent
    assert kept == pytest.approx(np.full(len(rows), kept[0]), rel=1e-12)
    middle = len(rows) // 2
    before, after = rows[0], rows[middle]
    capacity = after[History.GAS_MASS] * 287.05287 / 0.4
    work = np.trapezoid(AMBIENT + rows[: middle + 1, History.PRESSURE], rows[: middle + 1, History.VOLUME])
    heat = capacity * (after[History.TEMPERATURE] - before[History.TEMPERATURE]) + work
    assert after[History.HEAT] == pytest.approx(heat, abs=1e-5 * abs(work))
    assert (abs(after[History.HEAT]) < 1e-9) == (process == "adiabatic")


# --- what flows ------------------------------------------------------------------------------------------------------------


class Row(NamedTuple):
    """Sections, twin, and published values: largest absolute pressure (Pa) and its time (s), net (g0), temperature (K)."""

    name: str
    sections: dict[str, Any]
    piston: dict[str, Any]
    orifices: tuple[tuple[Any, ...], ...]
    peak: tuple[float, float, float, float]
    speeds: dict[float, float]  # m/s, at heights (m), of the last fall through them
    switched: tuple[float, ...] = ()  # s


DISK_TWIN = (0.04, level(0.7), 60e3)
ROWS = {
    "b1": Row(
        "S2",
        {"vents": VENT},
        {},
        ((0.03, level(0.6)),),
        (195538.6, 0.0876665, 8.05449, 330.249),
        {0.8: 7.05073, 0.6: 5.50394, 0.4: 1.01759, 0.2: 1.58306, 0.01: 1.79067},
    ),
    "b3": Row(
        "S2",
        {"vents": DISK},
        {},
        (DISK_TWIN,),
        (172451.4, 0.0599030, 5.83567, 318.604),
        {0.815842: 6.95379, 0.8: 6.84512, 0.6: 5.03428, 0.4: 2.51414, 0.2: 2.30567, 0.01: 2.55654},
        (0.0250033,),
    ),
    "b4h": Row(
        "S2",
        {"vents": orifice(0.04, 0.7, opens={"pressure": 60e3}, closes={"height": 0.4}), "time": {"end": 0.25}},
        {},
        ((*DISK_TWIN, np.inf, -np.inf, -np.inf, 0.4),),
        (182364.2, 0.165657, 6.78835, 323.733),
        {0.4: 2.51414},
        (0.0250033, 0.116057),
    ),
    "b8": Row(
        "S2",
        {"vents": orifice(0.03, 0.6, opens={"time": 0.03})},
        {},
        ((0.03, level(0.6), np.inf, 0.03),),
        (202061.3, 0.0747552, 8.68136, 333.36),
        {0.01: 1.83929},
        (0.03,),
    ),
    "c1": Row("S1", {"leakage": 0.004}, {"leakage": 0.004}, (), (133350.8, 0.0207291, 26.3588, 309.085), {}),
    "c2": Row("S1", {"permeability": {"linear": 2e-5}}, {"darcy": 2e-5}, (), (135510.3, 0.0192713, 28.2037, 310.507), {}),
    "e1": Row("S4", MARS, THIN_AIR, (), (42450.53, 0.076881, 36.8621, 351.099), {}),
    "e2": Row(
        "S4",
        {**MARS, "vents": orifice(0.02, 0.7)},
        THIN_AIR,
        ((0.02, level(0.7)),),
        (28677.62, 0.078353, 24.606, 320.716),
        {0.6: 11.18021, 0.4: 9.834487, 0.2: 6.917818},
    ),
    "b3 at 3000 m": Row(
        "S2",
        {"vents": DISK, "ambient": {"altitude": "3000 m"}},
        {"ambient": 70108.5265, "temperature": 268.65},
        (DISK_TWIN,),
        (138787.8, 0.065878, 5.60048, 303.936),
        {0.01: 2.60153},
        (0.0315991,),
    ),
}
LOWEST = {"b1": (0.388525, 0.147442), "b8": (0.478632, 0.122904), "c1": (0.217565, 0.027148), "c2": (0.223745, 0.0251262)}


@pytest.mark.parametrize("name", ROWS)
def test_vented_pistons(name: str) -> None:
    """Published values, to their digits, at the default step; and the twin's course at the peak."""
    row = ROWS[name]
    drop = Simulation(gas_case(row.name, **row.sections))
    rows, outcome = finish(drop)
    found, ambient = drop.finish(outcome), drop.case.ambient.pressure
    peak, when, net, hottest = row.peak
    assert found.peak_pressure + ambient == pytest.approx(peak, rel=2e-6)
    assert found.peak_deceleration / GRAVITY == pytest.approx(net, rel=1e-5)
    assert found.peak_temperature == pytest.approx(hottest, rel=3e-6)
    first = rows[np.argmax(rows[:, History.PRESSURE] > found.peak_pressure * (1.0 - 1e-9))]
    assert abs(first[History.TIME] - when) < 1.5 * rows[:, History.TIME_STEP].max()
    for height, speed in row.speeds.items():
        assert at_height(rows, height) == pytest.approx(speed, rel=1e-5)
    if name in LOWEST:
        resting = rows[: int(np.argmax(rows[:, History.VELOCITY] > 0.0)) + 1, History.HEIGHT]
        assert (resting.min(), found.rest_time) == pytest.approx(LOWEST[name], rel=4e-6)
    piston = twin(row.name, *(Orifice(*values) for values in row.orifices), **row.piston)
    course = piston.fall(when)
    here = int(np.argmax(rows[:, History.TIME] > when)) - 1
    state = course.at(float(rows[here, History.TIME]))
    assert rows[here, History.HEIGHT] == pytest.approx(state[HEIGHT], rel=1e-6)
    assert rows[here, History.GAS_MASS] == pytest.approx(state[MASS], rel=1e-6)
    opened = [value for value in found.vent_opening_times or [] if value]
    assert opened == pytest.approx(row.switched[:1], rel=2e-6)
    for one in piston.orifices:
        assert [at for at, _ in one.times] == pytest.approx(row.switched, rel=5e-6)


class Scene(NamedTuple):
    """Sections and the orifices of the twin."""

    name: str
    sections: dict[str, Any]
    orifices: tuple[tuple[Any, ...], ...]
    piston: dict[str, Any]
    times: tuple[float, ...]  # s
    mass_error: float = 1e-5


TABLE = {"pressure_ratio": [0.5, 0.8, 1.0], "coefficient": [0.9, 0.7, 0.5]}
FED = ((0.0, 0.02, 0.06, 0.1), (0.0, 5.0, 5.0, 0.0), 500.0)
NEVER = (np.inf, np.inf, -np.inf, -np.inf, -np.inf)  # thresholds of a vent that is always open
SCENES = {
    "two vents": Scene(
        "S2",
        {
            "vents": [
                *orifice(0.02, 0.7, opens={"pressure": 40e3}),
                *orifice(0.015, 0.6, opens={"height": 0.7}, closes={"height": 0.3}),
            ]
        },
        ((0.02, level(0.7), 40e3), (0.015, level(0.6), np.inf, np.inf, 0.7, -np.inf, 0.3)),
        {},
        (0.05, 0.1, 0.2),
    ),
    "relief valve": Scene(
        "S2",
        {"vents": orifice(0.1, 0.7, opens={"pressure": 60e3}, closes={"pressure": 20e3})},
        ((0.1, level(0.7), 60e3, np.inf, -np.inf, 20e3),),
        {},
        (0.05, 0.1, 0.15),
        3e-5,
    ),
    "closes at a pressure for good": Scene(
        "S2",
        {"vents": orifice(0.06, 0.7, closes={"pressure": 30e3})},
        ((0.06, level(0.7), np.inf, np.inf, -np.inf, 30e3),),
        {},
        (0.05, 0.1, 0.15),
    ),
    "table": Scene(
        "S2",
        {"vents": orifice(0.03, TABLE)},
        ((0.03, lambda r: float(np.interp(r, TABLE["pressure_ratio"], TABLE["coefficient"]))),),
        {},
        (0.05, 0.1, 0.3),
    ),
    "no inflow": Scene("S1", {"vents": orifice(0.002, 0.6)}, ((0.002, level(0.6)),), {}, (0.03, 0.06, 0.08)),
    "inflow": Scene(
        "S1",
        {"vents": orifice(0.002, 0.6, inflow="allowed")},
        ((0.002, level(0.6), *NEVER, True),),
        {},
        (0.03, 0.06, 0.08),
        2e-4,  # of first order in the step
    ),
    "inflow and back": Scene(
        "S2", {"vents": orifice(0.02, 0.6, inflow="allowed")}, ((0.02, level(0.6), *NEVER, True),), {}, (0.2, 0.4, 0.5), 2e-4
    ),
    "inflator": Scene(
        "S2",
        {
            "vents": orifice(0.02, 0.6, opens={"time": 0.05}),
            "inflator": {"times": FED[0], "mass_flow": FED[1], "temperature": FED[2]},
        },
        ((0.02, level(0.6), np.inf, 0.05),),
        {"inflow": FED},
        (0.02, 0.05, 0.1, 0.14),
    ),
    "helium": Scene(
        "S2",
        {"gas": {"gamma": 5 / 3, "gas_constant": 2077.0}, "vents": VENT},
        ((0.03, level(0.6)),),
        {"gamma": 5 / 3, "constant": 2077.0},
        (0.05, 0.1),
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_course_of_the_twin(name: str) -> None:
    """Place, velocity, mass, pressure and temperature at times of the drop."""
    scene = SCENES[name]
    course = twin(scene.name, *(Orifice(*values) for values in scene.orifices), **scene.piston).fall(scene.times[-1])
    for time in scene.times:
        drop, state = drop_to(time, scene.name, **scene.sections), course.at(time)
        _, pressure, temperature = course.piston.inside(state)
        assert drop.now(History.HEIGHT) == pytest.approx(state[HEIGHT], abs=1e-6)
        assert drop.now(History.VELOCITY) == pytest.approx(state[VELOCITY], abs=2e-5)
        assert drop.now(History.GAS_MASS) == pytest.approx(state[MASS], rel=scene.mass_error)
        assert drop.now(History.PRESSURE) == pytest.approx(pressure - AMBIENT, abs=2.0)
        assert drop.now(History.TEMPERATURE) == pytest.approx(temperature, rel=scene.mass_error)


def test_relief_valve_opens_again_and_again() -> None:
    """At the twin's times to a step; no pressure above its threshold is seen, although no step ends there."""
    scene = SCENES["relief valve"]
    piston = twin(scene.name, *(Orifice(*values) for values in scene.orifices))
    piston.fall(0.15)
    drop = Simulation(gas_case(scene.name, time={"end": 0.15}, **scene.sections))
    rows, outcome = finish(drop)
    flows = (rows[:, History.VENT_FLOW] > 0.0).astype(int)
    changes = np.flatnonzero(np.diff(flows)) + 1
    step = rows[:, History.TIME_STEP].max()
    assert len(changes) >= 8
    assert rows[changes, History.TIME] == pytest.approx([at for at, _ in piston.orifices[0].times], abs=1.1 * step)
    assert drop.finish(outcome).peak_pressure == pytest.approx(60e3, rel=1e-9)


@pytest.mark.parametrize("closes", [59.9e3, 59.99e3, 59.999e3])
def test_relief_valve_that_falls_below_both_thresholds_in_a_step_closes(closes: float) -> None:
    """However near they are: what leaves within one step takes the pressure below that of closing."""
    vents = orifice(0.03, 0.6, opens={"pressure": 60e3}, closes={"pressure": closes})
    wide = orifice(0.03, 0.6, opens={"pressure": 60e3}, closes={"pressure": 59.5e3})
    near, far = (drop_to(0.5, "S2", vents=valve) for valve in (vents, wide))
    assert near.now(History.GAS_MASS) == pytest.approx(far.now(History.GAS_MASS), rel=0.02)


@pytest.mark.parametrize(("suction", "height", "velocity"), [(True, 0.609916, 1.62631), (False, 0.621103, 2.27502)])
def test_a_limp_wall_holds_no_suction(suction: bool, height: float, velocity: float) -> None:
    """The vent shut at 0.4 m: a rigid cylinder sucks the cargo back below ambient pressure, a limp wall lets it go."""
    piston = twin("S2", Orifice(*ROWS["b4h"].orifices[0]), suction=suction)
    state = piston.fall(0.3).at(0.3)
    assert (state[HEIGHT], state[VELOCITY]) == pytest.approx((height, velocity), rel=3e-6)
    drop = drop_to(0.3, "S2", vents=ROWS["b4h"].sections["vents"])
    assert (abs(drop.now(History.HEIGHT) - height) < 1e-6) == (not suction)
    assert (abs(drop.now(History.VELOCITY) - velocity) < 1e-5) == (not suction)


def test_flow_of_the_history_has_what_comes_in() -> None:
    """A cargo thrown up on a bag that has lost gas, and draws it in again, to what inflow of first order is off."""
    drop = Simulation(gas_case("S2", cargo={"mass": 300.0}, vents=orifice(0.03, 0.6, inflow="allowed"), gas={"pressure": 3e3}))
    rows, _ = finish(drop)
    flow, mass = rows[:, History.VENT_FLOW], rows[:, History.GAS_MASS]
    assert drop.state.gas[GasState.FILLED] > 0.1 and flow.min() < 0.0 < flow.max()
    inwards, time = np.maximum(-flow, 0.0), rows[:, History.TIME]
    assert np.trapezoid(inwards, time) == pytest.approx(drop.state.gas[GasState.FILLED], rel=5e-3)
    assert np.trapezoid(flow, time) == pytest.approx(mass[0] - mass[-1], abs=5e-3 * drop.state.gas[GasState.FILLED])


def test_inflator_into_a_rigid_volume() -> None:
    """60 l of air, fed with hot air for 40 ms, vented from 50 ms: pressure and temperature at four times, order."""
    published = {0.005: (125437.441,), 0.02: (270112.088,), 0.04: (366561.852, 554.220857), 0.15: (218841.143, 478.274955)}
    volume, final = 0.06, []
    case = gas_case(
        "S3",
        shell={"height": volume / (0.25 * pi * 0.5**2)},
        gas={"pressure": 0.0, "temperature": 293.15},
        vents=orifice(12e-4, 0.7, opens={"time": 0.05}),
        inflator={"times": [0.0, 0.005, 0.02, 0.04], "mass_flow": [0.0, 2.4, 2.4, 0.0], "temperature": 600.0},
    )
    piston = Piston(
        0.5,
        case.shell.height,
        1.0,
        0.0,
        0.0,
        temperature=293.15,
        rigid=True,
        orifices=(Orifice(12e-4, level(0.7), opens_time=0.05),),
        inflow=((0.0, 0.005, 0.02, 0.04), (0.0, 2.4, 2.4, 0.0), 600.0),
    )
    exact = piston.inside(piston.fall(0.15).at(0.15))[0]
    for steps in (150, 300, 600, 1200):
        drop = Simulation(case)
        chamber, now = drop.state.gas, drop.state.now
        for k in range(1, steps + 1):
            now[History.TIME] = 0.15 * k / steps
            update_pressure(drop.model, drop.state, 0.0, 0.0)
            at = next((at for at in published if abs(now[History.TIME] - at) < 1e-9), None)
            if at is not None:
                found = (chamber[GasState.PRESSURE], now[History.TEMPERATURE])[: len(published[at])]
                assert found == pytest.approx(published[at], rel=4e-6 if at > 0.04 else 1e-8)
        assert chamber[GasState.MASS] == pytest.approx(
            101325.0 * volume / (287.05287 * 293.15) + chamber[GasState.FILLED] - chamber[GasState.VENTED], rel=1e-12
        )
        assert chamber[GasState.FILLED] == pytest.approx(2.4 * (0.0025 + 0.015 + 0.01), rel=1e-12)
        assert abs(drop.energy_error()) < 1e-10
        final.append(chamber[GasState.PRESSURE] / exact - 1.0)
    assert fitted_order(final) == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize(
    ("name", "orifices", "sections", "piston", "time"),
    [
        ("S2", ((0.03, level(0.6)),), {"vents": VENT}, {}, 0.3),
        ("S2", (DISK_TWIN,), {"vents": DISK}, {}, 0.2),
        ("S1", (), {"leakage": 0.004}, {"leakage": 0.004}, 0.025),
        ("S1", (), {"permeability": {"linear": 2e-5}}, {"darcy": 2e-5}, 0.025),
    ],
    ids=["vented", "burst", "leakage", "permeability"],
)
def test_order_of_convergence(name: str, orifices: Any, sections: dict[str, Any], piston: dict[str, Any], time: float) -> None:
    """Height and mass at a time, over four halvings of the step."""
    exact = twin(name, *(Orifice(*values) for values in orifices), **piston).fall(time).at(time)
    errors = []
    for courant in COURANT:
        drop = drop_to(time, name, courant, **sections)
        errors.append((drop.now(History.HEIGHT) - exact[HEIGHT], drop.now(History.GAS_MASS) - exact[MASS]))
    for part in zip(*errors, strict=True):
        assert fitted_order(list(part)) == pytest.approx(2.0, abs=0.2)


# --- nozzle ----------------------------------------------------------------------------------------------------------------


def flux(inside: float, temperature: float, outside: float, **gas: float) -> float:
    """Mass flux (kg/(m^2 s)) that a drop begins with, of a vent with a discharge coefficient of 1."""
    drop = Simulation(
        gas_case(
            "S2",
            gas={"pressure": inside - outside, "temperature": temperature, **gas},
            ambient={"pressure": outside},
            vents=orifice(0.01, 1.0),
        )
    )
    return drop.now(History.VENT_FLOW) / 0.01


@pytest.mark.parametrize(
    ("inside", "temperature", "outside", "gas", "expected"),
    [
        (120000.0, 293.15, 101325.0, {}, 210.676586),
        (150000.0, 300.0, 101325.0, {}, 332.753687),
        (300000.0, 350.0, 101325.0, {}, 648.076935),
        (20000.0, 250.0, 600.0, {"gamma": 1.3, "gas_constant": 188.92}, 61.4069666),
    ],
)
def test_mass_flux(inside: float, temperature: float, outside: float, gas: dict[str, float], expected: float) -> None:
    """Through an ideal nozzle, below and above choking."""
    assert flux(inside, temperature, outside, **gas) == pytest.approx(expected, rel=1e-8)
    gamma, constant = gas.get("gamma", 1.4), gas.get("gas_constant", 287.05287)
    assert mass_flux(inside, temperature, outside, gamma, constant) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("gamma", [1.3, 1.4, 5 / 3])
def test_choking(gamma: float) -> None:
    """Without a jump into the flux of sound, P sqrt(gamma/(R T)) (2/(gamma+1))^((gamma+1)/2(gamma-1))."""
    outside, temperature, constant = 5e4, 290.0, 300.0
    sonic = outside / critical_ratio(gamma)
    exact = sonic * sqrt(gamma / (constant * temperature)) * (2.0 / (gamma + 1.0)) ** (0.5 * (gamma + 1.0) / (gamma - 1.0))
    for near in (1.0 - 1e-9, 1.0 + 1e-9):
        assert flux(sonic * near, temperature, outside, gamma=gamma, gas_constant=constant) == pytest.approx(exact, rel=2e-9)
    for over in (0.6, 0.9, 1.5, 4.0):
        found = flux(sonic * over, temperature, outside, gamma=gamma, gas_constant=constant)
        assert found == pytest.approx(mass_flux(sonic * over, temperature, outside, gamma, constant), rel=1e-12)
    choked = [flux(sonic * over, temperature, outside, gamma=gamma, gas_constant=constant) / over for over in (1.5, 3.0)]
    assert choked[0] == pytest.approx(choked[1], rel=1e-12)  # goes on rising with the pressure inside


# --- ledger ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sections", [{"vents": VENT}, {"vents": DISK}, {"leakage": 0.01}, {"permeability": {"linear": 2e-5}}])
def test_gas_that_stays_keeps_its_entropy(sections: dict[str, Any]) -> None:
    """P (V/m)^gamma, whatever has left: no heat goes in or out."""
    drop = Simulation(gas_case("S2", **sections))
    before, begun = entropy(drop), float(drop.state.gas[GasState.MASS])
    finish(drop)
    assert entropy(drop) == pytest.approx(before, rel=1e-10)
    assert drop.state.gas[GasState.MASS] < 0.6 * begun


@pytest.mark.parametrize("sections", [{}, {"vents": VENT}, {"vents": DISK}], ids=["closed", "vented", "burst"])
def test_work_on_the_cargo_is_that_of_the_gas_less_that_on_the_air(sections: dict[str, Any]) -> None:
    """Two ledgers, of order two in the step: force times way over a step, and the gas's own first law."""
    errors = []
    for courant in COURANT:
        drop = Simulation(gas_case("S2", time={"courant": courant, "end": 0.12}, **sections))
        filled = drop.volume()
        rows = finish(drop)[0][1:-1]  # works begin at a whole step, and end there
        between = 0.5 * (rows[:-1, History.WORK_PRESSURE] + rows[1:, History.WORK_PRESSURE])  # those at half-steps
        gas = rows[:-1, History.GAS_WORK] - AMBIENT * (rows[:-1, History.VOLUME] - filled)
        errors.append(float(np.abs(between - gas).max()))
        assert np.abs(gas).max() > 1e3 * errors[-1]
    assert fitted_order(errors) == pytest.approx(2.0, abs=0.1)


# --- limp ------------------------------------------------------------------------------------------------------------------


def test_a_bag_less_than_full_brakes_only_when_it_is() -> None:
    """Filled below ambient pressure: free fall to the volume the gas has there, then its adiabat from that."""
    diameter, height, mass, velocity, _ = PISTONS["S3"]
    missing = -20e3
    full = height * (1.0 + missing / AMBIENT)  # at the outside's temperature
    drop = Simulation(gas_case("S3", gas={"pressure": missing}))
    rows, outcome = finish(drop)
    found, area = drop.finish(outcome), 0.25 * pi * diameter**2
    limp = rows[:, History.HEIGHT] >= full
    assert limp.sum() > 100
    assert (rows[limp, History.PRESSURE] == 0.0).all()
    gauge = AMBIENT * ((full / rows[~limp, History.HEIGHT]) ** 1.4 - 1.0)
    assert rows[~limp, History.PRESSURE] == pytest.approx(gauge, rel=1e-9, abs=1e-6)
    assert at_height(rows, full) == pytest.approx(free_fall(height - full, velocity, GRAVITY)[0], rel=1e-6)

    def left(h: float) -> float:
        work = area * AMBIENT * (full * ((full / h) ** 0.4 - 1.0) / 0.4 - (full - h))
        return 0.5 * mass * velocity**2 + mass * GRAVITY * (height - h) - work

    assert found.lowest_height == pytest.approx(bisect(left, 0.1, full), rel=1e-6)
    assert (found.outcome, found.rebound_velocity) == ("rebound", pytest.approx(velocity, rel=1e-6))


def test_a_limp_bag_that_comes_back_is_on_the_same_adiabat() -> None:
    """Shut after it has vented, thrown up, limp, and pressed again: gauge pressure by the volume alone, and never below 0."""
    drop = Simulation(gas_case("S2", vents=ROWS["b4h"].sections["vents"]))
    rows, outcome = finish(drop)
    assert outcome == Outcome.TIME_LIMIT
    rows = rows[rows[:, History.TIME] > 0.12]
    volume, gauge = rows[:, History.VOLUME], rows[:, History.PRESSURE]
    first = rows[0]
    free = first[History.VOLUME] * (1.0 + first[History.PRESSURE] / AMBIENT) ** (1.0 / 1.4)
    expected = AMBIENT * (np.maximum(free / volume, 1.0) ** 1.4 - 1.0)
    assert gauge == pytest.approx(expected, rel=1e-9, abs=1e-5)
    limp = volume > free
    turns = np.count_nonzero(np.diff(limp.astype(int)))
    assert (gauge[limp] == 0.0).all()
    assert turns == 3  # pressed, limp, pressed again, limp
    lowest = [
        rows[k, History.HEIGHT] for k in range(1, len(rows) - 1) if rows[k - 1, History.VELOCITY] < 0 <= rows[k, History.VELOCITY]
    ]
    assert lowest == pytest.approx([lowest[0]] * len(lowest), rel=1e-6)


# --- hard presses, rebound -------------------------------------------------------------------------------------------------


def test_pressed_to_a_fiftieth_of_its_volume() -> None:
    """A heavy, fast cargo on a closed bag: it comes back with its energy."""
    case = gas_case("S3", cargo={"mass": 4000.0, "velocity": 9.0})
    drop = Simulation(case)
    rows, outcome = finish(drop)
    found = drop.finish(outcome)
    assert rows[:, History.VOLUME].min() < 0.02 * rows[0, History.VOLUME]
    assert (found.outcome, found.rebound_velocity) == ("rebound", pytest.approx(9.0, rel=1e-5))


@pytest.mark.parametrize("mass", [12e3, 40e3])
def test_leaking_bag_pressed_flat(mass: float) -> None:
    """The wall that leaks is pressed flat with the bag: the last gas stops the cargo within a millimetre of the ground."""
    diameter, height, _, velocity, pressure = PISTONS["S2"]
    course = Piston(diameter, height, mass, velocity, pressure, leakage=0.05).fall(1.0, 1e-4)
    rows, outcome = finish(Simulation(gas_case("S2", cargo={"mass": mass}, leakage=0.05)))
    assert outcome == Outcome.REBOUND
    for low, error in ((0.05, 1e-6), (0.01, 5e-5), (0.001, 5e-4)):
        assert at_height(rows, low) == pytest.approx(-course.passes(low)[1], rel=error)


def test_a_run_to_full_stop_and_one_to_lift_off() -> None:
    """A closed bag has its peaks at the lowest point, one that vents before; both runs know the same."""
    for sections in ({}, {"vents": VENT}):
        to_stop, on = (Simulation(gas_case("S2", time={"after": after, "end": 0.2}, **sections)) for after in ("stop", "rebound"))
        stopped, risen = (drop.finish(finish(drop)[1]) for drop in (to_stop, on))
        assert stopped.outcome == "stopped"
        assert stopped.rebound_velocity is None
        assert (stopped.end_time, stopped.lowest_height) == pytest.approx((risen.rest_time, risen.lowest_height), rel=1e-9)
        assert stopped.rest_time == risen.rest_time
        names = ("peak_deceleration", "peak_pressure", "peak_temperature")
        assert [getattr(stopped, name) for name in names] == pytest.approx([getattr(risen, name) for name in names], rel=1e-5)
    assert risen.outcome == "time_limit"


def test_a_stroke_of_less_than_a_step_ends_at_lift_off() -> None:
    """A light cargo on a strong bag: down and up again, half as long each as its velocity over its deceleration."""
    drop = Simulation(gas_case("S2", cargo={"mass": 0.5, "velocity": 0.5}))
    found = drop.finish(finish(drop)[1])
    assert (found.outcome, found.steps) == ("rebound", 1)
    assert found.rebound_velocity == pytest.approx(0.5, rel=1e-6)
    assert found.end_time == pytest.approx(2.0 * found.rest_time, rel=1e-6)
    assert found.end_time == pytest.approx(2.0 * 0.5 / found.peak_deceleration, rel=1e-6)


def test_a_second_stroke_is_in_the_answer() -> None:
    """The cargo of a leaking bag comes down again, lower than where it first stood still."""
    drop = Simulation(gas_case("S2", vents=VENT))
    rows, outcome = finish(drop)
    found = drop.finish(outcome)
    assert found.outcome == "impact"
    assert found.rest_time == pytest.approx(0.147442, rel=1e-5)
    assert found.lowest_height == 0.0
    assert rows[np.argmax(rows[:, History.TIME] > found.rest_time), History.HEIGHT] > 0.38
    assert found.vented_mass == pytest.approx(rows[0, History.GAS_MASS] - rows[-1, History.GAS_MASS], rel=1e-9)
