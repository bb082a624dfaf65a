"""Gas with a state of its own in a case file: values, defaults, contradictions, paths, round trip."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from conftest import ROOT

from softbrake.case.case import Case, case_to_dict, is_quantity, key_at
from softbrake.case.case_file import CaseError, case_file, parse_case
from softbrake.case.level import level
from softbrake.case.schema import schema
from softbrake.case.sections.ambient import Ambient, standard_atmosphere
from softbrake.case.sections.gas import Gas
from softbrake.case.sections.inflator import Inflator
from softbrake.case.sections.permeability import Permeability
from softbrake.case.sections.pressure import Pressure
from softbrake.case.sections.vents import Vent
from softbrake.case.units import Dimension, parse_quantity
from softbrake.report.html.case import case_table
from softbrake.sim.result_file import tension_scale
from softbrake.studies.axes import designs_of
from softbrake.studies.inverse_design import ask

BAG = """\
shell: {diameter: 0.5 m, height: 0.6 m}
fabric: {E: 20 kN/m, areal_density: 0.05 kg/m^2, viscosity: 0.2 N*s/m}
cargo: {mass: 100 kg, velocity: 6 m/s}
"""
GAS = BAG + "gas: {pressure: 15.7 kPa}\n"
LAW = BAG + "pressure: {law: constant, value: 15.7 kPa}\n"
ALL_OF_IT = (
    BAG
    + """\
gas: {pressure: 15.7 kPa, name: nitrogen, temperature: 20 degC}
ambient: {pressure: 1 bar, temperature: 268 K}
vents:
  - {area: 300 cm^2, discharge: 0.6, opens: {pressure: 60 kPa}, closes: {pressure: 20 kPa}}
  - {area: 20 cm^2, discharge: {pressure_ratio: [0.5, 1], coefficient: [0.75, 60 %]}, opens: {height: 0.4 m}, inflow: allowed}
  - {area: 1 cm^2, discharge: 1, opens: {time: 30 ms}, closes: {height: 0.1 m}}
