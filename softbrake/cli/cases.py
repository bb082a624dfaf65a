"""Cases as the commands read them, and what is odd about them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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
    """The cases of the sweep of a file."""
    from softbrake.case.case_file import CaseError
    from softbrake.studies.axes import designs_of

    try:
        return designs_of(file, vary or (), settings)
    except CaseError as error:
        fail(error)


def at_fidelity(case: Case, fidelity: Literal["axisymmetric", "full"]) -> Case:
    """The case at a fidelity where it leaves the choice, for commands that want a grid."""
    from softbrake.case.level import level

    return level(case, fidelity, case.grid.generatrix, case.grid.hoop) if case.model.fidelity == "auto" else case


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
