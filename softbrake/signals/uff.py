"""UFF, datasets 58: functions at nodes, of which those over time are channels. pyuff reads and writes them.

What pyuff 2.5.8 passes over is refused here: a file that is cut off, fewer samples than a header says, uneven times that six
digits do not tell apart, and samples that are no numbers, which it writes as 0.0.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from softbrake.core.arrays import Floats
from softbrake.signals.channel import Channel, SignalError, check_units, fault_of, second_size, si_size

NONE = "NONE"  # a field without a value
GENERAL_OR_UNKNOWN, TIME_RESPONSE, TIME = 0, 1, 17  # of a function; of an axis
SI = 1  # code of dataset 164
UNITS = {8: "m", 9: "N", 11: "m/s", 12: "m/s^2", 13: "N", 15: "Pa", 16: "kg"}  # SI, of the data of an axis by type
TYPES = {"m": 8, "m/s": 11, "m/s^2": 12, "N": 9, "Pa": 15, "K": 5, "kg": 16}  # of others GENERAL
GENERAL = {"N/m": (-1, 1), "m^2": (2, 0), "m^3": (3, 0)}  # exponents of length and force
DIRECTIONS = {
    0: "",
    1: "+X",
    -1: "-X",
    2: "+Y",
    -2: "-Y",
    3: "+Z",
    -3: "-Z",
    4: "+RX",
    -4: "-RX",
    5: "+RY",
    -5: "-RY",
    6: "+RZ",
    -6: "-RZ",
}
FIELD, DIGITS = 20, 6  # characters of a label; digits of an abscissa in text, of its first value and increment always
LEAST = 10  # units of the last digit that uneven times are apart


def _pyuff(path: Path) -> ModuleType:
    try:
        import pyuff
    except ImportError:
        raise SignalError(f"{path}: UFF needs pyuff: pip install 'softbrake[test-data]'") from None
    return pyuff  # type: ignore[no-any-return]


def read(path: Path, units: Mapping[str, str], time: str | None) -> list[Channel]:
    """Read the functions over time as `read_channels` does."""
    pyuff = _pyuff(path)
    if time is not None:
        raise SignalError(f"{path}: datasets 58 have times of their own; no channel of times is expected")
    if not path.read_bytes().rstrip().endswith(b"-1"):
        raise SignalError(f"{path}: ends within a dataset, or is no UFF; a line '    -1' at the end is expected")
    file = pyuff.UFF(str(path))
    sets: dict[int, dict[str, Any]] = {}
    for k, kind in enumerate(file.get_set_types()):
        if kind in (58, 164):
            try:
                sets[k] = file.read_sets(k)
            except Exception:  # pyuff raises no other
                raise SignalError(
                    f"{path}: dataset {k + 1}: pyuff cannot read it; one of type {kind} by its format is expected"
                ) from None
    in_si = any(each["type"] == 164 and each["units_code"] == SI for each in sets.values())
    functions = {k: each for k, each in sets.items() if each["type"] == 58 and _over_time(each)}
    if not functions:
        raise SignalError(f"{path}: no function over time; a dataset 58 of type 1, time response, is expected")
    names = _names(functions)
    check_units(path, units, names.values())
    channels = []
    for k, name in names.items():
        each, place = functions[k], f"{path}: dataset {k + 1}, '{name}'"
        values = np.asarray(each["data"])
        if np.iscomplexobj(values):
            raise SignalError(f"{place}: samples are complex; real ones are expected")
        if len(values) != each["num_pts"] or len(values) < 2:
            raise SignalError(
                f"{place}: {len(values)} samples, {each['num_pts']} in its header; as many, two at least, are expected"
            )
        label = each["ordinate_axis_units_lab"]
        own = label if label not in (NONE, "") else UNITS.get(each["ordinate_spec_data_type"], "") if in_si else ""
        unit = units.get(name, own)
        values = values.astype(np.float64)
        channels.append(Channel(name, _times(place, each), values * si_size(unit), unit, fault=fault_of(place, values)))
    return channels


def _over_time(each: dict[str, Any]) -> bool:
    kind, axis = each["func_type"], each["abscissa_spec_data_type"]
    return bool(axis == TIME if kind == GENERAL_OR_UNKNOWN else kind == TIME_RESPONSE)


def _names(functions: Mapping[int, dict[str, Any]]) -> dict[int, str]:
    """The first line of each, or where it says nothing or is not the only one, node and direction, or its number besides."""
    firsts = [each["id1"].strip() for each in functions.values()]
    names: dict[int, str] = {}
    for (k, each), first in zip(functions.items(), firsts, strict=True):
        name = first
        if first in (NONE, "") or firsts.count(first) > 1:
            name = f"{each['rsp_node']}{DIRECTIONS.get(each['rsp_dir'], '')}"
        names[k] = name if name not in names.values() else f"{name} ({k + 1})"
    return names


def _times(place: str, each: dict[str, Any]) -> Floats:
    times = np.asarray(each["x"], np.float64)
    label = each["abscissa_axis_units_lab"]
    try:
        size = second_size(label) if label not in (NONE, "") else 1.0
    except ValueError as error:
        raise SignalError(f"{place}: unit of the times: {error}; a unit of time is expected") from None
    if not np.isfinite(times).all():
        raise SignalError(f"{place}: a time is no number; a time at each sample is expected")
    apart = np.diff(times)
    if (late := np.flatnonzero(apart <= 0.0)).size:
        k = int(late[0]) + 1
        raise SignalError(
            f"{place}: time {times[k]:g} of sample {k + 1} is not after {times[k - 1]:g}; times that rise are expected"
        )
    if not each["abscissa_spacing"] and not each["binary"]:
        last = 10.0 ** (np.floor(np.log10(np.maximum(np.abs(times[1:]), np.abs(times[:-1])))) - (DIGITS - 1))
        if (near := np.flatnonzero(apart < (LEAST - 0.5) * last)).size:
            k = int(near[0]) + 1
            fault = f"times {times[k - 1]:g} and {times[k]:g} are {apart[k - 1]:.2g} apart and have {DIGITS} digits"
            raise SignalError(f"{place}: {fault}; {LEAST} units of the last digit, even times or a binary dataset are expected")
    return times * size


def write(path: Path, title: str, channels: Iterable[Channel]) -> None:
    """Write channels of SI units at even times as binary datasets 58, behind one of units. Samples keep all digits.

    First time and interval keep six digits: raises SignalError where that is too few. Raises OSError.
    """
    pyuff = _pyuff(path)
    path.unlink(missing_ok=True)
    file = pyuff.UFF(str(path))
    sets: list[dict[str, Any]] = [{"type": 164, "units_code": SI, "units_description": "SI", "temp_mode": 1}]
    sets[0] |= {"length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 0.0}
    for k, each in enumerate(channels, 1):
        first, interval = (float(f"{number:.{DIGITS - 1}e}") for number in (each.time[0], each.time[1] - each.time[0]))
        if np.abs(first + interval * np.arange(len(each.time)) - each.time).max() > 1e-6 * interval:
            raise SignalError(f"{path}: '{each.name}': its times need more than {DIGITS} digits; fewer are expected")
        if not np.isfinite(each.values).all():
            raise SignalError(f"{path}: '{each.name}': samples that are no numbers; pyuff would write 0.0")
        length, force = GENERAL.get(each.unit, (0, 0))
        axis = {"abscissa_spacing": 1, "abscissa_spec_data_type": TIME, "abscissa_axis_units_lab": "s", "x": each.time}
        unit = {"ordinate_spec_data_type": TYPES.get(each.unit, 1), "ordinate_axis_units_lab": each.unit[:FIELD]}
        unit |= {"ordinate_len_unit_exp": length, "ordinate_force_unit_exp": force, "orddenom_spec_data_type": 0}
        node = {"rsp_node": k, "rsp_dir": 0, "ref_node": 0, "ref_dir": 0}  # no entities: their names would move the nodes
        about = {"type": 58, "binary": 1, "func_type": TIME_RESPONSE, "id1": each.name[:80], "id2": title[:80] or NONE}
        sets.append(about | node | axis | unit | {"data": each.values})
    file.write_sets(sets, "add")  # "overwrite" of pyuff 2.5.8 keeps nothing of a binary set
