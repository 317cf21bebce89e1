"""A path at a URL that the rest of cdtool uses like a local one.

Whatever opens it through the operating system (`open`, `os.open`, h5py, a memory map) calls `__fspath__`, which makes a
local copy (`staging`); everything else asks the storage. There are no links, permissions or locks, and a folder of an
object store is a common beginning of names. Files are written by `cdtool.base.files.writing` only.

Why not the package universal_pathlib: its paths are no `pathlib.Path`, and it leaves the copies, their bound and the
secrets in the text of a URL to its user.
"""

from __future__ import annotations

import errno
import io
import os
import posixpath
import stat
import sys
import time
from collections.abc import Iterator
from fnmatch import fnmatchcase
from functools import total_ordering
from pathlib import Path, PurePath, PurePosixPath
from typing import IO, Any

from cdtool.base.remote import staging, storage
from cdtool.base.remote.ranges import SMALLEST_BY_RANGES, RangedFile
from cdtool.base.remote.storage_error import StorageError
from cdtool.base.remote.urls import complete, scheme_of, shown

# Protocols without a host or bucket: the first name is one below it.
_WITHOUT_HOST = frozenset(("memory",))
# Files that are read by ranges, by suffix: the others are read from their beginning to their end.
_BY_RANGES = frozenset((".mcap",))
_MAGIC = frozenset("*?[")
# A listing counts as an answer about each of its files for this time [s].
_TRUSTED = 2.0
_BUFFER = 1 << 12


def location(text: str | Path) -> Path:
    """Return the path of a file name, which may be a URL.

    Parameters
    ----------
    text : str or Path
        A local path, or a URL of any protocol of fsspec. A `file://` URL is a local path.

    Returns
    -------
    Path
        A path that can be read like any other; its text has no user info and no query string.

    Examples
    --------
    >>> str(location("https://user:secret@host/logs/01.csv?X-Amz-Signature=abc"))
    'https://host/logs/01.csv'
    >>> location("logs/01.csv").parent.name
    'logs'
    """
    if isinstance(text, Path):
        return text
    scheme = scheme_of(text)
    if scheme in ("file", "local"):
        return _local(text)
    return RemotePath(text) if scheme else Path(text)


def joined(base: Path, text: str) -> Path:
    """Return the path of a file name that is relative to `base`, unless it is absolute or a URL."""
    return location(text) if scheme_of(text) else base / text


def relative_name(path: Path, folder: Path) -> str:
    """Return the name by which a file in `folder` names another file; the URL if that is in another storage.

    >>> relative_name(location("s3://bucket/logs/01.csv"), location("s3://bucket/benchmarks"))
    '../logs/01.csv'
    """
    if not isinstance(path, RemotePath) and not isinstance(folder, RemotePath):
        return Path(os.path.relpath(path, folder)).as_posix()
    if isinstance(path, RemotePath) and isinstance(folder, RemotePath) and path.anchor == folder.anchor:
        return posixpath.relpath("/".join(path.parts[1:]), "/".join(folder.parts[1:]) or ".")
    return path.absolute().as_posix()


def is_remote(path: Path) -> bool:
    """Return whether a path is at a URL."""
    return isinstance(path, RemotePath)


def _local(url: str) -> Path:
    from urllib.request import url2pathname

    rest = url.partition("://")[2]
    # Only names that were made by a library have escapes; a plain name with a % is not changed.
    return Path(url2pathname(rest) if "%" in rest else rest)


def _refused(name: str) -> Any:
    """Return a method that URLs do not have."""

    def refuse(self: RemotePath, *_: object, **__: object) -> Any:
        raise StorageError(str(self), f"'{name}' is not possible at a URL", "use a local path", errno.EOPNOTSUPP)

    return refuse


