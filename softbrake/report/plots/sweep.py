"""A picture of the answers of a sweep over its axes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softbrake.case.units import STANDARD_GRAVITY
from softbrake.report.plots.style import BLUE, GREEN, GREY, INK, ORANGE, RED, STYLE, PlotError, load_matplotlib, save
from softbrake.report.results_csv import PEAKS, Row, numbers
from softbrake.report.words import stops
from softbrake.studies.axes import Axis
from softbrake.studies.sweep import Plan

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PICTURE = "sweep.png"
MOST_AXES = 6  # of a scatter matrix
MOST_DOTS = 1000  # over contours
COLOURS = (BLUE, ORANGE, GREEN, RED, GREY, INK)


def draw_sweep(plan: Plan, table: Sequence[Row], picture: Path) -> None:
    """Draw the answers over the axes: curves over one axis, contours over two, a scatter matrix beyond. Raises PlotError."""
    if not plan.axes:
        raise PlotError("no picture: the sweep has no axis")
    mpl = load_matplotlib()
    scales = [Scale(axis, [row[axis.path] for row in table]) for axis in plan.axes]
    words, others = ([scale for scale in scales if bool(scale.words) == wanted] for wanted in (True, False))
    with mpl.rc_context(STYLE):
        if len(scales) == 1:
            figure = _curves(mpl, scales[0], table)
        elif len(words) == len(others) == 1:
            figure = _curves(mpl, others[0], table, words[0])
        elif len(others) == len(scales) == 2 and spread(scales):
            figure = _contours(mpl, scales, table)
        else:
            figure = _scatter_matrix(mpl, scales[:MOST_AXES], table)
        figure.suptitle(plan.title, fontsize=12, parse_math=False)
        save(figure, picture)


class Scale:
    """Where the values of an axis stand in a picture: numbers in the unit asked for or a readable one, words side by side."""

    def __init__(self, axis: Axis, values: Sequence[float | str]) -> None:
        self.log = axis.log
        self.words = [] if all(isinstance(value, (int, float)) for value in values) else list(dict.fromkeys(map(str, values)))
        if self.words:
            self.at: NDArray[Any] = np.array([self.words.index(str(value)) for value in values], float)
            self.label = axis.path
            return
        numbers = np.array(values, float)
        unit, size = axis.shown, axis.size
        if not axis.asked and axis.unit[:2] in ("N/", "Pa", "N") and np.abs(numbers).max() >= 1e3:
            unit, size = f"k{axis.unit}", 1e3
        elif not axis.asked and axis.unit == "m" and np.abs(numbers).max() < 0.1:
            unit, size = "mm", 1e-3
        self.at = numbers / size
        self.label = f"{axis.path}, {unit}" if unit else axis.path

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest value."""
        return float(self.at.min()), float(self.at.max())

    def share(self) -> NDArray[Any]:
        """How far along the axis each value stands, 0 to 1."""
        at = np.log(self.at) if self.log else self.at
        share: NDArray[Any] = (at - at.min()) / (np.ptp(at) or 1.0)
        return share

    def value(self, share: NDArray[Any]) -> NDArray[Any]:
        """The values at parts of the way along the axis."""
        low, high = self.ends
        return low * (high / low) ** share if self.log else low + (high - low) * share

    def along(self, axes: Axes, which: str) -> None:
        axes.set(**{f"{which}label": self.label})
        if self.log:
            from matplotlib.ticker import LogFormatter

            axes.set(**{f"{which}scale": "log"})
            numbers = getattr(axes, f"{which}axis")
            numbers.set_major_formatter(LogFormatter())  # plain text: on a page nothing sets formulas
            numbers.set_minor_formatter(LogFormatter(minor_thresholds=(2.0, 0.4)))
        if self.words:
            axes.set(**{f"{which}ticks": range(len(self.words)), f"{which}ticklabels": self.words})


