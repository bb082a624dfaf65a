"""Keys outside of all sections."""

from __future__ import annotations

from softbrake.case.checker import Values
from softbrake.case.keys import Key
from softbrake.case.section import Draft, Section
from softbrake.case.units import STANDARD_GRAVITY, Dimension

AUTO_TOLERANCE = 0.02  # that fidelity: auto aims at


class _Top(Section):
    def read(self, draft: Draft) -> Values:
        """Beside the sections."""
        others = [name for name in draft.sections if name]
        return draft.mapping(draft.outline(self.keys), "", self.keys, choices=self.choices, others=others)

    def build(self, draft: Draft) -> Values:
        """Fields of the case; it insists on a tolerance that the file names. A bag under pressure starts inflated."""
        top, fidelity = draft.values(""), draft.values("model")["fidelity"]
        tolerance = AUTO_TOLERANCE if fidelity == "auto" else None
        full = draft.values("gas").get("pressure", 0.0) > 0.0 and fidelity != "lumped"
        initial = "inflated" if full else "unloaded"
        return {"title": draft.stem, "tolerance": tolerance, "initial": initial, "insists": "tolerance" in top, **top}

    def starter(self) -> list[str]:
        """At the margin."""
        return [key.starter("", key.begun) for key in self.keys]


TOP = _Top(
    "",
    dict,
    (
        Key("title", str, "heads the results", "My drop", computed="name of the file", begun=True),
        Key("gravity", Dimension.ACCELERATION, "downwards", "9.80665 m/s^2", default=STANDARD_GRAVITY, least=0, begun=True),
        Key(
            "tolerance",
            Dimension.RATIO,
            "of the impact velocity; chooses fidelity, grid, step",
            "1 %",
            computed="none; fidelity: auto aims at 2 %",
            above=0,
            most=0.5,
            idle=True,
        ),
        Key(
            "initial",
            ("unloaded", "inflated"),
            "shape at first contact",
            "unloaded",
            computed="unloaded, with gas inflated",
        ),
        Key("friction", Dimension.RATIO, "Coulomb's coefficient of fabric on ground and cover", "0.3", default=0.0, least=0),
        Key("leakage", Dimension.RATIO, "effective part of the free wall area", "0.4 %", default=0.0, least=0, most=1),
    ),
    alternatives=((("pressure",), ("gas",)),),
    choices=((("leakage",), ("permeability",)),),
    optional=True,
    physical=True,
)
