"""A contact as JSON: the row of `cdtool benchmark`, in every command that shows a contact."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cdtool.alarms.pipeline import Detection
    from cdtool.results.results import ContactResult

# Fields of the whole log or benchmark, not of the contact.
_ELSEWHERE = ("recording", "group", "detector")


def contact_as_json(detection: Detection, row: ContactResult) -> dict[str, Any]:
    """Return a contact's row together with its operation."""
    values = {name: value for name, value in asdict(row).items() if name not in _ELSEWHERE}
    return {"operation": detection.operation.name, **values}
