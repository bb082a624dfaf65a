"""Section `sweep`: what `softbrake sweep` varies. No part of a case; `studies.axes` reads it."""

from __future__ import annotations

from typing import Any

from softbrake.case.keys import Key
from softbrake.case.section import Section
from softbrake.case.units import Dimension


class _SweepSection(Section):
    def schema(self) -> dict[str, Any]:
        """Also the axes, by the path of what they vary."""
        axis = {
            "description": "START:STOP:COUNT, also :log, a distribution such as normal(8.5 m/s, 0.4 m/s), or a list of values",
            "type": ["string", "array"],
            "minItems": 1,
        }
        vary = {"description": "values by key, as fabric.E", "type": "object", "additionalProperties": axis}
        sweep = super().schema()
        sweep["properties"]["vary"] = vary
        return sweep | {"description": "what `softbrake sweep` varies; else not read", "required": ["vary"]}


SWEEP = _SweepSection(
    "sweep",
    dict,
    (
        Key(
            "mode",
            ("grid", "zip", "random", "lhs", "sobol", "saltelli"),
            "all combinations, side by side; independent samples, a Latin hypercube, Sobol' points, those for Sobol' indices",
            "grid",
            default="grid",
        ),
        Key("samples", int, "runs of a sample; with saltelli times the inputs and two", "100", least=1, most=1_000_000),
        Key("seed", int, "of its random numbers", "1", default=0, least=0),
        Key(
            "until",
            Dimension.RATIO,
            "half width of the interval of the chance that all limits hold, at which samples stop doubling",
            "0.01",
            above=0,
            most=0.5,
        ),
        Key("control", ("lumped", "axisymmetric"), "cheaper fidelity whose drops control the chance of the case's own", "lumped"),
        Key("control_samples", int, "more samples of it", "10000", least=2, most=1_000_000),
    ),
    optional=True,
)
