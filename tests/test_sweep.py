"""Sweeps: which cases they ask for, that nothing is lost or done twice, and what they write."""

import csv
import io
import json
import math
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import synthetic_drop
from conftest import PATIENCE, ROOT, Command, start
from rich.console import Console
from typer.testing import CliRunner

from softbrake.case.case_file import CaseError, load_case, open_case
from softbrake.cli.app import app
from softbrake.core.columns import History
from softbrake.report.console.sweep import print_table
from softbrake.report.plots.sweep import Scale, colour_range, draw_map, draw_sweep
from softbrake.report.results_csv import failures, rows, write_results
from softbrake.sim.result_file import read_history
from softbrake.sim.simulation import Simulation, simulate
from softbrake.studies import batch, sweep
from softbrake.studies.axes import Designs, designs_of, key_of
from softbrake.studies.sweep import Run, Shard, SweepError, merge_folders, read_journals, run_id, run_sweep

MODULI = ROOT / "configs" / "moduli-sweep.yaml"
COARSE = ("grid.generatrix=12", "time.courant=0.9")
MANY = ("fabric.E=15kN/m:20kN/m:150",)
FIVE = ("fabric.E=15kN/m:20kN/m:5",)


def moduli(*vary: str, overrides: Sequence[str] = COARSE, **settings: object) -> Designs:
    return designs_of(open_case(MODULI, overrides), vary, settings)


def texts(folder: Path) -> list[list[str]]:
    """Rows of results.csv without the two timings at their end."""
    with open(folder / "results.csv", newline="") as stream:
        return [row[:-2] for row in csv.reader(stream)]


def write(folder: Path) -> None:
    """Write the results of a sweep that has run."""
    plan, records = merge_folders([folder])
    write_results(folder, plan, rows(plan, records))


# Which cases


def test_a_range_and_its_logarithmic_kind() -> None:
    assert [design.values for design in moduli("fabric.E=10kN/m:30kN/m:5").all] == [(1e4,), (1.5e4,), (2e4,), (2.5e4,), (3e4,)]
    mass = [design.case.cargo.mass for design in moduli("cargo.mass=10:1000kg:3:log").all]
    assert np.allclose(mass, [10.0, 100.0, 1000.0], rtol=1e-11)


def test_the_first_axis_turns_slowest_and_zip_goes_side_by_side() -> None:
    axes = ("cargo.mass=1kg,2kg", "belts.count=0,3")
    assert [design.values for design in moduli(*axes).all] == [(1.0, 0), (1.0, 3), (2.0, 0), (2.0, 3)]
    assert [design.values for design in moduli(*axes, mode="zip").all] == [(1.0, 0), (2.0, 3)]
    assert [len(design.case.belts) for design in moduli(*axes, mode="zip").all] == [0, 3]


def test_shipped_sweep_has_the_moduli_of_the_paper() -> None:
    designs = designs_of(open_case(MODULI))
    assert {15e3, 18.75e3, 20e3} <= {design.case.fabric.E11 for design in designs.all}
    assert designs.axes == (("fabric.E", "N/m", False, "kN/m", 1e3),)
    assert all(design.values[0] == design.case.fabric.E22 for design in designs.all)


def test_latin_hypercube_has_one_sample_in_each_part_of_each_axis() -> None:
    axes = (
        "cargo.mass=50:150",
        "fabric.E=1kN/m:1000kN/m:log",
        "fabric.slack=cut,compression",
        "belts.count=0:9",
    )
    designs = moduli(*axes, mode="lhs", samples=40, seed=3)
    mass, modulus, slack, count = (np.array(column) for column in zip(*(design.values for design in designs.all), strict=True))
    for parts in ((mass.astype(float) - 50) / 100, np.log10(modulus.astype(float) / 1e3) / 3):
        assert sorted((parts * 40).astype(int)) == list(range(40))
    assert sorted(slack) == ["compression"] * 20 + ["cut"] * 20
    assert set(count.astype(int)) <= set(range(10))
    assert not np.array_equal(np.argsort(mass.astype(float)), np.argsort(modulus.astype(float)))
    assert designs == moduli(*axes, mode="lhs", samples=40, seed=3)
    assert designs != moduli(*axes, mode="lhs", samples=40, seed=4)


