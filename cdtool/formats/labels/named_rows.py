"""A small CSV that a person or a program writes about recordings, as a label or trigger file: checked line by line.

Conventions: one header line, separated by commas, semicolons or tabs, in any encoding that a log may have. A number has
a decimal point or comma. What Excel adds (a line sep=;, empty cells and rows) is no content. `recording` is the path
below the benchmark file, or the file's name alone where that is unique. Every row has as many cells as the header, so
that a decimal comma between commas is noticed.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from cdtool.base.errors import ConfigurationError, RecordingError, nearest
from cdtool.base.files.bounded_loading import read_bytes
from cdtool.base.plain_text import counted, first_of
from cdtool.formats.csv.encoding import detect_text
from cdtool.formats.csv.lines import Line


@dataclass(frozen=True)
class NamedRow:
    """One row about a recording: its cells by column, and file and line for messages."""

    where: str
    cells: Mapping[str, str]
    recording: str

    def text(self, name: str) -> str:
        """Return a cell without the blanks around it; empty if the column is missing."""
        return self.cells.get(name, "").strip()

    def decimal(self, name: str) -> str:
        """Return a cell with a decimal point, also if it has a comma."""
        text = self.text(name)
        return text if "." in text else text.replace(",", ".")

    def seconds(self, name: str) -> float | None:
        """Return a finite number of seconds, None if the cell is empty; raises ConfigurationError."""
        text = self.text(name)
        if not text:
            return None
        try:
            value = float(self.decimal(name))
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.fault(f"{name} is '{text}'", "give a number of seconds")
        return value

    def fault(self, problem: str, hint: str) -> ConfigurationError:
        """Return an error about this row."""
        return ConfigurationError(f"{self.where}: {problem}", hint)


def read_named_rows(path: Path, required: Sequence[str], optional: Sequence[str], what: str) -> list[NamedRow]:
    """Return the rows of a file; raises ConfigurationError with the line. `what`: the kind of file, for messages."""
    (line, header), *rows = read_cells(path, what)
    _check_header(f"{path} line {line}", header, required, [*required, *optional])
    if not rows:
        raise ConfigurationError(
            f"{path}: contains no row", f"write one per {what}; one without a time: the recording has none"
        )
    return [_row(path, line, header, cells) for line, cells in rows]


def read_cells(path: Path, what: str) -> list[tuple[int, list[str]]]:
    """Return the rows that are not empty with their lines, the header first; raises ConfigurationError."""
    content = read_bytes(path, ConfigurationError)
    try:
        try:
            found, stream = detect_text(path, content, content=content)
            text = found.decode(stream)
        except RecordingError:  # empty, or names with characters that no log has
            text = content.decode("utf-8-sig")
        first = text.lstrip("\r\n").partition("\n")[0]
        named = Line(1, first, 0).separator
        separator = named or max(",;\t", key=first.count)
        reader = csv.reader(io.StringIO(text, newline=""), strict=True, delimiter=separator)
        filled = [(reader.line_num, cells) for cells in reader if any(map(str.strip, cells))]
    except UnicodeDecodeError as fault:
        raise ConfigurationError(f"{path}: not a {what} file: not text", "give a CSV file") from fault
    except csv.Error as fault:
        raise ConfigurationError(
            f"{path}: not a {what} file: damaged at line {reader.line_num}", "give a CSV file with paired quotes"
        ) from fault
    (line, header), *rows = filled[bool(named) :] or [(1, [])]
    names = [name.strip() for name in header]
    while names and not names[-1]:
        names.pop()
    for _, cells in rows:
        while len(cells) > len(names) and not cells[-1].strip():
            cells.pop()
    return [(line, names), *rows]


def by_recording(
    path: Path, names: Iterable[str], recordings: Collection[str], *, runs: bool = False
) -> dict[str, str | None]:
    """Return which recording each name of a file means.

    Parameters
    ----------
    path : Path
        The file, for messages.
    names : iterable of str
        Names in the file: paths relative to the benchmark file, or only file names.
    recordings : collection of str
        Paths of the recordings, relative to the benchmark file.
    runs : bool, optional
        A name may also be that of a run, the name of its recording with # and the run's id.

    Returns
    -------
    dict of str to str or None
        For each name its recording, or None.

    Raises
    ------
    ConfigurationError
        A file name fits several recordings.

    Examples
    --------
    >>> by_recording(Path("triggers.csv"), ["01.csv", "stiff/02.csv", "09.csv"], {"soft/01.csv", "stiff/02.csv"})
    {'01.csv': 'soft/01.csv', 'stiff/02.csv': 'stiff/02.csv', '09.csv': None}
    >>> by_recording(Path("triggers.csv"), ["01.csv#7"], {"soft/01.csv"}, runs=True)
    {'01.csv#7': 'soft/01.csv#7'}
    """
    found: dict[str, str | None] = {}
    for name in names:
        meant = _meant(name, recordings)
        if not meant and runs:
            meant = _meant_runs(name, recordings)
        if len(meant) > 1:
            raise ConfigurationError(
                f"{path}: '{name}' fits {first_of(meant)}", "give a path relative to the benchmark file"
            )
        found[name] = meant[0] if meant else None
    return found


def _meant(name: str, recordings: Collection[str]) -> list[str]:
    """Return the recordings that a path, or a file name alone, may mean."""
    if name in recordings:
        return [name]
    return [] if "/" in name else sorted(item for item in recordings if PurePosixPath(item).name == name)


def _meant_runs(name: str, recordings: Collection[str]) -> list[str]:
    """Return the names of runs that NAME#ID may mean; a file name may also contain the mark."""
    places = (i for i, character in enumerate(name) if character == "#")
    meant = ((recording, i) for i in places for recording in _meant(name[:i], recordings))
    return [f"{recording}{name[i:]}" for recording, i in meant]


def _check_header(where: str, header: Sequence[str], required: Sequence[str], known: Sequence[str]) -> None:
    unknown = [name for name in header if name not in known]
    if unknown:
        which = ", ".join(f"'{name}'" for name in unknown)
        missing = [name for name in required if name not in header]
        hint = f"{nearest(unknown[0], known)}; needed: {', '.join(missing or required)}"
        raise ConfigurationError(f"{where}: unknown column{'s' * (len(unknown) > 1)} {which}", hint)
    for name in header:
        if header.count(name) > 1:
            raise ConfigurationError(f"{where}: column '{name}' is repeated", "name each column once")
    for name in required:
        if name not in header:
            raise ConfigurationError(f"{where}: column '{name}' is missing", f"use {','.join(known)}")


def _row(path: Path, line: int, header: Sequence[str], cells: Sequence[str]) -> NamedRow:
    where = f"{path} line {line}"
    if len(cells) != len(header):
        raise ConfigurationError(
            f"{where}: {counted(len(cells), 'cell')} under {counted(len(header), 'column')}",
            "give one cell per column, empty without a value; decimals with a point",
        )
    by_column = dict(zip(header, cells, strict=True))
    name = by_column.get("recording", "").strip().replace("\\", "/")
    if not name:
        raise ConfigurationError(f"{where}: no recording is named", "give its path in column recording")
    return NamedRow(where, by_column, PurePosixPath(name).as_posix())
