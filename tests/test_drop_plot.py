"""Pictures: what the panels show, read back from the figure."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import synthetic_drop as drop

from softbrake.case.case_file import parse_case
from softbrake.core.columns import History
from softbrake.report.plots.drop import draw_drop, drop_figure, plot_result, result_figure
from softbrake.report.plots.page import drop_charts
from softbrake.report.plots.panels import moments
from softbrake.report.plots.style import PlotError
from softbrake.sim.result_file import ResultError, ResultFile, read_case, read_history, read_snapshots, read_summary
from softbrake.sim.simulation import simulate

pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("plot") / "drop.vtkhdf"
    drop.write(path, drop.case(6, 8, belts=2))
    return path


def curves(axes) -> dict[str, np.ndarray]:
    return {line.get_label(): np.column_stack(line.get_data()) for line in axes.lines}


def panel(figure, title: str):
    return next(axes for axes in figure.axes if axes.get_title(loc="left").startswith(title))


def test_curves_are_the_history_in_the_units_of_their_axes(result: Path) -> None:
    history, figure = read_history(result), result_figure(result)
    speed = panel(figure, "Speed")
    assert speed.get_ylabel() == "m/s"
    np.testing.assert_allclose(curves(speed)["cargo"], np.column_stack((history["time"] * 1e3, -history["velocity"])))
    np.testing.assert_allclose(curves(speed)["impact"], [[drop.END * 1e3, drop.summary().impact_velocity]])
    fallen_time, fallen_speed = curves(speed)["free fall"][-1]
    assert fallen_speed**2 == pytest.approx(6.0**2 + 2 * 9.81 * 0.6)
    assert fallen_time / 1e3 == pytest.approx((fallen_speed - 6.0) / 9.81)
    brake = panel(figure, "Deceleration")
    assert brake.get_ylabel() == "g of 9.80665 m/s²"
    np.testing.assert_allclose(
        brake.lines[0].get_ydata(), drop.DECELERATION / 9.80665
    )  # the standard gravity, whatever the case's
    assert "CFC 180, net of gravity" in brake.get_title(loc="left")
    energy = curves(panel(figure, "Energy"))
    works = sum(energy[label][-1, 1] for label in energy if label.startswith("work"))
    assert energy["kinetic energy"][-1, 1] - energy["kinetic energy"][0, 1] == pytest.approx(works)
    assert figure.axes[-1].get_xlabel() == "time, ms"
    assert "impact at 3.600 m/s, free fall 6.911 m/s" in figure.get_suptitle()


VENT = "vents=[{area: 20 cm^2, discharge: 0.6, opens: {pressure: 10 kPa}}]"


def test_a_gas_has_its_curves_and_the_speed_its_rest_and_rebound(tmp_path: Path) -> None:
    path = tmp_path / "piston.vtkhdf"
    answer = simulate(parse_case(drop.PISTON, "piston", [VENT]), path)
    history, figure = read_history(path), result_figure(path)
    assert answer.rebound_velocity is not None and answer.rest_time is not None and answer.vent_opening_times is not None
    for title, unit, column, scale in (
        ("Pressure of the gas, gauge", "kPa", "pressure", 1e-3),
        ("Temperature of the gas", "K", "temperature", 1.0),
        ("Mass of the gas", "kg", "gas_mass", 1.0),
        ("Flow out", "kg/s", "vent_flow", 1.0),
    ):
        shown = panel(figure, title)
        assert shown.get_ylabel() == unit
        np.testing.assert_allclose(shown.lines[0].get_xydata(), np.column_stack((history["time"] * 1e3, history[column] * scale)))
    assert panel(figure, "Temperature").get_ylim()[0] > 200.0
    speed, opening = curves(panel(figure, "Speed")), curves(panel(figure, "Pressure"))["vent opens"]
    np.testing.assert_allclose(speed["first at rest"], [[answer.rest_time * 1e3, 0.0]])
    np.testing.assert_allclose(speed["rebound"], [[answer.end_time * 1e3, -answer.rebound_velocity]])
    np.testing.assert_allclose(opening, [[answer.vent_opening_times[0] * 1e3, 10.0]], rtol=1e-3)
    assert f"rebound at {answer.rebound_velocity:.3f} m/s, lowest at {answer.lowest_height:.4g} m" in figure.get_suptitle()


def test_a_closed_bag_has_no_flow_and_a_law_no_temperature(result: Path, tmp_path: Path) -> None:
    path = tmp_path / "piston.vtkhdf"
    simulate(parse_case(drop.PISTON, "piston"), path)
    closed, law = ([axes.get_title(loc="left") for axes in result_figure(file).axes] for file in (path, result))
    assert "Temperature of the gas" in closed and not [title for title in closed if title.startswith(("Mass", "Flow"))]
    assert not [title for title in law if "gas" in title]


def test_moments_of_a_rebound_show_the_lowest_place(tmp_path: Path) -> None:
    """And say which way the cargo goes: at lift-off as fast up as it came down."""
    path = tmp_path / "piston.vtkhdf"
    simulate(parse_case(drop.PISTON, "piston", ["output.snapshot_interval=1 ms"]), path)
    shots = read_snapshots(path)
    for count in (3, 4, 6, 8):
        chosen = moments(shots, count)
        assert len(chosen) == count
        assert {0, int(np.argmin(shots.height)), len(shots.times) - 1} <= set(chosen)
        assert np.diff(shots.times[chosen]).max() < 2.0 * shots.times[-1] / (count - 1)
    for second, lowest in ((0.1999, 10), (0.2001, 10), (0.15, 30)):  # of strokes alike the first
        height = np.interp(np.arange(len(shots.times)), [0, 10, 20, 30, len(shots.times) - 1], [0.3, 0.2, 0.28, second, 0.3])
        assert lowest in moments(replace(shots, height=height), 6)
    labels = [text.get_text() for text in drop_figure(path).axes[0].texts]
    assert labels[0] == "0 ms\n5.00 m/s" and labels[-1] == "42 ms\n5.00 m/s up"


def test_page_and_picture_have_one_g(tmp_path: Path) -> None:
    """That of the standard, on a planet of another gravity as well."""
    path = tmp_path / "moon.vtkhdf"
    drop.write(path, replace(drop.case(6, 8), gravity=1.62))
    pictured = panel(result_figure(path), "Deceleration").lines[0].get_ydata()
    paged = drop_charts(read_case(path), read_history(path), read_summary(path))[2].axes[0].lines[0].get_ydata()
    assert pictured.max() == pytest.approx(drop.DECELERATION / 9.80665) == paged.max()


def test_a_record_too_coarse_for_its_class_is_drawn_unfiltered(tmp_path: Path) -> None:
    path, case = tmp_path / "drop.vtkhdf", drop.case(6, 8)
    drop.write(path, replace(case, output=replace(case.output, cfc=1000)))
    shown = panel(result_figure(path), "Deceleration, unfiltered").lines[0]
    assert len(shown.get_ydata()) == len(read_history(path))


def test_tensions_may_be_dimensionless(result: Path) -> None:
    plain, scaled = (panel(result_figure(result, flag), "Largest") for flag in (False, True))
    assert (plain.get_ylabel(), scaled.get_ylabel()) == ("kN/m", "T / (T$_0$/L)")
    for name in ("generatrix", "hoop", "belt"):
        ratio = curves(plain)[name][1:, 1] * 1e3 / curves(scaled)[name][1:, 1]
        np.testing.assert_allclose(ratio, 0.5 * drop.PRESSURE * 0.6)


def test_profiles_are_cuts_through_opposite_columns(result: Path) -> None:
    figure = result_figure(result)
    profiles = [axes for axes in figure.axes if axes.get_title(loc="left")[0].isdigit()]
    times = [float(axes.get_title(loc="left").split()[0]) for axes in profiles]
    assert times == [0.0, 20.0, 50.0, 70.0, 100.0, 120.0]  # snapshots stand 10 ms apart
    for axes, milliseconds in zip(profiles, times, strict=True):
        xyz, _ = drop.shape(drop.case(6, 8, belts=2), milliseconds / 1e3)
        right, right_belts, left, left_belts = (np.column_stack(line.get_data()) for line in axes.lines[:4])
        np.testing.assert_allclose(right, xyz[:, 0, [0, 2]], atol=1e-6)
        np.testing.assert_allclose(left, xyz[:, 4, [0, 2]], atol=1e-6)
        np.testing.assert_array_equal(right_belts, right[[2, 4]])
        np.testing.assert_array_equal(left_belts, left[[2, 4]])
    assert profiles[-1].get_xlabel() == "r, m"
    assert profiles[0].get_ylabel() == "z, m"


def test_no_belts_no_belt_curve(tmp_path: Path) -> None:
    path = tmp_path / "drop.vtkhdf"
    drop.write(path, drop.case(6, 8, belts=0), finished=False)
    figure = result_figure(path)
    assert "belt" not in curves(panel(figure, "Largest"))
    assert "impact" not in curves(panel(figure, "Speed"))
    assert figure.get_suptitle().endswith("unfinished run")


def test_drop_shows_all_parts_with_the_hoop_tension_in_kilonewtons(result: Path) -> None:
    figure = drop_figure(result)
    scene, bar = figure.axes
    assert bar.get_ylabel() == "hoop tension, kN/m"
    highest = drop.shape(drop.case(6, 8), drop.END)[1]["tension_hoop"].max() / 1e3
    assert 0.9 * highest < bar.get_ylim()[1] <= highest
    assert [text.get_text() for text in scene.texts] == [
        "0 ms\n6.00 m/s", "40 ms\n5.20 m/s", "80 ms\n4.40 m/s", "120 ms\n3.60 m/s",
    ]  # fmt: skip
    for collection in scene.collections:
        corners = [len(path.vertices) - 1 for path in collection.get_paths()]  # a closed path repeats its first corner
        assert corners.count(2) == 2 * 8
        assert corners.count(4) > 6 * 8


@pytest.mark.parametrize("suffix", [".png", *(pytest.param(other, marks=pytest.mark.slow) for other in (".svg", ".pdf"))])
def test_pictures_are_written(result: Path, tmp_path: Path, suffix: str) -> None:
    for draw in (plot_result, draw_drop):
        picture = tmp_path / f"{draw.__name__}{suffix}"
        draw(result, picture)
        assert picture.read_bytes()[:4] in (b"\x89PNG", b"<?xm", b"%PDF")


def test_a_diverged_run_still_has_a_picture(tmp_path: Path) -> None:
    path, case = tmp_path / "drop.vtkhdf", drop.case(6, 8)
    case = replace(case, title="costs $5 or $6_{")
    with ResultFile.create(path, case, version="1", source_hash="a") as result:
        drop.add_snapshot(result, case, 0.0)
        xyz, fields = drop.shape(case, 0.01)
        result.add_snapshot(0.01, xyz * np.nan, fields, height=np.nan, velocity=np.nan, pressure=1.0)
        result.add_history(np.vstack((drop.history(np.array([0.0])), np.full((1, len(History)), np.nan))))
    plot_result(path, tmp_path / "plot.png")
    draw_drop(path, tmp_path / "drop.png")


def test_messages(result: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(PlotError, match="ends in .png, .svg or .pdf"):
        plot_result(result, tmp_path / "plot.txt")
    with pytest.raises(FileNotFoundError):
        plot_result(result, tmp_path / "no" / "plot.png")
    with pytest.raises(ResultError, match="No such file"):
        plot_result(tmp_path / "none.vtkhdf", tmp_path / "plot.png")
    empty, case = tmp_path / "empty.vtkhdf", drop.case(6, 8)
    case = replace(case, pressure=replace(case.pressure, value=0.0))
    ResultFile.create(empty, case, version="1", source_hash="a").close()
    for draw in (plot_result, draw_drop):
        with pytest.raises(PlotError, match="before it recorded anything"):
            draw(empty, tmp_path / "plot.png")
    with pytest.raises(PlotError, match="without pressure"):
        plot_result(empty, tmp_path / "plot.png", dimensionless=True)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(PlotError, match=r"pip install 'softbrake\[plot\]'"):
        plot_result(result, tmp_path / "plot.png")
