"""What a sweep found: results.csv, a row for each run, and its units."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from softbrake.case.sections.limits import LIMITS, limits_of
from softbrake.core.arrays import Floats
from softbrake.report.words import stops
from softbrake.sim.files import draft_of
from softbrake.sim.limits import judge, meaning_of_none, no_answer, unreliable
from softbrake.sim.summary import Summary
from softbrake.studies.chance import Chance, chance_of
from softbrake.studies.sampling import Sampling
from softbrake.studies.sweep import RESULTS, Plan, Record

UNITS = "results.units.csv"
PEAKS = ("peak_deceleration", "peak_tension_generatrix", "peak_tension_hoop", "peak_tension_belt")
GAS_PEAKS = ("peak_pressure", "peak_temperature")
TIMINGS = ("kernel_seconds", "wall_seconds")  # the last columns: all that two runs of one sweep may differ in
LEFT_OUT = ("title", "results", "results_fault", "trials", "sensitivity", "filtered")
MISSING = "not run, or lost with its worker"
MARGIN = "limit_margin_"  # in front of the name of an answer
SPREAD = ("impact_velocity", "peak_deceleration", "peak_tension_hoop")  # answers of which a sample gives the distribution
_JUDGED = ("rest_time", "end_time", "doubt", "peak_tension_hoop")  # fields that say whether a run has an answer
Row = dict[str, Any]

ANSWER_UNITS = {answer.name: answer.metadata["unit"] for answer in fields(Summary)}
PEAK_UNITS = {
    "_time": "s",
    "_height": "m",
    "_phase": "",
}  # of a peak; error and other phase have its unit


def rows(plan: Plan, records: Mapping[str, Record]) -> list[Row]:
    """A row for each run of a plan: its number and id, the axes, outcome and fault, all fields of its summary, and its margins.

    A margin is that of an answer to a limit of the case, SI; `pass` is 1 where all hold, else 0. None are there without limits.
    """
    table, limits = [], limits_of(plan.case.get(LIMITS.name, {}))
    for number, run in enumerate(plan.runs, 1):
        record = records.get(run.id, {"summary": None, "fault": MISSING})
        summary = record["summary"] or {}
        outcome = summary.get("outcome") or ("failed" if run.id in records else "missing")
        row = {"run": number, "id": run.id} | {axis.path: value for axis, value in zip(plan.axes, run.values, strict=True)}
        row |= {"outcome": outcome, "fault": record["fault"]} | _flat(summary)
        if limits:
            fault = record["fault"]
            verdicts = judge(limits, summary) if summary and not fault else no_answer(limits, fault)
            row |= {MARGIN + each.limit.column: each.margin for each in verdicts}
            row["pass"] = int(all(each.holds for each in verdicts))
        table.append(row)
    names = list(dict.fromkeys(name for row in table for name in row if name not in TIMINGS))
    return [{name: row.get(name) for name in (*names, *TIMINGS)} for row in table]


def _flat(summary: Mapping[str, Any]) -> Row:
    """Fields of a summary, those of its parts with the part's name in front."""
    flat: Row = {}
    for name, value in summary.items():
        if name == "peaks":
            for peak, found in value.items():
                flat |= {f"{peak}_{part}": found[part] for part in ("time", "height", "phase")}
                flat[f"{peak}_other"] = None if found["other"] is None else found["other"]["value"]
        elif name == "peak_errors":
            flat |= {f"{peak}_error": error for peak, error in (value or {}).items()}
        elif name == "vent_opening_times":
            flat |= {f"{name}_{number}": when for number, when in enumerate(value or ())}
        elif name == "limit_peaks":
            flat |= {peak: found for peak, found in value.items() if not isinstance(found, str)}
        elif isinstance(value, dict):
            for part, member in value.items():
                flat[f"{name}_{part}"] = ", ".join(member) if isinstance(member, list) else member
        elif name not in LEFT_OUT:
            flat[name] = value
    return flat


def numbers(table: Sequence[Mapping[str, Any]], name: str, scale: float = 1.0) -> Floats:
    """An answer of each run, NaN where there is none; rows as `rows` makes them, or as texts of results.csv.

    The impact velocity of a cargo that turns above the ground is 0.
    """

    def number(row: Mapping[str, Any]) -> float:
        if row["fault"]:
            return math.nan
        if name == "impact_velocity" and stops(row["outcome"], row.get("rest_time")):
            return 0.0
        value = row.get(name)
        return math.nan if value in (None, "") else float(value)

    return scale * np.array([number(row) for row in table])


def relied(table: Sequence[Mapping[str, Any]], name: str) -> Floats:
    """As `numbers`, of runs whose answer can be relied on, by the rules by which limits are judged; infinite without tension."""

    def number(row: Mapping[str, Any]) -> float:
        values = {key: None if row.get(key) == "" else row.get(key) for key in (name, *_JUDGED)}
        rested = values["rest_time"] is not None
        answer = name.partition("_cfc")[0]
        if row["fault"] or values["end_time"] is None:
            return math.nan
        if unreliable(answer, row["outcome"], rested, values["doubt"], float(values["end_time"])) is not None:
            return math.nan
        found = values[name]
        value = meaning_of_none(name, values["peak_tension_hoop"]) if found is None else float(found)
        return math.nan if value is None else value

    return np.array([number(row) for row in table])


def chance_in(sampling: Sampling, case: Mapping[str, Any], table: Sequence[Mapping[str, Any]]) -> Chance:
    """What the rows of a sampled sweep say; case: as its plan keeps it."""
    limits = limits_of(case.get(LIMITS.name, {}))
    names = dict.fromkeys((*SPREAD, *(limit.column for limit in limits)))
    answers = {name: relied(table, name) for name in names}
    margins = {limit.column: numbers(table, MARGIN + limit.column) for limit in limits}
    return chance_of(sampling, answers, margins)


def unit_of(column: str, plan: Plan) -> str:
    """SI unit of a column of the results; empty for numbers without one and words."""
    column = column.removeprefix(MARGIN)
    for axis in plan.axes:
        if axis.path == column:
            return axis.unit
    if column in ANSWER_UNITS:
        return str(ANSWER_UNITS[column])
    if column.startswith(("work_", "gas_")):
        return "J"
    if column.startswith("vent_opening_times_"):
        return "s"
    for peak in (*PEAKS, *GAS_PEAKS):
        if column.startswith(peak):
            return PEAK_UNITS.get(column.removeprefix(peak), str(ANSWER_UNITS[peak]))
    return ""


def write_results(folder: Path, plan: Plan, table: Sequence[Row]) -> None:
    """Write results.csv, and results.units.csv with the same header and the units below it."""
    names = list(table[0])
    for file, lines in ((RESULTS, [row.values() for row in table]), (UNITS, [[unit_of(name, plan) for name in names]])):
        with draft_of(folder / file) as draft, open(draft, "w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(names)
            writer.writerows(lines)


def failures(table: Sequence[Row]) -> list[str]:
    """A line for each run without an answer: its number, the values of its axes and the reason."""
    return [f"run {row['run']}: {row['fault']}" for row in table if row["fault"]]


def doubtful(table: Sequence[Row]) -> list[Row]:
    """Runs that came to their end though something made energy of nothing."""
    return [row for row in table if not row["fault"] and row["doubt"]]
