"""What a sweep found: results.csv with its units, a table for the console, and a picture."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from softbrake.report.console import STANDARD_GRAVITY
from softbrake.report.plots.style import BLUE, GREEN, GREY, INK, ORANGE, RED, STYLE, PlotError, load_matplotlib, save
from softbrake.studies.axes import Axis
from softbrake.studies.sweep import Plan, Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RESULTS, UNITS, PICTURE = "results.csv", "results.units.csv", "sweep.png"
PEAKS = ("peak_deceleration", "peak_tension_generatrix", "peak_tension_hoop", "peak_tension_belt")
TIMINGS = ("kernel_seconds", "wall_seconds")  # the last columns: all that two runs of one sweep may differ in
LEFT_OUT = ("title", "results", "trials", "sensitivity", "filtered")
MOST_LINES = 24
MISSING = "not run, or lost with its worker"
MOST_AXES = 6  # of a scatter matrix
MOST_DOTS = 1000  # over contours
COLOURS = (BLUE, ORANGE, GREEN, RED, GREY, INK)
Row = dict[str, Any]

# By how the name of a column ends; what stands in none is a number without unit, or a word.
ENDINGS = {
    "_time": "s",
    "_seconds": "s",
    "_step": "s",
    "_height": "m",
    "_velocity": "m/s",
    "_reduction": "m/s",
    "deceleration": "m/s^2",
    "tension_generatrix": "N/m",
    "tension_hoop": "N/m",
    "tension_belt": "N/m",
}


def rows(plan: Plan, records: Mapping[str, Record]) -> list[Row]:
    """A row for each run of a plan: its number and id, the axes, outcome and fault, and all fields of its summary."""
    table = []
    for number, run in enumerate(plan.runs, 1):
        record = records.get(run.id, {"summary": None, "fault": MISSING})
        summary = record["summary"] or {}
        outcome = summary.get("outcome") or ("failed" if run.id in records else "missing")
        row = {"run": number, "id": run.id} | {axis.path: value for axis, value in zip(plan.axes, run.values, strict=True)}
        table.append(row | {"outcome": outcome, "fault": record["fault"]} | _flat(summary))
    names = list(dict.fromkeys(name for row in table for name in row if name not in TIMINGS))
    return [{name: row.get(name) for name in (*names, *TIMINGS)} for row in table]


def _flat(summary: Mapping[str, Any]) -> Row:
    """Fields of a summary, those of its parts with the part's name in front."""
    flat: Row = {}
    for name, value in summary.items():
        if name == "peaks":
            for peak, found in value.items():
                flat |= {f"{peak}_{part}": found[part] for part in ("time", "height", "phase")}
                flat[f"{peak}_other"] = None if found["other"] is None else found["other"]["value"]
        elif name == "peak_errors":
            flat |= {f"{peak}_error": error for peak, error in (value or {}).items()}
        elif isinstance(value, dict):
            flat |= {f"{name}_{part}": member for part, member in value.items()}
        elif name not in LEFT_OUT:
            flat[name] = value
    return flat


def unit_of(column: str, plan: Plan) -> str:
    """SI unit of a column of the results; empty for numbers without one and words."""
    for axis in plan.axes:
        if axis.path == column:
            return axis.unit
    if column.startswith("work_"):
        return "J"
    quantity = column.removesuffix("_error").removesuffix("_other") if column != "energy_error" else column
    return next((unit for ending, unit in ENDINGS.items() if quantity.endswith(ending)), "")


