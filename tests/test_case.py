"""Case files: units, YAML rules, every message, overrides, schema, round trip."""

from __future__ import annotations

import json
import math
import pickle
import re
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest
import yaml

from softbrake.case.case import SECTIONS, Case, case_to_dict
from softbrake.case.case_file import CaseError, load_case, open_case, parse_case
from softbrake.case.schema import schema, starter
from softbrake.case.sections.belts import Belt
from softbrake.case.sections.fabric import SHEAR
from softbrake.case.sections.top import TOP
from softbrake.case.units import Dimension, parse_quantity, pattern

CONFIGS = sorted((Path(__file__).parent.parent / "configs").glob("*.yaml"))

GOOD = """\
shell: {diameter: 0.5 m, height: 0.6 m}
fabric:
  E: 20 kN/m
  areal_density: 0.05 kg/m^2
  viscosity: 0.2 N*s/m
cargo: {mass: 100 kg, velocity: 6 m/s}
pressure: {law: constant, value: 15696 Pa}
"""


def case(text: str = "", *overrides: str) -> Case:
    """Case of GOOD and more sections."""
    return parse_case(GOOD + text, "f.yaml", overrides)


def faults(text: str, *overrides: str) -> list[str]:
    """Messages without the name of the file."""
    with pytest.raises(CaseError) as caught:
        parse_case(text, "f.yaml", overrides)
    assert str(caught.value) == "\n".join(caught.value.faults)
    return [message.removeprefix("f.yaml:") for message in caught.value.faults]


# Units


@pytest.mark.parametrize(
    ("text", "dimension", "expected"),
    [
        ("20 kN/m", Dimension.TENSION, 20000.0),
        ("18.75kN/m", Dimension.TENSION, 18750.0),
        ("0.05 kg/m^2", Dimension.AREAL_DENSITY, 0.05),
        ("50 g/m²", Dimension.AREAL_DENSITY, 0.05),
        ("0.2 N*s/m", Dimension.VISCOSITY, 0.2),
        ("0.2 N·s / m", Dimension.VISCOSITY, 0.2),
        ("0.2 N s/m", Dimension.VISCOSITY, 0.2),
        ("16.667 mm", Dimension.LENGTH, 0.016667),
        ("2 ft", Dimension.LENGTH, 0.6096),
        ("10 in", Dimension.LENGTH, 0.254),
        ("3 %", Dimension.RATIO, 0.03),
        ("3%", Dimension.RATIO, 0.03),
        ("1.5 psi", Dimension.PRESSURE, 1.5 * 6894.757293168361),
        ("0.15 bar", Dimension.PRESSURE, 15000.0),
        ("15.696 kPa", Dimension.PRESSURE, 15696.0),
        ("1e-2 N/mm^2", Dimension.PRESSURE, 10000.0),
        ("9.81 m/s^2", Dimension.ACCELERATION, 9.81),
        ("9.81 m*s^-2", Dimension.ACCELERATION, 9.81),
        ("8 g", Dimension.ACCELERATION, 78.4532),
        ("8g_n", Dimension.ACCELERATION, 78.4532),
        ("8 g", Dimension.MASS, 0.008),
        ("36 km/h", Dimension.SPEED, 10.0),
        ("5 ms", Dimension.TIME, 0.005),
        ("220 lb", Dimension.MASS, 99.7903214),
        ("12 g/m", Dimension.LINE_DENSITY, 0.012),
        ("1.7 kN", Dimension.FORCE, 1700.0),
        ("0.005 s/m", Dimension.INVERSE_SPEED, 0.005),
        ("0.5", Dimension.LENGTH, 0.5),
        ("+.5e1 m", Dimension.LENGTH, 5.0),
    ],
)
def test_quantity(text: str, dimension: Dimension, expected: float) -> None:
    assert parse_quantity(text, dimension) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("5 s", "'s' is a time"),
        ("5 %", "'%' is a ratio"),
        ("5 m^2/m/m", "'m^2/m/m' is a ratio"),
        ("5 kg*m", "'kg*m' is not a length"),
        ("5 M", "unknown unit 'M', did you mean 'm'?"),
        ("5 furlong", "unknown unit 'furlong'"),
        ("5 m^", "unknown unit 'm^', did you mean 'm'?"),
        ("5 /m", "unknown unit '/m'"),
        ("m", "'m' is not a number with a unit"),
        ("5 5", "unknown unit '5'"),
        ("1e300 km^9", "'km^9' is not a length"),
        ("1e999 m", "'1e999 m' is not a finite number"),
        ("nan m", "'nan m' is not a number with a unit"),
    ],
)
def test_quantity_faults(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=".") as caught:
        parse_quantity(text, Dimension.LENGTH)
    assert str(caught.value) == message


# Reading


def test_defaults() -> None:
    got = case()
    assert got.title == "f"
    assert got.gravity == 9.80665
    assert (got.fabric.E11, got.fabric.E22, got.fabric.viscosity) == (20000.0, 20000.0, 0.2)
    assert (got.fabric.nu12, got.fabric.nu21, got.fabric.G12) == (0, 0, SHEAR * 20000)
    assert (got.fabric.law, got.fabric.slack) == ("tension_field", "cut")
    assert got.belts == ()
    assert got.pressure.damping == 0
    assert (got.grid.generatrix, got.grid.hoop, got.model.scheme) == (44, 120, "edge")
    assert (got.time.courant, got.time.end) == (0.95, 1)
    assert case("time: {courant: auto}\n").time == got.time
    for viscosity, courant in ((0.02, 0.95), (0.01, 0.75), (0.002, 0.6), (0.001, 0.35), (0, 0.35)):
        assert case("", f"fabric.viscosity={viscosity}").time.courant == courant  # over 0.43 N s/m: the ratio of 0.0136 m edges
    assert case("time: {courant: 1.5}\n").time.courant == 1.5  # at the user's own risk
    assert got.output.snapshot_interval == pytest.approx(1 / 150)
    assert (got.output.history_interval, got.output.cfc) == (1, 180)
    assert case("time: {end: 0.3 s}\n").output.snapshot_interval == pytest.approx(0.002)


