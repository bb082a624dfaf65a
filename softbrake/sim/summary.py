"""The answer of a run, as `--json` prints it and the result file keeps it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import Field, dataclass, field, fields, is_dataclass
from typing import Any, Literal

LARGEST_GAIN = 1e-3  # of the initial energy from nowhere, above which peaks are doubtful and a run counts as failed
Phase = Literal["overshoot", "crushing"]  # before and after the cover has come down by a tenth of the shell's height


@dataclass(frozen=True)
class PeakValue:
    """Largest value of a quantity over the run, when and where."""

    value: float
    time: float  # s
    height: float | None = None  # m above the lower cover on the unloaded shell; None for a quantity of the cargo
    phase: Phase | None = None  # None in older result files
    other: PeakValue | None = None  # largest of the other phase; None where the run has none


@dataclass(frozen=True)
class FilteredPeaks:
    """Peaks behind a channel frequency class of SAE J211, of the rows that the result file keeps; heights are None.

    The deceleration is net of gravity: an accelerometer reads that much more.
    """

    cfc: int
    fault: str | None  # why there are none, else None
    peak_deceleration: PeakValue | None = None  # m/s^2, as of Summary
    peak_tension_generatrix: PeakValue | None = None  # N/m, of the largest tension of each row; None of a lumped run
    peak_tension_hoop: PeakValue | None = None  # N/m; likewise
    peak_tension_belt: PeakValue | None = None  # N/m; likewise, and None without belts


@dataclass(frozen=True)
class ModelUsed:
    """What was computed."""

    fidelity: str
    generatrix: int
    hoop: int
    courant: float
    scheme: str
    contact: list[str] | None = None  # what stops the fabric; None in older result files
    fabric: str | None = None  # law and shear in words; None in older result files and without a shell


def fabric_in_words(law: str, slack: str, G12: float, E11: float, E22: float) -> str:
    """Law of the fabric, and its shear modulus (N/m)."""
    carries = ", carries compression" if slack == "compression" else ", cut" if law != "tension_field" else ""
    return f"{law}{carries}; G12 {G12:.4g} N/m, {100 * G12 / min(E11, E22):.3g} % of E"


def doubt_of(energy_made: dict[str, float]) -> str | None:
    """Say why the peaks of a run are not to be trusted, where something made energy that no force gave; else None."""
    makers = [f"{name} made {made:.2%}" for name, made in energy_made.items() if made > LARGEST_GAIN]
    return f"{', '.join(makers)} of the initial energy from nowhere: peaks and velocity are doubtful" if makers else None


def contact_in_words(fidelity: str, parts: Iterable[str]) -> str:
    """What stops the fabric, and whether its folds meet."""
    if fidelity == "lumped":
        return "none: gas alone, no fabric"
    parts = tuple(parts)
    words = ", ".join(parts) or "none"
    if "folds" in parts:
        return words
    return words + "; folds may pass through each other"


@dataclass(frozen=True)
class Work:
    """Work done on cargo and shell from the start to the end, J."""

    pressure: float
    elastic: float
    viscous: float
    belts: float
    gravity: float
    ground: float
    contact: float  # with cover and cargo


@dataclass(frozen=True)
class GasBalance:
    """Energy of a gas with a state from the start to the end, J: what it gained is what came in less work and what went out."""

    gained: float  # internal energy
    work: float  # done on the wall, against the ambient pressure too
    enthalpy_out: float
    enthalpy_in: float
    heat: float  # taken from the surroundings, of a process that is not adiabatic


@dataclass(frozen=True)
class Trial:
    """One level and grid tried for a tolerance."""

    fidelity: str
    generatrix: int
    hoop: int
    impact_velocity: float | None  # m/s; 0 where the cargo stops above the ground, None where the run diverged
    error: float | None  # m/s, estimated; None where there is no estimate
    seconds: float
    verdict: str


@dataclass(frozen=True)
class Ensemble:
    """Drops behind a mean, alike but for how little their shells are out of round at the start."""

    members: int
    least: float  # m/s, impact velocity; 0 of one that stops above the ground
    most: float  # m/s
    smallest: float  # disturbance of the places over the radius, standard deviation
    largest: float


@dataclass(frozen=True)
class Inflation:
    """Shell at rest under a held cover, SI units."""

    title: str
    pressure: float  # Pa
    pressure_late: bool  # whether it is not that of t = 0, where the law has none, but its largest
    height: float  # m, of the cover
    largest_radius: float  # m, mean around the hoop
    largest_radius_height: float  # m above the ground
    volume: float  # m^3, of the gas
    cover_force: float  # N, on the cover from gas and fabric, up positive
    wall_pull: float  # N, of the fabric on the cover, down positive
    tension_generatrix: float  # N/m, largest
    tension_hoop: float  # N/m, largest
    tension_belt: float | None  # N/m, largest; None without belts
    middle_tension_generatrix: float  # N/m, at half the unloaded height, mean around the hoop
    middle_tension_hoop: float  # N/m
    residual: float  # of forces out of balance over those of the pressure, or of what is left to go over the radius
    steps: int
    results: str | None  # path of the result file
    results_fault: str | None = None  # why it lacks what came last; None where it is whole


@dataclass(frozen=True)
class Sensitivity:
    """What one input does to the answers."""

    path: str
    value: float | tuple[float, ...]  # SI
    changes: dict[str, float | None]  # of the answers of Summary, relative, per relative change of the input; None where lost


@dataclass(frozen=True)
class Sensitivities:
    """What all inputs do to the answers."""

    inputs: list[Sensitivity]  # those that lose an answer first, then the strongest
    errors: dict[str, float]  # of the changes, standard deviation
    noise: dict[str, float]  # of an answer, relative, standard deviation from straight lines over the inputs
    steps: dict[str, float]  # widest step behind an answer, relative, of the inputs
    left_out: dict[str, str]  # inputs that cannot be varied alone, and why


def answer(unit: str, meaning: str = "", **default: Any) -> Any:
    """A field of the answer with its unit and meaning, for tables and documents."""
    return field(metadata={"unit": unit, "meaning": meaning}, **default)


@dataclass(frozen=True)
class Summary:
    """Answer of one run, SI units."""

    title: str = answer("", "of the case")
    outcome: Literal["impact", "stopped", "rebound", "time_limit", "diverged", "interrupted"] = answer(
        "", "how the run ended; of a diverged one the rest is no answer"
    )
    end_time: float = answer("s", "when the run ended, from first contact on")
    impact_velocity: float | None = answer("m/s", "downwards positive; None without impact")
    impact_time: float | None = answer("s", "from first contact on; None without impact")
    free_fall_velocity: float = answer("m/s", "after falling the shell's height unbraked")
    velocity_reduction: float | None = answer("m/s", "free-fall less impact velocity; None without impact")
    lowest_height: float = answer("m", "lowest place of the upper cover")
    peak_deceleration: float = answer(
        "m/s^2",
        "upwards, net of gravity; with a shell behind a one-way first-order low-pass of 1 kHz, no channel class; see filtered",
    )
    peak_tension_generatrix: float | None = answer(
        "N/m", "largest tension along the generatrix; None of a lumped run, which has no shell"
    )
    peak_tension_hoop: float | None = answer("N/m", "largest around the hoop; likewise")
    peak_tension_belt: float | None = answer("N/m", "largest of the belts; likewise, and None without belts")
    peaks: dict[str, PeakValue] = answer(
        "", "time, place and phase of each; keys as the fields of their names, where they are not None"
    )
    work: Work = answer("", "done on cargo and shell, J")
    largest_penetration: float = answer("", "of folds into one another, over an unloaded cell")
    missed_collisions: int = answer(
        "", "how often a pair of folds was not kept from passing, at each look at contact; not in the last step"
    )
    threads: int | None = answer(
        "",
        "sides of the grid that stand through a face at the end, or segments of a meridian that cross; "
        "None where folds are not in contact, and in older result files",
        default=None,
        kw_only=True,
    )
    thread_time: float | None = answer(
        "s",
        "of the first snapshot with threads; None where none has any, or no result file was written",
        default=None,
        kw_only=True,
    )
    energy_error: float = answer(
        "", "residual of the work ledger, or of the gas's own where that is larger, over initial kinetic plus potential energy"
    )
    energy_made: dict[str, float] = answer("", "over that energy: the most that each gave beyond what it had, at any time")
    steps: int = answer("", "of time")
    time_step: float = answer("s", "mean")
    kernel_seconds: float = answer("s", "CPU time of the steps")
    wall_seconds: float = answer("s", "time on the clock, of all runs behind the answer")
    model: ModelUsed = answer("", "what was computed")
    results: str | None = answer("", "path of the result file; None without one")
    impact_velocity_error: float | None = answer(
        "m/s", "estimated numerical error; None where it was not asked for or has no bound", default=None
    )
    peak_errors: dict[str, float | None] | None = answer(
        "", "of the peaks, in their units, as far as estimated; None of one without a bound", default=None
    )
    fidelity_reason: str | None = answer("", "what the error rests on, and why this level was chosen", default=None)
    trials: list[Trial] = answer("", "what was tried for a tolerance", default_factory=list)
    fabric_margin: float | None = answer(
        "",
        "fabric.strength over its largest tension, less 1; None where no strength is given, or no tension arises",
        default=None,
    )
    belt_margin: float | None = answer("", "likewise, of the weakest belt under the largest tension of any", default=None)
    sensitivity: Sensitivities | None = answer("", "what each input does to the answer; None where not asked for", default=None)
    filtered: FilteredPeaks | None = answer(
        "", "peaks behind a class of SAE J211; None where no result file was written, and in older ones", default=None
    )
    limit_peaks: dict[str, float | str] = answer(
        "",
        "peaks behind the classes that limits name, SI, by name and class; a text says why there is none",
        default_factory=dict,
    )
    doubt: str | None = answer("", "why peaks and velocity are not to be trusted; None where they are", default=None)
    ensemble: Ensemble | None = answer("", "the drops behind velocity and peaks where those are means; else None", default=None)
    rest_time: float | None = answer("s", "when the cargo first stood still; None where it did not", default=None)
    rebound_velocity: float | None = answer(
        "m/s", "upwards, of the cargo back at the height of first contact; None without rebound", default=None
    )
    peak_pressure: float | None = answer(
        "Pa", "gauge, of a gas with a state; None of a pressure law, as all that follows of the gas", default=None
    )
    peak_temperature: float | None = answer("K", "of the gas", default=None)
    vented_mass: float | None = answer("kg", "of the gas, out through vents and wall", default=None)
    gas_mass: float | None = answer("kg", "of the gas, in the shell at the end", default=None)
    vent_opening_times: list[float | None] | None = answer("s", "of each vent, None of one that stayed closed", default=None)
    gas: GasBalance | None = answer("", "energy of the gas, J", default=None)
    results_fault: str | None = answer("", "why the result file lacks what came last; None where it is whole", default=None)

    @property
    def stood_still(self) -> bool:
        """Whether the cargo stopped above the ground at some time."""
        return self.outcome in ("stopped", "rebound") or self.rest_time is not None

    @property
    def cut_off(self) -> bool:
        """Whether `time.end` ended the run before the cargo reached the ground or stood still: it has no answer."""
        return self.outcome == "time_limit" and not self.stood_still


def as_dict(part: Any) -> Any:
    """A summary, or a part of one, as JSON has it: `dataclasses.asdict`, whose copies of numbers take four times as long."""
    if isinstance(part, dict):
        return {name: as_dict(value) for name, value in part.items()}
    if isinstance(part, list):
        return [as_dict(value) for value in part]
    return {name: as_dict(value) for name, value in vars(part).items()} if is_dataclass(part) else part


def _described(part: Field[Any]) -> str:
    unit, meaning = part.metadata["unit"], part.metadata["meaning"]
    return f"    {part.name}{f' [{unit}]' if unit else ''}: {meaning}"


Summary.__doc__ = "\n".join([f"{Summary.__doc__}\n", *map(_described, fields(Summary))])  # for help()
