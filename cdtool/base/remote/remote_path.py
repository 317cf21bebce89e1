"""Names of files, which may be URLs: of a local file a `Path`, of a URL a `Remote`, which answers the same questions.

Whatever opens a file at a URL through the operating system (`open`, `os.open`, h5py, a memory map) calls `__fspath__`,
which makes a local copy (`staging`); everything else asks the storage. There are no links, permissions or locks, and a
folder of an object store is a common beginning of names. Files are written by `cdtool.base.files.writing` only.
"""

from __future__ import annotations

import errno
import os
import posixpath
import stat
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import total_ordering
from pathlib import Path, PurePosixPath
from typing import IO, Any, cast

from cdtool.base.errors import UsageError
from cdtool.base.remote import staging, storage
from cdtool.base.remote.storage import MissingObjectError, StorageError
from cdtool.base.remote.urls import complete, scheme_of, shown

# Protocols whose first name is a bucket, which must exist.
_BUCKETS = frozenset(("s3", "s3a", "gs", "gcs", "abfs", "abfss", "az", "oss"))
# Files that are read by ranges, by suffix and size [bytes]: the others are copied, which is one request.
_BY_RANGES, SMALLEST_BY_RANGES = frozenset((".mcap",)), 16 << 20


def location(text: str | os.PathLike[str]) -> Path:
    """Return the path of a file name, which may be a URL.

    Parameters
    ----------
    text : str or Path
        A local path, or a URL of any protocol of fsspec. A `file://` URL is a local path.

    Returns
    -------
    Path
        A path, or for a URL what can be read like one; its text has no user info and no query string.

    Examples
    --------
    >>> str(location("https://user:secret@host/logs/01.csv?X-Amz-Signature=abc"))
    'https://host/logs/01.csv'
    >>> location("logs/01.csv").parent.name
    'logs'
    """
    if not isinstance(text, str):
        return cast("Path", text)
    scheme = scheme_of(text)
    if scheme in ("file", "local"):
        from urllib.request import url2pathname

        rest = text.partition("://")[2]
        # Only names that were made by a library have escapes; a plain name with a % is not changed.
        return Path(url2pathname(rest) if "%" in rest else rest)
    return cast("Path", Remote.of(text)) if scheme else Path(text)


def joined(base: Path, text: str) -> Path:
    """Return the path of a file name that is relative to `base`, unless it is absolute or a URL."""
    return location(text) if scheme_of(text) else base / text


def relative_name(path: Path, folder: Path) -> str:
    """Return the name by which a file in `folder` names another file; the URL if that is in another storage.

    >>> relative_name(location("s3://bucket/logs/01.csv"), location("s3://bucket/benchmarks"))
    '../logs/01.csv'
    """
    if not is_remote(path) and not is_remote(folder):
        return Path(os.path.relpath(path, folder)).as_posix()
    if is_remote(path) and is_remote(folder) and path.anchor == folder.anchor:
        return posixpath.relpath("/".join(path.parts[1:]), "/".join(folder.parts[1:]) or ".")
    return path.absolute().as_posix()


def is_remote(path: object) -> bool:
    """Return whether a path is at a URL."""
    return isinstance(path, Remote)


def is_read_by_ranges(path: Path) -> bool:
    """Return whether parts of a file are read from the storage, without a local copy; raises StorageError."""
    if not is_remote(path) or path.suffix.lower() not in _BY_RANGES:
        return False
    found = staging.known_info(str(path))
    return found is not None and found.size >= SMALLEST_BY_RANGES


def version_of(path: Path) -> str:
    """Return what identifies the content of a file at a URL without reading it; raises as `storage.info`.

    It is that of the last `stat` if that was asked for in the last seconds.
    """
    return (staging.known_info(str(path)) or staging.current_info(str(path))).digest


def check_place(path: Path) -> None:
    """Raise UsageError if a path is in a bucket that does not exist, StorageError if the storage cannot be reached."""
    if scheme_of(str(path)) not in _BUCKETS:
        return
    try:
        if staging.known_info(path.anchor) is None:  # some versions of s3fs do not find an empty one
            storage.names_in(path.anchor)
    except FileNotFoundError:
        raise UsageError(f"{path}: no bucket {path.anchor}", "create the bucket first") from None
    except StorageError as fault:
        if fault.errno != errno.EACCES:  # whoever may write to a bucket need not be allowed to ask about it
            raise


def _normal(below: str) -> str:
    """Return names without ".", ".." and "/" at the end; in a bucket, one between others may be empty."""
    dots = {".", ".."} & set(below.split("/"))
    return (posixpath.normpath(f"/{below}")[1:] if dots else below).rstrip("/")


