"""What remains of a scored log in a benchmark: its rows, totals and selected traces, without any of its samples."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from cdtool.alarms.pipeline import Detection
from cdtool.commands.judging.judged_operation import Judged
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.detector_inputs import inputs_of
from cdtool.commands.scoring.scoring import LogRows, ScoredLog
from cdtool.report.explanation_words import words
from cdtool.results.curves.sweep import Swept
from cdtool.results.explanation.explanation import explain_operation
from cdtool.results.results import (
    ContactResult,
    FalseAlarmResult,
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

    detector: str
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


# The detectors that did not fail on an operation, with their outcomes.
OfOperation = tuple[OperationOutcome, ...]


@dataclass(frozen=True)
class LogOutcome:
    """The results of one log or run, small enough to be sent from one process to another.

    `traces` has one entry per operation, None where its trace is not wanted; it is empty if none is. `lasts`:
    the log would have the same outcome again.
    """

    rows: LogRows
    operations: tuple[OfOperation, ...] = ()
    traces: tuple[Trace | None, ...] = ()
    lasts: bool = True


def striking_of(outcomes: OfOperation) -> str:
    """Return which detectors missed a contact of an operation or raised a false alarm in it; empty if none did."""
    missed = [made.detector for made in outcomes if "missed" in made.outcomes]
    false = [made.detector for made in outcomes if made.false_alarms]
    striking = [f"missed by {', '.join(missed)}"] if missed else []
    striking += [f"false alarm of {', '.join(false)}"] if false else []
    return "; ".join(striking)


def slowest_of(outcomes: OfOperation) -> float:
    """Return the longest latency in an operation [ms]; 0 if no contact was detected."""
    return max((row.latency_ms or 0.0 for made in outcomes for row in made.contacts), default=0.0)


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
    matched = scored.matched
    if matched is None:
        return LogOutcome(scored.rows, lasts=scored.lasts)
    of_operations = zip(matched.judged, matched.contacts, matched.false_alarms, strict=True)
    operations = tuple(_on_operation(*item) for item in of_operations)
    outcome = LogOutcome(scored.rows, operations if any(operations) else (), lasts=scored.lasts)
    if wanted is None or not any(operations):
        return outcome
    compared = cache(normals)
    traces = [
        _trace(item, setup, compared()) if wanted.is_wanted(item.group, made) else None
        for item, made in zip(matched.judged, operations, strict=True)
    ]
    return replace(outcome, traces=tuple(traces))


def _on_operation(
    judged: Judged, contacts: Sequence[ContactResult], false_alarms: Sequence[FalseAlarmResult]
) -> OfOperation:
    """Return the outcome of each detector on an operation, given the rows of all."""
    return tuple(
        OperationOutcome(
            detector=item.detector,
            unit=item.statistic.unit,
            seconds=item.assessed_seconds,
            is_not_assessable=item.verdict.outcome == "not_assessable",
            samples=item.statistic.status.size,
            by_reason={
                reason: round(share * item.statistic.status.size) for reason, share in item.statistic.shares().items()
            },
            contacts=tuple(row for row in contacts if row.detector == item.detector),
            false_alarms=tuple(row for row in false_alarms if row.detector == item.detector),
            swept=swept,
        )
        for item, swept in zip(judged.detections, judged.sweeps, strict=True)
    )


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
