"""Numba's inside, as far as kernels lean on it: all kernels of a driver are inlined into it, and no two arrays overlap.

Written for the releases of TESTED. `core.jit` takes plain `njit` where another is installed, or names here are gone.
"""

import gc
from collections.abc import Callable
from functools import cached_property
from typing import Any

from llvmlite.binding import parse_assembly
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.registry import CPUDispatcher
from numba.core.types import unliteral  # type: ignore[attr-defined]

from softbrake.core.cache import KernelCache

TESTED = "0.68."  # releases of Numba
OPTIONS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
RARELY = (100_000, 20, 100)  # objects made, collections of the young, of the middle-aged between two of the next older
OPTIONS_HASH = hash(Flags())  # that of any
COMPILED = "_ZN"  # how the names of compiled Python functions begin


class Unlinked(Exception):
    """A driver was linked without one of its kernels: to run it would be to call address 0."""


class Whole(JITCodeLibrary):
    """The code of a driver with all it calls. Numba itself looks for missing parts among its own functions only."""

    def _verify_declare_only_symbols(self) -> None:
        super()._verify_declare_only_symbols()
        missing = [one.name for one in self._final_module.functions if one.is_declaration and one.name.startswith(COMPILED)]
        if missing:
            raise Unlinked(f"{self.name} was linked without {', '.join(missing)}; SOFTBRAKE_SIMPLE_JIT=1 compiles it plainly")

    def serialize_using_object_code(self) -> Any:
        """Return what the cache keeps: machine code, and the names in it.

        Numba keeps what callers would inline as well, and reads it at each start. A driver is called by Python alone.
        """
        name, kind, (machine_code, _) = super().serialize_using_object_code()
        defined = (one.name for one in self._final_module.functions if not one.is_declaration)
        names = parse_assembly("\n".join(f'define void @"{one}"() {{ unreachable }}' for one in defined))
        return name, kind, (machine_code, names.as_bitcode())


class Options(Flags):
    """Options of a compilation. Numba's own ask all defaults anew at each comparison, which it makes for each operation: 1/9."""

    def __hash__(self) -> int:
        return OPTIONS_HASH

    def __eq__(self, other: object) -> bool:
        same = isinstance(other, Options) and self._values == other._values
        return same or bool(super().__eq__(other))


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
        flags = Options(flags)
        flags.noalias = True
        flags.nrt = False
        flags.forceinline = True
        super().__init__(typingctx, targetctx, library, args, return_type, flags, locals)

    def compile_extra(self, function: Callable[..., Any]) -> Any:
        if self.state.library is None:
            self.state.library = Whole(self.state.targetctx.codegen(), function.__qualname__)
            self.state.library.enable_object_caching()
        before = gc.get_threshold()
        gc.set_threshold(*RARELY)  # most of what a compilation makes lives until its end: to look for garbage often is 1/20 of it
        try:
            return super().compile_extra(function)
        finally:
            gc.set_threshold(*before)


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


class QuickCache(KernelCache):
    """Loads machine code alone. Numba would first import all that it can compile, with SciPy's linear algebra.

    What NoAlias makes calls nothing of that: it counts no references. A kernel that is not found compiled has it loaded then.
    """

    def _sound(self, sig: Any, target_context: Any) -> Any:
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)
        return None


class Kernel(CPUDispatcher):
    """A function that kernels and Python call: for kernels it is a Part; where Python calls it, it gets an entry of its own."""

    def __init__(self, function: Callable[..., Any], cached_njit: Callable[..., Any]) -> None:
        options = {**OPTIONS, "nopython": True, "no_cpython_wrapper": True}
        super().__init__(function, targetoptions=options, pipeline_class=Inner)
        self.cached_njit = cached_njit

    @cached_property
    def entry(self) -> Any:
        """Numba's dispatcher of the kernel as the outermost; its machine code is cached, with all the parts in it."""
        return self.cached_njit(self.py_func, pipeline_class=NoAlias, **OPTIONS)

    def __call__(self, *arguments: Any) -> Any:
        return self.entry(*arguments)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return the Part for these types, of a constant that of any value: once inlined it is known all the same."""
        return super().get_call_template([unliteral(one) for one in args], {name: unliteral(one) for name, one in kws.items()})

    def add_overload(self, compiled: Any) -> None:
        """Keep a Part by its types, and tell Numba of it by its library: it has no entry point, which would be its name there."""
        part = compiled.library
        self.targetctx.insert_user_function(part, compiled.fndesc, [part])
        self.overloads[tuple(compiled.signature.args)] = compiled._replace(entry_point=part)


def is_known(version: str) -> bool:
    """Return whether a release of Numba was tested, and its inside has all the names that this file overrides."""
    names: dict[type, tuple[str, ...]] = {
        JITCodeLibrary: (
            *("add_linking_library", "finalize", "_ensure_finalized", "_get_module_for_linking"),
            *("_verify_declare_only_symbols", "enable_object_caching", "serialize_using_object_code"),
        ),
        CPUDispatcher: ("add_overload",),
        Compiler: ("compile_extra",),
        FunctionCache: ("_load_overload", "_guard_against_spurious_io_errors"),
    }
    return version.startswith(TESTED) and all(hasattr(part, name) for part, known in names.items() for name in known)
