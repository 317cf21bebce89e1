"""Travel, noise and mean acceleration of a log, bit by bit against the formulas with numpy alone."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cdtool.clock import GAP_PERIODS, integrate, previous_value
from cdtool.recording import Series
from cdtool.workflows.log_checks.log_findings import _pairs
from cdtool.workflows.log_checks.motion_check import _moved, travel_without_gaps
from tests.bits import VALUES, assert_same_bits, clocks


@st.composite
def positions(draw):
    """(n,) m or rad: a stroke with noise or encoder steps, constant, arbitrary, some samples missing."""
    count = draw(st.sampled_from([0, 1, 2, 3, 4, 49, 50, 51, 120, 1300]))
    if draw(st.booleans()):
        return draw(arrays(np.float64, min(count, 120), elements=VALUES, fill=VALUES))
    random = np.random.default_rng(draw(st.integers(0, 2**31)))
    values = draw(st.sampled_from([0.0, 1.0, 0.05, 1e-12])) * np.sin(np.linspace(0.0, 2.0, count))
    values += draw(st.sampled_from([0.0, 1e-4, 0.01])) * random.normal(size=count)
    resolution = draw(st.sampled_from([0.0, 1e-3, 0.02]))
    values = np.round(values / resolution) * resolution if resolution else values
    values[random.uniform(size=count) < draw(st.sampled_from([0.0, 0.1]))] = draw(st.sampled_from([np.nan, np.inf]))
    return values


def _travel(values):
    known = values[np.isfinite(values)]
    if len(known) < 3:
        return 0.0
    steps = np.diff(known)
    noise = 1.48 * float(np.median(np.abs(steps - np.median(steps)))) / np.sqrt(2.0)
    changed = np.abs(steps[steps != 0.0])
    changed = changed[changed > 1e-9 * max(float(np.abs(known).max()), 1e-300)]
    encoder = float(changed.min()) if len(changed) else 0.0
    parts = [float(np.median(part)) for part in np.array_split(known, min(50, len(known)))]
    span = max(parts) - min(parts)
    return span if span > 10.0 * max(noise, encoder) else 0.0


@settings(max_examples=400, deadline=None)
@given(positions())
def test_how_far_a_joint_moved_is_the_range_of_fifty_medians_above_noise_and_steps(values):
    assert_same_bits(np.array(_moved(values)), np.array(_travel(values)))


def test_a_stroke_is_far_above_its_noise_and_noise_alone_is_no_travel():
    noise = 1e-3 * np.random.default_rng(1).normal(size=5000)
    assert 0.9 < _moved(np.linspace(0.0, 1.0, 5000) + noise) < 1.1
    assert _moved(noise) == 0.0
    assert _moved(np.round(np.linspace(0.0, 0.05, 5000) / 0.01) * 0.01) == 0.0


@settings(max_examples=150, deadline=None)
@given(st.data(), st.sampled_from([1, 2]))
def test_mean_acceleration_and_gain_of_speed_are_those_of_each_window_alone(data, joints):
    made = []
    for _ in range(2):
        time = data.draw(st.sampled_from([2, 30, 700, 2000]).flatmap(clocks))
        random = np.random.default_rng(data.draw(st.integers(0, 2**31)))
        values = random.normal(size=(len(time), joints))
        values[random.uniform(size=values.shape) < data.draw(st.sampled_from([0.0, 0.3, 1.0]))] = np.nan
        made.append(Series(time, values, "m/s"))
    window = data.draw(st.sampled_from([0.2, 0.05]))
    for ours, theirs in zip(_pairs(*made, joints - 1, window), _windows(*made, joints - 1, window), strict=True):
        assert_same_bits(ours, theirs)


def _windows(speed, acceleration, joint, window):
    edges = np.arange(max(speed.time[0], acceleration.time[0]), min(speed.time[-1], acceleration.time[-1]), window)
    known = np.isfinite(speed.values[:, joint])
    if len(edges) < 3 or np.count_nonzero(known) < 2:
        return np.empty(0), np.empty(0)
    gained = np.diff(np.interp(edges, speed.time[known], speed.values[known, joint])) / window
    means = np.full(len(edges) - 1, np.nan)
    for i, (start, end) in enumerate(pairwise(edges)):
        inside = (acceleration.time >= start) & (acceleration.time < end)
        part = acceleration.values[inside, joint]
        part = part[np.isfinite(part)]
        means[i] = part.mean() if len(part) else np.nan
    good = np.isfinite(means) & np.isfinite(gained)
    return gained[good], means[good]


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_travel_without_gaps_is_that_of_the_steps_between_known_samples(data):
    made = []
    for _ in range(2):
        time = data.draw(st.sampled_from([1, 2, 3, 30, 400]).flatmap(clocks))
        random = np.random.default_rng(data.draw(st.integers(0, 2**31)))
        if data.draw(st.booleans()):
            time = time + np.cumsum(random.choice([0.0, 0.5], size=len(time), p=[0.95, 0.05]))
        values = np.cumsum(random.normal(size=(len(time), 1)), axis=0)
        values[random.uniform(size=values.shape) < data.draw(st.sampled_from([0.0, 0.3]))] = np.nan
        made.append(Series(time, values, "m"))
    speed, position = made
    if data.draw(st.booleans()):
        position = Series(speed.time, data.draw(st.sampled_from([1.0, -1.0])) * speed.values, "m")
    integrals = previous_value(integrate(speed, "m"), position.time)[:, 0].copy()
    longest = GAP_PERIODS * position.period, speed.time, GAP_PERIODS * speed.period
    found = travel_without_gaps(position.time, integrals, position.values[:, 0].copy(), *longest)
    assert_same_bits(np.array(found) + 0.0, np.array(_steps_added(integrals, speed, position)) + 0.0)


def _steps_added(integrated, speed, position):
    travelled, time = position.values[:, 0], position.time
    known = np.isfinite(travelled) & np.isfinite(integrated)
    integrated, travelled, time = integrated[known], travelled[known], time[known]
    if len(time) < 2:
        return 0.0, 0.0, 0.0, 0.0
    logged = np.diff(time) <= GAP_PERIODS * position.period
    pauses = np.concatenate(([0], np.cumsum(np.diff(speed.time) > GAP_PERIODS * speed.period)))
    at = np.searchsorted(speed.time, time, side="right") - 1
    after = np.minimum(at + 1, len(speed.time) - 1)
    logged &= pauses[after[1:]] == pauses[at[:-1]]
    sums = [np.cumsum(np.where(logged, np.diff(values), 0.0)) for values in (integrated, travelled)]
    sums = [np.concatenate(([0.0], each)) for each in sums]
    return tuple(number for each in sums for number in (float(np.ptp(each)), float(each[-1])))