def _curves(mpl: Any, scale: Scale, table: Sequence[Row], words: Scale | None = None) -> Figure:
    """Answers over one axis; with words beside it a line for each, and the hoop's tension for all three."""
    figure: Figure = mpl.figure.Figure(figsize=(7.4, 7.6), layout="constrained")
    panels: Any = figure.subplots(3, 1, sharex=True)
    for panel, title, unit in zip(
        panels,
        ("Impact velocity", "Peak deceleration, 1 kHz", "Peak tensions" if words is None else "Peak tension, hoop"),
        ("m/s", "g", "kN/m"),
        strict=True,
    ):
        panel.set(title=title, ylabel=unit)
    impact, braking = numbers(table, "impact_velocity"), numbers(table, PEAKS[0], 1.0 / STANDARD_GRAVITY)
    everything = np.ones(len(table), bool)
    if words is None:
        _line(panels[0], scale, impact, everything, BLUE, "")
        _line(panels[1], scale, braking, everything, RED, "")
        for peak, label, colour in zip(PEAKS[1:], ("generatrix", "hoop", "belt"), (BLUE, ORANGE, GREEN), strict=True):
            _line(panels[2], scale, numbers(table, peak, 1e-3), everything, colour, label)
    else:
        for number, word in enumerate(words.words):
            colour = COLOURS[number % len(COLOURS)]
            for panel, values in zip(panels, (impact, braking, numbers(table, PEAKS[2], 1e-3)), strict=True):
                _line(panel, scale, values, words.at == number, colour, "")
            panels[0].plot([], [], color=colour, label=word)
    stopped = np.array([stops(row["outcome"], row.get("rest_time")) for row in table])
    if stopped.any():
        panels[0].plot(scale.at[stopped], impact[stopped], "o", color=INK, fillstyle="none", label="stops above the ground")
    if stopped.any() or words is not None:
        panels[0].legend()
    failed = scale.at[[bool(row["fault"]) for row in table]]
    if len(failed):
        for panel in panels:
            panel.plot(failed, np.zeros(len(failed)), "x", color=RED, transform=panel.get_xaxis_transform(), clip_on=False)
        _count_failures(panels[0], len(failed))
    scale.along(panels[2], "x")
    return figure


def _line(panel: Axes, scale: Scale, values: NDArray[Any], chosen: NDArray[Any], colour: str, label: str) -> None:
    """A curve with its name at its end."""
    order = np.flatnonzero(chosen)
    order = order[np.argsort(scale.at[order], kind="stable")]
    sound = order[np.isfinite(values[order])]
    if not len(sound):
        return
    panel.plot(scale.at[order], values[order], color=colour, marker="o" if len(order) <= 40 else "", markersize=3.5)
    if label:
        end = (scale.at[sound[-1]], values[sound[-1]])
        panel.annotate(label, end, (5, 0), textcoords="offset points", va="center", color=colour, fontsize=8)


def _count_failures(panel: Axes, count: int) -> None:
    panel.annotate(f"× no answer: {count}", (1.0, 1.02), xycoords="axes fraction", ha="right", color=RED, fontsize=8)


def spread(scales: Sequence[Scale]) -> bool:
    """Whether the runs lie about the plane of two axes, not along a line."""
    points = np.stack([scale.share() for scale in scales], axis=1)
    return len(points) >= 3 and int(np.linalg.matrix_rank(points - points.mean(axis=0), tol=1e-6)) == 2


def colour_range(values: NDArray[Any]) -> tuple[float, float]:
    """Least and largest of values, but for those far off all others: beyond three times the middle half from it."""
    low, first, third, high = np.percentile(values, [0, 25, 75, 100])
    reach = 3.0 * (third - first)
    return (float(max(low, first - reach)), float(min(high, third + reach))) if reach > 0.0 else (float(low), float(high))


