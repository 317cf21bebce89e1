"""What was learned from impact-free runs, from the store or learned and stored, and the outcomes that follow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from cdtool.base.arrays import FloatArray
from cdtool.commands.judging.runs import shown_path
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.learned import Learned, Teaching
from cdtool.commands.scoring.store.determinants import Determinants, learned_key
from cdtool.commands.scoring.store.known_sources import KnownSources
from cdtool.commands.scoring.store.stored_outcomes import StoredOutcomes
from cdtool.execution.store.digest import code_version, digest_of
from cdtool.execution.store.entry import Entry, source_entry
from cdtool.execution.store.sources import SourceFile
from cdtool.execution.store.store import Store
from cdtool.execution.store.use import StoreUse
from cdtool.execution.workers import Workers

Sources = tuple[SourceFile, ...]


@dataclass
class StoreOfRun:
    """A store as one run of a benchmark uses it."""

    store: Store
    use: StoreUse
    workers: Workers
    _runs: dict[Path, Sources] = field(default_factory=dict)
    _keys: list[str] = field(default_factory=list)

    def learned(self, teaching: Teaching) -> Learned:
        """Return what the runs of a benchmark give; raises what `Teaching` raises."""
        setup = teaching.setup
        known = KnownSources(setup, self.store, self.use, self.workers)
        sources = dict(zip(setup.learn, known.of(setup.learn, all_of_them=True), strict=True))
        self._runs = {path: item or () for path, item in sources.items()}
        if None in sources.values():  # one cannot be read now: what is learned without it must not be found again
            return teaching.learned
        key = digest_of(learned_key(setup, self._runs, setup.detectors), teaching.every_detector)
        found = self._restored(key, setup)
        if found is not None:
            self._add_sources(setup)
            self._keys.append(key)
            return found
        learned = teaching.learned
        if learned.lasts and all(known.is_unchanged(path, item) for path, item in self._runs.items()):
            self._add(key, setup, learned)
        return learned

    def outcomes(self, setup: BenchmarkFile, learned: Learned, factors: Mapping[str, FloatArray]) -> StoredOutcomes:
        """Return the outcomes of the logs, given what was learned."""
        determinants = Determinants(setup, learned, self._runs, factors)
        return StoredOutcomes(self.store, self.use, setup, determinants, self._keys)

    def _restored(self, key: str, setup: BenchmarkFile) -> Learned | None:
        entry = self.store.get(key)
        if entry is None:
            return None
        try:
            return Learned.of_text(entry.content, setup.rule)
        except ValueError:
            return None

    def _add(self, key: str, setup: BenchmarkFile, learned: Learned) -> None:
        text = learned.to_text(setup.rule)
        self.store.add(
            [Entry(key, "learned", setup.path.name, "", text, seconds=learned.seconds, version=code_version())]
        )
        self._add_sources(setup)
        self._keys.append(key)

    def _add_sources(self, setup: BenchmarkFile) -> None:
        """Add the sources of the runs that the store does not have with these times."""
        base = setup.path.parent
        entries = [source_entry(shown_path(path, base), sources) for path, sources in self._runs.items()]
        keys = [entry.key for entry in entries]
        places = self.store.places(keys)
        self.store.add([entry for entry, place in zip(entries, places, strict=True) if place is None])
        self._keys += keys
