"""Missing load-cell samples at the beginning of or during a contact: no unmeasured latency or force is reported."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.detectors.detection import Alarm, Signal, Status, Verdict
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.truth.doubts import truth_findings
from cdtool.truth.force.curve import force_time_curve
from cdtool.truth.force.limits import ForceProfile, ForceStep
from cdtool.truth.force.verdict import assess_force
from cdtool.truth.matching import match
from cdtool.truth.onset import OnsetRule, find_contacts
from tests.base.findings.facts import fact_of

RULE = OnsetRule(above=20.0, back_to=8.0)
TIME = np.arange(9000) * 1e-3
ONSET, PEAK, LASTS = 5.0, 3627.0, 0.19
PROFILE = ForceProfile("p", "p", "own", True, (ForceStep(0.0, 2500.0, "dynamic"), ForceStep(0.75, 150.0, "static")))
LENIENT = ForceProfile("q", "q", "own", True, (ForceStep(0.0, 9000.0, "dynamic"), ForceStep(0.75, 150.0, "static")))


def bump(time: FloatArray, peak: float = PEAK, begins: float = ONSET) -> FloatArray:
    """A half sine of 190 ms on a noisy cell."""
    inside = (time >= begins) & (time <= begins + LASTS)
    noise = np.random.default_rng(4).normal(0.0, 1.0, len(time))
    return noise + np.where(inside, peak * np.sin(np.pi * (time - begins) / LASTS), 0.0)


def recording(force: FloatArray, begin: float, end: float, own_clock: bool) -> Recording:
    """One log whose load cell has no samples from `begin` to `end` [s]: NaN, or none on a clock of its own."""
    lost = (begin <= TIME) & (end > TIME)
    cell = Series(TIME[~lost], force[~lost], "N") if own_clock else Series(TIME, np.where(lost, np.nan, force), "N")
    return Recording("a", "a.csv", ("x",), {"force": cell, "speed": Series(TIME, TIME * 0.0, "m/s")})


def matched(contacts: list[Contact], alarm: float) -> tuple:
    status = np.full((len(TIME), 1), Status.VALID, dtype=np.uint8)
    signal = Signal(TIME, np.zeros((len(TIME), 1)), status, "1", joints=("x",))
    alarms = (Alarm(alarm, "axis", "above", 1.0, 0.5),)
    return match(Verdict("alarm", alarms, crossings=alarms), contacts, signal).matches


@pytest.mark.parametrize("own_clock", [False, True])
@pytest.mark.parametrize("begin, end", [(-0.003, 0.138), (-0.05, 0.05), (0.0, 0.186), (-0.4, 0.02)])
def test_a_hole_over_the_onset_is_in_its_uncertainty_and_marked(begin, end, own_clock):
    (contact,) = find_contacts(recording(bump(TIME), ONSET + begin, ONSET + end, own_clock), RULE)
    assert contact.hole == pytest.approx(end - begin, abs=2e-3)
    assert contact.start - contact.uncertainty <= ONSET + 2e-3 <= contact.start + 2e-3
    assert contact.resolution >= contact.hole


@pytest.mark.parametrize("own_clock", [False, True])
def test_a_rebound_after_a_hole_over_the_first_touch_is_not_the_onset(own_clock):
    force = bump(TIME) + np.where(TIME > ONSET + 0.3, bump(TIME, 400.0, ONSET + 0.4), 0.0)
    (contact,) = find_contacts(recording(force, ONSET - 0.02, ONSET + 0.22, own_clock), RULE)
    assert contact.start == pytest.approx(ONSET + 0.4, abs=5e-3)
    assert contact.hole == pytest.approx(0.24, abs=2e-3)
    assert contact.start - contact.uncertainty <= ONSET
    # A hole too short for a contact of this kind does not affect the onset.
    (whole,) = find_contacts(recording(bump(TIME), ONSET - 0.4, ONSET - 0.38, own_clock), RULE)
    assert whole.hole == 0.0 and whole.uncertainty < 2e-3


def test_a_slow_cell_with_jitter_and_a_lost_sample_is_assessable_unless_near_the_limit():
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 9.0, 1 / 60)
    time = time + rng.uniform(-0.2, 0.2, len(time)) / 60
    force = bump(time)
    keep = np.ones(len(time), dtype=bool)
    keep[np.searchsorted(time, ONSET + 0.095)] = False
    one = Recording("a", "a.csv", ("x",), {"force": Series(time[keep], force[keep], "N")})
    (contact,) = find_contacts(one, RULE)
    curve = force_time_curve(one, contact)
    assert contact.hole == 0.0
    assert assess_force(curve, LENIENT).outcome == "pass"
    near = ForceProfile("n", "n", "own", True, (ForceStep(0.0, curve.peak + 10.0, "dynamic"),))
    verdict = assess_force(curve, near)
    assert verdict.outcome == "not_assessable" and "may have reached" in verdict.reason


def test_a_hole_as_long_as_the_window_makes_the_contact_not_assessable():
    one = recording(bump(TIME), ONSET - 1.0, ONSET + 0.1, True)
    contacts = find_contacts(one, RULE)
    (seen,) = matched(contacts, ONSET + 0.12)
    assert seen.outcome == "not_assessable" and np.isnan(seen.latency)
    assert seen.reason == "load-cell samples are missing for 1101 ms where it begins: its onset is not known"
    short = find_contacts(recording(bump(TIME), ONSET - 0.1, ONSET + 0.1, True), RULE)
    assert matched(short, ONSET + 0.12)[0].outcome == "detected"


@pytest.mark.parametrize("own_clock", [False, True])
@pytest.mark.parametrize("begin, end", [(-0.003, 0.138), (-0.05, 0.1), (0.05, 0.17), (-0.003, 0.186), (0.08, 0.12)])
def test_an_unmeasured_force_never_passes(begin, end, own_clock):
    one = recording(bump(TIME), ONSET + begin, ONSET + end, own_clock)
    (contact,) = find_contacts(one, RULE)
    curve = force_time_curve(one, contact)
    verdict = assess_force(curve, LENIENT)
    assert verdict.outcome == "not_assessable"
    assert f"missing for {1e3 * (end - begin) + 1:.0f} ms" in verdict.reason
    assert curve.longest_hole(contact.end) == pytest.approx(end - begin + 1e-3, abs=1e-4)


def test_a_later_step_does_not_pass_where_it_may_have_begun_earlier():
    # 300 N until 0.70 s after the onset: allowed until 0.75 s, but the onset may be 0.1 s earlier.
    force = np.where((TIME >= ONSET) & (TIME < ONSET + 0.8), 300.0, 0.0)
    one = recording(force, ONSET - 0.01, ONSET + 0.09, True)
    (contact,) = find_contacts(one, RULE)
    assert contact.start == pytest.approx(ONSET + 0.09, abs=2e-3)
    verdict = assess_force(force_time_curve(one, contact), LENIENT)
    assert [item.outcome for item in verdict.steps] == ["not_assessable", "not_assessable"]
    assert "onset" in verdict.steps[1].reason


def test_a_cell_starting_just_before_the_contact_is_a_warning_and_a_masked_one_a_hole():
    lost = TIME < ONSET + 0.3
    force = bump(TIME) + np.where(TIME > ONSET + 0.3, bump(TIME, 400.0, ONSET + 0.6), 0.0)
    cell = Series(TIME[~lost], force[~lost], "N")
    one = Recording("a", "a.csv", ("x",), {"force": cell, "speed": Series(TIME, TIME * 0.0, "m/s")})
    (contact,) = find_contacts(one, RULE)
    assert contact.hole == 0.0
    (warning,) = truth_findings(one, [contact], RULE)
    assert fact_of(warning) == ("force_begins_late", {"begin": pytest.approx(5.3), "onset": contact.start})
    masked = Recording("a", "a.csv", ("x",), {"force": Series(TIME, np.where(lost, np.nan, force), "N")})
    (contact,) = find_contacts(masked, RULE)
    assert contact.hole > 1.0
    assert matched([contact], contact.start + 0.02)[0].outcome == "not_assessable"


def test_samples_that_are_stamped_in_batches_have_onsets_no_finer_than_a_batch():
    number = np.arange(len(TIME))
    batched = (number // 10 + 1) * 1e-2 - (9 - number % 10) * 2e-6
    one = Recording("a", "a.csv", ("x",), {"force": Series(batched, bump(TIME), "N")})
    (contact,) = find_contacts(one, RULE)
    assert contact.start - contact.uncertainty <= ONSET + 1e-3 and contact.resolution >= 9e-3


def test_a_cell_that_ends_during_the_contact_prevents_a_pass():
    for end, outcome in ((ONSET + 0.05, "not_assessable"), (ONSET + 0.25, "pass")):
        kept = end > TIME
        cell = Series(TIME[kept], bump(TIME)[kept], "N")
        one = Recording("a", "a.csv", ("x",), {"force": cell, "speed": Series(TIME, TIME * 0.0, "m/s")})
        (contact,) = find_contacts(one, RULE)
        single = ForceProfile("s", "s", "own", True, (ForceStep(0.0, 9000.0, "all"),))
        assert assess_force(force_time_curve(one, contact), single).outcome == outcome
