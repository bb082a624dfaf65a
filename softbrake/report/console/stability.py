"""The limits of stability of a map, a line each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softbrake.studies.stability_map import Axis, MapPoint


def print_head(axes: Sequence[Axis]) -> None:
    """The line above the points."""
    print("  ".join((*(path for path, _ in axes), "predicted us", "found us", "ratio")), flush=True)


def print_point(point: MapPoint) -> None:
    """One point as soon as it is found."""
    print("  ".join((*point.values, *point.shown)), flush=True)
