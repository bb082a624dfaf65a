"""The static inflation."""

from __future__ import annotations

from softbrake.report.console.tables import plain, print_quantities
from softbrake.report.words import inflated_in_words, inflation_rows
from softbrake.sim.summary import Inflation


def print_inflation(inflation: Inflation) -> None:
    """Print the static inflation in at most 80 columns."""
    console = plain()
    console.print(inflation.title, style="bold", soft_wrap=True)
    console.print(inflated_in_words(inflation))
    console.print()
    print_quantities(console, inflation_rows(inflation))
    if inflation.results and inflation.results_fault is None:
        console.print(f"\nresults in {inflation.results}", soft_wrap=True)
