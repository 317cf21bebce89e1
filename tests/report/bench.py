"""Detectors with signatures of the gate, and rows of results for tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from cdtool.alarms.pipeline import Detection
from cdtool.commands.detecting.detection import Detected
from cdtool.commands.judging.judged_operation import Judged, contact_rows
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import Recording
from cdtool.results.results import ContactResult
from cdtool.results.traces.trace import Trace, make_trace
from cdtool.truth.matching import match
from cdtool.truth.onset import OnsetRule, find_contacts

NAMES = ("pure_inertia", "friction_ekf", "momentum", "pure_torque")
RULE = OnsetRule(above=20.0, back_to=8.0)


@dataclass(frozen=True)
class Bench:
    """Detectors with their signatures."""

    detect: Callable[[Recording, str], Detection]

    def detected(self, recording: Recording, name: str) -> Detected:
        detection, contacts = self.detect(recording, name), tuple(find_contacts(recording, RULE))
        matching = match(detection.verdict, contacts, detection.statistic)
        judged = Judged("", operations_of(recording)[0], contacts, (detection,), (matching,))
        rows = tuple(contact_rows(judged, recording, contacts, {}, 0.0))
        return Detected(recording, (detection,), contacts, (matching,), "limit 1 N set by hand", contact_rows=(rows,))

    def trace(self, recording: Recording, group: str, names: Sequence[str] = NAMES) -> Trace:
        detections = tuple(self.detect(recording, name) for name in names)
        contacts = tuple(find_contacts(recording, RULE))
        matchings = tuple(match(item.verdict, contacts, item.statistic) for item in detections)
        return make_trace(group, operations_of(recording)[0], contacts, detections, matchings)


def contact(
    detector: str, group: str, latency: float | None, outcome: str = "detected", name: str = "01"
) -> ContactResult:
    alarm = None if latency is None else 5.0 + 1e-3 * latency
    return ContactResult(
        name, group, detector, "gate", 5.0, 5e-4, alarm, latency, outcome, None, 3600.0, watched_ms=1000.0
    )


def contacts_of(detector: str, group: str, latencies: Sequence[float | str | None]) -> list[ContactResult]:
    """Return a recording per contact; None is missed, a text is the reason for not assessable."""
    made = []
    for i, late in enumerate(latencies, 1):
        name = f"{group}/{i:02}.csv"
        if isinstance(late, str):
            made.append(replace(contact(detector, group, None, "not_assessable", name), reason=late))
        else:
            made.append(contact(detector, group, late, "detected" if late is not None else "missed", name))
    return made
