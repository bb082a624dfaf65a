"""A drop beside a test in words and numbers, for console and page alike."""

from __future__ import annotations

from softbrake.case.units import unit_size
from softbrake.signals.channel import QUANTITIES
from softbrake.studies.comparison import Compared, Comparison

PEAKS = {"deceleration": "peak", "pressure": "peak", "velocity": "largest downwards", "height": "lowest"}
CHANGES = {"deceleration": ("velocity change", "m/s"), "velocity": ("change", ""), "height": ("change", "")}


def heading_lines(found: Comparison) -> list[str]:
    """What is compared: shift, interval, class, gravity."""
    how = "found by least squares" if found.shift_found else "given"
    start, stop = (1e3 * time for time in found.interval)
    filtered = "unfiltered" if found.cfc is None else f"both behind CFC {found.cfc}"
    decelerated = any(each.quantity == "deceleration" for each in found.quantities)
    weight = f"; gravity is {'' if found.added else 'not '}in the deceleration" if decelerated else ""
    return [
        f"Times of the test are shifted by {round(1e3 * found.shift, 3) + 0.0:g} ms, {how}.",
        f"Compared from {start:.5g} to {stop:.5g} ms of the drop at 10 kHz, {filtered}{weight}.",
    ]


def comparison_rows(each: Compared) -> list[list[str]]:
    """Mark, test, drop, difference and unit of one quantity, in the unit of its channel."""
    size = unit_size(each.unit, QUANTITIES[each.quantity])

    def row(name: str, test: float | None, drop: float | None, unit: str) -> list[str]:
        if test is None or drop is None:
            return [name, *("–" if one is None else f"{one:.5g}" for one in (test, drop)), "–", unit]
        share = f" ({100.0 * (drop - test) / abs(test):+.1f} %)" if test else ""
        return [name, f"{test:.5g}", f"{drop:.5g}", f"{drop - test:+.3g}{share}", unit]

    test, drop = each.test, each.computed
    rows = [row(PEAKS[each.quantity], test.peak / size, drop.peak / size, each.unit)]
    apart = 1e3 * (drop.time - test.time)
    rows.append(["at", f"{1e3 * test.time:.5g}", f"{1e3 * drop.time:.5g}", f"{apart:+.3g}", "ms"])
    if each.quantity in ("deceleration", "pressure"):
        broad, wide = (None if one.width is None else 1e3 * one.width for one in (test, drop))
        rows.append(row("width at half", broad, wide, "ms"))
    if each.quantity in CHANGES:
        name, unit = CHANGES[each.quantity]
        one = 1.0 if unit else size
        before, after = (None if mark.change is None else mark.change / one for mark in (test, drop))
        rows.append(row(name, before, after, unit or each.unit))
    rows.append(["RMS of the difference", "", "", f"{each.rms / size:.3g}", each.unit])
    return rows


def rating_rows(found: Comparison) -> list[list[str]]:
    """Quantity, overall rating and its parts, of those that have one."""
    return [
        [
            each.quantity,
            *(f"{part:.3f}" for part in (rated.overall, rated.corridor, rated.phase, rated.magnitude, rated.slope)),
        ]
        for each in found.quantities
        if (rated := each.rating) is not None
    ]
