"""Mappings of a case file against their keys: gathers all faults, each with place, path and what is allowed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from typing import Any

from softbrake.case.keys import Key
from softbrake.case.units import POINT, Dimension
from softbrake.case.yaml_nodes import Node, Place, join

CLOSE = 0.65  # of two names, from which on one may be meant for the other; vents and belts have 0.6
Values = dict[str, Any]  # of a section, without the faulty ones


class Checker:
    """Reads mappings and keeps what is wrong with them."""

    def __init__(self) -> None:
        self.faults: list[tuple[tuple[int, int, int], str]] = []
        self.meant: set[str] = set()  # paths that an unknown key was probably meant for: not missing besides

    def fault(self, place: Place, path: str, fault: str, expected: str) -> None:
        """Keep a message `place: path: fault; expected`."""
        self.faults.append((place.order, f"{place.text}: {path + ': ' if path else ''}{fault}; {expected}"))

    def messages(self) -> list[str]:
        """All faults in the order of the file, then of the overrides."""
        return [message for _, message in sorted(self.faults, key=lambda item: item[0])]

    def mapping(
        self,
        node: Node,
        path: str,
        keys: Sequence[Key],
        alternatives: Iterable[Sequence[Sequence[str]]] = (),
        choices: Iterable[Sequence[Sequence[str]]] = (),
        others: Iterable[str] = (),
        complete: bool = True,
    ) -> Values:
        """Return SI values and defaults of a mapping, without what is faulty.

        path: dotted, for messages; alternatives: of each exactly one group of keys must be given; choices: of each at most one
        may be; others: keys that are read elsewhere; complete: whether missing keys are faults.
        """
        if not isinstance(node.value, dict):
            self.fault(node.place, path, "not a mapping", f"a mapping of {listed(keys)} is expected")
            return {}
        known = {key.name: key for key in keys}
        values: Values = {key.name: key.default for key in keys if key.default is not None}
        for name, item in node.value.items():
            if name in known:
                values.pop(name, None)
                if (value := self.value(item, join(path, name), known[name])) is not None:
                    values[name] = value
            elif name not in others:
                self.unknown(item.key, path, name, [*known, *others])
        if complete:
            for key in keys:
                if key.required and key.name not in node.value:
                    self.missing(node, path, key)
        for groups in alternatives:
            self.alternatives(node, path, groups, known, complete)
        for groups in choices:
            self.alternatives(node, path, groups, known, False)
        return values

    def value(self, node: Node, path: str, key: Key) -> Any:
        """SI value of a key, of its parts a mapping; None if it is faulty."""
        if key.parts and isinstance(node.value, dict):
            told = len(self.faults)
            parts = self.mapping(node, path, key.parts, key.part_groups)
            return parts if len(self.faults) == told else None
        if not key.many:
            try:
                return key.convert(node.value)
            except ValueError as error:
                self.fault(node.place, path, str(error), f"{key.expected} is expected")
                return None
        if not isinstance(node.value, list) or len(node.value) < 2:
            fault = "fewer than two values" if isinstance(node.value, list) else "not a list"
            self.fault(node.place, path, fault, f"a list such as {key.example} is expected")
            return None
        single = replace(key, many=False, example=key.example.strip("[]").split(", ")[-1])
        values = tuple(self.value(item, join(path, number), single) for number, item in enumerate(node.value))
        return None if None in values else values

    def table(self, node: Node, path: str, values: Values, rising: Key, other: Key) -> None:
        """Two lists are as long as each other, and the values of the first increase."""
        rows = values.get(rising.name)
        if rows is None:
            return
        assert isinstance(node.value, dict) and isinstance(rising.kind, Dimension)
        items = node.value[rising.name].value
        assert isinstance(items, list)
        what, order = ("time", "later than the time") if rising.kind is Dimension.TIME else ("value", "above the value")
        for number in range(1, len(rows)):
            if rows[number] <= rows[number - 1]:
                expected = f"a {what} > {rows[number - 1]:g} {rising.kind.unit}".rstrip()
                where = join(path, f"{rising.name}.{number}")
                self.fault(items[number].place, where, f"not {order} before it", f"{expected} is expected")
        if other.name in values and len(values[other.name]) != len(rows):
            place, where = last_given(node, path, [other.name, rising.name])
            row = rising.name.replace("_", " ").removesuffix("s")
            fault = f"{len(values[other.name])} values for {len(rows)} {row}s"
            self.fault(place, where, fault, f"a value for each {row} is expected")

    def unknown(self, place: Place, path: str, name: str, known: Sequence[str]) -> None:
        """Tell of a key that is none, and which one was probably meant."""
        close = get_close_matches(name, known, 1, CLOSE)
        self.meant |= {join(path, match) for match in close}
        hint = f"did you mean '{close[0]}'?" if close else f"known are {', '.join(known)}"
        if name[:1].isdecimal():  # what comes behind the comma of {diameter: 0,5 m}
            hint = f"{POINT}, no comma"
        self.fault(place, join(path, name), "unknown key", hint)

    def missing(self, node: Node, path: str, key: Key) -> None:
        """Tell of a key that is not in a mapping, unless an unknown one was meant for it."""
        if join(path, key.name) not in self.meant:
            self.fault(node.key, join(path, key.name), "missing", f"{key.expected} is expected")

    def alternatives(
        self, node: Node, path: str, groups: Sequence[Sequence[str]], keys: Mapping[str, Key], complete: bool
    ) -> None:
        """One of the groups must be given, but for keys with a default, and none of another group."""
        assert isinstance(node.value, dict)
        started = [group for group in groups if any(name in node.value for name in group)]
        expected = " or ".join(" and ".join(f"'{name}'" for name in group) for group in groups)
        if len(started) > 1:
            place, where = last_given(node, path, [name for group in groups for name in group])
            others = [name for group in groups for name in group if name in node.value and join(path, name) != where]
            self.fault(place, where, f"given besides {' and '.join(others)}", f"either {expected} is expected")
        elif started:
            for name in started[0]:
                if name not in node.value and keys[name].default is None:
                    self.missing(node, path, keys[name])
        elif complete and not any(join(path, name) in self.meant for group in groups for name in group):
            first = keys[groups[0][0]]
            self.fault(node.key, path, f"missing {expected}", f"for instance '{first.name}: {first.example}'")


def last_given(node: Node, path: str, names: Sequence[str]) -> tuple[Place, str]:
    """Place and path of the last given of some keys: the one a user wrote, or set, to bring about their conflict."""
    assert isinstance(node.value, dict)
    given = [(node.value[name].key, join(path, name)) for name in names if name in node.value]
    return max(given, key=lambda item: item[0].order)


def listed(keys: Iterable[Key]) -> str:
    """Names between commas."""
    return ", ".join(key.name for key in keys)
