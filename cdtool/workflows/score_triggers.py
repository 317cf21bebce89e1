"""Alarms of any controller or program, scored like those of a detector: the rows of a trigger file."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from cdtool.detection import WHOLE_MACHINE, Alarm, Band, Signal, Status, Verdict
from cdtool.evaluation.evaluated import Evaluated, evaluate
from cdtool.evaluation.limits import ALL
from cdtool.evaluation.results import RecordingFinding, Skipped
from cdtool.evaluation.traces.trace import Trace
from cdtool.evaluation.truth.trigger_file import Triggered, TriggerFile, read_triggers
from cdtool.findings import Finding
from cdtool.findings.scoring import RecordingsWithoutRow
from cdtool.operations import Operation
from cdtool.pipeline import Detection
from cdtool.plain_text import counted
from cdtool.registry import plugin_packages
from cdtool.version import __version__
from cdtool.workflows.benchmark.benchmark_file import BenchmarkFile, read_benchmark_file
from cdtool.workflows.benchmark.scoring import Scored, score_log
from cdtool.workflows.gathering import Gathering
from cdtool.workflows.runs import Progress, in_order, shown_path

# A trigger counts as held for this long [s], and another within it as the same.
_HELD = 0.5
_CLOCK_RATE = 1000.0
_STRANGER = "the benchmark file does not score it: its rows are left out"


@dataclass(frozen=True)
class Score:
    """The results with their statistics, the traces kept for figures, and the files that were read."""

    evaluated: Evaluated
    traces: tuple[Trace, ...]
    inputs: tuple[Path, ...] = ()


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
    epoch, say). A recording that a detector has no row for counts as watched without an alarm; `listed_only` leaves
    it out. Of the file's [limits] those on `*` and on the trigger file's detectors are checked. Raises
    ConfigurationError for a wrong file, RecordingError where nothing could be scored.
    """
    given = read_triggers(Path(triggers))
    names = tuple(given.rows)
    setup = read_benchmark_file(benchmark, learning=False, also_known=names)
    base = setup.path.parent
    work = [(group, path) for group, item in setup.impacts.items() for path in item.logs]
    known = {shown_path(path, base) for _, path in work}
    said, strangers = given.assigned(known)
    gathered = Gathering(setup, names, {}, {})
    gathered.skipped += [Skipped(name, _STRANGER) for name in strangers]
    gathered.findings += _unlisted(given, said, known, listed_only)

    def detect(operations: Sequence[Operation], _: Scored) -> list[list[Detection]]:
        return [detect_one(operation) for operation in operations]

    def detect_one(operation: Operation) -> list[Detection]:
        log = operation.name.removesuffix(f"#{operation.number}")
        shift = operation.recording.origin if clock == "source" else 0.0
        asked = [name for name in names if log in said[name] or not listed_only]
        return [_detection(operation, name, said[name].get(log, Triggered()), shift) for name in asked]

    def one(item: tuple[str, Path]) -> Scored:
        scored = score_log(setup, item[0], item[1], detect, {})
        for name in names:
            scored.skipped += _beside(scored, name, said[name], clock)
        return scored

    if listed_only:
        work = [item for item in work if any(shown_path(item[1], base) in said[name] for name in names)]
    for (group, _), scored in zip(work, in_order(one, work, jobs, progress), strict=True):
        gathered.add(group, scored)
    results = gathered.results(_provenance(setup, given, clock))
    rules = [rule for rule in setup.limits if rule.detector in (ALL, *names)]
    return Score(evaluate(results, rules), gathered.traces, (Path(triggers), *setup.inputs))


def _unlisted(
    given: TriggerFile, said: Mapping[str, Mapping[str, Triggered]], known: Collection[str], listed_only: bool
) -> list[RecordingFinding]:
    """How many recordings a detector has no row for, and what became of them."""
    found = []
    for detector, by_name in said.items():
        missing = sorted(set(known) - set(by_name))
        if missing:
            fact = RecordingsWithoutRow(detector, len(missing), len(known), listed_only, missing[0])
            found.append(RecordingFinding.of(str(given.path), Finding(fact)))
    return found


def _beside(scored: Scored, detector: str, said: Mapping[str, Triggered], clock: str) -> list[Skipped]:
    """Rows about times in which nothing was recorded: mostly those of another clock."""
    if scored.recording is None or scored.recording.recording not in said:
        return []
    name, item = scored.recording.recording, said[scored.recording.recording]
    parts = [judged.operation.recording for judged in scored.judged]
    shift = parts[0].origin if clock == "source" else 0.0
    spans = [(part.start + shift, part.end + shift) for part in parts]
    rows = [(at, at) for at in item.alarms] + item.blind
    outside = [begin for begin, end in rows if all(end < first or begin > last for first, last in spans)]
    if not outside:
        return []
    words = (
        f"{detector}: {len(outside)} of {counted(len(rows), 'row')} in no operation, the first at {outside[0]:.3f} s"
    )
    first, last = spans[0][0], spans[-1][1]
    if any(not first <= at <= last for at in outside):
        other = "recording" if clock == "source" else "source"
        words += f"; recorded is {first:.3f} to {last:.3f} s: another clock? try --clock {other}"
    return [Skipped(name, words)]


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
    outcome: Any = "alarm" if alarms else ("no alarm" if signal.valid.any() else "not_assessable")
    reason = "" if signal.valid.any() else "the trigger file says so"
    return Detection(
        operation, detector, signal, band, Verdict(outcome, alarms, reason, crossings, _released(alarms, crossings))
    )


def _released(alarms: Sequence[Alarm], crossings: Sequence[Alarm]) -> tuple[float, ...]:
    """When each trigger is released [s]: it is held for a while after the last one that belongs to it."""
    after = [*(item.time for item in alarms[1:]), math.inf][: len(alarms)]  # there may be none
    return tuple(
        max(item.time for item in crossings if alarm.time <= item.time < end) + _HELD
        for alarm, end in zip(alarms, after, strict=True)
    )


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
        "plugins": plugin_packages(),
    }
