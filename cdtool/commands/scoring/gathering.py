"""The results of a benchmark from the outcomes of its logs: rows, and totals over operations."""

from __future__ import annotations

from array import array
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, RecordingError
from cdtool.base.findings import Finding
from cdtool.commands.judging.impact_free import unchecked
from cdtool.commands.scoring.benchmark_file import HOLDOUT, BenchmarkFile
from cdtool.commands.scoring.force_rows import point_rows
from cdtool.commands.scoring.log_outcome import LogOutcome, OperationOutcome
from cdtool.results.results import (
    ContactResult,
    ExposureResult,
    FalseAlarmResult,
    ForceResult,
    RecordingFinding,
    RecordingResult,
    Results,
    Skipped,
    SweepResult,
)
from cdtool.truth.force.verdict import ForceVerdict


def results_before(
    setup: BenchmarkFile,
    provenance: Mapping[str, Any],
    detectors: Iterable[str],
    skipped: Iterable[Skipped] = (),
    findings: Iterable[RecordingFinding] = (),
) -> Results:
    """Return what is known of the results before a log is scored: no row of a log."""
    return Results(
        provenance=provenance,
        detectors=tuple(detectors),
        groups=setup.groups,
        conditions=setup.conditions,
        contacts=(),
        false_alarms=(),
        exposure=(),
        skipped=tuple(skipped),
        findings=(*setup.rules_of("").findings, *findings),
    )


def results_of(
    setup: BenchmarkFile,
    before: Results,
    outcomes: Iterable[tuple[str, LogOutcome]],
    factors: Mapping[str, FloatArray],
    learned: Mapping[str, str],
) -> Results:
    """Return the results of the `outcomes` of logs, each with its group, in the order of the benchmark file.

    `before` is what was known before the first of them, `factors` are the safety factors of the sweep by detector, and
    `learned` maps the hashes of the logs learned from to their names. Raises ConfigurationError if the same log, under
    any name, was learned from or given twice, RecordingError if no log could be scored.
    """
    recordings, contents = list[RecordingResult](), dict[str, str]()
    contacts, false_alarms = list[ContactResult](), list[FalseAlarmResult]()
    forces, tests = list[ForceResult](), defaultdict[tuple[str, str], list[ForceVerdict]](list)
    skipped, findings = [*before.skipped], [*before.findings]
    assumed_free = list[tuple[str, Finding]]()
    exposure, sweep = defaultdict[tuple[str, str], _Exposure](_Exposure), _SweepRows(factors, HOLDOUT)
    # The unit of the value compared with the limits may differ from that of the signal.
    units, beside = dict[str, str](), dict[str, str]()
    for group, outcome in outcomes:
        skipped += outcome.rows.skipped
        findings += outcome.rows.findings
        assumed_free += outcome.rows.unchecked
        recording = outcome.rows.recording
        if recording is None:
            continue
        recordings.append(recording)
        if recording.sha256:
            _check_content(setup, recording, contents.get(recording.sha256, ""), learned.get(recording.sha256, ""))
            contents[recording.sha256] = recording.recording
        for made in (made for operation in outcome.operations for made in operation):
            units.setdefault(made.detector, made.unit)
            exposure[group, made.detector].add(made, recording.recording)
            sweep.add(group, made)
            contacts += made.contacts
            false_alarms += made.false_alarms
        if recording.point:
            tests[group, recording.point] += outcome.rows.verdicts
        forces += outcome.rows.forces
        beside |= {f"{recording.recording}, {name}": digest for name, digest in outcome.rows.beside}
    findings += unchecked(assumed_free)
    if not exposure and not setup.limits:
        raise _nothing_scored(setup, skipped)
    provenance = {**before.provenance, **({"load_cell_sha256": beside} if beside else {})}
    if "units" in provenance:
        provenance["units"] = provenance["units"] | units
    return replace(
        before,
        provenance=provenance,
        recordings=tuple(recordings),
        contacts=tuple(contacts),
        false_alarms=tuple(false_alarms),
        exposure=tuple(item.result(*key) for key, item in exposure.items()),
        forces=tuple(forces),
        points=tuple(point_rows(tests, {name: group.force for name, group in setup.impacts.items()})),
        sweep=tuple(sweep.rows(before.detectors, setup.groups)),
        skipped=tuple(skipped),
        # One about a file of which several groups have runs is the same in each of them.
        findings=tuple(dict.fromkeys(findings) if setup.has_runs else findings),
    )


def recordings_in(results: Results) -> set[str]:
    """Return the names of the recordings that were scored or left out by name."""
    return {row.recording for row in results.skipped} | {row.recording for row in results.recordings}


def _nothing_scored(setup: BenchmarkFile, skipped: Sequence[Skipped]) -> RecordingError:
    reason = f"; first reason: {skipped[0].recording}: {skipped[0].reason}" if skipped else ""
    hint = "" if skipped else "check with cdtool info"
    return RecordingError(f"{setup.path}: no recording could be scored{reason}", hint)


