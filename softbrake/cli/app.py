"""Commands. Everything slow is imported inside the command that needs it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NoReturn

import typer

from softbrake import __version__

if TYPE_CHECKING:
    from types import FrameType

    from softbrake.case.case import Case
    from softbrake.case.case_file import CaseFile
    from softbrake.sim.summary import Summary
    from softbrake.studies.axes import Designs
    from softbrake.studies.stability_map import Axis, Point
    from softbrake.studies.sweep import Plan

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
COMPILING = "10 to 40 s"
SET_ASIDE = "tolerance: a run chooses its own grid and step; this is about those of the case"
app = typer.Typer(
    help="Braking of a falling cargo by an inflatable shell of fabric and ring belts.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
CasePath = Annotated[Path, typer.Argument(metavar="CASE", help="Case file (YAML).")]
ResultPath = Annotated[Path, typer.Argument(metavar="RESULT", help="Result file of a run (*.vtkhdf).")]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Replace a value of the case, as fabric.E=18.75kN/m. Repeatable."),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Dimensionless = Annotated[bool, typer.Option("--dimensionless", help="Tensions also in the paper's dimensionless form.")]


def _fail(message: object, code: int = BAD_INPUT) -> NoReturn:
    typer.echo(str(message), err=True)
    raise typer.Exit(code)


@contextmanager
def _leaving_at_once() -> Iterator[None]:
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


@app.command()
def run(
    case_file: CasePath,
    overrides: Overrides = None,
    json: Json = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Result file; default: CASE's name with .vtkhdf, here.")
    ] = None,
    no_results: Annotated[bool, typer.Option("--no-results", help="Write no result file.")] = False,
    dimensionless: Dimensionless = False,
    tolerance: Annotated[
        str | None,
        typer.Option("--tolerance", metavar="RATIO", help="As 1%: choose fidelity, grid and Courant number for this error."),
    ] = None,
    budget: Annotated[
        float, typer.Option("--budget", metavar="SECONDS", min=0.0, help="Most CPU time to spend on a tolerance.")
    ] = 60.0,
    with_error_bar: Annotated[
        bool, typer.Option("--error-bar", help="Estimate the numerical error from three coarser neighbours.")
    ] = False,
    with_sensitivity: Annotated[
        bool, typer.Option("--sensitivity", help="What 1 % of each input of CASE does to the answer; four runs an input or more.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Simulate the drop of a case file."""
    if no_results and output is not None:
        _fail("--output and --no-results exclude each other")
    changes = [*(overrides or ()), *([f"tolerance={tolerance}"] if tolerance is not None else ())]
    opened = _open(case_file, changes)
    case = opened.case
    if with_error_bar and case.insists:
        _fail("--error-bar: a run for a tolerance has one already")
    results = _result_file(case_file, output, no_results, ".vtkhdf")

    from softbrake.report import console
    from softbrake.sim.result_file import ResultError, tension_scale
    from softbrake.sim.simulation import Diverged, NotInflated
    from softbrake.studies.error_control import run as simulate

    scale = tension_scale(case) if dimensionless else None
    _check_scale(scale)
    _warn_of_long_steps([case])
    _warn_of_grid(case)
    if case.insists and not quiet:
        typer.echo("tolerance: fidelity, grid and Courant number are chosen, those of the case set aside", err=True)
    _compile([case], quiet)
    try:
        with console.progress(case.shell.height, quiet=quiet) as callback:
            summary = simulate(
                case,
                results,
                callback,
                budget=budget,
                report=None if quiet else console.print_trial,
                with_error_bar=with_error_bar,
            )
        if with_sensitivity and summary.outcome != "interrupted":
            from dataclasses import replace

            from softbrake.sim.result_file import replace_summary
            from softbrake.studies.sensitivity import sensitivities

            with console.runs_progress(quiet=quiet) as count:
                summary = replace(summary, sensitivity=sensitivities(opened, summary, count))
            if results is not None:
                replace_summary(results, summary)
    except Diverged as error:
        if json:
            _show(error.summary, json, scale)
        _fail(error, FAILED)
    except NotInflated as error:
        _fail(error, FAILED)
    except (ResultError, ValueError) as error:
        _fail(error)
    except OSError as error:  # disk full, folder gone
        _fail(f"{results}: {error}", FAILED)
    except KeyboardInterrupt:  # before the first step, or after the last, when the result file is whole
        _fail("interrupted", INTERRUPTED)
    _show(summary, json, scale)
    if summary.outcome == "interrupted":
        raise typer.Exit(INTERRUPTED)
    _check_sound(case, summary)


