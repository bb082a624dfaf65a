"""Names of the files that commands write, and whether they can be written."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from softbrake.cli.exits import FAILED, fail

if TYPE_CHECKING:
    from softbrake.case.case import Case


def stem(case_file: Path) -> str:
    """How the names of a case's files begin."""
    from softbrake.case.case_file import name_of

    return Path(name_of(case_file)).stem


def result_file(
    case_file: Path, case: Case, output: Path | None, *, no_results: bool, force: bool, ending: str = ".vtkhdf"
) -> Path | None:
    """Result file that is asked for, None without one; by default the case's name with an ending, here.

    Refuses to replace the answer of another case, unless it is to be forced.
    """
    if no_results:
        return None
    results = output or Path(f"{stem(case_file)}{ending}")
    if results.resolve() == case_file.resolve():
        fail(f"{results}: is the case file; --output must name another one")
    if results.suffix != ".vtkhdf":
        fail(f"{results}: the name of a result file ends in .vtkhdf, for ParaView to know it")
    check_place(results)
    if not force and results.exists():
        from softbrake.sim.result_file import other_answer

        if (lost := other_answer(results, case)) is not None:
            fail(f"{results}: {lost}; --output names another file, --force replaces it")
    return results


@contextmanager
def writing(file: Path) -> Iterator[None]:
    """End as failed where a file cannot be written after all, as the disk is full or the folder gone."""
    try:
        yield
    except OSError as error:
        fail(f"{file}: cannot be written: {error.strerror or error}", FAILED)


@contextmanager
def drawing(picture: Path) -> Iterator[None]:
    """As `writing`, of a picture of results that are printed or written already."""
    from softbrake.report.plots.style import PlotError

    try:
        with writing(picture):
            yield
    except PlotError as error:
        fail(error, FAILED)


def check_place(file: Path) -> None:
    """Say before the run whether a file can be written after it."""
    import os

    if file.is_dir():
        fail(f"{file}: is a folder; the name of a file is expected")
    if not file.parent.is_dir():
        fail(f"{file}: there is no folder {file.parent}")
    if not os.access(file.parent, os.W_OK) or (file.exists() and not os.access(file, os.W_OK)):
        fail(f"{file}: may not be written")
