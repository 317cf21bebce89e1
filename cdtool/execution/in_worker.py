"""What runs in a worker process: one item at a time; its outcome is the result, or why there is no result."""

from __future__ import annotations

import os
import pickle
import shutil
import signal
import socket
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cdtool.execution.starting import ignore_interruption

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

# The arrays of a log are smaller [bytes].
_KEPT = 4 << 20
# Bytes before each message that state its length.
HEADER = 8


@dataclass(frozen=True)
class Done:
    """The result of an item."""

    value: Any


@dataclass(frozen=True)
class Failed:
    """An item that may succeed when it is repeated, with the reason why it did not."""

    reason: str


@dataclass(frozen=True)
class Raised:
    """The error that the work on an item raised: it ends all work."""

    fault: Exception


@dataclass(frozen=True)
class NotBegun:
    """An item whose worker ended before it began."""


Outcome = Done | Failed | Raised | NotBegun


def limit_words(seconds: float) -> str:
    """Return the reason of an item that took longer than the time limit."""
    return f"took longer than {seconds:g} s (execution.timeout_s)"


def ended_words(code: int) -> str:
    """Return the reason of an item whose worker process ended, by its exit status; negative: by a signal."""
    if code >= 0:
        return f"its worker process ended with exit status {code}"
    with suppress(ValueError):
        name = signal.Signals(-code).name
        if name == "SIGKILL":
            return "its worker process was killed (SIGKILL): mostly because the memory was not enough"
        return f"its worker process crashed ({name})"
    return f"its worker process ended by signal {-code}"


def keep_freed_memory() -> None:
    """Let the C library keep the memory of one item for the next.

    glibc returns freed blocks of more than 128 KiB to the system, so that each item pays for their pages again: 430
    page faults for 7 s of a gate, 5 % of the CPU time. The limit rises to the size of a larger block that is freed.
    """
    np.empty(_KEPT, np.uint8)


def attempt(work: Callable[[Any], Any], item: Any) -> Outcome:
    """Return the outcome of an item."""
    try:
        return Done(work(item))
    except MemoryError:
        return Failed("not enough memory")
    except SystemExit as end:
        return Failed(ended_words(end.code if isinstance(end.code, int) else int(end.code is not None)))
    except (KeyboardInterrupt, GeneratorExit) as fault:  # raised by the work: Ctrl-C is ignored in a worker
        return Failed(f"it was ended by {type(fault).__name__}")
    except Exception as fault:
        return Raised(fault)


def sendable(outcome: Outcome) -> bytes:
    """Return an outcome as bytes; an error that cannot be copied to another process is replaced by its words."""
    try:
        content = pickle.dumps(outcome, pickle.HIGHEST_PROTOCOL)
        if isinstance(outcome, Raised):
            pickle.loads(content)
        return content
    except Exception as fault:
        fault = outcome.fault if isinstance(outcome, Raised) else fault
        return pickle.dumps(Raised(RuntimeError(f"{type(fault).__name__}: {fault}")))


def serve(
    pipe: socket.socket, work: Callable[[Any], Any], folder: str, first: Connection, inherited: Connection | None
) -> None:
    """Do the work on each item that comes through the pipe; end with the first process, even if that is killed.

    Temporary files are made in `folder`, which the first process removes. `first` is closed at its other end when the
    first process ends; a forked worker has inherited that end, too.
    """
    if inherited is not None:
        inherited.close()
    ignore_interruption()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with, args=(first, folder), daemon=True).start()
    tempfile.tempdir = folder
    keep_freed_memory()
    items = pipe.makefile("rb")
    _send(pipe, b"")
    with suppress(EOFError, ConnectionError):
        while True:
            outcome = attempt(work, pickle.load(items))
            _send(pipe, sendable(outcome))


def _send(pipe: socket.socket, content: bytes) -> None:
    pipe.sendall(len(content).to_bytes(HEADER) + content)


def _end_with(first: Connection, folder: str) -> None:
    """End with the first process, and remove the folder for temporary files."""
    with suppress(EOFError, OSError):
        first.recv_bytes()
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(1)
