"""The rows of a text table block by block, for tables that need not fit into memory."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np

from cdtool.formats.csv.odd_lines import OddLines
from cdtool.formats.csv.row_arrays import Rows
from cdtool.formats.csv.row_kernel import read_rows
from cdtool.formats.csv.rows import RowReader

_AHEAD = 2


class RowPieces(RowReader):
    """As RowReader, but the rows of one block at a time; the next blocks are read while one is used."""

    def pieces(self, odd: OddLines) -> Iterator[Rows]:
        """The rows block by block; lines that are not plain go to `odd`. Raises RecordingError as `read` does."""
        line = self.dialect.first_line
        for done, rows in self._ahead():
            rows.first_line = line
            words = len(odd.words)
            for item in done.odd:
                odd.take(item, line, rows)
            dropped, odd.dropped = odd.dropped, {}
            kept = np.ones(done.rows, dtype=bool)
            kept[list(dropped)] = False
            if words:  # of an earlier block: a footer, unless rows follow
                odd.words[0] = (-1, *odd.words[0][1:])
            odd.finish(int(np.flatnonzero(kept)[-1]) if kept.any() else -1)
            odd.blank += (done.blank + line).tolist()
            odd.empty += (done.empty + line).tolist()
            rows.not_rows = np.sort(np.concatenate([done.blank + line, np.array(sorted(dropped.values()), np.int64)]))
            rows.numbers, rows.stamps = rows.numbers[:, : done.rows], rows.stamps[:, : done.rows]
            if dropped:
                rows.numbers, rows.stamps = rows.numbers[:, kept], rows.stamps[:, kept]
            rows.count = int(np.count_nonzero(kept))
            line += done.lines
            yield rows

    def _ahead(self) -> Iterator[tuple[Any, Rows]]:
        _ = read_rows.compiled  # once, not in every thread
        pending: deque[tuple[Future[Any], Rows]] = deque()
        with ThreadPoolExecutor(_AHEAD) as pool:
            try:
                for block, size, count in self._counted():
                    rows = self.room(count)
                    pending.append((pool.submit(self._block, block, size, 0, count, rows), rows))
                    if len(pending) > _AHEAD:
                        future, rows = pending.popleft()
                        yield future.result(), rows
                while pending:
                    future, rows = pending.popleft()
                    yield future.result(), rows
            finally:
                pool.shutdown(cancel_futures=True)

    def room(self, count: int) -> Rows:
        """Memory for so many rows."""
        numbers, stamps = np.empty((self.shape[0], count)), np.empty((self.shape[1], count), dtype=np.int64)
        return Rows(numbers, stamps, 0, self.dialect.first_line)