@app.command()
def check(case_file: CasePath, overrides: Overrides = None) -> None:
    """Check a case file and print what it means, without running it."""
    from softbrake.sim.summary import contact_in_words, fabric_in_words

    opened = _open(case_file, overrides)
    case, designs = opened.case, _designs(opened)
    cloth = case.fabric
    chosen = f"chosen for an error of {case.tolerance:.2g}" if case.tolerance is not None else ""
    cells = chosen or f"{case.grid.generatrix} x {case.grid.hoop} cells (generatrix x hoop)"
    heights = ", ".join(f"{belt.height:.4g}" for belt in case.belts)
    free_fall = (case.cargo.velocity**2 + 2 * case.gravity * case.shell.height) ** 0.5
    idle = f"  without effect      {', '.join(case.without_contact)}\n" if case.without_contact else ""
    typer.echo(
        f"{case_file}: OK\n"
        f"  {case.title}\n"
        f"  grid                {cells}, {case.model.scheme} scheme\n"
        f"  fidelity            {case.model.fidelity}\n"
        f"  belts               {len(case.belts)}{f' at {heights} m' if heights else ''}\n"
        f"  contact             {contact_in_words(case.model.fidelity, case.contact)}\n"
        f"{idle}"
        f"  fabric              {fabric_in_words(cloth.law, cloth.slack, cloth.G12, cloth.E11, cloth.E22)}\n"
        f"  viscosity           {case.fabric.viscosity:.4g} N*s/m\n"
        f"  free-fall velocity  {free_fall:.5f} m/s"
    )
    _warn_of_grid(case)
    if designs.axes:
        typer.echo(f"  sweep               {len(designs.all)} runs over {', '.join(axis.path for axis in designs.axes)}")


@app.command()
def schema() -> None:
    """Print the JSON Schema of case files, for editors."""
    import json

    from softbrake.case.schema import schema as of_cases

    typer.echo(json.dumps(of_cases(), indent=2))


@app.command()
def init(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File to write; - for stdout.")] = Path("case.yaml"),
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
) -> None:
    """Write a commented starter case."""
    from softbrake.case.schema import starter

    if str(file) == "-":
        typer.echo(starter(), nl=False)
        return
    try:
        with file.open("w" if force else "x", encoding="utf-8") as stream:
            stream.write(starter())
    except FileExistsError:
        _fail(f"{file}: exists already; --force replaces it")
    except OSError as error:
        _fail(f"{file}: {error.strerror}")
    typer.echo(f"{file} written; next: softbrake run {file}")


@app.command()
def info(result: ResultPath, json: Json = False, dimensionless: Dimensionless = False) -> None:
    """Print the summary of a result file again."""
    from softbrake.sim.result_file import ResultError, read_history, read_inflation, read_summary, read_tension_scale

    try:
        inflation = read_inflation(result)
        summary = read_summary(result)
        scale = read_tension_scale(result) if dimensionless else None
        history = read_history(result)
    except ResultError as error:
        _fail(error)
    if inflation is not None:
        from softbrake.report import console

        typer.echo(console.inflation_json(inflation)) if json else console.print_inflation(inflation)
    elif summary is not None:
        _check_scale(scale)
        _show(summary, json, scale)
    else:
        from softbrake.report import console

        row = {name: float(history[name][-1]) for name in history.dtype.names or () if len(history)}
        if json:
            typer.echo(console.row_json(row))
        else:
            console.print_unfinished(row)


