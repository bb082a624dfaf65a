"""A drop beside a test, laid over each other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from softbrake.case.units import unit_size
from softbrake.report.comparison_rows import heading_lines
from softbrake.report.plots.style import BLUE, INK, STYLE, load_matplotlib, save
from softbrake.signals.channel import QUANTITIES
from softbrake.studies.comparison import Compared, Comparison

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def draw_comparison(found: Comparison, picture: Path | str) -> None:
    """Draw a panel a quantity to `picture`: .png, .svg or .pdf. Raises PlotError and OSError."""
    mpl = load_matplotlib()
    with mpl.rc_context(STYLE):
        count = len(found.quantities)
        figure: Figure = mpl.figure.Figure(figsize=(7.0, 0.9 + 2.4 * count), layout="constrained")
        figure.suptitle("\n".join(heading_lines(found)), fontsize=9, parse_math=False)
        panels: Any = figure.subplots(count, 1, squeeze=False, sharex=True)[:, 0]
        for axes, each in zip(panels, found.quantities, strict=True):
            draw_overlay(axes, each)
            axes.legend()
        panels[-1].set_xlabel("time of the drop, ms")
        save(figure, picture)


def draw_overlay(axes: Axes, each: Compared) -> None:
    """Test and drop over the interval compared, in the unit of the channel."""
    size = unit_size(each.unit, QUANTITIES[each.quantity])
    axes.plot(each.pair.time * 1e3, each.pair.test / size, color=INK, label=f"test: {each.channel}")
    axes.plot(each.pair.time * 1e3, each.pair.computed / size, color=BLUE, label="drop")
    rated = "" if each.rating is None else f", ISO/TS 18571: {each.rating.overall:.2f}"
    axes.set(title=f"{each.quantity.capitalize()}{rated}", ylabel=each.unit)
