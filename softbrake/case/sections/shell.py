"""Section `shell`: the cut cylinder between the covers."""

from __future__ import annotations

from dataclasses import dataclass

from softbrake.case.keys import Key
from softbrake.case.section import Part, Section
from softbrake.case.units import Dimension


@dataclass(frozen=True)
class Shell(Part):
    """Cut cylinder between the covers."""

    diameter: float  # m, of the unloaded shell and of the covers
    height: float  # m, cutting height l1


SHELL = Section(
    "shell",
    Shell,
    (
        Key("diameter", Dimension.LENGTH, "of the unloaded shell and of the covers", "0.5 m", required=True, above=0),
        Key("height", Dimension.LENGTH, "cutting height between the covers", "0.6 m", required=True, above=0),
    ),
    physical=True,
)
