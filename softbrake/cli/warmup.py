"""softbrake warmup."""

from __future__ import annotations

import typer

from softbrake.cli.exits import leaving_at_once


def warmup() -> None:
    """Compile the kernels of all fidelities now, so that no run has to."""
    from time import perf_counter

    with leaving_at_once():
        from softbrake.core.jit import CACHE_FOLDER
        from softbrake.sim.simulation import compile_kernels

        typer.echo("compiling kernels (1 to 3 minutes), or loading those compiled before ...", err=True)
        start = perf_counter()
        compile_kernels(report=lambda name: typer.echo(f"  {name}", err=True))
    kept = f"kernels are in {CACHE_FOLDER}" if CACHE_FOLDER is not None else "kernels are not kept"
    typer.echo(f"{perf_counter() - start:.1f} s; {kept}")
