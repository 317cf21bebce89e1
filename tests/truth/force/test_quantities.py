"""How long a force is above a level, compared with closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base.errors import UsageError
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


@pytest.mark.parametrize("level", [0.0, -1.0, math.nan])
def test_a_level_that_is_not_above_zero_is_refused(level):
    with pytest.raises(UsageError, match="level"):
        time_above(curve(np.zeros(len(TIME))), level)


def test_the_dynamic_time_is_that_above_the_second_limit_and_a_profile_of_one_step_has_none():
    profiles = read_force_limits()
    force = np.where(TIME < 0.4, 200.0, 30.0)
    assert dynamic_time(curve(force), profiles["en_12453_wide_gap"]) == pytest.approx(0.4, abs=2.0 * STEP)
    assert dynamic_time(curve(force), profiles["iso_ts_15066_neck"]) == pytest.approx(0.4, abs=2.0 * STEP)


@given(st.lists(st.floats(0.0, 1000.0), min_size=2, max_size=40), st.floats(1.0, 999.0), st.floats(0.1, 10.0))
def test_a_higher_level_is_never_exceeded_for_longer_and_scaling_both_changes_nothing(forces, level, scale):
    force, time = np.array(forces), np.arange(len(forces)) * 0.01
    low, high = (time_above(curve(force, time), item).length for item in (level, 1.1 * level))
    assert high <= low + 1e-9
    scaled = time_above(curve(scale * force, time), scale * level).length
    assert scaled == pytest.approx(low, abs=1e-6) or min(np.abs(force - level)) < 1e-6
