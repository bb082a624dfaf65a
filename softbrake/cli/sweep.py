"""softbrake sweep and merge."""

from __future__ import annotations

from dataclasses import asdict
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from softbrake.cli import cases
from softbrake.cli.exits import FAILED, INTERRUPTED, compile_for, fail
from softbrake.cli.files import stem, writing
from softbrake.cli.options import CasePath, JsonLines, Overrides, Quiet

if TYPE_CHECKING:
    from softbrake.studies.sweep import Plan

Vary = Annotated[
    list[str] | None,
    typer.Option(
        "--vary",
        metavar="PATH=VALUES",
        help="As fabric.E=15kN/m,20kN/m, fabric.E=10kN/m:30kN/m:200[:log] or fabric.E=normal(20kN/m,1kN/m). Repeatable.",
    ),
]
Mode = Annotated[
    str | None, typer.Option("--mode", metavar="MODE", help="grid, zip, random, lhs, sobol or saltelli; docs/how-to/chance.md.")
]
Samples = Annotated[int | None, typer.Option("--samples", metavar="N", help="Of a sampled mode.")]
Seed = Annotated[int | None, typer.Option("--seed", metavar="N", help="Of a sampled mode.")]
Until = Annotated[
    str | None, typer.Option("--until", metavar="RATIO", help="Double samples until the chance that all limits hold is ± this.")
]
Control = Annotated[
    str | None, typer.Option("--control", metavar="FIDELITY", help="Cheaper model whose drops control those of the case's own.")
]
ControlSamples = Annotated[int | None, typer.Option("--control-samples", metavar="N", help="More samples of the control.")]
Folder = Annotated[Path | None, typer.Option("--output", "-o", metavar="FOLDER", help="Default: CASE's name with -sweep, here.")]
Threads = Annotated[int | None, typer.Option("--threads", metavar="N", min=1, help="Default: one a core.")]
Scheduler = Annotated[
    str | None, typer.Option("--scheduler", metavar="ADDRESS", help="Run on the workers of a dask scheduler, tcp://…")
]
Part = Annotated[str | None, typer.Option("--shard", metavar="I/N", help="Run each N-th case from the I-th on; see merge.")]
Histories = Annotated[bool, typer.Option("--histories", help="Keep the histories of all runs in histories.h5; says its size.")]


def sweep(
    case_file: CasePath,
    vary: Vary = None,
    mode: Mode = None,
    samples: Samples = None,
    seed: Seed = None,
    until: Until = None,
    control: Control = None,
    control_samples: ControlSamples = None,
    overrides: Overrides = None,
    output: Folder = None,
    threads: Threads = None,
    scheduler: Scheduler = None,
    shard: Part = None,
    histories: Histories = False,
    json: JsonLines = False,
    force: Annotated[bool, typer.Option("--force", help="Also into a folder with answers of another sweep.")] = False,
    quiet: Quiet = False,
) -> None:
    """Run a case with many values; the same command again goes on where it was broken off."""
    opened = cases.read(case_file, overrides)
    settings = {"mode": mode, "samples": samples, "seed": seed, "until": until}
    grown = cases.growing(opened, vary, **settings, control=control, control_samples=control_samples)
    designs, wanted = next(grown)
    if not designs.axes:
        fail(f"{opened.name}: no section sweep; one, or --vary fabric.E=10kN/m:30kN/m:200, is expected")
    if scheduler is not None and threads is not None:
        fail("--scheduler and --threads exclude each other: workers have threads of their own")
    number, of = _shard(shard)
    if wanted is not None and of > 1:
        fail("--shard: a sweep until an accuracy is one process, which sees all answers; --scheduler spreads its runs")
    if wanted is not None and not opened.case.limits:
        fail(f"--until: {opened.name} has no section limits, whose chance it asks for")
    folder = output or Path(f"{stem(case_file)}-sweep")
    if folder.exists() and not folder.is_dir():
        fail(f"{folder}: is not a folder; --output must name one")

    from softbrake.report.console.progress import runs_progress
    from softbrake.sim.cores import cores
    from softbrake.studies.sweep import NotKept, SchedulerLost, Shard, SweepError, passing, run_sweep

    if designs.sampling is not None and wanted is None and (said := designs.sampling.unbalanced) is not None:
        typer.echo(said, err=True)
    cases.warn_of_long_steps(design.case for design in designs.all)
    at_once = 1 if scheduler else min(threads or cores(), len(designs.all))
    cases.consider((design.case for design in designs.all), opened, at_once=at_once)
    if scheduler is None:
        compile_for((design.case for design in designs.all), quiet)
    missed = False
    records: dict[str, Any] = {}
    try:
        with runs_progress(quiet=quiet) as progress:
            for some, _ in chain([(designs, wanted)], grown):
                plan = run_sweep(
                    some,
                    folder,
                    shard=Shard(number, of),
                    threads=threads,
                    scheduler=scheduler,
                    histories=histories,
                    force=force,
                    growing=wanted is not None,
                    records=records,
                    progress=progress,
                    told=lambda text: typer.echo(text, err=True),
                )
                if wanted is None:
                    break
                found = passing(plan, records)
                missed = found.half > wanted
                if not quiet:
                    typer.echo(f"{len(plan.runs)} samples: {found.value:.4g} pass, ± {found.half:.2g}", err=True)
                if not missed:
                    break
    except (NotKept, SchedulerLost) as error:
        fail(error, FAILED)
    except SweepError as error:
        fail(error)
    except KeyboardInterrupt:
        fail(f"interrupted; the same command goes on from here, softbrake merge {folder} shows what is done", INTERRUPTED)
    if of > 1:
        typer.echo(f"shard {number} of {of} is done; when all are: softbrake merge {folder}", err=True)
        return
    _show(plan, records, folder, json)
    if missed:
        fail(f"--until {wanted:g}: not reached by {len(plan.runs)} samples, which leave ± {found.half:.2g}", FAILED)


