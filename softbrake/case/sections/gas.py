"""Section `gas`: a gas with a state of its own, instead of a pressure law."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from softbrake.case.checker import Values, last_given
from softbrake.case.keys import Key
from softbrake.case.section import Draft, MayBeNone, Part
from softbrake.case.sections.pressure import check_inflatable
from softbrake.case.units import Dimension
from softbrake.case.yaml_nodes import Node

MOLAR_GAS_CONSTANT = 8.31446261815324  # J/(mol K), CODATA 2018
# Ratio of specific heats at 300 K (Moran & Shapiro, Table A-20; 5/3 of a monatomic gas) and specific gas constant, J/(kg K), of
# standard atomic weights (IUPAC 2021); air has that of the International Standard Atmosphere (ICAO Doc 7488).
GASES = {
    "air": (1.4, 287.05287),
    "nitrogen": (1.4, MOLAR_GAS_CONSTANT / 28.014e-3),
    "carbon_dioxide": (1.3, 188.92),
    "helium": (5.0 / 3.0, MOLAR_GAS_CONSTANT / 4.002602e-3),
}
Process = Literal["adiabatic", "isothermal", "polytropic"]


@dataclass(frozen=True)
class Gas(Part):
    """Ideal gas in the shell, as the bag hangs: stretched, at rest."""

    pressure: float  # Pa, gauge
    temperature: float  # K
    gamma: float  # ratio of specific heats
    gas_constant: float  # J/(kg K)
    process: Process
    exponent: float  # n of P V^n: gamma, 1 or as given

    @property
    def choking_ratio(self) -> float:
        """Pressure outside over that inside, below which the flow out of an orifice is that of sound."""
        return math.pow(2.0 / (self.gamma + 1.0), self.gamma / (self.gamma - 1.0))

    @property
    def speed_of_sound(self) -> float:
        """At the temperature of filling, m/s."""
        return math.sqrt(self.gamma * self.gas_constant * self.temperature)


class _GasSection(MayBeNone):
    def read(self, draft: Draft) -> Values:
        """Values with gamma, gas constant, temperature and exponent resolved."""
        gas = super().read(draft)
        node = draft.members.get(self.name)
        if node is None or not isinstance(node.value, dict):
            return gas
        _complete(draft, node, gas)
        _check_pressure(draft, gas)
        _check_initial(draft, gas)
        return gas

    def build(self, draft: Draft) -> Gas | None:
        """Without the name, which gamma and gas constant stand for."""
        gas = draft.values(self.name)
        return Gas(**{name: value for name, value in gas.items() if name != "name"}) if gas else None

    def written(self, part: Gas) -> Values:
        """The exponent of a polytropic process only."""
        return {
            name: value for name, value in super().written(part).items() if name != "exponent" or part.process == "polytropic"
        }


EXPONENT = Key("exponent", Dimension.RATIO, "n of P V^n (polytropic)", "1.2", least=1)
GAS = _GasSection(
    "gas",
    Gas,
    (
        Key("pressure", Dimension.PRESSURE, "gauge, as the bag hangs: stretched, at rest", "15.7 kPa", required=True),
        Key("name", tuple(GASES), "of the gas", "air", default="air"),
        Key("gamma", Dimension.RATIO, "ratio of specific heats; with gas_constant", "1.4", above=1, instead="name"),
        Key("gas_constant", Dimension.GAS_CONSTANT, "with gamma", "287.053 J/kg/K", above=0, instead="name"),
        Key("temperature", Dimension.TEMPERATURE, "of the gas as the bag hangs", "288.15 K", computed="ambient's", above=0),
        Key("process", get_args(Process), "closed bags only for the last two", "adiabatic", default="adiabatic"),
        EXPONENT,
    ),
    choices=((("name",), ("gamma", "gas_constant")),),
    optional=True,
    physical=True,
    begun=False,
)


def check_flow(draft: Draft, path: str) -> None:
    """What lets gas in or out, at a path, needs a gas whose mass may change."""
    if GAS.name not in draft.members:
        if GAS.name not in draft.meant:
            place, where = draft.last_given(path)
            draft.fault(place, where, "there is no gas for it", "a section 'gas' instead of 'pressure' is expected")
        return
    process = draft.values(GAS.name).get("process", "adiabatic")
    if process != "adiabatic":
        place, where = draft.last_given(path, "gas.process")
        fault = f"the {process} process is one of a closed bag, which has no {path}"
        draft.fault(place, where, fault, f"process: adiabatic, or no {path} is expected")


def _complete(draft: Draft, node: Node, gas: Values) -> None:
    """What follows from the name, the process and the ambient gas."""
    assert isinstance(node.value, dict)
    if "temperature" not in node.value and "temperature" in (ambient := draft.values("ambient")):
        gas["temperature"] = ambient["temperature"]
    if "name" in gas and not {"gamma", "gas_constant"} & node.value.keys():
        gas["gamma"], gas["gas_constant"] = GASES[gas["name"]]
    process = gas.get("process")
    if process == "polytropic":
        if "exponent" not in node.value:
            draft.missing(node, "gas", EXPONENT)
        return
    if process is not None and "exponent" in node.value:
        place, where = last_given(node, "gas", ["exponent", "process"])
        draft.fault(place, where, f"an exponent of the {process} process", "process: polytropic, or no exponent is expected")
    if process == "isothermal":
        gas["exponent"] = 1.0
    elif "gamma" in gas:
        gas["exponent"] = gas["gamma"]


def _check_pressure(draft: Draft, gas: Values) -> None:
    """The gas has some."""
    ambient = draft.values("ambient")
    if "pressure" in gas and "pressure" in ambient and gas["pressure"] <= -ambient["pressure"]:
        place, where = draft.last_given("gas.pressure", "ambient.pressure", "ambient.altitude")
        fault = f"a gauge pressure of {gas['pressure']:.6g} Pa at an ambient pressure of {ambient['pressure']:.6g} Pa"
        draft.fault(place, where, fault, f"a gauge pressure > {-ambient['pressure']:.6g} Pa is expected")


def _check_initial(draft: Draft, gas: Values) -> None:
    """A bag under pressure starts inflated: on an unstretched shell it rings, and a fixed mass of gas loses most of it."""
    initial = draft.values("").get("initial")
    if initial is None or "pressure" not in gas:
        return
    if initial == "inflated":
        check_inflatable(draft, gas["pressure"], "the gas", "gas.pressure > 0")
    elif gas["pressure"] > 0.0 and draft.values("model")["fidelity"] != "lumped":
        place, where = draft.last_given("initial")
        fault = "gas.pressure is that of the stretched shell, which an unloaded one would lose"
        draft.fault(place, where, fault, "initial: inflated is expected")
