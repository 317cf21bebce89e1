"""ROS 2's plain CDR and ROS 1 (MCAP, "Well-known message encodings"; OMG DDS-XTypes 1.3, 7.4.1).

A CDR message begins with an encapsulation header of four bytes, the second of which is the byte order: 0 big, 1 little.
Other representations (parameter lists, encoding version 2) align differently and are refused. An int64 or uint64 beyond
2^53 is rounded to the nearest float64.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cdtool.messages.batch import Batch
from cdtool.messages.columns.decoded_batch import UndecodableError
from cdtool.messages.columns.field_values import FieldPlan
from cdtool.messages.columns.member_locations import MemberLocations, MemberPath
from cdtool.messages.columns.schema_decoder import SchemaDecoder, StampPaths
from cdtool.messages.columns.sequential_walk import locate_all
from cdtool.messages.columns.uniform_layout import UniformLayout, learn_layout, row_layout_of
from cdtool.messages.columns.walk_kernel import LONG, OTHER_KIND
from cdtool.messages.columns.walk_program import Program, compile_program
from cdtool.messages.fast_path import RowLayout
from cdtool.messages.layouts.layout import Schema, Text

_ENCAPSULATION = 4


def cdr_decoder(schema: Schema) -> SchemaDecoder:
    """Return the decoder of CDR messages; raises UndecodableError for wide strings."""
    for member in schema.walk():
        if isinstance(member.kind, Text) and member.kind.wide:
            raise UndecodableError(
                f"schema '{schema.root.name}': field '{member.name}' is a wstring, whose character width depends on "
                "the writer"
            )
    return SchemaDecoder(schema, SequentialLocator(schema, _ENCAPSULATION))


@dataclass
class SequentialLocator:
    """Locates the members of messages without tags.

    `header` is the size of the encapsulation header in bytes; 0 also means that numbers are not aligned.
    """

    schema: Schema
    header: int
    _layouts: dict[tuple[MemberPath, ...], UniformLayout | None] = field(default_factory=dict)

    def locate(self, batch: Batch, paths: tuple[MemberPath, ...]) -> MemberLocations:
        """Return the members of all messages; raises UndecodableError for a schema that is too large."""
        layout = self._layouts.get(paths)
        if layout is None or (locations := layout.locate(batch)) is None:
            layout = learn_layout(self._program(paths), batch, self.header) if len(batch) else None
            self._layouts[paths] = layout
            locations = layout.locate(batch) if layout is not None else None
        return self.locate_singly(batch, paths) if locations is None else locations

    def row_layout(
        self, paths: tuple[MemberPath, ...], plans: Sequence[FieldPlan], joints: Sequence[str], stamp: StampPaths
    ) -> RowLayout | None:
        """Return the row layout of the plans' fields; None if the last messages differed."""
        layout = self._layouts.get(paths)
        return None if layout is None else row_layout_of(layout, plans, joints, stamp)

    def locate_singly(self, batch: Batch, paths: tuple[MemberPath, ...]) -> MemberLocations:
        """Return the members of all messages, located message by message."""
        locations = locate_all(self._program(paths), batch, self.header)
        if not locations.status.any():
            return locations
        first = int(np.flatnonzero(locations.status)[0])
        length = int(batch.length[first])
        reason = f"a decoding error: its {length} bytes end before its last field"
        if locations.status[first] == LONG:
            reason = f"a decoding error: its {length} bytes go on after its last field: written by another definition"
        if locations.status[first] == OTHER_KIND:
            begin = int(batch.start[first])
            shown = batch.data[begin : begin + min(length, 4)].tobytes().hex()
            reason = f"not plain CDR (starts with {shown or 'nothing'})"
        return replace(locations, status=(locations.status != 0).astype(np.uint8), reason=reason)

    def _program(self, paths: tuple[MemberPath, ...]) -> Program:
        return compile_program(self.schema, paths, self.header > 0)


def ros1_decoder(schema: Schema) -> SchemaDecoder:
    """Return the decoder of ROS 1 messages: little-endian, without alignment (http://wiki.ros.org/roscpp)."""
    return SchemaDecoder(schema, SequentialLocator(schema, header=0))
