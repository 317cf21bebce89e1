"""The local copies of files at URLs: made when they are first opened, of the current version, removed after use.

The copies of a process have at most CDTOOL_CACHE_MIB in all (default 4096); the one that was used longest ago is
removed first. An answer of the storage counts for some seconds.
"""

from __future__ import annotations

import errno
import itertools
import os
import re
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from cdtool.base.remote import session, storage
from cdtool.base.remote.storage import ObjectInfo, StorageError

_BOUND = "CDTOOL_CACHE_MIB"
#: Forty logs of 100 MB.
_BOUND_MIB = 4096
# An answer of the storage is asked for again after this time [s].
_TRUSTED = 2.0
_lock = threading.RLock()
_users = 0  # blocks of `copies_in_use` that run
_numbers = itertools.count()
# By URL; the copy that was used longest ago is the first.
_copies: dict[str, tuple[Path, ObjectInfo]] = {}
_answers: dict[str, tuple[float, ObjectInfo | None]] = {}


def known_info(url: str) -> ObjectInfo | None:
    """Return what is at a URL, or was some seconds ago; None for nothing. Raises StorageError."""
    at, answer = _answers.get(url, (-_TRUSTED, None))
    if time.monotonic() - at < _TRUSTED:
        return answer
    try:
        return current_info(url)
    except FileNotFoundError:
        note(url, None)
        return None


def current_info(url: str) -> ObjectInfo:
    """Return what is at a URL now; raises MissingObjectError, StorageError."""
    found = storage.info(url)
    note(url, found)
    return found


def note(url: str, found: ObjectInfo | None) -> None:
    """Keep an answer of the storage for some seconds."""
    _answers[url] = (time.monotonic(), found)


def forget(url: str) -> None:
    """Forget the copy of a file and what is known of it: it was written."""
    with _lock:
        _answers.pop(url, None)
        if url in _copies:
            with suppress(OSError):
                _copies.pop(url)[0].unlink()


def staged(url: str) -> Path:
    """Return the local copy of the file at a URL, of its current version; raises StorageError, MissingObjectError."""
    with _lock:
        found = known_info(url) or current_info(url)
        if found.is_folder:
            raise StorageError(url, "is a folder", "give a file in it", errno.EISDIR)
        for _ in range(3):  # a file that changes while it is copied is copied again
            if url in _copies:
                path, copied = _copies[url] = _copies.pop(url)  # the last one
                if copied.digest == found.digest and path.exists():
                    return path
                forget(url)
            _copies[url] = _fetched(url, found), found
            found = current_info(url)
        forget(url)
    raise StorageError(url, "changed while it was read", "wait until it is complete", errno.EBUSY)


@contextmanager
def copies_in_use() -> Iterator[None]:
    """Remove all copies after the block, unless another thread is in such a block, too."""
    global _users
    with _lock:
        _users += 1
    try:
        yield
    finally:
        with _lock:
            _users -= 1
            if not _users:
                release()


def release() -> None:
    """Remove all copies of this process, which their user no longer needs."""
    with _lock:
        for url in list(_copies):
            forget(url)
        _answers.clear()


def _fetched(url: str, found: ObjectInfo) -> Path:
    try:
        mib = float(os.environ.get(_BOUND, ""))
    except ValueError:
        mib = _BOUND_MIB
    most = (mib if mib > 0.0 else _BOUND_MIB) * 2**20
    if found.size > most:
        why = f"has {found.size / 2**20:.0f} MiB; the cache for local copies has {most / 2**20:.0f}"
        raise StorageError(url, why, f"set {_BOUND} to a larger number", errno.EFBIG)
    while _copies and found.size + sum(info.size for _, info in _copies.values()) > most:
        forget(next(iter(_copies)))
    suffix = re.sub(r"[^A-Za-z0-9.]", "_", Path(url.rpartition("/")[2]).suffix[:16])  # as any system allows it
    target = session.folder() / f"{os.getpid()}-{next(_numbers)}{suffix}"
    try:
        storage.fetch(url, target)
    except BaseException:
        target.unlink(missing_ok=True)
        raise
    return target


def _begin_in_child() -> None:
    """A forked worker has copies of its own."""
    global _lock, _users
    _lock, _users = threading.RLock(), 0
    _copies.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_begin_in_child)
