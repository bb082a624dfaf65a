"""Pictures of a result file: curves with deformed profiles, and the drop in three dimensions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softbrake.case.sections.shell import shell_of
from softbrake.report.plots import panels
from softbrake.report.plots.style import (
    CARGO_COLOUR,
    COVER_COLOUR,
    GREY,
    GROUND_COLOUR,
    INK,
    STYLE,
    PlotError,
    load_matplotlib,
    save,
)
from softbrake.sim.result_file import (
    Snapshots,
    belt_rows,
    read_case,
    read_history,
    read_inflation,
    read_snapshots,
    read_summary,
    read_tension_scale,
)
from softbrake.sim.summary import Inflation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TENSION_COLOURS = ["#f6f1e4", "#f4cf8c", "#e98a48", "#c23a33", "#6d1330"]


def plot_result(path: Path | str, picture: Path | str, dimensionless: bool = False) -> None:
    """Draw profiles and curves of a result file to `picture`: .png, .svg or .pdf.

    `dimensionless` divides tensions by `results.tension_scale`. Raises PlotError and ResultError.
    """
    save(result_figure(path, dimensionless), picture)


def draw_drop(path: Path | str, picture: Path | str, instants: int = 4) -> None:
    """Draw `instants` snapshots side by side in three dimensions, coloured by hoop tension. Raises PlotError and ResultError."""
    save(drop_figure(path, instants), picture)


def result_figure(path: Path | str, dimensionless: bool = False) -> Figure:
    """The figure of `plot_result`."""
    mpl = load_matplotlib()
    scale, unit = 1e3, "kN/m"
    if dimensionless:
        scale, unit = read_tension_scale(path), "T / (T$_0$/L)"
        if scale == 0.0:
            raise PlotError(f"{path}: a run without pressure has no dimensionless tensions")
    if (inflation := read_inflation(path)) is not None:
        return inflation_figure(path, inflation, scale, unit)
    case, history, summary = read_case(path), read_history(path), read_summary(path)
    shots = read_snapshots(path)
    if len(shots.times) == 0 or len(history) == 0:
        raise PlotError(f"{path}: the run stopped before it recorded anything")

    with mpl.rc_context(STYLE):
        of_gas = panels.gas_panels(history, summary)
        figure: Figure = mpl.figure.Figure(figsize=(17.0 if of_gas else 12.0, 7.6), layout="constrained")
        figure.suptitle(_headline(case, summary), fontsize=12, parse_math=False)  # a title may hold dollars
        parts: Any = figure.subfigures(1, 3 if of_gas else 2, width_ratios=(1.0, 1.15, 0.95)[: 3 if of_gas else 2])
        _draw_profiles(parts[0].subplots(3, 2, sharex=True, sharey=True), case, shots)
        speed, brake, tension, energy = axes = parts[1].subplots(4, 1, sharex=True)
        panels.draw_speed(speed, case, history, summary)
        panels.draw_deceleration(brake, case, history)
        panels.draw_tensions(tension, case, history, scale, unit)
        panels.draw_energy(energy, history)
        energy.set_xlabel("time, ms")
        if of_gas:
            gas = parts[2].subplots(len(axes), 1, sharex=True)
            for panel in gas[len(of_gas) :]:
                panel.set_axis_off()
            for panel, draw in zip(gas, of_gas, strict=False):
                draw(panel)
            gas[len(of_gas) - 1].tick_params(labelbottom=True)
            gas[len(of_gas) - 1].set_xlabel("time, ms")
            axes = [*axes, *gas[: len(of_gas)]]
        for panel in axes:
            panel.margins(x=0.0)
            if panel.get_ylabel() != "K":
                panel.axhline(0.0, color=GREY, linewidth=0.6, zorder=0)
            if panel.get_legend_handles_labels()[0]:
                panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def inflation_figure(path: Path | str, inflation: Inflation, scale: float, unit: str) -> Figure:
    """Cut, tensions over a scale (N/m) and radius along the wall of an inflated shell. Raises PlotError and ResultError."""
    mpl = load_matplotlib()
    case, shots = read_case(path), read_snapshots(path, "tension_generatrix", "tension_hoop")
    with mpl.rc_context(STYLE):
        figure: Figure = mpl.figure.Figure(figsize=(10.0, 5.0), layout="constrained")
        pressure = f"{inflation.pressure / 1e3:.4g} kPa, force on the cover {inflation.cover_force:.4g} N"
        figure.suptitle(f"{inflation.title}\ninflated, at rest: {pressure}", fontsize=12, parse_math=False)
        parts: Any = figure.subfigures(1, 2)
        shape = parts[0].subplots()
        panels.draw_profile(shape, case, shots, 0)
        shape.set(aspect="equal", xlabel="r, m", ylabel="z, m", **panels.view(case, shots, [0]))
        shape.grid(False)
        shape.legend(loc="upper right")
        tension, radius = parts[1].subplots(2, 1, sharex=True)
        panels.draw_wall_tensions(tension, case, shots, scale, unit)
        tension.legend()
        panels.draw_radius(radius, case, shots)
        radius.set_xlabel("height on the unloaded shell, m")
    return figure


def drop_figure(path: Path | str, instants: int = 4) -> Figure:
    """The figure of `draw_drop`."""
    mpl = load_matplotlib()
    from matplotlib.collections import PolyCollection

    case, shots = read_case(path), read_snapshots(path, "tension_hoop")
    if len(shots.times) == 0:
        raise PlotError(f"{path}: the run stopped before it recorded anything")
    tension = shots.fields["tension_hoop"] * 1e-3
    chosen = panels.moments(shots, instants)
    limit = float(np.percentile(tension[chosen], 99.5))
    limit = limit if limit > 0.0 else 1.0
    colours = mpl.colors.LinearSegmentedColormap.from_list("tension", TENSION_COLOURS)
    reach = 1.1 * max(0.8 * shell_of(case["shell"]).diameter, float(np.abs(shots.xyz[chosen, ..., :2]).max()))
    pitch = np.array([2.1 * reach, 0.0])

    with mpl.rc_context(STYLE):
        figure: Figure = mpl.figure.Figure(figsize=(2.9 * len(chosen), 4.3), layout="constrained")
        axes = figure.subplots()
        axes.set_aspect("equal")
        axes.axis("off")
        for place, shot in enumerate(chosen):
            shift = place * pitch
            depth = reach * np.sin(_ELEVATION)
            axes.add_patch(mpl.patches.Ellipse(shift, 2 * reach, 2 * depth, facecolor=GROUND_COLOUR, linewidth=0, zorder=0))
            faces, paint, widths = _scene(case, shots.xyz[shot], tension[shot] / limit, colours)
            axes.add_collection(
                PolyCollection([face + shift for face in faces], facecolors=paint, edgecolors=paint, linewidths=widths)
            )
            label = f"{shots.times[shot] * 1e3:.0f} ms\n{panels.speed(shots, shot)}"
            axes.text(shift[0], -1.3 * depth, label, ha="center", va="top", fontsize=11, color=INK)
        axes.autoscale_view()
        axes.margins(0.01)
        bar = figure.colorbar(
            mpl.cm.ScalarMappable(mpl.colors.Normalize(0.0, limit), colours), ax=axes, shrink=0.6, aspect=18, pad=0.01
        )
        bar.set_label("hoop tension, kN/m")
        bar.outline.set_visible(False)
    return figure


def _draw_profiles(axes: NDArray[Any], case: dict[str, Any], shots: Snapshots) -> None:
    """Cuts at as many instants as there are panels, in rows."""
    chosen = panels.moments(shots, axes.size)
    for panel, shot in zip(axes.flat, chosen, strict=False):
        panels.draw_profile(panel, case, shots, shot)
        panel.set_title(panels.when(shots, shot), fontweight="normal")
        radius = shell_of(case["shell"]).upper_diameter / 2
        panel.set(aspect="equal", **panels.view(case, shots, chosen))
        panel.set_xticks(np.round([-radius, 0.0, radius], 6))
        panel.grid(False)
    inside = {"bbox_to_anchor": (0.0, 0.5 * shots.height[0]), "bbox_transform": axes[0, 0].transData}  # between the walls
    axes[0, 0].legend(loc="center", borderpad=0.0, handlelength=1.0, borderaxespad=0.0, **inside)
    for panel in axes[-1]:
        panel.set_xlabel("r, m")
    for panel in axes[:, 0]:
        panel.set_ylabel("z, m")
    for panel in axes.flat[len(chosen) :]:
        panel.set_axis_off()


def _headline(case: dict[str, Any], summary: Any) -> str:
    if summary is None:
        answer = "unfinished run"
    elif summary.impact_velocity is not None:
        answer = f"impact at {summary.impact_velocity:.3f} m/s, free fall {summary.free_fall_velocity:.3f} m/s"
    elif summary.rebound_velocity is not None:
        answer = f"rebound at {summary.rebound_velocity:.3f} m/s, lowest at {summary.lowest_height:.4g} m"
    else:
        answer = f"{summary.outcome.replace('_', ' ')}, no impact"
    return f"{case['title']}\n{answer}"


_AZIMUTH, _ELEVATION = np.radians(25.0), np.radians(16.0)
_RIGHT = np.array([np.cos(_AZIMUTH), np.sin(_AZIMUTH), 0.0])
_TOWARDS = np.array([np.sin(_AZIMUTH) * np.cos(_ELEVATION), -np.cos(_AZIMUTH) * np.cos(_ELEVATION), np.sin(_ELEVATION)])
_UP = np.cross(_TOWARDS, _RIGHT)
_LIGHT = 0.6 * _TOWARDS - 0.45 * _RIGHT + 0.65 * _UP


def _project(xyz: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Place in the picture (…, 2) and nearness to the eye (…)."""
    return np.stack((xyz @ _RIGHT, xyz @ _UP), axis=-1), xyz @ _TOWARDS


