"""Braking of a falling cargo by an inflatable shell of fabric and ring belts.

From Python: `summary = softbrake.run("case.yaml")`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softbrake.case.case import Case
    from softbrake.case.case_file import CaseError, load_case
    from softbrake.case.level import LongStep
    from softbrake.sim.result_file import Result, ResultError, read_result
    from softbrake.sim.simulation import Diverged, NotInflated
    from softbrake.sim.summary import Summary
    from softbrake.studies.error_control import run

__version__ = "0.1.0"
__all__ = [
    "Case",
    "CaseError",
    "Diverged",
    "LongStep",
    "NotInflated",
    "Result",
    "ResultError",
    "Summary",
    "__version__",
    "load_case",
    "read_result",
    "run",
]

_HOMES = {
    "case.case": ("Case",),
    "case.case_file": ("CaseError", "load_case"),
    "case.level": ("LongStep",),
    "sim.result_file": ("Result", "ResultError", "read_result"),
    "sim.simulation": ("Diverged", "NotInflated"),
    "sim.summary": ("Summary",),
    "studies.error_control": ("run",),
}


def __getattr__(name: str) -> Any:
    # On demand: importing the package, as the command line does for --help, must not load Numba.
    for home, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f"softbrake.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
