"""The page of a result: sound HTML that needs nothing from outside, and numbers that are those of the file."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import synthetic_drop as drop
from conftest import ROOT, Command

from softbrake.case.case import load_case
from softbrake.core.columns import History
from softbrake.report.html import result_page, sweep_page, write_report
from softbrake.report.page import BUCKETS, Curve, Mark, chart, table
from softbrake.sim.result_file import ResultError, ResultFile, read_history, replace_summary
from softbrake.sim.simulation import run
from softbrake.sim.summary import FilteredPeaks, Peak, Sensitivities, Sensitivity

VOID = {"meta"}


class Page(HTMLParser):
    """Checks that tags close in order, and gathers texts, attributes and the tables."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.tags: list[str] = []
        self.texts: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)

    @property
    def words(self) -> str:
        return "\n".join(self.texts)


def path_of(text: str, number: int = 0) -> np.ndarray:
    """Points of a curve of a chart."""
    curves = re.findall(r'<path d="M([^"]*)" fill="none"', text)
    return np.array([[float(part) for part in point.split()] for point in curves[number].split("L")])


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "drop.vtkhdf"
    drop.write(path, replace(drop.case(6, 8, belts=2), title="Tom & <b>Jerry</b>"))
    return path


def test_page_is_whole_and_needs_nothing_from_outside(result: Path) -> None:
    text = result_page(result)
    found = Page(text)
    assert text.startswith("<!doctype html>")
    assert not {"script", "link", "img", "iframe", "object", "b>Jerry"} & set(found.tags)
    assert not [pair for pair in found.attributes if pair[0] in ("src", "href", "xlink:href", "srcset")]
    assert not re.search(r"https?:|//|@import|url\(", text)
    assert "Tom & <b>Jerry</b>" in found.texts
    assert "nan" not in text.replace("nanmean", "").lower().split()
    assert len(text) < 200_000


def test_numbers_are_those_of_the_result(result: Path) -> None:
    words = Page(result_page(result)).words
    for piece in (
        "Impact: the cover reached the ground at 0.12 s.",
        "3.600 m/s",
        "free fall 6.911 m/s",
        "2.04 g",
        "8.00 kN/m",
        "no error bar was asked for",
        "shell.diameter\n0.5 m\nof the unloaded shell and of the covers",
        "belts.1.height\n0.4 m",
        "-1140.00 J",
        "Shape at 8 moments",
    ):
        assert piece in words


def test_errors_margins_and_sensitivities_are_shown(tmp_path: Path) -> None:
    file = tmp_path / "drop.vtkhdf"
    drop.write(file, drop.case(6, 8))
    changes = {"impact_velocity": -1.25, "peak_deceleration": None}
    found = Sensitivities(
        [Sensitivity("cargo.mass", 100.0, changes)],
        dict.fromkeys(changes, 0.01),
        dict.fromkeys(changes, 0.002),
        {},
        {"a": "why"},
    )
    errors = {"peak_deceleration": 0.98, "peak_tension_hoop": 120.0, "peak_tension_generatrix": None}
    answer = replace(
        drop.summary(),
        impact_velocity_error=0.05,
        peak_errors=errors,
        fidelity_reason="three grids",
        fabric_margin=0.5,
        belt_margin=-0.1,
        sensitivity=found,
    )
    replace_summary(file, answer)
    text = result_page(file)
    words = Page(text).words
    for piece in (
        "3.600 ± 0.05 m/s",
        "± 0.1 g",
        "± 0.12 kN/m",
        "4.00 ± no bound, kN/m",
        "three grids",
        "+50%",
        "-10%",
        "cargo.mass\n-1.25\n–",
        "0.2",
        "a is not",
    ):
        assert piece in words
    assert "exceeded" in words and text.count("class=bad") == 1


def test_phases_and_filtered_peaks_are_shown(tmp_path: Path) -> None:
    file = tmp_path / "drop.vtkhdf"
    drop.write(file, drop.case(6, 8))
    peaks = {
        "peak_deceleration": Peak(20.0, 0.004, None, "overshoot", Peak(9.80665, 0.05, None, "crushing")),
        "peak_tension_hoop": Peak(8e3, 0.06, 0.3, "crushing", Peak(6e3, 0.003, 0.2, "overshoot")),
    }
    behind = FilteredPeaks(180, None, Peak(14.709975, 0.005, None, "overshoot"), None, Peak(7e3, 0.061, None, "crushing"))
    replace_summary(file, replace(drop.summary(), peaks=peaks, filtered=behind))
    words = Page(result_page(file)).words
    assert "net of gravity; at 4 ms, overshoot; crushing: 1.00 g; CFC 180: 1.50 g, overshoot" in words
    assert "at 60 ms, 0.3 m up the shell, crushing; overshoot: 6.00 kN/m; CFC 180: 7.00 kN/m, crushing" in words
    replace_summary(file, replace(drop.summary(), filtered=FilteredPeaks(60, "5 ms long, 24 wanted")))
    assert "CFC 60: none, 5 ms long, 24 wanted" in Page(result_page(file)).words


