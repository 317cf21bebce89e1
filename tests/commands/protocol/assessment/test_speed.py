"""The speed just before a contact: closed forms, clocks of its own, and what it must not use."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.commands.protocol.assessment.assessment import speed_reasons
from cdtool.commands.protocol.assessment.plan import MeasuringPoint
from cdtool.commands.protocol.assessment.speed import speed_before
from cdtool.recordings.clock import differentiate
from cdtool.recordings.recording import Contact, Recording, Series

CONTACT = Contact(start=2.0, end=2.5, uncertainty=0.0)


def measured(time: FloatArray, speed: FloatArray, unit: str = "m/s", contact: Contact = CONTACT) -> float | None:
    count = speed.shape[1] if speed.ndim > 1 else 1
    joints = tuple(str(number) for number in range(count))
    return speed_before(Recording("run", "", joints, {"speed": Series(time, speed, unit)}), contact)


@given(
    speed=st.floats(-1.0, 1.0),
    deceleration=st.floats(-2.0, 2.0),
    rate=st.sampled_from([20.0, 100.0, 1000.0]),
    seed=st.integers(0, 9),
)
def test_a_constant_deceleration_is_exact_on_any_jittered_clock(speed, deceleration, rate, seed):
    jitter = np.random.default_rng(seed).uniform(0.0, 0.4 / rate, round(3.0 * rate))
    time = np.arange(round(3.0 * rate)) / rate + jitter
    found = measured(time, np.where(time < 2.0, speed - deceleration * (time - 2.0), 7.0))
    assert found == pytest.approx(abs(speed), abs=1e-6)


@given(
    seed=st.integers(0, 10**6),
    hold=st.sampled_from([0.01, 0.02, 0.025]),
    deceleration=st.sampled_from([0.0, 0.5, 1.0]),
    cell=st.sampled_from([1e-4, 5e-4, 1e-3]),
)
def test_a_position_that_the_log_repeats_has_the_speed_of_its_readings(seed, hold, deceleration, cell):
    time = np.arange(3000) * 1e-3
    read = hold * np.floor(time / hold) - np.random.default_rng(seed).uniform(0.0, hold)
    position = cell * np.round((0.2 * (read - 2.0) - 0.5 * deceleration * (read - 2.0) ** 2) / cell)
    derived = differentiate(Series(time, position, "m"), 50.0, "m/s")
    run = Recording(
        "run",
        "",
        ("axis",),
        {"position": Series(time, position, "m"), "speed": derived},
        findings=(Finding("derived_speed", "speed", {"low_pass": 50.0}),),
    )
    # The readings are late by up to one period, and so is the deceleration.
    assert speed_before(run, CONTACT) == pytest.approx(0.2, abs=deceleration * hold + 0.02)


def test_the_fastest_axis_counts_and_a_missing_one_is_missing():
    time = np.arange(3000) * 1e-3
    two = np.column_stack([np.full(3000, 0.1), np.full(3000, -0.3)])
    assert measured(time, two) == pytest.approx(0.3)
    two[:, 1] = np.nan
    found = measured(time, two)
    assert found is not None and math.isnan(found)


@given(planned=st.floats(0.01, 2.0), share=st.floats(0.0, 2.0), percent=st.floats(0.0, 25.0))
def test_half_the_speed_is_never_as_planned(planned, share, percent):
    point = MeasuringPoint(name="edge", speed_m_per_s=planned, speed_tolerance_percent=percent)
    reasons = list(speed_reasons(point, [("1.csv", share * planned)]))
    if abs(share - 1.0) > 0.01 * percent + 1e-6:
        assert [reason.kind for reason in reasons] == ["speed_differs"]
    elif abs(share - 1.0) < 0.01 * percent - 1e-6:
        assert not reasons


def test_a_slow_log_has_older_samples_but_not_any_age():
    for rate, is_known in ((20.0, True), (10.0, True), (1.0, False)):
        time = np.arange(0.3 / rate, 4.0, 1.0 / rate)
        found = measured(time, np.full(len(time), 0.2))
        assert found is not None and math.isfinite(found) == is_known, rate
