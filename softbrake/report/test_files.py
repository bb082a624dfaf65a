"""What a test would measure of a drop, as files of test data: ISO-MME and UFF 58."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np

from softbrake.core.columns import History
from softbrake.signals import Channel, iso_mme, uff
from softbrake.sim.files import draft_of
from softbrake.sim.filters import integral
from softbrake.sim.result_file import Result, ResultError, read_result

RATE = 10_000  # samples per second
# Codes of ISO/TS 13499: test rig; its platform, airbag or ground; dimension, 1 one of our own; 3 is up, against the sign of
# SAE J211; unfiltered.
CODES = {
    History.HEIGHT: "T0PLAF000000DS30",
    History.VELOCITY: "T0PLAF000000VE30",
    History.ACCELERATION: "T0PLAF000000AC30",
    History.PRESSURE: "T0AIRB000000PR00",
    History.COVER_FORCE: "T0PLAF000000FO30",
    History.CONTACT_FORCE: "T0AIRB000000FO30",
    History.GROUND_FORCE: "T0GRND000000FO30",
    History.GROUND_AREA: "T0GRND000000AR00",
    History.TENSION_GENERATRIX: "T0AIRB0000001G00",
    History.TENSION_HOOP: "T0AIRB0000001H00",
    History.TENSION_BELT: "T0AIRB0000001B00",
    History.TEMPERATURE: "T0AIRB000000TE00",
    History.GAS_MASS: "T0AIRB000000MA00",
    History.VOLUME: "T0AIRB000000VU00",
    History.VENT_FLOW: "T0AIRB000000MF00",
}
AT_INSTANTS = (History.HEIGHT, History.VELOCITY)


def write_iso_mme(result: Path | str, folder: Path | str) -> None:
    """Write the drop of a result file as a test of ISO-MME into a new folder. Raises ResultError and OSError."""
    found, folder = read_result(result), Path(folder)
    test = folder.name.removesuffix("-iso-mme")
    texts = iso_mme.files(test, _title(found), channels_of(found), 1.0 / RATE)
    draft = folder.with_name(f".{folder.name}.{os.getpid()}")
    try:
        (draft / "Channel").mkdir(parents=True)
        for name, text in texts.items():
            (draft / name).write_text(text, encoding="utf-8", newline="\n")
        draft.rename(folder)
    except BaseException:
        shutil.rmtree(draft, ignore_errors=True)
        raise


def write_uff(result: Path | str, file: Path | str) -> None:
    """Write the drop of a result file as datasets 58 of UFF. Raises ResultError, SignalError without pyuff, and OSError."""
    found = read_result(result)
    channels = channels_of(found)
    with draft_of(file) as draft:
        uff.write(draft, _title(found), channels)


def _title(result: Result) -> str:
    """Title of the case on one line, as both formats have it."""
    return " ".join(str(result.case["title"]).split())


def channels_of(result: Result) -> list[Channel]:
    """Return what a test would measure, at 10 kHz from half a sample after the first row on.

    Height and velocity are those of the instant, between rows on a line. All else is the mean over 0.1 ms about it; that of the
    acceleration is the change in velocity, so that no momentum between rows is lost. Raises ResultError.
    """
    history, interval = result.history, 1.0 / RATE
    if len(history) < 2 or not all(np.isfinite(history[name]).all() for name in history.dtype.names or ()):
        raise ResultError(f"{result.path}: a history of numbers, of two rows at least, is expected")
    rows = history["time"]
    count = int((rows[-1] - rows[0]) * RATE + 1e-6)
    if count < 2:
        raise ResultError(f"{result.path}: {(rows[-1] - rows[0]) * 1e3:.2g} ms of history; 0.2 ms at least are expected")
    times = (rows[0] + 0.5 * interval) + interval * np.arange(count)
    edges = np.minimum(rows[0] + interval * np.arange(count + 1), rows[-1])
    channels = []
    for column, code in CODES.items():
        name = column.name.lower()
        if name not in (history.dtype.names or ()):
            continue
        if column in AT_INSTANTS:
            values = np.interp(times, rows, history[name])
        elif column is History.ACCELERATION:
            values = np.diff(np.interp(edges, rows, history["velocity"])) / np.diff(edges)
        else:
            values = np.diff(integral(rows, history[name], edges)) / np.diff(edges)
        channels.append(Channel(name, times, values, column.unit, code))
    return channels
