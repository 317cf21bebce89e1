"""What was learned from impact-free runs: from the store, or learned and kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.learned import Learned, Teaching
from cdtool.commands.scoring.pieces import source_files
from cdtool.commands.scoring.store.determinants import learned_key
from cdtool.execution.store.digest import digest_of
from cdtool.execution.store.sources import SourceFile, read_sources, state_in, state_of
from cdtool.execution.store.store import Store
from cdtool.execution.workers import in_order

Sources = tuple[SourceFile, ...]


def learned_with_store(store: Store, teaching: Teaching) -> tuple[Learned, Mapping[Path, Sources]]:
    """Return what the runs of a benchmark give, and the files of the runs; raises what `Teaching` raises."""
    setup = teaching.setup
    made = in_order(_Hashing(setup), setup.learn, len(setup.learn), teaching.workers, of_lost=_not_hashed)
    sources = dict(zip(setup.learn, made, strict=True))
    runs = {path: item or () for path, item in sources.items()}
    if None in sources.values():  # one cannot be read now: what is learned without it must not be found again
        return teaching.learned, runs
    key = digest_of(learned_key(setup, runs, setup.detectors), teaching.every_detector)
    try:
        if (text := store.known("learned", key)) is not None:
            return Learned.of_text(text, setup.rule), runs
    except ValueError:  # damaged
        pass
    learned = teaching.learned
    same = all(state_of(source_files(setup, path)) == state_in(of_run) for path, of_run in runs.items())
    if learned.lasts and same:
        store.keep("learned", key, learned.to_text(setup.rule))
    return learned, runs


@dataclass(frozen=True)
class _Hashing:
    """Reads the sources of one log."""

    setup: BenchmarkFile

    def __call__(self, path: Path) -> Sources | None:
        return read_sources(source_files(self.setup, path))


def _not_hashed(*_: object) -> None:
    """Return the sources of a log that ended its workers: it is left out with the reason when it is read."""
