"""How a text table is written: encoding, separator, decimal mark, header. Found from its first lines."""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from cdtool.errors import RecordingError

SAMPLE_BYTES = 1 << 18
_SCORED_LINES = 60
# In the order of trust: where two split the lines equally well, the first is taken.
SEPARATORS = {"\t": "tab", ";": "semicolon", "|": "pipe", ",": "comma", " ": "blanks"}
_MISSING = ("", "nan", "NaN", "NAN")
_TAIL = r"(e[+-]?[0-9]+)?|[+-]?(inf|infinity)|true|false"
_NUMBER = re.compile(rf"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+){_TAIL}", re.IGNORECASE)
_COMMA_NUMBER = re.compile(rf"[+-]?([0-9]+,?[0-9]*|,[0-9]+){_TAIL}", re.IGNORECASE)
_OTHER_KINDS = (b"%PDF", b"\x89", b"GIF8", b"\xff\xd8", b"PK\x03\x04", b"\x1f\x8b", b"SQLite format", b"#ROSBAG")


@dataclass(frozen=True)
class Dialect:
    """`first_line` is the file's line (from 1) of the first row of numbers, `offset` the byte where it starts."""

    encoding: str
    separator: str
    decimal: str
    line_end: bytes
    header: tuple[str, ...] | None
    header_line: int
    first_line: int
    offset: int
    width: int

    @property
    def details(self) -> dict[str, str]:
        """The dialect in words."""
        return {
            "separator": SEPARATORS[self.separator] if self.width > 1 else "none (one column)",
            "header": f"line {self.header_line}" if self.header else "none: columns by number",
            "decimal mark": "comma" if self.decimal == "," else "point",
            "encoding": self.encoding,
        }

    def cells(self, line: str) -> list[str]:
        """One line cut into its cells."""
        return split_line(line, self.separator)


def find_dialect(path: Path, sample: bytes) -> Dialect:
    """The dialect of the first bytes of a text file; raises RecordingError if they are not a table of numbers."""
    encoding, skipped = _encoding(path, sample)
    text_bytes = sample[skipped:]
    line_end = b"\n" if b"\n" in text_bytes else b"\r"
    raw_lines = text_bytes.split(line_end)
    if len(sample) >= SAMPLE_BYTES and len(raw_lines) > 1:
        raw_lines.pop()  # cut by the sample, not by the file
    lines = [raw.decode(encoding, errors="replace").rstrip("\r\n") for raw in raw_lines]
    start = next((i for i, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")), None)
    if start is None:
        raise RecordingError(f"{path}: holds no row of numbers", "a header line and rows of numbers are needed")
    body = [line for line in lines[start:] if line.strip()]
    separator = _separator(body[:_SCORED_LINES])
    decimal = _decimal(body, separator)
    first = split_line(body[0], separator)
    second = split_line(body[1], separator) if len(body) > 1 else []
    header = _is_header(first, second, decimal)
    data = next((i for i in range(start + header, len(lines)) if lines[i].strip()), len(lines))
    if data == len(lines):
        raise RecordingError(
            f"{path}: holds a header in line {start + 1} and no row of numbers", "was the recording stopped at once?"
        )
    cells = (cell for line in body[header:] for cell in split_line(line, separator))
    if not any(is_number(cell, decimal) or cell in _MISSING[1:] for cell in cells):
        raise RecordingError(
            f"{path}: holds no row of numbers: line {data + 1} is {body[header][:60]!r}",
            "a table with a header line (or none) and rows of numbers is needed",
        )
    return Dialect(
        encoding=encoding,
        separator=separator,
        decimal=decimal,
        line_end=line_end,
        header=tuple(_names(first)) if header else None,
        header_line=start + 1 if header else 0,
        first_line=data + 1,
        offset=skipped + sum(len(raw) + 1 for raw in raw_lines[:data]),
        width=len(first),
    )


def looks_like_text(sample: bytes) -> bool:
    """False for what cannot be a table of numbers: NUL bytes near the start, markup, a known binary."""
    head = sample[:4096]
    written = head.rstrip(b"\0")  # a file system pads the end of a file that was cut by a loss of power
    if not written or b"\0" in written or head.startswith(_OTHER_KINDS):
        return False
    text = head.removeprefix(codecs.BOM_UTF8).lstrip()
    return not text.startswith((b"<", b"{", b"["))


def split_line(line: str, separator: str) -> list[str]:
    """Cells without their outer blanks and quotes."""
    if separator == " ":
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    try:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error:  # stray quotes or line ends: the rows are checked later, with their line numbers
        cells = line.split(separator)
    return [cell.strip() for cell in cells]


def _encoding(path: Path, sample: bytes) -> tuple[str, int]:
    if sample.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise RecordingError(f"{path}: is written in UTF-16", "save it as UTF-8")
    skipped = len(codecs.BOM_UTF8) if sample.startswith(codecs.BOM_UTF8) else 0
    if not looks_like_text(sample):
        raise RecordingError(f"{path}: is not a table of numbers: binary or markup", "give a CSV, MCAP or MAT file")
    try:
        codecs.getincrementaldecoder("utf-8")().decode(sample)
    except UnicodeDecodeError:
        return "latin-1", 0
    return "utf-8", skipped


def _separator(lines: list[str]) -> str:
    best, best_score = ",", (0.0, 0.0)
    for separator in SEPARATORS:
        rows = [split_line(line, separator) for line in lines]
        width, count = Counter(map(len, rows)).most_common(1)[0]
        if width < 2:
            continue
        cells = [cell for row in rows[1:] or rows for cell in row]
        decimal = "," if separator in (";", "\t") else "."
        numeric = sum(
            cell in _MISSING or is_number(cell, ".") or (decimal == "," and is_number(cell, ",")) for cell in cells
        )
        score = (round(numeric / len(cells), 2), round(count / len(rows), 2))
        if score > best_score:
            best, best_score = separator, score
    return best


def _decimal(lines: list[str], separator: str) -> str:
    if separator not in (";", "\t"):
        return "."
    comma = re.compile(rf"(?:^|{separator})\s*[+-]?\d*,\d+(?:[eE][+-]?\d+)?\s*(?={separator}|$)", re.MULTILINE)
    point = re.compile(rf"(?:^|{separator})\s*[+-]?\d*\.\d+(?:[eE][+-]?\d+)?\s*(?={separator}|$)", re.MULTILINE)
    text = "\n".join(lines).replace('"', "")
    return "," if comma.search(text) and not point.search(text) else "."


def _is_header(first: list[str], second: list[str], decimal: str) -> bool:
    numbers = [is_number(cell, decimal) or cell in _MISSING[1:] for cell in first]
    if all(numbers):
        return False
    if not any(numbers):
        return True
    # Some cells are numbers: a header with numbers as names, or rows that hold a date beside numbers?
    below = [is_number(cell, decimal) or cell in _MISSING for cell in second]
    return below != numbers


def is_number(cell: str, decimal: str) -> bool:
    """True for what pandas takes for a number: infinity, true and false (1 and 0) among them."""
    pattern = _COMMA_NUMBER if decimal == "," else _NUMBER
    return pattern.fullmatch(cell) is not None


def _names(cells: list[str]) -> list[str]:
    # A name that is there twice can be asked for by its number only: each bears it.
    counts = Counter(cells)
    return [str(i) if not cell else f"{cell}#{i}" if counts[cell] > 1 else cell for i, cell in enumerate(cells)]
