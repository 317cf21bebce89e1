"""The entries of a run that is under way: a line each in a file of its own, so that a killed run loses none.

The file is locked while its writer lives. The next run takes over the entries of a journal whose writer has ended; a
line that was not written to its end does not count.
"""

from __future__ import annotations

import os
import secrets
import weakref
import zlib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import IO

from cdtool.base.files.locks import lock_handle, remove_locked
from cdtool.base.files.typed_json import decoded, encoded
from cdtool.execution.store.entry import Entry

JOURNAL_SUFFIX = ".journal"
# JSON has no tab: it is escaped in texts.
_BETWEEN = "\t"


class Journal:
    """The journal of one run in a folder."""

    def __init__(self, folder: Path) -> None:
        self.path, self._file = _locked_file(folder)
        if hasattr(os, "register_at_fork"):  # the lock is to end with this process, not with the last worker
            own = weakref.ref(self._file)
            os.register_at_fork(after_in_child=lambda: _close(own()))

    def add(self, entries: list[Entry]) -> None:
        """Add entries; when it returns, they outlive this process."""
        self._file.write(b"".join(map(_line, entries)))
        self._file.flush()

    def clear(self) -> None:
        """Remove all entries: they are in a part of the store now."""
        self._file.seek(0)
        self._file.truncate()

    def close(self) -> None:
        """Remove the journal."""
        remove_locked(self.path, self._file.close)


def _locked_file(folder: Path) -> tuple[Path, IO[bytes]]:
    """Create a journal; another run may take it over before it is locked."""
    while True:
        path = folder / f"{secrets.token_hex(8)}{JOURNAL_SUFFIX}"
        file = path.open("xb")
        if _lock(file.fileno()) and path.exists():
            return path, file
        file.close()


def _close(file: IO[bytes] | None) -> None:
    if file is not None:
        file.close()


def left_behind(folder: Path) -> Iterator[tuple[Path, list[Entry]]]:
    """Yield the journals of writers that have ended, with their entries.

    Each is locked until the next one is asked for, and then removed.
    """
    for path in sorted(folder.glob(f"*{JOURNAL_SUFFIX}")):
        with suppress(OSError), path.open("r+b") as file:
            if not _lock(file.fileno()) or not path.exists():
                continue
            yield path, list(entries_in(file.read()))
            file.truncate(0)  # where it is closed before it is removed, another run may open it meanwhile
            remove_locked(path, file.close)


def _line(entry: Entry) -> bytes:
    """Return an entry as a line: a check sum, the entry without its content, and the content, which is JSON, too."""
    head = encoded(replace(entry, content=""), Entry)
    text = f"{head}{_BETWEEN}{entry.content}".encode("utf-8", "surrogatepass")
    return b"%08x %s\n" % (zlib.crc32(text), text)


def entries_in(content: bytes) -> Iterator[Entry]:
    """Yield the entries in the content of a journal."""
    for line in content.split(b"\n"):
        check, _, text = line.partition(b" ")
        if check == b"%08x" % zlib.crc32(text):
            with suppress(ValueError):
                head, _, inner = text.decode("utf-8", "surrogatepass").partition(_BETWEEN)
                yield replace(decoded(head, Entry), content=inner)


def _lock(handle: int) -> bool:
    """Lock a file for this process; return False if another one has locked it."""
    try:
        return lock_handle(handle)
    except OSError:
        return False