@app.command()
def plot(
    result: ResultPath,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="PICTURE", help="PNG, SVG or PDF; default: RESULT with .png.")
    ] = None,
    dimensionless: Dimensionless = False,
) -> None:
    """Draw the curves and the deformed profiles of a result file."""
    from softbrake.report.plots.drop import plot_result
    from softbrake.report.plots.style import PlotError
    from softbrake.sim.result_file import ResultError

    picture = output or _beside(result, ".png")
    try:
        plot_result(result, picture, dimensionless)
    except (PlotError, ResultError) as error:
        _fail(error)
    except OSError as error:
        _fail(f"{picture}: {error.strerror or error}")
    typer.echo(f"{picture} written")


@app.command()
def inflate(
    case_file: CasePath,
    overrides: Overrides = None,
    json: Json = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Result file; default: CASE's name with -inflated.vtkhdf, here."),
    ] = None,
    no_results: Annotated[bool, typer.Option("--no-results", help="Write no result file.")] = False,
    residual: Annotated[
        float,
        typer.Option(
            "--residual", metavar="RATIO", min=1e-12, max=0.1, help="Of the forces out of balance over those of the gas."
        ),
    ] = 1e-6,
) -> None:
    """Inflate the shell under its cover, held: shape, tensions, force on the cover."""
    if no_results and output is not None:
        _fail("--output and --no-results exclude each other")
    case = _load(case_file, overrides)
    if case.insists:
        typer.echo(SET_ASIDE, err=True)
    results = _result_file(case_file, output, no_results, "-inflated.vtkhdf")

    from softbrake.report import console
    from softbrake.sim.inflate import inflate as at_rest
    from softbrake.sim.result_file import ResultError
    from softbrake.sim.simulation import NotInflated

    if case.model.fidelity != "lumped":
        _compile([_at(case, "axisymmetric")], quiet=False)
    try:
        answer = at_rest(case, results, residual)
    except ValueError as error:
        _fail(f"{case_file}: {error}")
    except NotInflated as error:
        _fail(error, FAILED)
    except ResultError as error:
        _fail(error)
    except OSError as error:
        _fail(f"{results}: {error}", FAILED)
    except KeyboardInterrupt:
        _fail("interrupted", INTERRUPTED)
    if json:
        typer.echo(console.inflation_json(answer))
    else:
        console.print_inflation(answer)


@app.command()
def stability(
    case_file: CasePath,
    overrides: Overrides = None,
    over: Annotated[
        list[str] | None,
        typer.Option("--over", metavar="PATH=A,B,...", help="Axis of a map, as fabric.viscosity=0,0.2,2. Repeatable."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="PICTURE", help="Map as PNG, SVG or PDF; its points beside it as CSV."),
    ] = None,
) -> None:
    """Find the longest stable step by trial, beside the predicted one; map it over keys of the case."""
    opened = _open(case_file, overrides)

    from softbrake.report.plots.stability_map import draw_map
    from softbrake.report.plots.style import PlotError, check_picture
    from softbrake.studies.stability_map import edge_in_words, find_limit, read_axes, survey, write_csv

    try:
        axes = read_axes(over or ())
    except ValueError as error:
        _fail(error)
    if output is not None and not axes:
        _fail("--output: a map needs at least one axis, --over")
    picture = output or Path(f"{case_file.stem}-stability.png")
    table = picture.with_suffix(".csv")
    if axes:
        try:
            check_picture(picture)
        except PlotError as error:
            _fail(error)
        for file in (picture, table):
            _check_place(file)
    case = _at(opened.case, "full")
    cases = [case, *(_at(one, "full") for one in _cases_along(opened, axes))]
    for one in cases:
        if one.model.fidelity == "lumped":
            _fail(f"{case_file}: a case of fidelity lumped has no grid whose waves could grow; --set model.fidelity=full")
    if case.insists:
        typer.echo(SET_ASIDE, err=True)
    _compile(cases, quiet=False)
    if axes:
        typer.echo("  ".join((*(path for path, _ in axes), "predicted us", "found us", "ratio")))
    points: list[Point] = []

    def report(point: Point) -> None:
        points.append(point)
        typer.echo("  ".join((*point.values, *point.shown)))

    try:
        if axes:
            survey(lambda values: _at(_set(opened, values), "full"), axes, report)
        own = find_limit(case)
    except KeyboardInterrupt:
        if points:
            _write(table, lambda: write_csv(points, axes, table))
        _fail(f"interrupted{f'; {len(points)} points in {table}' if points else ''}", INTERRUPTED)
    if axes:
        _write(table, lambda: write_csv(points, axes, table))
        _write(picture, lambda: draw_map(points, axes, picture))
        typer.echo(f"{picture} and {table} written")
    if not own.edge_found:
        _fail(f"{case_file}: {edge_in_words(own)}", FAILED)
    typer.echo(edge_in_words(own))


