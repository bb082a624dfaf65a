"""Section `inflator`: gas that is fed into the bag."""

from __future__ import annotations

from dataclasses import dataclass

from softbrake.case.checker import Values
from softbrake.case.keys import Key
from softbrake.case.section import Draft, MayBeNone, Part
from softbrake.case.sections.gas import check_flow
from softbrake.case.units import Dimension


@dataclass(frozen=True)
class Inflator(Part):
    """Gas of the bag's kind, fed into it."""

    times: tuple[float, ...]  # s, increasing
    mass_flow: tuple[float, ...]  # kg/s, linear between the times and none outside of them
    temperature: float  # K


_TIMES = Key("times", Dimension.TIME, "increasing", "[0 s, 5 ms, 40 ms]", required=True, least=0, many=True)
_FLOW = Key(
    "mass_flow",
    Dimension.MASS_FLOW,
    "at the times; linear between, none outside",
    "[0 kg/s, 2.4 kg/s, 0 kg/s]",
    required=True,
    least=0,
    many=True,
)


class _InflatorSection(MayBeNone):
    def read(self, draft: Draft) -> Values:
        """A mass flow for each time."""
        values: Values = super().read(draft)
        node = draft.members.get(self.name)
        if node is not None and isinstance(node.value, dict):
            check_flow(draft, self.name)
            draft.table(node, self.name, values, _TIMES, _FLOW)
        return values

    def written(self, part: Inflator) -> Values:
        """Lists."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in super().written(part).items()}


INFLATOR = _InflatorSection(
    "inflator",
    Inflator,
    (_TIMES, _FLOW, Key("temperature", Dimension.TEMPERATURE, "of the gas it feeds", "600 K", required=True, above=0)),
    optional=True,
    physical=True,
    begun=False,
)
