"""Absolute limits."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.errors import UsageError
from cdtool.detectors.detection import Signal
from cdtool.recordings.recording import Recording
from cdtool.thresholds.limit import Limit

RECORDING = Recording("r", "r", ("a", "b"), {})


def signal(values: np.ndarray) -> Signal:
    return Signal(np.arange(len(values)) * 1.0, values, np.zeros(values.shape, dtype=np.uint8), "N m")


def test_one_limit_serves_all_joints_and_infinity_leaves_a_joint_unwatched():
    _, band = Limit.given([40.0]).evaluate(RECORDING, signal(np.zeros((3, 2))))
    assert (band.upper == 40.0).all() and (band.lower == -40.0).all()
    _, band = Limit.given([np.inf, 10.0]).evaluate(RECORDING, signal(np.zeros((3, 2))))
    assert (band.upper == [np.inf, 10.0]).all()


@pytest.mark.parametrize("limits", [[1.0, 2.0, 3.0], [-1.0], [np.nan], [0.0]])
def test_limits_that_do_not_fit_are_refused(limits):
    with pytest.raises(UsageError, match="limits"):
        Limit.given(limits).evaluate(RECORDING, signal(np.zeros((3, 2))))


def test_fitted_limits_are_the_mean_extremes_and_their_spread():
    peaks = np.array([10.0, 12.0, 14.0])
    pairs = [(RECORDING, signal(np.array([[0.0, 0.0], [peak, -peak]]))) for peak in peaks]
    fitted = Limit(safety_factor=3.0).fit(pairs)
    assert fitted.upper == pytest.approx((12.0 + 3.0 * 2.0, 0.0))
    assert fitted.lower == pytest.approx((0.0, -12.0 - 3.0 * 2.0))
