"""The command line. Everything slow is imported inside the command that needs it."""

from __future__ import annotations

from typing import Annotated

import typer

from softbrake import __version__
from softbrake.cli import chart, check, design, inflate, result, run, stability, sweep, warmup

COMMANDS = (  # in the order of --help
    run.run,
    check.check,
    check.schema,
    check.init,
    result.info,
    result.plot,
    result.export,
    inflate.inflate,
    stability.stability,
    sweep.sweep,
    sweep.merge,
    design.design,
    result.report,
    chart.chart,
    warmup.warmup,
)
app = typer.Typer(
    help="Braking of a falling cargo by an inflatable shell of fabric and ring belts.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
for command in COMMANDS:
    app.command()(command)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"softbrake {__version__}")
        raise typer.Exit


@app.callback()
def main(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    pass
