"""Colours and style of all pictures, and how they are written."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from softbrake.sim.files import draft_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK, BLUE, ORANGE, GREEN, RED, GREY = "#222222", "#1f6fb4", "#e07b00", "#2e8b57", "#c0392b", "#8a8f98"
SOFT, LINE = "#5b636c", "#d9dde1"  # of lesser text and of rules, on pages
CARGO_COLOUR, COVER_COLOUR, GROUND_COLOUR = "#b98b57", "#4a4f57", "#dfe2e4"
STYLE = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e6e6",
    "legend.frameon": False,
    "legend.fontsize": 8.0,
}


class PlotError(Exception):
    """No picture can be made; the message is one line for the user."""


def load_matplotlib() -> Any:
    """Import what pictures need. Raises PlotError."""
    try:
        import matplotlib.cm
        import matplotlib.colors
        import matplotlib.figure
        import matplotlib.patches
    except ImportError as error:
        raise PlotError("pictures need matplotlib: pip install 'softbrake[plot]'") from error
    return matplotlib


def check_picture(picture: Path | str) -> None:
    """Raise PlotError where no picture of this name can be drawn."""
    if Path(picture).suffix.lower() not in (".png", ".svg", ".pdf"):
        raise PlotError(f"{picture}: the name of a picture ends in .png, .svg or .pdf")
    load_matplotlib()


def save(figure: Figure, picture: Path | str) -> None:
    """Write a figure to a picture, whole or not at all. Raises PlotError and OSError."""
    check_picture(picture)
    with draft_of(picture) as draft:
        figure.savefig(draft, dpi=150, bbox_inches="tight", pad_inches=0.1)