@pytest.mark.parametrize(
    ("vary", "settings", "message"),
    [
        (["fabric.E=15kN/m,20kPa"], {}, "--vary fabric.E=15kN/m,20kPa: fabric.E: 'kPa' is a pressure; "),
        (["fabric.EE=1,2"], {}, "fabric.EE: unknown key; did you mean 'E'?"),
        (["fabric.E"], {}, "--vary fabric.E: not KEY=VALUES"),
        (["fabric.E=1:2:3:4"], {}, "'1:2:3:4' is not a range; START:STOP:COUNT"),
        (["fabric.E=1kN/m:x:3"], {}, "'x' is not a number with a unit"),
        (["fabric.E=1kN/m:2N/m:3"], {}, "ends in 'kN/m' and 'N/m'; one unit for both is expected"),
        (["fabric.E=0:2:3:log"], {}, "from 0 to 2; ends > 0 are expected"),
        (["fabric.E=1:2"], {}, "a range without a count in mode grid"),
        (["fabric.E=1:2:1"], {}, "is not a range"),
        (["fabric.E=1,,2"], {}, "an empty value"),
        (["fabric.E=1:2:3"], {"mode": "lhs", "samples": 3}, "a range with a count in mode lhs"),
        (["fabric.E=1:2"], {"mode": "lhs"}, "--mode lhs: sweep.samples: missing"),
        (["fabric.E=1,2"], {"samples": 3}, "sweep.samples: given in mode grid"),
        (["fabric.E=1,2"], {"mode": "sobl"}, "--mode sobl: unknown value 'sobl'; grid or zip or random or lhs"),
        (["fabric.E=1,2", "cargo.mass=1,2,3"], {"mode": "zip"}, "numbers of values differ: fabric.E 2, cargo.mass 3"),
        (["fabric.E=1:2:1000", "cargo.mass=1:2:1001"], {}, "1001000 runs; up to 1000000"),
        (["belts.width=1mm,400mm"], {}, "belts.width: the outer belts come closer than half a grid cell"),
        (["fabric.E=1,2", "cargo.mass=1,2", "fabric.E=3,4"], {}, "--vary fabric.E=3,4: fabric.E: given twice"),
        (["pressure.law=constant,sine"], {}, "with pressure.law=sine"),
        (["fabric.E=-1,-2,5"], {}, "fabric.E: -2 is out of range"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else None,
)
def test_faults_of_axes(vary: list[str], settings: dict[str, object], message: str) -> None:
    with pytest.raises(CaseError) as caught:
        moduli(*vary, **settings)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ("{vary: {fabric.E: [1, -2]}}", ":43:26: fabric.E: -2 is out of range"),
        ("{vary: {fabric.E: [[1]]}}", ":43:27: sweep.vary.fabric.E.0: not one value"),
        ("{vary: {fabric.E: []}}", "an empty list"),
        ("{vary: [1]}", ":43:15: sweep.vary: not a mapping"),
        ("{mode: zip}", ":43:8: sweep.vary: missing"),
        ("{vary: {fabric.E: [1, 2]}, mod: zip}", ":43:35: sweep.mod: unknown key; did you mean 'mode'?"),
        ("{vary: {fabric.E: '1:2'}, mode: lhs}", ":43:1: sweep.samples: missing"),
        ("5", "sweep: not a mapping"),
    ],
)
def test_faults_of_the_section_name_line_and_column(tmp_path: Path, section: str, message: str) -> None:
    case = tmp_path / "case.yaml"
    head = MODULI.read_text().split("sweep:")[0]
    case.write_text("#\n" * (42 - head.count("\n")) + head + f"sweep: {section}\n")
    with pytest.raises(CaseError) as caught:
        designs_of(open_case(case))
    assert message in str(caught.value)
    load_case(case)  # `softbrake run` does not read it


@pytest.mark.parametrize(
    ("path", "unit"),
    [("fabric.E", "N/m"), ("gravity", "m/s^2"), ("belts.0.height", "m"), ("pressure.values.1", "Pa"), ("pressure.value", "Pa")],
)
def test_keys_by_path(path: str, unit: str) -> None:
    key = key_of(path)
    assert key is not None and not isinstance(key.kind, (type, tuple)) and key.kind.unit == unit


