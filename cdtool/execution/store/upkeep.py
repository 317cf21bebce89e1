"""What a store contains, and the removal of what no recent run has used."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cdtool.base.errors import UsageError
from cdtool.base.remote.remote_path import location
from cdtool.execution.store.entry import Entry
from cdtool.execution.store.finished import finished
from cdtool.execution.store.store import RunRecord, Store, read_columns, read_keys, read_runs, require_store, write_part

_DAY = 86_400.0


@dataclass(frozen=True)
class StoreStatus:
    """The entries of a store by kind, the recordings with rows, those that could not be read, and the finished runs.

    `bytes` is the size of all files; `damaged` are files that cannot be read; `unused` is the number of entries that no
    finished run has used. `runs` has the newest first.
    """

    folder: Path
    entries: Mapping[str, int]
    recordings: int
    failed: int
    bytes: int
    unused: int
    damaged: tuple[str, ...]
    runs: tuple[RunRecord, ...]


@dataclass(frozen=True)
class Collected:
    """How many entries of a store were kept and removed, in how many files, and its size before and after [bytes]."""

    kept: int
    removed: int
    files_before: int
    files_after: int
    bytes_before: int
    bytes_after: int


def store_status(folder: str | Path) -> StoreStatus:
    """Return what a store contains; raises ConfigurationError if the folder is not a store."""
    store = Store(location(folder), writes=False)
    runs = read_runs(store.folder)
    used: set[bytes] = set()
    for path, _ in runs:
        used.update(read_keys(path))
    kinds: Counter[str] = Counter()
    recordings: dict[str, bool] = {}
    unused, damaged = 0, []
    for part in store.parts:
        rows = read_columns(part, ("key", "kind", "recording", "failed"))
        if rows is None:
            damaged.append(part.name)
            continue
        kinds.update(rows["kind"])
        unused += sum(bytes.fromhex(key) not in used for key in rows["key"])
        of_logs = zip(rows["kind"], rows["recording"], rows["failed"], strict=True)
        recordings |= {name: failed for kind, name, failed in of_logs if kind == "log"}
    return StoreStatus(
        store.folder,
        dict(sorted(kinds.items())),
        len(recordings),
        sum(recordings.values()),
        _size(store.folder),
        unused,
        tuple(damaged),
        tuple(run for _, run in runs),
    )


def collect_garbage(folder: str | Path, *, keep_runs: int = 10, older_than_days: float = 7.0) -> Collected:
    """Remove the entries of a store that none of the newest runs used, and write the others to fewer files.

    An entry that no run has used is kept for some days: it may be from a run that is under way or was killed. Other
    processes may use the store at the same time; at worst they compute again what is being moved.

    Parameters
    ----------
    folder : str or Path
        The store.
    keep_runs : int, optional
        Number of runs, the newest, whose entries are kept; the lists of the others are removed, and their results.
    older_than_days : float, optional
        Age of the file above which entries that none of these runs used are removed [days].

    Returns
    -------
    Collected
        What was kept and removed.

    Raises
    ------
    ConfigurationError
        The folder is not a store.
    UsageError
        A number is negative.
    """
    if keep_runs < 0 or older_than_days < 0.0:
        raise UsageError("a number of runs or days is negative", "give 0 or more")
    require_store(location(folder))
    store = Store(location(folder))
    before = _size(store.folder)
    runs = read_runs(store.folder)
    used: set[bytes] = set()
    for path, _ in runs[:keep_runs]:
        used.update(read_keys(path))
    oldest = time.time() - _DAY * older_than_days
    parts = store.parts
    kept, removed, files = _rewrite(store, used, oldest)
    for path in (*(path for path, _ in runs[keep_runs:]), *finished(store.folder)[keep_runs:]):
        path.unlink(missing_ok=True)
    return Collected(kept, removed, len(parts), files, before, _size(store.folder))


def _rewrite(store: Store, used: set[bytes], oldest: float) -> tuple[int, int, int]:
    """Copy the entries that are kept to new files, then remove the old ones; return kept, removed and files.

    A file that is younger than `oldest` [s since 1970] stays, with the time from which its age counts.
    """
    old: list[Path] = []
    seen: set[str] = set()
    kept = removed = files = 0
    for part in store.parts:
        if part.stat().st_mtime < oldest:
            old.append(part)
            continue
        keys = read_keys(part)
        seen.update(keys)
        kept, files = kept + len(keys), files + 1
    waiting: list[Entry] = []
    for part in old:
        for entry in store.entries_of(part) or ():
            key = entry.key
            if key in seen or bytes.fromhex(key) not in used:
                removed += 1
                continue
            seen.add(key)
            waiting.append(entry)
            kept += 1
        if store.is_enough(waiting):
            write_part(store.folder, waiting)
            waiting, files = [], files + 1
    if waiting:
        write_part(store.folder, waiting)
        files += 1
    for part in old:
        part.unlink(missing_ok=True)
    return kept, removed, files


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.glob("**/*") if path.is_file())
