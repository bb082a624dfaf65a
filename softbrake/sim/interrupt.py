"""Ctrl-C at a moment that is not the worst: in a kernel it becomes an error of the kernel's, in a file it cuts a write in two."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def held_interrupt() -> Iterator[Callable[[], bool]]:
    """Hold Ctrl-C back; yields a function that tells whether it came, and who learns so ends what he does.

    It is let go at the end where nobody learnt of it. Other threads than the main one, which takes it, are never told.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    came, told = False, False

    def keep(*_: object) -> None:
        nonlocal came
        came = True

    def tell() -> bool:
        nonlocal told
        told = came
        return told

    before = signal.signal(signal.SIGINT, keep)
    try:
        yield tell
    finally:
        signal.signal(signal.SIGINT, before)
    if came and not told:
        signal.raise_signal(signal.SIGINT)
