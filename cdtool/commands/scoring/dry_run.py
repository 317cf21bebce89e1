"""Check a benchmark without computing it: its files, and which recordings cannot be used."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdtool.base.remote.remote_path import is_remote
from cdtool.commands.judging.runs import load_runs, shown_path
from cdtool.commands.scoring.benchmark import BenchmarkWork
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.scoring import logs_to_score
from cdtool.detectors.base import Detector
from cdtool.execution.workers import Workers
from cdtool.results.results import Skipped


@dataclass(frozen=True)
class DryRun:
    """The recordings of a benchmark by group, and the number of impact-free runs that it learns from.

    `to_inject` contacts of [inject] would be made before, at least one recording each, and are not among the logs.
    `skipped`: logs that the run would leave out, as for a column that they do not have; those at URLs are not read.
    """

    logs: Mapping[str, tuple[str, ...]]
    learned: int
    to_inject: int
    skipped: tuple[Skipped, ...]


def dry_run(
    file: str | Path | BenchmarkFile,
    *,
    detectors: Sequence[str | Detector] = (),
    false_alarm_budget: str | None = None,
    settings: Mapping[str, Any] | None = None,
    workers: Workers | None = None,
) -> DryRun:
    """Return what `cdtool.benchmark` would compute with the same arguments; all logs are read, nothing is written.

    Raises
    ------
    CdtoolError
        As `cdtool.benchmark`, apart from errors of the logs.
    """
    work = BenchmarkWork.of(file, detectors, false_alarm_budget, settings)
    workers = (workers or Workers()).limited_by(work.setup.execution)
    setup, to_inject = work.setup.made.found(work.setup) if work.setup.made else (work.setup, 0)
    learn = [path for path in setup.learn if not is_remote(path)]
    skipped = [*load_runs(learn, setup.machine_file, setup.run_reading(workers)).skipped]
    for group, item in setup.impacts.items():
        read = (log for path in item.logs if not is_remote(path) for log in logs_to_score(setup, group, path))
        skipped += [log for log in read if isinstance(log, Skipped)]
    base = setup.path.parent
    logs = {name: tuple(shown_path(path, base) for path in item.logs) for name, item in setup.impacts.items()}
    return DryRun(logs, len(setup.learn), to_inject, tuple(skipped))
