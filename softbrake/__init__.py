"""Braking of a falling cargo by an inflatable shell of fabric and ring belts.

From Python: `summary = softbrake.run(softbrake.load_case("case.yaml"))`.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softbrake.case import load_case
    from softbrake.run import run

__all__ = ["__version__", "load_case", "run"]
__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    # On demand: importing the package, as the command line does for --help, must not load Numba.
    if name == "load_case":
        from softbrake.case import load_case

        return load_case
    if name == "run":
        from softbrake.run import run

        return run
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


class _Package(ModuleType):
    """Keeps `softbrake.run` the function: importing a submodule would bind the module of that name over it."""

    def __setattr__(self, name: str, value: Any) -> None:
        super().__setattr__(name, value.run if name == "run" and isinstance(value, ModuleType) else value)


sys.modules[__name__].__class__ = _Package
