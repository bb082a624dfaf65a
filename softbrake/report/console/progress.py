"""The progress of one run or of many, on stderr."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softbrake.sim.simulation import Progress

SECONDS_BETWEEN_LINES = 2.0


@contextmanager
def progress(height: float, *, quiet: bool) -> Iterator[Callable[[Progress], None] | None]:
    """Give the callback for a run of a shell of this `height` (m), None if `quiet`: a live bar, or plain lines off a terminal."""
    with _display(quiet=quiet) as show:

        def tell(now: Progress) -> None:
            assert show is not None
            # The run ends on the ground or at its end time, whichever comes first.
            show(max(now.time / now.end_time, 1.0 - now.height / height), _line(now), False)

        yield None if show is None else tell


@contextmanager
def runs_progress(*, quiet: bool) -> Iterator[Callable[[int, int, bool], None] | None]:
    """Give the callback of many runs: runs done, of all, and whether the last was computed now; else as `progress`."""
    started, computed = time.monotonic(), 0
    with _display(quiet=quiet) as show:

        def tell(done: int, total: int, fresh: bool) -> None:
            nonlocal computed
            assert show is not None
            computed += fresh
            seconds = time.monotonic() - started
            rate = computed / seconds if computed and seconds > 0.0 else 0.0
            speed = f", {rate:.3g} a second, {(total - done) / rate:.0f} s left" if rate > 0.0 else ""
            show(done / max(total, 1), f"{done} of {total} runs{speed}", not fresh and done > 0)

        yield None if show is None else tell


@contextmanager
def chart_progress(*, quiet: bool) -> Iterator[Callable[[int, int, str], None] | None]:
    """Give the callback for a chart, told runs done, runs planned and what comes next; where and how as `progress`."""
    with _display(quiet=quiet, at_once=True) as show:

        def tell(done: int, planned: int, doing: str) -> None:
            assert show is not None
            show(done / max(planned, 1), f"{done} of {planned} runs: {doing}", False)

        yield None if show is None else tell


@contextmanager
def _display(*, quiet: bool, at_once: bool = False) -> Iterator[Callable[[float, str, bool], None] | None]:
    """Give a function that shows which share is done, and a line of words about it; None if `quiet`.

    On a terminal it moves a live bar, elsewhere it prints a plain line every few seconds, both on stderr. Plain lines begin with
    the first words if `at_once`; the function's last argument tells words that are not to wait.
    """
    if quiet:
        yield None
        return
    if sys.stderr.isatty():
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as Bar

        console = Console(stderr=True, highlight=False)
        if console.is_interactive:
            with Bar(BarColumn(20), TextColumn("{task.description}", markup=False), console=console, transient=True) as bar:
                task = bar.add_task("", total=1.0)
                yield lambda share, words, _: bar.update(task, completed=share, description=words)
            return
    last = -math.inf if at_once else time.monotonic()

    def write(_: float, words: str, urgent: bool) -> None:
        nonlocal last
        if urgent or time.monotonic() - last >= SECONDS_BETWEEN_LINES:
            last = time.monotonic()
            print(words, file=sys.stderr, flush=True)

    yield write


def _line(now: Progress) -> str:
    return f"t {now.time:.4f} s  V {now.velocity:6.3f} m/s  H {now.height:.4f} m  {now.steps} steps"