@total_ordering
class RemotePath(type(Path())):  # type: ignore[misc]
    """A path at a URL: `segments` are the host or bucket and the names below it."""

    def __new__(cls, url: str) -> RemotePath:
        """Return the path; a URL without a protocol is an error of the caller."""
        made: RemotePath = super().__new__(cls, shown(url))
        return made

    def __init__(self, url: str) -> None:
        text = shown(url)
        if sys.version_info >= (3, 12):
            super().__init__(text)
        scheme, _, rest = text.partition("://")
        first, *names = ["", *rest.split("/")] if scheme in _WITHOUT_HOST else rest.split("/")
        self._scheme = scheme
        self._segments = (first, *_normal(names))
        self._listed: tuple[float, bool] | None = None

    @classmethod
    def _of(cls, scheme: str, segments: tuple[str, ...]) -> RemotePath:
        return cls(_url(scheme, segments))

    def __reduce__(self) -> tuple[Any, ...]:
        return RemotePath, (complete(str(self)),)

    def __copy__(self) -> RemotePath:
        return self

    def __deepcopy__(self, _: object) -> RemotePath:
        return self

    # What it is called.

    def __str__(self) -> str:
        return _url(self._scheme, self._segments)

    def __repr__(self) -> str:
        return f"RemotePath({str(self)!r})"

    def __bytes__(self) -> bytes:
        return str(self).encode("utf-8", "surrogatepass")

    def as_posix(self) -> str:
        """Return the URL."""
        return str(self)

    def as_uri(self) -> str:
        """Return the URL."""
        return str(self)

    def __hash__(self) -> int:
        return hash((self._scheme, self._segments))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RemotePath):
            return False if isinstance(other, PurePath) else NotImplemented
        return (self._scheme, self._segments) == (other._scheme, other._segments)

    def __lt__(self, other: object) -> bool:
        return str(self) < str(other) if isinstance(other, PurePath) else NotImplemented

    @property
    def anchor(self) -> str:
        """The protocol and the host or bucket."""
        return _url(self._scheme, self._segments[:1])

    @property
    def drive(self) -> str:
        """The protocol and the host or bucket."""
        return self.anchor

    @property
    def root(self) -> str:
        """The separator."""
        return "/"

    @property
    def parts(self) -> tuple[str, ...]:
        """The anchor and the names below it."""
        return (self.anchor, *self._segments[1:])

    @property
    def name(self) -> str:
        """The last name."""
        return self._segments[-1] if len(self._segments) > 1 else ""

    @property
    def suffix(self) -> str:
        """The last suffix of the name."""
        return PurePosixPath(self.name).suffix

    @property
    def suffixes(self) -> list[str]:
        """The suffixes of the name."""
        return PurePosixPath(self.name).suffixes

    @property
    def stem(self) -> str:
        """The name without its last suffix."""
        return PurePosixPath(self.name).stem

    # Other paths.

    @property
    def parent(self) -> RemotePath:
        """The folder; of a host or bucket itself."""
        return self._of(self._scheme, self._segments[:-1]) if len(self._segments) > 1 else self

    @property
    def parents(self) -> tuple[RemotePath, ...]:
        """The folders, the nearest first."""
        return tuple(self._of(self._scheme, self._segments[:i]) for i in range(len(self._segments) - 1, 0, -1))

    def _joined(self, *others: str | os.PathLike[str]) -> Path:
        """Return the path below; an absolute path or a URL replaces it."""
        made: Path = self
        for other in others:
            made = made / other
        return made

    joinpath = _joined

    def __truediv__(self, other: str | os.PathLike[str]) -> Path:
        if isinstance(other, RemotePath):
            return other
        text = other.as_posix() if isinstance(other, PurePath) else str(other)
        if scheme_of(text):
            return location(text)
        if PurePosixPath(text).is_absolute():
            return Path(text)
        names = [name for name in text.split("/") if name]
        return self._of(self._scheme, (*self._segments, *names))

    def __rtruediv__(self, other: object) -> Path:
        return self

    def with_name(self, name: str) -> RemotePath:
        """Return the path with another name."""
        if not self.name or not name or name in (".", ".."):
            raise ValueError(f"{name!r} is no name for {self}")
        return self._of(self._scheme, (*self._segments[:-1], *name.split("/")))

    def with_suffix(self, suffix: str) -> RemotePath:
        """Return the path with another suffix."""
        return self.with_name(PurePosixPath(self.name).with_suffix(suffix).name)

    def relative_to(self, *others: Any, **_: object) -> Path:
        """Return the path below another URL; raises ValueError."""
        base = others[0]
        names = base._segments if isinstance(base, RemotePath) and base._scheme == self._scheme else None
        if names is None or self._segments[: len(names)] != names:
            raise ValueError(f"{str(self)!r} is not below {str(base)!r}")
        return Path(*self._segments[len(names) :])

    def is_relative_to(self, *others: Any) -> bool:
        """Return whether the path is below another URL."""
        try:
            self.relative_to(*others)
        except ValueError:
            return False
        return True

    def is_absolute(self) -> bool:
        """Return True."""
        return True

    def match(self, pattern: Any, **_: object) -> bool:
        """Return whether the end of the path is as a pattern."""
        return PurePosixPath(*self._segments).match(str(pattern))

    def absolute(self) -> RemotePath:
        """Return the path itself."""
        return self

    expanduser = absolute

    def resolve(self, strict: bool = False) -> RemotePath:  # noqa: ARG002  as of Path
        """Return the path itself: there are no links."""
        return self

    # What the storage says.

    def stat(self, **_: object) -> os.stat_result:
        """Return size and time of the last change as they are now; raises MissingObjectError, StorageError."""
        found = staging.current_info(str(self))
        kind = stat.S_IFDIR | 0o777 if found.is_folder else stat.S_IFREG | 0o666
        seconds = found.modified // 10**9
        numbers = (kind, 0, 0, 1, 0, 0, found.size, seconds, seconds, seconds)
        return os.stat_result(numbers, {"st_mtime_ns": found.modified})

    def lstat(self) -> os.stat_result:
        """Return the same as `stat`."""
        return self.stat()

    def exists(self, **_: object) -> bool:
        """Return whether a file or folder is there; raises StorageError."""
        return self._is_folder() is not None

    def is_file(self, **_: object) -> bool:
        """Return whether a file is there; raises StorageError."""
        return self._is_folder() is False

    def is_dir(self, **_: object) -> bool:
        """Return whether a folder is there; raises StorageError."""
        return self._is_folder() is True

    def _is_folder(self) -> bool | None:
        """Return whether a folder is there, or a file; None for nothing."""
        if self._listed is not None and time.monotonic() - self._listed[0] < _TRUSTED:
            return self._listed[1]
        found = staging.known_info(str(self))
        return None if found is None else found.is_folder

    def is_symlink(self) -> bool:
        """Return False."""
        return False

    def is_mount(self) -> bool:
        """Return False."""
        return False

    is_reserved = is_junction = is_socket = is_fifo = is_block_device = is_char_device = is_mount

    def samefile(self, other: Any) -> bool:
        """Return whether another path is the same URL."""
        return self == location(other)

    def iterdir(self) -> Iterator[RemotePath]:
        """Yield the files and folders in a folder, in order; raises MissingObjectError, StorageError."""
        now = time.monotonic()
        for name, is_folder in storage.names_in(str(self)):
            path = self._of(self._scheme, (*self._segments, name))
            path._listed = (now, is_folder)
            yield path

    def glob(self, pattern: Any, **_: object) -> Iterator[RemotePath]:
        """Yield what fits a pattern below this folder; raises StorageError."""
        names = [name for name in str(pattern).split("/") if name]
        return iter(dict.fromkeys(_matches(self, _normal(names))))

    def rglob(self, pattern: Any, **_: object) -> Iterator[RemotePath]:
        """Yield what fits a pattern in this folder or one below it; raises StorageError."""
        return self.glob(f"**/{pattern}")

    # Its content.

    def __fspath__(self) -> str:
        """Return the local copy of the file; raises MissingObjectError, StorageError."""
        return str(staging.staged(str(self)))

    def is_read_by_ranges(self) -> bool:
        """Return whether parts of the file are read from the storage, without a local copy; raises StorageError."""
        if self.suffix.lower() not in _BY_RANGES:
            return False
        found = staging.known_info(str(self))
        return found is not None and not found.is_folder and found.size >= SMALLEST_BY_RANGES

    def digest(self) -> str:
        """Return what identifies the file's version without reading it; raises MissingObjectError, StorageError.

        It is that of the last `stat` if that was asked for in the last seconds.
        """
        found = staging.known_info(str(self))
        return (staging.current_info(str(self)) if found is None else found).digest

    def open(
        self,
        mode: str = "r",
        buffering: int = -1,
        encoding: str | None = None,
        errors: str | None = None,
        newline: str | None = None,
    ) -> IO[Any]:
        """Return the open file, for reading; raises MissingObjectError, StorageError."""
        if set(mode) & set("wax+"):
            _refused(f"open for mode {mode}")(self)
        if "b" in mode and self.is_read_by_ranges():
            raw: Any = RangedFile(str(self))
            return raw if buffering == 0 else io.BufferedReader(raw, _BUFFER)
        return Path(os.fspath(self)).open(mode, buffering, encoding, errors, newline)

    def read_bytes(self) -> bytes:
        """Return the content; raises MissingObjectError, StorageError."""
        if staging.is_staged(str(self)):
            return Path(os.fspath(self)).read_bytes()
        return storage.read_whole(str(self))

    def read_text(self, encoding: str | None = None, errors: str | None = None, **_: object) -> str:
        """Return the content as text; raises MissingObjectError, StorageError."""
        return self.read_bytes().decode(encoding or "utf-8", errors or "strict")

    # What changes the storage: files are written by `cdtool.base.files.writing`.

    def mkdir(self, mode: int = 0o777, parents: bool = False, exist_ok: bool = False) -> None:  # noqa: ARG002
        """Make the folder where the storage has real ones; raises StorageError."""
        storage.make_folder(str(self))

    def unlink(self, missing_ok: bool = False) -> None:
        """Remove the file; raises MissingObjectError, StorageError."""
        try:
            storage.remove(str(self))
        except FileNotFoundError:
            if not missing_ok:
                raise
        finally:
            staging.forget(str(self))

    with_segments: Any = _refused("with_segments")
    with_stem: Any = _refused("with_stem")
    rmdir: Any = _refused("rmdir")
    rename: Any = _refused("rename")
    replace: Any = _refused("replace")
    touch: Any = _refused("touch")
    write_bytes: Any = _refused("write_bytes")
    write_text: Any = _refused("write_text")
    chmod: Any = _refused("chmod")
    lchmod: Any = _refused("lchmod")
    owner: Any = _refused("owner")
    group: Any = _refused("group")
    readlink: Any = _refused("readlink")
    symlink_to: Any = _refused("symlink_to")
    hardlink_to: Any = _refused("hardlink_to")
    link_to: Any = _refused("link_to")
    walk: Any = _refused("walk")
    full_match: Any = _refused("full_match")
    copy: Any = _refused("copy")
    copy_into: Any = _refused("copy_into")
    move: Any = _refused("move")
    move_into: Any = _refused("move_into")


