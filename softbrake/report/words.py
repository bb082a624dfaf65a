"""An answer in words, and numbers that all reports share."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from softbrake.case.sections.limits import ANSWERS, LIMITS, limits_of
from softbrake.case.units import STANDARD_GRAVITY, Dimension
from softbrake.sim.limits import Verdict
from softbrake.sim.summary import Ensemble, GasBalance, Inflation, PeakValue, Summary, Trial
from softbrake.studies.chance import ALL, HELD, QUANTILES, Chance, Estimate

if TYPE_CHECKING:
    from softbrake.studies.calibration import FittedInput

SHOWN = 1e-5  # of the initial energy: less than that is what steps of finite length leave
DUST = 1e-6  # m/s^2 or N/m: less than that is round-off
MOST_MARGIN = 100.0  # above which strength is out of all proportion to the tension
ROUND_OFF = 1e-12  # of a fitted value: no interval is narrower
SMALL = 1e-4  # numbers below have a power of ten
SHOWN_UNITS = {
    Dimension.ACCELERATION: ("g", STANDARD_GRAVITY),
    Dimension.TENSION: ("kN/m", 1e3),
    Dimension.PRESSURE: ("kPa", 1e3),
}
TENSIONS = ("generatrix", "hoop", "belt")


def answer_in_words(column: str) -> str:
    """Name of an answer, with its class where it has one."""
    name, _, cfc = column.partition("_cfc")
    return name.replace("_", " ") + (f", CFC {cfc}" if cfc else "")


def named(answer: str) -> str:
    """Name of an answer of Summary for people; a deceleration has that of its filter."""
    return answer.replace("_", " ") + (", 1 kHz" if answer == "peak_deceleration" else "")


def outcome_in_words(summary: Summary) -> str:
    """One sentence: how the run ended and when."""
    end = f"{summary.end_time:.5g} s"
    lowest = f"the cover came down to {summary.lowest_height:.4g} m"
    match summary.outcome:
        case "impact":
            return f"Impact: the cover reached the ground at {end}."
        case "stopped":
            rest = end if summary.rest_time is None else f"{summary.rest_time:.5g} s"
            return f"Stopped: the cargo came to rest at {rest}; {lowest}."
        case "rebound":
            rising = "" if summary.rebound_velocity is None else f", rising at {summary.rebound_velocity:.4g} m/s"
            return f"Rebound: the cover was back at the height of first contact at {end}{rising}; {lowest}."
        case "time_limit":
            rest = "" if summary.rest_time is None else f"first at rest at {summary.rest_time:.5g} s, "
            return f"End of time: {rest}no impact by {end}; {lowest}."
        case "diverged":
            return f"Diverged at {end}: the numbers below are not an answer."
        case "interrupted":
            return f"Interrupted at {end}; {lowest}."


def vented_in_words(summary: Summary) -> str:
    """Part of the gas that has left the shell; empty where that is not known."""
    if summary.vented_mass is None or summary.gas_mass is None:
        return ""
    return f"{summary.vented_mass / (summary.vented_mass + summary.gas_mass):.1%} of the gas"


def openings_in_words(summary: Summary, scale: float = 1.0) -> list[tuple[str, str, str]]:
    """Path of each vent, when it first opened, and a unit or nothing; scale: of the time, 1 for s, 1e3 for ms."""
    rows = []
    for number, when in enumerate(summary.vent_opening_times or ()):
        name, unit = f"vents.{number} opens", "s" if scale == 1.0 else "ms"
        if when is None:
            ended = summary.outcome in ("impact", "rebound", "stopped")
            rows.append((name, "never" if ended else f"not by {summary.end_time:.5g} s", ""))
        elif when == 0.0:
            rows.append((name, "at once", ""))
        else:
            rows.append((name, f"{when:.5f}" if scale == 1.0 else f"{when * scale:.4g}", unit))
    return rows


def thread_rows(summary: Summary) -> list[tuple[str, str, str]]:
    """Threads at the end and when they were first seen: name, number, note; empty where there never were any."""
    if not summary.threads and summary.thread_time is None:
        return []
    first = summary.thread_time
    when = "" if first is None else f", first seen at {first:.5g} s" if first < summary.end_time else " only"
    what = "segments that cross" if summary.model.fidelity == "axisymmetric" else "sides through faces"
    return [("threads", "–" if summary.threads is None else str(summary.threads), f"{what}, at the end{when}")]


def gas_energy_rows(gas: GasBalance) -> list[tuple[str, float, str]]:
    """What changed the energy of the gas: name, J, note; what did not is left out."""
    parts = [
        ("  by compression", -gas.work, "by shell and ambient pressure"),
        ("  by outflow", -gas.enthalpy_out, "enthalpy of the gas that left"),
        ("  by inflow", gas.enthalpy_in, "enthalpy of the gas that came in"),
        ("  by heat", gas.heat, "from the surroundings"),
    ]
    return [("energy gained by the gas", gas.gained, "internal"), *(part for part in parts if part[1] != 0.0)]


def stops(outcome: str, rest_time: float | str | None) -> bool:
    """Whether a cargo came to rest above the ground, and has an impact velocity of 0; rest_time: as in Summary, or in a table."""
    return outcome in ("stopped", "rebound") or (outcome == "time_limit" and rest_time not in (None, ""))


def speed_in_words(trial: Trial) -> str:
    """Impact velocity (m/s) of a trial, or what became of it."""
    if trial.impact_velocity is None:
        return "–"
    return "stops" if trial.impact_velocity == 0.0 else f"{trial.impact_velocity:.4f}"


def made_in_words(summary: Summary) -> str:
    """What made energy that no force gave, and how much of the initial energy."""
    makers = [f"{name} {100 * made:.2g} %" for name, made in summary.energy_made.items() if made >= SHOWN]
    return ", ".join(makers) or "none"


def disturbed_in_words(found: Ensemble) -> str:
    """How little the shells of an ensemble are out of round at the start."""
    sizes = f"{found.smallest:g}" if found.smallest == found.largest else f"{found.smallest:g} to {found.largest:g}"
    return f"disturbed by {sizes} R"


def margin_in_words(margin: float, digits: int = 0) -> str:
    """Strength over tension less 1, in per cent."""
    return f"above {MOST_MARGIN:+.0%}" if margin > MOST_MARGIN else f"{margin:+.{digits}%}"


def verdict_rows(verdicts: Sequence[Verdict]) -> list[list[str]]:
    """Limit, answer, margin with its share, and verdict of each limit."""
    rows = []
    for each in verdicts:
        limit, margin, share = each.limit, each.margin, each.share
        name = limit.name.replace("_", " ")
        found, by, word = "none", "–", f"MISSED: {each.fault}"
        if each.answer is not None and margin is not None:
            found = "no tension" if math.isinf(each.answer) else limit.in_unit(each.answer)
            if not math.isinf(margin):
                by = limit.in_unit(margin, "+.3g") + ("" if share is None else f", {share:+.1%}")
            word = ("holds" if each.holds else "MISSED") + (", within the error" if each.within_error else "")
        rows.append([f"{name} {limit}", found, by, word])
    return rows


def chance_tables(chance: Chance, case: Mapping[str, Any]) -> list[tuple[str, list[str], list[list[str]]]]:
    """Title, head and rows of what a sample says; case: as a plan keeps it."""
    limits = {limit.column: limit for limit in limits_of(case.get(LIMITS.name, {}))}
    texts = {name: f"{answer_in_words(limit.name)} {limit}" for name, limit in limits.items()} | {ALL: ALL}
    tables = []
    lost = f"; {chance.lost} of them have no answer and count as missed" if chance.lost else ""
    if chance.holds:
        rows = [[texts[name], *_in_percent(found)] for name, found in chance.holds.items()]
        tables.append((f"Chance that limits hold, of {chance.runs} runs{lost}", ["limit", "chance", "from", "to"], rows))
    names = [f"{100 * part:g} %" for part in QUANTILES]
    rows = []
    for name, spread in chance.spreads.items():
        unit, size = shown_unit(name)
        values = [f"{value / size:.4g}" for value in (spread.mean, spread.deviation, *spread.quantiles)]
        rows.append([f"{answer_in_words(name)}, {unit}".removesuffix(", "), *values])
    missing = f"; {chance.lost} without are left out" if chance.lost else ""
    if rows:
        tables.append((f"Answers of {chance.runs} runs{missing}", ["answer", "mean", "deviation", *names], rows))
    for name, indices in chance.indices.items():
        rows = [
            [each.input, *(f"{part:.3f}" for found in (each.first, each.total) for part in (found.value, found.low, found.high))]
            for each in indices
        ]
        without = f"; {chance.left_out} samples with a run without an answer are left out" if chance.left_out else ""
        title = f"Sobol' indices of {answer_in_words(name)}, {chance.sampling.samples} samples{without}"
        tables.append((title, ["input", "first", "from", "to", "total", "from", "to"], rows))
    if sampling := chance.sampling.control and chance.sampling:
        rows = []
        for name, each in chance.controlled.items():
            limit = name.removeprefix(HELD)
            unit, size = ("%", 0.01) if limit != name else shown_unit(name)
            numbers = (each.mean.value, each.mean.half, each.plain.value, each.plain.half)
            shown = [f"{part / size:.4g}" for part in numbers]
            text = texts[limit] if limit != name else answer_in_words(name)
            rows.append([f"{text}, {unit}".removesuffix(", "), *shown, f"{each.coefficient:.3g}", f"{each.saved:.0%}"])
        title = f"Means of {sampling.samples} runs, with {sampling.control_samples} more {sampling.control} ones as control"
        if chance.uncontrolled:
            title += f"; {chance.uncontrolled} runs without an answer are left out with their twins"
        tables.append((title, ["mean", "controlled", "±", "plain", "±", "coefficient", "variance saved"], rows))
    return tables


def _in_percent(found: Estimate) -> list[str]:
    return [f"{100 * part:.2f} %" for part in (found.value, found.low, found.high)]


def shown_unit(column: str) -> tuple[str, float]:
    """Unit of an answer in tables of samples, and its SI size."""
    kind = ANSWERS[column.partition("_cfc")[0]]
    return SHOWN_UNITS.get(kind, (kind.unit, 1.0))


def missed_in_words(verdicts: Sequence[Verdict]) -> str:
    """The limits that an answer misses, in one line; empty where it keeps all."""
    missed = [f"{row[0]}: {row[1]}" for row, each in zip(verdict_rows(verdicts), verdicts, strict=True) if not each.holds]
    return f"{len(missed)} of {len(verdicts)} limits missed: {'; '.join(missed)}" if missed else ""


def when_in_words(peak: PeakValue, scale: float = 1.0, mean: Ensemble | None = None, phase: bool = True) -> str:
    """Time of a peak, its height on the shell, and its phase if asked for; empty where there is no peak.

    scale: of the time, 1 for s, 1e3 for ms. mean: ensemble whose mean the peak is, at the time and the place of one drop.
    """
    if peak.value < DUST:
        return ""
    time = f"{peak.time:.5f} s" if scale == 1.0 else f"{peak.time * scale:.4g} ms"
    height = "" if peak.height is None else f", {peak.height:.3f} m up" if scale == 1.0 else f", {peak.height:.3g} m up the shell"
    one = "" if mean is None else "in one drop "
    return f"{one}at {time}{height}" + (f", {peak.phase}" if phase and peak.phase is not None else "")


def inflated_in_words(inflation: Inflation) -> str:
    """One sentence: how near to rest the shell is."""
    return f"Inflated: at rest to a residual of {inflation.residual:.1e} after {inflation.steps} steps."


def inflation_rows(inflation: Inflation) -> list[tuple[str, str, str, str]]:
    """Name, value, unit and note of what a static inflation found."""
    middle = {"generatrix": inflation.middle_tension_generatrix, "hoop": inflation.middle_tension_hoop}
    rows = [
        ("pressure", f"{inflation.pressure / 1e3:.4g}", "kPa", "the largest; the law starts without" * inflation.pressure_late),
        ("height", f"{inflation.height:.5g}", "m", "held"),
        ("largest radius", f"{inflation.largest_radius:.5f}", "m", f"{inflation.largest_radius_height:.3f} m up"),
        ("volume", f"{inflation.volume:.5g}", "m^3", ""),
        ("force on the cover", f"{inflation.cover_force:.2f}", "N", ""),
        ("pull of the wall on it", f"{inflation.wall_pull:.2f}", "N", ""),
    ]
    for part in TENSIONS:
        if (tension := getattr(inflation, f"tension_{part}")) is not None:
            note = f"largest; {middle[part] / 1e3:.4f} at mid-height" if part in middle else "largest"
            rows.append((f"tension, {part}", f"{tension / 1e3:.4f}", "kN/m", note))
    return rows


def fitted_in_words(one: FittedInput) -> str:
    """Interval of a fitted input, or why there is none."""
    if one.interval is None:
        return f"no interval, {one.why_not}"
    low, high = (end / one.variable.size for end in one.interval)
    half = 0.5 * (high - low)
    return f"{_to_place(low, half)} to {_to_place(high, half)} {one.variable.shown}".rstrip() + " (95 %)"


def fitted_value(one: FittedInput) -> str:
    """A fitted value in the unit shown, to the place of its interval; to five digits where it has none."""
    value, size = one.value / one.variable.size, one.variable.size
    return f"{value:.5g}" if one.interval is None else _to_place(value, 0.5 * (one.interval[1] - one.interval[0]) / size)


def _to_place(value: float, half: float) -> str:
    """A number to the second significant digit of a half width."""
    half = max(half, ROUND_OFF * abs(value))
    if half == 0.0:
        return "0"
    place = 1 - math.floor(math.log10(half))
    if 0.0 < abs(value) < SMALL:
        return f"{value:.{max(place + math.floor(math.log10(abs(value))), 0)}e}"
    return f"{round(value, place):.{max(place, 0)}f}"
