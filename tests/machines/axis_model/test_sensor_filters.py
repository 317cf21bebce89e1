"""The low-passes of a log's channels against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.machines.axis_model.sensor_filters import first_order_low_pass, second_order_low_pass


def test_a_low_pass_answers_a_step_with_its_time_constant() -> None:
    answer = first_order_low_pass(np.ones(100), 0.01, 1e-3)
    np.testing.assert_allclose(answer, 1.0 - np.exp(-np.arange(1, 101) / 10.0), atol=1e-12)


def test_the_accelerometer_low_pass_has_unit_gain_at_rest_and_its_damping_at_the_corner() -> None:
    time = np.arange(4000) * 1e-3
    answer = second_order_low_pass(np.sin(2.0 * np.pi * 25.0 * time), 25.0, 0.8, 1e-3)[2000:]
    assert np.sqrt(2.0) * np.std(answer) == pytest.approx(1.0 / (2.0 * 0.8), rel=1e-3)
    assert second_order_low_pass(np.ones(4000), 25.0, 0.8, 1e-3)[-1] == pytest.approx(1.0)
