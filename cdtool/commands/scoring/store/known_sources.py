"""The sources of logs: as the store knows them where file times are trusted, otherwise hashed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cdtool.commands.judging.runs import shown_path
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.pieces import source_files
from cdtool.execution.store.sources import SourceFile, read_sources, state_of
from cdtool.execution.store.store import Store
from cdtool.execution.store.use import StoreUse
from cdtool.execution.workers import Workers, in_order


@dataclass(frozen=True)
class KnownSources:
    """Finds the sources of a benchmark's logs; `workers` hash their files."""

    setup: BenchmarkFile
    store: Store
    use: StoreUse
    workers: Workers

    def of(self, logs: Sequence[Path], *, all_of_them: bool = False) -> list[tuple[SourceFile, ...] | None]:
        """Return the sources of the logs; None for a log that the store does not know by its name.

        With `all_of_them` those are hashed, too; None then means that a log cannot be read, or changes meanwhile.
        """
        found: list[tuple[SourceFile, ...] | None] = [None] * len(logs)
        to_hash: list[int] = []
        for number, log in enumerate(logs):
            before = self.store.sources_of(shown_path(log, self.setup.path.parent))
            if before is None and not all_of_them:
                continue
            if before is not None and self.use.trust_times and self.is_unchanged(log, before):
                found[number] = before
            else:
                to_hash.append(number)
        paths = [logs[number] for number in to_hash]
        work = _Hashing(self.setup)
        hashed = in_order(work, paths, len(paths), self.workers, of_lost=_not_hashed)
        for number, sources in zip(to_hash, hashed, strict=True):
            found[number] = sources
        return found

    def is_unchanged(self, log: Path, before: Sequence[SourceFile]) -> bool:
        """Return whether the files of a log have the sizes and times of these sources."""
        return state_of(source_files(self.setup, log)) == tuple((item.size, item.modified) for item in before)


@dataclass(frozen=True)
class _Hashing:
    """Reads the sources of one log."""

    setup: BenchmarkFile

    def __call__(self, path: Path) -> tuple[SourceFile, ...] | None:
        return read_sources(source_files(self.setup, path))


def _not_hashed(*_: object) -> None:
    """Return the sources of a log that ended its workers: it is left out with the reason when it is scored."""
