"""Score many logs, with detectors or by external alarms, in the order of the benchmark file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

from cdtool.base.findings import Finding
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.log_outcome import LogOutcome, slowest_of, striking_of
from cdtool.commands.scoring.pieces import Piece, PieceOutcome, PieceScoring, ScoreLog, lost
from cdtool.commands.scoring.store.stored_outcomes import Planned, StoredOutcomes, same_content
from cdtool.execution.store.sources import SourceFile
from cdtool.execution.workers import Progress, Workers, in_order
from cdtool.results.results import RecordingFinding
from cdtool.results.traces.choice import TraceChoice
from cdtool.results.traces.trace import Trace

# The name of its group and the path of each log.
Logs = Sequence[tuple[str, Path]]


@dataclass(frozen=True)
class _Place:
    """An operation, by its number in a log; its trace is kept in the store if there is one."""

    number: int
    log: tuple[str, Path]
    sources: tuple[SourceFile, ...] | None
    operation: int


class ScoredLogs:
    """The outcomes of logs, each with its group, and the traces that are shown once all outcomes were taken.

    Parameters
    ----------
    setup : BenchmarkFile
        The benchmark.
    scoring : callable
        Returns how a log is scored; called if one has to be.
    logs : sequence of (str, Path)
        Group and path of each log.
    workers : Workers
        What scores them; a log that ends its workers is left out.
    progress : callable, optional
        Called after each log with the number done and the total.
    stored : StoredOutcomes, optional
        The store: what it has is not scored again.
    """

    def __init__(
        self,
        setup: BenchmarkFile,
        scoring: Callable[[], ScoreLog],
        logs: Logs,
        workers: Workers,
        progress: Progress | None = None,
        stored: StoredOutcomes | None = None,
    ) -> None:
        self.setup, self.logs, self.workers, self.progress, self.stored = setup, logs, workers, progress, stored
        self._scoring = scoring
        self._traces: dict[int, Trace] = {}
        # Where each trace is from that is kept, made or not.
        self._places: dict[int, _Place] = {}
        self._choice = TraceChoice(
            sum(len(setup.impacts[group].logs) for group in setup.groups),
            frozenset(item.group for item in setup.conditions),
        )
        # Time that all logs took [s].
        self.reading = self.detecting = 0.0

    @cached_property
    def _work(self) -> PieceScoring:
        return PieceScoring(self.setup, self._scoring(), with_sources=self.stored is not None)

    def __iter__(self) -> Iterator[tuple[str, LogOutcome]]:
        """Score the logs that are not stored, and yield the outcomes of all, in order."""
        plan = self.stored.plan(self.logs, self.workers) if self.stored else [Planned()] * len(self.logs)
        missing = [log for log, planned in enumerate(plan) if not planned.is_known]
        computed = self._computed(self._pieces(missing, plan), len(missing))
        for log, (group, path) in enumerate(self.logs):
            planned = plan[log]
            made = None if planned.is_known else next(computed)
            outcomes = self._complete(group, path, planned, made)
            if outcomes is None:  # what was stored of it is gone
                planned, made = Planned(), self._work(Piece(log, group, path, self._choice))
                outcomes = self._complete(group, path, planned, made)
            assert outcomes is not None, "all of it was computed"
            place = _Place(log, (group, path), planned.sources if made is None else made.sources, 0)
            for outcome in outcomes:
                self.reading += outcome.reading
                self.detecting += outcome.detecting
                place = self._offer(place, outcome)
                yield group, outcome
            if self.progress:
                self.progress(log + 1, len(self.logs))
        for _ in computed:  # their processes end
            pass

    def _computed(self, pieces: Iterator[Piece], count: int) -> Iterator[PieceOutcome]:
        if not count:
            return iter(())
        return in_order(self._work, pieces, count, self.workers, of_lost=partial(lost, self.setup))

    def _complete(
        self, group: str, path: Path, planned: Planned, made: PieceOutcome | None
    ) -> Sequence[LogOutcome] | None:
        """Return the outcomes of a log with what is stored of them; None if that is gone meanwhile."""
        if self.stored is None:
            return made.outcomes if made else None
        return self.stored.known(path, planned) if made is None else self.stored.add(group, path, planned, made)

    def _pieces(self, missing: Sequence[int], plan: Sequence[Planned]) -> Iterator[Piece]:
        # Known now: more traces are made than are kept at the logs' turn, never fewer. Those of a batch share a choice.
        choice = self._choice.copy()
        for log in missing:
            if choice.offered != self._choice.offered:
                choice = self._choice.copy()
            group, path = self.logs[log]
            yield (
                self.stored.piece(log, group, path, plan[log], choice)
                if self.stored
                else Piece(log, group, path, choice)
            )

    def _offer(self, place: _Place, outcome: LogOutcome) -> _Place:
        """Choose from the operations of a log or run, the first of which is at `place`; return the place after them."""
        if outcome.recording is None:
            return place
        for number in range(outcome.operations):
            judged = tuple(outcome.of_operation(number))
            group, _ = place.log
            chosen = self._choice.offer(place.number, group, len(judged), striking_of(judged), slowest_of(judged))
            if chosen is not None:
                kept = self._choice.kept()
                self._traces = {n: made for n, made in self._traces.items() if n in kept}
                self._places = {n: item for n, item in self._places.items() if n in kept} | {chosen: place}
                trace = outcome.traces[number] if outcome.traces else None
                if trace is not None:
                    self._keep(chosen, trace)
            place = replace(place, operation=place.operation + 1)
        return place

    def _keep(self, chosen: int, trace: Trace) -> None:
        self._traces[chosen], place = trace, self._places[chosen]
        if self.stored:
            self.stored.add_trace(place.log, place.sources, place.operation, trace)

    @cached_property
    def traces(self) -> tuple[Trace, ...]:
        """The selected traces; those that were not made when the logs were scored, as of stored logs, are made now."""
        absent: dict[int, list[tuple[int, _Place]]] = {}
        for chosen, place in self._places.items():
            if chosen not in self._traces:
                trace = self.stored.trace(place.log, place.sources, place.operation) if self.stored else None
                if trace is not None:
                    self._traces[chosen] = trace
                else:
                    absent.setdefault(place.number, []).append((chosen, place))
        logs = list(absent.values())
        pieces = (
            Piece(log[0][1].number, *log[0][1].log, operations=tuple(place.operation for _, place in log))
            for log in logs
        )
        for log, outcome in zip(logs, self._computed(pieces, len(logs)), strict=True):
            traces = [trace for of_run in outcome.outcomes for trace in of_run.traces]
            for chosen, place in log:
                trace = traces[place.operation] if place.operation < len(traces) else None
                # The log may have changed since its rows were stored.
                if trace is not None and same_content(outcome.sources, place.sources):
                    self._keep(chosen, trace)
        why = self._choice.kept()
        return tuple(replace(self._traces[number], chosen=why[number]) for number in why if number in self._traces)

    @property
    def left_out(self) -> list[RecordingFinding]:
        """The finding that more operations were missed or falsely alarmed than have a trace, if that is so."""
        if not self._choice.left_out:
            return []
        finding = Finding("plots_left_out", "", {"count": self._choice.left_out})
        return [RecordingFinding.of(str(self.setup.path), finding)]
