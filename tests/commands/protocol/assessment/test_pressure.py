"""The pressure of one repetition: closed forms, and what holds for every pressure."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base.arrays import FloatArray
from cdtool.commands.protocol.assessment.plan import Instrument, MeasuringPoint
from cdtool.commands.protocol.assessment.pressure import PressureAssessment, PressureRecord, pressure_record
from cdtool.commands.protocol.assessment.pressure_reasons import pressure_reasons
from cdtool.commands.protocol.assessment.reasons import ProtocolVerdict
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.truth.force.limits import ForceProfile, read_force_limits

CHEST = read_force_limits()["iso_ts_15066_chest"]
TIME = np.arange(4000) * 1e-3
CONTACT = Contact(start=2.0, end=3.0, uncertainty=0.001)
POINT = MeasuringPoint(name="chest", repetitions=1)


def record(pressure: FloatArray, time: FloatArray = TIME, **more: float) -> PressureRecord | None:
    """Return the record of a pressure [N/cm2] at times [s], of a contact from 2 s to 3 s."""
    run = Recording("run", "", ("axis",), {"contact_pressure": Series(time, 1e4 * pressure, "Pa")})
    return pressure_record(run, CONTACT, **more)


def steps(first: float, later: float, rest: float = 0.0) -> FloatArray:
    """Return a pressure that is `first` for 0.4 s from the onset, then `later` for 0.6 s, above a rest."""
    inside = (TIME >= 2.0) & (TIME < 3.0)
    return rest + np.where(inside, np.where(TIME < 2.4, first, later), 0.0)


def outcome(found: PressureRecord | None, entered: float | None = None, profile: ForceProfile = CHEST) -> str:
    item = PressureAssessment.of(profile, "", found, entered)
    reasons = pressure_reasons(POINT, profile, ["1.csv"], [item], Instrument("pressure"))
    # A rectangular pulse has no shape: what may be between samples has tests of its own.
    verdict = ProtocolVerdict(tuple(reason for reason in reasons if reason.kind != "pressure_between_samples"))
    # What a repetition shows in its line is what its reasons lead to, but for a rest that decides.
    if not any(reason.kind == "pressure_rest_decides" for reason in verdict.reasons):
        assert {"not_assessable": "incomplete"}.get(item.outcome, item.outcome) == verdict.outcome
    return verdict.outcome


def test_peak_late_peak_rest_and_rate_are_those_of_the_closed_form():
    found = record(steps(200.0, 90.0, rest=3.0))
    assert found is not None and found.rises
    assert (found.peak, found.peak_from(0.5), found.rest) == pytest.approx((200.0, 90.0, 3.0))
    assert (found.largest_reading, found.sample_rate) == pytest.approx((203.0, 1000.0))
    assert math.isnan(found.peak_from(9.0))


@given(first=st.floats(1.0, 400.0), later=st.floats(0.0, 400.0), rest=st.floats(-20.0, 20.0))
def test_it_passes_only_below_both_limits_and_fails_only_above_one(first, later, rest):
    found = outcome(record(steps(first, later, rest)))
    early = max(first, later)  # the second level begins before 0.5 s
    if early > 240.01 or later > 120.01:
        assert found == "fail"
    elif early < 239.9 - max(rest, 0.0) and later < 119.9 - max(rest, 0.0):
        assert found == "pass"
    else:
        assert found != "fail" or early > 239.99 or later > 119.99


@given(entered=st.floats(0.0, 500.0))
def test_an_entered_peak_alone_passes_only_up_to_the_quasi_static_limit(entered):
    wanted = "fail" if entered > 240.0 else "pass" if 0.0 < entered <= 120.0 else "incomplete"
    assert outcome(None, entered) == wanted


@given(first=st.floats(1.0, 400.0), entered=st.floats(0.0, 400.0))
def test_a_second_measurement_never_makes_it_better(first, entered):
    order = ("fail", "incomplete", "pass")
    alone, both = outcome(record(steps(first, 0.0))), outcome(record(steps(first, 0.0)), entered)
    assert order.index(both) <= order.index(alone)
    if entered > 240.0:
        assert both == "fail"


def between_samples(pulse: FloatArray, time: FloatArray) -> list[float]:
    """Return, of the steps that pass with what was read, how much the pressure may have been between samples."""
    item = PressureAssessment.of(CHEST, "", record(pulse, time), None)
    found = pressure_reasons(POINT, CHEST, ["1.csv"], [item], Instrument("pressure"))
    return [float(reason.values["most"]) for reason in found if reason.kind == "pressure_between_samples"]


@given(rate=st.floats(15.0, 200.0), phase=st.floats(0.0, 1.0), peak=st.floats(245.0, 400.0))
def test_a_slow_sensor_never_hides_a_peak_above_the_limit(rate, phase, peak):
    time = (np.arange(0.0, 4.0 * rate) + phase) / rate
    pulse = np.where((time >= 2.0) & (time <= 2.3), peak * np.sin(np.pi * (time - 2.0) / 0.3), 0.0)
    if pulse.max() <= 240.0:
        assert between_samples(pulse, time)[0] > 240.0


def test_a_record_that_ends_before_the_contact_does_is_not_a_pass():
    cut = TIME < 2.7
    found = record(steps(100.0, 90.0)[cut], TIME[cut])
    assert found is not None and outcome(found) == "pass"  # the log ends there, too: its last step is what it recorded
    run = Recording(
        "run",
        "",
        ("axis",),
        {
            "contact_pressure": Series(TIME[cut], 1e4 * steps(100.0, 90.0)[cut], "Pa"),
            "force": Series(TIME, steps(100.0, 90.0), "N"),
        },
    )
    assert outcome(pressure_record(run, CONTACT)) == "incomplete"
