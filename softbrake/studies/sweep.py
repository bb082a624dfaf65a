"""Many drops of one case file: what is to run, a journal of what has run, and where it runs.

A sweep's folder holds plan.json (axes and runs), a journal that grows by a line a run, and what `results_csv` makes of them. A
run is known by a hash of its resolved case and of the program, so whoever starts the same sweep again, after a kill or with more
values, runs only what no journal has. Shards write journals of their own into the same folder, or into others, to be merged.
"""

from __future__ import annotations

import hashlib
import json
import logging
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import h5py

from softbrake import __version__
from softbrake.case.case import Case, case_to_dict
from softbrake.case.sections.limits import LIMITS, limits_of
from softbrake.core.columns import History
from softbrake.core.jit import PACKAGE, hash_sources
from softbrake.sim.files import StagedFile, hold, write_text
from softbrake.sim.interrupt import held_interrupt
from softbrake.sim.limits import judge
from softbrake.sim.result_file import as_history, history_dtype
from softbrake.sim.summary import as_dict
from softbrake.studies.axes import Axis, Designs
from softbrake.studies.batch import Dropped, run_batch, run_one
from softbrake.studies.chance import Estimate, wilson
from softbrake.studies.sampling import Sampling

if TYPE_CHECKING:
    from distributed import Client

PLAN, JOURNAL, HISTORIES, RESULTS = "plan.json", "journal", "histories", "results.csv"
AT_ONCE = {"axisymmetric": 16, "lumped": 16}  # runs of one task of a cluster, whose upkeep takes a millisecond; else 1
PATIENCE = 30  # s, for a cluster's scheduler and its first worker
Record = dict[str, Any]  # a line of the journal: id, summary or None, fault or None


class SweepError(Exception):
    """A sweep cannot be run or read; the message is one line for the user."""


class NotKept(SweepError):
    """A sweep cannot be written to its folder, as the disk is full; the journal has what was done."""


class SchedulerLost(SweepError):
    """A cluster's scheduler is gone; the journal has what was done."""


class Run(NamedTuple):
    """One run of a plan."""

    id: str
    values: tuple[float | str, ...]  # of the axes


@dataclass(frozen=True)
class Plan:
    """What a sweep runs, as plan.json keeps it."""

    title: str
    version: str
    source_hash: str
    axes: tuple[Axis, ...]
    runs: tuple[Run, ...]
    case: dict[str, Any]  # resolved, of the first run
    sampling: Sampling | None = None  # of a sampled sweep


class Shard(NamedTuple):
    """One of several parts of a sweep, each run by a process of its own."""

    number: int = 1
    of: int = 1

    def named(self, stem: str, suffix: str) -> str:
        """Name of the shard's own file."""
        return f"{stem}{suffix}" if self.of == 1 else f"{stem}-{self.number}-of-{self.of}{suffix}"


WHOLE = Shard()


@cache
def source_hash() -> str:
    """Hash of the program, part of each run's id."""
    return hash_sources(PACKAGE)


def run_id(case: Case, known: dict[tuple[str, int], Any] | None = None) -> str:
    """Hash of a resolved case and of the program that runs it. Limits are held against answers, and are no part of it.

    known: as of `case_to_dict`.
    """
    written = {name: value for name, value in case_to_dict(case, known).items() if name != LIMITS.name}
    text = json.dumps([written, __version__, source_hash()], sort_keys=True)
    return "r" + hashlib.sha256(text.encode()).hexdigest()[:16]  # the letter, as spreadsheets take 12e4 for a number


def make_plan(designs: Designs) -> tuple[Plan, dict[str, Case]]:
    """Return the plan of the designs, and the cases by the ids of their runs; two equal cases are one run."""
    known: dict[tuple[str, int], Any] = {}
    cases = [(run_id(design.case, known), design) for design in designs.all]
    runs = tuple(Run(id, design.values) for id, design in cases)
    first = designs.all[0].case
    return Plan(first.title, __version__, source_hash(), designs.axes, runs, case_to_dict(first), designs.sampling), {
        id: design.case for id, design in cases
    }


