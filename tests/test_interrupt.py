"""Ctrl-C held back: it comes when it is asked for, or at the end, and is never lost."""

import signal
import threading
from collections.abc import Iterator

import pytest

from softbrake.case.case_file import parse_case
from softbrake.case.schema import starter
from softbrake.sim.interrupt import held_interrupt
from softbrake.sim.simulation import Progress, Simulation


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
