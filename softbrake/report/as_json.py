"""What the commands print for programs: JSON in SI units, null for numbers that are not finite."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from softbrake.report.words import TENSIONS
from softbrake.sim.limits import Verdict
from softbrake.sim.summary import Inflation, Summary

if TYPE_CHECKING:
    from softbrake.case.full_stop import FullStop
    from softbrake.studies.calibration import Calibration
    from softbrake.studies.comparison import Comparison
    from softbrake.studies.feasible_design import DesignFound, DesignProblem
    from softbrake.studies.inverse_design import DesignAnswer, Question

DESIGN_ANSWERS = ("outcome", "impact_velocity", "lowest_height", "peak_deceleration")  # of each point of a search


def summary_json(summary: Summary, tension_scale: float | None = None, verdicts: Sequence[Verdict] = ()) -> str:
    """The summary as one JSON object; numbers that are not finite become null.

    With `tension_scale` (N/m) it has one more member, `dimensionless`: the scale and the peak tensions divided by it. With
    verdicts it has `limits`, and `pass`: whether all hold.
    """
    answer = asdict(summary)
    if tension_scale is not None:
        peaks = {name: answer[name] for name in (f"peak_tension_{tension}" for tension in TENSIONS)}
        answer["dimensionless"] = {"tension_scale": tension_scale} | {
            name: None if value is None else value / tension_scale for name, value in peaks.items()
        }
    if verdicts:
        answer["limits"] = [_verdict(each) for each in verdicts]
        answer["pass"] = all(each.holds for each in verdicts)
    return json.dumps(_finite(answer), indent=2, allow_nan=False)


def _verdict(each: Verdict) -> dict[str, Any]:
    limit = each.limit
    about = {"name": limit.name, "cfc": limit.cfc, "at_most" if limit.at_most else "at_least": limit.value}
    names = ("answer", "margin", "share", "error", "holds", "within_error", "fault")
    return about | {name: getattr(each, name) for name in names}


def row_json(row: dict[str, float]) -> str:
    """The last history row of a run that did not finish, as one JSON object."""
    return json.dumps(_finite({"outcome": "unfinished", "last_row": row}), indent=2, allow_nan=False)


def line_json(row: dict[str, Any]) -> str:
    """One run of a sweep as one JSON object on one line."""
    return json.dumps(_finite(row), allow_nan=False)


def inflation_json(inflation: Inflation) -> str:
    """The static inflation as one JSON object."""
    return json.dumps(asdict(inflation), indent=2, allow_nan=False)


def design_json(question: Question, stop: tuple[FullStop, list[tuple[float, Summary]]] | None, found: DesignAnswer) -> str:
    """A search as one JSON object, SI units. stop: of `piston`; None of a case with gas."""
    keys = DESIGN_ANSWERS
    piston = None
    if stop is not None:
        energy, tried = stop
        pistons = [{"peak_time": when} | {key: getattr(summary, key) for key in keys[:3]} for when, summary in tried]
        piston = asdict(energy) | {"piston": pistons}
    answers = {
        "section_2_2": piston,
        "find": question.path,
        "unit": question.unit,
        "target": {"name": question.target.name, "value": question.target.value},
        "value": found.value,
        "error": found.error,
        "error_reason": found.basis,
        "missed": found.missed or None,
        "bracket": found.bracket,
        "other_crossings": found.others,
        "points": [
            {"value": point.value, "fault": point.fault or None}
            | {key: getattr(point.summary, key, None) for key in (*keys, question.target.name)}
            for point in found.points
        ],
        "summary": asdict(found.summary),
    }
    return json.dumps(_finite(answers), indent=2, allow_nan=False)


def feasible_json(problem: DesignProblem, found: DesignFound) -> str:
    """A search under bounds as one JSON object, SI units; the nearest design where none meets all bounds."""
    meeting = found.meeting
    keys = dict.fromkeys([*DESIGN_ANSWERS, *(bound.name for bound in problem.bounds)])
    variables, bounds = [], []
    for k, each in enumerate(problem.variables):
        values = [one.values[k] for one in meeting]
        variables.append(
            {"path": each.path, "unit": each.unit, "low": each.low, "high": each.high, "value": found.best.values[k]}
            | {"meeting": [min(values), max(values)] if values else None}
        )
    for k, bound in enumerate(problem.bounds):
        bounds.append(
            {"name": bound.name, "at_most": bound.value, "answer": getattr(found.summary, bound.name)}
            | {"margin": found.margins[k], "error": found.errors[k], "claimed": found.claimed(k)}
        )
    answers = {
        "meets": found.best.meets and not found.missed,
        "find": variables,
        "targets": bounds,
        "error_reason": found.basis,
        "missed": found.missed or None,
        "designs_tried": len(found.tried),
        "designs_meeting": len(meeting),
        "points": [
            {"values": one.values, "margins": one.margins or None, "fault": one.fault or None}
            | {key: getattr(one.summary, key, None) for key in keys}
            for one in found.tried
        ],
        "summary": asdict(found.summary),
    }
    return json.dumps(_finite(answers), indent=2, allow_nan=False)


def comparison_json(found: Comparison) -> str:
    """A drop beside a test as one JSON object, SI units, without the curves."""
    quantities = [{key: value for key, value in asdict(each).items() if key != "pair"} for each in found.quantities]
    return json.dumps(_finite(asdict(found) | {"quantities": quantities}), indent=2, allow_nan=False)


def calibration_json(found: Calibration) -> str:
    """Inputs fitted to tests as one JSON object, SI units."""
    inputs = [
        {"path": each.variable.path, "unit": each.variable.unit, "low": each.variable.low, "high": each.variable.high}
        | {
            "value": each.value,
            "interval": each.interval,
            "why_not": each.why_not or None,
            "grid": each.grid,
            "slope_error": error,
        }
        for each, error in zip(found.inputs, found.slope_errors, strict=True)
    ]
    channels = [
        {"test": each.test, "name": each.name, "quantity": each.quantity, "misfit": each.misfit, "scatter": each.scatter}
        | {"correlation": each.correlation, "samples": len(each.time)}
        | {"time": each.time.tolist(), "measured": each.measured.tolist(), "computed": each.computed.tolist()}
        for each in found.channels
    ]
    counted = ("shifts", "undetermined", "starts", "refined", "agreeing", "rivals", "drops", "faults")
    answer = {"inputs": inputs, "correlations": found.correlations.tolist(), "channels": channels}
    return json.dumps(_finite(answer | {name: getattr(found, name) for name in counted}), indent=2, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
