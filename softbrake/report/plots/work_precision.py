"""Work-precision diagrams: error against time and against cell size, and what a node and step costs."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softbrake.report.plots.style import BLUE, GREY, INK, ORANGE, RED, STYLE, load_matplotlib, save
from softbrake.report.words import named
from softbrake.studies.work_precision import COURANTS, PAPER, UNITS, Measurement, WorkPrecision, model_in_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {
    ("lumped", "edge"): GREY,
    ("axisymmetric", "edge"): BLUE,
    ("full", "edge"): ORANGE,
    ("full", "cell"): RED,
}
DASHES = {("full", "cell"): (0, (1, 1))}  # others solid
MARKERS = dict(zip(COURANTS, ("o", "s", "^", "D"), strict=True))
BAND = "#ececec"


def draw_work_precision(found: WorkPrecision, picture: Path | str) -> None:
    """Draw a chart to `picture`: .png, .svg or .pdf. Raises PlotError."""
    save(work_precision_figure(found), picture)


def work_precision_figure(found: WorkPrecision) -> Figure:
    """The figure of `draw_work_precision`."""
    mpl = load_matplotlib()
    reference = found.reference
    assert reference is not None
    with mpl.rc_context(STYLE):
        count = len(reference.values)
        figure: Figure = mpl.figure.Figure(figsize=(4.2 * count + 3.8, 8.4), layout="constrained")
        basis = textwrap.fill(f"reference: {reference.basis}", 50 * count + 40)
        title = f"{found.case.title}{' (interrupted)' if found.interrupted else ''}"
        figure.suptitle(f"{title}\n{basis}", fontsize=11, parse_math=False)
        panels: Any = figure.subplots(2, count + 1, squeeze=False, width_ratios=[1.0] * count + [0.9])
        for number, ((above, below), name) in enumerate(zip(panels.T, reference.values, strict=False)):
            _draw_work(above, found, name, labelled=number == 0)
            _draw_order(below, found, name)
            bottom, top = _limits(found, name)
            for axes in (above, below):
                axes.set_ylim(bottom, top)
                axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
                axes.yaxis.set_minor_formatter("")
        _draw_rate(panels[0, -1], found)
        _draw_list(panels[1, -1], found)
    return figure


def _limits(found: WorkPrecision, name: str) -> tuple[float, float]:
    """Limits of the axis of errors (%): what is below the reference's own error is drawn within half a decade of it."""
    assert found.reference is not None
    floor = found.reference.error(name)
    errors = [error for run in found.runs if math.isfinite(error := found.ranked(run, name))]
    finite = floor if math.isfinite(floor) else 1.0
    return 100.0 * max(finite, 1e-9) / 3.0, 100.0 * 3.0 * max([*errors, 3.0 * finite, 1e-8])


def _shown(found: WorkPrecision, run: Measurement, name: str) -> float:
    """Error (%) as drawn: not below the axis; at its top where the run failed."""
    bottom, top = _limits(found, name)
    error = found.error(run, name)
    return 0.7 * top if math.isinf(error) else max(100.0 * error, 1.2 * bottom)


def _draw_work(axes: Axes, found: WorkPrecision, name: str, labelled: bool) -> None:
    """Error against CPU time, a line a family."""
    assert found.reference is not None
    for key, family in found.families().items():
        _draw_family(axes, found, family, name, [run.seconds for run in family])
        if labelled and key[1:] == ("edge", COURANTS[0]):
            first = next((run for run in family if found.failure(run) is None), family[0])
            place = first.seconds, _shown(found, first, name)
            axes.annotate(key[0], place, (-2, 7), color=COLOURS[key[:2]], **_label())
    front = found.front(name)
    axes.step(
        [run.seconds for run in front],
        [100.0 * found.ranked(run, name) for run in front],
        where="post",
        color=INK,
        linewidth=4.0,
        alpha=0.2,
        zorder=1,
    )
    for run in found.runs:
        if run.setting == PAPER:
            place = run.seconds, _shown(found, run, name)
            axes.plot(*place, "o", markersize=13, markerfacecolor="none", color=INK)
            axes.annotate(
                f"{PAPER.generatrix} x {PAPER.hoop}, Courant {PAPER.courant:g}", place, (6, 12), color=INK, **_label("right")
            )
    _draw_floor(axes, found, name)
    value = f"{found.reference.values[name]:.4g} {UNITS[name].replace('^2', '²')}"
    axes.set_title(f"{named(name)[0].upper()}{named(name)[1:]}: {value}, {_known(found, name)}")
    axes.set(xscale="log", yscale="log", xlabel="CPU time of the kernels, s", ylabel="error, %")


def _draw_order(axes: Axes, found: WorkPrecision, name: str) -> None:
    """Error against cell size, with the fitted order of the families of the largest step."""
    height = 1e3 * found.case.shell.height
    lines = [(key, family) for key, family in found.families().items() if key[0] != "lumped"]
    for _, family in lines:
        _draw_family(axes, found, family, name, [height / run.setting.generatrix for run in family])
    fitted = [(key, found.order(family, name)) for key, family in lines if key[2] == COURANTS[0]]
    for line, (key, order) in enumerate(fitted):
        text = f"{key[0]}: " + ("no order" if order is None else f"order {order:.1f}")
        axes.text(0.02, 0.97 - 0.055 * line, text, transform=axes.transAxes, va="top", fontsize=8, color=COLOURS[key[:2]])
    _draw_floor(axes, found, name)
    axes.set(xscale="log", yscale="log", xlabel="cell along the generatrix, mm (and how many)", ylabel="error, %")
    grids = sorted({run.setting.generatrix for key, family in lines for run in family})[::2]
    axes.set_xticks([height / n1 for n1 in grids], [f"{height / n1:.3g}\n({n1})" for n1 in grids])
    axes.minorticks_off()


