"""Figures of the HTML page, and how they get into it: as SVG text in the colours of the page, by day and by night."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softbrake.report.plots import panels
from softbrake.report.plots.chance import Sampled, draw_distribution, draw_scatter, draw_tornado
from softbrake.report.plots.comparison import draw_overlay
from softbrake.report.plots.style import (
    BLUE,
    CARGO_COLOUR,
    GREEN,
    GREY,
    GROUND_COLOUR,
    INK,
    LINE,
    ORANGE,
    RED,
    SOFT,
    STYLE,
    load_matplotlib,
)
from softbrake.report.plots.sweep import Scale, draw_map
from softbrake.sim.result_file import Snapshots
from softbrake.sim.summary import Summary

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from softbrake.studies.comparison import Comparison

WIDTH, HEIGHT = 420.0, 230.0  # of a chart, in pixels of the page where it is not stretched
LEFT, RIGHT, TOP, BOTTOM, KEY = 46.0, 14.0, 8.0, 36.0, 15.0  # its margins, and a line of its key
MAP_LEFT, MAP_RIGHT, MAP_HIGHER = 64.0, 74.0, 60.0  # of a map: room for its label and its colour bar, and above a chart
SHAPE_WIDTH = 200.0
BUCKETS = 300  # of a curve: the least and the largest value of each is drawn
KEYS_A_LINE = 3
DASHES: tuple[Any, ...] = (
    "-",
    (0, (6, 3)),
    (0, (2, 2)),
    (0, (8, 2, 2, 2)),
    (0, (1, 3)),
)  # for those who see no colours, and on paper
THEME = {  # variables of the page: by day, as in pictures, and by night
    "ink": (INK, "#e8eaed"),
    "soft": (SOFT, "#a3abb4"),
    "line": (LINE, "#3a4047"),
    "blue": (BLUE, "#56b4e9"),
    "orange": (ORANGE, "#f08b3e"),
    "green": (GREEN, "#2fc79a"),
    "red": (RED, "#f2867a"),
    "grey": (GREY, "#98a0a9"),
    "cargo": (CARGO_COLOUR, "#8a6a40"),
    "ground": (GROUND_COLOUR, "#343a41"),
}
PAGE_STYLE = STYLE | {
    "font.size": 11.0,
    "font.sans-serif": ["DejaVu Sans"],  # by which texts are measured; the page has its own
    "legend.fontsize": 11.0,
    "legend.labelcolor": SOFT,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "axes.labelcolor": SOFT,
    "xtick.major.size": 0.0,
    "ytick.major.size": 0.0,
    "axes.spines.left": False,
    "axes.spines.bottom": False,
    "axes.grid.axis": "y",
    "axes.autolimit_mode": "round_numbers",
    "axes.xmargin": 0.0,
    "axes.ymargin": 0.0,
    "grid.color": LINE,
    "lines.linewidth": 1.6,
    "lines.markersize": 5.0,
    "path.simplify": False,
    "text.parse_math": False,
    "svg.fonttype": "none",  # texts stay texts, in the font of the page
    "svg.hashsalt": "softbrake",  # the same page twice is the same
}
STRANGE = (  # what a drawing in a page does not need
    r"^.*?(?=<svg)",
    r"<metadata>.*?</metadata>",
    r"<!--.*?-->",
    r"<style .*?</style>",
    r"<clipPath .*?</clipPath>",
    r"<defs>\s*</defs>",
    r' clip-path="[^"]*"',
    r' transform="rotate\(-0 [^"]*"',
    r' id="[a-z][\w.]*_\d+"',
    r' xmlns(:xlink)?="[^"]*"',
)


def drop_charts(case: dict[str, Any], history: NDArray[Any], summary: Summary | None) -> list[Figure]:
    """Courses of a drop over time. Raises PlotError."""

    def speed(axes: Axes) -> None:
        panels.draw_speed(axes, case, history, summary)
        if summary is not None and summary.impact_velocity is not None and summary.impact_time is not None:
            error = summary.impact_velocity_error or 0.0
            ends = summary.impact_velocity - error, summary.impact_velocity + error
            axes.plot([summary.impact_time * 1e3] * 2, ends, color=RED)

    drawings: list[Callable[[Axes], None]] = [
        speed,
        lambda axes: panels.draw_height(axes, history),
        lambda axes: panels.draw_deceleration(axes, case, history),
    ]
    drawings += panels.gas_panels(history, summary) or [lambda axes: panels.draw_pressure(axes, history)]
    if case["model"]["fidelity"] != "lumped":
        drawings.append(lambda axes: panels.draw_tensions(axes, case, history, 1e3, "kN/m"))
    drawings.append(lambda axes: panels.draw_energy(axes, history))
    return [_chart(draw, "time, ms") for draw in drawings]


def overlay_charts(found: Comparison) -> list[Figure]:
    """Each quantity of a drop and of its test over time. Raises PlotError."""
    return [_chart(partial(draw_overlay, each=each), "time of the drop, ms") for each in found.quantities]


def wall_charts(case: dict[str, Any], shots: Snapshots) -> list[Figure]:
    """Tensions and radius along the wall of the first snapshot, which has the fields of both tensions. Raises PlotError."""
    drawings: list[Callable[[Axes], None]] = [
        lambda axes: panels.draw_wall_tensions(axes, case, shots, 1e3, "kN/m"),
        lambda axes: panels.draw_radius(axes, case, shots),
    ]
    return [_chart(draw, "height on the unloaded shell, m") for draw in drawings]


def sweep_chart(
    title: str, unit: str, label: str, x: NDArray[Any], y: NDArray[Any], curve: bool, dots: bool, log: bool = False
) -> Figure:
    """An answer of all runs over an axis, as a curve in the order of x, as dots, or both. Raises PlotError."""

    def draw(axes: Axes) -> None:
        order = np.argsort(x, kind="stable")
        if curve:
            axes.plot(x[order], y[order], color=BLUE)
        if dots:
            axes.plot(x[order], y[order], "o", color=BLUE, markersize=4.0, markeredgewidth=0.0)
        axes.set(title=title, ylabel=unit, xscale="log" if log else "linear")

    return _chart(draw, label)


def sample_charts(one: Sampled) -> list[Figure]:
    """Charts of one answer of a sample: distribution, indices where there are, scatter over what moves it most."""
    scale = one.scales[0]
    charts = [_chart(lambda axes: draw_distribution(axes, one), one.unit)]
    if one.indices:
        charts.append(_chart(lambda axes: draw_tornado(axes, one), "part of the variance"))

    def scatter(axes: Axes) -> None:
        draw_scatter(axes, one)
        scale.along(axes, "x")

    return [*charts, _chart(scatter, scale.label)]


def map_chart(title: str, unit: str, scales: Sequence[Scale], values: NDArray[Any]) -> Figure:
    """An answer of all runs over the plane of two axes. Raises PlotError."""
    with _figure(WIDTH, HEIGHT + MAP_HIGHER) as figure:
        height = HEIGHT + MAP_HIGHER
        up = (height - TOP - BOTTOM) / height
        axes = figure.add_axes((MAP_LEFT / WIDTH, BOTTOM / height, (WIDTH - MAP_LEFT - MAP_RIGHT) / WIDTH, up))
        filled = draw_map(axes, scales, values)
        if filled is not None:
            bar = figure.add_axes((1.0 - (MAP_RIGHT - RIGHT) / WIDTH, BOTTOM / height, RIGHT / WIDTH, up))
            figure.colorbar(filled, cax=bar)
        figure.set_label(f"{title}, {unit}")
    return figure


def shapes(case: dict[str, Any], shots: Snapshots, count: int) -> list[Figure]:
    """Cuts through the shell at moments, all to one scale. Raises PlotError."""
    chosen = panels.moments(shots, count)
    view = panels.view(case, shots, chosen)
    (left, right), (low, high) = view["xlim"], view["ylim"]
    figures = []
    for shot in chosen:
        with _figure(SHAPE_WIDTH, SHAPE_WIDTH * (high - low) / (right - left)) as figure:
            axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
            axes.set_axis_off()
            panels.draw_profile(axes, case, shots, shot)
            axes.set(**view)
            figure.set_label(panels.when(shots, shot))
            figures.append(figure)
    return figures


def as_svg(figure: Figure) -> str:
    """A figure as text for a page. It holds names of the colours in THEME and those of maps, and refers to nothing outside it."""
    stream = io.StringIO()
    with load_matplotlib().rc_context(PAGE_STYLE):
        figure.savefig(stream, format="svg", transparent=True, metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    text = stream.getvalue()
    for pattern in STRANGE:
        text = re.sub(pattern, "", text, flags=re.DOTALL)
    text = text.replace("xlink:href", "href")
    text = re.sub(r"(?<= [dxy]=\")[^\"]*", lambda path: re.sub(r"(\.\d\d)\d+|\n", r"\1", path[0]), text)
    names = {colour: f"var(--{name})" for name, (colour, _) in THEME.items()}
    text = re.sub(r"(?<=[ :])#[0-9a-f]{6}\b", lambda colour: names.get(colour[0], colour[0]), text)
    return re.sub(r"\s*\n\s*", "\n", text).strip()


@contextmanager
def _figure(width: float, height: float) -> Iterator[Figure]:
    """A figure of so many pixels of the page, and the style to draw in it."""
    mpl = load_matplotlib()
    with mpl.rc_context(PAGE_STYLE):
        yield mpl.figure.Figure(figsize=(width / 72.0, height / 72.0))


def _chart(draw: Callable[[Axes], None], x_label: str) -> Figure:
    """A small chart with 0 in sight but in one of K, its key above it; its title and unit are the label of the figure."""
    with _figure(WIDTH, HEIGHT) as figure:
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        draw(axes)
        figure.set_label(f"{axes.get_title(loc='left')}, {axes.get_ylabel()}")
        zero = axes.get_ylabel() != "K"
        axes.set(title="", ylabel="")
        axes.set_xlim(*_span(np.concatenate([np.asarray(line.get_xdata(), float) for line in axes.lines])))
        curves = [line for line in axes.lines if line.get_linestyle() != "None"]
        for line in curves:
            line.set_data(*envelope(np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)))
        names = axes.get_legend_handles_labels()[1]
        for dash, line in zip(DASHES, (line for line in curves if line.get_label() in names), strict=False):
            line.set_linestyle(dash)
        if zero:
            axes.axhline(0.0, color=SOFT, linewidth=1.0, zorder=0)
        axes.set_xlabel(x_label, loc="right")
        lines = -(-len(names) // KEYS_A_LINE) if len(names) > 1 else 0
        if lines:
            place: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.0, "borderpad": 0.2}
            axes.legend(ncols=KEYS_A_LINE, **place, labelspacing=0.1, columnspacing=0.8, handlelength=1.7, handletextpad=0.4)
        across, up = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM - KEY * lines
        axes.set_position((LEFT / WIDTH, BOTTOM / HEIGHT, across / WIDTH, up / HEIGHT))
        axes.set_ylim(*axes.get_ylim())  # chosen here, by this style
    return figure


def _span(values: NDArray[Any]) -> tuple[float, float]:
    """Least and largest of the finite values, apart."""
    sound = values[np.isfinite(values)]
    low, high = (float(sound.min()), float(sound.max())) if len(sound) else (0.0, 1.0)
    return low, high if high > low else low + (abs(low) or 1.0)


def envelope(x: NDArray[Any], y: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """The finite points of a curve, of many the least and the largest of each bucket, and a gap where others lie between."""
    sound = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if len(sound) > 2 * BUCKETS:
        kept = {int(sound[0]), int(sound[-1])}
        for some in np.array_split(sound, BUCKETS):
            kept |= {int(some[np.argmin(y[some])]), int(some[np.argmax(y[some])])}
        sound = np.array(sorted(kept))
    lost = np.cumsum(~(np.isfinite(x) & np.isfinite(y)))[sound]
    gaps = np.flatnonzero(np.diff(lost)) + 1
    return np.insert(x[sound], gaps, np.nan), np.insert(y[sound], gaps, np.nan)
