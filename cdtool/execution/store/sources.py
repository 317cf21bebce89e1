"""The files that a log is read from: their content by digest, and their state, by which a change is noticed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cdtool.base.files.bounded_loading import MIB
from cdtool.base.remote.remote_path import is_remote, relative_name, version_of

# Size [bytes] and time of the last change [ns] of each file; None: it could not be looked at.
State = tuple[tuple[int, int], ...] | None


@dataclass(frozen=True)
class SourceFile:
    """One file of a log: its size [bytes], when it was last changed [ns], and the SHA-256 of its content.

    Of a file at a URL the digest is that of its ETag and size, so that its content need not be read. `name`: if the log
    has several files, by which its part is known; relative to the first one's folder.
    """

    size: int
    modified: int
    digest: str
    name: str = ""

    @property
    def content(self) -> str:
        """Return what of it determines what is read."""
        return f"{self.digest} {self.name}"


def files_of(log: Path, beside: Iterable[Path]) -> list[Path]:
    """Return the files of a log, a file or a folder, and those beside it that exist, in a fixed order."""
    own = sorted(item for item in log.iterdir() if item.is_file()) if log.is_dir() else [log]
    return [*own, *(path for path in beside if path.is_file())]


def names_of(files: Sequence[Path]) -> list[str]:
    """Return the name of each file of a log; empty for the only one."""
    return [relative_name(path, files[0].parent) for path in files] if len(files) > 1 else [""] * len(files)


def state_of(files: Sequence[Path]) -> State:
    """Return the state of files; None if one of them cannot be looked at."""
    try:
        states = [path.stat() for path in files]
    except OSError:
        return None
    return tuple((item.st_size, item.st_mtime_ns) for item in states)


def state_in(sources: Sequence[SourceFile]) -> State:
    """Return the state of files when their sources were read."""
    return tuple((item.size, item.modified) for item in sources)


def read_sources(files: Sequence[Path]) -> tuple[SourceFile, ...] | None:
    """Return the sources with their digests; None if one of the files cannot be read, or changed meanwhile."""
    before = state_of(files)
    if before is None:
        return None
    try:
        digests = [version_of(path) if is_remote(path) else file_sha256(path) for path in files]
    except OSError:
        return None
    if state_of(files) != before:
        return None
    return tuple(SourceFile(*state, *known) for state, *known in zip(before, digests, names_of(files), strict=True))


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file's content."""
    digest = hashlib.sha256()
    with path.open("rb", buffering=0) as file:
        while piece := file.read(MIB):
            digest.update(piece)
    return digest.hexdigest()
