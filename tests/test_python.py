"""The package as scripts use it: cases from files and mappings, bounds, answers, results."""

import csv
import inspect
import json
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import synthetic_drop as drop
from conftest import ROOT
from typer.testing import CliRunner

import softbrake
from softbrake.case.case import SECTIONS, case_to_dict
from softbrake.case.section import Part
from softbrake.cli.app import app
from softbrake.core.columns import History
from softbrake.sim.inflate import inflate
from softbrake.sim.result_file import ResultError

PAPER = ROOT / "configs" / "paper.yaml"
LUMPED = {
    "shell": {"diameter": "50 cm", "height": 0.6},
    "fabric": {"E": "20 kN/m", "areal_density": 0.05, "viscosity": 0.2},
    "cargo": {"mass": np.int64(100), "velocity": np.float32(6.0)},
    "pressure": {"law": "table", "times": np.array([0.0, 0.1]), "values": ("10 kPa", 15e3)},
    "model": {"fidelity": "lumped"},
}


def test_run_takes_the_path_of_a_case_file_or_a_mapping(tmp_path: Path) -> None:
    case = softbrake.load_case(LUMPED)
    assert (case.title, case.shell.diameter, case.cargo.mass, case.pressure.values) == ("case", 0.5, 100.0, (1e4, 1.5e4))
    answers = [softbrake.run(case), softbrake.run(LUMPED)]
    file = tmp_path / "case.json"
    file.write_text(json.dumps(case_to_dict(case)))
    answers += [softbrake.run(file), softbrake.run(str(file))]
    assert {answer.impact_velocity for answer in answers} == {answers[0].impact_velocity}
    with pytest.raises(softbrake.CaseError, match="no.yaml: No such file"):
        softbrake.run("no.yaml")


@pytest.mark.parametrize("path", sorted(ROOT.glob("configs/*.yaml")), ids=lambda path: path.stem)
def test_the_mapping_of_a_case_gives_it_again(path: Path) -> None:
    case = softbrake.load_case(path)
    assert softbrake.load_case(case_to_dict(case)) == case


