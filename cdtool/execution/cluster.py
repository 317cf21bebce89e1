"""Worker processes of a Dask cluster that do pieces of work, and which piece is to blame if one of them ends.

Dask would repeat the tasks of a worker that has ended, on any other worker and as often as its scheduler is configured
to. Here every batch is bound to one worker process instead, two at a time, so that it is known which items a process
had when it ended. An item of such a batch is then done on a worker that does nothing else: if that ends too, the item
is to blame.
"""

from __future__ import annotations

import asyncio
import pickle
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import Any

from cdtool.base.errors import CdtoolError, WorkerError
from cdtool.execution.cluster_session import NoResultError, Session, Worker
from cdtool.execution.in_worker import ended_words, limit_words
from cdtool.execution.on_cluster import GRACE, Done, begin, do, leave

# Batches that a worker has: one that it does and the next one.
_EACH = 2
# Time between two looks at the workers of the cluster, and at those that do not respond [s].
_LOOK, _LOOK_CLOSELY = 0.5, 5.0
# A worker that has not reported for the time limit and this long, or has paused for this long, is ended [s].
_SILENT = 20.0
# So long a run waits for another worker after the last one has ended [s].
_WITHOUT_WORKERS = 60.0
# Within this time the nanny of a worker that has ended reports why, mostly by its next worker [s].
_REASON_WITHIN = 20.0


_MEMORY_WORDS = "its worker process was ended: the memory was not enough"


class WorkerLostError(Exception):
    """A worker process ended, or left the cluster, before the results of a batch."""


@dataclass(eq=False)
class _Sent:
    """A batch, what is done of it, and the worker that has it; `alone`: the worker has nothing else."""

    items: Sequence[tuple[int, Any]]
    alone: bool
    future: Future[list[Any]] = field(default_factory=Future)
    results: list[Any] = field(default_factory=list)
    worker: Worker | None = None
    since: float = 0.0
    # Why its worker was ended, if it was from here.
    reason: str = ""
    waiting: asyncio.Task[None] | None = None

    @property
    def rest(self) -> list[Any]:
        """Return the items without a result."""
        return [item for _, item in self.items[len(self.results) :]]


@dataclass(eq=False)
class _Has:
    """What a worker has of one kind of work."""

    worker: Worker
    begun: Any
    sent: list[_Sent] = field(default_factory=list)

    @property
    def is_reserved(self) -> bool:
        """Whether it has an item that is to be alone."""
        return any(item.alone for item in self.sent)


