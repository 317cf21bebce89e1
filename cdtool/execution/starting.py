"""How processes start: whether they share memory, and Ctrl-C, which does not reach them before they ignore it.

A terminal sends it to all processes. Python prints where it interrupted a process that has not finished its start.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager


def shares_memory() -> bool:
    """Return whether processes that are started now are forked and share the memory of this one.

    A fork with other threads could keep a lock for ever.
    """
    return sys.platform == "linux" and threading.active_count() == 1


@contextmanager
def without_interruption() -> Iterator[None]:
    """Let Ctrl-C wait until the block has ended; processes and threads that it starts do not receive it."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def ignore_interruption() -> None:
    """Ignore Ctrl-C in this process, which its first process receives, too; programs that it starts ignore it as well.

    It is called in the main thread.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def dask_setup(_: object) -> None:
    """Ignore Ctrl-C in a worker process of `--cluster local`; called by Dask's `preload`."""
    ignore_interruption()