def test_either_of_poissons_ratios_follows_from_the_other() -> None:
    """nu12 E11 = nu21 E22, both given or one; shear is a part of the softer modulus."""
    unequal = ("fabric.E11=40 kN/m", "fabric.E22=10 kN/m")
    for given in ("nu12: 0.1", "nu21: 0.4", "nu12: 0.1\n  nu21: 0.4", "nu12: 0.1\n  nu21: 0.4003"):
        text = GOOD.replace("E: 20 kN/m", f"E11: 40 kN/m\n  E22: 10 kN/m\n  {given}")
        got = parse_case(text, "case.yaml").fabric
        assert (got.nu12, got.nu21) == pytest.approx((0.1, 0.4), rel=1e-12)
        got = parse_case(text, "case.yaml", ["fabric.nu21=0.2"]).fabric  # an override of one drops the other
        assert (got.nu12, got.nu21) == pytest.approx((0.05, 0.2), rel=1e-12)
    assert case("", *unequal).fabric.G12 == SHEAR * 10000
    assert case("", *unequal, "fabric.G12=0").fabric.G12 == 0


def test_yaml_1_2_scalars() -> None:
    got = case("title: no\ngravity: 1e1\ngrid: {generatrix: 017, hoop: 0x10}\ntime: {end: '5e-1 s'}\n")
    assert (got.title, got.gravity, got.grid.generatrix, got.grid.hoop, got.time.end) == ("no", 10.0, 17, 16, 0.5)


def test_damping_ratio_of_the_breathing_hoop() -> None:
    """A hoop of radius R: rho R'' = -E22/(1 - nu12 nu21) u/R², so critical viscosity is 2 R sqrt(rho E22/(1 - nu12 nu21))."""
    got = parse_case(GOOD.replace("viscosity: 0.2 N*s/m", "damping_ratio: 3 %\n  nu12: 0.25\n  nu21: 25 %"), "f.yaml")
    assert got.fabric.viscosity == pytest.approx(2 * 0.03 * 0.25 * math.sqrt(0.05 * 20000 / (1 - 0.25 * 0.25)), rel=1e-14)


def test_belts_at_uniform_spacing() -> None:
    got = case("belts: {count: 3, layers: 5, width: 20 mm}\n", "fabric.E22=10 kN/m")
    assert [belt.height for belt in got.belts] == pytest.approx([0.15, 0.3, 0.45])
    assert {(belt.stiffness, belt.line_density, belt.width) for belt in got.belts} == {(1000.0, 0.005, 0.02)}
    assert case("belts: {count: 0}\n").belts == ()
    assert case("belts: []\n").belts == ()


def test_belts_in_a_list() -> None:
    got = case(
        "belts:\n- {height: 0.2, layers: 2.5, width: 2 cm}\n"
        "- {height: 40 cm, stiffness: 6 kN, line_density: 12 g/m, width: 25 mm}\n"
    )
    assert got.belts == (Belt(0.2, 1000.0, 0.0025, 0.02), Belt(0.4, 6000.0, 0.012, 0.025))


def test_belt_may_touch_the_half_cell_at_a_cover() -> None:
    for height in (0.05, 0.55):  # half a cell of 0.06 m and half the width
        assert (
            case(f"grid: {{generatrix: 10}}\nbelts: [{{height: {height}, layers: 5, width: 40 mm}}]\n").belts[0].height == height
        )


def test_sine_pressure_by_default_absorbs_the_energy_of_the_cargo() -> None:
    got = parse_case(GOOD.replace("constant, value: 15696 Pa", "sine, peak_time: 0.1 s"), "f.yaml").pressure
    area, mass, velocity, height, g = math.pi * 0.25**2, 100.0, 6.0, 0.6, 9.80665
    mean = (mass * g * height + mass * velocity**2 / 2) / (area * height)
    assert got.value == pytest.approx(math.pi / 2 * mean, rel=1e-14)
    assert got.end_time == pytest.approx(velocity / (mean * area / mass - g), rel=1e-12)
    assert (got.peak_time, got.times, got.values) == (0.1, (), ())
    got = parse_case(GOOD, "f.yaml", ["pressure={law: sine, value: 1 bar, peak_time: 0.1 s, end_time: 0.11 s}"]).pressure
    assert (got.value, got.end_time) == (1e5, 0.11)


def test_table_pressure() -> None:
    got = case("", "pressure={law: table, times: [0, 50 ms], values: [1 kPa, 0], damping: 0.01}").pressure
    assert (got.law, got.times, got.values, got.damping, got.value) == ("table", (0.0, 0.05), (1000.0, 0.0), 0.01, 0.0)


# A file read once


LISTED = "belts:\n- {height: 0.2, layers: 2, width: 2 cm}\n- {height: 0.4, layers: 3, width: 2 cm}\n"


