"""Whether a new process is a copy of this one."""

from __future__ import annotations

import sys
import threading


def shares_memory() -> bool:
    """Return whether processes that are started now are forked and share the memory of this one.

    A fork with other threads could keep a lock for ever.
    """
    return sys.platform == "linux" and threading.active_count() == 1
