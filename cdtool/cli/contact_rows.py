"""A contact as JSON: the row that `cdtool benchmark` writes, in every command that shows one."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cdtool.evaluation.results import ContactResult
    from cdtool.pipeline import Detection

# Said of the log as a whole, or of the benchmark.
_ELSEWHERE = ("recording", "group", "detector")


def contact_as_json(detection: Detection, row: ContactResult) -> dict[str, Any]:
    """A contact's row with the operation that it lies in."""
    values = {name: value for name, value in asdict(row).items() if name not in _ELSEWHERE}
    return {"operation": detection.operation.name, **values}
