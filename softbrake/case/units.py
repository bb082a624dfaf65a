"""Quantities written with units, such as `20 kN/m`, to SI numbers."""

from __future__ import annotations

import math
import re
from difflib import get_close_matches
from enum import Enum
from functools import lru_cache

STANDARD_GRAVITY = 9.80665  # m/s^2, g_n: one g in every case, on a planet of any gravity
GRAVITIES = ("g", "g_n")  # its names, where an acceleration is asked for
CELSIUS, ICE_POINT = "degC", 273.15  # a temperature alone; K

Powers = tuple[int, int, int, int]  # of metre, kilogram, second, kelvin
NO_POWERS: Powers = (0, 0, 0, 0)
UNITS: dict[str, tuple[float, Powers]] = {
    "m": (1.0, (1, 0, 0, 0)),
    "cm": (1e-2, (1, 0, 0, 0)),
    "mm": (1e-3, (1, 0, 0, 0)),
    "km": (1e3, (1, 0, 0, 0)),
    "in": (0.0254, (1, 0, 0, 0)),
    "ft": (0.3048, (1, 0, 0, 0)),
    "kg": (1.0, (0, 1, 0, 0)),
    "g": (1e-3, (0, 1, 0, 0)),
    "t": (1e3, (0, 1, 0, 0)),
    "lb": (0.45359237, (0, 1, 0, 0)),
    "s": (1.0, (0, 0, 1, 0)),
    "ms": (1e-3, (0, 0, 1, 0)),
    "us": (1e-6, (0, 0, 1, 0)),
    "h": (3600.0, (0, 0, 1, 0)),
    "N": (1.0, (1, 1, -2, 0)),
    "kN": (1e3, (1, 1, -2, 0)),
    "MN": (1e6, (1, 1, -2, 0)),
    "lbf": (4.4482216152605, (1, 1, -2, 0)),
    "Pa": (1.0, (-1, 1, -2, 0)),
    "kPa": (1e3, (-1, 1, -2, 0)),
    "MPa": (1e6, (-1, 1, -2, 0)),
    "mbar": (1e2, (-1, 1, -2, 0)),
    "bar": (1e5, (-1, 1, -2, 0)),
    "psi": (4.4482216152605 / 0.0254**2, (-1, 1, -2, 0)),
    "J": (1.0, (2, 1, -2, 0)),
    "kJ": (1e3, (2, 1, -2, 0)),
    "K": (1.0, (0, 0, 0, 1)),
    "%": (1e-2, NO_POWERS),
}

