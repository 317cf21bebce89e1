"""A trigger file: when a controller, or any other program, raised its alarms.

Conventions: a CSV with the columns recording and time_s and, where needed, detector and blind_until_s. A row is one
alarm. A row without a time: watched, no alarm. A row with blind_until_s: from time_s until then it could not judge.
"""

from __future__ import annotations

import csv
import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from cdtool.errors import ConfigurationError, nearest

_COLUMNS = ("recording", "time_s", "detector", "blind_until_s")


@dataclass
class Triggered:
    """What one detector said of one recording: alarms [s], and stretches [s] that it could not judge."""

    alarms: list[float] = field(default_factory=list)
    blind: list[tuple[float, float]] = field(default_factory=list)


@dataclass(frozen=True)
class TriggerFile:
    """The rows of a trigger file by detector and recording."""

    path: Path
    rows: dict[str, dict[str, Triggered]]
    digest: str

    def of(self, detector: str, recording: str) -> Triggered | None:
        """What a detector said of a recording, by its path or its file's name; None where no row names it."""
        by_name = self.rows[detector]
        return by_name.get(recording) or by_name.get(PurePosixPath(recording).name)


def read_triggers(path: Path) -> TriggerFile:
    """Read and check a trigger file; raises ConfigurationError with the line."""
    try:
        content = path.read_bytes()
        reader = csv.DictReader(content.decode("utf-8-sig").splitlines(), strict=True)
        names = [name.strip() for name in reader.fieldnames or ()]
        reader.fieldnames = names
        _check_columns(path, names)
        rows: dict[str, dict[str, Triggered]] = {}
        for row in reader:
            _take(path, reader.line_num, row, rows)
    except (OSError, UnicodeDecodeError, csv.Error) as fault:
        raise ConfigurationError(f"{path}: no trigger file: {fault}", "a UTF-8 CSV file is needed") from fault
    if not rows:
        raise ConfigurationError(f"{path}: holds no row", "write one a trigger; an empty time_s: watched, no alarm")
    return TriggerFile(path, rows, hashlib.sha256(content).hexdigest())


def _check_columns(path: Path, names: Sequence[str]) -> None:
    for name in names:
        if name not in _COLUMNS:
            raise ConfigurationError(f"{path} line 1: unknown column '{name}'", nearest(name, _COLUMNS))
    for name in _COLUMNS[:2]:
        if name not in names:
            raise ConfigurationError(f"{path} line 1: column '{name}' is missing", f"known: {', '.join(_COLUMNS)}")


def _take(path: Path, line: int, row: Mapping[str, str | None], rows: dict[str, dict[str, Triggered]]) -> None:
    recording = (row["recording"] or "").strip().replace("\\", "/")
    if not recording:
        raise ConfigurationError(f"{path} line {line}: no recording is named", "write its path in column recording")
    detector = (row.get("detector") or "").strip() or path.stem
    said = rows.setdefault(detector, {}).setdefault(recording, Triggered())
    time, until = (_seconds(path, line, name, row.get(name)) for name in ("time_s", "blind_until_s"))
    if until is not None:
        if time is None or until < time:
            raise ConfigurationError(
                f"{path} line {line}: blind from {time} until {until}", "time_s is the begin, and comes first"
            )
        said.blind.append((time, until))
    elif time is not None:
        said.alarms.append(time)


def _seconds(path: Path, line: int, name: str, text: str | None) -> float | None:
    if not (text or "").strip():
        return None
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ConfigurationError(f"{path} line {line}: {name} is '{text}'", "a number of seconds is needed")
    return value
