"""Which cases a sweep asks for: axes over keys of a case, combined or sampled. All are checked before the first one runs."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

from softbrake.case.case import Case, key_at
from softbrake.case.case_file import CaseError, CaseFile
from softbrake.case.checker import Checker
from softbrake.case.keys import Key
from softbrake.case.level import level
from softbrake.case.overrides import Override
from softbrake.case.sections.limits import LIMITS
from softbrake.case.sections.sweep import SWEEP
from softbrake.case.units import POINT, Dimension, unit_of, unit_size
from softbrake.case.yaml_nodes import Node, Place, join, parse
from softbrake.studies.distributions import TABLE, Distribution, distribution_of, read_table
from softbrake.studies.sampling import NESTED, SAMPLED, Sampling

MOST_RUNS = 1_000_000
FIRST_SAMPLES = 64  # of a sweep that goes on until it knows enough
FAULTS_SHOWN = 20
LEAST_CONTROLLED = 8  # samples, of which each coefficient is that of all but one
_RANGE_END = re.compile(r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*(.*?)\s*")
_PLAIN = re.compile(r"-?[0-9.]+(e[-+]?[0-9]+)?")
_NUMBER = re.compile(r"[0-9]+(e\+?[0-9]+)?")
_RANGE = "START:STOP:COUNT or START:STOP:COUNT:log"
FIDELITY = "model.fidelity"
_SPAN = "START:STOP or START:STOP:log"


class Axis(NamedTuple):
    """A key that a sweep varies."""

    path: str
    unit: str  # SI; empty for ratios, integers and words
    log: bool = False  # spaced so, and drawn so
    asked: str = ""  # unit in which its values were asked for; empty where they were in none, or in several
    size: float = 1.0  # SI, of that unit

    @property
    def shown(self) -> str:
        """The unit for people."""
        return self.asked or self.unit

    def written(self, value: float | str) -> str:
        """A value in the unit for people."""
        return f"{value / self.size:.6g}" if isinstance(value, float) else str(value)


class Design(NamedTuple):
    """One case of a sweep."""

    values: tuple[float | str, ...]  # of the axes, in their units
    case: Case


@dataclass(frozen=True)
class Designs:
    """All cases of a sweep, in the order in which they run."""

    axes: tuple[Axis, ...]
    all: tuple[Design, ...]
    sampling: Sampling | None = None  # of a sampled sweep


@dataclass(frozen=True)
class _Values:
    """What an axis was given: a list, a range or a distribution."""

    path: str
    place: Place
    texts: tuple[str, ...] = ()
    start: float = 0.0
    stop: float = 0.0
    unit: str = ""
    count: int = 0  # 0: without one, to be sampled
    log: bool = False
    distribution: Distribution | None = None
    joint: str = ""  # the table of which its texts are a column

    @property
    def input(self) -> str:
        """What varies by itself: the key, or the table."""
        return self.joint or self.path

    def at(self, share: float) -> str:
        """The value at a part, 0 to 1, of the way through."""
        if self.distribution is not None:
            return repr(self.distribution.at(share))
        if self.texts:
            return self.texts[min(int(share * len(self.texts)), len(self.texts) - 1)]
        number = self.start * (self.stop / self.start) ** share if self.log else self.start + share * (self.stop - self.start)
        key = key_of(self.path)
        if self.count == 0 and key is not None and key.kind is int:
            number = round(number)
        return f"{number:.12g} {self.unit}".rstrip()

    def all(self) -> list[str]:
        """The values one after the other."""
        return list(self.texts) or [self.at(k / max(self.count - 1, 1)) for k in range(self.count)]


def designs_of(file: CaseFile, vary: Sequence[str] = (), settings: Mapping[str, Any] | None = None) -> Designs:
    """Every case that a case file asks for in its section `sweep`, checked.

    vary: texts such as `fabric.E=10kN/m:30kN/m:200`, instead of the axes of the file. settings: other keys of the section, in
    place of those of the file.
    Raises CaseError with the faults of all cases.
    """
    check = Checker()
    node, section = _section(file, settings or {}, check)
    axes = {} if node is None or vary else _axes_of_file(node, Path(file.name).parent, check)
    for index, option in enumerate(vary):
        place = Place((1, index, 0), f"--vary {option}")
        for path_varied, values in _axis_of_option(option, place, check).items():
            if path_varied in axes:
                check.fault(place, path_varied, "given twice", "all its values in one list or range are expected")
            axes[path_varied] = values
    asked = (settings or {}).get("mode") is not None
    place = Place((1, 0, 0), f"--mode {section.get('mode', 'grid')}") if node is None or asked else node.key
    for path_varied, values in axes.items():
        if path_varied.split(".")[0] == LIMITS.name:
            check.fault(values.place, path_varied, "no input of the drop", "limits are held against the answers of one sweep")
    combinations, sampling = ([], None) if check.faults else _combine(list(axes.values()), section, place, check)
    if sampling is not None and sampling.control:
        _check_control(file, sampling.control, axes, place, check)
    if check.faults:
        raise CaseError(check.messages())
    if not axes:
        return Designs((), (Design((), file.case),))
    faults: dict[str, None] = {}
    designs = []
    for combination in combinations:
        changes = [Override(f"{axis.path}={value}", axis.place) for axis, value in zip(axes.values(), combination, strict=True)]
        try:
            case = file.set(changes).case
            designs.append(Design(tuple(map(_si, axes, combination)), case))
        except CaseError as error:
            told = ", ".join(change.text for change in changes)
            named = (fault if any(axis in fault for axis in axes) else f"{fault}, with {told}" for fault in error.faults)
            faults |= dict.fromkeys(named)
    if faults:
        shown = list(faults)[:FAULTS_SHOWN]
        raise CaseError(shown + ([f"... and {len(faults) - len(shown)} faults more"] if len(faults) > len(shown) else []))
    if sampling is not None and sampling.control:
        return _controlled(tuple(map(_axis, axes.values())), designs, sampling)
    return Designs(tuple(map(_axis, axes.values())), tuple(designs), sampling)


def growing(file: CaseFile, vary: Sequence[str], settings: Mapping[str, Any]) -> Iterator[tuple[Designs, float | None]]:
    """Yield the cases of a sweep, or with `until` those of ever more samples, each with what `until` asks for.

    Arguments and errors: as of `designs_of`.
    """
    check = Checker()
    section = _section(file, settings, check)[1]
    until = section.get("until")
    bounding = section if settings.get("until") is None else settings  # samples of the file bound an accuracy of the file
    most = section["samples"] if bounding.get("samples") is not None else MOST_RUNS
    if until is None or check.faults:
        yield designs_of(file, vary, settings), None
        return
    samples = min(FIRST_SAMPLES, most)
    while True:
        yield designs_of(file, vary, {**settings, "samples": samples}), until
        if samples == most:
            return
        samples = min(2 * samples, most)


def _section(file: CaseFile, settings: Mapping[str, Any], check: Checker) -> tuple[Node | None, dict[str, Any]]:
    """The section of a file and the values of its keys, or of the settings instead."""
    assert isinstance(file.written.value, dict)
    node = file.written.value.get(SWEEP.name)
    section = {} if node is None else check.mapping(node, SWEEP.name, SWEEP.keys, others=("vary",))
    for key in SWEEP.keys:
        if (value := settings.get(key.name)) is not None:
            place = Place((1, 0, 0), f"--{key.name.replace('_', '-')} {value}")
            section[key.name] = check.value(Node(value, place, place), "", key)
    return node, section


def key_of(path: str) -> Key | None:
    """The key of one value at a dotted path, which may be an item of a list; None where there is none."""
    key = key_at(path)
    return None if key is None or key.many else key


def _axis(values: _Values) -> Axis:
    """The axis of values that are without faults."""
    key, units = key_of(values.path), {unit_of(text) for text in values.texts} or {unit_of(f"0 {values.unit}")}
    if key is None or not isinstance(key.kind, Dimension):
        return Axis(values.path, "", values.log)
    asked = units.pop() if len(units) == 1 else ""
    return Axis(values.path, key.kind.unit, values.log, asked, unit_size(asked, key.kind) if asked else 1.0)


def _si(path: str, text: str) -> float | str:
    """Value of an axis in its unit, as a case that was checked has it."""
    key = key_of(path)
    if key is not None and isinstance(key.kind, Dimension) and _PLAIN.fullmatch(text):
        return float(text)
    node = parse(text, lambda *_: Place((0, 0, 0), ""), lambda *_: None)
    return text if key is None or node is None else key.convert(node.value)


def _axes_of_file(node: Node, folder: Path, check: Checker) -> dict[str, _Values]:
    members = node.value if isinstance(node.value, dict) else {}
    vary = members.get("vary")
    if vary is None or not isinstance(vary.value, dict):
        place = node.place if vary is None else vary.place
        fault = "missing" if vary is None else "not a mapping"
        check.fault(place, "sweep.vary", fault, "keys with values such as 'fabric.E: 10 kN/m:30 kN/m:200' are expected")
        return {}
    axes: dict[str, _Values] = {}
    for path, item in vary.value.items():
        where = join("sweep.vary", path)
        if path == TABLE:
            _add_table(axes, Path(folder, _text(item, where, check)), item.place, where, check)
        elif isinstance(item.value, list):
            texts = tuple(_text(value, join(where, number), check) for number, value in enumerate(item.value))
            if not texts:
                check.fault(item.place, where, "an empty list", "values are expected")
            axes[path] = _Values(path, item.place, texts)
        else:
            axes[path] = _values(path, _text(item, where, check), item.place, where, check)
    return axes


def _text(node: Node, where: str, check: Checker) -> str:
    """A scalar as an override writes it."""
    if node.value is None or isinstance(node.value, (list, dict)):
        check.fault(node.place, where, "no value" if node.value is None else "not one value", "a value or a range is expected")
        return ""
    return str(node.value).lower() if isinstance(node.value, bool) else str(node.value)


def _axis_of_option(option: str, place: Place, check: Checker) -> dict[str, _Values]:
    path, equals, text = (part.strip() for part in option.partition("="))
    if not equals or not path or not text:
        check.fault(place, "", "not KEY=VALUES", "a key and values such as 'fabric.E=15kN/m,20kN/m' are expected")
        return {}
    if path == TABLE:
        axes: dict[str, _Values] = {}
        _add_table(axes, Path(text), place, path, check)
        return axes
    return {path: _values(path, text, place, path, check)}


def _add_table(axes: dict[str, _Values], file: Path, place: Place, where: str, check: Checker) -> None:
    """Add an axis for each column of a table of joint samples."""
    try:
        columns = read_table(file)
    except ValueError as error:
        check.fault(place, where, *str(error).rsplit("; ", 1))
        return
    for path, texts in columns.items():
        key = key_of(path)
        for row, text in enumerate(texts if key is not None else (), 2):
            try:
                key.convert(text)  # type: ignore[union-attr]
            except ValueError as error:
                check.fault(place, path, f"{file.name}, row {row}: {error}", f"{key.expected} is expected")  # type: ignore[union-attr]
                break
        if path in axes:
            check.fault(place, path, f"given besides {file.name}", "all its values in one place are expected")
        axes[path] = _Values(path, place, texts, joint=file.name)


def _values(path: str, text: str, place: Place, where: str, check: Checker) -> _Values:
    """Values between commas, or a range with its ends and number between colons."""
    nothing = _Values(path, place)
    try:
        if (found := distribution_of(text, key_of(path))) is not None:
            return replace(nothing, distribution=found[0], unit=found[1])
    except ValueError as error:
        check.fault(place, where, *str(error).split("; ", 1))
        return nothing
    if ":" not in text:
        texts = tuple(part.strip() for part in text.split(","))
        if not all(texts):
            check.fault(place, where, "an empty value", "values such as '15kN/m,20kN/m' are expected")
        return replace(nothing, texts=texts)
    start, stop, *others = (part.strip() for part in text.split(":"))
    log = others[-1:] == ["log"]
    counts = others[:-1] if log else others
    ends = [_RANGE_END.fullmatch(end) for end in (start, stop)]
    if len(counts) == 1 and _NUMBER.fullmatch(counts[0]) and float(counts[0]) > MOST_RUNS:
        check.fault(place, where, f"{counts[0]} values", f"up to {MOST_RUNS} are expected; mode: lhs samples")
        return nothing
    if len(counts) > 1 or any(not count.isdecimal() or int(count) < 2 for count in counts):
        check.fault(place, where, f"'{text}' is not a range", f"{_RANGE} with 2 values or more, to sample {_SPAN}, is expected")
        return nothing
    if ends[0] is None or ends[1] is None:
        fault = f"'{start if ends[0] is None else stop}' is not a number with a unit"
        check.fault(place, where, fault, f"{_RANGE}, to sample {_SPAN}, is expected")
        return nothing
    units = [end[2] for end in ends if end is not None]
    first, last = float(ends[0][1]), float(ends[1][1])
    if any(unit.startswith(",") for unit in units):
        check.fault(place, where, f"'{text}' has a comma", POINT)
    elif units[0] not in ("", units[1]):
        check.fault(place, where, f"ends in '{units[0]}' and '{units[1]}'", "one unit for both is expected")
    elif not (math.isfinite(first) and math.isfinite(last)) or (log and (first <= 0 or last <= 0)):
        check.fault(place, where, f"from {first:g} to {last:g}", "ends > 0 are expected of a logarithmic range")
    return replace(nothing, start=first, stop=last, unit=units[1], count=int(counts[0]) if counts else 0, log=log)


Combined = tuple[Iterable[tuple[str, ...]], Sampling | None]  # values of the axes for each run


def _combine(axes: Sequence[_Values], section: Mapping[str, Any], place: Place, check: Checker) -> Combined:
    """Values of the axes for each run, as the mode of the sweep asks."""
    mode = section.get("mode", "grid")
    if mode in SAMPLED:
        return _sampled(axes, section, place, check)
    for name in ("samples", "until", "control", "control_samples"):
        if name in section:
            modes = NESTED if name == "until" else ("random",) if name.startswith("control") else SAMPLED
            check.fault(place, f"sweep.{name}", f"given in mode {mode}", f"mode: {' or '.join(modes)}, or no {name}, is expected")
    for axis in axes:
        if axis.distribution is not None:
            check.fault(axis.place, axis.path, f"a distribution in mode {mode}", f"mode: {', '.join(SAMPLED)} are expected")
        elif axis.joint and mode == "grid":
            check.fault(axis.place, axis.path, "joint samples in mode grid", f"mode: zip, {', '.join(SAMPLED)} are expected")
        elif not axis.texts and not axis.count:
            check.fault(axis.place, axis.path, f"a range without a count in mode {mode}", f"{_RANGE} is expected")
    if check.faults:
        return [], None
    columns = [axis.all() for axis in axes]
    if mode == "zip":
        if len({len(column) for column in columns}) > 1:
            numbers = ", ".join(f"{axis.path} {len(column)}" for axis, column in zip(axes, columns, strict=True))
            check.fault(axes[-1].place, "", f"numbers of values differ: {numbers}", "as many of each are expected in mode zip")
            return [], None
        return list(zip(*columns, strict=True)), None
    runs = math.prod(map(len, columns))
    if runs > MOST_RUNS:
        check.fault(axes[-1].place, "", f"{runs} runs", f"up to {MOST_RUNS} are expected; mode: lhs samples")
        return [], None
    return product(*columns), None


def _sampled(axes: Sequence[_Values], section: Mapping[str, Any], place: Place, check: Checker) -> Combined:
    """Values of the axes at the places of a sample."""
    mode, samples, control = section["mode"], section.get("samples"), section.get("control", "")
    if samples is None:
        check.fault(place, "sweep.samples", "missing", f"samples: 100, or --samples 100, is expected for mode {mode}")
        samples = 1
    for axis in axes:
        if axis.count:
            check.fault(
                axis.place, axis.path, f"a range with a count in mode {mode}", f"{_SPAN} is expected, samples say how many"
            )
    if "until" in section and mode not in NESTED:
        check.fault(place, "sweep.until", f"given in mode {mode}", f"mode: {' or '.join(NESTED)} is expected, where samples grow")
    if "until" in section and control:
        check.fault(place, "sweep.until", "given with a control", "one of both is expected")
    if control and samples < LEAST_CONTROLLED:
        check.fault(place, "sweep.samples", f"{samples} with a control", f"{LEAST_CONTROLLED} or more are expected")
    if control and mode != "random":
        check.fault(place, "sweep.control", f"given in mode {mode}", "mode: random is expected, whose samples are independent")
    if bool(control) != ("control_samples" in section):
        check.fault(place, "sweep.control", "of control and control_samples one is missing", "both are expected")
    inputs = tuple(dict.fromkeys(axis.input for axis in axes))
    sampling = Sampling(mode, samples, section.get("seed", 0), inputs, control, section.get("control_samples", 0))
    runs = samples * (len(inputs) + 2) if mode == "saltelli" else samples + sampling.control_samples
    if runs > MOST_RUNS:
        check.fault(place, "sweep.samples", f"{runs} runs", f"up to {MOST_RUNS} are expected")
    if check.faults:
        return [], None
    index = [inputs.index(axis.input) for axis in axes]
    try:
        points = list(sampling.points())
    except ImportError:
        check.fault(place, "sweep.mode", f"{mode} needs scipy, which is not there", "pip install 'softbrake[chance]'")
        return [], None
    return [tuple(axis.at(point[k]) for axis, k in zip(axes, index, strict=True)) for point in points], sampling


def _check_control(file: CaseFile, control: str, axes: Mapping[str, _Values], place: Place, check: Checker) -> None:
    """Tell where a fidelity cannot stand beside that of a case, or the case not be at that level."""
    case = file.case
    own, order = case.model.fidelity, ("lumped", "axisymmetric", "full")
    if case.tolerance is not None:
        check.fault(place, "sweep.control", "the case chooses its model", "model.fidelity: axisymmetric or full is expected")
    elif own not in order[order.index(control) + 1 :]:
        check.fault(place, "sweep.control", f"{control} is no cheaper than {own}", "a level below that of the case is expected")
    if not check.faults:
        bare = file.set(["limits={}"]) if case.limits else file  # which a lumped case need not have answers to
        try:
            bare.set([f"{FIDELITY}={control}"])
        except CaseError as error:
            check.fault(place, "sweep.control", f"not {control}: {error.faults[0]}", "another level is expected")
    if FIDELITY in axes:
        check.fault(axes[FIDELITY].place, FIDELITY, "varied besides control", "one of both is expected")


def _controlled(axes: tuple[Axis, ...], designs: Sequence[Design], sampling: Sampling) -> Designs:
    """The first designs at their own fidelity, then all at the control's, with the fidelity as one more axis."""
    own = [Design((*one.values, one.case.model.fidelity), one.case) for one in designs[: sampling.samples]]
    below = [Design((*one.values, sampling.control), _at_level(one.case, sampling.control)) for one in designs]
    return Designs((*axes, Axis(FIDELITY, "")), (*own, *below), sampling)


def _at_level(case: Case, fidelity: str) -> Case:
    return level(case, fidelity, case.grid.generatrix, case.grid.hoop)  # type: ignore[arg-type]
