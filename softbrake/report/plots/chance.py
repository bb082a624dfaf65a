"""Pictures of a sample: how answers are distributed about their limits, what makes them vary, and how."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from softbrake.case.sections.limits import LIMITS, Limit, limits_of
from softbrake.core.arrays import Floats
from softbrake.report.plots.style import BLUE, GREY, INK, LINE, ORANGE, RED, STYLE, PlotError, load_matplotlib, save
from softbrake.report.plots.sweep import Scale
from softbrake.report.results_csv import relied
from softbrake.report.words import answer_in_words, shown_unit
from softbrake.studies.axes import FIDELITY, Axis
from softbrake.studies.chance import Chance, Index

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PICTURE = "chance.png"
BINS = 30
MOST_DOTS = 2000


class Sampled(NamedTuple):
    """One answer of a sample, as pictures have it."""

    title: str
    unit: str
    values: Floats  # in that unit, of the runs at the samples, NaN where there are none
    limit: Limit | None
    bound: float  # in that unit; NaN without a limit
    indices: Sequence[Index]
    scales: Sequence[Scale]  # of the axes, what moves the answer most first


def sampled(chance: Chance, axes: Sequence[Axis], case: Mapping[str, Any], table: Sequence[Mapping[str, Any]]) -> list[Sampled]:
    """The answers of a sample; table: rows or texts of results.csv."""
    limits = {limit.column: limit for limit in limits_of(case.get(LIMITS.name, {}))}
    found = []
    own = table[: chance.runs]
    scales = []
    for axis in axes:
        if axis.path != FIDELITY:
            texts = [row[axis.path] for row in own]
            try:
                scales.append(Scale(axis, [float(text) for text in texts]))
            except ValueError:
                scales.append(Scale(axis, texts))
    for name in chance.spreads:
        limit = limits.get(name)
        unit, size = shown_unit(name)
        values = relied(own, name) / size
        sound = np.isfinite(values)
        moved = sorted(scales, key=lambda scale: -abs(_correlation(scale.at[sound], values[sound])))
        bound = np.nan if limit is None else limit.value / size
        found.append(
            Sampled(
                answer_in_words(name).capitalize().replace("cfc", "CFC"),
                unit,
                values,
                limit,
                bound,
                chance.indices.get(name, ()),
                moved,
            )
        )
    return found


def _correlation(x: Floats, y: Floats) -> float:
    """Spearman's coefficient of rank correlation; 0 where one does not vary."""
    ranks = [np.unique(values, return_inverse=True)[1].astype(float) for values in (x, y)]
    spread = [np.ptp(rank) if len(rank) else 0.0 for rank in ranks]
    return float(np.corrcoef(np.array(ranks))[0, 1]) if min(spread) > 0.0 else 0.0


def draw_distribution(axes: Axes, one: Sampled) -> None:
    """Part of the runs in each of even bins, with the limit."""
    sound = one.values[np.isfinite(one.values)]
    count, edges = np.histogram(sound, min(BINS, max(math.isqrt(len(sound)), 2)))
    axes.plot(np.repeat(edges, 2), np.concatenate(([0.0], np.repeat(100.0 * count / len(one.values), 2), [0.0])), color=BLUE)
    if one.limit is not None:
        axes.axvline(one.bound, color=RED, linestyle="--", label="limit")
    axes.set(title=one.title, ylabel="% of runs")
    axes.set_ylim(bottom=0.0)


def draw_tornado(axes: Axes, one: Sampled) -> None:
    """Total and first index of each input with their intervals, the largest on top."""
    ordered = sorted(one.indices, key=lambda index: index.total.value)
    for k, index in enumerate(ordered, 1):
        for estimate, place, colour in ((index.total, k + 0.12, BLUE), (index.first, k - 0.12, ORANGE)):
            axes.plot([0.0, estimate.value], [place] * 2, color=colour, linewidth=6.0, solid_capstyle="butt")
            axes.plot([estimate.low, estimate.high], [place] * 2, color=INK, linewidth=1.0)
        axes.annotate(index.input, (0.0, k + 0.27), (2, 0), textcoords="offset points", va="bottom", fontsize=9)
    for label, colour in (("total", BLUE), ("first", ORANGE)):
        axes.plot([], [], color=colour, linewidth=6.0, label=label)
    axes.axvline(0.0, color=GREY, linewidth=1.0)
    axes.set(title=one.title, ylabel="Sobol' indices", ylim=(0.5, len(ordered) + 0.8), yticks=[])


def draw_scatter(axes: Axes, one: Sampled) -> None:
    """The answer of the runs over the axis that moves it most, with the limit."""
    scale = one.scales[0]
    some = np.arange(len(one.values))[:: max(len(one.values) // MOST_DOTS, 1)]
    axes.plot(scale.at[some], one.values[some], ".", color=BLUE, markersize=4.0, markeredgewidth=0.0, alpha=0.5)
    if one.limit is not None:
        axes.plot([scale.at.min(), scale.at.max()], [one.bound] * 2, color=RED, linestyle="--", label="limit")
    axes.set(title=one.title, ylabel=one.unit)


def draw_chance(
    chance: Chance, title: str, axes: Sequence[Axis], case: Mapping[str, Any], table: Sequence[Mapping[str, Any]], picture: Path
) -> None:
    """Draw a row for each answer: distribution, indices where there are, scatter over what matters. Raises PlotError."""
    mpl, rows = load_matplotlib(), sampled(chance, axes, case, table)
    if not rows:
        raise PlotError("no run has an answer to draw")
    wide = 3 if chance.indices else 2
    with mpl.rc_context(STYLE):
        figure = mpl.figure.Figure(figsize=(4.2 * wide, 2.9 * len(rows) + 0.5), layout="constrained")
        panels: Any = figure.subplots(len(rows), wide, squeeze=False)
        for line, one in zip(panels, rows, strict=True):
            draw_distribution(line[0], one)
            line[0].set_xlabel(one.unit)
            if chance.indices:
                draw_tornado(line[1], one)
                line[1].legend(loc="lower right")
                line[1].set_xlabel("part of the variance")
                line[1].grid(color=LINE)
            draw_scatter(line[-1], one)
            one.scales[0].along(line[-1], "x")
            if one.limit is not None:
                line[0].legend()
        figure.suptitle(title, fontsize=12, parse_math=False)
        save(figure, picture)
