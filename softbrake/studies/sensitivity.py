"""How much each input of a case moves the answer: central differences, at steps as wide as the scatter of the answer asks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from softbrake.case.case import Case
from softbrake.case.case_file import CaseError, CaseFile, Number
from softbrake.case.level import level
from softbrake.sim.result_file import ResultError, replace_summary
from softbrake.sim.summary import Sensitivities, Sensitivity, Summary
from softbrake.studies.batch import Dropped, run_batch
from softbrake.studies.error_control import PEAKS

ANSWERS = ("impact_velocity", *PEAKS)
WIDTHS = (0.005, 0.01, 0.02, 0.04, 0.08)  # relative, of an input; the first two always
NARROW = (0.001, 0.002)  # tried as well where one of the first two loses an answer
SMALL = 0.05  # error of a change per 1 %, in %, at which the steps are wide enough
Half = dict[str, float]  # half the relative difference of the answers at +step and -step
Inputs = dict[str, Number]


def with_sensitivities(
    file: CaseFile, summary: Summary, results: str | Path | None, report: Callable[[int, int, bool], None] | None = None
) -> Summary:
    """Return an answer with its sensitivities, which its result file then has too; `results_fault` tells where it has not."""
    found = replace(summary, sensitivity=sensitivities(file, summary, report))
    if results is not None and found.results_fault is None:
        try:
            replace_summary(results, found)
        except ResultError as error:
            return replace(found, results_fault=str(error))
    return found


def sensitivities(
    file: CaseFile,
    base: Summary,
    report: Callable[[int, int, bool], None] | None = None,
) -> Sensitivities:
    """Relative changes of the answers of `base` per relative change of each quantity that the case file gives.

    Of each pair of runs at +h and -h counts half the difference: the smooth part of even order drops out. A straight line through
    0 and these halves over h, by least squares, has the change as its slope; what is off the lines of all inputs, noise and what
    is left of curvature, is pooled, and its effect on a slope is its error. As long as one is above SMALL and falls, the next of
    WIDTHS is tried; each answer takes the steps with the least error, for wide ones feel that the answer is no straight line.
    An impact velocity V counts as V², of which V changes by half as much: near a full stop V itself is a straight line over no
    step. Where the cargo stops it has no value, and an input that stops it at the first steps is asked again at NARROW ones.
    A case with a tolerance is run at the level and grid of `base`. report: told runs done, runs planned, and
    that the run was computed now.
    """
    inputs: Inputs = file.quantities()
    left_out: dict[str, str] = {}
    for path in inputs:
        try:
            for step in WIDTHS:
                _pair(file, base, path, inputs[path], step)
        except CaseError as fault:  # a ratio beyond its limit, or inputs that must fit each other
            left_out[path] = fault.faults[0].partition(": ")[2]
    varied = [path for path in inputs if path not in left_out]
    halves: dict[str, dict[float, Half]] = {path: {} for path in varied}
    scales = {name: getattr(base, name) for name in ANSWERS} | {"impact_velocity": 2.0 * (base.impact_velocity or 0.0) ** 2}
    found, done = Sensitivities([], {}, {}, {}, left_out), 0
    steps: list[float] = []
    planned = list(WIDTHS)
    while planned:
        step = planned.pop(0)
        steps = sorted([*steps, step])
        cases = [case for path in varied for case in _pair(file, base, path, inputs[path], step)]
        answers = []
        for answer in run_batch(cases):
            answers.append(_answers(answer))
            done += 1
            if report is not None:
                report(done, len(cases) * max(2, len(steps)), True)
        for path, above, below in zip(varied, answers[::2], answers[1::2], strict=True):
            both = above.keys() & below.keys()
            halves[path][step] = {name: 0.5 * (above[name] - below[name]) / scales[name] for name in both if scales[name]}
        if len(steps) < 2:
            continue
        found = _fit(steps, inputs, halves, left_out)
        if len(steps) == 2 and any(row.changes[name] is None for row in found.inputs for name in ANSWERS if scales[name]):
            planned[:0] = NARROW
        elif step not in NARROW[:1] and all(e <= SMALL or found.steps[name] < steps[-1] for name, e in found.errors.items()):
            break
    return found


def _answers(dropped: Dropped) -> Half:
    """Answers of a run as far as there are, the impact velocity squared; none of one that diverged."""
    if dropped.fault is not None:
        return {}
    found = {name: value for name in ANSWERS if (value := getattr(dropped.summary, name)) is not None}
    return found | ({"impact_velocity": found["impact_velocity"] ** 2} if "impact_velocity" in found else {})


def _pair(file: CaseFile, base: Summary, path: str, value: Number, step: float) -> tuple[Case, Case]:
    """The case with one input larger and smaller by a relative step."""

    def varied(factor: float) -> Case:
        changed = value * factor if isinstance(value, float) else tuple(one * factor for one in value)
        case, model = file.vary({path: changed}), base.model
        if case.tolerance is None:
            return case
        return level(case, model.fidelity, model.generatrix, model.hoop, model.courant)  # type: ignore[arg-type]

    return varied(1.0 + step), varied(1.0 - step)


def _fit(steps: Sequence[float], inputs: Inputs, halves: dict[str, dict[float, Half]], left_out: dict[str, str]) -> Sensitivities:
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
    strength = next((name for name in ANSWERS if name in errors), ANSWERS[0])
    rows.sort(key=lambda row: -math.inf if (change := row.changes[strength]) is None else -abs(change))  # a lost answer first
    return Sensitivities(rows, errors, noise, widest, left_out)


def _lines(
    name: str, steps: Sequence[float], halves: dict[str, dict[float, Half]]
) -> tuple[dict[str, float], float, Sequence[float]]:
    """Slopes by input of an answer, their standard error, and the steps."""
    square = sum(step**2 for step in steps)
    slopes: dict[str, float] = {}
    off = 0.0
    for path, found in halves.items():
        pairs = [(step, half[name]) for step in steps if name in (half := found[step])]
        if len(pairs) == len(steps):  # an answer that is lost on the way, as where the cargo stops, has no slope
            slopes[path] = sum(step * half for step, half in pairs) / square
            off += sum((half - slopes[path] * step) ** 2 for step, half in pairs)
    free = len(slopes) * (len(steps) - 1)
    return slopes, math.sqrt(off / max(free, 1) / square), steps