# Running them


def test_batch_threads_and_single_runs_give_the_same_numbers(tmp_path: Path) -> None:
    designs = moduli(*FIVE)
    plan = run_sweep(designs, tmp_path)
    known = read_journals(tmp_path)
    for one, design in zip(plan.runs, designs.all, strict=True):
        alone = Simulation(design.case).to_end()
        kept = known[one.id]["summary"]
        for name in ("impact_velocity", "peak_deceleration", "peak_tension_hoop", "energy_error", "steps", "end_time"):
            assert kept[name] == getattr(alone, name)


def test_the_same_sweep_again_runs_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_sweep(moduli(*FIVE), tmp_path)
    write(tmp_path)
    before = (tmp_path / "results.csv").read_bytes()
    monkeypatch.setattr(batch, "run_one", lambda *_: pytest.fail("run again"))
    told: list[tuple[int, int, bool]] = []
    run_sweep(moduli(*FIVE), tmp_path, progress=lambda *numbers: told.append(numbers))
    write(tmp_path)
    assert (tmp_path / "results.csv").read_bytes() == before
    assert told == [(5, 5, False)]


def test_more_values_run_what_is_new(tmp_path: Path) -> None:
    run_sweep(moduli("fabric.E=15kN/m,20kN/m"), tmp_path)
    told: list[tuple[int, int, bool]] = []
    run_sweep(moduli("fabric.E=15kN/m,20kN/m,20kN/m,16kN/m"), tmp_path, progress=lambda *numbers: told.append(numbers))
    assert told == [(2, 3, False), (3, 3, True)]  # of two equal cases one
    write(tmp_path)
    assert len(texts(tmp_path)) == 5


def test_runs_are_known_by_case_and_program(monkeypatch: pytest.MonkeyPatch) -> None:
    case = moduli(*FIVE).all[0].case
    name = run_id(case)
    assert run_id(replace(case, gravity=9.0)) != name
    monkeypatch.setattr(sweep, "source_hash", lambda: "other")
    assert run_id(case) != name


def test_a_torn_last_line_is_forgotten(tmp_path: Path) -> None:
    plan = run_sweep(moduli(*FIVE), tmp_path)
    journal = tmp_path / "journal.jsonl"
    write(tmp_path)
    before = texts(tmp_path)
    whole = journal.read_bytes()
    journal.write_bytes(whole[: -random.Random(1).randrange(20, 200)])
    assert list(read_journals(tmp_path)) == [run.id for run in plan.runs[:-1]]
    run_sweep(moduli(*FIVE), tmp_path)
    assert [json.loads(line)["id"] for line in journal.read_text().splitlines()] == [run.id for run in plan.runs]
    write(tmp_path)
    assert texts(tmp_path) == before


def test_a_case_that_fails_costs_only_itself(softbrake: Command, tmp_path: Path) -> None:
    sets = [f"--set={change}" for change in COARSE]
    done = softbrake(
        "sweep", MODULI, *sets, "--vary", "fabric.E=15kN/m,0.05kN/m,20kN/m", "--vary", "pressure.value=15kPa", "-o", "s"
    )
    assert done.returncode == 1
    assert "1 of 3 runs have no answer:\nrun 2: diverged at" in done.stdout
    assert "the fabric bursts" in done.stdout
    outcomes = [row[texts(tmp_path / "s")[0].index("outcome")] for row in texts(tmp_path / "s")[1:]]
    assert outcomes == ["impact", "diverged", "impact"]
    assert (tmp_path / "s" / "sweep.png").read_bytes().startswith(b"\x89PNG")


def test_histories_are_kept_by_id(tmp_path: Path) -> None:
    designs = moduli("fabric.E=15kN/m,20kN/m", overrides=[*COARSE, "output.history_interval=50"])
    run_sweep(designs, tmp_path)
    plan = run_sweep(designs, tmp_path, histories=True)  # which the first did not keep
    assert len((tmp_path / "journal.jsonl").read_text().splitlines()) == 2
    alone = tmp_path / "drop.vtkhdf"
    with h5py.File(tmp_path / "histories.h5") as file:
        for one, design in zip(plan.runs, designs.all, strict=True):
            simulate(design.case, alone)
            assert file[one.id].dtype == read_history(alone).dtype
            assert np.array_equal(file[one.id][:], read_history(alone))
        assert file.attrs["time"] == History.TIME.unit


