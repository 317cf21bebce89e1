"""Ask fsspec: information, listings, bytes, uploads and removals, each error as one line.

The functions take a URL as it is shown (`urls.shown`). No answer is kept: listings that fsspec caches are dropped
before each question, so that a changed object is seen.
"""

from __future__ import annotations

import errno
import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from cdtool.base.errors import installing, nearest
from cdtool.base.remote import transferred
from cdtool.base.remote.storage_error import MissingObjectError, StorageError, is_no_space, words_of
from cdtool.base.remote.urls import complete, scheme_of, without_secrets

# Protocols of the extra cdtool[remote].
_OF_EXTRA = ("s3", "s3a")
# Protocols with real folders; in the others a folder is a common beginning of names, and a put is atomic.
_HIERARCHICAL = frozenset(("sftp", "ssh", "ftp", "smb", "hdfs", "webhdfs", "arrow_hdfs", "dbfs"))
_ETAGS = ("ETag", "etag", "md5Hash", "content_md5", "Content-MD5")
_TIMES = ("LastModified", "last_modified", "mtime", "updated", "modified", "created")
_NO_CREDENTIALS = ("NoCredentialsError", "PartialCredentialsError", "CredentialRetrievalError", "TokenRetrievalError")
_LONGEST_REASON = 160


@dataclass(frozen=True)
class ObjectInfo:
    """What is at a URL: its size [bytes], its version, and when it was last changed [ns]; or a folder.

    `etag` is the identifier that the storage gives to the content; empty if it has none.
    """

    size: int
    etag: str = ""
    changed: int = 0
    is_folder: bool = False

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


def has_folders(url: str) -> bool:
    """Return whether a storage has real folders, which must exist before a file is written to them."""
    return scheme_of(url) in _HIERARCHICAL


def info(url: str) -> ObjectInfo:
    """Return what is at a URL now; raises MissingObjectError, StorageError."""
    with _explained(url):
        fs, place = _filesystem(url)
        fs.invalidate_cache()
        return _info_of(fs.info(place))


def names_in(url: str) -> list[tuple[str, bool]]:
    """Return the names in a folder in order, each with whether it is a folder; raises as `info`."""
    with _explained(url):
        fs, place = _filesystem(url)
        fs.invalidate_cache()
        listed = fs.ls(place, detail=True)
    own, found = place.rstrip("/"), {}
    for item in listed:
        path = str(item["name"]).rstrip("/")
        name = path.rpartition("/")[2]
        if path != own and name and "?" not in (name if scheme_of(url) in ("http", "https") else ""):
            found[name] = item.get("type") == "directory"
    return sorted(found.items())


def read_range(url: str, start: int, end: int) -> bytes:
    """Return the bytes from `start` to before `end`; raises as `info`."""
    with _explained(url):
        fs, place = _filesystem(url)
        content = bytes(fs.cat_file(place, start=start, end=end))
    transferred.add(len(content))
    return content


def read_ranges(url: str, ranges: Sequence[tuple[int, int]]) -> list[bytes]:
    """Return the bytes of several ranges, asked for at the same time where fsspec can; raises as `info`."""
    with _explained(url):
        fs, place = _filesystem(url)
        starts, ends = [start for start, _ in ranges], [end for _, end in ranges]
        contents = [bytes(item) for item in fs.cat_ranges([place] * len(ranges), starts, ends, on_error="raise")]
    for content in contents:
        transferred.add(len(content))
    return contents


def read_whole(url: str) -> bytes:
    """Return all bytes at a URL; raises as `info`."""
    with _explained(url):
        fs, place = _filesystem(url)
        content = bytes(fs.cat_file(place))
    transferred.add(len(content))
    return content


def fetch(url: str, target: Path) -> None:
    """Copy what is at a URL to a local file; raises as `info`."""
    with _explained(url):
        fs, place = _filesystem(url)
        fs.get_file(place, str(target))
    transferred.add(target.stat().st_size)


def put(url: str, content: bytes | Path, expected: str = "") -> None:
    """Write bytes or a local file to a URL, completely or not at all; raises StorageError.

    `expected` is the ETag of what is replaced: on S3, something else there is not overwritten.
    """
    with _explained(url):
        fs, place = _filesystem(url)
        if isinstance(content, Path):
            content = content.read_bytes() if content.stat().st_size < _AT_ONCE else content
        condition = {"IfMatch": expected} if expected and scheme_of(url) in _OF_EXTRA else {}
        temporary = f"{place}.cdtool.tmp" if has_folders(url) else place
        if isinstance(content, Path):
            fs.put_file(str(content), temporary)
        else:
            fs.pipe_file(temporary, content, **condition)
        if temporary != place:
            fs.mv(temporary, place)


