"""Results of any number of recordings, drawn at random (seeded): detections, misses, false alarms, forces, findings.

A fleet of doors: each group is a kind of obstacle, each folder a door, each day of the log's name a test of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

import numpy as np

from cdtool.results.results import (
    ContactResult,
    ExposureResult,
    FalseAlarmResult,
    ForceResult,
    ForceStepResult,
    RecordingFinding,
    RecordingResult,
    Results,
    Skipped,
    SweepResult,
)
from cdtool.results.traces.trace import Trace
from tests.report.html.html_case import ONSET, trace_of

DETECTORS = ("momentum", "pure_inertia", "friction_ekf", "inertial_momentum", "pure_torque")
GROUPS = ("stiff", "soft", "holdout")
DOORS = 40
FIRST_DAY = datetime(2026, 1, 1, 8, tzinfo=UTC)
# Latency [ms] by group, and its factor by detector.
MEDIAN_MS = {"stiff": 30.0, "soft": 120.0}
SLOWER = (1.0, 1.3, 0.8, 1.1, 3.0)
STEPS = (("dynamic", 0.0, 400.0), ("static", 0.75, 150.0))


@dataclass(frozen=True)
class RowsOfLog:
    """The rows of one recording."""

    recording: RecordingResult
    contacts: tuple[ContactResult, ...]
    false_alarms: tuple[FalseAlarmResult, ...]
    forces: tuple[ForceResult, ...]
    findings: tuple[RecordingFinding, ...]


def rows_of_logs(count: int, detectors: int = 2, seed: int = 0) -> Iterator[RowsOfLog]:
    """Yield the rows of each recording: a contact in two of three, 2 % of them missed, and some false alarms."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        group, door = GROUPS[number % 3], number % DOORS
        day = FIRST_DAY + timedelta(days=3 * (number // DOORS) % 360)
        name = f"{group}/door-{door:02d}/{day:%Y-%m-%d}/run_{number:06d}.mcap"
        began = day.timestamp()
        log = RecordingResult(name, group, f"{number:064x}", 8.2, 1, int(group != "holdout"), began_s=began)
        names = DETECTORS[:detectors]
        if group == "holdout":
            alarms = tuple(
                FalseAlarmResult(name, group, detector, "door", 3.0, "above", 1.0 + float(rng.random()), 1.0)
                for detector in names
                if rng.random() < 0.01
            )
            yield RowsOfLog(log, (), alarms, (), ())
            continue
        peak = 300.0 * float(np.exp(0.15 * rng.normal()))
        contacts = tuple(_contact(log, names, place, peak, rng) for place in range(detectors))
        findings = (RecordingFinding(name, f"time: {number} gaps", "warning", "sample_gaps", "time"),)
        yield RowsOfLog(log, contacts, (), _forces(log, peak), findings if number % 10 == 1 else ())


def many_results(count: int, detectors: int = 2, seed: int = 0) -> Results:
    """Return the results of that many recordings."""
    logs = tuple(rows_of_logs(count, detectors, seed))
    of_group = {group: sum(log.recording.group == group for log in logs) for group in GROUPS}
    made = Results(
        provenance={"tool": "cdtool", "tool_version": "9.8.7", "machine": "door", "onset": "above 20 N, back to 8 N"},
        detectors=DETECTORS[:detectors],
        groups=GROUPS,
        contacts=tuple(row for log in logs for row in log.contacts),
        false_alarms=tuple(row for log in logs for row in log.false_alarms),
        exposure=(),
        recordings=tuple(log.recording for log in logs),
        forces=tuple(row for log in logs for row in log.forces),
        findings=tuple(row for log in logs for row in log.findings),
        skipped=tuple(Skipped(f"broken/{i}.mcap", f"broken/{i}.mcap: empty") for i in range(count // 100)),
    )
    return replace(
        made,
        exposure=tuple(
            ExposureResult(group, name, logs, logs, logs * 8.0 / 3600.0, 0, {"start-up": 0.02})
            for group, logs in of_group.items()
            for name in made.detectors
        ),
        sweep=tuple(
            SweepResult(
                name, group, 5.5 * factor, int(20 / factor), 100, 0.5, 90, 10, 0, 30.0, 30.0 * factor, factor == 1
            )
            for group in MEDIAN_MS
            for name in made.detectors
            for factor in (0.5, 1, 2)
        ),
    )


def traces_of_many(results: Results, count: int = 60) -> tuple[Trace, ...]:
    """Return traces of the first recordings with a missed contact, as a benchmark keeps them."""
    missed = {(item.group, item.recording): None for item in results.contacts if item.outcome == "missed"}
    named = dict(zip(("quick", "slow"), results.detectors, strict=False))
    return tuple(trace_of(lambda name: named.get(name, name), group, log) for group, log in list(missed)[:count])


def _contact(
    log: RecordingResult, names: tuple[str, ...], place: int, peak: float, rng: np.random.Generator
) -> ContactResult:
    drawn = float(rng.random())
    outcome = "missed" if drawn < 0.02 else "not_assessable" if drawn < 0.025 else "detected"
    late = SLOWER[place] * MEDIAN_MS[log.group] * float(np.exp(0.2 * rng.normal())) if outcome == "detected" else None
    return ContactResult(
        recording=log.recording,
        group=log.group,
        detector=names[place],
        joint=None if late is None else "door",
        onset_s=ONSET,
        onset_uncertainty_s=5e-4,
        alarm_s=None if late is None else ONSET + 1e-3 * late,
        latency_ms=late,
        outcome=outcome,
        force_at_alarm_n=None if late is None else min(8.0 * late, peak),
        peak_force_n=peak,
        reason="start-up" if outcome == "not_assessable" else None,
        watched_ms=1000.0,
        resolution_ms=2.0,
        side=None if late is None else "above",
        statistic=None if late is None else 2.0,
        limit=None if late is None else 1.0,
        rest_n=0.5,
        drift_n_per_s=0.0,
    )


def _forces(log: RecordingResult, peak: float) -> tuple[ForceResult, ...]:
    steps = tuple(
        ForceStepResult(
            name, after, most, value, 12.5 if value > most else None, "fail" if value > most else "pass",
            f"{value:.0f} N" if value > most else None,
        )
        for (name, after, most), value in zip(STEPS, (peak, 0.3 * peak), strict=True)
    )  # fmt: skip
    failed = next((step for step in steps if step.verdict == "fail"), None)
    return (
        ForceResult(
            log.recording,
            log.group,
            1,
            "door",
            "fail" if failed else "pass",
            peak,
            steps,
            time_budget_ms=12.5 if failed else None,
            reason=failed.reason if failed else None,
        ),
    )
