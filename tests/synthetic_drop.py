"""A drop without a solver: a barrel of constant meridian length squeezed by a cargo in uniform deceleration."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from softbrake.case.case import Case
from softbrake.case.sections.ambient import Ambient
from softbrake.case.sections.belts import Belt
from softbrake.case.sections.cargo import Cargo
from softbrake.case.sections.fabric import Fabric
from softbrake.case.sections.gas import Gas
from softbrake.case.sections.numerics import Grid, ModelChoice, Time
from softbrake.case.sections.output import Output
from softbrake.case.sections.pressure import Pressure
from softbrake.case.sections.shell import Shell
from softbrake.core.arrays import Floats
from softbrake.core.columns import History
from softbrake.sim.result_file import ResultFile
from softbrake.sim.summary import ModelUsed, PeakValue, Summary, Work

PISTON = """\
title: A piston of gas
shell: {diameter: 0.4 m, height: 0.3 m}
fabric: {E: 20 kN/m, areal_density: 0.05 kg/m^2, viscosity: 0.2 N*s/m}
cargo: {mass: 15 kg, velocity: 5 m/s}
gas: {pressure: 3 kPa}
model: {fidelity: lumped}
"""  # lowest at 0.232239 m and 0.0210356 s, with 47971.1 Pa and 319.222 K; lifts off at 0.0420711 s with 5 m/s
SPEED, DECELERATION, END = 6.0, 20.0, 0.12
PRESSURE = 15696.0


def case(generatrix: int = 36, hoop: int = 90, belts: int = 3) -> Case:
    """The paper's case, or nearly."""
    return Case(
        title="A synthetic drop",
        gravity=9.81,
        shell=Shell(0.5, 0.6),
        fabric=Fabric(20e3, 20e3, 0.25, 0.25, 0.0, 0.05, 0.2, "true_tension", "cut"),
        belts=tuple(Belt(0.6 * (k + 1) / (belts + 1), 1667.0, 0.004, 0.0167) for k in range(belts)),
        cargo=Cargo(100.0, SPEED, 0.5, None),
        contact=("ground",),
        initial="unloaded",
        friction=0.0,
        leakage=0.0,
        tolerance=None,
        pressure=Pressure("constant", PRESSURE, 0.0, 0.0, (), (), 0.0),
        gas=None,
        ambient=Ambient(),
        vents=(),
        permeability=None,
        inflator=None,
        grid=Grid(generatrix, hoop),
        time=Time(0.5, 0.3, "stop"),
        model=ModelChoice("edge", "full"),
        output=Output(0.002, 10, 180),
    )


def gas_case(generatrix: int = 36, hoop: int = 90) -> Case:
    """The same with a gas that has a state, in a closed bag."""
    return replace(case(generatrix, hoop), pressure=None, gas=Gas(PRESSURE, 288.15, 1.4, 287.05287, "adiabatic", 1.4))


def cargo(time: float) -> tuple[float, float]:
    """Height, m, and velocity, m/s, up positive."""
    return 0.6 - SPEED * time + 0.5 * DECELERATION * time**2, -SPEED + DECELERATION * time


def shape(case: Case, time: float) -> tuple[Floats, dict[str, Floats]]:
    """Nodes, m, and point fields."""
    s = np.linspace(0.0, 1.0, case.grid.generatrix + 1)[:, None]
    angle = 2 * np.pi * np.arange(case.grid.hoop) / case.grid.hoop
    height = cargo(time)[0]
    bulge = 0.2 * (1 - height / 0.6) * (1 + 0.1 * np.cos(5 * angle))
    r = 0.25 + bulge * np.sin(np.pi * s)
    xyz = np.stack((r * np.cos(angle), r * np.sin(angle), height * s + 0 * angle), axis=-1)
    tension = PRESSURE * r * (1 - np.exp(-time / 0.01))
    velocity = np.zeros_like(xyz)
    velocity[..., 2] = cargo(time)[1] * s
    fields = {
        "velocity": velocity,
        "tension_generatrix": 0.5 * tension,
        "tension_hoop": tension,
        "stretch_generatrix": 1 + 0.5 * tension / 20e3,
        "stretch_hoop": 1 + tension / 20e3,
    }
    return xyz, fields


