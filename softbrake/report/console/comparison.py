"""A drop beside a test."""

from __future__ import annotations

from rich.console import Console

from softbrake.report.comparison_rows import comparison_rows, heading_lines, rating_rows
from softbrake.report.console.tables import Column, plain, print_columns
from softbrake.studies.comparison import Comparison

MARKS = (Column(right=False, least=12), Column("test"), Column("drop"), Column("drop less\ntest"), Column("", right=False))
PARTS = ("overall", "corridor", "phase", "magnitude", "slope")


def print_comparison(found: Comparison, console: Console | None = None) -> None:
    """Print shift, interval, marks of each quantity and the ratings."""
    console = console or plain()
    for line in heading_lines(found):
        console.print(line)
    for each in found.quantities:
        console.print(f"\n{each.quantity}: '{each.channel}'", style="bold", soft_wrap=True)
        print_columns(console, MARKS, comparison_rows(each))
    console.print("\nISO/TS 18571, test as the reference", style="bold")
    print_columns(console, [Column(right=False), *map(Column, PARTS)], rating_rows(found))
    for each in found.quantities:
        if each.unrated is not None:
            console.print(f"{each.quantity}: no rating, {each.unrated}", soft_wrap=True)
