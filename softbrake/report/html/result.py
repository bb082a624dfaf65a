"""The page on one result: answers with errors and margins, curves, shapes and the case."""

from __future__ import annotations

import math
from dataclasses import asdict
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softbrake.case.sections.limits import limits_of
from softbrake.case.sections.shell import shell_of
from softbrake.case.units import STANDARD_GRAVITY
from softbrake.report.comparison_rows import comparison_rows, heading_lines, rating_rows
from softbrake.report.html.case import case_table
from softbrake.report.html.frame import Card, answers, figures, page, table
from softbrake.report.html.inflation import inflation_page
from softbrake.report.plots.page import drop_charts, overlay_charts, shapes
from softbrake.report.words import (
    TENSIONS,
    disturbed_in_words,
    gas_energy_rows,
    made_in_words,
    margin_in_words,
    named,
    openings_in_words,
    outcome_in_words,
    speed_in_words,
    thread_rows,
    vented_in_words,
    verdict_rows,
    when_in_words,
)
from softbrake.sim.limits import judge
from softbrake.sim.result_file import ResultError, read_case, read_history, read_inflation, read_snapshots, read_summary
from softbrake.sim.summary import Sensitivities, Summary

if TYPE_CHECKING:
    from softbrake.studies.comparison import Comparison

MOMENTS = 8


def result_page(path: Path | str, comparison: Comparison | None = None) -> str:
    """The page on a result file: of a drop, with a test beside it if any, or of an inflation. Raises ResultError, PlotError."""
    if (inflation := read_inflation(path)) is not None:
        return inflation_page(path, inflation)
    case, history, summary, shots = read_case(path), read_history(path), read_summary(path), read_snapshots(path)
    if len(history) == 0 or len(shots.times) == 0:
        raise ResultError(f"{path}: the run stopped before it recorded anything")
    ending = "The run did not finish: the file has no summary." if summary is None else outcome_in_words(summary)
    parts = [f"<h1>{escape(case['title'])}</h1>", f"<p>{escape(ending)}</p>"]
    if summary is not None:
        parts.append(_answers(case, summary))
        if limits := limits_of(case.get("limits", {})):
            parts += ["<h2>Limits</h2>", table(("limit", "answer", "margin", ""), verdict_rows(judge(limits, summary)))]
    if comparison is not None:
        parts += ["<h2>Beside the test</h2>", _comparison(comparison)]
    parts += ["<h2>Course of the drop</h2>", figures("charts", drop_charts(case, history, summary))]
    cuts = shapes(case, shots, MOMENTS)
    belts = ", dots are belts" if case["belts"] else ""
    note = f'<p class="note">Cut through the axis; all to one scale{belts}.</p>'
    parts += [f"<h2>Shape at {len(cuts)} moments</h2>", figures("shapes", cuts), note]
    if summary is not None:
        if summary.sensitivity is not None:
            parts += ["<h2>What 1 % of each input does</h2>", _sensitivity(summary.sensitivity)]
        parts += ["<h2>How it was computed</h2>", _computed(summary)]
    parts += ["<h2>Case</h2>", case_table(case)]
    return page(case["title"], parts, Path(path).name)


def _answers(case: dict[str, Any], summary: Summary) -> str:
    """The numbers a designer asks for, each with its error and its margin."""
    cards = [*_fall(summary), _braking(case, summary), *_gas(summary)]
    for tension in TENSIONS:
        name = f"peak_tension_{tension}"
        if (value := getattr(summary, name)) is not None:
            shown = f"{value / 1e3:.2f}{_bar(summary, name, 1e-3)} kN/m"
            cards.append(Card(f"peak tension, {tension}", shown, _notes(summary, name, 1e-3, "kN/m")))
    for name, margin in (("fabric", summary.fabric_margin), ("belts", summary.belt_margin)):
        if margin is not None:
            note = "of strength over peak tension" if margin >= 0.0 else "the strength is exceeded"
            cards.append(Card(f"margin, {name}", margin_in_words(margin), [note], margin < 0.0))
    height = shell_of(case["shell"]).height
    cards.append(Card("stroke", f"{height - summary.lowest_height:.4g} m", [f"of {height:g} m"]))
    reason = "no error bar was asked for" if summary.fidelity_reason is None else f"error bars: {summary.fidelity_reason}"
    doubt = "" if summary.doubt is None else f'<p class="bad">{escape(summary.doubt)}</p>'
    return f'{doubt}{answers(cards)}<p class="note">{escape(reason)}</p>'


