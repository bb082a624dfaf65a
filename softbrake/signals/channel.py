"""A measured or computed quantity over time, in whatever file it stood."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from softbrake.case.units import GRAVITIES, STANDARD_GRAVITY, Dimension, measure, unit_size
from softbrake.core.arrays import Floats

QUANTITIES = {  # what a drop and its test have in common, and what tells it: the dimension of the unit
    "deceleration": Dimension.ACCELERATION,
    "pressure": Dimension.PRESSURE,
    "velocity": Dimension.SPEED,
    "height": Dimension.LENGTH,
}
_SPELLINGS = ((r"\*\*", "^"), (r"\((\w+)[*·.](\w+)\)", r"\1/\2"), (r"([A-Za-z])([23])\b", r"\1^\2"), (r"[µμ]", "u"))
_SECONDS = r"\b[sS]ec(onds?)?\b|\bSeconds?\b|\bseconds?\b"


class SignalError(Exception):
    """A file of measured channels that cannot be read; its message names the file and what is expected."""


@dataclass(frozen=True)
class Channel:
    """One channel of a test, SI."""

    name: str  # as the file has it
    time: Floats  # s, rising, not necessarily even
    values: Floats  # of the unit's SI size, as signed in the file; as they stand in the file where the unit is not known
    unit: str  # as the file has it; empty where it says none
    code: str = ""  # of ISO/TS 13499, 16 characters; empty of other formats
    cfc: int | None = None  # class of SAE J211 that the values have passed already
    fault: str | None = None  # why they cannot be used, a line for the user: some are nan, as the file has no number there

    @property
    def quantity(self) -> str | None:
        """Name in QUANTITIES of what the unit measures; None of another."""
        for quantity, dimension in QUANTITIES.items():
            try:
                unit_size(spelled(self.unit), dimension)
            except ValueError:
                continue
            if self.unit:
                return quantity
        return None


def spelled(unit: str) -> str:
    """Return a unit as case files write it: `m/s2`, `m/s**2` and `m/(s*s)` are `m/s^2` or `m/s/s`, `sec` is `s`."""
    unit = re.sub(_SECONDS, "s", unit.strip())
    for pattern, text in _SPELLINGS:
        unit = re.sub(pattern, text, unit)
    return unit


def si_size(unit: str) -> float:
    """SI size of a unit, where `g` is gravity: nobody measures grams over a drop; 1 of none and of one that is not known."""
    if unit in GRAVITIES:
        return STANDARD_GRAVITY
    try:
        return measure(spelled(unit))[0]
    except ValueError:
        return 1.0


def is_unit(text: str) -> bool:
    """Whether a text is a unit that case files know too."""
    try:
        return bool(text) and measure(spelled(text)) is not None
    except ValueError:
        return False


def second_size(unit: str) -> float:
    """SI size of a unit of time. Raises ValueError, which says what it is."""
    return unit_size(spelled(unit), Dimension.TIME)


def check_units(path: Path, units: Mapping[str, str], names: Iterable[str]) -> None:
    """Raise SignalError where units are given for channels that a file has not, or are none."""
    known = list(names)
    for name, unit in units.items():
        if name not in known:
            raise SignalError(f"{path}: no channel '{name}' to give a unit; {listed(known)} are expected")
        if not is_unit(unit):
            raise SignalError(f"{path}: channel '{name}': '{unit}' is no unit; one as 'g', 'm/s^2' or 'kPa' is expected")


def even_times(place: str, key: str, first: float, interval: float, count: int) -> Floats:
    """Return times an interval apart. Raises SignalError, which names the interval's key, where they do not rise."""
    if interval > 0.0 and np.isfinite(first + interval * count):
        times = first + interval * np.arange(count, dtype=np.float64)
        if (np.diff(times) > 0.0).all():
            return times
    raise SignalError(f"{place}: {key} is {interval:g} s from {first:g} s on; times that rise are expected")


def fault_of(place: str, values: Floats) -> str | None:
    """Say which sample is no number; None where all are."""
    odd = np.flatnonzero(~np.isfinite(values))
    return f"{place}: sample {odd[0] + 1} is {values[odd[0]]}; a number at each sample is expected" if odd.size else None


def lines_of(data: bytes) -> list[str]:
    """Lines of a text; what is not UTF-8 is Latin-1, where names and units of western loggers read the same."""
    try:
        text = data.decode("utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return re.split(r"\r\n|\r|\n", text)


def listed(names: Iterable[str]) -> str:
    """Names in quotes, for messages."""
    return ", ".join(f"'{name}'" for name in names)
