"""The exact times of a file that cdtool converted, whose log times are rounded to whole nanoseconds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from cdtool.channels import ChannelMap, ChannelSource
from cdtool.columns import Piece
from cdtool.formats.pieces import PieceRun, Pieces
from cdtool.formats.source import Source

# The metadata record of such a file, the package of its message types, and the field with a message's time [s].
METADATA = "cdtool.converted"
PACKAGE = "cdtool_msgs/msg"
EXACT_TIME = "time_s"


def exact_times(path: Path) -> dict[str, str] | None:
    """Return the metadata of a file that cdtool converted, whose topics have exact times; None for any other file."""
    from mcap.reader import make_reader

    try:
        with path.open("rb") as file:
            for record in make_reader(file).iter_metadata():
                if record.name == METADATA:
                    return dict(record.metadata)
    except Exception:  # the metadata of a damaged file are not reliable
        return None
    return None


def with_exact_times(source: Source, wanted: ChannelMap, read: Callable[[ChannelMap], Source]) -> Source:
    """Return the source; if cdtool converted the file, with the exact times that were written.

    Log times are whole nanoseconds relative to the first message: without the exact times, a log whose clock started at
    5 s would start at 0 s. `read` returns the fields of a channel map.
    """
    converted = any(topic.schema.startswith(f"{PACKAGE}/") for topic in source.topics.values())
    metadata = exact_times(source.path) if converted else None
    if metadata is None:
        return source
    topics = dict.fromkeys(each.topic for each in wanted.sources if each.described in source.columns)
    clocks = tuple(ChannelSource("event", topic=topic, field=EXACT_TIME) for topic in topics)
    exact = read(replace(wanted, sources=clocks))
    columns = {}
    for name, column in source.columns.items():
        clock = exact.columns.get(f"{name.partition(' ')[0]} {EXACT_TIME}")
        if clock is None or len(clock.values) != len(column.values):
            return source
        columns[name] = replace(column, time=clock.values)
    return replace(source, columns=columns, origin=float(metadata.get("cdtool.origin_s", "0")))


def with_exact_pieces(pieces: Pieces, path: Path) -> Pieces:
    """Yield the pieces; for a converted file with the exact times that were written, whose columns are removed."""
    metadata = exact_times(path)
    if metadata is None:
        return (yield from pieces)
    origin = float(metadata.get("cdtool.origin_s", "0"))
    run = PieceRun(pieces)
    for piece in run:
        time = piece.values.get(f"{piece.clock} {EXACT_TIME}")
        values = {name: column for name, column in piece.values.items() if not name.endswith(f" {EXACT_TIME}")}
        yield Piece(piece.clock, piece.time if time is None else time, values, piece.rows, origin)
    columns = {name: column for name, column in run.source.columns.items() if not name.endswith(f" {EXACT_TIME}")}
    return replace(run.source, columns=columns, origin=origin)
