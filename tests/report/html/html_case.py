"""A small benchmark with content in every part of a report, made without running a detector."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdtool.detectors.detection import Status
from cdtool.recordings.recording import Contact
from cdtool.results.evaluated import Evaluated, evaluate
from cdtool.results.limits import LimitRule
from cdtool.results.results import (
    CalibrationResult,
    ContactResult,
    ExposureResult,
    FalseAlarmResult,
    ForceResult,
    ForceStepResult,
    PointResult,
    RecordingFinding,
    RecordingResult,
    Results,
    Skipped,
    SweepResult,
)
from cdtool.results.traces.trace import ContactOutcome, Panel, StatisticCurve, Trace

Naming = Callable[[str], str]

ONSET = 2.0
FACTORS = (2.75, 5.5, 11.0)
STEPS = (("dynamic", 0.0, 400.0), ("static", 0.75, 150.0))
LIMITS = (
    ("quick.stiff.p95_ms", "quick", "stiff", "p95_ms", 50.0),
    ("slow.soft.missed", "slow", "soft", "missed", 0.0),
    ("*.false_alarms", "*", "*", "false_alarms", 2.0),
)


def case(named: Naming = str, contacts: int = 12, *, limits: bool = True) -> tuple[Evaluated, tuple[Trace, ...]]:
    """Two detectors on two groups and a hold-out; `slow` misses, and is once not assessable. `named` changes names."""
    detectors = tuple(named(name) for name in ("quick", "slow"))
    groups = tuple(named(name) for name in ("stiff", "soft"))
    holdout = named("holdout")
    rows = [row for i, group in enumerate(groups) for row in _contacts(named, group, 40.0 * (i + 1), contacts)]
    names = list(dict.fromkeys((row.group, row.recording) for row in rows))
    results = Results(
        provenance=_provenance(named, groups),
        detectors=detectors,
        groups=(*groups, holdout),
        recordings=(
            *(RecordingResult(log, group, "ab" * 32, 7.2, 1, 1, named("monday")) for group, log in names),
            RecordingResult(named("free.csv"), holdout, "cd" * 32, 60.0, 2, 0),
        ),
        contacts=tuple(rows),
        false_alarms=(
            FalseAlarmResult(named("free.csv"), holdout, detectors[1], named("axis"), 4.0, "above", 7.0, 5.0, 2),
        ),
        exposure=tuple(
            ExposureResult(group, detector, 12, 12, 0.25, 1, {"start-up": 0.05, "missing samples": 0.01})
            for group in (*groups, holdout)
            for detector in detectors
        ),
        forces=tuple(_force(named, group, log) for group, log in names),
        points=(
            PointResult(
                named("top"), groups[0], named("door"), 3, "fail", _steps(named), "mean of 3 tests", named("why")
            ),
        ),
        sweep=tuple(_sweep(detector, group, i) for group in groups for detector in detectors for i in range(3)),
        calibration=(CalibrationResult(detectors[0], "1/15op", 5.5, 30, 0.06, 2),),
        skipped=(Skipped(named("broken.csv"), f"{named('broken.csv')}: {named('empty file')}"),),
        findings=(
            RecordingFinding(named("odd.csv"), named("a gap of 2 s"), "warning", named("kind"), named("channel")),
            RecordingFinding(named("cut.csv"), named("its end"), "loss"),
        ),
    )
    rules = [
        LimitRule(key, *(part if part == "*" else named(part) for part in (detector, group)), figure, largest=largest)
        for key, detector, group, figure, largest in LIMITS
    ]
    traces = tuple(trace_of(named, group, log) for group, log in names[:2] + names[-1:])
    return evaluate(results, rules if limits else ()), (*traces, free_trace(named, holdout))


def trace_of(named: Naming, group: str, log: str) -> Trace:
    """One contact: `quick` alarms after 30 ms, `slow` misses it."""
    contact = Contact(ONSET, 2.4, 5e-4, 900.0)
    panels = (
        _panel(named, "quick", ContactOutcome("detected", 0.03, ONSET + 0.03), (ONSET + 0.03,)),
        _panel(named, "slow", ContactOutcome("missed"), ()),
    )
    time = np.linspace(0.0, 4.0, 400)
    force = np.where((time > ONSET) & (time < 2.4), 900.0 * np.sin((time - ONSET) * np.pi / 0.4), 0.0)
    return Trace(log, group, 0.0, 4.0, (contact,), 0, (1.9, 2.5), time, force, panels, 2, named("taken evenly"))


def free_trace(named: Naming, group: str) -> Trace:
    """The second operation of the impact-free log, with a false alarm and a detector that could not assess anything."""
    panels = (
        _panel(named, "quick", None, (1.0,)),
        _panel(named, "slow", None, (), verdict="not_assessable", reason=named("start-up 100 %")),
    )
    name, nothing = f"{named('free.csv')}#2", np.empty(0)
    return Trace(name, group, 0.0, 4.0, (), -1, (0.0, 4.0), nothing, nothing, panels, operation=2)


def _panel(
    named: Naming,
    detector: str,
    seen: ContactOutcome | None,
    alarms: tuple[float, ...],
    verdict: str = "alarm",
    reason: str = "",
) -> Panel:
    time = np.linspace(0.0, 4.0, 300)
    value = np.sin(3.0 * time) + np.where(time > 2.02, 4.0 * (time - 2.02), 0.0)
    status = np.zeros(300, dtype=np.uint8)
    status[:30], status[200:210] = Status.START_UP, Status.GAP
    value[200:210] = np.nan
    course = StatisticCurve(time, value, np.full(300, -np.inf), np.where(time > 1.0, 1.5, 2.0), status)
    return Panel(
        detector=named(detector),
        unit="N",
        joint=named("axis"),
        course=course,
        verdict=verdict,
        reason=reason,
        seen=(seen,) if seen else (),
        alarms=alarms,
        false_alarms=() if seen else alarms,
        why=(named("the torque moved first"),),
    )


def _contacts(named: Naming, group: str, typical: float, count: int) -> list[ContactResult]:
    rng = np.random.default_rng(int(typical))
    rows = []
    for i in range(count):
        log = f"{group}/{named(f'{i + 1:02d}.csv')}"
        for detector, factor in (("quick", 1.0), ("slow", 2.0)):
            outcome = "detected"
            if detector == "slow" and i < 2:
                outcome = ("missed", "not_assessable")[i]
            late = round(factor * typical * float(rng.uniform(0.8, 1.2)), 1) if outcome == "detected" else None
            rows.append(
                ContactResult(
                    recording=log,
                    group=group,
                    detector=named(detector),
                    joint=named("axis"),
                    onset_s=ONSET,
                    onset_uncertainty_s=5e-4,
                    alarm_s=None if late is None else ONSET + 1e-3 * late,
                    latency_ms=late,
                    outcome=outcome,
                    force_at_alarm_n=None if late is None else 10.0 * late,
                    peak_force_n=900.0 + i,
                    reason=named("stands still") if outcome == "not_assessable" else None,
                    watched_ms=1000.0,
                    resolution_ms=2.0,
                )
            )
    return rows


def _force(named: Naming, group: str, log: str) -> ForceResult:
    return ForceResult(log, group, 1, named("door"), "fail", 900.0, _steps(named), named("top"), 12.5, named("why"))


def _steps(named: Naming) -> tuple[ForceStepResult, ...]:
    return tuple(
        ForceStepResult(named(name), start, most, 900.0 - most, budget, verdict, named("why"))
        for (name, start, most), verdict, budget in zip(STEPS, ("fail", "not_assessable"), (12.5, None), strict=True)
    )


def _sweep(detector: str, group: str, place: int) -> SweepResult:
    median = (20.0, 40.0, None)[place]
    return SweepResult(
        detector, group, FACTORS[place], (30, 2, 0)[place], 30, 0.5, 12 - place, place, 0, median, median, place == 1
    )


def _provenance(named: Naming, groups: tuple[str, ...]) -> dict[str, object]:
    profile = {
        "title": named("door"),
        "source": named("a standard"),
        "checked": False,
        "steps": [{"from_s": start, "at_most_n": most, "name": named(name)} for name, start, most in STEPS],
        "note": named("note"),
    }
    return {
        "tool_version": "9.8.7",
        "machine": named("gate"),
        "simulated": True,
        "onset": named("above 20 N, back to 8 N"),
        "gains": {named("quick"): {named("bandwidth"): 30.0}},
        "units": {named("quick"): "N"},
        "short_names": {named("quick"): named("q")},
        "signature_rule": {"safety_factor": 5.5},
        "learned_sha256": {named("learn.csv"): "ef" * 32},
        "force_profiles": dict.fromkeys(groups, profile),
    }