def _scene(
    case: dict[str, Any], xyz: NDArray[Any], tension: NDArray[Any], colours: Any
) -> tuple[list[NDArray[Any]], NDArray[Any], NDArray[Any]]:
    """Shell, belts, cover and cargo as polygons in the picture, farthest first: corners, colours, line widths."""
    diameter, height = shell_of(case["shell"]).upper_diameter, float(xyz[-1, :, 2].mean())
    xyz, tension = (np.concatenate((values, values[:, :1]), axis=1).astype(float) for values in (xyz, tension))
    wall = _quads(xyz)
    level = 0.25 * (tension[:-1, :-1] + tension[:-1, 1:] + tension[1:, 1:] + tension[1:, :-1]).ravel()
    rows = belt_rows(shell_of(case["shell"]), [belt["height"] for belt in case["belts"]], case["grid"]["generatrix"])
    belts = np.stack((xyz[rows, :-1], xyz[rows, 1:]), axis=-2).reshape(-1, 2, 3)
    cover, crate = _cover(height, diameter), _crate(height + 0.03 * diameter, 0.64 * diameter)

    faces, paint, widths, nearness = [], [], [], []
    # Parts that touch are told apart by a nudge towards the eye or away from it, in diameters.
    for polygons, colour, width, nudge in (
        (wall, _shade(colours(level), wall), 0.4, 0.0),
        (cover, _shade(COVER_COLOUR, cover), 0.4, -0.02),
        (crate, _shade(CARGO_COLOUR, crate), 0.4, 0.02),
        (belts, np.tile(_shade(INK), (len(belts), 1)), 1.6, 0.06),
    ):
        places, near = _project(polygons)
        faces += [*places]
        paint.append(colour)
        widths.append(np.full(len(polygons), width))
        nearness.append(near.mean(axis=1) + nudge * diameter)
    order = np.argsort(np.concatenate(nearness))
    return [faces[k] for k in order], np.concatenate(paint)[order], np.concatenate(widths)[order]


