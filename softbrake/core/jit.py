"""The one decorator of all kernels, and where their machine code is cached."""

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

from numba import config, njit
from numba.core import event
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.registry import CPUDispatcher

OPTIONS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
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
    folder = _cache_base() / "softbrake" / hash_sources(PACKAGE / "core")
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


class Part(JITCodeLibrary):
    """The code of a kernel for those that call it, handed on as it stands.

    Numba would optimise it with all it calls and make machine code of it, then do the same again in each of its callers. Since
    all are inlined, only that of the outermost is ever run: half of the compilation of the full shell was for nothing.
    """

    _linking_libraries: list[Any]

    def add_linking_library(self, library: Any) -> None:
        library._ensure_finalized()
        further = library._linking_libraries if isinstance(library, Part) else []
        self._linking_libraries = [*dict.fromkeys([*self._linking_libraries, library, *further])]

    def finalize(self) -> None:
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """Return this code and all that it calls."""
        whole = super()._get_module_for_linking().clone()
        for library in self._linking_libraries:
            whole.link_in(JITCodeLibrary._get_module_for_linking(library), preserve=True)
        return whole


class Inner(NoAlias):
    """Compiles a kernel as a Part. The promise of no overlap is left to the outermost, whose arrays they all are.

    Repeated at each call it would fill three quarters of the code with scopes, and win nothing.
    """

    def compile_extra(self, function: Callable[..., Any]) -> Any:
        state = self.state
        state.library = Part(state.targetctx.codegen(), function.__qualname__)
        state.flags.noalias = False
        state.flags.no_compile = True
        return super().compile_extra(function)


class Kernel(CPUDispatcher):
    """A function that kernels and Python call: for kernels it is a Part; where Python calls it, it gets an entry of its own."""

    def __init__(self, function: Callable[..., Any]) -> None:
        options = {**OPTIONS, "nopython": True, "no_cpython_wrapper": True}
        super().__init__(function, targetoptions=options, pipeline_class=Inner)

    @cached_property
    def entry(self) -> Any:
        """Numba's dispatcher of the kernel as the outermost; its machine code is cached, with all the parts in it."""
        theirs = config.CACHE_DIR
        config.CACHE_DIR = str(CACHE_FOLDER)
        try:
            return njit(cache=True, pipeline_class=NoAlias, **OPTIONS)(self.py_func)
        finally:
            config.CACHE_DIR = theirs

    def __call__(self, *arguments: Any) -> Any:
        return self.entry(*arguments)

    def add_overload(self, compiled: Any) -> None:
        """Keep a Part by its types, and tell Numba of it by its library: it has no entry point, which would be its name there."""
        part = compiled.library
        self.targetctx.insert_user_function(part, compiled.fndesc, [part])
        self.overloads[tuple(compiled.signature.args)] = compiled._replace(entry_point=part)


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


def kernel(function: Callable[..., Any]) -> Kernel:
    """Compile at the first call, cache the machine code; division by zero gives inf as in NumPy. See NoAlias, Kernel.

    Kernels let other threads run: no two drops share an array.
    """
    return Kernel(function)
