"""Markdown of tables and text from files: cells, tables, and sections that can be cut to a length."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import accumulate

from cdtool.base.plain_text import counted, plain, shorten
from cdtool.report.table import Cell, Heading, Table

# A colon followed by a space is part of a sentence; others begin an emoji or are part of an address.
_ACTIVE = re.compile(r"([\\`*\[\]<>|&$#~!]|:(?! )|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9]))")
# GitHub and GitLab look for @name and #12 in the rendered text, where no escape is left: only another character helps.
_REFERENCE = re.compile(r"([@#])(?=\w)")
_NO_WIDTH = "\u200b"
_ADDRESS = re.compile(r"(www)\.", re.IGNORECASE)
# A usual name of a log is shorter, and so is a sentence; results.json has all of it.
_LONGEST_CELL = 300
_BLANK = "\n\n"


def escape(text: object, longest: int | None = _LONGEST_CELL) -> str:
    """Return text for Markdown to show as it is, cut to `longest`: no markup, link, mention or end of a table's row."""
    shown = plain(text) if longest is None else shorten(plain(text), longest)
    escaped = _REFERENCE.sub(rf"\1{_NO_WIDTH}", _ACTIVE.sub(r"\\\1", shown))
    return _ADDRESS.sub(r"\1&#46;", escaped)


def table_lines(table: Table) -> list[str]:
    """Return the table as Markdown, line by line: headings, rule, rows; a part's heading is above its first row."""
    rule = ("---:" if column.numeric else "---" for column in table.columns)
    headings = (column.heading for column in table.columns)
    rows = [_line(map(_cell, row, table.columns)) for row in table.rows]
    for place, part in table.parts.items():
        rows[place] = f"{_line([f'**{escape(part.text)}**', *[''] * (len(table.columns) - 1)])}\n{rows[place]}"
    return [_line(headings), _line(rule), *rows]


@dataclass(frozen=True)
class Section:
    """A heading (folded: a line to click on) with text, a table and more text.

    The title is escaped; the title of a folded section contains no text from files at all.
    """

    title: str
    lead: str = ""
    table: Table | None = None
    tail: str = ""
    folded: bool = False
    whole: str = field(init=False)
    lines: Sequence[str] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "lines", table_lines(self.table) if self.table else [])
        cut = self._cut_note(len(self.table.rows)) if self.table and self.table.more else ""
        object.__setattr__(self, "whole", self._with(self.lines, cut))

    def within(self, room: int) -> str:
        """Return as many of its rows as `room` characters hold, with a line that counts them; empty without any row."""
        if len(self.whole) <= room:
            return self.whole
        head, rows = self.lines[:2], self.lines[2:]  # names and rule of the table
        frame = len(self._with(head, self._cut_note(len(rows))))
        ends = accumulate(len(line) + 1 for line in rows)
        kept = sum(frame + end <= room for end in ends)
        return self._with([*head, *rows[:kept]], self._cut_note(kept)) if kept else ""

    def _with(self, lines: Sequence[str], cut: str = "") -> str:
        parts = [part for part in (self.lead, "\n".join(lines), cut, self.tail) if part]
        if self.folded:
            parts = [f"<details>\n<summary>{self.title}</summary>", *parts, "</details>"]
        elif self.title:
            parts = [f"## {self.title}", *parts]
        return _BLANK.join(parts)

    def _cut_note(self, kept: int) -> str:
        count, source = (len(self.table.rows) + self.table.more, self.table.source) if self.table else (0, "")
        return f"*Cut here: {kept} of {counted(count, 'row')}; all of them are in results.json (`{source}`).*"


def fitted(head: str, tiers: Sequence[Sequence[Section]], most: int) -> str:
    """Return the head and every section in order, in at most `most` characters.

    If they are longer, each tier takes what it needs before the next, and within a tier short sections are complete
    before a long one takes more than its share.
    """
    sections = [section for tier in tiers for section in tier]
    text = _joined([head, *(section.whole for section in sections)])
    if len(text) <= most:
        return text
    left_out = "*{} of this report left out for its length; results.json has everything.*"
    room = most - len(head) - len(left_out) - 2 * len(_BLANK) - 8
    parts: list[str] = []
    for tier in tiers:
        made = _shared(tier, room)
        room -= sum(len(part) + len(_BLANK) for part in made if part)
        parts += made
    gone = parts.count("")
    words = [left_out.format(counted(gone, "part"))] if gone else []
    return _joined([head, *parts, *words])


def _shared(tier: Sequence[Section], room: int) -> list[str]:
    made = [""] * len(tier)
    shortest_first = sorted(range(len(tier)), key=lambda i: len(tier[i].whole))
    for done, i in enumerate(shortest_first):
        share = room // (len(tier) - done)
        made[i] = tier[i].within(share - len(_BLANK))
        room -= len(made[i]) + len(_BLANK) if made[i] else 0
    return made


def _joined(parts: Iterable[str]) -> str:
    return _BLANK.join(part for part in parts if part) + "\n"


def _cell(cell: Cell, column: Heading) -> str:
    """Return the cell in one line; bold if it is an outcome that is not good."""
    text = escape(cell.line)
    return f"**{text}**" if column.choice and cell.tone in ("bad", "unknown") else text


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"
