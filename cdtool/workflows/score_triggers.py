"""Alarms of any controller or program, scored like those of a detector: the rows of a trigger file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Literal

import numpy as np

from cdtool.detection import WHOLE_MACHINE, Alarm, Band, Signal, Status, Verdict
from cdtool.evaluation.evaluated import Evaluated, evaluate
from cdtool.evaluation.results import Skipped
from cdtool.evaluation.traces import Trace
from cdtool.evaluation.trigger_file import Triggered, TriggerFile, read_triggers
from cdtool.operations import Operation
from cdtool.pipeline import Detection
from cdtool.version import __version__
from cdtool.workflows.benchmark_file import BenchmarkFile, read_benchmark_file
from cdtool.workflows.gathering import Gathering
from cdtool.workflows.runs import Progress, in_order, shown_path
from cdtool.workflows.scoring import Scored, score_log

# A trigger counts as held for this long [s], and another within it as the same.
_HELD = 0.5
_CLOCK_RATE = 1000.0


@dataclass(frozen=True)
class Score:
    """The results with their statistics, and the traces kept for figures."""

    evaluated: Evaluated
    traces: tuple[Trace, ...]


def score(
    triggers: str | Path,
    benchmark: str | Path,
    *,
    clock: Literal["recording", "source"] = "recording",
    listed_only: bool = False,
    jobs: int = 1,
    progress: Progress | None = None,
) -> Score:
    """Score the trigger times of any program against the contacts of a benchmark file's recordings.

    `clock`: trigger times are seconds on the recording's own clock, as cdtool shows them, or on the source's (an
    epoch, say). A recording without a row counts as watched without an alarm, and is named; `listed_only` leaves it
    out. Raises ConfigurationError for a wrong file, RecordingError where nothing could be scored.
    """
    setup = read_benchmark_file(benchmark, learning=False)
    given = read_triggers(Path(triggers))
    names = tuple(given.rows)
    work = [(group, path) for group, item in setup.impacts.items() for path in item.logs]
    base = setup.path.parent
    known = {shown_path(path, base) for _, path in work}
    gathered = Gathering(setup, names, {}, {})
    gathered.skipped += _strangers(given, known)
    unlisted = [name for name in sorted(known) if not any(given.of(detector, name) for detector in names)]
    if unlisted:
        became = "left out" if listed_only else "taken as watched without an alarm"
        words = f"{len(unlisted)} of {len(known)} recordings have no row: {became}"
        gathered.findings.append(Skipped(str(given.path), words))
    if listed_only:
        work = [item for item in work if shown_path(item[1], base) not in set(unlisted)]

    def detect(operation: Operation, _: Scored) -> list[Detection]:
        log = operation.name.removesuffix(f"#{operation.number}")
        shift = operation.recording.origin if clock == "source" else 0.0
        return [_detection(operation, name, given.of(name, log) or Triggered(), shift) for name in names]

    def one(item: tuple[str, Path]) -> Scored:
        return score_log(setup, item[0], item[1], detect, {})

    for (group, _), scored in zip(work, in_order(one, work, jobs, progress), strict=True):
        gathered.add(group, scored)
    results = gathered.results(_provenance(setup, given, clock))
    return Score(evaluate(results), gathered.traces)


def _strangers(given: TriggerFile, known: set[str]) -> list[Skipped]:
    """Recordings with rows that the benchmark file does not name."""
    below = {PurePosixPath(name).name for name in known}
    named = {recording for by_name in given.rows.values() for recording in by_name}
    why = "the benchmark file does not score it: its triggers are left out"
    return [Skipped(name, why) for name in sorted(named) if name not in known and name not in below]


def _detection(operation: Operation, detector: str, said: Triggered, shift: float) -> Detection:
    """The triggers as a signal that is 1 while one is held, against a limit of one half."""
    recording = operation.recording
    time = recording.start + np.arange(math.floor(recording.duration * _CLOCK_RATE) + 1) / _CLOCK_RATE
    values, status = np.zeros((len(time), 1)), np.full((len(time), 1), Status.VALID, dtype=np.uint8)
    inside = sorted(at - shift for at in said.alarms if recording.start <= at - shift <= recording.end)
    for at in inside:
        values[(time >= at) & (time < at + _HELD)] = 1.0
    for begin, end in said.blind:
        status[(time >= begin - shift) & (time <= end - shift)] = Status.NOT_APPLICABLE
    crossings = tuple(Alarm(at, 0, "above", 1.0, 0.5) for at in inside)
    alarms = tuple(item for i, item in enumerate(crossings) if not i or item.time - crossings[i - 1].time > _HELD)
    signal = Signal(time, values, status, "1", joints=WHOLE_MACHINE)
    band = Band(np.full_like(values, -np.inf), np.full_like(values, 0.5))
    outcome: Any = "alarm" if alarms else ("no alarm" if signal.valid.any() else "not assessable")
    reason = "" if signal.valid.any() else "the trigger file says so"
    return Detection(operation, detector, signal, band, Verdict(outcome, alarms, reason, crossings))


def _provenance(setup: BenchmarkFile, given: TriggerFile, clock: str) -> dict[str, Any]:
    return {
        "tool": "cdtool",
        "tool_version": __version__,
        "benchmark_sha256": setup.digest,
        "machine": setup.machine_file.machine.name,
        "machine_sha256": setup.machine_file.digest,
        "triggers_sha256": given.digest,
        "trigger_clock": clock,
        **setup.scoring,
    }
