"""A small CSV that a person or a program writes about recordings, as a label or trigger file: checked line by line.

Conventions: UTF-8, separated by commas, one header line. `recording` is the path below the benchmark file, or the
file's name alone where that is unique. Every row has as many cells as the header, so that a decimal comma is noticed.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from cdtool.bounded_loading import read_bytes
from cdtool.errors import ConfigurationError, nearest
from cdtool.plain_text import counted, first_of


@dataclass(frozen=True)
class NamedRow:
    """One row about a recording: its cells by column, and file and line for messages."""

    where: str
    cells: Mapping[str, str]
    recording: str

    def text(self, name: str) -> str:
        """Return a cell without the blanks around it; empty if the column is missing."""
        return self.cells.get(name, "").strip()

    def seconds(self, name: str) -> float | None:
        """Return a finite number of seconds, None if the cell is empty; raises ConfigurationError."""
        text = self.text(name)
        if not text:
            return None
        try:
            value = float(text)
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
    content = read_bytes(path, ConfigurationError)
    try:
        text = content.decode("utf-8-sig")
        reader = csv.reader(io.StringIO(text, newline=""), strict=True)
        header = [name.strip() for name in next(reader, [])]
        _check_header(path, header, required, [*required, *optional])
        return [_row(path, reader.line_num, header, cells) for cells in reader if cells]
    except UnicodeDecodeError as fault:
        raise ConfigurationError(f"{path}: not a {what} file: not UTF-8 text", "give a UTF-8 CSV file") from fault
    except csv.Error as fault:
        raise ConfigurationError(
            f"{path}: not a {what} file: damaged at line {reader.line_num}", "give a CSV file with paired quotes"
        ) from fault


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


def _check_header(path: Path, header: Sequence[str], required: Sequence[str], known: Sequence[str]) -> None:
    for name in header:
        if name not in known:
            raise ConfigurationError(f"{path} line 1: unknown column '{name}'", nearest(name, known))
        if header.count(name) > 1:
            raise ConfigurationError(f"{path} line 1: column '{name}' is repeated", "name each column once")
    for name in required:
        if name not in header:
            raise ConfigurationError(f"{path} line 1: column '{name}' is missing", f"use {','.join(known)}")


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
