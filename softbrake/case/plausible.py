"""Whether a case can be meant: figures that a designer checks by eye, usual ranges, and what the run will take."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from softbrake.case.case import Case, key_at
from softbrake.case.sections.fabric import breathing_viscosity
from softbrake.case.sections.gas import Gas
from softbrake.case.sections.numerics import LUMPED_STEPS, ONE_COLUMN
from softbrake.case.units import STANDARD_GRAVITY, Dimension, unit_size

DECELERATION = "deceleration at full pressure"  # net of gravity
FILLED = "deceleration at filling pressure"  # likewise, of gas


class Range(NamedTuple):
    """Where the values of a key or a figure usually lie, in SI units, and why."""

    low: float
    high: float
    reason: str


# Of keys by path, of figures by name. Beyond is no fault, but more often a slip of unit or digit.
RANGES = {
    "shell.diameter": Range(0.05, 30.0, "from models on a bench to the 30 m of the largest cargo parachute"),
    "shell.height": Range(0.05, 30.0, "as the diameter"),
    "fabric.E11": Range(500.0, 1e7, "knits begin at 1 kN/m, aramid webs of 1 mm end at 1e7 N/m; steel sheet of 0.5 mm has 1e8"),
    "fabric.E22": Range(500.0, 1e7, "as E11"),
    "fabric.areal_density": Range(0.01, 5.0, "spinnaker cloth has 0.03 kg/m^2, coated tent fabric 1.5; steel sheet of 0.5 mm 4"),
    "fabric.nu12": Range(0.0, 1.0, "woven fabrics stay below 0.6, braids reach 1"),
    "fabric.nu21": Range(0.0, 1.0, "as nu12"),
    "cargo.mass": Range(0.1, 5e4, "the heaviest loads dropped by parachute have 40 t"),
    "cargo.velocity": Range(0.3, 100.0, "parachutes let fall at 5 to 10 m/s, a free body falls at 60"),
    "gravity": Range(0.0, 25.0, "Jupiter has 24.8 m/s^2"),
    "friction": Range(0.0, 1.5, "rubber on dry concrete has 1"),
    "pressure.value": Range(0.0, 5e5, "landing bags hold 3 to 100 kPa, airbags of cars for some milliseconds 300"),
    "pressure.values": Range(0.0, 5e5, "as the value of a constant pressure"),
    "gas.pressure": Range(-1e5, 5e5, "as that of a pressure law"),
    "gas.temperature": Range(150.0, 1000.0, "nights on Mars have 150 K, freshly inflated airbags of cars some 700"),
    "gas.gamma": Range(1.0, 1.67, "monatomic gases have 5/3, heavy ones tend to 1"),
    "gas.gas_constant": Range(50.0, 4200.0, "sulphur hexafluoride has 57 J/kg/K, hydrogen 4124"),
    "ambient.pressure": Range(100.0, 1e7, "Mars has 600 Pa, Venus 9.2 MPa"),
    "ambient.temperature": Range(90.0, 750.0, "Titan has 94 K, Venus 737"),
    "leakage": Range(0.0, 0.2, "seams and fabrics leak some per mille, parachute cloth some per cent"),
    "permeability.linear": Range(0.0, 0.01, "airbag cloth has up to 3e-5 m/s/Pa, parachute cloth up to 1e-3"),
    "inflator.mass_flow": Range(0.0, 50.0, "inflators of cars peak at 1 to 3 kg/s"),
    "inflator.temperature": Range(100.0, 2500.0, "stored gas cools as it expands, pyrotechnic gas has 600 to 1500 K"),
    "time.end": Range(1e-3, 60.0, "a drop lasts a tenth of a second to a few"),
    "pressure times radius over E": Range(0.0, 0.5, "fabrics break at stretches of 0.03 to 0.5"),
    "shell mass over cargo mass": Range(0.0, 1.0, "the shell is carried for the cargo"),
    "damping ratio": Range(0.0, 1.0, "of the breathing hoop; measured ones of fabrics are 0.01 to 0.1"),
    "vent area over cover": Range(0.0, 1.0, "of all vents together; those of landing bags take some per cent"),
    DECELERATION: Range(-math.inf, 200.0 * STANDARD_GRAVITY, "rugged electronics bear 200 g"),
    FILLED: Range(-math.inf, 200.0 * STANDARD_GRAVITY, "as at full pressure; a bag's peak is higher"),
    "CPU time": Range(0.0, 3600.0, "an hour; a coarser grid or another fidelity takes less"),
}

# Bytes a node: state and scratch arrays of the whole shell, by contact (docs/explanation/performance.md); what writing its
# snapshots takes besides, whatever part of the shell is computed.
STATE, STATE_BELTS, STATE_FOLDS, SNAPSHOTS = 56, 170, 750, 350  # of folds those that have crumpled
# CPU s a node and step, of smooth walls on a core that has others beside it; crumpled walls take several times as long.
PACE = {"full": 1.5e-8, "axisymmetric": 1.5e-8, "lumped": 1e-8}
FOLDED = 2.0  # times as long with folds in contact


class Foreseen(NamedTuple):
    """What a run takes, as far as the case says."""

    steps: int  # at most: to the end of a stroke that brings the cargo to rest, or to time.end where a rebound is followed
    seconds: float  # of CPU
    memory: int  # bytes


def figures(case: Case) -> dict[str, float]:
    """Figures of RANGES in SI units, for a shell of its unloaded shape."""
    shell, fabric, cargo, pressure = case.shell, case.fabric, case.cargo, case.filling.largest
    cover = math.pi * (shell.mean_diameter if case.model.fidelity == "lumped" else shell.upper_diameter) ** 2 / 4
    belts = sum(2.0 * math.pi * shell.hoop(shell.along(belt.height)) * belt.line_density for belt in case.belts)
    mass = shell.area * fabric.areal_density + belts
    critical = breathing_viscosity(1.0, shell.diameter, fabric.areal_density, fabric.E22, fabric.contraction)
    found = {
        "pressure times radius over E": pressure * shell.diameter / 2 / fabric.E22,
        "shell mass over cargo mass": mass / cargo.mass,
        "damping ratio": fabric.viscosity / critical,
    }
    if case.model.fidelity == "lumped":
        found = {}
    if case.vents:
        found["vent area over cover"] = sum(vent.area for vent in case.vents) / cover
    return found | {deceleration(case): pressure * cover / cargo.mass - case.gravity}


def deceleration(case: Case) -> str:
    """Name of the figure of the deceleration at the pressure that the case gives."""
    return DECELERATION if case.gas is None else FILLED


def unloaded_mass(case: Case, gas: Gas) -> float:
    """Mass of gas (kg) that the unloaded shell of a case holds as it is filled."""
    volume = case.shell.generatrix.volume
    return (case.ambient.pressure + gas.pressure) * volume / (gas.gas_constant * gas.temperature)


def wave_speed(case: Case) -> float:
    """Of tension waves along the generatrix, m/s."""
    return math.sqrt(case.fabric.E11 / case.fabric.contraction / case.fabric.areal_density)


def foreseen(case: Case, results: bool = True) -> Foreseen | None:
    """What a run takes; None where grid and level are yet to be chosen. results: whether it writes a result file."""
    if case.tolerance is not None:
        return None
    rows, columns = case.grid.generatrix + 1, case.grid.hoop
    computed = rows * (1 if case.model.fidelity in ONE_COLUMN else columns)
    folds = "folds" in case.contact and case.model.fidelity != "lumped"
    stroke = 2 * case.shell.height / case.cargo.velocity
    duration = case.time.end if case.time.after == "rebound" else min(case.time.end, stroke)
    steps = math.ceil(duration / _step(case))
    pace = PACE[case.model.fidelity] * (FOLDED if folds else 1.0)
    state = STATE_FOLDS if folds else STATE_BELTS if "belts" in case.contact else STATE
    seconds = steps * (1 if case.model.fidelity == "lumped" else computed) * pace
    return Foreseen(steps, seconds, computed * state + (rows * columns * SNAPSHOTS if results else 0))


def implausible(case: Case, unit_of: Callable[[str], str] = lambda _: "") -> Iterator[tuple[str, str]]:
    """Yield name and warning of what lies outside RANGES. unit_of: unit in which the user gives the value at a path."""
    run = foreseen(case)
    values = [*_keys(case), *figures(case).items(), *([("CPU time", run.seconds)] if run else [])]
    for name, value in values:
        usual = RANGES[name]
        if not usual.low <= value <= usual.high:
            end, bound = ("below", usual.low) if value < usual.low else ("above", usual.high)
            yield name, f"{name}: {shown(name, value, unit_of)} is {end} {shown(name, bound, unit_of)}; {usual.reason}"


def warnings_of(cases: Iterable[Case], unit_of: Callable[[str], str] = lambda _: "") -> list[str]:
    """A line for each key or figure that lies outside its range in some of the cases: the first warning, and how many more."""
    found: dict[str, list[str]] = {}
    for case in cases:
        for name, warning in implausible(case, unit_of):
            found.setdefault(name, []).append(warning)
    return [lines[0] + (f" (and {len(lines) - 1} more runs)" if lines[1:] else "") for lines in found.values()]


def shown(name: str, value: float, unit_of: Callable[[str], str]) -> str:
    """A value of a key in the user's unit, or of a figure in a common one."""
    if name in (DECELERATION, FILLED):
        return f"{value / STANDARD_GRAVITY:.4g} g"
    key = key_at(name)
    if key is None or not isinstance(key.kind, Dimension):
        return f"{value:.3g} s" if name == "CPU time" else f"{value:.4g}"
    unit = unit_of(name) or (unit_of("fabric.E") if name in ("fabric.E11", "fabric.E22", "fabric.G12") else "") or key.kind.unit
    return f"{value / unit_size(unit, key.kind):.6g} {unit}".rstrip()


