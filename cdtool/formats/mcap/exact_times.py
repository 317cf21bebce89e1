"""The exact times of a file that cdtool converted, whose log times are rounded to whole nanoseconds."""

from __future__ import annotations

from dataclasses import replace

from cdtool.formats.columns import Piece
from cdtool.formats.mcap.file_bytes import FileBytes
from cdtool.formats.mcap.records import LARGEST, PREFIX, DamageError, Opcode, parse
from cdtool.formats.mcap.summary import McapSummary
from cdtool.formats.pieces import PieceRun, Pieces
from cdtool.formats.source import stated_origin

# The metadata record of such a file, the package of its message types, and the field with a message's time [s].
METADATA = "cdtool.converted"
PACKAGE = "cdtool_msgs/msg"
EXACT_TIME = "time_s"


def exact_origin(file: FileBytes, summary: McapSummary, after_header: int) -> float | None:
    """Return the time [s] of the zero of the exact times; None for a file that cdtool did not convert."""
    for at in (*(index.offset for index in summary.metadata if index.name == METADATA), after_header):
        head = file.read(at, PREFIX)
        if len(head) == PREFIX and head[0] == Opcode.METADATA:
            try:
                record = parse(head[0], file.read(at + PREFIX, min(int.from_bytes(head[1:], "little"), LARGEST)))
            except DamageError:
                continue
            if record.name == METADATA:
                return stated_origin(record.metadata.get("cdtool.origin_s", "0"))
    return None


def with_exact_times(pieces: Pieces, origin: float) -> Pieces:
    """Yield the pieces of a converted file with the exact times that were written, whose columns are removed."""
    run = PieceRun(pieces)
    for piece in run:
        time = piece.values.get(f"{piece.clock} {EXACT_TIME}")
        values = {name: column for name, column in piece.values.items() if not name.endswith(f" {EXACT_TIME}")}
        yield Piece(piece.clock, piece.time if time is None else time, values, piece.rows, origin)
    columns = {name: column for name, column in run.source.columns.items() if not name.endswith(f" {EXACT_TIME}")}
    return replace(run.source, columns=columns, origin=origin)
