"""The steps of a load cell's clock: from one selection the bits of numpy's median and quantile; samples stored once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.recordings.recording import Series
from cdtool.truth.missing_samples import CellClock, cell_samples, longest_step
from tests.bits import assert_same_bits, clocks


@settings(max_examples=200, deadline=None)
@given(st.sampled_from([0, 1, 2, 3, 4, 5, 20, 21, 22, 41, 300]).flatmap(clocks))
def test_steps_are_those_of_median_and_quantile(time):
    clock = CellClock(time)
    if len(time) < 2:
        assert (clock.period, clock.longest_step, clock.batch_length) == (0.0, 0.005, 0.0)
        return
    steps = np.diff(time)
    period, usual = np.median(steps), np.quantile(steps, 0.95)
    assert_same_bits(np.array(clock.period), np.array(period))
    longest = max(5e-3, 2.5 * float(period), float(period) + 1.1 * float(usual))
    assert_same_bits(np.array([clock.longest_step, longest_step(time)]), np.array([longest, longest]))
    batch = float(usual) if usual > 5.0 * period else 0.0
    assert_same_bits(np.array(clock.batch_length), np.array(batch))


@pytest.mark.parametrize("missing", [(), (0, 3, 99), range(100)])
def test_the_samples_of_a_cell_are_those_that_are_not_missing_and_the_same_each_time(missing):
    values = np.arange(100.0)
    values[list(missing)] = np.inf if len(missing) == 3 else np.nan
    force = Series(np.arange(100) * 1e-3, values, "N")
    samples = cell_samples(force)
    assert samples is cell_samples(force)
    present = np.isfinite(values)
    assert_same_bits(samples.force, values[present])
    assert_same_bits(samples.time, force.time[present])
