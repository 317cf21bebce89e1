"""Why an alarm was raised and why a contact was missed, with numbers that can be calculated by hand."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, judge_alone
from cdtool.detectors.detection import Signal, Status
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.report.explanation_words import words
from cdtool.results.explanation.explanation import Explainer
from cdtool.results.explanation.explanation import explain_operation as explain
from cdtool.results.explanation.margin import joint_margins
from cdtool.thresholds.limit import Limit
from cdtool.truth.matching import Matching, match

TIME = np.arange(5000) * 1e-3
NINE = Activation(debounce=9)
CONTACT = Contact(3.0, 3.4, 0.001)


def detection(
    values: np.ndarray,
    limits: Sequence[float] = (1.0,),
    status: np.ndarray | None = None,
    time: np.ndarray = TIME,
    channels: Mapping[str, np.ndarray] = MappingProxyType({}),
    threshold: Any = None,
    activation: Activation = NINE,
) -> Detection:
    """A statistic (n,) or (n, J) with limits set by hand, assessed as in the pipeline."""
    columns = values.reshape(len(time), -1)
    joints = ("hip", "knee")[: columns.shape[1]]
    given = {"torque": columns, **{name: np.column_stack([part] * len(joints)) for name, part in channels.items()}}
    recording = Recording("log", "log", joints, {name: Series(time, part, "1") for name, part in given.items()})
    marks = np.column_stack([np.zeros(len(time)) if status is None else status] * len(joints)).astype(np.uint8)
    signal = Signal(time, columns, marks, "N m", joints=joints)
    return judge_alone(
        Operation(recording, MotionClass(1, 1.0)), "momentum", signal, [threshold or Limit.given(limits)], activation
    )


def matching(item: Detection, *contacts: Contact) -> Matching:
    return match(item.verdict, contacts, item.statistic)


def pulse(start: int, count: int, height: float = 1.5, rest: float = 0.2) -> np.ndarray:
    """Samples start to start + count - 1 at a height, all others at zero."""
    values = np.full(len(TIME), rest)
    values[start : start + count] = height
    return values


def test_margin_and_share_are_the_distance_to_the_nearest_limit_and_what_is_used_of_it():
    values = np.zeros(len(TIME))
    values[:4] = 0.75, -1.5, 1.0, -0.25
    (margin,) = joint_margins(detection(values, (1.0,)))
    assert margin.margin[:5] == pytest.approx([0.25, -0.5, 0.0, 0.75, 1.0])
    assert margin.share[:5] == pytest.approx([0.75, 1.5, 1.0, 0.25, 0.0])
    below = margin.moment(1)
    assert (below.limit, below.statistic, below.margin) == (-1.0, -1.5, -0.5)


def test_a_sample_not_assessable_has_no_margin_but_a_reason():
    status = np.zeros(len(TIME))
    status[10] = Status.START_UP
    (margin,) = joint_margins(detection(np.zeros(len(TIME)), status=status))
    moment = margin.moment(10)
    assert math.isnan(moment.margin) and math.isnan(moment.share) and moment.reason == "start-up"


@pytest.mark.parametrize("seed", range(20))
def test_between_leaving_the_band_and_any_alarm_lie_just_the_debounced_samples(seed):
    rng = np.random.default_rng(seed)
    values = np.convolve(rng.normal(size=len(TIME) + 19), np.ones(20) / 8.0, "valid")
    status = rng.choice([0, 0, 0, 0, 0, 0, 1, 3, 3], len(TIME))
    item = detection(values, status=status, activation=Activation(4, rearm=0.01))
    assert len(item.verdict.crossings) > 5
    for crossing in item.verdict.crossings:
        found = Explainer(item, Activation(4)).alarm(crossing)
        inside = (found.left <= TIME) & (crossing.time >= TIME)
        marks = status[inside]
        assert found.skipped == np.count_nonzero(marks == Status.GAP)
        assert np.count_nonzero(marks == Status.VALID) == 4 == found.debounce
        assert (np.abs(values[inside][marks == Status.VALID]) > 1.0).all()


def test_a_miss_states_its_closest_approach_with_duration_and_time():
    values = pulse(3040, 5)
    values[3060:3080] = 0.9
    values[3050] = -1.7
    item = detection(values)
    (found,) = explain(item, matching(item, CONTACT), NINE)
    assert (found.role, found.debounce) == ("missed", 9)
    (near,) = found.approaches
    assert (near.nearest.time, near.nearest.margin, near.nearest.limit) == pytest.approx((3.05, -0.7, -1.0))
    assert (near.longest, near.outside_from) == pytest.approx((5, 3.04))
    assert near.held == pytest.approx(0.9)
    assert math.isnan(near.latched_from)
    assert any("5 consecutive samples outside; 9 are required" in line for line in words(found))


def test_the_nearest_joint_is_listed_first_and_one_without_a_limit_is_omitted():
    values = np.column_stack((pulse(3040, 30, 0.6), pulse(3040, 30, 0.8)))
    item = detection(values, (1.0, 1.0))
    (found,) = explain(item, matching(item, CONTACT), NINE)
    assert [(near.joint, near.held) for near in found.approaches] == [
        ("knee", pytest.approx(0.8)),
        ("hip", pytest.approx(0.6)),
    ]
    assert found.joint == "knee" and found.departed[0].joint == "knee"
    unwatched = detection(values, (1.0, math.inf))
    (found,) = explain(unwatched, matching(unwatched, CONTACT), NINE)
    assert [near.joint for near in found.approaches] == ["hip"]


def test_a_statistic_outside_since_before_the_contact_is_reported():
    item = detection(pulse(2900, 600))
    early, missed = explain(item, matching(item, CONTACT), NINE)
    assert early.role == "false alarm"
    assert missed.role == "missed"
    assert missed.approaches[0].latched_from == pytest.approx(2.9)
    assert missed.approaches[0].longest == 0
    assert any("already outside the band since 2.900 s" in line for line in words(missed))


def test_every_alarm_and_every_miss_is_explained_once_in_order_of_time_with_its_role():
    values = pulse(1000, 30) + pulse(3020, 30) + pulse(3700, 30)
    item = detection(values)
    found = explain(item, matching(item, CONTACT, Contact(4.2, 4.3, 0.001)), NINE)
    roles = [part.role for part in found]
    assert roles == ["false alarm", "detection", "further alarm", "missed"]
    assert [part.contact.start if part.contact else None for part in found] == [None, 3.0, 3.0, 4.2]


def test_an_alarm_of_a_contact_in_progress_has_neither_onset_nor_latency():
    item = detection(pulse(400, 30) + pulse(3020, 30))
    begun = Contact(0.0, 1.0, 0.0, in_progress=True)
    first, second = explain(item, matching(item, begun, CONTACT), NINE)
    assert (first.role, first.contact, second.role) == ("in progress", None, "detection")
    assert "its onset is not recorded: no latency" in " ".join(words(first))


def test_without_ground_truth_an_alarm_is_not_called_false():
    item = detection(pulse(1000, 30))
    (found,) = explain(item, matching(item), NINE)
    assert found.role == "alarm"
    recording = item.operation.recording
    with_cell = {**recording.channels, "force": Series(TIME, np.zeros(len(TIME)), "N")}
    known = replace(item, operation=replace(item.operation, recording=replace(recording, channels=with_cell)))
    (found,) = explain(known, matching(known), NINE)
    assert found.role == "false alarm"


def test_an_alarm_that_is_latched_still_explains_the_contact_it_detected():
    item = detection(pulse(2800, 30) + pulse(3020, 30))
    assert len(item.verdict.alarms) == 1
    found = explain(item, matching(item, CONTACT), NINE)
    assert [part.role for part in found] == ["false alarm", "detection"]
