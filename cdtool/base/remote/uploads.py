"""Write to URLs: in one step each and, where that can be noticed, not over what another process has just written."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cdtool.base.errors import UsageError
from cdtool.base.remote import staging, storage
from cdtool.base.remote.storage_error import StorageError
from cdtool.base.remote.urls import scheme_of

# Protocols whose first name is a bucket, which must exist.
_BUCKETS = frozenset(("s3", "s3a", "gs", "gcs", "abfs", "abfss", "az", "oss"))
# The ETag of the object that is being updated, by its URL.
_expected: dict[str, str] = {}


def check_place(path: Path) -> None:
    """Raise UsageError if a path is in a bucket that does not exist, StorageError if the storage cannot be reached."""
    if scheme_of(str(path)) not in _BUCKETS:
        return
    try:
        if not _is_known(path.anchor):
            storage.names_in(path.anchor)
    except FileNotFoundError:
        raise UsageError(f"{path}: no bucket {path.anchor}", "create the bucket first") from None
    except StorageError as fault:
        if fault.errno != errno.EACCES:  # whoever may write to a bucket need not be allowed to ask about it
            raise


def _is_known(bucket: str) -> bool:
    """Return whether a bucket has something in it; some versions of s3fs do not find an empty one."""
    try:
        return storage.info(bucket).is_folder
    except FileNotFoundError:
        return False


def upload(path: Path, content: bytes | Path) -> None:
    """Write bytes or a local file to a path at a URL; raises StorageError."""
    url = str(path)
    storage.make_folder(str(path.parent))
    try:
        storage.put(url, content, _expected.get(url, ""))
    finally:
        staging.forget(url)


@contextmanager
def expecting(path: Path) -> Iterator[None]:
    """In the block, `upload` replaces only the version that is at a URL now; raises StorageError.

    On S3, where a put can be bound to an ETag; elsewhere the last writer wins.
    """
    url = str(path)
    try:
        _expected[url] = staging.current_info(url).etag
    except FileNotFoundError:
        _expected[url] = ""
    try:
        yield
    finally:
        del _expected[url]
