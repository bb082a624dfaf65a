"""The one decorator of all kernels, and where their machine code is cached."""

import contextlib
import hashlib
import os
import stat
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
from numba import config, njit
from numba.core import event

from softbrake.core.cache import KernelCache, warn

PACKAGE = Path(__file__).resolve().parents[1]


def hash_sources(*folders: Path) -> str:
    """Return a hash of the Python sources in folders of the package."""
    digest = hashlib.sha256()
    for source in sorted(source for folder in folders for source in folder.rglob("*.py")):
        digest.update(source.relative_to(PACKAGE).as_posix().encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _user_folder() -> Path:
    """Where a user's caches belong. Raises RuntimeError without a home: a container's user may have none."""
    if config.CACHE_DIR:
        return Path(config.CACHE_DIR)
    variable, usual = {"win32": ("LOCALAPPDATA", "AppData/Local"), "darwin": ("", "Library/Caches")}.get(
        sys.platform, ("XDG_CACHE_HOME", ".cache")
    )
    folder = Path(os.environ.get(variable, ""))
    if not folder.is_absolute():  # by the standard an empty or relative one does not count
        folder = Path.home() / usual
    if not folder.is_absolute():
        raise RuntimeError("HOME is no folder")
    return folder


def _temporary_folder() -> Path:
    """A folder of the user's own among those for temporary files, so that the next run finds its kernels."""
    if not hasattr(os, "getuid"):  # Windows has such folders for each user
        return Path(tempfile.gettempdir())
    folder = Path(tempfile.gettempdir(), f"softbrake-{os.getuid()}")
    folder.mkdir(mode=0o700, exist_ok=True)
    about = folder.lstat()
    if about.st_uid != os.getuid() or not stat.S_ISDIR(about.st_mode) or about.st_mode & 0o077:
        return Path(tempfile.mkdtemp(prefix="softbrake-"))  # others could put code of theirs there
    return folder


def _cache_folder() -> Path | None:
    """Writable folder for this version of the kernels; a temporary one where the user has none, None without any."""
    # Numba looks at a kernel's own file only: a changed helper or constant would leave stale machine code in one folder for all.
    version = hash_sources(PACKAGE / "core") + ("" if INLINING is not None else "-plain")
    for base in (_user_folder, _temporary_folder):
        with contextlib.suppress(OSError, RuntimeError):
            folder = base() / "softbrake" / version
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
            return folder
    return None


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


@contextlib.contextmanager
def before_compiling(say: Callable[[], None]) -> Iterator[None]:
    """Call say once within the context, at the first kernel that is not found compiled."""
    with event.install_listener("numba:compile", _Announcement(say)):
        yield


def cached_njit(function: Callable[..., Any], **options: Any) -> Any:
    """Numba's dispatcher of a function, its machine code cached in CACHE_FOLDER."""
    dispatcher = njit(**options)(function)
    if CACHE_FOLDER is None:
        warn("no folder can be written; each run compiles its kernels")
        return dispatcher
    theirs, config.CACHE_DIR = config.CACHE_DIR, str(CACHE_FOLDER)
    try:
        dispatcher._cache = (KernelCache if INLINING is None else INLINING.QuickCache)(function)
    except RuntimeError:  # the folder has no room for one more
        warn(f"{CACHE_FOLDER} cannot be written; each run compiles its kernels")
    finally:
        config.CACHE_DIR = theirs
    return dispatcher


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