def run_sweep(
    designs: Designs,
    folder: Path,
    *,
    shard: Shard = WHOLE,
    threads: int | None = None,
    scheduler: str | None = None,
    histories: bool = False,
    force: bool = False,
    growing: bool = False,
    progress: Callable[[int, int, bool], None] | None = None,
    told: Callable[[str], None] = lambda _: None,
    records: dict[str, Record] | None = None,
) -> Plan:
    """Run all designs, or a shard of them, that no journal in the folder has.

    threads: of this machine, default one a core; scheduler: address of a dask scheduler, whose workers run instead of them.
    histories: keep those as well, in histories.h5, a dataset a run named by its id, units in the file's attributes. force: also
    into a folder whose results.csv would lose answers of another sweep. growing: also into one with more of the same samples.
    progress: told the number of runs done, of all, and whether the last was computed now. told: told in words how large the
    histories get. records: gets what the journals have in the end, which spares reading them again.
    Raises SweepError; in the middle of a sweep its kinds NotKept, where the disk is full, and SchedulerLost. Whatever breaks it
    off, the journal has what was done.
    """
    if histories and any(design.case.tolerance is not None for design in designs.all):
        raise SweepError("--histories: a case with a tolerance has none, its answer is of several runs")
    client = _connected(scheduler) if scheduler else None
    plan, cases = make_plan(designs)
    mine = dict.fromkeys(run.id for run in plan.runs[shard.number - 1 :: shard.of])
    journal = folder / shard.named(JOURNAL, ".jsonl")
    with _writing(folder), _held(folder, journal):
        if not force:
            _refuse_other(folder, plan, growing)
        write_plan(folder, plan)
        _mend(journal)
        known = read_journals(folder)
        with ExitStack() as stack:
            kept = stack.enter_context(_Histories(folder / shard.named(HISTORIES, ".h5"))) if histories else None
            todo = {id: cases[id] for id in mine if _lacks(known.get(id), cases[id]) or (kept is not None and id not in kept.ids)}
            done = len(mine) - len(todo)
            answers = _on_cluster(client, todo, histories) if client else _here(todo, threads, histories)
            if progress is not None:
                progress(done, len(mine), False)
            stream = stack.enter_context(open(journal, "a", encoding="utf-8"))
            for number, (id, answer) in enumerate(answers):
                size = 0
                with held_interrupt():  # nothing is half kept
                    if _lacks(known.get(id), todo[id]):
                        record = _record(id, answer)
                        stream.write(json.dumps(record) + "\n")
                        stream.flush()
                        _add(known, record)
                    if kept is not None and answer.history is not None:
                        size = kept.add(id, todo[id], answer.history)
                if size and number == 0 and len(todo) > 1:
                    told(f"histories: about {len(todo) * size / 1e6:.3g} MB for {len(todo)} runs")
                done += 1
                if progress is not None:
                    progress(done, len(mine), True)
    if records is not None:
        records.update(known)
    return plan


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    """Say in a line why a sweep cannot be kept: disk full, folder gone."""
    try:
        yield
    except OSError as error:
        raise NotKept(f"{folder}: cannot be written: {error.strerror or error}; the same command goes on from here") from error


@contextmanager
def _held(folder: Path, journal: Path) -> Iterator[None]:
    """Make the folder, and keep other processes off its journal."""
    folder.mkdir(parents=True, exist_ok=True)
    try:
        release = hold(journal)
    except BlockingIOError:
        raise SweepError(f"{folder}: another sweep runs into this folder; --output names another one") from None
    try:
        yield
    finally:
        release()


def _refuse_other(folder: Path, plan: Plan, growing: bool) -> None:
    """Raise SweepError where the folder has answers of runs that the plan has not: the results would lose them."""
    if not (folder / PLAN).exists():
        return
    other, known = read_plan(folder), read_journals(folder)
    if growing and other.runs[: len(plan.runs)] == plan.runs:
        return  # the samples of the next plans
    lost = {run.id for run in other.runs if run.id in known} - {run.id for run in plan.runs}
    if lost:
        version = "" if other.source_hash == plan.source_hash else " by another version of softbrake"
        over = ", ".join(axis.path for axis in other.axes)
        raise SweepError(
            f"{folder}: holds another sweep{version}, '{other.title}' over {over}, and {RESULTS} would lose {len(lost)} of its "
            "answers; --output names another folder, --force replaces them"
        )


