"""The result file: what VTK reads of it, round trips, killed runs, messages."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic_drop as drop
from conftest import VtkSteps

import softbrake
from softbrake.case.case import Case, case_to_dict
from softbrake.case.sections.pressure import Pressure
from softbrake.core.columns import OF_GAS, History
from softbrake.sim import result_file as results
from softbrake.sim.result_file import ResultError, ResultFile
from softbrake.sim.summary import FilteredPeaks, PeakValue


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("results") / "drop.vtkhdf"
    drop.write(path, drop.case(6, 8, belts=2))
    return path


def vtk_steps(path: Path):
    """Time and PolyData of each step, as ParaView's reader sees them."""
    vtk = pytest.importorskip("vtkmodules.vtkIOHDF")
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    for step in range(reader.GetNumberOfSteps()):
        reader.SetStep(step)
        reader.Update()
        yield reader.GetTimeValue(), reader.GetOutputDataObject(0)


def test_vtk_reads_every_step_exactly(small: Path) -> None:
    numpy_support = pytest.importorskip("vtkmodules.util.numpy_support")
    case = drop.case(6, 8, belts=2)
    steps = 0
    for expected_time, (at, poly) in zip(np.linspace(0.0, drop.END, 13), vtk_steps(small), strict=True):
        assert at == expected_time
        xyz, fields = drop.shape(case, at)
        points = numpy_support.vtk_to_numpy(poly.GetPoints().GetData())
        np.testing.assert_array_equal(points[:-4], xyz.reshape(-1, 3).astype("f4"))
        assert np.all(points[-4:, 2] < 0)
        assert np.abs(points[-4:, :2]).max() == np.abs(points[:-4, :2]).max()  # the shell sets the bounds
        for name in results.POINT_FIELDS:
            values = numpy_support.vtk_to_numpy(poly.GetPointData().GetArray(name))
            np.testing.assert_array_equal(values[:-4], fields[name].reshape(-1, *values.shape[1:]).astype("f4"))
            assert name == "velocity" or values[-4:].tolist() == [values[:-4].min()] * 4  # and the colours
        height, velocity = drop.cargo(at)
        scalars = {name: poly.GetFieldData().GetArray(name).GetValue(0) for name in results.SCALARS}
        assert scalars == {"cover_height": height, "cargo_velocity": velocity, "gas_pressure": drop.PRESSURE}
        part = numpy_support.vtk_to_numpy(poly.GetCellData().GetArray("part"))
        assert part.tolist() == [1] * 2 + [0] * 48 + [2, 3, 4]
        pressure = numpy_support.vtk_to_numpy(poly.GetCellData().GetArray("pressure"))
        np.testing.assert_array_equal(pressure, np.where(np.isin(part, [0, 2, 3]), np.float32(drop.PRESSURE), 0))
        steps += 1
    assert steps == 13


def test_cells_are_the_belts_and_outward_polygons(small: Path) -> None:
    _, poly = next(vtk_steps(small))
    cells = [[poly.GetCell(c).GetPointId(k) for k in range(poly.GetCell(c).GetNumberOfPoints())] for c in range(53)]
    assert cells[0] == [*range(16, 24), 16]  # belts at a third and two thirds of six rows of eight
    assert cells[1] == [*range(32, 40), 32]
    points = np.array([poly.GetPoint(k) for k in range(poly.GetNumberOfPoints())])
    for cell in cells[2:50]:
        corners = points[cell]
        normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
        assert normal @ (corners.mean(axis=0) * [1, 1, 0]) > 0
    normals = [np.cross(points[c[1]] - points[c[0]], points[c[2]] - points[c[1]])[2] for c in cells[50:]]
    assert normals[0] < 0 < min(normals[1:])


@pytest.mark.parametrize(
    ("case", "columns"), [(drop.case(4, 8), set(History) - set(OF_GAS)), (drop.gas_case(4, 8), set(History))]
)
def test_history_round_trip_with_units(case: Case, columns: set[History], tmp_path: Path) -> None:
    """That of a pressure law has no columns of a gas with a state."""
    rows = np.random.default_rng(1).standard_normal((2500, len(History)))
    path = tmp_path / "drop.vtkhdf"
    with ResultFile.create(path, case, version="1", source_hash="a") as result:
        result.add_history(rows[:7])
        result.add_history(rows[7:7])
        result.add_history(rows[7:])
    history = results.read_history(path)
    assert set(history.dtype.names) == {column.name.lower() for column in columns}
    for column in columns:
        np.testing.assert_array_equal(history[column.name.lower()], rows[:, column])
    with h5py.File(path) as file:
        assert dict(file["history"].attrs) == {column.name.lower(): column.unit for column in columns}
    assert results.read_result(path).units == {column.name.lower(): column.unit for column in sorted(columns)}


