"""One log of a benchmark as an independent piece of work: what is sent to a worker, and what comes back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from cdtool.base.remote.remote_path import is_remote
from cdtool.commands.judging.runs import shown_path
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.log_outcome import LogOutcome, TheseTraces, Wanted, WantedTraces
from cdtool.commands.scoring.scoring import LogRows
from cdtool.execution.store.sources import SourceFile, State, files_of, read_sources, state_of
from cdtool.formats.channels.run_reading import split_run
from cdtool.results.results import Skipped
from cdtool.results.traces.choice import TraceChoice

# Returns the outcome of the log of a group, or of each of its runs; None as traces: no trace is wanted, as detectors:
# all of them are.
ScoreLog = Callable[[str, Path, Wanted | None, tuple[str, ...] | None], list[LogOutcome]]


@dataclass(frozen=True)
class Piece:
    """One log, by its number, to be scored with some `detectors` or, if it is None, with all.

    `choice` is the choice of traces as far as it is known; without it, those of `operations` are wanted. `sources` are
    the log's files if their content is known.
    """

    log: int
    group: str
    path: Path
    choice: TraceChoice | None = None
    detectors: tuple[str, ...] | None = None
    operations: tuple[int, ...] = ()
    sources: tuple[SourceFile, ...] | None = None

    @property
    def wanted(self) -> Wanted | None:
        """Return which traces are wanted, for one scoring of the log."""
        if self.choice is not None:
            return WantedTraces(self.log, self.choice.copy())
        return TheseTraces(self.operations) if self.operations else None


@dataclass(frozen=True)
class PieceOutcome:
    """The outcomes of a log or of its runs, the files that they are from, and the time taken [s].

    `sources` is None if they are not asked for, or if the outcomes would not be the same again. `is_stored`: nothing
    was computed.
    """

    outcomes: tuple[LogOutcome, ...]
    sources: tuple[SourceFile, ...] | None = None
    seconds: float = 0.0
    is_stored: bool = False


@dataclass(frozen=True)
class PieceScoring:
    """Scores one log; a log that changes meanwhile is left out. `with_sources`: its sources are asked for."""

    setup: BenchmarkFile
    score: ScoreLog
    with_sources: bool = False

    def __call__(self, piece: Piece) -> PieceOutcome:
        """Return the outcomes of the log."""
        begin = perf_counter()
        files = source_files(self.setup, piece.path)
        before = state_of(files)
        outcomes = self.score(piece.group, piece.path, piece.wanted, piece.detectors)
        sources = self._sources(piece, files, before, outcomes) if self.with_sources else None
        after = state_of(files)
        if after != before or sources == ():
            why = "changed while it was read" if after is not None else "was removed, or cannot be reached, meanwhile"
            changed = Skipped(shown_path(piece.path, self.setup.path.parent), why)
            return PieceOutcome((LogOutcome(LogRows(None, skipped=(changed,), unread=True), lasts=False),))
        lasting = sources if all(item.lasts for item in outcomes) else None
        return PieceOutcome(tuple(outcomes), lasting, perf_counter() - begin)

    def _sources(
        self, piece: Piece, files: list[Path], before: State, outcomes: list[LogOutcome]
    ) -> tuple[SourceFile, ...] | None:
        """Return the sources with the digests of what was read; empty if their content has changed."""
        if before is None:
            return None
        known = piece.sources
        if known is not None and tuple((item.size, item.modified) for item in known) != before:
            known = None
        if is_remote(piece.path):  # what was read is known by its SHA-256, a file at a URL by its version
            return known or read_sources(files)
        recording = outcomes[0].recording
        if recording is None or not recording.sha256 or len(files) > 1 or self.setup.has_runs or piece.path.is_dir():
            return known or read_sources(files)
        if known is None:
            return (SourceFile(*before[0], recording.sha256),)
        return known if known[0].digest == recording.sha256 else ()


def source_files(setup: BenchmarkFile, path: Path) -> list[Path]:
    """Return the files that a log, or LOG#ID, is read from."""
    log = split_run(path)[0] if setup.has_runs else path
    try:
        return files_of(log, setup.machine_file.files_beside(log))
    except OSError:
        return [log]


def lost(setup: BenchmarkFile, piece: Piece, reason: str) -> PieceOutcome:
    """Return the outcome of a log that ended its workers."""
    left_out = Skipped(shown_path(piece.path, setup.path.parent), reason)
    return PieceOutcome((LogOutcome(LogRows(None, skipped=(left_out,), unread=True), lasts=False),))


def same_content(one: Sequence[SourceFile] | None, other: Sequence[SourceFile] | None) -> bool:
    """Return whether the files of a log have the same content at two times; without a store it is not known."""
    if one is None or other is None:
        return one is other
    return [item.digest for item in one] == [item.digest for item in other]
