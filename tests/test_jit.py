"""How kernels are compiled, inlined by Numba's inside or plainly with the same digits, and how they are kept."""

import errno
import gc
import os
import random
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from numba.core.caching import IndexDataCacheFile, _CacheLocator
from numba.core.compiler import Flags
from numba.core.registry import CPUDispatcher

from softbrake.core import inlining, jit
from softbrake.core.jit import kernel

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
SMALL = ("grid={generatrix: 12, hoop: 24}", "time.end=20 ms", "contact=solid")


def test_driver_without_one_of_its_kernels_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the link, by name: it would call address 0."""

    @kernel
    def innermost(x):  # type: ignore[no-untyped-def]
        return x + 1.0

    @kernel
    def inner(x):  # type: ignore[no-untyped-def]
        return innermost(x) * 2.0

    @kernel
    def outer(x):  # type: ignore[no-untyped-def]
        return inner(x)

    monkeypatch.setattr(inlining.Part, "add_linking_library", lambda self, library: None)
    with pytest.raises(inlining.Unlinked, match=r"was linked without .*innermost"):
        outer(1.0)


def test_kernel_is_compiled_once_for_constants_and_variables() -> None:
    """Numba would compile it for each kind: findings/numba-constants-compile-twice.sh."""

    @kernel
    def inner(x, some):  # type: ignore[no-untyped-def]
        return x + 1 if some else x

    @kernel
    def outer(n):  # type: ignore[no-untyped-def]
        return inner(0, True) + inner(n, n > 0) + inner(2, False)

    before = gc.get_threshold()
    assert outer(3) == 1 + 4 + 2
    assert len(inner.overloads) == 1
    assert gc.get_threshold() == before


def test_options_compare_as_numba_s() -> None:
    kinds = [inlining.Options(Flags()) for _ in range(3)]
    kinds[1].nrt = True
    assert kinds[0] == kinds[2] == Flags() and hash(kinds[0]) == hash(Flags())
    assert kinds[0] != kinds[1] and kinds[1] != Flags()


def run(code: str, environment: dict[str, str], **more: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], env=environment | more, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_other_release_of_numba_is_taken_plainly_and_named(environment: dict[str, str]) -> None:
    code = """
import numba
numba.__version__ = "0.99.0"
from softbrake.core import jit
assert jit.INLINING is None and str(jit.CACHE_FOLDER).endswith("-plain")
"""
    assert "Numba 0.99.0 was not tested: kernels are compiled plainly" in run(code, environment)


def test_changed_inside_of_numba_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert inlining.is_known("0.68.1")
    assert not inlining.is_known("0.69.0")
    monkeypatch.setattr(inlining, "JITCodeLibrary", type("Renamed", (), {}))
    assert not inlining.is_known("0.68.1")


@pytest.mark.parametrize("fidelity", ["axisymmetric", "full"])
def test_plain_kernels_give_the_same_digits(fidelity: str, environment: dict[str, str]) -> None:
    code = f"""
import softbrake
from softbrake.sim.simulation import Simulation
case = softbrake.load_case({str(CONFIGS / "paper-contact.yaml")!r}, {[*SMALL, f"model.fidelity={fidelity}"]!r})
one = Simulation(case)
one.advance(0.02)
print(one.state.now.tobytes().hex(), one.state.nodes.x.tobytes().hex())
"""
    plain, inlined = run(code, environment, SOFTBRAKE_SIMPLE_JIT="1"), run(code, environment)
    assert len(plain) > 500
    assert plain == inlined


# The cache on disk


def test_compiled_kernels_are_loaded_without_what_compiles(environment: dict[str, str], tmp_path: Path) -> None:
    """Most of the CPU of a start was Numba's import of that, and of SciPy. What is not found compiled has it all the same."""
    code = """
import sys
import numpy as np
from softbrake.core.lanes import close_row
from softbrake.core.second_order import filter_samples
samples = np.array([1.0, 2.0, 4.0])
filter_samples(np.array([0.5, 0.5, 0.0, 0.0, 0.0]), np.zeros(2), samples)
assert samples.tolist() == [0.5, 1.5, 3.0]
print(*(name for name in ("numba.np.linalg", "scipy.linalg") if name in sys.modules), end=";")
close_row(samples, np.uint64(1), 1)
assert samples.tolist() == [1.5, 1.5, 1.5]
print(*(len(each.entry.stats.cache_hits) for each in (filter_samples, close_row)))
"""
    home = {"NUMBA_CACHE_DIR": str(tmp_path)}
    compiled, loaded = run(code, environment, **home), run(code, environment, **home)
    assert "numba.np.linalg" in compiled and compiled.endswith(";0 0\n")
    assert loaded == ";1 1\n"
    for file in tmp_path.rglob("lanes.*"):
        file.unlink()
    assert run(code, environment, **home) == ";1 0\n"


