"""Many recordings, many detectors: learn, detect, match, count."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from cdtool.base.arrays import FloatArray
from cdtool.base.registry import plugin_packages
from cdtool.commands.judging.runs import to_be_seen
from cdtool.commands.judging.settings_table import detectors_of
from cdtool.commands.learning.normal_runs import normals_for
from cdtool.commands.scoring.benchmark_file import (
    HOLDOUT,
    BenchmarkFile,
    read_benchmark_file,
    refuse_limits_by_hand,
    with_detectors,
    with_only,
)
from cdtool.commands.scoring.benchmark_result import BenchmarkResult, StoreReport
from cdtool.commands.scoring.gathering import recordings_in, results_before, results_of
from cdtool.commands.scoring.learned import Learned, Teaching
from cdtool.commands.scoring.learned_thresholds import ThresholdsByLog
from cdtool.commands.scoring.log_outcome import LogOutcome, Wanted, outcome_of
from cdtool.commands.scoring.pieces import PieceScoring
from cdtool.commands.scoring.scored_logs import ScoredLogs
from cdtool.commands.scoring.scoring import ScoredLog, detect_with, score_runs
from cdtool.commands.scoring.store.determinants import Determinants
from cdtool.commands.scoring.store.stored_learned import learned_with_store
from cdtool.commands.scoring.store.stored_scoring import StoredScoring
from cdtool.detectors.base import Detector
from cdtool.execution.store.store import Store
from cdtool.execution.workers import Workers
from cdtool.recordings.operations import Operation
from cdtool.recordings.plausible import LearnedRanges
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.results.curves.sweep import MULTIPLES
from cdtool.results.evaluated import evaluate
from cdtool.results.limits import LimitRule, unchecked
from cdtool.results.results import Results, Skipped
from cdtool.thresholds.base import FittedThreshold, set_by_hand
from cdtool.thresholds.normal_motion import NormalMotions


def benchmark(  # the public function: a keyword for each setting
    file: str | Path | BenchmarkFile,
    *,
    detectors: Sequence[str | Detector] = (),
    false_alarm_budget: str | None = None,
    settings: Mapping[str, Any] | None = None,
    jobs: int = 1,
    workers: Workers | None = None,
    store: Store | None = None,
) -> BenchmarkResult:
    """Learn every detector's threshold, run the detectors over all groups of logs, and match alarms with contacts.

    Parameters
    ----------
    file : str, Path or BenchmarkFile
        The benchmark file.
    detectors : sequence of str or Detector, optional
        Detectors in place of the file's: names, or objects with their gains, as `Momentum(bandwidth=20.0)`. Only "all":
        every registered detector that can learn from these logs; the others are listed in `results.findings`.
    false_alarm_budget : str, optional
        As "1/1000op" or "0.1/h": sets each detector's safety factor on the runs learned from.
    settings : mapping, optional
        Values in place of keys of the file, as {"activation.debounce": 9, "threshold.name": "cusum"}; stated in the
        results. Not with a BenchmarkFile.
    jobs : int, optional
        Number of logs processed at a time; the results do not depend on it.
    workers : Workers, optional
        In place of `jobs`: also the longest time for a log, and how often one that ended its worker is tried again;
        or a Dask cluster.
    store : Store, optional
        Where outcomes are kept: a log is computed only if something that determines its outcome has changed.

    Returns
    -------
    BenchmarkResult
        DataFrames, figures and reports. Logs that cannot be read or scored are in `skipped`; so is a detector without
        one of its channels: all its contacts are not assessable.

    Raises
    ------
    ConfigurationError
        The benchmark file, the machine file or the store is wrong; the message names the key.
    SignatureError
        Nothing can be learned.
    RecordingError
        No log could be scored.
    UsageError
        There are too few runs for the false-alarm budget.

    Examples
    --------
    >>> import cdtool
    >>> done = cdtool.benchmark("sample_logs/gate/benchmark.toml", detectors=["momentum"])
    >>> [(row.group, row.detected, row.missed) for row in done.evaluated.summaries]
    [('stiff', 4, 0), ('soft', 4, 0), ('holdout', 0, 0)]
    """
    work = BenchmarkWork.of(file, detectors, false_alarm_budget, settings)
    workers = (workers or Workers(jobs)).limited_by(work.setup.execution)
    work = replace(work, setup=work.setup.with_made(workers))
    if store is not None:
        store.create()
    logs = [path for item in work.setup.impacts.values() for path in item.logs]
    with workers.ready([*to_be_seen([*work.setup.learn, *logs]), *([store.mark] if store else [])]):
        return _run(work, workers, store)


@dataclass(frozen=True)
class BenchmarkWork:
    """A benchmark file with the options of the command; `limits` are those in the file."""

    setup: BenchmarkFile
    limits: tuple[LimitRule, ...]
    every_detector: bool

    @classmethod
    def of(
        cls,
        file: str | Path | BenchmarkFile,
        detectors: Sequence[str | Detector],
        budget: str | None,
        settings: Mapping[str, Any] | None = None,
    ) -> BenchmarkWork:
        """Read a benchmark file unless it has been read; raises as `benchmark`."""
        if not isinstance(file, BenchmarkFile):
            detectors, others = detectors_of(detectors, settings)
            file = read_benchmark_file(file, detectors=detectors, settings=others)
        setup = file
        limits = setup.limits
        setup = with_detectors(setup, detectors) if detectors else setup
        setup = replace(setup, budget=Budget.parse(budget)) if budget is not None else setup
        refuse_limits_by_hand(setup)
        return cls(setup, limits, list(detectors) == ["all"])


def _run(work: BenchmarkWork, workers: Workers, store: Store | None) -> BenchmarkResult:
    setup = work.setup
    teaching = Teaching(setup, workers, every_detector=work.every_detector)
    learned, runs = learned_with_store(store, teaching) if store else (teaching.learned, {})
    setup = with_only(setup, learned.about.detectors)
    factors = sweep_factors(setup, learned.thresholds)
    used = [setup.machine_file.detector(name) for name in setup.detectors]
    refused = [
        Skipped(name, f"{group}: not tested by injected contacts: {reason}")
        for group, item in setup.impacts.items()
        for name, reason in item.refused.items()
    ]
    of_limits = unchecked(work.limits, setup.detectors, str(setup.path))
    before = results_before(
        setup,
        _provenance(setup, used, learned),
        setup.detectors,
        (*setup.not_made, *learned.about.skipped, *refused),
        (*learned.about.findings, *of_limits),
    )
    logs = [(group, path) for group, item in setup.impacts.items() for path in item.logs]
    scoring = scoring_of(setup, learned, teaching, factors)
    with_store = StoredScoring(scoring, store, Determinants(setup, learned, runs, factors)) if store else None
    scored = ScoredLogs(setup, with_store or scoring, logs, workers)
    results = results_of(setup, before, scored, factors, learned.about.sources)
    results = replace(
        results,
        calibration=tuple(learned.about.calibration),
        skipped=(*results.skipped, *_labels_without_run(setup, results)),
        findings=(*results.findings, *scored.left_out),
    )
    report = StoreReport(len(logs) - scored.stored, scored.stored) if store else None
    return BenchmarkResult(evaluate(results, setup.limits), scored.traces, setup.inputs, report)


@dataclass(frozen=True)
class _LogScoring:
    """Scores one log with every detector: what `score_runs` needs for any log of the benchmark."""

    setup: BenchmarkFile
    detectors: tuple[Detector, ...]
    thresholds: ThresholdsByLog
    unusable: Mapping[str, str]
    factors: Mapping[str, FloatArray]
    ranges: LearnedRanges
    normals: NormalMotions
    runs: tuple[Operation, ...]

    def __call__(self, group: str, path: Path, wanted: Wanted | None) -> list[LogOutcome]:
        refused = self.setup.impacts[group].refused if group in self.setup.impacts else {}
        tested = [detector for detector in self.detectors if detector.name not in refused]
        detect = detect_with(self.setup, tested, self.thresholds.without, self.unusable)
        scored = score_runs(self.setup, group, path, detect, self.factors, self.ranges)
        return [outcome_of(item, self.setup, partial(self._normals_for, item), wanted) for item in scored]

    def _normals_for(self, scored: ScoredLog) -> NormalMotions:
        """Return the normal motion that a log is compared with: without its own."""
        if not self.runs or scored.recording is None:
            return self.normals
        others = [item for item in self.runs if item.whole.name != scored.recording.name]
        return normals_for(others, self.setup.rule)


def scoring_of(
    setup: BenchmarkFile, learned: Learned, teaching: Teaching, factors: Mapping[str, FloatArray]
) -> PieceScoring:
    """Return how a log is scored; the runs themselves are needed only for a log that is learned from, too."""
    score = _LogScoring(
        setup,
        tuple(setup.machine_file.detector(name) for name in setup.detectors),
        ThresholdsByLog(setup, learned.thresholds, teaching.pairs if setup.both else {}),
        learned.about.unusable,
        factors,
        learned.ranges,
        learned.normals,
        teaching.operations if setup.both else (),
    )
    return PieceScoring(setup, score)


def _labels_without_run(setup: BenchmarkFile, results: Results) -> list[Skipped]:
    """Return the names in the label file that no run has; rows about whole logs were checked before reading."""
    if setup.labels is None or not setup.has_runs:
        return []
    used = {setup.labels.name_of(name) for name in recordings_in(results)}
    return [
        Skipped(name, f"no such run is scored: {', '.join(lines)} left out")
        for name, lines in setup.labels.lines.items()
        if name not in used
    ]


def sweep_factors(setup: BenchmarkFile, thresholds: Mapping[str, tuple[FittedThreshold, ...]]) -> dict[str, FloatArray]:
    """Return the safety factors of the sweep by detector; empty without an impact-free group."""
    if HOLDOUT not in setup.impacts:
        return {}
    return {name: items[0].safety_factor * MULTIPLES for name, items in thresholds.items() if items}


def _provenance(
    setup: BenchmarkFile,
    detectors: Sequence[Any],
    learned: Learned,
) -> dict[str, Any]:
    injected = {name: dict(group.injected) for name, group in setup.impacts.items() if group.injected}
    return {
        **setup.identity,
        "gains": {detector.name: asdict(detector) for detector in detectors},
        "threshold": setup.rule.name,
        "threshold_rule": asdict(setup.rule),
        "signature_rule": {
            **asdict(setup.signature),
            "safety_factor": None if setup.budget else setup.signature.factor,
        },
        "signature_sha256": {name: _digest(items) for name, items in learned.thresholds.items()},
        "learned_runs": list(learned.about.names),
        **setup.learned_parts,
        "safety_factor_set": "by budget" if setup.budget else "by hand" if set_by_hand(setup.rule) else "by default",
        **setup.activation.described,
        **setup.scoring,
        "false_alarm_budget": str(setup.budget) if setup.budget else None,
        "units": {detector.name: detector.unit(setup.machine_file.machine) for detector in detectors},
        "short_names": {detector.name: detector.short_name for detector in detectors},
        "learned_sha256": dict(sorted(learned.about.digests.items())),
        "plugins": plugin_packages(),
        **({"injected": injected} if injected else {}),
    }


def _digest(thresholds: Sequence[FittedThreshold]) -> str:
    text = json.dumps([item.to_dict() for item in thresholds], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
