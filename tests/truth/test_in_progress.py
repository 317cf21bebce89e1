"""A contact in progress at the start of a recording: never detected or missed, and its alarms are not false."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.detectors.detection import Alarm, Signal, Status, Verdict
from cdtool.recordings.recording import Contact
from cdtool.results.results import ContactResult, Results
from cdtool.results.summary import FIGURES, latencies, summarise
from cdtool.truth.matching import match

BEGUN = Contact(0.0, 2.0, 0.0, 500.0, in_progress=True)
LATER = Contact(6.0, 6.3, 0.01, 900.0)


def matching(times, contacts, crossings=()):
    time = np.arange(0.0, 10.0, 1e-2)
    signal = Signal(time, np.zeros((1000, 1)), np.full((1000, 1), Status.VALID, dtype=np.uint8), "1", joints=("a",))
    alarms = tuple(Alarm(at, "axis", "above", 1.0, 0.5) for at in times)
    return match(Verdict("alarm", alarms, crossings=alarms), contacts, signal)


@pytest.mark.parametrize("at", [0.0, 0.5, 1.9, 2.05, 2.99])
def test_an_alarm_until_its_release_or_in_the_window_after_it_is_neither_a_detection_nor_false(at):
    found = matching([at], [BEGUN, LATER])
    assert [item.outcome for item in found.matches] == ["in_progress", "missed"]
    assert found.matches[0].alarm is None and np.isnan(found.matches[0].latency)
    assert "its onset is not recorded" in found.matches[0].reason
    assert found.false_alarms == ()


def test_later_alarms_are_false_or_detect_the_next_contact():
    found = matching([3.1, 6.04], [BEGUN, LATER])
    assert [item.outcome for item in found.matches] == ["in_progress", "detected"]
    assert [alarm.time for alarm in found.false_alarms] == [3.1]


def test_the_next_contact_opens_its_own_window():
    soon = Contact(2.4, 2.6, 0.01, 900.0)
    found = matching([2.45], [BEGUN, soon])
    assert [item.outcome for item in found.matches] == ["in_progress", "detected"]


def row(outcome: str, number: int, latency: float | None = None, clipped: bool = False) -> ContactResult:
    return ContactResult(
        "r", "stiff", "gm", "a", 0.0, 0.01, 1.0, latency, outcome, 100.0 * number, 500.0, clipped, contact=number
    )


def test_it_is_counted_separately_and_in_no_other_result():
    rows = (row("in_progress", 1), row("detected", 2, 0.0, True), row("detected", 3, 30.0), row("missed", 4))
    results = Results({}, ("gm",), ("stiff",), rows, (), ())
    (item,) = summarise(results)
    assert (item.contacts, item.detected, item.missed, item.not_assessable) == (3, 2, 1, 0)
    assert (item.in_progress, item.clipped) == (1, 1)
    assert FIGURES["in_progress"](item) == 1 and FIGURES["clipped"](item) == 1
    assert item.force_at_alarm == 250.0  # the median of 200 and 300
    assert len(results.scored_contacts) == 3 and len(latencies(rows)[0]) == 3
    alone = summarise(Results({}, ("gm",), ("stiff",), rows[:1], (), ()))[0]
    assert alone.contacts == 0 and np.isnan(alone.mean_ms)
    assert alone.why_undefined("missed") == "1 contact was in progress when the recording began"