def _record(id: str, answer: Dropped) -> Record:
    return {"id": id, "fault": answer.fault, "summary": None if answer.summary is None else as_dict(answer.summary)}


def _lacks(record: Record | None, case: Case) -> bool:
    """Whether a journal lacks the answer of a case, or a peak behind a class that its limits name."""
    if record is None:
        return True
    wanted = {limit.column for limit in case.limits if limit.cfc is not None}
    return record["fault"] is None and not wanted <= record["summary"]["limit_peaks"].keys()


def _here(todo: dict[str, Case], threads: int | None, histories: bool) -> Iterator[tuple[str, Dropped]]:
    yield from zip(todo, run_batch(todo.values(), threads=threads, histories=histories), strict=True)


def _connected(address: str) -> Client:
    """Return the client of a dask scheduler that has workers. Raises SweepError."""
    try:
        from distributed import Client
    except ImportError:
        raise SweepError("--scheduler needs dask: pip install 'softbrake[dask]'") from None
    expected = "the address of a dask scheduler such as tcp://host:8786 is expected"
    if not re.fullmatch(r"[a-z]+://\S+:[0-9]+", address):  # dask would try for a minute
        raise SweepError(f"--scheduler {address}: not an address; {expected}")
    try:
        client = Client(address, set_as_default=False, timeout=PATIENCE)
    except OSError as error:
        raise SweepError(f"--scheduler {address}: {error}; {expected}") from None
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError:
        client.close()
        fault = f"no worker within {PATIENCE} s; `dask worker {address}` starts one"
        raise SweepError(f"--scheduler {address}: {fault}") from None
    return client


def _on_cluster(client: Client, todo: dict[str, Case], histories: bool) -> Iterator[tuple[str, Dropped]]:
    """Run cases on the workers of a dask scheduler; a worker's death moves its runs to others. Raises SchedulerLost."""
    address = client.scheduler.address
    for name in ("client", "comm.tcp", "core"):  # the traceback that each would print of a lost scheduler
        logging.getLogger(f"distributed.{name}").setLevel(logging.CRITICAL)
    with client:
        try:
            yield from _answers(client, todo, histories)
        except Exception as error:
            if client.status == "running" or isinstance(error, SweepError):
                raise
            raise SchedulerLost(f"--scheduler {address}: lost; the same command goes on from here") from None


def _answers(client: Client, todo: dict[str, Case], histories: bool) -> Iterator[tuple[str, Dropped]]:
    from distributed import KilledWorker, as_completed

    tasks = {client.submit(_task, list(part.values()), histories, pure=False): list(part) for part in _parts(todo)}
    for task in as_completed(tasks, loop=client.loop):
        ids = tasks.pop(task)
        if task.status == "error" and isinstance(task.exception(), KilledWorker):
            continue  # lost with its workers, several times
        theirs, answers = task.result()
        if theirs != source_hash():
            raise SweepError("--scheduler: a worker has another version of softbrake; the same is expected everywhere")
        yield from zip(ids, answers, strict=True)
        task.release()


def _parts(todo: dict[str, Case]) -> Iterator[dict[str, Case]]:
    items = iter(todo.items())
    for id, case in items:
        more = AT_ONCE.get(case.model.fidelity, 1) - 1
        yield {id: case, **dict(islice(items, more))}


def _task(cases: Sequence[Case], histories: bool) -> tuple[str, list[Dropped]]:
    """What a worker does: run some cases, and say by which program."""
    return source_hash(), [run_one(case, histories) for case in cases]


def write_plan(folder: Path, plan: Plan) -> None:
    """Write plan.json, all of it or nothing."""
    write_text(folder / PLAN, json.dumps(vars(plan)))


