"""Ctrl-C held back: it comes when it is asked for, or at the end, and is never lost. SIGTERM and SIGHUP are like it."""

import csv
import itertools
import json
import os
import random
import shutil
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import NoReturn

import h5py
import pytest
from typer.testing import CliRunner

from softbrake.case.case_file import parse_case
from softbrake.case.schema import starter
from softbrake.cli.app import app
from softbrake.sim.interrupt import held_interrupt, taken_as_interrupts
from softbrake.sim.result_file import read_snapshots, read_summary
from softbrake.sim.simulation import Progress, Simulation
from softbrake.studies.sweep import read_journals


@pytest.fixture(autouse=True)
def plain_handler() -> Iterator[None]:
    """A background job ignores Ctrl-C."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_who_asks_is_told() -> None:
    with held_interrupt() as interrupted:
        assert not interrupted()
        signal.raise_signal(signal.SIGINT)
        assert interrupted() and interrupted()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_what_nobody_asked_for_comes_at_the_end() -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), held_interrupt() as interrupted:
        assert not interrupted()
        signal.raise_signal(signal.SIGINT)
        done.append("the rest")
    assert done
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_inner_part_hands_it_to_the_outer_one() -> None:
    with held_interrupt() as interrupted:
        with held_interrupt():
            signal.raise_signal(signal.SIGINT)
        assert interrupted()


def test_other_threads_hold_nothing() -> None:
    told: list[bool] = []

    def ask() -> None:
        with held_interrupt() as interrupted:
            told.append(interrupted())

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    assert told == [False]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_run_at_its_last_chunk_does_not_lose_it() -> None:
    """All that is left of the run is done; who runs many stops there."""
    drop = Simulation(parse_case(starter(), "starter", ["grid={generatrix: 9, hoop: 18}", "belts=[]", "time.end=2 ms"]))

    def at_once(_: Progress) -> None:
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        drop.to_end(None, at_once)


# SIGTERM and SIGHUP

CASE = ("--set", "grid={generatrix: 8, hoop: 16}", "--set", "belts=[]", "-q")
MASSES = ("--vary", "cargo.mass=" + ",".join(f"{mass} kg" for mass in range(90, 102)))


@pytest.fixture
def ended_by_default(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What would end the process ends the call."""

    def leave(code: int) -> NoReturn:
        raise SystemExit(code)

    monkeypatch.setattr(os, "_exit", leave)
    numbers = (signal.SIGTERM, signal.SIGHUP)
    before = [signal.signal(number, lambda number, _: leave(128 + number)) for number in numbers]
    yield
    for number, handler in zip(numbers, before, strict=True):
        signal.signal(number, handler)


def call(*words: str, watch: Callable[..., object] | None = None) -> int:
    """Exit code of the command line. watch: is called at each call of a function."""
    sys.setprofile(watch)
    try:
        return CliRunner().invoke(app, list(words)).exit_code
    except SystemExit as end:  # before the command began, or after it
        return int(end.code or 0)
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    finally:
        sys.setprofile(None)


def strike(number: int, at: int, *words: str) -> int:
    """Exit code of the command line, which gets a signal at a call of a function, counted from the first."""
    calls = itertools.count()

    def count(*_: object) -> None:
        if next(calls) == at:
            signal.raise_signal(number)

    return call(*words, watch=count)


def calls_of(*words: str, between: str | None = None) -> range:
    """Calls of functions by a command that goes well: the middle of all, or those from the first to the last with a name."""
    calls, marks = itertools.count(), [0]

    def count(frame: FrameType, *_: object) -> None:
        number = next(calls)
        if between is None or frame.f_code.co_name == between:
            marks.append(number)

    assert call(*words, watch=count) == 0
    return range(marks[1], marks[-1]) if between else range(marks[-1] // 10, 9 * marks[-1] // 10)  # Typer's come before


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
@pytest.mark.usefixtures("ended_by_default")
def test_run_ended_anywhere_leaves_nothing_or_a_whole_file(number: int, paper: Path, tmp_path: Path) -> None:
    file = tmp_path / "cut.vtkhdf"
    words = ("run", str(paper), *CASE, "-o", str(file))
    assert call(*words) == 0
    calls, chance, outcomes = calls_of(*words), random.Random(7), []
    for _ in range(12):
        file.unlink(missing_ok=True)
        code = strike(number, chance.choice(calls), *words)
        assert code in (0, 128 + number)  # 0 where Python was freeing an object, and lost the interrupt
        assert list(tmp_path.iterdir()) in ([], [file])
        if file.exists():
            summary = read_summary(file)
            assert summary is not None
            assert code != 0 or summary.outcome == "impact"
            assert read_snapshots(file).times[-1] == summary.end_time
            outcomes.append(summary.outcome)
    assert "interrupted" in outcomes


@pytest.mark.slow
@pytest.mark.usefixtures("ended_by_default")
def test_sweep_ended_anywhere_goes_on_from_there(paper: Path, tmp_path: Path) -> None:
    """Each run once, with its history, whether or not it was kept when the signal came."""
    folder = tmp_path / "sweep"
    words = ("sweep", str(paper), *CASE, *MASSES, "--histories", "--threads", "2", "-o", str(folder))
    assert call(*words) == 0
    whole = (folder / "results.csv").read_text()
    shutil.rmtree(folder)
    anywhere = calls_of(*words)
    shutil.rmtree(folder)
    within = calls_of(*words, between="result")
    chance, known = random.Random(7), []
    for calls in [anywhere] * 3 + [within] * 7:
        shutil.rmtree(folder)
        code = strike(signal.SIGTERM, chance.choice(calls), *words)
        known.append(len(read_journals(folder)) if folder.exists() else 0)
        assert code == 143 or (code, known[-1]) == (0, 12)
        assert call(*words) == 0
        lines = [json.loads(line)["id"] for line in (folder / "journal.jsonl").read_text().splitlines()]
        assert len(set(lines)) == len(lines) == 12
        with h5py.File(folder / "histories.h5") as histories:
            assert sorted(histories) == sorted(lines)
            assert all(histories[id]["time"][-1] > 0.0 for id in lines)
        assert answers((folder / "results.csv").read_text()) == answers(whole)
    assert any(0 < count < 12 for count in known)


def answers(table: str) -> list[list[str]]:
    """Cells of a table of results without those of the clock."""
    rows = list(csv.reader(table.splitlines()))
    clocks = {number for number, name in enumerate(rows[0]) if "seconds" in name}
    return [[cell for number, cell in enumerate(row) if number not in clocks] for row in rows]


def test_ctrl_c_that_is_ignored_stays_so() -> None:
    """As in a background job, which SIGTERM ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    came: list[int] = []
    with held_interrupt() as interrupted, taken_as_interrupts(came):
        signal.raise_signal(signal.SIGINT)
        assert not interrupted()
        signal.raise_signal(signal.SIGTERM)
        assert interrupted()
    assert came == [signal.SIGTERM]
    with pytest.raises(KeyboardInterrupt), taken_as_interrupts(came):
        signal.raise_signal(signal.SIGTERM)


def test_signal_that_is_ignored_stays_so() -> None:
    """As under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    came: list[int] = []
    with taken_as_interrupts(came):
        signal.raise_signal(signal.SIGHUP)
    assert came == []
    assert signal.signal(signal.SIGHUP, before) is signal.SIG_IGN
