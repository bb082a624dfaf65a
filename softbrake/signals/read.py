"""Channels of a test from a file of any known format."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from softbrake.signals.channel import Channel, SignalError


def read_channels(path: Path | str, *, units: Mapping[str, str] = {}, time: str | None = None) -> list[Channel]:
    """Read the channels of a test, in the order of the file.

    path: a folder, .mme, .chn or channel file (.001) of ISO/TS 13499; a .uff, .unv or .bunv of UFF 58; a .tdms; any other
    file is a text of delimited columns. units: of channels by name, over those of the file. time: name of the channel of
    times where the file may have several; by default the first column of a text, the increment of a TDMS channel.
    Raises SignalError, whose message is one line `file: fault; what is expected`, with line and column of a text.
    """
    path = Path(path)
    ending = path.suffix.lower()
    try:
        if path.is_dir() or ending in (".mme", ".chn") or re.fullmatch(r"\.[0-9]{3,}", ending):
            from softbrake.signals import iso_mme

            return iso_mme.read(path, units, time)
        if ending in (".uff", ".unv", ".bunv"):
            from softbrake.signals import uff

            return uff.read(path, units, time)
        if ending == ".tdms":
            from softbrake.signals import tdms

            return tdms.read(path, units, time)
        from softbrake.signals import columns

        return columns.read(path, units, time)
    except OSError as error:
        raise SignalError(f"{path}: cannot be read: {error.strerror or error}") from None
