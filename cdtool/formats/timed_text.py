"""Text logs whose head states the clock of each channel, as LabVIEW and TwinCAT Scope write them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from cdtool.channels import ChannelMap, TablePins
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.formats.column_names import requested_keys
from cdtool.formats.csv.cells import SEPARATORS, kind
from cdtool.formats.csv.dialect import Dialect
from cdtool.formats.csv.encoding import detect_text
from cdtool.formats.csv.head_words import column_kinds
from cdtool.formats.csv.marks import Marks, SampleCell
from cdtool.formats.csv.text import SAMPLE_BYTES, Text, read_sample, read_small
from cdtool.formats.csv.timed_table import ClockGroup, headers, timed_pieces
from cdtool.formats.pieces import Pieces
from cdtool.formats.source import Source

# No recording has more columns; each row may be completed with as many empty cells.
_MOST_COLUMNS = 1 << 14


@dataclass(frozen=True)
class Segment:
    """Rows below a head: their dialect, the channels by clock, and how many rows the head states (0: none)."""

    dialect: Dialect
    groups: tuple[ClockGroup, ...]
    stated: int = 0


@dataclass(frozen=True)
class TimedText:
    """A log: its segments, the units of its channels, its start since 1970 [s], and what its heads show."""

    segments: tuple[Segment, ...]
    units: Mapping[str, str | None]
    origin: float
    details: Mapping[str, str]
    findings: tuple[Finding, ...]

    def pieces(self, path: Path, name: str, wanted: ChannelMap | None, some: Collection[str] | None) -> Pieces:
        """Yield the rows of the channels that `wanted` and `some` name; return the source of the format `name`."""
        names = tuple(self.units)
        keys = [key for key in requested_keys(path, wanted, names) if some is None or key in some]
        findings, left_out = [*self.findings], set[str]()
        for each in self.segments:
            table = yield from timed_pieces(path, each.dialect, each.groups, keys, survey=wanted is None)
            findings += table.findings
            left_out |= table.left_out
            if table.rows < each.stated:
                findings.append(
                    Finding(
                        "segment_cut_off",
                        "",
                        {"line": each.dialect.first_line, "stated": each.stated, "rows": table.rows},
                    )
                )
        read = [key for key in keys if key not in left_out]
        if not read:
            raise RecordingError(f"{path}: no channel has numbers", "see cdtool info")
        columns = headers([group for each in self.segments for group in each.groups], self.units, read)
        ordered = {key: columns[key] for key in names if key in columns}
        return Source(path, name, ordered, self.origin, tuple(dict.fromkeys(findings)), self.details, names)


def opened(path: Path, pins: TablePins, most: int = SAMPLE_BYTES) -> tuple[Text, list[bytes]]:
    """Return a text file, and the lines in its first bytes; raises RecordingError if it is empty."""
    content = read_small(path)
    sample = read_sample(path, most) if content is None else content
    if not sample.strip():
        raise RecordingError(f"{path}: is empty", "was the recording stopped immediately, or the copy cut off?")
    text, stream = detect_text(path, sample, pins.encoding, content)
    return text, stream.split(text.line_end)


def dialect_of_rows(
    text: Text,
    pins: TablePins,
    marks: tuple[str, str],
    place: tuple[int, int],
    names: Sequence[str],
    rows: list[list[str]],
) -> Dialect:
    """Return the dialect of rows: `marks` are separator and decimal mark, `place` line and byte of the first row.

    `names` are those of the columns, empty for columns of other cells; `rows` are the cells of the first rows.
    """
    separator, decimal = marks
    width = max([len(names), *(len(row) for row in rows if not row[-1])])
    if width > _MOST_COLUMNS:
        raise RecordingError(f"{text.path}: names {width} columns, more than {_MOST_COLUMNS}", "export fewer channels")
    padded = [row + [""] * (width - len(row)) for row in rows if len(row) <= width]
    kinds = column_kinds(padded, width)
    words = {
        i: SampleCell(next(row[i] for row in padded if kind(row[i]) in "XT"), place[0])
        for i, name in enumerate(names)
        if name and kinds[i] in "XT"
    }
    return Dialect(
        text=text,
        pins=pins,
        separator=separator,
        marks=Marks(decimal),
        missing=pins.missing,
        header=tuple(name or str(i) for i, name in enumerate([*names, *[""] * (width - len(names))])),
        first_line=place[0],
        sampled=len(padded),
        offset=place[1],
        width=width,
        kinds=kinds,
        words=words,
        short_rows=True,
    )


def details_of(text: Text, separator: str, decimal: str) -> dict[str, str]:
    """Return the marks and the encoding of a log as texts to be displayed."""
    return {
        "separator": SEPARATORS.get(separator, repr(separator)),
        "decimal mark": "comma" if decimal == "," else "point",
        "encoding": text.encoding,
    }
