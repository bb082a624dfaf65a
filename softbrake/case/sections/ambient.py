"""Section `ambient`: the gas around the shell."""

from __future__ import annotations

from dataclasses import dataclass

from softbrake.case.checker import Values
from softbrake.case.keys import Key
from softbrake.case.section import Draft, Part, Section
from softbrake.case.units import Dimension
from softbrake.case.yaml_nodes import Node

PRESSURE, TEMPERATURE = 101325.0, 288.15  # Pa, K: of the International Standard Atmosphere at sea level
LOWEST, HIGHEST = -5e3, 80e3  # m, of that atmosphere


@dataclass(frozen=True)
class Ambient(Part):
    """Gas around the shell."""

    pressure: float = PRESSURE  # Pa, absolute
    temperature: float = TEMPERATURE  # K


def standard_atmosphere(altitude: float) -> tuple[float, float]:
    """Pressure (Pa) and temperature (K) of the standard atmosphere, ICAO Doc 7488. altitude: m, geopotential."""
    from ambiance import Atmosphere  # loads SciPy

    air = Atmosphere(Atmosphere.geop2geom_height(altitude))
    return float(air.pressure[0]), float(air.temperature[0])


class _AmbientSection(Section):
    def read(self, draft: Draft) -> Values:
        """Pressure and temperature, of an altitude too."""
        ambient: Values = super().read(draft)
        if "altitude" in ambient:
            ambient["pressure"], ambient["temperature"] = standard_atmosphere(ambient.pop("altitude"))
        return ambient

    def give_way(self, members: dict[str, Node], name: str) -> None:
        """An altitude stands for both; neither of both stands for it."""
        if name == "altitude":
            super().give_way(members, name)


AMBIENT = _AmbientSection(
    "ambient",
    Ambient,
    (
        Key("pressure", Dimension.PRESSURE, "around the shell, absolute", "101325 Pa", default=PRESSURE, above=0),
        Key("temperature", Dimension.TEMPERATURE, "around the shell", "288.15 K", default=TEMPERATURE, above=0),
        Key(
            "altitude",
            Dimension.LENGTH,
            "geopotential, in the standard atmosphere",
            "3000 m",
            least=LOWEST,
            most=HIGHEST,
            instead="pressure and temperature",
        ),
    ),
    choices=((("pressure", "temperature"), ("altitude",)),),
    optional=True,
    physical=True,
    begun=False,
)
