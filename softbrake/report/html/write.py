"""Writes the page on a result or a sweep."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from softbrake.report.html.result import result_page
from softbrake.report.html.sweep import sweep_page
from softbrake.sim.files import write_text

if TYPE_CHECKING:
    from softbrake.studies.comparison import Comparison


def write_report(source: Path | str, file: Path | str, comparison: Comparison | None = None) -> None:
    """Write the page on a result file, with the test beside it if any, or on the folder of a sweep.

    Raises ResultError, PlotError and OSError.
    """
    text = sweep_page(source) if Path(source).is_dir() else result_page(source, comparison)
    write_text(file, text)
