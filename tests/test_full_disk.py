"""Disks that get full, and places that are taken: nothing computed is lost, nothing is half written."""

import errno
import os
import resource
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic_drop as drop
from conftest import ROOT, Command, VtkSteps
from typer.testing import CliRunner

from softbrake.case.case_file import load_case, open_case
from softbrake.case.level import level
from softbrake.cli.app import app
from softbrake.sim import files, inflate
from softbrake.sim import result_file as results
from softbrake.sim.files import StagedFile, draft_of
from softbrake.sim.result_file import ResultError, ResultFile
from softbrake.studies import error_control
from softbrake.studies.axes import designs_of
from softbrake.studies.sweep import NotKept, SweepError, read_journals, run_sweep

NO_BELTS = ROOT / "configs" / "no-belts.yaml"
SHORT = ("model.fidelity=axisymmetric", "grid.generatrix=12", "time.end=5 ms")
MODULI = ROOT / "configs" / "moduli-sweep.yaml"
FEW = ("grid.generatrix=12", "time.courant=0.9", "output.history_interval=50")
TWO, OTHER = "fabric.E=15kN/m,20kN/m", "fabric.E=16kN/m,20kN/m"


class Disk:
    """A disk on which no file gets longer than it has room; `reserves` says whether it can be asked beforehand."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, reserves: bool) -> None:
        self.room = 2**60
        put = StagedFile._put

        def reserve(_: int, offset: int, length: int) -> None:
            if offset + length > self.room:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        def put_what_fits(file: StagedFile, offset: int, data: bytes) -> None:
            put(file, offset, data[: max(self.room - offset, 0)])
            if offset + len(data) > self.room:
                raise OSError(errno.EDQUOT, os.strerror(errno.EDQUOT))

        if reserves:
            monkeypatch.setattr(os, "posix_fallocate", reserve)
        else:
            monkeypatch.delattr(os, "posix_fallocate", raising=False)
            monkeypatch.setattr(StagedFile, "_put", put_what_fits)


def write_drop(path: Path, snapshots: int = 9) -> list[str | None]:
    """Write a drop as a run does, flushed at every chance; returns the fault told with the answer."""
    case = drop.case(4, 8)
    with ResultFile.create(path, case, version="1", source_hash="a") as file:
        for at in np.linspace(0.0, drop.END, snapshots):
            drop.add_snapshot(file, case, at)
            file.add_history(drop.history(np.linspace(at, at + 0.01, 20)))
        return [file.write_summary(drop.summary()).results_fault]


def check_drop(path: Path) -> int:
    """Check all that is in a file of `write_drop`; returns its number of snapshots."""
    shots, history = results.read_snapshots(path), results.read_history(path)
    for at, xyz in zip(shots.times, shots.xyz, strict=True):
        np.testing.assert_array_equal(xyz, drop.shape(drop.case(4, 8), at)[0].astype("f4"))
    assert len(history) >= 20 * (len(shots.times) - 1)
    assert (history["ground_force"] > 0.0).all()
    return len(shots.times)


@pytest.mark.slow
@pytest.mark.parametrize("reserves", [True, False])
def test_a_disk_full_at_any_point_leaves_a_readable_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reserves: bool) -> None:
    """Up to the last snapshot that fitted; the answer is returned with a line on the fault."""
    monkeypatch.setattr(results, "SECONDS_KEPT", 0.0)
    monkeypatch.setattr(results, "_pack", lambda _: None)
    path, disk = tmp_path / "drop.vtkhdf", Disk(monkeypatch, reserves)
    assert write_drop(path) == [None]
    whole, count = path.stat().st_size, []
    for room in np.linspace(0, whole - 1, 50).astype(int):
        path.unlink(missing_ok=True)
        disk.room = int(room)
        try:
            (fault,) = write_drop(path)
        except ResultError as error:  # no room to begin
            assert "cannot be written" in str(error) and list(tmp_path.iterdir()) == []
            continue
        shots = results.read_snapshots(path)
        count.append(len(shots.times))
        for at, xyz in zip(shots.times, shots.xyz, strict=True):
            np.testing.assert_array_equal(xyz, drop.shape(drop.case(4, 8), at)[0].astype("f4"))
        assert len(results.read_history(path)) in (20 * count[-1], 20 * max(count[-1] - 1, 0))
        assert results.read_summary(path) is None
        assert fault is not None and fault.startswith(f"{path}: cannot be written: ")
        until = f"the run up to {shots.times[-1]:.6g} s" if count[-1] else "no instant"
        assert fault.endswith(f"; the file holds {until}, and no answer")
        assert list(tmp_path.iterdir()) == [path]
    assert count == sorted(count) and {0, 9} <= set(count)


def test_a_full_disk_while_packing_leaves_the_file_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, disk, pack = tmp_path / "drop.vtkhdf", Disk(monkeypatch, True), results._pack

    def pack_without_room(file: Path) -> None:
        disk.room = 5000
        pack(file)

    monkeypatch.setattr(results, "_pack", pack_without_room)
    assert write_drop(path) == [None]
    assert results.read_history(path).shape == (180,)
    assert results.read_summary(path) is not None
    assert list(tmp_path.iterdir()) == [path]


def test_another_answer_that_does_not_fit_leaves_the_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "drop.vtkhdf"
    write_drop(path)
    before, disk = path.read_bytes(), Disk(monkeypatch, True)
    disk.room = 0
    with pytest.raises(ResultError, match="No space left"):
        results.replace_summary(path, error_control.replace(drop.summary(), title="long " * 100000))
    assert path.read_bytes() == before


def full_from_the_first_flush(monkeypatch: pytest.MonkeyPatch) -> None:
    """Result files can be begun, and then take nothing."""
    disk, start = Disk(monkeypatch, True), ResultFile.__init__

    def begin(self: ResultFile, *arguments: object) -> None:
        start(self, *arguments)  # type: ignore[arg-type]
        disk.room = 0

    monkeypatch.setattr(ResultFile, "__init__", begin)


@pytest.mark.parametrize("arguments", [["run"], ["run", "--error-bar"], ["inflate", "--set", "initial=inflated"]], ids=" ".join)
def test_commands_give_their_answer_without_a_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str]) -> None:
    full_from_the_first_flush(monkeypatch)
    monkeypatch.chdir(tmp_path)
    sets = [word for change in (*SHORT[:2], "time.courant=0.9") for word in ("--set", change)]
    command, *options = arguments
    done = CliRunner().invoke(app, [command, str(NO_BELTS), *sets, *options, "-o", "a.vtkhdf"])
    assert done.exit_code == 1
    assert ("impact velocity" if command == "run" else "tension") in done.stdout
    assert "results in" not in done.stdout
    assert "a.vtkhdf: cannot be written: No space left on device; the file holds no instant, and no answer" in done.stderr
    assert "Traceback" not in done.stderr


def test_an_answer_found_for_a_tolerance_outlives_a_file_that_cannot_begin(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = error_control.Refined(load_case(NO_BELTS, SHORT), drop.summary())
    monkeypatch.setattr(error_control, "refine", lambda *_: found)
    answer = error_control.run(load_case(NO_BELTS, ["tolerance=20%"]), tmp_path / "gone" / "a.vtkhdf")
    assert answer.impact_velocity == drop.summary().impact_velocity
    assert answer.results_fault is not None and "No such file or directory" in answer.results_fault


def test_a_shell_at_rest_outlives_a_file_that_cannot_begin(tmp_path: Path) -> None:
    answer = inflate.inflate(load_case(NO_BELTS, SHORT), tmp_path / "gone" / "a.vtkhdf")
    assert answer.volume > 0.0
    assert answer.results_fault is not None and "No such file or directory" in answer.results_fault


def test_a_limit_on_file_size_ends_no_run(softbrake: Command, environment: dict[str, str], tmp_path: Path) -> None:
    """In a process of its own, whose end HDF5 must survive too."""
    words = ["run", str(NO_BELTS), *(word for change in SHORT for word in ("--set", change)), "-q"]
    assert softbrake(*words, "--no-results").returncode == 0  # compiles
    ResultFile.create(tmp_path / "a.vtkhdf", load_case(NO_BELTS, SHORT), version="1", source_hash="a").close()
    room = (tmp_path / "a.vtkhdf").stat().st_size + 1000
    done = subprocess.run(
        [sys.executable, "-m", "softbrake", *words, "-o", "a.vtkhdf"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room)),
    )
    assert done.returncode == 1
    assert "peak deceleration" in done.stdout
    said = done.stderr.splitlines()[-1]
    assert said == "a.vtkhdf: cannot be written: File too large; the file holds no instant, and no answer"
    assert "Traceback" not in done.stderr
    assert len(results.read_snapshots(tmp_path / "a.vtkhdf").times) == 0


def test_histories_of_a_sweep_go_on_where_the_disk_was_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    designs = designs_of(open_case(MODULI, [*FEW[:2], "output.history_interval=2"]), ["fabric.E=15kN/m:20kN/m:5"], {})
    folder = tmp_path / "broken"
    run_sweep(designs, tmp_path / "whole", histories=True)
    with monkeypatch.context() as patch:
        Disk(patch, True).room = (tmp_path / "whole" / "histories.h5").stat().st_size // 2
        with pytest.raises(NotKept, match="No space left on device; the same command goes on from here"):
            run_sweep(designs, folder, histories=True)
    done = list(read_journals(folder))
    assert 0 < len(done) < 5
    with h5py.File(folder / "histories.h5") as file:
        assert set(file) <= set(done)
    plan = run_sweep(designs, folder, histories=True)
    assert list(read_journals(folder)) == [run.id for run in plan.runs]
    with h5py.File(folder / "histories.h5") as file:
        assert set(file) == {run.id for run in plan.runs}
        assert all(len(file[name]) > 10 for name in file)


def test_a_draft_takes_its_place_whole_or_not_at_all(tmp_path: Path) -> None:
    place, link = tmp_path / "page.html", tmp_path / "link.html"
    place.write_text("old")
    link.symlink_to(place)
    with pytest.raises(OSError, match="full"), draft_of(link) as draft:
        draft.write_text("half of")
        raise OSError("full")
    assert (place.read_text(), sorted(tmp_path.iterdir())) == ("old", [link, place])
    with draft_of(link) as draft:
        assert draft.suffix == ".html"  # by which Matplotlib knows what to write
        draft.write_text("new")
    assert (place.read_text(), sorted(tmp_path.iterdir()), link.is_symlink()) == ("new", [link, place], True)
    with draft_of("/dev/null") as draft:
        assert draft == Path("/dev/null")


@pytest.mark.parametrize(
    ("arguments", "made"),
    [
        (["init", "a.yaml"], "a.yaml"),
        (["plot", "drop.vtkhdf", "-o", "a.png"], "a.png"),
        (["plot", "drop.vtkhdf", "-o", "a.svg"], "a.svg"),
        (["report", "drop.vtkhdf", "-o", "a.html"], "a.html"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_outputs_without_room_leave_nothing(tmp_path: Path, environment: dict[str, str], arguments: list[str], made: str) -> None:
    pytest.importorskip("matplotlib")
    drop.write(tmp_path / "drop.vtkhdf", drop.case(6, 8))
    done = subprocess.run(
        [sys.executable, "-m", "softbrake", *arguments],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)),
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == f"{made}: cannot be written: File too large"
    assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["drop.vtkhdf"]


def states_between_writes(path: Path, monkeypatch: pytest.MonkeyPatch, snapshots: int, share: float) -> list[bytes]:
    """What a kill of `write_drop` before each of its writes to the disk would leave, or before a random share of them."""
    monkeypatch.setattr(results, "SECONDS_KEPT", 0.0)
    put, random = StagedFile._put, np.random.default_rng(16)
    states: list[bytes] = []

    def look_and_put(file: StagedFile, offset: int, data: bytes) -> None:
        if path.exists() and random.random() < share:
            states.append(path.read_bytes())  # as a kill would leave it here
        put(file, offset, data)

    monkeypatch.setattr(StagedFile, "_put", look_and_put)
    assert write_drop(path, snapshots) == [None]
    assert len(states) > 200
    return states


@pytest.mark.slow
@pytest.mark.parametrize(("snapshots", "share"), [(9, 1.0), (70, 0.1)])
def test_a_kill_between_any_two_writes_leaves_a_readable_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, snapshots: int, share: float
) -> None:
    """From the first byte to the packed file; 70 snapshots split the tables of chunks."""
    path, counts = tmp_path / "drop.vtkhdf", []
    for state in states_between_writes(path, monkeypatch, snapshots, share):
        path.write_bytes(state)
        counts.append(check_drop(path))
    assert counts == sorted(counts) and counts[-1] == snapshots


@pytest.mark.slow
def test_vtk_reads_what_a_kill_between_any_two_writes_leaves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, vtk_steps_apart: VtkSteps
) -> None:
    """The steps that softbrake reads. VTK takes all times there are into room for the steps that are counted."""
    monkeypatch.setattr(results, "_BLOCK", 2)  # five snapshots get three chunks of times
    path, counts = tmp_path / "drop.vtkhdf", []
    for state in states_between_writes(path, monkeypatch, 5, 1.0):
        path.write_bytes(state)
        shots = results.read_snapshots(path)
        counts.append(len(shots.times))
        with h5py.File(path) as file:
            assert len(file["VTKHDF/Steps/Values"]) == file["VTKHDF/Steps"].attrs["NSteps"]
        steps = vtk_steps_apart(path)
        if not counts[-1]:  # VTK takes no step for one
            continue
        assert [at for at, _ in steps] == shots.times.tolist()
        for (_, points), xyz in zip(steps, shots.xyz, strict=True):
            np.testing.assert_array_equal(points[:-4], xyz.reshape(-1, 3))
    assert counts == sorted(counts) and set(counts) == set(range(6))


# Places that are taken


def test_two_runs_do_not_write_one_file(tmp_path: Path) -> None:
    path = tmp_path / "drop.vtkhdf"
    with ResultFile.create(path, drop.case(4, 8), version="1", source_hash="a") as first:
        with pytest.raises(ResultError, match="drop.vtkhdf: another run writes this file"):
            ResultFile.create(path, drop.case(4, 8), version="1", source_hash="a")
        drop.add_snapshot(first, drop.case(4, 8), 0.01)
    assert len(results.read_snapshots(path).times) == 1
    (tmp_path / ".drop.vtkhdf.lock").touch()  # of a run that was killed
    drop.write(path, drop.case(4, 8))
    assert list(tmp_path.iterdir()) == [path]


def test_a_place_is_held_where_there_are_no_locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on some network disks: nobody is kept out, and every run goes on."""

    def refuse(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(files.fcntl, "flock", refuse)
    drop.write(tmp_path / "drop.vtkhdf", drop.case(4, 8))
    assert results.read_summary(tmp_path / "drop.vtkhdf") is not None


def test_a_run_replaces_no_answer_of_another_case_unasked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str, command: str = "run") -> tuple[int, str]:
        sets = [word for change in SHORT for word in ("--set", change)]
        done = CliRunner().invoke(app, [command, str(NO_BELTS), *sets, "-q", *arguments])
        return done.exit_code, done.stderr

    assert run()[0] == 0
    before = Path("no-belts.vtkhdf").read_bytes()
    code, said = run("--set", "cargo.mass=90")
    assert (code, Path("no-belts.vtkhdf").read_bytes()) == (2, before)
    assert said.splitlines()[-1] == (
        "no-belts.vtkhdf: holds the answer of another case, with another cargo; --output names another file, --force replaces it"
    )
    assert run()[0] == run("--set", "output.history_interval=3")[0] == run("--set", "cargo.mass=90", "--force")[0] == 0
    Path("no-belts.vtkhdf").write_text("notes")
    code, said = run()
    assert (code, Path("no-belts.vtkhdf").read_text()) == (2, "notes")
    assert "no-belts.vtkhdf: is no result file that can be read" in said


