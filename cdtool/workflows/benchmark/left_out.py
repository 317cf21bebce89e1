"""What several detectors left out for the same reason, said once."""

from __future__ import annotations

from collections.abc import Iterable

from cdtool.evaluation.results import Skipped


class LeftOut:
    """Runs that detectors left out: a reason that all of them have is said once, any other one names its detectors."""

    def __init__(self) -> None:
        self._detectors: dict[str, None] = {}
        self._reasons: dict[Skipped, dict[str, None]] = {}

    def add(self, detector: str, skipped: Iterable[Skipped]) -> None:
        """Take what one detector left out, which may be nothing."""
        self._detectors[detector] = None
        for item in skipped:
            self._reasons.setdefault(item, {})[detector] = None

    def said_once(self) -> list[Skipped]:
        """Return each run with each reason once."""
        return [
            item
            if len(names) == len(self._detectors)
            else Skipped(item.recording, f"{', '.join(names)}: {item.reason}")
            for item, names in self._reasons.items()
        ]
