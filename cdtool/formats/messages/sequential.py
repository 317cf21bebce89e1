"""One message of ROS 2's plain CDR or of ROS 1 (MCAP, "Well-known message encodings"; OMG DDS-XTypes 1.3, 7.4.1).

A CDR message begins with an encapsulation header of four bytes, the second of which is the byte order: 0 big, 1 little.
Numbers are aligned to their size, counted from the byte after it. Other representations (parameter lists, encoding
version 2) align differently and are refused. ROS 1 is little-endian, without header and alignment
(http://wiki.ros.org/roscpp).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cdtool.formats.messages.alike import DamagedMessageError, Example
from cdtool.formats.messages.decoded_batch import UndecodableError
from cdtool.formats.messages.layout import TEXT, Layout, Member

PADDING = 3  # bytes that may follow a CDR message: some writers fill it up to a multiple of 4


def walk_cdr(layout: Layout, payload: bytes) -> Example:
    """Return the layout of a message; raises DamagedMessageError."""
    if len(payload) < 4 or payload[0] or payload[1] > 1:
        raise DamagedMessageError(f"not plain CDR (starts with {payload[:4].hex() or 'nothing'})")
    walk = _Walk(layout, payload, 4, is_big=not payload[1])
    walk.example.share(0, 2)
    return walk.finished()


def walk_ros1(layout: Layout, payload: bytes) -> Example:
    """Return the layout of a message; raises DamagedMessageError."""
    return _Walk(layout, payload, 0, is_big=False).finished()


class _Walk:
    """A walk over the members of one message; `at` is the byte that it has reached."""

    def __init__(self, layout: Layout, payload: bytes, header: int, is_big: bool) -> None:
        self.example = Example(payload)
        self.at = header
        self._layout, self._payload, self._header = layout, payload, header
        self._order, self._code = ("big", ">") if is_big else ("little", "<")
        # One member per byte, and others: a schema of a hundred lines can nest any number of empty ones.
        self._left = 20_000 + len(payload)

    def finished(self) -> Example:
        """Walk the whole message; raises DamagedMessageError, or UndecodableError for a schema that is too large."""
        self.example.content = self._message(self._layout)
        over = len(self._payload) - self.at
        if over > (PADDING if self._header else 0):
            raise DamagedMessageError(
                f"a decoding error: its {len(self._payload)} bytes go on after its last field: written by another "
                "definition"
            )
        return self.example

    def _message(self, layout: Layout) -> dict[str, Any]:
        if not layout.members and self._header:
            self._advance(1)
        return {member.name: self._member(member) for member in layout.members}

    def _member(self, member: Member) -> Any:
        self._left -= 1
        if self._left < 0:
            raise UndecodableError(f"schema '{self._layout.name}' is too large")
        kind = member.kind
        if not member.array:
            if isinstance(kind, Layout):
                return self._message(kind)
            return self._text(member) if kind == TEXT else self._numbers(kind, 1)[0]
        count = self._length() if member.length is None else member.length
        if isinstance(kind, Layout):
            return self._messages(kind, count)
        if kind != TEXT:
            return self._numbers(kind, count) if count else range(0)
        self._check(count)  # every string has at least four bytes
        return [self._text(member) for _ in range(count)]

    def _messages(self, layout: Layout, count: int) -> Sequence[Any]:
        """Walk an array of messages; if nothing in the first two has a length, the others are like the second."""
        lengths = len(self.example.shared)
        begins: list[int] = [self.at]
        found: list[Any] = []
        while len(found) < count and (len(found) < 2 or len(self.example.shared) > lengths):
            found.append(self._message(layout))
            begins.append(self.at)
        if len(found) == count:
            return found
        self._advance((count - 2) * (begins[2] - begins[1]))
        return _Elements(self, layout, begins, count)

    def element(self, layout: Layout, at: int) -> dict[str, Any]:
        """Return the message at this byte."""
        self.at = at
        return self._message(layout)

    def _numbers(self, kind: str, count: int) -> range:
        size = int(kind[1:] or 1)  # which is also the alignment
        self._align(size)
        begin = self.at
        self._advance(count * size)
        return self.example.numbers(begin, count, kind if kind == "?" else self._code + kind, size)

    def _text(self, member: Member) -> str:
        size = self._length()
        begin = self.at
        self._advance(size)
        if member.array and member.name == "name":  # it may name the elements of an array
            self.example.share(begin, size)
        text = self._payload[begin : self.at]
        return (text.removesuffix(b"\0") if self._header else text).decode(errors="replace")

    def _length(self) -> int:
        self._align(4)
        begin = self.at
        self._advance(4)
        self.example.share(begin, 4)
        return int.from_bytes(self._payload[begin : self.at], self._order)  # type: ignore[arg-type]

    def _align(self, size: int) -> None:
        if self._header:
            self.at += -(self.at - self._header) % size

    def _advance(self, count: int) -> None:
        self._check(count)
        self.at += count

    def _check(self, count: int) -> None:
        if count > len(self._payload) - self.at:
            raise DamagedMessageError(f"a decoding error: its {len(self._payload)} bytes end before its last field")


class _Elements(Sequence[Any]):
    """An array of messages alike, each of which is walked when it is asked for: a cloud has many points."""

    def __init__(self, walk: _Walk, layout: Layout, begins: list[int], count: int) -> None:
        self._walk, self._layout, self._begins, self._count = walk, layout, begins, count

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, number: Any) -> Any:
        if not 0 <= number < self._count:
            raise IndexError(number)
        first, second, third = self._begins
        return self._walk.element(self._layout, second + (number - 1) * (third - second) if number else first)
