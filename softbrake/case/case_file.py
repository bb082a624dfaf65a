"""A case file: read once, and then varied without its text."""

from __future__ import annotations

import sys
from codecs import BOM_UTF8
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from softbrake.case.case import ALL, MAPPINGS, Case, complete
from softbrake.case.checker import Checker
from softbrake.case.keys import Key
from softbrake.case.overrides import Override, overridden
from softbrake.case.section import Draft
from softbrake.case.sections.top import TOP
from softbrake.case.units import Dimension, unit_of
from softbrake.case.yaml_nodes import Node, Place, YamlError, end_of, join, node_of, parse

Number = float | tuple[float, ...]
MAPPING = "case"  # name, in messages and as a title, of what comes from no file


class CaseError(Exception):
    """A case file or an override has faults; `faults` holds a message for each, in the order of the file."""

    def __init__(self, faults: Sequence[str]) -> None:
        super().__init__(faults)
        self.faults = list(faults)

    def __str__(self) -> str:
        return "\n".join(self.faults)


@dataclass(frozen=True, eq=False)
class CaseFile:
    """A case file without faults, its overrides written in."""

    name: str  # as messages have it
    written: Node  # the file, without overrides
    tree: Node  # with them
    overrides: int  # how many
    case: Case  # what it means
    draft: Draft  # that it was checked in
    text: str = ""  # of the file, as it was read; empty of a mapping

    def set(self, overrides: Sequence[str | Override]) -> CaseFile:
        """Return the file with more overrides, applied in turn, such as `fabric.E=18.75kN/m`.

        Raises CaseError with all faults of the overrides, and of the file with them.
        """
        found = _checked(self.name, self.written, self.tree, self.overrides, overrides, Checker(), self.draft)
        return replace(found, text=self.text)

    def vary(self, values: Mapping[str, Number]) -> Case:
        """Return the case with other numbers, in SI units by dotted path. Raises CaseError, as with `--set PATH=VALUE`."""
        texts = {path: repr(list(value) if isinstance(value, tuple) else value) for path, value in values.items()}
        return self.set([f"{path}={text}" for path, text in texts.items()]).case

    def unit_of(self, path: str) -> str:
        """Return the unit in which the file or an override gives the value at a dotted path; empty without one."""
        node: Node | None = self.tree
        for name in path.split("."):
            value = None if node is None else node.value
            members = dict(zip(map(str, range(len(value))), value, strict=True)) if isinstance(value, list) else value
            node = members.get(name) if isinstance(members, dict) else None
        return unit_of(node.value) if node is not None and isinstance(node.value, str) else ""

    def quantities(self) -> dict[str, Number]:
        """What the file and its overrides give to the physics as numbers other than 0, in SI units, by dotted path.

        Defaults are not among them, nor what is no input of the drop: grid, time, tolerance, strengths.
        """
        found: dict[str, Number] = {}
        assert isinstance(self.tree.value, dict)
        _gather(self.tree, "", TOP.keys, found)
        for section in MAPPINGS:
            node = self.tree.value.get(section.name)
            if node is None or not section.physical:
                continue
            if isinstance(node.value, list):
                for number, item in enumerate(node.value):
                    _gather(item, join(section.name, number), section.each, found)
            else:
                _gather(node, section.name, section.keys, found)
        return found

    def quantity(self, path: str) -> float | None:
        """Return one of `quantities`, or an item of one that is a list; None where it is not there."""
        found = self.quantities()
        whole, _, number = path.rpartition(".")
        items = found.get(whole)
        if isinstance(items, tuple) and number.isdecimal() and int(number) < len(items):
            return items[int(number)]
        value = found.get(path)
        return value if isinstance(value, float) else None


def name_of(path: str | Path) -> str:
    """Name of a case file as messages and results have it; - is stdin."""
    return "stdin" if str(path) == "-" else str(path)


def open_case(source: str | PathLike[str] | Mapping[str, Any], overrides: Sequence[str | Override] = ()) -> CaseFile:
    """Read a case file or a mapping, to be varied. source, overrides and errors: as of `load_case`."""
    if isinstance(source, Mapping):
        check = Checker()
        try:
            root = node_of(source, Place((0, 0, 0), MAPPING), check.fault)
        except RecursionError:
            raise CaseError([f"{MAPPING}: nested too deeply; sections of keys and values are expected"]) from None
        return _checked(MAPPING, root, root, 0, _several(overrides), check)
    path = fspath(source)
    name = name_of(path)
    return case_file(_read_text(path, name), name, overrides)


