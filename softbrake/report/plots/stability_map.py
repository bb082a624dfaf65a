"""A picture of the map of the largest stable step."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from softbrake.report.plots.style import BLUE, GREEN, GREY, INK, RED, STYLE, load_matplotlib, save
from softbrake.studies.stability_map import Axis, MapPoint


def draw_map(points: Sequence[MapPoint], axes: Sequence[Axis], picture: Path) -> None:
    """Draw the steps tried over the values of the first axis, stable or not, with the predicted ones; a panel for each other.

    Raises PlotError.
    """
    mpl = load_matplotlib()
    (name, ticks), *others = axes
    panels = list(product(*(values for _, values in others)))
    columns = min(len(panels), 4)
    with mpl.rc_context(STYLE):
        rows = -(-len(panels) // columns)
        figure = mpl.figure.Figure(figsize=(1.0 + 3.2 * columns, 0.7 + 2.7 * rows), layout="constrained")
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
        for panel, rest in zip(grid, panels, strict=False):
            _draw_panel(panel, [point for point in points if point.values[1:] == rest], ticks)
            panel.set_title("\n".join(f"{path} {value}" for (path, _), value in zip(others, rest, strict=True)))
        for panel in grid[len(panels) :]:
            panel.set_axis_off()
        for panel in grid[max(len(panels) - columns, 0) : len(panels)]:
            panel.set_xlabel(name)
            panel.tick_params(labelbottom=True)
        for row in range(rows):
            grid[row * columns].set_ylabel("step, µs")
        grid[0].legend(loc="best")
        save(figure, picture)


def _draw_panel(panel: Any, points: Sequence[MapPoint], ticks: Sequence[str]) -> None:
    place = {value: where for where, value in enumerate(ticks)}
    where = np.array([place[point.values[0]] for point in points])
    for kind, label, colour, marker in ((True, "stable", GREEN, "o"), (False, "unstable", RED, "x")):
        tried = [(place[point.values[0]], 1e6 * step) for point in points for step, stable in point.trials if stable == kind]
        panel.plot(*np.array(tried).reshape(-1, 2).T, marker, color=colour, markersize=3, alpha=0.6, label=label)
    panel.plot(where, [1e6 * point.predicted for point in points], color=INK, linewidth=1.6, label="predicted")
    panel.plot(
        where,
        [1e6 * point.predicted * point.courant for point in points],
        color=BLUE,
        linewidth=1.0,
        linestyle="--",
        label="taken",
    )
    panel.set_yscale("log")
    panel.set_xticks(range(len(ticks)), ticks, rotation=30 if max(map(len, ticks)) > 6 else 0, color=GREY)
