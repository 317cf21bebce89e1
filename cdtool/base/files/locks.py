"""One writer per target: a lock that ends with its process, and the removal of files left by killed writers.

Why not the package filelock: on Unix it leaves the lock file in the folder permanently, and on a file system without
flock it uses a lock that outlives its process. Here the file is removed while it is locked, and a process that waited
for it checks that the locked file still has this name. No file of cdtool remains in a folder of logs.
"""

from __future__ import annotations

import errno
import hashlib
import os
import re
import secrets
import shutil
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from cdtool.base.errors import OutputError
from cdtool.base.plain_text import plain

#: Longer than writing any file takes: whoever holds it hangs [s].
LOCK_SECONDS = 60.0
# Windows removes no file that a process has open.
REMOVES_OPEN_FILES = os.name != "nt"
# A lock on Windows is one of bytes, which nobody else can read then: of one behind any content.
_LOCKED_BYTE = 1 << 40
# Two names of one error on Linux, of two on macOS.
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.EINVAL)
_NAME = re.compile(r"\.cdtool-(?P<key>[0-9a-f]{16})(-[0-9a-f]{16}\.(tmp|old)|\.lock)")
# The locks of this process: lock file -> its handle, which is None before the file is open.
_handles: dict[tuple[Path, int], int | None] = {}


def temporary_name(target: Path, folder: Path, suffix: str = ".tmp") -> Path:
    """Return an unused name in `folder` for a file that will become `target`, or with ".old" for what it was before."""
    return folder / f".cdtool-{_key(target)}-{secrets.token_hex(8)}{suffix}"


def is_temporary(name: str) -> bool:
    """Whether a name is that of a temporary file or lock of cdtool."""
    return _NAME.fullmatch(name) is not None


@contextmanager
def holding(target: Path, folder: Path, shown: Path, *, needed: bool = False) -> Iterator[None]:
    """Hold the lock of `target`, whose lock file is in `folder`; a thread that already holds it continues.

    Raises OutputError if another process holds it for a minute, OSError if its file cannot be created. On a file system
    without locks it continues without one, unless it is `needed`.
    """
    lock = folder / f".cdtool-{_key(target)}.lock"
    mine = (lock, threading.get_ident())
    if mine in _handles:
        yield
        return
    try:
        _handles[mine] = None
        if _acquire(mine, shown, needed):
            _remove_left_behind(folder, mine)
        yield
    finally:
        _release(mine)


def release_all() -> None:
    """Release all locks of this process, at its end: an exception can occur between any two steps."""
    for mine in list(_handles):
        _release(mine)


def _key(target: Path) -> str:
    return hashlib.sha256(os.fsencode(target.name)).hexdigest()[:16]


def _acquire(mine: tuple[Path, int], shown: Path, needed: bool) -> bool:
    """Wait for a lock; return False if the file system has no locks."""
    end = time.monotonic() + LOCK_SECONDS
    try:
        while not _try(mine):
            if time.monotonic() > end:
                raise OutputError(
                    f"{plain(shown)}: is being written by another process", "try again after it has ended"
                )
            time.sleep(0.01)
    except OSError as fault:
        if fault.errno not in _NO_LOCKS or needed:
            raise
        mine[0].unlink(missing_ok=True)
        return False
    return True


def _try(mine: tuple[Path, int], *, create: bool = True) -> bool:
    """Take a lock if it is free. Its file is removed with it, so the locked file must still have that name."""
    lock = mine[0]
    flags = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)
    handle = os.open(lock, flags | (os.O_CREAT if create else 0), 0o666)
    try:
        if lock_handle(handle):
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(handle), os.stat(lock, follow_symlinks=False)):  # noqa: PTH116
                    _handles[mine] = handle
                    return True
        return False
    finally:
        if _handles.get(mine) != handle:
            os.close(handle)


def lock_handle(handle: int) -> bool:
    """Take the lock of an open file; return False if another process holds it."""
    try:
        import fcntl
    except ImportError:
        return _lock_on_windows(handle)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as fault:
        if fault.errno in (errno.EWOULDBLOCK, errno.EACCES, errno.EAGAIN):
            return False
        raise
    return True


def remove_locked(path: Path, close: Callable[[], None]) -> None:
    """Remove a file that this process has locked, and close it; raises OSError.

    While it is locked, no other process can hold it. Where an open file cannot be removed, it is closed first: it stays
    if another process has opened it meanwhile, which then removes it.
    """
    if REMOVES_OPEN_FILES:
        try:
            path.unlink(missing_ok=True)
        finally:
            close()
    else:
        close()
        with suppress(PermissionError):
            path.unlink(missing_ok=True)


def _lock_on_windows(handle: int) -> bool:
    import msvcrt

    os.lseek(handle, _LOCKED_BYTE, os.SEEK_SET)
    try:
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined, unused-ignore]
    except OSError:
        return False
    finally:
        os.lseek(handle, 0, os.SEEK_SET)
    return True


def _release(mine: tuple[Path, int]) -> None:
    with suppress(OSError):
        if _handles.get(mine) is None:
            _try(mine, create=False)
    handle = _handles.pop(mine, None)
    if handle is not None:
        with suppress(OSError):
            remove_locked(mine[0], lambda: os.close(handle))


def _remove_left_behind(folder: Path, own: tuple[Path, int]) -> None:
    """Remove temporary files and locks of dead writers: those whose lock is free, and those of the lock held.

    What a file was before is only removed by a writer of that file.
    """
    found: dict[Path, list[Path]] = {}
    for path in folder.iterdir():
        if match := _NAME.fullmatch(path.name):
            found.setdefault(folder / f".cdtool-{match['key']}.lock", []).append(path)
    for lock, paths in found.items():
        if lock == own[0]:
            _remove(path for path in paths if path != lock)
            continue
        other = (lock, -own[1])
        try:
            if _try(other):
                _remove(path for path in paths if path.suffix == ".tmp")
        except OSError:
            continue  # unknown: leave it
        finally:
            _release(other)


def _remove(paths: Iterable[Path]) -> None:
    for path in paths:
        with suppress(OSError):
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_handles.clear)  # they are the parent's
