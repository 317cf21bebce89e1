"""Results under hostile names."""

from __future__ import annotations

from dataclasses import replace

from cdtool.results.evaluated import Evaluated, evaluate
from cdtool.results.results import (
    CalibrationResult,
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
)
from tests.report.bench import contact


def forces(name: str = "reducing gap") -> tuple[tuple[ForceResult, ...], tuple[PointResult, ...]]:
    steps = (
        ForceStepResult(name, 0.0, 400.0, 500.0, 12.0, "fail", f"500 N where 400 N are allowed {name}"),
        ForceStepResult("static", 0.75, 150.0, None, None, "not_assessable", name),
    )
    kept = (ForceStepResult(name, 0.0, 400.0, 300.0, None, "pass"),)
    made = (
        ForceResult("stiff/01.csv", "stiff", 1, name, "fail", 500.0, steps, name, 12.0, name),
        ForceResult("stiff/02.csv", "stiff", 1, name, "pass", 300.0, kept),
    )
    return made, (PointResult(name, "stiff", name, 3, "fail", steps, "mean of 3 tests", name),)


def named(results: Results, name: str) -> Evaluated:
    """Results in which everything that may come from a file is this name."""
    made, points = forces(name)
    limit = LimitResult(name, name, name, name, 1.0, None, 0.0, "violated", name)
    changed = replace(
        results,
        groups=(name,),
        detectors=(name,),
        contacts=(
            contact(name, name, 30.0),
            contact(name, name, None, "missed", name),
            replace(contact(name, name, None, "not_assessable", name), reason=name, contact=2),
        ),
        false_alarms=(FalseAlarmResult(name, name, name, name, 1.0, name, 1.0, 1.0),),
        exposure=(ExposureResult(name, name, 1, 1, 1.0, 1, {name: 1.0}),),
        recordings=(RecordingResult(name, name, name, 1.0, 1, 1, name, name),),
        forces=tuple(replace(item, recording=name, group=name, profile=name) for item in made),
        points=tuple(replace(item, group=name, note=name) for item in points),
        calibration=(CalibrationResult(name, name, 1.0, 1, 1.0, 1),),
        limits=(limit,) * 9,
        skipped=(Skipped(name, name),),
        findings=tuple(RecordingFinding(name, name, severity, name, name) for severity in ("loss", "warning")),
        provenance={
            "onset": name,
            "machine": name,
            "plugins": [name],
            "window_s": {name: name},
            "units": {name: name},
            "short_names": {name: name},
            "gains": {name: {name: name}},
            "signature_sha256": {name: name},
            "learned_sha256": {name: name},
            "force_profiles": {name: {"title": name, "source": name}, "other": name},
        },
    )
    return evaluate(changed)
