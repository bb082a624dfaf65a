"""The page on a static inflation: answers, tensions along the wall, shape and the case."""

from __future__ import annotations

from html import escape
from pathlib import Path

from softbrake.report.html.case import case_table
from softbrake.report.html.frame import Card, answers, figures, page
from softbrake.report.plots.page import shapes, wall_charts
from softbrake.report.words import inflated_in_words, inflation_rows
from softbrake.sim.result_file import read_case, read_snapshots
from softbrake.sim.summary import Inflation


def inflation_page(path: Path | str, inflation: Inflation) -> str:
    """The page on the result file of an inflation. Raises ResultError and PlotError."""
    case, shots = read_case(path), read_snapshots(path, "tension_generatrix", "tension_hoop")
    cuts = shapes(case, shots, 1)
    cuts[0].set_label("At rest")
    cards = [Card(name, f"{value} {unit}", [note]) for name, value, unit, note in inflation_rows(inflation)]
    belts = ", dots are belts" if case["belts"] else ""
    parts = [
        f"<h1>{escape(inflation.title)}</h1>",
        f"<p>{escape(inflated_in_words(inflation))}</p>",
        answers(cards),
        "<h2>Along the wall</h2>",
        figures("charts", wall_charts(case, shots)),
        "<h2>Shape</h2>",
        figures("shapes", cuts),
        f'<p class="note">Cut through the axis{belts}.</p>',
        "<h2>Case</h2>",
        case_table(case),
    ]
    return page(inflation.title, parts, Path(path).name)
