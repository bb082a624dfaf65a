"""What was tried for a tolerance."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

from rich.console import Console

from softbrake.report.console.tables import Column, print_columns
from softbrake.report.words import speed_in_words
from softbrake.sim.summary import Trial


def print_trial(trial: Trial) -> None:
    """One level as soon as it is tried, on stderr."""
    level, grid, value, error, seconds, verdict = _trial(trial)
    unit = " m/s" if trial.impact_velocity else ""
    print(f"{level} {grid}: {value}{unit}, error {error}, {seconds} s: {verdict}", file=sys.stderr, flush=True)


def print_trials(trials: Sequence[Trial], console: Console) -> None:
    """All that was tried, in the order of the trials."""
    columns = [
        Column("level", right=False),
        *map(Column, ("grid", "m/s", "error", "s")),
        Column("verdict", right=False, breaks=True),
    ]
    print_columns(console, columns, [_trial(trial) for trial in trials], gap=1, order=(0, 1, 2, 3, 5, 4))
    console.print(f"All trials took {sum(trial.seconds for trial in trials):.3g} s of CPU.", highlight=False)


def _trial(trial: Trial) -> tuple[str, ...]:
    hoop = "" if trial.fidelity in ("axisymmetric", "lumped") else f" x {trial.hoop}"
    error = "–" if trial.error is None or not math.isfinite(trial.error) else f"{trial.error:.2g}"
    return trial.fidelity, f"{trial.generatrix}{hoop}", speed_in_words(trial), error, f"{trial.seconds:.2f}", trial.verdict
