"""Motion is what the noise of the speed does not explain, sample by sample, without a scale."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.recordings.motion.evident_motion import evident_speed
from cdtool.recordings.recording import Series


def speed_of(values, rate=100.0, time=None):
    values = np.asarray(values, dtype=float)
    return Series(np.arange(len(values)) / rate if time is None else time, values, "m/s")


@pytest.mark.parametrize("noise", [1e-6, 1e-3, 1.0])
@pytest.mark.parametrize("rate", [30.0, 100.0, 1000.0])
def test_white_noise_at_rest_is_almost_never_motion_whatever_its_size(noise, rate):
    values = noise * np.random.default_rng(1).standard_normal(20_000)
    assert np.count_nonzero(evident_speed(speed_of(values, rate))) < 0.02 * len(values)


@pytest.mark.parametrize("rate", [30.0, 100.0, 1000.0])
def test_a_motion_ten_times_its_noise_is_seen_after_the_averaging_time(rate):
    rng, n = np.random.default_rng(2), int(2 * rate)
    found = evident_speed(speed_of(np.repeat([0.0, -0.5], n) + 0.05 * rng.standard_normal(2 * n), rate))[:, 0]
    after = n + max(6, int(0.1 * rate))
    assert np.all(np.abs(found[after:] + 0.5) < 0.1)
    assert np.mean(found[:n] != 0.0) < 0.02


@given(st.integers(1, 60), st.integers(0, 2**32 - 1))
def test_a_later_sample_never_changes_it(cut, seed):
    rng = np.random.default_rng(seed)
    values = np.where(rng.random(60) < 0.1, np.nan, rng.standard_normal(60) + np.linspace(0.0, 3.0, 60))
    time = np.cumsum(rng.uniform(0.001, 0.1, 60))
    whole = evident_speed(speed_of(values, time=time))
    np.testing.assert_array_equal(evident_speed(speed_of(values[:cut], time=time[:cut])), whole[:cut])
