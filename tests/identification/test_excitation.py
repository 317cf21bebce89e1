"""What a motion excites: held speeds, directions, acceleration."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdtool.identification.axis_run import AxisRun
from cdtool.identification.estimate import Missing
from cdtool.identification.excitation import Excitation, distinct_speeds, measure_excitation
from cdtool.identification.filtered_regression import filter_run
from cdtool.recording import FloatArray

PERIOD = 2e-3


def excitation_of(*speeds: FloatArray, noise: float = 0.0) -> Excitation:
    rng = np.random.default_rng(1)
    runs = [
        AxisRun("log", 0.0, PERIOD, np.zeros(len(speed)), speed=speed + noise * rng.standard_normal(len(speed)))
        for speed in speeds
    ]
    return measure_excitation([filter_run(run, 20.0) for run in runs])


def stroke(speed: float, seconds: float = 4.0, acceleration: float = 1.0) -> FloatArray:
    ramp = np.linspace(0.0, speed, max(round(abs(speed) / acceleration / PERIOD), 2))
    hold, rest = np.full(round(seconds / PERIOD), speed), np.zeros(round(0.3 / PERIOD))
    return np.concatenate((rest, ramp, hold, ramp[::-1], rest))


@pytest.mark.parametrize("speeds", [(0.2,), (0.1, 0.2), (0.05, 0.12, 0.3)])
def test_the_held_speeds_are_found(speeds):
    excitation = excitation_of(*(stroke(speed) for speed in speeds))
    assert excitation.speeds == pytest.approx(speeds, rel=0.01)
    assert excitation.strokes == len(speeds)
    assert (Missing.SECOND_SPEED in excitation.missing) == (len(speeds) < 3)


def test_a_short_ramp_is_not_a_second_speed():
    assert len(excitation_of(stroke(0.2, seconds=7.0, acceleration=0.2)).speeds) == 1


def test_a_sine_holds_many_speeds():
    time = np.arange(10_000) * PERIOD
    excitation = excitation_of(0.3 * np.sin(2.0 * math.pi * 0.4 * time))
    assert len(excitation.speeds) >= 3
    assert excitation.forward_share == pytest.approx(0.5, abs=0.02)
    assert excitation.missing == ()
    assert excitation.reversals == 15


def test_one_direction_and_hardly_any_acceleration_are_missing():
    excitation = excitation_of(np.full(5000, -0.2), noise=1e-3)
    assert excitation.is_one_way
    assert Missing.REVERSALS in excitation.missing
    assert Missing.ACCELERATION in excitation.missing
    assert excitation.travel == pytest.approx(2.0, rel=0.02)


def test_acceleration_above_its_noise_is_enough():
    excitation = excitation_of(stroke(0.2), stroke(-0.2), noise=1e-4)
    assert Missing.ACCELERATION not in excitation.missing
    assert Missing.REVERSALS not in excitation.missing
    assert excitation.moving_time == pytest.approx(8.8, rel=0.05)


def test_standstill_excites_nothing():
    excitation = excitation_of(np.zeros(2000), noise=1e-4)
    assert excitation.moving_time < 0.1
    assert Missing.ACCELERATION in excitation.missing
    assert measure_excitation([]).speeds == ()


def test_speeds_that_are_close_are_one():
    speeds = np.repeat([0.100, 0.108, 0.2], 100)
    held = distinct_speeds(speeds, np.full(300, 1.0 / 300.0))
    assert held == pytest.approx((0.104, 0.2), rel=0.01)


def test_a_speed_for_a_short_time_is_not_held():
    speeds = np.concatenate((np.full(97, 0.1), np.full(3, 0.3)))
    assert distinct_speeds(speeds, np.full(100, 0.01)) == pytest.approx((0.1,))
