"""The page of a result: sound HTML that needs nothing from outside, and numbers that are those of the file."""

import re
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import synthetic_drop as drop
from conftest import ROOT, Command
from matplotlib.figure import Figure
from typer.testing import CliRunner

from softbrake.case.case_file import load_case, parse_case
from softbrake.cli.app import app
from softbrake.core.columns import History
from softbrake.report.html.frame import table
from softbrake.report.html.result import result_page
from softbrake.report.html.sweep import sweep_page
from softbrake.report.html.write import write_report
from softbrake.report.plots.drop import result_figure
from softbrake.report.plots.page import BUCKETS, DASHES, as_svg, drop_charts, shapes, sweep_chart
from softbrake.sim.inflate import inflate
from softbrake.sim.result_file import (
    ResultError,
    ResultFile,
    read_case,
    read_history,
    read_snapshots,
    read_summary,
    read_tension_scale,
    replace_summary,
)
from softbrake.sim.simulation import simulate
from softbrake.sim.summary import FilteredPeaks, PeakValue, Sensitivities, Sensitivity

pytest.importorskip("matplotlib")
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


def in_pixels(figure: Figure, number: int) -> np.ndarray:
    """Points of a line of a figure as its picture must have them, downwards."""
    (axes,) = figure.axes
    line = axes.lines[number]
    points = axes.transData.transform(np.column_stack(line.get_data())) * 72.0 / figure.dpi
    return np.column_stack((points[:, 0], 72.0 * figure.get_figheight() - points[:, 1]))


def paths(text: str) -> list[np.ndarray]:
    """Points of the open paths of a picture."""
    found = re.findall(r'<path d="M ([^"zC]*)" style="fill: none; stroke', text)
    return [np.array([[float(part) for part in point.split()] for point in path.split(" L ")]) for path in found]


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
    marks = [value for name, value in found.attributes if name in ("src", "href", "xlink:href", "srcset")]
    known = {f"#{value}" for name, value in found.attributes if name == "id"}
    assert set(marks) <= known  # within the page
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
        "4.00 kN/m\nits error has no bound",
        "± 0.1 g",
        "± 0.12 kN/m",
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
        "peak_deceleration": PeakValue(20.0, 0.004, None, "overshoot", PeakValue(9.80665, 0.05, None, "crushing")),
        "peak_tension_hoop": PeakValue(8e3, 0.06, 0.3, "crushing", PeakValue(6e3, 0.003, 0.2, "overshoot")),
    }
    behind = FilteredPeaks(
        180, None, PeakValue(14.709975, 0.005, None, "overshoot"), None, PeakValue(7e3, 0.061, None, "crushing")
    )
    replace_summary(file, replace(drop.summary(), peaks=peaks, filtered=behind))
    words = Page(result_page(file)).words
    assert "peak deceleration, CFC 180\n1.50 g\nnet of gravity: an accelerometer reads 1 g more; at 5 ms, overshoot; " in words
    assert "behind a one-way low-pass of 1 kHz 2.04 g; at 4 ms, overshoot; crushing: 1.00 g" in words
    assert "at 60 ms, 0.3 m up the shell, crushing; overshoot: 6.00 kN/m; CFC 180: 7.00 kN/m, crushing" in words
    replace_summary(file, replace(drop.summary(), filtered=FilteredPeaks(60, "5 ms long, 24 expected")))
    assert "CFC 60: none, 5 ms long, 24 expected" in Page(result_page(file)).words


def test_card_and_curve_of_the_deceleration_are_one_signal(tmp_path: Path) -> None:
    """A drop on the moon, whose accelerometer reads a sixth of a g more."""
    case = load_case(ROOT / "configs" / "no-belts.yaml", ["model.fidelity=lumped", "gravity=1.62 m/s^2"])
    summary = simulate(case, tmp_path / "gas.vtkhdf")
    curve = drop_charts(read_case(tmp_path / "gas.vtkhdf"), read_history(tmp_path / "gas.vtkhdf"), summary)[2]
    words = Page(result_page(tmp_path / "gas.vtkhdf")).words
    shown = re.search(r"peak deceleration, CFC 180\n([0-9.]+) g\n(.*)\n", words)
    assert shown is not None and "an accelerometer reads 0.165 g more" in shown[2]
    assert float(shown[1]) == pytest.approx(curve.axes[0].lines[0].get_ydata().max(), abs=0.005)
    assert curve.get_label().startswith("Deceleration, CFC 180, net of gravity, g of 9.80665 m/s²")


