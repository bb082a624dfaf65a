"""The history of a result as CSV: a row for each recorded step."""

from __future__ import annotations

import csv
from pathlib import Path

from softbrake.sim.files import draft_of
from softbrake.sim.result_file import ResultError, read_result


def write_curves(result: Path | str, file: Path | str) -> None:
    """Write the history of a result file: a header such as `height [m]`, then the numbers to their last digit.

    Raises ResultError and OSError.
    """
    found = read_result(result)
    if not len(found.history):
        raise ResultError(f"{result}: there is no history in it")
    with draft_of(file) as draft, open(draft, "w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(f"{name} [{unit}]" if unit else name for name, unit in found.units.items())
        writer.writerows(found.history.tolist())
