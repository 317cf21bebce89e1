"""The exact times of a file that cdtool converted: a message's own stamp is a whole number of nanoseconds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from cdtool.channels import ChannelMap, ChannelSource
from cdtool.columns import Piece
from cdtool.formats.pieces import PieceRun, Pieces
from cdtool.formats.source import Source

# The metadata record of such a file, the package of its message types, and the field that holds a message's time [s].
METADATA = "cdtool.converted"
PACKAGE = "cdtool_msgs/msg"
EXACT_TIME = "time_s"


def exact_times(path: Path) -> dict[str, str] | None:
    """The metadata of a file that cdtool converted, else None: its topics then hold exact times."""
    from mcap.reader import make_reader

    try:
        with path.open("rb") as file:
            for record in make_reader(file).iter_metadata():
                if record.name == METADATA:
                    return dict(record.metadata)
    except Exception:  # a damaged file holds no metadata that could be relied on
        return None
    return None


def with_exact_times(source: Source, wanted: ChannelMap, read: Callable[[ChannelMap], Source]) -> Source:
    """The source, with the times that were written where cdtool converted the file: its stamps are whole nanoseconds.

    They count from the first message on, so that a log whose clock began at 5 s would else begin at 0 s. `read` gives
    the fields of a map.
    """
    converted = any(topic.schema.startswith(f"{PACKAGE}/") for topic in source.topics.values())
    metadata = exact_times(source.path) if converted else None
    if metadata is None:
        return source
    topics = dict.fromkeys(item.topic for item in wanted.sources if item.described in source.columns)
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
    """The pieces; those of a converted file with the times that were written, which are columns no more."""
    metadata = exact_times(path)
    if metadata is None:
        return (yield from pieces)
    origin = float(metadata.get("cdtool.origin_s", "0"))
    run = PieceRun(pieces)
    for piece in run:
        time = piece.values.get(f"{piece.clock} {EXACT_TIME}")
        values = {name: column for name, column in piece.values.items() if not name.endswith(f" {EXACT_TIME}")}
        yield Piece(piece.clock, piece.time if time is None else time, values, piece.rows, origin)
    columns = {name: item for name, item in run.source.columns.items() if not name.endswith(f" {EXACT_TIME}")}
    return replace(run.source, columns=columns, origin=origin)
