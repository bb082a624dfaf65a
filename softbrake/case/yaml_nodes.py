"""YAML text -> tree of values that know their line and column, by the YAML 1.2 core rules.

PyYAML follows YAML 1.1: `1e3` would be text, `no` false, `12:30` a number, and of two equal keys the last would win.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import yaml


@dataclass(frozen=True)
class Place:
    """Where something was written: `file:line:col` or the text of an override."""

    order: tuple[int, int, int]  # overrides sort behind the file
    text: str


@dataclass
class Node:
    """One value of the tree."""

    value: str | int | float | bool | list[Node] | dict[str, Node] | None
    place: Place
    key: Place  # of the key in front of it; its own place where it has none


Report = Callable[[Place, str, str, str], None]  # place, dotted path, fault, what is allowed
PlaceOf = Callable[[int, int], Place]  # of a line and column counted from 0


class YamlError(Exception):
    """The text is not YAML; `place`, the message and `expected` say where, why and what is allowed."""

    def __init__(self, place: Place, message: str, expected: str = "valid YAML is expected") -> None:
        super().__init__(message)
        self.place = place
        self.expected = expected


_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_WORDS: dict[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}


def _plain(text: str) -> str | int | float | bool | None:
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text) and len(text) < 400:  # longer ones go on as floats, which overflow
        return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))
    if _FLOAT.fullmatch(text):
        return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
    return text


def join(path: str, name: str | int) -> str:
    """Dotted path of a member."""
    return f"{path}.{name}" if path else str(name)


def node_of(value: Any, place: Place, report: Report, path: str = "") -> Node:
    """Tree of mappings, lists and single values of Python or NumPy, all of one place. What is none is reported."""
    if hasattr(value, "tolist"):  # of NumPy
        value = value.tolist()
    if isinstance(value, Mapping):
        members = {str(name): node_of(item, place, report, join(path, name)) for name, item in value.items()}
        return Node(members, place, place)
    if isinstance(value, (list, tuple)):
        items = [node_of(item, place, report, join(path, number)) for number, item in enumerate(value)]
        return Node(items, place, place)
    if not isinstance(value, (str, int, float, type(None))):
        report(place, path, f"{value!r} is no value", "a number in SI units or a text such as '20 kN/m' is expected")
        value = None
    return Node(value, place, place)


def parse(text: str, place_of: PlaceOf, report: Report, path: str = "") -> Node | None:
    """Tree of the one document of a YAML text, None where there is none.

    Duplicate keys, anchors, aliases, merge keys and tags are reported and passed over. Raises YamlError.
    """
    if _FLOAT.fullmatch(text) or _INTEGER.fullmatch(text):  # of a sweep, thousands of times
        return Node(_plain(text), place_of(0, 0), place_of(0, 0))
    try:
        events = yaml.parse(_with_bounds(text) if ">=" in text else text, Loader=_LOADER)
        root = None
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                if root is not None:
                    report(_place(event, place_of), path, "a second document", "one document a file is expected")
                    break
                root = _Builder(events, place_of, report).node(next(events), path)
        return root
    except yaml.MarkedYAMLError as error:
        mark, began = error.problem_mark, error.context_mark
        shown = mark
        if began and (mark is None or mark.index >= len(text.rstrip()) or error.context == "while scanning a simple key"):
            shown = began  # what has no end is noticed further down, or behind the last line
        place = place_of(*min((shown.line, shown.column), end_of(text.rstrip()))) if shown else place_of(0, 0)
        if mark and text[mark.index : mark.index + 1] == "\t":
            raise YamlError(place, "a tab", "spaces are expected in front of a key") from None
        raise YamlError(place, error.problem or "not YAML") from None
    except yaml.reader.ReaderError as error:
        raise YamlError(place_of(*end_of(text[: error.position])), error.reason) from None
    except UnicodeEncodeError as error:  # bytes of a command line that are not UTF-8
        place = place_of(*end_of(text[: error.start]))
        raise YamlError(place, "a character that is none", "text in UTF-8 is expected") from None
    except RecursionError:
        raise YamlError(place_of(0, 0), "nested too deeply") from None


def _with_bounds(text: str) -> str:
    """The text with ≥ instead of >= in front of values, where YAML has folded texts or nothing: columns stay as they are."""
    while True:
        try:
            for _ in yaml.scan(text, Loader=_LOADER):
                pass
            return text
        except yaml.MarkedYAMLError as error:
            at = -1 if error.problem_mark is None else error.problem_mark.index
            start = next((k for k in (at - 1, at) if k >= 0 and text.startswith(">=", k)), None)
            if start is None:
                return text
            text = f"{text[:start]}≥ {text[start + 2 :]}"
        except (yaml.reader.ReaderError, UnicodeEncodeError, RecursionError):
            return text


def end_of(text: str) -> tuple[int, int]:
    """Line and column behind a text, counted from 0, with the line ends of YAML."""
    lines = re.split("\r\n|[\n\r\x85\u2028\u2029]", text)
    return len(lines) - 1, len(lines[-1])


def _place(event: Any, place_of: PlaceOf) -> Place:
    return place_of(event.start_mark.line, event.start_mark.column)


class _Builder:
    def __init__(self, events: Iterator[Any], place_of: PlaceOf, report: Report) -> None:
        self.events = events
        self.place_of = place_of
        self.report = report
        self.anchors: dict[str, Node] = {}

    def node(self, event: Any, path: str, key: Place | None = None) -> Node:
        place = _place(event, self.place_of)
        if isinstance(event, yaml.AliasEvent):
            self.report(place, path, f"alias '*{event.anchor}' is not supported", "write the value out")
            known = self.anchors.get(event.anchor or "")
            return Node(known.value if known else None, place, key or place)
        if event.tag is not None:
            self.report(place, path, f"tag '{event.tag}' is not supported", "leave it out")
        node = Node(None, place, key or place)
        if isinstance(event, yaml.ScalarEvent):
            node.value = _plain(event.value) if event.style in (None, "") else event.value
        elif isinstance(event, yaml.SequenceStartEvent):
            node.value = self.items(path)
        else:
            node.value = self.members(path)
        if event.anchor is not None:
            self.report(place, path, f"anchor '&{event.anchor}' is not supported", "leave it out")
            self.anchors[event.anchor] = node
        return node

    def items(self, path: str) -> list[Node]:
        items: list[Node] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            items.append(self.node(event, join(path, len(items))))
        return items

    def members(self, path: str) -> dict[str, Node]:
        members: dict[str, Node] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            place = _place(event, self.place_of)
            if not isinstance(event, yaml.ScalarEvent):
                self.report(place, path, "a key that is not a text", "plain keys are expected")
                self.node(event, path)
                self.node(next(self.events), path)
                continue
            name = event.value
            member = self.node(next(self.events), join(path, name), place)
            if name == "<<":
                self.report(place, join(path, name), "merge keys are not supported", "write the keys out")
            elif name in members:
                first = members[name].key
                self.report(place, join(path, name), f"duplicate key, first at {first.text}", "each key once is expected")
            else:
                members[name] = member
        return members
