"""A whole run with its result file: what it keeps, and how it ends when things go wrong."""

import json
import pickle
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic_drop

import softbrake
from softbrake.case.case import Case
from softbrake.case.case_file import parse_case
from softbrake.sim import simulation as drop
from softbrake.sim.result_file import read_case, read_snapshots

PAPER = Path(__file__).resolve().parents[1] / "configs" / "paper.yaml"


def case(*overrides: str) -> Case:
    return softbrake.load_case(PAPER, ["grid.generatrix=12", "grid.hoop=30", *overrides])


def test_pictures_from_first_contact_to_impact(tmp_path: Path) -> None:
    """The first picture has the pressure of its time, the last one is of the instant of impact, not of the step's end."""
    file = tmp_path / "drop.vtkhdf"
    summary = softbrake.run(case(), file)
    assert summary.outcome == "impact"
    with h5py.File(file) as opened:
        assert opened["VTKHDF/FieldData/gas_pressure"][0] == pytest.approx(15696.0)
        assert opened["VTKHDF/CellData/pressure"][:].max() == pytest.approx(15696.0)
    shots = read_snapshots(file)
    assert shots.times[0] == 0.0
    assert shots.times[-1] == pytest.approx(summary.impact_time)
    assert np.abs(shots.xyz[-1, -1, :, 2]).max() < 1e-7  # the cover on the ground
    assert shots.xyz[..., 2].min() > -1e-6


@pytest.mark.parametrize(("contact", "most"), [("solid", 12), ("full", 60)])
def test_memory_of_a_node(contact: str, most: int) -> None:
    """Doubles of a node of 36 x 90 cells: rows beside the six of places and velocities; folds begin with room for few pairs."""
    ours = drop.Simulation(softbrake.load_case(PAPER, [f"contact={contact}"]))
    parts, doubles = [ours.state, ours.workspace], 0.0
    while parts:
        part = parts.pop()
        if isinstance(part, tuple):
            parts += part
        elif part is not None:
            doubles += part.nbytes / 8
    assert 6 < doubles / ((ours.model.n1 + 1) * ours.model.n2) < most


@pytest.mark.skipif(sys.platform == "win32", reason="counts wall time: see drop.CLOCK")
def test_kernel_seconds_count_no_time_that_others_take(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(drop.KERNELS, "full", lambda *_: (time.sleep(0.3), (0, 0))[1])
    waiting = drop.Simulation(case())
    waiting.advance()
    assert waiting.kernel_seconds < 0.1


def test_resolved_case_in_the_file_runs_again(tmp_path: Path) -> None:
    file = tmp_path / "drop.vtkhdf"
    ours = case("time.end=1 ms")
    softbrake.run(ours, file)
    assert parse_case(json.dumps(read_case(file)), "drop") == ours


def test_snapshot_interval_below_the_step_takes_every_step(tmp_path: Path) -> None:
    file = tmp_path / "drop.vtkhdf"
    summary = softbrake.run(case("time.end=0.1 ms", "output.snapshot_interval=1e-20"), file)
    assert len(read_snapshots(file).times) == summary.steps + 1


def test_peaks_of_a_rebound_keep_their_phases() -> None:
    """The cover ends where it began, but its peaks are those of the crushed bag at the lowest place."""
    summary = softbrake.run(parse_case(synthetic_drop.PISTON, "piston"))
    assert (summary.outcome, summary.rebound_velocity) == ("rebound", pytest.approx(5.0, rel=1e-4))
    for name in ("peak_deceleration", "peak_pressure", "peak_temperature"):
        peak = summary.peaks[name]
        assert peak.time == pytest.approx(summary.rest_time, rel=1e-2)
        assert (peak.phase, peak.other and peak.other.phase) == ("crushing", "overshoot")
    assert summary.gas_mass == pytest.approx(104325.0 * np.pi * 0.04 * 0.3 / (287.05287 * 288.15))


def test_peaks_outlast_the_strokes_that_follow(tmp_path: Path) -> None:
    """A vented bag that stays on the ground comes down by a tenth of its height again and again."""
    words = [
        "shell={diameter: 0.5 m, height: 0.6 m}",
        "cargo={mass: 100 kg, velocity: 6 m/s}",
        "gas.pressure=15.7 kPa",
        "vents=[{area: 70 cm^2, discharge: 0.7, opens: {pressure: 60 kPa}, closes: {pressure: 20 kPa}}]",
        "output.history_interval=1",
    ]
    summary = softbrake.run(parse_case(synthetic_drop.PISTON, "piston", words), tmp_path / "a.vtkhdf")
    history = softbrake.read_result(tmp_path / "a.vtkhdf").history
    low = history["height"] <= 0.54
    assert summary.outcome == "time_limit" and np.count_nonzero(low[1:] & ~low[:-1]) > 2
    assert summary.peak_pressure == pytest.approx(history["pressure"].max(), rel=1e-3) == pytest.approx(60e3, rel=1e-2)
    assert summary.peak_deceleration == pytest.approx(history["acceleration"].max(), rel=1e-3)
    first = int(np.argmax(low))
    overshoot = summary.peaks["peak_deceleration"].other
    assert overshoot is not None and overshoot.phase == "overshoot"
    assert overshoot.value == pytest.approx(history["acceleration"][:first].max(), rel=1e-2)


@pytest.mark.parametrize(("damping", "courant"), [(0.05, 1.0), (0.5, 0.5)])
def test_strong_damping_by_the_gas_is_stable(damping: float, courant: float) -> None:
    """2 ν^n p S/m of (2.11) enters with the velocity at n - 1/2, so it shortens the step as viscosity does."""
    summary = softbrake.run(case(f"pressure.damping={damping}", f"time.courant={courant}"))
    assert summary.outcome in ("impact", "stopped")
    assert abs(summary.energy_error) < 1e-11


def test_fabric_too_soft_for_the_pressure_is_said_to_burst() -> None:
    """p R = 3.9 kN/m against E' = 1.07 kN/m: the ring has no balance, exact.py's harmonic motion turns exponential."""
    with pytest.raises(softbrake.Diverged, match="the fabric bursts") as caught:
        softbrake.run(case("fabric.E=1 kN/m", "belts.count=0"))
    assert caught.value.summary.outcome == "diverged"
    sent = pickle.loads(pickle.dumps(caught.value))  # as a worker process does
    assert str(sent) == str(caught.value)
    assert sent.summary == caught.value.summary


def test_printed_scheme_fails_by_its_checkerboard(tmp_path: Path) -> None:
    """(3.2) as printed diverges on the paper's own grid; the file is readable up to there."""
    file = tmp_path / "drop.vtkhdf"
    with pytest.raises(softbrake.Diverged, match="checkerboard"):
        softbrake.run(softbrake.load_case(PAPER, ["model.scheme=cell"]), file)
    shots = read_snapshots(file)
    assert np.isfinite(shots.xyz[:-1]).all()
    assert shots.times[-1] > 0.03
