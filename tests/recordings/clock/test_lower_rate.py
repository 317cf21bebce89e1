"""Which rows of a table are samples of a channel whose rate is lower than that of the rows."""

from __future__ import annotations

import numpy as np
import pytest

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
