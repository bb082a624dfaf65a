"""A page on one result: HTML with its pictures inside, which any browser shows without network, by day, by night and on paper."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softbrake import __version__
from softbrake.console import STANDARD_GRAVITY, TENSIONS, outcome_in_words
from softbrake.keys import CONTACT, key_at
from softbrake.plot import cut, moments
from softbrake.results import ResultError, Snapshots, belt_rows, read_case, read_history, read_snapshots, read_summary
from softbrake.summary import Sensitivities, Summary
from softbrake.units import Dimension

MOMENTS = 8
WIDTH, HEIGHT = 420.0, 230.0  # of a chart, in its own units
LEFT, RIGHT, TOP, BOTTOM = 46.0, 14.0, 8.0, 34.0  # margins
BUCKETS = 300  # of a curve: the least and the largest value of each is drawn

# Okabe and Ito's colours, told apart by the colour-blind; lighter ones by night. Dashes tell them apart in black and white.
STYLE = """
:root{color-scheme:light dark;--ink:#1c2024;--soft:#5b636c;--line:#d9dde1;--paper:#fff;--panel:#f6f7f8;
--c1:#0072b2;--c2:#d55e00;--c3:#00785a;--c4:#a8478a;--c5:#7a828b;--cargo:#c9a06c}
@media(prefers-color-scheme:dark){:root{--ink:#e8eaed;--soft:#a3abb4;--line:#3a4047;--paper:#16191d;--panel:#1f2429;
--c1:#56b4e9;--c2:#f08b3e;--c3:#2fc79a;--c4:#e29bc9;--c5:#98a0a9;--cargo:#8a6a40}}
@media print{:root{color-scheme:light;--ink:#000;--soft:#444;--line:#ccc;--paper:#fff;--panel:#fff;
--c1:#0072b2;--c2:#d55e00;--c3:#00785a;--c4:#a8478a;--c5:#7a828b;--cargo:#c9a06c}
figure,table,.answers div{break-inside:avoid}h2{break-after:avoid}}
body{margin:0 auto;padding:1rem;max-width:70rem;font:15px/1.45 system-ui,sans-serif;color:var(--ink);background:var(--paper)}
h1{font-size:1.4rem;margin:0 0 .3rem}h2{font-size:1.1rem;margin:2rem 0 .5rem}p{margin:.3rem 0}
.answers{display:grid;grid-template-columns:repeat(auto-fit,minmax(12.5rem,1fr));gap:.6rem;margin-top:1rem}
.answers div{background:var(--panel);border:1px solid var(--line);border-radius:6px;padding:.5rem .7rem}
.answers b{display:block;font-size:1.15rem;white-space:nowrap}
.answers span,figcaption span,.note{color:var(--soft);font-size:.85rem}
.bad b{color:var(--c2)}
.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,24rem),1fr));gap:1rem}
.shapes{display:grid;grid-template-columns:repeat(auto-fill,minmax(max(8rem,22%),1fr));gap:.5rem}
figure{margin:0}figcaption{font-weight:600;font-size:.9rem}.key{font-weight:400;white-space:nowrap;margin-left:.7rem}
svg{display:block;width:100%;height:auto}svg text{font:11px system-ui,sans-serif;fill:var(--soft)}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:.88rem}
th,td{text-align:left;padding:.15rem .8rem .15rem 0;border-bottom:1px solid var(--line);vertical-align:top}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
"""
DASHES = ("", "6 3", "2 2", "8 2 2 2", "1 3")


class Curve(NamedTuple):
    """One line of a chart."""

    label: str
    y: NDArray[Any]
    colour: int = 1  # of the style, 1 to 5


class Mark(NamedTuple):
    """A dot on a chart, with an error bar where there is an error."""

    x: float
    y: float
    error: float = 0.0


def write_report(source: Path | str, page: Path | str) -> None:
    """Write the page on a result file. Raises ResultError and OSError."""
    text = result_page(source)  # first, so that a fault leaves an older page alone
    Path(page).write_text(text, encoding="utf-8")


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


def page(title: str, parts: Sequence[str], source: str) -> str:
    """A whole HTML page of some parts."""
    head = '<meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1">'
    foot = f'<p class="note">softbrake {__version__}, from {escape(source)}</p>'
    body = "\n".join([*parts, foot])
    return (
        f'<!doctype html>\n<html lang="en"><head>{head}<title>{escape(title)}</title><style>{STYLE}</style></head>\n'
        f"<body>\n{body}\n</body></html>\n"
    )


def table(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: int = 0) -> str:
    """A table of texts; its last `numbers` columns are set flush right."""
    first = len(head) - numbers

    def line(cells: Sequence[str], tag: str) -> str:
        kinds = [' class="n"' if place >= first else "" for place in range(len(cells))]
        return "<tr>" + "".join(f"<{tag}{kind}>{escape(cell)}</{tag}>" for cell, kind in zip(cells, kinds, strict=True)) + "</tr>"

    top = f"<thead>{line(head, 'th')}</thead>" if any(head) else ""
    return f'<div class="scroll"><table>{top}<tbody>{"".join(line(row, "td") for row in rows)}</tbody></table></div>'


def chart(title: str, unit: str, x: NDArray[Any], curves: Sequence[Curve], x_label: str, marks: Sequence[Mark] = ()) -> str:
    """A figure of curves over x, with 0 in sight, and dots."""
    x_ticks, x_place = _axis(x, LEFT, WIDTH - RIGHT, inside=True)
    heights = [curve.y for curve in curves]
    heights += [np.array([mark.y - mark.error, mark.y + mark.error]) for mark in marks]
    y_ticks, y_place = _axis(np.concatenate([np.zeros(1), *heights]), HEIGHT - BOTTOM, TOP)
    lines = []
    for tick in y_ticks:
        y = y_place(tick)
        lines.append(f'<path d="M{LEFT:g} {y:.1f}H{WIDTH - RIGHT:g}" stroke="var(--{"soft" if tick == 0 else "line"})"/>')
        lines.append(f'<text x="{LEFT - 5:g}" y="{y + 4:.1f}" text-anchor="end">{_short(tick)}</text>')
    for tick in x_ticks:
        lines.append(f'<text x="{x_place(tick):.1f}" y="{HEIGHT - BOTTOM + 14:g}" text-anchor="middle">{_short(tick)}</text>')
    lines.append(f'<text x="{WIDTH - RIGHT:g}" y="{HEIGHT - 5:g}" text-anchor="end">{escape(x_label)}</text>')
    for number, curve in enumerate(curves):
        points = _thinned(x, curve.y)
        path = "M" + "L".join(f"{x_place(a):.1f} {y_place(b):.1f}" for a, b in points) if len(points) else ""
        dash = f' stroke-dasharray="{DASHES[number]}"' if DASHES[number] else ""
        lines.append(f'<path d="{path}" fill="none" stroke="var(--c{curve.colour})" stroke-width="1.6"{dash}/>')
    for mark in marks:
        a, b = x_place(mark.x), y_place(mark.y)
        if mark.error:
            lines.append(
                f'<path d="M{a:.1f} {y_place(mark.y - mark.error):.1f}V{y_place(mark.y + mark.error):.1f}" '
                'stroke="var(--ink)" stroke-width="2"/>'
            )
        lines.append(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3.2" fill="var(--ink)"/>')
    keys = ""
    if len(curves) > 1:
        for number, curve in enumerate(curves):
            sample = f'<path d="M0 5H26" stroke="var(--c{curve.colour})" stroke-width="2.4" stroke-dasharray="{DASHES[number]}"/>'
            keys += (
                f'<span class="key"><svg viewBox="0 0 26 10" style="display:inline;width:26px">{sample}</svg> '
                f"{escape(curve.label)}</span>"
            )
    label = escape(f"{title}, {unit}")
    picture = f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{label}">{"".join(lines)}</svg>'
    return f"<figure><figcaption>{label}{keys}</figcaption>{picture}</figure>"


def _axis(values: NDArray[Any], start: float, end: float, inside: bool = False) -> tuple[list[float], Callable[[float], float]]:
    """Round ticks that cover the values, or lie inside their range, and the place of a value between start and end."""
    sound = values[np.isfinite(values)]
    low, high = (float(sound.min()), float(sound.max())) if len(sound) else (0.0, 1.0)
    if high <= low:
        high = low + (abs(low) or 1.0)
    rough = (high - low) / 5
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(size * power for size in (1, 2, 2.5, 5, 10) if size * power >= rough * (1 - 1e-9))
    first, last = low / step, high / step
    down, up = (
        (math.ceil(first - 1e-9), math.floor(last + 1e-9)) if inside else (math.floor(first + 1e-9), math.ceil(last - 1e-9))
    )
    ticks = [step * number for number in range(down, up + 1)]
    if not inside:
        low, high = ticks[0], ticks[-1]

    def place(value: float) -> float:
        return start + (end - start) * (value - low) / (high - low)

    return ticks, place


def _short(value: float) -> str:
    return f"{value:.10g}".replace("-", "−")


def _thinned(x: NDArray[Any], y: NDArray[Any]) -> NDArray[Any]:
    """The finite points of a curve, of many the least and the largest of each bucket, (k, 2)."""
    sound = np.isfinite(x) & np.isfinite(y)
    points = np.column_stack((x[sound], y[sound]))
    if len(points) <= 2 * BUCKETS:
        return points
    kept = {0, len(points) - 1}
    for some in np.array_split(np.arange(len(points)), BUCKETS):
        kept |= {int(some[np.argmin(points[some, 1])]), int(some[np.argmax(points[some, 1])])}
    return points[sorted(kept)]


def _answers(case: dict[str, Any], summary: Summary) -> str:
    """The numbers a designer asks for, each with its error and its margin."""
    errors = summary.peak_errors or {}

    def bar(error: float | None, scale: float) -> str:
        return "" if error is None else f" ± {error * scale:.2g}"

    cards: list[tuple[str, str, str, bool]] = []
    if summary.impact_velocity is not None:
        value = f"{summary.impact_velocity:.3f}{bar(summary.impact_velocity_error, 1.0)} m/s"
        cards.append(("impact velocity", value, f"free fall {summary.free_fall_velocity:.3f} m/s", False))
    else:
        cards.append(("lowest height", f"{summary.minimum_height:.4g} m", "no impact", False))
    peak = f"{summary.peak_deceleration / STANDARD_GRAVITY:.2f}{bar(errors.get('peak_deceleration'), 1 / STANDARD_GRAVITY)} g"
    cards.append(("peak deceleration", peak, _when(summary, "peak_deceleration"), False))
    for tension in TENSIONS:
        name = f"peak_tension_{tension}"
        if (value_of := getattr(summary, name)) is not None:
            value = f"{value_of / 1e3:.2f}{bar(errors.get(name), 1e-3)} kN/m"
            cards.append((f"peak tension, {tension}", value, _when(summary, name), False))
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
    return f'<div class="answers">{body}</div><p class="note">{escape(reason)}</p>'


def _when(summary: Summary, name: str) -> str:
    peak = summary.peaks.get(name)
    if peak is None:
        return ""
    return f"at {peak.time * 1e3:.4g} ms" + ("" if peak.height is None else f", {peak.height:.3g} m up the shell")


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
    panels: list[tuple[str, str, list[Curve], list[Mark]]] = [
        ("Speed, downwards", "m/s", [Curve("cargo", -history["velocity"], 1), Curve("free fall", falling, 5)], impact),
        ("Height of the cover", "m", [Curve("", history["height"], 1)], []),
        ("Deceleration", "g", [Curve("", history["acceleration"] / STANDARD_GRAVITY, 2)], []),
        ("Pressure", "kPa", [Curve("", history["pressure"] * 1e-3, 2)], []),
        ("Largest tensions", "kN/m", tensions, []),
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
    rows.append(["noise of one run, %", *(f"{100 * found.noise[name]:.2g}" for name in names)])
    left = [escape(f"{path} is not varied alone: {fault}") for path, fault in found.left_out.items()]
    return table(head, rows, len(names)) + "".join(f'<p class="note">{line}</p>' for line in left)


def _computed(summary: Summary) -> str:
    model = summary.model
    lines = [
        f"{model.fidelity}, {model.scheme} scheme, {model.generatrix} x {model.hoop} cells, Courant {model.courant:g}",
        f"{summary.steps} steps of {summary.time_step * 1e6:.4g} us on average, {summary.kernel_seconds:.2f} s",
    ]
    works = [[f"work, {name}", f"{value:.2f} J"] for name, value in asdict(summary.work).items()]
    works.append(["energy residual", f"{summary.energy_error:.1e} of the initial energy"])
    text = "".join(f"<p>{escape(line)}</p>" for line in lines) + table(("", ""), works, 1)
    if summary.ladder:
        rows = [
            [
                rung.fidelity,
                f"{rung.generatrix} x {rung.hoop}",
                rung.verdict,
                "–" if rung.impact_velocity is None else f"{rung.impact_velocity:.4f}",
                "–" if rung.error is None or not math.isfinite(rung.error) else f"{rung.error:.2g}",
            ]
            for rung in summary.ladder
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
