"""Commas and points with two possible meanings: a table is refused if its rows do not decide between them.

A comma may separate cells, or be the decimal mark of a number without quotes. A point may be a decimal mark or a
thousands separator: a column of `998`, `999`, `1.000` can be read in two ways. If no number of the sample decides, the
rows after the sample are searched for the first one that does.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import islice, pairwise

from cdtool.base.errors import RecordingError
from cdtool.formats.csv.cells import kind, split_line
from cdtool.formats.csv.lines import SplitLine, begins_comment
from cdtool.formats.csv_dialect.dialect import Dialect
from cdtool.formats.csv_dialect.marks import Marks, find_marks

_EXPONENT = r"[eE][+-]?[0-9]+"
_PADDED = re.compile(rf"0[0-9]+(?:{_EXPONENT})?|[0-9]+{_EXPONENT}")
_FRACTION = re.compile(rf"[0-9]+(?:{_EXPONENT})?")
# Before a decimal comma: digits, perhaps in groups. After a comma as thousands separator: the next group.
_WHOLE_PART = re.compile(r"[+-]?(?:[0-9]+|[1-9][0-9]{0,2}(?:[.'\u00a0\u202f ][0-9]{3})+)")
_FIRST_GROUP, _GROUP = re.compile(r"[+-]?[1-9][0-9]{0,2}"), re.compile(r"[0-9]{3}(?:\.[0-9]*)?")

_HINT = (
    'pin decimal = "," and separator = "semicolon" in [csv] if it is one number, '
    'separator = "comma" if they are two cells; or save the table with semicolons'
)
_WHOLE = re.compile(r"[+-]?(?:0|[1-9][0-9]*)")
_GROUPED = re.compile(r"[+-]?[1-9][0-9]{0,2}\.[0-9]{3}")
_MARKED = re.compile(r"[.,'][0-9]")
# After this many numbers such as `1.234` without any other, the search ends.
_ENOUGH = 1000
_ROWS_HELD = 2000


def refuse_commas_that_may_be_decimal(data: Sequence[SplitLine], kinds: str, separator: str, named: bool) -> None:
    """Raise RecordingError if a row without a header may be one number: `0,05` may be two cells or 0.05.

    `named`: a comment above the rows is a single word, perhaps the name of one column.
    """
    if separator != ",":
        return
    pairs = kinds == "NN" and _may_be_one(data)
    points = not pairs and any("." in cell for row in data for i, cell in enumerate(row.cells) if kinds[i] == "N")
    columns = range(1, len(kinds))
    ambiguous = next(
        ((row, i) for row in data for i in columns if _is_fraction(data, kinds, row.cells, i, points)), None
    )
    if ambiguous is None and pairs and (named or (len(data) > 2 and not _is_counter(data))):
        ambiguous = data[0], 1
    if ambiguous is not None:
        row, i = ambiguous
        raise RecordingError(
            f"line {row.number}: '{row.cells[i - 1]},{row.cells[i]}' may be one number (decimal comma) or two cells",
            _HINT,
        )


def _is_fraction(data: Sequence[SplitLine], kinds: str, row: Sequence[str], i: int, points: bool) -> bool:
    """Return whether cell `i` may be the decimals of the cell before it.

    After a number: digits with leading zeros, or with an exponent. After a time of day: 3, 6 or 9 digits in all rows.
    """
    if kinds[i] != "N":
        return False
    if kinds[i - 1] == "N":
        if row[i].startswith("0") and _GROUP.fullmatch(row[i]) and _FIRST_GROUP.fullmatch(row[i - 1]):
            return True
        return not points and _PADDED.fullmatch(row[i]) is not None
    if kinds[i - 1] != "T" or ":" not in row[i - 1] or row is not data[0].cells:  # once: the test is of all rows
        return False
    digits = {len(each.cells[i]) if each.cells[i].isdigit() else 0 for each in data}
    return len(digits) == 1 and digits <= {3, 6, 9}


def _may_be_one(data: Sequence[SplitLine]) -> bool:
    """Return whether each row of two cells may be one number: `1,5`, `-3,07e+00`, `1.234,5` or `1,234.5`."""
    pairs = [row.cells for row in data]
    decimals = all(_WHOLE_PART.fullmatch(whole) and _FRACTION.fullmatch(rest) for whole, rest in pairs)
    return decimals or all(_FIRST_GROUP.fullmatch(whole) and _GROUP.fullmatch(rest) for whole, rest in pairs)


def _is_counter(data: Sequence[SplitLine]) -> bool:
    """Return whether the first column rises in equal steps, like a counter or a clock, and the second one changes."""
    first = [row.cells[0].replace(".", "") for row in data]
    if not all(cell.isdigit() for cell in first) or len({row.cells[1] for row in data}) == 1:
        return False
    steps = {int(b) - int(a) for a, b in pairwise(first)}
    return len(steps) == 1 and min(steps) > 0


def refuse_one_column_of_decimals(above: Sequence[SplitLine], data: Sequence[SplitLine]) -> None:
    """Raise RecordingError if one name or number is `above` rows such as `1,5` without names.

    Such lines may be one column with a decimal comma, or two columns without names.
    """
    if not above or len(above[-1].cells) != 1:
        return
    word = above[-1].cells[0]
    if kind(word) != "N" and not _may_be_one(data):
        return
    raise RecordingError(
        f"line {data[0].number} ({data[0].text[:40]!r}) may be one number (decimal comma) or two cells; "
        f"line {above[-1].number} has one ({word[:40]!r})",
        _HINT,
    )


def resolve_marks(dialect: Dialect) -> Marks:
    """Return the marks by all rows of a table whose sample has no decimal mark.

    Raises RecordingError if the rows can be read in two ways.
    """
    pins = dialect.pins
    numbers: list[tuple[str, int]] = []
    points: dict[int, tuple[str, int]] = {}
    for text, line, column in _marked_cells(dialect):
        numbers.append((text, line))
        if _GROUPED.fullmatch(text) is None or len(numbers) == _ENOUGH:
            break  # this number decides, or enough of them were seen
        points.setdefault(column, (text, line))
    marks = find_marks(numbers, dialect.separator if dialect.width > 1 else "", pins.decimal, pins.thousands)
    if marks.sure or marks.decimal != ".":
        return marks
    first_rows = [cells for _, cells, _ in islice(_rows(dialect, ("",)), _ROWS_HELD)] if points else []
    for column, (text, line) in points.items():
        whole = next((cells[column] for cells in first_rows if _WHOLE.fullmatch(cells[column])), None)
        if whole is not None:
            raise RecordingError(
                f"line {line}, column '{dialect.names[column]}': '{text}' next to '{whole}' may be "
                f"{text.replace('.', '')} (thousands) or {text} (decimal point)",
                'pin decimal = "," if the point separates thousands, or decimal = ".", in [csv] of the machine file',
            )
    return marks


def _marked_cells(dialect: Dialect) -> Iterator[tuple[str, int, int]]:
    """Yield the cells of columns of numbers that have a mark, with line and column, in the file's order."""
    for line, cells, is_last in _rows(dialect, [mark for mark in (".", "'", ",") if mark != dialect.separator]):
        for column, cell in enumerate(cells):
            # A last line without a line end may be cut off: `1.0` may have been `1.000`.
            if dialect.kinds[column] in "NM" and _MARKED.search(cell) and (not is_last or _GROUPED.fullmatch(cell)):
                yield cell, line, column


def _rows(dialect: Dialect, marks: Sequence[str]) -> Iterator[tuple[int, list[str], bool]]:
    """Yield the rows of blocks with one of the marks: line, cells, and whether the block ends without a line end."""
    line = dialect.first_line
    for block in dialect.text.blocks(dialect.offset):
        lines = block.split(dialect.text.line_end)
        if any(mark.encode() in block for mark in marks):
            for i, raw in enumerate(lines):
                if cells := _cells(dialect, raw):
                    yield line + i, cells, i == len(lines) - 1
        line += len(lines) - 1


def _cells(dialect: Dialect, raw: bytes) -> list[str]:
    """Return the cells of a row; empty for any other line, such as one of a footer."""
    text = dialect.text.decode(raw)
    cells = [] if begins_comment(text, dialect.comment) else split_line(text, dialect.separator)
    if len(cells) != dialect.width or (dialect.kinds[0] in "NT" and kind(cells[0]) == "X"):
        return []
    return cells
