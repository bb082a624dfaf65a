"""The command line: what it prints where, its exit codes, and what it must not load."""

import importlib
import io
import json
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import asdict, replace
from pathlib import Path

import pytest
import synthetic_drop
from conftest import PATIENCE, Command, start
from numba.core import event
from rich.console import Console
from typer.testing import CliRunner, Result

from softbrake.case.case_file import parse_case
from softbrake.case.schema import starter
from softbrake.cli.app import app
from softbrake.cli.exits import compile_for
from softbrake.core.jit import CACHE_FOLDER
from softbrake.report.as_json import summary_json
from softbrake.report.console.progress import progress
from softbrake.report.console.summary import print_summary
from softbrake.sim.simulation import ALL_KERNELS, Progress
from softbrake.sim.summary import (
    Ensemble,
    FilteredPeaks,
    GasBalance,
    PeakValue,
    Sensitivities,
    Sensitivity,
    Summary,
    Trial,
    Work,
)

SMALL = ("--set", "grid.generatrix=8", "--set", "grid.hoop=12", "--set", "time.end=5ms")
SLOW = {"h5py", "matplotlib", "numba", "numpy", "rich", "scipy"}


def summary() -> Summary:
    """A summary with nothing missing and a title of the usual length."""
    tensions = ("peak_tension_generatrix", "peak_tension_hoop", "peak_tension_belt")
    return replace(
        synthetic_drop.summary(),
        title="Braking of 100 kg by a belted cylinder (paper, section 4)",
        peak_tension_belt=28712.0,
        peaks={name: PeakValue(1.0, 0.01234, 0.3) for name in tensions} | {"peak_deceleration": PeakValue(20.0, 0.004)},
    )


def printed(answer: Summary, scale: float | None = None) -> str:
    stream = io.StringIO()
    print_summary(answer, scale, Console(file=stream, width=80))
    return stream.getvalue()


# What must stay fast


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["check", "PAPER"], ["schema"], ["init", "-"]], ids=" ".join)
def test_light_commands_load_nothing_slow(arguments: list[str], paper: Path, tmp_path: Path, environment: dict[str, str]) -> None:
    code = f"""
import sys, time
from softbrake.cli.app import app
try:
    app({[str(paper) if word == "PAPER" else word for word in arguments]!r})
except SystemExit as end:
    print(end.code, time.process_time(), *{SLOW!r}.intersection(sys.modules), file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True)
    exit_code, seconds, *loaded = done.stderr.split()
    assert exit_code == "0"
    assert loaded == []
    assert float(seconds) < 0.5


def test_package_gives_its_functions_and_loads_nothing(environment: dict[str, str]) -> None:
    code = f"""
