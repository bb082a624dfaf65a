"""What a sample says: chances of limits, quantiles, Sobol' indices, means with a control."""

from __future__ import annotations

from rich.console import Console

from softbrake.report.console.tables import Column, plain, print_columns
from softbrake.report.words import chance_tables
from softbrake.studies.chance import Chance
from softbrake.studies.sweep import Plan


def print_chance(plan: Plan, chance: Chance, console: Console | None = None) -> None:
    """Print tables of names and numbers, each below its title."""
    console = console or plain(wide=True)
    for title, head, rows in chance_tables(chance, plan.case):
        console.print()
        console.print(title, style="bold", soft_wrap=True)
        print_columns(console, [Column(head[0], False), *map(Column, head[1:])], rows)
