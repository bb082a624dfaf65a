"""Sampled sweeps: distributions, points, chances with their intervals, Sobol' indices, and means with a control."""

import csv
import json
import math
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from scipy import stats
from typer.testing import CliRunner

from softbrake.case.case import Case
from softbrake.case.case_file import CaseError, CaseFile, load_case, open_case
from softbrake.cli.app import app
from softbrake.report.console.chance import print_chance
from softbrake.report.html.sweep import sweep_page
from softbrake.report.plots.chance import draw_chance, sampled
from softbrake.report.results_csv import chance_in, relied, rows, write_results
from softbrake.sim.summary import Summary
from softbrake.studies import batch, sweep
from softbrake.studies.axes import Designs, designs_of, growing, key_of
from softbrake.studies.batch import Dropped, run_one
from softbrake.studies.chance import ALL, HELD, Chance, chance_of, controlled, sobol_indices, wilson
from softbrake.studies.distributions import LEAST, distribution_of
from softbrake.studies.sampling import NESTED, Sampling
from softbrake.studies.sweep import Shard, SweepError, merge_folders, read_journals, run_sweep

G = 9.80665
AREA = 0.25 * math.pi * 1.2**2
PISTON: dict[str, Any] = {  # a lumped drop under constant pressure, whose answer is known: `exact`
    "shell": {"diameter": 1.2, "height": 0.6},
    "fabric": {"E": 1e5, "nu12": 0.2, "areal_density": 0.3, "damping_ratio": 0.03},
    "cargo": {"mass": 500, "velocity": 8.5},
    "pressure": {"law": "constant", "value": 26e3},
    "model": {"fidelity": "lumped"},
    "limits": {"impact_velocity": "<= 5 m/s", "peak_deceleration": "<= 5 g"},
}
VARIED = ("cargo.velocity=normal(8.5 m/s, 0.3 m/s)", "pressure.value=normal(26 kPa, 1 kPa)", "cargo.mass=uniform(480,520)")
Answer = Callable[[Case], Dropped]


def exact(velocity: Any, pressure: Any, mass: Any) -> tuple[Any, Any]:
    """Impact velocity (m/s; 0 of a stop) and peak deceleration (m/s^2) of the piston: both forces are constant."""
    braking = pressure * AREA / mass - G
    return np.sqrt(np.maximum(velocity**2 - 2.0 * 0.6 * braking, 0.0)), braking


@pytest.fixture(scope="module")
def piston() -> CaseFile:
    return open_case(PISTON)


@pytest.fixture(scope="module")
def drop(piston: CaseFile) -> Summary:
    summary = run_one(piston.case).summary
    assert summary is not None
    return summary


@pytest.fixture
def standing(monkeypatch: pytest.MonkeyPatch) -> Callable[[Answer], None]:
    """Let a function stand for the drop, in all of a sweep."""

    def stand(answer: Answer) -> None:
        def run(cases: Sequence[Case], **_: Any) -> Iterator[Dropped]:
            yield from map(answer, cases)

        monkeypatch.setattr(sweep, "run_batch", run)

    return stand


def by_formula(drop: Summary) -> Answer:
    def answer(case: Case) -> Dropped:
        impact, braking = exact(case.cargo.velocity, case.filling.value, case.cargo.mass)
        return Dropped(replace(drop, impact_velocity=float(impact), peak_deceleration=float(braking)), None, None)

    return answer


def evaluated(designs: Designs, folder: Path) -> Chance:
    """Run a sampled sweep as the command does, and evaluate it."""
    plan = run_sweep(designs, folder)
    assert plan.sampling is not None
    return chance_in(plan.sampling, plan.case, rows(plan, read_journals(folder)))


# Distributions


@pytest.mark.parametrize(
    ("text", "other"),
    [
        ("normal(8 m/s, 0.5 m/s)", stats.norm(8.0, 0.5)),
        ("uniform(2 m/s, 800 cm/s)", stats.uniform(2.0, 6.0)),
        ("triangular(2, 7, 8)", stats.triang(5 / 6, 2.0, 6.0)),
        ("triangular(2, 2, 8)", stats.triang(0.0, 2.0, 6.0)),
        ("lognormal(8, 2)", stats.lognorm(math.sqrt(math.log(1 + 1 / 16)), scale=8 / math.sqrt(1 + 1 / 16))),
    ],
)
def test_distributions_are_those_of_their_names(text: str, other: Any) -> None:
    found = distribution_of(text, key_of("cargo.velocity"))
    assert found is not None
    one, _ = found
    for share in (1e-8, 1e-3, 0.1, 0.5, 0.8, 0.999, 1 - 1e-8):
        assert one.at(share) == pytest.approx(other.ppf(share), rel=1e-9)
    values = np.array([one.at((k + 0.5) / 20_000) for k in range(20_000)])
    assert values.mean() == pytest.approx(other.mean(), rel=1e-4)
    assert values.std() == pytest.approx(other.std(), rel=2e-3)
    assert one.at(0.0) == one.at(LEAST) < one.at(1.0) == one.at(1 - LEAST)


