"""Overrides such as `fabric.E=18.75kN/m`: values written over those of the file before it is checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from softbrake.case.section import Section
from softbrake.case.yaml_nodes import Node, Place, Report, YamlError, join, parse


class Override(NamedTuple):
    """An override that stands somewhere else than in `--set`."""

    text: str
    place: Place


def overridden(root: Node, override: Override, sections: dict[str, Section], report: Report) -> Node:
    """Return the tree with the value of one override written in; keys it stands for instead are dropped.

    The tree that is given stays as it is; both share what the override does not touch. What is wrong goes to `report`.
    """
    place = override.place
    path, equals, text = override.text.partition("=")
    keys = path.strip().split(".")
    if not equals or not all(keys):
        report(place, "", "not KEY=VALUE", "a key and its value such as 'fabric.E=18.75kN/m' is expected")
        return root
    try:
        value = parse(text, lambda line, column: place, report, path.strip()) or Node(None, place, place)
    except YamlError as error:
        report(place, path.strip(), str(error), "a YAML value is expected")
        return root
    return _Writer(value, place, sections.get(keys[0]) if len(keys) > 1 else None, report).put(root, "", keys)


@dataclass(frozen=True)
class _Writer:
    value: Node
    place: Place
    section: Section | None  # that the value belongs to
    report: Report

    def put(self, node: Node, path: str, keys: Sequence[str]) -> Node:
        """Return a node at a path with the value at the keys below it; the node itself where there is no such place."""
        name, *deeper = keys
        if isinstance(node.value, dict):
            members = dict(node.value)
            if deeper:
                members[name] = self.put(members.get(name, Node({}, self.place, self.place)), join(path, name), deeper)
            else:
                if self.section is not None:
                    self.section.give_way(members, name)
                members[name] = self.value
            return replace(node, value=members)
        if not isinstance(node.value, list):
            self.report(self.place, join(path, name), f"{path} is a single value without keys", f"{path}=VALUE is expected")
            return node
        if not name.isdecimal() or int(name) >= len(node.value):
            numbers = ", ".join(str(number) for number in range(len(node.value))) or "none"
            self.report(self.place, join(path, name), f"{path} is a list without a '{name}'", f"its numbers are {numbers}")
            return node
        items, number = list(node.value), int(name)
        new = Node(self.value.value, self.place, self.place)
        items[number] = self.put(items[number], join(path, name), deeper) if deeper else new
        return replace(node, value=items)
