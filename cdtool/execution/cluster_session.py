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
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from pathlib import Path
from time import monotonic, sleep
from typing import Any
from urllib.parse import urlsplit

from cdtool.base.errors import CdtoolError, UsageError, WorkerError, installing
from cdtool.base.plain_text import one_line, shorten
from cdtool.execution.environment import difference, environment
from cdtool.execution.interruption import without_interruption
from cdtool.execution.on_cluster import Described, Sight, describe

LOCAL = "local"
_ADDRESS = re.compile(r"(tcp|tls|ws|wss)://[^\s/@?#]+:\d+")
# Time to connect, until the first worker joins, and until workers that are there have described themselves [s].
_CONNECTED_WITHIN, _JOINED_WITHIN, _DESCRIBED_WITHIN = 8.0, 30.0, 15.0
# A scheduler that has not answered for so long has ended [s].
_ANSWERED_WITHIN = 30.0
_LOGGERS = ("distributed", "dask", "tornado", "asyncio", "bokeh")
_SETTINGS = {
    "distributed.comm.timeouts.connect": f"{_CONNECTED_WITHIN}s",
    "distributed.comm.retry.count": 0,
    "distributed.admin.large-graph-warning-threshold": "100GB",
}


@dataclass(frozen=True)
class Worker:
    """A worker process that is used: its address, its own name and number, and the address of its nanny if any."""

    address: str
    process: str
    number: int
    nanny: str | None


def checked_address(cluster: str) -> None:
    """Raise UsageError for what is not the address of a scheduler; it is not repeated, as it may hold a password."""
    if cluster != LOCAL and not _ADDRESS.fullmatch(cluster):
        raise UsageError(
            "--cluster is no address of a scheduler", "give one as tcp://host:8786 without user and path, or local"
        )


class NoResultError(Exception):
    """A worker process ended before the result of a task."""