def test_lognormal_has_the_mean_and_deviation_of_its_numbers() -> None:
    found = distribution_of("lognormal(20 kPa, 3 kPa)", key_of("pressure.value"))
    assert found is not None and found[1] == "kPa"
    values = [found[0].at((k + 0.5) / 50_000) for k in range(50_000)]
    assert statistics.fmean(values) == pytest.approx(20e3, rel=1e-4)
    assert statistics.pstdev(values) == pytest.approx(3e3, rel=2e-3)


def test_a_deviation_in_degrees_is_a_difference() -> None:
    found = distribution_of("normal(20 degC, 5 degC)", key_of("gas.temperature"))
    assert found is not None and found[0].numbers == (293.15, 5.0)


@pytest.mark.parametrize(
    ("vary", "settings", "message"),
    [
        (
            ["cargo.mass=normal(5 kg, 2 kg)"],
            {},
            "cargo.mass: 'normal(5 kg, 2 kg)' reaches -7.242 kg, once in 2e+09 samples; a mass > 0",
        ),
        (["cargo.mass=uniform(-1 kg, 2 kg)"], {}, "reaches -1 kg; a mass > 0"),
        (["cargo.mass=gauss(5 kg, 2 kg)"], {}, "unknown distribution 'gauss'; normal, lognormal, uniform, triangular are known"),
        (["cargo.mass=normal(5 kg)"], {}, "has 1 numbers; normal(MEAN, DEVIATION) is expected"),
        (["cargo.mass=normal(5 kg, 2 m)"], {}, "'m' is a length; normal(MEAN, DEVIATION) with units is expected"),
        (["cargo.mass=normal(5 kg, 0 kg)"], {}, "a deviation of 0 kg; > 0 is expected"),
        (["cargo.mass=lognormal(0 kg, 1 kg)"], {}, "a mean of 0 kg; > 0 is expected"),
        (["cargo.velocity=uniform(8, 36 km/h)"], {}, "has units on some of its numbers; on all or none is expected"),
        (["cargo.mass=uniform(3 kg, 2 kg)"], {}, "does not rise; uniform(LOW, HIGH) is expected"),
        (["cargo.mass=triangular(1, 4, 3)"], {}, "does not rise; triangular(LOW, MODE, HIGH)"),
        (["grid.hoop=normal(120, 3)"], {}, "a distribution of what is no quantity"),
        (["cargo.masss=normal(5, 1)"], {}, "cargo.masss: unknown key; did you mean 'mass'?"),
        (
            ["cargo.mass=normal(500, 3)"],
            {"mode": "grid", "samples": None},
            "a distribution in mode grid; mode: random, lhs, sobol, saltelli",
        ),
        (["cargo.mass=1:2"], {"mode": "sobol", "samples": None}, "sweep.samples: missing"),
        (["cargo.mass=1:2:3"], {"mode": "sobol"}, "a range with a count in mode sobol"),
        (["cargo.mass=1:2"], {"mode": "saltelli", "samples": 400_000}, "1200000 runs; up to 1000000 are expected"),
        (["cargo.mass=1:2"], {"mode": "lhs", "until": "0.01"}, "sweep.until: given in mode lhs; mode: random or sobol"),
        (["cargo.mass=1,2"], {"mode": "grid", "samples": None, "until": "0.01"}, "sweep.until: given in mode grid"),
        (["cargo.mass=1:2"], {"control": "lumped"}, "of control and control_samples one is missing"),
        (["cargo.mass=1:2"], {"control": "lumped", "control_samples": 9}, "lumped is no cheaper than lumped"),
        (["cargo.mass=1:2"], {"control": "lumped", "control_samples": 9, "until": "0.1"}, "sweep.until: given with a control"),
        (
            ["cargo.mass=1:2"],
            {"samples": 2, "control": "lumped", "control_samples": 9},
            "2 with a control; 8 or more are expected",
        ),
        (["cargo.mass=1:2"], {"mode": "sobol", "control": "lumped", "control_samples": 9}, "mode: random is expected"),
        (["table=none.csv"], {}, "none.csv: No such file or directory; a table of samples is expected"),
    ],
)
def test_faults_of_samples(piston: CaseFile, vary: list[str], settings: dict[str, Any], message: str) -> None:
    with pytest.raises(CaseError) as caught:
        designs_of(piston, vary, {"mode": "random", "samples": 8, **settings})
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_sobol_points_without_scipy_are_refused_in_a_line(piston: CaseFile, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "scipy.stats", None)
    with pytest.raises(CaseError) as caught:
        designs_of(piston, VARIED, {"mode": "sobol", "samples": 8})
    assert str(caught.value) == "--mode sobol: sweep.mode: sobol needs scipy, which is not there; pip install 'softbrake[chance]'"
    assert len(designs_of(piston, VARIED, {"mode": "lhs", "samples": 8}).all) == 8


