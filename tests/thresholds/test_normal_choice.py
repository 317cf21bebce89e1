"""The choice of a class of motion, and comparisons that several alarms of one operation share."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from cdtool.recordings.motion import measured_class
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.normal_choice import NormalMotions
from cdtool.thresholds.normal_motion import learn_normal_motion

TIME = np.arange(4000) * 1e-3
VALUES = st.sampled_from([0.0, -0.0, 1.0, -2.5, 1e3, 1e-9, np.nan, np.inf])


def _run(seed: int) -> Recording:
    noise = np.random.default_rng(seed).standard_normal(len(TIME))
    channels = {"speed": Series(TIME, 0.2 + 1e-3 * noise, "m/s"), "position": Series(TIME, 0.2 * TIME, "m")}
    return Recording(f"{seed}", "", ("axis",), channels)


def test_alarms_of_one_operation_share_a_comparison_that_equals_a_separate_one():
    runs = [_run(seed) for seed in range(5)]
    learned = learn_normal_motion(runs, measured_class(runs[0]))
    assert learned is not None
    (shared,) = NormalMotions((learned,)).for_one_operation().motions
    log = _run(77)
    first = shared.compare(log, "speed", 1.0, 2.0)
    assert shared.compare(log, "speed", 0.9, 2.1) is first
    for start, end in ((1.0, 2.0), (0.9, 2.1), (2.5, 3.0), (0.0, 0.4), (-np.inf, np.inf)):
        one, other = (item.compare(log, "speed", start, end) for item in (shared, learned))
        first, last = np.searchsorted(one.time, other.time[[0, -1]])
        rows = slice(first, last + 1)
        for name in ("time", "value", "mean", "spread", "level", "level_mean", "level_spread", "running", "distance"):
            np.testing.assert_array_equal(getattr(one, name)[rows], getattr(other, name))
