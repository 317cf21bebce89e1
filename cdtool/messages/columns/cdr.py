"""ROS 2's plain CDR and ROS 1 (MCAP, "Well-known message encodings"; OMG DDS-XTypes 1.3, 7.4.1).

A CDR message begins with four bytes of encapsulation; the second one is the byte order: 0 big, 1 little. Other kinds
(parameter lists, encoding version 2) align differently and are refused. An int64 or uint64 beyond 2^53 is rounded to
the nearest float64.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from cdtool.messages.batch import Batch
from cdtool.messages.columns.decoded_batch import UndecodableError
from cdtool.messages.columns.member_locations import Found, Place
from cdtool.messages.columns.schema_decoder import TypedDecoder
from cdtool.messages.columns.sequential_walk import walk_all
from cdtool.messages.columns.uniform_layout import Pattern, pattern_of
from cdtool.messages.columns.walk_kernel import LONG, OTHER_KIND
from cdtool.messages.columns.walk_program import Program, compile_program
from cdtool.messages.layouts.layout import Schema, Text

_ENCAPSULATION = 4


def cdr_decoder(schema: Schema) -> TypedDecoder:
    """The decoder of CDR messages; raises UndecodableError for wide strings."""
    for member in schema.walk():
        if isinstance(member.kind, Text) and member.kind.wide:
            raise UndecodableError(
                f"schema '{schema.root.name}': field '{member.name}' is a wstring, whose characters are written "
                "in different widths"
            )
    return TypedDecoder(schema, WalkFinder(schema, _ENCAPSULATION))


@dataclass
class WalkFinder:
    """Places of untagged messages; `header` bytes of encapsulation, 0: not aligned either."""

    schema: Schema
    header: int
    _programs: dict[tuple[Place, ...], Program] = field(default_factory=dict)
    _patterns: dict[tuple[Place, ...], Pattern | None] = field(default_factory=dict)

    def find(self, batch: Batch, places: tuple[Place, ...]) -> Found:
        """The places of all messages; raises UndecodableError for a schema that is too large."""
        pattern = self._patterns.get(places)
        if pattern is None or (found := pattern.found(batch)) is None:
            pattern = pattern_of(self._program(places), batch, self.header) if len(batch) else None
            self._patterns[places] = pattern
            found = pattern.found(batch) if pattern is not None else None
        return self.checked(batch, places) if found is None else found

    def pattern(self, places: tuple[Place, ...]) -> Pattern | None:
        """What the last messages had in common; None where they had nothing."""
        return self._patterns.get(places)

    def checked(self, batch: Batch, places: tuple[Place, ...]) -> Found:
        """The same, found message by message."""
        found = walk_all(self._program(places), batch, self.header)
        if not found.status.any():
            return found
        first = int(np.flatnonzero(found.status)[0])
        length = int(batch.length[first])
        reason = f"a decoding error: its {length} bytes end before its last field"
        if found.status[first] == LONG:
            reason = f"a decoding error: its {length} bytes go on behind its last field: written by another definition"
        if found.status[first] == OTHER_KIND:
            begin = int(batch.start[first])
            shown = batch.data[begin : begin + min(length, 4)].tobytes().hex()
            reason = f"not plain CDR (starts with {shown or 'nothing'})"
        return replace(found, status=(found.status != 0).astype(np.uint8), reason=reason)

    def _program(self, places: tuple[Place, ...]) -> Program:
        if places not in self._programs:
            self._programs[places] = compile_program(self.schema, places, self.header > 0)
        return self._programs[places]


def ros1_decoder(schema: Schema) -> TypedDecoder:
    """Return the decoder of ROS 1 messages: little-endian, without alignment (http://wiki.ros.org/roscpp)."""
    return TypedDecoder(schema, WalkFinder(schema, header=0))
