"""A clock in another unit than stated is named by the channels that depend on it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdtool.evaluation.truth.onset import OnsetRule
from cdtool.findings.clocks import ClockFactor
from cdtool.findings.motion import AccelerometerScaleWrong, SpeedUnitDoubtful
from cdtool.recording import FloatArray, Recording, Series
from cdtool.workflows.log_checks.log_findings import _window, log_findings
from cdtool.workflows.log_checks.motion_check import units_apart


def stroke() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    time = np.arange(6000) * 1e-3
    acceleration = np.where((time > 0.5) & (time < 1.5), 0.2, 0.0) - np.where((time > 4.0) & (time < 5.0), 0.2, 0.0)
    speed = np.cumsum(acceleration) * 1e-3
    noise = 5e-3 * np.random.default_rng(1).standard_normal(len(time))
    return time, np.cumsum(speed) * 1e-3, speed, acceleration + noise


def findings(clock: float = 1.0, **factors: float) -> dict[type, object]:
    time, *values = stroke()
    channels = {
        name: Series(clock * time, factors.get(name, 1.0) * own, unit)
        for name, own, unit in zip(("position", "speed", "acceleration"), values, ("m", "m/s", "m/s2"), strict=True)
    }
    recording = Recording("log", "log", ("axis",), channels)
    return {
        type(item.fact): item.fact for item in log_findings(recording, [], OnsetRule()) if item.severity == "warning"
    }


@pytest.mark.parametrize(
    ("clock", "units"),
    [
        (1000.0, "ms and s"),
        (1e-3, "ms and s"),
        (1e6, "us and s"),
        (1e-6, "us and s"),
        (1 / 60.0, "min and s"),
        (60.0, "min and s"),
        (1 / 3600.0, "h and s"),
    ],
)
def test_a_clock_in_another_unit_is_named(clock, units):
    fact = findings(clock)[ClockFactor]
    assert fact.as_between == units and fact.by_speed == pytest.approx(clock, rel=0.05)
    assert fact.by_acceleration == pytest.approx(clock, rel=0.2)


@pytest.mark.parametrize(
    ("channel", "factor", "kind"),
    [
        ("position", 1000.0, SpeedUnitDoubtful),
        ("position", 2.0 * math.pi, SpeedUnitDoubtful),
        ("acceleration", 1000.0, AccelerometerScaleWrong),
        ("acceleration", 1e-6, AccelerometerScaleWrong),
    ],
)
def test_the_unit_of_one_channel_does_not_blame_the_clock(channel, factor, kind):
    found = findings(**{channel: factor})
    assert set(found) == {kind} and found[kind].as_between == units_apart(max(factor, 1.0 / factor))


def test_a_wrong_speed_alone_blames_the_clock_only_if_both_factors_are_equal():
    assert ClockFactor not in findings(speed=1000.0)


def test_correct_units_cause_no_warning():
    assert not findings()


def test_a_gap_of_centuries_needs_no_more_windows():
    time, *values = stroke()
    time = np.where(time > 3.0, time + 1e10, time)
    channels = {"speed": Series(time, values[1], "m/s"), "acceleration": Series(time, values[2], "m/s2")}
    assert _window(channels["speed"], channels["acceleration"]) == pytest.approx(1e4)


@pytest.mark.parametrize(
    ("ratio", "units"),
    [
        (1000.0, "mm and m, or ms and s"),
        (1e6, "um and m, or us and s"),
        (60.0, "min and s"),
        (180.0 / math.pi, "deg and rad"),
        (2.0 * math.pi, "turns and rad"),
        (6.0, "rpm and deg/s"),
        (3.0, ""),
        (0.0, ""),
    ],
)
def test_a_factor_names_the_nearest_units(ratio, units):
    assert units_apart(ratio) == units
