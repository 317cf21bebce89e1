"""Copies of a sample log with a changed load cell, damaged values, stamps or rows."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

SAMPLES = Path(__file__).parents[3] / "sample_logs" / "gate"


def changed(source: Path, target: Path, change: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> None:
    """Return a copy of a log with `change(time [s], force [N])` as its load cell."""
    lines = source.read_text(encoding="utf-8").splitlines()
    rows = [line.split(",") for line in lines[1:]]
    time, force = (np.array([float(row[k]) for row in rows]) for k in (0, 5))
    made = change(1e-3 * time, 1e3 * force) / 1e3
    for row, value in zip(rows, made, strict=True):
        row[5] = f"{value:.6g}"
    target.parent.mkdir(exist_ok=True, parents=True)
    target.write_text("\n".join([lines[0], *(",".join(row) for row in rows)]) + "\n", encoding="utf-8")


def folder_of(folder: Path, hits: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]], more: str = "") -> Path:
    """Return a benchmark of one detector on changed copies of one impact; hold-outs unchanged or drifting."""
    shutil.copy(SAMPLES / "machine.toml", folder)
    for name, change in hits.items():
        group = "holdout" if name.startswith("free") else "stiff"
        source = SAMPLES / ("holdout/03.csv" if group == "holdout" else "stiff/03.csv")
        changed(source, folder / group / f"{name}.csv", change)
    file = folder / "benchmark.toml"
    holdout = '[holdout]\nlogs = ["holdout/*.csv"]\n' if (folder / "holdout").exists() else ""
    file.write_text(
        f'machine = "machine.toml"\ndetectors = ["pi"]\n[learn]\nlogs = ["{SAMPLES}/free/*.*"]\n'
        f'{holdout}[impacts.stiff]\nlogs = ["stiff/*.csv"]\n[onset]\nabove_n = 20.0\nback_to_n = 8.0\n{more}',
        encoding="utf-8",
    )
    return file


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
