"""Score many logs, with detectors or by external alarms, in the order of the benchmark file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

from cdtool.base.findings import Finding
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.log_outcome import LogOutcome, slowest_of, striking_of
from cdtool.commands.scoring.pieces import Piece, PieceOutcome, lost, same_content
from cdtool.execution.store.sources import SourceFile
from cdtool.execution.workers import Workers, in_order
from cdtool.results.results import RecordingFinding
from cdtool.results.traces.choice import TraceChoice
from cdtool.results.traces.trace import Trace

# The name of its group and the path of each log.
Logs = Sequence[tuple[str, Path]]


# Scores one log: `PieceScoring`, or with a store `StoredScoring`.
Scoring = Callable[[Piece], PieceOutcome]


@dataclass(frozen=True)
class _Place:
    """An operation, by its number in a log."""

    number: int
    log: tuple[str, Path]
    sources: tuple[SourceFile, ...] | None
    operation: int = 0


class ScoredLogs:
    """The outcomes of logs, each with its group, and the traces that are shown once all outcomes were taken.

    Parameters
    ----------
    setup : BenchmarkFile
        The benchmark.
    scoring : callable
        Scores one log.
    logs : sequence of (str, Path)
        Group and path of each log.
    workers : Workers
        What scores them; a log that ends its workers is left out.
    """

    def __init__(self, setup: BenchmarkFile, scoring: Scoring, logs: Logs, workers: Workers) -> None:
        self.setup, self.scoring, self.logs, self.workers = setup, scoring, logs, workers
        self._traces: dict[int, Trace] = {}
        # Where each trace is from that is kept, made or not.
        self._places: dict[int, _Place] = {}
        self._choice = TraceChoice(
            sum(len(setup.impacts[group].logs) for group in setup.groups),
            frozenset(item.group for item in setup.conditions),
        )
        # Logs of which nothing was computed.
        self.stored = 0

    def __iter__(self) -> Iterator[tuple[str, LogOutcome]]:
        """Yield the outcomes of all logs, in order."""
        of_lost = partial(lost, self.setup)
        count = len(self.logs)
        made = in_order(self.scoring, self._pieces(), count, self.workers, of_lost=of_lost)
        for number, (log, piece) in enumerate(zip(self.logs, made, strict=True)):
            self.stored += piece.is_stored
            place = _Place(number, log, piece.sources)
            for outcome in piece.outcomes:
                place = self._offer(place, outcome)
                yield log[0], outcome

    def _pieces(self) -> Iterator[Piece]:
        # Known now: more traces are made than are kept at the logs' turn, never fewer.
        choice = self._choice.copy()
        for number, (group, path) in enumerate(self.logs):
            if choice.offered != self._choice.offered:
                choice = self._choice.copy()
            yield Piece(number, group, path, choice)

    def _offer(self, place: _Place, outcome: LogOutcome) -> _Place:
        """Choose from the operations of a log or run, the first of which is at `place`; return the place after them."""
        for number, judged in enumerate(outcome.operations):
            group, _ = place.log
            chosen = self._choice.offer(place.number, group, len(judged), striking_of(judged), slowest_of(judged))
            if chosen is not None:
                kept = self._choice.kept()
                self._traces = {n: made for n, made in self._traces.items() if n in kept}
                self._places = {n: item for n, item in self._places.items() if n in kept} | {chosen: place}
                if outcome.traces and (trace := outcome.traces[number]) is not None:
                    self._traces[chosen] = trace
            place = replace(place, operation=place.operation + 1)
        return place

    @cached_property
    def traces(self) -> tuple[Trace, ...]:
        """The selected traces; those that were not made when the logs were scored, as of stored logs, are made now."""
        absent: dict[int, list[tuple[int, _Place]]] = {}
        for chosen, place in self._places.items():
            if chosen not in self._traces:
                absent.setdefault(place.number, []).append((chosen, place))
        pieces = [
            Piece(number, *of_log[0][1].log, operations=tuple(place.operation for _, place in of_log))
            for number, of_log in absent.items()
        ]
        made = in_order(self.scoring, pieces, len(pieces), self.workers, of_lost=partial(lost, self.setup))
        for of_log, piece in zip(absent.values(), made, strict=True):
            traces = [trace for outcome in piece.outcomes for trace in outcome.traces]
            for chosen, place in of_log:
                trace = traces[place.operation] if place.operation < len(traces) else None
                # The log may have changed since its rows were stored.
                if trace is not None and same_content(piece.sources, place.sources):
                    self._traces[chosen] = trace
        why = self._choice.kept()
        return tuple(replace(self._traces[number], chosen=why[number]) for number in why if number in self._traces)

    @property
    def left_out(self) -> list[RecordingFinding]:
        """The finding that more operations were missed or falsely alarmed than have a trace, if that is so."""
        if not self._choice.left_out:
            return []
        finding = Finding("plots_left_out", "", {"count": self._choice.left_out})
        return [RecordingFinding.of(str(self.setup.path), finding)]
