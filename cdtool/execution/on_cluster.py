"""What runs in a worker process of a cluster: one item at a time, which ends the process if it takes too long."""

from __future__ import annotations

import faulthandler
import os
import pickle
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from uuid import uuid4

from cdtool.base.remote.remote_path import location
from cdtool.execution.environment import environment
from cdtool.execution.in_worker import attempt, keep_freed_memory, sendable

# The process: its address and its number may be those of an earlier one.
_PROCESS = uuid4().hex
# The process may have several threads and serve other programs.
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
        path = location(self.path)
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


def do(begun: Begun, process: str, item: bytes) -> bytes | None:
    """Return the outcome of a pickled item, pickled; None if another process has the address now."""
    if process != _PROCESS:
        return None
    with _one_at_a_time, _in_folder(begun.folder), _time_limit(begun.limit):
        outcome = attempt(begun.work, pickle.loads(item))
    return sendable(outcome)


@contextmanager
def _in_folder(folder: str) -> Iterator[None]:
    """Work in a folder, in which the relative paths of items are."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


@contextmanager
def _time_limit(seconds: float | None) -> Iterator[None]:
    """End this process if the block takes longer, also if it does not return to Python; None: no limit."""
    if seconds is None:
        yield
        return
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
        faulthandler.dump_traceback_later(seconds, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()
