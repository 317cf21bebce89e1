"""The force of a contact over time, compared with closed forms.

A rigid leaf of 620 kg that hits a spring of 500 N/mm at 0.2 m/s exerts a half sine F = v sqrt(k m) sin(w t).
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError, UsageError
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.truth.force.curve import force_at, force_time_curve

MASS, STIFFNESS, SPEED, ONSET = 620.0, 500e3, 0.2, 2.0
RATE = float(np.sqrt(STIFFNESS / MASS))
PEAK = SPEED * float(np.sqrt(STIFFNESS * MASS))
TIME = np.arange(8000) * 1e-3
CONTACT = Contact(ONSET, ONSET + np.pi / RATE, 5e-4)


def half_sine(time: FloatArray) -> FloatArray:
    return np.where((time >= ONSET) & (time <= ONSET + np.pi / RATE), PEAK * np.sin(RATE * (time - ONSET)), 0.0)


def recording(force: FloatArray, **channels: Series) -> Recording:
    return Recording("run", "run.csv", ("gate",), {"force": Series(TIME, force, "N"), **channels})


def moving(direction: float = 1.0, clock: FloatArray = TIME) -> dict[str, Series]:
    """Speed and acceleration of the leaf, before and during the contact, on a separate clock."""
    speed = np.where(clock < ONSET, SPEED, np.where(clock < CONTACT.end, SPEED * np.cos(RATE * (clock - ONSET)), 0.0))
    acceleration = -half_sine(clock) / MASS
    return {
        "speed": Series(clock, direction * speed, "m/s"),
        "acceleration": Series(clock, direction * acceleration, "m/s2"),
    }


def missing_share(curve):
    """Return the share of the time from the onset to the record's end in which samples are missing."""
    begins, ends = curve.holes()
    return float(np.sum(ends - begins)) / curve.end


def test_the_force_curve_of_a_rigid_leaf_is_a_half_sine_of_known_peak():
    curve = force_time_curve(recording(half_sine(TIME)), CONTACT)
    assert curve.peak == pytest.approx(3521.0, abs=1.0)
    assert curve.time[0] == 0.0
    assert curve.end == pytest.approx(TIME[-1] - ONSET)
    np.testing.assert_allclose(curve.force, half_sine(curve.time + ONSET), atol=1e-9)
    assert not curve.saturated
    assert missing_share(curve) == 0.0


@given(st.floats(-500.0, 500.0), st.sampled_from([-1.0, 1.0]))
@settings(deadline=None, max_examples=20)
def test_offset_and_sign_of_the_cell_do_not_change_the_curve(offset, sign):
    curve = force_time_curve(recording(offset + sign * half_sine(TIME)), CONTACT)
    np.testing.assert_allclose(curve.force, half_sine(curve.time + ONSET), atol=1e-6)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_inertia_before_the_cell_is_given_back(direction, sign):
    mass = 60.0
    clock = np.arange(0.0, 8.0, 0.7e-3) + 0.21e-3  # the accelerometer has its own clock
    cell = half_sine(TIME) * (1.0 - mass / MASS)  # the contact force minus M times the deceleration
    part = recording(sign * cell, **moving(direction, clock))
    assert force_time_curve(part, CONTACT).peak == pytest.approx(PEAK * (1.0 - mass / MASS), rel=1e-3)
    curve = force_time_curve(part, CONTACT, mass)
    np.testing.assert_allclose(curve.force, half_sine(curve.time + ONSET), atol=1.5)


def test_a_mass_without_the_required_channel_is_an_error_that_names_it():
    force = half_sine(TIME)
    with pytest.raises(RecordingError, match="'acceleration'"):
        force_time_curve(recording(force), CONTACT, 5.0)
    only = {"acceleration": moving()["acceleration"]}
    with pytest.raises(RecordingError, match="'speed'"):
        force_time_curve(recording(force, **only), CONTACT, 5.0)
    turning = moving() | {"acceleration": Series(TIME, TIME, "rad/s2")}
    with pytest.raises(RecordingError, match="not in rad/s2"):
        force_time_curve(recording(force, **turning), CONTACT, 5.0)
    resting = moving() | {"speed": Series(TIME, np.where(TIME > 4.0, SPEED, 0.0), "m/s")}
    with pytest.raises(RecordingError, match="is at rest"):
        force_time_curve(recording(force, **resting), CONTACT, 5.0)
    silent = moving() | {"acceleration": Series(TIME, np.full(len(TIME), np.nan), "m/s2")}
    with pytest.raises(RecordingError, match="no acceleration"):
        force_time_curve(recording(force, **silent), CONTACT, 5.0)
    for wrong in (-1.0, float("nan")):
        with pytest.raises(UsageError, match="mass_before_cell"):
            force_time_curve(recording(force), CONTACT, wrong)


