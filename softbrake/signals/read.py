"""Channels of a test from a file of any known format."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from softbrake.signals.channel import Channel, SignalError


def read_channels(path: Path | str, *, units: Mapping[str, str] = {}, time: str | None = None) -> list[Channel]:
    """Read the channels of a test, in the order of the file.

    path: a text of delimited columns. units: of channels by name, over those of the file. time: name of the channel of
    times where it is not the first column of a text.
    Raises SignalError, whose message is one line `file: fault; what is expected`, with line and column of a text.
    """
    path = Path(path)
    try:
        from softbrake.signals import columns

        return columns.read(path, units, time)
    except OSError as error:
        raise SignalError(f"{path}: cannot be read: {error.strerror or error}") from None
