"""Limits of the case: what an answer is held against, and how far from it."""

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from conftest import ROOT, Command
from typer.testing import CliRunner

import softbrake
from softbrake.case.case import case_to_dict
from softbrake.case.case_file import CaseError, load_case, open_case
from softbrake.case.sections.limits import ANSWERS, CLASSED, limit_of, limits_of
from softbrake.case.units import STANDARD_GRAVITY
from softbrake.cli.app import app
from softbrake.report.html.sweep import sweep_page
from softbrake.report.words import verdict_rows
from softbrake.sim.filters import PEAKS
from softbrake.sim.limits import judge
from softbrake.sim.result_file import read_summary
from softbrake.sim.summary import Summary
from softbrake.studies import batch
from softbrake.studies.axes import designs_of
from softbrake.studies.sweep import read_journals, run_id, run_sweep

VENTED = ROOT / "configs" / "airdrop-vented.yaml"
COARSE = ("grid.generatrix=12", "grid.hoop=36")
SECTION = (
    "limits: {impact_velocity: <= 1.5 m/s, peak_deceleration: <= 8 g at CFC 60, minimum_height: >= 5 cm, fabric_margin: >= 2}\n"
)


@pytest.fixture(scope="module")
def case_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The vented airdrop with the section above, behind a comment of 3 lines."""
    path = tmp_path_factory.mktemp("limits") / "case.yaml"
    path.write_text(VENTED.read_text() + SECTION)
    return path


@pytest.fixture(scope="module")
def answer(case_path: Path) -> Summary:
    return softbrake.run(load_case(case_path, COARSE))


def test_names_are_those_of_the_answer_and_classes_those_of_the_filter() -> None:
    assert set(ANSWERS) <= set(Summary.__dataclass_fields__)
    assert CLASSED == PEAKS


def test_bounds_are_read_with_unit_and_class() -> None:
    one = limit_of("peak_deceleration", "<= 8 g at CFC 60")
    assert (one.at_most, one.value, one.cfc, one.unit) == (True, 8 * STANDARD_GRAVITY, 60, "g")
    assert limit_of("lowest_height", ">=5cm") == replace(limit_of("lowest_height", "≥ 5cm"))
    assert not limit_of("lowest_height", ">= 5 cm").at_most
    assert limit_of("fabric_margin", ">= 2").value == 2.0


def test_unquoted_bounds_of_either_sign_are_read_in_flow_and_block(case_path: Path) -> None:
    case = load_case(case_path)
    assert [(limit.name, str(limit)) for limit in case.limits] == [
        ("impact_velocity", "<= 1.5 m/s"),
        ("lowest_height", ">= 5 cm"),
        ("peak_deceleration", "<= 8 g at CFC 60"),
        ("fabric_margin", ">= 2"),
    ]
    block = case_path.parent / "block.yaml"
    block.write_text(VENTED.read_text() + "limits:\n  lowest_height: >= 5 cm   # of 1 m\n  fabric_margin: '>= 2'\n  title: 5\n")
    with pytest.raises(CaseError) as caught:
        load_case(block)
    line = VENTED.read_text().count("\n") + 4
    assert caught.value.faults == [
        f"{block}:{line}:3: limits.title: unknown key; known are {', '.join((*ANSWERS, 'minimum_height'))}"
    ]


def test_a_resolved_case_keeps_its_limits(case_path: Path) -> None:
    case = load_case(case_path, ["limits.impact_velocity=<= 5 ft/s"])
    written = json.loads(json.dumps(case_to_dict(case)))
    assert load_case(written).limits == case.limits == limits_of(written["limits"])
    assert "limits" not in case_to_dict(load_case(VENTED))


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("limits.impact_velocity=5", "limits.impact_velocity: no bound; a bound such as '<= 1.5 m/s' is expected"),
        ("limits.impact_velocity=5 m/s", "'5 m/s' is no bound; a bound such as '<= 1.5 m/s' is expected"),
        ("limits.impact_velocty=<= 5 m/s", "limits.impact_velocty: unknown key; did you mean 'impact_velocity'?"),
        ("limits.impact_velocity=<= 5 kg", "'kg' is a mass; a bound such as '<= 1.5 m/s' is expected"),
        ("limits.impact_velocity=<= -1 m/s", "-1 m/s is out of range"),
        ("limits.impact_velocity=<= 1 m/s at CFC 60", "no class filters impact_velocity"),
        ("limits.peak_deceleration=<= 8 g at CFC 61", "unknown class 61, known are 60, 180, 600, 1000"),
        ("limits.belt_margin=>= 1", "limits.belt_margin: the case has no belts"),
        ("limits.peak_tension_belt=<= 1 kN/m", "limits.peak_tension_belt: the case has no belts"),
        ("limits=5", "limits: not a mapping; answers with bounds such as '<= 1.5 m/s' are expected"),
        ("model.fidelity=lumped", "limits.fabric_margin: a lumped case has no shell, and so no tensions"),
        ("limits={lowest_height: '>= 1 cm', minimum_height: '>= 2 cm'}", "limits.minimum_height: given besides lowest_height"),
    ],
)
def test_faults_of_limits(case_path: Path, override: str, message: str) -> None:
    with pytest.raises(CaseError) as caught:
        load_case(case_path, [override])
    assert message in str(caught.value)


def test_a_limit_on_what_the_case_lacks_is_a_fault() -> None:
    for limits, message in (
        ("peak_pressure: '<= 9 kPa'", "the pressure of the case is given"),
        ("rebound_velocity: '<= 1 m/s'", "the run ends at a full stop; time.after: rebound is expected"),
        ("belt_margin: '>= 1'", "no belt has a strength; belts.strength is expected"),
        ("fabric_margin: '>= 1'", "the fabric has no strength; fabric.strength is expected"),
    ):
        with pytest.raises(CaseError) as caught:
            load_case(ROOT / "configs" / "paper.yaml", [f"limits={{{limits}}}"])
        assert message in str(caught.value)


def test_an_override_of_either_name_replaces_a_limit(case_path: Path) -> None:
    for name in ("lowest_height", "minimum_height"):
        limits = {limit.name: str(limit) for limit in load_case(case_path, [f"limits.{name}=>= 7 cm"]).limits}
        assert limits["lowest_height"] == ">= 7 cm" and len(limits) == 4


def test_margins_are_distances_from_the_limit_on_its_right_side(answer: Summary) -> None:
    written = {
        "impact_velocity": "<= 1.5 m/s",
        "lowest_height": ">= 5 cm",
        "peak_deceleration": "<= 8 g",
        "fabric_margin": ">= 1",
    }
    for each in judge(limits_of(written), answer):
        value = getattr(answer, each.limit.name)
        assert each.answer == value and each.fault is None
        assert each.margin == pytest.approx(each.limit.value - value if each.limit.at_most else value - each.limit.value)
        assert each.holds == (each.margin >= 0.0)
        assert each.share == pytest.approx(each.margin / each.limit.value)
    exactly = limits_of({"impact_velocity": f"<= {answer.impact_velocity!r}"})
    assert judge(exactly, answer)[0].holds and judge(exactly, answer)[0].margin == 0.0


def test_a_cargo_that_stops_above_the_ground_has_the_impact_velocity_0() -> None:
    stopped = softbrake.run(load_case(VENTED, [*COARSE, "vents=[]", "shell.height=2 m"]))
    assert stopped.impact_velocity is None and stopped.stood_still
    (impact, height) = judge(limits_of({"impact_velocity": "<= 0", "lowest_height": ">= 1 cm"}), stopped)
    assert (impact.answer, impact.margin, impact.share, impact.holds) == (0.0, 0.0, None, True)
    assert height.answer == stopped.lowest_height > 0.0 and height.holds


def test_a_run_without_an_answer_keeps_no_limit_and_says_why(answer: Summary) -> None:
    limits = limits_of({"impact_velocity": "<= 100 m/s", "lowest_height": ">= 0"})
    late = replace(answer, outcome="time_limit", impact_velocity=None, rest_time=None, end_time=0.1)
    doubted = replace(answer, doubt="fabric made 1 % of the initial energy from nowhere")
    for odd, fault in (
        (late, "neither impact nor stop by 0.1 s"),
        (replace(answer, outcome="diverged"), "the run has diverged"),
        (replace(answer, outcome="interrupted"), "the run is interrupted"),
        (doubted, doubted.doubt),
    ):
        verdicts = judge(limits, odd)
        assert [(each.holds, each.margin, each.fault) for each in verdicts] == [(False, None, fault)] * 2
        assert all(row[1:] == ["none", "–", f"MISSED: {fault}"] for row in verdict_rows(verdicts))


def test_a_margin_smaller_than_the_error_is_said_to_be_within_it(answer: Summary) -> None:
    assert answer.impact_velocity is not None
    (limit,) = limits_of({"impact_velocity": f"<= {answer.impact_velocity + 0.01:.6f} m/s"})
    for error, words in ((0.02, "holds, within the error"), (0.005, "holds"), (None, "holds")):
        (verdict,) = judge([limit], replace(answer, impact_velocity_error=error))
        assert verdict_rows([verdict])[0][3] == words
    (peak,) = judge(limits_of({"peak_deceleration": "<= 1 g"}), replace(answer, peak_errors={"peak_deceleration": None}))
    assert peak.error == math.inf and verdict_rows([peak])[0][3] == "MISSED, within the error"  # it has no bound


def test_a_peak_behind_a_class_is_that_of_the_result_file(case_path: Path, tmp_path: Path, answer: Summary) -> None:
    bounds = ", ".join(f"{name}: '<= 1e6 at CFC 60'" for name in CLASSED[:3])
    case = load_case(case_path, [*COARSE, f"limits={{{bounds}}}", "output.cfc=60"])
    kept = softbrake.run(case, tmp_path / "kept.vtkhdf")
    assert kept.filtered is not None
    alone = batch.run_one(case).summary
    assert alone is not None and alone.filtered is None
    for name in CLASSED[:3]:
        peak = getattr(kept.filtered, name).value
        assert kept.limit_peaks[f"{name}_cfc60"] == peak
        assert alone.limit_peaks[f"{name}_cfc60"] == pytest.approx(peak, rel=1e-5)  # a snapshot ends a chunk of rows
    assert read_summary(tmp_path / "kept.vtkhdf").limit_peaks == kept.limit_peaks
    assert 0.0 < answer.limit_peaks["peak_deceleration_cfc60"] < answer.peak_deceleration
    coarse = softbrake.run(replace(case, output=replace(case.output, history_interval=10_000)))
    (verdict, *_) = judge(case.limits, coarse)
    assert not verdict.holds and "rows" in str(verdict.fault)


def test_run_prints_limits_and_fails_by_option(case_path: Path, softbrake: Command) -> None:
    settings = [word for override in COARSE for word in ("--set", override)]
    plain = softbrake("run", case_path, *settings, "-q", "-o", "x.vtkhdf")
    assert plain.returncode == 0
    assert "peak deceleration <= 8 g at CFC 60" in plain.stdout and "MISSED" in plain.stdout
    assert all(len(line) <= 80 for line in plain.stdout.splitlines()[2:] if "results in" not in line)
    info = softbrake("info", "x.vtkhdf")
    assert "lowest height >= 5 cm" in info.stdout
    failed = softbrake("run", case_path, *settings, "-q", "--no-results", "--fail-on-limits", "--json")
    assert failed.returncode == 1 and "limits missed: " in failed.stderr
    found = json.loads(failed.stdout)
    assert found["pass"] is False
    by_name = {each["name"]: each for each in found["limits"]}
    assert by_name["peak_deceleration"]["cfc"] == 60 and by_name["lowest_height"]["at_least"] == 0.05
    held = softbrake(
        "run", case_path, *settings, "-q", "--no-results", "--fail-on-limits", "--set", "limits={impact_velocity: <= 9 m/s}"
    )
    assert held.returncode == 0 and "limits" not in held.stderr
    none = softbrake("run", VENTED, "--fail-on-limits")
    assert none.returncode == 2 and none.stderr.endswith("has no section limits\n")


def test_limits_are_on_the_page_of_a_result(case_path: Path, tmp_path: Path) -> None:
    runner = CliRunner()
    settings = [word for override in COARSE for word in ("--set", override)]
    assert runner.invoke(app, ["run", str(case_path), *settings, "-q", "-o", str(tmp_path / "x.vtkhdf")]).exit_code == 0
    assert runner.invoke(app, ["report", str(tmp_path / "x.vtkhdf")]).exit_code == 0
    page = (tmp_path / "x.html").read_text()
    assert "<h2>Limits</h2>" in page and "impact velocity &lt;= 1.5 m/s" in page


def test_margins_stand_in_the_results_of_a_sweep(case_path: Path, tmp_path: Path) -> None:
    settings = [word for override in COARSE for word in ("--set", override)]
    arguments = ["sweep", str(case_path), *settings, "--vary", "vents.0.area=400cm^2:700cm^2:4", "-q", "-o", str(tmp_path / "s")]
    shown = CliRunner().invoke(app, arguments, catch_exceptions=False).stdout
    with open(tmp_path / "s" / "results.csv", newline="") as stream:
        table = list(csv.DictReader(stream))
    with open(tmp_path / "s" / "results.units.csv", newline="") as stream:
        units = next(csv.DictReader(stream))
    assert units["limit_margin_peak_deceleration_cfc60"] == units["peak_deceleration_cfc60"] == "m/s^2"
    assert units["limit_margin_lowest_height"] == "m" and units["limit_margin_fabric_margin"] == units["pass"] == ""
    kept = sum(row["pass"] == "1" for row in table)
    assert shown.count("pass") == kept and shown.count("MISSED") == 4 - kept
    assert f"{kept} of 4 runs keep all limits: impact velocity &lt;= 1.5 m/s" in sweep_page(tmp_path / "s")
    for row in table:
        margins = [float(value) for name, value in row.items() if name.startswith("limit_margin_")]
        assert len(margins) == 4 and int(row["pass"]) == all(margin >= 0.0 for margin in margins)
        assert float(row["limit_margin_peak_deceleration_cfc60"]) == 8 * STANDARD_GRAVITY - float(row["peak_deceleration_cfc60"])


def test_a_journal_outlives_its_limits_and_gets_what_new_ones_need(
    case_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def moving(*overrides: str):
        return designs_of(open_case(VENTED, [*COARSE, *overrides]), ["cargo.mass=490kg,500kg"])

    plan = run_sweep(moving(), tmp_path)
    assert run_id(load_case(case_path, COARSE)) == run_id(load_case(VENTED, COARSE))
    ran: list[str] = []
    one = batch.run_one
    monkeypatch.setattr(batch, "run_one", lambda case, *rest: ran.append(case.title) or one(case, *rest))
    bounded = run_sweep(moving("limits.impact_velocity=<= 1 m/s"), tmp_path)
    assert bounded.runs == plan.runs and not ran
    for cfc, runs in ((60, 2), (60, 0), (180, 2)):
        ran.clear()
        run_sweep(moving(f"limits.peak_deceleration=<= 8 g at CFC {cfc}"), tmp_path)
        assert len(ran) == runs
    (first, _) = read_journals(tmp_path).values()
    assert set(first["summary"]["limit_peaks"]) == {"peak_deceleration_cfc60", "peak_deceleration_cfc180"}
    ran.clear()
    run_sweep(moving("limits.peak_deceleration=<= 9 g at CFC 60"), tmp_path)
    assert not ran


def test_limits_are_no_axis_of_a_sweep(case_path: Path) -> None:
    with pytest.raises(CaseError) as caught:
        designs_of(open_case(case_path), ["limits.impact_velocity=<= 1 m/s,<= 2 m/s"])
    assert "limits.impact_velocity: no input of the drop" in str(caught.value)


def test_a_tolerance_keeps_the_peak_behind_a_class() -> None:
    case = load_case(VENTED, ["tolerance=10 %", "limits.peak_deceleration=<= 8 g at CFC 60"])
    found = batch.run_one(case).summary
    assert found is not None and isinstance(found.limit_peaks["peak_deceleration_cfc60"], float)