class Session:
    """A client of a cluster, and those of its workers that are used, by address."""

    def __init__(self, client: Any, words: str, sights: Sequence[Sight]) -> None:
        self.client = client
        self.words = words
        self.loop: asyncio.AbstractEventLoop = client.loop.asyncio_loop
        self.workers: dict[str, Worker] = {}
        # Addresses of workers that were ended because of their memory.
        self.over_memory: set[str] = set()
        self._sights = pickle.dumps(tuple(sights))
        self._described: dict[str, asyncio.Task[None] | None] = {}
        self._refused: dict[str, CdtoolError] = {}
        client.subscribe_topic("worker-restart-memory", self._note_memory)

    def _note_memory(self, event: tuple[float, Any]) -> None:
        self.over_memory.add(event[1]["worker"])

    async def present(self) -> set[str]:
        """Return the addresses of all workers; those that are new are asked to describe themselves."""
        if self.client.status != "running":
            raise self.lost()
        threads = await asyncio.wait_for(self.client.nthreads(asynchronous=True), _ANSWERED_WITHIN)
        for address in set(self._described) - set(threads):
            self.forget(address)
        for address in threads:
            if address not in self._described:
                self._described[address] = asyncio.get_running_loop().create_task(self._describe(address))
        return set(threads)

    async def _describe(self, address: str) -> None:
        try:
            found: Described = await self.result(self.task(address, describe, self._sights))
            known = await self.client.scheduler.identity(n_workers=-1)
        except asyncio.CancelledError:
            raise
        except (NoResultError, OSError):
            self._described.pop(address, None)  # if it is still there, it is asked again
            return
        except Exception as fault:
            if self.client.status != "running":
                return
            words = shorten(one_line(f"{type(fault).__name__}: {fault}"), 120)
            self._refuse(address, f"cdtool cannot be used there: {words}", "install the same there as here")
            return
        if words := difference(environment(), found.versions):
            self._refuse(address, words, "use the same environment on all machines")
        elif found.unseen:
            self._refuse(address, f"{found.unseen[0]} is not the same there", "mount the folder at the same path there")
        else:
            nanny = known["workers"].get(address, {}).get("nanny")
            self.workers[address] = Worker(address, found.process, found.number, nanny)

    def _refuse(self, address: str, words: str, hint: str) -> None:
        self._refused[address] = WorkerError(f"--cluster {self.words}: worker {address}: {words}", hint)
        if self.workers:
            warnings.warn(f"worker {address} is not used: {words}", UserWarning, stacklevel=2)

    def wait_for_workers(self) -> None:
        """Wait until workers can be used; raises WorkerError if there is no worker, or if one must not be used."""
        begin = monotonic()
        described = begin + _DESCRIBED_WITHIN
        while True:
            try:
                present = asyncio.run_coroutine_threadsafe(self.present(), self.loop).result()
            except CdtoolError:
                raise
            except Exception as fault:
                raise self.lost(fault) from fault
            now = monotonic()
            if self._refused:
                raise next(iter(self._refused.values()))
            if present and (len(self.workers) == len(present) or (self.workers and now > described)):
                return
            if not present:
                described = now + _DESCRIBED_WITHIN
                if now - begin > _JOINED_WITHIN:
                    raise self.without_workers()
            sleep(0.05)

    def task(self, address: str, work: Callable[..., Any], *arguments: Any) -> Any:
        """Return Dask's future of a call on one worker process, and on no other."""
        return self.client.submit(work, *arguments, workers=[address], allow_other_workers=False, pure=False, retries=0)

    async def result(self, task: Any) -> Any:
        """Return the result of a task, or raise its error.

        Raises NoResultError if its worker has ended, WorkerError if the scheduler has.
        """
        try:
            found = await self.client.gather([task], errors="skip", asynchronous=True)
        except OSError as lost:  # of the connection to the scheduler: an error of the task is asked for below
            raise self.lost(lost) from lost
        if found:
            return found[0]
        fault = await task.exception(asynchronous=True)
        if fault is None or type(fault).__name__ == "KilledWorker":
            raise NoResultError
        raise fault

    def forget(self, address: str) -> None:
        """Use a worker no more; a process that has its address later is another one."""
        self.workers.pop(address, None)
        self._refused.pop(address, None)
        describing = self._described.pop(address, None)
        if describing is not None and not describing.done():
            describing.cancel()

    async def last_reports(self) -> dict[str, tuple[float, bool]]:
        """Return when each worker has last reported to its scheduler, by its clock [s], and whether it has paused.

        A worker with little free memory pauses: it begins nothing until it has more.
        """
        known = await asyncio.wait_for(self.client.scheduler.identity(n_workers=-1), _ANSWERED_WITHIN)
        return {address: (item["last_seen"], item["status"] == "paused") for address, item in known["workers"].items()}

    def restart(self, address: str) -> None:
        """Let the nanny of a worker that does not respond end it, and start another one."""

        def end() -> None:
            with suppress(Exception):
                self.client.restart_workers([address], timeout=30, raise_for_error=False)

        threading.Thread(target=end, daemon=True).start()

    def successor(self, worker: Worker) -> str | None:
        """Return the address of the worker process that the nanny of one that has ended has started after it."""
        if worker.nanny is None:
            return None
        return next((item.address for item in list(self.workers.values()) if item.nanny == worker.nanny), None)

    def exit_status(self, worker: Worker, successor: str) -> int | None:
        """Return the exit status of a worker process that has ended, negative for a signal, if its nanny reports it."""
        try:
            logs = self.client.get_worker_logs(workers=[successor], nanny=True)
        except Exception:
            return None
        said = re.compile(rf"Worker process {worker.number} (was killed by signal|exited with status) (\d+)")
        for _, line in (item for lines in logs.values() for item in lines):
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
    import distributed

    start: Any = distributed.LocalCluster
    resource_tracker.ensure_running()  # its start would end the block below for the thread that starts processes
    cluster = None
    try:
        with without_interruption():
            cluster = start(
                n_workers=jobs,
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address=None,
                # Its other pages have a free port.
                scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
                silence_logs=logging.CRITICAL + 1,
                # Dask calls its function dask_setup.
                preload=["cdtool.execution.local_worker"],
            )
        yield cluster
    finally:
        if cluster is not None:
            with suppress(Exception):
                cluster.close(timeout=10)


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
