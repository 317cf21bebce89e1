"""Score one log, unless the store has its outcome: what is known is not computed, what is computed is kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from cdtool.base.files.typed_json import decoded, encoded
from cdtool.commands.scoring.log_outcome import LogOutcome
from cdtool.commands.scoring.pieces import Piece, PieceOutcome, PieceScoring, source_files
from cdtool.commands.scoring.store.determinants import Determinants, trace_key
from cdtool.execution.store.sources import read_sources
from cdtool.execution.store.store import Store
from cdtool.results.traces.trace import Trace


@dataclass(frozen=True)
class StoredScoring:
    """Scores a log unless the `store` has its outcome under its key of the `determinants`."""

    scoring: PieceScoring
    store: Store
    determinants: Determinants

    def __call__(self, piece: Piece) -> PieceOutcome:
        """Return the outcome of a log; the traces that are known are among it if certain operations are asked for."""
        sources = read_sources(source_files(self.determinants.setup, piece.path))
        if sources is None:  # one cannot be read now, or changes
            return self.scoring(piece)
        key = self.determinants.key(piece.group, piece.path, sources)
        known = self._known(piece, key)
        if known is not None:
            return PieceOutcome(known, sources, is_stored=True)
        made = self.scoring(replace(piece, sources=sources))
        if made.sources is not None:
            self._keep(made.outcomes, key)
        return made

    def _known(self, piece: Piece, key: str) -> tuple[LogOutcome, ...] | None:
        """Return the outcome of a log with the traces of certain operations; None if anything of it is missing."""
        text = self.store.known("logs", key)
        texts = {number: self.store.known("traces", trace_key(key, number)) for number in piece.operations}
        if text is None or None in texts.values():
            return None
        try:
            traces = {number: decoded(made, Trace) for number, made in texts.items() if made is not None}
            return _with_traces(decoded(text, tuple[LogOutcome, ...]), traces)
        except ValueError:  # damaged
            return None

    def _keep(self, outcomes: Sequence[LogOutcome], key: str) -> None:
        self.store.keep("logs", key, encoded([replace(item, traces=()) for item in outcomes]))
        for number, trace in enumerate(trace for outcome in outcomes for trace in outcome.traces):
            if trace is not None:
                self.store.keep("traces", trace_key(key, number), encoded(trace))


def _with_traces(outcomes: Sequence[LogOutcome], traces: Mapping[int, Trace]) -> tuple[LogOutcome, ...]:
    """Return outcomes with the traces of some operations, by number counted on through the runs."""
    found, first = [], 0
    for outcome in outcomes:
        count = len(outcome.operations)
        found.append(replace(outcome, traces=tuple(traces.get(first + number) for number in range(count))))
        first += count
    return tuple(found)
