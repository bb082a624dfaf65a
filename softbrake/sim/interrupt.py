"""Ctrl-C at a moment that is not the worst: in a kernel it becomes an error of the kernel's, in a file it cuts a write in two."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

ENDINGS = ("SIGTERM", "SIGHUP")  # what batch queues and closed terminals send, where the system has it

_held: Callable[[], bool] | None = None  # what the outermost part that holds Ctrl-C back asks


@contextmanager
def interrupts_handled(handle: Callable[[int], object]) -> Iterator[None]:
    """Have Ctrl-C call a function with the signal's number; one that is ignored, as in background jobs, stays so."""
    before = signal.getsignal(signal.SIGINT)

    def handler(number: int, _: FrameType | None) -> None:
        if number != signal.SIGINT or before != signal.SIG_IGN:
            handle(number)

    signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def held_interrupt() -> Iterator[Callable[[], bool]]:
    """Hold Ctrl-C back; yields a function that tells whether it came, and who learns so ends what he does.

    It is let go at the end of the outermost part where nobody learnt of it. Other threads than the main one, which takes it, are
    never told.
    """
    global _held
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    if _held is not None:
        yield _held
        return
    came: list[int] = []
    told = False

    def tell() -> bool:
        nonlocal told
        told = bool(came)
        return told

    with interrupts_handled(came.append):
        _held = tell
        try:
            yield tell
        finally:
            _held = None
    if came and not told:
        _interrupt(came[0])


@contextmanager
def taken_as_interrupts(came: list[int]) -> Iterator[None]:
    """Take SIGTERM and SIGHUP as Ctrl-C, unless they are ignored. came: gets the numbers of those that come."""

    def take(number: int, _: FrameType | None) -> None:
        came.append(number)
        _interrupt(number)

    numbers = [getattr(signal, name) for name in ENDINGS if hasattr(signal, name)]
    before = {number: handler for number in numbers if (handler := signal.getsignal(number)) != signal.SIG_IGN}
    try:
        for number in before:
            signal.signal(number, take)
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _interrupt(number: int) -> None:
    """Do what Ctrl-C does now, also where Ctrl-C itself is ignored."""
    handler = signal.getsignal(signal.SIGINT)
    if not callable(handler):
        raise KeyboardInterrupt
    handler(number, None)
