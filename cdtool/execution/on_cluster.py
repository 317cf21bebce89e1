"""What runs in a worker process of a cluster: one item at a time, each within its time limit.

The process may have several threads and serve other programs. Reading and judging a log hold the interpreter lock, and
an item may end the process: with one item at a time it is known which one.
"""

from __future__ import annotations

import os
import pickle
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from uuid import uuid4

from cdtool.execution.environment import environment
from cdtool.execution.in_worker import (
    Failed,
    ended_words,
    exit_code,
    keep_freed_memory,
    limit_words,
    sendable,
    time_limit,
)

# After the time limit, the process has this long to return that it is exceeded [s]; one that does not is ended.
GRACE = 3.0
# The process: its number may be that of an earlier one.
_PROCESS = uuid4().hex
_one_at_a_time = threading.Lock()


@dataclass(frozen=True)
class Described:
    """A worker process: its own name, its number, what determines outcomes in it, and files that are not as stated."""

    process: str
    number: int
    versions: Mapping[str, str]
    unseen: tuple[str, ...] = ()


@dataclass(frozen=True)
class Sight:
    """A file as this process sees it: its path and size [bytes]; a folder has no size."""

    path: str
    size: int | None

    @classmethod
    def of(cls, path: Path) -> Sight:
        """Return a file or folder as it is; raises OSError."""
        return cls(str(path.absolute()), path.stat().st_size if path.is_file() else None)

    @property
    def is_same(self) -> bool:
        """Whether it is seen so in this process."""
        path = Path(self.path)
        try:
            return path.is_dir() if self.size is None else path.stat().st_size == self.size
        except OSError:
            return False


def describe(sights: bytes) -> Described:
    """Return what this process is, and which of the pickled `sights` it does not have."""
    unseen = tuple(item.path for item in pickle.loads(sights) if not item.is_same)
    return Described(_PROCESS, os.getpid(), dict(environment()), unseen)


@dataclass(frozen=True)
class Begun:
    """The work for any number of items, the folder that relative paths are in, and the time limit [s]."""

    work: Callable[[Any], Any]
    folder: str
    limit: float | None


def begin(work: bytes, folder: str, limit: float | None) -> Begun:
    """Return the work, unpickled once per process: Dask keeps it there as long as the run lasts."""
    keep_freed_memory()
    return Begun(pickle.loads(work), folder, limit)


@dataclass(frozen=True)
class Done:
    """The results of a batch. `is_other`: another process has the address now, and nothing was done.

    `is_stuck`: the last item continues beyond its time limit, and those after it have not begun.
    """

    results: tuple[Any, ...] = ()
    is_other: bool = False
    is_stuck: bool = False


def do(begun: Begun, process: str, batch: bytes) -> bytes:
    """Return what was done of pickled items, as a pickled `Done`."""
    if process != _PROCESS:
        return pickle.dumps(Done(is_other=True))
    with _one_at_a_time, _in_folder(begun.folder):
        return pickle.dumps(_done(begun, pickle.loads(batch)), pickle.HIGHEST_PROTOCOL)


def _done(begun: Begun, batch: Sequence[Any]) -> Done:
    results: list[Any] = []
    for item in batch:
        with time_limit(None if begun.limit is None else begun.limit + GRACE):
            result = _result(begun.work, item) if begun.limit is None else _in_time(begun.work, item, begun.limit)
        if result is None:
            assert begun.limit is not None, "an item in time has a result"
            return Done((*results, Failed(limit_words(begun.limit))), is_stuck=True)
        results.append(result[0])
    return Done(tuple(results))


def _result(work: Callable[[Any], Any], item: Any) -> tuple[Any]:
    try:
        return (work(item),)
    except MemoryError:
        return (Failed("not enough memory"),)
    except SystemExit as end:
        return (Failed(ended_words(exit_code(end))),)
    except (KeyboardInterrupt, GeneratorExit) as fault:
        return (Failed(f"it was ended by {type(fault).__name__}"),)
    except Exception as fault:
        raise sendable(fault) from None


def _in_time(work: Callable[[Any], Any], item: Any, limit: float) -> tuple[Any] | None:
    """Return the result of an item; None if it takes longer than the limit, and then it continues."""
    found: list[Any] = []

    def run() -> None:
        try:
            found.append(_result(work, item))
        except BaseException as fault:
            found.append(fault)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(limit)
    if not found:
        return None
    if isinstance(found[0], BaseException):
        raise found[0]
    result: tuple[Any] = found[0]
    return result


def leave() -> None:
    """End this process: an item in it is beyond its time limit. Its nanny starts another one."""
    os._exit(1)


@contextmanager
def _in_folder(folder: str) -> Any:
    """Work in a folder, in which the relative paths of items are."""
    before = Path.cwd()
    if str(before) == folder:
        yield
        return
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
