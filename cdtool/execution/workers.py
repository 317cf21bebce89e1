"""Work on many independent items, in this process, in several or on a cluster, with the results in the items' order.

Reading and judging a log hold Python's interpreter lock most of the time, so threads would not save time: jobs are
processes. They receive the work once, and one item at a time, so that it is known which item ended its worker or takes
too long: it is tried again in another worker.
"""

from __future__ import annotations

import gc
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Protocol, TypeVar

from cdtool.base.errors import UsageError, WorkerError
from cdtool.base.remote.staging import copies_in_use
from cdtool.base.settings import Count, CountFromZero, Positive, check, setting
from cdtool.execution.in_worker import Done, Failed, Outcome, Raised, keep_freed_memory

Item = TypeVar("Item")
Made = TypeVar("Made")
# Called after each piece of work with the amount done and the total.
Progress = Callable[[int, int], None]
# Returns what is made of an item that could not be worked on, given the reason.
OfLost = Callable[[Any, str], Any]

# Items per worker that are under way or wait for the result before them: a long one does not stop the others.
_AHEAD = 8
# Python 3.12.1 itself leaves some hundred objects out of garbage collection; a caller that does so leaves out all.
_LEFT_OUT_BY_PYTHON = 10_000


@dataclass(frozen=True, kw_only=True)
class Execution:
    """[execution]: how the work is done; it changes no result, and results do not state it."""

    timeout_s: Annotated[
        Positive | None, setting("leave out a log that takes longer than this; default: no limit", unit="s")
    ] = None
    retries: Annotated[
        CountFromZero | None,
        setting("how often a log that took too long or ended its worker is tried again; default: 1"),
    ] = None


@dataclass(frozen=True)
class Workers:
    """How work is done: in `jobs` processes, or by the workers of a Dask `cluster`.

    An item that takes longer than `timeout` [s], or ends its worker, is tried `retries` times more. With one job and no
    timeout the work is done in this process, which an item can end. `cluster` is the address of a scheduler, or "local"
    for one that is started here with `jobs` worker processes. `progress` is called after each item with the number done
    and the total.
    """

    jobs: Count = 1
    timeout: Positive | None = None
    retries: CountFromZero = 1
    cluster: str | None = None
    progress: Progress | None = None

    def __post_init__(self) -> None:
        check(self)
        if self.cluster is not None:
            from cdtool.execution.cluster_session import LOCAL, checked_address

            checked_address(self.cluster)
            if self.cluster != LOCAL and self.jobs != 1:
                raise UsageError("--jobs with the address of a cluster", "start that many workers there, or remove it")

    def limited_by(self, execution: Execution) -> Workers:
        """Return the workers with the time and the attempts of [execution] where it gives them."""
        given = {"timeout": execution.timeout_s, "retries": execution.retries}
        return replace(self, **{name: value for name, value in given.items() if value is not None})  # type: ignore[arg-type]

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
    """The contract of a pool of workers for one kind of work, which works in its context."""

    @property
    def size(self) -> int:
        """Return the number of workers."""
        ...

    @property
    def free(self) -> int:
        """Return how many items can be begun."""
        ...

    def begin(self, number: int, item: Any) -> None:
        """Give an item to a worker without one."""
        ...

    def ended(self, *, wait_for_one: bool) -> list[tuple[int, Outcome]]:
        """Return outcomes of items by their numbers; without any, wait for some time if that is asked for."""
        ...

    def __enter__(self) -> Any:
        """Begin."""
        ...

    def __exit__(self, *_: object) -> None:
        """End all workers."""
        ...


def in_order(
    work: Callable[[Item], Made],
    items: Iterable[Item],
    total: int,
    workers: Workers | None = None,
    *,
    of_lost: OfLost | None = None,
) -> Iterator[Made]:
    """Yield `work` of each item, in order, whatever the workers.

    With several workers, `work` and the items must be picklable. An item is taken from `items` when its work begins, a
    few items before its result is yielded, so that waiting items and results need little memory.

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
    of_lost : callable, optional
        Returns the result of an item that ended its workers or took too long, given the item and the reason.

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
    made = _made(_Releasing(work), items, total, workers, of_lost)
    with _without_earlier_garbage():
        for number, result in enumerate(made, 1):
            yield result
            if workers.progress:
                workers.progress(number, total)


def _made(
    work: Callable[[Item], Made], items: Iterable[Item], total: int, workers: Workers, of_lost: OfLost | None
) -> Iterator[Made]:
    if not total:
        return
    if workers.cluster is not None:
        from cdtool.execution.cluster import ClusterWorkers
        from cdtool.execution.cluster_session import session_of

        with session_of(workers.cluster, workers.jobs) as session:
            pool: Pool = ClusterWorkers(session, work, workers.timeout)
            yield from _Ordered(pool, items, workers.retries, of_lost).results(total)
    elif workers.timeout is None and min(workers.jobs, total - 1) <= 1:
        yield from map(work, items)
    else:
        from cdtool.execution.processes import Processes

        pool = Processes(work, min(workers.jobs, total), workers.timeout)
        yield from _Ordered(pool, items, workers.retries, of_lost).results(total)


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


class _Ordered:
    """The results of a pool in the order of the items, whichever of them end their workers."""

    def __init__(self, pool: Pool, items: Iterable[Any], retries: int, of_lost: OfLost | None) -> None:
        self.pool, self.retries, self.of_lost = pool, retries, of_lost
        self._items = enumerate(items)
        self._again: deque[tuple[int, Any]] = deque()
        self._under_way: dict[int, Any] = {}
        self._tried: Counter[int] = Counter()
        self._done: dict[int, Done | Raised] = {}

    def results(self, total: int) -> Iterator[Any]:
        """Yield the result of each item."""
        with self.pool:
            for number in range(total):
                self._begin()
                self._settle(wait_for_one=number not in self._done)
                while number not in self._done:
                    self._begin()
                    self._settle(wait_for_one=True)
                self._begin()
                done = self._done.pop(number)
                if isinstance(done, Raised):
                    raise done.fault
                yield done.value

    def _begin(self) -> None:
        """Give items to all workers without one."""
        while self.pool.free:
            is_enough = len(self._under_way) + len(self._done) >= _AHEAD * self.pool.size
            item = self._again.popleft() if self._again else None if is_enough else next(self._items, None)
            if item is None:
                return
            self.pool.begin(*item)
            self._under_way.update([item])

    def _settle(self, *, wait_for_one: bool) -> None:
        """Note the outcomes of items, and which of them are to be tried again."""
        for number, outcome in self.pool.ended(wait_for_one=wait_for_one):
            item = self._under_way.pop(number)
            self._tried[number] += isinstance(outcome, Failed)
            if isinstance(outcome, Done | Raised):
                self._done[number] = outcome
            elif isinstance(outcome, Failed) and self._tried[number] > self.retries:
                self._done[number] = _lost(item, outcome.reason, self._tried[number], self.of_lost)
            else:
                self._again.append((number, item))


def _lost(item: Any, reason: str, tried: int, of_lost: OfLost | None) -> Done | Raised:
    """Return what stands for an item that has failed too often."""
    words = f"{reason}, in each of {tried} attempts" if tried > 1 else reason
    if of_lost is None:
        return Raised(WorkerError(f"{item}: {words}", "with too little memory, use a smaller --jobs"))
    return Done(of_lost(item, words))
