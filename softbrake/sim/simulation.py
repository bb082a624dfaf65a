"""One drop: chunks of steps, snapshots, reasons to stop, and the answer."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from softbrake import __version__
from softbrake.case.case import Case
from softbrake.case.case_file import parse_case
from softbrake.case.level import level
from softbrake.case.plausible import foreseen
from softbrake.case.schema import starter
from softbrake.case.sections.numerics import ONE_COLUMN, Fidelity, damping_ratio
from softbrake.core.arrays import (
    PAD,
    ContactCount,
    Floats,
    GasState,
    Meridian,
    Model,
    Motion,
    Nodes,
    Outcome,
    Peak,
    Source,
    State,
    VentState,
    Workspace,
)
from softbrake.core.columns import WORKS, History
from softbrake.core.gas import begin_gas
from softbrake.core.jit import PACKAGE, hash_sources
from softbrake.core.lanes import close_nodes
from softbrake.core.loop.fields import sample_fields
from softbrake.core.loop.meridian import advance_meridian, stable_step_of_meridian, volume_of_meridian
from softbrake.core.loop.piston import advance_lumped
from softbrake.core.loop.rest import relax_meridian
from softbrake.core.loop.step import advance
from softbrake.core.loop.step_size import stable_step
from softbrake.core.loop.time_loop import MADE, energy_given
from softbrake.core.membrane.volume import shell_volume
from softbrake.core.pressure import update_pressure
from softbrake.sim.build import (
    build_meridian,
    build_model,
    build_state,
    build_workspace,
    grid_view,
    initial_energy,
    lacks_room,
    places,
    whole_model,
    whole_nodes,
    with_room,
    without_viscosity,
)
from softbrake.sim.cores import memory
from softbrake.sim.filters import COLUMNS, LEAST_ROWS, PEAKS, filtered_peaks, larger, low_pass
from softbrake.sim.interrupt import held_interrupt
from softbrake.sim.relax import MOST_STEPS, TOLERANCE, Relaxation, relax
from softbrake.sim.result_file import ResultFile
from softbrake.sim.stored import stored_energy
from softbrake.sim.summary import (
    LARGEST_GAIN,
    FilteredPeaks,
    GasBalance,
    ModelUsed,
    PeakValue,
    Phase,
    Summary,
    Work,
    doubt_of,
    fabric_in_words,
)
from softbrake.sim.threads import ThreadSearch, crossings_of_meridian

KERNELS = {"full": advance, "axisymmetric": advance_meridian, "lumped": advance_lumped}
REFINED: tuple[Fidelity, ...] = ("lumped", "axisymmetric", "full")  # of a run for a tolerance
ALL_KERNELS = (  # fidelity; whether folds are in contact
    *((fidelity, False) for fidelity in KERNELS),
    ("full", True),
    ("axisymmetric", True),
    ("inflation", False),  # of a shell at the start, and by a gas
)
NODE_STEPS_PER_CHUNK = 2_000_000  # about 15 ms between chances for progress and Ctrl-C
HISTORY_ROWS = 4096
VISCOUS = 1.5  # times longer would the stable step be without viscosity: then that is its limit
CLOCK = time.perf_counter if sys.platform == "win32" else time.thread_time  # Windows counts CPU time by 16 ms, drops take 1
TENSIONS = (Peak.TENSION_GENERATRIX, Peak.TENSION_HOOP, Peak.TENSION_BELT)
NO_ROWS = 2**62  # steps between rows of a history that nobody reads
UNDAMPED = 0.03  # damping ratio of the shortest wave below which tensions without a potential end either scheme
LEAKY = 0.3  # below which they may end a run of the default one; see benchmarks/stability.py
ROUND_OFF = 1e-9  # of a strength: a smaller tension is none
BURSTING = 1.5  # median hoop stretch; skeleton fabrics are used up to 1.3, and a faulty step stretches a few nodes only


class Progress(NamedTuple):
    """What a progress callback is told after each chunk of steps."""

    time: float  # s
    height: float  # m
    velocity: float  # m/s, downwards positive
    steps: int
    end_time: float  # s


class Diverged(Exception):
    """The run left what physics allows; the message names time, step, node, quantity and the likely cause.

    `summary` says what was computed up to there.
    """

    def __init__(self, message: str, summary: Summary) -> None:
        super().__init__(message, summary)
        self.summary = summary

    def __str__(self) -> str:
        return str(self.args[0])


class NotInflated(Exception):
    """The shell found no shape of rest; the message says how far it came and the likely cause."""


def kernels_of(cases: Iterable[Case]) -> set[tuple[str, bool]]:
    """Return which of ALL_KERNELS runs of cases need."""
    wanted: set[tuple[str, bool]] = set()
    for case in cases:
        for fidelity in REFINED if case.tolerance is not None else [case.model.fidelity]:
            wanted.add((fidelity, "folds" in case.contact and (fidelity, True) in ALL_KERNELS))
        if case.initial == "inflated" or case.gas is not None:
            wanted.add(("inflation", False))
    return wanted


def kernel_name(fidelity: str, self_contact: bool) -> str:
    """Name of one of ALL_KERNELS for people."""
    return fidelity + " with folds" * self_contact


def compile_kernels(wanted: Iterable[tuple[str, bool]] = ALL_KERNELS, report: Callable[[str], None] = lambda _: None) -> None:
    """Compile, or load, some of ALL_KERNELS, and those of pictures, disturbances and filtered peaks.

    report: told the name of each before.
    """
    low_pass(np.zeros(2), LEAST_ROWS, 1.0)
    for fidelity, self_contact in wanted:
        report(kernel_name(fidelity, self_contact))
        if fidelity == "inflation":
            compile_inflation()
            continue
        contact = "contact=full" if self_contact else "contact=solid"
        one = Simulation(parse_case(starter(), "starter", [f"model.fidelity={fidelity}", contact]))
        one.advance(most=0)
        one.fields()
        one.disturb(0.0, 0)
        one.threads()
        update_pressure(one.model, one.state, 0.0, 0.0)


def compile_inflation() -> None:
    """Compile, or load, what inflates a shell and fills it with gas."""
    gas = ["model.fidelity=axisymmetric", "contact=solid", "gas={pressure: 1 kPa}"]
    case = replace(parse_case(starter(), "starter", gas), initial="unloaded")
    one = Simulation(case)
    relax_meridian(one.model, one.state.nodes, one.workspace, 1.0, 1.0, 0)


def prepare(case: Case, disturbed: tuple[float, int] | None = None) -> Simulation:
    """Return a drop at its start, its kernels loaded or compiled. disturbed: size (m) and seed, see `Simulation.disturb`.

    Raises NotInflated.
    """
    falling = Simulation(case)
    falling.advance(most=0)
    if disturbed is not None:
        falling.disturb(*disturbed)
    return falling


@contextmanager
def recorded(case: Case, results: str | Path | None) -> Iterator[ResultFile | None]:
    """Hold the result file of a run open, replacing an older one when it is whole; None for no file. Raises ResultError."""
    if results is None:
        yield None
        return
    with (
        held_interrupt(),  # a run that is ended has an answer in its file, as soon as that stands
        ResultFile.create(Path(results), case, version=__version__, source_hash=hash_sources(PACKAGE)) as file,
    ):
        yield file


def simulate(case: Case, results: str | Path | None = None, progress: Callable[[Progress], None] | None = None) -> Summary:
    """Run a drop to impact, full stop or `time.end` as it stands in the case, and return its answer.

    results: path of the result file to write, or None for none. progress: called after each chunk of steps, some 15 ms.
    Ctrl-C ends the run early with outcome "interrupted" and a whole result file. A disk that gets full ends no run:
    `results_fault` of the answer tells of it. Raises Diverged where the computation fails; the result file is readable up to
    there. Raises ResultError where the file cannot be begun.
    """
    falling = prepare(case)
    with recorded(case, results) as file:
        return falling.to_end(file, progress)


class Simulation:
    """A drop under way."""

    def __init__(self, case: Case) -> None:
        """Allocate the arrays; `initial: inflated` also inflates the shell. Raises NotInflated, and MemoryError beforehand."""
        run, there = foreseen(case, results=False), memory()
        if run is not None and run.memory > there:
            cells = f"{case.grid.generatrix} x {case.grid.hoop} cells"
            raise MemoryError(f"{cells} need about {run.memory / 1e9:.3g} GB, and there are {there / 1e9:.3g} GB")
        self.case = case
        self.model: Model = build_model(case)
        self.state: State = build_state(case, self.model)
        one_column = case.model.fidelity in ONE_COLUMN
        self_contact = self.state.self_contact is not None
        self.workspace: Workspace | Meridian = (
            build_meridian(self.model) if one_column else build_workspace(self.model, self_contact)
        )
        self.history: Floats = np.empty((HISTORY_ROWS, len(History)))
        self.interval = case.output.history_interval  # steps between rows of the history
        self.classed = [limit for limit in case.limits if limit.cfc is not None]
        self.keeping = bool(self.classed)  # whether rows are kept, for filtered peaks
        self._kept: list[Floats] = []
        self.most = max(NODE_STEPS_PER_CHUNK // ((self.model.n1 + 1) * self.model.n2), 1)  # steps of a chunk
        self.kernel_seconds = 0.0
        self.thread_time: float | None = None  # s, of the first snapshot with threads
        if case.initial == "inflated" and case.model.fidelity != "lumped":  # gas alone has no shape
            self.inflate()
            shape = self.state.nodes
            self.state = build_state(case, self.model)
            for part, inflated in zip(self.state.nodes[:3], shape[:3], strict=True):
                part[:] = inflated
            self.state.stored[:] = stored_energy(self.model, self.state.nodes)
        if case.gas is not None:
            begin_gas(self.model, self.state, case.gas.pressure, case.gas.temperature, self.volume())
        self._gas_energy_start = self.now(History.GAS_ENERGY)

    def step(self, model: Model) -> Outcome:
        """Advance by one step of another model of the same arrays."""
        kernel = KERNELS[self.case.model.fidelity]
        return Outcome(kernel(model, self.state, self.workspace, self.history, 1, 1, math.inf)[1])

    def inflate(self, tolerance: float = TOLERANCE) -> Relaxation:
        """Bring the shell to rest under its cover, which is held, and the pressure of t = 0; see `relax`. Raises NotInflated."""
        steady = self.model._replace(gas=self.model.gas._replace(exponent=0.0))
        self._start_round(steady, tolerance)
        found = relax(steady, self.state, self.step, tolerance)
        if not found.converged:
            if math.isinf(found.residual):
                why = "it grows without end; most likely the fabric is too soft for the pressure, and bursts"
            else:
                why = f"residual {found.residual:.3g}, not {tolerance:.3g}; most likely slack fabric that nothing holds still"
            raise NotInflated(f"not inflated: the shell is not at rest after {found.steps} steps: {why}")
        return found

    def _start_round(self, model: Model, tolerance: float) -> None:
        """Move the nodes to where a round shell without contact is at rest, if it finds that."""
        one, scratch, nodes = model, self.workspace, self.state.nodes
        if self.case.model.fidelity == "full":
            grid = self.case.grid
            round_case = level(self.case, "axisymmetric", grid.generatrix, grid.hoop)
            one = build_model(round_case)
            scratch, nodes = build_meridian(one), build_state(round_case, one).nodes
        start = Nodes(*(part.copy() for part in nodes))
        residual, _ = relax_meridian(without_viscosity(one), start, scratch, self.case.filling.start, 0.5 * tolerance, MOST_STEPS)
        if residual > tolerance or start.z[: one.n1].max() > self.case.shell.height:
            return
        if self.case.model.fidelity == "full":
            start = whole_nodes(model, one, start)
        for part, place in zip(self.state.nodes[:3], start[:3], strict=True):
            part[:] = place

    def volume(self) -> float:
        """Return the volume (m^3) of the shell as it is, covers included."""
        if self.case.model.fidelity == "full":
            return float(shell_volume(self.model, self.state.nodes, self.workspace.by_column.rate))  # type: ignore[union-attr]
        if self.case.model.fidelity == "lumped":
            return self.model.hoop.whole * self.model.piston_area * self.now(History.HEIGHT)
        return float(volume_of_meridian(self.model, self.state.nodes, self.workspace.volume))  # type: ignore[union-attr]

    @property
    def contact_open(self) -> bool:
        """Whether contact of folds has been left to the next step: until then they may stand through one another."""
        self_contact = self.state.self_contact
        return self_contact is not None and bool(self_contact.counts[ContactCount.OPEN] > 0)

    def advance(self, until: float = math.inf, most: int = 2**62) -> tuple[Floats, Outcome]:
        """Advance to a time (s), and up to three steps more while contact is open, or by a number of steps, and no further than
        one block of history rows.

        Returns the new rows, a view that the next call overwrites, and the outcome: RUNNING where it only paused.
        Adds to kernel_seconds, CPU seconds.
        """
        start = CLOCK()
        kernel = KERNELS[self.case.model.fidelity]
        interval, last = self.interval, int(self.state.steps[0]) + most
        rows, outcome = kernel(self.model, self.state, self.workspace, self.history, interval, most, until)
        while (self_contact := self.state.self_contact) is not None and lacks_room(self_contact):
            self.state = self.state._replace(self_contact=with_room(self_contact))
            if outcome == Outcome.RUNNING:
                rest = last - int(self.state.steps[0])
                more, outcome = kernel(self.model, self.state, self.workspace, self.history[rows:], interval, rest, until)
                rows += more
        self.kernel_seconds += CLOCK() - start
        if self.keeping:
            self._kept.append(self.history[:rows, COLUMNS])
        return self.history[:rows], Outcome(outcome)

    def to_end(self, file: ResultFile | None = None, progress: Callable[[Progress], None] | None = None) -> Summary:
        """Advance to the end, writing history, snapshots and answer to the file, whose rows give the filtered peaks.

        Raises Diverged.
        """
        started = time.perf_counter()
        self.kernel_seconds = 0.0
        if file is None:
            self.without_rows()
        else:
            self.keeping = True
        outcome = Outcome.RUNNING
        interval = self.case.output.snapshot_interval
        due = math.inf if file is None else 0.0
        with held_interrupt() as interrupted:
            while outcome == Outcome.RUNNING and not interrupted():
                now = self.now(History.TIME)
                if file is not None and now >= due and not self.contact_open:
                    self._snapshot(file)
                    due = max((now // interval + 1.0) * interval, math.nextafter(now, math.inf))
                rows, outcome = self.advance(due, self.most)
                if file is not None:
                    file.add_history(rows)
                if progress is not None:
                    progress(self._progress())
            ending = "interrupted" if outcome == Outcome.RUNNING else outcome.name.lower()
            if file is not None:
                self._snapshot(file)
            filtered = None if file is None or not self._kept else self._filtered(self.case.output.cfc)
            summary = self._summary(ending, time.perf_counter() - started, file, filtered)
            if file is not None:
                summary = file.write_summary(summary)
        if outcome == Outcome.DIVERGED:
            raise Diverged(self._divergence(), summary)
        return summary

    def finish(self, outcome: Outcome) -> Summary:
        """Return the answer of a drop that was advanced step by step to an outcome. Raises Diverged."""
        summary = self._summary(outcome.name.lower(), self.kernel_seconds, None, None)
        if outcome == Outcome.DIVERGED:
            raise Diverged(self._divergence(), summary)
        return summary

    def without_rows(self) -> None:
        """Record no rows that nothing needs."""
        if not self.keeping:
            self.interval = NO_ROWS

    def now(self, column: History) -> float:
        """Return a current value."""
        return float(self.state.now[column])

    def energy_error(self) -> float:
        """Return the larger residual of work ledger and gas over the initial kinetic plus potential energy."""
        works = float(self.state.now[list(WORKS)].sum())
        residual = self.now(History.KINETIC_ENERGY) - float(self.state.kinetic_start[0]) - works
        gas = self.gas_balance()
        in_gas = 0.0 if gas is None else gas.gained + gas.work + gas.enthalpy_out - gas.enthalpy_in - gas.heat
        return max(residual, in_gas, key=abs) / initial_energy(self.case, self.model)

    def gas_balance(self) -> GasBalance | None:
        """Return the energy of the gas since the start; None of a pressure law."""
        if self.case.gas is None:
            return None
        return GasBalance(
            gained=self.now(History.GAS_ENERGY) - self._gas_energy_start,
            work=self.now(History.GAS_WORK),
            enthalpy_out=self.now(History.ENTHALPY_OUT),
            enthalpy_in=self.now(History.ENTHALPY_IN),
            heat=self.now(History.HEAT),
        )

    def disturb(self, size: float, seed: int) -> None:
        """Move each free node by normal deviates of a size (m), all columns alike in the axisymmetric shell."""
        model, nodes = self.model, self.state.nodes
        random = np.random.default_rng(seed)
        if self.case.model.fidelity in ONE_COLUMN:
            for values in (nodes.x, nodes.z):
                values[1 : model.n1] += size * random.normal(size=model.n1 - 1)
            self._keep_stored()
            return
        for values in (nodes.x, nodes.y, nodes.z):
            grid_view(values, model)[1:-1] += size * random.normal(size=(model.n1 - 1, model.n2))
        for row in range(1, model.n1):
            close_nodes(nodes, np.uint64(row * model.stride + PAD), model.n2)
        self._keep_stored()

    def _keep_stored(self) -> None:
        """Take what the shell stores as it is as stored from the start, where that is more."""
        self.state.stored[:] = np.maximum(self.state.stored, stored_energy(self.model, self.state.nodes))

    def lopsided(self) -> float:
        """Return how far the full shell is out of round (m): largest standard deviation of radius or height along a hoop."""
        x, y, z = (grid_view(values, self.model) for values in self.state.nodes[:3])
        return float(max(np.hypot(x, y).std(axis=1).max(), z.std(axis=1).max()))

    def threads(self) -> int | None:
        """Return how many sides stand through a face, or segments of a meridian cross, as the shell is.

        See core.contact.threads. None without contact of folds, which then may pass, and where the run has left finite numbers.
        """
        if self.state.self_contact is None or not math.isfinite(self.now(History.KINETIC_ENERGY)):
            return None
        if self.case.model.fidelity in ONE_COLUMN:
            return crossings_of_meridian(self.model, self.state.nodes)
        return self.thread_search.find(self.state.nodes).threads

    @cached_property
    def thread_search(self) -> ThreadSearch:
        """The search for threads of the full shell."""
        return ThreadSearch(self.model)

    def _progress(self) -> Progress:
        return Progress(
            time=self.now(History.TIME),
            height=self.now(History.HEIGHT),
            velocity=-self.now(History.VELOCITY),
            steps=int(self.state.steps[0]),
            end_time=self.case.time.end,
        )

    def whole_shell(self) -> tuple[Model, Nodes]:
        """Return model and nodes of the whole shell, whatever part of it is computed."""
        if self.case.model.fidelity == "full":
            return self.model, self.state.nodes
        return self._whole_model, whole_nodes(self._whole_model, self.model, self.state.nodes)

    @cached_property
    def _whole_model(self) -> Model:
        return whole_model(self.case)

    @cached_property
    def _whole_workspace(self) -> Workspace:
        """Scratch for pictures; that of the steps does where it is of the whole shell, since nothing in it outlives a step."""
        scratch: Workspace = self.workspace if self.case.model.fidelity == "full" else build_workspace(self._whole_model)  # type: ignore[assignment]
        return scratch

    def fields(self) -> dict[str, Floats]:
        """Return stretches and tensions (N/m) at the nodes of the whole shell, each (n1+1, cells around the hoop)."""
        return self._fields_of(*self.whole_shell())

    def _fields_of(self, model: Model, nodes: Nodes) -> dict[str, Floats]:
        names = ("stretch_generatrix", "stretch_hoop", "tension_generatrix", "tension_hoop")
        fields = {name: np.empty((model.n1 + 1, model.n2)) for name in names}
        sample_fields(model, nodes, self._whole_workspace, *fields.values())
        return fields

    def _snapshot(self, file: ResultFile) -> None:
        model, nodes = self.whole_shell()
        fields = self._fields_of(model, nodes)
        update_pressure(self.model, self.state, 0.0, 0.0)
        fields["velocity"] = np.stack([grid_view(part, model) for part in (nodes.u, nodes.v, nodes.w)], axis=-1)
        xyz = np.stack([grid_view(part, model) for part in (nodes.x, nodes.y, nodes.z)], axis=-1)
        threads = self.threads()
        if threads and self.thread_time is None:
            self.thread_time = self.now(History.TIME)
        file.add_snapshot(
            self.now(History.TIME),
            xyz,
            fields,
            height=self.now(History.HEIGHT),
            velocity=self.now(History.VELOCITY),
            pressure=self.now(History.PRESSURE),
            temperature=self.now(History.TEMPERATURE),
            mass=self.now(History.GAS_MASS),
            threads=threads,
        )

    def _above_ground(self, row: float) -> float:
        """Return the height (m) of a row of the unloaded profile, or of the middle of an edge."""
        return float(np.interp(row, *self._heights))

    @cached_property
    def _heights(self) -> tuple[Floats, Floats]:
        """Rows, and the height (m) of each on the unloaded profile."""
        return np.arange(self.model.n1 + 1.0), places(self.case)[0]

    def _peak(self, which: Peak) -> PeakValue:
        """Largest value of the run and that of the other phase."""

        def of(phase: Phase, peaks: Floats) -> PeakValue:
            value, when, row = (float(part) for part in peaks[which])
            return PeakValue(value, when, self._above_ground(row) if which in TENSIONS else None, phase)

        if self._lowest() > self.model.crushing:
            return of("overshoot", self.state.peaks)
        return larger(of("overshoot", self.state.overshoot), of("crushing", self.state.peaks))

    def _lowest(self) -> float:
        """Lowest height of the cover so far, m."""
        return min(self.now(History.HEIGHT), float(self.state.motion[Motion.LOWEST]))

    def _known(self) -> dict[str, Peak]:
        """Peaks that the run has, by their names in the answer."""
        lumped, belts = self.case.model.fidelity == "lumped", self.case.belts
        tensions = [Peak.TENSION_GENERATRIX, Peak.TENSION_HOOP, *([Peak.TENSION_BELT] if belts else [])]
        gas = [] if self.case.gas is None else [Peak.PRESSURE, Peak.TEMPERATURE]
        known = [Peak.DECELERATION, *([] if lumped else tensions), *gas]
        return {f"peak_{which.name.lower()}": which for which in known}

    def _filtered(self, cfc: int, *names: str) -> FilteredPeaks:
        """Peaks behind a class; names: by default all that the run has."""
        names = names or tuple(name for name in self._known() if name in PEAKS)
        return filtered_peaks(np.concatenate(self._kept), cfc, self.model.crushing, names)

    def _limit_peaks(self) -> dict[str, float | str]:
        """Peaks behind the classes of the case's limits; why there is none, where there is none."""
        found: dict[str, float | str] = {}
        for limit in self.classed if self._kept else ():
            assert limit.cfc is not None
            peaks = self._filtered(limit.cfc, limit.name)
            found[limit.column] = getattr(peaks, limit.name).value if peaks.fault is None else peaks.fault
        return found

    def _summary(self, outcome: str, wall_seconds: float, file: ResultFile | None, filtered: FilteredPeaks | None) -> Summary:
        case, self_contact, steps = self.case, self.state.self_contact, int(self.state.steps[0])
        impact = -self.now(History.VELOCITY) if outcome == "impact" else None
        free_fall = case.free_fall_velocity
        peaks = {name: self._peak(which) for name, which in self._known().items()}
        generatrix, hoop, belt = (
            None if (peak := peaks.get(f"peak_tension_{part}")) is None else peak.value for part in ("generatrix", "hoop", "belt")
        )
        energy = initial_energy(case, self.model)
        made = {name: part / energy for name, part in self.made().items()}
        return Summary(
            title=case.title,
            outcome=outcome,  # type: ignore[arg-type]
            end_time=self.now(History.TIME),
            impact_velocity=impact,
            impact_time=None if impact is None else self.now(History.TIME),
            free_fall_velocity=free_fall,
            velocity_reduction=None if impact is None else free_fall - impact,
            lowest_height=self._lowest(),
            peak_deceleration=peaks["peak_deceleration"].value,
            peak_tension_generatrix=generatrix,
            peak_tension_hoop=hoop,
            peak_tension_belt=belt,
            peaks=peaks,
            work=Work(*(float(part) for part in self.state.now[list(WORKS)])),
            largest_penetration=0.0 if self_contact is None else float(self_contact.penetration[0]),
            missed_collisions=0 if self_contact is None else int(self_contact.counts[ContactCount.MISSED]),
            threads=self.threads(),
            thread_time=self.thread_time,
            energy_error=self.energy_error(),
            energy_made=made,
            steps=steps,
            time_step=self.now(History.TIME) / steps if steps else 0.0,
            kernel_seconds=self.kernel_seconds,
            wall_seconds=wall_seconds,
            model=ModelUsed(
                case.model.fidelity,
                case.grid.generatrix,
                case.grid.hoop,
                case.time.courant,
                case.model.scheme,
                [] if case.model.fidelity == "lumped" else list(case.contact),
                None
                if case.model.fidelity == "lumped"
                else fabric_in_words(case.fabric.law, case.fabric.slack, case.fabric.G12, case.fabric.E11, case.fabric.E22),
            ),
            results=None if file is None else str(file.path),
            fabric_margin=_margin(case.fabric.strength, max(generatrix or 0.0, hoop or 0.0)),
            belt_margin=_margin(min((b.strength for b in case.belts if b.strength is not None), default=None), belt or 0.0),
            filtered=filtered,
            limit_peaks=self._limit_peaks(),
            doubt=doubt_of(made),
            rest_time=rest if math.isfinite(rest := float(self.state.motion[Motion.REST_TIME])) else None,
            rebound_velocity=self.now(History.VELOCITY) if outcome == "rebound" else None,
            peak_pressure=peaks["peak_pressure"].value if case.gas is not None else None,
            peak_temperature=peaks["peak_temperature"].value if case.gas is not None else None,
            vented_mass=float(self.state.gas[GasState.VENTED]) if case.gas is not None else None,
            gas_mass=self.now(History.GAS_MASS) if case.gas is not None else None,
            vent_opening_times=self._openings(),
            gas=self.gas_balance(),
        )

    def _openings(self) -> list[float | None] | None:
        """When each vent opened first, s."""
        times = self.state.vents[:, VentState.OPENED_AT].tolist()
        return None if self.case.gas is None else [when if math.isfinite(when) else None for when in times]

    def _divergence(self) -> str:
        model, nodes = self.whole_shell()
        speed = np.sqrt(sum(grid_view(part, model) ** 2 for part in (nodes.u, nodes.v, nodes.w)))
        row, column = np.unravel_index(int(np.argmax(np.where(np.isfinite(speed), speed, np.inf))), speed.shape)
        kinetic, (maker, made) = self.now(History.KINETIC_ENERGY), max(self.made().items(), key=lambda part: part[1])
        if not math.isfinite(kinetic):
            excess = "kinetic energy not finite"
        elif made > MADE * energy_given(self.model, self.state):
            excess = (
                f"{maker} gave {made:.4g} J more than they took"
                if maker == "belts"
                else f"{maker} gave {made:.4g} J more than it took"
            )
        else:
            excess = f"kinetic energy {kinetic:.4g} J, more than start, gravity and gas can have given"
        return (
            f"diverged at {self.now(History.TIME):.6g} s, step {int(self.state.steps[0])}: {excess}; "
            f"fastest node: row {row} of {model.n1}, column {column}, at {speed[row, column]:.4g} m/s; "
            f"most likely {self._cause()}"
        )

    def made(self) -> dict[str, float]:
        """Return the most that fabric, belts and viscosity gave beyond what they had, J: above 0, energy from nowhere."""
        return {source.name.lower(): float(self.state.made[source]) for source in Source}

    def _cause(self) -> str:
        """Most likely cause of a divergence, in words, with what helps."""
        case, fabric = self.case, self.case.fabric
        stretch = float(np.median(self.fields()["stretch_hoop"]))
        if stretch > BURSTING:
            return (
                f"the fabric bursts: half of the hoops, stretched {stretch:.3g} times and more, find no balance with the pressure"
            )
        if self.model.courant > 1.0:
            return f"{self._limit()} exceeded {self.model.courant:.3g} times; try time.courant=auto"
        shorter = f"try time.courant={0.5 * case.time.courant:g}"
        contact = self.now(History.WORK_CONTACT)
        if contact > max(*self.made().values(), LARGEST_GAIN * energy_given(self.model, self.state)):
            return f"contact, which gave {contact:.4g} J more than it took; {shorter}"
        ratio, printed = damping_ratio(case.shell, fabric, case.grid), case.model.scheme == "cell"
        lawless = fabric.law == "true_tension" or (fabric.law != "tension_field" and fabric.slack == "cut" and fabric.nu12 > 0.0)
        made = self.made()
        makes = not printed and made["fabric"] >= max(made.values()) > 0.0
        if lawless and (makes or ratio < (UNDAMPED if printed else LEAKY)):
            return (
                "tensions without a potential, which gain energy where fabric gets slack and taut again, at any step; "
                "try fabric.law=tension_field" + (", and model.scheme=edge" if printed else "")
            )
        if printed:
            return "the printed scheme's averages do not feel a checkerboard of folds; model.scheme=edge does"
        return f"waves near the limit of the step, which fabric that gets slack and taut again feeds; {shorter}"

    def _limit(self) -> str:
        """What limits the step, and where: of the shell as it started, the only one known to be sound."""
        kernel = stable_step_of_meridian if self.case.model.fidelity in ONE_COLUMN else stable_step
        nodes, model = build_state(self.case, self.model).nodes, self.model
        longest = kernel(model, nodes, self.workspace)
        row = int(np.argmax(self.workspace.by_row.rate))
        viscous = kernel(without_viscosity(model), nodes, self.workspace) > VISCOUS * longest
        where = "at the belt cells" if model.belts.width[row] > 0.0 else f"at row {row}"
        return f"the {'viscosity' if viscous else 'stiffness'} limit of the step {where}"


def _margin(strength: float | None, tension: float) -> float | None:
    """Strength over tension less 1; None without a strength, and where the tension is round-off."""
    return strength / tension - 1.0 if strength is not None and tension > ROUND_OFF * strength else None
