"""Section `permeability`: how fast gas goes through the fabric, instead of `leakage`."""

from __future__ import annotations

from dataclasses import dataclass

from softbrake.case.checker import Values, last_given
from softbrake.case.keys import Key
from softbrake.case.section import Draft, MayBeNone, Part
from softbrake.case.sections.gas import check_flow
from softbrake.case.units import Dimension


@dataclass(frozen=True)
class Permeability(Part):
    """Face velocity of the gas through the fabric, of one of two forms; the coefficients of the other are 0."""

    linear: float = 0.0  # m/s/Pa, of u = linear dp + quadratic dp^2
    quadratic: float = 0.0  # m/s/Pa^2
    viscous: float = 0.0  # Pa s/m, of dp = viscous u + inertial u^2
    inertial: float = 0.0  # Pa s^2/m^2


class _PermeabilitySection(MayBeNone):
    def read(self, draft: Draft) -> Values:
        """One of the forms, which lets something through."""
        values: Values = super().read(draft)
        if draft.values("").get("leakage", 0.0) > 0.0:
            check_flow(draft, "leakage")
        node = draft.members.get(self.name)
        if node is None or not isinstance(node.value, dict):
            return values
        check_flow(draft, self.name)
        for names in (("linear", "quadratic"), ("viscous", "inertial")):
            if values.get(names[0]) == 0.0 and values.get(names[1], 1.0) <= 0.0:
                place, where = last_given(node, self.name, names)
                draft.fault(place, where, "nothing goes through", f"{names[0]} or {names[1]} > 0 is expected")
        return values

    def written(self, part: Permeability) -> Values:
        """Of its form alone, in full."""
        names = ("viscous", "inertial") if part.viscous or part.inertial else ("linear", "quadratic")
        return {name: getattr(part, name) for name in names}


PERMEABILITY = _PermeabilitySection(
    "permeability",
    Permeability,
    (
        Key("linear", Dimension.PERMEABILITY, "of u = linear dp + quadratic dp^2", "2e-5 m/s/Pa", least=0),
        Key("quadratic", Dimension.PERMEABILITY_SLOPE, "with linear; may be negative", "-1e-10 m/s/Pa^2", default=0.0),
        Key("viscous", Dimension.VISCOUS_RESISTANCE, "of dp = viscous u + inertial u^2", "5e4 Pa*s/m", least=0, instead="linear"),
        Key(
            "inertial",
            Dimension.INERTIAL_RESISTANCE,
            "with viscous",
            "1e3 Pa*s^2/m^2",
            default=0.0,
            least=0,
            instead="quadratic",
        ),
    ),
    alternatives=((("linear", "quadratic"), ("viscous", "inertial")),),
    optional=True,
    physical=True,
    begun=False,
)
