"""Section `sweep`: what `softbrake sweep` varies. No part of a case; `studies.axes` reads it."""

from __future__ import annotations

from typing import Any

from softbrake.case.keys import Key
from softbrake.case.section import Section


class _SweepSection(Section):
    def schema(self) -> dict[str, Any]:
        """Also the axes, by the path of what they vary."""
        axis = {"description": "START:STOP:COUNT, also :log, or a list of values", "type": ["string", "array"], "minItems": 1}
        vary = {"description": "values by key, as fabric.E", "type": "object", "additionalProperties": axis}
        sweep = super().schema()
        sweep["properties"]["vary"] = vary
        return sweep | {"description": "what `softbrake sweep` varies; else not read", "required": ["vary"]}


SWEEP = _SweepSection(
    "sweep",
    dict,
    (
        Key("mode", ("grid", "zip", "lhs"), "every combination, side by side, or a Latin hypercube", "grid", default="grid"),
        Key("samples", int, "runs of a Latin hypercube", "100", least=1, most=1_000_000),
        Key("seed", int, "of its random numbers", "1", default=0, least=0),
    ),
    optional=True,
)
