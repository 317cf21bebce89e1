"""The names of the files that a command is asked to write, before it begins its work."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cdtool.base.errors import UsageError
from cdtool.base.files.writing import resolved
from cdtool.base.plain_text import plain
from cdtool.report.outputs import check_parent


def check_output_names(targets: Sequence[Path], suffixes: Sequence[str]) -> None:
    """Raise UsageError for a name with another suffix, a name given twice, or one in a folder that does not exist."""
    for target in targets:
        if target.suffix.lower() not in suffixes:
            *others, last = suffixes
            raise UsageError(f"--output is '{plain(target)}'", f"the name must end in {', '.join(others)} or {last}")
        if targets.count(target) > 1:
            raise UsageError(f"--output is '{plain(target)}' twice", "give each name once")
        resolved(target)
        check_parent(target)
