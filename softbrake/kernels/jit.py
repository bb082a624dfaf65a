"""The one decorator of all kernels, and where their machine code is cached."""

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import config, njit
from numba.core.compiler import Compiler

PACKAGE = Path(__file__).resolve().parents[1]


def hash_sources(*folders: Path) -> str:
    """Return a hash of the Python sources in folders of the package, state.py always among them."""
    digest = hashlib.sha256((PACKAGE / "state.py").read_bytes())
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
    folder = _cache_base() / "softbrake" / hash_sources(PACKAGE / "kernels")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.mkdtemp(prefix="softbrake-"))
    return folder if os.access(folder, os.W_OK) else Path(tempfile.mkdtemp(prefix="softbrake-"))


CACHE_FOLDER = _cache_folder()


class NoAlias(Compiler):
    """Compiles with the promise that no two arrays given to a kernel overlap where one of them is written.

    LLVM else tests this at run time before each loop it vectorises, pair by pair of arrays, or gives up where they are many:
    52 against 188 ns for update_edges on 96 columns.

    Kernels allocate nothing, so they do not count references either: each count is atomic, and one is due whenever an array is
    taken out of a tuple. And they are inlined, all of them: to call one means to copy the tuples it is given, seven words an
    array. ns per node and step, and seconds of compilation:

                        36 x 90      36 x 9      axisymmetric, 36       compilation
        with both         13.9          75                       26            19 s
        no counts         10.7          43                        8            11 s
        and inlined        8.0          17                        6             8 s
    """

    def __init__(
        self, typingctx: Any, targetctx: Any, library: Any, args: Any, return_type: Any, flags: Any, locals: Any
    ) -> None:
        flags.noalias = True
        flags.nrt = False
        flags.forceinline = True
        super().__init__(typingctx, targetctx, library, args, return_type, flags, locals)


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile at the first call, cache the machine code; division by zero gives inf as in NumPy. See NoAlias.

    Kernels let other threads run: no two drops share an array.
    """
    theirs = config.CACHE_DIR
    config.CACHE_DIR = str(CACHE_FOLDER)
    try:
        compiler = njit(cache=True, nogil=True, error_model="numpy", pipeline_class=NoAlias, no_cfunc_wrapper=True)
        compiled: Callable[..., Any] = compiler(function)
        return compiled
    finally:
        config.CACHE_DIR = theirs
