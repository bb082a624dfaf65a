"""Fitted drop and tests over each other, and what is left between them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from softbrake.case.units import unit_size
from softbrake.report.plots.style import BLUE, GREY, INK, RED, STYLE, load_matplotlib, save
from softbrake.signals.channel import QUANTITIES
from softbrake.studies.calibration import Calibration


def draw_calibration(found: Calibration, picture: Path | str) -> None:
    """Draw a row a channel: test and drop, and test less drop with its root mean square. Raises PlotError and OSError."""
    mpl = load_matplotlib()
    with mpl.rc_context(STYLE):
        rows = len(found.channels)
        figure = mpl.figure.Figure(figsize=(9.0, 0.5 + 2.4 * rows), layout="constrained")
        panels: Any = figure.subplots(rows, 2, squeeze=False)
        for (over, left), each in zip(panels, found.channels, strict=True):
            size, time = unit_size(each.unit, QUANTITIES[each.quantity]), each.time * 1e3
            over.plot(time, each.measured / size, ".-", color=INK, linewidth=0.8, label="test")
            over.plot(time, each.computed / size, color=BLUE, label="fitted drop")
            over.set_title(f"{each.test}: {each.name}", parse_math=False)
            over.set_ylabel(each.unit)
            over.legend()
            left.plot(time, (each.measured - each.computed) / size, ".-", color=RED, linewidth=0.8)
            left.axhspan(-each.misfit / size, each.misfit / size, color=GREY, alpha=0.2, linewidth=0.0)
            left.set_title("test less drop")
        for axes in panels[-1]:
            axes.set_xlabel("time of the drop, ms")
        save(figure, picture)
