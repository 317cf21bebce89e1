"""What runs in a worker process: the pieces of a batch, one after the other, each within its time limit.

A worker notes which piece it is working on in memory that it shares with the first process, so that a piece that ends
the worker is known.
"""

from __future__ import annotations

import faulthandler
import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic_ns
from typing import Any

import numpy as np

from cdtool.execution.interruption import ignore_interruption

# A worker that another process ends exits with this status.
TOLD_TO_END = 143
# Entries of a claim: the process, the number of the piece counted from 1 (0: none; negative: it is done, and its result
# is being sent or was sent), when it began, and when the process was asked to end (0: not) [ns].
CLAIM = 4
# The arrays of a log are smaller [bytes].
_KEPT = 4 << 20

# What is done with each piece, the claim of this worker, and the time limit [s].
_work: Callable[[Any], Any] | None = None
_claim: Any = None
_limit: float | None = None
_nowhere: Any = None


@dataclass(frozen=True)
class Failed:
    """A piece of work that may succeed when it is repeated, with the reason why it did not."""

    reason: str


def limit_words(seconds: float) -> str:
    """Return the reason of an item that took longer than the time limit."""
    return f"took longer than {seconds:g} s (--timeout)"


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


def begin(work: Callable[[Any], Any], claims: Any, free_claims: Any, limit: float | None) -> None:
    """Prepare a worker: it leaves Ctrl-C to the first process, and ends with it even if that is killed."""
    global _work, _claim, _limit
    _work, _limit = work, limit
    first = CLAIM * free_claims.get()
    _claim = memoryview(claims).cast("B").cast("q")[first : first + CLAIM]
    _claim[0] = os.getpid()
    keep_freed_memory()
    ignore_interruption()
    signal.signal(signal.SIGTERM, _end)
    sys.unraisablehook = _end_from_callback
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end(*_: object) -> None:
    _claim[3] = monotonic_ns()
    if _claim[1] <= 0:  # waiting for work, in code that would print where it was interrupted
        os._exit(TOLD_TO_END)
    raise SystemExit(TOLD_TO_END)  # temporary files of the piece are removed


def _end_from_callback(unraisable: sys.UnraisableHookArgs) -> None:
    """End a worker that gets the signal in a callback from C, as while LLVM compiles: no exception passes C code."""
    if unraisable.exc_type is SystemExit:
        os._exit(TOLD_TO_END)
    sys.__unraisablehook__(unraisable)


def _end_with_parent() -> None:
    from multiprocessing import parent_process

    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(TOLD_TO_END)


def do(batch: Sequence[tuple[int, Any]]) -> list[Any]:
    """Return the result of each of the numbered pieces, or `Failed`."""
    assert _work is not None
    try:
        return [_done(_work, number, item) for number, item in batch]
    except SystemExit as end:  # temporary files are removed by now
        os._exit(exit_code(end))
    except Exception as fault:
        raise sendable(fault) from None


def exit_code(end: SystemExit) -> int:
    """Return the exit status of a process that ends so."""
    return end.code if isinstance(end.code, int) else int(end.code is not None)


def sendable(fault: Exception) -> Exception:
    """Return an error that arrives in another process: itself, or its words if it cannot be copied."""
    try:
        pickle.loads(pickle.dumps(fault))
    except Exception:
        return RuntimeError(f"{type(fault).__name__}: {fault}")
    return fault


def _done(work: Callable[[Any], Any], number: int, item: Any) -> Any:
    _claim[2] = monotonic_ns()
    _claim[1] = number + 1
    try:
        with time_limit(_limit):
            result = work(item)
    except MemoryError:
        result = Failed("not enough memory")
    except (KeyboardInterrupt, GeneratorExit) as fault:  # raised by the piece: Ctrl-C is ignored here
        result = Failed(f"it was ended by {type(fault).__name__}")
    except Exception:
        _claim[1] = -_claim[1]
        raise
    _claim[1] = -_claim[1]
    return result


@contextmanager
def time_limit(seconds: float | None) -> Iterator[None]:
    """End this process if the block takes longer, also if it does not return to Python; None: no limit."""
    global _nowhere
    if seconds is None:
        yield
        return
    if _nowhere is None:
        _nowhere = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115  open until the process ends
    faulthandler.dump_traceback_later(seconds, exit=True, file=_nowhere)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()
