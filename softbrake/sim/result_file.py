"""The result file: VTKHDF PolyData over time, which ParaView 5.12 opens, with the history, case and summary inside.

    /VTKHDF     one PolyData of shell, belts, covers and ground; a step per snapshot; written in VTK's order: lines, then polygons
    /history    a row per recorded step, columns named as `History` in lower case, units in attributes; those of a gas with a
                state only where the case has one
    /softbrake  attributes version, source_hash and tension_scale; JSON texts `case` and, once the run has ended, `summary`,
                or `inflation` of a shell at rest

Snapshots and history are kept for half a second and then written together, and flushed; last, in one write, the times and the
step counter. The file of a killed run stays readable, by VTK too, and lacks that much at most. So does that of a run whose disk
gets full: the run goes on without it. A file that has its answer is packed when it is closed.
"""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from softbrake.case.case import Case, case_to_dict
from softbrake.case.sections.shell import Shell
from softbrake.core.arrays import Floats
from softbrake.core.columns import OF_GAS, History
from softbrake.sim.files import StagedFile, draft_of, hold
from softbrake.sim.interrupt import held_interrupt
from softbrake.sim.summary import (
    Ensemble,
    FilteredPeaks,
    GasBalance,
    Inflation,
    ModelUsed,
    PeakValue,
    Sensitivities,
    Sensitivity,
    Summary,
    Trial,
    Work,
)

if TYPE_CHECKING:
    from pandas import DataFrame


class ResultError(Exception):
    """A result file cannot be written or read; the message is one line for the user."""


class PointField(NamedTuple):
    """A field over the shell's nodes."""

    unit: str
    components: tuple[int, ...]  # () or (3,)


POINT_FIELDS = {
    "velocity": PointField("m/s", (3,)),
    "tension_generatrix": PointField("N/m", ()),
    "tension_hoop": PointField("N/m", ()),
    "stretch_generatrix": PointField("1", ()),
    "stretch_hoop": PointField("1", ()),
}
# One value a snapshot. No name of a point or cell field: readers that look a name up in all of them would take the wrong one.
SCALARS = {"cover_height": "m", "cargo_velocity": "m/s", "gas_pressure": "Pa"}
GAS_SCALARS = {"gas_temperature": "K", "gas_mass": "kg"}  # of a gas with a state
FOLD_SCALARS = {"threads": "1"}  # of a shell whose folds are in contact
FORMER = {"crossings": "missed_collisions", "ladder": "trials", "minimum_height": "lowest_height"}  # names in older files
FORMER_SCALARS = {"cover_height": "height", "cargo_velocity": "velocity"}
PARTS = ("shell", "belt", "lower cover", "upper cover", "ground")  # by the values of the cell array `part`
SHELL_PART, BELT, LOWER_COVER, UPPER_COVER, GROUND = range(len(PARTS))
_COMPRESSED: dict[str, Any] = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
EXPECTED = "a result file of softbrake run (*.vtkhdf) is expected"
SECONDS_KEPT = 0.5  # each call of HDF5 costs as much as the data of a small shell, and a flush as ten
_BYTES_KEPT = 2**26
_BLOCK = 128  # entries a chunk, of datasets with a number or a history row an entry
_PACKED_BLOCK = 4096  # history rows a chunk of a finished file
_CORNERS = 4  # of the ground
_FOR_EACH_CELL_KIND = ("CellOffsets", "ConnectivityIdOffsets")  # vertices, lines, polygons, strips


def tension_scale(case: Case) -> float:
    """Unit of the paper's dimensionless tensions, T_0 / L = rho_B V_0^2 L of section 3.2, N/m.

    With the paper's p = k_p rho_B V_0^2 / 2 and k_p = 4 this is p L / 2, L the shell's height; p is the largest pressure of the
    law. 4709 N/m in the paper's example. 0 without pressure: then there is no dimensionless form.
    """
    return 0.5 * case.filling.largest * case.shell.height


def history_dtype(case: Case) -> np.dtype[Any]:
    """Type of a row of /history: a float64 for each column, those of a gas only where the case has one."""
    columns = [column for column in History if case.gas is not None or column not in OF_GAS]
    return np.dtype([(column.name.lower(), np.float64) for column in columns])