class ClusterWorkers:
    """The worker processes of a cluster for one kind of work; `limit` is the longest time of an item [s].

    All that follows `submit` happens in the thread of Dask's client, so that nothing is locked.
    """

    broken: tuple[type[BaseException], ...] = (WorkerLostError,)
    isolates = True

    def __init__(self, session: Session, work: Callable[[Any], Any], limit: float | None) -> None:
        self.session = session
        self._limit = limit
        self._work = pickle.dumps(work, pickle.HIGHEST_PROTOCOL)
        self._folder = str(Path.cwd())
        self._has: dict[str, _Has] = {}
        self._queue: deque[_Sent] = deque()
        self._fault: CdtoolError | None = None
        self._closed = False
        # Of each worker: its last report, when it was noticed, and when it was last not paused.
        self._idle: dict[str, tuple[float, float, float]] = {}
        self._looked_closely = monotonic()
        self._last_worker = monotonic()
        self._watching: Future[None] | None = None

    @property
    def size(self) -> int:
        """Return the number of worker processes."""
        return max(1, len(self.session.workers))

    def submit(self, batch: Sequence[tuple[int, Any]], *, alone: bool = False) -> Future[list[Any]]:
        """Return the future results of some numbered items; `alone`: on a worker that does nothing else meanwhile."""
        sent = _Sent(batch, alone)
        with suppress(RuntimeError):  # the loop has ended: the future is as well
            self.session.loop.call_soon_threadsafe(self._accept, sent)
            return sent.future
        sent.future.set_exception(self._fault or self.session.lost())
        return sent.future

    def blamed(self, lost: Future[list[Any]]) -> dict[int, str]:
        """Return the item of a lost batch of which it is known that it ended its worker, and why."""
        fault = lost.exception()
        sent = fault.args[0] if fault is not None and fault.args else None
        if not isinstance(sent, _Sent) or not sent.alone or len(sent.items) > 1 or sent.worker is None:
            return {}
        return {sent.items[0][0]: sent.reason or self._reason(sent.worker, monotonic() - sent.since)}

    def check(self) -> float | None:
        """Return after how long waiting for a result this is to be called again: never."""
        return None

    def progressed(self) -> None:
        """Note that an item was done."""

    @contextmanager
    def __call__(self) -> Iterator[ClusterWorkers]:
        """Watch the workers in the block; what has been submitted is released after it."""
        self._watching = asyncio.run_coroutine_threadsafe(self._watch(), self.session.loop)
        try:
            yield self
        finally:
            with suppress(Exception):
                asyncio.run_coroutine_threadsafe(self._release(), self.session.loop).result(timeout=5.0)

    def _accept(self, sent: _Sent) -> None:
        if self._fault is not None:
            sent.future.set_exception(self._fault)
            return
        self._queue.append(sent)
        self._assign()

    def _assign(self) -> None:
        """Give waiting batches to workers: first those that are to be alone, each to a worker without a batch."""
        for sent in [item for item in self._queue if item.alone]:
            free = [has for has in self._has.values() if not has.sent]
            if not free:
                break
            self._queue.remove(sent)
            self._send(sent, free[0])
        kept = sum(item.alone for item in self._queue)
        usable = sorted((has for has in self._has.values() if not has.is_reserved), key=lambda has: len(has.sent))
        usable = usable[kept:]  # those with the fewest batches are about to be free
        for sent in [item for item in self._queue if not item.alone]:
            has = min(usable, key=lambda item: len(item.sent), default=None)
            if has is None or len(has.sent) >= _EACH:
                break
            self._queue.remove(sent)
            self._send(sent, has)

    def _send(self, sent: _Sent, has: _Has) -> None:
        sent.worker, sent.since = has.worker, monotonic()
        has.sent.append(sent)
        sent.waiting = asyncio.get_running_loop().create_task(self._gather(sent, has))

    async def _gather(self, sent: _Sent, has: _Has) -> None:
        """Wait for the results of a batch."""
        worker = has.worker
        try:
            task = self.session.task(
                worker.address, do, has.begun, worker.process, pickle.dumps(sent.rest, pickle.HIGHEST_PROTOCOL)
            )
            done: Done = pickle.loads(await self.session.result(task))
        except asyncio.CancelledError:
            raise
        except NoResultError:
            self._took_back(sent, has)
            self._lose(sent)
            return
        except Exception as fault:
            self._took_back(sent, has)
            if not sent.future.done():
                sent.future.set_exception(fault)
            return
        self._took_back(sent, has)
        sent.results += done.results
        if done.is_other or done.is_stuck:
            self._drop(worker.address)
        if done.is_stuck:
            self.session.task(worker.address, leave)
        if done.is_other:
            self._lose(sent)
        elif sent.rest:
            self._queue.appendleft(sent)
        elif not sent.future.done():
            sent.future.set_result(sent.results)
        self._assign()

    def _took_back(self, sent: _Sent, has: _Has) -> None:
        if sent in has.sent:
            has.sent.remove(sent)

    def _lose(self, sent: _Sent) -> None:
        sent.results.clear()
        if not sent.future.done():
            sent.future.set_exception(WorkerLostError(sent))

    def _drop(self, address: str) -> None:
        """Forget a worker that has ended: its batches are lost."""
        self.session.forget(address)
        self._idle.pop(address, None)
        has = self._has.pop(address, None)
        if has is None:
            return
        for sent in has.sent:
            if sent.waiting is not None and sent.waiting is not asyncio.current_task():
                sent.waiting.cancel()
            self._lose(sent)

    async def _watch(self) -> None:
        """Notice workers that leave and come, until the block ends."""
        try:
            while not self._closed:
                await self._look()
                self._assign()
                await asyncio.sleep(_LOOK)
        except CdtoolError as fault:
            self._fail(fault)
        except Exception as fault:
            self._fail(self.session.lost(fault))

    async def _look(self) -> None:
        present = await self.session.present()
        for address in set(self._has) - present:
            self._drop(address)
        for address, worker in list(self.session.workers.items()):
            if address not in self._has and address in present:
                task = self.session.task(address, begin, self._work, self._folder, self._limit)
                self._has[address] = _Has(worker, task)
        now = monotonic()
        if self._has:
            self._last_worker = now
        elif now - self._last_worker > _WITHOUT_WORKERS:
            raise self.session.without_workers()
        if now - self._looked_closely > _LOOK_CLOSELY:
            self._looked_closely = now
            await self._end_idle(now)

    async def _end_idle(self, now: float) -> None:
        """End workers that have batches and do nothing: a stopped process beyond the time limit, or one without memory.

        Neither ends itself, and no other worker may take what is bound to it.
        """
        for address, (last, is_paused) in (await self.session.last_reports()).items():
            before, reported, worked = self._idle.get(address, (last, now, now))
            reported, worked = now if last != before else reported, worked if is_paused else now
            self._idle[address] = last, reported, worked
            has = self._has.get(address)
            if has is None or not has.sent:
                continue
            reason = ""
            if self._limit is not None and now - reported > self._limit + GRACE + _SILENT:
                reason = limit_words(self._limit)
            elif now - worked > _SILENT:
                reason = _MEMORY_WORDS
            if reason:
                for sent in has.sent:
                    sent.reason = reason
                self._drop(address)
                self.session.restart(address)

    def _fail(self, fault: CdtoolError) -> None:
        """End all batches with an error."""
        self._fault = fault
        every = [*self._queue, *(sent for has in self._has.values() for sent in has.sent)]
        self._queue.clear()
        for sent in every:
            if sent.waiting is not None:
                sent.waiting.cancel()
            if not sent.future.done():
                sent.future.set_exception(fault)

    async def _release(self) -> None:
        self._closed = True
        if self._fault is None:
            self._fail(WorkerError("the work was ended"))
        self._has.clear()

    def _reason(self, worker: Worker, seconds: float) -> str:
        """Return why a worker process has ended, as far as its scheduler or its nanny reports it."""
        until, code = monotonic() + _REASON_WITHIN, None
        while code is None and worker.nanny is not None and monotonic() < until:
            if (successor := self.session.successor(worker)) is not None:
                code = self.session.exit_status(worker, successor)
                break
            threading.Event().wait(0.2)
        if worker.address in self.session.over_memory:
            return _MEMORY_WORDS
        if self._limit is not None and code in (None, 1) and seconds >= self._limit:
            return limit_words(self._limit)
        return "its worker process ended" if code is None else ended_words(code)
