"""The argument LOG... of several commands; patterns of URLs name logs, too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer

from cdtool.commands.console.place import location

_PATTERN = frozenset("*?[")


def logs_argument(description: str) -> Any:
    """Return the argument of one or more logs, with its description in the help."""
    return typer.Argument(parser=location, callback=_each_log, help=description, metavar="LOG")


def _each_log(logs: list[Path]) -> list[Path]:
    """Return the logs with each pattern of a URL replaced by what matches, as a shell does for local files.

    A pattern without a match stays, and is reported as a missing file.
    """
    found: list[Path] = []
    for log in logs:
        found += _matching(log) or [log]
    return found


def _matching(log: Path) -> list[Path]:
    if "://" not in str(log) or not _PATTERN.intersection(str(log)):
        return []
    from cdtool.commands.judging.runs import matching_logs

    return matching_logs(Path(), str(log))