def as_history(rows: Floats, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Copy `rows` (k, len(History)) to structured ones, (k,), of the columns of a dtype."""
    columns = [History[name.upper()] for name in dtype.names or ()]
    copy: NDArray[Any] = np.ascontiguousarray(rows[:, columns], np.float64).view(dtype)[:, 0]
    return copy


class ResultFile:
    """A result file being written. Use as a context manager, or call `close`."""

    def __init__(self, path: Path, release: Callable[[], None]) -> None:
        """Open a laid-out file that has no step yet; `create` is the way in. release: gives the place back at the end."""
        self.path = path
        self._release = release
        # No locks of HDF5: a reader may look into the file while the run goes on, and some file systems have none.
        self._staged = StagedFile(path, "r+")
        self._file = h5py.File(self._staged, "r+", locking=False)
        root = self._file["VTKHDF"]
        part = root["CellData/part"][:]
        self._under_pressure = np.isin(part, (SHELL_PART, LOWER_COVER, UPPER_COVER))
        self._points, self._cell_pressure = root["Points"], root["CellData/pressure"]
        self._fields = {name: root["PointData"][name] for name in POINT_FIELDS}
        self._scalars = dict(root["FieldData"].items())
        self._steps, self._times = root["Steps"], root["Steps/Values"]
        offsets = _offsets(int(root["NumberOfPoints"][0]), len(part), self._scalars)
        each = ((self._steps[name], *line) for name, line in offsets.items())
        self._offsets = [(dataset, np.full((1, *dataset.shape[1:]), first), stride) for dataset, first, stride in each]
        self._history = self._file["history"]
        self._kept: dict[h5py.Dataset, list[NDArray[Any]]] = {}
        self._bytes_kept = 0
        self._written = -math.inf
        self._whole_until: float | None = None  # s, of the last snapshot on the disk
        self._answered = False

    @classmethod
    def create(cls, path: Path | str, case: Case, *, version: str, source_hash: str) -> Self:
        """Start the result file of `case` at `path`, which ends in .vtkhdf; an older file is replaced once the new one stands.

        `version` and `source_hash` name the program that computes the results. Raises ResultError, also where another run
        writes to this file.
        """
        path = Path(path)
        if path.suffix != ".vtkhdf":
            raise ResultError(f"{path}: the name of a result file ends in .vtkhdf")
        with held_interrupt(), _writing(path):
            try:
                release = hold(path)
            except BlockingIOError:
                raise ResultError(f"{path}: another run writes this file; --output names another one") from None
            try:
                with draft_of(path) as draft, _staged(draft, "w") as file:
                    _lay_out(file, case)
                    about = file.create_group("softbrake")
                    about.attrs.update({"version": version, "source_hash": source_hash, "tension_scale": tension_scale(case)})
                    about.attrs["tension_scale_units"] = "N/m"
                    about["case"] = json.dumps(case_to_dict(case))
                return cls(path, release)
            except BaseException:
                release()
                raise

    @property
    def fault(self) -> str | None:
        """Why the file lacks what came last, in a line for the user; None where it is whole."""
        if (error := self._staged.fault) is None:
            return None
        until = "no instant" if self._whole_until is None else f"the run up to {self._whole_until:.6g} s"
        return f"{self.path}: cannot be written: {_reason(error)}; the file holds {until}, and no answer"

    def add_snapshot(
        self,
        instant: float,
        xyz: Floats,
        fields: Mapping[str, Floats],
        *,
        height: float,
        velocity: float,
        pressure: float,
        temperature: float = 0.0,
        mass: float = 0.0,
        threads: int | None = None,
    ) -> None:
        """Append the shell at an `instant` [s]; it reaches the file within SECONDS_KEPT, or with the next call after that.

        `xyz` [m] is (n1+1, n2, 3); `fields` holds every name of POINT_FIELDS, each (n1+1, n2) or, for velocity, (n1+1, n2, 3).
        `height` [m] and `velocity` [m/s, up positive] are the cargo's, `pressure` [Pa] the gas's; so are `temperature` [K] and
        `mass` [kg] of a gas with a state. `threads` are those of a shell whose folds are in contact, None is kept as nan.
        """
        step = len(self._times) + len(self._kept.get(self._times, ()))
        ground = _ground_corners(xyz)
        self._keep(self._points, np.concatenate((xyz.reshape(-1, 3), ground)))
        for name, dataset in self._fields.items():
            components = POINT_FIELDS[name].components
            values = fields[name].reshape(-1, *components)
            own = np.zeros(components) if components else values.min()
            self._keep(dataset, np.concatenate((values, np.full((len(ground), *components), own))))
        self._keep(self._cell_pressure, np.where(self._under_pressure, pressure, 0.0))
        counted = math.nan if threads is None else threads
        scalars = (height, velocity, pressure, temperature, mass, counted)
        for name, value in zip((*SCALARS, *GAS_SCALARS, *FOLD_SCALARS), scalars, strict=True):
            if name in self._scalars:
                self._keep(self._scalars[name], np.array([value]))
        for dataset, first, stride in self._offsets:
            self._keep(dataset, first + step * stride)
        self._keep(self._times, np.array([instant]))
        self._write_if_due()

    def add_history(self, rows: Floats) -> None:
        """Append `rows` (k, len(History)) to /history, as add_snapshot does; they are copied."""
        self._keep(self._history, as_history(rows, self._history.dtype))
        self._write_if_due()

    def _keep(self, dataset: h5py.Dataset, rows: NDArray[Any]) -> None:
        self._kept.setdefault(dataset, []).append(rows)
        self._bytes_kept += rows.nbytes

    def _write_if_due(self) -> None:
        if time.monotonic() - self._written >= SECONDS_KEPT or self._bytes_kept > _BYTES_KEPT:
            self._write()

    def _write(self) -> None:
        """Append what was kept, and flush; where the disk took no more, forget it."""
        if self._staged.fault is None:
            with held_interrupt():
                times = self._kept.pop(self._times, [])
                for dataset, rows in self._kept.items():
                    _append(dataset, rows)
                self._file.flush()
                if times:  # counter and times last, in one write: VTK aborts where there are more times than it counts steps
                    _append(self._times, times)
                    self._steps.attrs.modify("NSteps", len(self._times))
                    self._file.flush()
            if times and self._staged.fault is None:
                self._whole_until = float(times[-1][-1])
        self._kept, self._bytes_kept, self._written = {}, 0, time.monotonic()

    def write_summary(self, summary: Summary) -> Summary:
        """Keep the answer, over an earlier one, and return it, with the fault of the file if there is one.

        A file without an answer is from a run that was killed, or whose disk was full.
        """
        self._write_answer("summary", asdict(summary))
        return replace(summary, results_fault=self.fault)

    def write_inflation(self, inflation: Inflation) -> Inflation:
        """Keep the answer of a static inflation, and return it, with the fault of the file if there is one."""
        self._write_answer("inflation", asdict(inflation))
        return replace(inflation, results_fault=self.fault)

    def _write_answer(self, name: str, answer: dict[str, Any]) -> None:
        self._write()
        with held_interrupt():
            _replace_text(self._file["softbrake"], name, json.dumps(answer))
            self._file.flush()
        self._answered = True

    def close(self) -> None:
        """Write what was kept, close the file and pack it; a second call does nothing."""
        if not self._file:
            return
        try:
            with held_interrupt():
                self._write()
                self._file.close()
                self._staged.close()
                if self._answered and self._staged.fault is None:
                    _pack(self.path)
        finally:
            self._release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@dataclass(frozen=True)
class Snapshots:
    """The shell at the recorded instants."""

    times: Floats  # s, (k,)
    xyz: NDArray[np.float32]  # m, (k, n1+1, n2, 3)
    height: Floats  # m, (k,), of the cargo
    velocity: Floats  # m/s, (k,), of the cargo, up positive
    threads: Floats | None  # (k,), see Summary; None where folds are not in contact, and in older files
    fields: dict[str, NDArray[np.float32]]  # as asked for: (k, n1+1, n2) or (k, n1+1, n2, 3), units in POINT_FIELDS


@dataclass(frozen=True)
class Result:
    """What a result file holds. `read_result` reads one."""

    path: Path
    case: dict[str, Any]  # as resolved, SI units; `load_case` makes a Case of it
    summary: Summary | None  # None if the run was killed, and of a static inflation
    inflation: Inflation | None  # the answer of `softbrake inflate`; None of a drop
    history: NDArray[Any]  # (rows,), structured: a field of SI values for each column that the file has, as history["time"]

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each column of the history."""
        return {name: History[name.upper()].unit for name in self.history.dtype.names or ()}

    def frame(self) -> DataFrame:
        """The history as a DataFrame of pandas, a column for each of `units`. Raises ImportError without pandas."""
        try:
            import pandas
        except ImportError:
            raise ImportError("a DataFrame needs pandas: pip install pandas") from None
        return pandas.DataFrame(self.history)

    def snapshots(self, *fields: str) -> Snapshots:
        """Read the shell at the recorded instants: places (m), and the fields that are named.

        fields: of `velocity` (m/s), `tension_generatrix`, `tension_hoop` (N/m), `stretch_generatrix` and `stretch_hoop`.
        Returns an object of times (k,), xyz (k, n1+1, n2, 3), height and velocity (k,) of the cargo, upwards positive, threads
        (k,) or None, and a dict `fields` of arrays (k, n1+1, n2), of velocity (k, n1+1, n2, 3); n1 and n2 are the cells along
        and around the shell.
        Raises ResultError.
        """
        return read_snapshots(self.path, *fields)


def read_result(path: Path | str) -> Result:
    """Read the result file of a run or an inflation: case, answer and history.

    Returns a Result, whose `snapshots` reads the shapes as well. Raises ResultError where the file cannot be read.
    """
    return Result(Path(path), read_case(path), read_summary(path), read_inflation(path), read_history(path))


def read_history(path: Path | str) -> NDArray[Any]:
    """/history as a structured array, a field for each of its columns. Raises ResultError."""
    with _open(path) as file:
        history: NDArray[Any] = file["history"][:]
    return history


def read_summary(path: Path | str) -> Summary | None:
    """The answer of the run, whose file may have been moved; None if the run was killed. Raises ResultError."""
    with _open(path) as file:
        if "softbrake/summary" not in file:
            return None
        text = {FORMER.get(name, name): part for name, part in json.loads(file["softbrake/summary"][()]).items()}
    with _of_this_version(path):
        text["peaks"] = {name: _read_peak(peak) for name, peak in text["peaks"].items()}
        text["work"] = Work(**text["work"])
        text["gas"] = None if text.get("gas") is None else GasBalance(**text["gas"])
        text["model"] = ModelUsed(**text["model"])
        if text.get("ensemble") is not None:
            text["ensemble"] = Ensemble(**text["ensemble"])
        text["trials"] = [Trial(**trial) for trial in text["trials"]]
        if (found := text.get("sensitivity")) is not None:
            text["sensitivity"] = Sensitivities(**{**found, "inputs": [Sensitivity(**row) for row in found["inputs"]]})
        if (kept := text.get("filtered")) is not None:
            peaks = {name: _read_peak(peak) for name, peak in kept.items() if isinstance(peak, dict)}
            text["filtered"] = FilteredPeaks(**{**kept, **peaks})
        return Summary(**{**text, "results": str(path)})


def _read_peak(text: Mapping[str, Any]) -> PeakValue:
    other = text.get("other")
    return PeakValue(**{**text, "other": None if other is None else _read_peak(other)})


def read_inflation(path: Path | str) -> Inflation | None:
    """The answer of a static inflation; None in the file of a drop. Raises ResultError."""
    with _open(path) as file:
        if "softbrake/inflation" not in file:
            return None
        text = json.loads(file["softbrake/inflation"][()])
    with _of_this_version(path):
        return Inflation(**{**text, "results": str(path)})


def read_case(path: Path | str) -> dict[str, Any]:
    """The resolved case as nested dicts, SI units. Raises ResultError."""
    with _open(path) as file:
        case: dict[str, Any] = json.loads(file["softbrake/case"][()])
    return case


def other_answer(path: Path, case: Case) -> str | None:
    """Say what a file at `path` holds that a result of `case` would not repeat; None where nothing is lost.

    Of a case that chooses its own grid and step, those count for nothing; how often results are kept never does.
    """
    if not path.exists():
        return None
    try:
        with _open(path) as file:
            if not {"summary", "inflation"} & set(file["softbrake"]):
                return None
        old = read_case(path)
    except ResultError:
        return "is no result file that can be read"
    new = json.loads(json.dumps(case_to_dict(case)))
    idle = {"output", "limits"} | ({"contact", "grid", "model", "time", "tolerance"} if case.tolerance is not None else set())
    differ = [name for name in {**old, **new} if name not in idle and old.get(name) != new.get(name)]
    return f"holds the answer of another case, with another {' and '.join(differ)}" if differ else None


def read_tension_scale(path: Path | str) -> float:
    """`tension_scale` of the case, N/m. Raises ResultError."""
    with _open(path) as file:
        return float(file["softbrake"].attrs["tension_scale"])


def read_snapshots(path: Path | str, *fields: str) -> Snapshots:
    """All recorded shapes, and the named POINT_FIELDS. Raises ResultError."""
    if strange := [name for name in fields if name not in POINT_FIELDS]:
        raise ResultError(f"{path}: no field '{strange[0]}'; {', '.join(POINT_FIELDS)} are expected")
    grid = read_case(path)["grid"]
    n1, n2 = grid["generatrix"], grid["hoop"]
    with _open(path) as file:
        root = file["VTKHDF"]
        count = int(root["Steps"].attrs["NSteps"])
        points = int(root["NumberOfPoints"][0])

        def shell(name: str) -> NDArray[np.float32]:
            values = root[name][: count * points]
            values = values.reshape(count, points, *values.shape[1:])[:, : (n1 + 1) * n2]
            return np.ascontiguousarray(values.reshape(count, n1 + 1, n2, *values.shape[2:]))

        def scalar(name: str) -> Floats:
            fields = root["FieldData"]
            values: Floats = fields[name if name in fields else FORMER_SCALARS[name]][:count]
            return values

        return Snapshots(
            times=root["Steps/Values"][:count],
            xyz=shell("Points"),
            height=scalar("cover_height"),
            velocity=scalar("cargo_velocity"),
            threads=scalar("threads") if "threads" in root["FieldData"] else None,
            fields={name: shell(f"PointData/{name}") for name in fields},
        )


@dataclass(frozen=True)
class Layout:
    """How much of what a result file holds; cells are in the order of lines and polygons."""

    times: Floats  # s, (k,), of the snapshots
    points: int  # of a snapshot, with the ground's corners last
    cells: int
    generatrix: int  # cells of the shell
    hoop: int
    belts: int
    connectivity: dict[str, int]  # entries of Lines and Polygons


def read_layout(path: Path | str) -> Layout:
    """Sizes of a result file. Raises ResultError."""
    case = read_case(path)
    with _open(path) as file:
        root = file["VTKHDF"]
        return Layout(
            times=root["Steps/Values"][: int(root["Steps"].attrs["NSteps"])],
            points=int(root["NumberOfPoints"][0]),
            cells=len(root["CellData/part"]),
            generatrix=case["grid"]["generatrix"],
            hoop=case["grid"]["hoop"],
            belts=int(root["Lines/NumberOfCells"][0]),
            connectivity={name: len(root[f"{name}/Connectivity"]) for name in ("Lines", "Polygons")},
        )


def replace_summary(path: Path | str, summary: Summary) -> None:
    """Write another answer over that of a finished run. Raises ResultError."""
    with held_interrupt(), _writing(path), _staged(path, "r+") as file:
        _replace_text(file["softbrake"], "summary", json.dumps(asdict(summary)))


def belt_rows(shell: Shell, heights: list[float], generatrix: int) -> list[int]:
    """Row of nodes nearest to each belt's unloaded height [m]; `generatrix` is the number of cells."""
    return [round(shell.along(height) / shell.wall * generatrix) for height in heights]


def _lay_out(file: h5py.File, case: Case) -> None:
    """Write all that does not change with time, and the empty datasets that grow."""
    lines, polygons, part = _cells(case)
    points = (case.grid.generatrix + 1) * case.grid.hoop + _CORNERS
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = np.array([2, 0], np.int64)
    root.attrs["Type"] = np.bytes_("PolyData")  # VTK 9.3 and 9.4 refuse a str
    steps = root.create_group("Steps")  # before what depends on the grid: its counter and its times stay within one page
    steps.attrs["NSteps"] = 0
    _growing(steps, "Values", np.float64, (_BLOCK,), "s")
    root["NumberOfPoints"] = np.array([points], np.int64)
    for name, cells in (("Vertices", []), ("Lines", lines), ("Polygons", polygons), ("Strips", [])):
        _write_cells(root.create_group(name), cells)
    _growing(root, "Points", np.float32, (points, 3), "m")
    for name, field in POINT_FIELDS.items():
        _growing(root, f"PointData/{name}", np.float32, (points, *field.components), field.unit)
    root["CellData/part"] = part
    root["CellData/part"].attrs["legend"] = ", ".join(f"{value} {name}" for value, name in enumerate(PARTS))
    _growing(root, "CellData/pressure", np.float32, (len(part),), "Pa")
    folds = "folds" in case.contact and case.model.fidelity != "lumped"
    scalars = SCALARS | (GAS_SCALARS if case.gas is not None else {}) | (FOLD_SCALARS if folds else {})
    for name, unit in scalars.items():
        _growing(root, f"FieldData/{name}", np.float64, (_BLOCK,), unit)
    for name in _offsets(points, len(part), scalars):
        _growing(steps, name, np.int64, (_BLOCK, 4) if name in _FOR_EACH_CELL_KIND else (_BLOCK,))
    dtype = history_dtype(case)
    _growing(file, "history", dtype, (_BLOCK,))
    for name in dtype.names or ():
        file["history"].attrs[name] = History[name.upper()].unit


def _offsets(points: int, cells: int, scalars: Iterable[str]) -> dict[str, tuple[int, int]]:
    """Entries of the group Steps: value at the first step, increase at each step; `part` is the same at all steps."""
    entries = {"PartOffsets": (0, 0), "NumberOfParts": (1, 0), "PointOffsets": (0, points)}
    entries |= dict.fromkeys(_FOR_EACH_CELL_KIND, (0, 0))
    entries |= {f"PointDataOffsets/{name}": (0, points) for name in POINT_FIELDS}
    entries |= {"CellDataOffsets/part": (0, 0), "CellDataOffsets/pressure": (0, cells)}
    entries |= {f"FieldDataOffsets/{name}": (0, 1) for name in scalars}
    return entries


def _cells(case: Case) -> tuple[list[NDArray[np.int64]], list[NDArray[np.int64]], NDArray[np.int64]]:
    """Lines, polygons and their parts, in VTK's order; polygons face outwards and upwards."""
    n1, n2 = case.grid.generatrix, case.grid.hoop
    node = np.arange((n1 + 1) * n2).reshape(n1 + 1, n2)
    beside = np.roll(node, -1, axis=1)
    rows = belt_rows(case.shell, [belt.height for belt in case.belts], n1)
    lines = [np.append(node[row], node[row, 0]) for row in rows]
    quads = np.stack((node[:-1], beside[:-1], beside[1:], node[1:]), axis=-1).reshape(-1, 4)
    polygons = [*quads, node[0, ::-1], node[-1], node.size + np.arange(4)]
    part = np.repeat([BELT, SHELL_PART, LOWER_COVER, UPPER_COVER, GROUND], [len(lines), len(quads), 1, 1, 1])
    return lines, polygons, part


def _write_cells(group: h5py.Group, cells: list[NDArray[np.int64]]) -> None:
    connectivity = np.concatenate(cells) if cells else np.empty(0, np.int64)
    group["NumberOfCells"] = np.array([len(cells)], np.int64)
    group["NumberOfConnectivityIds"] = np.array([len(connectivity)], np.int64)
    group["Offsets"] = np.cumsum([0, *map(len, cells)], dtype=np.int64)
    # In chunks even where it is empty: h5repack 1.10 cannot copy an empty dataset of another layout.
    group.create_dataset("Connectivity", data=connectivity, maxshape=(None,), chunks=(max(len(connectivity), 1),))


def _ground_corners(xyz: Floats) -> Floats:
    """A square as wide as the shell (m), (4, 3), which thus sets the bounds; a little below zero, to let cloth on it show."""
    half = float(np.abs(xyz[..., :2]).max())
    z = -0.008 * half
    return np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])


