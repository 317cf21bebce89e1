"""Blank lines in a table of one column are empty cells: each is a missing sample, so that later rows have their times.

If every other line is blank, the blank lines only separate the rows and are not samples; nor are those at the end.
"""

from __future__ import annotations

from collections.abc import Sequence

from cdtool.formats.csv.lines import Line

_BLANK = b" \t\r\n"
# The end is searched so often, TAIL_BYTES at a time.
_MOST_TAILS = 16
_HINT = "was the recording stopped? remove them"


def are_missing_samples(lines: Sequence[Line], first: int, width: int) -> bool:
    """Return whether blank lines are missing samples of the table whose rows start in line number `first`.

    They are if the table has one column and fewer than half of the `lines` of its rows are blank.
    """
    if width != 1:
        return False
    rows = [line.number for line in lines if not line.blank and line.number >= first]
    blank = [line.number for line in lines if line.blank and first < line.number < rows[-1]]
    return not blank or 2 * len(blank) < rows[-1] - first
