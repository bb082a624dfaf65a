"""What a case means, line by line."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from softbrake.case.case import Case
from softbrake.case.case_file import CaseFile
from softbrake.case.plausible import deceleration, figures, foreseen, in_bytes, shown, unloaded_mass, wave_speed
from softbrake.case.sections.shell import PROFILES
from softbrake.case.units import Dimension, unit_size
from softbrake.sim.summary import contact_in_words, fabric_in_words

if TYPE_CHECKING:
    from softbrake.studies.axes import Designs


def case_lines(opened: CaseFile, designs: Designs) -> list[tuple[str, str]]:
    """Return names and texts, in the units of the file; the text of what the case has not is empty. designs: of its sweep."""
    case = opened.case
    cloth = case.fabric
    chosen = f"chosen for an error of {case.tolerance:.2g}" if case.tolerance is not None else ""
    cells = chosen or f"{case.grid.generatrix} x {case.grid.hoop} cells (generatrix x hoop)"
    height_unit = opened.unit_of("belts.0.height") or opened.unit_of("shell.height") or "m"
    heights = ", ".join(f"{belt.height / unit_size(height_unit, Dimension.LENGTH):.4g}" for belt in case.belts)
    return [
        *_shell(opened),
        ("cargo", _values(opened, "cargo.mass", "cargo.velocity", "cargo.diameter", "cargo.height")),
        *_gas(opened),
        ("gravity", shown("gravity", case.gravity, opened.unit_of)),
        ("grid", f"{cells}, {case.model.scheme} scheme"),
        ("fidelity", case.model.fidelity),
        ("belts", f"{len(case.belts)}{f' at {heights} {height_unit}' if heights else ''}"),
        ("contact", contact_in_words(case.model.fidelity, case.contact)),
        ("without effect", ", ".join(case.without_effect)),
        ("pressure", _last(case)),
        ("fabric", fabric_in_words(cloth.law, cloth.slack, cloth.G12, cloth.E11, cloth.E22)),
        ("", _values(opened, "fabric.E11", "fabric.E22", "fabric.areal_density", "fabric.strength")),
        ("viscosity", f"{cloth.viscosity:.4g} N*s/m"),
        *_derived(case),
        ("limits", "; ".join(f"{limit.name} {limit}" for limit in case.limits)),
        ("sweep", f"{len(designs.all)} runs over {', '.join(axis.path for axis in designs.axes)}" if designs.axes else ""),
    ]


def _values(opened: CaseFile, *paths: str) -> str:
    """Values of keys in the units of the file, those that are None left out."""
    said = []
    for path in paths:
        section, name = path.split(".")
        value = getattr(getattr(opened.case, section), name)
        if value is not None:
            said.append(f"{name} {shown(path, value, opened.unit_of)}")
    return ", ".join(said)


def _gas(opened: CaseFile) -> list[tuple[str, str]]:
    """Pressure law, or gas and what it goes through, in the units of the file; with what follows."""
    case, gas = opened.case, opened.case.gas
    if gas is None:
        return [("gas", f"{case.filling.law}, {_law(opened)}")]
    known = case.shell.profile != "pattern"  # the volume, before it is blown up
    held = f", {unloaded_mass(case, gas):.4g} kg in the unloaded shell" if known else ""
    names = ["pressure", "temperature", "gamma", "gas_constant", *["exponent"] * (gas.process == "polytropic")]
    lines = [
        ("gas", f"{gas.process}, {_values(opened, *(f'gas.{name}' for name in names[:2]))}"),
        ("", _values(opened, *(f"gas.{name}" for name in names[2:]))),
        ("", f"{case.ambient.pressure + gas.pressure:.6g} Pa absolute{held}"),
        ("", f"speed of sound {gas.speed_of_sound:.4g} m/s, choked below a ratio of {gas.choking_ratio:.4g}"),
        ("ambient", _values(opened, "ambient.pressure", "ambient.temperature")),
    ]
    lines += [("vents" if number == 0 else "", _vent(opened, number)) for number in range(len(case.vents))]
    if case.leakage:
        lines.append(("leakage", shown("leakage", case.leakage, opened.unit_of)))
    if (cloth := case.permeability) is not None:
        given = (name for name in ("linear", "quadratic", "viscous", "inertial") if getattr(cloth, name))
        lines.append(("permeability", _values(opened, *(f"permeability.{name}" for name in given))))
    if (inflator := case.inflator) is not None:
        rows = list(zip(inflator.times, inflator.mass_flow, strict=True))
        fed = sum((late - soon) * (one + other) / 2 for (soon, one), (late, other) in pairwise(rows))
        lines.append(("inflator", f"{fed:.4g} kg by {rows[-1][0]:.4g} s, {_values(opened, 'inflator.temperature')}"))
    return lines


def _vent(opened: CaseFile, number: int) -> str:
    """A vent in words, in the units of the file."""
    vent, path = opened.case.vents[number], f"vents.{number}"
    least, most = min(vent.discharge), max(vent.discharge)
    discharge = f"{least:.4g}" if least == most else f"{least:.4g} to {most:.4g}"
    said = [f"area {shown(f'{path}.area', vent.area, opened.unit_of)}", f"discharge {discharge}"]
    for event in ("opens", "closes"):
        for key in ("pressure", "time", "height"):
            value = getattr(vent, f"{event}_at_{key}", None)
            if value is not None:
                said.append(f"{event} at {shown(f'{path}.{event}.{key}', value, opened.unit_of)}")
    return ", ".join([*said, *["lets ambient gas in"] * vent.inflow])


def _shell(opened: CaseFile) -> list[tuple[str, str]]:
    """Profile and size, in the units of the file."""
    shell = opened.case.shell
    keys = [f"shell.{key.name}" for key in PROFILES[shell.profile]]
    if shell.profile == "cylinder":
        return [("shell", _values(opened, *keys))]
    lists = [path for path in keys if isinstance(getattr(shell, path.partition(".")[2]), tuple)]
    numbers = [path for path in keys if path not in lists]
    rows = f"{len(shell.diameters)} rows" if lists else ""
    lines = [("shell", ", ".join(filter(None, (shell.profile, rows, _values(opened, *numbers) if numbers else ""))))]
    size = f"{shell.height:.4g} m high, {shell.wall:.4g} m of cloth along the generatrix, at most {shell.diameter:.4g} m wide"
    return [*lines, ("", size)]


def _law(opened: CaseFile) -> str:
    """Pressure law in the units of the file; of a table its size and largest value."""
    pressure = opened.case.filling
    if pressure.times:
        units = (opened.unit_of(f"pressure.values.{row}") for row in range(len(pressure.times)))
        unit = next(filter(None, units), "")
        return f"{len(pressure.times)} rows, at most {shown('pressure.values', pressure.largest, lambda _: unit)}"
    names = ("value", "peak_time", "end_time") if pressure.law == "sine" else ("value",)
    return _values(opened, *(f"pressure.{name}" for name in names))


def _last(case: Case) -> str:
    """Pressure behind the end of a table; nothing of another law."""
    law = case.filling
    return f"{law.values[-1]:.4g} Pa from {law.times[-1]:.4g} s on" if law.times else ""


def _derived(case: Case) -> list[tuple[str, str]]:
    """Figures to check by eye: what the values mean together, and what the run takes."""
    found, halt, run = figures(case), case.full_stop, foreseen(case)
    law, filled = case.filling, "full" if case.gas is None else "filling"
    full = halt.largest if law.law == "sine" else halt.mean
    name = deceleration(case)
    lines = [("free-fall velocity", f"{case.free_fall_velocity:.5f} m/s")]
    if case.model.fidelity != "lumped":
        lines += [
            ("p R / E", f"{found['pressure times radius over E']:.3g}, stretch of the hoop at {filled} pressure"),
            ("wave speed", f"{wave_speed(case):.4g} m/s along the generatrix"),
            ("damping ratio", f"{found['damping ratio']:.3g} of the breathing hoop"),
            ("shell mass", f"{found['shell mass over cargo mass']:.3g} of the cargo's"),
        ]
    share = f"; the case has {law.largest / full:.3g} of it" if full > 0.0 else ""
    if case.shell.profile != "pattern":
        lines.append(("full stop", f"at {full / 1e3:.4g} kPa (section 2.2){share}"))
    lines += [
        (f"{filled} pressure", f"{shown(name, found[name], lambda _: '')} of deceleration, net of gravity"),
    ]
    if run is None:
        return [*lines, ("run", "takes what the tolerance needs, trials up to the budget of run")]
    return [*lines, ("run", f"up to {run.steps} steps, about {run.seconds:.2g} s of CPU, {in_bytes(run.memory)}")]
