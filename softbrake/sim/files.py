"""Files written whole or not at all: drafts beside their place, staged HDF5 files, and places that one process holds."""

from __future__ import annotations

import errno
import io
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import groupby
from pathlib import Path
from typing import Any

try:
    import fcntl
except ImportError:  # Windows has none
    fcntl = None  # type: ignore[assignment]


@contextmanager
def draft_of(file: Path | str) -> Iterator[Path]:
    """Yield a name beside a file to write to, which takes the file's place at the end, or goes where that fails. Raises OSError.

    What is not an ordinary file, such as /dev/stdout, is written to itself.
    """
    place = Path(file).resolve()
    if place.exists() and not place.is_file():
        yield place
        return
    draft = place.with_name(f".{place.stem}.{os.getpid()}{place.suffix}")
    try:
        yield draft
        os.replace(draft, place)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise


def write_text(file: Path | str, text: str) -> None:
    """Write a text as UTF-8, whole or not at all. Raises OSError."""
    with draft_of(file) as draft:
        draft.write_text(text, encoding="utf-8", newline="")


def hold(file: Path) -> Callable[[], None]:
    """Hold a place to write to until the function returned is called, or the process ends.

    Raises BlockingIOError where another writer holds it, and OSError. Where the system has no locks, it keeps nobody out.
    """
    if fcntl is None:
        return lambda: None
    lock = file.with_name(f".{file.name}.lock")
    while True:
        handle = os.open(lock, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(handle)
            raise
        except OSError:  # no locks here
            break
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(handle), os.stat(lock)):
                break
        os.close(handle)  # of one that was given back meanwhile

    def release() -> None:
        lock.unlink(missing_ok=True)
        os.close(handle)

    return release


_PAGE = 4096  # bytes, a divisor of every system's
_CHUNK_TABLE = b"TREE\x01"  # a node of the B-tree of a dataset's chunks begins so


class StagedFile(io.RawIOBase):
    """A file for h5py that takes what HDF5 flushes all at once, once there is room for it.

    HDF5 does not survive a write that fails: it may crash when it closes the file. So no write fails here. `fault` says
    that the disk took no more; the file then stays as it was at the last flush that succeeded.
    """

    def __init__(self, path: Path | str, mode: str) -> None:
        """Open a file in mode "r+", or "w" for a new one. Raises OSError."""
        super().__init__()
        self.fault: OSError | None = None
        flags = os.O_RDWR | getattr(os, "O_BINARY", 0) | (os.O_CREAT | os.O_TRUNC if mode == "w" else 0)
        self._disk = os.fdopen(os.open(path, flags, 0o666), "rb+", buffering=0)
        self._kept = self._size = self._disk.seek(0, os.SEEK_END)
        self._at = 0
        self._staged: list[tuple[int, bytes]] = []

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """As of any file."""
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._size}[whence]
        return self._at

    def tell(self) -> int:
        """As of any file."""
        return self._at

    def readinto(self, buffer: Any) -> int:
        """What is on the disk, with what is staged laid over it."""
        view = memoryview(buffer).cast("B")
        count = max(min(len(view), self._size - self._at), 0)
        view[:count], view[count:] = self._overlaid(self._at, count, self._staged), bytes(len(view) - count)
        self._at += count
        return count

    def _overlaid(self, start: int, count: int, parts: list[tuple[int, bytes]]) -> bytearray:
        """Read what is on the disk, and lay parts over it."""
        self._disk.seek(start)
        found = bytearray(self._disk.read(count).ljust(count, b"\0"))
        for offset, data in parts:
            first, last = max(offset, start), min(offset + len(data), start + count)
            if first < last:
                found[first - start : last - start] = data[first - offset : last - offset]
        return found

    def write(self, data: Any) -> int:
        """Stage."""
        self._staged.append((self._at, bytes(data)))
        self._at += len(self._staged[-1][1])
        self._size = max(self._size, self._at)
        return len(self._staged[-1][1])

    def truncate(self, size: int | None = None) -> int:
        """Stage a size."""
        self._size = self._at if size is None else size
        return self._size

    def flush(self) -> None:
        """Bring what is staged to the disk, in an order that a kill may cut off anywhere.

        First what makes the file longer, which alone can lack room; then the superblock, which says how long it is; then the
        tables of chunks; then, as HDF5 wrote it, the rest, which has the sizes of datasets. Parts that follow one another within
        a page are one write, which no kill cuts.
        """
        if self.fault is not None or self.closed or not (self._staged or self._size != self._kept):
            return
        try:
            self._reserve()
            old = [part for part in self._staged if part[0] < self._kept]
            for offset, data in (part for part in self._staged if part[0] >= self._kept):
                self._put(offset, data)
            self._disk.truncate(max(self._size, self._kept))
            old.sort(key=lambda part: (part[0] > 0, not part[1].startswith(_CHUNK_TABLE)))
            for _, group in groupby(old, key=lambda part: part[0] // _PAGE):
                parts = list(group)
                first, last = min(offset for offset, _ in parts), max(offset + len(data) for offset, data in parts)
                self._put(first, bytes(self._overlaid(first, last - first, parts)))
            self._disk.truncate(self._size)
        except OSError as error:
            self.fault = error
            with suppress(OSError):
                self._disk.truncate(self._kept)
        else:
            self._staged, self._kept = [], self._size

    def _reserve(self) -> None:
        """Take the room that the file grows by; a file system that has no such request says at the write whether there is."""
        if self._size <= self._kept or not hasattr(os, "posix_fallocate"):
            return
        try:
            os.posix_fallocate(self._disk.fileno(), self._kept, self._size - self._kept)
        except OSError as error:
            if error.errno not in (errno.EINVAL, errno.EOPNOTSUPP, errno.ENOSYS):
                raise

    def _put(self, offset: int, data: bytes) -> None:
        self._disk.seek(offset)
        rest = memoryview(data)
        while rest:
            rest = rest[self._disk.write(rest) :]

    def close(self) -> None:
        """Flush and close."""
        if not self.closed:
            self.flush()
            try:
                self._disk.close()
            except OSError as error:  # as network disks say it late
                self.fault = self.fault or error
        super().close()