def history(times: Floats) -> Floats:
    """Rows of /history; the columns that no curve needs hold their own number."""
    rows = np.tile(np.arange(len(History), dtype=float), (len(times), 1))
    height, velocity = cargo(times)  # type: ignore[arg-type]
    fallen = 0.6 - height
    rows[:, History.TIME] = times
    rows[:, History.HEIGHT] = height
    rows[:, History.VELOCITY] = velocity
    rows[:, History.ACCELERATION] = DECELERATION
    rows[:, History.PRESSURE] = PRESSURE
    rows[:, History.COVER_FORCE] = 100.0 * (DECELERATION + 9.81)
    rows[:, History.GROUND_FORCE] = 100.0 * (DECELERATION + 9.81)
    rows[:, History.TENSION_HOOP] = 8e3 * (1 - np.exp(-times / 0.01))
    rows[:, History.TENSION_GENERATRIX] = 0.5 * rows[:, History.TENSION_HOOP]
    rows[:, History.TENSION_BELT] = 3 * rows[:, History.TENSION_HOOP]
    rows[:, History.KINETIC_ENERGY] = 50.0 * velocity**2
    rows[:, History.WORK_PRESSURE] = -2500.0 * fallen
    rows[:, History.WORK_GRAVITY] = 981.0 * fallen
    rows[:, History.WORK_ELASTIC] = -481.0 * fallen
    rows[:, History.WORK_VISCOUS : History.WORK_BELTS + 1] = 0.0
    rows[:, History.WORK_GROUND] = rows[:, History.WORK_CONTACT] = rows[:, History.CONTACT_FORCE] = 0.0
    return rows


def summary() -> Summary:
    """The answer that fits the curves."""
    return Summary(
        title="A synthetic drop",
        outcome="impact",
        end_time=END,
        impact_velocity=-cargo(END)[1],
        impact_time=END,
        free_fall_velocity=6.911,
        velocity_reduction=6.911 + cargo(END)[1],
        lowest_height=cargo(END)[0],
        peak_deceleration=DECELERATION,
        peak_tension_generatrix=4e3,
        peak_tension_hoop=8e3,
        peak_tension_belt=None,
        peaks={"peak_tension_hoop": PeakValue(8e3, END, 0.3), "peak_deceleration": PeakValue(DECELERATION, 0.0)},
        work=Work(-1140.0, -219.0, 0.0, 0.0, 447.0, 0.0, 0.0),
        largest_penetration=0.0,
        missed_collisions=0,
        energy_error=1e-14,
        energy_made={"fabric": 0.0, "belts": 0.0, "viscosity": 0.0},
        steps=1200,
        time_step=1e-4,
        kernel_seconds=0.1,
        wall_seconds=0.2,
        model=ModelUsed("shell", 36, 90, 0.5, "edge"),
        results="drop.vtkhdf",
    )


def write(path: Path, drop: Case, snapshots: int = 13, finished: bool = True) -> None:
    """A result file of the drop."""
    with ResultFile.create(path, drop, version="1.2.3", source_hash="abc") as result:
        for time in np.linspace(0.0, END, snapshots):
            add_snapshot(result, drop, time)
        result.add_history(history(np.linspace(0.0, END, 500)))
        if finished:
            result.write_summary(summary())


def add_snapshot(result: ResultFile, drop: Case, time: float) -> None:
    """One instant of the drop."""
    xyz, fields = shape(drop, time)
    height, velocity = cargo(time)
    result.add_snapshot(time, xyz, fields, height=height, velocity=velocity, pressure=PRESSURE)
