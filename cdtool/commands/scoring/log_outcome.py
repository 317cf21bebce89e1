"""What remains of a scored log in a benchmark: its rows, totals and selected traces, without any of its samples.

What does not depend on the detectors is separate from the outcome of each detector, so that a detector can be run
without the others, and its outcome be kept.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from cdtool.alarms.pipeline import Detection
from cdtool.commands.judging.judged_operation import Judged
from cdtool.commands.judging.matched_log import MatchedLog, UncutStrokes
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.detector_inputs import inputs_of
from cdtool.commands.scoring.scoring import LogRows, ScoredLog, left_out_by
from cdtool.report.explanation_words import words
from cdtool.results.curves.sweep import Swept
from cdtool.results.explanation.explanation import explain_operation
from cdtool.results.results import (
    ContactResult,
    FalseAlarmResult,
    RecordingFinding,
    RecordingResult,
    Skipped,
)
from cdtool.results.traces.choice import TraceChoice
from cdtool.results.traces.trace import Trace, make_trace
from cdtool.thresholds.normal_motion import NormalMotions
from cdtool.truth.matching import Matching


@dataclass(frozen=True)
class OperationOutcome:
    """One detector on one operation: how long it monitored it, and what became of its contacts.

    `seconds` were assessable, `samples` in all, `by_reason` of them not assessable. `contacts` has a row for each
    contact of the operation; `swept` is None without an impact-free group.
    """

    unit: str
    seconds: float
    is_not_assessable: bool
    samples: int
    by_reason: Mapping[str, int]
    contacts: tuple[ContactResult, ...]
    false_alarms: tuple[FalseAlarmResult, ...]
    swept: Swept | None

    @property
    def outcomes(self) -> tuple[str, ...]:
        """Return the outcome of each contact."""
        return tuple(row.outcome for row in self.contacts)


@dataclass(frozen=True)
class DetectorOutcome:
    """One detector on one log: an outcome for each operation, None where it failed.

    `failed` are the operations on which it failed, with the reason; `findings` are about its threshold for this log.
    `uncut` are the strokes that it cannot assess because the log is not cut.
    """

    detector: str
    operations: tuple[OperationOutcome | None, ...]
    failed: tuple[Skipped, ...] = ()
    findings: tuple[RecordingFinding, ...] = ()
    uncut: tuple[int, ...] = ()


@dataclass(frozen=True)
class LogOutcome:
    """The results of one log or run, small enough to be sent from one process to another.

    `traces` has one entry per operation, None where its trace is not wanted; it is empty if none is. `lasts`:
    the log would have the same outcome again.
    """

    rows: LogRows
    detectors: tuple[DetectorOutcome, ...] = ()
    traces: tuple[Trace | None, ...] = ()
    lasts: bool = True

    @property
    def recording(self) -> RecordingResult | None:
        """Return the row of the log; None if it was left out."""
        return self.rows.recording

    @property
    def operations(self) -> int:
        """Return the number of operations."""
        return max((len(item.operations) for item in self.detectors), default=0)

    def of_operation(self, number: int) -> Iterator[tuple[str, OperationOutcome]]:
        """Yield every detector that did not fail on an operation, and its outcome; `number` counts from 0."""
        for item in self.detectors:
            made = item.operations[number]
            if made is not None:
                yield item.detector, made

    @property
    def contacts(self) -> Iterator[ContactResult]:
        """Return the rows of all contacts, operation by operation."""
        every = (made for number in range(self.operations) for _, made in self.of_operation(number))
        return (row for made in every for row in made.contacts)

    @property
    def false_alarms(self) -> Iterator[FalseAlarmResult]:
        """Return the rows of all false alarms, operation by operation."""
        every = (made for number in range(self.operations) for _, made in self.of_operation(number))
        return (row for made in every for row in made.false_alarms)

    @property
    def skipped(self) -> tuple[Skipped, ...]:
        """Return what was left out of the log; what all detectors left out for the same reason is listed once."""
        return (*self.rows.skipped, *left_out_by({item.detector: item.failed for item in self.detectors}))

    @property
    def findings(self) -> tuple[RecordingFinding, ...]:
        """Return the findings about the log."""
        findings = [*self.rows.findings]
        if self.rows.recording is not None:
            uncut = {item.detector: item.uncut for item in self.detectors}
            findings += UncutStrokes(self.rows.recording.recording, self.rows.strokes, uncut).findings
        return (*findings, *(finding for item in self.detectors for finding in item.findings))


# The detectors that did not fail on an operation, with their outcomes.
OfOperation = Sequence[tuple[str, OperationOutcome]]


def striking_of(outcomes: OfOperation) -> str:
    """Return which detectors missed a contact of an operation or raised a false alarm in it; empty if none did."""
    missed = [name for name, made in outcomes if "missed" in made.outcomes]
    false = [name for name, made in outcomes if made.false_alarms]
    striking = [f"missed by {', '.join(missed)}"] if missed else []
    striking += [f"false alarm of {', '.join(false)}"] if false else []
    return "; ".join(striking)


def slowest_of(outcomes: OfOperation) -> float:
    """Return the longest latency in an operation [ms]; 0 if no contact was detected."""
    return max((row.latency_ms or 0.0 for _, made in outcomes for row in made.contacts), default=0.0)


@dataclass(frozen=True)
class WantedTraces:
    """Which traces of log number `log` are wanted: those that are kept after the operations in `choice`.

    The operations of the log are then in `choice`, too.
    """

    log: int
    choice: TraceChoice

    def is_wanted(self, group: str, outcomes: OfOperation) -> bool:
        """Return whether the trace of the next operation of the log is wanted."""
        striking, slowest = striking_of(outcomes), slowest_of(outcomes)
        return self.choice.offer(self.log, group, len(outcomes), striking, slowest) is not None


@dataclass
class TheseTraces:
    """The traces of certain operations of a log, by number from 0, counted on through its runs."""

    numbers: Collection[int]
    seen: int = 0

    def is_wanted(self, _: str, __: OfOperation) -> bool:
        """Return whether the trace of the next operation of the log is wanted."""
        self.seen += 1
        return self.seen - 1 in self.numbers


Wanted = WantedTraces | TheseTraces


def outcome_of(
    scored: ScoredLog, setup: BenchmarkFile, normals: Callable[[], NormalMotions], wanted: Wanted | None
) -> LogOutcome:
    """Return what remains of a scored log; alarms are explained by comparison with `normals`, for wanted traces."""
    detections, matched = scored.detections, scored.matched
    judged = matched.judged if matched else ()
    uncut = matched.uncut.not_assessable if matched else {}
    outcome = LogOutcome(
        scored.rows,
        tuple(
            DetectorOutcome(
                detector=name,
                operations=tuple(_on_operation(name, matched, number) for number in range(len(judged))),
                failed=failed,
                findings=tuple(detections.untaught.get(name, ())),
                uncut=uncut.get(name, ()),
            )
            for name, failed in detections.failed.items()
        ),
        lasts=scored.lasts,
    )
    if wanted is None:
        return outcome
    compared = cache(normals)
    traces = [
        _trace(item, setup, compared()) if wanted.is_wanted(item.group, tuple(outcome.of_operation(number))) else None
        for number, item in enumerate(judged)
    ]
    return replace(outcome, traces=tuple(traces))


def _on_operation(detector: str, matched: MatchedLog | None, number: int) -> OperationOutcome | None:
    """Return the outcome of a detector on an operation; None if it failed on it."""
    assert matched is not None, "operations are matched before they are judged"
    judged = matched.judged[number]
    for detection, swept in zip(judged.detections, judged.sweeps, strict=True):
        if detection.detector == detector:
            statistic = detection.statistic
            size = statistic.status.size
            return OperationOutcome(
                unit=statistic.unit,
                seconds=detection.assessed_seconds,
                is_not_assessable=detection.verdict.outcome == "not_assessable",
                samples=size,
                by_reason={reason: round(share * size) for reason, share in statistic.shares().items()},
                contacts=tuple(row for row in matched.contacts[number] if row.detector == detector),
                false_alarms=tuple(row for row in matched.false_alarms[number] if row.detector == detector),
                swept=swept,
            )
    return None


def _trace(judged: Judged, setup: BenchmarkFile, normals: NormalMotions) -> Trace:
    return make_trace(
        judged.group,
        judged.operation,
        judged.contacts,
        judged.detections,
        judged.matchings,
        [
            _explained(detection, matching, setup, normals)
            for detection, matching in zip(judged.detections, judged.matchings, strict=True)
        ],
    )


def _explained(detection: Detection, matching: Matching, setup: BenchmarkFile, normals: NormalMotions) -> list[str]:
    """Return why each alarm was raised and each contact missed; empty for external alarms."""
    if detection.threshold is None:
        return []
    inputs = inputs_of(detection.detector, setup.machine_file)
    found = explain_operation(detection, matching, setup.activation, inputs, normals)
    return [line for item in found for line in words(item)]