def write_results(folder: Path, plan: Plan, table: Sequence[Row]) -> None:
    """Write results.csv, and results.units.csv with the same header and the units below it."""
    names = list(table[0])
    for file, lines in ((RESULTS, [row.values() for row in table]), (UNITS, [[unit_of(name, plan) for name in names]])):
        draft = folder / f".{file}"
        with open(draft, "w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(names)
            writer.writerows(lines)
        draft.replace(folder / file)


def failures(table: Sequence[Row]) -> list[str]:
    """A line for each run without an answer: its number, the values of its axes and the reason."""
    return [f"run {row['run']}: {row['fault']}" for row in table if row["fault"]]


def doubtful(table: Sequence[Row]) -> list[Row]:
    """Runs that came to their end though something made energy of nothing."""
    return [row for row in table if not row["fault"] and row["doubt"]]


def print_table(plan: Plan, table: Sequence[Row], console: Console | None = None) -> None:
    """Print axes and answers, of many runs some that are evenly spaced, and all failures."""
    console = console or Console(highlight=False, markup=False, emoji=False)
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


def draw_sweep(plan: Plan, table: Sequence[Row], picture: Path) -> None:
    """Draw the answers over the axes: curves over one axis, contours over two, a scatter matrix beyond. Raises PlotError."""
    if not plan.axes:
        raise PlotError("no picture: the sweep has no axis")
    mpl = load_matplotlib()
    scales = [_Scale(axis, [row[axis.path] for row in table]) for axis in plan.axes]
    words, numbers = ([scale for scale in scales if bool(scale.words) == wanted] for wanted in (True, False))
    with mpl.rc_context(STYLE):
        if len(scales) == 1:
            figure = _curves(mpl, scales[0], table)
        elif len(words) == len(numbers) == 1:
            figure = _curves(mpl, numbers[0], table, words[0])
        elif len(numbers) == len(scales) == 2 and _spread(scales, table):
            figure = _contours(mpl, scales, table)
        else:
            figure = _scatter_matrix(mpl, scales[:MOST_AXES], table)
        figure.suptitle(plan.title, fontsize=12, parse_math=False)
        save(figure, picture)


class _Scale:
    """Where the values of an axis stand in a picture: numbers in a readable unit, words side by side."""

    def __init__(self, axis: Axis, values: Sequence[float | str]) -> None:
        path, unit, self.log = axis
        self.words = [] if all(isinstance(value, (int, float)) for value in values) else list(dict.fromkeys(map(str, values)))
        if self.words:
            self.at: NDArray[Any] = np.array([self.words.index(str(value)) for value in values], float)
            self.label = path
            return
        numbers = np.array(values, float)
        factor, prefix = 1.0, ""
        if unit[:2] in ("N/", "Pa", "N") and np.abs(numbers).max() >= 1e3:
            factor, prefix = 1e-3, "k"
        elif unit == "m" and np.abs(numbers).max() < 0.1:
            factor, prefix = 1e3, "m"
        self.at = numbers * factor
        self.label = f"{path}, {prefix}{unit}" if unit else path

    def along(self, axes: Axes, which: str) -> None:
        axes.set(**{f"{which}label": self.label})
        if self.log:
            axes.set(**{f"{which}scale": "log"})
        if self.words:
            axes.set(**{f"{which}ticks": range(len(self.words)), f"{which}ticklabels": self.words})


def _column(table: Sequence[Row], name: str, unit: float = 1.0) -> NDArray[Any]:
    """An answer of each run, NaN where there is none; the impact velocity of a cargo that stops above the ground is zero."""
    zero = {"stopped"} if name == "impact_velocity" else set()
    values = [None if row["fault"] else 0.0 if row["outcome"] in zero else row.get(name) for row in table]
    return np.array([np.nan if value is None else value * unit for value in values], float)


def _curves(mpl: Any, scale: _Scale, table: Sequence[Row], words: _Scale | None = None) -> Figure:
    """Answers over one axis; with words beside it a line for each, and the hoop's tension for all three."""
    figure: Figure = mpl.figure.Figure(figsize=(7.4, 7.6), layout="constrained")
    panels: Any = figure.subplots(3, 1, sharex=True)
    for panel, title, unit in zip(
        panels,
        ("Impact velocity", "Peak deceleration", "Peak tensions" if words is None else "Peak tension, hoop"),
        ("m/s", "g", "kN/m"),
        strict=True,
    ):
        panel.set(title=title, ylabel=unit)
    impact, braking = _column(table, "impact_velocity"), _column(table, PEAKS[0], 1.0 / STANDARD_GRAVITY)
    everything = np.ones(len(table), bool)
    if words is None:
        _line(panels[0], scale, impact, everything, BLUE, "")
        _line(panels[1], scale, braking, everything, RED, "")
        for peak, label, colour in zip(PEAKS[1:], ("generatrix", "hoop", "belt"), (BLUE, ORANGE, GREEN), strict=True):
            _line(panels[2], scale, _column(table, peak, 1e-3), everything, colour, label)
    else:
        for number, word in enumerate(words.words):
            colour = COLOURS[number % len(COLOURS)]
            for panel, values in zip(panels, (impact, braking, _column(table, PEAKS[2], 1e-3)), strict=True):
                _line(panel, scale, values, words.at == number, colour, "")
            panels[0].plot([], [], color=colour, label=word)
    stopped = np.array([row["outcome"] == "stopped" for row in table])
    if stopped.any():
        panels[0].plot(scale.at[stopped], impact[stopped], "o", color=INK, fillstyle="none", label="stops above the ground")
    if stopped.any() or words is not None:
        panels[0].legend()
    failed = scale.at[[bool(row["fault"]) for row in table]]
    if len(failed):
        for panel in panels:
            panel.plot(failed, np.zeros(len(failed)), "x", color=RED, transform=panel.get_xaxis_transform(), clip_on=False)
        _count_failures(panels[0], len(failed))
    scale.along(panels[2], "x")
    return figure


def _line(panel: Axes, scale: _Scale, values: NDArray[Any], chosen: NDArray[Any], colour: str, label: str) -> None:
    """A curve with its name at its end."""
    order = np.flatnonzero(chosen)
    order = order[np.argsort(scale.at[order], kind="stable")]
    sound = order[np.isfinite(values[order])]
    if not len(sound):
        return
    panel.plot(scale.at[order], values[order], color=colour, marker="o" if len(order) <= 40 else "", markersize=3.5)
    if label:
        end = (scale.at[sound[-1]], values[sound[-1]])
        panel.annotate(label, end, (5, 0), textcoords="offset points", va="center", color=colour, fontsize=8)


def _count_failures(panel: Axes, count: int) -> None:
    panel.annotate(f"× no answer: {count}", (1.0, 1.02), xycoords="axes fraction", ha="right", color=RED, fontsize=8)


def _spread(scales: Sequence[_Scale], table: Sequence[Row]) -> bool:
    """Whether the runs with an answer lie about a plane of two axes, not along a line."""
    sound = np.isfinite(_column(table, "impact_velocity"))
    points = np.stack([scale.at[sound] for scale in scales], axis=1)
    if len(points) < 3:
        return False
    points = (points - points.mean(axis=0)) / np.maximum(np.ptp(points, axis=0), 1e-300)
    return int(np.linalg.matrix_rank(points, tol=1e-6)) == 2


def _contours(mpl: Any, scales: Sequence[_Scale], table: Sequence[Row]) -> Figure:
    figure: Figure = mpl.figure.Figure(figsize=(11.0, 4.6), layout="constrained")
    panels: Any = figure.subplots(1, 2, sharey=True)
    failed = np.array([bool(row["fault"]) for row in table])
    x, y = (scale.at for scale in scales)
    for panel, name, unit, title in (
        (panels[0], "impact_velocity", 1.0, "Impact velocity, m/s"),
        (panels[1], PEAKS[0], 1.0 / STANDARD_GRAVITY, "Peak deceleration, g"),
    ):
        values = _column(table, name, unit)
        sound = np.isfinite(values)
        if np.ptp(values[sound]) > 0.0:
            filled = panel.tricontourf(x[sound], y[sound], values[sound], 14, cmap="viridis")
            lines = panel.tricontour(x[sound], y[sound], values[sound], filled.levels[::2], colors="white", linewidths=0.6)
            panel.clabel(lines, fontsize=7.5)
            figure.colorbar(filled, ax=panel).outline.set_visible(False)
        if len(table) <= MOST_DOTS:
            panel.plot(x[sound], y[sound], ".", color="white", markersize=2.0, alpha=0.7)
        if failed.any():
            panel.plot(x[failed], y[failed], "x", color=RED, markersize=5.0, clip_on=False)
        panel.set_title(title)
        panel.grid(False)
        scales[0].along(panel, "x")
    scales[1].along(panels[0], "y")
    if failed.any():
        _count_failures(panels[0], int(failed.sum()))
    return figure


def _scatter_matrix(mpl: Any, scales: Sequence[_Scale], table: Sequence[Row]) -> Figure:
    """Below the diagonal runs over each two axes, coloured by impact velocity; on it that velocity over each axis."""
    count = len(scales)
    figure: Figure = mpl.figure.Figure(figsize=(2.6 * count + 2.0, 2.2 * count + 0.8), layout="constrained")
    panels: Any = figure.subplots(count, count, squeeze=False)
    impact = _column(table, "impact_velocity")
    failed = np.array([bool(row["fault"]) for row in table])
    shades = None
    for i, down in enumerate(scales):
        for j, across in enumerate(scales):
            panel = panels[i, j]
            if j > i:
                panel.remove()
                continue
            if i == j:
                panel.plot(across.at, impact, ".", color=BLUE, markersize=4.0)
                panel.set_ylabel("impact, m/s")
            else:
                shades = panel.scatter(across.at, down.at, c=impact, s=10.0, cmap="viridis")
                panel.plot(across.at[failed], down.at[failed], "x", color=RED, markersize=4.0)
                down.along(panel, "y")
            across.along(panel, "x")
    if shades is not None:
        figure.colorbar(shades, ax=panels[-1, -1], label="impact velocity, m/s").outline.set_visible(False)
    return figure
