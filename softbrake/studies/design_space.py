"""What a design search varies: quantities of a case over their ranges, and the model that it searches with."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from softbrake.case.case import ALL, Case, is_quantity, key_at
from softbrake.case.case_file import CaseFile
from softbrake.case.checker import Checker
from softbrake.case.keys import Key
from softbrake.case.level import level
from softbrake.case.overrides import Override, overridden
from softbrake.case.units import Dimension, parse_quantity, unit_of, unit_size
from softbrake.case.yaml_nodes import Place
from softbrake.sim.summary import Trial
from softbrake.studies.error_control import Refined, refine

REACH = 3.0  # of the range on both sides of the value of the case


@dataclass(frozen=True)
class Variable:
    """A quantity of a case that a search varies over a range."""

    path: str
    unit: str  # SI
    low: float  # SI
    high: float
    shown: str  # unit in which people gave the value or the range; SI where they gave none
    size: float  # SI, of that unit
    option: str  # by which people name it

    def in_unit(self, value: float, form: str = ".6g") -> str:
        """A value (SI) in the unit shown."""
        return f"{value / self.size:{form}} {self.shown}".rstrip()

    def override(self, value: float) -> str:
        """A value (SI) as --set has it."""
        return f"{self.path}={value / self.size:.6g}{self.shown}"

    def at(self, share: float) -> float:
        """The value (SI) at a part of the range, 0 to 1; of its logarithm where both ends are positive."""
        if share in (0.0, 1.0):
            return self.high if share else self.low
        return self.low * (self.high / self.low) ** share if self.low > 0.0 else self.low + share * (self.high - self.low)

    def refused(self, fault: str) -> ValueError:
        """The error of a range with an end that no case can have; fault: of the case file."""
        ends = f"{self.in_unit(self.low)} to {self.in_unit(self.high)}"
        return ValueError(f"{self.option} {self.path} from {ends}: {fault.partition(': ')[2]}")


class Searched(NamedTuple):
    """The model of a search."""

    load: Callable[[Mapping[str, float]], Case]  # the case with values (SI) by path, at the level and grid of the search
    check: Callable[[Mapping[str, float]], Refined] | None  # refines it, where the case asks for a tolerance


def variable(file: CaseFile, path: str, between: str | None, option: str = "--find", ranged: str = "--range") -> Variable:
    """Return a quantity of a case file and its range.

    between: LOW:HIGH or PATH=LOW:HIGH, by default a third to three times the value of the case, as far as its key allows. That of
    `pressure.value` is the mean pressure of section 2.2, for a sine its largest one. option, ranged: that ask for it and its
    range, for messages.
    Raises ValueError where it is no quantity, or has no range.
    """
    case, key = file.case, key_at(path)
    usual = "gas.pressure" if case.gas is not None else "pressure.value"
    if key is None or not isinstance(key.kind, Dimension) or not is_quantity(path):
        raise ValueError(f"{option} {path}: not a quantity of the drop; a path such as {usual} or fabric.E is expected")
    if path.startswith("pressure.") and case.gas is not None:
        raise ValueError(f"{option} {path}: the case has gas, no pressure law; a path such as gas.pressure is expected")
    told = Checker()
    overridden(file.tree, Override(f"{path}={key.example}", Place((0, 0, 0), f"{option} {path}")), ALL, told.fault)
    if faults := told.messages():  # a list without that number
        raise ValueError(faults[0])
    shown = file.unit_of(path) or key.kind.unit
    if between is not None:
        low, high = _between(between, key.kind, ranged)
        shown = unit_of(between.split(":")[1]) or shown
    elif path == "pressure.value":
        middle = case.full_stop.largest if case.filling.law == "sine" else case.full_stop.mean
        low, high = middle / REACH, middle * REACH
    elif (value := file.quantity(path)) is not None:
        low, high = _around(value, key)
    else:
        raise ValueError(f"{option} {path}: the case gives no value to start from; {ranged} {path}=LOW:HIGH is expected")
    return Variable(path, key.kind.unit, low, high, shown, unit_size(shown, key.kind), option)


def _around(value: float, key: Key) -> tuple[float, float]:
    """A third to three times a value, no further than a key allows; of an end that it excludes, a third of the way to it."""
    low, high = sorted((value / REACH, value * REACH))
    if key.above is not None and low <= key.above:
        low = key.above + (value - key.above) / REACH
    low = low if key.least is None else max(low, key.least)
    return low, high if key.most is None else min(high, key.most)


def ranges_of(paths: Sequence[str], texts: Sequence[str]) -> dict[str, str]:
    """Return the texts of ranges, PATH=LOW:HIGH or of a single path LOW:HIGH, by path. Raises ValueError for other ones."""
    if repeated := twice(paths):
        raise ValueError(f"--find {repeated}: given twice; it is searched for once")
    found: dict[str, str] = {}
    for text in texts:
        path, equals, _ = (part.strip() for part in text.rpartition("="))
        if not equals and len(paths) == 1:
            path = paths[0]
        if path not in paths:
            fault = f"no --find {path}" if equals else "of which quantity is not said"
            raise ValueError(f"--range {text}: {fault}; {' or '.join(f'{one}=LOW:HIGH' for one in paths)} is expected")
        if path in found:
            raise ValueError(f"--range {text}: a second range of {path}; one is expected")
        found[path] = text
    return found


def twice(names: Sequence[str]) -> str:
    """The first name that is there again; empty without one."""
    return next((name for k, name in enumerate(names) if name in names[:k]), "")


def _between(text: str, kind: Dimension, option: str) -> tuple[float, float]:
    parts = text.rpartition("=")[2].split(":")
    try:
        if len(parts) != 2:
            raise ValueError(f"'{text}' is not LOW:HIGH")
        low, high = (parse_quantity(part, kind) for part in parts)
    except ValueError as error:
        raise ValueError(f"{option} {text}: {error}; {kind.phrase} on both sides of a colon is expected") from None
    if not (low < high and math.isfinite(high - low)):
        raise ValueError(f"{option} {text}: not a range; LOW < HIGH is expected")
    return low, high


def searched(file: CaseFile, budget: float, report: Callable[[Trial], None] | None) -> Searched:
    """Return the model to search with; a case with a tolerance is refined for it (`budget` s, `report`). Raises Diverged."""
    tolerance = file.case.tolerance
    if tolerance is None:
        return Searched(file.vary, None)
    chosen = refine(file.case, tolerance, budget, report).case

    def load(values: Mapping[str, float]) -> Case:
        return level(file.vary(values), chosen.model.fidelity, chosen.grid.generatrix, chosen.grid.hoop, chosen.time.courant)

    def check(values: Mapping[str, float]) -> Refined:
        return refine(file.vary(values), tolerance, budget, report)

    return Searched(load, check)
