"""One measurement that was exported twice is recognised; two measurements of a stiff, repeatable machine never are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base.arrays import FloatArray
from cdtool.commands.protocol.assessment.same_measurement import hold_same_measurement
from cdtool.truth.force.curve import ForceTimeCurve


def curve(time: FloatArray, force: FloatArray) -> ForceTimeCurve:
    return ForceTimeCurve(time, force, np.zeros(len(time), dtype=bool), end=float(time[-1]))


def push(time: FloatArray, peak: float = 380.0, rise: float = 0.02, steady: float = 80.0) -> FloatArray:
    """Return an impact that rings and becomes a steady push until 3 s [N]."""
    since = np.maximum(time, 0.0)
    impact = peak * np.sin(np.pi * since / (2.0 * rise)) * (since < 2.0 * rise)
    held = steady * (1.0 - np.exp(-since / 0.03)) * (1.0 + 0.2 * np.exp(-since / 0.2) * np.cos(180.0 * since))
    return (np.maximum(impact, 0.0) + held * (since >= rise)) * ((time >= 0.0) & (time < 3.0))


def measured(
    seed: int, *, rate: float = 1000.0, noise: float = 0.3, cell: float = 0.01, seconds: float = 5.0
) -> ForceTimeCurve:
    """Return a new measurement of one push: noise, and where the samples fall, are new."""
    random = np.random.default_rng(seed)
    time = np.arange(round(seconds * rate)) / rate
    force = push(time + random.uniform(0.0, 1.0 / rate)) + random.normal(0.0, noise, len(time))
    return curve(time, cell * np.round(force / cell))


def rounded(one: ForceTimeCurve, cell: float, rest: float = 0.0) -> ForceTimeCurve:
    return curve(one.time, cell * np.round((one.force + rest) / cell) - rest)


def at_rate(one: ForceTimeCurve, rate: float, cell: float = 0.01) -> ForceTimeCurve:
    time = np.arange(one.time[0] + 2e-3, one.time[-1], 1.0 / rate)
    force = np.interp(time, one.time, one.force)
    return curve(time - time[0], cell * np.round(force / cell))


def averaged(one: ForceTimeCurve, count: int) -> ForceTimeCurve:
    whole = len(one.time) // count * count
    return curve(*(values[:whole].reshape(-1, count).mean(axis=1) for values in (one.time, one.force)))


ORIGINAL = measured(1)
AGAIN = {
    "another number format": rounded(ORIGINAL, 0.1),
    "whole newtons": rounded(ORIGINAL, 1.0, rest=0.37),
    "another level at rest": curve(ORIGINAL.time, ORIGINAL.force + 0.8),
    "samples cut": curve(ORIGINAL.time[:3000], ORIGINAL.force[:3000]),
    "the onset 7 samples later": curve(ORIGINAL.time[7:] - ORIGINAL.time[7], ORIGINAL.force[7:]),
    "times rounded by the logger": curve(ORIGINAL.time + 4e-4 * np.sin(np.arange(5000.0)), ORIGINAL.force),
    "every second sample": curve(ORIGINAL.time[1::2] - ORIGINAL.time[1], ORIGINAL.force[1::2]),
    "every fifth sample": curve(ORIGINAL.time[3::5] - ORIGINAL.time[3], ORIGINAL.force[3::5]),
    "interpolated to 700 Hz": at_rate(ORIGINAL, 700.0),
    "interpolated to 1300 Hz": at_rate(ORIGINAL, 1300.0),
    "interpolated to 250 Hz, whole newtons": at_rate(ORIGINAL, 250.0, cell=1.0),
    "averaged in twos": averaged(ORIGINAL, 2),
    "averaged in fives": averaged(ORIGINAL, 5),
    "each reading twice": curve(np.arange(10000) * 5e-4, np.repeat(ORIGINAL.force, 2)),
}


@pytest.mark.parametrize("name", AGAIN)
def test_an_export_of_the_same_measurement_is_recognised(name):
    assert hold_same_measurement(ORIGINAL, AGAIN[name])
    assert hold_same_measurement(AGAIN[name], ORIGINAL)


# A cell of 12 bit and 5000 N reads in steps of 1.22 N.
CELL = 5000.0 / 4096


@given(
    st.integers(0, 10**6),
    st.sampled_from([200.0, 1000.0, 5000.0]),
    st.sampled_from([0.001, 0.1, CELL, 10.0]),
    st.floats(0.29, 3.0),
)
def test_two_measurements_with_noise_of_the_resolution_never_match(seed, rate, cell, noise):
    one, two = (measured(number, rate=rate, cell=cell, noise=noise * cell) for number in (seed, seed + 1))
    assert not hold_same_measurement(one, two)


@given(st.integers(0, 10**6), st.sampled_from([200.0, 1000.0]), st.sampled_from([1.0, CELL, 5.0]))
def test_two_tests_of_a_machine_that_repeats_within_a_percent_never_match_on_a_quiet_coarse_cell(seed, rate, cell):
    random = np.random.default_rng(seed)
    one, two = (measured(number, rate=rate, cell=0.001, noise=0.1) for number in (seed, seed + 1))
    weaker = curve(one.time, one.force * (0.99 - 0.01 * random.random()))
    assert not hold_same_measurement(rounded(weaker, cell), rounded(two, cell))


@given(st.integers(0, 10**6), st.floats(0.05, 2.0), st.sampled_from([500.0, 700.0, 2000.0]))
def test_two_measurements_of_two_loggers_never_match(seed, noise, rate):
    other = measured(seed + 1, noise=noise, rate=rate)
    assert not hold_same_measurement(measured(seed, noise=noise), other)
    assert not hold_same_measurement(measured(seed, noise=noise), rounded(averaged(other, 2), 0.1))


@given(st.integers(0, 10**6))
def test_hum_and_ringing_of_one_machine_do_not_make_two_measurements_one(seed):
    def with_hum(number: int) -> ForceTimeCurve:
        made = measured(number)
        phase = np.random.default_rng(number).uniform(0.0, 6.28)
        return curve(made.time, made.force + 2.0 * np.sin(314.16 * made.time + phase))

    assert not hold_same_measurement(with_hum(seed), with_hum(seed + 1))


@pytest.mark.parametrize(("cell", "noise"), [(CELL, 0.1), (10.0, 0.5)])
def test_a_cell_that_is_coarser_than_its_noise_still_tells_two_pushes_apart(cell, noise):
    found = [
        hold_same_measurement(measured(seed, cell=cell, noise=noise), measured(seed + 1000, cell=cell, noise=noise))
        for seed in range(20)
    ]
    assert not any(found)
