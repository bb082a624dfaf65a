"""Fixtures for several test files."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices; its threads and xdist's workers would wait for one another

ROOT = Path(__file__).resolve().parents[1]
PATIENCE = 900.0  # s, after which what hangs is ended; no outcome hangs on it

Command = Callable[..., subprocess.CompletedProcess[str]]
VtkSteps = Callable[[Path], list[tuple[float, list[list[float]]]]]


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


VTK_READER = """
import json, sys
from vtkmodules.vtkIOHDF import vtkHDFReader
for line in sys.stdin:
    reader = vtkHDFReader()
    reader.SetFileName(json.loads(line))
    reader.UpdateInformation()
    steps = []
    for step in range(reader.GetNumberOfSteps()):
        reader.SetStep(step)
        reader.Update()
        shell = reader.GetOutputDataObject(0)
        steps.append((reader.GetTimeValue(), [shell.GetPoint(k) for k in range(shell.GetNumberOfPoints())]))
    print(json.dumps(steps), flush=True)
"""


@pytest.fixture(scope="module")
def vtk_steps_apart(environment: dict[str, str]) -> Iterator[VtkSteps]:
    """Time and points of each step of a result file, read by VTK in a process of its own: its abort is a failed test."""
    pytest.importorskip("vtkmodules.vtkIOHDF")
    with subprocess.Popen(
        [sys.executable, "-c", VTK_READER],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        assert process.stdin and process.stdout
        asked, told = process.stdin, process.stdout

        def steps(path: Path) -> list[tuple[float, list[list[float]]]]:
            asked.write(json.dumps(str(path)) + "\n")
            asked.flush()
            said = told.readline()
            assert said, f"VTK's reader ended with code {process.wait()}"
            return [(time, points) for time, points in json.loads(said)]

        yield steps