def test_a_kill_between_history_and_line_of_the_journal_does_no_harm(tmp_path: Path) -> None:
    designs = moduli("fabric.E=15kN/m,20kN/m", overrides=[*COARSE, "output.history_interval=50"])
    plan = run_sweep(designs, tmp_path, histories=True)
    journal = tmp_path / "journal.jsonl"
    whole = journal.read_text().splitlines(keepends=True)
    journal.write_text(whole[0])
    run_sweep(designs, tmp_path, histories=True)
    assert list(read_journals(tmp_path)) == [run.id for run in plan.runs]
    with h5py.File(tmp_path / "histories.h5") as file:
        assert set(file) == {run.id for run in plan.runs}


def test_shards_share_the_runs_and_merge_to_the_same_results(tmp_path: Path) -> None:
    whole, parts, other = (tmp_path / name for name in ("whole", "parts", "other"))
    run_sweep(moduli(*FIVE), whole)
    write(whole)
    run_sweep(moduli(*FIVE), parts, shard=Shard(1, 2))
    plan, records = merge_folders([parts])
    table = rows(plan, records)
    assert [row["outcome"] for row in table] == ["impact", "missing"] * 2 + ["impact"]
    assert len(failures(table)) == 2
    run_sweep(moduli(*FIVE), other, shard=Shard(2, 2))
    plan, records = merge_folders([parts, other])
    write_results(parts, plan, rows(plan, records))
    assert texts(parts) == texts(whole)
    assert not set(read_journals(parts)) & set(read_journals(other))
    run_sweep(moduli("fabric.E=1kN/m,2kN/m"), other, force=True)
    with pytest.raises(SweepError, match="of another sweep"):
        merge_folders([parts, other])


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the sweep that others break off: long enough for that on a machine that is fast, or busy elsewhere."""
    folder = tmp_path_factory.mktemp("uninterrupted")
    run_sweep(moduli(*MANY, overrides=()), folder)
    write(folder)
    return folder


def start_sweep(folder: Path, environment: dict[str, str]) -> subprocess.Popen[str]:
    """Start that sweep as a process."""
    arguments = ("sweep", MODULI, "--vary", *MANY, "-o", folder, "-q", "--json")
    return start(*arguments, environment=environment, folder=folder.parent)


def lines(folder: Path) -> int:
    journal = folder / "journal.jsonl"
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


@pytest.mark.slow
@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGINT], ids=["kill -9", "Ctrl-C"])
def test_a_sweep_broken_off_goes_on_to_the_same_results(
    tmp_path: Path, environment: dict[str, str], uninterrupted: Path, blow: int
) -> None:
    broken = tmp_path / "broken"
    with start_sweep(broken, environment) as process:
        while lines(broken) < 5:
            assert process.poll() is None
            time.sleep(0.002)
        process.send_signal(blow)
        _, told = process.communicate(timeout=PATIENCE)
    assert process.returncode == (130 if blow == signal.SIGINT else -blow)
    assert "Traceback" not in told
    assert 5 <= lines(broken) < 150
    with start_sweep(broken, environment) as again:
        resumed = [json.loads(line) for line in again.communicate(timeout=PATIENCE)[0].splitlines()]
    assert again.returncode == 0
    assert texts(broken) == texts(uninterrupted)
    ids = [json.loads(line)["id"] for line in (broken / "journal.jsonl").read_text().splitlines()]
    assert len(ids) == len(set(ids)) == 150
    assert [row["impact_velocity"] for row in resumed] == [
        record["summary"]["impact_velocity"] for record in merge_folders([uninterrupted])[1].values()
    ]


@pytest.mark.slow
def test_a_cluster_that_loses_a_worker_loses_no_run(tmp_path: Path, environment: dict[str, str]) -> None:
    pytest.importorskip("distributed")
    from distributed import LocalCluster

    whole, there = tmp_path / "whole", tmp_path / "there"
    designs = moduli("fabric.E=15kN/m:20kN/m:160", overrides=["grid.generatrix=24"])
    run_sweep(designs, whole)
    write(whole)
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        victim = next(iter(cluster.workers.values())).pid
        told: list[tuple[int, int, bool]] = []

        def watch(*numbers: object) -> None:
            told.append(numbers)  # type: ignore[arg-type]
            if len(told) == 20:
                os.kill(victim, signal.SIGKILL)

        run_sweep(designs, there, scheduler=cluster.scheduler_address, progress=watch)
    write(there)
    assert texts(there) == texts(whole)
    ids = [json.loads(line)["id"] for line in (there / "journal.jsonl").read_text().splitlines()]
    assert len(ids) == len(set(ids)) == 160
    assert told[-1] == (160, 160, True)


@pytest.mark.slow
def test_a_lost_scheduler_is_one_line_and_the_same_command_goes_on(tmp_path: Path, environment: dict[str, str]) -> None:
    pytest.importorskip("distributed")
    folder, about = tmp_path / "sweep", tmp_path / "scheduler.json"

    def dask(*words: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", *words, "--no-dashboard", "--scheduler-file", str(about)]
        return subprocess.Popen(command, env=environment, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    with dask("scheduler", "--host", "127.0.0.1", "--port", "0") as scheduler, dask("worker", "--nthreads", "1") as worker:
        while not about.exists():
            assert scheduler.poll() is None
            time.sleep(0.1)
        address = json.loads(about.read_text())["address"]
        words = ("sweep", MODULI, "--vary", *MANY, "-o", folder, "-q", "--set", "grid.generatrix=48")
        with start(*words, "--scheduler", address, environment=environment, folder=tmp_path) as process:
            while lines(folder) < 1:
                assert process.poll() is None
                time.sleep(0.002)
            scheduler.kill()
            _, told = process.communicate(timeout=PATIENCE)
        worker.terminate()
    assert process.returncode == 1
    assert told == f"--scheduler {address}: lost; the same command goes on from here\n"
    assert 1 <= lines(folder) < 150
    with start(*words, environment=environment, folder=tmp_path) as again:
        again.communicate(timeout=PATIENCE)
    assert again.returncode == 0
    assert lines(folder) == 150


# What they write


def test_answers_of_a_gas_are_columns_with_units(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the picture of the sweep a rebound has the impact velocity 0."""
    vents = "vents=[{area: 1 cm^2, discharge: 0.6, opens: {pressure: 10 kPa}}, {area: 1 cm^2, discharge: 1, opens: {time: 1 s}}]"
    (tmp_path / "piston.yaml").write_text(synthetic_drop.PISTON)
    designs = designs_of(open_case(tmp_path / "piston.yaml", [vents]), ["vents.0.area=1cm^2,40cm^2"], {})
    run_sweep(designs, tmp_path / "s", histories=True)
    write(tmp_path / "s")
    with open(tmp_path / "s" / "results.csv", newline="") as stream:
        found = list(csv.DictReader(stream))
    with open(tmp_path / "s" / "results.units.csv", newline="") as stream:
        (units,) = csv.DictReader(stream)
    expected = {
        "peak_pressure": "Pa",
        "peak_pressure_time": "s",
        "peak_pressure_phase": "",
        "peak_temperature": "K",
        "vented_mass": "kg",
        "gas_mass": "kg",
        "gas_enthalpy_out": "J",
        "vent_opening_times_0": "s",
        "vent_opening_times_1": "s",
        "rebound_velocity": "m/s",
        "rest_time": "s",
    }
    assert {name: units[name] for name in expected} == expected
    small, large = ({name: row[name] for name in expected} for row in found)
    assert float(small["peak_pressure"]) > float(large["peak_pressure"]) > 10e3
    assert float(small["vented_mass"]) < float(large["vented_mass"])
    assert (found[0]["outcome"], small["vent_opening_times_1"]) == ("rebound", "")
    assert "vent_opening_times" not in units
    pytest.importorskip("matplotlib")
    drawn: list[Any] = []
    monkeypatch.setattr("softbrake.report.plots.sweep.save", lambda figure, _: drawn.append(figure))
    plan, records = sweep.make_plan(designs)[0], read_journals(tmp_path / "s")
    draw_sweep(plan, rows(plan, records), tmp_path / "sweep.png")
    speeds, ringed = (line.get_ydata().tolist() for line in drawn[0].axes[0].lines)
    assert speeds == [0.0, float(found[1]["impact_velocity"])] and ringed == [0.0]
    with h5py.File(tmp_path / "s" / "histories.h5") as file:
        for row in found:
            assert file[row["id"]]["gas_mass"][-1] == float(row["gas_mass"])


