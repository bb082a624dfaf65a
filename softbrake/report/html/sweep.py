"""The page on one sweep: answers over its axes, runs, and the case of the first."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from contextlib import suppress
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from softbrake.case.units import STANDARD_GRAVITY
from softbrake.report.html.case import case_table
from softbrake.report.html.frame import figures, page, table
from softbrake.report.plots.chance import sampled
from softbrake.report.plots.page import map_chart, sample_charts, sweep_chart
from softbrake.report.plots.sweep import Scale, spread
from softbrake.report.results_csv import UNITS, chance_in, numbers
from softbrake.report.words import TENSIONS, chance_tables, stops
from softbrake.sim.result_file import ResultError
from softbrake.studies.axes import Axis
from softbrake.studies.chance import Chance
from softbrake.studies.sampling import Sampling
from softbrake.studies.sweep import RESULTS

MOST_DOTS_ON_CURVE = 40


class Answer(NamedTuple):
    """A column of a sweep and how it is shown."""

    column: str
    title: str
    unit: str
    scale: float  # of the SI value


DRAWN = (
    Answer("impact_velocity", "impact velocity", "m/s", 1.0),
    Answer("peak_deceleration", "peak deceleration, 1 kHz", "g", 1 / STANDARD_GRAVITY),
    *(Answer(f"peak_tension_{tension}", f"peak tension, {tension}", "kN/m", 1e-3) for tension in TENSIONS),
    Answer("fabric_margin", "margin, fabric", "%", 100.0),
    Answer("belt_margin", "margin, belts", "%", 100.0),
    Answer("lowest_height", "lowest height", "m", 1.0),
    Answer("rebound_velocity", "rebound velocity", "m/s", 1.0),
    Answer("peak_pressure", "peak pressure, gauge", "kPa", 1e-3),
    Answer("peak_temperature", "peak temperature", "K", 1.0),
    Answer("vented_mass", "vented mass", "kg", 1.0),
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
        paths = names[names.index("id") + 1 : names.index("outcome")]
        kept = {axis[0]: Axis(*axis) for axis in plan.get("axes", ())}
        axes = [kept.get(path, Axis(path, units[path])) for path in paths]
        failed = [row for row in rows if row["fault"]]
    except OSError as error:
        raise ResultError(f"{error.filename}: {error.strerror}; the folder of a finished sweep is expected") from error
    except (ValueError, KeyError, IndexError, StopIteration, TypeError) as error:
        raise ResultError(f"{folder}: not the results of a sweep, or incomplete ones") from error
    parts = [f"<h1>{escape(title)}</h1>", f"<p>{len(rows)} runs over {escape(', '.join(paths))}</p>"]
    if failed:
        parts.append(f"<p><b>{len(failed)} of them have no answer.</b></p>")
    if "pass" in names:
        kept = sum(row["pass"] == "1" for row in rows)
        bounds = "; ".join(f"{name.replace('_', ' ')} {bound}" for name, bound in case["limits"].items())
        parts.append(f"<p>{kept} of {len(rows)} runs keep all limits: {escape(bounds)}</p>")
    if plan.get("sampling") is not None:
        parts += _chance(chance_in(Sampling(*plan["sampling"]), case, rows), axes, case, rows)
    elif charts := _charts(rows, axes):
        parts += ["<h2>Answers</h2>", charts]
    parts += ["<h2>Runs</h2>", _runs(rows, axes)]
    if failed:
        parts += ["<h2>Runs without an answer</h2>", table(("run", "why"), [(row["run"], row["fault"]) for row in failed])]
    parts += ["<h2>Case</h2>", "<p>Of the first run.</p>", case_table(case)]
    return page(title, parts, folder.name)


def _chance(chance: Chance, axes: Sequence[Axis], case: dict[str, Any], rows: Sequence[dict[str, str]]) -> list[str]:
    """What a sample says, and its pictures: of each answer the distribution, indices, and a scatter over what matters."""
    parts = []
    for title, head, lines in chance_tables(chance, case):
        parts += [f"<h2>{escape(title)}</h2>", table(head, lines, len(head) - 1)]
    drawn = sampled(chance, axes, case, rows)
    return [*parts, "<h2>How answers vary</h2>", figures("charts", [figure for one in drawn for figure in sample_charts(one)])]


def _charts(rows: Sequence[dict[str, str]], axes: Sequence[Axis]) -> str:
    """Answers over one axis as curves, over the plane of two as maps, else a dot a run over each; empty without numbers."""
    scales = []
    for axis in axes:
        with suppress(ValueError):  # words
            scales.append(Scale(axis, [float(row[axis.path]) for row in rows]))
    columns = [(one, numbers(rows, one.column, one.scale)) for one in DRAWN]
    columns = [(one, values) for one, values in columns if np.isfinite(values).any()]
    if len(scales) == len(axes) == 2 and spread(scales):
        drawn = [map_chart(one.title[0].upper() + one.title[1:], one.unit, scales, values) for one, values in columns]
    else:
        alone = len(axes) == 1
        dots = not alone or len(rows) <= MOST_DOTS_ON_CURVE
        drawn = [
            sweep_chart(one.title[0].upper() + one.title[1:], one.unit, scale.label, scale.at, values, alone, dots, scale.log)
            for scale in scales
            for one, values in columns
        ]
    if not drawn:
        return ""
    note = '<p class="note">Impact velocity 0: the cargo stops above the ground, or rebounds.</p>'
    stopping = any(stops(row["outcome"], row.get("rest_time")) for row in rows)
    return figures("charts", drawn) + (note if stopping else "")


def _runs(rows: Sequence[dict[str, str]], axes: Sequence[Axis]) -> str:
    shown = [answer for answer in DRAWN if np.isfinite(numbers(rows, answer.column, 1.0)).any()]
    names = [f"{axis.path}, {axis.shown}" if axis.shown else axis.path for axis in axes]
    head = ["run", "outcome", *names, *(f"{one.title}, {one.unit}" for one in shown)]
    lines = []
    for row in rows:
        cells = [axis.written(_number(row[axis.path])) for axis in axes]
        for one in shown:
            value = float(row[one.column]) * one.scale if row.get(one.column) and not row["fault"] else math.nan
            cells.append(f"{value:.4g}" if math.isfinite(value) else "–")
        lines.append([row["run"], row["outcome"].replace("_", " "), *cells])
    return table(head, lines, len(head) - 2)


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
