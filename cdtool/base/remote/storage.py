"""Ask fsspec: information, listings, bytes, uploads and removals, each error as one line without credentials.

The functions take a URL as it is shown (`urls.shown`). Listings that fsspec caches are dropped before each question, so
that a changed object is seen.
"""

from __future__ import annotations

import errno
import glob
import hashlib
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from cdtool.base.errors import CdtoolError, installing, nearest
from cdtool.base.remote import session
from cdtool.base.remote.urls import complete, scheme_of, without_secrets

# Protocols of the extra cdtool[remote].
_OF_EXTRA = ("s3", "s3a")
# Protocols with real folders; in the others a folder is a common beginning of names, and a put is atomic.
_HIERARCHICAL = frozenset(("sftp", "ssh", "ftp", "smb", "hdfs", "webhdfs", "arrow_hdfs", "dbfs"))
_ETAGS = ("ETag", "etag", "md5Hash", "content_md5", "Content-MD5")
_TIMES = ("LastModified", "last_modified", "mtime", "updated", "modified", "created")
_NO_CREDENTIALS = ("NoCredentialsError", "PartialCredentialsError", "CredentialRetrievalError", "TokenRetrievalError")


class StorageError(CdtoolError, OSError):
    """A file at a URL cannot be read or written; `strerror` is the reason without the URL. It is not lasting."""

    def __init__(self, url: str, why: str, hint: str = "check the path", number: int = errno.EIO) -> None:
        super().__init__(f"{url}: {why}", hint)
        self.url, self.errno, self.strerror = url, number, why

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.url, self.strerror, self.hint, self.errno)


class MissingObjectError(StorageError, FileNotFoundError):
    """No file is at a URL."""


@dataclass(frozen=True)
class ObjectInfo:
    """What is at a URL: its size [bytes], its version, and when it was last changed [ns]; or a folder.

    `etag` is the identifier that the storage gives to the content; empty if it has none.
    """

    size: int
    etag: str = ""
    changed: int = 0
    is_folder: bool = False

    @classmethod
    def of(cls, found: dict[str, Any]) -> ObjectInfo:
        """Return what a file system says."""
        if found.get("type") == "directory":
            return cls(0, is_folder=True)
        etag = next((str(found[name]) for name in _ETAGS if found.get(name)), "")
        time = next((found[name] for name in _TIMES if found.get(name)), None)
        with suppress(ValueError):
            time = datetime.fromisoformat(time) if isinstance(time, str) else time
        if isinstance(time, datetime):
            time = (time if time.tzinfo is not None else time.replace(tzinfo=UTC)).timestamp()
        changed = round(time * 1e6) * 1000 if isinstance(time, int | float) else 0
        return cls(int(found.get("size") or 0), etag, changed)

    @property
    def digest(self) -> str:
        """Return what identifies the content without reading it: of ETag and size, or of time and size."""
        kind = "etag" if self.etag else "modified"
        text = f"{self.etag or self.changed} {self.size}"
        return f"{kind}:{hashlib.sha256(text.encode()).hexdigest()}"

    @property
    def modified(self) -> int:
        """Return a time of the last change [ns] that differs between versions.

        Object stores give whole seconds; the digits below are from the ETag.
        """
        if not self.etag:
            return self.changed
        below = int.from_bytes(hashlib.sha256(self.etag.encode()).digest()[:8], "big") % 10**9
        return self.changed // 10**9 * 10**9 + below


def info(url: str) -> ObjectInfo:
    """Return what is at a URL now; raises MissingObjectError, StorageError."""
    with _asked(url) as (fs, place):
        fs.invalidate_cache()
        return ObjectInfo.of(fs.info(place))


def names_in(url: str, pattern: str = "") -> dict[str, ObjectInfo | None]:
    """Return the names in a folder, or those below it that match a pattern, with what is there; raises as `info`.

    None: the storage lists only the name.
    """
    with _asked(url) as (fs, place):
        fs.invalidate_cache()
        own = place.rstrip("/")
        within = f"{glob.escape(own)}/{pattern}"
        listed = fs.glob(within, detail=True).values() if pattern else fs.ls(place, detail=True)
        listed = [item for item in listed if str(item["name"]).startswith(own)]  # a web page has other links, too
        found = {str(item["name"]).removeprefix(own).strip("/"): item for item in listed}
    is_web = scheme_of(url) in ("http", "https")
    return {
        name: ObjectInfo.of(item) if item.get("size") is not None or item.get("type") == "directory" else None
        for name, item in sorted(found.items())
        if name and not (is_web and "?" in name)
    }