def _growing(group: h5py.Group, name: str, dtype: Any, chunk: tuple[int, ...], unit: str = "") -> None:
    """An empty dataset that grows along its first axis; float32 ones by a chunk a snapshot, compressed.

    The others refill their last chunk, which uncompressed stays at its place: a kill in the middle of it does no harm.
    """
    rest = chunk[1:]
    filters = _COMPRESSED if dtype is np.float32 else {}
    dataset = group.create_dataset(name, (0, *rest), dtype, maxshape=(None, *rest), chunks=chunk, **filters)
    if unit:
        dataset.attrs["units"] = unit


def _append(dataset: h5py.Dataset, parts: list[NDArray[Any]]) -> None:
    rows = np.concatenate(parts, dtype=dataset.dtype)
    old = len(dataset)
    dataset.resize(old + len(rows), axis=0)
    dataset[old:] = rows


def _replace_text(group: h5py.Group, name: str, text: str) -> None:
    if name in group:
        del group[name]
    group[name] = text


def _pack(path: Path) -> None:
    """Compress the history of a finished file, whose rows were laid side by side for the sake of a kill; a large part of it."""
    with suppress(OSError), draft_of(path) as draft, h5py.File(path, "r", locking=False) as old, _staged(draft, "w") as new:
        for name in ("VTKHDF", "softbrake"):
            old.copy(name, new)
        rows = old["history"]
        chunk = max(min(len(rows), _PACKED_BLOCK), 1)
        packed = new.create_dataset("history", rows.shape, rows.dtype, maxshape=(None,), chunks=(chunk,), **_COMPRESSED)
        packed.attrs.update(rows.attrs)
        for first in range(0, len(rows), chunk):
            packed[first : first + chunk] = rows[first : first + chunk]


