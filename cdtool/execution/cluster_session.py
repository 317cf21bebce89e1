"""The connection to a Dask cluster, or to one that is started here, for the time of a block.

Only worker processes with the same versions that see the same files are used. Dask prints nothing meanwhile: what it
would log is reported as an error or as the reason why an item is left out.
"""

from __future__ import annotations

import asyncio
import logging
import pickle
import re
import socket
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import active_children, resource_tracker
from pathlib import Path
from time import monotonic, sleep
from typing import Any
from urllib.parse import urlsplit

from cdtool.base.errors import UsageError, WorkerError, installing
from cdtool.base.plain_text import one_line, shorten
from cdtool.execution.environment import difference, environment
from cdtool.execution.on_cluster import Described, Sight, describe
from cdtool.execution.starting import without_interruption

LOCAL = "local"
_ADDRESS = re.compile(r"(tcp|tls|ws|wss)://[^\s/@?#]+:\d+")
# Time to connect, until the first worker joins, and until workers that are there have described themselves [s].
_CONNECTED_WITHIN, _JOINED_WITHIN, _DESCRIBED_WITHIN = 8.0, 30.0, 15.0
# A scheduler that has not answered for so long has ended [s].
_ANSWERED_WITHIN = 30.0
_SAME = "use the same environment on all machines"
_LOGGERS = ("distributed", "dask", "tornado", "asyncio", "bokeh")
_SETTINGS = {
    "distributed.comm.timeouts.connect": f"{_CONNECTED_WITHIN}s",
    "distributed.comm.retry.count": 0,
    "distributed.admin.large-graph-warning-threshold": "100GB",
}


@dataclass(eq=False)
class Worker:
    """A worker process, by its address, the address of its nanny if any, and what it says that it is.

    It was last not paused at the time `worked` [s]: with little free memory it pauses, and begins nothing.
    """

    address: str
    nanny: str | None
    describing: Future[Described | None]
    worked: float = 0.0
    described: Described | None = None


def checked_address(cluster: str) -> None:
    """Raise UsageError for what is not the address of a scheduler; it is not repeated, as it may hold a password."""
    if cluster != LOCAL and not _ADDRESS.fullmatch(cluster):
        raise UsageError(
            "--cluster is no address of a scheduler", "give one as tcp://host:8786 without user and path, or local"
        )


