"""Ctrl-C at a moment that is not the worst: in a kernel it becomes an error of the kernel's, in a file it cuts a write in two."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def held_interrupt() -> Iterator[Callable[[], bool]]:
    """Hold Ctrl-C back; yields a function that tells whether it came. Who asks and learns so ends what it does."""
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False  # the main thread takes it
        return
    before = signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield lambda: bool(came)
    finally:
        signal.signal(signal.SIGINT, before)
