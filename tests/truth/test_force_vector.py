"""A force with several axes: its magnitude without the rest level of each axis, and the contacts in it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.recordings.recording import Recording, Series
from cdtool.truth.force.curve import force_time_curve
from cdtool.truth.force_vector import force_magnitude, quiet_level, with_scalar_force
from cdtool.truth.missing_samples import cell_samples
from cdtool.truth.onset import OnsetRule, find_contacts

GATE = OnsetRule(above=20.0, back_to=8.0)
RULES = {"levels by hand": GATE, "levels from the noise": OnsetRule()}
REST = np.array([10.0, -5.0, 40.0])
OBLIQUE = np.array([0.6, 0.0, -0.8])


def clock(rate: float = 1000.0, jitter: float = 0.0, length: float = 8.0) -> FloatArray:
    count = int(length * rate)
    return (np.arange(count) + jitter * np.random.default_rng(0).uniform(0.0, 1.0, count)) / rate


def pulse(time: FloatArray, onset: float, length: float = 0.3, peak: float = 100.0) -> FloatArray:
    inside = (time >= onset) & (time < onset + length)
    return np.where(inside, peak * np.sin(np.pi * (time - onset) / length), 0.0)


def noise(time: FloatArray, sigma: float, axes: int = 3) -> FloatArray:
    return np.random.default_rng(1).normal(0.0, sigma, (len(time), axes))


def recording(time: FloatArray, vector: FloatArray) -> Recording:
    return Recording("r", "r", ("axis",), {"force": Series(time, vector, "N")})


@pytest.mark.parametrize("rule", RULES.values(), ids=RULES)
def test_a_vector_has_the_contacts_of_a_cell_along_it(rule):
    time = clock()
    along = pulse(time, 3.0) + pulse(time, 6.0, peak=60.0)
    single = find_contacts(recording(time, along[:, np.newaxis] + noise(time, 0.3, 1)), rule)
    found = find_contacts(recording(time, REST + np.outer(along, OBLIQUE) + noise(time, 0.3)), rule)
    assert [item.start for item in found] == pytest.approx([item.start for item in single], abs=4e-3)
    assert [item.end for item in found] == pytest.approx([item.end for item in single], abs=3e-3)
    assert [item.peak_force for item in found] == pytest.approx([100.0, 60.0], abs=1.5)
    assert all(item.rest == 0.0 and not item.in_progress for item in found)


@pytest.mark.parametrize("seed", range(4))
def test_the_mounting_of_the_sensor_does_not_matter(seed):
    time = clock(length=5.0)
    force = np.outer(pulse(time, 3.0), OBLIQUE) + noise(time, 0.3)
    rotation = stats.ortho_group.rvs(3, random_state=seed)
    (straight,), (turned,) = (find_contacts(recording(time, REST + axes), GATE) for axes in (force, force @ rotation))
    assert turned.start == pytest.approx(straight.start, abs=1.01e-3)
    assert turned.peak_force == pytest.approx(straight.peak_force, abs=0.3)


@pytest.mark.parametrize("axes", [2, 3])
def test_noise_alone_is_no_contact_although_its_magnitude_has_a_mean(axes):
    time = clock(length=60.0)
    vector = REST[:axes] + noise(time, 2.0, axes)
    magnitude = force_magnitude(Series(time, vector, "N"), OnsetRule())
    assert float(np.mean(magnitude.values)) == pytest.approx(2.0 * stats.chi(axes).mean(), rel=0.03)
    assert find_contacts(recording(time, vector), OnsetRule()) == []


@given(st.floats(0.5, 8.0), st.integers(1, 3))
def test_the_level_of_a_magnitude_is_exceeded_as_rarely_as_that_of_a_reading(sigmas, axes):
    level = quiet_level(sigmas, axes)
    assert stats.chi(axes).sf(level) == pytest.approx(2.0 * stats.norm.sf(sigmas), rel=1e-6)


def test_a_sample_without_one_axis_is_missing():
    time = clock()
    vector = REST + np.outer(pulse(time, 3.0), OBLIQUE)
    vector[3050:3150, 1] = np.nan
    (found,) = find_contacts(recording(time, vector), GATE)
    reduced = with_scalar_force(recording(time, vector), GATE)
    assert np.flatnonzero(np.isnan(reduced["force"].values[:, 0])).tolist() == list(range(3050, 3150))
    curve = force_time_curve(reduced, found)
    assert curve.longest_hole() == pytest.approx(0.101, abs=2e-3)


def test_an_axis_at_its_stop_is_seen_although_the_magnitude_changes():
    time = clock()
    force = np.outer(pulse(time, 3.0, peak=300.0), [0.6, 0.5, -0.6245]) + noise(time, 0.3)
    stopped = force.copy()
    stopped[:, 2] = np.maximum(stopped[:, 2], -150.0)
    curves = []
    for vector in (force, stopped):
        reduced = with_scalar_force(recording(time, REST + vector), GATE)
        curves.append(force_time_curve(reduced, find_contacts(reduced, GATE)[0]))
    assert [curve.saturated for curve in curves] == [False, True]
    assert curves[1].time[curves[1].at_stop].min() == pytest.approx(0.09, abs=0.03)


def test_a_vector_is_never_mistaken_for_its_first_axis():
    with pytest.raises(RecordingError, match="3 axes"):
        cell_samples(Series(np.arange(4.0), np.zeros((4, 3)), "N"))


def test_a_magnitude_is_equal_to_itself_and_hashable_as_every_channel():
    magnitude = force_magnitude(Series(np.arange(100.0), np.ones((100, 3)), "N"), OnsetRule())
    assert magnitude == magnitude and isinstance(hash(magnitude), int)


@pytest.mark.parametrize("rule", RULES.values(), ids=RULES)
def test_each_axis_may_drift_by_itself(rule):
    time = clock()
    drift = np.outer(time, [3.0, -3.0, 1.0])
    still = find_contacts(recording(time, REST + np.outer(pulse(time, 6.0), OBLIQUE) + noise(time, 0.3)), rule)
    found = find_contacts(recording(time, REST + drift + np.outer(pulse(time, 6.0), OBLIQUE) + noise(time, 0.3)), rule)
    assert [item.start for item in found] == pytest.approx([item.start for item in still], abs=2.01e-3)
    assert found[0].shift == pytest.approx(6.0 * math.hypot(3.0, 3.0, 1.0), abs=1.0)
    assert found[0].peak_force == pytest.approx(100.0, abs=1.5)