POINT = "numbers have a decimal point"
_QUANTITY = re.compile(r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*(.*?)\s*")
_SEPARATOR = re.compile(r"\s*([*·/])\s*|\s+")
_FACTOR = re.compile(r"([A-Za-z]+|%)(?:\^(-?[1-9]))?")


@lru_cache(maxsize=256)
def measure(unit: str) -> tuple[float, Powers]:
    """SI size and dimension of a product of units, alike 1 of none; ValueError for an unknown one."""
    if not unit:
        return 1.0, NO_POWERS
    parts = _SEPARATOR.split(unit.replace("²", "^2").replace("³", "^3"))
    size, powers = 1.0, NO_POWERS
    for separator, part in zip(["*", *parts[1::2]], parts[0::2], strict=True):
        factor = _FACTOR.fullmatch(part)
        if factor is None or factor[1] not in UNITS:
            name = factor[1] if factor else part
            names = (*UNITS, CELSIUS)
            close = [known for known in names if known.lower() == name.lower()] or get_close_matches(name, names, 1)
            raise ValueError(f"unknown unit '{name or unit}'" + (f", did you mean '{close[0]}'?" if close else ""))
        power = int(factor[2] or 1) * (-1 if separator == "/" else 1)
        one, dimension = UNITS[factor[1]]
        size *= one**power
        length, mass, time, temperature = (old + power * new for old, new in zip(powers, dimension, strict=True))
        powers = (length, mass, time, temperature)
    return size, powers


class Dimension(Enum):
    """What a quantity measures: its name in messages and its SI unit."""

    RATIO = ("a ratio", "")
    LENGTH = ("a length", "m")
    MASS = ("a mass", "kg")
    TIME = ("a time", "s")
    SPEED = ("a speed", "m/s")
    INVERSE_SPEED = ("an inverse speed", "s/m")
    ACCELERATION = ("an acceleration", "m/s^2")
    FORCE = ("a force", "N")
    TENSION = ("a force per length", "N/m")
    VISCOSITY = ("a fabric viscosity", "N*s/m")
    PRESSURE = ("a pressure", "Pa")
    LINE_DENSITY = ("a mass per length", "kg/m")
    AREAL_DENSITY = ("a mass per area", "kg/m^2")
    AREA = ("an area", "m^2")
    TEMPERATURE = ("a temperature", "K")
    GAS_CONSTANT = ("a specific gas constant", "J/kg/K")
    MASS_FLOW = ("a mass flow", "kg/s")
    PERMEABILITY = ("a face velocity per pressure", "m/s/Pa")
    PERMEABILITY_SLOPE = ("a face velocity per pressure squared", "m/s/Pa^2")
    VISCOUS_RESISTANCE = ("a pressure per face velocity", "Pa*s/m")
    INERTIAL_RESISTANCE = ("a pressure per face velocity squared", "Pa*s^2/m^2")

    def __init__(self, phrase: str, unit: str) -> None:
        self.phrase = phrase
        self.unit = unit
        self.powers = measure(unit)[1]


def unit_size(unit: str, expected: Dimension) -> float:
    """SI size of a unit of the expected dimension, 1 of none. Raises ValueError as `parse_quantity`."""
    if expected is Dimension.TEMPERATURE and unit == CELSIUS:
        return 1.0
    if expected is Dimension.ACCELERATION and unit in GRAVITIES:
        return STANDARD_GRAVITY
    size, powers = measure(unit)
    if unit and powers != expected.powers:
        found = " or ".join(dimension.phrase for dimension in Dimension if dimension.powers == powers)
        raise ValueError(f"'{unit}' is {found or f'not {expected.phrase}'}")
    return size


def unit_of(text: str) -> str:
    """Unit of a quantity as it is written, of degrees Celsius K; empty without one, and of what is no quantity."""
    match = _QUANTITY.fullmatch(text)
    unit = match[2] if match else ""
    return "K" if unit == CELSIUS else unit  # whose values are a size times a number


_POWERS = {1: "", 2: r"(\^2|²)", 3: r"(\^3|³)", -1: r"\^-1", -2: r"\^-2", -3: r"\^-3"}  # as patterns
_TIMES, _OVER = r"(\s*[*·]\s*|\s+)", r"\s*/\s*"


def pattern(expected: Dimension, signed: bool = False) -> str:
    """Text of a quantity of a dimension, as a regular expression that JSON Schema understands too.

    signed: whether it may be negative; degrees Celsius always may.
    It knows the dimension of units of one or two factors and lets all of three and more pass: those are for `parse_quantity`.
    """
    alike: dict[Powers, list[str]] = {}
    for name, (_, dimension) in UNITS.items():
        alike.setdefault(dimension, []).append(re.escape(name))
    factors = {
        (tuple(power * part for part in dimension), f"({'|'.join(names)}){text}")
        for dimension, names in alike.items()
        for power, text in _POWERS.items()
    }
    units = {text for powers, text in factors if powers == expected.powers}
    units |= set(GRAVITIES) if expected is Dimension.ACCELERATION else set()
    for first, text in factors:
        rest = tuple(part - one for part, one in zip(expected.powers, first, strict=True))
        for joint, sign in ((_TIMES, 1), (_OVER, -1)):
            seconds = sorted(other for powers, other in factors if tuple(sign * part for part in powers) == rest)
            if seconds:
                units.add(f"{text}{joint}({'|'.join(seconds)})")
    factor = r"([A-Za-z]+|%)(\^-?[1-9]|²|³)?"
    units.add(f"{factor}(({_TIMES}|{_OVER}){factor}){{2,}}")
    number, plus, either = r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?\s*", r"\+?", "[-+]?"
    text = rf"{either if signed else plus}{number}({'|'.join(sorted(units))})?"
    if expected is Dimension.TEMPERATURE:
        text = rf"({text}|{either}{number}{CELSIUS})"
    return rf"^\s*{text}\s*$"


def parse_quantity(text: str, expected: Dimension) -> float:
    """SI value of a number with a unit of the expected dimension; without a unit the number is SI already.

    Units are joined by `*`, `·` or a space, `/` and `^`: `0.2 N*s/m`, `9.81 m/s^2`. Alone, `g` and `g_n` are the standard gravity
    where an acceleration is expected; else `g` is a gram. `degC` stands alone, where a temperature is expected.
    Raises ValueError, which says what is wrong in words for a user.
    """
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise ValueError(f"'{text}' is not a number with a unit")
    unit = match[2]
    if unit.startswith(","):
        raise ValueError(f"'{text}' has a comma, {POINT}")
    value = float(match[1]) * unit_size(unit, expected) + (ICE_POINT if unit == CELSIUS else 0.0)
    if not math.isfinite(value):
        raise ValueError(f"'{text}' is not a finite number")
    return value
