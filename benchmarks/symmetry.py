"""How fast a full shell loses its symmetry, and what that does to the answer: tables and picture of docs/validation/roundness.md.

python -m benchmarks.symmetry        writes docs/images/symmetry.png, a minute and a half
"""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

import softbrake
from benchmarks.reproduction import CONFIGS, table
from softbrake.case.case import Case
from softbrake.core.arrays import Floats, Outcome
from softbrake.core.columns import History
from softbrake.sim.simulation import Simulation
from softbrake.studies.error_control import level, speed_of

PICTURE = Path(__file__).resolve().parents[1] / "docs" / "images" / "symmetry.png"
CELLS = 36  # along the generatrix, and half of those around the hoop
TINY = 1e-12  # of the radius
SEWN = 1e-3
INTERVAL = 5e-4  # s, between looks
BELTS = {"no belts": "belts.count=0", "belts 1 mm": "belts.width=1 mm", "belts 16.667 mm": "belts.width=16.667 mm"}
SLACK = {"cut": "tab:blue", "tension field": "tab:green", "compression": "tab:red"}
SHEAR = {"0": 1.8, "2 % of E": 0.8}  # G12: width of its line
DAMPING = {"0": "-", "0.0005": "--"}  # s/m: style of its line
CONTACT = {"cover and cargo": "contact=[ground, cover, cargo]", "as in the paper": "contact=paper"}


class Growth(NamedTuple):
    """Course of a seed."""

    times: Floats  # s
    sizes: Floats  # of the radius, how far the shell is out of round
    impact: str  # m/s

    @property
    def largest(self) -> float:
        """Of the radius."""
        return float(self.sizes.max())

    @property
    def rate(self) -> float | None:
        """Growth rate (1/s), fitted between ten times the seed and a thousandth of the radius; None below a factor of 100."""
        if self.largest < 100.0 * TINY:
            return None
        first = int(np.argmax(self.sizes > 10.0 * TINY))
        above = self.sizes > SEWN
        last = int(np.argmax(above)) if above.any() else int(np.argmax(self.sizes)) + 1
        return float(np.polyfit(self.times[first:last], np.log(self.sizes[first:last]), 1)[0]) if last > first + 2 else None


def scene(belts: str, slack: str, shear: str, damping: str, contact: str) -> Case:
    """Return the paper's drop with these choices."""
    fabric = "fabric.law=tension_field" if slack == "tension field" else f"fabric.slack={slack}"
    choices = [BELTS[belts], fabric, f"pressure.damping={damping}", CONTACT[contact]]
    return softbrake.load_case(CONFIGS / "paper.yaml", [*choices, f"fabric.G12={'400' if shear != '0' else '0'}"])


def grow(case: Case, seed: float) -> Growth:
    """Drop a disturbed full shell and watch it get out of round until it is crushed; seed: of the radius."""
    radius = 0.5 * case.shell.diameter
    falling = Simulation(level(case, "full", CELLS, 2 * CELLS))
    falling.disturb(seed * radius, 1)
    times, sizes, outcome = [], [], Outcome.RUNNING
    while outcome == Outcome.RUNNING:
        times.append(falling.now(History.TIME))
        sizes.append(falling.lopsided() / radius)
        due = times[-1] + INTERVAL
        while outcome == Outcome.RUNNING and falling.now(History.TIME) < due:
            _, outcome = falling.advance(due)
    impact = "diverged" if outcome == Outcome.DIVERGED else f"{speed_of(falling.finish(outcome)):.3f}"
    return Growth(np.array(times), np.array(sizes), impact)


def axisymmetric(case: Case) -> str:
    """Impact velocity (m/s) of the axisymmetric shell on the same grid."""
    return f"{speed_of(softbrake.run(level(case, 'axisymmetric', CELLS, 2 * CELLS))):.3f}"


def draw(found: dict[tuple[str, ...], Growth]) -> None:
    """Draw the growth of the tiny seed with contact of cover and cargo."""
    figure = Figure(figsize=(11, 4.2), layout="constrained")
    panels = figure.subplots(1, len(BELTS), sharey=True)
    for panel, belts in zip(panels, BELTS, strict=True):
        for slack, shear, damping in product(SLACK, SHEAR, DAMPING):
            growth = found[belts, slack, shear, damping, "cover and cargo"]
            label = f"{slack}{', damped gas' if damping != '0' else ''}" if shear == "0" else None
            panel.semilogy(1e3 * growth.times, growth.sizes, DAMPING[damping], color=SLACK[slack], lw=SHEAR[shear], label=label)
        panel.set_title(belts)
        panel.set_xlabel("time, ms")
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("out of round, parts of the radius")
    panels[0].legend(fontsize=8, loc="upper left", title="thin: with shear, $G_{12}$ 2 % of E", title_fontsize=8)
    figure.savefig(PICTURE, dpi=130)


def growth_table() -> None:
    """Print growth rate and largest size of the tiny seed with contact of cover and cargo, and draw its course."""
    contact = "cover and cargo"
    found = {choice: grow(scene(*choice), TINY) for choice in product(BELTS, SLACK, SHEAR, DAMPING, (contact,))}
    draw(found)
    lines = []
    for belts, slack in product(BELTS, SLACK):
        cells = []
        for shear, damping in product(SHEAR, DAMPING):
            growth = found[belts, slack, shear, damping, contact]
            cells.append(("–" if growth.rate is None else f"{growth.rate:.0f}") + f", {growth.largest:.0e}")
        lines.append([belts, slack, *cells])
    table(["belts", "slack", *(f"G12 {shear}, damping {damping}" for shear, damping in product(SHEAR, DAMPING))], lines)


def slack_table() -> None:
    """Print what each slack law answers, axisymmetric and in full, disturbed a little and as sewing does."""
    lines = []
    for contact, belts, slack in product(CONTACT, BELTS, SLACK):
        case = scene(belts, slack, "0", "0.0005", contact)
        tiny, sewn = grow(case, TINY), grow(case, SEWN)
        rate = "–" if tiny.rate is None else f"{tiny.rate:.0f}"
        lines.append([contact, belts, slack, axisymmetric(case), tiny.impact, sewn.impact, rate, f"{sewn.largest:.0e}"])
    head = ["contact", "belts", "slack", "axisymmetric, m/s", "full, 1e-12", "full, 1e-3", "growth, 1/s", "1e-3 grows to"]
    table(head, lines)


def main() -> None:
    """Print the tables and draw the picture."""
    growth_table()
    print()
    slack_table()


if __name__ == "__main__":
    main()