def test_a_gas_has_its_cards_its_curves_and_its_case(tmp_path: Path) -> None:
    file = tmp_path / "piston.vtkhdf"
    vents = "vents=[{area: 20 cm^2, discharge: {pressure_ratio: [0.5, 1], coefficient: [0.75, 0.6]}, opens: {pressure: 10 kPa}}]"
    answer = simulate(parse_case(drop.PISTON, "piston", [vents, "ambient.altitude=3000 m"]), file)
    assert answer.peak_pressure and answer.vented_mass and answer.gas_mass and answer.vent_opening_times and answer.gas
    share = answer.vented_mass / (answer.vented_mass + answer.gas_mass)
    text = result_page(file)
    words = Page(text).words
    for piece in (
        "Rebound: the cover was back at the height of first contact",
        f"rebound velocity\n{answer.rebound_velocity:.3f} m/s\nupwards",
        f"lowest height\n{answer.lowest_height:.4g} m\nno impact; first at rest at",
        f"peak pressure, gauge\n{answer.peak_pressure / 1e3:.2f} kPa\nat",
        f"peak temperature\n{answer.peak_temperature:.1f} K\nat",
        f"vented mass\n{answer.vented_mass:.4g} kg\n{share:.1%} of the gas; ",
        f"vents.0 opens at {answer.vent_opening_times[0] * 1e3:.4g} ms",
        f"by outflow\n{-answer.gas.enthalpy_out:.2f} J",
        "gas.pressure\n3000 Pa\ngauge",
        "ambient.pressure\n70108.5 Pa\naround the shell",
        "vents.0.discharge.coefficient\n0.75, 0.6\nat each ratio",
        "vents.0.opens.pressure\n10000 Pa\ngauge",
    ):
        assert piece in words
    labels = [figure.get_label() for figure in drop_charts(read_case(file), read_history(file), answer)]
    assert [label.rsplit(", ", 1)[1] for label in labels] == ["m/s", "m", "g of 9.80665 m/s²", "kPa", "K", "kg", "kg/s", "kJ"]
    assert [text.count(f"<figcaption>{label}</figcaption>") for label in labels] == [1] * 8
    heat = drop_charts(read_case(file), read_history(file), answer)[4].axes[0]
    assert 150.0 < heat.get_ylim()[0] < read_history(file)["temperature"].min()  # no 0 K in sight


def test_values_of_the_case_are_explained_for_a_reader_of_results(tmp_path: Path) -> None:
    """Not as to one who fills in the starter case; layers and the damping ratio, which become other keys, are there."""
    file, plain = tmp_path / "drop.vtkhdf", drop.case(6, 8)
    drop.write(file, load_case(ROOT / "configs" / "paper.yaml", ["grid.generatrix=6", "grid.hoop=8", "fabric.damping_ratio=3 %"]))
    words = Page(result_page(file)).words
    assert "instead" not in words
    assert "fabric.E11\n20000 N/m\nmodulus along the generatrix" in words
    assert "belts.2.layers\n5\nof fabric" in words
    assert "fabric.damping_ratio\n3 %" in words
    drop.write(file, replace(plain, belts=(replace(plain.belts[0], line_density=1.0),)))
    assert "layers" not in Page(result_page(file)).words


def test_margins_out_of_all_proportion_are_not_written_out(tmp_path: Path) -> None:
    file = tmp_path / "drop.vtkhdf"
    drop.write(file, drop.case(6, 8))
    replace_summary(file, replace(drop.summary(), fabric_margin=4e13))
    assert "margin, fabric\nabove +10000%" in Page(result_page(file)).words


