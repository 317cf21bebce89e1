"""How long a force is above a level, compared with closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.limits import read_force_limits
from cdtool.truth.force.quantities import dynamic_time, time_above

STEP = 1e-4
TIME = np.arange(0.0, 3.0, STEP)


def curve(force: np.ndarray, time: np.ndarray = TIME) -> ForceTimeCurve:
    return ForceTimeCurve(time, force, np.zeros(len(time), dtype=bool), end=float(time[-1]))


@given(st.floats(200.0, 5000.0), st.floats(0.01, 2.0), st.floats(0.05, 0.95))
def test_a_half_sine_is_above_a_level_between_two_arc_sines(peak, length, share):
    force = np.where(length >= TIME, peak * np.sin(np.pi * TIME / length), 0.0)
    above = time_above(curve(force), share * peak)
    begin = length / np.pi * math.asin(share)
    # A straight line between two samples is off by less than a sample.
    assert above.begin == pytest.approx(begin, abs=STEP) and above.end == pytest.approx(length - begin, abs=STEP)


@given(st.floats(200.0, 5000.0), st.floats(0.02, 0.5), st.floats(0.1, 0.9))
def test_an_exponential_decay_is_above_a_level_for_a_logarithm(peak, constant, share):
    above = time_above(curve(peak * np.exp(-TIME / constant)), share * peak)
    assert above.begin == 0.0 and above.length == pytest.approx(constant * math.log(1.0 / share), abs=STEP)


def test_a_ramp_crosses_exactly_between_two_samples():
    above = time_above(curve(np.array([0.0, 100.0, 200.0, 0.0]), np.array([0.0, 0.1, 0.2, 0.3])), 150.0)
    assert above.begin == pytest.approx(0.15) and above.end == pytest.approx(0.225)


def test_the_dynamic_time_is_that_above_the_second_limit_and_a_profile_of_one_step_has_none():
    profiles = read_force_limits()
    force = np.where(TIME < 0.4, 200.0, 30.0)
    assert dynamic_time(curve(force), profiles["en_12453_wide_gap"]) == pytest.approx(0.4, abs=2.0 * STEP)
    assert dynamic_time(curve(force), profiles["iso_ts_15066_neck"]) == pytest.approx(0.4, abs=2.0 * STEP)
