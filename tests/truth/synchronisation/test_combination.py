"""Offset and drift from the delays of many events."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.truth.synchronisation.combination import clock_line
from cdtool.truth.synchronisation.delay import EventDelay


def events(times, delays, errors=1e-4):
    each = np.broadcast_to(errors, len(times))
    return [EventDelay(float(t), float(d), float(e), 0.99) for t, d, e in zip(times, delays, each, strict=True)]


def test_soft_contacts_with_too_small_errors_do_not_turn_the_line():
    """The delays of six stiff contacts are within 0.5 ms; one of six soft ones is wrong by 3.6 standard errors."""
    times = np.array([26, 177, 316, 331, 340, 488, 42, 270, 349, 444, 451, 560], dtype=np.float64)
    wrong = 1e-3 * np.array([0.4, -0.3, -0.1, 0.0, 0.1, -0.3, 6.7, 2.0, -0.4, 1.6, -5.1, -2.5])
    errors = 1e-3 * np.array([0.4, 0.4, 0.5, 0.4, 0.2, 0.3, 1.9, 3.0, 2.7, 6.2, 3.1, 1.9])
    line = clock_line(events(times, 14.6e-3 + 77e-6 * times + wrong, errors))
    assert line.drift.value == pytest.approx(77e-6, abs=2e-6)
    assert line.drift.low < 77e-6 < line.drift.high


@pytest.mark.parametrize("scatter", [0.0, 1e-3])
def test_the_intervals_contain_offset_and_drift_whatever_the_scatter_between_events_is(scatter):
    rng = np.random.default_rng(3)
    offsets, drifts, times = 0, 0, np.arange(8) * 30.0
    for _ in range(120):
        errors = rng.uniform(1e-4, 5e-4, 8)
        delays = 4e-3 + 50e-6 * times + rng.standard_normal(8) * np.hypot(errors, scatter)
        line = clock_line(events(times, delays, errors))
        offsets += line.offset.low <= 4e-3 + 50e-6 * line.at <= line.offset.high
        drifts += line.drift.low <= 50e-6 <= line.drift.high
    assert min(offsets, drifts) >= 104  # of 114: four standard deviations less


def test_an_event_far_from_the_others_is_left_out():
    delays = [3e-3, 3.1e-3, 2.9e-3, 90e-3, 3e-3, 3.05e-3, 2.95e-3]
    line = clock_line(events(np.arange(7.0), delays))
    assert 3 not in line.used and line.offset.value == pytest.approx(3e-3, abs=1e-4)
