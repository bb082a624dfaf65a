"""The plain console, and tables of 80 columns without lines."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table


def plain() -> Console:
    """A console that takes texts as they are."""
    return Console(highlight=False, markup=False, emoji=False)


def quantities() -> Table:
    """A table of name, value, unit and note."""
    table = Table.grid(padding=(0, 1, 0, 0))
    table.add_column(width=24)
    table.add_column(justify="right", width=10)
    table.add_column(width=6)
    table.add_column(overflow="fold")
    return table
