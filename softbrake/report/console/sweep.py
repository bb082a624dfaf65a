"""The runs of a sweep."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from softbrake.report.console.tables import plain
from softbrake.report.results_csv import PEAKS, RESULTS, Row, failures
from softbrake.report.words import STANDARD_GRAVITY
from softbrake.studies.sweep import Plan

MOST_LINES = 24


def print_table(plan: Plan, table: Sequence[Row], console: Console | None = None) -> None:
    """Print axes and answers, of many runs some that are evenly spaced, and all failures."""
    console = console or plain()
    lines = Table(box=None, padding=(0, 2, 0, 0), show_edge=False, header_style="")
    for axis in plan.axes:
        lines.add_column(f"{axis.path}\n{axis.unit}", justify="right")
    for head in ("outcome\n", "impact\nm/s", "peak\ng", "T11\nkN/m", "T22\nkN/m", "belt\nkN/m"):
        lines.add_column(head, justify="left" if head == "outcome\n" else "right")
    shown = range(len(table))
    if len(table) > MOST_LINES:
        shown = sorted({round(k * (len(table) - 1) / (MOST_LINES - 1)) for k in range(MOST_LINES)})  # type: ignore[assignment]
    for number in shown:
        row = table[number]
        values = [row[axis.path] for axis in plan.axes]
        lines.add_row(*(f"{v:.6g}" if isinstance(v, float) else str(v) for v in values), *_answers(row))
    console.print(lines)
    if len(shown) < len(table):
        console.print(f"{len(shown)} of {len(table)} runs; all are in {RESULTS}")
    faults = failures(table)
    if faults:
        console.print(f"\n{len(faults)} of {len(table)} runs have no answer:")
        for fault in faults[:MOST_LINES]:
            console.print(fault, soft_wrap=True)
        if len(faults) > MOST_LINES:
            console.print(f"... and {len(faults) - MOST_LINES} more, in {RESULTS}")


def _answers(row: Row) -> list[str]:
    if row["fault"]:
        return [row["outcome"], *["–"] * 5]
    impact = row["impact_velocity"]
    tensions = [row[peak] for peak in PEAKS[1:]]
    return [
        row["outcome"],
        "–" if impact is None else f"{impact:.4f}",
        f"{row['peak_deceleration'] / STANDARD_GRAVITY:.2f}",
        *("–" if tension is None else f"{tension / 1e3:.3f}" for tension in tensions),
    ]