def test_case_file_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its variations are those of --set, come from no file and no text of it, and leave it as it is."""
    path = tmp_path / "f.yaml"
    path.write_text(GOOD + LISTED)
    expected = {
        "fabric.E11=3": load_case(path, ["cargo.mass=50", "fabric.E11=3"]),  # E22 keeps what E gave
        "belts.1.height=0.3": load_case(path, ["cargo.mass=50", "belts.1.height=0.3"]),
        "fabric.damping_ratio=1%": load_case(path, ["cargo.mass=50", "fabric.damping_ratio=1%"]),
        "contact=[ground]": load_case(path, ["cargo.mass=50", "contact=[ground]"]),
    }
    opened = open_case(path, ["cargo.mass=50"])
    path.unlink()
    parsed: list[str] = []
    monkeypatch.setattr(yaml, "parse", lambda text, Loader, parse=yaml.parse: parsed.append(text) or parse(text, Loader))
    for override, one in expected.items():
        assert opened.set([override]).case == one
    assert parsed == ["1%", "[ground]"]  # plain numbers need no parser
    assert opened.set([]).case == opened.case == parse_case(GOOD + LISTED, "f.yaml", ["cargo.mass=50"])
    assert opened.set(["fabric.E11=3"]).set(["fabric.E22=4"]).case.fabric.E11 == 3.0
    assert opened.vary({"fabric.E": 2e4, "belts.0.width": 0.01}) == opened.set(["fabric.E=20000.0", "belts.0.width=0.01"]).case
    table = opened.set(["pressure={law: table, times: [0, 0.1], values: [0, 15 kPa]}"])
    assert table.vary({"pressure.values": (1.0, 2.0)}).pressure.values == (1.0, 2.0)


def test_faults_of_variations_name_their_place(tmp_path: Path) -> None:
    (tmp_path / "f.yaml").write_text(GOOD + LISTED)
    opened = open_case(tmp_path / "f.yaml", ["cargo.mass=50"])
    for values, message in (
        ({"cargo.diameter": 0.6}, "--set cargo.diameter=0.6: cargo.diameter: 0.6 m is wider than the cover; a diameter up to"),
        ({"belts.1.height": 0.6}, "--set belts.1.height=0.6: belts.1.height: the belt comes closer than half a grid cell"),
        ({"shell.height": 0.3}, f"{tmp_path}/f.yaml:{END + 2}:28: belts.1.width: the belt comes closer than half a grid cell"),
    ):
        with pytest.raises(CaseError) as caught:
            opened.vary(values)
        assert str(caught.value).startswith(message)


# Messages


def test_all_faults_at_once_in_the_order_of_the_file() -> None:
    text = """\
gravty: 9.81
shell: {diameter: 5 s, height: 0.6 m}
fabric:
  E: 20 kN/m
  areal_density: -1 kg/m^2
  nu12: .nan
  nu12: 0.25
