"""One log of a benchmark as an independent piece of work: what is sent to a worker, and what comes back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cdtool.commands.judging.runs import shown_path
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.log_outcome import LogOutcome, TheseTraces, Wanted, WantedTraces
from cdtool.commands.scoring.scoring import LogRows
from cdtool.execution.store.sources import SourceFile, files_of, state_in, state_of
from cdtool.formats.channels.run_reading import split_run
from cdtool.results.results import Skipped
from cdtool.results.traces.choice import TraceChoice

# Returns the outcome of the log of a group, or of each of its runs, with the wanted traces.
ScoreLog = Callable[[str, Path, Wanted | None], list[LogOutcome]]


@dataclass(frozen=True)
class Piece:
    """One log, by its number, to be scored.

    `choice` is the choice of traces as far as it is known; without it, those of `operations` are wanted. `sources` are
    the log's files with their content, by which a store knows them; None without a store.
    """

    log: int
    group: str
    path: Path
    choice: TraceChoice | None = None
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
    """The outcomes of a log or of its runs, and the files that they are from.

    `sources` is None without a store, or if the outcomes would not be the same again. `is_stored`: nothing was
    computed.
    """

    outcomes: tuple[LogOutcome, ...]
    sources: tuple[SourceFile, ...] | None = None
    is_stored: bool = False


@dataclass(frozen=True)
class PieceScoring:
    """Scores one log; a log that changes meanwhile, or since its sources were read, is left out."""

    setup: BenchmarkFile
    score: ScoreLog

    def __call__(self, piece: Piece) -> PieceOutcome:
        """Return the outcomes of the log."""
        files = source_files(self.setup, piece.path)
        before = state_of(files) if piece.sources is None else state_in(piece.sources)
        outcomes = self.score(piece.group, piece.path, piece.wanted)
        after = state_of(files)
        if after != before:
            why = "changed while it was read" if after is not None else "was removed, or cannot be reached, meanwhile"
            changed = Skipped(shown_path(piece.path, self.setup.path.parent), why)
            return PieceOutcome((LogOutcome(LogRows(None, skipped=(changed,)), lasts=False),))
        return PieceOutcome(tuple(outcomes), piece.sources if all(item.lasts for item in outcomes) else None)


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
    return PieceOutcome((LogOutcome(LogRows(None, skipped=(left_out,)), lasts=False),))


def same_content(one: Sequence[SourceFile] | None, other: Sequence[SourceFile] | None) -> bool:
    """Return whether the files of a log have the same content at two times; without a store it is not known."""
    if one is None or other is None:
        return one is other
    return [item.digest for item in one] == [item.digest for item in other]
