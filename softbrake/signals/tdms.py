"""TDMS of National Instruments, through npTDMS: waveforms with an increment, or channels beside one of times."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from softbrake.core.arrays import Floats
from softbrake.signals.channel import Channel, SignalError, check_units, even_times, fault_of, listed, second_size, si_size

UNITS = ("unit_string", "NI_UnitDescription", "Unit")  # properties that name it


def read(path: Path, units: Mapping[str, str], time: str | None) -> list[Channel]:
    """Read the numeric channels as `read_channels` does."""
    try:
        import nptdms
    except ImportError:
        raise SignalError(f"{path}: TDMS needs npTDMS: pip install 'softbrake[test-data]'") from None
    try:
        file = nptdms.TdmsFile.read(str(path))
    except OSError:
        raise
    except Exception as error:  # of the segments that it found no sense in, of many kinds
        raise SignalError(f"{path}: npTDMS cannot read it: {error}; a file of TDMS is expected") from None
    if file.file_status.incomplete_final_segment:
        raise SignalError(f"{path}: ends within a segment, so samples are missing; a whole file is expected")
    found = [each for group in file.groups() for each in group.channels()]
    short = [each.name for each in found]
    named = {each.name if short.count(each.name) == 1 else f"{each.group_name}/{each.name}": each for each in found}
    named = {name: each for name, each in named.items() if np.asarray(each[:0]).dtype.kind in "iuf"}
    if not named:
        raise SignalError(f"{path}: no channel of numbers; one at least is expected")
    check_units(path, units, named)
    clock = None
    if time is not None:
        if time not in named:
            raise SignalError(f"{path}: no channel '{time}' for the times; {listed(named)} are expected")
        clock = _clock(path, time, named[time], units)
    channels = []
    for name, each in named.items():
        if name == time:
            continue
        values = np.asarray(each[:], np.float64)
        place = f"{path}: '{name}'"
        if clock is not None and len(clock) != len(values):
            raise SignalError(f"{place}: {len(values)} samples at {len(clock)} times of '{time}'; as many are expected")
        unit = units.get(name, _unit(each))
        times = clock if clock is not None else _waveform(place, each, len(values))
        fault = fault_of(place, values) if len(values) > 1 else f"{place}: {len(values)} samples; two at least are expected"
        channels.append(Channel(name, times, values * si_size(unit), unit, fault=fault))
    return channels


def _unit(each: Any) -> str:
    return next((str(each.properties[key]).strip() for key in UNITS if each.properties.get(key)), "")


def _waveform(place: str, each: Any, count: int) -> Floats:
    """Times (s) of a waveform: an offset, and an increment a sample."""
    interval, first = each.properties.get("wf_increment"), each.properties.get("wf_start_offset", 0.0)
    if interval is None:
        raise SignalError(f"{place}: no wf_increment; an increment, or the name of a channel of times, is expected")
    try:
        size = second_size(each.properties.get("wf_xunit_string") or "s")
    except ValueError as error:
        raise SignalError(f"{place}: wf_xunit_string: {error}; a unit of time is expected") from None
    return even_times(place, "wf_increment", first * size, interval * size, count)


def _clock(path: Path, name: str, each: Any, units: Mapping[str, str]) -> Floats:
    """Times (s) of a channel of times."""
    times = np.asarray(each[:], np.float64)
    place = f"{path}: '{name}'"
    if not np.isfinite(times).all():
        raise SignalError(f"{place}: a time is no number; a time at each sample is expected")
    if (late := np.flatnonzero(np.diff(times) <= 0.0)).size:
        k = int(late[0]) + 1
        raise SignalError(
            f"{place}: time {times[k]:g} of sample {k + 1} is not after {times[k - 1]:g}; times that rise are expected"
        )
    unit = units.get(name, _unit(each))
    try:
        if not unit:
            raise ValueError("no unit")
        return times * second_size(unit)
    except ValueError as error:
        raise SignalError(f"{place}: {error}; a unit of time in {UNITS[0]}, or given for it, is expected") from None
