"""Names of the files that commands write, and whether they can be written."""

from __future__ import annotations

from pathlib import Path

from softbrake.case.case_file import name_of
from softbrake.cli.exits import fail


def stem(case_file: Path) -> str:
    """How the names of a case's files begin."""
    return Path(name_of(case_file)).stem


def result_file(case_file: Path, output: Path | None, no_results: bool, ending: str) -> Path | None:
    """Result file that is asked for, None without one; by default the case's name with an ending, here."""
    if no_results:
        return None
    results = output or Path(f"{stem(case_file)}{ending}")
    if results.resolve() == case_file.resolve():
        fail(f"{results}: is the case file; --output must name another one")
    if results.suffix != ".vtkhdf":
        fail(f"{results}: the name of a result file ends in .vtkhdf, for ParaView to know it")
    check_place(results)
    return results


def check_place(file: Path) -> None:
    """Say before the run whether a file can be written after it."""
    import os

    if file.is_dir():
        fail(f"{file}: is a folder; --output must name a file")
    if not file.parent.is_dir():
        fail(f"{file}: there is no folder {file.parent}")
    if not os.access(file.parent, os.W_OK) or (file.exists() and not os.access(file, os.W_OK)):
        fail(f"{file}: may not be written")