def _quads(grid: NDArray[Any]) -> NDArray[Any]:
    """Cells (…, 4, 3) of a grid of points (rows, columns, 3)."""
    return np.stack((grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]), axis=-2).reshape(-1, 4, 3)


def _cover(height: float, diameter: float) -> NDArray[Any]:
    """Rim and top of the plate on the shell, in small quads, m."""
    angle = np.linspace(0.0, 2 * np.pi, 73)
    circle = np.stack((np.cos(angle), np.sin(angle), 0.0 * angle), axis=-1)
    rings = np.array([circle, *(circle * size for size in np.linspace(1.0, 0.0, 9))]) * 0.5 * diameter
    rings[0, :, 2] += height
    rings[1:, :, 2] += height + 0.03 * diameter
    return _quads(rings)


def _crate(height: float, side: float) -> NDArray[Any]:
    """Walls and top of the cargo, in small quads, m."""
    line = np.linspace(-0.5, 0.5, 13)
    u, v = np.meshgrid(line, line)
    half = np.full_like(u, 0.5)
    walls = [(u, -half, v), (half, u, v), (-u, half, v), (-half, -u, v), (u, v, half)]
    unit = np.concatenate([_quads(np.stack(wall, axis=-1)) for wall in walls])
    unit *= [side, side, 0.75 * side]
    unit[..., 2] += height + 0.375 * side
    return unit


def _shade(colour: str | NDArray[Any], faces: NDArray[Any] | None = None) -> NDArray[Any]:
    """One colour or (n, 4) colours, darkened by the angle between each face and the light."""
    from matplotlib.colors import to_rgba

    rgba = np.atleast_2d(np.array(to_rgba(colour)) if isinstance(colour, str) else colour)
    if faces is None:
        return rgba
    normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, -1] - faces[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-12
    normal *= np.where(normal @ _TOWARDS < 0, -1.0, 1.0)[:, None]  # cloth is seen from both sides
    light = 0.62 + 0.42 * np.clip(normal @ _LIGHT, 0.0, 1.0)
    return np.column_stack((np.clip(rgba[:, :3] * light[:, None], 0.0, 1.0), np.ones(len(faces))))
