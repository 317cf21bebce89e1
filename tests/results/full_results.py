"""Results with a row of every kind."""

from __future__ import annotations

import math
from dataclasses import replace

from cdtool.results.results import (
    CalibrationResult,
    ConditionResult,
    ContactResult,
    ExposureResult,
    FalseAlarmResult,
    ForceResult,
    ForceStepResult,
    LimitResult,
    PointResult,
    RecordingFinding,
    RecordingResult,
    Results,
    Skipped,
    SweepResult,
)


def contact(latency: float | None, outcome: str = "detected", detector: str = "momentum") -> ContactResult:
    alarm = None if latency is None else 5.0 + 1e-3 * latency
    return ContactResult(
        "a.csv", "stiff", detector, "gate", 5.0, 0.001, alarm, latency, outcome, 100.0, math.nan, watched_ms=1000.0
    )


RESULTS = Results(
    provenance={"tool": "cdtool", "gain": math.inf, "learned_runs": []},
    detectors=("momentum", "pure_torque"),
    groups=("stiff", "holdout"),
    contacts=(
        contact(10.0),
        contact(20.0),
        contact(60.0),
        contact(None, "missed"),
        contact(None, "not_assessable"),
        contact(None, "missed", "pure_torque"),
    ),
    false_alarms=(FalseAlarmResult("b.csv", "holdout", "momentum", "gate", 1.0),),
    exposure=(ExposureResult("stiff", "momentum", 5, 5, 0.01), ExposureResult("holdout", "momentum", 7, 9, 0.5)),
    skipped=(Skipped("c.csv", "empty"),),
)
# One row of every kind.
STEP = ForceStepResult("dynamic", 0.0, 400.0, math.inf, 3.0, "fail", "too much")
FULL = replace(
    RESULTS,
    recordings=(RecordingResult("a.csv", "stiff", "c0ffee", 7.0, 1, 5, "monday", "edge"),),
    forces=(ForceResult("a.csv", "stiff", 1, "gap", "fail", 500.0, (STEP, STEP), "edge", 3.0, "too much"),),
    points=(PointResult("edge", "stiff", "gap", 3, "fail", (STEP,), "mean of 3", "too much"),),
    sweep=(SweepResult("momentum", "stiff", 5.5, 0, 9, 0.5, 3, 1, 1, 30.0, None),),
    calibration=(CalibrationResult("momentum", "1/1000op", 6.0, 3000, 5.0, 1),),
    limits=(LimitResult("momentum.*.missed", "momentum", "stiff", "missed", 1.0, None, 0.0, "violated", "1 is more"),),
    conditions=(ConditionResult("winter/stiff", "winter", "stiff", False),),
    findings=(RecordingFinding("a.csv", "time: 1 gap", "loss", "sample_gaps", "time"),),
)
