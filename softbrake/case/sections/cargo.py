"""Section `cargo`: the falling body."""

from __future__ import annotations

from dataclasses import dataclass

from softbrake.case.checker import Values, last_given
from softbrake.case.keys import Key
from softbrake.case.section import Draft, Part, Section
from softbrake.case.units import Dimension


@dataclass(frozen=True)
class Cargo(Part):
    """Rigid body on the upper cover, Eq. (2.4)."""

    mass: float  # kg
    velocity: float  # m/s at first contact, downwards positive
    diameter: float  # m, of the upright cylinder that it is to the fabric
    height: float | None  # m; None: without a top


class _CargoSection(Section):
    def read(self, draft: Draft) -> Values:
        """A body no wider than the cover."""
        shell, node = draft.values("shell"), self.node(draft)
        if node is None:
            return {}
        cargo = draft.mapping(node, self.name, self.keys)
        cover = shell.get("upper_diameter")
        if cover is not None and cargo.get("diameter", 0.0) > cover:
            place, where = last_given(node, self.name, ["diameter"])
            fault = f"{cargo['diameter']:g} m is wider than the cover"
            draft.fault(place, where, fault, f"a diameter up to the cover's, {cover:g} m, is expected")
        return cargo

    def build(self, draft: Draft) -> Cargo:
        """As wide as the cover by default."""
        return Cargo(**{"diameter": draft.built("shell").upper_diameter, "height": None, **draft.values(self.name)})


CARGO = _CargoSection(
    "cargo",
    Cargo,
    (
        Key("mass", Dimension.MASS, "of the falling body", "100 kg", required=True, above=0),
        Key("velocity", Dimension.SPEED, "downwards, at first contact", "6 m/s", required=True, above=0),
        Key("diameter", Dimension.LENGTH, "of the body on the cover", "0.4 m", computed="the cover's", above=0),
        Key("height", Dimension.LENGTH, "of the body on the cover", "0.5 m", computed="no top", above=0),
    ),
    physical=True,
)
