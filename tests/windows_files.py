"""Files as on Windows, simulated on Linux: a file that this process has open or mapped is not removed or renamed.

Python opens files there without permission for others to delete them. A folder that contains such a file is not renamed
either. The module `fcntl` does not exist; that of Windows for locks does.

As a plug-in (`python -m pytest -p tests.windows_files ...`) it simulates this for every test.
"""

from __future__ import annotations

import errno
import os
import shutil
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from cdtool.base.files import locks as file_locks

# A name is looked up and removed in one step there: no other thread opens the file in between.
_one_step = threading.RLock()
CAN_SIMULATE = Path("/proc/self/fd").is_dir()


def opened() -> set[str]:
    """Return the real paths of all files that this process has open or mapped."""
    found = set()
    for entry in Path("/proc/self/fd").iterdir():
        with suppress(OSError):
            found.add(str(entry.readlink()))
    for line in Path("/proc/self/maps").read_text(encoding="utf-8", errors="surrogateescape").splitlines():
        parts = line.split(maxsplit=5)
        if len(parts) == 6:
            found.add(parts[5])
    return found


def refuse_open(path: Any) -> None:
    """Raise PermissionError for a file that is open, or a folder with one in it."""
    if isinstance(path, int):
        return
    given = Path(os.fspath(path))
    real = str(given.parent.resolve() / given.name)
    if any(name == real or name.startswith(f"{real}/") for name in opened()):
        raise PermissionError(errno.EACCES, "used by this process (as on Windows)", str(path))


@contextmanager
def windows_files() -> Iterator[None]:
    """Let files behave in the block as on Windows."""
    with pytest.MonkeyPatch.context() as patch:
        for name, both in (("unlink", False), ("remove", False), ("rename", True), ("replace", True)):
            patch.setattr(os, name, _refusing(getattr(os, name), both))
        patch.setattr(os, "open", _in_one_step(os.open))
        patch.setattr(shutil, "_use_fd_functions", False)
        patch.setitem(sys.modules, "fcntl", None)
        patch.setitem(sys.modules, "msvcrt", ByteLocks())
        patch.setattr(file_locks, "REMOVES_OPEN_FILES", False)
        yield


def _refusing(call: Callable[..., Any], both: bool) -> Callable[..., Any]:
    def checked(path: Any, *others: Any, **options: Any) -> Any:
        with _one_step:
            if options.get("dir_fd") is None:
                refuse_open(path)
                if both:
                    refuse_open(others[0])
            return call(path, *others, **options)

    return checked


def _in_one_step(call: Callable[..., Any]) -> Callable[..., Any]:
    def alone(*arguments: Any, **options: Any) -> Any:
        with _one_step:
            return call(*arguments, **options)

    return alone


class ByteLocks:
    """The locks of `msvcrt`, made of those of Linux."""

    LK_NBLCK = 2

    def locking(self, handle: int, mode: int, size: int) -> None:
        """Lock bytes at the current position; raise OSError if another handle has locked them."""
        assert mode == self.LK_NBLCK and size == 1
        absent = sys.modules.pop("fcntl")
        try:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as fault:
            raise PermissionError(errno.EACCES, "Permission denied") from fault
        finally:
            sys.modules["fcntl"] = absent


@pytest.fixture(autouse="tests.windows_files" in " ".join(sys.argv))
def as_on_windows() -> Iterator[None]:
    """Simulate the files of Windows for a test."""
    if not CAN_SIMULATE:
        pytest.skip("no /proc: open files are not known")
    with windows_files():
        yield