@app.command()
def sweep(
    case_file: CasePath,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary", metavar="PATH=VALUES", help="As fabric.E=15kN/m,20kN/m or fabric.E=10kN/m:30kN/m:200[:log]. Repeatable."
        ),
    ] = None,
    mode: Annotated[
        str | None, typer.Option("--mode", metavar="MODE", help="grid, zip or lhs: all combinations, side by side, sampled.")
    ] = None,
    samples: Annotated[int | None, typer.Option("--samples", metavar="N", help="Runs of mode lhs.")] = None,
    seed: Annotated[int | None, typer.Option("--seed", metavar="N", help="Of mode lhs.")] = None,
    overrides: Overrides = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FOLDER", help="Default: CASE's name with -sweep, here.")
    ] = None,
    threads: Annotated[int | None, typer.Option("--threads", metavar="N", min=1, help="Default: one a core.")] = None,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", metavar="ADDRESS", help="Run on the workers of a dask scheduler, tcp://…")
    ] = None,
    shard: Annotated[
        str | None, typer.Option("--shard", metavar="I/N", help="Run each N-th case from the I-th on; see merge.")
    ] = None,
    histories: Annotated[bool, typer.Option("--histories", help="Keep the histories of all runs in histories.h5.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print a JSON object a run, one a line.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Run a case with many values; the same command again goes on where it was broken off."""
    designs = _designs(_open(case_file, overrides), vary, mode=mode, samples=samples, seed=seed)
    if not designs.axes:
        _fail(f"{case_file}: no section sweep; one, or --vary fabric.E=10kN/m:30kN/m:200, is expected")
    if scheduler is not None and threads is not None:
        _fail("--scheduler and --threads exclude each other: workers have threads of their own")
    number, of = _shard(shard)
    folder = output or Path(f"{case_file.stem}-sweep")
    if folder.exists() and not folder.is_dir():
        _fail(f"{folder}: is not a folder; --output must name one")

    from softbrake.report import console
    from softbrake.studies.sweep import Shard, SweepError, read_journals, run_sweep

    _warn_of_long_steps(design.case for design in designs.all)
    if scheduler is None:
        _compile((design.case for design in designs.all), quiet)
    try:
        with console.runs_progress(quiet=quiet) as progress:
            plan = run_sweep(
                designs,
                folder,
                shard=Shard(number, of),
                threads=threads,
                scheduler=scheduler,
                histories=histories,
                progress=progress,
            )
    except SweepError as error:
        _fail(error)
    except KeyboardInterrupt:
        _fail(f"interrupted; the same command goes on from here, softbrake merge {folder} shows what is done", INTERRUPTED)
    if of > 1:
        typer.echo(f"shard {number} of {of} is done; when all are: softbrake merge {folder}", err=True)
        return
    _show_sweep(plan, read_journals(folder), folder, json)


@app.command()
def merge(
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER...", help="Of a sweep; the first one gets the results.")],
    json: Annotated[bool, typer.Option("--json", help="Print a JSON object a run, one a line.")] = False,
) -> None:
    """Put the shards of a sweep together."""
    from softbrake.studies.sweep import SweepError, merge_folders

    try:
        plan, records = merge_folders(folders)
    except SweepError as error:
        _fail(error)
    _show_sweep(plan, records, folders[0], json)


@app.command()
def design(
    case_file: CasePath,
    overrides: Overrides = None,
    path: Annotated[str, typer.Option("--find", metavar="PATH", help="Quantity of the case to find.")] = "pressure.value",
    target: Annotated[
        str, typer.Option("--target", metavar="ANSWER=VALUE", help="As impact_velocity=1.5m/s; 0 is a full stop.")
    ] = "impact_velocity=0",
    between: Annotated[
        str | None,
        typer.Option(
            "--range",
            metavar="LOW:HIGH",
            help="To search; default: a third to three times the case's, of pressure.value that of section 2.2.",
        ),
    ] = None,
    budget: Annotated[
        float,
        typer.Option("--budget", metavar="SECONDS", min=0.0, help="Most CPU time to choose a level, where a tolerance is set."),
    ] = 60.0,
    json: Json = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Find the pressure, or another value, that meets a target."""
    import shlex

    opened = _open(case_file, overrides)
    case = opened.case

    from softbrake.case.case_file import CaseError
    from softbrake.report import console
    from softbrake.studies.inverse_design import NotReached, ask, find, piston

    _warn_of_long_steps([case])
    _compile([case], quiet)
    try:
        question = ask(opened, path, target, between, budget, None if quiet else console.print_trial)
        stop = piston(question.case)
        found = find(question, None if quiet else lambda point: console.print_point(question, point))
    except (CaseError, ValueError) as error:
        _fail(error)
    except NotReached as error:
        _fail(f"{path}: {error}", FAILED)
    except KeyboardInterrupt:
        _fail("interrupted", INTERRUPTED)
    if json:
        typer.echo(console.design_json(question, stop, found))
    else:
        console.print_design(question, stop, found)
        options = [word for change in [*(overrides or ()), f"{path}={found.value:.6g}"] for word in ("--set", change)]
        typer.echo(f"next: {shlex.join(['softbrake', 'run', str(case_file), *options])}")
    if found.missed:
        _fail(f"{path}: {found.missed}", FAILED)
    _check_sound(case, found.summary)


@app.command()
def report(
    result: Annotated[Path, typer.Argument(metavar="RESULT", help="Result file of a run (*.vtkhdf), or folder of a sweep.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="PAGE", help="HTML file; default: RESULT with .html.")
    ] = None,
) -> None:
    """Write all about a result or a sweep as one HTML page."""
    from softbrake.report.html import write_report
    from softbrake.sim.result_file import ResultError

    page = output or _beside(result, ".html")
    if page.suffix != ".html":
        _fail(f"{page}: the name of a page ends in .html")
    if page.resolve() == result.resolve():
        _fail(f"{page}: is the result; --output must name another file")
    try:
        write_report(result, page)
    except ResultError as error:
        _fail(error)
    except OSError as error:
        _fail(f"{page}: cannot be written: {error.strerror or error}")
    typer.echo(f"{page} written")


@app.command("chart")
def work_precision(
    case_file: CasePath,
    overrides: Overrides = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="PICTURE", help="PNG, SVG or PDF; default: CASE's name with -chart.png, here."),
    ] = None,
    budget: Annotated[float, typer.Option("--budget", metavar="SECONDS", min=0.0, help="Time for all runs, about.")] = 120.0,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Chart error against time of all fidelities, grids and steps, and recommend one: a picture and a CSV file of its name."""
    import shlex

    case = _load(case_file, overrides)
    picture = output or Path(f"{case_file.stem}-chart.png")
    table = picture.with_suffix(".csv")
    for file in (picture, table):
        _check_place(file)

    from softbrake.report import console
    from softbrake.report.plots.style import PlotError, check_picture
    from softbrake.report.plots.work_precision import draw_work_precision
    from softbrake.sim.simulation import Diverged
    from softbrake.studies.work_precision import plan, write_csv
    from softbrake.studies.work_precision import work_precision as compute

    try:
        check_picture(picture)
    except PlotError as error:
        _fail(error)
    _compile((setting.apply(case) for setting in plan(case)), quiet)
    try:
        with console.chart_progress(quiet=quiet) as callback:
            found = compute(case, budget, callback)
    except (Diverged, ValueError) as error:
        _fail(error, FAILED)
    if found.reference is None:
        _fail("interrupted before there was a reference; nothing is written", INTERRUPTED)
    try:
        write_csv(found, table)
        draw_work_precision(found, picture)
    except (OSError, PlotError) as error:  # disk full, folder gone
        _fail(error, FAILED)
    sets = "".join(f" --set {shlex.quote(text)}" for text in overrides or ())
    console.print_work_precision(found, f"softbrake run {shlex.quote(str(case_file))}{sets}")
    typer.echo(f"\n{picture}, {table} written")
    if found.interrupted:
        _fail("interrupted", INTERRUPTED)


def _shard(text: str | None) -> tuple[int, int]:
    number, slash, of = (text or "1/1").partition("/")
    if not (slash and number.isdecimal() and of.isdecimal() and 1 <= int(number) <= int(of)):
        _fail(f"--shard {text}: a part of the runs such as 1/4, 2/4, 3/4 or 4/4 is expected")
    return int(number), int(of)


def _show_sweep(plan: Plan, records: dict[str, Any], folder: Path, json: bool) -> None:
    """Write the results of a sweep and print them; exit 1 where a run has no answer."""
    from softbrake.report import console
    from softbrake.report import sweep as sweep_results
    from softbrake.report.plots.style import PlotError

    table = sweep_results.rows(plan, records)
    try:
        sweep_results.write_results(folder, plan, table)
    except OSError as error:
        _fail(f"{folder}: {error.strerror or error}", FAILED)
    if json:
        for row in table:
            typer.echo(console.line_json(row))
    else:
        sweep_results.print_table(plan, table)
    try:
        sweep_results.draw_sweep(plan, table, folder / sweep_results.PICTURE)
        written = f"{sweep_results.RESULTS} and {sweep_results.PICTURE}"
    except PlotError as error:
        typer.echo(str(error), err=True)
        written = sweep_results.RESULTS
    typer.echo(f"{written} in {folder}", err=json)
    if doubtful := sweep_results.doubtful(table):
        what = "energy came from nowhere, peaks and velocity are doubtful"
        typer.echo(f"{len(doubtful)} of {len(table)} runs: {what}; see column doubt, docs/explanation/stability.md", err=True)
    if sweep_results.failures(table) or doubtful:
        raise typer.Exit(FAILED)


@app.command()
def warmup() -> None:
    """Compile the kernels of all fidelities now, so that no run has to."""
    from time import perf_counter

    with _leaving_at_once():
        from softbrake.core.jit import CACHE_FOLDER
        from softbrake.sim.simulation import compile_kernels

        typer.echo("compiling kernels (1 to 3 minutes), or loading those compiled before ...", err=True)
        start = perf_counter()
        compile_kernels(report=lambda name: typer.echo(f"  {name}", err=True))
    typer.echo(f"{perf_counter() - start:.1f} s; kernels are in {CACHE_FOLDER}")


def _open(path: Path, overrides: list[str] | None) -> CaseFile:
    from softbrake.case.case_file import CaseError, open_case

    try:
        return open_case(path, overrides or ())
    except CaseError as error:
        _fail(error)


def _load(path: Path, overrides: list[str] | None) -> Case:
    return _open(path, overrides).case


def _set(file: CaseFile, overrides: Sequence[str]) -> Case:
    from softbrake.case.case_file import CaseError

    try:
        return file.set(overrides).case
    except CaseError as error:
        _fail(error)


def _cases_along(file: CaseFile, axes: Sequence[Axis]) -> list[Case]:
    """Return the case with each value of each axis alone, so that faults are said before the first trial."""
    cases: list[Case] = []
    for path, values in axes:
        along: list[Case] = []
        for value in values:
            one = _set(file, [f"{path}={value}"])
            if one in along:
                _fail(f"--over {path}: the value {value} is there twice, the first time as {values[along.index(one)]}")
            along.append(one)
        cases += along
    return cases


def _designs(file: CaseFile, vary: list[str] | None = None, **settings: str | int | None) -> Designs:
    from softbrake.case.case_file import CaseError
    from softbrake.studies.axes import designs_of

    try:
        return designs_of(file, vary or (), settings)
    except CaseError as error:
        _fail(error)


def _at(case: Case, fidelity: Literal["axisymmetric", "full"]) -> Case:
    """The case at a fidelity where it leaves the choice, for commands that want a grid."""
    from softbrake.case.level import level

    return level(case, fidelity, case.grid.generatrix, case.grid.hoop) if case.model.fidelity == "auto" else case


def _warn_of_grid(case: Case) -> None:
    """Say on stderr where the grid of a case is coarser than its scene needs."""
    from softbrake.case.level import coarseness

    if (said := coarseness(case)) is not None:
        typer.echo(said, err=True)


def _warn_of_long_steps(cases: Iterable[Case]) -> None:
    """Say once, in a line, what Python would say at every run."""
    import warnings

    from softbrake.case.level import LongStep, long_steps

    if said := long_steps(cases):
        typer.echo(said, err=True)
    warnings.simplefilter("ignore", LongStep)


def _compile(cases: Iterable[Case], quiet: bool) -> None:
    """Load what runs of the cases need; say so where it is not compiled yet, and compile it."""
    with _leaving_at_once():
        from softbrake.core.jit import before_compiling
        from softbrake.sim.simulation import compile_kernels, kernels_of

        def say() -> None:
            if not quiet:
                typer.echo(f"compiling kernels (first run only, {COMPILING}) ...", err=True)

        with before_compiling(say):
            compile_kernels(kernels_of(cases))


def _beside(result: Path, suffix: str) -> Path:
    """Name of a file beside a result or a folder; dots in the name of a folder end nothing."""
    named = result if result.name not in ("", "..") else result.resolve()
    return named.parent / f"{named.stem if named.suffix == '.vtkhdf' else named.name}{suffix}"


def _result_file(case_file: Path, output: Path | None, no_results: bool, ending: str) -> Path | None:
    """Result file that is asked for, None without one; by default the case's name with an ending, here."""
    if no_results:
        return None
    results = output or Path(f"{case_file.stem}{ending}")
    _check_writable(results, case_file)
    return results


def _check_writable(results: Path, case_file: Path) -> None:
    """Say before the run what would fail after it."""
    if results.resolve() == case_file.resolve():
        _fail(f"{results}: is the case file; --output must name another one")
    if results.suffix != ".vtkhdf":
        _fail(f"{results}: the name of a result file ends in .vtkhdf, for ParaView to know it")
    _check_place(results)


def _check_place(file: Path) -> None:
    """Say whether a file can be written."""
    import os

    if file.is_dir():
        _fail(f"{file}: is a folder; --output must name a file")
    if not file.parent.is_dir():
        _fail(f"{file}: there is no folder {file.parent}")
    if not os.access(file.parent, os.W_OK) or (file.exists() and not os.access(file, os.W_OK)):
        _fail(f"{file}: may not be written")


def _write(file: Path, write: Callable[[], None]) -> None:
    """Write a file of results; exit 1 where that fails, as the disk is full or the folder gone."""
    from softbrake.report.plots.style import PlotError

    try:
        write()
    except PlotError as error:
        _fail(error, FAILED)
    except OSError as error:
        _fail(f"{file}: {error.strerror or error}", FAILED)


def _check_scale(tension_scale: float | None) -> None:
    if tension_scale == 0.0:
        _fail("--dimensionless: the case has no pressure, and so no scale for tensions")


def _show(summary: Summary, json: bool, tension_scale: float | None) -> None:
    from softbrake.report import console

    if json:
        typer.echo(console.summary_json(summary, tension_scale))
    else:
        console.print_summary(summary, tension_scale)


def _check_sound(case: Case, summary: Summary) -> None:
    """Exit code 1 where a run that came to its end made energy of nothing, or does not reach the tolerance that was asked for."""
    from softbrake.studies.error_control import reached

    faults = []
    if summary.doubt is not None and summary.outcome != "diverged":
        faults.append(f"{summary.doubt}; try fabric.law=tension_field, or a smaller time.courant; docs/explanation/stability.md")
    if not reached(case, summary):
        faults.append(f"the tolerance of {case.tolerance:.3g} was not reached: {summary.fidelity_reason}")
    if faults:
        _fail("\n".join(faults), FAILED)
