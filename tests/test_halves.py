"""Steps in two halves of the rows and two threads: the same drop, whoever sweeps which, and an end to all waiting."""

import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import softbrake
from softbrake import build, drop
from softbrake.build import grid_view
from softbrake.drop import Drop
from softbrake.kernels.halves import await_lower, hand_over, take_over
from softbrake.state import FoldCount, History, Outcome, Turn

PAPER = Path(__file__).resolve().parents[1] / "configs" / "paper.yaml"
GRID = ["grid.generatrix=24", "grid.hoop=40"]
SCENES = {
    "paper": [],
    "solid": ["contact=solid", "friction=0.3"],
    "folds": ["contact=full"],
    "printed scheme": ["model.scheme=cell"],
    "tension field": ["fabric.law=tension_field", "fabric.G12=1 kN/m", "contact=full"],
    "shear, damped pressure": ["fabric.G12=5 kN/m", "pressure.damping=0.0005"],
    "sector": ["model.fidelity=sector", "model.sector=8", "contact=solid"],
    "four rows": ["grid.generatrix=4", "belts=[]"],
}
LONGEST = 600.0  # s, that nothing here comes near
TOUCHING = Drop._touching


@pytest.fixture(autouse=True)
def always_two(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second thread in each chunk, however crowded the machine is, and whether folds touch or not."""
    monkeypatch.setattr(drop, "LONGEST_PAUSE", 0)
    monkeypatch.setattr(Drop, "_touching", lambda _: False)


def shell(monkeypatch: pytest.MonkeyPatch, *overrides: str, halves: bool = True, threads: int = 1) -> Drop:
    monkeypatch.setattr(build, "CELLS_OF_TWO", 0 if halves else 10**9)
    falling = Drop(softbrake.load_case(PAPER, [*GRID, *overrides]))
    falling.threads = threads
    return falling


def within_time(work: Callable[[], None]) -> None:
    """Do it in a thread of its own; fail where it hangs or raises."""
    faults: list[BaseException] = []

    def watched() -> None:
        try:
            work()
        except BaseException as fault:
            faults.append(fault)

    thread = threading.Thread(target=watched, daemon=True)
    thread.start()
    thread.join(LONGEST)
    assert not thread.is_alive(), "hangs"
    if faults:
        raise faults[0]


def same(one: Drop, other: Drop) -> bool:
    ours, theirs = ([grid_view(part, each.model) for part in each.state.nodes] for each in (one, other))
    return all(map(np.array_equal, ours, theirs)) and all(
        np.array_equal(getattr(one.state, name), getattr(other.state, name)) for name in ("peaks", "overshoot")
    )


def compile_first(monkeypatch: pytest.MonkeyPatch, *overrides: str) -> None:
    """Compile, or load, what a scene needs, which may take longer than LONGEST on a slow machine."""
    for halves in (False, True):
        shell(monkeypatch, *overrides, halves=halves).advance(most=0)


def shared(falling: Drop) -> bool:
    """Whether a second thread swept any half; with one core for both, or others on it, it hardly comes to that."""
    return falling.shared > 0 or drop.cores() == 1


def until_shared(fall: Callable[[], bool]) -> None:
    """Let something fall until the second thread had a core while it did."""
    assert any(fall() for _ in range(100))


@pytest.mark.kernels
@pytest.mark.parametrize("scene", SCENES)
def test_halves_and_threads_are_one_drop(scene: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Places, velocities, peaks to the last bit; sums to round-off with the halves, exactly with the number of threads."""

    def fall() -> bool:
        whole, alone, helped = (
            shell(monkeypatch, *SCENES[scene], halves=h, threads=t) for h, t in ((False, 1), (True, 1), (True, 2))
        )
        for _ in range(16):
            pieces = [(rows.copy(), outcome) for rows, outcome in (each.advance(most=300) for each in (whole, alone, helped))]
            assert same(alone, helped)
            assert np.array_equal(alone.state.now, helped.state.now)
            assert np.array_equal(pieces[1][0], pieces[2][0])
            assert alone.state.now == pytest.approx(whole.state.now, rel=1e-12, abs=1e-12 * whole.now(History.KINETIC_ENERGY))
            assert same(whole, alone)
            if pieces[0][1] != Outcome.RUNNING:
                break
        assert len({outcome for _, outcome in pieces}) == 1
        assert (pieces[0][1] == Outcome.DIVERGED) == (scene == "printed scheme")
        return shared(helped)

    compile_first(monkeypatch, *SCENES[scene])
    within_time(lambda: until_shared(fall))


def test_full_history_and_growing_pairs_end_chunks_of_two_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "PAIRS_PER_NODE", 0.01)
    before = threading.active_count()

    def fall() -> bool:
        alone, helped = (shell(monkeypatch, "contact=full", "grid.hoop=24", threads=t) for t in (1, 2))
        alone.history, helped.history = alone.history[:99], helped.history[:99]
        outcome = Outcome.RUNNING
        while outcome == Outcome.RUNNING and (folds := helped.state.folds) is not None and helped.state.steps[0] < 10_000:
            room = folds.pairs.size
            rows, outcome = helped.advance()
            assert np.array_equal(rows, alone.advance()[0])
            assert len(rows) == 98 or outcome != Outcome.RUNNING
        assert same(alone, helped)
        assert room > 0.01 * helped.state.nodes.x.size  # there were more pairs than that
        return shared(helped)

    compile_first(monkeypatch, "contact=full")
    within_time(lambda: until_shared(fall))
    assert threading.active_count() == before