def test_columns_have_units_and_the_timings_come_last(tmp_path: Path) -> None:
    designs = moduli("fabric.E=15kN/m,20kN/m", "fabric.slack=cut,compression")
    run_sweep(designs, tmp_path)
    write(tmp_path)
    with open(tmp_path / "results.csv", newline="") as stream:
        table = list(csv.DictReader(stream))
    with open(tmp_path / "results.units.csv", newline="") as stream:
        (units,) = csv.DictReader(stream)
    assert list(table[0]) == list(units)
    assert list(units)[-2:] == ["kernel_seconds", "wall_seconds"]
    assert [row["fabric.slack"] for row in table] == ["cut", "compression"] * 2
    assert {row["model_contact"] for row in table} == {", ".join(designs.all[0].case.contact)}
    assert all(row["id"][0] == "r" for row in table)  # 12e4 would be a number
    expected = {
        "fabric.E": "N/m",
        "fabric.slack": "",
        "impact_velocity": "m/s",
        "free_fall_velocity": "m/s",
        "velocity_reduction": "m/s",
        "impact_velocity_error": "m/s",
        "impact_time": "s",
        "time_step": "s",
        "steps": "",
        "lowest_height": "m",
        "peak_deceleration": "m/s^2",
        "peak_deceleration_time": "s",
        "peak_tension_belt": "N/m",
        "peak_tension_belt_height": "m",
        "peak_tension_belt_phase": "",
        "peak_tension_belt_other": "N/m",
        "work_gravity": "J",
        "energy_error": "",
        "missed_collisions": "",
        "threads": "",
        "thread_time": "s",
        "wall_seconds": "s",
    }
    assert {name: units[name] for name in expected} == expected
    alone = Simulation(designs.all[0].case).to_end()
    assert float(table[0]["impact_velocity"]) == alone.impact_velocity
    assert float(table[0]["work_pressure"]) == alone.work.pressure
    hoop = alone.peaks["peak_tension_hoop"]
    assert float(table[0]["peak_tension_hoop_time"]) == hoop.time
    assert table[0]["peak_tension_hoop_phase"] == hoop.phase
    assert hoop.other is not None and float(table[0]["peak_tension_hoop_other"]) == hoop.other.value