def load_case(source: str | PathLike[str] | Mapping[str, Any], overrides: Sequence[str] = ()) -> Case:
    """Read a case and check it.

    source: path of a case file, - for what comes on stdin; or a mapping of sections as in a case file, such as
    `{"shell": {"diameter": "0.5 m", "height": 0.6}, ...}`, with numbers in SI units and texts with units. The case of a result,
    `read_result(path).case`, is one. overrides: texts such as `fabric.E=18.75kN/m`, applied in turn to the keys of the case.
    Returns the Case, resolved and in SI units. Raises CaseError with all faults of the case and the overrides.
    """
    return open_case(source, overrides).case


def parse_case(text: str, name: str, overrides: Sequence[str | Override] = ()) -> Case:
    """Read the text of a case file; `name` stands in messages and gives the default title. Raises CaseError."""
    return case_file(text, name, overrides).case


def case_file(text: str, name: str, overrides: Sequence[str | Override] = ()) -> CaseFile:
    """Read the text of a case file, to be varied. As `parse_case`."""
    check = Checker()

    def place_of(line: int, column: int) -> Place:
        return Place((0, line, column), f"{name}:{line + 1}:{column + 1}")

    try:
        root = parse(text, place_of, check.fault)
    except YamlError as error:
        check.fault(error.place, "", str(error), error.expected)
        raise CaseError(check.messages()) from None
    if root is None or not isinstance(root.value, dict):
        empty = root is None or root.value is None  # of '---' alone YAML's place is behind the last line
        place = place_of(0, 0) if root is None or empty else root.place
        check.fault(place, "", "an empty file" if empty else "not a mapping", "sections such as 'shell:' are expected")
        raise CaseError(check.messages())
    return replace(_checked(name, root, root, 0, _several(overrides), check), text=text)


def _several(overrides: Sequence[str | Override]) -> Sequence[str | Override]:
    return [overrides] if isinstance(overrides, str) else overrides


def _checked(
    name: str,
    written: Node,
    tree: Node,
    count: int,
    overrides: Sequence[str | Override],
    told: Checker,
    sound: Draft | None = None,
) -> CaseFile:
    """Write overrides into a tree that has `count` of them, and check it.

    told: has the faults found so far. sound: the draft of the tree without the overrides, which spares what they do not touch.
    """
    for index, override in enumerate(overrides, count):
        change = override if isinstance(override, Override) else Override(override, Place((1, index, 0), f"--set {override}"))
        tree = overridden(tree, change, ALL, told.fault)
    draft = Draft(tree, Path(name).stem if sound is None else sound.stem, ALL, sound)
    draft.faults += told.faults
    case = complete(draft)
    if case is None:
        raise CaseError(draft.messages())
    draft.settle()
    return CaseFile(name, written, tree, count + len(overrides), case, draft)


def _read_text(path: str | Path, name: str) -> str:
    try:
        content = _read_stdin() if str(path) == "-" else Path(path).read_bytes()
    except OSError as error:
        raise CaseError([f"{name}: {error.strerror or error}; a case file is expected"]) from None
    content = content.removeprefix(BOM_UTF8)
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        line, column = end_of(content[: error.start].decode("utf-8"))
        fault = f"byte 0x{content[error.start]:02x} is not UTF-8; a text file in UTF-8 is expected"
        raise CaseError([f"{name}:{line + 1}:{column + 1}: {fault}"]) from None


def _read_stdin() -> bytes:
    return b"" if sys.stdin is None else sys.stdin.buffer.read()


def _gather(node: Node, where: str, keys: Sequence[Key], found: dict[str, Number]) -> None:
    """Add the numbers of a mapping, which has no faults."""
    assert isinstance(node.value, dict)
    for key in keys:
        if key.name not in node.value or key.idle:
            continue
        item = node.value[key.name].value
        if isinstance(item, dict):
            _gather(node.value[key.name], join(where, key.name), key.parts, found)
            continue
        if not isinstance(key.kind, Dimension):
            continue
        values = tuple(float(key.convert(one.value)) for one in item) if isinstance(item, list) else float(key.convert(item))
        if values if isinstance(values, float) else any(values):
            found[join(where, key.name)] = values
