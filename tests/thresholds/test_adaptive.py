"""Limits that follow the references."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.detectors.detection import Status
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.adaptive import Adaptive
from tests.thresholds.strokes import TIME, N, signal, stroke


def excited(rng, gain=40.0):
    """Runs of various speeds whose signal is wide where the reference changes: |i| = 2 + gain LP{|HP{v}|}."""
    recording = stroke(speed=rng.uniform(0.1, 0.3))
    reach = Adaptive().excitation(recording, ("reference_speed",), TIME) @ (2.0, gain)
    return recording, signal(reach * rng.choice((-1.0, 1.0), N))


def test_the_gains_are_found_and_what_is_left_is_the_spread():
    rng = np.random.default_rng(0)
    pairs = [
        (r, replace(s, values=s.values + 0.1 * rng.normal(size=(N, 1)))) for r, s in (excited(rng) for _ in range(8))
    ]
    fitted = Adaptive(safety_factor=3.0).fit(pairs)
    assert fitted.gains[:, 0] == pytest.approx((2.0, 40.0), rel=0.01)
    assert fitted.spread[0] == pytest.approx(0.1, rel=0.05)
    _, band = fitted.evaluate(*pairs[0])
    assert band.upper[0, 0] == pytest.approx(2.3, abs=0.05)
    np.testing.assert_array_equal(band.lower, -band.upper)


def test_a_constant_reference_leaves_the_constant_and_a_ramp_adds_its_slope_through_both_filters():
    ramp = Recording("r", "r", ("axis",), {"reference_speed": Series(TIME, 0.5 * TIME, "m/s")})
    excitation = Adaptive(high_pass=0.1, low_pass=0.05).excitation(ramp, ("reference_speed",), TIME)
    # HP of a ramp: slope T1 (1 - exp(-t / T1)); LP of that by partial fractions.
    closed = 0.05 * (1.0 - (0.1 * np.exp(-TIME / 0.1) - 0.05 * np.exp(-TIME / 0.05)) / 0.05)
    np.testing.assert_allclose(excitation[:, 1], closed, atol=2e-5)
    still = Recording("s", "s", ("axis",), {"reference_speed": Series(TIME, np.full(N, 7.0), "m/s")})
    assert (Adaptive().excitation(still, ("reference_speed",), TIME)[:, 1] == 0.0).all()


def test_a_gain_is_never_negative():
    rng = np.random.default_rng(1)
    pairs = []
    for _ in range(4):
        recording, _ = excited(rng)
        reach = 5.0 - Adaptive().excitation(recording, ("reference_speed",), TIME)[:, 1]
        pairs.append((recording, signal(reach)))
    gains = Adaptive().fit(pairs).gains[:, 0]
    assert gains[1] == 0.0 and 4.9 < gains[0] < 5.0


def test_the_reference_torque_counts_where_every_run_has_it_and_the_measured_torque_never():
    rng = np.random.default_rng(2)

    def with_torque(pair):
        torque = Series(TIME, np.cumsum(rng.normal(size=N)), "N")
        channels = {**pair[0].channels, "reference_torque": torque, "torque": torque}
        return replace(pair[0], channels=channels), pair[1]

    pairs = [excited(rng) for _ in range(3)]
    assert Adaptive().fit([with_torque(pair) for pair in pairs]).inputs == ("reference_speed", "reference_torque")
    assert Adaptive().fit([with_torque(pairs[0]), *pairs[1:]]).inputs == ("reference_speed",)


def test_without_a_reference_it_says_so():
    recording = Recording("bare", "bare", ("axis",), {"speed": Series(TIME, TIME, "m/s")})
    with pytest.raises(RecordingError, match="reference_speed"):
        Adaptive().fit([(recording, signal(np.zeros(N)))] * 2)


def test_a_reference_that_stops_leaves_no_limit_and_one_with_holes_is_held():
    rng = np.random.default_rng(4)
    fitted = Adaptive().fit([excited(rng) for _ in range(4)])
    recording = stroke()
    values = recording["reference_speed"].values.copy()
    values[2000:2003], values[3000:] = np.nan, np.nan
    holed = {**recording.channels, "reference_speed": Series(TIME, values, "m/s")}
    statistic, band = fitted.evaluate(replace(recording, channels=holed), signal(np.zeros(N)))
    assert statistic.valid[:3000].all() and not statistic.valid[3010:].any()
    assert np.isfinite(band.upper[:3000]).all()
    none = {**recording.channels, "reference_speed": Series(TIME, np.full(N, np.nan), "m/s")}
    statistic, _ = fitted.evaluate(replace(recording, channels=none), signal(np.zeros(N)))
    assert (statistic.status == Status.NO_LIMIT).all()