@pytest.mark.slow
@pytest.mark.parametrize(
    "vary",
    [
        ["fabric.E=15kN/m:20kN/m:3"],
        ["fabric.slack=cut,compression"],
        ["fabric.E=15kN/m:20kN/m:3", "fabric.slack=cut,compression"],
        ["fabric.E=1kN/m:20kN/m:3", "pressure.value=10kPa:40kPa:3"],
        ["fabric.E=15kN/m,20kN/m", "cargo.mass=90,100", "fabric.slack=cut,compression"],
    ],
    ids=" ".join,
)
def test_pictures(softbrake: Command, tmp_path: Path, vary: list[str]) -> None:
    pytest.importorskip("matplotlib")
    arguments = [f"--vary={axis}" for axis in vary] + [f"--set={change}" for change in COARSE]
    done = softbrake("sweep", MODULI, "-q", *arguments, "-o", "s")
    assert all(line.startswith("unusual: ") for line in done.stderr.splitlines())
    assert "…" not in done.stdout and "left out" not in done.stdout  # a pipe has room
    assert (tmp_path / "s" / "sweep.png").read_bytes().startswith(b"\x89PNG")


def test_a_logarithmic_range_is_drawn_on_a_logarithmic_axis() -> None:
    figure = pytest.importorskip("matplotlib.figure")
    designs = moduli("cargo.mass=1kg:10000kg:5:log")
    assert designs.axes == (sweep.Axis("cargo.mass", "kg", log=True, asked="kg"),)
    panel = figure.Figure().subplots()
    Scale(designs.axes[0], [design.values[0] for design in designs.all]).along(panel, "x")
    assert panel.get_xscale() == "log"


