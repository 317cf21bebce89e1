"""What a store contains, and the removal of what was not used for a long time."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from cdtool.base.errors import UsageError
from cdtool.base.remote.remote_path import location
from cdtool.execution.store.store import KINDS, Kind, Store

_DAY = 86_400.0


@dataclass(frozen=True)
class StoreStatus:
    """The number of entries of a store by kind, and the size of all [bytes]."""

    folder: Path
    entries: Mapping[str, int]
    bytes: int


@dataclass(frozen=True)
class Collected:
    """How many entries of a store were kept and removed, and their size before and after [bytes]."""

    kept: int
    removed: int
    bytes_before: int
    bytes_after: int


def store_status(folder: str | Path) -> StoreStatus:
    """Return what a store contains; raises ConfigurationError if the folder is not a store."""
    store = Store(location(folder), writes=False)
    store.check()
    sizes = {kind: [state.st_size for _, state in _states(store, kind)] for kind in KINDS}
    return StoreStatus(store.folder, {kind: len(each) for kind, each in sizes.items()}, sum(map(sum, sizes.values())))


def collect_garbage(folder: str | Path, *, older_than_days: float = 30.0) -> Collected:
    """Remove entries that no run has used for a time; other processes may use the store meanwhile.

    Parameters
    ----------
    folder : str or Path
        The store.
    older_than_days : float, optional
        Time since the last use above which an entry is removed [days]. A use is noted once a day, at a URL never: there
        it is the time since the entry was written.

    Returns
    -------
    Collected
        What was kept and removed.

    Raises
    ------
    ConfigurationError
        The folder is not a store.
    UsageError
        The number of days is negative.
    """
    if older_than_days < 0.0:
        raise UsageError("a number of days is negative", "give 0 or more")
    store = Store(location(folder))
    store.check()
    oldest = time.time() - _DAY * older_than_days
    kept = removed = before = after = 0
    for path, state in [found for kind in KINDS for found in _states(store, kind)]:
        before += state.st_size
        # One that is not complete may be under way.
        if state.st_mtime < (min(oldest, time.time() - _DAY) if path.name.startswith(".") else oldest):
            path.unlink(missing_ok=True)
            removed += 1
        else:
            kept, after = kept + 1, after + state.st_size
    return Collected(kept, removed, before, after)


def _states(store: Store, kind: Kind) -> Iterator[tuple[Path, os.stat_result]]:
    """Yield the files of a kind with their states; another process may remove or complete one meanwhile."""
    for path in store.files(kind):
        with suppress(FileNotFoundError):
            yield path, path.stat()
