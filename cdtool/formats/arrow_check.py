"""How much does a Feather (Arrow IPC) file unpack to? Arrow allots whatever a compressed buffer claims before it looks.

The file's messages are walked, both one behind the other and where the footer points. Of a compressed batch each buffer
begins with the number of bytes it unpacks to. https://arrow.apache.org/docs/format/Columnar.html#ipc-file-format
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cdtool.formats.container_checks import check_size

_FIRST, _MAGIC = 8, b"ARROW1"
_CONTINUED = 0xFFFFFFFF
_DICTIONARY, _BATCH = 2, 3
_BLOCK = 24


def check_batches(path: Path) -> None:
    """Refuse an Arrow file whose compressed batches unpack to far more than a log; raises RecordingError.

    Damage is not looked for: where a message cannot be walked, Arrow will not read it either.
    """
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        claimed = 0
        for at in sorted({*_in_sequence(content), *_in_footer(content)}):
            try:
                claimed += _claimed(content, at)
            except (struct.error, IndexError, ValueError):
                continue
            check_size(path, claimed // 8)


@dataclass(frozen=True)
class _Table:
    """A table of a flatbuffer: a vtable says at which byte a field lies, if it is there."""

    content: mmap.mmap
    at: int

    def field(self, number: int) -> int:
        """Where a field lies, 0 if it is not there."""
        vtable = self.at - _read(self.content, "<i", self.at)
        place = 4 + 2 * number
        if place >= _read(self.content, "<H", vtable):
            return 0
        offset = _read(self.content, "<H", vtable + place)
        return self.at + offset if offset else 0

    def table(self, number: int) -> _Table | None:
        """A field that is a table."""
        place = self.field(number)
        return _Table(self.content, _pointed(self.content, place)) if place else None

    def vector(self, number: int) -> tuple[int, int]:
        """Where a field's elements begin, and how many they are."""
        place = self.field(number)
        if not place:
            return 0, 0
        start = _pointed(self.content, place)
        return start + 4, _read(self.content, "<I", start)


def _claimed(content: mmap.mmap, at: int) -> int:
    """To how many bytes the compressed buffers of the message at that byte unpack, as they say."""
    message, body = _message(content, at)
    kind = message.field(1)
    header = message.table(2)
    which = content[kind] if kind else 0
    batch = header.table(1) if which == _DICTIONARY and header is not None else header
    if which not in (_DICTIONARY, _BATCH) or batch is None or not batch.field(3):
        return 0
    first, count = batch.vector(2)
    claimed = 0
    for place in range(first, min(first + 16 * count, len(content)), 16):
        offset, length = struct.unpack_from("<qq", content, place)
        if length >= 8:
            claimed += max(0, _read(content, "<q", body + offset))
    return claimed


def _in_sequence(content: mmap.mmap) -> Iterator[int]:
    """Where messages begin, one behind the other from the file's start; up to the first that is not whole."""
    at = _FIRST
    while at + 8 <= len(content):
        try:
            message, body = _message(content, at)
            length = message.field(3)
            size = _read(content, "<q", length) if length else 0
        except (struct.error, ValueError):
            return
        yield at
        if size < 0 or body <= at:
            return
        at = body + size


def _in_footer(content: mmap.mmap) -> Iterator[int]:
    """Where the footer says that dictionaries and batches begin."""
    end = len(content) - len(_MAGIC) - 4
    if end < _FIRST or content[-len(_MAGIC) :] != _MAGIC:
        return
    try:
        start = end - _read(content, "<i", end)
        footer = _Table(content, _pointed(content, start))
        for number in (_DICTIONARY, _BATCH):
            first, count = footer.vector(number)
            for place in range(first, min(first + _BLOCK * count, end), _BLOCK):
                yield _read(content, "<q", place)
    except (struct.error, ValueError):
        return


def _message(content: mmap.mmap, at: int) -> tuple[_Table, int]:
    """The message at that byte, and where its body begins; raises ValueError at the end of the messages."""
    size = _read(content, "<I", at)
    if size == _CONTINUED:  # older files lack this mark
        at += 4
        size = _read(content, "<I", at)
    if not size:
        raise ValueError("no message")
    return _Table(content, _pointed(content, at + 4)), at + 4 + size


def _pointed(content: mmap.mmap, at: int) -> int:
    return at + int(_read(content, "<I", at))


def _read(content: mmap.mmap, form: str, at: int) -> int:
    if at < 0:
        raise ValueError("before the file")
    return int(struct.unpack_from(form, content, at)[0])
