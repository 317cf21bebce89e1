"""Which logs belong together: those of a machine, by their folders, and those of a day, by their names or clocks."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, date, datetime
from enum import Enum
from pathlib import Path
from typing import Any

from cdtool.base.errors import UsageError
from cdtool.base.remote.remote_path import location
from cdtool.formats.channels.run_reading import split_run
from cdtool.recordings.operations import Operation

_DATE = re.compile(r"(?<!\d)((?:19|20)\d\d)[-_.]?(0[1-9]|1[0-2])[-_.]?(0[1-9]|[12]\d|3[01])(?!\d)")
_DIGITS = re.compile(r"(\d+)")


class Split(Enum):
    """What stays together where recordings assess one another: nothing, a day's recordings, or a machine's."""

    RECORDING = "recording"
    DAY = "day"
    MACHINE = "machine"


def split_names(split: Split, operations: Sequence[Operation]) -> list[str]:
    """Return for each operation the name of what it stays together with.

    Raises UsageError for a recording without a day, or if all are of one day or machine.
    """
    logs = [split_run(location(item.recording.source))[0] for item in operations]
    if split is Split.RECORDING:
        return [str(number) for number in range(len(operations))]
    if split is Split.MACHINE:
        machine_of = {log: name for name, members in by_machine(logs, "").items() for log in members}
        names = [machine_of[log] for log in logs]
    else:
        names = [day_of(log, item.whole.began) for log, item in zip(logs, operations, strict=True)]
        for name, item in zip(names, operations, strict=True):
            if not name:
                raise UsageError(
                    f"split = 'day': neither the path nor the clock of {item.name} contains a date",
                    "put the date into the folder or file name as 2026-11-27, or remove split",
                )
    if len(set(names)) < 2:
        hint = "add logs of another one, or remove split"
        raise UsageError(f"split = '{split.value}': all impact-free logs are of one {split.value}", hint)
    return names


def by_machine(paths: Sequence[Path], only: str) -> dict[str, list[Path]]:
    """Return the logs by the first folder in which their paths differ, dates apart; `only` names a single machine."""
    folders = [path.parent.parts for path in paths]
    for level in range(max((len(parts) for parts in folders), default=0)):
        names = [parts[level] if level < len(parts) else "." for parts in folders]
        if len(set(names)) > 1 and not all(date_in(name) for name in names):
            found: dict[str, list[Path]] = {}
            for name, path in zip(names, paths, strict=True):
                found.setdefault(name, []).append(path)
            return {name: sorted(found[name], key=natural_order) for name in sorted(found, key=_natural_name)}
    return {only: sorted(paths, key=natural_order)}


def day_of(log: Path, began: float | None) -> str:
    """Return the date in a log's path, else that of its clock (`began` [s], UTC); empty without one."""
    if day := day_in_path(log):
        return day
    return "" if began is None else datetime.fromtimestamp(began, UTC).date().isoformat()


def day_in_path(log: Path) -> str:
    """Return the last date in a path as 2026-11-27; empty without one."""
    return next(filter(None, map(date_in, reversed(log.parts))), "")


def date_in(text: str) -> str:
    """Return the date in a name as 2026-11-27; empty without one."""
    for match in _DATE.finditer(text):
        year, month, day = map(int, match.groups())
        try:
            return date(year, month, day).isoformat()
        except ValueError:  # the 31st of a month with 30 days
            continue
    return ""


def natural_order(path: Path) -> tuple[Any, ...]:
    """Return a sort key: by the date in a path, then run 9 before run 10."""
    return (date_in(str(path)), _natural_name(str(path)))


def _natural_name(name: str) -> tuple[tuple[int, int | str], ...]:
    return tuple((0, int(part)) if part.isdecimal() else (1, part) for part in _DIGITS.split(name) if part)