def _url(scheme: str, segments: tuple[str, ...]) -> str:
    return f"{scheme}://{'/'.join(segments[1:] if scheme in _WITHOUT_HOST else segments)}"


def _normal(names: list[str]) -> tuple[str, ...]:
    """Return the names of a path without ".", ".." and an empty one at the end."""
    made: list[str] = []
    for number, name in enumerate(names):
        if name == "..":
            del made[-1:]
        elif name != "." and (name or number < len(names) - 1):
            made.append(name)
    while made and not made[-1]:
        made.pop()
    return tuple(made)


def _matches(folder: RemotePath, names: tuple[str, ...]) -> Iterator[RemotePath]:
    """Yield the paths below a folder whose names fit the patterns; a folder that does not exist has none."""
    if not names:
        yield folder
        return
    first, rest = names[0], names[1:]
    if first == "**":
        yield from _matches(folder, rest)
        for path in _below(folder):
            if path.is_dir():
                yield from _matches(path, names)
    elif not _MAGIC & set(first):
        path = RemotePath._of(folder._scheme, (*folder._segments, first))
        if rest or path.exists():
            yield from _matches(path, rest)
    else:
        for path in _below(folder):
            if fnmatchcase(path.name, first) and (not rest or path.is_dir()):
                yield from _matches(path, rest)


def _below(folder: RemotePath) -> list[RemotePath]:
    try:
        return list(folder.iterdir())
    except (FileNotFoundError, NotADirectoryError):
        return []
