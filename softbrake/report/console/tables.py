"""The plain console, and columns without lines that fit it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

PIPE = 10_000  # columns of a console that is a pipe or a file, where tables of many columns are not to fit a screen


class Column(NamedTuple):
    """A column of a table: its head, on which side it is flush, whether cells break between words.

    width: least with room to spare; least: without.
    """

    head: str = ""
    right: bool = True
    breaks: bool = False
    width: int = 0
    least: int = 0


QUANTITIES = (
    Column(right=False, breaks=True, width=24),
    Column(width=10),
    Column(right=False, width=6),
    Column("notes", False, True, least=16),
)


def plain(*, wide: bool = False) -> Console:
    """A console that takes texts as they are; `wide` off a terminal, unless the environment has a width."""
    console = Console(highlight=False, markup=False, emoji=False)
    if wide and not console.is_terminal and "COLUMNS" not in os.environ:
        console.width = PIPE
    return console


def print_quantities(console: Console, *tables: Sequence[Sequence[str]]) -> None:
    """Print tables of name, value, unit and note, blank lines between; without notes where there is no room for them."""
    rows = [row for table in tables for row in ((), *table)][1:]
    filled = [(*row, "", "", "", "")[: len(QUANTITIES)] for row in rows]
    print_columns(console, QUANTITIES, filled, gap=1, headed=False)


def print_columns(
    console: Console,
    columns: Sequence[Column],
    rows: Sequence[Sequence[str]],
    *,
    gap: int = 2,
    order: Sequence[int] | None = None,
    headed: bool = True,
) -> None:
    """Print rows of texts in columns. No number is cut: columns without room are left out, and named.

    gap: spaces between columns; order: indices of columns, the ones to keep first, by default as they stand; headed: whether
    heads stand above.
    """
    shown = [[column.head for column in columns], *rows] if headed else rows
    cells = [[row[k] for row in shown] for k in range(len(columns))]
    lines = [max((len(line) for cell in each for line in cell.split("\n")), default=0) for each in cells]
    words = [max((len(word) for cell in each for word in cell.split()), default=0) for each in cells]
    needed = [max(words[k] if column.breaks else lines[k], column.least) for k, column in enumerate(columns)]
    room, kept = console.width + gap, []
    for k in order or range(len(columns)):
        if needed[k] + gap <= room:
            kept.append(k)
            room -= needed[k] + gap
    kept.sort()
    table = Table.grid(padding=(0, gap, 0, 0))
    for k in kept:
        width = min(max(lines[k], columns[k].width, needed[k]), needed[k] + room)
        room -= width - needed[k]
        table.add_column(width=width, justify="right" if columns[k].right else "left", overflow="fold")
    for row in shown:
        table.add_row(*(row[k] for k in kept))
    console.print(table)
    if lost := [" ".join(column.head.split()) for k, column in enumerate(columns) if k not in kept]:
        console.print(f"left out, for want of room: {', '.join(lost)}")
