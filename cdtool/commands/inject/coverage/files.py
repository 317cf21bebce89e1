"""The files of the map that `cdtool inject` writes, by suffix: HTML page, JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from cdtool.base.files.foreign import Kind, refuse_inputs, refuse_other_kind
from cdtool.base.files.strict_json import strict_json
from cdtool.base.files.writing import write_texts
from cdtool.commands.inject.coverage.coverage import Coverage
from cdtool.commands.inject.coverage.coverage_map import CellKey, MapCell
from cdtool.report.outputs import check_output_names

PAGE, JSON = ".html", ".json"
_TOOL = "cdtool inject"
_KINDS: Mapping[str, Kind] = {
    PAGE: Kind(b"<title>Coverage", f"HTML page of {_TOOL}"),
    JSON: Kind(f'"tool": "{_TOOL}"'.encode(), f"map of {_TOOL}"),
}


def check_coverage_files(targets: Sequence[Path], inputs: Sequence[Path], *, force: bool = False) -> None:
    """Raise UsageError for a target that cannot be written: an unknown suffix, a name given twice, a foreign file.

    A file that this command wrote may be rewritten; any other existing file is replaced only with `force`, and a file
    of `inputs`, which are read, never.
    """
    check_output_names(targets, tuple(_KINDS))
    for target in targets:
        refuse_other_kind(target, _KINDS[target.suffix.lower()], force=force)
    refuse_inputs(targets, inputs)


def write_coverage(done: Coverage, targets: Sequence[Path]) -> None:
    """Write each target by its suffix, all or none. Raises UsageError, OutputError."""
    refuse_inputs(targets, done.inputs)
    write_texts({target: _text(done, target) for target in targets})


def _text(done: Coverage, target: Path) -> str:
    if target.suffix.lower() == JSON:
        return strict_json(coverage_summary(done)) + "\n"
    from cdtool.commands.inject.coverage.page import coverage_html

    return coverage_html(done)


def coverage_summary(done: Coverage) -> dict[str, Any]:
    """Return the map as plain values for JSON: every cell with its recordings, and the most telling cells first."""
    made = done.map
    return {
        "tool": _TOOL,
        "machine": done.machine,
        "unit": made.unit,
        "speed_unit": made.speed_unit,
        "positions": list(made.positions),
        "stiffnesses_n_per_m": list(made.stiffnesses),
        "speeds": [asdict(item) for item in made.speeds],
        "most_telling": [
            {"detector": item.detector, **asdict(item.key), "reason": item.reason.name.lower()}
            for item in made.most_telling()
        ],
        "cells": [_cell(name, key, cell) for name, cells in made.cells.items() for key, cell in cells.items()],
        "skipped": [asdict(item) for item in done.skipped],
    }


def _cell(detector: str, key: CellKey, cell: MapCell) -> dict[str, Any]:
    telling = cell.telling
    reason = None if telling is None else telling.name.lower()
    return {"detector": detector, **asdict(key), **asdict(cell), "telling": reason}
