"""How much each input of a case moves the answer: central differences, at steps as wide as the scatter of the answer asks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

from softbrake.batch import Dropped, run_batch
from softbrake.case import Case, CaseError, load_case, quantities
from softbrake.ladder import PEAKS, level
from softbrake.summary import Sensitivities, Sensitivity, Summary

ANSWERS = ("impact_velocity", *PEAKS)
STEPS = (0.005, 0.01, 0.02, 0.04, 0.08)  # relative, of an input; the first two always
ENOUGH = 0.05  # error of a change per 1 %, in %, at which the steps are wide enough

Half = dict[str, float]  # half the relative difference of the answers at +step and -step
Inputs = dict[str, float | tuple[float, ...]]


def sensitivities(
    file: str | Path,
    overrides: Sequence[str],
    base: Summary,
    report: Callable[[int, int, bool], None] | None = None,
) -> Sensitivities:
    """Relative changes of the answers of `base` per relative change of each quantity that the case file gives.

    Of each pair of runs at +h and -h counts half the difference: the smooth part of even order drops out. A straight line through
    0 and these halves over h, by least squares, has the change as its slope; what is off the lines of all inputs is the noise,
    whose effect on a slope is its error. As long as one is above ENOUGH and falls, the next of STEPS is tried; each answer takes
    the steps with the least error, for wide ones feel that the answer is no straight line.
    A case with a tolerance is run at the level and grid of `base`. report: told runs done, runs planned, and
    that the run was computed now.
    """
    inputs: Inputs = quantities(file, overrides)
    left_out: dict[str, str] = {}
    for path in inputs:
        try:
            for step in STEPS:
                _pair(file, overrides, base, path, inputs[path], step)
        except CaseError as fault:  # a ratio beyond its limit, or inputs that must fit each other
            left_out[path] = fault.faults[0].partition(": ")[2]
    varied = [path for path in inputs if path not in left_out]
    halves: dict[str, list[Half]] = {path: [] for path in varied}
    found, done = Sensitivities([], {}, {}, {}, left_out), 0
    for count, step in enumerate(STEPS, 1):
        cases = [case for path in varied for case in _pair(file, overrides, base, path, inputs[path], step)]
        answers = []
        for answer in run_batch(cases):
            answers.append(_answers(answer))
            done += 1
            if report is not None:
                report(done, len(cases) * max(2, count), True)
        for path, above, below in zip(varied, answers[::2], answers[1::2], strict=True):
            both = above.keys() & below.keys()
            half = {name: 0.5 * (above[name] - below[name]) / scale for name in both if (scale := getattr(base, name))}
            halves[path].append(half)
        if count > 1:
            found = _fit(STEPS[:count], inputs, halves, left_out)
            if all(error <= ENOUGH or found.steps[name] < step for name, error in found.errors.items()):
                break
    return found


def _answers(dropped: Dropped) -> Half:
    """Answers of a run as far as there are; none of one that diverged."""
    if dropped.fault is not None:
        return {}
    found = {name: getattr(dropped.summary, name) for name in ANSWERS}
    return {name: value for name, value in found.items() if value is not None}


def _pair(
    file: str | Path, overrides: Sequence[str], base: Summary, path: str, value: float | tuple[float, ...], step: float
) -> tuple[Case, Case]:
    """The case with one input larger and smaller by a relative step."""

    def varied(factor: float) -> Case:
        text = repr(value * factor) if isinstance(value, float) else repr([one * factor for one in value])
        case, model = load_case(file, [*overrides, f"{path}={text}"]), base.model
        if case.tolerance is None:
            return case
        return level(case, model.fidelity, model.generatrix, model.hoop, model.courant)  # type: ignore[arg-type]

    return varied(1.0 + step), varied(1.0 - step)


def _fit(steps: Sequence[float], inputs: Inputs, halves: dict[str, list[Half]], left_out: dict[str, str]) -> Sensitivities:
    """Slopes of each answer over as many of the steps as lose no slope and make its error least."""
    slopes: dict[str, dict[str, float | None]] = {path: dict.fromkeys(ANSWERS) for path in halves}
    errors, noise, widest = {}, {}, {}
    for name in ANSWERS:
        lines = [_lines(name, steps[:count], halves) for count in range(2, len(steps) + 1)]
        found, error, used = min(lines, key=lambda line: (-len(line[0]), line[1]))
        if not found:
            continue
        errors[name], widest[name] = error, used[-1]
        noise[name] = error * math.sqrt(2.0 * sum(step**2 for step in used))  # a half difference has 1/sqrt(2) of it
        for path, slope in found.items():
            slopes[path][name] = slope
    rows = [Sensitivity(path, inputs[path], changes) for path, changes in slopes.items()]
    rows.sort(key=lambda row: -next((abs(change) for change in row.changes.values() if change is not None), 0.0))
    return Sensitivities(rows, errors, noise, widest, left_out)


def _lines(name: str, steps: Sequence[float], halves: dict[str, list[Half]]) -> tuple[dict[str, float], float, Sequence[float]]:
    """Slopes by input of an answer, their standard error, and the steps."""
    square = sum(step**2 for step in steps)
    slopes: dict[str, float] = {}
    off = 0.0
    for path, found in halves.items():
        pairs = [(step, half[name]) for step, half in zip(steps, found, strict=False) if name in half]
        if len(pairs) == len(steps):  # an answer that is lost on the way, as where the cargo stops, has no slope
            slopes[path] = sum(step * half for step, half in pairs) / square
            off += sum((half - slopes[path] * step) ** 2 for step, half in pairs)
    free = len(slopes) * (len(steps) - 1)
    return slopes, math.sqrt(off / max(free, 1) / square), steps
