"""Are answers for a tolerance within it? The tables of docs/fidelity.md.

python -m benchmarks.ladder [--short] [--json FILE]     five minutes, short half a minute
python -m benchmarks.ladder --references                computes what is missing in benchmarks/ladder.json; half an hour for all

Each scene is climbed for each tolerance, and the answer held against a reference on a grid at least twice as fine as any that a
climb may take: the axisymmetric shell of 10 000 hoop cells where the full shell stays round, an ensemble of full shells where it
does not. Two scenes run at a time, one a core.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

import softbrake
from benchmarks.reproduction import CONFIGS, table
from softbrake.case import Case
from softbrake.drop import Drop
from softbrake.ladder import COURANT, OUT_OF_ROUND, SEEDS, allowed, climb, level, reached, speed_of
from softbrake.state import History, Outcome

REFERENCES = Path(__file__).with_suffix(".json")
TOLERANCES = (0.05, 0.02, 0.01, 0.005)
BUDGET = 10.0  # s a climb
ROUND = 10_000  # cells around the hoop
FINE = 576  # cells along the generatrix of an axisymmetric reference
FINE_FULL = 108  # of a full one
WITNESS = 72  # of the full shell that says which of them it is to be
ENSEMBLE = 8  # two of each seed
CORES = 2
SHORT = ("no belts", "belts 1 mm, damped", "belts 16.667 mm", "flat", "tension field", "the cargo stops")
NONE = "belts.count=0"
DAMPED = "pressure.damping=0.0005"
FIELD = "fabric.law=tension_field"
SMALL = ("shell.diameter=0.3", "cargo.velocity=4", "fabric.E=8 kN/m", "fabric.viscosity=0.05", NONE)
LARGE = (
    "shell={diameter: 2, height: 1.5}",
    "cargo={mass: 1500, velocity: 8}",
    "pressure.value=9670",
    "fabric.E=60 kN/m",
    "fabric.areal_density=0.2",
    "fabric.viscosity=2",
)
SCENES: dict[str, tuple[str, ...]] = {  # changes of configs/paper.yaml with contact of ground, cover and cargo
    "no belts": (NONE,),
    "no belts, damped": (NONE, DAMPED),
    "belts 1 mm": ("belts.width=1 mm",),
    "belts 1 mm, damped": ("belts.width=1 mm", DAMPED),
    "belts 16.667 mm": (),
    "belts 16.667 mm, damped": (DAMPED,),
    "fifteen belts of 2 mm, damped": ("belts.count=15", "belts.width=2 mm", "belts.layers=2", "pressure.damping=0.001"),
    "contact: paper": ("contact=paper",),
    "contact: paper, belts 1 mm, damped": ("contact=paper", "belts.width=1 mm", DAMPED),
    "contact: ground, no belts, damped": ("contact=ground", NONE, "pressure.damping=0.002"),
    "contact: ground, belts 5 mm, damped": ("contact=ground", "belts.width=5 mm", "pressure.damping=0.002"),
    "narrow cargo": ("cargo.diameter=0.2", NONE, DAMPED),
    "friction": ("friction=0.3", "belts.width=1 mm"),
    "tension field": (FIELD, NONE),
    "tension field, belts 16.667 mm": (FIELD,),
    "compression": ("fabric.slack=compression", NONE),
    "contact: paper, compression, damped": ("contact=paper", "fabric.slack=compression", NONE, DAMPED),
    "shear 2 % of E": ("fabric.G12=400", NONE),
    "viscosity 1 N s/m": ("fabric.viscosity=1", NONE),
    "viscosity 0.02 N s/m, damped": ("fabric.viscosity=0.02", NONE, "pressure.damping=0.002"),
    "nominal tension": ("fabric.law=nominal_tension", NONE),
    "twice as stiff along the generatrix": ("fabric.E11=40 kN/m", NONE),
    "stiff": ("fabric.E=100 kN/m", NONE),
    "soft": ("fabric.E=15 kN/m", NONE, DAMPED),
    "slow and light": ("cargo.mass=20", "cargo.velocity=3", "pressure.value=1000", "fabric.E=5 kN/m", NONE),
    "small": (*SMALL, "shell.height=0.3", "cargo.mass=10", "pressure.value=3600"),
    "small, tall, damped": (*SMALL, "shell.height=0.5", "cargo.mass=20", "pressure.value=4500", "pressure.damping=0.002"),
    "large": (*LARGE, NONE),
    "large, ten belts, damped": (*LARGE, "belts.count=10", "belts.width=10 mm", "belts.layers=2", "pressure.damping=0.001"),
    "flat": (
        "shell={diameter: 1, height: 0.4}",
        "cargo={mass: 200, velocity: 5}",
        "pressure.value=6500",
        "fabric.E=30 kN/m",
        "fabric.viscosity=0.5",
        NONE,
    ),
    "fast": (
        "shell={diameter: 1, height: 1}",
        "cargo={mass: 300, velocity: 10}",
        "pressure.value=14000",
        "fabric.E=50 kN/m",
        "fabric.areal_density=0.1",
        "fabric.viscosity=1",
        "belts.count=1",
        "belts.width=5 mm",
        "pressure.damping=0.001",
    ),
    "falling pressure": ("pressure={law: table, times: [0, 0.06, 0.2], values: [18e3, 14e3, 8e3]}", NONE),
    "the cargo stops": ("pressure.value=30000", "cargo.velocity=4", NONE),
    # The rules of the ladder were fixed before the following were tried.
    "later: two unlike belts, light": (
        "belts=[{height: 0.15, width: 8 mm, layers: 3}, {height: 0.4, width: 4 mm, layers: 6}]",
        "cargo.mass=60",
        "pressure.value=9500",
        "pressure.damping=0.0003",
    ),
    "later: low and wide": (
        "shell={diameter: 1.5, height: 0.8}",
        "cargo={mass: 800, velocity: 7}",
        "pressure.value=11000",
        "fabric.E=60 kN/m",
        "fabric.areal_density=0.1",
        "fabric.viscosity=1",
        "belts.count=2",
        "belts.width=20 mm",
        "belts.layers=3",
    ),
    "later: slender, tension field": (
        "shell={diameter: 0.4, height: 0.8}",
        "cargo={mass: 40, velocity: 5}",
        "pressure.value=4800",
        "fabric.E=12 kN/m",
        "fabric.viscosity=0.1",
        FIELD,
        "belts.count=1",
    ),
    "later: no Poisson effect, five belts": (
        "fabric.E22=30 kN/m",
        "fabric.nu12=0",
        "belts.count=5",
        "belts.width=3 mm",
    ),
    "later: belts 10 mm, viscous": ("belts.width=10 mm", "fabric.viscosity=0.5", "pressure.damping=0.001"),
    "later: contact: ground, tension field": ("contact=ground", FIELD, "belts.width=3 mm", "pressure.damping=0.001"),
    "later: narrow low cargo": ("cargo.diameter=0.3", "cargo.height=0.2", NONE),
}
DRAWN = 12  # scenes drawn by chance, once the rules had been mended on all the others


def draw(seed: int) -> tuple[str, ...]:
    """Return the changes of a scene drawn by chance: sizes, loads, stretch, belts, slack law, contact."""
    random = np.random.default_rng(seed)
    diameter, speed, pressure = random.uniform(0.3, 2.0), random.uniform(3.0, 10.0), 10.0 ** random.uniform(3.3, 4.5)
    height = diameter * random.uniform(0.5, 1.6)
    modulus = 0.5 * pressure * diameter / random.uniform(0.05, 0.25)  # hoops stretched by 5 to 25 %
    density = 0.05 * random.uniform(0.5, 4.0) * diameter
    fall = 0.5 * speed**2 + 9.80665 * height
    mass = 0.25 * math.pi * diameter**2 * pressure * height / (fall * random.uniform(0.6, 1.0))
    changes = [
        f"shell={{diameter: {diameter:.3g}, height: {height:.3g}}}",
        f"cargo={{mass: {mass:.3g}, velocity: {speed:.3g}}}",
        f"pressure={{law: constant, value: {pressure:.4g}, damping: {random.choice((0.0, 5e-4, 2e-3)):g}}}",
        f"fabric.E={modulus:.4g}",
        f"fabric.areal_density={density:.3g}",
        f"fabric.viscosity={random.uniform(0.005, 0.02) * math.sqrt(modulus * density) * height:.3g}",
        str(random.choice(("fabric.slack=cut", FIELD, "fabric.slack=compression"), p=(0.6, 0.3, 0.1))),
        f"belts.count={random.integers(0, 7)}",
        f"belts.layers={random.integers(1, 8)}",
        f"belts.width={height * random.uniform(0.002, 0.03):.3g}",
    ]
    contact = random.choice(("ground, cover, cargo", "ground"), p=(0.8, 0.2))
    return (*changes, f"contact=[{contact}]", "time.end=2")


SCENES |= {f"drawn: {seed}": draw(seed) for seed in range(1, DRAWN + 1)}


@dataclass(frozen=True)
class Reference:
    """What an answer is held against."""

    changes: list[str]  # of the scene it was computed for
    velocity: float  # m/s
    doubt: float  # m/s, twice the standard error of an ensemble's mean; 0 for the axisymmetric shell
    scatter: float  # m/s, twice the standard deviation of the ensemble
    fidelity: str
    generatrix: int


@dataclass(frozen=True)
class Run:
    """One climb."""

    scene: str
    tolerance: float
    claimed: bool  # that the answer is within the tolerance
    velocity: float  # m/s
    error_bar: float | None  # m/s, None for no bound
    error: float  # m/s, against the reference
    permitted: float  # m/s
    fidelity: str
    generatrix: int
    hoop: int
    seconds: float


def scene(name: str) -> Case:
    """Return a scene's case."""
    return softbrake.load_case(CONFIGS / "paper.yaml", ["contact=[ground, cover, cargo]", *SCENES[name]])


