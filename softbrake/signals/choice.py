"""Which channels of a test are compared, and in the drop's terms: pressures gauge, velocities negative downwards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches

from softbrake.case.units import GRAVITIES, measure
from softbrake.signals.channel import QUANTITIES, Channel, SignalError


def chosen(channels: Sequence[Channel], names: Sequence[str], source: str) -> list[Channel]:
    """Return the channels of some names or codes; without any, all that are the only ones of their quantity.

    source: the file, for messages. Raises SignalError where one is not there, has samples that are no numbers, measures nothing
    a drop has, or where two measure the same.
    """
    if names:
        found = [_named(channels, name, source) for name in dict.fromkeys(names)]
    else:
        found = [channel for channel in channels if channel.quantity is not None]
    if not found:
        units = ", ".join(f"'{channel.name}' in '{channel.unit}'" for channel in channels)
        raise SignalError(f"{source}: no channel of {', '.join(QUANTITIES)}: {units}; --unit 'NAME=m/s^2' gives one its unit")
    if faults := [channel.fault for channel in found if channel.fault is not None]:
        raise SignalError(faults[0])
    for quantity in QUANTITIES:
        if len(alike := [channel.name for channel in found if channel.quantity == quantity]) > 1:
            raise SignalError(f"{source}: {' and '.join(map(repr, alike))} are both a {quantity}; --channel NAME chooses one")
    return found


def _named(channels: Sequence[Channel], name: str, source: str) -> Channel:
    matching = [channel for channel in channels if name in (channel.name, channel.code)]
    if not matching:
        known = [channel.name for channel in channels]
        close = get_close_matches(name, known, 1)
        hint = f"did you mean '{close[0]}'?" if close else f"{', '.join(map(repr, known)) or 'none'} are there"
        raise SignalError(f"{source}: no channel '{name}'; {hint}")
    if len(matching) > 1:
        raise SignalError(f"{source}: {len(matching)} channels '{name}'; a channel of its own name or code is expected")
    if matching[0].quantity is None:
        unit = f"in '{matching[0].unit}'" if matching[0].unit else "without a unit"
        raise SignalError(f"{source}: '{name}' is {unit}, none of {', '.join(QUANTITIES)}; --unit '{name}=g' gives it one")
    return matching[0]


def unknown_units(channels: Sequence[Channel]) -> list[Channel]:
    """Channels of which nobody knows what they measure: their unit is none, or not said."""

    def unknown(unit: str) -> bool:
        try:
            measure(unit)
        except ValueError:
            return unit not in GRAVITIES
        return not unit

    return [channel for channel in channels if channel.quantity is None and unknown(channel.unit)]


def in_terms_of_drop(channels: Sequence[Channel], *, turned: Sequence[str], ambient: float) -> list[Channel]:
    """Return channels with the values of the named ones turned, and pressures less the ambient one (Pa), 0 if they are gauge."""
    found = []
    for channel in channels:
        values = -channel.values if channel.name in turned or (channel.code and channel.code in turned) else channel.values
        found.append(replace(channel, values=values - ambient if channel.quantity == "pressure" else values))
    return found
