"""Kills and SIGTERM at seeded points of run, sweep and merge: files readable, nothing twice, nothing lost.

A process that is forked from this one has the kernels loaded already, so that fifty cost seconds. It is struck at a call of a
function, counted from its first, which no load of the machine moves.
"""

import csv
import itertools
import json
import os
import random
import shutil
import signal
import sys
from pathlib import Path
from types import FrameType

import h5py
import numpy as np
import pytest
from typer.testing import CliRunner

from softbrake.cli.app import app
from softbrake.sim import result_file as results
from softbrake.studies.sweep import read_journals

POINTS = 16  # of each signal
SMALL = ("--set", "grid={generatrix: 8, hoop: 16}", "--set", "belts=[]", "--set", "time.courant=0.9", "-q")
MASSES = ("--vary", "cargo.mass=90,91,92,93,94,95")
BLOWS = (signal.SIGKILL, signal.SIGTERM)

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")]


def points_of(*words: str, place: Path | None = None) -> list[int]:
    """Seeded calls of a command that goes well: half of them anywhere, half at writes of result files and histories.

    place: folder that is to be empty.
    """
    calls, writes = itertools.count(), []

    def count(frame: FrameType, *_: object) -> None:
        number = next(calls)
        if frame.f_code.co_name == "_put":
            writes.append(number)

    assert CliRunner().invoke(app, list(words)).exit_code == 0  # imports
    if place is not None:
        shutil.rmtree(place)
        place.mkdir()
    sys.setprofile(count)
    try:
        done = CliRunner().invoke(app, list(words))
    finally:
        sys.setprofile(None)
    assert done.exit_code == 0, done.output
    chance, last = random.Random(16), next(calls)
    return [chance.choice(writes) if writes and point % 2 else chance.randrange(last) for point in range(POINTS)]


def forked(number: int, at: int, *words: str) -> int:
    """Exit code of the command line in a process of its own, negative where a signal ended it, which it gets at a call."""
    child = os.fork()
    if child == 0:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        calls = itertools.count()

        def strike(*_: object) -> None:
            if next(calls) == at:
                os.kill(os.getpid(), number)

        code = 70
        try:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            os.dup2(1, 2)
            sys.setprofile(strike)
            app(list(words))
        except SystemExit as end:
            code = int(end.code or 0)
        except KeyboardInterrupt:
            code = 128 + signal.SIGINT
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def ended_as(number: int) -> tuple[int, ...]:
    """Exit codes of a command that got the signal, or had ended before."""
    return (-number, 0) if number == signal.SIGKILL else (128 + number, -number, 0)


def answers(folder: Path) -> list[list[str]]:
    """Cells of the results of a sweep, without those of the clock."""
    rows = list(csv.reader((folder / "results.csv").read_text(encoding="utf-8").splitlines()))
    clocks = {column for column, name in enumerate(rows[0]) if "seconds" in name}
    return [[cell for column, cell in enumerate(row) if column not in clocks] for row in rows]


@pytest.mark.parametrize("number", BLOWS)
def test_a_run_struck_anywhere_leaves_a_readable_file_or_none(
    number: int, paper: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the file of a killed run has is equal to the same rows and shapes of a whole one."""
    monkeypatch.setattr(results, "SECONDS_KEPT", 0.0)
    folder, file = tmp_path / "struck", tmp_path / "struck" / "a.vtkhdf"
    words = ("run", str(paper), *SMALL, "-o", str(file))
    folder.mkdir()
    points = points_of(*words, place=folder)
    history, shapes = results.read_history(file), results.read_snapshots(file)
    kept = []
    for at in points:
        shutil.rmtree(folder)
        folder.mkdir()
        code = forked(number, at, *words)
        assert code in ended_as(number)
        if not file.exists():
            continue
        part, some, summary = results.read_history(file), results.read_snapshots(file), results.read_summary(file)
        whole = summary is not None and summary.outcome == "impact"
        assert whole or code != 0
        np.testing.assert_array_equal(part, history[: len(part)])
        alike = min(len(some.times), len(shapes.times)) - (0 if whole else 1)  # the last of a run that is ended is its own
        if number == signal.SIGKILL or whole:
            np.testing.assert_array_equal(some.times[:alike], shapes.times[:alike])
            np.testing.assert_array_equal(some.xyz[:alike], shapes.xyz[:alike])
        kept.append(len(some.times))
        if number == signal.SIGTERM and code == 128 + number:
            assert summary is not None
        if code != 0:
            assert forked(0, -1, *words) == 0  # the same command again
            np.testing.assert_array_equal(results.read_history(file), history)
            assert [path for path in folder.iterdir() if not path.name.startswith(".")] == [file]  # but for drafts of the killed
    assert len(set(kept)) > 5


@pytest.mark.parametrize("number", BLOWS)
def test_a_sweep_struck_anywhere_goes_on_to_the_same_results(number: int, paper: Path, tmp_path: Path) -> None:
    folder, whole = tmp_path / "struck", tmp_path / "whole"
    words = ("sweep", str(paper), *SMALL, *MASSES, "--histories", "--threads", "1", "-o")
    points = points_of(*words, str(whole), place=whole)
    expected, ids = answers(whole), list(read_journals(whole))
    known = []
    for at in points:
        shutil.rmtree(folder, ignore_errors=True)
        code = forked(number, at, *words, str(folder))
        assert code in ended_as(number)
        known.append(len(read_journals(folder)) if folder.exists() else 0)
        assert code != 0 or known[-1] == len(ids)
        assert forked(0, -1, *words, str(folder)) == 0
        lines = [json.loads(line)["id"] for line in (folder / "journal.jsonl").read_text(encoding="utf-8").splitlines()]
        assert lines == ids
        with h5py.File(folder / "histories.h5") as histories, h5py.File(whole / "histories.h5") as others:
            assert sorted(histories) == sorted(ids)
            for id in ids:
                np.testing.assert_array_equal(histories[id], others[id])
        assert answers(folder) == expected
        kept = sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))  # but for drafts of the killed
        assert kept == sorted(path.name for path in whole.iterdir())
    assert len(set(known)) > 3


@pytest.mark.parametrize("number", BLOWS)
def test_a_merge_struck_anywhere_loses_nothing(number: int, paper: Path, tmp_path: Path) -> None:
    """Journals stay as they are; the results are the old ones, the new ones, or not there yet."""
    parts, folder = [tmp_path / "1", tmp_path / "2"], tmp_path / "struck"
    for part, place in enumerate(parts, 1):
        words = ("sweep", str(paper), *SMALL, *MASSES, "--shard", f"{part}/2", "-o", str(place))
        assert CliRunner().invoke(app, list(words)).exit_code == 0
    shutil.copytree(parts[0], folder)
    words = ("merge", str(folder), str(parts[1]))
    points = points_of(*words)
    expected, journals = answers(folder), [read_journals(place) for place in parts]
    found = []
    for at in points:
        shutil.rmtree(folder)
        shutil.copytree(parts[0], folder)
        code = forked(number, at, *words)
        assert code in ended_as(number)
        assert [read_journals(folder), read_journals(parts[1])] == journals
        found.append((folder / "results.csv").exists())
        assert code != 0 or found[-1]
        if found[-1]:
            assert answers(folder) == expected
        assert forked(0, -1, *words) == 0
        assert answers(folder) == expected
    assert {*found} == {True, False}