def _fall(summary: Summary) -> list[Card]:
    """Impact velocity, or how low the cover came and how fast it rose."""
    if summary.impact_velocity is None:
        rest = "" if summary.rest_time is None else f"first at rest at {summary.rest_time * 1e3:.4g} ms"
        cards = [Card("lowest height", f"{summary.lowest_height:.4g} m", ["no impact", rest])]
        if summary.rebound_velocity is not None:
            notes = [f"upwards at the height of first contact, at {summary.end_time * 1e3:.4g} ms"]
            cards.append(Card("rebound velocity", f"{summary.rebound_velocity:.3f} m/s", notes))
        return cards
    error = "" if summary.impact_velocity_error is None else f" ± {summary.impact_velocity_error:.2g}"
    notes = [f"free fall {summary.free_fall_velocity:.3f} m/s"]
    if (found := summary.ensemble) is not None:
        notes.append(f"{found.members} drops, {found.least:.3f} to {found.most:.3f} m/s, {disturbed_in_words(found)}")
    return [Card("impact velocity", f"{summary.impact_velocity:.3f}{error} m/s", notes)]


def _gas(summary: Summary) -> list[Card]:
    """Peaks of a gas with a state, and what left it; none of a pressure law."""
    if summary.peak_pressure is None or summary.peak_temperature is None or summary.vented_mass is None:
        return []
    shown = f"{summary.peak_pressure / 1e3:.2f}{_bar(summary, 'peak_pressure', 1e-3)} kPa"
    notes = _notes(summary, "peak_pressure", 1e-3, "kPa", filtered=False)
    cards = [
        Card("peak pressure, gauge", shown, notes),
        Card("peak temperature", f"{summary.peak_temperature:.1f} K", [when_in_words(summary.peaks["peak_temperature"], 1e3)]),
    ]
    openings = [f"{name} at {when} {unit}" if unit else f"{name} {when}" for name, when, unit in openings_in_words(summary, 1e3)]
    if summary.vented_mass or openings:
        cards.append(Card("vented mass", f"{summary.vented_mass:.4g} kg", [vented_in_words(summary), *openings]))
    return cards


def _braking(case: dict[str, Any], summary: Summary) -> Card:
    """The peak of the curve on the page: behind the channel class, or where the rows do not allow that the one of the answer."""
    name, scale, filtered = "peak_deceleration", 1.0 / STANDARD_GRAVITY, summary.filtered
    gravity = case["gravity"] * scale
    notes = [f"net of gravity: an accelerometer reads {gravity:.3g} g more"]
    plain, lumped = f"{summary.peak_deceleration * scale:.2f}{_bar(summary, name, scale)} g", summary.model.fidelity == "lumped"
    if filtered is not None and (peak := filtered.peak_deceleration) is not None:
        notes += [
            when_in_words(peak, 1e3, summary.ensemble),
            f"{'unfiltered' if lumped else 'behind a one-way low-pass of 1 kHz'} {plain}",
        ]
        notes += _notes(summary, name, scale, "g", filtered=False)
        return Card(f"peak deceleration, CFC {filtered.cfc}", f"{peak.value * scale:.2f} g", notes)
    if filtered is not None and filtered.fault is not None:
        notes.append(f"CFC {filtered.cfc}: none, {filtered.fault}")
    return Card(
        "peak deceleration" if lumped else "peak deceleration, 1 kHz", plain, [*notes, *_notes(summary, name, scale, "g")]
    )


