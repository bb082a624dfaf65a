"""softbrake calibrate."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softbrake.cli import cases
from softbrake.cli.compare import (
    Channels,
    Class,
    Gravity,
    Interval,
    Pressure,
    Shift,
    TimeName,
    Turned,
    Units,
    read_class,
    read_interval,
    read_test,
    read_time,
)
from softbrake.cli.exits import BAD_INPUT, FAILED, INTERRUPTED, compile_for, fail
from softbrake.cli.files import check_place, drawing, stem, writing
from softbrake.cli.options import CasePath, Json, Overrides, Quiet

if TYPE_CHECKING:
    from softbrake.case.case_file import CaseFile
    from softbrake.studies.calibration import Calibration, FittedInput
    from softbrake.studies.design_space import Variable

OWN = re.compile(r"(.+?):([A-Za-z_][\w.]*=.*)")  # of a test: PATH:KEY=VALUE,KEY=VALUE
NEXT_KEY = re.compile(r",(?=[A-Za-z_][\w.]*=)")


def calibrate(
    case_file: CasePath,
    tests: Annotated[
        list[str],
        typer.Argument(
            metavar="TEST...", help="Files of drop tests; TEST:cargo.velocity=8.2m/s,cargo.mass=510kg has its own values."
        ),
    ],
    fit: Annotated[
        list[str] | None,
        typer.Option(
            "--fit",
            metavar="PATH[=LOW:HIGH]",
            help="Input, as gas.pressure; default: a third to three times the case's. Repeatable.",
        ),
    ] = None,
    overrides: Overrides = None,
    channels: Channels = None,
    units: Units = None,
    time: TimeName = None,
    turned: Turned = None,
    gravity: Gravity = None,
    pressure: Pressure = None,
    cfc: Class = None,
    shift: Shift = None,
    interval: Interval = None,
    starts: Annotated[
        int | None, typer.Option("--starts", metavar="N", min=0, help="Places looked at; default: 16 for each input.")
    ] = None,
    seed: Annotated[int, typer.Option("--seed", metavar="N", min=0, help="Of these places.")] = 0,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Fitted case (YAML), or picture of what is left (PNG, SVG, PDF). Repeatable."
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a case file that is there.")] = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Fit inputs of a case to drop tests, with their intervals, and write the fitted case."""
    from softbrake.case.case import case_to_dict
    from softbrake.report.as_json import calibration_json
    from softbrake.report.console.calibration import print_calibration
    from softbrake.studies.calibration import DropTest, NotCalibrated
    from softbrake.studies.calibration import calibrate as fitted
    from softbrake.studies.design_space import searched
    from softbrake.studies.error_control import BUDGET

    opened = cases.read(case_file, overrides)
    variables = _variables(opened, fit or [])
    files = output or [Path(f"{stem(case_file)}-fitted.yaml")]
    _check_files(files, case_file, force)
    _edited(opened, overrides or (), [each.override(opened.quantity(each.path) or each.low) for each in variables], {})
    asked = read_class(cfc, case_to_dict(opened.case))
    if asked is None:
        fail("--cfc none: noise is judged behind a class; 60, 180, 600 or 1000 is expected")
    given = read_time("--shift", shift)
    within = read_interval(interval)
    read = _of_tests(opened, tests, variables)
    found = []
    for text, path, own in read:
        case = case_to_dict(own.case)
        measured = read_test(path, case, channels, units, time, turned, gravity, pressure)
        found.append((text, own, measured, own.case.gravity if gravity == "in" else 0.0))
    every = [own.case for _, _, own in read]
    cases.warn_of_long_steps(every)
    cases.consider(every, opened)
    compile_for(every, quiet)

    def report(text: str) -> None:
        if not quiet:
            typer.echo(text, err=True)

    try:
        asked_of = [
            DropTest(text, tuple(measured), searched(own, BUDGET, None).load, added) for text, own, measured, added in found
        ]
        values = [opened.quantity(each.path) for each in variables]
        options = {"cfc": asked, "shift": given, "interval": within, "starts": starts, "seed": seed}
        answer = fitted(asked_of, variables, values, report=report, **options)  # type: ignore[arg-type]
    except (ValueError, ImportError) as error:
        fail(error)
    except NotCalibrated as error:
        fail(error, FAILED)
    except KeyboardInterrupt:
        fail("interrupted", INTERRUPTED)
    if json:
        typer.echo(calibration_json(answer))
    else:
        print_calibration(answer)
    for opposed in answer.opposed:
        typer.echo(opposed, err=True)
    for file in files:
        _write(opened, overrides or (), answer, file)
    if answer.undetermined:
        fail("\n".join(answer.undetermined), FAILED)