def filled(values: np.ndarray, first: np.ndarray, second: np.ndarray, log: bool = False):
    """Colours of an answer over a diameter in m and a modulus in N/m, by a function of the place."""
    panel = pytest.importorskip("matplotlib.figure").Figure().subplots()
    scales = [Scale(sweep.Axis("shell.diameter", "m"), list(first)), Scale(sweep.Axis("fabric.E", "N/m", log), list(second))]
    drawn = draw_map(panel, scales, values)

    def level(x: float, y: float) -> float | None:
        """Middle of the band in which a place lies; None where there is none."""
        for low, high, path in zip(drawn.levels[:-1], drawn.levels[1:], drawn.get_paths(), strict=False):
            if path.contains_point((x, y)):
                return float(low + high) / 2
        return None

    return level, drawn


def test_a_map_is_empty_where_a_run_has_no_answer() -> None:
    """9 of 15 runs fail, on a grid: only cells whose corners all have an answer are coloured."""
    x, y = (part.ravel() for part in np.meshgrid(np.linspace(0.4, 0.8, 5), [10e3, 20e3, 30e3]))
    sound = (x < 0.65) & (y < 25e3)
    assert sound.sum() == 6
    level, _ = filled(np.where(sound, x, np.nan), x, y)
    assert level(0.55, 15.0) is not None
    for place in ((0.65, 15.0), (0.75, 15.0), (0.5, 25.0), (0.75, 25.0)):
        assert level(*place) is None


@pytest.mark.parametrize("log", [False, True])
def test_scattered_runs_are_joined_in_axes_of_one_size(log: bool) -> None:
    """A smooth answer of 80 scattered runs over units that differ by 1e5: a plane is met to a band everywhere within."""
    chance = np.random.default_rng(3)
    share = chance.uniform(size=(80, 2))
    low, high = 1e3, 1e5
    x, y = 0.3 + 0.5 * share[:, 0], low * (high / low) ** share[:, 1] if log else low + (high - low) * share[:, 1]

    def smooth(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return 5.0 * u + 5.0 * np.sin(2.0 * v)

    level, drawn = filled(smooth(share[:, 0], share[:, 1]), x, y, log)
    band = float(np.diff(drawn.levels).max())
    for u, v in chance.uniform(0.2, 0.8, size=(60, 2)):
        ends = low * (high / low) ** v if log else low + (high - low) * v
        found = level(0.3 + 0.5 * u, ends / 1e3)
        assert found is not None and abs(found - smooth(u, v)) < 0.5 * band + 0.25


def test_one_run_far_off_leaves_colours_to_the_others() -> None:
    values = np.array([*np.linspace(2.0, 4.0, 14), 190.0])
    assert colour_range(values)[1] < 10.0
    x, y = (part.ravel() for part in np.meshgrid(np.linspace(0.4, 0.8, 5), [10e3, 20e3, 30e3]))
    _, drawn = filled(values, x, y)
    assert drawn.levels[-1] < 10.0 and drawn.extend == "max"
    assert colour_range(np.linspace(2.0, 4.0, 15)) == (2.0, 4.0)
    assert colour_range(np.array([0.0] * 9 + [1.0])) == (0.0, 1.0)


def test_axes_keep_the_unit_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    mixed = moduli("pressure.value=10kPa,0.2bar", "fabric.E=10:30kN/m:2", "cargo.mass=90,100", "grid.generatrix=8,12")
    assert [(axis.shown, axis.size) for axis in mixed.axes] == [("Pa", 1.0), ("kN/m", 1e3), ("kg", 1.0), ("", 1.0)]
    axis = moduli("pressure.value=10kPa:40kPa:3").axes[0]
    runs = tuple(Run(str(k), (1e4 * k,)) for k in (1, 4))
    print_table(sweep.Plan("A sweep", "1", "2", (axis,), runs, {}), rows(sweep.Plan("A sweep", "1", "2", (axis,), runs, {}), {}))
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].split()[0] == "kPa"
    assert [line.split()[0] for line in lines[3:5]] == ["10", "40"]