cargo: {mass: 100 kg}
"""
    assert faults(text, "grid.hoop=7", "time.end=0") == [
        "1:1: gravty: unknown key; did you mean 'gravity'?",
        "1:1: 'pressure' and 'gas' are missing; "
        "a section such as 'pressure: {law: constant, value: 15696 Pa}' or 'gas: {pressure: 15.7 kPa}' is expected",
        "2:19: shell.diameter: 's' is a time; a length > 0 such as '0.5 m' is expected",
        "3:1: fabric: missing 'damping_ratio' or 'viscosity'; for instance 'damping_ratio: 3 %'",
        "5:18: fabric.areal_density: '-1 kg/m^2' is out of range; a mass per area > 0 such as '0.05 kg/m^2' is expected",
        "6:9: fabric.nu12: nan is not a finite number; a ratio >= 0 such as '0.25' is expected",
        "7:3: fabric.nu12: duplicate key, first at f.yaml:6:3; each key once is expected",
        "8:1: cargo.velocity: missing; a speed > 0 such as '6 m/s' is expected",
        "--set grid.hoop=7: grid.hoop: 7 is out of range; an integer >= 8 and <= 10000 such as '120' is expected",
        "--set time.end=0: time.end: 0 is out of range; a time > 0 such as '1 s' is expected",
    ]


def test_sine_law_takes_no_height_of_the_cargo_for_one_of_the_shell() -> None:
    text = GOOD.replace(", height: 0.6 m", "").replace("6 m/s}", "6 m/s, height: 0.5 m}")
    assert faults(text.replace("constant, value: 15696 Pa", "sine, peak_time: 0.1 s")) == [
        "1:1: shell.height: missing; a length > 0 such as '0.6 m' is expected"
    ]


def test_keys_of_other_laws_are_named_in_the_order_of_the_table() -> None:
    told = faults(GOOD, override := "pressure={law: constant, values: 1, peak_time: 1, value: 1, zzz: 1}")
    assert [fault.removeprefix(f"--set {override}: pressure.") for fault in told] == [
        "values: not a key of the constant law; law, value, damping are expected",
        "peak_time: not a key of the constant law; law, value, damping are expected",
        "zzz: unknown key; known are law, value, damping, peak_time, end_time, times, values",
    ]


END = GOOD.count("\n") + 1


@pytest.mark.parametrize(
    ("section", "message"),
    [
        # kinds of values
        ("title: 12", "{}:8: title: 12 is not a text (quote it); a text such as 'My drop' is expected"),
        ("gravity: -1", "{}:10: gravity: -1 is out of range; an acceleration >= 0 such as '9.80665 m/s^2' is expected"),
        ("gravity: true", "{}:10: gravity: true is not a number; an acceleration >= 0 such as '9.80665 m/s^2' is expected"),
        ("gravity:", "{}:9: gravity: no value; an acceleration >= 0 such as '9.80665 m/s^2' is expected"),
        ("gravity: [1]", "{}:10: gravity: a list is not one value; an acceleration >= 0 such as '9.80665 m/s^2' is expected"),
        (
            "gravity: {a: 1}",
            "{}:10: gravity: a mapping is not one value; an acceleration >= 0 such as '9.80665 m/s^2' is expected",
        ),
        ("gravity: .inf", "{}:10: gravity: inf is not a finite number; an acceleration >= 0 such as '9.80665 m/s^2' is expected"),
        (
            "time: {end: 1e-200}",
            "{}:13: time.end: 1e-200 is not between 1e-30 and 1e30 in SI units; a time > 0 such as '1 s' is expected",
        ),
        ("time: {end: 1" + 400 * "0" + "}", "{}:13: time.end: inf is not a finite number; a time > 0 such as '1 s' is expected"),
        ("time: {courant: 0}", "{}:17: time.courant: 0 is out of range; auto or a ratio > 0 such as '0.5' is expected"),
        (
            "time: {courant: fast}",
            "{}:17: time.courant: 'fast' is not a number with a unit; auto or a ratio > 0 such as '0.5' is expected",
        ),
        ("time: {end: 1 sec}", "{}:13: time.end: unknown unit 'sec'; a time > 0 such as '1 s' is expected"),
        (
            "grid: {generatrix: 3}",
            "{}:20: grid.generatrix: 3 is out of range; an integer >= 4 and <= 10000 such as '44' is expected",
        ),
        ("grid: {hoop: 9.5}", "{}:14: grid.hoop: 9.5 is not an integer; an integer >= 8 and <= 10000 such as '120' is expected"),
        (
            "grid: {hoop: '90'}",
            "{}:14: grid.hoop: '90' is not an integer; an integer >= 8 and <= 10000 such as '120' is expected",
        ),
        ("model: {scheme: cells}", "{}:17: model.scheme: unknown value 'cells'; edge or cell is expected"),
        ("model: edge", "{}:8: model: not a mapping; a mapping of scheme, fidelity is expected"),
        ("output:", "{}:8: output: not a mapping; a mapping of snapshot_interval, history_interval, cfc is expected"),
        ("output: {cfc: 100}", "{}:15: output.cfc: unknown value 100; 60 or 180 or 600 or 1000 is expected"),
        ("output: {cfc: 60.0}", "{}:15: output.cfc: unknown value 60.0; 60 or 180 or 600 or 1000 is expected"),
        ("output: {cfc: '180'}", "{}:15: output.cfc: unknown value '180'; 60 or 180 or 600 or 1000 is expected"),
        (
            "output: {history_interval: 0}",
            "{}:28: output.history_interval: 0 is out of range; an integer >= 1 such as '1' is expected",
        ),
        (
            "output: {snapshot_interval: 0 s}",
            "{}:29: output.snapshot_interval: '0 s' is out of range; a time > 0 such as '2 ms' is expected",
        ),
        # keys
        ("grid: {hoops: 90}", "{}:8: grid.hoops: unknown key; did you mean 'hoop'?"),
        ("grid: {zzz: 90}", "{}:8: grid.zzz: unknown key; known are generatrix, hoop"),
        ("cargo: {}", "{}:1: cargo: duplicate key, first at f.yaml:6:1; each key once is expected"),
        # YAML beyond plain data
        ("gravity: &a 9.8", "{}:10: gravity: anchor '&a' is not supported; leave it out"),
        ("gravity: !!float 9.8", "{}:10: gravity: tag 'tag:yaml.org,2002:float' is not supported; leave it out"),
        ("<<: {a: 1}", "{}:1: <<: merge keys are not supported; write the keys out"),
        ("? [a]\n: 1", "{}:3: a key that is not a text; plain keys are expected"),
        ("---\na: 1", "{}:1: a second document; one document a file is expected"),
        # belts
        (
            "belts: 3",
            "{}:8: belts: not a mapping; a mapping of count, layers, stiffness, line_density, width, strength is expected",
        ),
        ("belts: {layers: 5, width: 1 cm}", "{}:1: belts.count: missing; an integer >= 0 such as '3' is expected"),
        ("belts: {count: 1, layers: 5}", "{}:1: belts.width: missing; a length > 0 such as '16.667 mm' is expected"),
        (
            "belts: {count: 1, width: 1 cm}",
            "{}:1: belts: missing 'layers' or 'stiffness' and 'line_density'; for instance 'layers: 5'",
        ),
        ("belts: {count: 0, layers: 0}", "{}:27: belts.layers: 0 is out of range; a ratio > 0 such as '5' is expected"),
        (
            "belts: {count: -1, layers: 5, width: 1 cm}",
            "{}:16: belts.count: -1 is out of range; an integer >= 0 such as '3' is expected",
        ),
        (
            "belts: [{height: 0.3, layers: 5, width: 1 cm, line_density: 1 g/m}]",
            "{}:47: belts.0.line_density: given besides layers; either 'layers' or 'stiffness' and 'line_density' is expected",
        ),
        (
            "belts: [{height: 0.3, stiffness: 5, width: 1 cm}]",
            "{}:9: belts.0.line_density: missing; a mass per length > 0 such as '4.2 g/m' is expected",
        ),
        (
            "belts: [7]",
            "{}:9: belts.0: not a mapping; a mapping of height, layers, stiffness, line_density, width, strength is expected",
        ),
        (
            "belts: [{height: 0.59, layers: 5, width: 20 mm}]\ngrid: {generatrix: 36}",
            "{}:35: belts.0.width: the belt comes closer than half a grid cell to a cover; "
            "a height from 0.0183333 m to 0.581667 m is expected for this width",
        ),
        (
            "belts: [{width: 20 mm, layers: 5, height: 0.0183}]\ngrid: {generatrix: 36}",
            "{}:35: belts.0.height: the belt comes closer than half a grid cell to a cover; "
            "a height from 0.0183333 m to 0.581667 m is expected for this width",
        ),
        (
            "belts: [{height: 0.3, layers: 5, width: 0.6}]\ngrid: {generatrix: 36}",
            "{}:34: belts.0.width: the belt is wider than the room between the covers; a width < 0.583333 m is expected",
        ),
        (
            "belts: {count: 2, layers: 5, width: 0.39}\ngrid: {generatrix: 36}",
            "{}:30: belts.width: the outer belts come closer than half a grid cell to the covers; "
            "a width up to 0.383333 m is expected for this count",
        ),
        (
            "belts: {count: 71, layers: 5, width: 1 mm}\ngrid: {generatrix: 36}",
            "{}:9: belts.count: the outer belts come closer than half a grid cell to the covers; "
            "a count up to 70 is expected on this grid",
        ),
    ],
)
def test_fault_in_another_section(section: str, message: str) -> None:
    assert faults(GOOD + section + "\n") == [message.format(END)]


@pytest.mark.parametrize(
    ("old", "new", "messages"),
    [
        (
            "diameter: 0.5 m",
            "diameter: 0 m",
            ["1:19: shell.diameter: '0 m' is out of range; a length > 0 such as '0.5 m' is expected"],
        ),
        ("height: 0.6 m", "heigth: 0.6 m", ["1:26: shell.heigth: unknown key; did you mean 'height'?"]),
        ("shell:", "shel:", ["1:1: shel: unknown key; did you mean 'shell'?"]),
        ("mass: 100 kg", "mass: -5 kg", ["6:15: cargo.mass: '-5 kg' is out of range; a mass > 0 such as '100 kg' is expected"]),
        ("6 m/s", "0", ["6:33: cargo.velocity: 0 is out of range; a speed > 0 such as '6 m/s' is expected"]),
        # fabric
        ("E: 20 kN/m", "E11: 1", ["2:1: fabric.E22: missing; a force per length > 0 such as '20 kN/m' is expected"]),
        ("  E: 20 kN/m\n", "", ["2:1: fabric: missing 'E' or 'E11' and 'E22'; for instance 'E: 20 kN/m'"]),
        (
            "E: 20 kN/m",
            "E: 20 kN/m\n  E11: 20 kN/m",
            ["4:3: fabric.E11: given besides E; either 'E' or 'E11' and 'E22' is expected"],
        ),
        ("viscosity", "viscosty", ["5:3: fabric.viscosty: unknown key; did you mean 'viscosity'?"]),
        (
            "viscosity: 0.2",
            "viscosity: -0.2",
            ["5:14: fabric.viscosity: '-0.2 N*s/m' is out of range; a fabric viscosity >= 0 such as '0.2 N*s/m' is expected"],
        ),
        (
            "viscosity:",
            "damping_ratio: 3 %\n  viscosity:",
            ["6:3: fabric.viscosity: given besides damping_ratio; either 'damping_ratio' or 'viscosity' is expected"],
        ),
        (
            "  viscosity: 0.2 N*s/m\n",
            "",
            ["2:1: fabric: missing 'damping_ratio' or 'viscosity'; for instance 'damping_ratio: 3 %'"],
        ),
        ("E: 20 kN/m", "E11: 1\n  E22: 4\n  nu12: 2", ["5:3: fabric.nu12: nu12*nu21 = 1; a product < 1 is expected"]),
        ("E: 20 kN/m", "E11: 1\n  E22: 4\n  nu21: 0.6", ["5:3: fabric.nu21: nu12*nu21 = 1.44; a product < 1 is expected"]),
        ("E: 20 kN/m", "E: 1\n  nu12: -0.1", ["4:9: fabric.nu12: -0.1 is out of range; a ratio >= 0 such as '0.25' is expected"]),
        (
            "E: 20 kN/m",
            "E: 1\n  G12: -1",
            ["4:8: fabric.G12: -1 is out of range; a force per length >= 0 such as '1 kN/m' is expected"],
        ),
        ("E: 20 kN/m", "E: 1\n  slack: no", ["4:10: fabric.slack: unknown value 'no'; cut or compression is expected"]),
        (
            "E: 20 kN/m",
            "law: TEXT\n  E: 1",
            ["3:8: fabric.law: unknown value 'TEXT'; tension_field or nominal_tension or true_tension is expected"],
        ),
        *(
            (
                "E: 20 kN/m",
                f"law: {law}\n  E11: 20 kN/m\n  E22: 10 kN/m\n  nu12: 0.2\n  nu21: 0.2",
                [
                    "7:3: fabric.nu21: nu12*E11 = 4000 N/m is not nu21*E22 = 2000 N/m, so there is no elastic energy; "
                    "nu21: 0.4, or one of nu12 and nu21 alone is expected"
                ],
            )
            for law in ("tension_field", "nominal_tension", "true_tension")
        ),
        (
            "E: 20 kN/m",
            "E: 1\n  slack: compression",
            ["4:3: fabric.slack: a tension field carries no compression; slack: cut, or law: nominal_tension is expected"],
        ),
        (
            "E: 20 kN/m",
            "slack: compression\n  law: tension_field\n  E: 1",
            ["4:3: fabric.law: a tension field carries no compression; slack: cut, or law: nominal_tension is expected"],
        ),
        # pressure
        ("law: constant", "law: constnt", ["7:17: pressure.law: unknown value 'constnt'; constant or sine or table is expected"]),
        ("law: constant", "lw: constant", ["7:12: pressure.lw: unknown key; did you mean 'law'?"]),
        ("law: constant, ", "", ["7:1: pressure.law: missing; constant or sine or table is expected"]),
        (", value: 15696 Pa", "", ["7:1: pressure.value: missing; a pressure >= 0 such as '15696 Pa' is expected"]),
        ("15696 Pa", "-1 Pa", ["7:34: pressure.value: '-1 Pa' is out of range; a pressure >= 0 such as '15696 Pa' is expected"]),
        (
            "15696 Pa",
            "1, damping: -1",
            ["7:46: pressure.damping: -1 is out of range; an inverse speed >= 0 such as '0 s/m' is expected"],
        ),
        (
            "value: 15696 Pa",
            "value: 1, peak_time: 1",
            ["7:37: pressure.peak_time: not a key of the constant law; law, value, damping are expected"],
        ),
        ("constant, value: 15696 Pa", "sine", ["7:1: pressure.peak_time: missing; a time > 0 such as '0.1 s' is expected"]),
        (
            "constant, value: 15696 Pa",
            "sine, peak_time: 0.2",
            ["7:23: pressure.peak_time: peak_time 0.2 s is not before end_time 0.2 s; peak_time < end_time is expected"],
        ),
        (
            "constant, value: 15696 Pa",
            "sine, peak_time: 0.1, end_time: 0.1",
            ["7:39: pressure.end_time: peak_time 0.1 s is not before end_time 0.1 s; peak_time < end_time is expected"],
        ),
        (
            "constant, value: 15696 Pa",
            "table, times: [0, 1, 1 s], values: [1, -1]",
            [
                "7:38: pressure.times.2: not later than the time before it; a time > 1 s is expected",
                "7:56: pressure.values.1: -1 is out of range; a pressure >= 0 such as '15 kPa' is expected",
            ],
        ),
        (
            "constant, value: 15696 Pa",
            "table, times: [0, 1, 2], values: [1, 2]",
            ["7:42: pressure.values: 2 values for 3 times; a value for each time is expected"],
        ),
        (
            "constant, value: 15696 Pa",
            "table, times: 3, values: [2]",
            [
                "7:31: pressure.times: not a list; a list such as [0 s, 0.1 s] is expected",
                "7:42: pressure.values: fewer than two values; a list such as [0 kPa, 15 kPa] is expected",
            ],
        ),
        (
            "constant, value: 15696 Pa",
            "table, times: [-1, 2], values: [1, 2]",
            ["7:32: pressure.times.0: -1 is out of range; a time >= 0 such as '0.1 s' is expected"],
        ),
    ],
)
def test_fault(old: str, new: str, messages: list[str]) -> None:
    assert old in GOOD
    assert faults(GOOD.replace(old, new)) == messages


@pytest.mark.parametrize("text", ["", "# only a comment\n"])
def test_empty_file(text: str) -> None:
    assert faults(text) == ["1:1: an empty file; sections such as 'shell:' are expected"]


def test_top_level_is_a_mapping() -> None:
    assert faults("- shell") == ["1:1: not a mapping; sections such as 'shell:' are expected"]


def test_yaml_syntax() -> None:
    (message,) = faults("shell:\n  diameter: 0.5: m\n")
    assert message.startswith("2:16: mapping values are not allowed")
    assert message.endswith("; valid YAML is expected")
    assert faults("a: \x01")[0].startswith("1:4: ")
    assert faults("a: " + 3000 * "[")[0].endswith("valid YAML is expected")


def test_tab_is_named() -> None:
    expected = "a tab; spaces are expected in front of a key"
    assert faults("shell:\n\tdiameter: 0.5 m\n") == [f"2:1: {expected}"]
    assert faults("shell:\n  diameter: 0.5 m\n \theight: 0.6 m\n") == [f"3:2: {expected}"]


def test_decimal_comma_is_named() -> None:
    shell = "{diameter: 0.5 m, height: 0.6 m}"
    (inside,) = faults(GOOD.replace(shell, "\n  diameter: 0,5 m\n  height: 0.6 m"))
    assert inside.startswith("2:13: shell.diameter: '0,5 m' has a comma, numbers have a decimal point; ")
    behind = faults(GOOD.replace("0.5 m", "1,5 m"))
    assert behind == ["1:21: shell.5 m: unknown key; numbers have a decimal point, no comma"]


def test_key_that_is_like_none_suggests_none() -> None:
    (fault,) = faults(GOOD + "colour: 3\n")
    assert fault.startswith("8:1: colour: unknown key; known are ")


def test_aliases_are_refused() -> None:
    assert faults(GOOD.replace("0.5 m", "&d 0.5 m").replace("0.6 m", "*d")) == [
        "1:19: shell.diameter: anchor '&d' is not supported; leave it out",
        "1:37: shell.height: alias '*d' is not supported; write the value out",
    ]


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    missing, binary = tmp_path / "missing.yaml", tmp_path / "binary.yaml"
    binary.write_bytes(b"title: a\nshell: \xff\n")
    expected = {
        missing: f"{missing}: No such file or directory; a case file is expected",
        tmp_path: f"{tmp_path}: Is a directory; a case file is expected",
        binary: f"{binary}:2:8: byte 0xff is not UTF-8; a text file in UTF-8 is expected",
    }
    for path, message in expected.items():
        with pytest.raises(CaseError) as caught:
            load_case(path)
        assert caught.value.faults == [message]


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "mark.yaml"
    path.write_text(GOOD, encoding="utf-8-sig")
    assert load_case(path).title == "mark"


def test_error_goes_through_a_process_pool() -> None:
    assert pickle.loads(pickle.dumps(CaseError(["a", "b"]))).faults == ["a", "b"]


# Overrides


def test_override_of_both_moduli() -> None:
    text = GOOD.replace("E: 20 kN/m", "E11: 1 kN/m\n  E22: 2 kN/m")
    for overrides, moduli in (
        (["fabric.E=18.75kN/m"], (18750, 18750)),
        (["fabric.E=1", "fabric.E = 2"], (2, 2)),
        (["fabric.E=18.75kN/m", "fabric.E22=3"], (18750, 3)),
        (["fabric.E22=3"], (1000, 3)),
    ):
        fabric = parse_case(text, "f.yaml", overrides).fabric
        assert moduli == (fabric.E11, fabric.E22)
    assert (case("", "fabric.E11=3").fabric.E11, case("", "fabric.E11=3").fabric.E22) == (3, 20000)


def test_override_replaces_its_alternative() -> None:
    assert case("", "fabric.damping_ratio=3 %").fabric.viscosity == pytest.approx(2 * 0.03 * 0.25 * math.sqrt(1000))
    assert case("", "fabric.damping_ratio=3 %", "fabric.viscosity=1").fabric.viscosity == 1
    listed = "belts: [{height: 0.2 m, stiffness: 1, line_density: 1, width: 20 mm}]\n"
    assert case(listed, "belts.0.layers=5").belts == (Belt(0.2, 2000, 0.005, 0.02),)


def test_overrides_reach_any_key() -> None:
    belts = "belts: [{height: 0.2 m, layers: 5, width: 20 mm}, {height: 0.3 m, layers: 5, width: 20 mm}]\n"
    assert [belt.height for belt in case(belts, "belts.1.height=0.4 m").belts] == [0.2, 0.4]
    assert case("belts: {count: 3, layers: 5, width: 20 mm}\n", "belts.count=0").belts == ()
    assert len(case("", "belts={count: 2, layers: 5, width: 20 mm}").belts) == 2
    assert case(belts, "belts.1={height: 0.5 m, layers: 1, width: 20 mm}").belts[1].height == 0.5
    got = case("", "title=Other", "gravity=1", "output.history_interval=7", "time.end=2")
    assert (got.title, got.gravity, got.output.history_interval, got.time.end) == ("Other", 1, 7, 2)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("fabric.E=18 s", "fabric.E: 's' is a time; a force per length > 0 such as '20 kN/m' is expected"),
        ("fabric.E=", "fabric.E: no value; a force per length > 0 such as '20 kN/m' is expected"),
        ("fabric.viscosty=1", "fabric.viscosty: unknown key; did you mean 'viscosity'?"),
        ("fabrik.E=1", "fabrik: unknown key; did you mean 'fabric'?"),
        ("fabric.E", "not KEY=VALUE; a key and its value such as 'fabric.E=18.75kN/m' is expected"),
        ("fabric..E=1", "not KEY=VALUE; a key and its value such as 'fabric.E=18.75kN/m' is expected"),
        ("cargo.mass.x=1", "cargo.mass.x: cargo.mass is a single value without keys; cargo.mass=VALUE is expected"),
        ("belts.2.width=1", "belts.2: belts is a list without a '2'; its numbers are 0, 1"),
        ("belts.count=0", "belts.count: belts is a list without a 'count'; its numbers are 0, 1"),
        (
            "belts.1.width=0.4",
            "belts.1.width: the belt comes closer than half a grid cell to a cover; "
            "a height from 0.208333 m to 0.391667 m is expected for this width",
        ),
        ("pressure.law=table", None),
    ],
)
def test_override_faults(override: str, message: str | None) -> None:
    belts = "belts: [{height: 0.2 m, layers: 5, width: 20 mm}, {height: 0.2 m, layers: 5, width: 20 mm}]\n"
    got = faults(GOOD + belts + "grid: {generatrix: 36}\n", override)
    if message is not None:
        assert got == [f"--set {override}: {message}"]
    else:  # keys of the file that the new law does not know, and what it misses
        assert [fault.split(":")[2].strip() for fault in got] == ["pressure.times", "pressure.values", "pressure.value"]


def test_override_that_is_not_yaml() -> None:
    (message,) = faults(GOOD, "fabric.E=[")
    assert message.startswith("--set fabric.E=[: fabric.E: ")
    assert message.endswith("; a YAML value is expected")


# Shipped cases, schema, starter


def test_paper_case_is_short_and_right() -> None:
    (path,) = [path for path in CONFIGS if path.stem == "paper"]
    got = load_case(path)
    assert len(path.read_text().splitlines()) < 35
    assert (got.shell.diameter, got.shell.height, got.cargo.mass, got.cargo.velocity) == (0.5, 0.6, 100, 6)
    assert (got.fabric.E11, got.fabric.E22, got.fabric.nu12, got.fabric.nu21) == (20000, 20000, 0.25, 0.25)
    assert got.pressure.value == pytest.approx(4 * 0.125 * 9.81 * 80**2 / 2)
    assert [belt.height for belt in got.belts] == pytest.approx([0.15, 0.3, 0.45])
    assert math.sqrt(got.cargo.velocity**2 + 2 * got.gravity * got.shell.height) == pytest.approx(6.91143, abs=1e-5)


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_round_trip(path: Path, tmp_path: Path) -> None:
    resolved = case_to_dict(load_case(path))
    for name, text in (("case.json", json.dumps(resolved)), ("case.yaml", yaml.safe_dump(resolved))):
        (tmp_path / name).write_text(text)
        assert load_case(tmp_path / name) == load_case(path)


def test_round_trip_of_a_table(tmp_path: Path) -> None:
    original = case("", f"pressure={{law: table, times: [0, {1 / 3!r}], values: [1, 2]}}", "title='Größe: 1e3'")
    path = tmp_path / "other.json"
    path.write_text(json.dumps(case_to_dict(original)))
    assert load_case(path) == original


def test_starter_shows_every_key_with_a_comment() -> None:
    text = starter()
    assert parse_case(text, "case.yaml").model.fidelity == "auto"
    section, shown = "", set()
    for line in text.splitlines()[2:]:
        assert len(line) <= 130
        match = re.fullmatch(r"( *)(?:# )?(?:- |  )?(\w+):(?: [^#]*# (.+))?", line)
        assert match, line
        indent, name, comment = match.groups()
        assert comment or not indent
        section = section if indent else name
        shown.add((section, name) if indent else ("", name) if comment else ("", ""))
    sections = {section.name: section.keys or section.each for section in (TOP, *SECTIONS)}
    known = {(name, key.name) for name, keys in sections.items() for key in keys} | {("", "contact")}
    assert shown - {("", "")} == known


def test_schema() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator.check_schema(schema())
    validator = jsonschema.Draft202012Validator(schema())
    for path in CONFIGS:
        validator.validate(yaml.safe_load(path.read_text()))
        validator.validate(case_to_dict(load_case(path)))
    validator.validate(yaml.safe_load(starter()))
    good = yaml.safe_load(GOOD)
    fabric, belt = good["fabric"], {"height": 0.3, "layers": 5, "width": "1 cm"}
    validator.validate(good | {"belts": {"count": 0}})
    for wrong in (
        good | {"extra": 1},
        {key: value for key, value in good.items() if key != "cargo"},
        good | {"grid": {"hoop": 7}},
        good | {"output": {"cfc": 100}},
        good | {"grid": {"hoops": 90}},
        good | {"gravity": "-1 m/s^2"},
        good | {"shell": good["shell"] | {"height": "0.6 kg"}},
        good | {"shell": good["shell"] | {"height": "0.6 meters"}},
        good | {"gravity": "9.8 m/s"},
        good | {"fabric": fabric | {"E11": 1}},
        good | {"fabric": fabric | {"E11": 1, "E22": 1}},
        good | {"fabric": fabric | {"damping_ratio": 0.1}},
        good | {"fabric": {key: value for key, value in fabric.items() if key != "viscosity"}},
        good | {"fabric": fabric | {"slack": "no"}},
        good | {"belts": {"layers": 5, "width": 0.01}},
        good | {"belts": {"count": 1, "layers": 5}},
        good | {"belts": [belt | {"stiffness": 1}]},
        good | {"pressure": {"law": "constant", "value": 1, "peak_time": 1}},
        good | {"pressure": {"law": "table", "times": [0], "values": [0]}},
    ):
        assert not validator.is_valid(wrong), wrong


def test_schema_knows_the_dimension_of_two_factors() -> None:
    """It takes what the program takes and nothing else; of three factors it takes all that the program does."""
    factors = [f"{name}{power}" for name in ("m", "mm", "kg", "s", "N", "Pa", "K", "%") for power in ("", "^2", "³", "^-1")]
    pairs = [f"{one}{joint}{other}" for one in factors for joint in ("*", " / ", " ") for other in factors]
    triples = ["N*s/m", "kg/m/s", "kg*m/s²", "kg m s^-2", "N/m * s", "kg/m·s^-2", "kN·ms/mm", "kg/s^2/m"]
    patterns = {dimension: re.compile(pattern(dimension)) for dimension in Dimension}
    for unit in ("", *factors, *pairs, "metre", "KG", "m+m", "degC"):
        text = f"1.5e1 {unit}"
        for dimension, known in patterns.items():
            try:
                parse_quantity(text, dimension)
            except ValueError:
                assert not known.search(text), (dimension, text)
            else:
                assert known.search(text), (dimension, text)
    for dimension, known in patterns.items():
        for unit in triples:
            with suppress(ValueError):
                parse_quantity(f"2 {unit}", dimension)
                assert known.search(f"2 {unit}"), (dimension, unit)
        for text in ("", "m", "-1", "1,5 m", "1..5"):
            assert not known.search(text)
        assert re.search(pattern(dimension, signed=True), f"-1.5 {dimension.unit}")
        assert bool(known.search("-40 degC")) == (dimension is Dimension.TEMPERATURE)


def test_schema_beside_the_shipped_cases() -> None:
    """`softbrake schema > configs/case.schema.json` after a change of the keys; editors find it from the first line of a case."""
    assert json.loads((CONFIGS[0].parent / "case.schema.json").read_text()) == schema()
    for path in CONFIGS:
        assert path.read_text().startswith("# yaml-language-server: $schema=case.schema.json\n")


def test_reading_a_case_loads_no_arrays() -> None:
    code = "import sys, softbrake.case; sys.exit(bool({'numpy', 'numba', 'h5py', 'rich'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parent.parent, check=False).returncode == 0


def test_contact_is_all_of_it_or_what_is_named() -> None:
    assert parse_case(GOOD, "case.yaml").contact == ("ground", "cover", "cargo", "axis", "folds")  # of any fidelity
    assert parse_case(GOOD, "case.yaml", ["model.fidelity=full"]).contact == ("ground", "cover", "cargo", "folds")
    assert parse_case(GOOD + "contact: full\n", "case.yaml") == parse_case(GOOD, "case.yaml")
    assert parse_case(GOOD + "contact: solid\n", "case.yaml").contact == ("ground", "cover", "cargo")
    assert parse_case(GOOD + "contact: paper\n", "case.yaml").contact == ("ground", "belts")
    assert parse_case(GOOD + "contact: ground\n", "case.yaml").contact == ("ground",)
    assert parse_case(GOOD + "contact: [cargo, ground]\n", "case.yaml").contact == ("ground", "cargo")
    assert parse_case(GOOD + "contact: []\n", "case.yaml").contact == ()
    with pytest.raises(CaseError, match=r"contact\.1: unknown part 'clouds'; ground, .*folds, or a list of them, is expected"):
        parse_case(GOOD + "contact: [ground, clouds]\n", "case.yaml")
    with pytest.raises(
        CaseError, match="contact: unknown part 'al'; full, solid, paper, ground, .*folds, or a list of them, is expected"
    ):
        parse_case(GOOD + "contact: al\n", "case.yaml")


def test_cargo_is_as_wide_as_the_cover_or_narrower() -> None:
    wide = parse_case(GOOD, "case.yaml")
    assert (wide.cargo.diameter, wide.cargo.height) == (wide.shell.diameter, None)
    narrow = parse_case(GOOD, "case.yaml", ["cargo.diameter=0.3 m", "cargo.height=0.4 m"])
    assert (narrow.cargo.diameter, narrow.cargo.height) == (0.3, 0.4)
    assert parse_case(json.dumps(case_to_dict(narrow)), "case.yaml") == narrow
    with pytest.raises(CaseError, match=r"cargo\.diameter: 0\.6 m is wider than the cover"):
        parse_case(GOOD, "case.yaml", ["cargo.diameter=0.6 m"])
