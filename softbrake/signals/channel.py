"""A measured or computed quantity over time, in whatever file it stood."""

from __future__ import annotations

from dataclasses import dataclass

from softbrake.case.units import Dimension, unit_size
from softbrake.core.arrays import Floats

QUANTITIES = {  # what a drop and its test have in common, and what tells it: the dimension of the unit
    "deceleration": Dimension.ACCELERATION,
    "pressure": Dimension.PRESSURE,
    "velocity": Dimension.SPEED,
    "height": Dimension.LENGTH,
}


class SignalError(Exception):
    """A file of measured channels that cannot be read; its message names the file and what is expected."""


@dataclass(frozen=True)
class Channel:
    """One channel of a test, SI."""

    name: str  # as the file has it
    time: Floats  # s, rising, not necessarily even
    values: Floats  # of the unit's SI size, as signed in the file
    unit: str  # as the file has it; empty where it says none
    code: str = ""  # of ISO/TS 13499, 16 characters; empty of other formats
    cfc: int | None = None  # class of SAE J211 that the values have passed already

    @property
    def quantity(self) -> str | None:
        """Name in QUANTITIES of what the unit measures; None of another."""
        for quantity, dimension in QUANTITIES.items():
            try:
                unit_size(self.unit, dimension)
            except ValueError:
                continue
            if self.unit:
                return quantity
        return None