@pytest.mark.parametrize("fault", [KeyboardInterrupt, MemoryError])
def test_no_thread_outlives_a_fault(fault: type[BaseException], monkeypatch: pytest.MonkeyPatch) -> None:
    alone, helped = (shell(monkeypatch, threads=t) for t in (1, 2))
    alone.advance(most=100)
    before = threading.active_count()

    def broken(*_: object) -> None:
        time.sleep(0.1)
        raise fault

    def fall() -> None:
        with monkeypatch.context() as patched:
            patched.setitem(drop.KERNELS, "full", broken)
            with pytest.raises(fault):
                helped.advance()
        assert threading.active_count() == before + 1  # that in which this is done
        helped.advance(most=100)

    within_time(fall)
    assert same(alone, helped)
    assert threading.active_count() == before


def test_crowded_chunks_are_followed_by_ever_longer_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    """A thread that gets no time on a core, as if others had it, is asked again after 1, 3, 7 … chunks, else at once."""
    monkeypatch.setattr(drop, "LONGEST_PAUSE", 7)
    helped = shell(monkeypatch, threads=2)
    chunks, asked, seconds = [0], [], 0.0

    def chunk(*_: float) -> tuple[np.ndarray, Outcome]:
        chunks[0] += 1
        time.sleep(0.001)
        return helped.history[:0], Outcome.RUNNING

    def work(_: object) -> float:
        asked.append(chunks[0])
        return seconds

    monkeypatch.setattr(helped, "_advance", chunk)
    monkeypatch.setattr(helped, "_help", work)
    for _ in range(30):
        helped.advance()
    assert len(asked) == 5  # at chunks 0, 2, 6, 14, 22
    seconds = 10.0
    for _ in range(8):
        helped.advance()
    assert len(asked) == 5 + 8


def test_folds_that_touched_in_the_chunk_before_leave_it_to_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Drop, "_touching", TOUCHING)
    helped = shell(monkeypatch, "contact=full", threads=2)
    folds, chunk, asked = helped.state.folds, 0, []
    assert folds is not None
    monkeypatch.setattr(helped, "_advance", lambda *_: (helped.history[:0], Outcome.RUNNING))
    monkeypatch.setattr(helped, "_help", lambda _: asked.append(chunk) or 10.0)
    for touching in (False, True, True, False, False):
        helped.advance()
        chunk += 1
        folds.counts[FoldCount.PASSES] += touching
    assert asked == [0, 1, 4]