def test_an_inflated_shell_has_a_page_and_a_picture_of_its_own(tmp_path: Path) -> None:
    file, case = tmp_path / "rest.vtkhdf", load_case(ROOT / "configs" / "no-belts.yaml", ["grid={generatrix: 12, hoop: 16}"])
    answer = inflate(case, file)
    text = result_page(file)
    words = Page(text).words
    assert "did not finish" not in words and "Course of the drop" not in words
    for piece in (
        "Inflated: at rest to a residual of",
        f"pressure\n{answer.pressure / 1e3:.4g} kPa",
        f"force on the cover\n{answer.cover_force:.2f} N",
        f"tension, hoop\n{answer.tension_hoop / 1e3:.4f} kN/m",
        "At rest",
    ):
        assert piece in words
    assert text.count("<figure>") == 3
    for dimensionless in (False, True):
        shape, tension, radius = result_figure(file, dimensionless).axes
        scale = read_tension_scale(file) if dimensionless else 1e3
        hoop = next(line for line in tension.lines if line.get_label() == "hoop").get_ydata()
        assert hoop.max() == pytest.approx(answer.tension_hoop / scale, rel=1e-3)
        assert radius.lines[0].get_ydata().max() == pytest.approx(answer.largest_radius, rel=1e-6)
        assert shape.lines[0].get_xdata().max() == pytest.approx(answer.largest_radius, rel=1e-3)


def test_curves_are_the_history_and_the_page_shows_them(result: Path) -> None:
    text, history = result_page(result), read_history(result)
    figures = drop_charts(read_case(result), history, read_summary(result))
    labels = [figure.get_label() for figure in figures]
    assert [label.rsplit(", ", 1)[1] for label in labels] == ["m/s", "m", "g of 9.80665 m/s²", "kPa", "kN/m", "kJ"]
    assert [text.count(f"<figcaption>{label}</figcaption>") for label in labels] == [1] * 6
    columns = (-history["velocity"], history["height"], history["acceleration"] / 9.80665, history["pressure"] * 1e-3)
    for figure, column in zip(figures, columns, strict=False):
        (axes,) = figure.axes
        x, y = axes.lines[0].get_data()
        if axes is figures[2].axes[0]:  # behind a filter, at times of its own
            np.testing.assert_allclose(y, column[0])
        else:
            np.testing.assert_allclose(np.column_stack((x, y)), np.column_stack((history["time"] * 1e3, column)))
        assert axes.get_ylim()[0] <= 1e-9 and axes.get_ylim()[1] >= -1e-9
        assert axes.get_xlabel() == "time, ms"
    for figure in figures:
        assert as_svg(figure).split("\n", 1)[1] in text  # but for the tag, which the page completes
        pictured = [path for path in paths(as_svg(figure)) if len(path) == len(history)]
        lines = [k for k, line in enumerate(figure.axes[0].lines) if len(line.get_xdata()) == len(history)]
        assert len(pictured) == len(lines) and bool(pictured) == (figure is not figures[2])
        for path, number in zip(pictured, lines, strict=True):
            np.testing.assert_allclose(path, in_pixels(figure, number), atol=0.02)


def test_key_names_and_dashes_the_curves(result: Path) -> None:
    tensions = drop_charts(read_case(result), read_history(result), read_summary(result))[4].axes[0]
    words = [text.get_text() for text in tensions.get_legend().get_texts()]
    assert words == ["generatrix", "hoop", "belt"]
    assert len({line.get_color() for line in tensions.lines[:3]}) == 3
    dashes = re.findall("stroke-dasharray: ([^;]*);", as_svg(tensions.figure))
    assert len(set(dashes)) == 2 < len(DASHES)  # the first is without


def test_impact_has_its_error_bar(tmp_path: Path) -> None:
    file = tmp_path / "drop.vtkhdf"
    drop.write(file, drop.case(6, 8))
    answer = replace(drop.summary(), impact_velocity_error=0.5)
    bar = drop_charts(read_case(file), read_history(file), answer)[0].axes[0].lines[3]
    np.testing.assert_allclose(bar.get_data(), [[120.0, 120.0], [3.1, 4.1]])


