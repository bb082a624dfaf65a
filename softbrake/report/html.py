"""A page on one result or one sweep: answers with errors and margins, curves, shapes, runs and the case."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softbrake.case.keys import CONTACT, key_at
from softbrake.case.units import Dimension
from softbrake.report.page import Curve, Mark, chart, page, table
from softbrake.report.plots.drop import cut, moments
from softbrake.report.words import STANDARD_GRAVITY, TENSIONS, disturbed_in_words, made_in_words, outcome_in_words
from softbrake.sim.result_file import ResultError, Snapshots, belt_rows, read_case, read_history, read_snapshots, read_summary
from softbrake.sim.summary import Sensitivities, Summary

MOMENTS = 8


def write_report(source: Path | str, file: Path | str) -> None:
    """Write the page on a result file or on the folder of a sweep. Raises ResultError and OSError."""
    text = sweep_page(source) if Path(source).is_dir() else result_page(source)  # before an older page goes
    Path(file).write_text(text, encoding="utf-8")


def result_page(path: Path | str) -> str:
    """The page on a result file. Raises ResultError."""
    case, history, summary, shots = read_case(path), read_history(path), read_summary(path), read_snapshots(path)
    if len(history) == 0 or len(shots.times) == 0:
        raise ResultError(f"{path}: the run stopped before it recorded anything")
    ending = "The run did not finish: the file has no summary." if summary is None else outcome_in_words(summary)
    parts = [f"<h1>{escape(case['title'])}</h1>", f"<p>{escape(ending)}</p>"]
    if summary is not None:
        parts.append(_answers(case, summary))
    parts += ["<h2>Course of the drop</h2>", _charts(case, history, summary)]
    parts += [f"<h2>Shape at {len(moments(shots, MOMENTS))} moments</h2>", _shapes(case, shots)]
    if summary is not None:
        if summary.sensitivity is not None:
            parts += ["<h2>What 1 % of each input does</h2>", _sensitivity(summary.sensitivity)]
        parts += ["<h2>How it was computed</h2>", _computed(summary)]
    parts += ["<h2>Case</h2>", _case(case)]
    return page(case["title"], parts, Path(path).name)


def sweep_page(folder: Path | str) -> str:
    """The page on the folder of a sweep: its plan.json and results.csv. Raises ResultError."""
    folder = Path(folder)
    try:
        plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
        title, case = plan["title"], plan["case"]
        with open(folder / "results.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        with open(folder / "results.units.csv", encoding="utf-8", newline="") as file:
            units = next(csv.DictReader(file))
        names = list(rows[0])
        axes = names[names.index("id") + 1 : names.index("outcome")]
        failed = [row for row in rows if row["fault"]]
    except OSError as error:
        raise ResultError(f"{error.filename}: {error.strerror}; the folder of a finished sweep is wanted") from error
    except (ValueError, KeyError, IndexError, StopIteration) as error:
        raise ResultError(f"{folder}: not the results of a sweep, or incomplete ones") from error
    parts = [f"<h1>{escape(title)}</h1>", f"<p>{len(rows)} runs over {escape(', '.join(axes))}</p>"]
    if failed:
        parts.append(f"<p><b>{len(failed)} of them have no answer.</b></p>")
    if charts := _sweep_charts(rows, axes, units):
        parts += ["<h2>Answers</h2>", charts]
    parts += ["<h2>Runs</h2>", _runs(rows, axes, units)]
    if failed:
        parts += ["<h2>Runs without an answer</h2>", table(("run", "why"), [(row["run"], row["fault"]) for row in failed])]
    parts += ["<h2>Case</h2>", "<p>Of the first run.</p>", _case(case)]
    return page(title, parts, folder.name)


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


def _column(rows: Sequence[dict[str, str]], name: str, scale: float) -> NDArray[Any]:
    """Numbers of a column, NaN where there are none. A cargo that stops above the ground has the impact velocity 0."""

    def number(row: dict[str, str]) -> float:
        if row["fault"]:
            return math.nan
        if name == "impact_velocity" and row["outcome"] == "stopped":
            return 0.0
        return float(row.get(name) or math.nan)

    return scale * np.array([number(row) for row in rows])


def _sweep_charts(rows: Sequence[dict[str, str]], axes: Sequence[str], units: dict[str, str]) -> str:
    """Answers over each axis of numbers, a curve where it is the only one, else a dot a run; empty without such an axis."""
    figures = []
    for axis in axes:
        try:
            x = np.array([float(row[axis]) for row in rows])
        except ValueError:  # words
            continue
        order, unit = np.argsort(x, kind="stable"), units[axis]
        if unit in ("Pa", "N/m", "N") and np.abs(x).max() >= 1e3:
            x, unit = 1e-3 * x, f"k{unit}"
        label = f"{axis}, {unit}" if unit else axis
        for answer in ANSWERS:
            y = _column(rows, answer.column, answer.scale)
            if not np.isfinite(y).any():
                continue
            dots = [Mark(a, b) for a, b in zip(x, y, strict=True) if math.isfinite(b)] if len(axes) > 1 or len(x) <= 40 else []
            curves = [Curve("", y[order])] if len(axes) == 1 else []
            figures.append(chart(answer.title.capitalize(), answer.unit, x[order], curves, label, dots))
    if not figures:  # words only
        return ""
    note = '<p class="note">Impact velocity 0: the cargo stops above the ground.</p>'
    stops = any(row["outcome"] == "stopped" for row in rows)
    return f'<div class="charts">{"".join(figures)}</div>{note if stops else ""}'


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


def _answers(case: dict[str, Any], summary: Summary) -> str:
    """The numbers a designer asks for, each with its error and its margin."""
    errors = summary.peak_errors or {}

    def bar(error: float | None, scale: float) -> str:
        return "" if error is None else f" ± {error * scale:.2g}"

    def peak_bar(name: str, scale: float) -> str:
        return " ± no bound," if name in errors and errors[name] is None else bar(errors.get(name), scale)

    cards: list[tuple[str, str, str, bool]] = []
    if summary.impact_velocity is not None:
        value = f"{summary.impact_velocity:.3f}{bar(summary.impact_velocity_error, 1.0)} m/s"
        notes = [f"free fall {summary.free_fall_velocity:.3f} m/s"]
        if (found := summary.ensemble) is not None:
            notes.append(f"{found.members} drops, {found.least:.3f} to {found.most:.3f} m/s, {disturbed_in_words(found)}")
        cards.append(("impact velocity", value, "; ".join(notes), False))
    else:
        cards.append(("lowest height", f"{summary.minimum_height:.4g} m", "no impact", False))
    peak = f"{summary.peak_deceleration / STANDARD_GRAVITY:.2f}{peak_bar('peak_deceleration', 1 / STANDARD_GRAVITY)} g"
    notes = ["net of gravity", *_notes(summary, "peak_deceleration", 1 / STANDARD_GRAVITY, "g")]
    if summary.filtered is not None and summary.filtered.fault is not None:
        notes.append(f"CFC {summary.filtered.cfc}: none, {summary.filtered.fault}")
    cards.append(("peak deceleration, 1 kHz", peak, "; ".join(notes), False))
    for tension in TENSIONS:
        name = f"peak_tension_{tension}"
        if (value_of := getattr(summary, name)) is not None:
            value = f"{value_of / 1e3:.2f}{peak_bar(name, 1e-3)} kN/m"
            cards.append((f"peak tension, {tension}", value, "; ".join(_notes(summary, name, 1e-3, "kN/m")), False))
    for name, margin in (("fabric", summary.fabric_margin), ("belts", summary.belt_margin)):
        if margin is not None:
            note = "of strength over peak tension" if margin >= 0.0 else "the strength is exceeded"
            cards.append((f"margin, {name}", f"{margin:+.0%}", note, margin < 0.0))
    cards.append(
        ("stroke", f"{case['shell']['height'] - summary.minimum_height:.4g} m", f"of {case['shell']['height']:g} m", False)
    )
    body = "".join(
        f"<div{' class=bad' if bad else ''}><span>{escape(name)}</span><b>{escape(value)}</b><span>{escape(note)}</span></div>"
        for name, value, note, bad in cards
    )
    reason = "no error bar was asked for" if summary.fidelity_reason is None else f"error bars: {summary.fidelity_reason}"
    doubt = "" if summary.doubt is None else f'<p class="bad">{escape(summary.doubt)}</p>'
    return f'{doubt}<div class="answers">{body}</div><p class="note">{escape(reason)}</p>'


def _notes(summary: Summary, name: str, scale: float, unit: str) -> list[str]:
    """When, where and in which phase a peak is, its value in the other phase and behind the filter; scale: of the SI value."""
    peak, notes = summary.peaks.get(name), []
    if peak is not None:
        height = "" if peak.height is None else f", {peak.height:.3g} m up the shell"
        notes.append(f"at {peak.time * 1e3:.4g} ms{height}" + ("" if peak.phase is None else f", {peak.phase}"))
        if peak.other is not None:
            notes.append(f"{peak.other.phase}: {peak.other.value * scale:.2f} {unit}")
    if summary.filtered is not None and (behind := getattr(summary.filtered, name)) is not None:
        notes.append(f"CFC {summary.filtered.cfc}: {behind.value * scale:.2f} {unit}, {behind.phase}")
    return notes


def _charts(case: dict[str, Any], history: NDArray[Any], summary: Summary | None) -> str:
    time = history["time"]
    start, gravity, drop = case["cargo"]["velocity"], case["gravity"], case["shell"]["height"]
    falling = start + gravity * time
    falling = np.where(start * time + 0.5 * gravity * time**2 <= drop, falling, np.nan)
    impact = []
    if summary is not None and summary.impact_velocity is not None and summary.impact_time is not None:
        impact = [Mark(summary.impact_time * 1e3, summary.impact_velocity, summary.impact_velocity_error or 0.0)]
    tensions = [
        Curve(name, history[f"tension_{name}"] * 1e-3, number)
        for number, name in enumerate(TENSIONS, 1)
        if name != "belt" or case["belts"]
    ]
    works = [Curve("kinetic", history["kinetic_energy"] * 1e-3, 5)]
    for label, colour, names in (
        ("gas", 2, ("pressure",)),
        ("gravity", 3, ("gravity",)),
        ("fabric, belts", 1, ("elastic", "viscous", "belts")),
        ("contact", 4, ("ground", "contact")),
    ):
        works.append(Curve(label, 1e-3 * np.sum([history[f"work_{name}"] for name in names], axis=0), colour))
    no_marks: list[Mark] = []
    panels: list[tuple[str, str, list[Curve], list[Mark]]] = [
        ("Speed, downwards", "m/s", [Curve("cargo", -history["velocity"], 1), Curve("free fall", falling, 5)], impact),
        ("Height of the cover", "m", [Curve("", history["height"], 1)], []),
        ("Deceleration", "g", [Curve("", history["acceleration"] / STANDARD_GRAVITY, 2)], []),
        ("Pressure", "kPa", [Curve("", history["pressure"] * 1e-3, 2)], []),
        *([("Largest tensions", "kN/m", tensions, no_marks)] if case["model"]["fidelity"] != "lumped" else []),
        ("Energy and works", "kJ", works, []),
    ]
    return (
        '<div class="charts">'
        + "".join(chart(title, unit, time * 1e3, curves, "time, ms", marks) for title, unit, curves, marks in panels)
        + "</div>"
    )


def _shapes(case: dict[str, Any], shots: Snapshots) -> str:
    """Cuts through the shell, all to one scale."""
    chosen = moments(shots, MOMENTS)
    radius, height, box = case["shell"]["diameter"] / 2, case["shell"]["height"], case["cargo"]["diameter"]
    rows = belt_rows([belt["height"] for belt in case["belts"]], height, case["grid"]["generatrix"])
    top = min(case["cargo"].get("height", math.inf), 0.5 * case["shell"]["diameter"])  # of the cargo, as far as there is room
    cuts = [cut(shots, shot) for shot in chosen]
    reach = 1.05 * max([box / 2, *(float(np.abs(r).max()) for sides in cuts for r, _ in sides)])
    floor, ceiling = -0.06 * height, height + top * 1.05
    scale = 100.0 / reach
    figures = []
    for shot, sides in zip(chosen, cuts, strict=True):

        def place(r: float, z: float) -> str:
            return f"{(r + reach) * scale:.1f} {(ceiling - z) * scale:.1f}"

        level = float(shots.height[shot])
        lines = [
            f'<path d="M{place(-reach, 0)}L{place(reach, 0)}L{place(reach, floor)}L{place(-reach, floor)}Z" fill="var(--line)"/>',
            f'<path d="M{place(-box / 2, level)}L{place(-box / 2, level + top)}L{place(box / 2, level + top)}'
            f'L{place(box / 2, level)}Z" fill="var(--cargo)" stroke="var(--soft)"/>',
            f'<path d="M{place(-radius, level)}L{place(radius, level)}" stroke="var(--ink)" stroke-width="3"/>',
        ]
        for r, z in sides:
            path = "L".join(place(a, b) for a, b in zip(r, z, strict=True))
            lines.append(f'<path d="M{path}" fill="none" stroke="var(--c1)" stroke-width="1.8" stroke-linejoin="round"/>')
            for row in rows:
                a, b = place(r[row], z[row]).split()
                lines.append(f'<circle cx="{a}" cy="{b}" r="3" fill="var(--c3)"/>')
        caption = f"{shots.times[shot] * 1e3:.1f} ms <span>{round(-shots.velocity[shot], 2) + 0.0:.2f} m/s</span>"
        box_size = f"0 0 {2 * reach * scale:.1f} {(ceiling - floor) * scale:.1f}"
        figures.append(
            f'<figure><figcaption>{caption}</figcaption><svg viewBox="{box_size}" role="img" '
            f'aria-label="shape at {shots.times[shot] * 1e3:.1f} ms">{"".join(lines)}</svg></figure>'
        )
    dots = ", dots are belts" if rows else ""
    return f'<div class="shapes">{"".join(figures)}</div><p class="note">Cut through the axis; all to one scale{dots}.</p>'


def _sensitivity(found: Sensitivities) -> str:
    names = [name for name in found.errors if name in found.noise]
    head = ["% per 1 % of", *(name.replace("_", " ") for name in names)]
    rows = [
        [row.path, *("–" if (change := row.changes[name]) is None else f"{change:+.2f}" for name in names)]
        for row in found.inputs
    ]
    rows.append(["standard error", *(f"{found.errors[name]:.2g}" for name in names)])
    rows.append(["off straight lines, %", *(f"{100 * found.noise[name]:.2g}" for name in names)])
    left = [escape(f"{path} is not varied alone: {fault}") for path, fault in found.left_out.items()]
    return table(head, rows, len(names)) + "".join(f'<p class="note">{line}</p>' for line in left)


def _computed(summary: Summary) -> str:
    model = summary.model
    lines = [
        f"{model.fidelity}, {model.scheme} scheme, {model.generatrix} x {model.hoop} cells, Courant {model.courant:g}",
        f"{summary.steps} steps of {summary.time_step * 1e6:.4g} us on average, {summary.kernel_seconds:.2f} s of CPU",
    ]
    works = [[f"work, {name}", f"{value:.2f} J"] for name, value in asdict(summary.work).items()]
    works.append(["energy residual", f"{summary.energy_error:.1e} of the initial energy"])
    works.append(["energy from nowhere", made_in_words(summary)])
    text = "".join(f"<p>{escape(line)}</p>" for line in lines) + table(("", ""), works, 1)
    if summary.trials:
        rows = [
            [
                trial.fidelity,
                f"{trial.generatrix} x {trial.hoop}",
                trial.verdict,
                "–" if trial.impact_velocity is None else f"{trial.impact_velocity:.4f}",
                "–" if trial.error is None or not math.isfinite(trial.error) else f"{trial.error:.2g}",
            ]
            for trial in summary.trials
        ]
        text += "<p>Tried for the tolerance:</p>" + table(("level", "grid", "", "m/s", "± m/s"), rows, 2)
    return text


def _case(case: dict[str, Any]) -> str:
    """All values of the resolved case with unit and meaning."""
    rows = []

    def add(path: str, value: Any) -> None:
        key = key_at(path)
        unit = key.kind.unit if key is not None and isinstance(key.kind, Dimension) else ""
        values = value if isinstance(value, list) else [value]
        shown = ", ".join(f"{one:.6g}" if isinstance(one, float) else str(one) for one in values)
        rows.append([path, f"{shown} {unit}".strip(), key.meaning if key is not None else ""])

    for name, value in case.items():
        if isinstance(value, dict):
            for key, inner in value.items():
                add(f"{name}.{key}", inner)
        elif name == "belts":
            for number, belt in enumerate(value):
                for key, inner in belt.items():
                    add(f"belts.{number}.{key}", inner)
        elif name == "contact":
            rows.append(["contact", ", ".join(value) or "none", f"what stops the fabric, of {', '.join(CONTACT)}"])
        elif name != "title":
            add(name, value)
    return table(("", "", ""), rows)