class Session:
    """A client of a cluster, and its workers by address."""

    def __init__(self, client: Any, words: str, sights: Sequence[Sight]) -> None:
        self.client, self.words = client, words
        self.workers: dict[str, Worker] = {}
        # Addresses of workers that were ended because of their memory.
        self.over_memory: set[str] = set()
        self._refused: dict[Worker, WorkerError] = {}
        self._sights = pickle.dumps(tuple(sights))
        client.subscribe_topic("worker-restart-memory", lambda event: self.over_memory.add(event[1]["worker"]))

    @property
    def usable(self) -> list[Worker]:
        """Return the workers that may be used."""
        return [worker for worker in self.workers.values() if worker.described is not None]

    def look(self) -> list[Worker]:
        """Notice workers that have come, and return those that have gone; raises WorkerError without the scheduler."""
        if self.client.status != "running":
            raise self.lost()
        known = self._asked(self.client.scheduler.identity, n_workers=-1)["workers"]
        gone = [worker for address, worker in self.workers.items() if address not in known]
        for worker in gone:
            self.forget(worker)
        for address, state in known.items():
            if address not in self.workers:
                task = self.task(address, describe, self._sights)
                self.workers[address] = Worker(address, state.get("nanny"), self.result(task), monotonic())
            if state["status"] != "paused":
                self.workers[address].worked = monotonic()
        for worker in list(self.workers.values()):
            if worker.described is None and worker not in self._refused and worker.describing.done():
                self._accept(worker)
        return gone

    def _asked(self, question: Callable[..., Any], **arguments: Any) -> Any:
        """Return the answer of the scheduler; raises WorkerError without an answer."""
        try:
            return self.client.sync(question, callback_timeout=_ANSWERED_WITHIN, **arguments)
        except Exception as fault:
            raise self.lost(fault) from fault

    def _accept(self, worker: Worker) -> None:
        """Use a worker that has described itself, unless it is another one or sees other files."""
        hint = _SAME
        try:
            described = worker.describing.result()
        except Exception as fault:
            words = f"cdtool cannot be used there: {shorten(one_line(f'{type(fault).__name__}: {fault}'), 120)}"
        else:
            if described is None:  # it has ended; if it is still there, it is asked again
                self.forget(worker)
                return
            words = difference(environment(), described.versions)
            if not words and described.unseen:
                words, hint = f"{described.unseen[0]} is not the same there", "mount the folder at the same path there"
        if not words:
            worker.described = described
            return
        self._refused[worker] = WorkerError(f"--cluster {self.words}: worker {worker.address}: {words}", hint)
        if self.usable:
            warnings.warn(f"worker {worker.address} is not used: {words}", UserWarning, stacklevel=2)

    def wait_for_workers(self) -> None:
        """Wait until workers can be used; raises WorkerError if there is no worker, or if one must not be used."""
        begin = described = monotonic()
        while not self.workers or len(self.usable) < len(self.workers):
            now = monotonic()
            if self.usable and now - described > _DESCRIBED_WITHIN:
                return
            if not self.workers and now - begin > _JOINED_WITHIN:
                raise self.without_workers()
            described = described if self.workers else now
            self.look()
            for fault in self._refused.values():
                raise fault
            sleep(0.05)

    def task(self, address: str, work: Callable[..., Any], *arguments: Any) -> Any:
        """Return Dask's future of a call on one worker process, and on no other."""
        return self.client.submit(work, *arguments, workers=[address], allow_other_workers=False, pure=False, retries=0)

    def result(self, task: Any) -> Future[Any]:
        """Return the future result of a task; None if its worker has ended, as far as Dask reports it."""

        async def gathered() -> Any:
            if found := await self.client.gather([task], errors="skip", asynchronous=True):
                return found[0]
            fault = await task.exception(asynchronous=True)
            if fault is not None and type(fault).__name__ != "KilledWorker":
                raise fault
            return None

        return asyncio.run_coroutine_threadsafe(gathered(), self.client.loop.asyncio_loop)

    def forget(self, worker: Worker) -> None:
        """Use a worker no more; a process that has its address later is another one."""
        worker.describing.cancel()
        if self.workers.get(worker.address) is worker:
            del self.workers[worker.address]

    def restart(self, worker: Worker) -> None:
        """Let the nanny of a worker that does not respond end it, and start another one."""
        self.forget(worker)
        with suppress(Exception):
            self.client.restart_workers([worker.address], timeout=_ANSWERED_WITHIN, raise_for_error=False)

    def exit_status(self, worker: Worker) -> int | None:
        """Return the exit status of a worker process that has ended, negative for a signal, if its nanny reports it."""
        if worker.nanny is None or worker.described is None:
            return None
        said = re.compile(rf"Worker process {worker.described.number} (was killed by signal|exited with status) (\d+)")
        with suppress(Exception):
            for _, line in self.client.sync(self.client.rpc(worker.nanny).get_logs, callback_timeout=_CONNECTED_WITHIN):
                if found := said.search(line):
                    return -int(found[2]) if "signal" in found[1] else int(found[2])
        return None

    def lost(self, fault: BaseException | None = None) -> WorkerError:
        """Return the error for a scheduler that has ended or does not answer."""
        why = f": {type(fault).__name__}" if fault is not None and not isinstance(fault, OSError | TimeoutError) else ""
        return WorkerError(f"--cluster {self.words}: the scheduler has ended or does not answer{why}", "run it again")

    def without_workers(self) -> WorkerError:
        """Return the error for a cluster without a worker."""
        return WorkerError(f"--cluster {self.words}: no worker", f"start one: dask worker {self.words} --nthreads 1")