permeability: {linear: 2e-5 m/s/Pa, quadratic: -1e-10 m/s/Pa^2}
inflator: {times: [0 s, 5 ms, 40 ms], mass_flow: [0 kg/s, 2.4 kg/s, 0 g/s], temperature: 600 K}
"""
)


def case(text: str, *overrides: str) -> Case:
    return parse_case(text, "f.yaml", overrides)


def faults(text: str, *overrides: str) -> list[str]:
    """Messages without the name of the file."""
    with pytest.raises(CaseError) as caught:
        case(text, *overrides)
    return [message.removeprefix("f.yaml:") for message in caught.value.faults]


# Values


def test_every_part_has_the_values_of_the_file() -> None:
    got = case(ALL_OF_IT)
    assert got.pressure is None
    assert got.gas == Gas(15700.0, 293.15, 1.4, 8.31446261815324 / 28.014e-3, "adiabatic", 1.4)
    assert got.ambient == Ambient(1e5, 268.0)
    area = parse_quantity("300 cm^2", Dimension.AREA)
    assert got.vents == (
        Vent(area, (0.6,), (0.0,), 60e3, None, None, 20e3, None, False),
        Vent(0.002, (0.75, 0.6), (0.5, 1.0), None, None, 0.4, None, None, True),
        Vent(1e-4, (1.0,), (0.0,), None, 0.03, None, None, 0.1, False),
    )
    assert got.permeability == Permeability(linear=2e-5, quadratic=-1e-10)
    assert got.inflator == Inflator((0.0, 0.005, 0.04), (0.0, 2.4, 0.0), 600.0)
    assert case(GAS + "leakage: 0.4 %\n").leakage == 0.004
    assert case(GAS + "permeability: {viscous: 1e4, inertial: 1e3 Pa*s^2/m^2}\n").permeability == Permeability(0, 0, 1e4, 1e3)


def test_defaults_are_a_closed_adiabatic_bag_of_air_at_sea_level() -> None:
    got = case(GAS)
    assert got.gas == Gas(15700.0, 288.15, 1.4, 287.05287, "adiabatic", 1.4)
    assert (got.ambient, got.vents, got.leakage, got.permeability, got.inflator) == (
        Ambient(101325.0, 288.15),
        (),
        0.0,
        None,
        None,
    )
    assert (got.initial, got.time.after) == ("inflated", "rebound")
    assert case(GAS + "vents: [{area: 1 cm^2, discharge: 0.6}]\n").vents[0] == Vent(
        1e-4, (0.6,), (0.0,), None, None, None, None, None, False
    )
    law = case(LAW)
    assert (law.gas, law.vents, law.initial, law.time.after) == (None, (), "unloaded", "stop")
    assert case(LAW + "time: {after: rebound}\n").time.after == "rebound"
    assert case(GAS + "time: {after: stop}\n").time.after == "stop"


def test_temperature_of_the_gas_is_that_around_it() -> None:
    gas = case(GAS + "ambient: {temperature: -63 degC}\n").gas
    assert gas is not None
    assert gas.temperature == pytest.approx(210.15)


@pytest.mark.parametrize(
    ("name", "gamma", "molar_mass"),
    [("air", 1.4, 28.9644e-3), ("nitrogen", 1.4, 28.014e-3), ("carbon_dioxide", 1.3, 44.009e-3), ("helium", 5 / 3, 4.0026e-3)],
)
def test_gases_have_the_molar_gas_constant(name: str, gamma: float, molar_mass: float) -> None:
    gas = case(GAS, f"gas.name={name}").gas
    assert gas is not None
    assert gas.gas_constant * molar_mass == pytest.approx(8.314462618, rel=5e-5)
    assert gas.gamma == pytest.approx(gamma)


def test_gas_by_its_own_numbers() -> None:
    own = case(BAG + "gas: {pressure: 5 kPa, gamma: 1.29, gas_constant: 0.18892 kJ/kg/K}\n").gas
    assert own is not None
    assert (own.gamma, own.gas_constant, own.exponent) == (1.29, pytest.approx(188.92), 1.29)
    named = case(BAG + "gas: {pressure: 5 kPa, gamma: 1.29, gas_constant: 188.92}\n", "gas.name=helium").gas
    assert named is not None
    assert named.gamma == pytest.approx(5 / 3)


@pytest.mark.parametrize(("process", "exponent"), [("isothermal", 1.0), ("adiabatic", 1.4), ("polytropic, exponent: 1.2", 1.2)])
def test_exponent_of_the_process(process: str, exponent: float) -> None:
    gas = case(BAG + f"gas: {{pressure: 5 kPa, process: {process}}}\n").gas
    assert gas is not None
    assert gas.exponent == exponent


def test_choking_ratios_and_speed_of_sound() -> None:
    """Pressure ratios of the sonic flow, 6 digits; sound in the air of the standard atmosphere, ICAO Doc 7488."""
    for gamma, ratio in ((1.4, 0.528282), (1.3, 0.545728), (5 / 3, 0.487139)):
        gas = Gas(0.0, 288.15, gamma, 287.05287, "adiabatic", gamma)
        assert gas.choking_ratio == pytest.approx(ratio, abs=5e-7)
    assert Gas(0.0, 288.15, 1.4, 287.05287, "adiabatic", 1.4).speed_of_sound == pytest.approx(340.294, abs=5e-4)


@pytest.mark.parametrize(
    ("altitude", "pressure", "temperature"),
    [
        (0, 101325.0, 288.15),
        (3000, 70108.5265, 268.65),
        (11000, 22632.06, 216.65),
        (-300, 104981.2, 290.1),
        (20000, 5474.88, 216.65),
    ],
)
def test_standard_atmosphere(altitude: float, pressure: float, temperature: float) -> None:
    """ICAO Doc 7488; base pressures of its layers have 6 digits there. Geometric 3000 m have 70121 Pa."""
    assert standard_atmosphere(altitude) == pytest.approx((pressure, temperature), rel=3e-6)
    got = case(GAS + f"ambient: {{altitude: {altitude} m}}\n")
    assert (got.ambient.pressure, got.ambient.temperature) == standard_atmosphere(altitude)


def test_atmosphere_is_hydrostatic() -> None:
    """dp/dH = -g p/(R T), whatever the layer."""
    for altitude in (-4000.0, 500.0, 8000.0, 15e3, 25e3, 40e3, 60e3, 75e3):
        (low, _), (p, T), (high, _) = (standard_atmosphere(altitude + step) for step in (-1.0, 0.0, 1.0))
        assert (high - low) / 2.0 == pytest.approx(-9.80665 * p / (287.05287 * T), rel=1e-6)


def test_atmosphere_is_loaded_only_for_an_altitude(tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text(GAS)
    code = (
        "import sys; from softbrake.case.case_file import load_case\n"
        f"load_case({str(tmp_path / 'case.yaml')!r}, [word for word in sys.argv[1:]]); sys.exit('ambiance' in sys.modules)"
    )
    for words, status in (((), 0), (("ambient.altitude=1 km",), 1)):
        assert subprocess.run([sys.executable, "-c", code, *words], cwd=ROOT, check=False).returncode == status


@pytest.mark.parametrize(
    ("text", "dimension", "expected"),
    [
        ("20 degC", Dimension.TEMPERATURE, 293.15),
        ("-40degC", Dimension.TEMPERATURE, 233.15),
        ("300 K", Dimension.TEMPERATURE, 300.0),
        ("287.05287 J/kg/K", Dimension.GAS_CONSTANT, 287.05287),
        ("0.287 kJ*kg^-1*K^-1", Dimension.GAS_CONSTANT, 287.0),
        ("300 cm^2", Dimension.AREA, 0.03),
        ("2400 g/s", Dimension.MASS_FLOW, 2.4),
        ("20 mm/s/kPa", Dimension.PERMEABILITY, 2e-5),
        ("-1e-4 m/s/kPa^2", Dimension.PERMEABILITY_SLOPE, -1e-10),
        ("50 kPa*s/m", Dimension.VISCOUS_RESISTANCE, 5e4),
        ("1 kPa*s^2/m^2", Dimension.INERTIAL_RESISTANCE, 1e3),
    ],
)
def test_quantity(text: str, dimension: Dimension, expected: float) -> None:
    assert parse_quantity(text, dimension) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "dimension", "message"),
    [
        ("20 degC", Dimension.LENGTH, "unknown unit 'degC'"),
        ("20 J/kg/degC", Dimension.GAS_CONSTANT, "unknown unit 'degC'"),
        ("20 degc", Dimension.TEMPERATURE, "unknown unit 'degc', did you mean 'degC'?"),
        ("20 K", Dimension.LENGTH, "'K' is a temperature"),
        ("1 kg/s", Dimension.LENGTH, "'kg/s' is a fabric viscosity or a mass flow"),
    ],
)
def test_quantity_faults(text: str, dimension: Dimension, message: str) -> None:
    with pytest.raises(ValueError) as caught:
        parse_quantity(text, dimension)
    assert str(caught.value).startswith(message)


# Start


def test_a_bag_under_pressure_starts_inflated_and_a_limp_one_unloaded() -> None:
    assert case(GAS).initial == case(GAS + "initial: inflated\n").initial == "inflated"
    assert case(GAS, "model.fidelity=lumped").initial == "unloaded"
    assert case(GAS + "initial: unloaded\n", "model.fidelity=lumped").initial == "unloaded"
    for pressure in ("0 Pa", "-1 kPa", "-101324 Pa"):
        assert case(GAS, f"gas.pressure={pressure}").initial == "unloaded"


def test_every_level_starts_as_it_can_and_reads_back() -> None:
    """A lumped bag has no shape; a shell of it is stretched, also where the file asks for the lumped model."""
    inflated, lumped = case(GAS), case(GAS, "model.fidelity=lumped")
    for one in (inflated, lumped, case(LAW + "initial: inflated\n")):
        assert level(one, "axisymmetric", 36, 90).initial == "inflated"
        piston = level(one, "lumped", 36, 90)
        assert piston.initial == "unloaded"
        assert case(json.dumps(case_to_dict(piston))) == replace(piston, tolerance=None)
    assert level(case(GAS, "gas.pressure=0"), "full", 36, 90).initial == "unloaded"


def test_filling_is_the_law_that_the_shell_starts_with() -> None:
    assert case(GAS).filling == Pressure("constant", 15700.0, 0.0, 0.0, (), (), 0.0) == case(LAW).pressure == case(LAW).filling
    assert case(GAS, "gas.pressure=-1 kPa").filling.largest == 0.0
    assert tension_scale(case(GAS)) == tension_scale(case(LAW)) == 0.5 * 15700.0 * 0.6


def test_a_case_under_a_law_instead_of_its_gas() -> None:
    law = case(LAW)
    assert law.pressure is not None
    assert case(ALL_OF_IT, "ambient={}").under(law.pressure) == law
    assert case(LAW, "time.after=rebound").under(law.pressure.steady(1.0)).time.after == "rebound"


# Contradictions


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("vents: [{area: 1 cm^2, discharge: 1}]", "vents: there is no gas for it"),
        ("leakage: 1 %", "leakage: there is no gas for it"),
        ("permeability: {linear: 1e-5}", "permeability: there is no gas for it"),
        ("inflator: {times: [0, 1], mass_flow: [0, 1], temperature: 300}", "inflator: there is no gas for it"),
    ],
)
def test_what_needs_gas(more: str, message: str) -> None:
    assert faults(LAW + more + "\n") == [f"5:1: {message}; a section 'gas' instead of 'pressure' is expected"]
    name = message.partition(":")[0]
    for process in ("isothermal", "polytropic, exponent: 1.2"):
        word = process.partition(",")[0]
        assert faults(BAG + f"gas: {{pressure: 1 kPa, process: {process}}}\n{more}\n") == [
            f"5:1: {name}: the {word} process is one of a closed bag, which has no {name}; "
            f"process: adiabatic, or no {name} is expected"
        ]
    told = faults(GAS + more + "\n", "gas.process=isothermal")
    assert [fault.partition(": the")[0] for fault in told] == ["--set gas.process=isothermal: gas.process"]
    case(GAS + more + "\n")


VENT = "vents: [{area: 1 cm^2, discharge: 1"


@pytest.mark.parametrize(
    ("more", "messages"),
    [
        # gas
        ("pressure: {law: constant, value: 1}", ["5:1: pressure: given besides gas; either 'pressure' or 'gas' is expected"]),
        (
            "ambient: {pressure: 15700 Pa, altitude: 3 km}",
            ["5:31: ambient.altitude: given besides pressure; either 'pressure' and 'temperature' or 'altitude' is expected"],
        ),
        (
            "ambient: {altitude: 90 km}",
            ["5:21: ambient.altitude: '90 km' is out of range; a length >= -5000 and <= 80000 such as '3000 m' is expected"],
        ),
        ("ambient: {pressure: 0}", ["5:21: ambient.pressure: 0 is out of range; a pressure > 0 such as '101325 Pa' is expected"]),
        (
            "initial: unloaded",
            [
                "5:1: initial: gas.pressure is that of the stretched shell, which an unloaded one would lose; "
                "initial: inflated is expected"
            ],
        ),
        (
            "initial: inflated\nmodel: {fidelity: lumped}",
            ["5:1: initial: the lumped model has no shell to inflate; initial: unloaded or another fidelity is expected"],
        ),
        # vents
        ("vents: {area: 1}", ["5:8: vents: not a list; a list such as [{area: 300 cm^2, discharge: 0.6}] is expected"]),
        ("vents: [1]", ["5:9: vents.0: not a mapping; a mapping of area, discharge, opens, closes, inflow is expected"]),
        ("vents: [{area: 1 cm^2}]", ["5:9: vents.0.discharge: missing; a ratio > 0 and <= 1 such as '0.6' is expected"]),
        (
            VENT + "}, {area: 0.2 m^2, discharge: 1}]",
            ["5:40: vents.1.area: 0.2 m^2 is wider than the cover; an area up to that of the cover, 0.19635 m^2, is expected"],
        ),
        (
            "vents: [{area: 1 cm^2, discharge: 1.2}]",
            ["5:35: vents.0.discharge: 1.2 is out of range; a ratio > 0 and <= 1 such as '0.6' is expected"],
        ),
        (
            "vents: [{area: 1 cm^2, discharge: {pressure_ratio: [0.5, 0.5, 1.1], coefficient: [0, 1]}}]",
            [
                "5:63: vents.0.discharge.pressure_ratio.2: 1.1 is out of range; a ratio >= 0 and <= 1 such as '1' is expected",
                "5:83: vents.0.discharge.coefficient.0: 0 is out of range; a ratio > 0 and <= 1 such as '0.6' is expected",
            ],
        ),
        (
            "vents: [{area: 1 cm^2, discharge: {pressure_ratio: [0.5, 0.5], coefficient: [1, 1]}}]",
            ["5:58: vents.0.discharge.pressure_ratio.1: not above the value before it; a value > 0.5 is expected"],
        ),
        (
            "vents: [{area: 1 cm^2, discharge: {pressure_ratio: [0.5, 1], coefficient: [1, 1, 1]}}]",
            ["5:62: vents.0.discharge.coefficient: 3 values for 2 pressure ratios; a value for each pressure ratio is expected"],
        ),
        (
            "vents: [{area: 1 cm^2, discharge: {pressure_ratio: [0.5, 1]}}]",
            ["5:24: vents.0.discharge.coefficient: missing; a ratio > 0 and <= 1 such as '[0.75, 0.6]' is expected"],
        ),
        (
            VENT + ", opens: late}]",
            [
                "5:45: vents.0.opens: unknown value 'late'; always, or one of pressure, time, height "
                "such as '{pressure: 60 kPa}', is expected"
            ],
        ),
        (
            VENT + ", opens: {}}]",
            ["5:38: vents.0.opens: missing 'pressure' or 'time' or 'height'; for instance 'pressure: 60 kPa'"],
        ),
        (
            VENT + ", opens: {pressure: 1, time: 1}}]",
            ["5:59: vents.0.opens.time: given besides pressure; either 'pressure' or 'time' or 'height' is expected"],
        ),
        (VENT + ", opens: {hight: 1}}]", ["5:46: vents.0.opens.hight: unknown key; did you mean 'height'?"]),
        (
            VENT + ", closes: {time: 1}}]",
            [
                "5:38: vents.0.closes: missing 'pressure' or 'height'; for instance 'pressure: 20 kPa'",
                "5:47: vents.0.closes.time: unknown key; known are pressure, height",
            ],
        ),
        (
            VENT + ", opens: {pressure: 20 kPa}, closes: {pressure: 0.2 bar}}]",
            [
                "5:74: vents.0.closes.pressure: it opens at 20000 Pa and closes at 20000 Pa; "
                "a pressure of opening above that of closing is expected"
            ],
        ),
        (
            VENT + ", closes: {height: 30 cm}, opens: {height: 0.2 m}}]",
            [
                "5:71: vents.0.opens.height: it opens at 0.2 m and closes at 0.3 m; "
                "a height of opening above that of closing is expected"
            ],
        ),
        (
            VENT + ", opens: {height: 0.7 m}}]",
            ["5:46: vents.0.opens.height: 0.7 m is above the shell; a height up to shell.height, 0.6 m, is expected"],
        ),
        (
            VENT + ", closes: {height: 0.7 m}}]",
            ["5:47: vents.0.closes.height: 0.7 m is above the shell; a height up to shell.height, 0.6 m, is expected"],
        ),
        (VENT + ", inflow: yes}]", ["5:46: vents.0.inflow: unknown value 'yes'; none or allowed is expected"]),
        # fabric
        (
            "leakage: 1 %\npermeability: {linear: 1}",
            ["6:1: permeability: given besides leakage; either 'leakage' or 'permeability' is expected"],
        ),
        ("leakage: 1.1", ["5:10: leakage: 1.1 is out of range; a ratio >= 0 and <= 1 such as '0.4 %' is expected"]),
        (
            "permeability: {linear: 1, inertial: 1}",
            [
                "5:27: permeability.inertial: given besides linear; "
                "either 'linear' and 'quadratic' or 'viscous' and 'inertial' is expected"
            ],
        ),
        (
            "permeability: {quadratic: 1}",
            ["5:1: permeability.linear: missing; a face velocity per pressure >= 0 such as '2e-5 m/s/Pa' is expected"],
        ),
        ("permeability: {linear: 0}", ["5:16: permeability.linear: nothing goes through; linear or quadratic > 0 is expected"]),
        (
            "permeability: {viscous: 0, inertial: 0}",
            ["5:28: permeability.inertial: nothing goes through; viscous or inertial > 0 is expected"],
        ),
        # inflator
        (
            "inflator: {times: [0, 1, 1], mass_flow: [0, 1, -1], temperature: 0 K}",
            [
                "5:26: inflator.times.2: not later than the time before it; a time > 1 s is expected",
                "5:48: inflator.mass_flow.2: -1 is out of range; a mass flow >= 0 such as '0 kg/s' is expected",
                "5:66: inflator.temperature: '0 K' is out of range; a temperature > 0 such as '600 K' is expected",
            ],
        ),
        (
            "inflator: {times: [0, 1], mass_flow: [0, 1, 2], temperature: 300}",
            ["5:27: inflator.mass_flow: 3 values for 2 times; a value for each time is expected"],
        ),
        ("time: {after: bounce}", ["5:15: time.after: unknown value 'bounce'; stop or rebound is expected"]),
    ],
)
def test_contradictions_by_their_place(more: str, messages: list[str]) -> None:
    assert faults(GAS + more + "\n") == messages


@pytest.mark.parametrize(
    ("gas", "message"),
    [
        ("", "4:1: gas.pressure: missing; a pressure such as '15.7 kPa' is expected"),
        (
            "pressure: -101325 Pa",
            "4:7: gas.pressure: a gauge pressure of -101325 Pa at an ambient pressure of 101325 Pa; "
            "a gauge pressure > -101325 Pa is expected",
        ),
        (
            "pressure: 1, name: argon",
            "4:26: gas.name: unknown value 'argon'; air or nitrogen or carbon_dioxide or helium is expected",
        ),
        (
            "pressure: 1, gamma: 1.4",
            "4:1: gas.gas_constant: missing; a specific gas constant > 0 such as '287.053 J/kg/K' is expected",
        ),
        (
            "pressure: 1, gamma: 1.4, gas_constant: 287, name: air",
            "4:51: gas.name: given besides gamma and gas_constant; either 'name' or 'gamma' and 'gas_constant' is expected",
        ),
        (
            "pressure: 1, gamma: 1, gas_constant: 287",
            "4:27: gas.gamma: 1 is out of range; a ratio > 1 such as '1.4' is expected",
        ),
        (
            "pressure: 1, temperature: -1 K",
            "4:33: gas.temperature: '-1 K' is out of range; a temperature > 0 such as '288.15 K' is expected",
        ),
        ("pressure: 1, process: polytropic", "4:1: gas.exponent: missing; a ratio >= 1 such as '1.2' is expected"),
        (
            "pressure: 1, exponent: 1.2",
            "4:20: gas.exponent: an exponent of the adiabatic process; process: polytropic, or no exponent is expected",
        ),
        (
            "pressure: 1, process: polytropic, exponent: 0.9",
            "4:51: gas.exponent: 0.9 is out of range; a ratio >= 1 such as '1.2' is expected",
        ),
    ],
)
def test_faults_of_the_gas(gas: str, message: str) -> None:
    assert faults(BAG + f"gas: {{{gas}}}\n") == [message]


def test_faults_that_an_override_brings_about_are_told_of_it() -> None:
    for override, place in (("ambient.pressure=600 Pa", "ambient.pressure"), ("ambient.altitude=30 km", "ambient.altitude")):
        (fault,) = faults(BAG + "gas: {pressure: -2 kPa}\n", override)
        assert fault.startswith(f"--set {override}: {place}: a gauge pressure of -2000 Pa at an ambient pressure of ")
    limp = faults(BAG + "gas: {pressure: 0 Pa}\n", "initial=inflated")
    assert limp == [
        "--set initial=inflated: initial: the gas starts without pressure; initial: unloaded, or gas.pressure > 0 is expected"
    ]
    (fault,) = faults(GAS + "ambient: {altitude: 3 km}\n", "ambient.temperature=220 K")  # at another pressure than was meant
    assert fault.startswith("--set ambient.temperature=220 K: ambient.temperature: given besides altitude; ")


def test_a_key_that_is_misspelt_is_not_missing_besides() -> None:
    assert faults(BAG + "gass: {pressure: 1 kPa}\nvents: [{area: 1 cm^2, discharge: 1}]\n") == [
        "4:1: gass: unknown key; did you mean 'gas'?"
    ]


def test_ambient_of_a_pressure_law_does_nothing() -> None:
    assert case(LAW + "ambient: {altitude: 3 km}\n").without_effect == ["ambient"]
    assert case(GAS + "ambient: {altitude: 3 km}\n").without_effect == case(LAW).without_effect == []


def test_a_case_has_gas_or_a_law() -> None:
    got = case(GAS)
    for change in ({"gas": None}, {"pressure": case(LAW).pressure}):
        with pytest.raises(ValueError, match="^pressure, gas: exactly one of them is expected$"):
            replace(got, **change)
    with pytest.raises(ValueError, match=r"^vents\.discharge: 1\.5 is not allowed; a ratio > 0 and <= 1"):
        replace(case(ALL_OF_IT).vents[0], discharge=(1.5,))
    with pytest.raises(ValueError, match=r"^gas\.temperature: 0\.0 is not allowed; a temperature > 0"):
        replace(case(GAS).gas or pytest.fail("no gas"), temperature=0.0)


# Paths


def test_overrides_reach_every_value() -> None:
    def vent(*overrides: str) -> Vent:
        return case(ALL_OF_IT, *overrides).vents[0]

    assert vent("vents.0.area=200 cm^2").area == pytest.approx(0.02)
    assert vent("vents.0.opens.pressure=50 kPa").opens_at_pressure == 50e3
    timed = vent("vents.0.opens.time=5 ms")  # instead of the pressure
    assert (timed.opens_at_pressure, timed.opens_at_time) == (None, 0.005)
    assert vent("vents.0.opens=always").opens_at_pressure is None
    assert vent("vents.0.closes=never", "vents.0.closes.height=0.2 m").closes_at_height == 0.2
    assert case(ALL_OF_IT, "vents.2.opens=always", "vents.2.opens.height=0.5 m").vents[2].opens_at_height == 0.5
    assert vent(
        "vents.0.discharge={pressure_ratio: [0, 1], coefficient: [1, 0.5]}", "vents.0.discharge.coefficient.1=0.7"
    ).discharge == (1.0, 0.7)
    assert case(ALL_OF_IT, "inflator.mass_flow.1=3 kg/s").inflator == Inflator((0.0, 0.005, 0.04), (0.0, 3.0, 0.0), 600.0)
    assert case(ALL_OF_IT, "leakage=1 %").permeability is None
    assert case(ALL_OF_IT, "permeability.viscous=1e4").permeability == Permeability(viscous=1e4)
    assert case(ALL_OF_IT, "ambient.altitude=0 m").ambient == Ambient()


def test_gas_replaces_a_law_that_an_override_gives_way_to_it() -> None:
    assert case(LAW, "gas.pressure=15.7 kPa") == case(GAS)
    assert case(GAS, "pressure={law: constant, value: 15.7 kPa}") == case(LAW)
    assert faults(GAS, "pressure.value=1 kPa") == [
        "--set pressure.value=1 kPa: pressure.law: missing; constant or sine or table is expected"
    ]


def test_paths_of_numbers() -> None:
    numbers = [
        "gas.pressure",
        "ambient.altitude",
        "leakage",
        "vents.0.area",
        "vents.0.discharge",
        "vents.1.discharge.coefficient.0",
        "vents.0.opens.pressure",
        "vents.2.opens.time",
        "vents.1.opens.height",
        "vents.0.closes.pressure",
        "vents.2.closes.height",
        "permeability.quadratic",
        "inflator.mass_flow.1",
        "inflator.temperature",
        "pressure.values.1",
    ]
    assert [path for path in numbers if not is_quantity(path)] == []
    none = [
        "vents.0.opens",
        "vents.0.inflow",
        "vents.0",
        "vents.area",
        "gas.name",
        "gas.process",
        "inflator.mass_flow",
        "time.after",
    ]
    none += ["vents.0.opens.time.0", "vents.0.discharge.coefficient.x", "gas.pressure.0"]
    assert [path for path in none if is_quantity(path)] == []
    assert (key_at("inflator.mass_flow") or pytest.fail("no key")).many


def test_quantities_of_the_file() -> None:
    file = case_file(ALL_OF_IT, "f.yaml")
    found = file.quantities()
    table = found["vents.1.discharge.coefficient"]
    assert {path: value for path, value in found.items() if path.startswith(("vents", "gas", "inf"))} == {
        "gas.pressure": 15700.0,
        "gas.temperature": 293.15,
        "vents.0.area": parse_quantity("300 cm^2", Dimension.AREA),
        "vents.0.discharge": 0.6,
        "vents.0.opens.pressure": 60e3,
        "vents.0.closes.pressure": 20e3,
        "vents.1.area": 0.002,
        "vents.1.discharge.pressure_ratio": (0.5, 1.0),
        "vents.1.discharge.coefficient": table,
        "vents.1.opens.height": 0.4,
        "vents.2.area": 1e-4,
        "vents.2.discharge": 1.0,
        "vents.2.opens.time": 0.03,
        "vents.2.closes.height": 0.1,
        "inflator.times": (0.0, 0.005, 0.04),
        "inflator.mass_flow": (0.0, 2.4, 0.0),
        "inflator.temperature": 600.0,
    }
    assert file.vary(found) == file.case  # as sensitivities do
    assert (file.quantity("inflator.mass_flow.1"), file.quantity("inflator.mass_flow.7"), file.quantity("inflator.times")) == (
        2.4,
        None,
        None,
    )
    units = {
        "vents.0.opens.pressure": "kPa",
        "vents.1.discharge.coefficient.1": "%",
        "inflator.mass_flow.2": "g/s",
        "gas.temperature": "K",
    }
    assert {path: file.unit_of(path) for path in units} == units


def test_axes_of_a_sweep() -> None:
    file = case_file(ALL_OF_IT, "f.yaml")
    designs = designs_of(
        file, ["vents.0.opens.pressure=50 kPa:60 kPa:3", "gas.temperature=0 degC:20 degC:2", "inflator.mass_flow.1=1,2"]
    )
    assert [(axis.path, axis.unit) for axis in designs.axes] == [
        ("vents.0.opens.pressure", "Pa"),
        ("gas.temperature", "K"),
        ("inflator.mass_flow.1", "kg/s"),
    ]
    assert len(designs.all) == 12
    assert designs.all[-1].values == (60e3, 293.15, 2.0)
    last = designs.all[2].case
    assert last.gas is not None and last.inflator is not None
    assert (last.vents[0].opens_at_pressure, last.gas.temperature, last.inflator.mass_flow[1]) == (50e3, 293.15, 1.0)


def test_design_searches_around_what_the_file_gives() -> None:
    file = case_file(ALL_OF_IT, "f.yaml", ["model.fidelity=lumped"])
    for path, value in (("vents.1.area", 0.002), ("inflator.mass_flow.1", 2.4), ("vents.1.opens.height", 0.1)):
        if path == "vents.1.opens.height":
            file = file.set([f"{path}=0.1 m"])
        question = ask(file, path)
        assert (question.low, question.high) == pytest.approx((value / 3, value * 3))
        assert question.load(value) == file.vary({path: value})
    with pytest.raises(
        ValueError, match="^--find pressure.value: the case has gas, no pressure law; a path such as gas.pressure"
    ):
        ask(file)


# Written


def test_report_has_every_value() -> None:
    """In SI units, by the path that an override gives."""
    found = case_table(case_to_dict(case(ALL_OF_IT)))
    for path, value in (
        ("vents.0.opens.pressure", "60000 Pa"),
        ("vents.1.discharge.coefficient", "0.75, 0.6"),
        ("vents.2.opens.time", "0.03 s"),
        ("gas.gas_constant", "296.797 J/kg/K"),
        ("ambient.temperature", "268 K"),
        ("inflator.mass_flow", "0, 2.4, 0 kg/s"),
    ):
        assert re.search(rf"<td>{re.escape(path)}</td>\s*<td>{re.escape(value)}</td>", found), path


@pytest.mark.parametrize(
    "text",
    [
        GAS,
        LAW,
        ALL_OF_IT,
        LAW + "ambient: {altitude: 3 km}\n",
        GAS + "ambient: {altitude: 11 km}\nleakage: 0.4 %\n",
        GAS + "permeability: {viscous: 0, inertial: 100}\n",
        BAG + "gas: {pressure: -1 kPa, process: polytropic, exponent: 1.3, name: helium}\nmodel: {fidelity: lumped}\n",
        BAG + "gas: {pressure: 1 kPa, process: isothermal, gamma: 1.2, gas_constant: 300}\ntime: {after: stop}\n",
    ],
)
def test_round_trip(text: str) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    original, validator = case(text), jsonschema.Draft202012Validator(schema())
    written = case_to_dict(original)
    assert case(json.dumps(written)) == original
    validator.validate(json.loads(json.dumps(written)))
    validator.validate(yaml.safe_load(text))


def test_schema_refuses_what_the_program_refuses() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    validator, good = jsonschema.Draft202012Validator(schema()), yaml.safe_load(GAS)
    vent = {"area": 1e-4, "discharge": 0.6}
    for right in (
        {"gas": {"pressure": "-2 kPa", "temperature": "-20 degC"}},
        {"vents": []},
        {"vents": [vent | {"opens": "always", "closes": {"pressure": "2 kPa"}}]},
        {"permeability": {"linear": 1e-5}},
        {"permeability": {"viscous": 1e5, "inertial": "1 Pa*s^2/m^2"}},
        {"ambient": {"temperature": 200}},
        {"ambient": {"altitude": "-300 m"}},
    ):
        validator.validate(good | right)
    for wrong in (
        {"pressure": {"law": "constant", "value": 1}},
        {"gas": {"pressure": 1, "name": "argon"}},
        {"gas": {"pressure": 1, "name": "air", "gamma": 1.4, "gas_constant": 287}},
        {"gas": {"pressure": 1, "gamma": 1.4}},
        {"gas": {"pressure": 1, "temperature": "-20 K"}},
        {"gas": {}},
        {"ambient": {"altitude": 0, "temperature": 288}},
        {"ambient": {"pressure": "-1 bar"}},
        {"vents": vent},
        {"vents": [{"area": 1e-4}]},
        {"vents": [vent | {"opens": "never"}]},
        {"vents": [vent | {"opens": {}}]},
        {"vents": [vent | {"opens": {"pressure": 1, "time": 1}}]},
        {"vents": [vent | {"discharge": {"coefficient": [1, 1]}}]},
        {"vents": [vent | {"discharge": 1.1}]},
        {"leakage": 0.1, "permeability": {"linear": 1e-5}},
        {"permeability": {"linear": 1e-5, "viscous": 1e5}},
        {"permeability": {"linear": 1e-5, "inertial": 1}},
        {"permeability": {"quadratic": 1e-5}},
        {"inflator": {"times": [0, 1], "mass_flow": [0, 1]}},
        {"time": {"after": "bounce"}},
    ):
        assert not validator.is_valid(good | wrong), wrong
    assert not validator.is_valid(yaml.safe_load(BAG))


def test_choking_ratio_tends_to_that_of_an_isothermal_flow() -> None:
    assert Gas(0.0, 300.0, 1.0 + 1e-9, 287.0, "adiabatic", 1.0).choking_ratio == pytest.approx(math.exp(-0.5), rel=1e-6)