def test_curves_are_the_history(result: Path) -> None:
    """The first chart's first curve, scaled back by two of its own points, is the speed over time."""
    text = result_page(result)
    points, history = path_of(text), read_history(result)
    assert len(points) == len(history)
    x, y = history["time"], -history["velocity"]
    for drawn, true in ((points[:, 0], x), (points[:, 1], y)):
        scale = (true[-1] - true[0]) / (drawn[-1] - drawn[0])
        np.testing.assert_allclose(true[0] + scale * (drawn - drawn[0]), true, atol=2e-3 * np.ptp(true))
    assert points[0, 1] < points[-1, 1]  # it slows down, and places grow downwards


def test_shapes_are_cuts_through_opposite_columns(result: Path) -> None:
    shapes = result_page(result).split('class="shapes">')[1]
    middle = shapes.split("</figure>")[3]
    xyz, _ = drop.shape(drop.case(6, 8, belts=2), float(re.findall(r"([\d.]+) ms <span>", middle)[0]) / 1e3)
    right, left = path_of(middle, 0), path_of(middle, 1)
    assert right.shape == (7, 2)
    scale = np.ptp(right[:, 1]) / np.ptp(xyz[:, 0, 2])
    np.testing.assert_allclose(right[:, 0] - left[:, 0], scale * (xyz[:, 0, 0] - xyz[:, 4, 0]), atol=0.3)
    assert middle.count("<circle") == 4


def test_long_curves_keep_their_peaks() -> None:
    x = np.linspace(0.0, 1.0, 100_000)
    y = np.sin(50 * x)
    y[54_321] = 7.0
    points = path_of(chart("a", "m", x, [Curve("", y)], "s"))
    assert len(points) <= 2 * BUCKETS + 2
    assert points[np.argmin(points[:, 1]), 0] == pytest.approx(points[0, 0] + 0.54321 * np.ptp(points[:, 0]), abs=0.1)


def test_charts_bear_what_is_not_a_number() -> None:
    x = np.array([0.0, 1.0, 2.0, np.nan])
    text = chart("a", "m", x, [Curve("one", np.array([1.0, np.nan, 3.0, 1.0])), Curve("two", np.full(4, np.nan))], "s")
    assert "nan" not in text
    assert len(path_of(text)) == 2
    assert "nan" not in chart("flat", "m", x[:1], [Curve("", np.zeros(1))], "s", [Mark(0.0, 0.0, 0.1)])


def test_tables_escape() -> None:
    assert "<td>a&lt;b</td>" in table(("x", "y"), [("a<b", "1")], 1)
    assert '<td class="n">1</td>' in table(("x", "y"), [("a<b", "1")], 1)


def test_killed_and_diverged_runs_have_a_page(tmp_path: Path) -> None:
    killed, diverged, case = tmp_path / "killed.vtkhdf", tmp_path / "diverged.vtkhdf", drop.case(6, 8)
    drop.write(killed, case, finished=False)
    assert "did not finish" in Page(result_page(killed)).words
    with ResultFile.create(diverged, case, version="1", source_hash="a") as file:
        drop.add_snapshot(file, case, 0.0)
        xyz, fields = drop.shape(case, 0.01)
        file.add_snapshot(0.01, xyz * np.nan, fields, height=np.nan, velocity=np.nan, pressure=1.0)
        file.add_history(np.vstack((drop.history(np.array([0.0])), np.full((1, len(History)), np.nan))))
        file.write_summary(
            replace(drop.summary(), outcome="diverged", impact_velocity=None, impact_time=None, energy_error=np.nan)
        )
    assert "not an answer" in Page(result_page(diverged)).words


COLUMNS = "run,id,pressure.value,outcome,fault,impact_velocity,minimum_height,peak_deceleration,peak_tension_belt\n"
SWEEP = {  # as a sweep writes them: stops above the ground, lands, lands, bursts
    "plan.json": '{"title": "Sweep <1>", "case": {"title": "Sweep <1>", "cargo": {"mass": 123.5}}}',
    "results.csv": COLUMNS + "1,a,30000.0,stopped,,,0.1,98.0665,\n2,b,20000.0,impact,,1.5,0.0,49.03325,\n"
    "3,c,10000.0,impact,,6.25,0.0,19.6133,\n4,d,90000.0,diverged,it <bursts>,9.0,0.5,1e9,\n",
    "results.units.csv": COLUMNS + ",,Pa,,,m/s,m,m/s^2,N/m\n",
}


def sweep(folder: Path, **changes: str) -> Path:
    folder.mkdir()
    for name, text in SWEEP.items():
        (folder / name).write_text(changes.get(name.split(".")[0], text), encoding="utf-8")
    return folder


