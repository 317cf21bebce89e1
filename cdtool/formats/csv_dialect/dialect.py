"""The dialect of a text table, and its form as `[csv]` of a machine file."""

from __future__ import annotations

from dataclasses import dataclass, field

from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import TablePins
from cdtool.formats.csv.cells import SEPARATORS
from cdtool.formats.csv.stamps import StampLayouts
from cdtool.formats.csv.text import Text
from cdtool.formats.csv_dialect.marks import Marks, SampleCell

# So many cells a block may have: 16 MiB of float64. Rows that end early have more cells than their bytes show.
MOST_CELLS = 1 << 21


@dataclass(frozen=True, kw_only=True)
class Dialect:
    """The dialect of a text table: rows of `width` cells start in line `first_line` (from 1), at byte `offset`.

    `kinds` has one letter per cell: N numbers, T time stamps, X words, M missing in the whole sample. `trailing`: each
    row ends with a separator, which is not followed by another cell. `stamped` and `words` describe the columns T and
    X, by number. `commented`: the sample has comments other than commented rows; `sampled` is the number of its rows;
    `preamble` are the lines above them. `blank_is_missing`: a blank line is a row whose only cell is empty.
    `short_rows`: rows may end early, and their other cells are empty; if `short_width` is not 0, after as many cells.
    """

    text: Text
    pins: TablePins
    separator: str
    marks: Marks
    missing: tuple[str, ...]
    header: tuple[str, ...] | None
    first_line: int
    sampled: int
    offset: int
    width: int
    kinds: str
    words: dict[int, SampleCell]
    comment: str = ""
    commented: bool = False
    header_line: int = 0
    units: tuple[str, ...] = ()
    units_line: int = 0
    header_text: tuple[str, ...] = ()
    from_comment: bool = False
    preamble: tuple[int, ...] = ()
    trailing: bool = False
    blank_is_missing: bool = False
    stamped: dict[int, StampLayouts] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    short_rows: bool = False
    short_width: int = 0

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the columns; without a header their numbers from 0."""
        return self.header or tuple(str(i) for i in range(self.width - self.trailing))

    def may_end_after(self, cells: int) -> bool:
        """Return whether a row may end after so many cells, though it has more columns."""
        return self.short_rows and (cells == self.short_width if self.short_width else 1 < cells < self.width)

    @property
    def details(self) -> dict[str, str]:
        """Return the dialect as texts to be displayed."""
        shown = {
            "separator": SEPARATORS.get(self.separator, self.separator) if self.width > 1 else "none (one column)",
            "header": f"line {self.header_line}" if self.header else "none: columns by number",
            "decimal mark": "comma" if self.marks.decimal == "," else "point",
            "encoding": self.text.encoding,
        }
        if self.units_line:
            shown["units"] = f"line {self.units_line}"
        if self.marks.thousands:
            shown["thousands"] = repr(self.marks.thousands)
        if self.text.line_end == b"\r":
            shown["line ends"] = "CR"
        return shown

    @property
    def as_pins(self) -> str:
        """Return the dialect as `[csv]` of a machine file.

        Lines of names and units that were detected are written as comments, because the next log may have more or fewer
        lines above them; only pinned lines are written as keys.
        """
        pins = self.pins
        lines = ["[csv]"]
        if self.width > 1 or pins.separator:
            lines.append(f"separator = {quoted(SEPARATORS.get(self.separator, self.separator))}")
        lines += [f"decimal = {quoted(self.marks.decimal)}", f"thousands = {quoted(self.marks.thousands)}"]
        lines.append(f"encoding = {quoted(self.text.encoding)}")
        if not self.header and not self.preamble:
            lines.append("header = false")
        elif self.header and not self.from_comment:
            lines.append(_line("header", pins.header, self.header_line))
        if self.header and (self.units_line or pins.units is not None) and not self.from_comment:
            lines.append(_line("units", pins.units, self.units_line))
        if pins.skip_lines:
            lines.append(f"skip_lines = {pins.skip_lines}")
        if pins.comment is not None:
            lines.append(f"comment = {quoted(pins.comment)}")
        if pins.missing:
            lines.append(f"missing = [{', '.join(map(quoted, pins.missing))}]")
        layouts = {each.layout.pattern for each in self.stamped.values() if each.layout}
        if len(layouts) == 1:
            lines.append(f"time_format = {quoted(layouts.pop())}")
        elif pins.time_format:
            lines.append(f"time_format = {quoted(pins.time_format)}")
        return "\n".join(lines)


def quoted(text: str) -> str:
    """Return a text as a TOML string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t")
    return f'"{escaped}"'


def _line(key: str, pinned: int | bool | None, number: int) -> str:
    if pinned is not None:
        return f"{key} = {number or 'false'}"
    return f"# {key} = {number}  (in this file; detected again in each file)"
