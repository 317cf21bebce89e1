"""A log in parts, as rosbag2 splits one, piece by piece."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cdtool.columns import Piece
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.formats.pieces import Pieces, Run, header, read_pieces
from cdtool.formats.source import Format, Source
from cdtool.ingest.parts import joined_sources, lost_findings
from cdtool.ingest.reading import choose_format, has_topics, log_parts

# Opens a file of a format, for some of its columns or all.
ReadFile = Callable[[Format, Path, Collection[str] | None], Pieces]


@dataclass(frozen=True)
class FoundParts:
    """The parts of a log in a folder: those that hold something in the order of their first times, and the others.

    `unread` are those that cannot be read at all, with the reason.
    """

    folder: Path
    filled: tuple[Path, ...]
    empty: tuple[Path, ...]
    unread: Mapping[Path, RecordingError]

    @classmethod
    def of(cls, folder: Path) -> FoundParts:
        """Look into each part; raises RecordingError where none can be read."""
        starts: dict[Path, float] = {}
        unread: dict[Path, RecordingError] = {}
        for part in log_parts(folder):
            try:
                starts[part] = _first_time(part)
            except RecordingError as fault:
                unread[part] = fault
        if not starts:
            raise next(iter(unread.values()))
        known = sorted((start, part.name, part) for part, start in starts.items() if start < np.inf)
        empty = tuple(part for part, start in starts.items() if start == np.inf)
        return cls(folder, tuple(part for _, _, part in known), empty, unread)

    @property
    def every(self) -> tuple[Path, ...]:
        """All files of the log."""
        return (*self.filled, *self.empty, *self.unread)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What is lost: parts that are not there, and those that cannot be read."""
        return lost_findings(self.folder, self.every, self.unread)


def log_pieces(log: Path, keys: Collection[str] | None = None, read: ReadFile = read_pieces) -> Pieces:
    """All numeric columns of a file, or of the folder that rosbag2 made, or at least `keys`; raises RecordingError.

    A part that cannot be read is a loss, as long as another one can.
    """
    if not log.is_dir():
        return read(choose_format(log), log, keys)
    return _of_parts(log, keys, read)


def in_time_order(log: Path) -> bool:
    """The rows are to be in the order of their times, as messages are, and not as they stand."""
    return log.is_dir() or has_topics(choose_format(log))


def _of_parts(folder: Path, keys: Collection[str] | None, read: ReadFile) -> Pieces:
    """The parts one after the other, all times from the start of the first."""
    parts = FoundParts.of(folder)
    start: float | None = None
    sources: list[Source] = []
    for part in (*parts.filled, *parts.empty):
        run = Run(read(choose_format(part), part, keys))
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
    joined = joined_sources(folder, sources, parts.unread)
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
