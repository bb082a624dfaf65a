"""Texts of delimited columns: a header with names and units above rows of numbers, a column of times among them.

Nothing is guessed that the text leaves open. The first line with numbers alone tells the delimiter: only one can part it into
numbers. A comma is a decimal mark where it is not the delimiter and no number has a point.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from softbrake.core.arrays import Floats
from softbrake.signals.channel import Channel, SignalError, check_units, is_unit, lines_of, listed, second_size, si_size

DELIMITERS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "spaces"}
COMMENTS = ("#", "%", "//")
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+|[0-9]+,[0-9]+)([eE][-+]?[0-9]+)?")
_THOUSANDS = re.compile(r"[-+]?[1-9][0-9]{0,2},[0-9]{3}")  # or a decimal comma
_MISSING = ("", "-", "--", "---", "nan", "na", "n/a", "#n/a", "null", "none", "novalue", "inf", "-inf", "+inf")
_UNIT = re.compile(r"(?P<name>.*?)\s*(\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*(\([^()]*\))?)\)|\s/\s*(?P<over>.+))\s*")


class _Line(NamedTuple):
    number: int  # from 1
    text: str


class _Name(NamedTuple):
    """A name of the header, as `acc z [g]`."""

    name: str
    unit: str
    place: str  # file:line:col


def read(path: Path, units: Mapping[str, str], time: str | None) -> list[Channel]:
    """Read a text as `read_channels` does."""
    data = path.read_bytes()
    if b"\0" in data and not data.startswith((b"\xff\xfe", b"\xfe\xff")):  # of UTF-16
        raise SignalError(f"{path}: is no text; columns of numbers, or a file *.mme, *.uff, *.tdms are expected")
    lines = [_Line(k, line) for k, line in enumerate(lines_of(data), 1) if line.strip()]
    delimiter, start = _start(path, lines)
    rows = [line for line in lines[start:] if not line.text.lstrip().startswith(COMMENTS)]
    names = _header(path, lines[:start], _filled(rows[0].text, delimiter), delimiter, time)
    check_units(path, units, [each.name for each in names])
    if time is not None and time not in [each.name for each in names]:
        raise SignalError(f"{path}: no column '{time}' for the times; {listed(each.name for each in names)} are expected")
    of_time = 0 if time is None else [each.name for each in names].index(time)
    table = _numbers(path, rows, [each.name for each in names], delimiter)
    clock = names[of_time]
    unit = units.get(clock.name, clock.unit)
    try:
        if not unit:
            raise ValueError("no unit")
        size = second_size(unit)
    except ValueError as error:
        expected = f"'{clock.name} [s]', '{clock.name} [ms]' or a unit given for it is expected"
        raise SignalError(f"{clock.place}: times '{clock.name}': {error}; {expected}") from None
    times = table[:, of_time] * size
    if (late := np.flatnonzero(np.diff(times) <= 0.0)).size:
        line, cells = rows[late[0] + 1], _cells(rows[late[0] + 1].text, delimiter)
        before = _cells(rows[late[0]].text, delimiter)[of_time][1]
        at, text = cells[of_time]
        fault = f"time {text} is not after {before} of the row before"
        raise SignalError(f"{path}:{line.number}:{at}: {fault}; times that rise are expected")
    if len(times) < 2:
        raise SignalError(f"{path}:{rows[0].number}:1: one row of numbers; two at least are expected")
    return [
        Channel(name, times, table[:, k] * si_size(unit := units.get(name, own)), unit)
        for k, (name, own, _) in enumerate(names)
        if k != of_time
    ]


def _cells(text: str, delimiter: str) -> list[tuple[int, str]]:
    """Columns (from 1) and texts of the cells of a line, without quotes and blanks about them."""
    if delimiter == " ":
        return [(cell.start() + 1, cell[0].strip('"')) for cell in re.finditer(r'"[^"]*"|[^ ]+', text)]
    if '"' not in text:
        at, cells = 1, []
        for cell in text.split(delimiter):
            cells.append((at + len(cell) - len(cell.lstrip()), cell.strip()))
            at += len(cell) + 1
        return cells
    parts = re.findall(rf'(?:"(?:[^"]|"")*"|[^"{delimiter}]+|")*(?:{delimiter}|$)', text)
    at, cells = 1, []
    for part, cell in zip(parts, next(csv.reader([text], delimiter=delimiter, skipinitialspace=True)), strict=False):
        cells.append((at, cell.strip()))
        at += len(part)
    return cells


def _filled(text: str, delimiter: str) -> int:
    """Number of cells of a line, a delimiter at its end aside."""
    cells = _cells(text, delimiter)
    return len(cells) - (not cells[-1][1])


def _start(path: Path, lines: list[_Line]) -> tuple[str, int]:
    """Delimiter, and index of the first line of two or more numbers."""
    for k, line in enumerate(lines):
        if line.text.lstrip().startswith(COMMENTS):
            continue
        for delimiter in DELIMITERS:
            cells = [text for _, text in _cells(line.text, delimiter)]
            numbers = sum(_NUMBER.fullmatch(text) is not None for text in cells)
            if len(cells) > 1 and numbers and all(_NUMBER.fullmatch(text) or text.lower() in _MISSING for text in cells):
                return delimiter, k
    apart = f"apart by {', '.join(list(DELIMITERS.values())[:-1])} or {list(DELIMITERS.values())[-1]}"
    raise SignalError(f"{path}: no row of numbers; below a header a time and a value at least in each line are expected, {apart}")


def _header(path: Path, lines: list[_Line], count: int, delimiter: str, time: str | None) -> list[_Name]:
    """Names and units of the columns, from the line above the numbers, or from that above a row of units."""
    found = [_names(line, count, delimiter) for line in reversed(lines)]
    place = f"{path}:{lines[-1].number}" if lines else f"{path}:1"
    if found and len(found[0]) > count and not found[0][-1][1]:  # but a name above a last cell without a value counts
        found = [cells[:-1] if len(cells) > count and not cells[-1][1] else cells for cells in found]
    if not found or len(found[0]) not in (count, count + 1):
        fault = f"{len(found[0])} names above rows of {count} cells" if found else "no header"
        raise SignalError(f"{place}:1: {fault}; a line with a name for each column is expected, as 'time [s]', above the numbers")
    names, unit_row = found[0], None
    if len(found) > 1 and len(found[1]) == len(names) and not any(_NUMBER.fullmatch(text) for _, text in found[1]):
        above = [text for _, text in found[1]]
        clock = above.index(time) if time in above else 0
        if _is_time(_bare(names[clock][1])):
            names, unit_row, place = found[1], [_bare(text) for _, text in names], f"{path}:{lines[-2].number}"
    header: list[_Name] = []
    for k, (at, text) in enumerate(names):
        name, unit = (text, unit_row[k]) if unit_row else _parted(text)
        if not name:
            raise SignalError(f"{place}:{at}: column {k + 1} has no name; a name for each column is expected")
        if name in [each.name for each in header]:
            raise SignalError(f"{place}:{at}: a second column '{name}'; names that differ are expected")
        header.append(_Name(name, unit, f"{place}:{at}"))
    return header


def _names(line: _Line, count: int, delimiter: str) -> list[tuple[int, str]]:
    """Cells of a header, of a comment without its mark; of names apart by spaces a unit in brackets belongs to its name."""
    text = line.text
    bare = text.lstrip()
    for mark in COMMENTS:
        bare = bare.removeprefix(mark)
    moved = len(text) - len(bare)
    cells = _cells(bare, delimiter)
    if delimiter == " " and len(cells) != count:
        for form in (r"\S+( \S+)*", r'("[^"]*"|[^\s\[(]+)( *(\[[^\]]*\]|\([^)]*\)))?'):  # two spaces between names; or one
            cells = [(cell.start() + 1, cell[0].replace('"', "")) for cell in re.finditer(form, bare)]
            if len(cells) == count:
                break
    return [(at + moved, text) for at, text in cells]


def _parted(text: str) -> tuple[str, str]:
    """Name and unit of `acc z [g]`, `acc_z (m/s^2)` or `p / kPa`; what is in round brackets or behind a stroke may be none."""
    match = _UNIT.fullmatch(text)
    if match is None:
        return text, ""
    unit = match["square"] if match["square"] is not None else match["round"] if match["round"] is not None else match["over"]
    unit = unit.strip()
    return (match["name"], unit) if match["square"] is not None or is_unit(unit) else (text, "")


def _bare(text: str) -> str:
    """A unit without its brackets, empty where a dash says that there is none."""
    text = text[1:-1].strip() if text[:1] + text[-1:] in ("[]", "()") else text
    return "" if text in ("-", "--") else text


def _is_time(unit: str) -> bool:
    try:
        return bool(unit) and second_size(unit) > 0.0
    except ValueError:
        return False


def _numbers(path: Path, rows: list[_Line], names: list[str], delimiter: str) -> Floats:
    """Numbers of all rows, (rows, columns)."""
    if delimiter == ",":  # in quotes alone
        comma = any("," in text for row in rows if '"' in row.text for _, text in _cells(row.text, delimiter))
    else:
        comma = any("," in row.text for row in rows)
    table = _plain_numbers(rows, len(names), delimiter, comma)
    if table is None:
        table = _numbers_or_fault(path, rows, names, delimiter, comma)
    marked = (text for row in rows for _, text in _cells(row.text, delimiter) if "," in text)
    if comma and all(_THOUSANDS.fullmatch(text) for text in marked):
        place = next(f"{row.number}:{row.text.index(',') + 1}" for row in rows if "," in row.text)
        expected = "numbers without a mark of thousands, or one comma with other than three digits behind it, are expected"
        raise SignalError(f"{path}:{place}: each comma may mark decimals or thousands; {expected}")
    return table


def _plain_numbers(rows: list[_Line], count: int, delimiter: str, comma: bool) -> Floats | None:
    """As `_numbers`, quickly; None where a cell is quoted or is no number."""
    apart = None if delimiter == " " else delimiter
    odd = re.compile(r"[^-+.,0-9eE;\t ]" + (r"|\." if comma else ""))
    try:
        if any(odd.search(row.text) for row in rows):
            return None
        texts = (row.text.replace(",", ".") if comma else row.text for row in rows)
        table = np.array([list(map(float, text.split(apart))) for text in texts])
    except ValueError:
        return None
    return table if table.shape == (len(rows), count) and np.isfinite(table).all() else None


def _numbers_or_fault(path: Path, rows: list[_Line], names: list[str], delimiter: str, comma: bool) -> Floats:
    """As `_numbers`, cell by cell."""
    table = np.empty((len(rows), len(names)))
    for k, row in enumerate(rows):
        cells = _cells(row.text, delimiter)
        if len(cells) == len(names) + 1 and not cells[-1][1]:  # a delimiter at the end
            cells = cells[:-1]
        if len(cells) != len(names):
            fault = f"a row of {len(cells)}, {len(names)} in the header"
            raise SignalError(f"{path}:{row.number}:1: {fault}; a number below each name is expected")
        for j, (at, text) in enumerate(cells):
            if _NUMBER.fullmatch(text) is None or (comma and "." in text):
                raise SignalError(f"{path}:{row.number}:{at}: '{names[j]}': {_fault(text, comma)}")
            table[k, j] = float(text.replace(",", "."))
            if not np.isfinite(table[k, j]):
                raise SignalError(f"{path}:{row.number}:{at}: '{names[j]}': {text} is not finite; a finite number is expected")
    return table


def _fault(text: str, comma: bool) -> str:
    """Say what a cell lacks."""
    if text.lower() in _MISSING:
        return f"{f'no value, {text!r}' if text else 'no value'}; a number in each cell is expected"
    if comma and "." in text:
        return f"'{text}' has a point, others have commas; one decimal mark and none of thousands is expected"
    return f"'{text}' is no number; one as 1.5e-3 is expected"