def test_a_section_and_options_ask_for_the_same_runs(tmp_path: Path) -> None:
    lines = [f"    {axis.replace('=', ': ', 1)}" for axis in VARIED]
    path = tmp_path / "case.yaml"
    path.write_text(
        json.dumps({**PISTON, "title": "block"})[:-1] + ', "sweep": {"mode": "sobol", "samples": 8, "seed": 3, "vary": {}}}'
    )
    block = tmp_path / "block.yaml"
    sections = [f"{name}: {json.dumps(part)}" for name, part in PISTON.items()]
    block.write_text("\n".join([*sections, "sweep:", "  mode: sobol", "  samples: 8", "  seed: 3", "  vary:", *lines]) + "\n")
    assert designs_of(open_case(block)) == designs_of(open_case(path), VARIED)


# Points


@pytest.mark.parametrize("mode", NESTED)
def test_more_samples_begin_with_those_of_fewer(mode: str) -> None:
    few, many = (list(Sampling(mode, samples, 5, ("a", "b", "c")).points()) for samples in (48, 200))
    assert many[:48] == few and len(many) == 200
    assert few != list(Sampling(mode, 48, 6, ("a", "b", "c")).points())


def test_sobol_points_are_spread_in_each_input_and_powers_of_two_are_said() -> None:
    points = np.array(list(Sampling("sobol", 64, 1, ("a", "b")).points()))
    for column in points.T:
        assert sorted((column * 64).astype(int)) == list(range(64))
    assert Sampling("sobol", 64, 1, ("a",)).unbalanced is None is Sampling("lhs", 65, 1, ("a",)).unbalanced
    assert (
        Sampling("sobol", 100, 1, ("a",)).unbalanced
        == "mode sobol: 100 samples are no power of two; 64 or 128 fill the cube evenly"
    )


def test_saltelli_points_differ_from_a_in_one_input_which_is_that_of_b() -> None:
    points = np.array(list(Sampling("saltelli", 16, 1, ("a", "b", "c")).points())).reshape(5, 16, 3)
    a, b, *mixed = points
    for k, block in enumerate(mixed):
        assert (block[:, k] == b[:, k]).all()
        assert (np.delete(block, k, axis=1) == np.delete(a, k, axis=1)).all()
    assert not (a == b).any()


def test_joint_samples_stay_together(piston: CaseFile, tmp_path: Path) -> None:
    table = tmp_path / "joint.csv"
    table.write_text("cargo.velocity [cm/s],cargo.mass [kg]\n800,490\n850,500\n\n900,515\n")
    pairs = {(8.0, 490.0), (8.5, 500.0), (9.0, 515.0)}
    designs = designs_of(piston, [f"table={table}", "pressure.value=normal(26 kPa, 1 kPa)"], {"mode": "lhs", "samples": 30})
    found = [design.values[:2] for design in designs.all]
    assert {pair: found.count(pair) for pair in pairs} == dict.fromkeys(pairs, 10)
    assert designs.sampling is not None and designs.sampling.inputs == ("joint.csv", "pressure.value")
    assert designs.axes[0].shown == "cm/s"
    side = designs_of(piston, [f"table={table}"], {"mode": "zip"})
    assert [design.values for design in side.all] == sorted(pairs)
    case = tmp_path / "case.yaml"
    case.write_text(json.dumps({**PISTON, "sweep": {"mode": "zip", "vary": {"table": "joint.csv"}}}))
    assert designs_of(open_case(case)).all == side.all  # beside the case file
    for text, message in (
        ("cargo.mass [kg\n1\n2\n", "no table; a head such as"),
        ("cargo.mass [kg]\n1\n", "no table"),
        ("cargo.mass,cargo.mass\n1,2\n1,3\n", "a key stands twice in the head"),
        ("cargo.mass,gravity\n1,2\n1\n", "row 3 has not 2 values; one for each key is expected"),
        ("cargo.mass [m]\n1\n2\n", "'m' is a length"),
    ):
        table.write_text(text)
        with pytest.raises(CaseError) as caught:
            designs_of(piston, [f"table={table}"], {"mode": "zip"})
        assert message in str(caught.value)


