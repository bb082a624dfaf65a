"""Answers of a drop and what they shall be: a value, or a bound.

The cargo that stops above the ground has no impact velocity. To search across that boundary, velocities are compared as
energies per mass, V²/2, and below 0 stands what the shell could still have absorbed: see `kinetic`.
"""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches

from softbrake.case.case import Case
from softbrake.case.sections.limits import ANSWERS, EXAMPLES, lacking
from softbrake.case.units import Dimension, parse_quantity, unit_of, unit_size
from softbrake.sim.summary import Summary
from softbrake.studies.error_control import kinetic

TARGETS = {  # a margin and the lowest height are to be large: no search for a low answer has them as targets
    name: kind for name, kind in ANSWERS.items() if kind not in (Dimension.RATIO, Dimension.LENGTH, Dimension.TEMPERATURE)
}
NEAR = 1e-3  # of the target, by which the answer may be below it: an impact at a low speed changes much within a small range


@dataclass(frozen=True)
class Target:
    """An answer and the value it shall have or not exceed, in SI units."""

    name: str  # of TARGETS
    value: float
    unit: str = ""  # in which people gave the value; SI where they gave none
    at_most: bool = False  # whether lower answers do as well

    def __str__(self) -> str:
        return f"{self.name} {'<=' if self.at_most else '='} {self.in_unit(self.value, 'g')}"

    def in_unit(self, value: float, form: str = ".5g") -> str:
        """A value (SI) of the answer in the unit of the target."""
        kind = TARGETS[self.name]
        return f"{value / unit_size(self.unit or kind.unit, kind):{form}} {self.unit or kind.unit}"

    @property
    def is_speed(self) -> bool:
        """Whether it is compared as an energy."""
        return TARGETS[self.name] is Dimension.SPEED

    @property
    def near(self) -> float:
        """Scores up to this, either way, are of answers within NEAR of the target; 0 for a target of 0."""
        return NEAR * self.value ** (2 if self.is_speed else 1)

    def score(self, case: Case, summary: Summary) -> float:
        """What a search brings to 0: positive where the answer is above the target.

        A velocity V counts as V²/2 - target²/2. Where the cargo stops at a height h above the ground, it has lost
        V_0²/2 over the distance l1 - h, and at that mean deceleration could have lost h V_0²/(2 (l1 - h)) more: that, negative,
        stands for the V²/2 of an impact. Both are 0 at the boundary between impact and stop and change with the pressure alike
        there, as V itself, which rises like a square root, does not. A cargo that stood still counts as stopped at its lowest
        height, whether it rebounds or meets `time.end`. Raises ValueError where a run has no answer.
        """
        if not self.is_speed:
            answer: float = getattr(summary, self.name)
            return answer - self.value
        return self._energy(case, summary) - 0.5 * self.value**2

    def _energy(self, case: Case, summary: Summary) -> float:
        if self.name == "rebound_velocity":
            if summary.outcome == "time_limit":
                raise ValueError(f"neither impact nor rebound by {summary.end_time:g} s")
            return 0.5 * (summary.rebound_velocity or 0.0) ** 2
        if summary.impact_velocity is None and not summary.stood_still:
            raise ValueError(f"neither impact nor stop by {summary.end_time:g} s")
        return 0.5 * kinetic(case, summary)

    def margin(self, case: Case, summary: Summary) -> float:
        """How far the answer is below the target, over the target; of velocities their squares. Raises as `score`."""
        return -self.score(case, summary) / self.scale(case)

    def scale(self, case: Case) -> float:
        """Score of a margin of -1. A velocity of 0 is measured by that of the cargo at first contact."""
        return 0.5 * (self.value or case.cargo.velocity) ** 2 if self.is_speed else self.value

    def error(self, summary: Summary) -> float | None:
        """Numerical error of the score by the error bars of an answer; None where it has none."""
        if self.name != "impact_velocity":
            return (summary.peak_errors or {}).get(self.name)
        bar = summary.impact_velocity_error
        return None if bar is None else (summary.impact_velocity or 0.0) * bar + 0.5 * bar**2

    def answer(self, summary: Summary) -> str:
        """What a run gave, in words."""
        value: float | None = getattr(summary, self.name)
        if value is not None:
            return self.in_unit(value)
        if self.name == "rebound_velocity":
            return "no rebound"
        how = {"rebound": "rebounded from", "stopped": "stopped at"}.get(summary.outcome, "stood still, at the lowest at")
        return f"{how} a height of {summary.lowest_height:.4g} m"


def target_of(text: str, case: Case) -> Target:
    """Read ANSWER=VALUE or ANSWER<=VALUE. Raises ValueError where it is neither, or is no answer of the case."""
    relation = "<=" if "<=" in text else "="
    name, found, value = (part.strip() for part in text.partition(relation))
    if name not in TARGETS:
        close = get_close_matches(name, TARGETS, 1)
        hint = f"did you mean '{close[0]}'?" if close else f"known are {', '.join(TARGETS)}"
        raise ValueError(f"--target {text}: unknown answer '{name}'; {hint}")
    kind = TARGETS[name]
    try:
        number = parse_quantity(value, kind)
    except ValueError as error:
        example = f"{name}{found or '='}{EXAMPLES[kind].replace(' ', '')}"
        raise ValueError(f"--target {text}: {error}; {kind.phrase} such as {example} is expected") from None
    target = Target(name, number, unit_of(value), relation == "<=")
    if number < 0.0 or (target.at_most and number == 0.0 and not target.is_speed):
        least = ">" if target.at_most and not target.is_speed else ">="
        raise ValueError(f"--target {text}: {value} is out of range; {kind.phrase} {least} 0 is expected")
    if fault := lacking(target.name, case):
        raise ValueError(f"--target {text}: {fault}")
    return target
