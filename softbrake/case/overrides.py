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
    return _Writer(value, place, sections[""], sections.get(keys[0]) if len(keys) > 1 else None, report).put(root, "", keys)


@dataclass(frozen=True)
class _Writer:
    value: Node
    place: Place
    top: Section  # of the keys outside of all sections
    section: Section | None  # that the value belongs to
    report: Report

    def put(self, node: Node, path: str, keys: Sequence[str]) -> Node:
        """Return a node at a path with the value at the keys below it; the node itself where there is no such place."""
        name, *deeper = keys
        if isinstance(node.value, dict):
            members = dict(node.value)
            if not path:
                self.top.give_way(members, name)
            elif not deeper and self.section is not None:
                self.section.give_way(members, name)
            if deeper:
                empty, member = Node({}, self.place, self.place), members.get(name)
                if member is None or (not isinstance(member.value, (dict, list)) and self.has_parts(name)):
                    member = empty
                members[name] = self.put(member, join(path, name), deeper)
            else:
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

    def has_parts(self, name: str) -> bool:
        """Whether a key may be a mapping instead of its one value."""
        return self.section is not None and any(
            key.name == name and key.parts for key in (*self.section.keys, *self.section.each)
        )
