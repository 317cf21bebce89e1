"""The local copies of files at URLs: made when they are first opened, few bytes at a time, removed after use.

Conventions: one folder per command below the folder for temporary files, and one in it for each process. The copies of
a process have at most CDTOOL_CACHE_MIB in all (default 4096); the one that was used longest ago is removed first. The
folder is locked while the command lives, and removed when it ends; what a killed command has left is removed by the
next one.
"""

from __future__ import annotations

import atexit
import errno
import os
import re
import shutil
import tempfile
import threading
import time
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from cdtool.base.remote import storage, transferred
from cdtool.base.remote.storage import ObjectInfo
from cdtool.base.remote.storage_error import StorageError

BOUND = "CDTOOL_CACHE_MIB"
_BOUND_MIB = 4096
_MIB = 1 << 20
# The folder of the first process, for those that it starts.
_FOLDER = "CDTOOL_REMOTE_FOLDER"
_PREFIX, _LOCK = "cdtool-remote-", "lock"
# An answer of the storage is asked for again after this time [s].
_TRUSTED = 2.0
_MOST_ANSWERS = 10_000


@dataclass
class _Copy:
    """The local copy of one version of a file."""

    path: Path
    info: ObjectInfo


class _Session:
    """The folder of this process, its copies and the last answers about URLs."""

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.folder: Path | None = None
        self.root: Path | None = None
        self.owned: IO[bytes] | None = None
        self.copies: OrderedDict[str, _Copy] = OrderedDict()
        self.answers: dict[str, tuple[float, ObjectInfo | None]] = {}
        self.number = self.users = 0

    def own_folder(self) -> Path:
        """Return the folder of this process; make it at the first call."""
        with self.lock:
            return self._made_folder()

    def _made_folder(self) -> Path:
        if self.folder is None:
            given = os.environ.get(_FOLDER)
            if given and Path(given).is_dir():
                self.root = Path(given)
            else:
                self.root = Path(tempfile.mkdtemp(prefix=_PREFIX))
                self.owned = _locked(self.root)
                os.environ[_FOLDER] = str(self.root)
                _remove_left_behind(self.root)
            self.folder = self.root / str(os.getpid())
            self.folder.mkdir(exist_ok=True)
        return self.folder

    def end(self) -> None:
        """Remove the folder, and with it those of the workers if this is the first process."""
        if self.owned is not None and self.root is not None:
            os.environ.pop(_FOLDER, None)
            _remove(self.root, self.owned)
        elif self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)


_session = _Session()


def known_info(url: str) -> ObjectInfo | None:
    """Return what is at a URL, or was some seconds ago; None for nothing. Raises StorageError."""
    with _session.lock:
        at, answer = _session.answers.get(url, (-_TRUSTED, None))
        if time.monotonic() - at < _TRUSTED:
            return answer
    try:
        return current_info(url)
    except FileNotFoundError:
        return None


def current_info(url: str) -> ObjectInfo:
    """Return what is at a URL now; raises MissingObjectError, StorageError."""
    _session.own_folder()  # workers that are started later find it
    try:
        found = storage.info(url)
    except FileNotFoundError:
        _note_answer(url, None)
        raise
    _note_answer(url, found)
    return found


def _note_answer(url: str, found: ObjectInfo | None) -> None:
    """Keep an answer of the storage for some seconds."""
    with _session.lock:
        if len(_session.answers) >= _MOST_ANSWERS:
            _session.answers.clear()
        _session.answers[url] = (time.monotonic(), found)


def forget(url: str) -> None:
    """Forget the copy of a file and what is known of it: it was written."""
    with _session.lock:
        _drop(url)
        _session.answers.pop(url, None)


def staged(url: str) -> Path:
    """Return the local copy of the file at a URL, of its current version; raises StorageError, MissingObjectError."""
    with _session.lock:
        found = known_info(url)
        if found is None:
            found = current_info(url)
        if found.is_folder:
            raise StorageError(url, "is a folder", "give a file in it", errno.EISDIR)
        copy = _session.copies.get(url)
        if copy is not None and copy.info == found and copy.path.exists():
            _session.copies.move_to_end(url)
            return copy.path
        return _fetched(url, found)


