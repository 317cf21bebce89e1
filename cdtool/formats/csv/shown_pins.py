"""A table's dialect as `[csv]` of a machine file, to be pasted: this file is read the same with it as without."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cdtool.formats.csv.cells import SEPARATORS

if TYPE_CHECKING:
    from cdtool.formats.csv.dialect import Dialect


def shown_pins(dialect: Dialect) -> str:
    """Lines of TOML. Where names and units stand is found again in each file, so that line is shown as a comment.

    The next log may have another line above them; only what was pinned stays pinned.
    """
    pins = dialect.pins
    lines = ["[csv]"]
    if dialect.width > 1 or pins.separator:
        lines.append(f"separator = {quoted(SEPARATORS.get(dialect.separator, dialect.separator))}")
    lines += [f"decimal = {quoted(dialect.marks.decimal)}", f"thousands = {quoted(dialect.marks.thousands)}"]
    lines.append(f"encoding = {quoted(dialect.text.encoding)}")
    if not dialect.header and not dialect.preamble:
        lines.append("header = false")
    elif dialect.header and not dialect.from_comment:
        lines.append(_line("header", pins.header, dialect.header_line))
    if dialect.header and (dialect.units_line or pins.units is not None) and not dialect.from_comment:
        lines.append(_line("units", pins.units, dialect.units_line))
    if pins.skip_lines:
        lines.append(f"skip_lines = {pins.skip_lines}")
    if pins.comment is not None:
        lines.append(f"comment = {quoted(pins.comment)}")
    if pins.missing:
        lines.append(f"missing = [{', '.join(map(quoted, pins.missing))}]")
    layouts = {item.layout.pattern for item in dialect.stamped.values() if item.layout}
    if len(layouts) == 1:
        lines.append(f"time_format = {quoted(layouts.pop())}")
    elif pins.time_format:
        lines.append(f"time_format = {quoted(pins.time_format)}")
    return "\n".join(lines)


def quoted(text: str) -> str:
    """A TOML string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t")
    return f'"{escaped}"'


def _line(key: str, pinned: int | bool | None, number: int) -> str:
    if pinned is not None:
        return f"{key} = {number or 'false'}"
    return f"# {key} = {number}  (in this file; looked for again in each)"