@contextmanager
def _staged(path: Path | str, mode: str) -> Iterator[h5py.File]:
    """Open a file to write to, all of it or nothing. Raises OSError at the end where it did not fit."""
    staged = StagedFile(path, mode)
    try:
        with h5py.File(staged, mode, locking=False) as file:
            yield file
    finally:
        staged.close()
    if staged.fault is not None:
        raise staged.fault


@contextmanager
def _writing(path: Path | str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ResultError(f"{path}: cannot be written: {_reason(error)}") from error


def _reason(error: OSError) -> str:
    return os.strerror(error.errno) if error.errno else str(error).splitlines()[0]


@contextmanager
def _of_this_version(path: Path | str) -> Iterator[None]:
    """Say so where an answer has not the fields that this version's has."""
    try:
        yield
    except (KeyError, TypeError) as error:
        raise ResultError(f"{path}: its answer is that of another version of softbrake; run the case again") from error


@contextmanager
def _open(path: Path | str) -> Iterator[h5py.File]:
    try:
        with h5py.File(path, "r", locking=False) as file:
            file["softbrake"]
            yield file
    except KeyError as error:
        raise ResultError(f"{path}: not a softbrake result file, or an incomplete one; {EXPECTED}") from error
    except (OSError, RuntimeError) as error:
        if isinstance(error, OSError) and error.errno:
            raise ResultError(f"{path}: cannot be read: {_reason(error)}; {EXPECTED}") from error
        fault = "truncated" if "truncated" in str(error) else "damaged, or not a result file"
        raise ResultError(f"{path}: cannot be read: {fault}; {EXPECTED}") from error