def is_staged(url: str) -> bool:
    """Return whether a file has a local copy."""
    return url in _session.copies


@contextmanager
def copies_in_use() -> Iterator[None]:
    """Remove all copies after the block, unless another thread is in such a block, too."""
    with _session.lock:
        _session.users += 1
    try:
        yield
    finally:
        with _session.lock:
            _session.users -= 1
            if not _session.users:
                release()


def release() -> None:
    """Remove all copies of this process, which their user no longer needs; a worker notes how much it has read."""
    with _session.lock:
        for url in list(_session.copies):
            _drop(url)
        _session.answers.clear()
        if _session.folder is not None and _session.root is not None and _session.owned is None:
            transferred.note(_session.root, _session.folder.name)


def amount_read() -> tuple[int, int]:
    """Return the bytes that this process and its workers have read from URLs, and in how many requests."""
    return transferred.altogether(_session.root)


def bound() -> int:
    """Return the most bytes of the copies of one process."""
    try:
        mib = float(os.environ.get(BOUND, ""))
    except ValueError:
        mib = _BOUND_MIB
    return int((mib if mib > 0.0 else _BOUND_MIB) * _MIB)


def _fetched(url: str, found: ObjectInfo) -> Path:
    """Copy the file at a URL; a file that changes meanwhile is copied once more."""
    for _ in range(2):
        _drop(url)
        _make_room(url, found.size)
        _session.number += 1
        suffix = re.sub(r"[^A-Za-z0-9.]", "_", Path(url.rpartition("/")[2]).suffix[:16])  # as any system allows it
        target = _session.own_folder() / f"{_session.number}{suffix}"
        copy = _session.copies[url] = _Copy(target, found)
        try:
            storage.fetch(url, target)
            after = current_info(url)
        except BaseException:
            _drop(url)
            raise
        if after == found and target.stat().st_size == found.size:
            return copy.path
        found = after
    _drop(url)
    raise StorageError(url, "changed while it was read", "wait until it is complete", errno.EBUSY)


def _make_room(url: str, size: int) -> None:
    most = bound()
    if size > most:
        raise StorageError(
            url,
            f"has {size / _MIB:.0f} MiB; the cache for local copies has {most / _MIB:.0f}",
            f"set {BOUND} to a larger number",
            errno.EFBIG,
        )
    while _session.copies and size + sum(copy.info.size for copy in _session.copies.values()) > most:
        _drop(next(iter(_session.copies)))


def _drop(url: str) -> None:
    copy = _session.copies.pop(url, None)
    if copy is not None:
        with suppress(OSError):
            copy.path.unlink(missing_ok=True)


def _locked(folder: Path) -> IO[bytes]:
    """Return the open lock file of a folder."""
    from cdtool.base.files.locks import lock_handle

    file = (folder / _LOCK).open("xb")
    lock_handle(file.fileno())
    return file


def _remove_left_behind(own: Path) -> None:
    """Remove the folders of commands that were killed: those whose lock is free."""
    from cdtool.base.files.locks import lock_handle

    for folder in own.parent.glob(f"{_PREFIX}*"):
        if folder == own:
            continue
        with suppress(OSError), (folder / _LOCK).open("r+b") as file:
            if lock_handle(file.fileno()):
                _remove(folder, file)


def _remove(folder: Path, lock: IO[bytes]) -> None:
    """Remove a folder while it is locked; on Windows its lock file, and with it the folder, after that is closed."""
    shutil.rmtree(folder, ignore_errors=True)
    lock.close()
    if folder.exists():
        shutil.rmtree(folder, ignore_errors=True)


def _end() -> None:
    _session.end()


def _begin_in_child() -> None:
    """A forked worker has copies of its own."""
    global _session
    if _session.owned is not None:
        _session.owned.close()  # the lock ends with the first process, not with the last worker
    _session = _Session()
    transferred.forget()


atexit.register(_end)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_begin_in_child)
