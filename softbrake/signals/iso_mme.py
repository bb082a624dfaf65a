"""ISO-MME (ISO/TS 13499): a test is TEST.mme and Channel/ with a list TEST.chn and TEST.001, TEST.002 ..., a channel each.

Each file is lines `key :value`, behind them in that of a channel a number a line. Times are `implicit`, of a first sample and an
interval, or `explicit`, of a reference channel. Codes, classes and keys are those of RED A 1.6.2, the related electronic document
of the standard.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from softbrake.core.arrays import Floats
from softbrake.signals.channel import Channel, SignalError, check_units, even_times, lines_of, second_size, si_size

# Classes of SAE J211 by the last character of a code; others are unfiltered or of filters that are no class.
CLASSES = dict(zip("ABCDEFGHL", (1000, 600, 180, 60, 1000, 600, 180, 60, 20), strict=True))
NO_VALUE = "NOVALUE"
EXPECTED = "a test of ISO-MME is expected: TEST.mme, and Channel/ beside it with TEST.chn, TEST.001 ..."
_LINE = re.compile(r"([^:]*[^:\s])\s*:(.*)")


class _File(NamedTuple):
    """A file of a channel."""

    path: Path
    keys: dict[str, str]  # in lower case, without those of no value
    texts: list[str]  # of the samples
    first: int  # line of the first sample, from 1

    @property
    def code(self) -> str:
        return self.keys.get("channel code", "")

    @property
    def name(self) -> str:
        return self.keys.get("name of the channel", self.code)


def read(path: Path, units: Mapping[str, str], time: str | None) -> list[Channel]:
    """Read a test as `read_channels` does; of a channel file that channel alone."""
    if time is not None:
        raise SignalError(f"{path}: channels of ISO-MME say their times themselves; no channel of times is expected")
    files = [_file(each) for each in _channel_files(path)]
    check_units(path, units, [name for each in files for name in (each.name, each.code)])
    clocks = {each.keys["reference channel name"] for each in files if _explicit(each)}
    asked = [path] if re.fullmatch(r"\.[0-9]{3,}", path.suffix) else [each.path for each in files]
    channels = []
    for each in files:
        if each.path not in asked or each.code in clocks or each.code[2:6] == "TIRS":
            continue
        unit = units.get(each.name, units.get(each.code, each.keys.get("unit", "")))
        values, fault = _samples(each)
        times = _times(each, files)
        channels.append(Channel(each.name, times, values * si_size(unit), unit, each.code, CLASSES.get(each.code[15:]), fault))
    return channels


def _channel_files(path: Path) -> list[Path]:
    """The files of all channels of a test, as its list has them."""
    if path.suffix.lower() == ".mme" and not path.is_dir():
        folder, test = path.parent, path
        path.stat()
    else:
        folder = path if path.is_dir() else path.parent.parent
        tests = sorted(each for each in folder.iterdir() if each.suffix.lower() == ".mme")
        if len(tests) != 1:
            raise SignalError(f"{path}: {len(tests) or 'no'} files *.mme in {folder}; {EXPECTED}")
        test = tests[0]
    places = [each for each in folder.iterdir() if each.name.lower() == "channel" and each.is_dir()]
    inside = {each.name.lower(): each for each in places[0].iterdir()} if places else {}
    stem = test.stem.lower()
    if f"{stem}.chn" not in inside:
        raise SignalError(f"{test}: no Channel/{test.stem}.chn beside it; {EXPECTED}")
    keys = _header(inside[f"{stem}.chn"])[0]
    numbers = [match[1] for key in keys if (match := re.fullmatch(r"name of channel\s+([0-9]+)", key))]
    if missing := [number for number in numbers if f"{stem}.{number}" not in inside]:
        expected = f"a file {test.stem}.{missing[0]} beside it is expected"
        raise SignalError(f"{inside[f'{stem}.chn']}: lists channel {missing[0]}; {expected}")
    if not numbers:
        raise SignalError(f"{inside[f'{stem}.chn']}: lists no channel; 'Name of channel 001' is expected")
    return [inside[f"{stem}.{number}"] for number in numbers]


def _header(path: Path) -> tuple[dict[str, str], list[str], int]:
    """Values of a file by their keys in lower case, the first of each; the lines behind; the number of lines before."""
    lines = lines_of(path.read_bytes())
    keys: dict[str, str] = {}
    for k, line in enumerate(lines):
        match = _LINE.fullmatch(line.strip())
        if match is None and line.strip():
            return keys, lines[k:], k
        if match is not None and match[2].strip() not in ("", NO_VALUE):
            keys.setdefault(match[1].lower(), match[2].strip())
    return keys, [], len(lines)


def _file(path: Path) -> _File:
    keys, lines, before = _header(path)
    texts = [line.strip() for line in lines]
    while texts and not texts[-1]:
        texts.pop()
    file = _File(path, keys, texts, before + 1)
    if not file.name:
        raise SignalError(f"{path}: no name and no code; 'Channel code' is expected")
    if (said := keys.get("number of samples")) is not None and said != str(len(texts)):
        raise SignalError(f"{path}: '{file.name}': {len(texts)} samples, {said} in 'Number of samples'; as many are expected")
    if len(texts) < 2:
        raise SignalError(f"{path}: '{file.name}': {len(texts)} samples; two at least are expected")
    return file


def _samples(file: _File) -> tuple[Floats, str | None]:
    """Numbers, nan where there are none, and what that forbids."""
    values, fault = np.full(len(file.texts), np.nan), None
    for k, text in enumerate(file.texts):
        try:
            values[k] = float(text) if text != NO_VALUE else np.nan
        except ValueError:
            raise SignalError(
                f"{file.path}:{file.first + k}:1: '{file.name}': '{text}' is no number; a sample is expected"
            ) from None
        if fault is None and not np.isfinite(values[k]):
            fault = (
                f"{file.path}:{file.first + k}:1: '{file.name}': sample {k + 1} is {text}; a number at each sample is expected"
            )
    return values, fault


def _explicit(file: _File) -> bool:
    return file.keys.get("reference channel", "").lower() == "explicit" and "reference channel name" in file.keys


def _times(file: _File, files: list[_File]) -> Floats:
    """Times (s) of the samples of a channel."""
    if file.keys.get("reference channel", "implicit").lower() == "implicit":
        first, interval = (_number(file, key) for key in ("Time of first sample", "Sampling interval"))
        return even_times(f"{file.path}: '{file.name}'", "'Sampling interval'", first, interval, len(file.texts))
    reference = file.keys.get("reference channel name", "")
    named = [each for each in files if reference and reference in (each.code, each.name)]
    if not _explicit(file) or len(named) != 1:
        fault = f"its times are channel '{reference}', of which there are {len(named)}" if reference else "its times are not said"
        expected = (
            "'Reference channel' implicit, or explicit with the code of one channel in 'Reference channel name', is expected"
        )
        raise SignalError(f"{file.path}: '{file.name}': {fault}; {expected}")
    clock = named[0]
    times, no_time = _samples(clock)
    if no_time is not None:
        raise SignalError(no_time)
    if len(times) != len(file.texts):
        fault = f"{len(file.texts)} samples at {len(times)} times of '{clock.name}'"
        raise SignalError(f"{file.path}: '{file.name}': {fault}; as many are expected")
    if (late := np.flatnonzero(np.diff(times) <= 0.0)).size:
        k = int(late[0]) + 1
        fault = f"time {clock.texts[k]} is not after {clock.texts[k - 1]} of the sample before"
        raise SignalError(f"{clock.path}:{clock.first + k}:1: '{clock.name}': {fault}; times that rise are expected")
    try:
        return times * second_size(clock.keys.get("unit", "s"))
    except ValueError as error:
        raise SignalError(f"{clock.path}: '{clock.name}': {error}; a unit of time is expected") from None


def _number(file: _File, key: str) -> float:
    text = file.keys.get(key.lower())
    try:
        number = float(text or "")
    except ValueError:
        number = np.nan
    if not np.isfinite(number):
        fault = f"'{key}' is '{text}'" if text else f"no '{key}'"
        raise SignalError(f"{file.path}: '{file.name}': {fault}; a number of seconds is expected")
    return number


def files(test: str, title: str, channels: Iterable[Channel], interval: float) -> dict[str, str]:
    """Return the files of a test by their names: TEST.mme, Channel/TEST.chn, Channel/TEST.001 ...

    channels: of SI units, with codes, at even times an interval (s) apart. Numbers have all their digits.
    """
    channels = list(channels)
    names = {f"{k:03}": each for k, each in enumerate(channels, 1)}
    heads: dict[str, dict[str, object]] = {
        f"{test}.mme": {
            "Data format edition number": "1.6",
            "Laboratory name": "softbrake",
            "Title": title or NO_VALUE,
            "Type of the test": "computed drop",
        },
        f"Channel/{test}.chn": {"Number of channels": len(channels)}
        | {f"Name of channel {number}": f"{each.code} / {each.name}" for number, each in names.items()},
    }
    texts = {name: _text(keys) for name, keys in heads.items()}
    for number, each in names.items():
        keys = {
            "Name of the channel": each.name,
            "Channel code": each.code,
            "Unit": each.unit,
            "Reference channel": "implicit",
            "Time of first sample": float(each.time[0]),
            "Sampling interval": interval,
            "Number of samples": len(each.values),
        }
        texts[f"Channel/{test}.{number}"] = _text(keys) + "".join(f"{value!r}\n" for value in each.values.tolist())
    return texts


def _text(keys: Mapping[str, object]) -> str:
    return "".join(f"{key:<28}:{value}\n" for key, value in keys.items())
