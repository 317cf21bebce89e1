"""The accelerometer compared with the derivative of the speed: errors are found, and vibration is no evidence."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from cdtool.findings import Fact
from cdtool.findings.motion import AccelerometerScaleWrong, AccelerometerTurned, AccelerometerUncheckable
from cdtool.recording import Recording, Series
from cdtool.workflows.log_checks.log_findings import accelerometer_findings
from cdtool.workflows.runs import read_log

LOGS = Path(__file__).parents[3] / "sample_logs"


@cache
def log(folder: str, name: str) -> Recording:
    return read_log(LOGS / folder / name, LOGS / folder / "machine.toml")


def warnings(recording: Recording) -> list[Fact]:
    return [item.fact for item in accelerometer_findings(recording, ()) if item.severity == "warning"]


def scaled(recording: Recording, factor: float) -> Recording:
    series = recording["acceleration"]
    values = Series(series.time, factor * series.values, series.unit)
    return replace(recording, channels={**recording.channels, "acceleration": values})


@pytest.mark.parametrize("folder", ["gate", "arm/trial_1", "arm/trial_2"])
def test_no_sample_run_has_a_warning_and_a_held_joint_is_no_evidence(folder):
    for path in sorted((LOGS / folder / "free").iterdir()):
        recording = log(folder, f"free/{path.name}")
        assert warnings(recording) == []
        facts = [item.fact for item in accelerometer_findings(recording, ())]
        assert (AccelerometerUncheckable("forearm", "joint hardly moves") in facts) == ("arm" in folder)


@pytest.mark.parametrize("folder", ["gate", "arm/trial_1"])
@pytest.mark.parametrize(
    ("factor", "kind", "may_hold"),
    [
        (-1.0, AccelerometerTurned, None),
        (9.81, AccelerometerScaleWrong, "m/s2"),
        (1 / 9.81, AccelerometerScaleWrong, "g"),
    ],
)
def test_a_joint_that_moves_is_found_with_the_wrong_sign_or_scale(folder, factor, kind, may_hold):
    (fact,) = warnings(scaled(log(folder, "free/03.csv"), factor))
    assert type(fact) is kind and getattr(fact, "may_hold", None) == may_hold
    assert 0.7 < fact.slope / factor < 1.4 and abs(fact.correlation) > 0.8
