"""The rows of a text table: read block by block with a compiled loop, every line accounted for.

A plain line is read by the loop. Every other one comes here: it is a row written in an unusual way, a line that is
skipped and named (comment, blank line, the header again, NUL bytes, the half-written end), or an error with its line.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdtool.cores import usable_cores
from cdtool.formats.csv.blank_lines import filled
from cdtool.formats.csv.cells import NARROW_BLANKS
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.marks import thousands_byte
from cdtool.formats.csv.number_kernel import powers
from cdtool.formats.csv.odd_lines import OddLine, OddLines
from cdtool.formats.csv.row_arrays import Rows
from cdtool.formats.csv.row_kernel import EMPTY, LEFT, STAMP, Integers, count_lines, read_rows
from cdtool.formats.csv.stamp_kernel import STEPS
from cdtool.formats.csv.text import AFTER

_THREADS = 4


@dataclass(frozen=True)
class _Read:
    """What one block gave: its rows and lines, and those that are not plain; `empty` are blank lines that are rows."""

    rows: int
    lines: int
    blank: Integers
    empty: Integers
    odd: list[OddLine]


class RowReader:
    """Reads the rows of one file. `numeric` and `stamped` are the columns wanted, by their number, in order."""

    def __init__(self, path: Path, dialect: Dialect, numeric: Sequence[int], stamped: Sequence[int]) -> None:
        self.path = path
        self.dialect = dialect
        self.targets = np.full(dialect.width, LEFT, dtype=np.int64)
        self.targets[list(numeric)] = np.arange(len(numeric))
        self.targets[list(stamped)] = STAMP - np.arange(len(stamped))
        if dialect.trailing:
            self.targets[-1] = EMPTY
        self.programs = np.zeros((len(stamped), STEPS), dtype=np.int64)
        for k, column in enumerate(stamped):
            self.programs[k] = dialect.stamped[column].layouts[0].program
        self.shape = (len(numeric), len(stamped))
        self.ended = True

    def read(self, odd: OddLines) -> Rows:
        """All rows; lines that are not plain go to `odd`. Raises RecordingError with the line of the first bad one."""
        lines = self.dialect.text.count_lines(self.dialect.offset, count_lines)
        rows = Rows(
            np.empty((self.shape[0], lines)),
            np.empty((self.shape[1], lines), dtype=np.int64),
            0,
            self.dialect.first_line,
        )
        runs: list[tuple[int, int]] = []
        blank: list[Integers] = []
        line = self.dialect.first_line
        place = 0
        for done, room in self._blocks(rows):
            blank.append(done.blank + line)
            odd.empty += (done.empty + line).tolist()
            for item in done.odd:
                odd.take(item, line, rows)
            runs.append((place, done.rows))
            place += room
            line += done.lines
        skipped = odd.dropped
        places = (row for start, count in reversed(runs) for row in range(start + count - 1, start - 1, -1))
        odd.finish(next((row for row in places if row not in skipped), -1))
        rows.count = _close_up(rows, runs, sorted(skipped))
        odd.blank = [line for part in blank for line in part.tolist()]
        rows.not_rows = np.sort(np.concatenate([*blank, np.array(sorted(skipped.values()), dtype=np.int64)]))
        rows.numbers, rows.stamps = rows.numbers[:, : rows.count], rows.stamps[:, : rows.count]
        return rows

    def _counted(self) -> Iterator[tuple[bytearray, int, int]]:
        """Blocks, the bytes that belong to their lines, and how many lines these are."""
        end = self.dialect.text.line_end[0]
        for block, size in self.dialect.text.blocks(self.dialect.offset):
            count = int(count_lines(np.frombuffer(block, dtype=np.uint8, count=size), end))
            yield block, size, count + (block[size - 1] != end)

    def _blocks(self, rows: Rows) -> Iterator[tuple[_Read, int]]:
        """Blocks in the file's order, read ahead by threads (the loop runs without the interpreter lock)."""
        place = 0
        workers = min(_THREADS, usable_cores())
        pending: deque[tuple[Future[_Read], int]] = deque()
        blocks = self._counted()
        first = next(blocks, None)
        second = next(blocks, None) if first else None
        if second is None or workers == 1:
            for block, size, count in (item for part in ([first], [second], blocks) for item in part if item):
                yield self._block(block, size, place, count, rows), count
                place += count
            return
        _ = read_rows.compiled  # once, not in every thread
        with ThreadPoolExecutor(workers) as pool:
            try:
                for block, size, count in (item for part in ([first], [second], blocks) for item in part if item):
                    pending.append((pool.submit(self._block, block, size, place, count, rows), count))
                    place += count
                    if len(pending) > workers:
                        future, room = pending.popleft()
                        yield future.result(), room
                while pending:
                    future, room = pending.popleft()
                    yield future.result(), room
            finally:
                pool.shutdown(cancel_futures=True)

    def _block(self, block: bytearray, size: int, place: int, count: int, rows: Rows) -> _Read:
        end = self.dialect.text.line_end
        unfinished = block[size - 1] not in b"\r\n"
        self.ended = self.ended and not unfinished
        if block[size - 1 : size] != end:  # the line ends behind the block stand in for the one that lacks
            size += 1
        if self.dialect.marks.thousands in NARROW_BLANKS:
            encoding = "utf-8" if self.dialect.text.recoded else self.dialect.text.encoding
            lines = block[:size].replace(self.dialect.marks.thousands.encode(encoding), b"'")
            block, size = lines + end * AFTER, len(lines)
        empty = np.empty(0, dtype=np.int64)
        if self.dialect.blank_is_missing:
            block, size, empty = filled(block, size, end)
        data = np.frombuffer(block, dtype=np.uint8)
        blank = np.empty(count, dtype=np.int64)
        odd = np.empty((count, 4), dtype=np.int64)
        counts = np.zeros(4, dtype=np.int64)
        read_rows(
            data,
            size,
            self._marks(),
            self.targets,
            self.programs,
            rows.numbers,
            rows.stamps,
            place,
            blank,
            odd,
            counts,
            *powers(),
        )
        final = count - 1 if unfinished else -1
        listed = [
            OddLine(line, row, bytes(block[first:last]), line == final)
            for line, row, first, last in odd[: counts[3]].tolist()
        ]
        return _Read(int(counts[0]), int(counts[1]), blank[: counts[2]].copy(), empty, listed)

    def _marks(self) -> Integers:
        dialect = self.dialect
        comment = ord(dialect.comment[0]) if dialect.comment and ord(dialect.comment[0]) < 128 else -1
        return np.array(
            [
                dialect.text.line_end[0],
                ord(dialect.separator),
                ord(dialect.marks.decimal),
                thousands_byte(dialect.marks.thousands),
                ord('"'),
                comment,
            ],
            dtype=np.int64,
        )


def _close_up(rows: Rows, runs: Sequence[tuple[int, int]], dropped: Sequence[int]) -> int:
    """Move the rows together over the places of lines that are no rows; returns how many rows there are."""
    to = 0
    gone = deque(dropped)
    for place, count in runs:
        start, end = place, place + count
        while start < end:
            stop = gone.popleft() if gone and gone[0] < end else end
            if to != start and stop > start:
                for table in (rows.numbers, rows.stamps):
                    table[:, to : to + stop - start] = table[:, start:stop]
            to += stop - start
            start = stop + 1 if stop < end else end
    return to
