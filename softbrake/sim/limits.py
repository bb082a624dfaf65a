"""Whether an answer keeps the limits of its case, and by how much."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from softbrake.case.sections.limits import Limit
from softbrake.sim.summary import Summary


@dataclass(frozen=True)
class Verdict:
    """What an answer is to a limit. A run without an answer that can be relied on keeps none."""

    limit: Limit
    answer: float | None  # SI; None where there is none
    fault: str | None  # why there is none
    error: float | None = None  # SI, numerical, of the answer; inf where it has no bound, None where it was not asked for

    @property
    def margin(self) -> float | None:
        """How far the answer is on the right side of the limit, SI."""
        if self.answer is None:
            return None
        return (self.limit.value - self.answer) * (1.0 if self.limit.at_most else -1.0)

    @property
    def share(self) -> float | None:
        """The margin over the limit; None of a limit of 0."""
        return None if self.margin is None or self.limit.value == 0.0 else self.margin / self.limit.value

    @property
    def holds(self) -> bool:
        """Whether the answer keeps the limit."""
        return self.margin is not None and self.margin >= 0.0

    @property
    def within_error(self) -> bool:
        """Whether the numerical error is larger than the margin, and may turn the verdict."""
        return self.margin is not None and self.error is not None and self.error > abs(self.margin)


def judge(limits: Iterable[Limit], summary: Summary | Mapping[str, Any]) -> list[Verdict]:
    """Hold an answer, or its fields as a journal keeps them, against limits."""
    fields = vars(summary) if isinstance(summary, Summary) else summary
    return [Verdict(limit, *_answer(limit, fields), _error(limit, fields)) for limit in limits]


def no_answer(limits: Iterable[Limit], fault: str) -> list[Verdict]:
    """The verdicts on a run without any answer."""
    return [Verdict(limit, None, fault) for limit in limits]


def unreliable(name: str, outcome: str, rested: bool, doubt: str | None, end: float) -> str | None:
    """Say why an answer of a run cannot be relied on; None where it can. rested: whether it has a rest time; end: s."""
    stood = outcome in ("stopped", "rebound") or rested
    if outcome in ("diverged", "interrupted"):
        return f"the run is {outcome}" if outcome == "interrupted" else "the run has diverged"
    if outcome == "time_limit" and (not stood or name == "rebound_velocity"):
        wanted = "rebound" if name == "rebound_velocity" else "stop"
        return f"neither impact nor {wanted} by {end:g} s"
    return doubt


def meaning_of_none(name: str, hoop: float | None) -> float | None:
    """The answer of a run that has none of a name, SI: 0 of one that stops above the ground or does not rebound; no tension
    has any margin. hoop: N/m, its peak hoop tension, None where it has no shell."""
    if name in ("impact_velocity", "rebound_velocity"):
        return 0.0
    return math.inf if name.endswith("_margin") and hoop is not None else None


def _answer(limit: Limit, fields: Mapping[str, Any]) -> tuple[float | None, str | None]:
    """What a limit bounds, SI, or why there is nothing."""
    outcome, name = fields["outcome"], limit.name
    if (why := unreliable(name, outcome, fields["rest_time"] is not None, fields["doubt"], fields["end_time"])) is not None:
        return None, why
    value: float | str | None = fields["limit_peaks"].get(limit.column) if limit.cfc is not None else fields[name]
    if isinstance(value, str):
        return None, value
    if value is None:
        value = meaning_of_none(name, fields["peak_tension_hoop"])
    return value, f"the run has no {name.replace('_', ' ')}" if value is None else None


def _error(limit: Limit, fields: Mapping[str, Any]) -> float | None:
    """Numerical error of what a limit bounds; of a peak behind a class that of the answer."""
    if limit.name == "impact_velocity":
        return fields["impact_velocity_error"]  # type: ignore[no-any-return]
    errors = fields["peak_errors"] or {}
    if limit.name not in errors:
        return None
    return math.inf if errors[limit.name] is None else errors[limit.name]
