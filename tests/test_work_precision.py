"""Work-precision charts: fronts, orders and advice on made-up runs, an honest reference, and the whole command."""

import csv
import io
import math
import shlex
import signal
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import synthetic_drop
from conftest import PATIENCE, Command, start
from rich.console import Console
from typer.testing import CliRunner

import softbrake as package
from softbrake.cli.app import app
from softbrake.report.console.work_precision import print_work_precision
from softbrake.sim.simulation import Simulation
from softbrake.sim.summary import PeakValue
from softbrake.studies import work_precision as work_precision_module
from softbrake.studies.error_control import level
from softbrake.studies.work_precision import (
    INTERRUPTED,
    PAPER,
    TOO_FINE,
    UNITS,
    Measurement,
    Reference,
    Setting,
    WorkPrecision,
    fitted_order,
    pareto,
    plan,
    work_precision,
    write_csv,
)

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
SCENE = CONFIGS / "no-belts.yaml"
BRIEF = ("--set", "time.end=20 ms")


def run(
    cells: int, seconds: float, velocity: float, outcome: str = "impact", courant: float = 0.9, fidelity: str = "full"
) -> Measurement:
    """A made-up run."""
    summary = replace(synthetic_drop.summary(), outcome=outcome, end_time=0.05)
    setting = Setting(fidelity, "edge", courant, cells, 2 * cells)
    return Measurement(setting, summary, dict.fromkeys(UNITS, velocity), seconds)


def made_up(*runs: Measurement, error: float = 0.001) -> WorkPrecision:
    """Runs beside a reference of 1 m/s, known to an error."""
    setting = Setting("axisymmetric", "edge", 0.9, 288, 720)
    reference = Reference({"impact_velocity": 1.0}, {"impact_velocity": error}, frozenset({"impact"}), "made up", setting, 0.1)
    return WorkPrecision(package.load_case(SCENE), reference, runs=list(runs))


def test_pareto_front_is_what_nothing_beats() -> None:
    points = [(1.0, 8.0), (2.0, 9.0), (2.0, 4.0), (3.0, 4.0), (4.0, math.inf), (8.0, 1.0), (0.5, math.inf)]
    front = pareto(points)
    assert front == [0, 2, 5]
    random = [tuple(point) for point in np.random.default_rng(1).random((200, 2))]
    slow = [k for k, p in enumerate(random) if not any(q[0] <= p[0] and q[1] <= p[1] and q != p for q in random)]
    assert sorted(pareto(random)) == slow


def test_errors_below_that_of_the_reference_are_not_ranked() -> None:
    found = made_up(run(9, 1.0, 1.1), run(18, 2.0, 1.0009), run(36, 4.0, 1.0001))
    assert [one.setting.generatrix for one in found.front("impact_velocity")] == [9, 18]
    assert found.ranked(found.runs[2], "impact_velocity") == found.ranked(found.runs[1], "impact_velocity") == 0.001


@pytest.mark.parametrize("order", [1.0, 2.0, 3.0])
def test_fitted_order(order: float) -> None:
    cells = [9, 18, 36, 72, 144]
    errors = [0.4 * n**-order for n in cells]
    assert fitted_order(cells, errors, 0.0) == pytest.approx(order)
    floor = 0.9 * errors[3]  # what the reference cannot tell is left out, whatever it says
    assert fitted_order(cells, [*errors[:3], 1e-9, 0.9 * floor], floor) == pytest.approx(order)
    assert fitted_order([3, 6, *cells], [math.inf, 0.9, *errors], 0.0) == pytest.approx(order)  # too coarse, as yet
    assert fitted_order(cells, [math.inf, *errors[1:]], 0.0) == pytest.approx(order)
    assert fitted_order(cells[:2], errors[:2], 0.0) is None
    assert fitted_order(cells, [0.01, 0.03, 0.005, 0.04, 0.008], 0.0) is None
    assert fitted_order(cells, [0.01] * 5, 0.0) is None


def test_recommended_is_the_cheapest_that_finer_runs_confirm() -> None:
    family = [run(9, 1.0, 1.004), run(18, 2.0, 1.08), run(36, 4.0, 1.03), run(72, 8.0, 1.002), run(144, 16.0, 1.001)]
    dear = [run(36, 5.0, 1.001, courant=0.1), run(72, 50.0, 1.001, courant=0.1)]
    lone = [run(9, 0.1, 1.0, courant=0.5)]
    found = made_up(*family, *dear, *lone)
    names = {0.05: 4.0, 0.02: 5.0, 0.005: 5.0}  # 9 cells at 1 s hit by accident: 18 do not; 0.1 s is confirmed by none
    for tolerance, seconds in names.items():
        chosen = found.recommended("impact_velocity", tolerance)
        assert chosen is not None and chosen.seconds == seconds
    assert found.recommended("impact_velocity", 0.0015) is None  # 0.001 of the reference counts as well
    piston = made_up(run(18, 0.01, 1.01, fidelity="lumped"))
    assert piston.recommended("impact_velocity", 0.02) is None  # without a shell it may be right by accident only


