"""What was tried for a tolerance."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

from rich.table import Table

from softbrake.sim.summary import Trial


def print_trial(trial: Trial) -> None:
    """One level as soon as it is tried, on stderr."""
    level, grid, value, error, seconds, verdict = _trial(trial)
    print(f"{level} {grid}: {value} m/s, error {error}, {seconds} s: {verdict}", file=sys.stderr, flush=True)


def trials_table(trials: Sequence[Trial]) -> Table:
    """All that was tried, in the order of the trials."""
    table = Table(box=None, padding=(0, 1, 0, 0), show_edge=False, header_style="")
    for name in ("level", "grid", "m/s", "error", "s", ""):
        table.add_column(name, justify="left" if name in ("level", "") else "right", overflow="fold")
    for trial in trials:
        table.add_row(*_trial(trial))
    return table


def _trial(trial: Trial) -> tuple[str, ...]:
    hoop = "" if trial.fidelity in ("axisymmetric", "lumped") else f" x {trial.hoop}"
    value = "–" if trial.impact_velocity is None else f"{trial.impact_velocity:.4f}"
    error = "–" if trial.error is None or not math.isfinite(trial.error) else f"{trial.error:.2g}"
    return trial.fidelity, f"{trial.generatrix}{hoop}", value, error, f"{trial.seconds:.2f}", trial.verdict
