"""A log in parts, as rosbag2 splits one, piece by piece."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np

from cdtool.formats.parts import joined_sources
from cdtool.formats.pieces import Piece, Pieces, Run, header, read_pieces
from cdtool.formats.reading import choose_format, has_topics, log_parts
from cdtool.formats.source import Source


def log_pieces(log: Path, keys: Collection[str] | None = None) -> Pieces:
    """All numeric columns of a file, or of the folder that rosbag2 made, or at least `keys`; raises RecordingError."""
    if not log.is_dir():
        return read_pieces(choose_format(log), log, keys)
    return _of_parts(log)


def in_time_order(log: Path) -> bool:
    """The rows are to be in the order of their times, as messages are, and not as they stand."""
    return log.is_dir() or has_topics(choose_format(log))


def _of_parts(folder: Path) -> Pieces:
    """The parts one after the other, all times from the start of the first."""
    parts = sorted(log_parts(folder), key=lambda part: (_first_time(part), part.name))
    start: float | None = None
    sources: list[Source] = []
    for part in parts:
        run = Run(read_pieces(choose_format(part), part))
        spans: dict[str, list[float]] = {}
        for piece in run:
            start = piece.origin if start is None else start
            if piece.time is None or not piece.rows:
                continue
            for name in piece.values:
                first, last = spans.setdefault(name, [float(piece.time[0]), -np.inf])
                spans[name] = [min(first, float(piece.time[0])), max(last, float(piece.time[-1]))]
            yield replace(piece, time=piece.time + (piece.origin - start), origin=start)
        sources.append(_spanned(run.source, spans))
    joined = joined_sources(folder, sources)
    return replace(joined, columns={name: header(column) for name, column in joined.columns.items()})


def _first_time(part: Path) -> float:
    """When a part begins [s]; parts without any message come last."""
    pieces = read_pieces(choose_format(part), part)
    try:
        piece: Piece | None = next(pieces, None)
    finally:
        pieces.close()
    return np.inf if piece is None or piece.time is None or not piece.rows else piece.origin + float(piece.time[0])


def _spanned(source: Source, spans: dict[str, list[float]]) -> Source:
    """Two rows a column, its first and its last time: by them it is seen whether parts overlap."""
    columns = {
        name: replace(column, time=np.array(spans[name]), values=np.full((2, *column.values.shape[1:]), np.nan))
        if name in spans
        else column
        for name, column in source.columns.items()
    }
    return replace(source, columns=columns)