def out_of_round(case: Case, cells: int) -> float:
    """Return how far a disturbed full shell gets out of round before the end, over its radius."""
    radius = 0.5 * case.shell.diameter
    falling = Drop(level(case, "full", cells, 2 * cells))
    falling.disturb(SEEDS[0] * radius, 99)
    largest, outcome = 0.0, Outcome.RUNNING
    while outcome == Outcome.RUNNING:
        largest = max(largest, falling.lopsided() / radius)
        _, outcome = falling.advance(falling.now(History.TIME) + 1e-3)
    falling.finish(outcome)
    return largest


def fall(case: Case, courant: float, size: float, seed: int) -> float:
    """Return the impact velocity (m/s) of a fine full shell, its places disturbed by a size (m)."""
    falling = Drop(level(case, "full", FINE_FULL, 2 * FINE_FULL, courant))
    falling.disturb(size, seed)
    return speed_of(falling.run())


def refer(name: str) -> Reference:
    """Compute a scene's reference."""
    case, changes = scene(name), list(SCENES[name])
    if out_of_round(case, WITNESS) <= OUT_OF_ROUND:
        value = speed_of(softbrake.run(level(case, "axisymmetric", FINE, ROUND)))
        return Reference(changes, value, 0.0, 0.0, "axisymmetric", FINE)
    values = []
    for member in range(ENSEMBLE):
        seed = SEEDS[member % len(SEEDS)] * 0.5 * case.shell.diameter
        try:
            values.append(fall(case, COURANT, seed, 1000 + member))
        except softbrake.Diverged:
            values.append(fall(case, 0.5 * COURANT, seed, 1000 + member))
    scatter = 2.0 * statistics.stdev(values)
    return Reference(changes, statistics.mean(values), scatter / math.sqrt(len(values)), scatter, "full", FINE_FULL)


