"""What pictures and pages show of a drop, each drawn on axes: courses over time, and cuts through the shell."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softbrake.case.sections.output import CFC_DEFAULT
from softbrake.case.sections.shell import shell_of
from softbrake.case.units import STANDARD_GRAVITY
from softbrake.report.plots.style import BLUE, CARGO_COLOUR, GREEN, GREY, GROUND_COLOUR, INK, ORANGE, RED
from softbrake.sim.filters import filtered_slope
from softbrake.sim.result_file import Snapshots, belt_rows
from softbrake.sim.summary import Summary

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ALIKE = 0.02  # of the way of the cover: lowest places no further apart are alike
SPACE = "   "  # between time and speed of a caption


def draw_speed(axes: Axes, case: dict[str, Any], history: NDArray[Any], summary: Summary | None) -> None:
    """Downward speed, with free fall down to the ground beside it."""
    time = history["time"]
    start, gravity, drop = case["cargo"]["velocity"], case["gravity"], shell_of(case["shell"]).height
    landing = (np.sqrt(start**2 + 2 * gravity * drop) - start) / gravity if gravity else drop / start
    falling = np.linspace(0.0, min(landing, time[-1]), 50)
    axes.plot(time * 1e3, -history["velocity"], color=BLUE, label="cargo")
    axes.plot(falling * 1e3, start + gravity * falling, color=GREY, linestyle="--", label="free fall")
    if summary is not None and summary.impact_velocity is not None and summary.impact_time is not None:
        axes.plot([summary.impact_time * 1e3], [summary.impact_velocity], "o", color=RED, label="impact", clip_on=False)
    if summary is not None and summary.rest_time is not None and summary.rest_time < summary.end_time:
        axes.plot([summary.rest_time * 1e3], [0.0], "o", color=GREEN, label="first at rest", clip_on=False)
    if summary is not None and summary.rebound_velocity is not None:
        axes.plot([summary.end_time * 1e3], [-summary.rebound_velocity], "o", color=RED, label="rebound", clip_on=False)
    axes.set(title="Speed of the cargo, downwards", ylabel="m/s")


def draw_height(axes: Axes, history: NDArray[Any]) -> None:
    """Height of the cover."""
    axes.plot(history["time"] * 1e3, history["height"], color=BLUE)
    axes.set(title="Height of the cover", ylabel="m")


def draw_deceleration(axes: Axes, case: dict[str, Any], history: NDArray[Any]) -> None:
    """Deceleration net of gravity, behind the channel class of the answer where the rows allow that."""
    cfc = case["output"].get("cfc", CFC_DEFAULT)  # older results have none
    pulse = filtered_slope(history["time"], history["velocity"], cfc)
    time, values = (history["time"], history["acceleration"]) if pulse is None else pulse
    signal = "unfiltered" if pulse is None else f"CFC {cfc}"
    axes.plot(time * 1e3, values / STANDARD_GRAVITY, color=RED)
    axes.set(title=f"Deceleration, {signal}, net of gravity", ylabel=f"g of {STANDARD_GRAVITY} m/s²")


def draw_pressure(axes: Axes, history: NDArray[Any]) -> None:
    """Pressure of the gas."""
    axes.plot(history["time"] * 1e3, history["pressure"] * 1e-3, color=ORANGE)
    axes.set(title="Pressure", ylabel="kPa")


def draw_gauge_pressure(axes: Axes, history: NDArray[Any], summary: Summary | None) -> None:
    """Pressure of a gas with a state, with what it is where vents first open."""
    time, pressure = history["time"] * 1e3, history["pressure"] * 1e-3
    opened = [when * 1e3 for when in (() if summary is None else summary.vent_opening_times or ()) if when]
    axes.plot(time, pressure, color=ORANGE, label="pressure" if opened else None)
    if opened:
        axes.plot(opened, np.interp(opened, time, pressure), "o", color=RED, label="vent opens")
    axes.set(title="Pressure of the gas, gauge", ylabel="kPa")


def draw_temperature(axes: Axes, history: NDArray[Any]) -> None:
    """Temperature of the gas."""
    axes.plot(history["time"] * 1e3, history["temperature"], color=RED)
    axes.set(title="Temperature of the gas", ylabel="K")


def draw_gas_mass(axes: Axes, history: NDArray[Any]) -> None:
    """Mass of the gas in the shell."""
    axes.plot(history["time"] * 1e3, history["gas_mass"], color=BLUE)
    axes.set(title="Mass of the gas", ylabel="kg")


def draw_vent_flow(axes: Axes, history: NDArray[Any]) -> None:
    """What flows out through vents and wall."""
    axes.plot(history["time"] * 1e3, history["vent_flow"], color=GREEN)
    axes.set(title="Flow out through vents and wall", ylabel="kg/s")


def gas_panels(history: NDArray[Any], summary: Summary | None) -> list[Callable[[Axes], None]]:
    """What draws the courses of a gas with a state; of a pressure law none, of a closed bag no mass and no flow."""
    if "temperature" not in (history.dtype.names or ()):
        return []
    drawings: list[Callable[[Axes], None]] = [
        lambda axes: draw_gauge_pressure(axes, history, summary),
        lambda axes: draw_temperature(axes, history),
    ]
    if np.ptp(history["gas_mass"]) > 0.0:
        drawings += [lambda axes: draw_gas_mass(axes, history), lambda axes: draw_vent_flow(axes, history)]
    return drawings


def draw_tensions(axes: Axes, case: dict[str, Any], history: NDArray[Any], scale: float, unit: str) -> None:
    """The largest tensions over a scale, N/m; of a lumped run none."""
    lumped = case["model"]["fidelity"] == "lumped"
    for name, label, colour in (
        ("tension_generatrix", "generatrix", BLUE),
        ("tension_hoop", "hoop", ORANGE),
        ("tension_belt", "belt", GREEN),
    ):
        if not lumped and (name != "tension_belt" or case["belts"]):
            axes.plot(history["time"] * 1e3, history[name] / scale, color=colour, label=label)
    none = " (a lumped run has no shell)" if lumped else ""
    axes.set(title=f"Largest tensions{none}", ylabel=unit)


def draw_wall_tensions(axes: Axes, case: dict[str, Any], shots: Snapshots, scale: float, unit: str) -> None:
    """Tensions of the first snapshot over a scale, N/m, means around the hoop, along the unloaded wall."""
    for name, label, colour in (("tension_generatrix", "generatrix", BLUE), ("tension_hoop", "hoop", ORANGE)):
        values = shots.fields[name][0].mean(axis=1)
        axes.plot(np.linspace(0.0, shell_of(case["shell"]).wall, len(values)), values / scale, color=colour, label=label)
    axes.set(title="Tensions of the fabric", ylabel=unit)


def draw_radius(axes: Axes, case: dict[str, Any], shots: Snapshots) -> None:
    """Radius of the first snapshot, mean around the hoop, along the unloaded wall."""
    radius = np.hypot(shots.xyz[0, ..., 0], shots.xyz[0, ..., 1]).mean(axis=1)
    axes.plot(np.linspace(0.0, shell_of(case["shell"]).wall, len(radius)), radius, color=BLUE)
    axes.set(title="Radius", ylabel="m")


def draw_energy(axes: Axes, history: NDArray[Any]) -> None:
    """Kinetic energy and what changed it since the start."""
    time = history["time"] * 1e3
    axes.plot(time, history["kinetic_energy"] * 1e-3, color=INK, label="kinetic energy")
    for label, colour, names in (
        ("work of gas", ORANGE, ("pressure",)),
        ("work of gravity", GREEN, ("gravity",)),
        ("work of fabric, belts", BLUE, ("elastic", "viscous", "belts")),
        ("work of contact", GREY, ("ground", "contact")),
    ):
        axes.plot(time, sum(history[f"work_{name}"] for name in names) * 1e-3, color=colour, label=label)
    axes.set(title="Energy", ylabel="kJ")


def moments(shots: Snapshots, count: int) -> list[int]:
    """Indices of at most `count` snapshots, the first, the last and the one of the lowest cover among them, of 3 and more.

    On both sides of the lowest they are evenly spaced in time. Of strokes alike the first is the lowest. None is one that a
    divergence spoilt.
    """
    sound = np.flatnonzero(np.isfinite(shots.xyz).all(axis=(1, 2, 3)))
    times, height = shots.times[sound], shots.height[sound]
    near = int(np.argmax(height <= height.min() + ALIKE * np.ptp(height)))
    up = np.flatnonzero(np.diff(height[near:]) > 0.0)
    lowest = near + int(up[0]) if up.size else len(sound) - 1
    wanted = np.linspace(times[0], times[-1], count)
    if 0 < lowest < len(sound) - 1 and count > 2:
        share = (times[lowest] - times[0]) / (times[-1] - times[0])
        down = min(max(round((count - 1) * share), 1), count - 2)
        wanted = np.append(
            np.linspace(times[0], times[lowest], down, endpoint=False), np.linspace(times[lowest], times[-1], count - down)
        )
    return sorted({int(sound[np.argmin(np.abs(times - time))]) for time in wanted})


def when(shots: Snapshots, shot: int) -> str:
    """Time and speed of a snapshot."""
    return f"{shots.times[shot] * 1e3:.1f} ms{SPACE}{speed(shots, shot)}"


def speed(shots: Snapshots, shot: int) -> str:
    """Speed of the cargo in a snapshot, downwards unless it says otherwise."""
    down = round(-shots.velocity[shot], 2) + 0.0
    return f"{-down:.2f} m/s up" if down < 0.0 else f"{down:.2f} m/s"


def cut(shots: Snapshots, shot: int) -> list[tuple[NDArray[Any], NDArray[Any]]]:
    """Radius (m, negative on the left) and height (m) of column 0 of a snapshot and of the column opposite, each (n1+1,)."""
    sides = []
    for column, side in ((0, 1.0), (shots.xyz.shape[2] // 2, -1.0)):
        outward = shots.xyz[0, 0, column, :2] / np.hypot(*shots.xyz[0, 0, column, :2])
        sides.append((side * (shots.xyz[shot, :, column, :2] @ outward), shots.xyz[shot, :, column, 2]))
    return sides


def view(case: dict[str, Any], shots: Snapshots, chosen: Sequence[int]) -> dict[str, tuple[float, float]]:
    """Limits, m, that hold the cuts of some snapshots, for `Axes.set`."""
    shell = shell_of(case["shell"])
    beside = float(np.abs(shots.xyz[chosen][..., [0, case["grid"]["hoop"] // 2], :2]).max())
    reach = 1.1 * max(0.8 * shell.diameter, beside)
    return {"xlim": (-reach, reach), "ylim": (-0.08 * shell.height, shots.height[0] + 0.57 * shell.upper_diameter)}


def draw_profile(axes: Axes, case: dict[str, Any], shots: Snapshots, shot: int) -> None:
    """The cut through column 0 and the opposite one, with belts, cargo, cover and ground."""
    shell = shell_of(case["shell"])
    rows = belt_rows(shell, [belt["height"] for belt in case["belts"]], case["grid"]["generatrix"])
    radius, box = shell.upper_diameter / 2, case["cargo"]["diameter"]
    top = min(case["cargo"].get("height", np.inf), 0.48 * shell.upper_diameter)  # of the cargo, as far as there is room
    for side, (r, z) in zip((1.0, -1.0), cut(shots, shot), strict=True):
        axes.plot(r, z, color=BLUE, linewidth=1.3, label="shell" if side > 0 else None)
        axes.plot(r[rows], z[rows], "o", color=GREEN, markersize=3.5, label="belts" if side > 0 and rows else None)
    height = shots.height[shot]
    axes.fill_between([-box / 2, box / 2], height, height + top, facecolor=CARGO_COLOUR, edgecolor=INK, linewidth=0.8)
    axes.plot([-radius, radius], [height, height], color=INK, linewidth=2.0, solid_capstyle="butt")
    axes.axhspan(-0.08 * shell.height, 0.0, color=GROUND_COLOUR, linewidth=0)
    axes.axhline(0.0, color=INK, linewidth=0.8)
