"""Score many logs, with detectors or by external alarms, and gather their rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
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
from cdtool.commands.scoring.pieces import Piece, PieceOutcome, PieceScoring, ScoreLog, lost
from cdtool.commands.scoring.store.stored_outcomes import Planned, StoredOutcomes, same_content
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
from cdtool.results.traces.choice import TraceChoice
from cdtool.results.traces.trace import Trace
from cdtool.truth.force.verdict import ForceVerdict

# The name of its group and the path of each log.
Logs = Sequence[tuple[str, Path]]


@dataclass
class _Place:
    """A log, its files, and the number of its operations so far; its traces are kept in the store if there is one."""

    number: int
    group: str
    path: Path
    sources: tuple[SourceFile, ...] | None = None
    stored: StoredOutcomes | None = None
    operations: int = 0

    @property
    def log(self) -> tuple[str, Path]:
        """Return the group and the path of the log."""
        return self.group, self.path

    def keep(self, operation: int, trace: Trace) -> None:
        """Store the trace of an operation."""
        if self.stored:
            self.stored.add_trace(self.log, self.sources, operation, trace)


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
        self.recordings: list[RecordingResult] = []
        self.contacts: list[ContactResult] = []
        self.false_alarms: list[FalseAlarmResult] = []
        self.forces: list[ForceResult] = []
        self.skipped: list[Skipped] = []
        self.findings = [RecordingFinding.of(str(setup.path), remark(words)) for words in setup.migrated]
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
        # Time that all logs took [s].
        self.reading = self.detecting = 0.0

    def score(
        self,
        scoring: Callable[[], ScoreLog],
        logs: Logs,
        workers: Workers | None = None,
        progress: Progress | None = None,
        stored: StoredOutcomes | None = None,
        plan: Sequence[Planned] = (),
    ) -> None:
        """Score the logs that are not `stored`, and add the rows of all; one that ends its workers is left out.

        `plan` is what is stored of each log; `scoring` is called if one has to be scored. Raises ConfigurationError if
        the same log, under any name, was learned from or given twice.
        """
        workers = workers or Workers()
        plan = plan or [Planned()] * len(logs)
        missing = [log for log, planned in enumerate(plan) if not planned.is_known]

        @cache
        def work() -> PieceScoring:
            return PieceScoring(self.setup, scoring(), with_sources=stored is not None)

        pieces = self._pieces(missing, logs, plan, stored)
        of_lost = partial(lost, self.setup)
        computed: Iterator[PieceOutcome] = iter(())
        if missing:
            computed = in_order(work(), pieces, len(missing), workers, of_lost=of_lost)
        for log, ((group, path), planned) in enumerate(zip(logs, plan, strict=True)):
            made = None if planned.is_known else next(computed)
            outcomes = self._complete(group, path, planned, made, stored)
            if outcomes is None:  # what was stored of it is gone
                planned, made = Planned(), work()(Piece(log, group, path, self._choice))
                outcomes = self._complete(group, path, planned, made, stored)
            assert outcomes is not None, "all of it was computed"
            self._place = _Place(log, group, path, planned.sources if made is None else made.sources, stored)
            for outcome in outcomes:
                self._add(log, group, outcome)
            if progress:
                progress(log + 1, len(logs))
        for _ in computed:  # their processes end
            pass
        self._make_absent_traces(work, workers)

    @staticmethod
    def _complete(
        group: str, path: Path, planned: Planned, made: PieceOutcome | None, stored: StoredOutcomes | None
    ) -> Sequence[LogOutcome] | None:
        """Return the outcomes of a log with what is stored of them; None if that is gone meanwhile."""
        if stored is None:
            return made.outcomes if made else None
        return stored.known(path, planned) if made is None else stored.add(group, path, planned, made)

    def _pieces(
        self, missing: Sequence[int], logs: Logs, plan: Sequence[Planned], stored: StoredOutcomes | None
    ) -> Iterator[Piece]:
        # Known now: more traces are made than are kept at the logs' turn, never fewer. Those of a batch share a choice.
        choice = self._choice.copy()
        for log in missing:
            if choice.offered != self._choice.offered:
                choice = self._choice.copy()
            group, path = logs[log]
            yield stored.piece(log, group, path, plan[log], choice) if stored else Piece(log, group, path, choice)

    def _make_absent_traces(self, work: Callable[[], PieceScoring], workers: Workers) -> None:
        """Make the traces that are kept and were not made when the logs were scored, as of logs that were stored."""
        absent: dict[int, list[tuple[int, _Place, int]]] = {}
        for number in self._choice.kept():
            if number not in self._traces:
                place, operation = self._places[number]
                trace = place.stored.trace(place.log, place.sources, operation) if place.stored else None
                if trace is not None:
                    self._traces[number] = trace
                else:
                    absent.setdefault(place.number, []).append((number, place, operation))
        wanted = list(absent.values())
        if not wanted:
            return
        pieces = (Piece(log[0][1].number, *log[0][1].log, operations=tuple(item[2] for item in log)) for log in wanted)
        made = in_order(work(), pieces, len(wanted), workers, of_lost=partial(lost, self.setup))
        for log, outcome in zip(wanted, made, strict=True):
            traces = [trace for of_run in outcome.outcomes for trace in of_run.traces]
            for number, place, operation in log:
                trace = traces[operation] if operation < len(traces) else None
                # The log may have changed since its rows were stored.
                if trace is not None and same_content(outcome.sources, place.sources):
                    self._traces[number] = trace
                    place.keep(operation, trace)

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
            self._place.keep(operation, trace)

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
            recordings=tuple(self.recordings),
            contacts=tuple(self.contacts),
            false_alarms=tuple(self.false_alarms),
            exposure=tuple(item.result(group, name) for (group, name), item in self._exposure.items()),
            forces=tuple(self.forces),
            points=tuple(point_rows(self._tests, profiles)),
            sweep=tuple(self._sweep.rows(self.names, self.setup.groups)),
            calibration=tuple(calibration),
            skipped=tuple(self.skipped),
            findings=self._findings(),
        )

    def _findings(self) -> tuple[RecordingFinding, ...]:
        """Return all findings; one about a file of which several groups have runs is the same in each of them."""
        self.findings += unchecked(self._unchecked)
        return tuple(dict.fromkeys(self.findings) if self.setup.has_runs else self.findings)

    @property
    def scored(self) -> frozenset[str]:
        """Return the names of the recordings that were scored or left out by name."""
        return frozenset([item.recording for rows in (self.skipped, self.recordings) for item in rows])

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
