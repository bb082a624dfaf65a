"""Braking of a falling cargo by an inflatable shell of fabric and ring belts.

From Python: `summary = softbrake.run(softbrake.load_case("case.yaml"))`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softbrake.case import load_case
    from softbrake.drop import run

__all__ = ["__version__", "load_case", "run"]
__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    # On demand: importing the package, as the command line does for --help, must not load Numba.
    if name == "load_case":
        from softbrake.case import load_case

        return load_case
    if name == "run":
        from softbrake.drop import run

        return run
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
