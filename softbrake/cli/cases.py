"""Cases as the commands read them, and what is odd about them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

from softbrake.cli.exits import fail

if TYPE_CHECKING:
    from softbrake.case.case import Case
    from softbrake.case.case_file import CaseFile
    from softbrake.case.overrides import Override
    from softbrake.studies.axes import Designs

SET_ASIDE = "tolerance: a run chooses its own grid and step; this is about those of the case"


def read(path: Path, overrides: Sequence[str | Override] | None) -> CaseFile:
    """A case file, read once."""
    from softbrake.case.case_file import CaseError, open_case

    try:
        return open_case(path, overrides or ())
    except CaseError as error:
        fail(error)


def load(path: Path, overrides: list[str] | None) -> Case:
    """The case of a file."""
    return read(path, overrides).case


def changed(file: CaseFile, overrides: Sequence[str]) -> Case:
    """The case of a file with more values replaced."""
    from softbrake.case.case_file import CaseError

    try:
        return file.set(overrides).case
    except CaseError as error:
        fail(error)


def designs(file: CaseFile, vary: list[str] | None = None, **settings: str | int | None) -> Designs:
    """The cases of the sweep of a file; of one that goes on until it knows enough the first ones."""
    return next(growing(file, vary, **settings))[0]


def growing(
    file: CaseFile, vary: list[str] | None = None, **settings: str | int | None
) -> Iterator[tuple[Designs, float | None]]:
    """The cases of the sweep of a file, or of ever more samples, each with the accuracy that they are to reach."""
    from softbrake.case.case_file import CaseError
    from softbrake.studies import axes

    try:
        yield from axes.growing(file, vary or (), settings)
    except CaseError as error:
        fail(error)


def at_fidelity(case: Case, fidelity: Literal["axisymmetric", "full"]) -> Case:
    """The case at a fidelity where it leaves the choice, for commands that want a grid."""
    from softbrake.case.level import level

    return level(case, fidelity, case.grid.generatrix, case.grid.hoop) if case.model.fidelity == "auto" else case


def consider(cases: Iterable[Case], file: CaseFile, *, results: bool = False, at_once: int = 1) -> None:
    """Say on stderr what is unusual about cases, a line each; refuse those that need more memory than there is.

    results: whether their runs write result files; at_once: how many run at the same time.
    """
    from softbrake.case.plausible import warnings_of

    cases = list(cases)
    for line in warnings_of(cases, file.unit_of):
        typer.echo(f"unusual: {line}", err=True)
    refuse_too_large(cases, results=results, at_once=at_once)


def refuse_too_large(cases: Iterable[Case], *, results: bool, at_once: int = 1) -> None:
    """End where runs need more memory than this machine, or its container, has. Arguments as of `consider`."""
    from softbrake.case.plausible import foreseen, in_bytes
    from softbrake.sim.cores import memory

    there = memory()
    for case in cases:
        if (run := foreseen(case, results)) is not None and (needed := at_once * run.memory) > there:
            cells = f"{case.grid.generatrix} x {case.grid.hoop} cells"
            many = f"{at_once} runs of {cells} at once need" if at_once > 1 else f"{cells} need"
            fail(f"grid: {many} about {in_bytes(needed)} of memory, and there are {in_bytes(there)}; a coarser grid is expected")


def warn_of_grid(case: Case) -> None:
    """Say on stderr where the grid of a case is coarser than its scene needs."""
    from softbrake.case.level import coarseness

    if (said := coarseness(case)) is not None:
        typer.echo(said, err=True)


def warn_of_long_steps(cases: Iterable[Case]) -> None:
    """Say once, in a line, what Python would say at every run."""
    import warnings

    from softbrake.case.level import LongStep, long_steps

    if said := long_steps(cases):
        typer.echo(said, err=True)
    warnings.simplefilter("ignore", LongStep)
