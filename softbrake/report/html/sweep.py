"""The page on one sweep: answers over its axes, runs, and the case of the first."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softbrake.report.html.case import case_table
from softbrake.report.html.frame import figures, page, table
from softbrake.report.plots.page import sweep_chart
from softbrake.report.results_csv import RESULTS, UNITS
from softbrake.report.words import STANDARD_GRAVITY, TENSIONS
from softbrake.sim.result_file import ResultError


class Answer(NamedTuple):
    """A column of a sweep and how it is shown."""

    column: str
    title: str
    unit: str
    scale: float  # of the SI value


ANSWERS = (
    Answer("impact_velocity", "impact velocity", "m/s", 1.0),
    Answer("peak_deceleration", "peak deceleration", "g", 1 / STANDARD_GRAVITY),
    *(Answer(f"peak_tension_{tension}", f"peak tension, {tension}", "kN/m", 1e-3) for tension in TENSIONS),
    Answer("fabric_margin", "margin, fabric", "%", 100.0),
    Answer("belt_margin", "margin, belts", "%", 100.0),
    Answer("minimum_height", "lowest height", "m", 1.0),
)


def sweep_page(folder: Path | str) -> str:
    """The page on the folder of a sweep: its plan.json and results.csv. Raises ResultError and PlotError."""
    folder = Path(folder)
    try:
        plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
        title, case = plan["title"], plan["case"]
        with open(folder / RESULTS, encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        with open(folder / UNITS, encoding="utf-8", newline="") as file:
            units = next(csv.DictReader(file))
        names = list(rows[0])
        axes = names[names.index("id") + 1 : names.index("outcome")]
        failed = [row for row in rows if row["fault"]]
    except OSError as error:
        raise ResultError(f"{error.filename}: {error.strerror}; the folder of a finished sweep is expected") from error
    except (ValueError, KeyError, IndexError, StopIteration) as error:
        raise ResultError(f"{folder}: not the results of a sweep, or incomplete ones") from error
    parts = [f"<h1>{escape(title)}</h1>", f"<p>{len(rows)} runs over {escape(', '.join(axes))}</p>"]
    if failed:
        parts.append(f"<p><b>{len(failed)} of them have no answer.</b></p>")
    if charts := _charts(rows, axes, units):
        parts += ["<h2>Answers</h2>", charts]
    parts += ["<h2>Runs</h2>", _runs(rows, axes, units)]
    if failed:
        parts += ["<h2>Runs without an answer</h2>", table(("run", "why"), [(row["run"], row["fault"]) for row in failed])]
    parts += ["<h2>Case</h2>", "<p>Of the first run.</p>", case_table(case)]
    return page(title, parts, folder.name)


def _column(rows: Sequence[dict[str, str]], name: str, scale: float) -> NDArray[Any]:
    """Numbers of a column, NaN where there are none. A cargo that stops above the ground has the impact velocity 0."""

    def number(row: dict[str, str]) -> float:
        if row["fault"]:
            return math.nan
        if name == "impact_velocity" and row["outcome"] == "stopped":
            return 0.0
        return float(row.get(name) or math.nan)

    return scale * np.array([number(row) for row in rows])


def _charts(rows: Sequence[dict[str, str]], axes: Sequence[str], units: dict[str, str]) -> str:
    """Answers over each axis of numbers, a curve where it is the only one, else a dot a run; empty without such an axis."""
    drawn = []
    for axis in axes:
        try:
            x = np.array([float(row[axis]) for row in rows])
        except ValueError:  # words
            continue
        unit = units[axis]
        if unit in ("Pa", "N/m", "N") and np.abs(x).max() >= 1e3:
            x, unit = 1e-3 * x, f"k{unit}"
        label = f"{axis}, {unit}" if unit else axis
        for answer in ANSWERS:
            y = _column(rows, answer.column, answer.scale)
            if np.isfinite(y).any():
                alone = len(axes) == 1
                drawn.append(sweep_chart(answer.title.capitalize(), answer.unit, label, x, y, alone, not alone or len(x) <= 40))
    if not drawn:  # words only
        return ""
    note = '<p class="note">Impact velocity 0: the cargo stops above the ground.</p>'
    stops = any(row["outcome"] == "stopped" for row in rows)
    return figures("charts", drawn) + (note if stops else "")


def _runs(rows: Sequence[dict[str, str]], axes: Sequence[str], units: dict[str, str]) -> str:
    shown = [answer for answer in ANSWERS if np.isfinite(_column(rows, answer.column, 1.0)).any()]
    head = ["run", "outcome", *(f"{axis} {units[axis]}".strip() for axis in axes), *(f"{one.title}, {one.unit}" for one in shown)]
    lines = []
    for row in rows:
        cells = [_short_number(row[axis]) for axis in axes]
        for one in shown:
            value = float(row[one.column]) * one.scale if row.get(one.column) and not row["fault"] else math.nan
            cells.append(f"{value:.4g}" if math.isfinite(value) else "–")
        lines.append([row["run"], row["outcome"].replace("_", " "), *cells])
    return table(head, lines, len(head) - 2)


def _short_number(text: str) -> str:
    try:
        return f"{float(text):.6g}"
    except ValueError:
        return text
