"""Processes of this machine that do pieces of work, and which piece is to blame if one of them ends.

On Linux they are forked from this process, so that they share its modules and compiled kernels; elsewhere, and if this
process has several threads, they are new processes of Python.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Future
from concurrent.futures.process import BrokenProcessPool, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import wait
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from time import monotonic, monotonic_ns
from typing import Any

from cdtool.base.errors import WorkerError
from cdtool.execution.forking import shares_memory
from cdtool.execution.in_worker import CLAIM, TOLD_TO_END, begin, do, ended_words, limit_words
from cdtool.execution.interruption import without_interruption

# On Windows, a process is ended in one way only.
_KILL = getattr(signal, "SIGKILL", signal.SIGTERM)
# Windows waits for no more processes at a time.
_MOST_PROCESSES = 61 if os.name == "nt" else sys.maxsize
# So many times in a row processes may end although none of them has begun a piece.
_MOST_RESTARTS = 3
_JOINED_WITHIN, _ENDED_WITHIN = 10.0, 3.0
# After the time limit, a process has this long to end itself; processes and pieces are looked at so often [s].
_GRACE, _CHECKED_EVERY = 2.0, 1.0
# The pool notices within this time that a process has ended, unless it waits for the rest of what that one sent [s].
_NOTICED_WITHIN = 2.0


class Processes:
    """A `ProcessPoolExecutor` for one kind of work that is replaced when one of its processes ends.

    `size` processes do the work, on Windows at most 61; a piece that takes longer than `limit` [s] ends its process.
    """

    broken: tuple[type[BaseException], ...] = (BrokenProcessPool, CancelledError)
    isolates = False

    def __init__(self, work: Callable[[Any], Any], size: int, limit: float | None) -> None:
        self.size = min(size, _MOST_PROCESSES)
        self._work = work
        self._limit = limit
        self._restarts = 0
        self._start()

    def _start(self) -> None:
        context = _context()
        try:
            self._claims: Any = context.RawArray("q", CLAIM * self.size)
            free: Any = context.SimpleQueue()
        except OSError as fault:
            words = f"no shared memory for processes: {fault.strerror or fault}"
            raise WorkerError(words, "free space in /dev/shm, or use --jobs 1 without --timeout") from fault
        for number in range(self.size):
            free.put(number)
        self._children: set[BaseProcess] = set()
        self._ended_at: float | None = None  # when it was first seen that a process has ended
        self._ended_here: set[int] = set()
        self._pool = ProcessPoolExecutor(
            self.size, context, initializer=begin, initargs=(self._work, self._claims, free, self._limit)
        )
        self._results: Any = self._pool._result_queue  # shutting the pool down drops it

    def submit(self, batch: Sequence[tuple[int, Any]], *, alone: bool = False) -> Future[list[Any]]:  # noqa: ARG002
        """Return the future results of some numbered pieces; a pool whose process has ended gives a failed one."""
        try:
            with without_interruption():  # it starts processes
                future = self._pool.submit(do, batch)
        except BrokenProcessPool as fault:
            future = Future()
            future.set_exception(fault)
        # The pool's own list: another pool may be at work in this program, and a process that has ended is in no other.
        self._children |= set((self._pool._processes or {}).values())
        return future

    def blamed(self, lost: Future[list[Any]]) -> dict[int, str]:  # noqa: ARG002  the claims show it
        """Return the numbers of the pieces that ended their processes, with the reasons, and start new processes.

        Raises WorkerError if the processes end again and again before they have begun a piece.
        """
        now = monotonic_ns()
        self._end(self._children)
        self._pool.shutdown(wait=True, cancel_futures=True)
        status: dict[int, int | None] = {}
        for child in self._children:
            child.join(_JOINED_WITHIN)
            status[child.pid or 0] = child.exitcode
        for process in self._ended_here & set(status):
            status[process] = TOLD_TO_END
        found: dict[int, str] = {}
        asked: list[tuple[int, int]] = []
        for process, number, since, told in self._each_claim():
            code = status.get(process, 1)
            if code in (TOLD_TO_END, -signal.SIGTERM):
                asked += [(told, number)] if told else []
            elif number > 0 and code is not None:
                found[number - 1] = self._reason(code, 1e-9 * (now - since))
            elif number and code is not None:  # its result may not have arrived
                found[-number - 1] = ended_words(code)
        # The pool asks all processes to end when one of them has ended; if none has, the first one was asked by others.
        if not found and asked and all(code in (TOLD_TO_END, -signal.SIGTERM) for code in status.values()):
            _, number = min(asked)
            found |= {number - 1: ended_words(-signal.SIGTERM)} if number > 0 else {}
        self._restarts = 0 if found else self._restarts + 1
        if self._restarts > _MOST_RESTARTS:
            raise WorkerError(
                "worker processes end before they begin their work", "with too little memory, use a smaller --jobs"
            )
        self._start()
        return found

    def _reason(self, code: int, seconds: float) -> str:
        if self._limit is not None and code in (1, -_KILL) and seconds >= self._limit:
            return limit_words(self._limit)
        return ended_words(code)

    def check(self) -> float:
        """End a process whose piece takes too long and did not end itself; let the pool notice one that has ended."""
        self._release()
        if self._limit is None:
            return _CHECKED_EVERY
        now = monotonic_ns()
        too_long = {
            process
            for process, number, since, _ in self._each_claim()
            if number > 0 and 1e-9 * (now - since) > self._limit + _GRACE
        }
        for child in self._children:
            if child.pid in too_long and not _has_ended(child):
                child.kill()
        return _CHECKED_EVERY

    def _release(self) -> None:
        """End all processes if one has ended and the pool did not notice it.

        A process that is killed while it sends a result leaves the pool waiting for the rest of it, and the other
        processes for the right to send theirs.
        """
        ended = set(filter(_has_ended, self._children))
        if not ended:
            self._ended_at = None
        elif self._ended_at is None:
            self._ended_at = monotonic()
        elif monotonic() - self._ended_at > _NOTICED_WITHIN:
            self._end(self._children - ended)
            self._ended_at = None

    def _end(self, children: Iterable[BaseProcess]) -> None:
        """End processes, by force if they ignore the signal, and the wait of the pool for what they did not send."""
        for child in children:
            if not _has_ended(child):
                self._ended_here.add(child.pid or 0)
                child.terminate()
        until = monotonic() + _ENDED_WITHIN
        for child in children:
            child.join(max(0.0, until - monotonic()))
            if not _has_ended(child):
                child.kill()
                child.join(_JOINED_WITHIN)
        # The pool holds an end of the pipe for sending, too: without this it never sees that nobody else does.
        with suppress(AttributeError, OSError):
            self._results._writer.close()

    def _each_claim(self) -> Iterator[Sequence[int]]:
        return (self._claims[first : first + CLAIM] for first in range(0, len(self._claims), CLAIM))

    def progressed(self) -> None:
        """Note that a piece was done: the processes work."""
        self._restarts = 0

    @contextmanager
    def __call__(self) -> Iterator[Processes]:
        """End the processes after the block; if it ends early, without waiting for the work that has begun."""
        try:
            yield self
        except BaseException:
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._end(self._children)
            raise
        self._pool.shutdown(wait=True)


def _has_ended(child: BaseProcess) -> bool:
    """Return whether a process has ended; `is_alive` may be wrong while a thread of the pool waits for it."""
    return bool(wait([child.sentinel], 0.0))


def _context() -> BaseContext:
    return get_context("fork" if shares_memory() else "spawn")
