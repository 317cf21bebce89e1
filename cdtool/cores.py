"""The number of processor cores available to this process."""

from __future__ import annotations

import os


def usable_cores() -> int:
    """Return the number of cores that the process may use, if the platform states it; otherwise of all cores."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
