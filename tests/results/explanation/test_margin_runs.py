"""Runs outside the band, as the activation counts them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.detectors.detection import Status
from cdtool.results.explanation.margin import JointMargin

VALUES = st.sampled_from([1.0, 0.0, -0.0, 1.0 + 1e-15, -1.0, 2.0, -np.inf, np.inf, np.nan])
LIMITS = st.sampled_from([1.0, 1.0, -1.0, np.inf, -np.inf, np.nan])


def _sample_by_sample(value, lower, upper, status):
    runs, count = [], 0
    for k in range(len(value)):
        if status[k] == Status.GAP:
            continue
        margin = np.minimum(upper[k] - value[k], value[k] - lower[k])
        if margin < 0.0 and status[k] == Status.VALID:
            runs = runs if count else [*runs, [k, k, 0]]
            count += 1
            runs[-1] = [runs[-1][0], k, count]
        else:
            count = 0
    return runs


@given(st.lists(st.tuples(VALUES, LIMITS, LIMITS, st.sampled_from([0, 0, 0, 3, 4])), max_size=40))
def test_missing_samples_neither_interrupt_a_run_nor_count(rows):
    value, lower, upper = (np.array([row[i] for row in rows], dtype=np.float64) for i in range(3))
    status = np.array([row[3] for row in rows], dtype=np.uint8)
    statistic = SimpleNamespace(values=value[:, np.newaxis], status=status[:, np.newaxis])
    band = SimpleNamespace(lower=lower[:, np.newaxis], upper=upper[:, np.newaxis])
    with np.errstate(invalid="ignore"):
        found = JointMargin(SimpleNamespace(statistic=statistic, band=band), 0).runs
        assert found.tolist() == _sample_by_sample(value, lower, upper, status)
