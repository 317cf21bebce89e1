"""The low-pass with its rate and the local cubic against scipy's filters and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import bilinear, butter, lfilter, lfilter_zi

from cdtool.base.arrays import FloatArray
from cdtool.detectors.desired_dynamics import DesiredDynamics
from cdtool.detectors.detection import Status
from cdtool.detectors.direct import Direct
from cdtool.detectors.filters import longest_gap, low_pass, polynomial_rates, settling_time, started_at
from cdtool.recordings.recording import Recording, Series
from tests.synthetic.machines import machine_of

TIME = np.arange(4000) * 1e-3
NONE = np.zeros((len(TIME), 1), dtype=bool)
UNIT_MASS = machine_of({"coordinates": "load", "load_mass": 1.0})


def jittered(count: int = 4000, seed: int = 0) -> FloatArray:
    return np.cumsum(np.random.default_rng(seed).uniform(0.4e-3, 1.6e-3, count))


def filtered_by_scipy(values: FloatArray, cutoff: float) -> tuple[FloatArray, FloatArray]:
    """The same low-pass and s times it, prewarped, at 1 kHz, both at rest at the first value."""
    warped = 2000.0 * np.tan(np.pi * cutoff * 1e-3)
    below = [1.0, np.sqrt(2.0) * warped, warped**2]
    sections = butter(2, cutoff, fs=1000.0), bilinear([warped**2, 0.0], below, 1000.0)
    filtered, rate = (lfilter(b, a, values, zi=lfilter_zi(b, a) * values[0])[0] for b, a in sections)
    return filtered, rate


@pytest.mark.parametrize("cutoff", [1.0, 5.0, 15.0, 120.0])
def test_at_uniform_steps_it_is_scipys_butterworth_filter_and_its_band_pass(cutoff):
    values = np.random.default_rng(1).normal(size=len(TIME)) + 3.0
    found = low_pass(TIME, values[:, np.newaxis], NONE, cutoff)
    for one, other in zip(found, filtered_by_scipy(values, cutoff), strict=True):
        np.testing.assert_allclose(one[:, 0], other, rtol=0.0, atol=1e-9 * np.abs(other).max())


@pytest.mark.parametrize(("time", "allowed"), [(TIME, 1e-12), (jittered(), 1e-4)])
def test_of_a_ramp_the_rate_becomes_its_slope_exactly_at_uniform_steps(time, allowed):
    """Prewarping makes the cut-off depend a little on the step: with a jittering clock the rate is not quite steady."""
    filtered, rate = low_pass(time, (2.5 * time)[:, np.newaxis], NONE, 5.0)
    late = time > 3.0
    np.testing.assert_allclose(rate[late], 2.5, rtol=allowed)
    # The filtered ramp lags by sqrt(2) / w; w is prewarped, a little above 2 pi 5.
    lag = time[late] - filtered[late, 0] / 2.5
    np.testing.assert_allclose(lag, np.sqrt(2.0) / (2.0 * np.pi * 5.0), rtol=2e-3)


@pytest.mark.parametrize("time", [TIME, jittered()])
def test_the_rate_is_the_slope_of_the_filtered_values(time):
    values = np.sin(20.0 * time) + np.cos(3.0 * time)
    filtered, rate = low_pass(time, values[:, np.newaxis], NONE, 8.0)
    mean = 0.5 * (rate[1:, 0] + rate[:-1, 0])
    np.testing.assert_allclose(np.diff(filtered[:, 0]) / np.diff(time), mean, atol=1e-9)


def test_a_missing_sample_makes_the_next_step_longer_and_a_long_gap_restarts_it():
    values = np.sin(2.0 * TIME)[:, np.newaxis]
    lone, gap = NONE.copy(), NONE.copy()
    lone[1000:1010] = True
    gap[1000 : 1000 + round(longest_gap(5.0) * 1e3) + 1] = True
    full, _ = low_pass(TIME, values, NONE, 5.0)
    short, rate = low_pass(TIME, np.where(lone, np.nan, values), lone, 5.0)
    assert (short[1000:1010] == short[999]).all() and (rate[1000:1010] == rate[999]).all()
    np.testing.assert_allclose(short[1010:], full[1010:], atol=1e-4)
    anew, rate = low_pass(TIME, np.where(gap, np.nan, values), gap, 5.0)
    first = int(np.flatnonzero(gap)[-1]) + 1
    assert anew[first] == values[first] and rate[first] == 0.0
    since = started_at(TIME, gap, longest_gap(5.0))
    assert since[first - 1, 0] == TIME[0] and since[first, 0] == TIME[first]
    assert started_at(TIME, lone, longest_gap(5.0))[-1, 0] == TIME[0]


def test_it_has_settled_to_five_percent_after_its_settling_time():
    step = np.where(TIME >= 1.0, 1.0, 0.0)[:, np.newaxis]
    filtered, _ = low_pass(TIME, step, NONE, 5.0)
    error, since = np.abs(filtered[:, 0] - 1.0), TIME - 1.0
    assert np.max(error[since >= settling_time(5.0)]) < 0.05
    assert error[since < 0.5 * settling_time(5.0)][-1] > 0.1


def test_direct_derivation_is_the_filtered_force_less_mass_times_the_filters_own_rate_of_the_speed():
    rng = np.random.default_rng(2)
    force, speed = rng.normal(size=len(TIME)), np.cumsum(rng.normal(size=len(TIME))) * 1e-2
    channels = {"torque": Series(TIME, force, "N"), "speed": Series(TIME, speed, "m/s")}
    found = Direct(5.0).signal(Recording("r", "r", ("axis",), channels), UNIT_MASS).values[:, 0]
    expected = filtered_by_scipy(force, 5.0)[0] - filtered_by_scipy(speed, 5.0)[1]
    np.testing.assert_allclose(found, expected, atol=1e-9)


CUBIC = np.polynomial.Polynomial([0.7, -1.3, 2.0, 0.9])


@pytest.mark.parametrize("time", [TIME[:500], jittered(500), 1000.0 + TIME[:500]])
def test_the_rates_of_a_cubic_are_exact_for_any_sampling(time):
    local = time - time[0]
    first, second = polynomial_rates(time, CUBIC(local)[:, np.newaxis], 21)
    assert np.isnan(first[:4]).all() and np.isnan(second[:4]).all()
    np.testing.assert_allclose(first[20:, 0], CUBIC.deriv()(local[20:]), rtol=1e-7)
    np.testing.assert_allclose(second[20:, 0], CUBIC.deriv(2)(local[20:]), rtol=1e-5)


def test_the_rates_are_those_of_the_newest_end_of_savitzky_and_golays_filter():
    values = np.random.default_rng(3).normal(size=60)
    first, second = polynomial_rates(TIME[:60], values[:, np.newaxis], 21)
    window = np.polynomial.Polynomial.fit(TIME[39:60] - TIME[59], values[39:60], 3).convert()
    assert first[59, 0] == pytest.approx(window.deriv()(0.0), rel=1e-8)
    assert second[59, 0] == pytest.approx(window.deriv(2)(0.0), rel=1e-8)


def test_a_reference_that_the_axis_does_not_follow_makes_the_method_not_applicable_there():
    reference = 0.1 * TIME
    position = np.where((TIME > 2.0) & (TIME < 3.0), reference - 0.06, reference - 0.01)
    channels = {
        "torque": Series(TIME, np.zeros(len(TIME)), "N"),
        "position": Series(TIME, position, "m"),
        "reference_position": Series(TIME, reference, "m"),
    }
    signal = DesiredDynamics(tracking_limit=0.05).signal(Recording("r", "r", ("axis",), channels), UNIT_MASS)
    lost = (TIME > 2.0) & (TIME < 3.0)
    assert (signal.status[lost] == Status.NOT_APPLICABLE).all()
    assert signal.valid[~lost & (TIME > 0.5)].all()
    rms = np.sqrt((3.0 * 0.01**2 + 1.0 * 0.06**2) / 4.0)
    assert signal.notes == (f"tracking error of axis: rms {rms:.3g} m, largest 0.06 m",)