def draw_map(panel: Axes, scales: Sequence[Scale], values: NDArray[Any]) -> Any:
    """Fill the plane of two axes with the colours of an answer, (n,), NaN where a run has none; return what a colour bar needs.

    Triangles join all runs, in axes from 0 to 1. One that has a run without an answer stays empty; None where all do.
    """
    from matplotlib.ticker import MaxNLocator
    from matplotlib.tri import Triangulation

    sound = np.isfinite(values)
    filled = None
    mesh = Triangulation(*(scale.share() for scale in scales))
    empty = ~sound[mesh.triangles].all(axis=1)
    if not empty.all() and np.ptp(values[sound]) > 0.0:
        mesh.set_mask(empty)
        low, high = float(values[sound].min()), float(values[sound].max())
        levels = MaxNLocator(14).tick_values(*colour_range(values[sound]))
        extend = {(True, True): "both", (True, False): "min", (False, True): "max"}.get((low < levels[0], high > levels[-1]))
        finite = np.where(sound, values, low)
        filled = panel.tricontourf(mesh, finite, levels, cmap="viridis", extend=extend or "neither")
        lines = panel.tricontour(mesh, finite, levels[::2], colors="white", linewidths=0.6)
        for path in (*filled.get_paths(), *lines.get_paths()):
            path.vertices = np.column_stack(
                [scale.value(part) for scale, part in zip(scales, np.asarray(path.vertices).T, strict=True)]
            )
    for which, scale in zip("xy", scales, strict=True):
        scale.along(panel, which)
        panel.set(**{f"{which}lim": scale.ends})
    x, y = (scale.at for scale in scales)
    if sound.any() and len(values) <= MOST_DOTS:
        panel.plot(
            x[sound], y[sound], ".", color="white", markersize=3.0, markeredgecolor=GREY, markeredgewidth=0.4, clip_on=False
        )
    if not sound.all():  # an empty line without a clip would count as a marker in the corner, and squeeze the panel
        panel.plot(x[~sound], y[~sound], "x", color=RED, markersize=5.0, clip_on=False)
    if filled is not None:
        panel.clabel(lines, fontsize=7.5)
    elif sound.any() and np.ptp(values[sound]) == 0.0:
        panel.annotate(f"{values[sound][0]:.4g} in each run", (0.5, 0.5), xycoords="axes fraction", ha="center", color=GREY)
    panel.grid(False)
    return filled


def _contours(mpl: Any, scales: Sequence[Scale], table: Sequence[Row]) -> Figure:
    figure: Figure = mpl.figure.Figure(figsize=(11.0, 4.6), layout="constrained")
    panels: Any = figure.subplots(1, 2, sharey=True)
    for panel, name, unit, title in (
        (panels[0], "impact_velocity", 1.0, "Impact velocity, m/s"),
        (panels[1], PEAKS[0], 1.0 / STANDARD_GRAVITY, "Peak deceleration, 1 kHz, g"),
    ):
        values = numbers(table, name, unit)
        filled = draw_map(panel, scales, values)
        if filled is not None:
            figure.colorbar(filled, ax=panel).outline.set_visible(False)
        panel.set_title(title)
        if lost := int(np.isnan(values).sum()):
            _count_failures(panel, lost)
    panels[1].set_ylabel("")
    return figure


def _scatter_matrix(mpl: Any, scales: Sequence[Scale], table: Sequence[Row]) -> Figure:
    """Below the diagonal runs over each two axes, coloured by impact velocity; on it that velocity over each axis."""
    count = len(scales)
    figure: Figure = mpl.figure.Figure(figsize=(2.6 * count + 2.0, 2.2 * count + 0.8), layout="constrained")
    panels: Any = figure.subplots(count, count, squeeze=False)
    impact = numbers(table, "impact_velocity")
    failed = np.array([bool(row["fault"]) for row in table])
    shades, sound = None, impact[np.isfinite(impact)]
    low, high = colour_range(sound) if len(sound) else (0.0, 1.0)
    for i, down in enumerate(scales):
        for j, across in enumerate(scales):
            panel = panels[i, j]
            if j > i:
                panel.remove()
                continue
            if i == j:
                panel.plot(across.at, impact, ".", color=BLUE, markersize=4.0)
                panel.set_ylabel("impact, m/s")
            else:
                shades = panel.scatter(across.at, down.at, c=impact, s=10.0, cmap="viridis", vmin=low, vmax=high)
                panel.plot(across.at[failed], down.at[failed], "x", color=RED, markersize=4.0)
                down.along(panel, "y")
            across.along(panel, "x")
    if shades is not None:
        figure.colorbar(shades, ax=panels[-1, -1], label="impact velocity, m/s").outline.set_visible(False)
    return figure
