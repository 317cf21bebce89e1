"""Score the alarms of any controller or program from a trigger file like those of a detector."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.alarms.pipeline import Detection
from cdtool.base.errors import ConfigurationError
from cdtool.base.findings import Finding
from cdtool.base.plain_text import counted, first_of
from cdtool.base.registry import plugin_packages
from cdtool.base.remote.remote_path import location
from cdtool.commands.judging.runs import shown_path, to_be_seen
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, read_benchmark_file
from cdtool.commands.scoring.benchmark_result import BenchmarkResult
from cdtool.commands.scoring.gathering import recordings_in, results_before, results_of
from cdtool.commands.scoring.log_outcome import LogOutcome, Wanted, outcome_of
from cdtool.commands.scoring.pieces import PieceScoring
from cdtool.commands.scoring.scored_logs import ScoredLogs
from cdtool.commands.scoring.scoring import Detections, ScoredLog, score_runs
from cdtool.detectors.detection import WHOLE_MACHINE, Alarm, Band, Signal, Status, Verdict
from cdtool.execution.workers import Workers
from cdtool.formats.channels.run_reading import split_run
from cdtool.formats.labels.trigger_file import Triggered, TriggerFile, read_triggers
from cdtool.recordings.operations import Operation
from cdtool.results.evaluated import evaluate
from cdtool.results.limits import ALL, unchecked
from cdtool.results.results import RecordingFinding, RecordingResult, Results, Skipped
from cdtool.thresholds.normal_motion import NormalMotions

# A trigger is treated as held for this long [s]; another one within it is the same alarm.
_HELD = 0.5
# A trigger file has times to a millisecond [Hz].
_CLOCK_RATE = 1000.0
_CUT_LOG = "is cut into runs: its rows are left out (name a run, as {name}#1)"
_NO_RUN = "no such run is scored: its rows are left out"


def score(
    triggers: str | Path,
    benchmark: str | Path,
    *,
    settings: Mapping[str, Any] | None = None,
    jobs: int = 1,
    workers: Workers | None = None,
) -> BenchmarkResult:
    """Score the trigger times of any program against the contacts of a benchmark file's recordings.

    Parameters
    ----------
    triggers : str or Path
        A CSV file with the columns recording, time_s and, optionally, detector and blind_until_s.
    benchmark : str or Path
        The benchmark file with groups, onset rule, windows and limits.
    settings : mapping, optional
        Values in place of keys of the benchmark file, as {"triggers.clock": "source"}; stated in the results.
    jobs : int, optional
        Number of logs processed at a time; the results do not depend on it.
    workers : Workers, optional
        In place of `jobs`: also the longest time for a log, how often it is tried again, or a cluster.

    Returns
    -------
    BenchmarkResult
        As that of `benchmark`. Of the file's limits, those on `*` and on detectors of the trigger file are checked.

    Raises
    ------
    ConfigurationError
        The benchmark file or the trigger file is wrong.
    RecordingError
        No log could be scored.

    Examples
    --------
    >>> import cdtool
    >>> scored = cdtool.score("docs/examples/triggers.csv", "sample_logs/gate/benchmark.toml")
    >>> [(row.group, row.detected, row.missed, row.false_alarms) for row in scored.evaluated.summaries]
    [('stiff', 4, 0, 0), ('soft', 2, 1, 0), ('holdout', 0, 0, 1)]
    """
    given = read_triggers(location(triggers))
    known = tuple(given.rows)
    setup = read_benchmark_file(benchmark, learning=False, also_known=known, settings=settings, command="score")
    workers = (workers or Workers(jobs)).limited_by(setup.execution)
    with workers.ready(to_be_seen([path for item in setup.impacts.values() for path in item.logs])):
        return _run(setup, given, workers)


def _run(setup: BenchmarkFile, given: TriggerFile, workers: Workers) -> BenchmarkResult:
    names = tuple(given.rows)
    base = setup.path.parent
    work = [(group, path) for group, item in setup.impacts.items() for path in item.logs]
    runs = setup.has_runs
    known = {shown_path(split_run(path)[0] if runs else path, base) for _, path in work}
    said, strangers = given.assigned(known, runs)
    if strangers and not any(said.values()):
        raise ConfigurationError(
            f"{given.path}: no row is about a scored recording: {first_of(strangers)}",
            f"give paths relative to the benchmark file, such as {min(known)}",
        )
    findings: list[RecordingFinding] = []
    if strangers:
        note = Finding("rows_not_scored", "", {"names": first_of(strangers), "scored": min(known)})
        findings.append(RecordingFinding.of(str(given.path), note))
    if not runs:
        findings += _unlisted(given.path, said, known, setup.triggers.listed_only)
        if setup.triggers.listed_only:
            work = [item for item in work if any(shown_path(item[1], base) in said[name] for name in names)]
    findings += unchecked(setup.limits, names, str(setup.path))
    before = results_before(setup, _provenance(setup, given), names, findings=findings)
    scoring = _TriggerScoring(setup, given.path, said)
    scored = ScoredLogs(setup, PieceScoring(setup, scoring), work, workers)
    results = results_of(setup, before, scored, {}, {})
    without = _without_run(said, known, results) if runs else []
    results = replace(results, skipped=(*results.skipped, *without), findings=(*results.findings, *scored.left_out))
    rules = [rule for rule in setup.limits if rule.detector in (ALL, *names)]
    return BenchmarkResult(evaluate(results, rules), scored.traces, (given.path, *setup.inputs))


@dataclass(frozen=True)
class _TriggerScoring:
    """Scores one log by the triggers that are `said` about it in the file at `path`, by detector and recording."""

    setup: BenchmarkFile
    path: Path
    said: Mapping[str, Mapping[str, Triggered]]

    def __call__(self, group: str, path: Path, wanted: Wanted | None) -> list[LogOutcome]:
        found = score_runs(self.setup, group, path, self._detect, {})
        if self.setup.has_runs:
            found = self._listed_runs(found)
        outcomes = []
        for log in found:
            beside = [
                row for name, said in self.said.items() for row in _beside(log, name, said, self.setup.triggers.clock)
            ]
            rows = replace(log.rows, skipped=(*log.rows.skipped, *beside))
            outcomes.append(outcome_of(replace(log, rows=rows), self.setup, NormalMotions, wanted))
        return outcomes

    def _listed_runs(self, found: list[ScoredLog]) -> list[ScoredLog]:
        """Return the runs of a log that are scored, and report those without a row."""
        about_log, *runs = found
        known = {run.rows.recording.recording for run in runs if run.rows.recording is not None}
        findings = (*about_log.rows.findings, *_unlisted(self.path, self.said, known, self.setup.triggers.listed_only))
        if self.setup.triggers.listed_only:
            runs = [run for run in runs if run.rows.recording is None or self._is_listed(run.rows.recording)]
        return [replace(about_log, rows=replace(about_log.rows, findings=findings)), *runs]

    def _is_listed(self, run: RecordingResult) -> bool:
        return any(run.recording in by_name for by_name in self.said.values())

    def _detect(self, _: Path, operations: Sequence[Operation]) -> Detections:
        found = [self._of_operation(operation) for operation in operations]
        return Detections(found, {item.detector: () for detections in found for item in detections}, {})

    def _of_operation(self, operation: Operation) -> list[Detection]:
        log = operation.whole.name
        shift = operation.recording.origin if self.setup.triggers.clock == "source" else 0.0
        asked = [name for name, said in self.said.items() if log in said or not self.setup.triggers.listed_only]
        return [_detection(operation, name, self.said[name].get(log, Triggered()), shift) for name in asked]


def _without_run(said: Mapping[str, Mapping[str, Triggered]], logs: Collection[str], results: Results) -> list[Skipped]:
    """Return the names that have rows, but are not those of runs that were scored."""
    names = sorted({name for by_name in said.values() for name in by_name} - recordings_in(results))
    return [Skipped(name, _CUT_LOG.format(name=name) if name in logs else _NO_RUN) for name in names]


def _unlisted(
    path: Path, said: Mapping[str, Mapping[str, Triggered]], known: Collection[str], listed_only: bool
) -> list[RecordingFinding]:
    """Return how many recordings have no row for a detector, and how they are counted."""
    found = []
    for detector, by_name in said.items():
        missing = sorted(set(known) - set(by_name))
        if missing:
            fact = {
                "detector": detector,
                "missing": len(missing),
                "recordings": len(known),
                "left_out": listed_only,
                "first": missing[0],
            }
            found.append(RecordingFinding.of(str(path), Finding("recordings_without_row", "", fact)))
    return found


def _beside(scored: ScoredLog, detector: str, said: Mapping[str, Triggered], clock: str) -> list[Skipped]:
    """Report rows at times without a recording, mostly times on another clock."""
    row, matched = scored.rows.recording, scored.matched
    if row is None or matched is None or row.recording not in said:
        return []
    name, item = row.recording, said[row.recording]
    parts = [judged.operation.recording for judged in matched.judged]
    shift = parts[0].origin if clock == "source" else 0.0
    spans = [(part.start + shift, part.end + shift) for part in parts]
    rows = [(at, at) for at in item.alarms] + item.blind
    outside = [begin for begin, end in rows if all(end < first or begin > last for first, last in spans)]
    if not outside:
        return []
    words = (
        f"{detector}: {len(outside)} of {counted(len(rows), 'row')} outside all operations, first at {outside[0]:.3f} s"
    )
    first, last = spans[0][0], spans[-1][1]
    if any(not first <= at <= last for at in outside):
        other = "recording" if clock == "source" else "source"
        in_ms = all(at > last and first <= at / 1e3 <= last for at in outside)
        cause = (
            "are the times in ms? time_s is in seconds" if in_ms else f"another clock? try --set triggers.clock={other}"
        )
        words += f"; the recording is from {first:.3f} to {last:.3f} s: {cause}"
    return [Skipped(name, words)]


def _detection(operation: Operation, detector: str, said: Triggered, shift: float) -> Detection:
    """Return the triggers as a signal that is 1 while a trigger is held, with a limit of one half."""
    recording = operation.recording
    time = recording.start + np.arange(math.floor(recording.duration * _CLOCK_RATE) + 1) / _CLOCK_RATE
    values, status = np.zeros((len(time), 1)), np.full((len(time), 1), Status.VALID, dtype=np.uint8)
    inside = sorted(at - shift for at in said.alarms if recording.start <= at - shift <= recording.end)
    for at in inside:
        values[(time >= at) & (time < at + _HELD)] = 1.0
    for begin, end in said.blind:
        status[(time >= begin - shift) & (time <= end - shift)] = Status.NOT_APPLICABLE
    crossings = tuple(Alarm(at, WHOLE_MACHINE[0], "above", 1.0, 0.5) for at in inside)
    alarms = tuple(item for i, item in enumerate(crossings) if not i or item.time - crossings[i - 1].time > _HELD)
    signal = Signal(time, values, status, "1", joints=WHOLE_MACHINE)
    band = Band(np.full_like(values, -np.inf), np.full_like(values, 0.5))
    outcome: Any = "alarm" if alarms else ("no alarm" if signal.valid.any() else "not_assessable")
    reason = "" if signal.valid.any() else "stated in the trigger file"
    return Detection(
        operation, detector, signal, band, Verdict(outcome, alarms, reason, crossings, _released(alarms, crossings))
    )


def _released(alarms: Sequence[Alarm], crossings: Sequence[Alarm]) -> tuple[float, ...]:
    """Return when each trigger is released [s]: a fixed time after its last repetition."""
    after = [*(item.time for item in alarms[1:]), math.inf][: len(alarms)]  # may be empty
    return tuple(
        max(item.time for item in crossings if alarm.time <= item.time < end) + _HELD
        for alarm, end in zip(alarms, after, strict=True)
    )


def _provenance(setup: BenchmarkFile, given: TriggerFile) -> dict[str, Any]:
    return {
        **setup.identity,
        "triggers_sha256": given.digest,
        "trigger_clock": setup.triggers.clock,
        **setup.scoring,
        "plugins": plugin_packages(),
    }
