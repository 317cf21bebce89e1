"""When a recording began: only where its clock counts from 1970."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.recordings.recording import Recording, Series


@pytest.mark.parametrize(
    ("origin", "first", "began"),
    [(1.7e9, 0.5, 1.7e9 + 0.5), (0.0, 0.5, None), (0.0, 1.7e9, 1.7e9), (5.0e9, 0.0, None), (3.2e8, 0.0, None)],
)
def test_the_first_sample_of_any_channel_counts(origin, first, began):
    channels = {
        "speed": Series(np.array([first + 1.0, first + 2.0]), np.zeros((2, 1)), "m/s"),
        "torque": Series(np.array([first, first + 2.0]), np.zeros((2, 1)), "N"),
    }
    assert Recording("a.csv", "a.csv", ("gate",), channels, origin).began == began
