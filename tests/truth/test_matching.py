"""Matching of alarms and contacts."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.detectors.detection import Alarm, Signal, Status, Verdict
from cdtool.recordings.recording import Contact
from cdtool.truth.matching import Matching
from cdtool.truth.matching import match as match_verdict

TIME = np.arange(10_000) * 1e-3
CONTACT = Contact(5.0, 5.3, 0.01)


def alarm(time: float) -> Alarm:
    return Alarm(time, "axis", "above", 2.0, 1.0)


def match(alarms: list[Alarm], contacts: list[Contact], signal: Signal) -> Matching:
    """A detection in which every alarm is a crossing."""
    return match_verdict(Verdict("alarm", tuple(alarms), crossings=tuple(alarms)), contacts, signal)


def statistic(valid=lambda t: t >= 0.0) -> Signal:
    status = np.where(valid(TIME), Status.VALID, Status.NOT_APPLICABLE).astype(np.uint8).reshape(-1, 1)
    return Signal(TIME, np.zeros((len(TIME), 1)), status, "N")


def test_an_alarm_in_the_window_detects_with_its_latency():
    matching = match([alarm(5.04)], [CONTACT], statistic())
    assert matching.matches[0].outcome == "detected"
    assert matching.matches[0].latency == pytest.approx(0.04)
    assert matching.false_alarms == ()


def test_an_early_alarm_is_false_and_does_not_hide_the_contacts_own_detection():
    matching = match([alarm(3.0), alarm(5.04)], [CONTACT], statistic())
    assert matching.matches[0].latency == pytest.approx(0.04)
    assert [item.time for item in matching.false_alarms] == [3.0]


def test_no_alarm_in_the_window_is_missed_and_a_late_one_is_false():
    matching = match([alarm(6.5)], [CONTACT], statistic())
    assert matching.matches[0].outcome == "missed" and np.isnan(matching.matches[0].latency)
    assert len(matching.false_alarms) == 1


def test_a_second_alarm_in_the_window_is_neither_detection_nor_false():
    matching = match([alarm(5.04), alarm(5.8)], [CONTACT], statistic())
    assert matching.matches[0].latency == pytest.approx(0.04) and matching.false_alarms == ()


def test_a_contact_that_went_through_a_pickle_is_that_of_the_log():
    copy = pickle.loads(pickle.dumps(CONTACT))
    matching = match_verdict(
        Verdict("alarm", (alarm(5.04),)), [copy], statistic(), of_log=[CONTACT], crossings=[alarm(5.04)]
    )
    assert copy != CONTACT and [item.outcome for item in matching.matches] == ["detected"]


def test_never_valid_after_the_onset_is_not_assessable():
    matching = match([], [CONTACT], statistic(lambda t: t < 5.0))
    assert matching.matches[0].outcome == "not_assessable"


def test_valid_at_the_onset_and_then_lost_is_missed():
    matching = match([], [CONTACT], statistic(lambda t: t < 5.02))
    assert matching.matches[0].outcome == "missed"


def test_an_alarm_inside_the_onsets_uncertainty_has_latency_zero_and_is_flagged():
    matching = match([alarm(4.995)], [CONTACT], statistic())
    assert (matching.matches[0].latency, matching.matches[0].clipped) == (0.0, True)


def test_an_alarm_that_is_still_latched_does_not_hide_the_contact():
    early, again = alarm(4.8), alarm(5.04)
    verdict = Verdict("alarm", (early,), crossings=(early, again))
    matching = match_verdict(verdict, [CONTACT], statistic())
    assert matching.matches[0].alarm == again
    assert matching.false_alarms == (early,)


def test_an_alarm_after_the_next_contact_belongs_to_that_one_and_the_first_is_missed():
    first, second = Contact(5.0, 5.1, 0.01), Contact(5.5, 5.6, 0.01)
    matching = match([alarm(5.52)], [first, second], statistic())
    assert [item.outcome for item in matching.matches] == ["missed", "detected"]
    assert matching.matches[0].watched == pytest.approx(0.49)


def test_a_missed_contact_is_censored_where_the_window_or_the_log_ends():
    matching = match([], [CONTACT, Contact(9.6, 9.8, 0.01)], statistic())
    assert [item.watched for item in matching.matches] == pytest.approx([1.0, TIME[-1] - 9.6])


times = st.floats(0.0, 9.9)


@given(st.lists(times, max_size=12), st.lists(times, max_size=6), st.floats(0.0, 0.3))
def test_every_alarm_is_counted_at_most_once_and_every_contact_once(alarm_times, onsets, uncertainty):
    alarms = [alarm(time) for time in sorted(set(alarm_times))]
    contacts = [Contact(onset, onset + 0.1, uncertainty) for onset in onsets]
    matching = match(alarms, contacts, statistic())
    taken = [item.alarm for item in matching.matches if item.alarm]
    assert len(set(taken)) == len(taken) and not set(taken) & set(matching.false_alarms)
    assert sorted(item.contact.start for item in matching.matches) == sorted(onsets)
    for item in matching.matches:
        if item.alarm:
            assert item.contact.start - uncertainty <= item.alarm.time <= item.contact.start + 1.0


def test_one_event_on_several_joints_is_one_false_alarm():
    alarms = [Alarm(2.0 + 0.01 * joint, f"joint {joint}", "above", 2.0, 1.0, joint) for joint in range(6)] + [
        alarm(4.0)
    ]
    assert [item.time for item in match(alarms, [CONTACT], statistic()).false_alarms] == [2.0, 4.0]


def test_an_alarm_in_the_next_operation_of_a_log_belongs_to_its_contact_and_is_not_false():
    late = alarm(5.6)
    first = match_verdict(Verdict("no alarm"), [CONTACT], statistic(), of_log=[CONTACT], crossings=[late])
    assert first.matches[0].alarm == late
    second = match_verdict(
        Verdict("alarm", (late,), crossings=(late,)), [], statistic(), of_log=[CONTACT], crossings=[late]
    )
    assert second.matches == () and second.false_alarms == ()


def test_an_alarm_during_the_contact_is_not_false():
    matching = match([alarm(5.04), alarm(7.0)], [Contact(5.0, 7.5, 0.01)], statistic())
    assert matching.false_alarms == ()