def test_snapshots_have_temperature_and_mass_of_a_gas(tmp_path: Path, small: Path) -> None:
    path, case = tmp_path / "drop.vtkhdf", drop.gas_case(6, 8)
    xyz, fields = drop.shape(case, 0.0)
    with ResultFile.create(path, case, version="1", source_hash="a") as result:
        for k in range(2):
            result.add_snapshot(
                0.01 * k, xyz, fields, height=0.6, velocity=-6.0, pressure=1e4, temperature=300.0 + k, mass=0.2 - 0.1 * k
            )
    for k, (_, poly) in enumerate(vtk_steps(path)):
        found = {name: poly.GetFieldData().GetArray(name).GetValue(0) for name in (*results.SCALARS, *results.GAS_SCALARS)}
        assert found == {
            "cover_height": 0.6,
            "cargo_velocity": -6.0,
            "gas_pressure": 1e4,
            "gas_temperature": 300.0 + k,
            "gas_mass": 0.2 - 0.1 * k,
        }
    for file, scalars in ((path, {*results.SCALARS, *results.GAS_SCALARS}), (small, {*results.SCALARS})):
        with h5py.File(file) as opened:
            assert set(opened["VTKHDF/FieldData"]) == set(opened["VTKHDF/Steps/FieldDataOffsets"]) == scalars


def test_case_summary_snapshots_round_trip(small: Path) -> None:
    case = drop.case(6, 8, belts=2)
    assert results.read_case(small) == json.loads(json.dumps(case_to_dict(case)))
    assert results.read_summary(small) == replace(drop.summary(), results=str(small))
    snapshots = results.read_snapshots(small, "tension_hoop", "velocity")
    xyz, fields = drop.shape(case, snapshots.times[5])
    np.testing.assert_array_equal(snapshots.xyz[5], xyz.astype("f4"))
    np.testing.assert_array_equal(snapshots.fields["tension_hoop"][5], fields["tension_hoop"].astype("f4"))
    np.testing.assert_array_equal(snapshots.fields["velocity"][5], fields["velocity"].astype("f4"))
    assert (snapshots.height[5], snapshots.velocity[5]) == drop.cargo(snapshots.times[5])
    with h5py.File(small) as file:
        assert (file["softbrake"].attrs["version"], file["softbrake"].attrs["source_hash"]) == ("1.2.3", "abc")


def test_tension_scale_is_that_of_section_3_2(small: Path) -> None:
    air_density, speed, length = 0.125 * 9.81, 80.0, 0.6
    assert results.read_tension_scale(small) == pytest.approx(air_density * speed**2 * length, rel=1e-3)
    table = Pressure("table", 0.0, 0.0, 0.0, (0.0, 1.0, 2.0), (1e3, 3e3, 2e3), 0.0)
    assert results.tension_scale(replace(drop.case(), pressure=table)) == pytest.approx(0.5 * 3e3 * 0.6)


@pytest.mark.parametrize("delay", [0.0, 0.02, 0.05])
def test_file_of_a_killed_run_is_readable(tmp_path: Path, vtk_steps_apart: VtkSteps, delay: float) -> None:
    """Killed while it writes, as it does all the time here; and it has all that was written."""
    path = tmp_path / "drop.vtkhdf"
    code = """
import sys, itertools, synthetic_drop as drop, numpy as np
from softbrake.sim import result_file as results
results.SECONDS_KEPT = 0.0
case = drop.case(6, 8, belts=2)
result = drop.ResultFile.create(sys.argv[1], case, version="1", source_hash="a")
for k in itertools.count():
    drop.add_snapshot(result, case, drop.END * (k % 100) / 100)
    result.add_history(drop.history(np.arange(3.0)))
    print(k, flush=True)
"""
    paths = os.pathsep.join([str(Path(drop.__file__).parent), str(Path(results.__file__).parents[2])])
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": paths}
    )
    assert process.stdout
    while process.stdout.readline().strip() != "20":
        assert process.poll() is None
    time.sleep(delay)
    process.kill()
    written = 1 + max([20, *map(int, process.stdout.read().split())])
    process.wait()

    assert results.read_summary(path) is None
    assert len(results.read_history(path)) >= 3 * written
    snapshots = results.read_snapshots(path)
    assert len(snapshots.times) >= written
    case = drop.case(6, 8, belts=2)
    assert [at for at, _ in vtk_steps_apart(path)] == snapshots.times.tolist()
    for at, xyz in zip(snapshots.times, snapshots.xyz, strict=True):
        np.testing.assert_array_equal(xyz, drop.shape(case, at)[0].astype("f4"))