@total_ordering
@dataclass(frozen=True)
class Remote(os.PathLike[str]):
    """A file or folder at a URL: the protocol with the host or bucket, and the names below it."""

    anchor: str
    below: str = ""

    @classmethod
    def of(cls, url: str) -> Remote:
        """Return that of a URL."""
        scheme, _, rest = shown(url).partition("://")
        first, _, below = ("", "", rest) if scheme == "memory" else rest.partition("/")
        return cls(f"{scheme}://{first}", _normal(below))

    def __reduce__(self) -> tuple[Any, ...]:
        return Remote.of, (complete(str(self)),)

    def __str__(self) -> str:
        return f"{self.anchor}{'/' if self.below and self.anchor[-1] != '/' else ''}{self.below}"

    as_posix = __str__

    def __lt__(self, other: object) -> bool:
        return str(self) < str(other)

    def __fspath__(self) -> str:
        """Return the local copy of the file; raises MissingObjectError, StorageError."""
        return str(staging.staged(str(self)))

    @property
    def name(self) -> str:
        """The last name."""
        return self.below.rpartition("/")[2]

    @property
    def suffix(self) -> str:
        """The last suffix of the name."""
        return PurePosixPath(self.name).suffix

    @property
    def stem(self) -> str:
        """The name without its last suffix."""
        return PurePosixPath(self.name).stem

    @property
    def parts(self) -> tuple[str, ...]:
        """The anchor and the names below it."""
        return (self.anchor, *self.below.split("/")) if self.below else (self.anchor,)

    @property
    def parent(self) -> Remote:
        """The folder; of a host or bucket itself."""
        return replace(self, below=self.below.rpartition("/")[0])

    def with_name(self, name: str) -> Remote:
        """Return the path with another name."""
        return replace(self, below=f"{self.below.removesuffix(self.name)}{name}")

    def __truediv__(self, other: str | os.PathLike[str]) -> Any:
        """Return the path below; an absolute path or a URL replaces it."""
        text = str(other)
        if scheme_of(text) or text.startswith("/"):
            return location(text)
        return replace(self, below=_normal(f"{self.below}/{text}" if self.below else text))

    def absolute(self) -> Remote:
        """Return the path itself: there are no links."""
        return self

    resolve = absolute

    def is_absolute(self) -> bool:
        """Return True."""
        return True

    def is_symlink(self) -> bool:
        """Return False."""
        return False

    def relative_to(self, base: Remote) -> Path:
        """Return the path below another URL."""
        return Path(self.below.removeprefix(base.below).lstrip("/"))

    def samefile(self, other: object) -> bool:
        """Return whether another path is the same URL."""
        return self == other

    def stat(self) -> os.stat_result:
        """Return size and time of the last change as they are now; raises MissingObjectError, StorageError."""
        found = staging.current_info(str(self))
        kind, seconds = stat.S_IFDIR if found.is_folder else stat.S_IFREG, found.modified // 10**9
        numbers = (kind, 0, 0, 1, 0, 0, found.size, seconds, seconds, seconds)
        return os.stat_result(numbers, {"st_mtime_ns": found.modified})

    def exists(self) -> bool:
        """Return whether a file or folder is there; raises StorageError."""
        return staging.known_info(str(self)) is not None

    def is_file(self) -> bool:
        """Return whether a file is there; raises StorageError."""
        return (found := staging.known_info(str(self))) is not None and not found.is_folder

    def is_dir(self) -> bool:
        """Return whether a folder is there; raises StorageError."""
        return (found := staging.known_info(str(self))) is not None and found.is_folder

    def glob(self, pattern: str) -> Iterator[Remote]:
        """Yield what fits a pattern below this folder; raises StorageError."""
        with suppress(FileNotFoundError, NotADirectoryError):
            yield from self._listed(pattern)

    def iterdir(self) -> Iterator[Remote]:
        """Yield the files and folders in a folder, in order; raises MissingObjectError, StorageError."""
        return self._listed()

    def _listed(self, pattern: str = "") -> Iterator[Remote]:
        for name, found in storage.names_in(str(self), pattern).items():
            path = replace(self, below=f"{self.below}/{name}" if self.below else name)
            if found is not None:
                staging.note(str(path), found)
            yield path

    def open(self, mode: str = "r", buffering: int = -1, **text: Any) -> IO[Any]:
        """Return the open file, for reading; raises MissingObjectError, StorageError."""
        if "b" in mode and is_read_by_ranges(cast("Path", self)):
            from cdtool.base.remote.ranges import RangedFile

            return cast("IO[Any]", RangedFile(str(self)))
        return Path(os.fspath(self)).open(mode, buffering, **text)

    def read_bytes(self) -> bytes:
        """Return the content; raises MissingObjectError, StorageError."""
        return storage.read_range(str(self))

    def mkdir(self, **_: object) -> None:
        """Do nothing: a folder is there with its first file."""

    def unlink(self, missing_ok: bool = False) -> None:
        """Remove the file; raises MissingObjectError, StorageError."""
        try:
            storage.remove(str(self))
        except MissingObjectError:
            if not missing_ok:
                raise
        finally:
            staging.forget(str(self))
