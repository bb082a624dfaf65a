"""Static inflation of a case's shell, its cover held at the shell's height: shape, tensions, force on the cover."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from softbrake import __version__
from softbrake.case.case import Case
from softbrake.case.level import level
from softbrake.core.arrays import Floats, Model
from softbrake.core.columns import History
from softbrake.core.jit import PACKAGE, hash_sources
from softbrake.sim.build import grid_view
from softbrake.sim.relax import TOLERANCE
from softbrake.sim.result_file import ResultError, ResultFile
from softbrake.sim.simulation import Simulation
from softbrake.sim.summary import Inflation


def inflate(case: Case, results: str | Path | None = None, tolerance: float = TOLERANCE) -> Inflation:
    """Inflate the shell to rest and return what it is then; the result file holds that one instant.

    The pressure is that of t = 0, or where the law starts without any its largest. tolerance: of both residuals of `relax`.
    `results_fault` of the answer tells of a file that cannot be written.
    Raises NotInflated, and ValueError where there is nothing to inflate, or to inflate with; then writes nothing.
    """
    if case.model.fidelity == "lumped":
        raise ValueError("a case of fidelity lumped has no grid of a shell to inflate; model.fidelity=full has")
    if case.model.fidelity == "auto":
        case = level(case, "axisymmetric", 2 * case.grid.generatrix, case.grid.hoop)  # at rest a shell is round
    law = case.filling
    if law.largest == 0.0:
        expected = "gas.pressure > 0" if case.gas is not None else "pressure.value or a table with one"
        raise ValueError(f"there is no pressure to inflate the shell with; {expected} is expected")
    late = law.start == 0.0
    drop = Simulation(case.under(law.steady(law.largest) if late else law))
    found = drop.inflate(tolerance)
    model, nodes = drop.whole_shell()
    xyz = np.stack([grid_view(part, model) for part in nodes[:3]], axis=-1)
    fields = drop.fields()
    radius = np.hypot(xyz[..., 0], xyz[..., 1]).mean(axis=1)
    widest = int(np.argmax(radius))
    pressure, cover_force = drop.now(History.PRESSURE), drop.now(History.COVER_FORCE)
    middle = case.grid.generatrix / 2
    rows = [int(np.floor(middle)), int(np.ceil(middle))]
    answer = Inflation(
        title=case.title,
        pressure=pressure,
        pressure_late=late,
        height=drop.now(History.HEIGHT),
        largest_radius=float(radius[widest]),
        largest_radius_height=float(xyz[widest, :, 2].mean()),
        volume=volume(xyz, model),
        cover_force=cover_force,
        wall_pull=pressure * model.hoop.whole * model.cover_area - cover_force,
        tension_generatrix=drop.now(History.TENSION_GENERATRIX),
        tension_hoop=drop.now(History.TENSION_HOOP),
        tension_belt=drop.now(History.TENSION_BELT) if case.belts else None,
        middle_tension_generatrix=float(fields["tension_generatrix"][rows].mean()),
        middle_tension_hoop=float(fields["tension_hoop"][rows].mean()),
        residual=found.residual,
        steps=found.steps,
        results=None if results is None else str(results),
    )
    if results is None:
        return answer
    gas, now = case.gas, drop.state.now
    if gas is not None:  # the shell was inflated by a law
        absolute = case.ambient.pressure + pressure
        now[History.VOLUME], now[History.TEMPERATURE] = answer.volume, gas.temperature
        now[History.GAS_MASS] = absolute * answer.volume / (gas.gas_constant * gas.temperature)
        now[History.GAS_ENERGY] = absolute * answer.volume / (gas.gamma - 1.0)
    try:
        with ResultFile.create(Path(results), case, version=__version__, source_hash=hash_sources(PACKAGE)) as file:
            file.add_history(now[None, :])
            fields["velocity"] = np.zeros_like(xyz)
            file.add_snapshot(
                0.0,
                xyz,
                fields,
                height=answer.height,
                velocity=0.0,
                pressure=pressure,
                temperature=drop.now(History.TEMPERATURE),
                mass=drop.now(History.GAS_MASS),
            )
            return file.write_inflation(answer)
    except ResultError as error:
        return replace(answer, results_fault=str(error))


def volume(xyz: Floats, model: Model) -> float:
    """Return the volume (m^3) below the bilinear patches of a wall of nodes (n1+1, n2, 3) and its covers, with that of the arcs.

    A third of the flux of the places: through a patch that is the mean of both its cuts into two triangles.
    """
    a, d = xyz[:-1], xyz[1:]
    b, c = np.roll(a, -1, axis=1), np.roll(d, -1, axis=1)
    corners = ((a, b, c), (a, c, d), (a, b, d), (b, c, d))
    wall = sum(float((one * np.cross(two, three)).sum()) for one, two, three in corners) / 12.0
    return model.hoop.whole * (model.hoop.gas * wall + float(xyz[-1, 0, 2]) * model.cover_area / 3.0)
