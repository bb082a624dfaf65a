"""What a work-precision diagram recommends."""

from __future__ import annotations

import math
import shlex
from typing import TYPE_CHECKING

from rich.console import Console

from softbrake.report.console.tables import Column, plain, print_columns, print_quantities
from softbrake.report.words import named

if TYPE_CHECKING:
    from softbrake.studies.work_precision import WorkPrecision


def print_work_precision(found: WorkPrecision, command: str, console: Console | None = None) -> None:
    """Print reference, recommended settings, failures and what was left out; `command` is `softbrake run CASE` of the user."""
    from softbrake.studies.work_precision import TOLERANCES, UNITS

    console = console or plain()
    console.print(found.case.title, style="bold", soft_wrap=True, markup=False, highlight=False)
    reference = found.reference
    assert reference is not None
    if found.interrupted:
        console.print(f"Interrupted after {len(found.runs)} runs: what is recommended may change.")
    console.print(f"Reference: {reference.basis}.")
    console.print(f"All runs took {found.seconds:.3g} s of a budget of {found.budget:g} s.")
    console.print()
    values = [
        (named(name), f"{value:.5g}", UNITS[name], f"± {_percent(reference.error(name))}")
        for name, value in reference.values.items()
    ]
    print_quantities(console, values)
    console.print()
    rows: list[tuple[str, ...]] = []
    for name in reference.values:
        rows.append(("", named(name), "", ""))
        for tolerance in TOLERANCES:
            run = found.recommended(name, tolerance)
            if run is None:
                rows.append((f"{100 * tolerance:g} %", _why_none(reference.error(name), tolerance), "", ""))
            else:
                error = max(found.error(run, name), reference.error(name))
                below = "< " if found.error(run, name) < reference.error(name) else ""
                rows.append((f"{100 * tolerance:g} %", str(run.setting), below + _percent(error), f"{run.seconds:.2g}"))
    choose = Column("choose", right=False, breaks=True)
    print_columns(console, (Column("within"), choose, Column("error"), Column("CPU s")), rows)
    for head, lines in (("failed", found.failures()), ("left out", found.omissions())):
        if lines:
            console.print(f"\n{head}")
            for line in lines:
                console.print(f"  {line}")
    first = next(iter(reference.values))
    chosen = [(tolerance, run) for tolerance in TOLERANCES if (run := found.recommended(first, tolerance)) is not None]
    if chosen and found.case.tolerance is None:
        tolerance, run = chosen[-1]
        sets = " ".join(f"--set {shlex.quote(text)}" for text in run.setting.overrides(found.case))
        console.print(f"\nFor {100 * tolerance:g} % of the {named(first)}:")
        console.print(f"  {command} {sets}", soft_wrap=True)


def _why_none(known: float, tolerance: float) -> str:
    """Say why no run is recommended for a tolerance, beside a reference that is known to a relative error."""
    if math.isinf(known):
        return "none: the budget holds too few runs for an error bar of the reference; try a larger --budget"
    if known >= tolerance:
        return f"none: the reference is known to {_percent(known)} only"
    return f"none: no run within {100 * tolerance:g} % that a finer one confirms"


def _percent(error: float) -> str:
    return f"{100 * error:.{2 if error < 0.1 else 3}g} %" if math.isfinite(error) else "unknown"