def test_file_is_readable_while_it_is_written(tmp_path: Path) -> None:
    path = tmp_path / "drop.vtkhdf"
    case = drop.case(4, 8)
    with ResultFile.create(path, case, version="1", source_hash="a") as result:
        assert len(results.read_snapshots(path).times) == 0
        drop.add_snapshot(result, case, 0.01)
        assert results.read_snapshots(path).times.tolist() == [0.01]


def test_snapshots_and_history_are_written_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What comes before SECONDS_KEPT have passed is written with what comes after, or with the summary, or at the end."""
    path, clock = tmp_path / "drop.vtkhdf", [100.0]
    monkeypatch.setattr(results.time, "monotonic", lambda: clock[0])
    case = drop.case(4, 8)

    def written() -> tuple[list[float], int]:
        return results.read_snapshots(path).times.tolist(), len(results.read_history(path))

    with ResultFile.create(path, case, version="1", source_hash="a") as result:
        drop.add_snapshot(result, case, 0.01)
        drop.add_snapshot(result, case, 0.02)
        rows = drop.history(np.arange(3.0))
        result.add_history(rows)
        rows[:] = np.nan  # the caller's array is free again
        assert written() == ([0.01], 0)
        clock[0] += results.SECONDS_KEPT
        drop.add_snapshot(result, case, 0.03)
        assert written() == ([0.01, 0.02, 0.03], 3)
        drop.add_snapshot(result, case, 0.04)
        result.write_summary(drop.summary())
        assert written() == ([0.01, 0.02, 0.03, 0.04], 3)
        result.add_history(drop.history(np.arange(2.0)))
    assert written()[1] == 5
    assert np.isfinite(results.read_history(path)["height"]).all()
    assert len(list(vtk_steps(path))) == 4


def test_new_file_replaces_an_older_one_only_when_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "drop.vtkhdf"
    path.write_text("old")

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch, pytest.raises(ResultError, match="No space left"):
        patch.setattr(results, "_lay_out", fail)
        ResultFile.create(path, drop.case(4, 8), version="1", source_hash="a")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    drop.write(path, drop.case(4, 8), snapshots=1)
    assert list(tmp_path.iterdir()) == [path]
    assert len(results.read_snapshots(path).times) == 1


def test_messages(tmp_path: Path, small: Path) -> None:
    def message(path: Path) -> str:
        with pytest.raises(ResultError) as caught:
            results.read_summary(path)
        assert "\n" not in str(caught.value)
        return str(caught.value).removeprefix(f"{path}: ").removesuffix(f"; {results.EXPECTED}")

    assert message(tmp_path / "none.vtkhdf") == "cannot be read: No such file or directory"
    text = tmp_path / "text.vtkhdf"
    text.write_text("no HDF5")
    assert message(text) == "cannot be read: damaged, or not a result file"
    cut = tmp_path / "cut.vtkhdf"
    cut.write_bytes(small.read_bytes()[:-1000])
    assert message(cut) == "cannot be read: truncated"
    other = tmp_path / "other.vtkhdf"
    h5py.File(other, "w").close()
    assert message(other) == "not a softbrake result file, or an incomplete one"
    with pytest.raises(ResultError, match="ends in .vtkhdf"):
        ResultFile.create(tmp_path / "drop.h5", drop.case(4, 8), version="1", source_hash="a")
    with pytest.raises(ResultError, match="cannot be written: No such file or directory"):
        ResultFile.create(tmp_path / "no" / "drop.vtkhdf", drop.case(4, 8), version="1", source_hash="a")


def test_phases_and_filtered_peaks_round_trip(tmp_path: Path, small: Path) -> None:
    """As an answer from before they were kept is read."""
    file = tmp_path / "drop.vtkhdf"
    file.write_bytes(small.read_bytes())
    hoop = PeakValue(8e3, 0.06, 0.3, "crushing", PeakValue(6e3, 0.003, 0.2, "overshoot"))
    filtered = FilteredPeaks(60, None, PeakValue(18.0, 0.005, None, "overshoot", PeakValue(12.0, 0.05, None, "crushing")))
    for answer in (
        replace(drop.summary(), peaks={"peak_tension_hoop": hoop}, filtered=filtered),
        replace(drop.summary(), filtered=FilteredPeaks(60, "rows 3 ms apart, 1.67 allowed")),
    ):
        results.replace_summary(file, answer)
        assert results.read_summary(file) == replace(answer, results=str(file))
    with h5py.File(file, "a") as opened:
        older = json.loads(opened["softbrake/summary"][()])
        del older["filtered"], opened["softbrake/summary"]
        for peak in older["peaks"].values():
            del peak["phase"], peak["other"]
        opened["softbrake/summary"] = json.dumps(older)
    assert results.read_summary(file) == replace(drop.summary(), results=str(file))


@pytest.mark.parametrize(("name", "read"), [("summary", results.read_summary), ("inflation", results.read_inflation)])
def test_answer_of_another_version_is_no_traceback(
    tmp_path: Path, small: Path, name: str, read: Callable[[Path], object]
) -> None:
    """Fields come and go: a file from before says so."""
    older = tmp_path / "older.vtkhdf"
    older.write_bytes(small.read_bytes())
    with h5py.File(older, "a") as file:
        answer = json.loads(file["softbrake/summary"][()])
        del answer["steps"], file["softbrake/summary"]
        file[f"softbrake/{name}"] = json.dumps(answer)
    with pytest.raises(ResultError, match="older.vtkhdf: its answer is that of another version of softbrake"):
        read(older)


def test_package_reads_what_it_wrote(tmp_path: Path) -> None:
    """The names that a script needs stand in the package itself."""
    case = softbrake.load_case(
        Path(__file__).resolve().parents[1] / "configs" / "no-belts.yaml",
        ["model.fidelity=axisymmetric", "grid.generatrix=12", "time.end=5 ms"],
    )
    assert isinstance(case, softbrake.Case)
    answer = softbrake.run(case, tmp_path / "a.vtkhdf")
    result = softbrake.read_result(tmp_path / "a.vtkhdf")
    assert result.summary == answer and isinstance(answer, softbrake.Summary)
    assert result.case["shell"]["height"] == case.shell.height
    assert result.history["time"][-1] == answer.end_time
    for name in softbrake.__all__:
        assert getattr(softbrake, name) is not None
    with pytest.raises(softbrake.ResultError):
        softbrake.read_result(tmp_path / "b.vtkhdf")


def test_a_moved_file_names_its_place(tmp_path: Path) -> None:
    drop.write(tmp_path / "drop.vtkhdf", drop.case(4, 8))
    moved = (tmp_path / "drop.vtkhdf").rename(tmp_path / "kept.vtkhdf")
    summary = results.read_summary(moved)
    assert summary is not None and summary.results == str(moved)


def test_files_with_the_former_names_are_read(tmp_path: Path) -> None:
    path = tmp_path / "drop.vtkhdf"
    drop.write(path, drop.case(4, 8), snapshots=3)
    before = results.read_snapshots(path)
    with h5py.File(path, "a") as file:
        for group in (file["VTKHDF/FieldData"], file["VTKHDF/Steps/FieldDataOffsets"]):
            for new, old in (("cover_height", "height"), ("cargo_velocity", "velocity"), ("gas_pressure", "pressure")):
                group.move(new, old)
    after = results.read_snapshots(path)
    assert (after.height.tolist(), after.velocity.tolist()) == (before.height.tolist(), before.velocity.tolist())


def test_layout_is_what_other_readers_take(small: Path) -> None:
    """Names that stand once, chunks where there is nothing, a legend of the parts, a history that is compressed."""
    with h5py.File(small) as file:
        root, history = file["VTKHDF"], file["history"]
        names = [name for kind in ("PointData", "CellData", "FieldData") for name in root[kind]]
        assert len(names) == len(set(names))
        assert set(root["Steps/FieldDataOffsets"]) == set(root["FieldData"])
        assert root["CellData/part"].attrs["legend"] == "0 shell, 1 belt, 2 lower cover, 3 upper cover, 4 ground"

        def check(name: str, item: object) -> None:
            if isinstance(item, h5py.Dataset) and item.shape is not None and 0 in item.shape:
                assert item.chunks is not None and item.maxshape[0] is None, name

        file.visititems(check)
        assert (history.compression, history.shuffle, history.chunks) == ("gzip", True, (500,))
        assert root["Steps/Values"].dtype == np.float64 and not np.isnan(root["Steps/Values"][:]).any()
        assert h5py.check_string_dtype(root.attrs.get_id("Type").dtype).encoding == "ascii"  # type: ignore[union-attr]


def test_a_long_history_is_packed_in_blocks(tmp_path: Path) -> None:
    path, rows = tmp_path / "drop.vtkhdf", drop.history(np.linspace(0.0, drop.END, 10_000))
    with ResultFile.create(path, drop.case(4, 8), version="1", source_hash="a") as file:
        file.add_history(rows)
        file.write_summary(drop.summary())
    with h5py.File(path) as opened:
        assert opened["history"].chunks == (4096,)
        assert opened["history"].id.get_storage_size() < rows.nbytes / 3
    np.testing.assert_array_equal(results.read_history(path)["height"], rows[:, History.HEIGHT])