# A file of fewer bytes is sent in one request [bytes].
_AT_ONCE = 64 << 20


def make_folder(url: str) -> None:
    """Make a folder with its parents where the storage has real folders; raises StorageError."""
    if has_folders(url):
        with _explained(url):
            fs, place = _filesystem(url)
            fs.makedirs(place, exist_ok=True)


def remove(url: str) -> None:
    """Remove the file at a URL; raises as `info`."""
    with _explained(url):
        fs, place = _filesystem(url)
        fs.invalidate_cache()
        fs.rm_file(place)


def _filesystem(url: str) -> tuple[Any, str]:
    """Return the file system of a URL and the place in it; raises StorageError for a package that is missing."""
    scheme, full = scheme_of(url), complete(url)
    try:
        from fsspec.registry import get_filesystem_class, known_implementations
    except ImportError as fault:
        raise StorageError(
            url, "reading a URL needs fsspec, which is not installed", installing("remote"), errno.ENOSYS
        ) from fault
    try:
        kind = get_filesystem_class(scheme)
    except ImportError as fault:
        said = without_secrets(" ".join(str(fault).split()))[:_LONGEST_REASON]
        hint = installing("remote") if scheme in _OF_EXTRA else said
        raise StorageError(url, f"{scheme}:// needs a package that is not installed", hint, errno.ENOSYS) from fault
    except ValueError:
        known = nearest(scheme, known_implementations)
        raise StorageError(url, f"unknown protocol '{scheme}'", known, errno.ENOSYS) from None
    return kind(**kind._get_kwargs_from_urls(full)), kind._strip_protocol(full)


@contextmanager
def _explained(url: str) -> Iterator[None]:
    """Convert the exceptions of fsspec, and of the libraries below it, to StorageError."""
    try:
        yield
    except StorageError:
        raise
    except Exception as fault:
        raise _error_of(url, fault) from None


def _error_of(url: str, fault: Exception) -> StorageError:
    said = without_secrets(" ".join(str(fault).split()))
    name, reason = type(fault).__name__, said[:_LONGEST_REASON] or type(fault).__name__
    if isinstance(fault, FileNotFoundError):
        return MissingObjectError(url)
    if name in _NO_CREDENTIALS:
        return StorageError(url, "no credentials are set", "set them as for the storage's own tools", errno.EPERM)
    if isinstance(fault, PermissionError):
        return StorageError(url, f"access is denied: {reason}", "check the credentials", errno.EACCES)
    if "PreconditionFailed" in said or "412" in said or "At least one of the pre-conditions" in said:
        return StorageError(url, "was changed by another process meanwhile", "try again", errno.EBUSY)
    if is_no_space(fault):
        assert isinstance(fault, OSError)
        return StorageError(url, words_of(fault.errno), "free some space for temporary files", fault.errno or 0)
    if isinstance(fault, IsADirectoryError):
        return StorageError(url, "is a folder", "give a file in it", errno.EISDIR)
    return StorageError(url, f"the storage cannot be used: {reason}", "check the network and try again")


def _info_of(found: dict[str, Any]) -> ObjectInfo:
    if found.get("type") == "directory":
        return ObjectInfo(0, is_folder=True)
    etag = next((str(found[name]) for name in _ETAGS if found.get(name)), "")
    return ObjectInfo(int(found.get("size") or 0), etag, _nanoseconds(found))


def _nanoseconds(found: dict[str, Any]) -> int:
    """Return the time of the last change [ns since 1970]; 0 if the storage does not state it."""
    value = next((found[name] for name in _TIMES if found.get(name)), None)
    if isinstance(value, str):
        try:
            value = datetime.fromisoformat(value)
        except ValueError:
            return 0
    if isinstance(value, datetime):
        value = value if value.tzinfo is not None else value.replace(tzinfo=UTC)
        return round(value.timestamp() * 1e6) * 1000
    return round(float(value) * 1e9) if isinstance(value, int | float) else 0