def merge(
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER...", help="Of a sweep; the first one gets the results.")],
    json: JsonLines = False,
) -> None:
    """Put the shards of a sweep together."""
    from softbrake.studies.sweep import SweepError, merge_folders

    try:
        plan, records = merge_folders(folders)
    except SweepError as error:
        fail(error)
    _show(plan, records, folders[0], json)


def _shard(text: str | None) -> tuple[int, int]:
    number, slash, of = (text or "1/1").partition("/")
    if not (slash and number.isdecimal() and of.isdecimal() and 1 <= int(number) <= int(of)):
        fail(f"--shard {text}: a part of the runs such as 1/4, 2/4, 3/4 or 4/4 is expected")
    return int(number), int(of)


def _show(plan: Plan, records: dict[str, Any], folder: Path, json: bool) -> None:
    """Write the results of a sweep and print them; exit 1 where a run has no answer."""
    from softbrake.report.as_json import line_json
    from softbrake.report.console.chance import print_chance
    from softbrake.report.console.sweep import print_table
    from softbrake.report.plots.chance import PICTURE as CHANCE_PICTURE
    from softbrake.report.plots.chance import draw_chance
    from softbrake.report.plots.style import PlotError
    from softbrake.report.plots.sweep import PICTURE, draw_sweep
    from softbrake.report.results_csv import chance_in, doubtful, failures, rows, write_results
    from softbrake.studies.sweep import RESULTS

    table = rows(plan, records)
    if json:
        for row in table:
            typer.echo(line_json(row))
    else:
        print_table(plan, table)
    with writing(folder / RESULTS):
        write_results(folder, plan, table)
    chance = None if plan.sampling is None else chance_in(plan.sampling, plan.case, table)
    if chance is not None:
        if json:
            typer.echo(line_json({"chance": asdict(chance)}))
        else:
            print_chance(plan, chance)
    picture = folder / (PICTURE if chance is None else CHANCE_PICTURE)
    written = f"{RESULTS} and {picture.name}"
    try:
        with writing(picture):
            if chance is None:
                draw_sweep(plan, table, picture)
            else:
                draw_chance(chance, plan.title, plan.axes, plan.case, table, picture)
    except PlotError as error:
        typer.echo(str(error), err=True)
        written = RESULTS
    typer.echo(f"{written} in {folder}", err=json)
    if odd := doubtful(table):
        what = "energy came from nowhere, peaks and velocity are doubtful"
        typer.echo(f"{len(odd)} of {len(table)} runs: {what}; see column doubt, docs/explanation/stability.md", err=True)
    if failures(table) or odd:
        raise typer.Exit(FAILED)
