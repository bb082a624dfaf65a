"""A web page of tables and figures that any browser shows without network, by day, by night, on a telephone and on paper."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING, NamedTuple

from softbrake import __version__
from softbrake.report.plots import panels
from softbrake.report.plots.page import THEME, as_svg

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DAY, NIGHT = (";".join(f"--{name}:{colours[time]}" for name, colours in THEME.items()) for time in (0, 1))
STYLE = f"""
:root{{color-scheme:light dark;--paper:#fff;--panel:#f6f7f8;{DAY}}}
@media(prefers-color-scheme:dark){{:root{{--paper:#16191d;--panel:#1f2429;{NIGHT}}}}}
@media print{{:root{{color-scheme:light;--paper:#fff;--panel:#fff;{DAY}}}
figure,table,.answers div{{break-inside:avoid}}h2{{break-after:avoid}}}}
"""
STYLE += """\
body{margin:0 auto;padding:1rem;max-width:70rem;font:15px/1.45 system-ui,sans-serif;color:var(--ink);background:var(--paper)}
h1{font-size:1.4rem;margin:0 0 .3rem}h2{font-size:1.1rem;margin:2rem 0 .5rem}p{margin:.3rem 0}
.answers{display:grid;grid-template-columns:repeat(auto-fit,minmax(12.5rem,1fr));gap:.6rem;margin-top:1rem}
.answers div{background:var(--panel);border:1px solid var(--line);border-radius:6px;padding:.5rem .7rem}
.answers b{display:block;font-size:1.15rem}
.answers span,figcaption span,.note{color:var(--soft);font-size:.85rem}
.bad b{color:var(--red)}
.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,24rem),1fr));gap:1rem}
.shapes{display:grid;grid-template-columns:repeat(auto-fill,minmax(max(8rem,22%),1fr));gap:.5rem}
figure{margin:0}figcaption{font-weight:600;font-size:.9rem}
svg{display:block;width:100%;height:auto;overflow:visible}svg text{font-family:system-ui,sans-serif!important}
svg *{stroke-linejoin:round;stroke-linecap:butt}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:.88rem}
th,td{text-align:left;padding:.15rem .8rem .15rem 0;border-bottom:1px solid var(--line);vertical-align:top}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
@media print{body{font-size:11px;padding:0}.charts{grid-template-columns:1fr 1fr}.shapes{grid-template-columns:repeat(4,1fr)}
.answers{grid-template-columns:repeat(4,1fr)}h2{margin-top:1rem}}
"""


def page(title: str, parts: Sequence[str], source: str) -> str:
    """A whole HTML page of some parts."""
    head = '<meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1">'
    foot = f'<p class="note">softbrake {__version__}, from {escape(source)}</p>'
    body = "\n".join([*parts, foot])
    return (
        f'<!doctype html>\n<html lang="en"><head>{head}<title>{escape(title)}</title><style>{STYLE}</style></head>\n'
        f"<body>\n{body}\n</body></html>\n"
    )


class Card(NamedTuple):
    """One answer: its name, its value with unit, and notes on it."""

    name: str
    value: str
    notes: Sequence[str] = ()
    bad: bool = False


def answers(cards: Sequence[Card]) -> str:
    """Cards side by side."""
    body = "".join(
        f"<div{' class=bad' if card.bad else ''}><span>{escape(card.name)}</span><b>{escape(card.value)}</b>"
        f"<span>{escape('; '.join(filter(None, card.notes)))}</span></div>"
        for card in cards
    )
    return f'<div class="answers">{body}</div>'


def table(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: int = 0) -> str:
    """A table of texts; its last `numbers` columns are set flush right."""
    first = len(head) - numbers

    def line(cells: Sequence[str], tag: str) -> str:
        kinds = [' class="n"' if place >= first else "" for place in range(len(cells))]
        return "<tr>" + "".join(f"<{tag}{kind}>{escape(cell)}</{tag}>" for cell, kind in zip(cells, kinds, strict=True)) + "</tr>"

    top = f"<thead>{line(head, 'th')}</thead>" if any(head) else ""
    return f'<div class="scroll"><table>{top}<tbody>{"".join(line(row, "td") for row in rows)}</tbody></table></div>'


def figures(kind: str, drawn: Sequence[Figure]) -> str:
    """Figures, each with its label as caption; kind: charts or shapes."""
    parts = []
    for figure in drawn:
        label = escape(str(figure.get_label()))
        name, _, rest = label.partition(panels.SPACE)
        caption = f"{name} <span>{rest}</span>" if rest else label
        picture = re.sub(r"<svg [^>]*(viewBox=\"[^\"]*\")[^>]*>", rf'<svg \1 role="img" aria-label="{label}">', as_svg(figure))
        parts.append(f"<figure><figcaption>{caption}</figcaption>{picture}</figure>")
    return f'<div class="{kind}">{"".join(parts)}</div>'