def _variables(file: CaseFile, texts: Sequence[str]) -> list[Variable]:
    """What is to be fitted."""
    from softbrake.case.case_file import CaseError
    from softbrake.studies.design_space import twice, variable

    if not texts:
        fail("--fit: what is to be fitted is not said; a path such as gas.pressure, or gas.pressure=1kPa:5kPa, is expected")
    pairs = [text.partition("=") for text in texts]
    if repeated := twice([path for path, _, _ in pairs]):
        fail(f"--fit {repeated}: given twice; it is fitted once")
    found = []
    for (path, equals, _), text in zip(pairs, texts, strict=True):
        try:
            each = variable(file, path.strip(), text if equals else None, "--fit", "--fit")
        except ValueError as error:
            fail(error)
        for end in (each.low, each.high):
            try:
                file.vary({each.path: end})
            except CaseError as error:
                fail(each.refused(error.faults[0]))
        found.append(each)
    return found


def _of_tests(file: CaseFile, texts: Sequence[str], fitted: Sequence[Variable]) -> list[tuple[str, Path, CaseFile]]:
    """Each test as it was given, its file, and the case as that test had it."""
    found: list[tuple[str, Path, CaseFile]] = []
    for text in texts:
        path, own = _of_test(file, text, [each.path for each in fitted])
        if any(path.resolve() == other.resolve() and own.case == case.case for _, other, case in found):
            fail(f"{text}: given twice with the same values; a test is fitted once")
        found.append((text, path, own))
    return found


def _of_test(file: CaseFile, text: str, fitted: Sequence[str]) -> tuple[Path, CaseFile]:
    from softbrake.case.case_file import CaseError
    from softbrake.case.overrides import Override
    from softbrake.case.yaml_nodes import Place

    own = OWN.fullmatch(text)
    if own is None:
        return Path(text), file
    changes = [Override(change, Place((1, k, 0), text)) for k, change in enumerate(NEXT_KEY.split(own[2]))]
    for change in changes:
        given = change.text.partition("=")[0].strip()
        if hidden := [path for path in fitted if f"{path}.".startswith(f"{given}.")]:
            fail(f"{text}: {hidden[0]} is fitted, one value for all tests; --fit or values of tests are expected, not both")
    try:
        return Path(own[1]), file.set(changes)
    except CaseError as error:
        fail(error)


def _check_files(files: Sequence[Path], case_file: Path, force: bool) -> None:
    """Say before the fit what would fail after it."""
    from softbrake.report.plots.style import PlotError, check_picture

    for file in files:
        check_place(file)
        if file.suffix in (".yaml", ".yml"):
            if file.resolve() == case_file.resolve():
                fail(f"{file}: is the case file; --output must name another one")
            if file.exists() and not force:
                fail(f"{file}: is there already; --output names another file, --force replaces it")
            continue
        try:
            check_picture(file)
        except PlotError as error:
            fail(f"{error}; that of a case in .yaml" if "ends in" in str(error) else error)


def _edited(file: CaseFile, overrides: Sequence[str], fitted: Sequence[str], comments: dict[str, str]) -> str:
    """The text of the case file with overrides and fitted values; ends the command where it cannot hold them."""
    from softbrake.case.case_file import CaseError, parse_case
    from softbrake.case.edited_text import edited

    changes = {path.strip(): value.strip() for path, _, value in (change.partition("=") for change in (*overrides, *fitted))}
    try:
        text = edited(file.text, changes, comments)
        sound = parse_case(text, file.name) == file.set(list(fitted)).case
    except ValueError as error:
        fail(f"{file.name}: has no place for {error}; write it into the case file first", BAD_INPUT)
    except CaseError:
        sound = False
    if not sound:
        fail(f"{file.name}: has no place for {', '.join(overrides)}; write it into the case file first", BAD_INPUT)
    return text


def _written(one: FittedInput) -> str:
    """A fitted value in the unit shown, of six digits, or of more where its interval has them."""
    from softbrake.report.words import fitted_value

    value = one.value / one.variable.size
    return min(f"{value:.6g}", fitted_value(one), key=lambda text: abs(float(text) - value))


def _write(file: CaseFile, overrides: Sequence[str], answer: Calibration, to: Path) -> None:
    """Write the fitted case, unless something in it is not determined, or a picture."""
    from softbrake.report.plots.calibration import draw_calibration
    from softbrake.report.words import fitted_in_words
    from softbrake.sim.files import draft_of

    if to.suffix not in (".yaml", ".yml"):
        with drawing(to):
            draw_calibration(answer, to)
    elif answer.undetermined:
        return
    else:
        names = ", ".join(dict.fromkeys(each.test for each in answer.channels))
        comments = {each.variable.path: f"fitted to {names}: {fitted_in_words(each)}" for each in answer.inputs}
        values = [f"{each.variable.path}={_written(each)} {each.variable.shown}".rstrip() for each in answer.inputs]
        text = _edited(file, overrides, values, comments)
        with writing(to), draft_of(to) as draft:
            Path(draft).write_bytes(text.encode("utf-8"))
    typer.echo(f"{to} written", err=True)