def read_range(url: str, start: int | None = None, end: int | None = None) -> bytes:
    """Return the bytes from `start` to before `end`, or all; raises as `info`."""
    with _asked(url) as (fs, place):
        content = bytes(fs.cat_file(place, start=start, end=end))
    session.note_read(len(content))
    return content


def read_ranges(url: str, starts: Sequence[int], ends: Sequence[int]) -> list[bytes]:
    """Return the bytes of several ranges, asked for at the same time where fsspec can; raises as `info`."""
    with _asked(url) as (fs, place):
        found = fs.cat_ranges([place] * len(starts), list(starts), list(ends), on_error="raise")
    for content in found:
        session.note_read(len(content))
    return [bytes(content) for content in found]


def fetch(url: str, target: Path) -> None:
    """Copy what is at a URL to a local file; raises as `info`."""
    with _asked(url) as (fs, place):
        fs.get_file(place, str(target))
    session.note_read(target.stat().st_size)


def put(url: str, file: Path, expected: str = "") -> None:
    """Write a local file to a URL, completely or not at all; raises StorageError.

    `expected` is the ETag of what is replaced: on S3, something else there is not overwritten.
    """
    with _asked(url) as (fs, place):
        if expected and scheme_of(url) in _OF_EXTRA:
            fs.pipe_file(place, file.read_bytes(), IfMatch=expected)
        elif scheme_of(url) in _HIERARCHICAL:
            fs.makedirs(place.rpartition("/")[0], exist_ok=True)
            fs.put_file(str(file), f"{place}.cdtool.tmp")
            fs.mv(f"{place}.cdtool.tmp", place)
        else:
            fs.put_file(str(file), place)


def remove(url: str) -> None:
    """Remove the file at a URL; raises as `info`."""
    with _asked(url) as (fs, place):
        fs.rm_file(place)


@contextmanager
def _asked(url: str) -> Iterator[tuple[Any, str]]:
    """Yield the file system of a URL and the place in it; what goes wrong in the block is a StorageError."""
    session.folder()  # workers that are started later find it
    try:
        fs = _filesystem(url)
        yield fs, fs._strip_protocol(complete(url))
    except StorageError:
        raise
    except Exception as fault:
        raise _error_of(url, fault) from None


def _filesystem(url: str) -> Any:
    scheme = scheme_of(url)
    try:
        from fsspec.registry import get_filesystem_class, known_implementations
    except ImportError:
        why = "reading a URL needs fsspec, which is not installed"
        raise StorageError(url, why, installing("remote"), errno.ENOSYS) from None
    try:
        kind = get_filesystem_class(scheme)
    except ImportError as fault:
        hint = installing("remote") if scheme in _OF_EXTRA else _words(fault)
        raise StorageError(url, f"{scheme}:// needs a package that is not installed", hint, errno.ENOSYS) from None
    except ValueError:
        known = nearest(scheme, known_implementations)
        raise StorageError(url, f"unknown protocol '{scheme}'", known, errno.ENOSYS) from None
    return kind(**kind._get_kwargs_from_urls(complete(url)))


def _words(fault: Exception) -> str:
    # The line has room for the URL, too.
    return without_secrets(" ".join(str(fault).split()))[:160] or type(fault).__name__


def _error_of(url: str, fault: Exception) -> StorageError:
    if isinstance(fault, FileNotFoundError):
        return MissingObjectError(url, "no such file", number=errno.ENOENT)
    if type(fault).__name__ in _NO_CREDENTIALS:
        return StorageError(url, "no credentials are set", "set them as for the storage's own tools", errno.EPERM)
    if isinstance(fault, PermissionError):
        return StorageError(url, f"access is denied: {_words(fault)}", "check the credentials", errno.EACCES)
    if any(mark in str(fault) for mark in ("PreconditionFailed", "(412)", "At least one of the pre-conditions")):
        return StorageError(url, "was changed by another process meanwhile", "try again", errno.EBUSY)
    if isinstance(fault, OSError) and fault.errno in (errno.ENOSPC, errno.EDQUOT, errno.EROFS):
        return StorageError(url, os.strerror(fault.errno), "free some space for temporary files", fault.errno)
    if isinstance(fault, IsADirectoryError):
        return StorageError(url, "is a folder", "give a file in it", errno.EISDIR)
    return StorageError(url, f"the storage cannot be used: {_words(fault)}", "check the network and try again")
