"""Work on a Dask cluster: each of its worker processes has one item at a time.

So it is known which item a process had when it ended. Dask would repeat it on any other worker, as often as its
scheduler is configured to; here every item is bound to a worker, and repeated as often as `execution.retries` states.
"""

from __future__ import annotations

import asyncio
import pickle
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from pathlib import Path
from time import monotonic, sleep
from typing import Any

from cdtool.base.errors import CdtoolError
from cdtool.execution.cluster_session import Session, Worker
from cdtool.execution.in_worker import Failed, Outcome, Raised, ended_words, limit_words
from cdtool.execution.on_cluster import begin, do

# Time between two looks at the workers of the cluster [s].
_LOOK = 0.5
# A worker that has an item is ended if it has paused for so long, or if its item takes so much longer than the limit:
# one without memory, and a stopped one, do not end themselves [s].
_SILENT = 20.0
# So long a run waits for another worker after the last one has ended [s].
_WITHOUT_WORKERS = 60.0
# Within this time the nanny of a worker that has ended reports why [s].
_REASON_WITHIN = 5.0
_MEMORY_WORDS = "its worker process was ended: the memory was not enough"


class ClusterWorkers:
    """The worker processes of a cluster for one kind of work; `limit` is the longest time of an item [s]."""

    def __init__(self, session: Session, work: Callable[[Any], Any], limit: float | None) -> None:
        self.session, self._limit = session, limit
        self._work = pickle.dumps(work, pickle.HIGHEST_PROTOCOL)
        self._begun: dict[Worker, Any] = {}
        # The number of the item that a worker has, since when, and its outcome.
        self._has: dict[Worker, tuple[int, float, Future[Any]]] = {}
        self._looked = self._last_worker = monotonic()

    def __enter__(self) -> ClusterWorkers:
        """Begin."""
        return self

    def __exit__(self, *_: object) -> None:
        """Wait for no item any more."""
        for _number, _since, result in self._has.values():
            result.cancel()
        self._has.clear()
        self._begun.clear()

    @property
    def size(self) -> int:
        """Return the number of worker processes."""
        return max(1, len(self.session.usable))

    @property
    def _idle(self) -> list[Worker]:
        return [worker for worker in self.session.usable if worker not in self._has]

    @property
    def free(self) -> int:
        """Return how many items can be begun."""
        return len(self._idle)

    def begin(self, number: int, item: Any) -> None:
        """Give an item to a worker without one."""
        worker = self._idle[0]
        if worker not in self._begun:
            self._begun[worker] = self.session.task(worker.address, begin, self._work, str(Path.cwd()), self._limit)
        assert worker.described is not None, "it is usable"
        content = pickle.dumps(item, pickle.HIGHEST_PROTOCOL)
        task = self.session.task(worker.address, do, self._begun[worker], worker.described.process, content)
        self._has[worker] = number, monotonic(), self.session.result(task)

    def ended(self, *, wait_for_one: bool) -> list[tuple[int, Outcome]]:
        """Return outcomes of items; raises WorkerError if the scheduler or all workers have ended."""
        results = [result for _, _, result in self._has.values()]
        if results:
            wait(results, _LOOK if wait_for_one else 0.0, FIRST_COMPLETED)
        elif wait_for_one:
            sleep(_LOOK)
        found = [item for worker, has in list(self._has.items()) if has[2].done() for item in self._outcome(worker)]
        if monotonic() - self._looked > _LOOK:
            found += self._look()
            self._looked = monotonic()
        return found

    def _outcome(self, worker: Worker) -> list[tuple[int, Outcome]]:
        number, _, result = self._has[worker]
        try:
            content = result.result()
        except (CancelledError, asyncio.CancelledError, CdtoolError) as fault:
            raise self.session.lost() from fault
        except Exception as fault:
            if self.session.client.status != "running":
                raise self.session.lost(fault) from fault
            del self._has[worker]
            return [(number, Raised(fault))]
        if content is None:
            self.session.forget(worker)
            return self._dropped(worker)
        del self._has[worker]
        return [(number, pickle.loads(content))]

    def _look(self) -> list[tuple[int, Outcome]]:
        """Notice workers that have come or gone, and end those that do nothing."""
        now = monotonic()
        found = [item for worker in self.session.look() for item in self._dropped(worker)]
        for worker, (_, since, _) in list(self._has.items()):
            reason = ""
            if self._limit is not None and now - since > self._limit + _SILENT:
                reason = limit_words(self._limit)
            elif now - worker.worked > _SILENT:
                reason = _MEMORY_WORDS
            if reason:
                self.session.restart(worker)
                found += self._dropped(worker, reason)
        if self.session.usable:
            self._last_worker = now
        elif now - self._last_worker > _WITHOUT_WORKERS:
            raise self.session.without_workers()
        return found

    def _dropped(self, worker: Worker, reason: str = "") -> list[tuple[int, Outcome]]:
        """Forget a worker that has ended, and return the outcome of its item."""
        self._begun.pop(worker, None)
        if worker not in self._has:
            return []
        number, since, result = self._has.pop(worker)
        result.cancel()
        return [(number, Failed(reason or self._reason(worker, monotonic() - since)))]

    def _reason(self, worker: Worker, seconds: float) -> str:
        """Return why a worker process has ended, as far as its scheduler or its nanny reports it."""
        until, code = monotonic() + _REASON_WITHIN, None
        while (code := self.session.exit_status(worker)) is None and worker.nanny and monotonic() < until:
            sleep(0.1)
        if worker.address in self.session.over_memory:
            return _MEMORY_WORDS
        if self._limit is not None and code in (None, 1) and seconds >= self._limit:
            return limit_words(self._limit)
        return "its worker process ended" if code is None else ended_words(code)
