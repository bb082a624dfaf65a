"""Braking of a falling cargo by an inflatable shell of fabric and ring belts.

From Python: `summary = softbrake.run(softbrake.load_case("case.yaml"))`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softbrake.case.case_file import CaseError, load_case
    from softbrake.sim.result_file import ResultError
    from softbrake.sim.simulation import Diverged
    from softbrake.studies.error_control import run

__all__ = ["CaseError", "Diverged", "ResultError", "__version__", "load_case", "run"]
__version__ = "0.1.0"

_HOMES = {
    "CaseError": "case.case_file",
    "Diverged": "sim.simulation",
    "ResultError": "sim.result_file",
    "load_case": "case.case_file",
    "run": "studies.error_control",
}


def __getattr__(name: str) -> Any:
    # On demand: importing the package, as the command line does for --help, must not load Numba.
    if name in _HOMES:
        return getattr(import_module(f"softbrake.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