def test_page_of_a_sweep(tmp_path: Path) -> None:
    text = sweep_page(sweep(tmp_path / "one-sweep"))
    found = Page(text)
    for piece in ("Sweep <1>", "4 runs over pressure.value", "1 of them have no answer.", "it <bursts>", "Peak deceleration, g"):
        assert piece in found.texts or piece in found.words
    assert "2\nimpact\n20000\n1.5\n5\n–" not in found.words  # no belts, no column of theirs
    assert "2\nimpact\n20000\n1.5\n5\n0" in found.words
    assert "1\nstopped\n30000\n–\n10\n0.1" in found.words
    assert "4\ndiverged\n90000\n–\n–\n–" in found.words
    assert "cargo.mass\n123.5 kg" in found.words  # of the case
    curve = path_of(text)
    assert len(curve) == 3
    assert list(curve[:, 0]) == sorted(curve[:, 0])  # by the axis, whatever the order of the runs
    heights = (curve[:, 1] - curve[2, 1]) / (curve[0, 1] - curve[2, 1])
    np.testing.assert_allclose(heights, [1.0, 1.5 / 6.25, 0.0], atol=2e-3)  # stopped: an impact velocity of 0
    assert "belt" not in "".join(value or "" for name, value in found.attributes if name == "aria-label")


def test_sweep_over_two_axes_has_a_dot_a_run(tmp_path: Path) -> None:
    results = "run,id,cargo.mass,fabric.slack,outcome,fault,impact_velocity\n" + "".join(
        f"{k},x{k},{mass},{slack},impact,,{2.0 + k}\n"
        for k, (mass, slack) in enumerate([(50.0, "cut"), (100.0, "cut"), (50.0, "compression"), (100.0, "compression")])
    )
    units = "run,id,cargo.mass,fabric.slack,outcome,fault,impact_velocity\n,,kg,,,,m/s\n"
    folder = sweep(tmp_path / "two-sweep")
    (folder / "results.csv").write_text(results)
    (folder / "results.units.csv").write_text(units)
    text = sweep_page(folder)
    Page(text)
    assert text.count("<figure>") == 1  # words make no axis
    assert text.count("<circle") == 4


def test_faults_of_a_sweep(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(ResultError, match="the folder of a finished sweep is wanted"):
        sweep_page(tmp_path / "empty")
    for number, changes in enumerate(({"plan": "{}"}, {"plan": "{"}, {"results": "a,b\n1,2\n"}, {"results": ""})):
        with pytest.raises(ResultError, match="not the results of a sweep"):
            sweep_page(sweep(tmp_path / f"bad{number}", **changes))


def test_faults(tmp_path: Path) -> None:
    empty, page = tmp_path / "empty.vtkhdf", tmp_path / "page.html"
    ResultFile.create(empty, drop.case(6, 8), version="1", source_hash="a").close()
    page.write_text("older")
    with pytest.raises(ResultError, match="before it recorded anything"):
        write_report(empty, page)
    with pytest.raises(ResultError, match="No such file"):
        write_report(tmp_path / "none.vtkhdf", page)
    assert page.read_text() == "older"


@pytest.mark.slow
def test_command(softbrake: Command, tmp_path: Path) -> None:
    drop.write(tmp_path / "drop.vtkhdf", drop.case(6, 8))
    kept = (tmp_path / "drop.vtkhdf").read_bytes()
    done = softbrake("report", "drop.vtkhdf")
    assert (done.returncode, done.stdout, done.stderr) == (0, "drop.html written\n", "")
    Page((tmp_path / "drop.html").read_text(encoding="utf-8"))
    for arguments, fault in (
        (("none.vtkhdf",), "none.vtkhdf: cannot be read: No such file"),
        (("drop.vtkhdf", "-o", "no/page.html"), "no/page.html: cannot be written: No such file or directory"),
        (("drop.html",), "drop.html: cannot be read"),
        (("drop.vtkhdf", "-o", "drop.vtkhdf"), "drop.vtkhdf: the name of a page ends in .html"),
        (("drop.html", "-o", "./drop.html"), "drop.html: is the result"),
    ):
        done = softbrake("report", *arguments)
        assert (done.returncode, done.stdout) == (2, "")
        assert fault in done.stderr and "Traceback" not in done.stderr
    assert (tmp_path / "drop.vtkhdf").read_bytes() == kept


def test_lumped_run_has_no_tensions_to_show(tmp_path: Path) -> None:
    case = load_case(ROOT / "configs" / "no-belts.yaml", ["model.fidelity=lumped", "fabric.strength=30 kN/m"])
    run(case, tmp_path / "gas.vtkhdf")
    words = Page(result_page(tmp_path / "gas.vtkhdf")).words.lower()
    assert "net of gravity" in words
    assert not [shown for shown in ("peak tension", "largest tensions", "margin, fabric") if shown in words]


def test_pages_of_folders_stand_beside_them(softbrake: Command, tmp_path: Path) -> None:
    sweep(tmp_path / "moduli-1.5")
    assert softbrake("report", "moduli-1.5").stdout == "moduli-1.5.html written\n"
    page = (tmp_path / "moduli-1.5.html").read_bytes()
    (tmp_path / "moduli-1.5.html").unlink()
    assert softbrake("report", "moduli-1.5/../moduli-1.5/.").returncode == 0
    assert (tmp_path / "moduli-1.5.html").read_bytes() == page
    done = softbrake("report", ".")
    assert (done.returncode, done.stdout) == (2, "")
    assert "the folder of a finished sweep is wanted" in done.stderr and "Traceback" not in done.stderr
