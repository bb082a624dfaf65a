"""The tables of docs/contact.md: impact velocity by grid with contact of cover and cargo, and what the contact costs.

python -m benchmarks.contact        about two minutes
"""

from __future__ import annotations

import softbrake
from benchmarks.reproduction import CONFIGS, table
from softbrake.summary import Summary

SCENES = (
    ("no belts, damping 0.0005 s/m", ("belts.count=0", "pressure.damping=0.0005")),
    ("no belts, no damping", ("belts.count=0",)),
    ("belts 1 mm, damping 0.0005 s/m", ("belts.width=1 mm", "pressure.damping=0.0005")),
    ("belts 16.667 mm, damping 0.0005 s/m", ("pressure.damping=0.0005",)),
    ("belts 16.667 mm, no damping", ()),
)
GRIDS = ((18, 24), (36, 24), (72, 24), (144, 24), (36, 90), (72, 180))


def impact(*overrides: str) -> Summary:
    """Return the answer of the paper's drop with contact of all parts."""
    return softbrake.run(softbrake.load_case(CONFIGS / "paper.yaml", ["contact=[ground, cover, cargo]", *overrides]))


def main() -> None:
    """Print the tables."""
    lines = []
    for name, overrides in SCENES:
        line = [name]
        for generatrix, hoop in GRIDS:
            try:
                velocity = impact(*overrides, f"grid.generatrix={generatrix}", f"grid.hoop={hoop}").impact_velocity
                line.append("–" if velocity is None else f"{velocity:.4f}")
            except softbrake.Diverged:
                line.append("diverged")
        lines.append(line)
    table(["impact velocity, m/s", *(f"{generatrix} x {hoop}" for generatrix, hoop in GRIDS)], lines)
    print()
    lines = []
    for contact in ("ground", "[ground, cover, cargo]"):
        early = impact("belts.count=0", f"contact={contact}", "time.end=5 ms")
        whole = impact("belts.count=0", f"contact={contact}")
        lines.append([contact, *(f"{1e9 * run.kernel_seconds / run.steps / (37 * 90):.1f}" for run in (early, whole))])
    table(["ns per node and step, 36 x 90, no belts", "first 5 ms", "whole drop"], lines)


if __name__ == "__main__":
    main()
