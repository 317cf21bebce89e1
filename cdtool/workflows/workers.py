"""Work on many items, in this process or in several, with the results in the order of the items.

Reading and judging a log hold Python's interpreter lock most of the time, so threads would not save time: jobs are
processes. They are started when the work begins and receive it once. On Linux they are forked from this process after
it has done the first item, so that they share its modules and compiled kernels; elsewhere, and if this process has
several threads, they are new processes of Python.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from cdtool.errors import WorkerError

if TYPE_CHECKING:
    from concurrent.futures import Future, ProcessPoolExecutor
    from multiprocessing.context import BaseContext

Item = TypeVar("Item")
Made = TypeVar("Made")
# Called after each piece of work with the amount done and the total.
Progress = Callable[[int, int], None]

# The arrays of a log are smaller [bytes].
_KEPT = 4 << 20

# In a worker: what is done with each item.
_work: Callable[[Any], Any] | None = None


def in_order(
    work: Callable[[Item], Made], items: Iterable[Item], total: int, jobs: int = 1, progress: Progress | None = None
) -> Iterator[Made]:
    """Yield `work` of each item, in order, whatever the number of `jobs`.

    With more than one job, `work` and the items must be picklable. An item is taken from `items` when its work begins,
    at most two per job before its result is yielded, so that waiting results need little memory.

    Parameters
    ----------
    work : callable
        Returns the result of one item.
    items : iterable
        The items.
    total : int
        Their number.
    jobs : int, optional
        Number of processes; with 1, or with one or two items, the work is done in this process.
    progress : callable, optional
        Called after each item with the number done and the total.

    Yields
    ------
    object
        The result of each item.

    Raises
    ------
    WorkerError
        A process ended before its result.

    Examples
    --------
    >>> list(in_order(abs, [-1, 2, -3], total=3))
    [1, 2, 3]
    """
    if total > 1:
        _keep_freed_memory()
    made = map(work, items) if min(jobs, total - 1) <= 1 else _by_processes(work, items, min(jobs, total - 1))
    with _without_earlier_garbage():
        for number, result in enumerate(made, 1):
            yield result
            if progress:
                progress(number, total)


def _keep_freed_memory() -> None:
    """Let the C library keep the memory of one item for the next.

    glibc returns freed blocks of more than 128 KiB to the system, so that each item pays for their pages again: 430
    page faults for 7 s of a gate, 5 % of the CPU time. The limit rises to the size of a larger block that is freed.
    """
    np.empty(_KEPT, np.uint8)


@contextmanager
def _without_earlier_garbage() -> Iterator[None]:
    """Leave objects that were made before the block out of garbage collection, unless the caller does so.

    There are more than 100,000, most of them of modules and compiled kernels. To search them takes 5 % of the CPU time
    of 200 logs, and in a forked worker it copies their memory.
    """
    if gc.get_freeze_count():
        yield
        return
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def _by_processes(work: Callable[[Item], Made], items: Iterable[Item], jobs: int) -> Iterator[Made]:
    from concurrent.futures import ProcessPoolExecutor

    waiting = iter(items)
    for item in islice(waiting, 1):
        yield work(item)
    with ProcessPoolExecutor(jobs, _context(), initializer=_begin, initargs=(work,)) as pool, _stopping(pool):
        ahead = deque(_submitted(pool, item) for item in islice(waiting, 2 * jobs))
        while ahead:
            with _ended_processes_named():
                made = ahead.popleft().result()
            yield made
            ahead.extend(_submitted(pool, item) for item in islice(waiting, 1))


def _submitted(pool: ProcessPoolExecutor, item: Any) -> Future[Any]:
    """Return the pool's work on an item; a pool whose process has ended refuses it."""
    with _ended_processes_named():
        return pool.submit(_do, item)


@contextmanager
def _ended_processes_named() -> Iterator[None]:
    from concurrent.futures.process import BrokenProcessPool

    try:
        yield
    except BrokenProcessPool as fault:
        raise WorkerError(
            "a worker process ended before its result", "with too little memory, use a smaller --jobs"
        ) from fault


def _context() -> BaseContext:
    """Return how processes are started: a fork with other threads could keep a lock for ever."""
    from multiprocessing import get_context

    alone = threading.active_count() == 1
    return get_context("fork" if sys.platform == "linux" and alone else "spawn")


def _begin(work: Callable[[Any], Any]) -> None:
    """Prepare a worker: it leaves Ctrl-C to the first process, and ends with it even if that is killed."""
    global _work
    _work = work
    _keep_freed_memory()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _end)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end(*_: object) -> None:
    raise SystemExit(1)


def _end_with_parent() -> None:
    from multiprocessing import parent_process

    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _do(item: Any) -> Any:
    assert _work is not None
    try:
        return _work(item)
    except SystemExit:  # told to end: temporary files are removed by now
        os._exit(1)


@contextmanager
def _stopping(pool: ProcessPoolExecutor) -> Iterator[None]:
    """If the block ends early, cancel work that has not begun and end the processes started in it."""
    from multiprocessing import active_children

    others = set(active_children())
    try:
        yield
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for child in set(active_children()) - others:
            child.terminate()
        raise
