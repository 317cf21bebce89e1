"""The outcomes of a benchmark's logs in order, each from the store if it is there, otherwise computed and stored.

What is stored of a log are its rows and the outcome of each detector, each under the digest of everything that
determines it; so a detector with another gain is run on its own. Errors of the system are not stored.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

from cdtool.base.errors import CdtoolError
from cdtool.base.files.typed_json import decoded, encoded
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.log_outcome import DetectorOutcome, LogOutcome
from cdtool.commands.scoring.pieces import Piece, PieceOutcome
from cdtool.commands.scoring.scoring import LogRows
from cdtool.commands.scoring.store.determinants import Determinants
from cdtool.commands.scoring.store.finished_run import FinishedRun, TraceKey
from cdtool.commands.scoring.store.known_sources import KnownSources
from cdtool.execution.store.digest import code_version, combined
from cdtool.execution.store.entry import Entry, source_entry
from cdtool.execution.store.finished import mark_used, read_finished, write_finished
from cdtool.execution.store.sources import SourceFile
from cdtool.execution.store.store import RunRecord, Store, encodable, write_run
from cdtool.execution.store.use import StoreUse
from cdtool.execution.workers import Workers
from cdtool.results.evaluated import Evaluated
from cdtool.results.traces.choice import TraceChoice
from cdtool.results.traces.trace import Trace

_Rows = tuple[LogRows, ...]
_OfDetector = tuple[DetectorOutcome | None, ...]


@dataclass(frozen=True)
class Planned:
    """One log: the places of its rows and of its detectors' outcomes in the store, None where it is missing."""

    sources: tuple[SourceFile, ...] | None = None
    rows: int | None = None
    detectors: tuple[int | None, ...] = ()

    @property
    def is_known(self) -> bool:
        """Whether all of it is in the store."""
        return self.rows is not None and None not in self.detectors


@dataclass(frozen=True)
class StoreReport:
    """How many recordings were computed, at least in part, and how many were all in the store."""

    computed: int = 0
    reused: int = 0


