"""Combine the reports of several detectors that left out a run for the same reason."""

from __future__ import annotations

from collections.abc import Iterable

from cdtool.results.results import Skipped


class LeftOut:
    """Runs left out by detectors: a reason shared by all detectors is listed once, others name their detectors."""

    def __init__(self) -> None:
        self._detectors: dict[str, None] = {}
        self._reasons: dict[Skipped, dict[str, None]] = {}

    def add(self, detector: str, skipped: Iterable[Skipped]) -> None:
        """Add what one detector left out; may be empty."""
        self._detectors[detector] = None
        for item in skipped:
            self._reasons.setdefault(item, {})[detector] = None

    def combined(self) -> list[Skipped]:
        """Return each run with each reason once."""
        return [
            item
            if len(names) == len(self._detectors)
            else Skipped(item.recording, f"{', '.join(names)}: {item.reason}")
            for item, names in self._reasons.items()
        ]