@pytest.mark.parametrize("lacking", ["thread", "memory"])
def test_without_room_for_a_second_thread_there_is_one(lacking: str, monkeypatch: pytest.MonkeyPatch) -> None:
    alone, helped = (shell(monkeypatch, threads=t) for t in (1, 2))

    def no_thread(*_: object) -> None:
        raise RuntimeError("can't start new thread")

    def no_memory(*_: object, **__: object) -> None:
        raise MemoryError

    if lacking == "thread":
        monkeypatch.setattr(threading.Thread, "start", no_thread)
    else:
        monkeypatch.setattr(drop, "build_sweep", no_memory)
    for each in (alone, helped, helped):
        each.advance(most=100 if each is alone else 50)
    assert same(alone, helped)
    assert (helped.threads, helped.shared) == (1, 0)


def test_a_thread_that_helps_takes_each_half_on_offer(monkeypatch: pytest.MonkeyPatch) -> None:
    falling = shell(monkeypatch)
    falling.advance(most=10)
    halves = falling.sweep.halves  # type: ignore[union-attr]
    assert halves is not None
    turn = halves.turn
    turn[0] = Turn.FREE
    helping = threading.Thread(target=falling._help, args=(falling._second_sweep,))

    def offers() -> None:
        helping.start()
        for _ in range(50):
            turn[0] = Turn.OPEN
            while turn[0] != Turn.FREE:
                time.sleep(0.0)
        turn[0] = Turn.ALONE
        helping.join()

    within_time(offers)
    assert falling.shared == 50


def test_who_has_the_lower_half(monkeypatch: pytest.MonkeyPatch) -> None:
    halves = shell(monkeypatch).sweep.halves  # type: ignore[union-attr]
    assert halves is not None
    turn = halves.turn
    assert turn[0] == Turn.ALONE
    assert not take_over(halves)
    assert not hand_over(turn)
    turn[0] = Turn.OPEN
    assert take_over(halves)
    assert turn[0] == Turn.TAKEN
    turn[0] = Turn.FREE
    assert not hand_over(turn)  # nobody is there
    assert turn[0] == Turn.FREE

    def help_late() -> None:
        time.sleep(0.2)
        turn[0] = Turn.FREE

    def wait(patience: int) -> int:
        turn[0] = Turn.TAKEN
        late = threading.Thread(target=help_late)
        late.start()
        await_lower(turn, patience)
        late.join()
        return int(turn[0])

    def waits() -> None:
        assert wait(2**62) == Turn.FREE
        assert wait(1) == Turn.ALONE  # too late: it may go
        assert not hand_over(turn)

    within_time(waits)


def test_the_grid_alone_decides_on_halves_and_the_machine_on_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []

    class Watched(Drop):
        def advance(self, *arguments: float, **named: float) -> object:  # type: ignore[override]
            seen.append(self.threads)
            return super().advance(*arguments, **named)  # type: ignore[arg-type]

    for grid, halves in (((124, 200), False), ((125, 200), True)):
        case = softbrake.load_case(PAPER, [f"grid.generatrix={grid[0]}", f"grid.hoop={grid[1]}"])
        assert (Drop(case).sweep.halves is not None) == halves
    monkeypatch.setattr(drop, "Drop", Watched)
    taken = {}
    for platform, cores in (("linux", 1), ("linux", 2), ("linux", 8), ("win32", 8)):
        monkeypatch.setattr(drop, "cores", lambda cores=cores: cores)
        monkeypatch.setattr(drop.sys, "platform", platform)
        assert drop.run(softbrake.load_case(PAPER, [*GRID, "time.end=0.1 ms"])).steps > 0
        taken[platform, cores] = seen[-1]
    assert taken == {("linux", 1): 1, ("linux", 2): 2, ("linux", 8): 2, ("win32", 8): 1}