_open: dict[tuple[str, int], Session] = {}


@contextmanager
def session_of(cluster: str, jobs: int, inputs: Iterable[Path] = ()) -> Iterator[Session]:
    """Connect to a cluster in the block, or use the connection of an enclosing block.

    `inputs` are files and folders that every worker must see as they are here. Raises UsageError without the package,
    WorkerError if the cluster cannot be used.
    """
    if (known := _open.get((cluster, jobs))) is not None:
        yield known
        return
    try:
        import dask
        import distributed
    except ImportError:
        raise UsageError("--cluster needs the package distributed", installing("cluster")) from None
    sights = [Sight.of(path) for path in dict.fromkeys([Path.cwd(), *inputs]) if path.exists()]
    with ExitStack() as stack:
        stack.enter_context(_silent())
        stack.enter_context(dask.config.set(_SETTINGS))
        connect: Any = distributed.Client
        address: Any = stack.enter_context(_local(jobs)) if cluster == LOCAL else cluster
        try:
            if cluster != LOCAL:
                _refuse_unreachable(cluster)
            client = connect(address, timeout=_CONNECTED_WITHIN, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as fault:
            hint = "check the address, or start one: dask scheduler"
            raise WorkerError(f"--cluster {cluster}: no scheduler answers", hint) from fault
        stack.callback(_closed, client)
        session = Session(client, cluster, sights)
        session.wait_for_workers()
        _open[cluster, jobs] = session
        stack.callback(_open.pop, (cluster, jobs))
        yield session


def _refuse_unreachable(address: str) -> None:
    """Raise OSError if nothing answers at an address: a client of Dask would leave a thread behind."""
    place = urlsplit(address)
    socket.create_connection((place.hostname or "", place.port or 0), _CONNECTED_WITHIN).close()


def _closed(client: Any) -> None:
    with suppress(Exception):
        client.close(timeout=5)


@contextmanager
def _local(jobs: int) -> Iterator[Any]:
    """Start a scheduler and worker processes on this machine, and end them after the block."""
    resource_tracker.ensure_running()  # its start would end the block below for the thread that starts processes
    cluster = None
    try:
        with without_interruption():
            cluster = _started(jobs)
        yield cluster
    finally:
        if cluster is not None:
            with suppress(Exception):
                cluster.close(timeout=10)


def _started(jobs: int, attempts: int = 2) -> Any:
    """Start a scheduler and worker processes; again if one of them ends meanwhile."""
    import distributed

    start: Any = distributed.LocalCluster
    before = set(active_children())
    try:
        return start(
            n_workers=jobs,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address=None,
            # Its other pages have a free port.
            scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
            silence_logs=logging.CRITICAL + 1,
            # Dask calls its function dask_setup.
            preload=["cdtool.execution.starting"],
            death_timeout=_JOINED_WITHIN,
        )
    except (RuntimeError, TimeoutError, AssertionError) as fault:  # the last one by a nanny whose process is stopped
        for process in set(active_children()) - before:
            process.kill()
        if attempts > 1:
            return _started(jobs, attempts - 1)
        raise WorkerError(f"--cluster {LOCAL}: a worker ended while it was started", "run it again") from fault


@contextmanager
def _silent() -> Iterator[None]:
    """Keep Dask's log lines and warnings from the screen in the block."""
    before = []
    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in _LOGGERS]
    for name in {*names, *_LOGGERS}:
        logger = logging.getLogger(name)
        before.append((logger, logger.handlers, logger.propagate))
        logger.handlers = [logging.NullHandler()]
        logger.propagate = "." in name
    try:
        with warnings.catch_warnings():
            for name in _LOGGERS:
                warnings.filterwarnings("ignore", module=name)
            yield
    finally:
        for logger, handlers, propagate in before:
            logger.handlers, logger.propagate = handlers, propagate