@pytest.fixture
def cached(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], CPUDispatcher]:
    """Call a kernel as a new process would, its code cached in a folder of the test's; gives Numba's dispatcher."""
    monkeypatch.setattr(jit, "CACHE_FOLDER", tmp_path)

    def twice(x):  # type: ignore[no-untyped-def]
        return 2.0 * x

    def call() -> CPUDispatcher:
        dispatcher = kernel(twice).entry
        assert dispatcher(1.5) == 3.0
        return dispatcher

    return call


def found(dispatcher: CPUDispatcher) -> bool:
    return bool(dispatcher.stats.cache_hits)


def empty(file: Path) -> None:
    file.write_bytes(b"")


def cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def scramble(file: Path) -> None:
    file.write_bytes(random.Random(1).randbytes(file.stat().st_size))


def flip(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)


def lock(file: Path) -> None:
    file.chmod(0)


def turn_into_folder(file: Path) -> None:
    file.unlink()
    file.mkdir()


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", [empty, cut, scramble, flip, lock])
def test_damaged_cache_is_replaced(
    cached: Callable[[], CPUDispatcher],
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    damage: Callable[[Path], None],
    suffix: str,
) -> None:
    """One line says so; a byte of the machine code that is another would crash the program."""
    assert not found(cached())
    assert found(cached())
    (file,) = tmp_path.rglob(f"*.{suffix}")
    damage(file)
    harmless = damage is lock and os.access(file, os.R_OK)  # to who may read all
    assert found(cached()) == harmless
    assert len(caplog.messages) == (0 if damage is lock and (harmless or suffix == "nbc") else 1)
    assert all(f"{tmp_path} cannot be read" in said for said in caplog.messages)
    assert found(cached())


def test_cache_that_cannot_be_mended_is_done_without(
    cached: Callable[[], CPUDispatcher], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    cached()
    (index,) = tmp_path.rglob("*.nbi")
    turn_into_folder(index)
    for _ in range(2):
        assert not found(cached())
    assert [said.split(" (")[0] for said in caplog.messages] == [
        f"kernel cache: a file in {tmp_path} cannot be read",
        f"kernel cache: {tmp_path} cannot be written",
    ]


def test_cache_on_a_full_disk_is_done_without(
    cached: Callable[[], CPUDispatcher], tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(IndexDataCacheFile, "_open_for_write", full)
    for _ in range(2):
        assert not found(cached())
    assert caplog.messages == [
        f"kernel cache: {tmp_path} cannot be written (No space left on device); each run compiles its kernels"
    ]
    monkeypatch.setattr(_CacheLocator, "ensure_cache_path", full)
    assert not found(cached())
    assert len(caplog.messages) == 2
    assert list(tmp_path.rglob("*.nb*")) == []


# Where it is


@pytest.mark.parametrize("home", [{}, {"XDG_CACHE_HOME": ""}, {"XDG_CACHE_HOME": "here"}, {"HOME": "/proc/nowhere"}], ids=str)
def test_user_without_a_home_has_a_temporary_folder(
    home: dict[str, str], environment: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is put into the current folder, and the next run finds the same one."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tmp").mkdir()
    bare = {"PATH": os.environ["PATH"], "PYTHONPATH": environment["PYTHONPATH"], "TMPDIR": str(tmp_path / "tmp")}
    code = """
import os, pwd
def unknown(_):
    raise KeyError
pwd.getpwuid = unknown
from softbrake.core.jit import CACHE_FOLDER
print(CACHE_FOLDER)
"""
    folders = {run(code, bare, **home) for _ in range(2)}
    assert len(folders) == 1
    assert folders.pop().startswith(str(tmp_path / "tmp" / "softbrake-"))
    assert [path.name for path in tmp_path.iterdir()] == ["tmp"]


def test_named_cache_folder_needs_no_home(environment: dict[str, str], tmp_path: Path) -> None:
    bare = {"PATH": os.environ["PATH"], "PYTHONPATH": environment["PYTHONPATH"], "XDG_CACHE_HOME": str(tmp_path)}
    code = "import os; os.path.expanduser = lambda path: path\nfrom softbrake.core.jit import CACHE_FOLDER; print(CACHE_FOLDER)"
    assert run(code, bare).startswith(str(tmp_path / "softbrake"))


def test_temporary_folder_of_another_is_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    own = jit._temporary_folder()
    assert jit._temporary_folder() == own
    own.chmod(0o777)
    assert jit._temporary_folder() != own
    assert jit._temporary_folder().stat().st_mode & 0o077 == 0