def known() -> dict[str, Reference]:
    """Return the references kept of scenes as they are now."""
    kept = json.loads(REFERENCES.read_text(encoding="utf-8")) if REFERENCES.exists() else {}
    return {name: Reference(**kept[name]) for name in SCENES if name in kept and kept[name]["changes"] == list(SCENES[name])}


def run(name: str, tolerance: float, budget: float, reference: Reference) -> Run:
    """Climb a scene for a tolerance."""
    case = scene(name)
    found = climb(case, tolerance, budget)
    summary, grid = found.summary, found.case.grid
    if found.case.model.fidelity == reference.fidelity and 2 * grid.generatrix > reference.generatrix:
        raise ValueError(f"'{name}': the reference of {reference.generatrix} cells is not far beyond {grid.generatrix}")
    value = speed_of(summary)
    return Run(
        scene=name,
        tolerance=tolerance,
        claimed=reached(replace(case, tolerance=tolerance), summary),
        velocity=value,
        error_bar=summary.impact_velocity_error,
        error=abs(value - reference.velocity),
        permitted=allowed(tolerance, reference.velocity, summary.free_fall_velocity),
        fidelity=found.case.model.fidelity,
        generatrix=grid.generatrix,
        hoop=grid.hoop,
        seconds=summary.wall_seconds,
    )


def share(part: int, whole: int) -> str:
    """Return a part in percent."""
    return f"{100 * part / whole:.0f} %" if whole else "–"


