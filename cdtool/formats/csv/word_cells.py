"""Replace the texts in columns of categories by their codes before the compiled loop reads a block.

A text that is not replaced here, such as one in a line with unusual quotes, makes its line irregular: it is read there
with the same code.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from cdtool.columns import Categories
from cdtool.formats.csv.cells import number
from cdtool.formats.csv.dialect import Dialect


class WordCells:
    """The columns of categories of a table, by number."""

    def __init__(self, dialect: Dialect, categories: Mapping[int, Categories]) -> None:
        self._dialect = dialect
        self._columns = [(column, _pattern(dialect.separator, column), each) for column, each in categories.items()]
        self._known: dict[tuple[int, bytes], bytes] = {}
        self._encoding = "utf-8" if dialect.text.recoded else dialect.text.encoding
        self._comment = dialect.comment.encode(self._encoding, "replace") if dialect.comment else b"\0"

    def coded(self, lines: bytes) -> bytes:
        """Return lines with the codes of texts in their places."""
        for column, pattern, categories in self._columns:
            lines = pattern.sub(lambda cell: self._code(column, categories, cell), lines)  # noqa: B023
        return lines

    def _code(self, column: int, categories: Categories, cell: re.Match[bytes]) -> bytes:
        before, raw = cell.groups()
        known = self._known.get((column, raw))
        if known is None:
            known = self._known[column, raw] = self._replacement(column, categories, raw)
        if cell[0].lstrip().startswith(self._comment):
            return cell[0]
        return before + known

    def _replacement(self, column: int, categories: Categories, raw: bytes) -> bytes:
        """Return the code of a text; a number, a pinned missing value or the column's own name stays as it is.

        `None` is a text here: in a column of labels it is what no contact is called.
        """
        dialect = self._dialect
        text = raw.decode(self._encoding, "replace").strip(" \t")
        text = text[1:-1].strip(" \t") if text.startswith('"') else text
        is_number = number(text, dialect.marks.decimal, dialect.marks.thousands) is not None
        if is_number or text in dialect.pins.missing or text in (dialect.names[column], dialect.names[column].strip()):
            return raw
        return b"%d" % categories.code(text)


def _pattern(separator: str, column: int) -> re.Pattern[bytes]:
    """Return the pattern of a line up to the end of a cell: what is before the cell, and the cell."""
    blanks = {" ": b"", "\t": rb"[ ]*+"}.get(separator, rb"[ \t]*+")
    if separator == " ":
        mark, before, cell = rb"[ \t]", rb'[ \t]*+(?:[^ \t\r\n"]++[ \t]++){%d}' % column, rb'[^ \t\r\n"]++'
    else:
        mark = re.escape(separator.encode())
        bare = rb'[^"\r\n' + mark + rb"]*+"
        quoted = rb'%s(?:"[^"\n]*+")++%s' % (blanks, blanks)
        before = rb"(?:(?:%s|%s)%s){%d}" % (quoted, bare, mark, column)
        cell = rb'"[^"\n]*+"|' + bare
    return re.compile(rb"^(%s)(%s)(?=%s(?:%s|\r|\n|\Z))" % (before, cell, blanks, mark), re.MULTILINE)
