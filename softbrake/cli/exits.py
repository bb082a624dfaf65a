"""How commands end, and what they say before they compile."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from softbrake.sim.interrupt import interrupts_handled, taken_as_interrupts

if TYPE_CHECKING:
    from softbrake.case.case import Case

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
COMPILING = "10 to 40 s"


def fail(message: object, code: int = BAD_INPUT) -> NoReturn:
    """Say on stderr why the command ends, and end it."""
    typer.echo(str(message), err=True)
    raise typer.Exit(code)


def ending(command: Callable[..., None]) -> Callable[..., None]:
    """A command that SIGTERM and SIGHUP end as Ctrl-C does, with the exit code 128 and their number, as a shell expects."""

    @wraps(command)
    def run(*arguments: Any, **options: Any) -> None:
        came: list[int] = []
        try:
            with taken_as_interrupts(came):
                command(*arguments, **options)
            return
        except KeyboardInterrupt:
            typer.echo("interrupted", err=True)
            code = INTERRUPTED
        except MemoryError as error:
            typer.echo(f"not enough memory: {error}", err=True)
            code = FAILED
        except typer.Exit as end:
            code = end.exit_code
        raise typer.Exit(128 + came[0] if code == INTERRUPTED and came else code)

    return run


@contextmanager
def leaving_at_once() -> Iterator[None]:
    """End on Ctrl-C as interrupted, at once: the compiler would make errors of its own of it. Nothing may be half written."""
    import os

    def leave(number: int) -> NoReturn:
        typer.echo("interrupted", err=True)
        os._exit(128 + number)

    with interrupts_handled(leave):
        yield


def compile_for(cases: Iterable[Case], quiet: bool) -> None:
    """Load what runs of the cases need; say so where it is not compiled yet, and compile it."""
    with leaving_at_once():
        from softbrake.core.jit import before_compiling
        from softbrake.sim.simulation import compile_kernels, kernel_name, kernels_of

        wanted = kernels_of(cases)

        def say() -> None:
            if not quiet:
                names = " and ".join(kernel_name(*each) for each in sorted(wanted))
                typer.echo(f"compiling the kernels of {names} ({COMPILING}, once) ...", err=True)

        with before_compiling(say):
            compile_kernels(wanted)
