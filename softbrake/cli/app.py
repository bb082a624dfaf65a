"""The command line. Everything slow is imported inside the command that needs it."""

from __future__ import annotations

import atexit
import codecs
import gc
import io
import os
import sys
from typing import Annotated, Any

import typer

from softbrake import __version__
from softbrake.cli import calibrate, chart, check, compare, design, inflate, result, run, stability, sweep, warmup
from softbrake.cli.exits import ending

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
    compare.compare,
    calibrate.calibrate,
    chart.chart,
    warmup.warmup,
)


RARELY = (200_000, 20, 100)  # garbage is looked for: more than a start makes, nearly all of which lives to the end


class Ascii(io.TextIOWrapper):
    """ASCII under another name: Click takes ASCII for a mistake, and would write UTF-8."""

    encoding = "latin-1"


def replacing(stream: Any) -> Any:
    """Return stdout or stderr so that characters which its code page has not are replaced: no answer is lost to one of them."""
    if not isinstance(stream, io.TextIOWrapper):
        return stream
    if codecs.lookup(stream.encoding).name == "ascii":
        buffered = stream.line_buffering
        return Ascii(stream.detach(), "ascii", "replace", line_buffering=buffered)
    stream.reconfigure(errors="replace")
    return stream


class App(typer.Typer):
    """The command line as a program runs it."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # they wait busily, and no matrix here is large enough for two
        gc.set_threshold(*RARELY)
        atexit.register(gc.freeze)  # what is there at the end goes with the process
        sys.stdout, sys.stderr = replacing(sys.stdout), replacing(sys.stderr)
        return super().__call__(*arguments, **options)


app = App(
    help="Braking of a falling cargo by an inflatable shell of fabric and ring belts.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
for command in COMMANDS:
    app.command()(ending(command))


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
