"""Overrides such as `fabric.E=18.75kN/m`: values written over those of the file before it is checked."""

from __future__ import annotations

from typing import NamedTuple

from softbrake.case.keys import ALTERNATIVES
from softbrake.case.yaml_nodes import Node, Place, Report, YamlError, join, parse


class Override(NamedTuple):
    """An override that stands somewhere else than in `--set`."""

    text: str
    place: Place


def apply_override(root: Node, override: str, place: Place, report: Report) -> None:
    """Write the value of one override into the tree; keys it stands for instead are dropped."""
    path, equals, text = override.partition("=")
    path = path.strip()
    if not equals or not all(path.split(".")):
        report(place, "", "not KEY=VALUE", "a key and its value such as 'fabric.E=18.75kN/m' is wanted")
        return
    try:
        value = parse(text, lambda line, column: place, report, path) or Node(None, place, place)
    except YamlError as error:
        report(place, path, str(error), "a YAML value is wanted")
        return
    node, done = root, ""
    *parents, name = path.split(".")
    for parent in parents:
        if isinstance(node.value, dict):
            node = node.value.setdefault(parent, Node({}, place, place))
        elif (item := _item(node, parent, done, place, report)) is not None:
            node = item
        else:
            return
        done = join(done, parent)
    if isinstance(node.value, dict):
        section = "belts" if parents[:1] == ["belts"] else done
        _drop_alternatives(node.value, section, name)
        node.value[name] = value
    elif (item := _item(node, name, done, place, report)) is not None:
        item.value, item.place, item.key = value.value, place, place


def _item(node: Node, name: str, path: str, place: Place, report: Report) -> Node | None:
    if not isinstance(node.value, list):
        report(place, join(path, name), f"{path} is a single value without keys", f"{path}=VALUE is wanted")
        return None
    if not name.isdecimal() or int(name) >= len(node.value):
        numbers = ", ".join(str(number) for number in range(len(node.value))) or "none"
        report(place, join(path, name), f"{path} is a list without a '{name}'", f"its numbers are {numbers}")
        return None
    return node.value[int(name)]


def _drop_alternatives(members: dict[str, Node], section: str, name: str) -> None:
    if section == "fabric" and name in ("E11", "E22") and "E" in members:
        members["E11"] = members["E22"] = members.pop("E")
    if section == "fabric" and name in ("nu12", "nu21"):  # either follows from the other
        members.pop("nu21" if name == "nu12" else "nu12", None)
    for groups in ALTERNATIVES.get(section, ()):
        if any(name in group for group in groups):
            for other in [key for group in groups if name not in group for key in group]:
                members.pop(other, None)
