"""How many cores this process may use."""

from __future__ import annotations

import math
import os
from pathlib import Path

GROUPS, MOUNTED = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")  # Linux: of this process, of all


def cores() -> int:
    """Number of cores that this process may use; a container's quota of CPU time counts as the cores that it fills."""
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(allowed, max(math.ceil(min(_quota(), allowed)), 1))


def _quota() -> float:
    """Seconds of CPU time a second that the control groups of this process leave it, inf without a limit."""
    try:
        lines = GROUPS.read_text(encoding="utf-8").splitlines()
    except OSError:
        return math.inf
    least = math.inf
    for line in lines:  # number:controllers:path; version 2 names no controllers
        _, controllers, path = line.split(":", 2)
        if controllers and "cpu" not in controllers.split(","):
            continue
        top = MOUNTED / "cpu" if controllers else MOUNTED
        group = top / path.lstrip("/")
        for folder in (group, *group.parents):
            if folder.is_relative_to(top):  # a limit of an outer group holds as well
                least = min(least, _quota_of(folder))
    return least


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