def test_missing_samples_are_left_out_and_counted():
    force = half_sine(TIME)
    force[3000:3600] = np.nan
    curve = force_time_curve(recording(force), CONTACT)
    assert np.isfinite(curve.force).all()
    (begins,), (ends,) = curve.holes()
    assert (begins, ends) == (pytest.approx(0.999), pytest.approx(1.6))
    assert missing_share(curve) == pytest.approx(0.601 / curve.end)


def test_a_few_lost_samples_and_a_slow_sample_rate_are_not_a_hole():
    force = half_sine(TIME)
    force[3000:3004] = np.nan
    assert missing_share(force_time_curve(recording(force), CONTACT)) == 0.0
    slow = np.full(len(TIME), np.nan)
    slow[::10] = half_sine(TIME)[::10]
    curve = force_time_curve(recording(slow), CONTACT)
    assert missing_share(curve) == pytest.approx(0.0, abs=2e-3)
    assert len(curve.time) == 600


def test_a_cell_at_its_stop_is_marked_there_and_nowhere_else():
    curve = force_time_curve(recording(np.minimum(half_sine(TIME), 2000.0)), CONTACT)
    assert curve.saturated
    np.testing.assert_array_equal(curve.at_stop, half_sine(curve.time + ONSET) >= 2000.0)
    negative = force_time_curve(recording(7.0 - np.minimum(half_sine(TIME), 2000.0)), CONTACT)
    np.testing.assert_array_equal(negative.at_stop, curve.at_stop)


def test_four_equal_readings_or_repeated_readings_are_not_a_stop():
    few = half_sine(TIME)
    top = int(np.argmax(few))
    few[top - 1 : top + 3] = few[top]
    assert not force_time_curve(recording(few), CONTACT).saturated
    few[top + 3] = few[top]
    assert force_time_curve(recording(few), CONTACT).saturated
    held = np.repeat(half_sine(TIME)[::10], 10)
    assert not force_time_curve(recording(held), CONTACT).saturated


@pytest.mark.parametrize("peak", [300.0, 300.3, 300.49, 300.51, 300.8])
def test_the_top_of_a_smooth_peak_in_whole_newtons_is_not_a_stop_but_a_stop_in_whole_newtons_is(peak):
    random = np.random.default_rng(1)
    since = np.maximum(TIME - ONSET, 0.0)
    push = peak * np.sin(np.minimum(since / 0.3, 1.0) * np.pi) + random.normal(0.0, 0.03, len(TIME))
    contact = Contact(ONSET, ONSET + 0.3, 5e-4)
    assert not force_time_curve(recording(np.round(push)), contact).saturated
    assert force_time_curve(recording(np.round(np.minimum(push, 280.0))), contact).saturated


def test_the_curve_ends_at_the_next_contact():
    twice = half_sine(TIME) + half_sine(TIME - 3.0) * 2.0
    curve = force_time_curve(recording(twice), CONTACT, until=5.0)
    assert curve.peak == pytest.approx(PEAK, rel=1e-3)
    assert curve.end == pytest.approx(3.0)
    assert curve.time[-1] < 3.0


def test_the_force_at_an_alarm_is_that_of_the_last_sample_before_it():
    force = half_sine(TIME)
    force[3000:3600] = np.nan
    curve = force_time_curve(recording(force), CONTACT)
    assert force_at(curve, 0.0149) == curve.force[14]
    assert force_at(curve, 0.0) == curve.force[0]
    assert np.isnan(force_at(curve, -0.001))
    assert np.isnan(force_at(curve, 1.3))
    assert np.isnan(force_at(curve, 99.0))
