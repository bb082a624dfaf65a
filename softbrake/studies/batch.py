"""Many drops at once: threads over cases, each the same drop as a single run, to the last bit.

Kernels let other threads run and share no array, so threads keep all cores busy, with the full shell as well: processes would
each take a second to start and to load the kernels, for the same rate. Python's 0.15 ms around a drop are done by one at a time.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from itertools import islice
from time import perf_counter
from typing import NamedTuple

import numpy as np

from softbrake.case.case import Case
from softbrake.core.arrays import Floats, Outcome
from softbrake.sim.cores import cores
from softbrake.sim.simulation import Diverged, NotInflated, Simulation
from softbrake.sim.summary import Summary
from softbrake.studies.error_control import reached, refine

AHEAD = 8  # drops under way or waiting, for each thread


class Dropped(NamedTuple):
    """The answer of one case of a batch."""

    summary: Summary | None  # of a drop that diverged, as far as it came; None where nothing was computed
    fault: str | None  # why there is no answer, else None
    history: Floats | None  # (rows, len(History)), on request


def run_batch(cases: Iterable[Case], *, threads: int | None = None, histories: bool = False) -> Iterator[Dropped]:
    """Run cases and yield their answers in order; cases may be without end, they are taken as they are needed.

    A case that fails costs only itself. One with a tolerance is refined, as by `error_control.run`. threads: default one a core.
    histories: keep rows as `output.history_interval` asks. Leaving the iterator, or Ctrl-C, ends the drops under way.
    """
    threads = threads or cores()
    stop = threading.Event()
    remaining = iter(cases)
    under_way: deque[Future[Dropped]] = deque()
    pool = ThreadPoolExecutor(threads)
    try:
        while True:
            wanted = AHEAD * threads - len(under_way)
            under_way.extend(pool.submit(run_one, case, histories, stop) for case in islice(remaining, wanted))
            if not under_way:
                return
            yield under_way.popleft().result()
    finally:
        stop.set()
        pool.shutdown(cancel_futures=True)


def run_one(case: Case, histories: bool = False, stop: threading.Event | None = None) -> Dropped:
    """Run one case of a batch, in whatever thread or process. stop: ends it early when it is set, without an answer."""
    started = perf_counter()
    rows: list[Floats] = []
    fault = None
    try:
        if case.tolerance is not None:
            if histories:
                return Dropped(None, "a case with a tolerance has no history, its answer is of several runs", None)
            summary = refine(case, case.tolerance).summary
            missed = f"the tolerance of {case.tolerance:.3g} was not reached: {summary.fidelity_reason}"
            return Dropped(summary, None if reached(case, summary) else missed, None)
        drop = Simulation(case)
        if not histories:
            drop.without_rows()
        outcome = Outcome.RUNNING
        while outcome == Outcome.RUNNING:
            if stop is not None and stop.is_set():
                return Dropped(None, "interrupted", None)  # which nobody waits for
            new, outcome = drop.advance(most=drop.most)
            if histories:
                rows.append(new.copy())
        summary = drop.finish(outcome)
    except Diverged as error:
        summary, fault = error.summary, str(error)
    except (NotInflated, ValueError, MemoryError) as error:
        return Dropped(None, str(error) or "not enough memory", None)
    return Dropped(replace(summary, wall_seconds=perf_counter() - started), fault, np.concatenate(rows) if histories else None)
