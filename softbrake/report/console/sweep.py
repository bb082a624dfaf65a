"""The runs of a sweep."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console

from softbrake.case.units import STANDARD_GRAVITY
from softbrake.report.console.tables import Column, plain, print_columns
from softbrake.report.results_csv import PEAKS, Row, failures
from softbrake.report.words import TENSIONS
from softbrake.studies.sweep import RESULTS, Plan

MOST_LINES = 24
ANSWERS = (
    Column("outcome", right=False),
    *map(Column, ("impact\n\nm/s", "peak\n1 kHz\ng", *(f"tension\n{part}\nkN/m" for part in TENSIONS))),
)


def print_table(plan: Plan, table: Sequence[Row], console: Console | None = None) -> None:
    """Print axes and answers, of many runs some that are evenly spaced, and all failures."""
    console = console or plain(wide=True)
    shown = range(len(table))
    if len(table) > MOST_LINES:
        shown = sorted({round(k * (len(table) - 1) / (MOST_LINES - 1)) for k in range(MOST_LINES)})  # type: ignore[assignment]
    held = "pass" in table[0]
    answers = (*ANSWERS, Column("limits", right=False)) if held else ANSWERS
    axes = [Column(f"{axis.path}\n\n{axis.shown}") for axis in plan.axes]
    lines = [[*(axis.written(table[k][axis.path]) for axis in plan.axes), *_answers(table[k], held)] for k in shown]
    outcome, impact, *others = range(len(axes), len(axes) + len(answers))
    first, *rest = range(len(axes))
    order = [first, impact, outcome, *rest, *others]
    print_columns(console, [*axes, *answers], lines, order=order)
    if len(shown) < len(table):
        console.print(f"{len(shown)} of {len(table)} runs are shown; {RESULTS} is for all")
    faults = failures(table)
    if faults:
        console.print(f"\n{len(faults)} of {len(table)} runs have no answer:")
        for fault in faults[:MOST_LINES]:
            console.print(fault, soft_wrap=True)
        if len(faults) > MOST_LINES:
            console.print(f"... and {len(faults) - MOST_LINES} more, in {RESULTS}")


def _answers(row: Row, held: bool) -> list[str]:
    verdict = ["pass" if row["pass"] else "MISSED"] if held else []
    if row["fault"]:
        return [row["outcome"], *["–"] * 5, *verdict]
    impact = row["impact_velocity"]
    tensions = [row[peak] for peak in PEAKS[1:]]
    return [
        row["outcome"],
        "–" if impact is None else f"{impact:.4f}",
        f"{row['peak_deceleration'] / STANDARD_GRAVITY:.2f}",
        *("–" if tension is None else f"{tension / 1e3:.3f}" for tension in tensions),
        *verdict,
    ]
