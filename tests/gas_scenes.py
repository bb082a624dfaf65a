"""Cases of a gas with a state, and what every drop of them keeps: energy, mass."""

from typing import Any

import numpy as np
import pytest

from softbrake.case.case import Case
from softbrake.case.case_file import load_case
from softbrake.core.arrays import Floats, GasState, Outcome
from softbrake.core.columns import History
from softbrake.sim.simulation import Simulation

ENERGY, MASS = 1e-10, 1e-12  # of the initial energy and mass
GRAVITY = 9.80665  # m/s^2
AMBIENT = 101325.0  # Pa
# Diameter and height of a piston (m), mass (kg), velocity (m/s), gauge pressure (Pa).
PISTONS = {
    "S1": (0.4, 0.3, 15.0, 5.0, 3e3),
    "S2": (1.2, 1.0, 1200.0, 7.62, 20e3),
    "S3": (0.5, 0.6, 100.0, 6.0, 15.7e3),
    "S4": (1.0, 0.8, 90.0, 12.0, 5e3),
}
MARS = {
    "gas": {"gamma": 1.3, "gas_constant": 188.92, "temperature": 220.0},
    "ambient": {"pressure": 600.0, "temperature": 220.0},
    "gravity": 3.72076,
}


def gas_case(piston: str, **more: Any) -> Case:
    """A piston's case, lumped; more: sections, whose keys are put over those there are."""
    diameter, height, mass, velocity, pressure = PISTONS[piston]
    sections: dict[str, Any] = {
        "shell": {"diameter": diameter, "height": height},
        "fabric": {"E": "20 kN/m", "nu12": 0.25, "areal_density": 0.05, "damping_ratio": 0.03},
        "cargo": {"mass": mass, "velocity": velocity},
        "gas": {"pressure": pressure},
        "model": {"fidelity": "lumped"},
    }
    for name, value in more.items():
        merged = isinstance(value, dict) and isinstance(sections.get(name), dict)
        sections[name] = {**sections[name], **value} if merged else value
    return load_case(sections)


def orifice(area: float, discharge: Any, **more: Any) -> list[dict[str, Any]]:
    """The section `vents` of one vent."""
    return [{"area": area, "discharge": discharge, **more}]


def finish(drop: Simulation) -> tuple[Floats, Outcome]:
    """Advance to the end, looking after energy and mass; return the whole history."""
    begun = float(drop.state.gas[GasState.MASS])
    rows, outcome = [], Outcome.RUNNING
    while outcome == Outcome.RUNNING:
        new, outcome = drop.advance()
        rows.append(new.copy())
        keeps(drop, begun)
    assert outcome != Outcome.DIVERGED
    return np.concatenate(rows), outcome


def keeps(drop: Simulation, begun: float) -> None:
    """First law and mass (kg) of the gas, ledger of the works."""
    chamber = drop.state.gas
    assert abs(drop.energy_error()) <= ENERGY
    mass = begun + chamber[GasState.FILLED] - chamber[GasState.VENTED]
    assert chamber[GasState.MASS] == pytest.approx(mass, rel=MASS)
    absolute, held = chamber[GasState.PRESSURE], min(chamber[GasState.VOLUME], chamber[GasState.FREE_VOLUME])
    if drop.case.gas is not None:
        assert drop.now(History.GAS_ENERGY) == pytest.approx(absolute * held / (drop.case.gas.gamma - 1.0), rel=1e-12)


def entropy(drop: Simulation) -> float:
    """P (V/m)^gamma, which gas that expands without heat keeps, whatever leaves."""
    chamber, gas = drop.state.gas, drop.case.gas
    assert gas is not None
    held = min(chamber[GasState.VOLUME], chamber[GasState.FREE_VOLUME])
    return float(chamber[GasState.PRESSURE] * (held / chamber[GasState.MASS]) ** gas.gamma)


def at_height(rows: Floats, height: float) -> float:
    """Velocity (m/s, downwards positive) of the last fall through a height (m)."""
    above = rows[:, History.HEIGHT] > height
    k = int(np.flatnonzero(above[:-1] & ~above[1:])[-1])
    (high, low), (before, after) = rows[k : k + 2, History.HEIGHT], rows[k : k + 2, History.VELOCITY]
    share = (high - height) / (high - low)
    return -float(np.sqrt(before**2 + share * (after**2 - before**2)) * np.sign(after))
