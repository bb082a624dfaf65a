"""Fixtures for several test files."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices; its threads and xdist's workers would wait for one another

ROOT = Path(__file__).resolve().parents[1]
PATIENCE = 900.0  # s, after which what hangs is ended; no outcome hangs on it

Command = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="session")
def paper() -> Path:
    """The paper's case file."""
    return ROOT / "configs" / "paper.yaml"


@pytest.fixture(scope="session")
def environment() -> dict[str, str]:
    """For subprocesses: this checkout's package, output as in a pipe of 80 columns."""
    plain = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "FORCE_COLOR")}
    return plain | {"PYTHONPATH": str(ROOT)}


def start(*arguments: object, environment: dict[str, str], folder: Path) -> subprocess.Popen[str]:
    """Start the command line in a folder, as in the foreground of a shell: its background jobs ignore Ctrl-C."""
    return subprocess.Popen(
        [sys.executable, "-m", "softbrake", *map(str, arguments)],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )


@pytest.fixture
def softbrake(tmp_path: Path, environment: dict[str, str]) -> Command:
    """Run the command line in `tmp_path`."""

    def command(*arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "softbrake", *map(str, arguments)],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )

    return command