def test_shapes_are_cuts_through_opposite_columns(result: Path) -> None:
    case, shots = read_case(result), read_snapshots(result)
    figures = shapes(case, shots, 8)
    pictures = result_page(result).split('class="shapes">')[1].split("</figure>")
    times = [float(figure.get_label().split()[0]) for figure in figures]
    assert times[0] == 0.0 and times[-1] == 120.0 and times == sorted(times)
    for figure, picture, milliseconds in zip(figures, pictures, times, strict=False):
        assert f"<figcaption>{milliseconds:.1f} ms <span>" in picture
        xyz, _ = drop.shape(drop.case(6, 8, belts=2), milliseconds / 1e3)
        right, right_belts, left, left_belts = (np.column_stack(line.get_data()) for line in figure.axes[0].lines[:4])
        np.testing.assert_allclose(right, xyz[:, 0, [0, 2]], atol=1e-6)
        np.testing.assert_allclose(left, xyz[:, 4, [0, 2]], atol=1e-6)
        np.testing.assert_array_equal(np.vstack((right_belts, left_belts)), np.vstack((right[[2, 4]], left[[2, 4]])))
        pictured = [path for path in paths(picture) if len(path) == 7]
        np.testing.assert_allclose(pictured, [in_pixels(figure, 0), in_pixels(figure, 2)], atol=0.02)
        assert picture.count("<use") == 4 + 1  # belts, and the cargo
        axes = figure.axes[0]
        across, up = (np.ptp(limits) for limits in (axes.get_xlim(), axes.get_ylim()))
        assert figure.get_figheight() / figure.get_figwidth() == pytest.approx(up / across)  # one scale both ways
    assert len({figure.axes[0].get_xlim() + figure.axes[0].get_ylim() for figure in figures}) == 1


def test_colours_are_those_of_the_page(result: Path) -> None:
    text = result_page(result)
    style, body = text.split("</style>")
    assert not re.findall("#[0-9a-f]{6};", body)
    names = set(re.findall(r"var\(--(\w+)\)", text))
    for part in re.findall(r":root{([^}]*)}", style):  # by day, by night and on paper
        assert names <= set(re.findall(r"--(\w+):", part))


def test_the_same_page_twice_is_the_same(result: Path) -> None:
    assert result_page(result) == result_page(result)


def test_long_curves_keep_their_peaks() -> None:
    x = np.linspace(0.0, 1.0, 100_000)
    y = np.sin(50 * x)
    y[54_321] = 7.0
    figure = sweep_chart("a", "m", "s", x, y, True, False)
    points = np.column_stack(figure.axes[0].lines[0].get_data())
    assert len(points) <= 2 * BUCKETS + 2
    np.testing.assert_array_equal(points[np.argmax(points[:, 1])], [x[54_321], 7.0])
    np.testing.assert_array_equal(points[[0, -1], 0], [0.0, 1.0])
    assert len(as_svg(figure)) < 25_000


def test_charts_bear_what_is_not_a_number() -> None:
    x = np.array([0.0, 1.0, 2.0, np.nan])
    figure = sweep_chart("a", "m", "s", x, np.array([1.0, np.nan, 3.0, 1.0]), True, True)
    assert "nan" not in as_svg(figure)
    np.testing.assert_array_equal(figure.axes[0].lines[0].get_ydata(), [1.0, np.nan, 3.0])  # a gap, no bridge
    for y in (np.zeros(1), np.array([np.nan])):
        assert "nan" not in as_svg(sweep_chart("flat", "m", "s", x[:1], y, True, False))


def test_words_are_no_formulas() -> None:
    figure = sweep_chart("a", "m", "costs $5 or $6_{<", np.arange(2.0), np.arange(2.0), True, False)
    assert ">costs $5 or $6_{&lt;</text>" in as_svg(figure)


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


COLUMNS = "run,id,pressure.value,outcome,fault,impact_velocity,lowest_height,peak_deceleration,peak_tension_belt\n"
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
    for piece in (
        "Sweep <1>",
        "4 runs over pressure.value",
        "1 of them have no answer.",
        "it <bursts>",
        "Peak deceleration, 1 kHz, g",
    ):
        assert piece in found.texts or piece in found.words
    assert "2\nimpact\n20000\n1.5\n5\n–" not in found.words  # no belts, no column of theirs
    assert "2\nimpact\n20000\n1.5\n5\n0" in found.words
    assert "1\nstopped\n30000\n–\n10\n0.1" in found.words
    assert "4\ndiverged\n90000\n–\n–\n–" in found.words
    assert "cargo.mass\n123.5 kg" in found.words  # of the case
    curve = next(path for path in paths(text) if len(path) == 3)
    assert list(curve[:, 0]) == sorted(curve[:, 0])  # by the axis, whatever the order of the runs
    heights = (curve[:, 1] - curve[2, 1]) / (curve[0, 1] - curve[2, 1])
    np.testing.assert_allclose(heights, [1.0, 1.5 / 6.25, 0.0], atol=2e-3)  # stopped: an impact velocity of 0
    assert "belt" not in "".join(value or "" for name, value in found.attributes if name == "aria-label")