# Chances


@pytest.fixture(scope="module")
def truth() -> Mapping[str, float]:
    """Chances of the limits of the piston, of 4 million samples."""
    random = np.random.default_rng(1)
    impact, braking = exact(
        random.normal(8.5, 0.3, 4_000_000), random.normal(26e3, 1e3, 4_000_000), random.uniform(480, 520, 4_000_000)
    )
    held = {"impact_velocity": impact <= 5.0, "peak_deceleration": braking <= 5 * G}
    held[ALL] = held["impact_velocity"] & held["peak_deceleration"]
    return {name: float(each.mean()) for name, each in held.items()}


def test_drops_of_the_piston_are_the_formula(piston: CaseFile) -> None:
    for design in designs_of(piston, VARIED, {"mode": "random", "samples": 40}).all:
        summary, (impact, braking) = run_one(design.case).summary, exact(*np.array(design.values)[[0, 1, 2]])
        assert summary is not None
        assert summary.peak_deceleration == pytest.approx(braking, rel=1e-9)
        assert (summary.impact_velocity or 0.0) ** 2 == pytest.approx(impact**2, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "least"), [("random", 0.90), ("lhs", 0.97), ("sobol", 0.97)])
def test_intervals_hold_the_chance_in_19_of_20_seeds(
    piston: CaseFile,
    drop: Summary,
    truth: Mapping[str, float],
    standing: Callable[[Answer], None],
    tmp_path: Path,
    mode: str,
    least: float,
) -> None:
    """Independent samples in about 95 %, even ones in more: theirs scatter less than the interval says."""
    standing(by_formula(drop))
    inside = dict.fromkeys(truth, 0)
    for seed in range(100):
        found = evaluated(designs_of(piston, VARIED, {"mode": mode, "samples": 128, "seed": seed}), tmp_path / str(seed))
        for name, chance in truth.items():
            inside[name] += found.holds[name].low <= chance <= found.holds[name].high
    assert 0.1 < truth[ALL] < 0.9
    assert all(100 * least <= count <= 100 for count in inside.values()), inside
    if mode == "random":
        assert min(inside.values()) < 100


@pytest.mark.slow
def test_drops_themselves_give_the_chance(piston: CaseFile, truth: Mapping[str, float], tmp_path: Path) -> None:
    inside = 0
    for seed in range(20):
        found = evaluated(designs_of(piston, VARIED, {"mode": "random", "samples": 200, "seed": seed}), tmp_path / str(seed))
        inside += found.holds[ALL].low <= truth[ALL] <= found.holds[ALL].high
    assert inside >= 17


def test_wilson_is_that_of_scipy_and_never_of_no_width() -> None:
    for holds, runs in ((0, 50), (50, 50), (7, 20), (1, 1)):
        found, other = wilson(holds, runs), stats.binomtest(holds, runs).proportion_ci(0.95, method="wilson")
        assert (found.low, found.high) == pytest.approx((other.low, other.high), abs=1e-12)
        assert found.value == holds / runs and found.half > 0.0


