"""Score one log, unless the store has its outcome: what is known is not computed, what is computed is kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from cdtool.base.files.typed_json import decoded, encoded
from cdtool.commands.scoring.log_outcome import DetectorOutcome, LogOutcome
from cdtool.commands.scoring.pieces import Piece, PieceOutcome, PieceScoring, source_files
from cdtool.commands.scoring.scoring import LogRows
from cdtool.commands.scoring.store.determinants import Determinants
from cdtool.execution.store.sources import SourceFile, read_sources
from cdtool.execution.store.store import Store
from cdtool.results.traces.trace import Trace

_Rows = tuple[LogRows, ...]
_OfDetector = tuple[DetectorOutcome | None, ...]
# Between the key of the outcome of a detector and the outcome: JSON has no tab and no line end.
_BETWEEN = "\t"


@dataclass(frozen=True)
class KnownLog:
    """What a store has of a log: its rows, and the outcomes of detectors by key, each as JSON."""

    rows: str
    detectors: Mapping[str, str] = field(default_factory=dict)

    def to_text(self) -> str:
        """Return it as lines."""
        return "\n".join([self.rows, *(f"{key}{_BETWEEN}{text}" for key, text in self.detectors.items())])

    @classmethod
    def of_text(cls, text: str) -> KnownLog:
        """Return what `to_text` made."""
        rows, *detectors = text.split("\n")
        pairs = (line.partition(_BETWEEN) for line in detectors)
        return cls(rows, {key: text for key, _, text in pairs})


@dataclass(frozen=True)
class StoredScoring:
    """Scores a log with the detectors whose outcomes the `store` does not have, by the keys of the `determinants`."""

    scoring: PieceScoring
    store: Store
    determinants: Determinants

    def __call__(self, piece: Piece) -> PieceOutcome:
        """Return the outcome of a log; the traces that are known are among it if certain operations are asked for."""
        sources = read_sources(source_files(self.determinants.setup, piece.path))
        if sources is None:  # one cannot be read now, or changes
            return self.scoring(piece)
        piece = replace(piece, sources=sources)
        known = self._known(piece, sources)
        missing = tuple(
            name
            for name, key in self._keys(piece.group, piece.path, sources).items()
            if known is None or key not in known.detectors
        )
        if known is not None and not missing:
            found = self._restored(piece, sources, known)
            if found is not None:
                return found
            missing = self._names
        is_whole = len(missing) == len(self._names)
        made = self.scoring(piece if is_whole else replace(piece, choice=None, detectors=missing))
        return made if made.sources is None else self._kept(piece, made, sources, known, missing)

    @property
    def _names(self) -> tuple[str, ...]:
        return self.determinants.setup.detectors

    def _known(self, piece: Piece, sources: tuple[SourceFile, ...]) -> KnownLog | None:
        """Return what the store has of a log with these files."""
        text = self.store.known("logs", self.determinants.log_key(piece.group, piece.path, sources))
        return None if text is None else KnownLog.of_text(text)

    def _keys(self, group: str, path: Path, sources: tuple[SourceFile, ...]) -> dict[str, str]:
        of = self.determinants
        key = of.log_key(group, path, sources)
        return {name: of.detector_key(name, path, key) for name in self._names}

    def _trace_key(self, piece: Piece, sources: tuple[SourceFile, ...], number: int) -> str:
        keys = self._keys(piece.group, piece.path, sources)
        return self.determinants.trace_key(piece.path, number, list(keys.values()))

    def _restored(self, piece: Piece, sources: tuple[SourceFile, ...], known: KnownLog) -> PieceOutcome | None:
        """Return the outcome of a log with the traces of certain operations; None if one of these is missing."""
        keys = self._keys(piece.group, piece.path, sources)
        try:
            detectors = [decoded(known.detectors[keys[name]], _OfDetector) for name in self._names]
            outcomes = _combined(decoded(known.rows, _Rows), detectors)
            texts = {n: self.store.known("traces", self._trace_key(piece, sources, n)) for n in piece.operations}
            if None in texts.values():
                return None
            traces = {number: decoded(text, Trace) for number, text in texts.items() if text is not None}
        except ValueError:
            return None
        if traces:
            outcomes = _with_traces(outcomes, traces)
        return PieceOutcome(tuple(outcomes), sources, is_stored=True)

    def _kept(
        self,
        piece: Piece,
        made: PieceOutcome,
        sources: tuple[SourceFile, ...],
        known: KnownLog | None,
        missing: Sequence[str],
    ) -> PieceOutcome:
        """Keep what was computed of a log, and return the outcome with that of all detectors."""
        keys = self._keys(piece.group, piece.path, sources)
        rows = tuple(item.rows for item in made.outcomes)
        new = {name: tuple(_of_detector(item, name) for item in made.outcomes) for name in missing}
        texts = {keys[name]: encoded(item) for name, item in new.items()}
        others = known.detectors if known is not None else {}
        if known is None or len(missing) == len(self._names):
            known = KnownLog(encoded(rows))
        both = replace(known, detectors={**others, **texts})
        self.store.keep("logs", self.determinants.log_key(piece.group, piece.path, sources), both.to_text())
        traces = [trace for outcome in made.outcomes for trace in outcome.traces]
        for number, trace in enumerate(traces):
            if trace is not None:
                self.store.keep("traces", self._trace_key(piece, sources, number), encoded(trace))
        if len(missing) == len(self._names):
            return made
        detectors = [new[name] if name in new else decoded(others[keys[name]], _OfDetector) for name in self._names]
        return replace(made, outcomes=tuple(_combined(rows, detectors)))


def _of_detector(outcome: LogOutcome, name: str) -> DetectorOutcome | None:
    return next((item for item in outcome.detectors if item.detector == name), None)


def _combined(rows: Sequence[LogRows], detectors: Sequence[_OfDetector]) -> list[LogOutcome]:
    """Return the outcomes of a log or of its runs from its rows and those of each detector."""
    return [
        LogOutcome(of_run, tuple(item[number] for item in detectors if item[number] is not None))  # type: ignore[misc]
        for number, of_run in enumerate(rows)
    ]


def _with_traces(outcomes: Sequence[LogOutcome], traces: Mapping[int, Trace]) -> list[LogOutcome]:
    """Return outcomes with the traces of some operations, by number counted on through the runs."""
    found, first = [], 0
    for outcome in outcomes:
        count = outcome.operations
        found.append(replace(outcome, traces=tuple(traces.get(first + number) for number in range(count))))
        first += count
    return found
