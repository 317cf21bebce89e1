"""The delay of a signal against another one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.truth.synchronisation.delay import SmoothSignal, delay_of
from cdtool.truth.synchronisation.smoothing import Grid

GRID = Grid.over(0.0, 2.0, 0.004)


def bump(time):
    return np.exp(-(((time - 1.0) / 0.04) ** 2)) + 0.5 * np.exp(-(((time - 1.1) / 0.03) ** 2))


def signal(values) -> SmoothSignal:
    return SmoothSignal(GRID, np.asarray(values, dtype=np.float64))


@given(st.floats(-0.09, 0.09), st.floats(0.1, 10.0), st.floats(-5.0, 5.0), st.sampled_from([-1.0, 1.0]))
def test_the_delay_does_not_depend_on_scale_offset_and_sign(delay, scale, offset, sign):
    late = signal(sign * scale * bump(GRID.times - delay) + offset)
    found = delay_of(late, signal(bump(GRID.times)), 0.8, 1.3, 0.15)
    assert found.known and found.delay == pytest.approx(delay, abs=2e-6)


@pytest.mark.parametrize(
    ("late", "early", "is_transient", "reason"),
    [
        (np.sin(60.0 * GRID.times), np.sin(60.0 * GRID.times), False, "periodic: several delays fit"),
        (bump(GRID.times - 0.165), bump(GRID.times), True, "at the limit of the range of delays"),
        (np.ones(GRID.count), bump(GRID.times), True, "too few samples"),
        (np.full(GRID.count, np.nan), bump(GRID.times), True, "too few samples"),
        (GRID.times, 3.0 * GRID.times, True, "the signals do not change enough"),
    ],
    ids=["periodic", "too late", "constant", "missing", "ramp"],
)
def test_what_shows_no_unique_delay_has_a_reason(late, early, is_transient, reason):
    found = delay_of(signal(late), signal(early), 0.6, 1.6, 0.15, is_transient)
    assert not found.known and math.isnan(found.delay) and found.reason == reason


def test_independent_noise_has_no_delay():
    rng = np.random.default_rng(1)
    kernel = np.exp(-0.5 * (np.arange(-12, 13) / 3.0) ** 2)
    reasons = []
    for _ in range(30):
        one, other = (np.convolve(rng.standard_normal(GRID.count), kernel, "same") for _ in range(2))
        reasons.append(delay_of(signal(one), signal(other), 0.5, 1.5, 0.1, is_transient=False).reason)
    assert sum(not reason for reason in reasons) <= 3  # one in two hundred is usual


def test_the_standard_error_is_that_of_the_scatter():
    rng = np.random.default_rng(2)
    kernel = np.exp(-0.5 * (np.arange(-8, 9) / 2.0) ** 2)
    kernel /= np.sqrt(np.sum(kernel**2))
    delays, errors = [], []
    for _ in range(60):
        noise = 0.03 * np.convolve(rng.standard_normal(GRID.count), kernel, "same")
        found = delay_of(signal(bump(GRID.times - 0.013) + noise), signal(bump(GRID.times)), 0.7, 1.4, 0.1)
        delays.append(found.delay)
        errors.append(found.error)
    assert np.mean(delays) == pytest.approx(0.013, abs=4e-4)
    assert 0.8 < np.mean(errors) / np.std(delays) < 2.0
