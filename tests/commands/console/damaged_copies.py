"""Copies of a recording with damaged values, stamps and rows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path


def damaged(
    log: Path,
    target: Path,
    cells: Mapping[tuple[str, int], str] | None = None,
    without: range = range(0),
    shifted: Callable[[int, float], float] | None = None,
) -> Path:
    """Write a copy of a CSV log: cells by column and row replaced, rows removed, stamps changed by `shifted`."""
    head, *lines = log.read_text(encoding="utf-8").splitlines()
    names, rows = head.split(","), [line.split(",") for line in lines]
    for (name, row), text in (cells or {}).items():
        rows[row][names.index(name)] = text
    if shifted:
        for i, row in enumerate(rows):
            row[0] = f"{shifted(i, float(row[0])):g}"
    kept = [",".join(row) for i, row in enumerate(rows) if i not in without]
    target.write_text("\n".join([head, *kept]) + "\n", encoding="utf-8")
    return target