def _draw_family(axes: Axes, found: WorkPrecision, family: Sequence[Measurement], name: str, places: Sequence[float]) -> None:
    """A line through the runs of a family; failures are crosses at the top, errors below the reference's own hollow."""
    assert found.reference is not None
    fidelity, scheme, courant = family[0].setting.family
    colour, dashes, main = COLOURS[fidelity, scheme], DASHES.get((fidelity, scheme), "-"), courant == COURANTS[0]
    sound = [(place, run) for place, run in zip(places, family, strict=True) if math.isfinite(found.error(run, name))]
    heights = [_shown(found, run, name) for _, run in sound]
    axes.plot([place for place, _ in sound], heights, color=colour, linestyle=dashes, linewidth=1.6 if main else 0.6)
    for place, run in zip(places, family, strict=True):
        failed = math.isinf(found.error(run, name))
        below = found.error(run, name) < found.reference.error(name)
        axes.plot(
            [place],
            [_shown(found, run, name)],
            "x" if failed else MARKERS[courant],
            color=colour,
            markerfacecolor="white" if below else colour,
            markersize=7 if failed else 5.5 if main else 4,
            markeredgewidth=1.8 if failed else 1.0,
        )


def _draw_floor(axes: Axes, found: WorkPrecision, name: str) -> None:
    """The band below the reference's own error."""
    assert found.reference is not None
    bottom, top = _limits(found, name)
    level = min(100.0 * found.reference.error(name), top)
    axes.axhspan(bottom, level, color=BAND, zorder=0, linewidth=0)
    place = axes.get_yaxis_transform()
    axes.text(0.02, level, "below the reference's own error: not ranked", transform=place, va="top", fontsize=8, zorder=0.5)


def _label(side: str = "left") -> dict[str, Any]:
    """Style of a label beside a point, legible across lines."""
    from matplotlib.patheffects import withStroke

    return {
        "textcoords": "offset points",
        "ha": side,
        "fontsize": 8,
        "path_effects": [withStroke(linewidth=2.5, foreground="white")],
    }


def _known(found: WorkPrecision, name: str) -> str:
    """How well the reference is known."""
    assert found.reference is not None
    error = found.reference.error(name)
    return f"± {100.0 * error:.{2 if error < 0.1 else 3}g} %" if math.isfinite(error) else "± unknown"


def _draw_rate(axes: Axes, found: WorkPrecision) -> None:
    """CPU time of a node and step against the nodes that are computed."""
    for (fidelity, scheme, courant), family in found.families().items():
        if fidelity == "lumped":
            continue
        nodes = [(run.setting.generatrix + 1) * run.setting.columns for run in family]
        dashes, width = DASHES.get((fidelity, scheme), "-"), 1.6 if courant == COURANTS[0] else 0.6
        style: dict[str, Any] = {"color": COLOURS[fidelity, scheme], "linestyle": dashes, "markersize": 4, "linewidth": width}
        axes.plot(nodes, [run.nanoseconds or math.nan for run in family], MARKERS[courant], **style)
    axes.set_title("Rate, one thread, contact included")
    axes.set(xscale="log", yscale="log", xlabel="nodes computed", ylabel="ns per node and step")
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:g}"[0] in "25" else "")


def _draw_list(axes: Axes, found: WorkPrecision) -> None:
    """Legend, failures and what was left out."""
    text: list[str] = []
    axes.set_axis_off()
    for (fidelity, scheme), colour in COLOURS.items():
        if any(run.setting[:2] == (fidelity, scheme) for run in found.runs):
            dashes = DASHES.get((fidelity, scheme), "-")
            axes.plot([], [], color=colour, linestyle=dashes, linewidth=2.5, label=model_in_words(fidelity, scheme))
    for courant, marker in MARKERS.items():
        axes.plot([], [], marker, color=INK, markersize=5, label=f"Courant {courant:g}")
    axes.plot([], [], "o", color=INK, markerfacecolor="white", markersize=5, label="not ranked")
    axes.plot([], [], "x", color=INK, markeredgewidth=1.8, label="failed")
    axes.plot([], [], color=INK, alpha=0.22, linewidth=3.5, label="Pareto front")
    axes.legend(loc="upper left", ncols=2, borderaxespad=0.0)
    for head, lines in (("Failed", found.failures()), ("Left out", found.omissions())):
        text.append(f"{head}: {len(lines) or 'none'}")
        text += [part for line in lines for part in textwrap.wrap(line, 52, initial_indent="· ", subsequent_indent="   ")]
    axes.text(0.0, 0.62, "\n".join(text), transform=axes.transAxes, va="top", fontsize=6.5, linespacing=1.35, parse_math=False)