def test_faults_of_a_mapping_name_the_key() -> None:
    faulty = LUMPED | {"cargo": {"mass": -3, "velocity": 6j}, "fabrik": {}, "contact": [None]}
    with pytest.raises(softbrake.CaseError) as caught:
        softbrake.load_case(faulty, "shell.height=-1")
    told = caught.value.faults
    assert "case: cargo.mass: -3 is out of range; a mass > 0 such as '100 kg' is expected" in told
    assert "case: cargo.velocity: 6j is no value; a number in SI units or a text such as '20 kN/m' is expected" in told
    assert "case: fabrik: unknown key; did you mean 'fabric'?" in told
    assert told[-1].startswith("--set shell.height=-1: shell.height: -1 is out of range")
    endless: dict[str, Any] = {}
    endless["shell"] = endless
    with pytest.raises(softbrake.CaseError, match="case: nested too deeply"):
        softbrake.load_case(endless)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda case: replace(case.cargo, mass=-3), "cargo.mass: -3 is not allowed; a mass > 0 such as '100 kg' is expected"),
        (lambda case: replace(case.cargo, mass="3 kg"), "cargo.mass: '3 kg' is not allowed"),
        (lambda case: replace(case.cargo, diameter=None), "cargo.diameter: None is not allowed"),
        (lambda case: replace(case.shell, height=float("nan")), "shell.height: nan is not allowed"),
        (lambda case: replace(case.grid, hoop=9.5), "grid.hoop: 9.5 is not allowed; an integer >= 8 and <= 10000"),
        (lambda case: replace(case.time, end=True), "time.end: True is not allowed"),
        (lambda case: replace(case.model, fidelity="fulll"), "model.fidelity: 'fulll' is not allowed; full or axisymmetric"),
        (lambda case: replace(case.belts[0], width=0.0), "belts.width: 0.0 is not allowed"),
        (lambda case: replace(case.pressure, law="table", times=(0.0, -1.0)), "pressure.times: -1.0 is not allowed"),
        (lambda case: replace(case.output, cfc=500), "output.cfc: 500 is not allowed; 60 or 180 or 600 or 1000 is expected"),
        (lambda case: replace(case.fabric, slack="cutt"), "fabric.slack: 'cutt' is not allowed"),
        (lambda case: replace(case, gravity=-1.0), "gravity: -1.0 is not allowed"),
        (lambda case: replace(case, contact=("grund",)), "contact: 'grund' is no part"),
        (lambda case: replace(case, cargo=None), "cargo: None is no section of a case"),
    ],
)
def test_a_part_of_a_case_keeps_within_the_bounds_of_its_keys(change: Callable[[Any], object], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        change(softbrake.load_case(PAPER))


def test_every_part_of_a_case_has_bounds() -> None:
    """Also one that is added."""
    kinds = [section.kind for section in SECTIONS if is_dataclass(section.kind)]
    assert len(kinds) == 14
    assert all(isinstance(kind, type) and issubclass(kind, Part) for kind in kinds)


def test_bounds_let_pass_what_files_give() -> None:
    case = softbrake.load_case(PAPER)
    assert replace(case.cargo, mass=np.float64(90), height=None).mass == 90.0
    assert replace(case.grid, hoop=np.int64(96)).hoop == 96
    assert replace(case.pressure.steady(0.0), damping=0.0).peak_time == 0.0


def test_every_field_of_the_answer_has_unit_and_meaning() -> None:
    told = softbrake.Summary.__doc__ or ""
    for field in fields(softbrake.Summary):
        assert field.metadata["meaning"], field.name
        unit = f" [{field.metadata['unit']}]" if field.metadata["unit"] else ""
        assert f"{field.name}{unit}: {field.metadata['meaning']}" in told


@pytest.mark.parametrize("name", ["load_case", "read_result", "run"])
def test_help_is_complete_without_inner_names(name: str) -> None:
    function = getattr(softbrake, name)
    told = inspect.getdoc(function) or ""
    parameters = inspect.signature(function).parameters
    for parameter in parameters.values():
        assert parameter.name == "path" or f"{parameter.name}: " in told or parameter.default is MISSING, parameter.name
    outer = {*softbrake.__all__, *parameters, *(field.name for field in fields(softbrake.Summary)), "snapshots"}
    keys = {"time.courant", "time.end", "model.fidelity: auto", "initial: inflated", "fabric.E=18.75kN/m"}
    quoted = {word for word in re.findall(r"`([^`]+)`", told) if not word.startswith(("{", "read_result("))}
    assert quoted <= outer | keys
    for error in re.findall(r"\b[A-Z][a-zA-Z]+Error\b|\bDiverged\b|\bNotInflated\b|\bLongStep\b", told):
        assert error in softbrake.__all__ or hasattr(__import__("builtins"), error)


def test_a_result_has_history_frame_snapshots_and_answers(tmp_path: Path) -> None:
    file = tmp_path / "drop.vtkhdf"
    case = drop.case(4, 8)
    drop.write(file, case)
    result = softbrake.read_result(str(file))
    assert result.summary is not None and result.inflation is None
    assert softbrake.load_case(result.case) == case
    assert list(result.units) == list(result.history.dtype.names)
    assert result.units["height"] == History.HEIGHT.unit == "m"
    shapes = result.snapshots("tension_hoop")
    assert shapes.xyz.shape == (len(shapes.times), 5, 8, 3)
    assert shapes.fields["tension_hoop"].shape == shapes.xyz.shape[:3]
    with pytest.raises(ResultError, match="no field 'tension_hop'; velocity, tension_generatrix"):
        result.snapshots("tension_hop")


def test_a_history_becomes_a_data_frame(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    drop.write(tmp_path / "drop.vtkhdf", drop.case(4, 8))
    result = softbrake.read_result(tmp_path / "drop.vtkhdf")
    frame = result.frame()
    assert list(frame.columns) == list(result.units)
    np.testing.assert_array_equal(frame["time"], result.history["time"])


def test_without_pandas_a_frame_says_what_it_needs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drop.write(tmp_path / "drop.vtkhdf", drop.case(4, 8))
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="pip install pandas"):
        softbrake.read_result(tmp_path / "drop.vtkhdf").frame()


def export(folder: Path, *words: str) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, ["export", str(folder / "drop.vtkhdf"), *words])
    return done.exit_code, done.stdout, done.stderr


def test_curves_as_csv_are_exact_and_have_units(tmp_path: Path) -> None:
    drop.write(tmp_path / "drop.vtkhdf", drop.case(4, 8))
    assert export(tmp_path, "--format", "csv") == (0, f"{tmp_path / 'drop.csv'} written\n", "")
    with open(tmp_path / "drop.csv", newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    history = softbrake.read_result(tmp_path / "drop.vtkhdf").history
    assert header[0] == "time [s]" and "height [m]" in header and len(header) == len(history.dtype.names)
    assert [tuple(map(float, row)) for row in rows] == history.tolist()


def test_an_inflated_shell_has_no_curves(tmp_path: Path) -> None:
    inflate(softbrake.load_case(str(PAPER), ["grid={generatrix: 6, hoop: 8}", "belts=[]"]), tmp_path / "rest.vtkhdf")
    answer = CliRunner().invoke(app, ["export", str(tmp_path / "rest.vtkhdf"), "--format", "csv"])
    assert answer.exit_code == 2 and "an inflated shell has no history" in answer.output
    assert not (tmp_path / "rest.csv").exists()


def test_mistakes_of_export(tmp_path: Path) -> None:
    drop.write(tmp_path / "drop.vtkhdf", drop.case(4, 8))
    code, _, told = export(tmp_path)
    assert code == 2 and "Missing option '--format'" in told
    assert export(tmp_path, "--format", "cvs")[::2] == (2, "--format cvs: csv, xdmf, iso-mme or uff is expected\n")
    code, _, told = export(tmp_path, "--format", "csv", "-o", str(tmp_path / "drop.vtkhdf"))
    assert (code, told) == (2, f"{tmp_path / 'drop.vtkhdf'}: is the result; --output must name another file\n")
    assert softbrake.read_result(tmp_path / "drop.vtkhdf").summary is not None


def test_importing_the_package_loads_nothing_slow() -> None:
    code = "import sys, softbrake; softbrake.load_case; sys.exit(bool({'numpy', 'numba', 'h5py'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0
