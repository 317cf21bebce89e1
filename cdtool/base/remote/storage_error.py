"""What can go wrong with a file at a URL, as one line without credentials.

Both errors are CdtoolError and OSError: whatever handles an unreadable file handles them, and they are not lasting.
"""

from __future__ import annotations

import errno
import os
from typing import Any

from cdtool.base.errors import CdtoolError


class StorageError(CdtoolError, OSError):
    """A file at a URL cannot be read or written; `strerror` is the reason without the URL."""

    def __init__(self, url: str, why: str, hint: str = "", number: int = errno.EIO) -> None:
        super().__init__(f"{url}: {why}", hint)
        self.url = url
        self.errno = number
        self.strerror = why

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.url, self.strerror, self.hint, self.errno)


class MissingObjectError(StorageError, FileNotFoundError):
    """No file is at a URL."""

    def __init__(self, url: str, why: str = "", hint: str = "check the path", number: int = errno.ENOENT) -> None:
        super().__init__(url, why or "no such file", hint, number)


def is_no_space(fault: BaseException) -> bool:
    """Return whether the local disk, not the storage, is to blame."""
    return isinstance(fault, OSError) and fault.errno in (errno.ENOSPC, errno.EDQUOT, errno.EROFS)


def words_of(number: int | None) -> str:
    """Return the system's words for an error number."""
    return os.strerror(number) if number else "unknown error"