@pytest.mark.parametrize("width", range(40, 201, 8))
def test_no_number_of_a_table_is_cut(width: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight axes of long numbers: columns are left out with a word, the first axis and the impact velocity last."""
    axes = tuple(sweep.Axis(f"belts.{k}.line_density", "kg/m") for k in range(8))
    values = tuple(-1.23456e-5 * (k + 1) for k in range(8))
    plan = sweep.Plan("A sweep", "1", "2", axes, (Run("x", values),), {})
    table = rows(plan, {"x": {"summary": {"outcome": "impact", "impact_velocity": 12345.678, "doubt": None}, "fault": None}})
    table[0] |= {"peak_deceleration": -1131234.5, **dict.fromkeys(("peak_tension_generatrix", "peak_tension_belt"), 1e9)}
    table[0]["peak_tension_hoop"] = None
    stream = io.StringIO()
    print_table(plan, table, Console(file=stream, width=width, markup=False, highlight=False))
    text = stream.getvalue()
    whole = {f"{value:.6g}" for value in values} | {"12345.6780", f"{-1131234.5 / 9.80665:.2f}", "1000000.000", "–", "impact"}
    (line,) = [line for line in text.splitlines() if "e-05" in line]
    assert set(line.split()) <= whole and {f"{values[0]:.6g}", "12345.6780"} <= set(line.split())
    assert max(map(len, text.splitlines())) <= width
    assert ("left out, for want of room: " in text) == (set(line.split()) != whole)
    monkeypatch.delenv("COLUMNS", raising=False)
    print_table(plan, table)  # a pipe has room for all
    assert whole <= set(capsys.readouterr().out.split())


def test_a_long_sweep_prints_some_of_its_runs(capsys: pytest.CaptureFixture[str]) -> None:
    runs = tuple(Run(f"{number}", (float(number),)) for number in range(1000))
    plan = sweep.Plan("A sweep", "1", "2", (sweep.Axis("cargo.mass", "kg"),), runs, {})
    table = rows(plan, {})
    print_table(plan, table)
    told = capsys.readouterr().out
    assert "24 of 1000 runs are shown; results.csv is for all" in told
    assert "1000 of 1000 runs have no answer" in told
    assert told.count("\n") < 70
    assert math.isclose(float(told.splitlines()[3].split()[0]), 0.0)


# Mistakes: exit 2, nothing written


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["sweep", "PAPER"], "no section sweep"),
        (["sweep", "PAPER", "--vary", "fabric.F=1,2"], "--vary fabric.F=1,2: fabric.F: unknown key"),
        (
            ["sweep", "MODULI", "--vary", "fabric.E=1:2:1e8"],
            "fabric.E: 1e8 values; up to 1000000 are expected; mode: lhs samples",
        ),
        (["sweep", "MODULI", "--vary", "fabric.E=1:2:100000000"], "fabric.E: 100000000 values; up to 1000000 are expected"),
        (
            ["sweep", "MODULI", "--vary", "fabric.E=1,5kN/m:2kN/m:3"],
            "'1,5kN/m:2kN/m:3' has a comma; numbers have a decimal point",
        ),
        (["sweep", "MODULI", "--shard", "3/2"], "--shard 3/2: a part of the runs"),
        (["sweep", "MODULI", "-o", "file"], "file: is not a folder"),
        (["sweep", "MODULI", "--threads", "2", "--scheduler", "tcp://h:1"], "exclude each other"),
        (["sweep", "MODULI", "--scheduler", "nothing"], "--scheduler nothing: not an address; "),
        (["merge", "nowhere"], "plan.json: No such file or directory; the folder of a sweep is expected"),
        (["merge", "."], "plan.json: not the plan of a sweep"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_mistakes(paper: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], message: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    (tmp_path / "plan.json").write_text("[]")
    before = sorted(tmp_path.rglob("*"))
    done = CliRunner().invoke(app, [str({"PAPER": paper, "MODULI": MODULI}.get(word, word)) for word in arguments])
    assert (done.exit_code, done.stdout) == (2, "")
    assert message in " ".join(done.stderr.split())
    assert sorted(tmp_path.rglob("*")) == before


def test_check_says_what_a_sweep_runs(softbrake: Command) -> None:
    assert "sweep               161 runs over fabric.E" in softbrake("check", MODULI).stdout
