"""A web page of tables and charts that any browser shows without network, by day, by night, on a telephone and on paper."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from html import escape
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softbrake import __version__

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
.answers b{display:block;font-size:1.15rem}
.answers span,figcaption span,.note{color:var(--soft);font-size:.85rem}
.bad b{color:var(--c2)}
.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,24rem),1fr));gap:1rem}
.shapes{display:grid;grid-template-columns:repeat(auto-fill,minmax(max(8rem,22%),1fr));gap:.5rem}
figure{margin:0}figcaption{font-weight:600;font-size:.9rem}.key{font-weight:400;white-space:nowrap;margin-left:.7rem}
svg{display:block;width:100%;height:auto}svg text{font:11px system-ui,sans-serif;fill:var(--soft)}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:.88rem}
th,td{text-align:left;padding:.15rem .8rem .15rem 0;border-bottom:1px solid var(--line);vertical-align:top}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
@media print{body{font-size:11px;padding:0}.charts{grid-template-columns:1fr 1fr}.shapes{grid-template-columns:repeat(4,1fr)}
.answers{grid-template-columns:repeat(4,1fr)}h2{margin-top:1rem}}
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
        at = x_place(tick)
        anchor = "end" if at > WIDTH - 2 * RIGHT else "middle"
        lines.append(f'<text x="{at:.1f}" y="{HEIGHT - BOTTOM + 14:g}" text-anchor="{anchor}">{_short(tick)}</text>')
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
        lines.append(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="2.6" fill="var(--ink)"/>')
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
