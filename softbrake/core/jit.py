"""The one decorator of all kernels, and where their machine code is cached."""

import hashlib
import os
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
from numba import config, njit
from numba.core import event

PACKAGE = Path(__file__).resolve().parents[1]


def hash_sources(*folders: Path) -> str:
    """Return a hash of the Python sources in folders of the package."""
    digest = hashlib.sha256()
    for source in sorted(source for folder in folders for source in folder.rglob("*.py")):
        digest.update(source.relative_to(PACKAGE).as_posix().encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _cache_base() -> Path:
    if config.CACHE_DIR:
        return Path(config.CACHE_DIR)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))


def _cache_folder() -> Path:
    """Writable folder for this version of the kernels; a new temporary one where the user has none."""
    # Numba looks at a kernel's own file only: a changed helper or constant would leave stale machine code in one folder for all.
    folder = _cache_base() / "softbrake" / (hash_sources(PACKAGE / "core") + ("" if INLINING is not None else "-plain"))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.mkdtemp(prefix="softbrake-"))
    return folder if os.access(folder, os.W_OK) else Path(tempfile.mkdtemp(prefix="softbrake-"))


def _inlining() -> Any:
    """The module that inlines kernels; None for plain `njit`: on request, or where Numba's inside is not the one it knows."""
    if os.environ.get("SOFTBRAKE_SIMPLE_JIT") == "1":
        return None
    try:
        from softbrake.core import inlining
    except ImportError:
        known = False
    else:
        known = inlining.is_known(numba.__version__)
    if not known:
        warnings.warn(f"Numba {numba.__version__} was not tested: kernels are compiled plainly, and take longer", stacklevel=2)
    return inlining if known else None


INLINING = _inlining()
CACHE_FOLDER = _cache_folder()


class _Announcement(event.Listener):
    def __init__(self, say: Callable[[], None]) -> None:
        self.say: Callable[[], None] | None = say

    def on_start(self, event: event.Event) -> None:
        say, self.say = self.say, None
        if say is not None:
            say()

    def on_end(self, event: event.Event) -> None:
        pass


@contextmanager
def before_compiling(say: Callable[[], None]) -> Iterator[None]:
    """Call say once within the context, at the first kernel that is not found compiled."""
    with event.install_listener("numba:compile", _Announcement(say)):
        yield


def cached_njit(function: Callable[..., Any], **options: Any) -> Any:
    """Numba's dispatcher of a function, its machine code cached in CACHE_FOLDER."""
    theirs, config.CACHE_DIR = config.CACHE_DIR, str(CACHE_FOLDER)
    try:
        return njit(cache=True, **options)(function)
    finally:
        config.CACHE_DIR = theirs


def kernel(function: Callable[..., Any]) -> Any:
    """Compile at the first call, cache the machine code; division by zero gives inf as in NumPy. See core.inlining.

    Kernels let other threads run: no two drops share an array. Where Numba's inside is not known, or SOFTBRAKE_SIMPLE_JIT=1,
    this is `njit`: the same digits, at twice the time.
    """
    if INLINING is not None:
        return INLINING.Kernel(function, cached_njit)
    plain = cached_njit(function, nogil=True, error_model="numpy")
    plain.entry = plain
    return plain
