"""Each example runs."""

import subprocess
import sys
from pathlib import Path

import numpy as np

from softbrake.signals import read_channels

ROOT = Path(__file__).resolve().parents[1]


def run(example: str, environment: dict[str, str], folder: Path) -> str:
    script = ROOT / "examples" / example
    done = subprocess.run([sys.executable, script, folder], env=environment, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_airdrop(environment: dict[str, str], tmp_path: Path) -> None:
    printed = run("airdrop.py", environment, tmp_path)
    assert "impact at 5.3003 m/s" in printed  # as the tutorial has it
    assert "energy balance" in printed
    assert "32 kPa  stopped" in printed
    assert (tmp_path / "airdrop.vtkhdf").is_file()
    assert all(text.startswith(b"\x89PNG") for text in (path.read_bytes() for path in tmp_path.glob("*.png")))


def test_drop_test(environment: dict[str, str], tmp_path: Path) -> None:
    """A record that reads back: free fall, then a pulse of some 6.5 g with gravity in it, between 20 and 30 kPa at most."""
    run("drop_test.py", environment, tmp_path)
    acceleration, pressure = read_channels(tmp_path / "drop-test.csv")
    assert (acceleration.quantity, pressure.quantity) == ("deceleration", "pressure")
    before = acceleration.time < 0.05
    assert abs(acceleration.values[before].mean()) < 0.1 * 9.80665
    smooth = np.convolve(acceleration.values, np.full(101, 1.0 / 101), "valid")
    assert 6.0 < smooth.max() / 9.80665 < 7.0
    assert 20e3 < pressure.values.max() < 35e3


def test_all_are_tested() -> None:
    assert {path.stem for path in (ROOT / "examples").glob("*.py")} == {"airdrop", "drop_test"}