def test_runs_without_an_answer_are_counted_and_keep_no_limit(
    piston: CaseFile, drop: Summary, standing: Callable[[Answer], None], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def failing(case: Case) -> Dropped:
        lost = case.cargo.velocity > 9.0
        return (
            Dropped(None, "lost", None) if lost else Dropped(replace(drop, impact_velocity=1.0, peak_deceleration=G), None, None)
        )

    standing(failing)
    designs = designs_of(piston, VARIED, {"mode": "saltelli", "samples": 128})
    fast = [design.values[0] > 9.0 for design in designs.all]
    found = evaluated(designs, tmp_path)
    assert found.runs == 256 and found.lost == sum(fast[:256]) > 0
    assert found.holds[ALL].value == 1.0 - found.lost / 256
    assert found.left_out == int(np.array(fast).reshape(-1, 128).any(axis=0).sum())
    assert all(math.isnan(index.first.value) for index in found.indices["impact_velocity"])  # it does not vary
    plan, records = merge_folders([tmp_path])
    print_chance(plan, found, Console(width=120))
    said = capsys.readouterr().out
    assert f"{found.lost} of them have no answer and count as missed" in said
    assert f"{found.left_out} samples with a run without an answer are left out" in said
    draw_chance(found, "title", plan.axes, plan.case, rows(plan, records), tmp_path / "x.png")
    assert (tmp_path / "x.png").stat().st_size > 10_000


def test_quantiles_and_spread_are_those_of_the_answers(
    piston: CaseFile, drop: Summary, standing: Callable[[Answer], None], tmp_path: Path
) -> None:
    standing(by_formula(drop))
    designs = designs_of(piston, VARIED[1:2], {"mode": "sobol", "samples": 1024})
    spread = evaluated(designs, tmp_path).spreads["peak_deceleration"]
    assert spread.mean == pytest.approx(26e3 * AREA / 500 - G, rel=1e-3)
    assert spread.deviation == pytest.approx(1e3 * AREA / 500, rel=0.01)
    assert spread.quantiles[1] == pytest.approx(stats.norm(26e3, 1e3).ppf(0.05) * AREA / 500 - G, rel=1e-3)


# Sobol' indices


def test_indices_of_ishigami_through_a_sweep(
    piston: CaseFile, drop: Summary, standing: Callable[[Answer], None], tmp_path: Path
) -> None:
    """Ishigami and Homma (1990), a = 7, b = 0.1, whose indices are known."""

    def ishigami(case: Case) -> Dropped:
        shares = (case.cargo.velocity - 2.0, case.cargo.mass - 100.0, case.filling.value - 5.0)
        x, y, z = ((2.0 * share - 1.0) * math.pi for share in shares)
        value = math.sin(x) + 7.0 * math.sin(y) ** 2 + 0.1 * z**4 * math.sin(x)
        return Dropped(replace(drop, impact_velocity=value), None, None)

    standing(ishigami)
    vary = ("cargo.velocity=uniform(2, 3)", "cargo.mass=uniform(100, 101)", "pressure.value=uniform(5, 6)")
    found = evaluated(designs_of(piston, vary, {"mode": "saltelli", "samples": 1024}), tmp_path)
    variance = 7.0**2 / 8 + 0.1 * math.pi**4 / 5 + 0.1**2 * math.pi**8 / 18 + 0.5
    first = [0.5 * (1 + 0.1 * math.pi**4 / 5) ** 2, 7.0**2 / 8, 0.0]
    mixed = 0.1**2 * math.pi**8 * (1 / 18 - 1 / 50)
    total = [first[0] + mixed, first[1], mixed]
    assert found.runs == 2048
    assert found.spreads["impact_velocity"].deviation ** 2 == pytest.approx(variance, rel=0.02)
    for index, one, whole in zip(found.indices["impact_velocity"], first, total, strict=True):
        assert index.first.value == pytest.approx(one / variance, abs=0.02)
        assert index.total.value == pytest.approx(whole / variance, abs=0.02)
        assert index.first.low < one / variance < index.first.high
        assert index.total.low < whole / variance < index.total.high


def test_indices_are_those_of_scipy() -> None:
    random = np.random.default_rng(2)
    blocks = random.normal(size=(5, 64)).cumsum(axis=0) + 100.0
    own = sobol_indices(blocks, ("a", "b", "c"))
    parts = {"f_A": blocks[:1], "f_B": blocks[1:2], "f_AB": blocks[2:, None]}
    other = stats.sobol_indices(func=parts, n=64)
    assert [index.first.value for index in own] == pytest.approx(other.first_order.ravel().tolist(), rel=1e-10)
    assert [index.total.value for index in own] == pytest.approx(other.total_order.ravel().tolist(), rel=1e-10)


# A control


def skewed(random: np.random.Generator, n: int, m: int) -> tuple[Any, Any, Any]:
    """A dear answer of mean 1 + 2/3, a cheap one beside it, and the cheap one alone: both far from normal."""
    u, v, w = random.uniform(size=n), random.uniform(size=n), random.uniform(size=m)
    return 1.0 + 2.0 * u**2 + 0.3 * (v - 0.5), np.exp(3.0 * u), np.exp(3.0 * w)


def test_a_controlled_mean_is_unbiased_where_the_plain_coefficient_is_not() -> None:
    random, own, naive = np.random.default_rng(3), [], []
    for _ in range(20_000):
        dear, beside, more = skewed(random, 4, 40)
        own.append(controlled(dear, beside, more).mean.value)
        slope = np.cov(dear, beside)[0, 1] / beside.var(ddof=1) / (1 + 4 / 40)
        naive.append(dear.mean() - slope * (beside.mean() - more.mean()))
    error = np.std(own) / math.sqrt(len(own))
    assert abs(np.mean(own) - 5 / 3) < 3.5 * error
    assert abs(np.mean(naive) - 5 / 3) > 6 * np.std(naive) / math.sqrt(len(naive))


def test_the_interval_and_the_variance_saved_of_a_controlled_mean_are_true() -> None:
    random, found = np.random.default_rng(4), []
    for _ in range(2000):
        found.append(controlled(*skewed(random, 40, 2000)))
    means = np.array([each.mean.value for each in found])
    plain = np.array([each.plain.value for each in found])
    inside = np.mean([each.mean.low <= 5 / 3 <= each.mean.high for each in found])
    assert 0.92 < inside < 0.97
    saved = 1.0 - means.var() / plain.var()
    assert saved > 0.7
    assert np.mean([each.saved for each in found]) == pytest.approx(saved, abs=0.04)


def test_a_control_that_knows_nothing_saves_nothing_and_one_that_knows_all_nearly_all() -> None:
    random = np.random.default_rng(5)
    dear, other, more = random.normal(size=400), random.normal(size=400), random.normal(size=40_000)
    assert abs(controlled(dear, other, more).saved) < 0.02
    assert controlled(dear, dear, more).saved == pytest.approx(1 - 400 / 40_400, abs=0.01)
    assert controlled(dear, np.ones(400), np.ones(400)).mean == controlled(dear, np.ones(400), np.ones(400)).plain


@pytest.mark.slow
def test_lumped_drops_control_axisymmetric_ones(tmp_path: Path) -> None:
    coarse = {
        "grid": {"generatrix": 12, "hoop": 36},
        "model": {"fidelity": "axisymmetric"},
        "limits": {"impact_velocity": "<= 3.4 m/s"},
    }
    file = open_case({**PISTON, **coarse})
    vary = VARIED[:2]
    found = evaluated(
        designs_of(file, vary, {"mode": "random", "samples": 40, "control": "lumped", "control_samples": 1000, "seed": 1}),
        tmp_path / "few",
    )
    many = evaluated(designs_of(file, vary, {"mode": "sobol", "samples": 512}), tmp_path / "many")
    assert found.runs == 40
    for name in ("peak_deceleration", "impact_velocity"):
        one, sure = found.controlled[name], many.spreads[name].mean
        assert one.mean.low <= sure <= one.mean.high and one.mean.half < one.plain.half
        assert one.saved > 0.5
    chance = found.controlled[f"{HELD}impact_velocity"].mean
    assert chance.low <= many.holds["impact_velocity"].value <= chance.high
    plan, records = merge_folders([tmp_path / "few"])
    assert [run.values[-1] for run in plan.runs] == ["axisymmetric"] * 40 + ["lumped"] * 1040
    assert [run.values[:-1] for run in plan.runs[:40]] == [run.values[:-1] for run in plan.runs[40:80]]
    assert {records[run.id]["summary"]["model"]["fidelity"] for run in plan.runs[40:]} == {"lumped"}


# Running


def test_shards_and_resumed_sweeps_have_the_same_runs(piston: CaseFile, tmp_path: Path) -> None:
    def designs() -> Designs:
        return designs_of(piston, VARIED, {"mode": "saltelli", "samples": 4, "seed": 7})

    whole = run_sweep(designs(), tmp_path / "whole")
    for number in (1, 2):
        run_sweep(designs(), tmp_path / "parts", shard=Shard(number, 2))
    plan, records = merge_folders([tmp_path / "parts"])
    assert plan == whole and len(records) == 20
    kept = read_journals(tmp_path / "whole")
    for id, record in records.items():
        assert record["summary"]["impact_velocity"] == kept[id]["summary"]["impact_velocity"]
    told: list[tuple[int, int, bool]] = []
    run_sweep(designs(), tmp_path / "whole", progress=lambda *numbers: told.append(numbers))
    assert told == [(20, 20, False)]


def test_samples_double_until_the_chance_is_known(
    piston: CaseFile, drop: Summary, standing: Callable[[Answer], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case, folder, runner = tmp_path / "case.yaml", tmp_path / "s", CliRunner()
    case.write_text(json.dumps(PISTON))
    count: list[int] = []
    answer = by_formula(drop)
    standing(lambda case: count.append(1) or answer(case))  # type: ignore[func-returns-value]
    vary = [word for axis in VARIED for word in ("--vary", axis)]
    command = ["sweep", str(case), *vary, "--mode", "sobol", "-q", "--until", "0.04", "-o", str(folder)]
    first = runner.invoke(app, command, catch_exceptions=False)
    assert first.exit_code == 0
    plan, _ = merge_folders([folder])
    runs = len(plan.runs)
    assert runs & (runs - 1) == 0 and runs == len(count)
    found = chance_in(plan.sampling, plan.case, rows(plan, read_journals(folder)))
    assert found.holds[ALL].half <= 0.04
    with open(folder / "results.csv", newline="") as stream:
        half = [row["pass"] == "1" for row in csv.DictReader(stream)][: runs // 2]
    assert wilson(sum(half), len(half)).half > 0.04
    again = runner.invoke(app, command, catch_exceptions=False)
    assert again.exit_code == 0 and len(count) == runs and again.stdout == first.stdout
    short = runner.invoke(app, [*command[:-2], "--samples", "100", "-o", str(tmp_path / "t")], catch_exceptions=False)
    assert short.exit_code == 1 and "--until 0.04: not reached by 100 samples, which leave ± 0.09" in short.output
    for more, message in (
        (["--shard", "1/2"], "--shard: a sweep until an accuracy is one process"),
        (["--set", "limits={}"], "has no section limits, whose chance it asks for"),
    ):
        refused = runner.invoke(app, [*command, *more])
        assert refused.exit_code == 2 and message in refused.output
    with pytest.raises(SweepError, match="holds another sweep"):
        run_sweep(designs_of(piston, VARIED, {"mode": "sobol", "samples": 64, "seed": 1}), folder, growing=True)
    stages = growing(piston, VARIED, {"mode": "random", "until": "0.1", "samples": 200})
    assert [len(designs.all) for designs, _ in stages] == [64, 128, 200]
    case.write_text(
        json.dumps({**PISTON, "sweep": {"mode": "sobol", "samples": 80, "until": 0.1, "vary": {"cargo.mass": "1:2"}}})
    )
    for settings, counts in (({}, [64, 80]), ({"until": "0.2"}, [64, 128, 256]), ({"until": "0.2", "samples": 70}, [64, 70])):
        assert [len(designs.all) for designs, _ in islice(growing(open_case(case), (), settings), 3)] == counts


def test_the_page_and_the_json_of_a_sample_have_its_chance(
    drop: Summary, standing: Callable[[Answer], None], tmp_path: Path
) -> None:
    standing(by_formula(drop))
    case, folder = tmp_path / "case.yaml", tmp_path / "s"
    case.write_text(json.dumps({**PISTON, "title": "piston"}))
    vary = [word for axis in VARIED for word in ("--vary", axis)]
    command = ["sweep", str(case), *vary, "--mode", "saltelli", "--samples", "60", "-q", "-o", str(folder), "--json"]
    result = CliRunner().invoke(app, command, catch_exceptions=False)
    assert result.exit_code == 0 and "60 samples are no power of two; 32 or 64 fill the cube evenly" in result.stderr
    *lines, last = result.stdout.splitlines()
    assert len(lines) == 300 and all("id" in json.loads(line) for line in lines)
    found = json.loads(last)["chance"]
    assert found["runs"] == 120 and 0 < found["holds"][ALL]["value"] < 1
    assert (folder / "chance.png").exists()
    page = sweep_page(folder)
    for text in (
        "Chance that limits hold, of 120 runs",
        "Sobol&#x27; indices of impact velocity, 60 samples",
        "Peak deceleration",
    ):
        assert text in page
    plan, records = merge_folders([folder])
    write_results(folder, plan, rows(plan, records))
    chance = chance_in(plan.sampling, plan.case, rows(plan, records))
    (one, *_) = sampled(chance, plan.axes, plan.case, rows(plan, records))
    strongest = max(one.indices, key=lambda index: index.total.value)
    assert one.scales[0].label.startswith(strongest.input)  # the scatter is over what moves the answer most


def test_a_varied_case_is_the_case_loaded_anew(piston: CaseFile) -> None:
    """Sections that an override does not touch are taken from the case before: the whole must not notice."""
    shipped = Path(__file__).resolve().parents[1] / "configs"
    for name, overrides in (
        (
            "paper.yaml",
            ["fabric.E=19 kN/m", "belts.width=11 mm", "shell.height=0.7 m", "friction=0.1", "model.fidelity=axisymmetric"],
        ),
        (
            "airdrop-vented.yaml",
            ["gas.temperature=260 K", "ambient.altitude=1 km", "fabric.damping_ratio=1 %", "time.after=stop"],
        ),
        ("airdrop-vented.yaml", ["model={}", "vents.0.area=1 cm^2", "cargo.diameter=1 m", "grid={}", "time.end=2 s"]),
    ):
        file = open_case(shipped / name)
        for number in range(1, len(overrides) + 1):
            assert file.set(overrides[:number]).case == load_case(shipped / name, overrides[:number])
        step = file
        for override in overrides:
            step = step.set([override])
        assert step.case == load_case(shipped / name, overrides)
    for override in ("cargo.diameter=5 m", "gravity=-1", "fabrik.E=3", "grid.hoop=3", "pressure.law=sine"):
        with pytest.raises(CaseError) as varied:
            piston.set([override])
        with pytest.raises(CaseError) as anew:
            load_case(PISTON, [override])
        assert varied.value.faults == anew.value.faults
    assert batch.run_one(piston.case).fault is None


def test_runs_that_cannot_be_relied_on_are_no_answers() -> None:
    """Of a row: doubt, a fall that time.end cut off; 0 without impact or rebound, no bound without tension."""
    sound = {"outcome": "impact", "fault": "", "doubt": "", "rest_time": "", "end_time": "0.2", "peak_tension_hoop": "5.0"}
    sound |= {"impact_velocity": "1.5", "peak_deceleration": "70.0", "rebound_velocity": "", "fabric_margin": ""}
    table = [
        sound,
        sound | {"doubt": "fabric made 2 %"},
        sound | {"outcome": "time_limit", "impact_velocity": ""},
        sound | {"outcome": "time_limit", "rest_time": "0.1", "impact_velocity": ""},
        sound | {"outcome": "diverged"},
        sound | {"fault": "not run"},
    ]
    nan = math.nan
    np.testing.assert_array_equal(relied(table, "impact_velocity"), [1.5, nan, nan, 0.0, nan, nan])
    np.testing.assert_array_equal(relied(table, "peak_deceleration"), [70.0, nan, nan, 70.0, nan, nan])
    np.testing.assert_array_equal(relied(table, "rebound_velocity"), [0.0, nan, nan, nan, nan, nan])
    np.testing.assert_array_equal(relied(table, "fabric_margin"), [math.inf, nan, nan, math.inf, nan, nan])


def test_a_lost_run_takes_its_twin_along_and_no_more() -> None:
    """A controlled mean over the pairs that are there, and how many runs are not."""
    random = np.random.default_rng(2)
    x = random.normal(size=100)
    answers = np.concatenate((x[:40] + 5.0, x))  # dear runs, then cheap ones at the same and at more samples
    whole = chance_of(Sampling("random", 40, 0, ("a",), "lumped", 60), {"impact_velocity": answers}, {})
    answers[3] = answers[47] = answers[90] = math.nan
    found = chance_of(Sampling("random", 40, 0, ("a",), "lumped", 60), {"impact_velocity": answers}, {})
    kept = np.delete(np.arange(40), [3, 7])
    expected = controlled(x[kept] + 5.0, x[kept], np.delete(x[40:], 10))
    assert found.controlled["impact_velocity"] == expected and found.uncontrolled == 3
    assert whole.uncontrolled == 0


def test_a_control_that_does_not_vary_corrects_nothing() -> None:
    dear = np.random.default_rng(1).normal(size=50)
    assert controlled(dear, np.full(50, 0.1), np.full(80, 0.1)).coefficient == 0.0
