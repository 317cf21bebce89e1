"""Work on many independent items, in this process, in several or on a cluster, with the results in the items' order.

Reading and judging a log hold Python's interpreter lock most of the time, so threads would not save time: jobs are
processes. They receive the work once, and the items in batches: sending one costs
as much as a twentieth of scoring a log. An item that ends its worker or takes too long is tried again in another
worker; the items that were under way beside it are repeated without being counted.
"""

from __future__ import annotations

import gc
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, wait
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, Protocol, TypeVar

from cdtool.base.errors import UsageError, WorkerError
from cdtool.base.remote.staging import copies_in_use
from cdtool.execution.in_worker import Failed, keep_freed_memory

Item = TypeVar("Item")
Made = TypeVar("Made")
# Called after each piece of work with the amount done and the total.
Progress = Callable[[int, int], None]
# Returns what is made of an item that could not be worked on, given the reason.
OfLost = Callable[[Any, str], Any]

_AHEAD = 2  # batches per worker
_SHARES = 4  # of what is left, per worker
# Python 3.12.1 itself leaves some hundred objects out of garbage collection; a caller that does so leaves out all.
_LEFT_OUT_BY_PYTHON = 10_000


@dataclass(frozen=True)
class Workers:
    """How work is done: in `jobs` processes, or by the workers of a Dask `cluster`.

    An item that takes longer than `timeout` [s], or ends its worker, is tried `retries` times more. With one job and no
    timeout the work is done in this process, which an item can end. `cluster` is the address of a scheduler, or "local"
    for one that is started here with `jobs` worker processes.
    """

    jobs: int = 1
    timeout: float | None = None
    retries: int = 1
    cluster: str | None = None

    def __post_init__(self) -> None:
        if self.jobs < 1:
            raise UsageError(f"jobs is {self.jobs}", "give at least 1")
        if self.timeout is not None and not 0.0 < self.timeout < 1e6:
            raise UsageError(f"timeout is {self.timeout:g}", "give a time above 0 s, or none")
        if self.retries < 0:
            raise UsageError(f"retries is {self.retries}", "give 0 or more")
        if self.cluster is not None:
            from cdtool.execution.cluster_session import LOCAL, checked_address

            checked_address(self.cluster)
            if self.cluster != LOCAL and self.jobs != 1:
                raise UsageError("--jobs with the address of a cluster", "start that many workers there, or remove it")

    @contextmanager
    def ready(self, inputs: Iterable[Path] = ()) -> Iterator[None]:
        """Keep the cluster connected in the block, if there is one; its workers must see the `inputs` as they are here.

        Raises UsageError without the package for clusters, WorkerError if the cluster cannot be used.
        """
        if self.cluster is None:
            yield
            return
        from cdtool.execution.cluster_session import session_of

        with session_of(self.cluster, self.jobs, inputs):
            yield


class Pool(Protocol):
    """The contract of a pool of workers for one kind of work; called, it is a context in which it works."""

    # Exceptions of futures whose worker has ended.
    broken: tuple[type[BaseException], ...]
    # Whether `submit` can do an item alone; otherwise it is alone if nothing else is under way.
    isolates: bool

    @property
    def size(self) -> int:
        """Return the number of items that it works on at a time."""
        ...

    def submit(self, batch: Sequence[tuple[int, Any]], *, alone: bool = False) -> Future[list[Any]]:
        """Return the future results of some numbered items; `alone`: if it isolates, on a worker with nothing else."""
        ...

    def blamed(self, lost: Future[list[Any]]) -> dict[int, str]:
        """After an exception in `broken`: return the items that ended their workers, and why; make the pool usable.

        Where it is not known which item of a batch ended its worker, it is known when they are done alone.
        """
        ...

    def check(self) -> float | None:
        """End what takes too long and does not end itself; return when to call this again [s], None: never."""
        ...

    def progressed(self) -> None:
        """Note that an item was done."""
        ...

    def __call__(self) -> AbstractContextManager[Any]:
        """Return the context."""
        ...


