"""A key of a case file: it feeds the checks, the messages, the JSON Schema and the starter case."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Integral, Real
from typing import Any

from softbrake.case.units import Dimension, parse_quantity

Groups = tuple[tuple[str, ...], ...]  # names of keys that are given together, and exclude those of the other groups
Alternatives = tuple[Groups, ...]


@dataclass(frozen=True)
class Key:
    """One key. Bounds and default in SI units; a key that is neither required nor has a default may be left out."""

    name: str
    kind: Dimension | type[int] | type[str] | tuple[str, ...] | tuple[int, ...]  # quantity, integer, text or one of these
    meaning: str
    example: str  # value as the starter case writes it
    default: float | int | str | None = None
    computed: str = ""  # in words, a default that depends on other keys
    required: bool = False
    above: float | None = None
    least: float | None = None
    most: float | None = None
    many: bool = False  # a list of such values
    auto: str = ""  # the word auto is allowed; what a number looks like
    begun: bool = False  # stands in the starter case though it may be left out
    instead: str = ""  # the key that it replaces: for starter case and schema, where both may stand
    idle: bool = False  # does nothing to the drop: accuracy, or what an answer is compared with
    parts: tuple[Key, ...] = ()  # keys of a mapping that may stand instead of the one value
    one_part: bool = False  # of which exactly one is given

    @property
    def part_groups(self) -> Alternatives:
        """Choices among its parts."""
        return (tuple((part.name,) for part in self.parts),) if self.one_part else ()

    @property
    def signed(self) -> bool:
        """Whether it is a quantity that may be negative."""
        lowest = self.least if self.above is None else self.above
        return isinstance(self.kind, Dimension) and (lowest is None or lowest < 0.0)

    @property
    def expected(self) -> str:
        """What is allowed for one value."""
        if isinstance(self.kind, tuple):
            names = ", ".join(part.name for part in self.parts)
            return " or ".join(map(str, self.kind)) + (f", or one of {names} such as '{self.example}'," if self.parts else "")
        phrase = {int: "an integer", str: "a text"}[self.kind] if isinstance(self.kind, type) else self.kind.phrase
        limits = ((">", self.above), (">=", self.least), ("<=", self.most))
        bounds = " and ".join(f"{sign} {bound:g}" for sign, bound in limits if bound is not None)
        return ("auto or " if self.auto else "") + f"{phrase} {bounds}".rstrip() + f" such as '{self.auto or self.example}'"

    def convert(self, value: Any) -> float | int | str:
        """SI value of a scalar of the file; ValueError says in words what is wrong with it."""
        if value is None:
            raise ValueError("no value")
        if isinstance(value, (list, dict)):
            raise ValueError(f"{'a list' if isinstance(value, list) else 'a mapping'} is not one value")
        shown = f"'{value}'" if isinstance(value, str) else str(value).lower()
        if self.auto and value == "auto":
            return "auto"
        if isinstance(self.kind, tuple):
            if value not in self.kind or not isinstance(value, (str, int)):
                raise ValueError(f"unknown value {shown}")
            return value
        if self.kind is str:
            if not isinstance(value, str):
                raise ValueError(f"{shown} is not a text (quote it)")
            return value
        number = self._number(value, shown)
        if number and not 1e-30 < abs(number) < 1e30:  # so that no formula over- or underflows later
            raise ValueError(f"{shown[:40]} is not between 1e-30 and 1e30 in SI units")
        if not self._within(number):
            raise ValueError(f"{shown} is out of range")
        return number

    def check(self, value: Any) -> None:
        """Refuse an SI value that no file can give; ValueError says in words what is wrong with it, and what is allowed."""
        items = value if self.many and isinstance(value, tuple) else (value,)
        for item in items:
            if isinstance(self.kind, tuple):
                sound = isinstance(item, (str, int)) and item in self.kind
            elif self.kind is str:
                sound = isinstance(item, str)
            else:
                real = type(item) is (int if self.kind is int else float)  # which tells the most of them sooner
                real = real or (isinstance(item, Integral if self.kind is int else Real) and not isinstance(item, bool))
                sound = real and math.isfinite(item) and self._within(item)
            if not sound:
                expected = replace(self, many=False, auto="").expected
                raise ValueError(f"{item!r} is not allowed; {expected} is expected")

    def _within(self, number: float) -> bool:
        return (
            (self.above is None or number > self.above)
            and (self.least is None or number >= self.least)
            and (self.most is None or number <= self.most)
        )

    def _number(self, value: str | float | bool, shown: str) -> float | int:
        if isinstance(value, bool):
            raise ValueError(f"{shown} is not a number")
        if isinstance(value, str):
            if not isinstance(self.kind, Dimension):
                raise ValueError(f"{shown} is not an integer")
            return parse_quantity(value, self.kind)
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise ValueError(f"{shown[:40]} is not a finite number")
        if self.kind is not int:
            return number
        if number != int(number):
            raise ValueError(f"{shown} is not an integer")
        return int(value)

    @property
    def purpose(self) -> str:
        """Meaning, and the key that it stands for instead."""
        return f"instead of {self.instead}: {self.meaning}" if self.instead else self.meaning

    @property
    def described(self) -> str:
        """Meaning, words or SI unit, and default in one line."""
        unit = f" [{self.kind.unit}]" if isinstance(self.kind, Dimension) and self.kind.unit else ""
        words = f" ({' | '.join(map(str, self.kind))})" if isinstance(self.kind, tuple) else ""
        default = f"{self.default:.7g}" if isinstance(self.default, (int, float)) else self.computed or self.default
        return self.purpose + words + unit + (f"; default {default}" if default else "")

    def schema(self) -> dict[str, Any]:
        """JSON Schema of its value."""
        value: dict[str, Any]
        if isinstance(self.kind, tuple):
            value = {"enum": list(self.kind)}
        elif self.kind is str:
            value = {"type": "string"}
        else:
            bounds = {"exclusiveMinimum": self.above, "minimum": self.least, "maximum": self.most}
            value = {"type": "integer" if self.kind is int else "number"} | {k: v for k, v in bounds.items() if v is not None}
            if isinstance(self.kind, Dimension):
                words = [{"const": "auto"}] if self.auto else []
                value = {"anyOf": [value, *words, {"$ref": f"#/$defs/{'signed_' * self.signed}{self.kind.name.lower()}"}]}
        if self.many:
            value = {"type": "array", "minItems": 2, "items": value}
        if self.parts:
            value = {"anyOf": [value, mapping_schema(self.parts, self.part_groups)]}
        value["description"] = self.described
        if self.default is not None:
            value["default"] = self.default
        elif not self.many:
            value["examples"] = [int(self.example) if self.kind is int else self.example]
        return value

    def starter(self, indent: str, live: bool) -> str:
        """Its line of the starter case; one that is not live is commented out."""
        return f"{indent}{'' if live else '# '}{self.name}: {self.example}".ljust(33) + f" # {self.described}"


def mapping_schema(keys: Sequence[Key], alternatives: Alternatives = (), choices: Alternatives = ()) -> dict[str, Any]:
    """JSON Schema of a mapping of keys.

    Of each of the alternatives exactly one group of keys must be given, of each of the choices at most one; keys of a group that
    have a default may be left out.
    """
    mapping: dict[str, Any] = {
        "type": "object",
        "properties": {key.name: key.schema() for key in keys},
        "required": [key.name for key in keys if key.required],
        "additionalProperties": False,
    }
    if alternatives or choices:
        spared = {key.name for key in keys if key.default is not None}
        needed = [{"oneOf": [_only(group, groups, spared) for group in groups]} for groups in alternatives]
        allowed = [{"anyOf": [_only(group, groups, spared) for group in ((), *groups)]} for groups in choices]
        mapping["allOf"] = needed + allowed
    return mapping


def _only(group: tuple[str, ...], groups: Groups, spared: set[str]) -> dict[str, Any]:
    others = [{"required": [name]} for other in groups if other != group for name in other]
    return {"required": [name for name in group if name not in spared], "not": {"anyOf": others}}