@pytest.mark.parametrize(("outcome", "rest"), [("rebound", "0.02"), ("time_limit", "0.02"), ("time_limit", "")])
def test_a_cargo_that_turned_above_the_ground_counts_as_one_that_stopped(tmp_path: Path, outcome: str, rest: str) -> None:
    """As does one that still sinks at the end of time; not so one that never stood still."""
    first, *others = SWEEP["results.csv"].splitlines()
    lines = [f"{first},rest_time", *(f"{line}," for line in others)]
    lines[1] = lines[1].replace("stopped", outcome) + rest
    pages = [sweep_page(sweep(tmp_path / "a")), sweep_page(sweep(tmp_path / "b", results="\n".join(lines) + "\n"))]
    stopped, other = ([path.tolist() for path in paths(text) if len(path) == 3] for text in pages)
    assert (other == stopped) == bool(rest)
    assert ("or rebounds" in pages[1]) == bool(rest)


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
    assert text.count("<use") == 4  # the dots, by one definition


def test_page_of_a_sweep_over_two_numbers_has_the_maps_of_the_picture(tmp_path: Path) -> None:
    head = "run,id,cargo.mass,pressure.value,outcome,fault,impact_velocity,peak_deceleration\n"
    values = [(mass, p) for mass in (50.0, 75.0, 100.0) for p in (1e4, 2e4, 3e4)]
    results = head + "".join(
        f"{k},x{k},{mass},{p},diverged,burst,,\n" if k == 0 else f"{k},x{k},{mass},{p},impact,,{mass * p},{p + k}\n"
        for k, (mass, p) in enumerate(values)
    )
    axes = '"axes": [["cargo.mass", "kg", false], ["pressure.value", "Pa", true, "bar", 1e5]]'
    folder = sweep(tmp_path / "map", plan=SWEEP["plan.json"].replace("{", "{" + axes + ", ", 1), results=results)
    (folder / "results.units.csv").write_text(head + ",,kg,Pa,,,m/s,m/s^2\n")
    text = sweep_page(folder)
    found = Page(text)
    assert text.count("<figure>") == 2  # one an answer, not one an answer and axis
    assert found.texts.count("pressure.value, bar") == 2 + 1  # of each map and of the table
    assert "1\nimpact\n50\n0.2\n" in found.words
    assert "mathdefault" not in text


def test_faults_of_a_sweep(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(ResultError, match="the folder of a finished sweep is expected"):
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
        (("drop.vtkhdf", "-o", "no/page.html"), "no/page.html: there is no folder no"),
        (("drop.html",), "drop.html: cannot be read"),
        (("drop.vtkhdf", "-o", "drop.vtkhdf"), "drop.vtkhdf: the name of a page ends in .html"),
        (("drop.html", "-o", "./drop.html"), "drop.html: is the result"),
    ):
        done = softbrake("report", *arguments)
        assert (done.returncode, done.stdout) == (2, "")
        assert fault in done.stderr and "Traceback" not in done.stderr
    assert (tmp_path / "drop.vtkhdf").read_bytes() == kept


def test_without_matplotlib_there_is_no_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drop.write(tmp_path / "drop.vtkhdf", drop.case(6, 8))
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    done = CliRunner().invoke(app, ["report", str(tmp_path / "drop.vtkhdf")])
    assert (done.exit_code, done.stderr) == (2, "pictures need matplotlib: pip install 'softbrake[plot]'\n")
    assert not (tmp_path / "drop.html").exists()


def test_lumped_run_has_no_tensions_to_show(tmp_path: Path) -> None:
    case = load_case(ROOT / "configs" / "no-belts.yaml", ["model.fidelity=lumped", "fabric.strength=30 kN/m"])
    simulate(case, tmp_path / "gas.vtkhdf")
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
    assert "the folder of a finished sweep is expected" in done.stderr and "Traceback" not in done.stderr
