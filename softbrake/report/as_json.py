"""What the commands print for programs: JSON in SI units, null for numbers that are not finite."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from softbrake.report.words import TENSIONS
from softbrake.sim.summary import Inflation, Summary

if TYPE_CHECKING:
    from softbrake.case.full_stop import FullStop
    from softbrake.studies.inverse_design import DesignAnswer, Question


def summary_json(summary: Summary, tension_scale: float | None = None) -> str:
    """The summary as one JSON object; numbers that are not finite become null.

    With `tension_scale` (N/m) it has one more member, `dimensionless`: the scale and the peak tensions divided by it.
    """
    answer = asdict(summary)
    if tension_scale is not None:
        peaks = {name: answer[name] for name in (f"peak_tension_{tension}" for tension in TENSIONS)}
        answer["dimensionless"] = {"tension_scale": tension_scale} | {
            name: None if value is None else value / tension_scale for name, value in peaks.items()
        }
    return json.dumps(_finite(answer), indent=2, allow_nan=False)


def row_json(row: dict[str, float]) -> str:
    """The last history row of a run that did not finish, as one JSON object."""
    return json.dumps(_finite({"outcome": "unfinished", "last_row": row}), indent=2, allow_nan=False)


def line_json(row: dict[str, Any]) -> str:
    """One run of a sweep as one JSON object on one line."""
    return json.dumps(_finite(row), allow_nan=False)


def inflation_json(inflation: Inflation) -> str:
    """The static inflation as one JSON object."""
    return json.dumps(asdict(inflation), indent=2, allow_nan=False)


def design_json(question: Question, stop: tuple[FullStop, list[tuple[float, Summary]]], found: DesignAnswer) -> str:
    """A search as one JSON object, SI units."""
    energy, tried = stop
    keys = ("outcome", "impact_velocity", "lowest_height", "peak_deceleration", "rebound_velocity", "peak_pressure")
    answers = {
        "section_2_2": asdict(energy)
        | {"piston": [{"peak_time": when} | {key: getattr(summary, key) for key in keys[:3]} for when, summary in tried]},
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


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