def test_an_unfinished_run_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "drop.vtkhdf"
    drop.write(path, drop.case(4, 8), finished=False)
    assert results.other_answer(path, drop.case(6, 8)) is None


def test_a_case_that_chooses_its_grid_may_be_run_again(tmp_path: Path) -> None:
    path = tmp_path / "drop.vtkhdf"
    chooses = load_case(NO_BELTS, ["tolerance=1%"])
    with ResultFile.create(path, level(chooses, "axisymmetric", 24, 48), version="1", source_hash="a") as file:
        file.write_summary(drop.summary())
    assert results.other_answer(path, chooses) is None
    assert results.other_answer(path, load_case(NO_BELTS, ["tolerance=1%", "cargo.mass=90"])) is not None


def sweep(folder: Path, vary: str, **options: bool) -> None:
    run_sweep(designs_of(open_case(MODULI, FEW), [vary], {}), folder, **options)


def test_a_sweep_replaces_no_answers_of_another_unasked(tmp_path: Path) -> None:
    sweep(tmp_path, TWO)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(SweepError, match="over fabric.E, and results.csv would lose 1 of its answers; .*--force"):
        sweep(tmp_path, OTHER)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
    sweep(tmp_path, f"{TWO},16kN/m")  # more values lose nothing
    sweep(tmp_path, OTHER, force=True)
    assert len(read_journals(tmp_path)) == 3
    done = CliRunner().invoke(app, ["sweep", str(MODULI), "--set", FEW[0], "--vary", "fabric.E=9kN/m,8kN/m", "-o", str(tmp_path)])
    assert done.exit_code == 2 and "would lose 2 of its answers" in done.stderr


def test_two_sweeps_do_not_run_into_one_folder(tmp_path: Path) -> None:
    release = files.hold(tmp_path / "journal.jsonl")
    with pytest.raises(SweepError, match="another sweep runs into this folder"):
        sweep(tmp_path, TWO)
    release()
    sweep(tmp_path, TWO)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["journal.jsonl", "plan.json"]


def test_a_sweep_says_how_large_its_histories_get(tmp_path: Path) -> None:
    told: list[str] = []
    designs = designs_of(open_case(MODULI, [*FEW[:2], "output.history_interval=2"]), ["fabric.E=15kN/m:20kN/m:9"], {})
    run_sweep(designs, tmp_path, histories=True, told=told.append)
    (said,) = told
    guessed = float(said.removeprefix("histories: about ").removesuffix(" MB for 9 runs"))
    assert guessed == pytest.approx((tmp_path / "histories.h5").stat().st_size / 1e6, rel=0.3)
