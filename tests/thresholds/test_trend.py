"""The trend of a signal, limits on it, and limits on the value that depend on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.detectors.detection import Status
from cdtool.thresholds.first_order import filtered_slope, low_passed
from cdtool.thresholds.limit import Limit
from cdtool.thresholds.trend import Trend
from tests.thresholds.strokes import STILL, TIME, N, jittering_clock, signal


def test_a_ramp_gives_its_slope_after_the_closed_form_on_any_clock():
    time = jittering_clock(N, 0.8)
    trend = Trend(time_constant=0.02).statistic(signal(30.0 * time, time), 1e-3)
    np.testing.assert_allclose(trend.values[:, 0], 30.0 * (1.0 - np.exp(-time / 0.02)), atol=1e-9)
    assert trend.unit == "N/s"
    assert (trend.status[time < 0.06] == Status.START_UP).all() and trend.valid[time > 0.0601].all()


def test_it_is_the_signal_less_its_low_pass_over_the_time_constant():
    time = jittering_clock(N, 0.5)
    step = np.concatenate(([np.inf], np.diff(time)))
    values = np.sin(30.0 * time)
    gain, phase = np.abs(1j * 30 / (1 + 0.6j)), np.angle(1j * 30 / (1 + 0.6j))
    slope = filtered_slope(values, step, 0.02)
    np.testing.assert_allclose(slope[500:], gain * np.sin(30.0 * time[500:] + phase), atol=0.05)
    gain, phase = np.abs(1 / (1 + 0.6j)), np.angle(1 / (1 + 0.6j))
    np.testing.assert_allclose(
        low_passed(values, step, 0.02)[500:], gain * np.sin(30.0 * time[500:] + phase), atol=1e-3
    )


def test_it_continues_over_a_short_gap_and_restarts_after_a_long_one():
    ramp = signal(30.0 * TIME)
    status = ramp.status.copy()
    status[1000:1050] = Status.GAP
    status[2000:2100] = Status.GAP
    trend = Trend().statistic(replace(ramp, status=status), 1e-3)
    assert trend.valid[1050:2000].all() and trend.values[1050:2000] == pytest.approx(30.0)
    assert trend.values[2100, 0] == 0.0 and (trend.status[2100:2160] == Status.START_UP).all()
    assert trend.valid[2161:].all()


def test_an_interval_where_the_signal_does_not_apply_restarts_it_however_short():
    step = signal(np.where(TIME < 2.0, 0.0, 500.0))
    status = step.status.copy()
    status[1995:2000] = Status.NOT_APPLICABLE
    trend = Trend().statistic(replace(step, status=status), 1e-3)
    assert np.nanmax(trend.values) == 0.0
    assert (trend.status[2000:2060] == Status.START_UP).all()


def test_the_trend_alarms_before_the_value_does_on_a_fast_ramp_and_never_on_a_slow_one():
    rng = np.random.default_rng(0)
    # What varies from run to run is the level, as with friction.
    pairs = [(STILL, signal(100.0 + 3.0 * rng.normal() + 0.1 * rng.normal(size=N))) for _ in range(20)]
    fitted, value = Trend().fit(pairs), Limit().fit(pairs)

    def first(threshold, slope):
        pushed = signal(100.0 + slope * np.maximum(TIME - 2.0, 0.0))
        statistic, band = threshold.evaluate(STILL, pushed)
        outside = np.flatnonzero(statistic.values[:, 0] > band.upper[:, 0])
        return TIME[outside[0]] if len(outside) else np.inf

    assert first(fitted, 400.0) < first(value, 400.0) < 2.1
    assert first(fitted, 12.0) == np.inf and first(value, 12.0) < np.inf