def _bar(summary: Summary, name: str, scale: float) -> str:
    """Estimated error of a peak; empty where there is none, or none that is bounded. scale: of the SI value."""
    error = (summary.peak_errors or {}).get(name)
    return "" if error is None else f" ± {error * scale:.2g}"


def _notes(summary: Summary, name: str, scale: float, unit: str, filtered: bool = True) -> list[str]:
    """When, where and in which phase a peak is, its value in the other phase and behind the filter; scale: of the SI value."""
    peak, notes = summary.peaks.get(name), []
    errors = summary.peak_errors or {}
    if name in errors and errors[name] is None:
        notes.append("its error has no bound")
    if peak is not None:
        notes.append(when_in_words(peak, 1e3, summary.ensemble))
        if peak.other is not None:
            notes.append(f"{peak.other.phase}: {peak.other.value * scale:.2f} {unit}")
    if filtered and summary.filtered is not None and (behind := getattr(summary.filtered, name)) is not None:
        notes.append(f"CFC {summary.filtered.cfc}: {behind.value * scale:.2f} {unit}, {behind.phase}")
    return notes


def _sensitivity(found: Sensitivities) -> str:
    names = [name for name in found.errors if name in found.noise]
    head = ["% per 1 % of", *map(named, names)]
    rows = [
        [row.path, *("–" if (change := row.changes[name]) is None else f"{change:+.2f}" for name in names)]
        for row in found.inputs
    ]
    rows.append(["standard error", *(f"{found.errors[name]:.2g}" for name in names)])
    rows.append(["off straight lines, %", *(f"{100 * found.noise[name]:.2g}" for name in names)])
    left = [escape(f"{path} is not varied alone: {fault}") for path, fault in found.left_out.items()]
    return table(head, rows, len(names)) + "".join(f'<p class="note">{line}</p>' for line in left)


def _comparison(found: Comparison) -> str:
    text = "".join(f"<p>{escape(line)}</p>" for line in heading_lines(found))
    text += figures("charts", overlay_charts(found))
    for each in found.quantities:
        text += table((each.quantity, "test", "drop", "drop less test", ""), comparison_rows(each), 4)
    text += "<p>ISO/TS 18571, test as the reference:</p>"
    text += table(("", "overall", "corridor", "phase", "magnitude", "slope"), rating_rows(found), 5)
    unrated = [f"{each.quantity}: no rating, {each.unrated}" for each in found.quantities if each.unrated is not None]
    return text + "".join(f'<p class="note">{escape(line)}</p>' for line in unrated)


def _computed(summary: Summary) -> str:
    model = summary.model
    lines = [
        f"{model.fidelity}, {model.scheme} scheme, {model.generatrix} x {model.hoop} cells, Courant {model.courant:g}",
        f"{summary.steps} steps of {summary.time_step * 1e6:.4g} us on average, {summary.kernel_seconds:.2f} s of CPU",
    ]
    works = [[f"work, {name}", f"{value:.2f} J"] for name, value in asdict(summary.work).items()]
    if summary.gas is not None:
        works += [[name.strip(), f"{value:.2f} J"] for name, value, _ in gas_energy_rows(summary.gas)]
    works.append(["energy residual", f"{summary.energy_error:.1e} of the initial energy"])
    works.append(["energy from nowhere", made_in_words(summary)])
    works += [[name, f"{number} {note}"] for name, number, note in thread_rows(summary)]
    text = "".join(f"<p>{escape(line)}</p>" for line in lines) + table(("", ""), works, 1)
    if summary.trials:
        rows = [
            [
                trial.fidelity,
                f"{trial.generatrix} x {trial.hoop}",
                trial.verdict,
                speed_in_words(trial),
                "–" if trial.error is None or not math.isfinite(trial.error) else f"{trial.error:.2g}",
            ]
            for trial in summary.trials
        ]
        text += "<p>Tried for the tolerance:</p>" + table(("level", "grid", "", "m/s", "± m/s"), rows, 2)
    return text
