"""Map of the largest stable step: found by bisection over short runs, beside the step that is predicted.

The shell is inflated and its cover held, so that nothing moves but what the scheme itself makes grow. Disturbed by a hair, it
takes some hundred steps; they are too long if its velocities then flip from step to step and grow.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from softbrake.case.case import Case
from softbrake.sim.files import draft_of
from softbrake.sim.interrupt import held_interrupt
from softbrake.sim.relax import Held
from softbrake.sim.simulation import NotInflated, Simulation

HAIR = 1e-7  # of the shorter edge, the disturbance: far below what slackens taut fabric
STEPS_OF_A_RUN = 400
WINDOW = 4  # over which they are judged
GROWTH = 3.0  # of what flips from step to step, beyond its least
LOW, HIGH = 0.4, 2.5  # of the predicted step, where bisection starts
CLOSE = 0.005  # relative, where it ends
SEED = 1
Axis = tuple[str, Sequence[str]]  # path of a key of the case, and values as a file would write them


@dataclass(frozen=True)
class MapPoint:
    """One case of a map."""

    values: tuple[str, ...]  # of the axes
    predicted: float  # s, the stable step by the bound; nan where the shell finds no shape of rest
    found: float  # s, by bisection; nan also where it is not between LOW and HIGH of the predicted one
    trials: tuple[tuple[float, bool], ...]  # step (s) and whether it was stable
    courant: float  # of the case

    @property
    def edge_found(self) -> bool:
        """Whether bisection found the longest stable step."""
        return bool(np.isfinite(self.found))

    @property
    def ratio(self) -> float:
        """Predicted over found step: at most 1 if the bound is safe."""
        return self.predicted / self.found

    @property
    def shown(self) -> tuple[str, ...]:
        """Predicted and found step in us, and their ratio; or what was not found."""
        if not np.isfinite(self.predicted):
            return ("no shape of rest",)
        if not self.edge_found:
            kind = "no" if not self.trials[0][1] else "every"
            return f"{self.predicted * 1e6:.4g}", f"{kind} step stable from {LOW:g} to {HIGH:g} of it"
        return f"{self.predicted * 1e6:.4g}", f"{self.found * 1e6:.4g}", f"{self.ratio:.3f}"


def read_axes(texts: Sequence[str]) -> list[Axis]:
    """Return the axes of several texts. Raises ValueError."""
    axes = [read_axis(text) for text in texts]
    for number, (path, _) in enumerate(axes):
        if path in (other for other, _ in axes[:number]):
            raise ValueError(f"--over {path}: an axis twice; all its values are expected in one, {path}=A,B,...")
    return axes


def read_axis(text: str) -> Axis:
    """Return path and values of `PATH=A,B,...`; commas within brackets part no values. Raises ValueError."""
    path, _, given = text.partition("=")
    values = [value.strip() for value in re.split(r",(?![^\[{]*[\]}])", given)]
    if not path or not all(values):
        raise ValueError(f"--over {text}: not an axis; PATH=A,B,... such as fabric.viscosity=0,0.2,2 is expected")
    return path.strip(), values


def survey(
    load: Callable[[Sequence[str]], Case], axes: Sequence[Axis], report: Callable[[MapPoint], None] | None = None
) -> list[MapPoint]:
    """Find the stable step at every combination of the axes' values; load gives the case for overrides of its keys."""
    points = []
    for values in product(*(given for _, given in axes)):
        case = load([f"{path}={value}" for (path, _), value in zip(axes, values, strict=True)])
        points.append(replace(find_limit(case), values=values))
        if report is not None:
            report(points[-1])
    return points


def find_limit(case: Case) -> MapPoint:
    """Inflate the shell of a case by the largest pressure of its law, and bisect for the largest stable step."""
    pressure = case.filling.steady(case.filling.largest)
    # Inflated with steps below any limit; the bound then stands for the state, whatever the case's coefficient.
    drop = Simulation(replace(case.under(pressure), time=replace(case.time, courant=LOW)))
    none = MapPoint((), np.nan, np.nan, (), case.time.courant)
    try:
        drop.inflate()
    except NotInflated:
        return none
    start = [part.copy() for part in drop.state.nodes]
    is_stable(drop, LOW, steps=1)
    predicted = float(drop.state.stable_step[1])
    trials: list[tuple[float, bool]] = []

    def stable(part: float) -> bool:
        for values, inflated in zip(drop.state.nodes, start, strict=True):
            values[:] = inflated
        trials.append((part * predicted, is_stable(drop, part)))
        return trials[-1][1]

    low, high = LOW, HIGH
    if not stable(low) or stable(high):
        return replace(none, predicted=predicted, trials=tuple(trials))
    while high - low > CLOSE * low:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return replace(none, predicted=predicted, found=low * predicted, trials=tuple(trials))


def is_stable(drop: Simulation, courant: float, steps: int = STEPS_OF_A_RUN) -> bool:
    """Whether a hair's disturbance of a shell at rest dies or stays, in steps of a part of the predicted one.

    Raises KeyboardInterrupt between two steps.
    """
    with held_interrupt() as interrupted:
        return _is_stable(drop, courant, steps, interrupted)


def _is_stable(drop: Simulation, courant: float, steps: int, interrupted: Callable[[], bool]) -> bool:
    """As `is_stable`, told of Ctrl-C."""
    drop.disturb(HAIR * min(drop.model.fabric.h1, drop.model.fabric.h2), SEED)
    held = Held(drop.model._replace(courant=courant), drop.state, drop.step)
    least, last = np.inf, np.zeros(())
    for _ in range(-(-steps // WINDOW)):
        if interrupted():
            raise KeyboardInterrupt
        size = turn = 0.0
        for _ in range(WINDOW):
            push = held.push()
            if push is None:
                return False
            change = push.acceleration * push.length  # of the velocities: what flips from step to step stands out
            size += float(np.square(change).sum())
            turn += float((change * last).sum())
            last = change
        if turn < 0.0 and size > GROWTH**2 * least:  # before it is so large that fabric gets slack and saves it
            return False
        least = min(least, size)
    return True


def edge_in_words(point: MapPoint) -> str:
    """How far the case's own setting is from the edge."""
    if not np.isfinite(point.predicted):
        return "no stable step is defined: the shell finds no shape of rest"
    if not point.edge_found:
        return "no edge found: predicted us, " + ", ".join(point.shown)
    part = point.courant * point.ratio
    side = f"{1.0 - part:.1%} below" if part <= 1.0 else f"{part - 1.0:.1%} ABOVE"
    return (
        f"time.courant {point.courant:g}: steps of {point.courant * point.predicted * 1e6:.4g} us, {side} the edge found at "
        f"{point.found * 1e6:.4g} us; predicted {point.predicted * 1e6:.4g} us, {point.ratio:.3f} of it"
    )


def write_csv(points: Sequence[MapPoint], axes: Sequence[Axis], path: Path) -> None:
    """Write a row per point; what was not found is left empty."""
    with draft_of(path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow([*(name for name, _ in axes), "predicted_step_s", "found_step_s", "predicted_over_found"])
        for point in points:
            steps = f"{point.predicted:.6g}", f"{point.found:.6g}", f"{point.ratio:.4f}"
            rows.writerow([*point.values, *(step.replace("nan", "") for step in steps)])
