"""How commands end, and what they say before they compile."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NoReturn

import typer

if TYPE_CHECKING:
    from types import FrameType

    from softbrake.case.case import Case

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
COMPILING = "10 to 40 s"


def fail(message: object, code: int = BAD_INPUT) -> NoReturn:
    """Say on stderr why the command ends, and end it."""
    typer.echo(str(message), err=True)
    raise typer.Exit(code)


@contextmanager
def leaving_at_once() -> Iterator[None]:
    """End on Ctrl-C as interrupted, at once: the compiler would make errors of its own of it. Nothing may be half written."""
    import os
    import signal

    def leave(number: int, frame: FrameType | None) -> NoReturn:
        typer.echo("interrupted", err=True)
        os._exit(INTERRUPTED)

    before = signal.signal(signal.SIGINT, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def compile_for(cases: Iterable[Case], quiet: bool) -> None:
    """Load what runs of the cases need; say so where it is not compiled yet, and compile it."""
    with leaving_at_once():
        from softbrake.core.jit import before_compiling
        from softbrake.sim.simulation import compile_kernels, kernels_of

        def say() -> None:
            if not quiet:
                typer.echo(f"compiling kernels (first run only, {COMPILING}) ...", err=True)

        with before_compiling(say):
            compile_kernels(kernels_of(cases))