def _keys(case: Case) -> Iterator[tuple[str, float]]:
    """Paths of RANGES that are keys, with their values; of a list its largest."""
    for path in RANGES:
        if key_at(path) is None:
            continue
        section, _, name = path.rpartition(".")
        value = getattr(getattr(case, section) if section else case, name, None)  # a part that is not there has none
        if value is None or value == ():
            continue
        yield path, max(value) if isinstance(value, tuple) else value


def _step(case: Case) -> float:
    """Length of a step (s) of the unloaded shell without belts and viscosity: (3.3); of gas alone that of the lumped model."""
    if case.model.fidelity == "lumped":
        return case.shell.height / case.cargo.velocity / LUMPED_STEPS
    fabric, stiffest = case.fabric, 1.0 / (case.fabric.contraction * case.fabric.areal_density)
    along = math.sqrt(fabric.E11 * stiffest) / (case.shell.wall / case.grid.generatrix)
    around = math.sqrt(fabric.E22 * stiffest) / (2.0 * math.pi * case.shell.generatrix.narrowest / case.grid.hoop)
    if case.model.fidelity in ONE_COLUMN:
        around = math.sqrt(fabric.E22 * stiffest) / (2.0 * case.shell.generatrix.narrowest)  # half the breathing frequency
    return case.time.courant / max(along, around)


def in_bytes(size: float) -> str:
    """A size of memory in words."""
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{max(size / 1e6, 1):.3g} MB"