def summarise(runs: list[Run], references: dict[str, Reference]) -> None:
    """Print a line a tolerance."""
    lines = []
    for tolerance in sorted({run.tolerance for run in runs}, reverse=True):
        of = [run for run in runs if run.tolerance == tolerance]
        claims = [run for run in of if run.claimed]
        honest = sum(run.error + references[run.scene].doubt <= run.permitted for run in claims)
        undecided = sum(abs(run.error - run.permitted) < references[run.scene].doubt for run in claims)
        bars = [run for run in of if run.error_bar is not None]
        covered = sum(run.error <= (run.error_bar or 0.0) for run in bars)
        typical = statistics.median(run.error / run.permitted for run in claims)
        seconds = (statistics.median(run.seconds for run in some) for some in (of, claims) if some)
        cells = [str(len(of)), str(len(claims)), f"{honest} ({share(honest, len(claims))})", str(undecided), f"{typical:.2g}"]
        lucky = sum(references[run.scene].scatter > run.permitted for run in claims)
        cells += [str(lucky), f"{covered} of {len(bars)}", str(len(of) - len(claims)), *(f"{median:.2f}" for median in seconds)]
        lines.append([f"{100 * tolerance:g} %", *cells])
    head = [
        "tolerance",
        "scenes",
        "claims",
        "within",
        "undecided",
        "median error/allowed",
        "but one drop scatters more",
        "error bar holds",
        "say they cannot",
    ]
    table([*head, "median s", "of claims"], lines)


def list_scenes(runs: list[Run], references: dict[str, Reference]) -> None:
    """Print a line a scene: the reference, and for each tolerance error against it, error bar, level and grid."""
    tolerances = sorted({run.tolerance for run in runs}, reverse=True)
    lines = []
    for name in {run.scene: None for run in runs}:
        reference = references[name]
        line = [name, f"{reference.velocity:.4f}" + (f" ± {reference.doubt:.2g}" if reference.doubt else "")]
        for run in (run for run in runs if run.scene == name):
            bar = "–" if run.error_bar is None else f"{run.error_bar:.2g}"
            told = abs(run.error - run.permitted) >= reference.doubt
            verdict = "" if not run.claimed else " undecided" if not told else " ok" if run.error <= run.permitted else " WRONG"
            line.append(f"{run.error:.2g} ± {bar}, {run.fidelity[:4]} {run.generatrix}, {run.seconds:.1f} s{verdict}")
        lines.append(line)
    table(["scene", "reference, m/s", *(f"{100 * tolerance:g} %: error, bar" for tolerance in tolerances)], lines)


def costs(short: bool) -> dict[str, list[tuple[int, float]]]:
    """Measure seconds of one run by cells along the generatrix, of both levels."""
    found = {}
    for fidelity, grids in (("axisymmetric", (36, 72, 144, 288)), ("full", (18, 36, 72))):
        cases = [level(scene("no belts"), fidelity, n1, ROUND if fidelity == "axisymmetric" else 2 * n1) for n1 in grids]
        most = 3 if short else len(grids)
        softbrake.run(cases[0])  # compiles
        found[fidelity] = [(n1, softbrake.run(case).kernel_seconds) for n1, case in zip(grids[:most], cases[:most], strict=True)]
    return found


def print_costs(found: dict[str, list[tuple[int, float]]]) -> None:
    """Print seconds and the power of the grid by which they rise."""
    lines = []
    for fidelity, rows in found.items():
        power = statistics.linear_regression([math.log(n1) for n1, _ in rows], [math.log(s) for _, s in rows]).slope
        lines.append([fidelity, ", ".join(f"{n1}: {seconds:.3g}" for n1, seconds in rows), f"{power:.1f}"])
    table(["no belts", "seconds by cells along the generatrix", "power"], lines)


def climbed(task: tuple[str, float, float, Reference]) -> Run:
    """Run one climb in a process of its own."""
    return run(*task)


def main(arguments: Iterable[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--short", action="store_true", help="six scenes, two tolerances")
    parser.add_argument("--json", type=Path, help="file for all runs")
    parser.add_argument("--references", action="store_true", help="compute the references that are missing")
    asked = parser.parse_args(arguments)
    with ProcessPoolExecutor(CORES) as pool:
        if asked.references:
            kept = known()
            missing = [name for name in SCENES if name not in kept]
            kept |= dict(zip(missing, pool.map(refer, missing), strict=True))
            text = {name: asdict(kept[name]) for name in SCENES}
            REFERENCES.write_text(json.dumps(text, indent=2) + "\n", encoding="utf-8")
            return
        references = known()
        names, tolerances = (SHORT, (0.05, 0.01)) if asked.short else (tuple(SCENES), TOLERANCES)
        if missing := [name for name in names if name not in references]:
            parser.error(f"no reference of {', '.join(missing)}: --references computes it")
        tasks = [(name, tolerance, BUDGET, references[name]) for name in names for tolerance in tolerances]
        runs = list(pool.map(climbed, tasks))
    found = costs(asked.short)
    summarise(runs, references)
    print()
    print_costs(found)
    print()
    list_scenes(runs, references)
    if asked.json is not None:
        asked.json.write_text(json.dumps({"runs": [asdict(run) for run in runs], "costs": found}, indent=2), encoding="utf-8")


if __name__ == "__main__":
    main()
