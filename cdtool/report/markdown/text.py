"""Markdown that is made of text from files: cells, tables, and sections that can be cut to a length."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import accumulate

from cdtool.plain_text import counted, plain, shorten

_ACTIVE = re.compile(r"([\\`*\[\]<>|&$#~:!]|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9]))")
# GitHub and GitLab look for @name and #12 in the rendered text, where no escape is left: only another character helps.
_REFERENCE = re.compile(r"([@#])(?=\w)")
_NO_WIDTH = "\u200b"
_ADDRESS = re.compile(r"(www)\.", re.IGNORECASE)
# A name of a sensible log is shorter; results.json has it whole.
_LONGEST_CELL = 200
_BLANK = "\n\n"


def escape(text: object, longest: int = _LONGEST_CELL) -> str:
    """Text from a file so that Markdown shows it as it is: no markup, no link, no mention, no end of a table's row."""
    shown = shorten(plain(text), longest)
    escaped = _REFERENCE.sub(rf"\1{_NO_WIDTH}", _ACTIVE.sub(r"\\\1", shown))
    return _ADDRESS.sub(r"\1&#46;", escaped)


@dataclass(frozen=True)
class Table:
    """Headings and rows of cells that are escaped already; `numeric`: all but the first column aligned to the right."""

    headings: Sequence[str]
    rows: Sequence[Sequence[object]]
    numeric: bool = False

    @property
    def head(self) -> str:
        """The line of headings and the rule."""
        rule = ["---"] + ["---:" if self.numeric else "---"] * (len(self.headings) - 1)
        return f"{_line(self.headings)}\n{_line(rule)}"

    @property
    def lines(self) -> list[str]:
        """The rows."""
        return [_line(row) for row in self.rows]


@dataclass(frozen=True)
class Section:
    """A heading (folded: a line to click on) with text, a table and more text; `source`: its rows in results.json.

    The title is in this program's words or escaped; that of a folded one holds no text from files at all.
    """

    title: str
    lead: str = ""
    table: Table | None = None
    tail: str = ""
    folded: bool = False
    source: str = ""
    whole: str = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "whole", self._made(self.table.lines if self.table else []))

    def within(self, room: int) -> str:
        """As many of its rows as `room` characters hold, with a line that counts them; empty where not one does."""
        if len(self.whole) <= room:
            return self.whole
        lines = self.table.lines if self.table else []
        frame = len(self._made([], self._cut_words(len(lines))))
        ends = accumulate(len(line) + 1 for line in lines)
        kept = sum(frame + end <= room for end in ends)
        return self._made(lines[:kept], self._cut_words(kept)) if kept else ""

    def _made(self, lines: Sequence[str], cut: str = "") -> str:
        table = "\n".join([self.table.head, *lines]) if self.table else ""
        parts = [part for part in (self.lead, table, cut, self.tail) if part]
        if self.folded:
            parts = [f"<details>\n<summary>{self.title}</summary>", *parts, "</details>"]
        elif self.title:
            parts = [f"## {self.title}", *parts]
        return _BLANK.join(parts)

    def _cut_words(self, kept: int) -> str:
        count = len(self.table.rows) if self.table else 0
        return f"*Cut here: {kept} of {counted(count, 'row')}; all of them are in results.json (`{self.source}`).*"


def fitted(head: str, tiers: Sequence[Sequence[Section]], most: int) -> str:
    """The head and every section in order, in at most `most` characters.

    Where they are longer, a tier takes what it needs before the next one does, and within a tier a short section is
    whole before a long one has more than its share.
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


def _line(cells: Sequence[object]) -> str:
    return f"| {' | '.join(map(str, cells))} |"
