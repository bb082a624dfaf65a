"""Where methods fail, on purpose: the curves of docs/validation/stability.md. `python -m benchmarks.failures PICTURE`.

Each function makes one failure happen on a small shell and returns what tests/test_failures.py asserts and the picture shows.
"""

from __future__ import annotations

import sys
from math import inf, pi
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softbrake.case.case_file import load_case
from softbrake.core.arrays import PAD, Outcome
from softbrake.core.columns import History
from softbrake.core.lanes import close_nodes
from softbrake.core.loop.step_size import stable_step
from softbrake.core.pressure import pressure_at
from softbrake.sim.build import grid_view, initial_energy, meridian_view
from softbrake.sim.relax import Held
from softbrake.sim.simulation import Simulation

Floats = NDArray[np.float64]
CONFIGS = Path(__file__).resolve().parents[1] / "configs"
SMALL = ("grid={generatrix: 12, hoop: 24}", "time.courant=0.5")
BLOCK = 4000  # steps
ROUND = ("model.fidelity=axisymmetric", "grid={generatrix: 24, hoop: 720}")


def inflated(*overrides: str) -> Simulation:
    """The shell of the paper without belts at rest under a held cover."""
    drop = Simulation(load_case(CONFIGS / "no-belts.yaml", [*SMALL, *overrides]))
    drop.inflate()
    return drop


def close(drop: Simulation) -> None:
    """Renew the copies at both ends of all rows."""
    for row in range(drop.model.n1 + 1):
        close_nodes(drop.state.nodes, np.uint64(row * drop.model.stride + PAD), drop.model.n2)


def checkerboard(scheme: str, size: float = 1e-6) -> tuple[Floats, Floats]:
    """Times (s) and amplitude (m) of places that alternate from node to node, seeded at the start of a drop to its end."""
    drop = Simulation(
        load_case(CONFIGS / "no-belts.yaml", ["grid={generatrix: 24, hoop: 48}", f"model.scheme={scheme}", "contact=ground"])
    )
    model = drop.model
    parts = [grid_view(part, model)[1:-1] for part in drop.state.nodes[:3]]
    i, j = np.mgrid[1 : model.n1, 0 : model.n2]
    alternating = (-1.0) ** (i + j)
    angle = 2.0 * pi * j / model.n2
    parts[0] += size * alternating * np.cos(angle)
    parts[1] += size * alternating * np.sin(angle)
    close(drop)
    times, found, outcome = [], [], Outcome.RUNNING
    while outcome == Outcome.RUNNING:
        _, outcome = drop.advance(most=100)
        radius = np.cos(angle) * parts[0] + np.sin(angle) * parts[1]
        times.append(drop.now(History.TIME))
        found.append(float(np.abs((alternating * radius).mean())))
    return np.array(times), np.array(found)


def held_motion(drop: Simulation, courant: float, steps: int = 300) -> Floats:
    """Root mean square speed (m/s) of the free nodes, disturbed by a hair, in steps of a part of the longest stable one."""
    drop.disturb(1e-8, seed=2)
    held, speeds = Held(drop.model._replace(courant=courant), drop.state, drop.step), []
    for _ in range(steps):
        push = held.push()
        if push is None:
            break
        speeds.append(float(np.sqrt((push.velocity**2).sum(axis=0).mean())))
    return np.array(speeds)


def viscosity_ignored(viscosity: float) -> float:
    """The step that would be stable without viscosity over that which is with it."""
    drop = inflated(f"fabric.viscosity={viscosity}")
    calm = drop.model._replace(fabric=drop.model.fabric._replace(viscosity=0.0))
    return float(stable_step(calm, drop.state.nodes, drop.workspace) / stable_step(drop.model, drop.state.nodes, drop.workspace))