def _check_content(setup: BenchmarkFile, recording: RecordingResult, scored: str, learned: str) -> None:
    """Raise ConfigurationError if a recording has the content of one that was `scored` or `learned` from, by name."""
    name = recording.recording
    if scored == name:
        raise ConfigurationError(f"{setup.path}: {name} is scored twice", "name each run in one group only, and once")
    if scored:
        raise ConfigurationError(f"{setup.path}: {name} and {scored} have identical content", "score each log once")
    # A log in [learn] up to its contact and in a group is scored with what was learned from the others.
    if learned and not (setup.both and learned == name):
        raise ConfigurationError(
            f"{setup.path}: {name} has the same content as {learned}, which is used for learning",
            "use a recording either in [learn] or for scoring",
        )


@dataclass
class _Exposure:
    """How long one detector monitored one group."""

    recordings: set[str] = field(default_factory=set)
    operations: int = 0
    seconds: float = 0.0
    not_assessable: int = 0
    samples: int = 0
    by_reason: Counter[str] = field(default_factory=Counter)

    def add(self, outcome: OperationOutcome, recording: str) -> None:
        """Add one operation of a recording."""
        self.recordings.add(recording)
        self.operations += 1
        self.seconds += outcome.seconds
        self.not_assessable += outcome.is_not_assessable
        self.samples += outcome.samples
        for reason, count in outcome.by_reason.items():  # Counter.update takes three times as long
            self.by_reason[reason] += count

    def result(self, group: str, detector: str) -> ExposureResult:
        """Return the row of results.json."""
        shares = {reason: count / max(self.samples, 1) for reason, count in sorted(self.by_reason.items())}
        hours = self.seconds / 3600.0
        return ExposureResult(
            group, detector, len(self.recordings), self.operations, hours, self.not_assessable, shares
        )


@dataclass
class _SweepRows:
    """The points of the curve: false alarms from the impact-free group, latencies from each group of impacts."""

    factors: Mapping[str, FloatArray]
    impact_free: str
    _false_alarms: dict[str, np.ndarray] = field(default_factory=dict)
    _watched: dict[str, tuple[int, float]] = field(default_factory=dict)
    # By detector and group: of each contact the latency with every factor, one contact after the other.
    _latency: dict[tuple[str, str], array[float]] = field(default_factory=dict)
    _blind: Counter[tuple[str, str]] = field(default_factory=Counter)

    def add(self, group: str, outcome: OperationOutcome) -> None:
        """Add one operation of a detector."""
        name, swept = outcome.detector, outcome.swept
        if swept is None:
            return
        if group == self.impact_free:
            if outcome.seconds <= 0.0:
                return  # an operation without an assessable sample does not count as exposure
            self._false_alarms[name] = self._false_alarms.get(name, 0) + swept.false_alarms
            operations, seconds = self._watched.get(name, (0, 0.0))
            self._watched[name] = operations + 1, seconds + outcome.seconds
            return
        seen = np.array([item in ("detected", "missed") for item in outcome.outcomes], dtype=bool)
        self._latency.setdefault((name, group), array("d")).frombytes(swept.latency[:, seen].T.tobytes())
        self._blind[name, group] += outcome.outcomes.count("not_assessable")

    def rows(self, detectors: Sequence[str], groups: Sequence[str]) -> Iterator[SweepResult]:
        """Return a row for each detector, group of impacts and safety factor."""
        for group in groups:
            for name in detectors:
                if name in self._watched and (name, group) in self._latency:
                    yield from self._rows_of(name, group)

    def _rows_of(self, name: str, group: str) -> Iterator[SweepResult]:
        latency = 1e3 * np.frombuffer(self._latency[name, group]).reshape(-1, len(self.factors[name])).T
        operations, seconds = self._watched[name]
        in_use = len(self.factors[name]) // 2
        for i, factor in enumerate(self.factors[name]):
            if i < min(_loudest(self._false_alarms[name]), in_use):
                continue
            values = latency[i]
            detected = values[np.isfinite(values)]
            yield SweepResult(
                detector=name,
                group=group,
                safety_factor=float(factor),
                false_alarms=int(self._false_alarms[name][i]),
                operations=operations,
                hours=seconds / 3600.0,
                detected=len(detected),
                missed=len(values) - len(detected),
                not_assessable=self._blind[name, group],
                mean_ms=float(detected.mean()) if len(detected) else None,
                median_ms=_median(values),
                in_use=i == in_use,
            )


def _loudest(false_alarms: npt.NDArray[np.int64]) -> int:
    """Return the largest factor with the most false alarms; below it the signal hardly returns and alarms merge."""
    return int(np.flatnonzero(false_alarms == false_alarms.max())[-1])


def _median(values: FloatArray) -> float | None:
    """Return the median [ms], counting a missed contact (NaN) as later than all; None if it is not reached."""
    ordered = np.sort(np.where(np.isnan(values), np.inf, values))
    if not len(ordered):
        return None
    middle = 0.5 * float(ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2])
    return middle if np.isfinite(middle) else None