class StoredOutcomes:
    """The outcomes of logs in a store, and those that are computed and added to it."""

    def __init__(
        self,
        store: Store,
        use: StoreUse,
        setup: BenchmarkFile,
        determinants: Determinants,
        keys: Sequence[str] = (),
    ) -> None:
        self.store, self.use, self.setup, self.determinants = store, use, setup, determinants
        self.names = setup.detectors
        self.keys = list(keys)
        self.computed = self.reused = self.failed = 0
        self.began = time.time()
        # Of the outcomes of all logs, in order: those that are planned, and those that were used.
        self._planned_keys: list[str] = []
        self._order = hashlib.sha256()
        self._lasts = True

    def plan(self, logs: Sequence[tuple[str, Path]], workers: Workers) -> list[Planned]:
        """Return what is in the store of each log."""
        known = KnownSources(self.setup, self.store, self.use, workers)
        sources = known.of([path for _, path in logs])
        keys = [key for log, of_log in zip(logs, sources, strict=True) if of_log for key in self._keys_of(log, of_log)]
        self._planned_keys = [] if None in sources else keys
        places = iter(self.store.places(keys))
        each = 1 + len(self.names)
        planned = [self._planned(item, list(islice(places, each)) if item else None) for item in sources]
        self._note_touched(logs, planned)
        if not all(item.is_known for item in planned):
            self._planned_keys = []
        return planned

    def finished(self, key: str, provenance: Mapping[str, Any]) -> tuple[FinishedRun, tuple[Trace, ...]] | None:
        """Return the results of a run with the planned outcomes, under `key` for everything else, with its traces.

        Returns None if the store has none, or if some of its logs could not be read and are to be read again.
        """
        planned, self._planned_keys = self._planned_keys, []
        if not planned:
            return None
        whole = combined(key, _digest_of_keys(planned))
        try:
            found = FinishedRun.of_texts(read_finished(self.store.folder, whole), provenance)
            if found is None or (found.failed and self.use.retry_failed):
                return None
            entries = [self.store.get(item.key) for item in found.traces]
            traces = tuple(
                replace(decoded(entry.content, Trace), chosen=item.chosen)
                for entry, item in zip(entries, found.traces, strict=True)
                if entry is not None
            )
        except ValueError:  # damaged
            return None
        if len(traces) < len(found.traces):
            return None
        mark_used(self.store.folder, whole)
        self.keys += [*planned, *(item.key for item in found.traces)]
        self.reused, self.failed = len(planned) // (1 + len(self.names)), found.failed
        return found, traces

    def add_finished(self, key: str, evaluated: Evaluated, traces: Sequence[TraceKey] | None) -> None:
        """Store the results of the run if it would have the same again; `traces` is None if one of them is missing."""
        if not self._lasts or traces is None or not self.store.writes:
            return
        whole = combined(key, self._order.hexdigest())
        # What the run has found does not depend on this file: without it, only time is lost.
        with suppress(OSError, CdtoolError):
            write_finished(self.store.folder, whole, FinishedRun(evaluated, tuple(traces), self.failed).to_texts())

    def _keys_of(self, log: tuple[str, Path], sources: tuple[SourceFile, ...]) -> list[str]:
        """Return the key of the rows of a log, and of the outcome of each detector."""
        of, (group, path) = self.determinants, log
        key = of.log_key(group, path, sources)
        return [key, *(of.detector_key(name, path, key) for name in self.names)]

    def _planned(self, sources: tuple[SourceFile, ...] | None, places: list[int | None] | None) -> Planned:
        nothing = Planned(sources, None, (None,) * len(self.names))
        if places is None or places[0] is None or (self.use.retry_failed and self.store.is_failed(places[0])):
            return nothing
        return Planned(sources, places[0], tuple(places[1:]))

    def piece(self, log: int, group: str, path: Path, planned: Planned, choice: TraceChoice) -> Piece:
        """Return the work that is left of a log; traces are wanted only if every detector is run."""
        missing = self.missing(planned)
        if len(missing) == len(self.names):
            return Piece(log, group, path, choice, sources=planned.sources)
        return Piece(log, group, path, detectors=missing, sources=planned.sources)

    def missing(self, planned: Planned) -> tuple[str, ...]:
        """Return the detectors that have to be run on a log: all if its rows are missing."""
        if planned.rows is None:
            return self.names
        return tuple(name for name, place in zip(self.names, planned.detectors, strict=True) if place is None)

    def known(self, path: Path, planned: Planned) -> list[LogOutcome] | None:
        """Return the outcomes of a log that are all in the store; None if one of them is gone or damaged."""
        entries = self._entries(path, (planned.rows, *planned.detectors), ("", *self.names))
        if entries is None:
            return None
        try:
            rows = decoded(entries[0].content, _Rows)
            detectors = [decoded(item.content, _OfDetector) for item in entries[1:]]
        except ValueError:
            return None
        self._use([item.key for item in entries])
        self.reused += 1
        self.failed += any(item.unread for item in rows)
        return _combined(rows, detectors)

    def _entries(self, path: Path, places: Sequence[int | None], detectors: Sequence[str]) -> list[Entry] | None:
        """Return the entries of a log at some places; None if one of them is not there.

        Places are found by a part of the keys: that they are of this log and detector is checked.
        """
        found, name = [], encodable(self.determinants.name(path))
        for place, detector in zip(places, detectors, strict=True):
            entry = None if place is None else self.store.at(place)
            if entry is None or entry.recording != name or entry.detector != detector:
                return None
            found.append(entry)
        return found

    def _use(self, keys: Sequence[str]) -> None:
        """Note the keys of the outcomes of the next log."""
        self.keys += keys
        self._order.update("".join(keys).encode())

    def _note_touched(self, logs: Sequence[tuple[str, Path]], planned: Sequence[Planned]) -> None:
        """Add the present times of the files of logs whose content is the same as before."""
        entries = []
        for (_, path), item in zip(logs, planned, strict=True):
            if item.is_known and item.sources is not None:
                name = self.determinants.name(path)
                if item.sources != self.store.sources_of(name):
                    entries.append(source_entry(name, item.sources))
                elif key := self.store.source_key_of(name):
                    self.keys.append(key)
        self.keys += [entry.key for entry in entries]
        self.store.add(entries)

    def add(self, group: str, path: Path, planned: Planned, made: PieceOutcome) -> list[LogOutcome] | None:
        """Store what was computed of a log, and return the outcomes with every detector.

        Returns None if only some detectors were run, and the outcomes of the others are gone or are those of another
        content.
        """
        rows = tuple(item.rows for item in made.outcomes)
        unread = any(item.unread for item in rows)
        missing = self.missing(planned)
        stored: dict[str, Entry] = {}
        # A log whose worker ended, or that changed, is left out with this reason: nothing stored of it is used.
        is_left_out = made.sources is None and all(item.unread for item in rows)
        if len(missing) < len(self.names) and not is_left_out:
            others = [name for name in self.names if name not in missing]
            places = [place for place in planned.detectors if place is not None]
            entries = self._entries(path, places, others)
            if entries is None or not same_content(made.sources, planned.sources):
                return None
            stored = dict(zip(others, entries, strict=True))
        new = {name: tuple(_of_detector(item, name) for item in made.outcomes) for name in missing}
        try:
            known = {name: decoded(entry.content, _OfDetector) for name, entry in stored.items()}
        except ValueError:
            return None
        self.computed += 1
        self.failed += unread
        if made.sources is None:
            self._lasts = False
        else:
            keys = self._store(group, path, made, new) | {name: entry.key for name, entry in stored.items()}
            self._use([keys[name] for name in ("", *self.names)])
        return _combined(rows, [(new | known)[name] for name in self.names]) if known else list(made.outcomes)

    def _store(self, group: str, path: Path, made: PieceOutcome, new: dict[str, _OfDetector]) -> dict[str, str]:
        """Store the rows of a log and new outcomes; return their keys by detector, that of the rows under ""."""
        assert made.sources is not None
        of, name, version = self.determinants, self.determinants.name(path), code_version()
        key = of.log_key(group, path, made.sources)
        rows = tuple(item.rows for item in made.outcomes)
        unread = any(item.unread for item in rows)
        entries = [Entry(key, "log", name, "", encoded(rows, _Rows), made.sources, made.seconds, unread, version)]
        for detector, outcomes in new.items():
            text, own = encoded(outcomes, _OfDetector), of.detector_key(detector, path, key)
            entries.append(Entry(own, "detector", name, detector, text, failed=unread, version=version))
        self.store.add(entries)
        return {entry.detector: entry.key for entry in entries}

    def trace(self, log: tuple[str, Path], sources: tuple[SourceFile, ...] | None, number: int) -> Trace | None:
        """Return the stored trace of an operation of a log; None if it is missing."""
        key = self.trace_key(log, sources, number)
        entry = None if key is None else self.store.get(key)
        if entry is None:
            return None
        self.keys.append(entry.key)
        try:
            return decoded(entry.content, Trace)
        except ValueError:
            return None

    def add_trace(
        self, log: tuple[str, Path], sources: tuple[SourceFile, ...] | None, number: int, trace: Trace
    ) -> None:
        """Store the trace of an operation of a log."""
        key = self.trace_key(log, sources, number)
        if key is not None:
            name = self.determinants.name(log[1])
            self.store.add([Entry(key, "trace", name, "", encoded(trace, Trace), version=code_version())])
            self.keys.append(key)

    def trace_key(self, log: tuple[str, Path], sources: tuple[SourceFile, ...] | None, number: int) -> str | None:
        """Return the key of the trace of an operation of a log; None if the content of the log is not known."""
        if sources is None:
            return None
        return self.determinants.trace_key(log[1], number, self._keys_of(log, sources)[1:])

    def finish(self) -> StoreReport:
        """Write which entries the run has used."""
        run = RunRecord(
            self.began,
            time.time(),
            self.setup.path.name,
            self.setup.digest,
            len(self.keys),
            self.computed + self.reused,
            self.computed,
            self.failed,
            code_version(),
        )
        write_run(self.store.folder, run, self.keys)
        return StoreReport(self.computed, self.reused)


def _digest_of_keys(keys: Sequence[str]) -> str:
    return hashlib.sha256("".join(keys).encode()).hexdigest()


def same_content(one: Sequence[SourceFile] | None, other: Sequence[SourceFile] | None) -> bool:
    """Return whether the files of a log have the same content at two times; without a store it is not known."""
    if one is None or other is None:
        return one is other
    return [item.digest for item in one] == [item.digest for item in other]


def _of_detector(outcome: LogOutcome, name: str) -> DetectorOutcome | None:
    return next((item for item in outcome.detectors if item.detector == name), None)


def _combined(rows: Sequence[LogRows], detectors: Sequence[_OfDetector]) -> list[LogOutcome]:
    """Return the outcomes of a log or of its runs from its rows and those of each detector."""
    return [
        LogOutcome(of_run, tuple(item[number] for item in detectors if item[number] is not None))  # type: ignore[misc]
        for number, of_run in enumerate(rows)
    ]