def twist(modulus: float, steps: int = 1500) -> tuple[Floats, Floats]:
    """Times (s) and turn (rad) at mid-height of an inflated shell whose hoops were set turning to and fro."""
    drop = inflated(f"fabric.G12={modulus}", "fabric.viscosity=0")
    model, nodes = drop.model, drop.state.nodes
    held = Held(model, drop.state, drop.step)
    z = grid_view(nodes.z, model)[1:-1]
    x, y, u, v = (grid_view(part, model)[1:-1] for part in (nodes.x, nodes.y, nodes.u, nodes.v))
    spin = 1.0 * np.sin(pi * z / 0.6)
    u -= spin * y
    v += spin * x
    close(drop)
    start, times, turn = np.arctan2(y[model.n1 // 2 - 1], x[model.n1 // 2 - 1]), [0.0], [0.0]
    for _ in range(steps):
        push = held.push()
        assert push is not None
        times.append(times[-1] + push.length)
        turn.append(float(np.mean(np.angle(np.exp(1j * (np.arctan2(y[model.n1 // 2 - 1], x[model.n1 // 2 - 1]) - start))))))
    return np.array(times), np.array(turn)


def cycling(law: str, courant: float, viscosity: float = 0.0) -> tuple[Floats, Floats]:
    """Times (s) and gain of fabric and belts over the initial energy in a drop; it ends where that diverges."""
    fabric = (f"fabric.law={law}", f"fabric.viscosity={viscosity}")
    case = load_case(
        CONFIGS / "no-belts.yaml", [*ROUND, *fabric, f"time.courant={courant}", "contact=[ground, cover, cargo, axis]"]
    )
    drop, times, gains, outcome = Simulation(case), [], [], Outcome.RUNNING
    while outcome == Outcome.RUNNING:
        _, outcome = drop.advance(most=50)
        times.append(drop.now(History.TIME))
        given = sum(drop.now(work) for work in (History.WORK_ELASTIC, History.WORK_VISCOUS, History.WORK_BELTS))
        gains.append((given - float(drop.state.stored.sum())) / initial_energy(case, drop.model))
    return np.array(times), np.array(gains)


def history(*overrides: str, config: str = "paper-contact") -> Floats:
    """All rows of a drop, up to its end or its divergence."""
    drop, rows, outcome = Simulation(load_case(CONFIGS / f"{config}.yaml", overrides)), [], Outcome.RUNNING
    while outcome == Outcome.RUNNING:
        new, outcome = drop.advance()
        rows.append(new.copy())
    return np.concatenate(rows)


def degenerate(share: float) -> tuple[float, Floats]:
    """Longest stable step over that of the sound shell, with one node pushed to a share of its edge from the next; its motion."""
    drop = inflated("fabric.viscosity=0.2", "time.courant=auto")
    model = drop.model
    sound = stable_step(model, drop.state.nodes, drop.workspace)
    for part in drop.state.nodes[:3]:
        row = grid_view(part, model)[6]
        row[7] = row[8] + share * (row[7] - row[8])
    close(drop)
    bound = stable_step(model, drop.state.nodes, drop.workspace)
    held, speeds = Held(model, drop.state, drop.step), []
    for _ in range(3000):
        push = held.push()
        speeds.append(inf if push is None else float(np.sqrt((push.velocity**2).sum(axis=0).max())))
    return float(bound / sound), np.array(speeds)


class Million(NamedTuple):
    """What a million steps did, by blocks of BLOCK steps."""

    peaks: Floats  # N/m, largest hoop tension of the block
    made: Floats  # J, stored in fabric and gas at its end, beyond the works that were booked against it: an error of the step
    moving: Floats  # J, kinetic energy of the shell at its end
    momentum: float  # change of the vertical momentum less that of its forces, over what the forces gave in all


def million(steps: int = 1_000_000, courant: str = "auto") -> Million:
    """Undamped swings of an inflated round shell under a cargo that hardly falls, in a million steps."""
    others = ("cargo.mass=1e11", "cargo.velocity=1e-4", "gravity=0", "time.end=1e6", "contact=[]", "fabric.law=tension_field")
    others = (*others, "fabric.nu12=0", "initial=inflated", "fabric.viscosity=0", f"time.courant={courant}")
    case = load_case(CONFIGS / "no-belts.yaml", [*ROUND, "grid.generatrix=8", *others])
    drop = Simulation(case)
    drop.disturb(1e-3, seed=5)
    model, nodes = drop.model, meridian_view(drop.state.nodes, drop.model)
    copies, fabric = model.hoop.whole, model.fabric
    pressure = pressure_at(model.pressure, 0.0)

    def fabric_momentum() -> float:
        return float(copies * (model.mass[:-1] @ nodes.w[:-1]))

    def motion() -> float:
        return float(0.5 * copies * (model.mass[1:-1] @ (nodes.u[1:-1] ** 2 + nodes.w[1:-1] ** 2)))

    def unbooked() -> float:
        """Energy stored in taut edges less that of the gas, and the works booked against it."""
        along = np.maximum(np.hypot(np.diff(nodes.x), np.diff(nodes.z)) / fabric.h1 - 1.0, 0.0)
        around = np.maximum(nodes.x[1:-1] / model.shape.widest - 1.0, 0.0)
        stored = 0.5 * fabric.h1 * fabric.h2 * (fabric.c11 * (along**2).sum() + fabric.c22 * (around**2).sum())
        rings = np.diff(nodes.z) * (nodes.x[1:] ** 2 + nodes.x[1:] * nodes.x[:-1] + nodes.x[:-1] ** 2) / 6.0
        gas = pressure * fabric.h2 / model.shape.widest * rings.sum()
        return float(copies * (stored - gas)) + drop.now(History.WORK_ELASTIC) + drop.now(History.WORK_PRESSURE)

    start, before, last, given, all_given, done = unbooked(), fabric_momentum(), 0.0, 0.0, 0.0, 0
    made, moving, peaks = [], [], []
    while done < steps:
        rows, outcome = drop.advance(most=min(BLOCK, steps - done))
        assert outcome == Outcome.RUNNING
        length = rows[:, History.TIME_STEP]
        between = 0.5 * (length + np.concatenate(([last], length[:-1])))
        impulse = between * (rows[:, History.GROUND_FORCE] - rows[:, History.COVER_FORCE])
        given, all_given, last = given + float(impulse.sum()), all_given + float(np.abs(impulse).sum()), float(length[-1])
        peaks.append(float(rows[:, History.TENSION_HOOP].max()))
        made.append(unbooked() - start)
        moving.append(motion())
        done += len(rows)
    return Million(
        peaks=np.array(peaks),
        made=np.array(made),
        moving=np.array(moving),
        momentum=abs(fabric_momentum() - before - given) / all_given,
    )


def draw(picture: Path) -> None:
    """Draw all failures."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from softbrake.report.plots.style import BLUE, GREY, ORANGE, RED, STYLE

    with rc_context(STYLE):
        figure = Figure(figsize=(12.0, 9.6), layout="constrained")
        axes = figure.subplots(3, 3).ravel()
        for scheme, colour in (("cell", RED), ("edge", BLUE)):
            times, amplitude = checkerboard(scheme)
            axes[0].semilogy(times * 1e3, amplitude, color=colour, label=f"scheme: {scheme}")
        axes[0].set(title="Checkerboard seeded with 1 µm", xlabel="ms", ylabel="amplitude, m", ylim=(1e-9, 1.0))
        for courant, colour in ((1.1, RED), (0.95, BLUE)):
            axes[1].semilogy(held_motion(inflated("fabric.viscosity=0"), courant), color=colour, label=f"courant {courant}")
        axes[1].set(title="Courant number above the bound", xlabel="steps", ylabel="speed, m/s")
        factor = viscosity_ignored(2.0)
        for courant, colour, label in ((factor, RED, f"undamped limit, {factor:.2f}"), (0.95, BLUE, "courant 0.95")):
            axes[2].semilogy(held_motion(inflated("fabric.viscosity=2"), courant), color=colour, label=label)
        axes[2].set(title="Viscosity of 2 N s/m, half a step late", xlabel="steps", ylabel="speed, m/s")
        for modulus, colour in ((0, RED), (2000, BLUE)):
            times, turn = twist(modulus)
            axes[3].plot(times * 1e3, turn * 1e3, color=colour, label=f"G12 = {modulus / 1e3:g} kN/m")
        axes[3].set(title="No shear stiffness", xlabel="ms", ylabel="turn, mrad")
        for law, courant, colour in (
            ("true_tension", 0.35, RED),
            ("nominal_tension", 0.35, ORANGE),
            ("tension_field", 0.95, GREY),
            ("tension_field", 0.35, BLUE),
        ):
            times, gain = cycling(law, courant)
            axes[4].plot(times * 1e3, gain, color=colour, label=f"{law}, courant {courant:g}")
        axes[4].set(title="Slack-taut cycling, undamped", xlabel="ms", ylabel="fabric's gain / energy", ylim=(-0.6, 0.4))
        rows = history(*ROUND, "time.courant=auto")
        rows = rows[rows[:, History.TIME_STEP] > 0.0]
        axes[5].plot(rows[:, History.HEIGHT] / 0.6, rows[:, History.TIME_STEP] * 1e6, color=BLUE, label="paper-contact.yaml")
        axes[5].axvline(0.05, color=GREY, linewidth=0.8)
        axes[5].set(title="Down to 5 % of the height", xlabel="height / l1", ylabel="step, µs", xlim=(1.0, 0.0), ylim=(0.0, None))
        for part, name in ((ROUND, "axisymmetric"), (("grid={generatrix: 24, hoop: 48}",), "full")):
            for slack, colour in (("compression", RED), ("cut", BLUE)):
                rows = history(*part, f"fabric.slack={slack}", "contact=ground", "belts.width=25 mm", config="paper")
                style = "-" if name == "full" else "--"
                axes[6].plot(
                    rows[:, History.TIME] * 1e3, -rows[:, History.VELOCITY], style, color=colour, label=f"{name}, {slack}"
                )
        axes[6].set(title="Hoops that carry compression", xlabel="ms", ylabel="cargo, m/s")
        for share, colour in ((0.01, RED), (0.5, BLUE)):
            bound, speeds = degenerate(share)
            axes[7].semilogy(speeds, color=colour, label=f"edge of {share:g}: step x {bound:.2f}")
        axes[7].set(title="A nearly degenerate cell, released", xlabel="steps", ylabel="fastest node, m/s")
        runs = {"auto: 0.35": million(), "0.1": million(3_500_000, "0.1")}  # of the same time
        for (courant, run), colour in zip(runs.items(), (RED, BLUE), strict=True):
            axes[8].plot(np.linspace(0.0, 1.0, len(run.peaks)), run.peaks * 1e-3, color=colour, label=f"courant {courant}")
        axes[8].set(
            title="A million undamped steps",
            xlabel="time, in million steps of auto",
            ylabel="largest hoop tension, kN/m",
            ylim=(0.0, None),
        )
        for panel in axes:
            panel.legend(loc="best")
        figure.savefig(picture, dpi=110)
    for courant, run in runs.items():
        tenths = [part.mean() for part in np.array_split(run.made, 10)]
        made = f"energy made, means of tenths {min(tenths):.3f} to {max(tenths):.3f} J, of {run.moving.mean():.2f} J of motion"
        print(f"courant {courant}: {made}; momentum {run.momentum:.1e}; tension {run.peaks[0]:.0f} to {run.peaks.max():.0f} N/m")


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