def test_failures_are_listed_and_never_count() -> None:
    failed = [run(18, 0.1, 1.0, "diverged"), run(36, 0.2, 1.0, "stopped")]
    found = made_up(run(9, 1.0, 1.1), run(18, 2.0, 1.1), *failed)
    assert found.failures() == [
        "18 x 36 full, Courant 0.9: diverged at 0.05 s",
        "36 x 72 full, Courant 0.9: ends otherwise (stopped) at 0.05 s",
    ]
    assert not set(map(id, failed)) & set(map(id, found.front("impact_velocity")))
    assert found.recommended("impact_velocity", 0.5) is None  # a finer run of the family fails


def test_omissions_are_said_by_family() -> None:
    found = made_up()
    found.left_out = [(Setting("full", "cell", 0.02, n, 2 * n), s) for n, s in ((36, 5.0), (72, 80.0))]
    found.left_out.append((Setting("axisymmetric", "edge", 0.9, 144, 720), TOO_FINE))
    found.left_out.append((Setting("axisymmetric", "edge", 0.5, 36, 720), INTERRUPTED))
    assert found.omissions() == [
        "full, cell scheme, Courant 0.02: 36, 72 cells, may take 5 s and more",
        "axisymmetric: 144 cells, too fine for the reference to judge",
        "axisymmetric, Courant 0.5: 36 cells, not run: interrupted",
    ]


def test_plan_holds_the_papers_setting_and_its_shape_of_cells() -> None:
    case = package.load_case(CONFIGS / "paper.yaml")
    settings = plan(case)
    assert PAPER in settings
    assert len(settings) == len(set(settings))
    for setting in settings:
        applied = setting.apply(case)
        assert (applied.grid.generatrix, applied.time.courant) == (setting.generatrix, setting.courant)
        if setting.fidelity == "full":
            assert applied.grid.hoop / applied.grid.generatrix == pytest.approx(2.5, rel=0.05)
    self_contact = package.load_case(CONFIGS / "paper-contact.yaml")
    assert {setting.fidelity for setting in plan(self_contact)} == {"lumped", "axisymmetric", "full"}
    many = package.load_case(CONFIGS / "paper.yaml", ["belts.count=30", "grid.generatrix=90", "belts.width=2 mm"])
    assert min(setting.generatrix for setting in plan(many)) >= 18  # half a cell off the covers


