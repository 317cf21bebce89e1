"""Worker processes of this machine, each with a pipe of its own and one item at a time.

So it is known which item a process had when it ended, and when it began; a process that ends is replaced. On Linux they
are forked from this process, so that they share its modules and compiled kernels; elsewhere, and if this process has
several threads, they are new processes of Python.
"""

from __future__ import annotations

import os
import pickle
import socket
import sys
import tempfile
from collections.abc import Callable
from math import inf
from multiprocessing import get_context
from multiprocessing.connection import wait
from time import monotonic
from typing import Any

from cdtool.base.errors import WorkerError
from cdtool.base.files.bounded_loading import MIB
from cdtool.execution.in_worker import HEADER, Failed, NotBegun, Outcome, ended_words, limit_words, serve
from cdtool.execution.starting import shares_memory, without_interruption

# Windows waits for no more processes at a time.
_MOST_PROCESSES = 61 if os.name == "nt" else sys.maxsize
# So many times in a row processes may end before they are ready for work.
_MOST_RESTARTS = 3
# A process is ready within this time, if there is a time limit [s].
_READY_WITHIN = 60.0


class _Process:
    """A worker process: whether it is ready for work, the number of its item, and since when it has it."""

    def __init__(self, start: Callable[[socket.socket], Any]) -> None:
        self.pipe, other = socket.socketpair()
        with other:
            self.process = start(other)
        self.number: int | None = None
        self.since = monotonic()
        self.is_ready = False
        self._received = bytearray()

    def send(self, number: int, item: Any) -> None:
        """Give it an item."""
        self.number, self.since = number, monotonic()
        content = pickle.dumps(item, pickle.HIGHEST_PROTOCOL)
        self.pipe.settimeout(None)
        try:
            self.pipe.sendall(content)
        except OSError:  # it has ended, which is noticed when its outcome is waited for
            self.is_ready = False
        self.pipe.setblocking(False)

    def received(self) -> list[bytes]:
        """Return the messages of which all is there; raises EOFError if the process has ended.

        Nothing waits for a process that is ended, or stopped, while it sends.
        """
        try:
            content = self.pipe.recv(MIB)
        except BlockingIOError:
            return []
        except OSError as fault:
            raise EOFError from fault
        if not content:
            raise EOFError
        self._received += content
        messages = []
        while len(self._received) >= HEADER:
            end = HEADER + int.from_bytes(self._received[:HEADER])
            if len(self._received) < end:
                break
            messages.append(bytes(self._received[HEADER:end]))
            del self._received[:end]
        return messages

    def end(self) -> int:
        """End it, and return its exit status."""
        self.process.kill()
        self.process.join()
        self.pipe.close()
        code: int = self.process.exitcode
        return code


class Processes:
    """At most `size` processes for one kind of work; one whose item takes longer than `limit` [s] is ended."""

    def __init__(self, work: Callable[[Any], Any], size: int, limit: float | None) -> None:
        self.size = min(size, _MOST_PROCESSES)
        self._work, self._limit = work, limit
        self._context: Any = get_context("fork" if shares_memory() else "spawn")
        self._processes: list[_Process] = []
        self._restarts = 0

    def __enter__(self) -> Processes:
        """Begin: processes are started when there is an item for them."""
        self._folder = tempfile.TemporaryDirectory(prefix="cdtool-")
        self._first, self._own = self._context.Pipe(duplex=False)
        return self

    def __exit__(self, *_: object) -> None:
        """End all processes, whatever they do, and remove their temporary files."""
        for each in self._processes:
            each.process.kill()
        for each in self._processes:
            each.end()
        self._first.close()
        self._own.close()
        self._folder.cleanup()

    @property
    def free(self) -> int:
        """Return how many items can be begun."""
        return self.size - sum(each.number is not None for each in self._processes)

    def begin(self, number: int, item: Any) -> None:
        """Give an item to a process without one."""
        idle = next((each for each in self._processes if each.number is None), None)
        if idle is None:
            idle = _Process(self._start)
            self._processes.append(idle)
        idle.send(number, item)

    def _start(self, pipe: socket.socket) -> Any:
        inherited = self._own if self._context.get_start_method() == "fork" else None
        arguments = (pipe, self._work, self._folder.name, self._first, inherited)
        process = self._context.Process(target=serve, args=arguments, daemon=True)
        with without_interruption():
            process.start()
        return process

    def ended(self, *, wait_for_one: bool) -> list[tuple[int, Outcome]]:
        """Return the items that are done or whose processes have ended, if there are any or it has waited for one.

        Raises WorkerError if processes end again and again before they are ready for work.
        """
        timeout: float | None = 0.0
        if wait_for_one:
            end = min(map(self._end_of, self._processes), default=inf)
            timeout = None if end == inf else max(0.0, end - monotonic())
        found = []
        for pipe in wait([each.pipe for each in self._processes], timeout):
            each = next(item for item in self._processes if item.pipe is pipe)
            found += self._outcomes(each)
        for each in [item for item in self._processes if monotonic() > self._end_of(item)]:
            assert self._limit is not None, "without a limit, none is too late"
            found += self._removed(each, Failed(limit_words(self._limit)))
        return found

    def _end_of(self, process: _Process) -> float:
        """Return when the item of a process has taken too long [s]."""
        if self._limit is None or process.number is None:
            return inf
        return process.since + (self._limit if process.is_ready else self._limit + _READY_WITHIN)

    def _outcomes(self, process: _Process) -> list[tuple[int, Outcome]]:
        """Return the outcome of the item of a process, if it is there or if the process has ended."""
        try:
            messages = process.received()
        except EOFError:
            return self._removed(process)
        found: list[tuple[int, Outcome]] = []
        for message in messages:
            if message:
                assert process.number is not None, "it had an item"
                found.append((process.number, pickle.loads(message)))
                process.number = None
            else:
                process.is_ready, process.since, self._restarts = True, monotonic(), 0
        return found

    def _removed(self, process: _Process, outcome: Outcome | None = None) -> list[tuple[int, Outcome]]:
        """Remove a process that has ended or is to end, and return the outcome of its item."""
        self._processes.remove(process)
        code = process.end()
        if not process.is_ready:
            self._restarts += 1
            outcome = NotBegun()
        if self._restarts > _MOST_RESTARTS:
            raise WorkerError(
                "worker processes end before they begin their work", "with too little memory, use a smaller --jobs"
            )
        return [] if process.number is None else [(process.number, outcome or Failed(ended_words(code)))]