import sys, softbrake
assert not {SLOW | {"yaml"}!r}.intersection(sys.modules)
import softbrake.sim.simulation, softbrake.case.case_file, softbrake.studies.error_control
from softbrake import load_case, run
assert softbrake.run is run is softbrake.studies.error_control.run
assert load_case is softbrake.case.case_file.load_case
"""
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


# check, schema, init, version


def test_version(softbrake: Command) -> None:
    done = softbrake("--version")
    assert (done.returncode, done.stdout) == (0, "softbrake 0.1.0\n")


def test_check_prints_a_digest(softbrake: Command, paper: Path) -> None:
    done = softbrake("check", paper, "--set", "fabric.viscosity=0.3")
    assert (done.returncode, done.stderr) == (0, "")
    assert f"{paper}: OK" in done.stdout
    assert "36 x 90 cells" in done.stdout
    assert "3 at 0.15, 0.3, 0.45 m" in done.stdout
    assert "0.3 N*s/m" in done.stdout
    assert "6.91144 m/s" in done.stdout


def test_faults_go_to_stderr_and_exit_2(softbrake: Command, tmp_path: Path) -> None:
    case = tmp_path / "typo.yaml"
    case.write_text("shel: {diameter: 0.5 m, height: 0.6 m}\ncargo: {mass: -1 kg, velocity: 6 m/s}\n")
    for command in ("check", "run"):
        done = softbrake(command, "typo.yaml")
        assert (done.returncode, done.stdout) == (2, "")
        assert "typo.yaml:1:1: shel: " in done.stderr
        assert "typo.yaml:2:" in done.stderr
        assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["typo.yaml"]


def test_case_comes_on_stdin(paper: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    lumped = ("--set", "model.fidelity=lumped")

    def piped(text: str, *words: str) -> Result:
        return CliRunner().invoke(app, words, input=text)

    case = paper.read_text(encoding="utf-8")
    assert piped(case, "check", "-").stdout.startswith("stdin: OK\n")
    assert piped("# Прыжок\nshel: 1", "check", "-").stderr.startswith("stdin:2:1: shel: unknown key; did you mean 'shell'?")
    assert piped("", "run", "-").stderr == "stdin:1:1: an empty file; sections such as 'shell:' are expected\n"
    assert list(tmp_path.iterdir()) == []
    assert piped(case, "run", "-", *lumped).exit_code == 0
    assert piped(case, "sweep", "-", *lumped, "--vary", "cargo.mass=90 kg,100 kg").exit_code == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["stdin-sweep", "stdin.vtkhdf"]


@pytest.mark.skipif(not Path("/dev/stdin").exists(), reason="the system has none")
def test_case_comes_from_dev_stdin(paper: Path, environment: dict[str, str]) -> None:
    words = [sys.executable, "-m", "softbrake", "check", "/dev/stdin"]
    done = subprocess.run(words, env=environment, input=paper.read_bytes(), capture_output=True, timeout=PATIENCE)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.startswith(b"/dev/stdin: OK\n")


def test_schema_is_json(softbrake: Command) -> None:
    done = softbrake("schema")
    assert done.returncode == 0
    assert "fabric" in json.loads(done.stdout)["properties"]


def test_check_says_which_contact_does_nothing(softbrake: Command, paper: Path) -> None:
    def said(*overrides: str) -> str:
        return softbrake("check", paper, *(word for override in overrides for word in ("--set", override))).stdout

    unused = ("friction=0.3", "cargo.height=0.2", "cargo.diameter=0.3")
    assert "  contact             none: gas alone, no fabric\n" in said("model.fidelity=lumped", "contact=full")
    assert "  without effect      friction, cargo.diameter, cargo.height\n" in said("model.fidelity=lumped", *unused)
    assert "  without effect      friction, cargo.diameter, cargo.height\n" in said("contact=[folds]", *unused)
    assert "  contact             ground; folds may pass through each other\n" in said("contact=ground", *unused)
    assert "  without effect      cargo.diameter, cargo.height\n" in said("contact=ground", *unused)
    assert "without effect" not in said("contact=solid", *unused)


def test_init_writes_a_case_that_checks_and_never_overwrites_unasked(softbrake: Command, tmp_path: Path) -> None:
    starter = softbrake("init", "-").stdout
    assert softbrake("init").returncode == 0
    assert (tmp_path / "case.yaml").read_text() == starter
    assert softbrake("check", "case.yaml").returncode == 0

    (tmp_path / "mine.yaml").write_text("mine")
    refused = softbrake("init", "mine.yaml")
    assert refused.returncode == 2
    assert "--force" in refused.stderr
    assert (tmp_path / "mine.yaml").read_text() == "mine"
    assert softbrake("init", "mine.yaml", "--force").returncode == 0
    assert (tmp_path / "mine.yaml").read_text() == starter


# A user's mistakes: exit 2, one line, no traceback, nothing written


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "missing.yaml"], "missing.yaml"),
        (["run"], "Missing argument"),
        (["run", "drop.vtkhdf", "-o", "drop.vtkhdf"], "drop.vtkhdf: is the case file"),
        (["run", "PAPER", "-o", "nowhere/drop.vtkhdf"], "there is no folder nowhere"),
        (["run", "PAPER", "-o", "folder.vtkhdf"], "folder.vtkhdf: is a folder"),
        (["run", "PAPER", "-o", "drop.h5"], "ends in .vtkhdf"),
        (["run", "PAPER", "-o", "drop.vtkhdf", "--no-results"], "exclude each other"),
        (["run", "PAPER", "--no-results", "--dimensionless", "--set", "pressure.value=0"], "no pressure"),
        (["check", "folder.vtkhdf"], "folder.vtkhdf"),
        (["init", "nowhere/case.yaml"], "nowhere/case.yaml: there is no folder nowhere"),
        (["info", "missing.vtkhdf"], "missing.vtkhdf"),
        (["info", "junk.vtkhdf"], "junk.vtkhdf"),
        (["plot", "missing.vtkhdf"], "missing.vtkhdf"),
        (["plot", "junk.vtkhdf"], "junk.vtkhdf"),
        (
            ["plot", "PAPER"],
            "cannot be read: damaged, or not a result file; a result file of softbrake run (*.vtkhdf) is expected",
        ),
        (["plot", "folder.vtkhdf"], "Is a directory; a result file of softbrake run (*.vtkhdf) is expected"),
        (["run", "PAPER", "--tolerance", "1"], "--tolerance 1: tolerance: 1 is out of range"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_mistakes(softbrake: Command, paper: Path, tmp_path: Path, arguments: list[str], message: str) -> None:
    (tmp_path / "folder.vtkhdf").mkdir()
    (tmp_path / "junk.vtkhdf").write_text("junk")
    (tmp_path / "drop.vtkhdf").write_text(paper.read_text())
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    done = softbrake(*(paper if word == "PAPER" else word for word in arguments))
    assert done.returncode == 2
    assert done.stdout == ""
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before


def test_divergence_is_one_line_and_exit_1(paper: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = importlib.import_module("softbrake.sim.simulation")

    def diverge(*_: object, **__: object) -> None:
        raise module.Diverged("step 7, t = 1 ms: a velocity is not a number", replace(summary(), outcome="diverged"))

    monkeypatch.setattr(module.Simulation, "to_end", diverge)
    done = CliRunner().invoke(app, ["run", str(paper), "--no-results", "--json", "-q"])
    assert done.exit_code == 1
    assert json.loads(done.stdout)["outcome"] == "diverged"
    assert done.stderr == "step 7, t = 1 ms: a velocity is not a number\n"


# The summary


def test_summary_fits_80_columns_and_says_everything() -> None:
    for answer in (summary(), replace(summary(), outcome="stopped", impact_velocity=None, impact_time=None)):
        for scale in (None, 4709.0):
            text = printed(answer, scale)
            assert max(map(len, text.splitlines())) <= 80
            assert "\x1b" not in text
            assert "…" not in text
    text = printed(summary(), 4709.0)
    for piece in (
        "Impact: the cover reached the ground at 0.12 s.",
        "3.60000 m/s    at 0.12000 s",
        "47.9% of free fall",
        "20.00 m/s^2  2.04 g net, at 0.00400 s",
        "28.712 kN/m   6.097 T0/L, at 0.01234 s, 0.300 m up",
        "-1140.000 J",
        "1.00e-14",
        "1200 steps of 100 us",
        "36 x 90 cells",
        "results in drop.vtkhdf",
    ):
        assert piece in text


@pytest.mark.parametrize("width", range(40, 201, 8))
def test_no_number_of_a_summary_is_cut(width: int) -> None:
    """Numbers longer than their columns, at each width; notes are left out with a word where there is no room for them."""
    answer = replace(
        summary(),
        work=Work(-110890.0123, 7654321.123, 0.0, 0.0, 447.0, 0.0, 0.0),
        peak_deceleration=11311234.25,
        trials=[Trial("axisymmetric", 36, 90, 123456.7891, 0.00123, 1234.5, "grids beside it agree")],
        sensitivity=Sensitivities(
            [Sensitivity("belts.line_density", 1.0, {"impact_velocity": -123456.78, "peak_deceleration": 0.5})],
            *({"impact_velocity": 0.1, "peak_deceleration": 0.1} for _ in range(3)),
            {},
        ),
    )
    stream = io.StringIO()
    print_summary(answer, 4709.0, Console(file=stream, width=width, markup=False, highlight=False))
    text = stream.getvalue()
    for number in ("-110890.012", "7654321.123", "11311234.25", "123456.7891", "-123456.78"):
        assert number in text.split()
    assert "…" not in text and max(map(len, text.splitlines()[1:])) <= width  # but for the title
    assert ("47.9%" in text) != ("left out, for want of room: notes" in text)


def test_peaks_of_ensembles_and_peaks_that_are_none_say_no_more_than_is_known() -> None:
    mean = replace(summary(), ensemble=Ensemble(7, 3.5, 3.7, 1e-6, 1e-3))
    lines = [" ".join(line.split()) for line in printed(mean).splitlines()]
    assert "peak tension, hoop 8.000 kN/m in one drop at 0.01234 s, 0.300 m up" in lines
    none = {name: PeakValue(2e-11, 0.0, 0.0, "overshoot") for name in summary().peaks}
    assert "0.00000 s" not in printed(replace(summary(), peaks=none))


def test_phases_and_filtered_peaks_stand_below_their_peak() -> None:
    peaks = {
        "peak_deceleration": PeakValue(20.0, 0.004, None, "overshoot", PeakValue(12.5, 0.05, None, "crushing")),
        "peak_tension_hoop": PeakValue(8e3, 0.06, 0.3, "crushing", PeakValue(6e3, 0.003, 0.2, "overshoot")),
    }
    behind = FilteredPeaks(
        180,
        None,
        PeakValue(18.0, 0.005, None, "overshoot"),
        PeakValue(3e3, 0.002, None, "overshoot"),
        PeakValue(7e3, 0.061, None, "crushing"),
    )
    lines = [" ".join(line.split()) for line in printed(replace(summary(), peaks=peaks, filtered=behind)).splitlines()]
    first = lines.index("peak deceleration, 1 kHz 20.00 m/s^2 2.04 g net, at 0.00400 s, overshoot")
    assert lines[first + 1 : first + 3] == [
        "crushing 12.50 m/s^2 at 0.05000 s",
        "CFC 180 18.00 m/s^2 at 0.00500 s, overshoot",
    ]
    hoop = lines.index("peak tension, hoop 8.000 kN/m at 0.06000 s, 0.300 m up, crushing")
    assert lines[hoop - 1] == "CFC 180 3.000 kN/m at 0.00200 s, overshoot"
    assert lines[hoop + 1 : hoop + 3] == [
        "overshoot 6.000 kN/m at 0.00300 s, 0.200 m up",
        "CFC 180 7.000 kN/m at 0.06100 s, crushing",
    ]
    coarse = printed(replace(summary(), filtered=FilteredPeaks(1000, "rows 0.75 ms apart, 0.1 allowed")))
    assert "CFC 1000 – rows 0.75 ms apart, 0.1 allowed" in [" ".join(line.split()) for line in coarse.splitlines()]
    assert "CFC" not in printed(summary())


@pytest.mark.parametrize(
    ("outcome", "words"),
    [("stopped", "came to rest"), ("time_limit", "no impact"), ("diverged", "not an answer"), ("interrupted", "Interrupted")],
)
def test_outcome_in_words(outcome: str, words: str) -> None:
    assert words in printed(replace(summary(), outcome=outcome))  # type: ignore[arg-type]


def test_a_gas_has_its_peaks_its_vents_and_its_energy() -> None:
    answer = replace(
        summary(),
        outcome="rebound",
        end_time=0.09,
        impact_velocity=None,
        impact_time=None,
        velocity_reduction=None,
        rest_time=0.02104,
        rebound_velocity=4.5,
        peak_pressure=47971.1,
        peak_temperature=319.222,
        vented_mass=0.05,
        gas_mass=0.15,
        vent_opening_times=[0.0, 0.01236, None],
        peak_errors={"peak_pressure": 120.0},
        gas=GasBalance(gained=-10.0, work=-30.0, enthalpy_out=41.0, enthalpy_in=1.0, heat=0.0),
        peaks=summary().peaks | {name: PeakValue(1.0, 0.021, None, "crushing") for name in ("peak_pressure", "peak_temperature")},
    )
    text = printed(answer)
    lines = [" ".join(line.split()) for line in text.splitlines()]
    for line in (
        "lowest height 0.02400 m first at rest at 0.02104 s",
        "rebound velocity 4.50000 m/s upwards, at 0.09000 s",
        "peak pressure, gauge 47.9711 kPa ± 0.12, at 0.02100 s, crushing",
        "peak temperature 319.22 K at 0.02100 s, crushing",
        "vented mass 0.05000 kg 25.0% of the gas",
        "vents.0 opens at once",
        "vents.1 opens 0.01236 s",
        "vents.2 opens never",
        "energy gained by the gas -10.000 J internal",
        "by compression 30.000 J by shell and ambient pressure",
        "by outflow -41.000 J enthalpy of the gas that left",
        "by inflow 1.000 J enthalpy of the gas that came in",
    ):
        assert line in lines
    assert "height of first contact at 0.09 s, rising at 4.5 m/s" in " ".join(lines)
    assert "by heat" not in text
    assert max(map(len, text.splitlines())) <= 80
    closed = printed(replace(answer, vented_mass=0.0, vent_opening_times=[]))
    assert "vented" not in closed and "opens" not in closed
    assert not {"gas", "temperature", "rebound", "rest"} & set(re.findall("[a-z]+", printed(summary())))


def test_a_run_without_belts_or_impact_leaves_their_lines_out() -> None:
    text = printed(replace(summary(), peak_tension_belt=None, impact_velocity=None, impact_time=None, velocity_reduction=None))
    assert "peak tension, belt" not in text
    assert "impact velocity" not in text


def test_a_long_path_is_not_broken() -> None:
    path = "/" + "long/" * 30 + "drop.vtkhdf"
    assert f"results in {path}\n" in printed(replace(summary(), results=path))


def test_brackets_in_a_title_are_no_markup() -> None:
    assert "[bold]drop[/]" in printed(replace(summary(), title="[bold]drop[/]"))


def test_json_holds_the_summary_and_on_request_the_dimensionless_tensions() -> None:
    plain = json.loads(summary_json(summary()))
    assert plain == asdict(summary())
    scaled = json.loads(summary_json(replace(summary(), peak_tension_belt=None), 4000.0))["dimensionless"]
    assert scaled == {
        "tension_scale": 4000.0,
        "peak_tension_generatrix": 1.0,
        "peak_tension_hoop": 2.0,
        "peak_tension_belt": None,
    }


@pytest.mark.parametrize(
    ("made", "words"),
    [(0.0, ["energy from nowhere none"]), (1e-17, ["energy from nowhere none"]), (0.0234, ["energy made by fabric 2.3 %"])],
)
def test_energy_made_by_fabric_in_words(made: float, words: list[str]) -> None:
    given = replace(summary(), energy_made={"fabric": made, "belts": 0.0, "viscosity": 0.0})
    lines = [" ".join(line.split("  of the")[0].split()) for line in printed(given).splitlines()]
    assert [line for line in lines if line.startswith(("energy from", "energy made"))] == words


def test_json_knows_no_nan() -> None:
    assert json.loads(summary_json(replace(summary(), energy_error=float("nan"))))["energy_error"] is None


# Progress


def test_progress_in_a_pipe_is_a_line_every_two_seconds(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter([0.0, 0.5, 1.9, 2.1, 2.1, 2.3, 4.2, 4.2])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    with progress(0.6, quiet=False) as callback:
        assert callback is not None
        for step in range(5):
            callback(Progress(0.01 * step, 0.5, 5.5, step, 0.3))
    out, err = capsys.readouterr()
    assert out == ""
    assert [line.split()[:2] for line in err.splitlines()] == [["t", "0.0200"], ["t", "0.0400"]]


def test_quiet_has_no_progress() -> None:
    with progress(0.6, quiet=True) as callback:
        assert callback is None


# Result files


def test_info_of_a_killed_run(tmp_path: Path) -> None:
    file = tmp_path / "killed.vtkhdf"
    synthetic_drop.write(file, synthetic_drop.case(), finished=False)
    told = CliRunner().invoke(app, ["info", str(file)])
    assert told.exit_code == 0
    assert "did not finish" in told.stdout
    assert "0.12 s" in told.stdout
    answer = json.loads(CliRunner().invoke(app, ["info", str(file), "--json"]).stdout)
    assert answer["outcome"] == "unfinished"
    assert answer["last_row"]["time"] == 0.12


def test_info_repeats_the_summary_and_scales_tensions(tmp_path: Path) -> None:
    file = tmp_path / "drop.vtkhdf"
    synthetic_drop.write(file, synthetic_drop.case())
    assert json.loads(CliRunner().invoke(app, ["info", str(file), "--json"]).stdout) == asdict(
        replace(synthetic_drop.summary(), results=str(file))
    )
    assert "1.699 T0/L" in CliRunner().invoke(app, ["info", str(file), "--dimensionless"]).stdout


def test_plot_names_its_picture_after_the_result(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    file = tmp_path / "drop.vtkhdf"
    synthetic_drop.write(file, synthetic_drop.case())
    done = CliRunner().invoke(app, ["plot", str(file)])
    assert done.exit_code == 0, done.output
    assert done.stdout == f"{tmp_path / 'drop.png'} written\n"
    assert (tmp_path / "drop.png").read_bytes().startswith(b"\x89PNG")


# End to end


def test_run_writes_one_json_object_and_a_file_that_says_the_same(softbrake: Command, paper: Path, tmp_path: Path) -> None:
    done = softbrake("run", paper, *SMALL, "--json")
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert answer["outcome"] == "time_limit"
    assert answer["impact_velocity"] is None
    assert (answer["model"]["generatrix"], answer["model"]["hoop"]) == (8, 12)
    assert answer["results"] == "paper.vtkhdf"
    assert [path.name for path in tmp_path.iterdir()] == ["paper.vtkhdf"]
    assert json.loads(softbrake("info", "paper.vtkhdf", "--json").stdout) == answer


def test_run_for_people(softbrake: Command, paper: Path, tmp_path: Path) -> None:
    done = softbrake("run", paper, *SMALL, "--no-results", "--dimensionless", "-q")
    assert done.returncode == 0
    assert re.fullmatch(
        r"coarse grid: grid.generatrix 8, where this scene needs 44 and .*; answers may be off by .*\n", done.stderr
    )
    assert "no impact by 0.005 s" in done.stdout
    assert "T0/L" in done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 80
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "number", [signal.SIGINT, *(pytest.param(other, marks=pytest.mark.slow) for other in (signal.SIGTERM, signal.SIGHUP))]
)
def test_interrupt_leaves_a_readable_file(
    softbrake: Command, paper: Path, tmp_path: Path, environment: dict[str, str], number: int
) -> None:
    fine = ("--set", "grid.generatrix=180", "--set", "grid.hoop=450")
    with start("run", paper, *fine, "-o", "cut.vtkhdf", environment=environment, folder=tmp_path) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if line.startswith("t "):
                break
        process.send_signal(number)
        out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + number
    assert "Traceback" not in err
    assert "Interrupted at" in out
    answer = json.loads(softbrake("info", "cut.vtkhdf", "--json").stdout)
    assert answer["outcome"] == "interrupted"
    assert answer["steps"] > 0


def test_ctrl_c_where_a_command_does_not_expect_it(paper: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(importlib.import_module("softbrake.case.case_file"), "open_case", interrupt)
    for command in ("check", "run", "design"):
        done = CliRunner().invoke(app, [command, str(paper)])
        assert (done.exit_code, done.stdout, done.stderr) == (130, "", "interrupted\n")


@pytest.mark.slow
def test_warmup_leaves_nothing_to_compile(paper: Path, tmp_path: Path, environment: dict[str, str]) -> None:
    """In a folder of its own, with what is compiled already: others write to theirs."""
    folder = tmp_path / "cache" / "softbrake" / CACHE_FOLDER.name
    shutil.copytree(CACHE_FOLDER, folder, ignore=lambda _, names: [name for name in names if "tmp" in name])
    own = environment | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    warm = subprocess.run(
        [sys.executable, "-m", "softbrake", "warmup"], env=own, capture_output=True, text=True, timeout=PATIENCE
    )
    assert warm.returncode == 0
    assert str(folder) in warm.stdout
    speaking = own | {"NUMBA_DEBUG_CACHE": "1"}
    for fidelity, self_contact in ALL_KERNELS:
        contact = f"contact={'full' if self_contact else 'paper'}"
        overrides = [f"model.fidelity={fidelity}", contact]
        if fidelity == "inflation":
            overrides = ["model.fidelity=axisymmetric", contact, "gas={pressure: 1 kPa}"]
        changes = [word for change in overrides for word in ("--set", change)]
        words = [sys.executable, "-m", "softbrake", "run", str(paper), *SMALL[:2], "--set", "time.end=1ms", "--force", *changes]
        run = subprocess.run(words, cwd=tmp_path, env=speaking, capture_output=True, text=True, timeout=PATIENCE)
        assert run.returncode == 0
        assert "compiling" not in run.stderr
        assert "data loaded from" in run.stdout
        assert "data saved to" not in run.stdout


def test_compiling_says_which_kernels_it_waits_for(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Each command that compiles others says so, and not that it were the first."""

    def compile_kernels(_: object) -> None:
        for _ in range(2):
            with event.trigger_event("numba:compile"):
                pass

    monkeypatch.setattr(importlib.import_module("softbrake.sim.simulation"), "compile_kernels", compile_kernels)
    lumped = parse_case(starter(), "starter", ["model.fidelity=lumped"])
    full = parse_case(starter(), "starter", ["model.fidelity=full", "contact=full"])
    compile_for([lumped], quiet=False)
    compile_for([full, lumped], quiet=False)
    compile_for([full], quiet=True)
    assert capsys.readouterr().err.splitlines() == [
        "compiling the kernels of lumped (10 to 40 s, once) ...",
        "compiling the kernels of full with folds and lumped (10 to 40 s, once) ...",
    ]


