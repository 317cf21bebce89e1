"""Score many logs, with detectors or by external alarms, and gather their rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, RecordingError
from cdtool.base.findings import Finding, remark
from cdtool.commands.judging.impact_free import unchecked
from cdtool.commands.scoring.benchmark_file import HOLDOUT, BenchmarkFile
from cdtool.commands.scoring.counting import Exposure, SweepRows
from cdtool.commands.scoring.force_rows import point_rows
from cdtool.commands.scoring.log_outcome import LogOutcome, OfOperation, slowest_of, striking_of
from cdtool.commands.scoring.pieces import Piece, PieceOutcome, lost, same_content
from cdtool.execution.store.sources import SourceFile
from cdtool.execution.workers import Progress, Workers, in_order
from cdtool.results.results import (
    CalibrationResult,
    ContactResult,
    FalseAlarmResult,
    ForceResult,
    RecordingFinding,
    RecordingResult,
    Results,
    Skipped,
)
from cdtool.results.rows import Rows
from cdtool.results.traces.choice import TraceChoice
from cdtool.results.traces.trace import Trace
from cdtool.truth.force.verdict import ForceVerdict

# The name of its group and the path of each log.
Logs = Sequence[tuple[str, Path]]


@dataclass
class _Place:
    """A log, its files, and the number of its operations so far."""

    number: int
    group: str
    path: Path
    sources: tuple[SourceFile, ...] | None = None
    operations: int = 0


class Gathering:
    """The rows of a benchmark, log by log in the order of the file, and the selected traces.

    `names` are the detectors; `learned` maps the hashes of the logs learned from to their names.
    """

    def __init__(
        self,
        setup: BenchmarkFile,
        names: Sequence[str],
        factors: Mapping[str, FloatArray],
        learned: Mapping[str, str],
    ) -> None:
        self.setup = setup
        self.names = tuple(names)
        self.learned = learned
        self.recordings = Rows(RecordingResult)
        self.contacts = Rows(ContactResult)
        self.false_alarms = Rows(FalseAlarmResult)
        self.forces = Rows(ForceResult)
        self.skipped = Rows(Skipped)
        self.findings = Rows(RecordingFinding)
        self.findings += (RecordingFinding.of(str(setup.path), remark(words)) for words in setup.migrated)
        self.findings += setup.rules_of("").findings
        # SHA-256 of the files beside the logs.
        self._beside: dict[str, str] = {}
        # By detector: the unit of the value compared with the limits, which may differ from that of the signal.
        self.units: dict[str, str] = {}
        self._exposure: dict[tuple[str, str], Exposure] = {}
        self._sweep = SweepRows(factors, HOLDOUT)
        self._tests: dict[tuple[str, str], list[ForceVerdict]] = {}
        self._scored: dict[str, str] = {}
        self._unchecked: list[tuple[str, Finding]] = []
        self._traces: dict[int, Trace] = {}
        # The log of each trace that is kept, made or not, and the number of the operation in it.
        self._places: dict[int, tuple[_Place, int]] = {}
        self._place = _Place(0, "", Path())
        self._choice = TraceChoice(
            sum(len(setup.impacts[group].logs) for group in setup.groups),
            frozenset(item.group for item in setup.conditions),
        )
        # Logs of which nothing was computed.
        self.stored = 0
        # Time that all logs took [s].
        self.reading = self.detecting = 0.0

    def score(
        self,
        scoring: Callable[[Piece], PieceOutcome],
        logs: Logs,
        workers: Workers | None = None,
        progress: Progress | None = None,
    ) -> None:
        """Score the logs, and add the rows of all; one that ends its workers is left out.

        Raises ConfigurationError if the same log, under any name, was learned from or given twice.
        """
        workers, of_lost = workers or Workers(), partial(lost, self.setup)
        made = in_order(scoring, self._pieces(logs), len(logs), workers, progress=progress, of_lost=of_lost)
        for log, ((group, path), piece) in enumerate(zip(logs, made, strict=True)):
            self.stored += piece.is_stored
            self._place = _Place(log, group, path, piece.sources)
            for outcome in piece.outcomes:
                self._add(log, group, outcome)
        self._make_absent_traces(scoring, workers)

    def _pieces(self, logs: Logs) -> Iterator[Piece]:
        # Known now: more traces are made than are kept at the logs' turn, never fewer.
        choice = self._choice.copy()
        for log, (group, path) in enumerate(logs):
            if choice.offered != self._choice.offered:
                choice = self._choice.copy()
            yield Piece(log, group, path, choice)

    def _make_absent_traces(self, scoring: Callable[[Piece], PieceOutcome], workers: Workers) -> None:
        """Make the traces that are kept and were not made when the logs were scored, as of logs that were stored."""
        absent: dict[int, list[tuple[int, _Place, int]]] = {}
        for number in self._choice.kept():
            if number not in self._traces:
                place, operation = self._places[number]
                absent.setdefault(place.number, []).append((number, place, operation))
        wanted = list(absent.values())
        pieces = (
            Piece(place.number, place.group, place.path, operations=tuple(operation for _, _, operation in of_log))
            for of_log in wanted
            for _, place, _ in of_log[:1]
        )
        made = in_order(scoring, pieces, len(wanted), workers, of_lost=partial(lost, self.setup))
        for of_log, outcome in zip(wanted, made, strict=True):
            traces = [trace for of_run in outcome.outcomes for trace in of_run.traces]
            for number, place, operation in of_log:
                trace = traces[operation] if operation < len(traces) else None
                # The log may have changed since its rows were stored.
                if trace is not None and same_content(outcome.sources, place.sources):
                    self._traces[number] = trace

    def _add(self, log: int, group: str, outcome: LogOutcome) -> None:
        self.reading += outcome.reading
        self.detecting += outcome.detecting
        self.skipped += outcome.skipped
        self.findings += outcome.findings
        self._unchecked += outcome.rows.unchecked
        if outcome.recording is None:
            return
        self._refuse_learned(outcome.recording)
        for number in range(outcome.operations):
            of_operation = tuple(outcome.of_operation(number))
            for name, item in of_operation:
                self.units.setdefault(name, item.unit)
                if (exposure := self._exposure.get((group, name))) is None:
                    exposure = self._exposure[group, name] = Exposure()
                exposure.add(item)
                self._sweep.add(group, name, item)
            self._offer(log, group, of_operation, outcome.traces[number] if outcome.traces else None)
        for detector in outcome.detectors:
            if any(item is not None for item in detector.operations):
                self._exposure[group, detector.detector].recordings += 1
        if outcome.recording.point:
            self._tests.setdefault((group, outcome.recording.point), []).extend(outcome.rows.verdicts)
        self.recordings.append(outcome.recording)
        self.contacts += outcome.contacts
        self.false_alarms += outcome.false_alarms
        self.forces += outcome.rows.forces
        self._beside |= {f"{outcome.recording.recording}, {name}": digest for name, digest in outcome.rows.beside}

    def _offer(self, log: int, group: str, outcomes: OfOperation, trace: Trace | None) -> None:
        number = self._choice.offer(log, group, len(outcomes), striking_of(outcomes), slowest_of(outcomes))
        operation, self._place.operations = self._place.operations, self._place.operations + 1
        if number is None:
            return
        kept = self._choice.kept()
        self._traces = {n: made for n, made in self._traces.items() if n in kept}
        self._places = {n: place for n, place in self._places.items() if n in kept}
        self._places[number] = self._place, operation
        if trace is not None:
            self._traces[number] = trace

    @property
    def traces(self) -> tuple[Trace, ...]:
        """Return the selected traces."""
        why = self._choice.kept()
        return tuple(replace(self._traces[number], chosen=why[number]) for number in why if number in self._traces)

    def results(self, provenance: Mapping[str, Any], calibration: Sequence[CalibrationResult] = ()) -> Results:
        """Return all results; raises RecordingError if no log could be scored."""
        if not self._exposure and not self.setup.limits:
            first = self.skipped[0] if self.skipped else None
            reason = f"; first reason: {first.recording}: {first.reason}" if first else ""
            hint = "" if first else "check with cdtool info"
            raise RecordingError(f"{self.setup.path}: no recording could be scored{reason}", hint)
        if self._choice.left_out:
            left_out = Finding("plots_left_out", "", {"count": self._choice.left_out})
            self.findings.append(RecordingFinding.of(str(self.setup.path), left_out))
        profiles = {name: group.force for name, group in self.setup.impacts.items()}
        return Results(
            provenance={**provenance, "load_cell_sha256": self._beside} if self._beside else provenance,
            detectors=self.names,
            groups=self.setup.groups,
            conditions=self.setup.conditions,
            recordings=self.recordings,
            contacts=self.contacts,
            false_alarms=self.false_alarms,
            exposure=tuple(item.result(group, name) for (group, name), item in self._exposure.items()),
            forces=self.forces,
            points=tuple(point_rows(self._tests, profiles)),
            sweep=tuple(self._sweep.rows(self.names, self.setup.groups)),
            calibration=tuple(calibration),
            skipped=self.skipped,
            findings=self._findings(),
        )

    def _findings(self) -> Rows[RecordingFinding]:
        """Return all findings; one about a file of which several groups have runs is the same in each of them."""
        self.findings += unchecked(self._unchecked)
        return Rows(RecordingFinding, dict.fromkeys(self.findings)) if self.setup.has_runs else self.findings

    @property
    def scored(self) -> frozenset[str]:
        """Return the names of the recordings that were scored or left out by name."""
        return frozenset((*self.skipped.values("recording"), *self.recordings.values("recording")))

    def _refuse_learned(self, recording: RecordingResult) -> None:
        before = self._scored.get(recording.sha256, "") if recording.sha256 else ""
        self._scored[recording.sha256] = recording.recording
        if before and before == recording.recording:
            raise ConfigurationError(
                f"{self.setup.path}: {before} is scored twice", "name each run in one group only, and once"
            )
        if before:
            raise ConfigurationError(
                f"{self.setup.path}: {recording.recording} and {before} have identical content", "score each log once"
            )
        learned = self.learned.get(recording.sha256, "") if recording.sha256 else ""
        # A log in [learn] up to its contact and in a group is scored with what was learned from the others.
        if learned and not (self.setup.both and learned == recording.recording):
            raise ConfigurationError(
                f"{self.setup.path}: {recording.recording} has the same content as {learned}, "
                "which is used for learning",
                "use a recording either in [learn] or for scoring",
            )
