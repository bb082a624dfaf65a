"""The sidecar for older ParaView: VTK's reader of XDMF sees what its reader of VTKHDF sees."""

from pathlib import Path

import numpy as np
import pytest
import synthetic_drop as drop
from typer.testing import CliRunner

from softbrake.cli.app import app
from softbrake.sim.result_file import POINT_FIELDS


@pytest.mark.parametrize("belts", [0, 2])
def test_sidecar_points_into_the_result(tmp_path: Path, belts: int) -> None:
    reading = pytest.importorskip("vtkmodules.vtkIOXdmf2")
    to_numpy = pytest.importorskip("vtkmodules.util.numpy_support").vtk_to_numpy
    case, folder = drop.case(6, 8, belts=belts), tmp_path / "a & b"
    folder.mkdir()
    drop.write(folder / "drop.vtkhdf", case)
    done = CliRunner().invoke(app, ["export", str(folder / "drop.vtkhdf"), "--format", "xdmf"])
    assert (done.exit_code, done.stderr) == (0, "")

    reader = reading.vtkXdmfReader()
    reader.SetFileName(str(folder / "drop.xdmf"))
    reader.UpdateInformation()
    information = reader.GetOutputInformation(0)
    key = pytest.importorskip("vtkmodules.vtkCommonExecutionModel").vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    times = [information.Get(key, step) for step in range(information.Length(key))]
    assert times == pytest.approx(np.linspace(0.0, drop.END, 13), rel=1e-15)
    for time in (times[0], times[7], times[-1]):
        reader.UpdateTimeStep(time)
        reader.Update()
        parts = reader.GetOutputDataObject(0)
        blocks = {
            parts.GetMetaData(k).Get(parts.NAME()).partition("[")[0]: parts.GetBlock(k) for k in range(parts.GetNumberOfBlocks())
        }
        cells = {name: (block.GetNumberOfCells(), block.GetCell(0).GetNumberOfPoints()) for name, block in blocks.items()}
        expected = {"shell": (48, 4), "covers": (2, 8), "ground": (1, 4), "belts": (belts, 9)}
        assert cells == {name: size for name, size in expected.items() if size[0]}
        xyz, fields = drop.shape(case, time)
        shell = blocks["shell"]
        points = to_numpy(shell.GetPoints().GetData())
        np.testing.assert_array_equal(points[:-4], xyz.reshape(-1, 3).astype("f4"))
        for name in POINT_FIELDS:
            values = to_numpy(shell.GetPointData().GetArray(name))
            np.testing.assert_array_equal(values[:-4], fields[name].reshape(-1, *values.shape[1:]).astype("f4"))
        corners = [shell.GetCell(9).GetPointId(k) for k in range(4)]
        assert corners == [9, 10, 18, 17]
        for name, pressure in (("shell", drop.PRESSURE), ("covers", drop.PRESSURE), ("ground", 0.0)):
            assert set(to_numpy(blocks[name].GetCellData().GetArray("pressure"))) == {np.float32(pressure)}


def test_mistakes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    drop.write(Path("drop.vtkhdf"), drop.case(4, 8))
    drop.write(Path("short.vtkhdf"), drop.case(4, 8), snapshots=0)
    before = sorted(tmp_path.iterdir())
    for arguments, message in (
        (["none.vtkhdf", "--format", "xdmf"], "none.vtkhdf: cannot be read: No such file or directory"),
        (["drop.vtkhdf", "--format", "xdmf", "-o", "drop.xml"], "drop.xml: the name of the sidecar ends in .xdmf"),
        (["drop.vtkhdf", "--format", "xdmf", "-o", "no/drop.xdmf"], "there is no folder no"),
        (["short.vtkhdf", "--format", "xdmf"], "short.vtkhdf: the run stopped before it recorded anything"),
    ):
        done = CliRunner().invoke(app, ["export", *arguments])
        assert done.exit_code == 2
        assert message in done.stderr
    assert sorted(tmp_path.iterdir()) == before
