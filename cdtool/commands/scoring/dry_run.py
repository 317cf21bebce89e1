"""What a run of a benchmark would compute, without computing it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from cdtool.base.remote.remote_path import is_remote
from cdtool.commands.judging.runs import load_runs, shown_path
from cdtool.commands.scoring.benchmark import BenchmarkWork, sweep_factors
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, with_only
from cdtool.commands.scoring.learned import Teaching
from cdtool.commands.scoring.measured_synchronisation import with_synchronisation
from cdtool.commands.scoring.pieces import source_files
from cdtool.commands.scoring.scoring import logs_to_score
from cdtool.commands.scoring.store.determinants import Determinants
from cdtool.commands.scoring.store.stored_learned import learned_with_store
from cdtool.commands.scoring.store.stored_scoring import StoredScoring
from cdtool.detectors.base import Detector
from cdtool.execution.store.store import Store
from cdtool.execution.workers import Workers, in_order
from cdtool.results.results import Skipped


@dataclass(frozen=True)
class PlannedLog:
    """A log that would be computed: its size [bytes], and the detectors that would run on it."""

    recording: str
    group: str
    bytes: int
    detectors: tuple[str, ...]


@dataclass(frozen=True)
class DryRun:
    """The logs that would be computed, out of a `total`, and how long that takes [s]; None: nothing to estimate it by.

    `learned` is the number of impact-free runs, `to_inject` that of the contacts of [inject] that would be made before,
    at least one recording each, and are not among the logs. `skipped`: logs that the run would leave out, as for a
    column that they do not have; those at URLs are not read for it.
    """

    logs: tuple[PlannedLog, ...]
    total: int
    learned: int
    seconds: float | None
    to_inject: int = 0
    skipped: tuple[Skipped, ...] = ()

    @property
    def bytes(self) -> int:
        """Return the size of the logs that would be computed."""
        return sum(item.bytes for item in self.logs)


def dry_run(
    file: str | Path | BenchmarkFile,
    *,
    detectors: Sequence[str | Detector] = (),
    false_alarm_budget: str | None = None,
    settings: Mapping[str, Any] | None = None,
    workers: Workers | None = None,
    store: Store | None = None,
) -> DryRun:
    """Return which logs of a benchmark `cdtool.benchmark` would compute with the same arguments; nothing is written.

    The logs that would be computed are read, so that one which cannot be used is named, and the impact-free runs unless
    the store has what was learned from them. The time is estimated by that of the recordings in the store.

    Raises
    ------
    CdtoolError
        As `cdtool.benchmark`, apart from errors of the logs.
    """
    work = BenchmarkWork.of(file, detectors, false_alarm_budget, settings)
    workers, store = work.executed_by(workers or Workers(), store)
    setup, to_inject = work.setup.made.found(work.setup) if work.setup.made else (work.setup, 0)
    return replace(_dry_run(replace(work, setup=setup), workers, store), to_inject=to_inject)


def _dry_run(work: BenchmarkWork, workers: Workers, store: Store | None) -> DryRun:
    if store is None or not (store.exists or store.folder.is_file()):
        names = work.setup.detectors
        logs = [(group, path, names) for group, item in work.setup.impacts.items() for path in item.logs]
        learn = [path for path in work.setup.learn if not is_remote(path)]
        runs = load_runs(learn, work.setup.machine_file, work.setup.run_reading(workers))
        return _planned(work.setup, logs, len(logs), None, skipped=runs.skipped)
    store = replace(store, writes=False)
    store.check()
    setup, _ = with_synchronisation(work.setup, workers)
    teaching = Teaching(setup, workers, every_detector=work.every_detector)
    learned, files = learned_with_store(store, teaching)
    setup = with_only(setup, learned.about.detectors)
    factors = sweep_factors(setup, learned.thresholds)
    scoring = StoredScoring(None, store, Determinants(setup, learned, files, factors))
    every = [(group, path) for group, item in setup.impacts.items() for path in item.logs]
    plan = list(in_order(scoring.planned, every, len(every), workers, of_lost=partial(_all, setup)))
    missing = [(*log, detectors) for log, (_, detectors) in zip(every, plan, strict=True) if detectors]
    done = [known for known, detectors in plan if known is not None and not detectors]
    seconds = sum(known.seconds for known in done)
    speed = sum(known.size for known in done) / seconds if seconds else None
    return _planned(setup, missing, len(every), speed, workers.jobs, learned.about.skipped)


def _all(setup: BenchmarkFile, *_: object) -> tuple[None, tuple[str, ...]]:
    """Return the plan of a log that ended its workers: all of it."""
    return None, setup.detectors


def _planned(
    setup: BenchmarkFile,
    logs: Sequence[tuple[str, Path, tuple[str, ...]]],
    total: int,
    speed: float | None,
    jobs: int = 1,
    skipped: tuple[Skipped, ...] = (),
) -> DryRun:
    """Return the dry run of these logs; `speed` is that of one worker [bytes/s]."""
    planned = tuple(
        PlannedLog(shown_path(path, setup.path.parent), group, _size(setup, path), names) for group, path, names in logs
    )
    size = sum(item.bytes for item in planned)
    seconds = None if speed is None else size / speed / jobs
    read = [item for group, path, _ in logs if not is_remote(path) for item in logs_to_score(setup, group, path)]
    skipped += tuple(item for item in read if isinstance(item, Skipped))
    return DryRun(planned, total, len(setup.learn), seconds if planned else 0.0, skipped=skipped)


def _size(setup: BenchmarkFile, path: Path) -> int:
    """Return the size of a log's files; those that are missing do not count."""
    total = 0
    for file in source_files(setup, path):
        try:
            total += file.stat().st_size
        except OSError:
            continue
    return total