@pytest.mark.parametrize("name", ["paper", "paper-contact"])
def test_all_kernels_of_the_plan_are_compiled_before_the_budget_counts(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    case = package.load_case(CONFIGS / f"{name}.yaml")
    compiled: list[tuple[str, bool]] = []
    monkeypatch.setattr(work_precision_module, "compile_kernels", compiled.extend)
    work_precision_module._Campaign(WorkPrecision(case, budget=1.0), lambda done, planned, doing: None)
    settings = sorted(plan(case), key=lambda setting: setting.generatrix)
    wanted = set()
    for setting in {
        (one.fidelity, size): one for size in (1, -1) for one in settings[::size]
    }.values():  # the coarsest, the finest
        wanted.add((setting.fidelity, Simulation(setting.apply(case)).state.self_contact is not None))
    assert wanted == set(compiled)


@pytest.fixture(scope="module")
def charted() -> WorkPrecision:
    """A shell that stays round, by few settings but all of them, and a reference of 144 cells, whatever the machine does."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            work_precision_module,
            "CHARTED",
            (("lumped", "edge", (0.9,)), ("axisymmetric", "edge", (0.9, 0.1)), ("full", "edge", (0.9,))),
        )
        patch.setattr(work_precision_module, "GRIDS", (9, 13, 18, 25, 36))
        patch.setattr(work_precision_module, "DOUBLINGS", 4)
        patch.setattr(work_precision_module, "PAPER", Setting("full", "edge", 0.5, 9, 22))
        return work_precision(package.load_case(SCENE), budget=1e6)


@pytest.mark.slow
def test_reference_is_within_its_error_of_a_far_finer_run(charted: WorkPrecision) -> None:
    reference = charted.reference
    assert reference is not None
    assert "stays round" in reference.basis
    shown = [one for one in charted.runs if one.setting.fidelity == "axisymmetric"]
    assert max(one.setting.generatrix for one in shown) <= reference.setting.generatrix / 4
    assert reference.setting.generatrix == 144
    finer = package.run(level(charted.case, "axisymmetric", 288, 720))
    assert finer.impact_velocity is not None
    assert abs(finer.impact_velocity - reference.values["impact_velocity"]) <= reference.errors["impact_velocity"]
    assert abs(finer.peak_deceleration - reference.values["peak_deceleration"]) <= reference.errors["peak_deceleration"]
    assert abs(finer.peak_tension_hoop - reference.values["peak_tension"]) <= reference.errors["peak_tension"]
    assert reference.error("impact_velocity") < 0.005


@pytest.mark.slow
def test_errors_fall_with_the_grid(charted: WorkPrecision) -> None:
    family = charted.families()["axisymmetric", "edge", 0.9]
    errors = [charted.error(one, "impact_velocity") for one in family]
    assert errors[0] > 0.05
    assert errors[-1] < 0.01
    order = fitted_order([one.setting.generatrix for one in family], errors, 0.0)
    assert order is not None and 1.5 < order < 5.0
    gas = charted.families()["lumped", "edge", 0.9][0]
    assert charted.error(gas, "impact_velocity") > 0.1
    assert charted.error(gas, "peak_tension") == 1.0
    assert not charted.left_out


@pytest.mark.slow
def test_shell_that_crumples_is_compared_with_an_ensemble(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fast drop, which another disturbance answers within the error of the reference."""
    case = package.load_case(CONFIGS / "paper.yaml", ["contact=ground", "cargo.velocity=20"])
    found = work_precision(case, budget=0.0)
    reference = found.reference
    assert reference is not None
    assert "mean of 1 full shell of 16 x 40 cells, disturbed by 0.001 R; whether the full shell stays round" in reference.basis
    assert reference.errors["impact_velocity"] == math.inf  # one grid says nothing of the grid's error
    assert found.recommended("impact_velocity", 0.05) is None
    assert not found.runs and len(found.left_out) == len(plan(case))
    monkeypatch.setattr(work_precision_module, "plan", lambda case: [])
    monkeypatch.setattr(work_precision_module, "PROBE", 24)
    monkeypatch.setattr(
        work_precision_module._Campaign, "expected", lambda self, setting: 0.0 if setting.generatrix <= 24 else math.inf
    )
    reference = work_precision(case, budget=1e6).reference
    assert reference is not None
    assert "does not stay round" in reference.basis and "mean of 4 full shells" in reference.basis
    drop = Simulation(reference.setting.apply(case))
    drop.disturb(2.5e-5, 11)
    speed = drop.to_end().impact_velocity
    assert speed is not None
    assert abs(speed - reference.values["impact_velocity"]) <= reference.errors["impact_velocity"] < 2.0


@dataclass
class Clocked:
    """Drops that only take their time, on a clock of their own."""

    price: float  # s, of a full shell of 16 x 40 cells
    lopsided: float  # of the radius
    now: float = 0.0  # s
    taken: list[float] = field(default_factory=list)  # s, of each run of more than a cell

    def drop(self, case: package.Case) -> SimpleNamespace:
        return SimpleNamespace(disturb=lambda size, seed: None, to_end=lambda: self.run(case))

    def run(self, case: package.Case) -> package.Summary:
        cells, columns = case.grid.generatrix, case.grid.hoop if case.model.fidelity == "full" else 1
        seconds = self.price * (cells / 16) ** 2.5 * columns / 40 * 0.9 / case.time.courant
        self.now += seconds
        self.taken.append(seconds)
        answer = synthetic_drop.summary()
        peaks = {name: PeakValue(1.0, 0.1) for name in ("peak_deceleration", "peak_tension_generatrix", "peak_tension_hoop")}
        return replace(answer, wall_seconds=seconds, kernel_seconds=seconds, peaks=peaks)

    def probe(self, case: package.Case, seed: int) -> tuple[package.Summary, float]:
        return self.run(case), self.lopsided


@pytest.mark.parametrize("lopsided", [1e-3, 0.02, 0.5])
@pytest.mark.parametrize("price", [0.01, 0.3, 2.4, 100.0])
def test_budget_is_kept(price: float, lopsided: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Within a fifth, or one run of the coarsest full shell; it is said what all took."""
    made = Clocked(price, lopsided)
    monkeypatch.setattr(work_precision_module, "Simulation", made.drop)
    monkeypatch.setattr(work_precision_module, "probe", made.probe)
    monkeypatch.setattr(work_precision_module, "compile_kernels", list)
    monkeypatch.setattr(work_precision_module, "time", SimpleNamespace(perf_counter=lambda: made.now))
    for budget in (0.0, 5.0, 20.0, 80.0):
        made.now, made.taken = 0.0, []
        found = work_precision(package.load_case(CONFIGS / "paper.yaml"), budget)
        assert found.seconds == made.now <= max(1.2 * budget, budget + price)
        assert max(made.taken) <= max(budget, price)
        stream = io.StringIO()
        print_work_precision(found, "softbrake run", Console(file=stream, width=120))
        assert f"All runs took {made.now:.3g} s of a budget of {budget:g} s." in stream.getvalue()
    assert len(made.taken) > 30 or price > 1.0


def test_run_that_diverges_early_prices_no_other() -> None:
    campaign = work_precision_module._Campaign(WorkPrecision(package.load_case(SCENE, ["fabric.E=1 kN/m"])), lambda *_: None)
    setting = Setting("axisymmetric", "edge", 0.9, 18, 720)
    assert campaign.run(setting).summary.outcome == "diverged"
    assert campaign.costs == []


def test_without_a_reference_there_is_no_chart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work_precision_module._Campaign, "run", lambda self, setting, seed=0: run(18, 0.1, 0.0, "diverged"))
    with pytest.raises(package.Diverged, match="diverges on every grid: there is no reference"):
        work_precision(package.load_case(SCENE), budget=1.0)


def test_runs_of_the_kind_of_the_reference_are_on_coarser_grids(monkeypatch: pytest.MonkeyPatch) -> None:
    """Full shells share the grid's error with a full reference; axisymmetric shells are another model."""
    case = package.load_case(CONFIGS / "paper.yaml")
    reference = replace(made_up().reference, setting=Setting("full", "edge", 0.9, 36, 90))
    monkeypatch.setattr(work_precision_module._Campaign, "reference", lambda self: reference)
    monkeypatch.setattr(
        work_precision_module._Campaign, "timed", lambda self, setting: replace(run(9, 0.1, 1.0), setting=setting)
    )
    runs = sorted((one.setting for one in work_precision(case, budget=1e6).runs), key=lambda setting: setting.generatrix)
    finest = {setting.fidelity: setting.generatrix for setting in runs if setting.fidelity != "lumped"}
    assert finest == {"full": 18, "axisymmetric": 144}


def test_the_papers_grid_confirms_no_grid_of_another_shape() -> None:
    of_paper = replace(run(9, 8.0, 1.0), setting=PAPER)
    coarse = run(18, 1.0, 1.0, courant=PAPER.courant)
    family = PAPER.family
    for cells, count in ((90, 2), (72, 1)):
        found = replace(made_up(coarse, of_paper), case=package.load_case(SCENE, [f"grid.hoop={cells}"]))
        assert len(found.families()[family]) == count
        assert (found.recommended("impact_velocity", 0.01) is None) == (count == 1)


@pytest.mark.parametrize(
    ("error", "why"),
    [(math.inf, "the budget holds too few runs"), (0.3, "is known to 30 % only"), (0.001, "that a finer one confirms")],
)
def test_why_nothing_is_recommended_is_said(error: float, why: str) -> None:
    stream = io.StringIO()
    print_work_precision(made_up(run(9, 1.0, 1.5), error=error), "softbrake run", Console(file=stream, width=120))
    assert stream.getvalue().count(why) >= 3


def test_a_cargo_that_stops_has_a_stroke() -> None:
    found = work_precision(package.load_case(SCENE, ["pressure.value=30 kPa", "cargo.velocity=4"]), budget=1.0)
    assert found.reference is not None
    assert list(found.reference.values) == ["stroke", "peak_deceleration", "peak_tension"]
    assert 0.05 < found.reference.values["stroke"] < 0.6


@pytest.mark.slow
def test_interrupt_keeps_what_was_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def report(done: int, planned: int, doing: str) -> None:
        if done == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(work_precision_module, "DOUBLINGS", 3)
    found = work_precision(package.load_case(SCENE, ["time.end=20 ms"]), 1e6, report)
    assert found.interrupted and len(found.runs) == 3
    assert {one.setting for one in found.runs} | {setting for setting, _ in found.left_out} == {*plan(found.case)}
    assert {why for _, why in found.left_out} == {INTERRUPTED}
    write_csv(found, tmp_path / "chart.csv")
    assert [line["role"] for line in lines_of(tmp_path / "chart.csv")].count("run") == 3


def test_interrupt_before_the_reference_keeps_an_older_chart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def reference(self: object) -> Reference:
        raise KeyboardInterrupt

    monkeypatch.setattr(work_precision_module._Campaign, "reference", reference)
    older = tmp_path / "chart.csv"
    older.write_text("older")
    done = CliRunner().invoke(app, ["chart", str(SCENE), "--output", str(tmp_path / "chart.png"), "--quiet"])
    assert done.exit_code == 130
    assert "nothing is written" in done.output
    assert older.read_text() == "older" and not (tmp_path / "chart.png").exists()


def lines_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.slow
def test_figure_shows_the_runs(charted: WorkPrecision) -> None:
    pytest.importorskip("matplotlib")
    from softbrake.report.plots.work_precision import work_precision_figure

    figure = work_precision_figure(replace_runs(charted))
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles[0].startswith("Impact velocity: 2.86")
    words = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert "36 x 90, Courant 0.02" in words
    assert any("Failed: 1" in word and "diverged" in word for word in words)
    times = np.concatenate([line.get_xdata() for line in figure.axes[0].lines])
    assert all(np.any(np.isclose(times, one.seconds)) for one in charted.runs)
    marks = [line for line in figure.axes[0].lines if line.get_marker() == "x"]
    assert len(marks) == 1  # the run that failed
    _, top = figure.axes[0].get_ylim()
    assert 0.5 * top < marks[0].get_ydata()[0] < top
    for axes in figure.axes[:6]:
        heights = np.concatenate([line.get_ydata() for line in axes.lines])
        assert np.isfinite(heights).all()


def replace_runs(found: WorkPrecision) -> WorkPrecision:
    """The chart with the paper's setting, and one that diverged."""
    failed = run(18, 0.1, 1.0, "diverged")
    return replace(found, runs=[*found.runs, replace(found.runs[-1], setting=PAPER), failed])


@pytest.mark.slow
def test_command(softbrake: Command, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    done = softbrake("chart", SCENE, "--budget", "10", *BRIEF, "-o", "work.svg")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "work.svg").read_bytes()[:5] == b"<?xml"
    lines = lines_of(tmp_path / "work.csv")
    assert {line["role"] for line in lines} == {"reference", "run", "left out"}
    for head in lines[0]:
        assert head in ("role", "fidelity", "scheme", "outcome") or head.endswith("]"), f"{head} has no unit"
    ran = [line for line in lines if line["role"] == "run"]
    for line in ran:
        assert float(line["kernel_seconds [s]"]) > 0.0
        assert float(line["error of stroke [%]"]) >= 0.0
    assert "stroke" in done.stdout and "left out" in done.stdout and "runs: " in done.stderr
    assert "work.svg, work.csv written" in done.stdout
    # The setting it recommends, run as it prints it, is the one that it charted.
    words = shlex.split(next(line for line in done.stdout.splitlines() if line.startswith("  softbrake run")))
    case = package.load_case(words[2], [word for word in words[3:] if word != "--set"])
    lowest = package.run(case).lowest_height
    keys = {"fidelity": case.model.fidelity, "generatrix [cells]": str(case.grid.generatrix)}
    same = [line for line in ran if all(line[key] == value for key, value in keys.items())]
    strokes = [float(line["stroke [m]"]) for line in same if float(line["courant [1]"]) == case.time.courant]
    assert strokes == [pytest.approx(case.shell.height - lowest, rel=1e-12)]


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (("-o", "chart.txt"), "the name of a picture ends in .png, .svg or .pdf"),
        (("-o", "none/chart.png"), "there is no folder none"),
        (("--budget", "-1"), "--budget"),
        (("--set", "fabric.E=no"), "fabric.E"),
    ],
)
def test_bad_input(arguments: tuple[str, ...], fault: str, softbrake: Command, tmp_path: Path) -> None:
    done = softbrake("chart", SCENE, *arguments)
    assert done.returncode == 2
    assert fault in done.stderr.replace("\n", " ")
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_interrupted_command_writes_what_it_has(tmp_path: Path, environment: dict[str, str]) -> None:
    pytest.importorskip("matplotlib")
    running = start("chart", SCENE, *BRIEF, "--budget", "60", environment=environment, folder=tmp_path)
    assert running.stderr is not None
    for line in running.stderr:
        if "of" in line and not line.startswith("0 of") and "runs: " in line:
            running.send_signal(signal.SIGINT)
            break
    out, _ = running.communicate(timeout=PATIENCE)
    assert running.returncode == 130
    assert "no-belts-chart.png, no-belts-chart.csv written" in out
    assert [line["role"] for line in lines_of(tmp_path / "no-belts-chart.csv")].count("run") > 0
