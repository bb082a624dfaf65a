"""Machine code of kernels on disk: what is damaged there is compiled anew, and what cannot be written is done without."""

import contextlib
import hashlib
import logging
import pickle
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, UserProvidedCacheLocator
from numba.core.serialize import dumps

LOG = logging.getLogger("softbrake")  # without a handler of the caller's: one line on stderr


class Damaged(Exception):
    """A file of the cache does not hold what was written into it."""


def sealed(value: Any) -> tuple[bytes, bytes]:
    """Return a value, pickled, behind the hash of that. Machine code with a wrong byte would else be run."""
    content = dumps(value)
    return hashlib.sha256(content).digest(), content


def opened(seal: Any) -> Any:
    """Return the value of a seal. Raises Damaged."""
    digest, content = seal
    if hashlib.sha256(content).digest() != digest:
        raise Damaged("its hash is another")
    return pickle.loads(content)


class SealedFiles(IndexDataCacheFile):
    """The index and the data files of one kernel, all under seals."""

    def _load_index(self) -> Any:
        index = super()._load_index()
        return opened(index) if index else {}

    def _save_index(self, overloads: Any) -> None:
        super()._save_index(sealed(overloads))

    def _load_data(self, name: str) -> Any:
        return opened(super()._load_data(name))

    def _save_data(self, name: str, data: Any) -> None:
        super()._save_data(name, sealed(data))


class InFolder(CompileResultCacheImpl):
    """Keeps kernels in NUMBA_CACHE_DIR only. Numba would else turn to the package's own folder where that one is full."""

    _locator_classes = (UserProvidedCacheLocator,)


class KernelCache(FunctionCache):
    """Numba's cache of a kernel, which any fault of its files only slows down."""

    _impl_class = InFolder

    def __init__(self, function: Any) -> None:
        """Raises RuntimeError where the folder cannot be written."""
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = SealedFiles(self.cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled kernel for a signature, None where there is none that is sound."""
        try:
            return self._sound(sig, target_context)
        except Exception as error:  # a pickle of random bytes raises whatever these ask for
            index = Path(self._cache_file._index_path)
            warn(f"a file in {index.parents[1]} cannot be read ({_words(error)}); its kernel is compiled anew")
            with contextlib.suppress(OSError):
                index.unlink()
            return None

    def _sound(self, sig: Any, target_context: Any) -> Any:
        return super().load_overload(sig, target_context)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled kernel where that is possible."""
        try:
            super().save_overload(sig, data)
        except Exception as error:
            folder = Path(self.cache_path).parent
            warn(f"{folder} cannot be written ({_words(error)}); each run compiles its kernels")


@cache
def warn(fault: str) -> None:
    """Say a fault once: all kernels of a folder tend to have the same."""
    LOG.warning("kernel cache: %s", fault)


def _words(error: Exception) -> str:
    return getattr(error, "strerror", None) or (str(error).splitlines() or [type(error).__name__])[0]