def in_order(
    work: Callable[[Item], Made],
    items: Iterable[Item],
    total: int,
    workers: Workers | None = None,
    *,
    progress: Progress | None = None,
    of_lost: OfLost | None = None,
    together: int = 1,
) -> Iterator[Made]:
    """Yield `work` of each item, in order, whatever the workers.

    With several workers, `work` and the items must be picklable. An item is taken from `items` when its work begins, a
    few batches before its result is yielded, so that waiting items and results need little memory.

    Parameters
    ----------
    work : callable
        Returns the result of one item.
    items : iterable
        The items.
    total : int
        Their number.
    workers : Workers, optional
        Who does the work; this process if it is None, or if there are few items.
    progress : callable, optional
        Called after each item with the number done and the total.
    of_lost : callable, optional
        Returns the result of an item that ended its workers or took too long, given the item and the reason.
    together : int, optional
        The most items of a batch. At the beginning and at the end batches are smaller, so that no worker waits.

    Yields
    ------
    object
        The result of each item.

    Raises
    ------
    WorkerError
        Without `of_lost`: an item ended its workers.

    Examples
    --------
    >>> list(in_order(abs, [-1, 2, -3], total=3))
    [1, 2, 3]
    """
    workers = workers or Workers()
    if total > 1:
        keep_freed_memory()
    made = _made(_Releasing(work), items, total, workers, of_lost, together)
    with _without_earlier_garbage():
        for number, result in enumerate(made, 1):
            yield result
            if progress:
                progress(number, total)


def _made(
    work: Callable[[Item], Made],
    items: Iterable[Item],
    total: int,
    workers: Workers,
    of_lost: OfLost | None,
    together: int,
) -> Iterator[Made]:
    if not total:
        return iter(())
    if workers.cluster is not None:
        return _on_cluster(work, items, total, workers, of_lost, together)
    if workers.timeout is None and min(workers.jobs, total - 1) <= 1:
        return map(work, items)
    from cdtool.execution.processes import Processes

    pool = Processes(work, min(workers.jobs, total), workers.timeout)
    return _Ordered(pool, total, workers.retries, of_lost, together).results(items)


def _on_cluster(
    work: Callable[[Item], Made],
    items: Iterable[Item],
    total: int,
    workers: Workers,
    of_lost: OfLost | None,
    together: int,
) -> Iterator[Made]:
    from cdtool.execution.cluster import ClusterWorkers
    from cdtool.execution.cluster_session import session_of

    assert workers.cluster is not None, "the work is done on a cluster"
    with session_of(workers.cluster, workers.jobs) as session:
        pool = ClusterWorkers(session, work, workers.timeout)
        yield from _Ordered(pool, total, workers.retries, of_lost, together).results(items)


@dataclass(frozen=True)
class _Releasing:
    """Does the work on one item, and then removes the local copies of files at URLs that were made for it."""

    work: Callable[[Any], Any]

    def __call__(self, item: Any) -> Any:
        """Return the result of the item."""
        with copies_in_use():
            return self.work(item)


@contextmanager
def _without_earlier_garbage() -> Iterator[None]:
    """Leave objects that were made before the block out of garbage collection, unless the caller does so.

    There are more than 100,000, most of them of modules and compiled kernels. To search them takes 5 % of the CPU time
    of 200 logs, and in a forked worker it copies their memory.
    """
    if gc.get_freeze_count() > _LEFT_OUT_BY_PYTHON:
        yield
        return
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


@dataclass
class _Batch:
    """Consecutive numbered items, and their results once they are there; with neither, an item to be done alone."""

    items: Sequence[tuple[int, Any]]
    future: Future[list[Any]] | None = None
    results: list[Any] | None = None

    @property
    def is_lost(self) -> bool:
        """Whether its workers have ended before its results."""
        return self.future is not None and self.future.done() and bool(self.future.exception())


