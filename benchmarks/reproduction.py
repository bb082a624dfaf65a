"""The tables of docs/validation/reproduction.md: the paper's rows beside ours, and what each choice it leaves open does to them.

python -m benchmarks.reproduction        half a minute to two minutes
"""

from __future__ import annotations

from pathlib import Path

from softbrake import load_case
from softbrake.core.arrays import Outcome
from softbrake.core.columns import History
from softbrake.sim.result_file import tension_scale
from softbrake.sim.simulation import Simulation

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
CASES = {"paper.yaml": CONFIGS / "paper.yaml", "paper-narrow-belts.yaml": CONFIGS / "paper-narrow-belts.yaml"}
PAPER_ROWS = (  # time (s), V (m/s), height over l1, largest dimensionless T22, of section 4
    (0.0025, 6.018, 0.975, 6.099),
    (0.052, 5.359, 0.5, None),
    (0.101, 4.503, 0.1, 1.706),
    (0.125, 4.04476, 0.0, None),
)
PAPER_IMPACTS = {"20": 4.04476, "18.75": 3.88157, "15": 3.76559}  # E (kN/m): impact velocity (m/s)
CHOICES = (
    ("as in the file", ()),
    ("viscosity 0.02 N s/m", ("fabric.viscosity=0.02",)),
    ("viscosity 1 N s/m", ("fabric.viscosity=1",)),
    ("damping of (2.11) 0", ("pressure.damping=0",)),
    ("damping of (2.11) 0.0005 s/m", ("pressure.damping=0.0005",)),
    ("damping of (2.11) 0.002 s/m", ("pressure.damping=0.002",)),
    ("belt width 1 mm", ("belts.width=1 mm",)),
    ("belt width 5 mm", ("belts.width=5 mm",)),
    ("belt width 16.667 mm", ("belts.width=16.667 mm",)),
    ("no belts", ("belts.count=0",)),
    ("slack: compression", ("fabric.slack=compression",)),
    ("law: nominal_tension", ("fabric.law=nominal_tension",)),
    ("contact: ground, without (2.5)", ("contact=ground",)),
    ("G12 2 % of E", ("fabric.G12=400",)),
    ("Courant 0.9", ("time.courant=0.9",)),
    ("Courant 0.1", ("time.courant=0.1",)),
    ("grid 24 x 60", ("grid.generatrix=24", "grid.hoop=60")),
    ("grid 54 x 136", ("grid.generatrix=54", "grid.hoop=136")),
    ("scheme: cell, (3.2) as printed", ("model.scheme=cell",)),
)


def rows(path: Path, *overrides: str) -> list[str]:
    """Cells of a line: V, height over l1 and dimensionless T22 at the paper's times, then impact time and velocity."""
    case = load_case(path, overrides)
    drop = Simulation(case)
    scale = tension_scale(case)
    found = []
    outcome = Outcome.RUNNING
    for time, *_ in PAPER_ROWS[:-1]:
        while outcome == Outcome.RUNNING and drop.now(History.TIME) < time:
            _, outcome = drop.advance(until=time)
        if outcome == Outcome.RUNNING:
            belt, hoop = drop.now(History.TENSION_BELT) / scale, drop.now(History.TENSION_HOOP) / scale
            height = drop.now(History.HEIGHT) / case.shell.height
            found.append(f"{-drop.now(History.VELOCITY):.3f}, {height:.3f}, {max(belt, hoop):.2f}")
        else:
            found.append("–")
    while outcome == Outcome.RUNNING:
        _, outcome = drop.advance()
    end = f"{drop.now(History.TIME):.4f}"
    impact = f"{-drop.now(History.VELOCITY):.3f}" if outcome == Outcome.IMPACT else outcome.name.lower()
    return [*found, end, impact]


def table(head: list[str], lines: list[list[str]]) -> None:
    """Print a table in Markdown."""
    for line in (head, ["---"] * len(head), *lines):
        print("| " + " | ".join(line) + " |", flush=True)


def against_paper(modulus: str, impact: str) -> str:
    """Return an impact velocity (m/s) and its deviation from the paper's."""
    return f"{impact} ({100 * (float(impact) / PAPER_IMPACTS[modulus] - 1):+.1f} %)"


def main() -> None:
    """Print the tables."""
    head = [f"V, H/l1, T22 at {1e3 * time:g} ms" for time, *_ in PAPER_ROWS[:-1]] + ["end, s", "impact, m/s"]
    print("The paper's rows\n")
    paper = [f"{v:.3f}, {h:.3f}" + (f", {t:.2f}" if t else "") for _, v, h, t in PAPER_ROWS[:-1]] + ["0.1250", "4.045"]
    lines = [["paper, E = 20 kN/m", *paper]]
    found = {(name, modulus): rows(path, f"fabric.E={modulus} kN/m") for name, path in CASES.items() for modulus in PAPER_IMPACTS}
    lines += [[f"{name}, E = {modulus} kN/m", *cells] for (name, modulus), cells in found.items()]
    table(["", *head], lines)
    print("\nImpact velocity against the paper's\n")
    lines = [[name, *(against_paper(e, found[name, e][-1]) for e in PAPER_IMPACTS)] for name in CASES]
    for viscosity in (0.02, 0.1, 0.5, 1.0):
        line = [f"paper-narrow-belts.yaml, viscosity {viscosity} N s/m"]
        for e in PAPER_IMPACTS:
            cells = rows(CASES["paper-narrow-belts.yaml"], f"fabric.E={e} kN/m", f"fabric.viscosity={viscosity}")
            line.append(against_paper(e, cells[-1]))
        lines.append(line)
    table(["", *(f"E = {e} kN/m (paper {v})" for e, v in PAPER_IMPACTS.items())], lines)
    for name, path in CASES.items():
        print(f"\nWhat the open choices do, {name}\n")
        table(["choice", *head], [[label, *rows(path, *overrides)] for label, overrides in CHOICES])


if __name__ == "__main__":
    main()