@pytest.mark.slow
def test_first_run_says_what_it_waits_for(paper: Path, tmp_path: Path, environment: dict[str, str]) -> None:
    cold = environment | {"NUMBA_CACHE_DIR": str(tmp_path)}
    lumped = [sys.executable, "-m", "softbrake", "run", str(paper), "--set", "model.fidelity=lumped", "--no-results"]
    runs = [subprocess.run(lumped, env=cold, capture_output=True, text=True, timeout=PATIENCE) for _ in range(2)]
    assert [run.stderr.count("compiling the kernels of lumped (") for run in runs] == [1, 0]
    assert [run.returncode for run in runs] == [0, 0]


@pytest.mark.slow
def test_interrupted_warmup_ends_without_a_traceback(tmp_path: Path, environment: dict[str, str]) -> None:
    cold = environment | {"NUMBA_CACHE_DIR": str(tmp_path)}
    process = start("warmup", environment=cold, folder=tmp_path)
    assert process.stderr is not None
    for line in process.stderr:
        if line.strip() == "full":
            break
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert errors == "interrupted\n"


def test_a_peak_whose_error_has_no_bound_says_so() -> None:
    answer = replace(summary(), peak_errors={"peak_deceleration": 0.5, "peak_tension_hoop": None})
    hoop = next(line for line in printed(answer).splitlines() if line.startswith("peak tension, hoop"))
    generatrix = next(line for line in printed(answer).splitlines() if line.startswith("peak tension, generatrix"))
    assert "± no bound, at" in hoop and "±" not in generatrix


def test_check_says_what_holds_after_the_rows_of_a_table(paper: Path) -> None:
    table = "pressure={law: table, times: [0, 0.1 s], values: [0, 15 kPa]}"
    assert (
        "  pressure            1.5e+04 Pa from 0.1 s on\n"
        in CliRunner().invoke(app, ["check", str(paper), "--set", table]).stdout
    )
    assert "  pressure " not in CliRunner().invoke(app, ["check", str(paper)]).stdout
