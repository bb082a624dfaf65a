"""Inputs that are not known as one value: distributions, and tables of joint samples."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import NormalDist

from softbrake.case.keys import Key
from softbrake.case.units import CELSIUS, Dimension, parse_quantity, unit_of, unit_size

FORMS = {
    "normal": "normal(MEAN, DEVIATION)",
    "lognormal": "lognormal(MEAN, DEVIATION)",
    "uniform": "uniform(LOW, HIGH)",
    "triangular": "triangular(LOW, MODE, HIGH)",
}
LEAST = 2.0**-31  # share of a distribution that no sample lies below, or above: half the step of Sobol' points of 30 bits
TABLE = "table"  # axis of a file of joint samples
_FORM = re.compile(r"\s*([A-Za-z]\w*)\s*\(([^()]*)\)\s*")
_HEAD = re.compile(r"\s*([^\s\[\]]+)\s*(?:\[([^\[\]]*)\])?\s*")


@dataclass(frozen=True)
class Distribution:
    """How a quantity is distributed, SI."""

    form: str  # of FORMS
    numbers: tuple[float, ...]  # SI, as the form names them

    def at(self, share: float) -> float:
        """The value that a part of all, within LEAST of 0 and 1, lies below: the inverse of the distribution function."""
        share = min(max(share, LEAST), 1.0 - LEAST)
        first, second, *_ = self.numbers
        if self.form == "uniform":
            return first + share * (second - first)
        if self.form == "triangular":
            low, mode, high = self.numbers
            below = (mode - low) / (high - low)
            if share <= below:
                return low + math.sqrt(share * (high - low) * (mode - low))
            return high - math.sqrt((1.0 - share) * (high - low) * (high - mode))
        deviate = NormalDist().inv_cdf(share)
        if self.form == "normal":
            return first + second * deviate
        variance = math.log1p((second / first) ** 2)  # of the logarithm
        return first * math.exp(math.sqrt(variance) * deviate - 0.5 * variance)


def distribution_of(text: str, key: Key | None) -> tuple[Distribution, str] | None:
    """Read a distribution such as `normal(8.5 m/s, 0.4 m/s)` of a key, and the unit of its first number.

    None where the text is none, or the key unknown. Raises ValueError, in words, also where a sample can leave what the key has.
    """
    match = _FORM.fullmatch(text)
    if match is None or key is None:
        return None
    form, inner = match.groups()
    if form not in FORMS:
        raise ValueError(f"unknown distribution '{form}'; {', '.join(FORMS)} are known")
    if not isinstance(key.kind, Dimension):
        raise ValueError("a distribution of what is no quantity; values between commas are expected")
    parts = [part.strip() for part in inner.split(",")]
    expected = FORMS[form]
    if len(parts) != expected.count(",") + 1:
        raise ValueError(f"'{text}' has {len(parts)} numbers; {expected} is expected")
    try:
        places = parts if form in ("uniform", "triangular") else parts[:1]
        numbers = [parse_quantity(part, key.kind) for part in places]
        numbers += [_difference(part, key.kind) for part in parts[len(places) :]]
    except ValueError as error:
        raise ValueError(f"{error}; {expected} with units is expected") from None
    if len({not unit_of(part) for part in parts}) > 1:
        raise ValueError(f"'{text}' has units on some of its numbers; on all or none is expected")
    if form in ("uniform", "triangular"):
        if numbers != sorted(numbers) or numbers[0] == numbers[-1]:
            raise ValueError(f"'{text}' does not rise; {expected} is expected")
    elif numbers[1] <= 0.0 or (form == "lognormal" and numbers[0] <= 0.0):
        what = "a deviation" if numbers[1] <= 0.0 else "a mean"
        raise ValueError(f"{what} of {parts[1 if numbers[1] <= 0.0 else 0]}; > 0 is expected")
    found, unit = Distribution(form, tuple(numbers)), unit_of(parts[0])
    for share in (LEAST, 1.0 - LEAST):
        value = found.at(share)
        try:
            key.convert(value)
        except ValueError:
            shown = f"{value / unit_size(unit, key.kind):.4g} {unit or key.kind.unit}".rstrip()
            rare = "" if form in ("uniform", "triangular") else f", once in {1.0 / LEAST:.1g} samples"
            other = "another distribution" if form in ("uniform", "triangular") else "uniform, triangular or lognormal"
            raise ValueError(f"'{text}' reaches {shown}{rare}; {key.expected} is expected: {other}") from None
    return found, unit


def _difference(text: str, kind: Dimension) -> float:
    """A deviation in SI units; degrees Celsius count as kelvin."""
    return parse_quantity(text.replace(CELSIUS, "K"), kind) if kind is Dimension.TEMPERATURE else parse_quantity(text, kind)


def read_table(path: Path) -> Mapping[str, tuple[str, ...]]:
    """Read joint samples: a CSV file with a head of keys and units, as `cargo.mass [kg]`, and a row a sample.

    Returns texts of values with units, by key, all of the same number. Raises ValueError, with the place in the file.
    """
    try:
        with open(path, encoding="utf-8-sig", newline="") as stream:
            rows = [row for row in csv.reader(stream) if any(cell.strip() for cell in row)]
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror or error}; a table of samples is expected") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: {error}; a CSV file in UTF-8 is expected") from None
    heads = [_HEAD.fullmatch(cell) for cell in rows[0]] if rows else []
    if len(rows) < 3 or None in heads:
        raise ValueError(f"{path}: no table; a head such as 'cargo.mass [kg],cargo.velocity [m/s]' and two rows are expected")
    names = [head[1] for head in heads if head is not None]
    if len(set(names)) < len(names):
        raise ValueError(f"{path}: a key stands twice in the head; once is expected")
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(heads) or not all(cell.strip() for cell in row):
            raise ValueError(f"{path}: row {number} has not {len(heads)} values; one for each key is expected")
    units = [head[2] or "" for head in heads if head is not None]
    columns = zip(*rows[1:], strict=True)
    return {
        name: tuple(f"{cell.strip()} {unit}".strip() for cell in column)
        for name, unit, column in zip(names, units, columns, strict=True)
    }
