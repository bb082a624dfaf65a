"""The text of a case file with other values: in their places, and all else as it stands there, comments too."""

from __future__ import annotations

from collections.abc import Mapping

import yaml

from softbrake.case.yaml_nodes import Node, Place, parse


def edited(text: str, values: Mapping[str, str], comments: Mapping[str, str]) -> str:
    """Return the text of a case file without faults with values by dotted path, and comments on lines above some of them.

    A key that is not there is added to its section, a section at the end. Raises ValueError, with the path, where there is no
    place for a value, as in a list that is not there. Keys that a value would stand for instead are not taken out.
    """
    end = "\r\n" if "\r\n" in text else "\n"
    for path, value in values.items():
        text = end.join(_with(text if text.endswith(end) else text + end, end, path, value, comments.get(path, "")))
    return text


def _with(text: str, end: str, path: str, value: str, comment: str) -> list[str]:
    """Lines of a text with one value, and a comment above it if there is one."""
    root = parse(text, lambda line, column: Place((0, line, column), ""), lambda *_: None)
    assert root is not None
    lines, node = text.split(end), root
    names = path.split(".")
    for depth, name in enumerate(names):
        members = node.value
        if isinstance(members, list) and name.isdecimal() and int(name) < len(members):
            node = members[int(name)]
        elif isinstance(members, dict) and name in members:
            node = members[name]
        elif isinstance(members, dict) and depth == len(names) - 1:
            return _added(lines, node, f"{name}: {value}", comment)
        elif depth == 0 and len(names) == 2 and not names[1].isdecimal():
            new = [f"{names[0]}:", *([f"  # {comment}"] if comment else []), f"  {names[1]}: {value}"]
            return [*lines[:-1], *new, ""]
        else:
            raise ValueError(path)
    if isinstance(node.value, (dict, list)):
        raise ValueError(path)
    start = node.place.order[1:]
    stop = _ends(text)[start]
    old = lines[start[0]]
    return _noted(lines, start[0], [f"{old[: start[1]]}{value}{old[stop:]}"], comment)


def _ends(text: str) -> dict[tuple[int, int], int]:
    """Columns behind scalars by the lines and columns where they begin."""
    found = {}
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        if isinstance(event, yaml.ScalarEvent) and event.start_mark is not None and event.end_mark is not None:
            found[event.start_mark.line, event.start_mark.column] = event.end_mark.column
    return found


def _added(lines: list[str], mapping: Node, entry: str, comment: str) -> list[str]:
    """Lines with an entry at the head of a mapping."""
    _, line, column = mapping.place.order
    before, rest = lines[line][:column], lines[line][column:]  # before: spaces, `- ` of a list, or the key of a mapping in braces
    if rest.startswith("{"):
        more = ", " if mapping.value else ""
        return _noted(lines, line, [f"{before}{{{entry}{more}{rest[1:]}"], comment)
    return _noted(lines, line, [f"{before}{entry}", f"{' ' * column}{rest}"], comment)


def _noted(lines: list[str], line: int, new: list[str], comment: str) -> list[str]:
    """Lines with new ones instead of one, and a comment above."""
    indent = lines[line][: len(lines[line]) - len(lines[line].lstrip(" "))]
    return [*lines[:line], *([f"{indent}# {comment}"] if comment else []), *new, *lines[line + 1 :]]
