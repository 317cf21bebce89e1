"""The dialect of a text table, and its form as `[csv]` of a machine file."""

from __future__ import annotations

from dataclasses import dataclass, field

from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import TablePins
from cdtool.formats.column_names import split_unit
from cdtool.formats.csv.cells import SEPARATORS
from cdtool.formats.csv.stamps import StampLayouts
from cdtool.formats.csv.text import Text
from cdtool.formats.csv_dialect.head import Head
from cdtool.formats.csv_dialect.marks import Marks, SampleCell
from cdtool.recordings.units import find_unit

# So many cells a block may have: 16 MiB of float64. Rows that end early have more cells than their bytes show.
MOST_CELLS = 1 << 21


@dataclass(frozen=True, kw_only=True)
class Dialect(Head):
    """The dialect of a text table, whose rows have `width` cells.

    `kinds` has one letter per cell: N numbers, T time stamps, X words, M missing in the whole sample. `trailing`: each
    row ends with a separator, which is not followed by another cell. `stamped` and `words` describe the columns T and
    X, by number. `commented`: the sample has comments other than commented rows; `sampled` is the number of its rows.
    `blank_is_missing`: a blank line is a row whose only cell is empty.
    `short_rows`: how many cells a row may have that ends early; its other cells are empty.
    `origin` [s] is stated by the head of a file that cdtool wrote, `stated_rows` by that of LabVIEW (0: none are).
    """

    text: Text
    pins: TablePins
    separator: str
    marks: Marks
    missing: tuple[str, ...]
    sampled: int
    width: int
    kinds: str
    words: dict[int, SampleCell]
    comment: str = ""
    commented: bool = False
    header_text: tuple[str, ...] = ()
    trailing: bool = False
    blank_is_missing: bool = False
    stamped: dict[int, StampLayouts] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    short_rows: range = range(0)
    origin: float = 0.0
    stated_rows: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the columns; without a header their numbers from 0."""
        return self.header or tuple(str(i) for i in range(self.width - self.trailing))

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


def unit_from_header(dialect: Dialect, name: str) -> str | None:
    """Return the unit of a column in the header, or in the row of units below it; None if there is no unit."""
    column = dialect.names.index(name)
    text = dialect.units[column].strip() if column < len(dialect.units) else ""
    if text[:1] + text[-1:] in ("[]", "()"):
        text = text[1:-1].strip()
    texts = [item for item in (text, split_unit(name.partition("#")[0])[1]) if item and item != "-"]
    return next((item for item in texts if find_unit(item)), next(iter(texts), None))


def quoted(text: str) -> str:
    """Return a text as a TOML string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t")
    return f'"{escaped}"'


def _line(key: str, pinned: int | bool | None, number: int) -> str:
    if pinned is not None:
        return f"{key} = {number or 'false'}"
    return f"# {key} = {number}  (in this file; detected again in each file)"
