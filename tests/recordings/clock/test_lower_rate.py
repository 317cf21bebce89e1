"""Which rows of a table are samples of a channel whose rate is lower than that of the rows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.recordings.clock.lower_rate import sampled_rows


def every(count, step, start=0):
    values = np.full(count, np.nan)
    values[start::step] = np.arange(len(values[start::step]))
    return values


@pytest.mark.parametrize("step", [2, 3, 4, 10])
@pytest.mark.parametrize("start", [0, 1])
def test_the_rows_with_a_value_are_the_samples_of_a_lower_rate(step, start):
    values = every(100, step, start)
    assert np.flatnonzero(sampled_rows(values)).tolist() == list(range(start, 100, step))


def test_a_lost_sample_of_a_lower_rate_stays_a_pause():
    values = every(100, 4)
    values[40] = np.nan
    assert np.flatnonzero(sampled_rows(values)).tolist() == [i for i in range(0, 100, 4) if i != 40]


@pytest.mark.parametrize(
    "missing", [[], [7], range(50, 100), range(50), [i for i in range(100) if i % 3 == 0], range(10, 90)]
)
def test_missing_samples_at_the_rate_of_the_rows_are_no_lower_rate(missing):
    values = np.arange(100.0)
    values[list(missing)] = np.nan
    assert sampled_rows(values) is None


def test_joints_that_are_sampled_together_have_one_rate_and_a_single_joint_may_miss_a_sample():
    values = np.column_stack([every(40, 4), every(40, 4)])
    values[8, 1] = np.nan
    assert np.flatnonzero(sampled_rows(values)).tolist() == list(range(0, 40, 4))


@given(st.lists(st.booleans(), max_size=60))
def test_no_row_with_a_value_is_lost(present):
    values = np.where(present, 1.0, np.nan) if present else np.empty(0)
    rows = sampled_rows(values)
    assert rows is None or rows.tolist() == present
