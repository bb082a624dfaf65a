"""Each example runs."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("example", sorted((ROOT / "examples").glob("*.py")), ids=lambda path: path.stem)
def test_example_runs(example: Path, environment: dict[str, str], tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, example, tmp_path], env=environment, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "impact at 5.3003 m/s" in done.stdout  # as the tutorial has it
    assert "energy balance" in done.stdout
    assert "32 kPa  stopped" in done.stdout
    assert (tmp_path / "airdrop.vtkhdf").is_file()
    assert all(text.startswith(b"\x89PNG") for text in (path.read_bytes() for path in tmp_path.glob("*.png")))
