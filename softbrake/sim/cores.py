"""How many cores, and how much memory, this process may use."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path

GROUPS, MOUNTED = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")  # Linux: of this process, of all


def cores() -> int:
    """Number of cores that this process may use; a container's quota of CPU time counts as the cores that it fills."""
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(allowed, max(math.ceil(min(_quota(), allowed)), 1))


@cache
def memory() -> float:
    """Bytes of memory that this process may use, inf where the system does not tell; a container's limit counts."""
    try:
        there = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):  # Windows
        there = math.inf
    return min([there, *map(_limit_of, _groups("memory"))])


def _quota() -> float:
    """Seconds of CPU time a second that the control groups of this process leave it, inf without a limit."""
    return min(map(_quota_of, _groups("cpu")), default=math.inf)


def _groups(controller: str) -> Iterator[Path]:
    """Folders of the control groups of this process and of those around them, whose limits hold as well."""
    try:
        lines = GROUPS.read_text(encoding="utf-8").splitlines()
    except OSError:
        return
    for line in lines:  # number:controllers:path; version 2 names no controllers
        _, controllers, path = line.split(":", 2)
        if controllers and controller not in controllers.split(","):
            continue
        top = MOUNTED / controller if controllers else MOUNTED
        group = top / path.lstrip("/")
        yield from (folder for folder in (group, *group.parents) if folder.is_relative_to(top))


def _limit_of(group: Path) -> float:
    """Most memory (bytes) of one group, in version 2 or 1; inf where it has no limit or cannot be read."""
    for name in ("memory.max", "memory.limit_in_bytes"):
        try:
            return float((group / name).read_text(encoding="utf-8"))
        except (OSError, ValueError):  # ValueError: max
            continue
    return math.inf


def _quota_of(group: Path) -> float:
    """The limit of one group, in version 2 or 1; inf where it has none or cannot be read."""
    for files in (("cpu.max",), ("cpu.cfs_quota_us", "cpu.cfs_period_us")):
        try:
            quota, period = " ".join((group / name).read_text(encoding="utf-8") for name in files).split()
            if float(quota) > 0.0:
                return float(quota) / float(period)
        except (OSError, ValueError):  # ValueError: max
            continue
    return math.inf
