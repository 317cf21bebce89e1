"""Read the rows of a text table, all at once or block by block, with a compiled loop.

The loop reads regular lines. Any other line is a row with unusual notation, a line that is skipped and reported
(comment, blank line, repeated header, NUL bytes, incomplete last line), or an error with its line number.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from itertools import chain, islice, starmap
from pathlib import Path

import numpy as np

from cdtool.cores import usable_cores
from cdtool.formats.csv.blank_lines import fill_blank_lines
from cdtool.formats.csv.cells import NARROW_BLANKS
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.irregular_lines import IrregularLine, IrregularLines
from cdtool.formats.csv.marks import thousands_byte
from cdtool.formats.csv.number_clock import read_whole_numbers
from cdtool.formats.csv.number_kernel import powers
from cdtool.formats.csv.row_arrays import Rows
from cdtool.formats.csv.row_kernel import EMPTY, LEFT, MISSING_STAMP, STAMP, Integers, count_lines, read_rows
from cdtool.formats.csv.short_rows import complete_blocks
from cdtool.formats.csv.stamp_kernel import STEPS
from cdtool.formats.csv.text import AFTER, Bytes
from cdtool.formats.csv.word_cells import WordCells

_THREADS = 4


@dataclass(frozen=True)
class _Block:
    """The result of one block: `rows` rows of `arrays` from row `first`, the number of lines, and irregular lines.

    `blank` are the blank lines; `empty` are blank lines that are rows; `unfinished`: the last line has no end.
    """

    arrays: Rows
    first: int
    rows: int
    lines: int
    blank: Integers
    empty: Integers
    irregular: list[IrregularLine]
    unfinished: bool


class RowReader:
    """Reads the rows of one file. `numeric` and `stamped` are the requested columns, by number, in order.

    `whole` are columns of integers with more digits than float64 can represent; they follow the stamps.
    """

    def __init__(
        self,
        path: Path,
        dialect: Dialect,
        numeric: Sequence[int],
        stamped: Sequence[int],
        whole: Sequence[int] = (),
    ) -> None:
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
        self.whole = tuple(whole)
        self.shape = (len(numeric), len(stamped) + len(whole))
        self.ended = True
        self.words: WordCells | None = None  # the columns of categories

    def read(self, irregular: IrregularLines) -> Rows:
        """Return all rows in one pair of arrays, into which several threads write; raises RecordingError."""
        if self.dialect.text.content is not None:
            return _joined(list(self.pieces(irregular)), self.allocate(0))
        whole = self.allocate(self.dialect.text.count_lines(self.dialect.offset, count_lines))
        parts = list(self.pieces(irregular, whole))
        count = sum(part.count for part in parts)
        not_rows = np.concatenate([whole.not_rows, *(part.not_rows for part in parts)])
        return Rows(whole.numbers[:, :count], whole.stamps[:, :count], count, whole.first_line, not_rows)

    def pieces(self, irregular: IrregularLines, whole: Rows | None = None) -> Iterator[Rows]:
        """Yield the rows block by block, in arrays of their own or consecutively in `whole`.

        Irregular lines are passed to `irregular`. Raises RecordingError with the first line that cannot be read.
        """
        line, end = self.dialect.first_line, 0
        for block in self._read_ahead(whole):
            self.ended = not block.unfinished
            for each in block.irregular:
                irregular.read(each, line, block.arrays)
            irregular.blank += (block.blank + line).tolist()
            irregular.empty += (block.empty + line).tolist()
            dropped = irregular.end_block(range(block.first, block.first + block.rows))
            not_rows = np.sort(np.concatenate([block.blank + line, np.array([*dropped.values()], dtype=np.int64)]))
            begin = 0 if whole is None else end
            end = _compact(block, sorted(dropped), begin)
            numbers, stamps = block.arrays.numbers[:, begin:end], block.arrays.stamps[:, begin:end]
            yield Rows(numbers, stamps, end - begin, line, not_rows)
            line += block.lines

    def allocate(self, count: int) -> Rows:
        """Return uninitialised arrays for `count` rows."""
        numbers, stamps = np.empty((self.shape[0], count)), np.empty((self.shape[1], count), dtype=np.int64)
        return Rows(numbers, stamps, 0, self.dialect.first_line)

    def _raw_blocks(self, whole: Rows | None) -> Iterator[tuple[bytearray, int, int, int, Rows]]:
        """Yield per block the bytes, the size of its lines, the first row, the number of rows, and their arrays."""
        dialect = self.dialect
        end, first, blocks = dialect.text.line_end[0], 0, dialect.text.blocks(dialect.offset)
        if dialect.short_rows:
            blocks = complete_blocks(blocks, dialect)
        for block, size in blocks:
            count = int(count_lines(np.frombuffer(block, dtype=np.uint8, count=size), end)) + (block[size - 1] != end)
            yield block, size, first, count, self.allocate(count) if whole is None else whole
            first += 0 if whole is None else count

    def _read_ahead(self, whole: Rows | None) -> Iterator[_Block]:
        """Yield blocks in the file's order, read ahead by threads (the loop runs without the interpreter lock)."""
        workers = min(_THREADS, usable_cores())
        blocks = self._raw_blocks(whole)
        begin = list(islice(blocks, 2))
        if len(begin) < 2 or workers == 1:
            yield from starmap(self._block, chain(begin, blocks))
            return
        pending: deque[Future[_Block]] = deque()
        with ThreadPoolExecutor(workers) as pool:
            try:
                for block in chain(begin, blocks):
                    pending.append(pool.submit(self._block, *block))
                    if len(pending) > workers:
                        yield pending.popleft().result()
                while pending:
                    yield pending.popleft().result()
            finally:
                pool.shutdown(cancel_futures=True)

    def _block(self, block: bytearray, size: int, first: int, count: int, arrays: Rows) -> _Block:
        end = self.dialect.text.line_end
        unfinished = block[size - 1] not in b"\r\n"
        if block[size - 1 : size] != end:  # the line ends after the block replace the missing one
            size += 1
        if self.dialect.marks.thousands in NARROW_BLANKS:
            encoding = "utf-8" if self.dialect.text.recoded else self.dialect.text.encoding
            lines = block[:size].replace(self.dialect.marks.thousands.encode(encoding), b"'")
            block, size = lines + end * AFTER, len(lines)
        empty = np.empty(0, dtype=np.int64)
        if self.dialect.blank_is_missing:
            block, size, empty = fill_blank_lines(block, size, end)
        if self.words is not None:
            content = self.words.coded(bytes(memoryview(block)[:size]))
            block, size = bytearray(content + end * AFTER), len(content)
        data = np.frombuffer(block, dtype=np.uint8)
        blank = np.empty(count, dtype=np.int64)
        irregular = np.empty((count, 4), dtype=np.int64)
        counts = np.zeros(4, dtype=np.int64)
        read_rows(
            data,
            size,
            self._marks(),
            self.targets,
            self.programs,
            arrays.numbers,
            arrays.stamps,
            first,
            blank,
            irregular,
            counts,
            *powers(),
        )
        if self.whole:
            self._read_whole(data[:size], arrays.stamps[:, first : first + int(counts[0])], blank[: counts[2]])
        final = count - 1 if unfinished else -1
        listed = [
            IrregularLine(line, row, bytes(block[begin:stop]), line == final)
            for line, row, begin, stop in irregular[: counts[3]].tolist()
        ]
        return _Block(
            arrays, first, int(counts[0]), int(counts[1]), blank[: counts[2]].copy(), empty, listed, unfinished
        )

    def _read_whole(self, data: Bytes, stamps: Integers, blank: Integers) -> None:
        """Fill the last of `stamps` (m, n) with the columns of integers; `blank` are the lines that are not rows."""
        for row, column in zip(stamps[-len(self.whole) :], self.whole, strict=True):
            numbers, is_read = read_whole_numbers(data, self.dialect, column, blank)
            row[:] = np.where(is_read, numbers, MISSING_STAMP)

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


def _joined(parts: Sequence[Rows], none: Rows) -> Rows:
    """Return the rows of a short file in one pair of arrays; `none` are no rows."""
    if len(parts) == 1:  # the usual case, without a copy
        return parts[0]
    parts = [none, *parts]
    numbers, stamps = (
        np.concatenate(tables, axis=1) for tables in zip(*((it.numbers, it.stamps) for it in parts), strict=True)
    )
    not_rows = np.concatenate([part.not_rows for part in parts])
    return Rows(numbers, stamps, sum(part.count for part in parts), none.first_line, not_rows)


def _compact(block: _Block, dropped: Sequence[int], to: int) -> int:
    """Move a block's rows, without the dropped ones, to consecutive rows from row `to`; return their end."""
    start = block.first
    for stop in (*dropped, block.first + block.rows):
        if to != start and stop > start:
            for table in (block.arrays.numbers, block.arrays.stamps):
                table[:, to : to + stop - start] = table[:, start:stop]
        to += stop - start
        start = stop + 1
    return to