class _Ordered:
    """Results of a pool in the order of the items, whichever of them end their workers."""

    def __init__(self, pool: Pool, total: int, retries: int, of_lost: OfLost | None, together: int) -> None:
        self.pool, self.total, self.retries, self.of_lost, self.together = pool, total, retries, of_lost, together
        self._ahead: deque[_Batch] = deque()
        self._tried: Counter[int] = Counter()

    def results(self, items: Iterable[Any]) -> Iterator[Any]:
        """Yield the result of each item."""
        numbered = enumerate(items)
        with self.pool():
            yielded = 0
            self._fill(numbered, yielded)
            while self._ahead:
                results = self._results_of_first()
                if results is None:
                    continue
                self._ahead.popleft()
                yield from results
                yielded += len(results)
                self._fill(numbered, yielded)

    def _fill(self, numbered: Iterator[tuple[int, Any]], yielded: int) -> None:
        """Submit batches until enough are under way."""
        while len(self._ahead) < _AHEAD * self.pool.size:
            taken = yielded + sum(len(batch.items) for batch in self._ahead)
            batch = list(islice(numbered, self._size(taken)))
            if not batch:
                return
            self._ahead.append(_Batch(batch, self.pool.submit(batch)))

    def _size(self, taken: int) -> int:
        most = min(taken, self.total - taken) // (_SHARES * self.pool.size)
        return max(1, min(self.together, most))

    def _results_of_first(self) -> list[Any] | None:
        """Return the results of the first batch; None if some of it is repeated now."""
        first = self._ahead[0]
        if first.future is None and first.results is None:
            self._wait_for([batch.future for batch in self._ahead if batch.future is not None])
            first.future = self.pool.submit(first.items, alone=True)
        if first.results is None:
            assert first.future is not None, "a batch without results is under way"
            try:
                first.results = self._awaited(first.future)
            except self.pool.broken:
                self._repeat(self.pool.blamed(first.future))
                return None
            self.pool.progressed()
        failed = {
            number: result.reason
            for (number, _), result in zip(first.items, first.results, strict=True)
            if isinstance(result, Failed)
        }
        if not failed:
            return first.results
        self._ahead.popleft()
        self._ahead.extendleft(reversed(self._divided(first, failed)))
        return None

    def _awaited(self, future: Future[list[Any]]) -> list[Any]:
        self._wait_for([future])
        return future.result()

    def _wait_for(self, futures: Sequence[Future[list[Any]]]) -> None:
        while wait(futures, timeout=self.pool.check()).not_done:
            pass

    def _repeat(self, blamed: dict[int, str]) -> None:
        """Submit again what was lost; the first batch, or one with an item that is blamed, is divided into items."""
        ahead = [self._ahead.popleft() for _ in range(len(self._ahead))]
        for place, batch in enumerate(ahead):
            if not batch.is_lost:
                self._ahead.append(batch)
            elif not place or any(number in blamed for number, _ in batch.items):
                self._ahead.extend(self._divided(batch, blamed))
            else:
                self._ahead.append(_Batch(batch.items, self.pool.submit(batch.items, alone=True)))

    def _divided(self, batch: _Batch, failed: dict[int, str]) -> list[_Batch]:
        """Return batches of one item each: done, lost, submitted again, or to be done alone if it failed before."""
        single = []
        for place, (number, item) in enumerate(batch.items):
            alone = [(number, item)]
            self._tried[number] += number in failed
            if number not in failed:
                done = None if batch.results is None else [batch.results[place]]
                single.append(_Batch(alone, None if done else self.pool.submit(alone, alone=True), done))
            elif self._tried[number] > self.retries:
                single.append(_Batch(alone, results=[self._lost(item, number, failed[number])]))
            else:
                single.append(_Batch(alone, self.pool.submit(alone, alone=True) if self.pool.isolates else None))
        return single

    def _lost(self, item: Any, number: int, reason: str) -> Any:
        tried = f"{reason}, in each of {self._tried[number]} attempts" if self._tried[number] > 1 else reason
        if self.of_lost is None:
            raise WorkerError(f"{item}: {tried}", "with too little memory, use a smaller --jobs")
        return self.of_lost(item, tried)
