"""Results: every verdict of a benchmark with raw figures and provenance. Versioned; statistics are derived from it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from cdtool.errors import RecordingError

SCHEMA_VERSION = 1


@dataclass(frozen=True)
class ContactResult:
    """One contact seen by one detector; None where there is no figure."""

    recording: str
    group: str
    detector: str
    joint: str | None
    onset_s: float
    onset_uncertainty_s: float
    alarm_s: float | None
    latency_ms: float | None
    outcome: str
    force_at_alarm_n: float | None
    peak_force_n: float | None
    clipped: bool = False
    reason: str | None = None


@dataclass(frozen=True)
class FalseAlarmResult:
    """One alarm without a contact."""

    recording: str
    group: str
    detector: str
    joint: str
    time_s: float


@dataclass(frozen=True)
class ExposureResult:
    """How long and how often a detector watched in a group: the denominator of its false alarms.

    `not_assessable` counts operations that it could judge nowhere; `not_judged` is the share of all samples by reason.
    """

    group: str
    detector: str
    recordings: int
    operations: int
    hours: float
    not_assessable: int = 0
    not_judged: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Skipped:
    """A recording that was left out, and why."""

    recording: str
    reason: str


@dataclass(frozen=True)
class Results:
    """All of it, in the order of the benchmark file."""

    provenance: Mapping[str, Any]
    detectors: tuple[str, ...]
    groups: tuple[str, ...]
    contacts: tuple[ContactResult, ...]
    false_alarms: tuple[FalseAlarmResult, ...]
    exposure: tuple[ExposureResult, ...]
    skipped: tuple[Skipped, ...] = ()
    findings: tuple[Skipped, ...] = ()
    schema_version: int = field(default=SCHEMA_VERSION)

    def to_json(self) -> str:
        """Strict JSON: null where there is no figure."""
        return json.dumps(_finite(asdict(self)), indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def read_results(path: Path) -> Results:
    """Read results.json; raises RecordingError."""
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
        if values["schema_version"] != SCHEMA_VERSION:
            raise RecordingError(f"{path}: schema_version {values['schema_version']}", f"{SCHEMA_VERSION} is known")
        return Results(
            provenance=values["provenance"],
            detectors=tuple(values["detectors"]),
            groups=tuple(values["groups"]),
            contacts=tuple(ContactResult(**item) for item in values["contacts"]),
            false_alarms=tuple(FalseAlarmResult(**item) for item in values["false_alarms"]),
            exposure=tuple(ExposureResult(**item) for item in values["exposure"]),
            skipped=tuple(Skipped(**item) for item in values["skipped"]),
            findings=tuple(Skipped(**item) for item in values["findings"]),
        )
    except (OSError, ValueError, KeyError, TypeError) as fault:
        raise RecordingError(f"{path}: not a results file: {fault!r}", "write one with cdtool benchmark") from fault


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return value