def read_plan(folder: Path) -> Plan:
    """The plan of a sweep's folder. Raises SweepError."""
    try:
        plan = json.loads((folder / PLAN).read_text(encoding="utf-8"))
        axes = tuple(Axis(*axis) for axis in plan.pop("axes"))
        runs = tuple(Run(id, tuple(values)) for id, values in plan.pop("runs"))
        if (kept := plan.pop("sampling", None)) is not None:
            mode, samples, seed, inputs, *control = kept
            kept = Sampling(mode, samples, seed, tuple(inputs), *control)
        return Plan(axes=axes, runs=runs, sampling=kept, **plan)
    except OSError as error:
        raise SweepError(f"{folder / PLAN}: {error.strerror or error}; the folder of a sweep is expected") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise SweepError(f"{folder / PLAN}: not the plan of a sweep") from None


def read_journals(folder: Path) -> dict[str, Record]:
    """What the journals of a folder have, by id; the torn last line of a run that was killed counts for nothing.

    Of several lines of a run, which differ in the peaks that limits asked for, the last one counts, with the peaks of all.
    """
    known: dict[str, Record] = {}
    for path in sorted(folder.glob(f"{JOURNAL}*.jsonl")):
        for line in path.read_text(encoding="utf-8").splitlines():
            try:
                record = json.loads(line)
            except ValueError:
                continue
            if isinstance(record, dict) and {"id", "summary", "fault"} <= record.keys():
                _add(known, record)
    return known


def _add(known: dict[str, Record], record: Record) -> None:
    """Take a record in, with the peaks of an earlier one."""
    before = known.get(record["id"], {"summary": None})["summary"]
    if before and record["summary"]:
        record["summary"]["limit_peaks"] = before.get("limit_peaks", {}) | record["summary"]["limit_peaks"]
    known[record["id"]] = record


def passing(plan: Plan, records: Mapping[str, Record]) -> Estimate:
    """Chance that a run of a plan keeps all limits of its case; one without an answer does not."""
    limits = limits_of(plan.case[LIMITS.name])
    found = (records[run.id] for run in plan.runs if run.id in records)  # one may be lost with its worker
    held = sum(not one["fault"] and all(each.holds for each in judge(limits, one["summary"])) for one in found)
    return wilson(held, len(plan.runs))


def _mend(journal: Path) -> None:
    """Cut a torn last line off, so that the next one starts a line of its own."""
    if journal.exists():
        with open(journal, "rb+") as stream:
            stream.truncate(stream.read().rfind(b"\n") + 1)


class _Histories:
    """histories.h5; a file that a kill left torn starts anew."""

    def __init__(self, path: Path) -> None:
        self._staged = StagedFile(path, "r+" if path.exists() else "w")
        try:
            self._open("a")
            self.ids = {id for id in self._file if self._file[id].shape}  # each header has its checksum
        except (OSError, RuntimeError, KeyError):
            self._staged = StagedFile(path, "w")
            self._open("w")
            self.ids = set()
        self._file.attrs.update({column.name.lower(): column.unit for column in History})

    def _open(self, mode: str) -> None:
        # the oldest format, h5py's default, has no checksums: of a torn group it reads names that nobody wrote
        self._file = h5py.File(self._staged, mode, locking=False, libver="v110")

    def add(self, id: str, case: Case, history: Any) -> int:
        """Keep the history (rows, len(History)) of a run and return its size in the file, bytes. Raises OSError."""
        rows = as_history(history, history_dtype(case))
        if id in self._file:  # whose line of the journal was torn
            del self._file[id]
        kept = self._file.create_dataset(id, data=rows, compression="gzip", compression_opts=4, shuffle=True)
        self._file.flush()
        if self._staged.fault is not None:
            raise self._staged.fault
        return int(kept.id.get_storage_size())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
        self._staged.close()


def merge_folders(folders: Iterable[Path]) -> tuple[Plan, dict[str, Record]]:
    """Plan and records of the shards of one sweep, in one folder or several. Raises SweepError where plans differ."""
    plan: Plan | None = None
    known: dict[str, Record] = {}
    for folder in folders:
        other = read_plan(folder)
        if plan is not None and other != plan:
            raise SweepError(f"{folder}: of another sweep, or by another version of softbrake; shards of one sweep are expected")
        plan = other
        known = read_journals(folder) | known
    if plan is None:
        raise SweepError("no folder to merge")
    return plan, {id: known[id] for id in dict.fromkeys(run.id for run in plan.runs) if id in known}
