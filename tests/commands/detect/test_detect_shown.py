"""`cdtool detect` on an alarm without a detection: a repeated alarm of the same contact, or one without a contact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import judge_alone
from cdtool.commands.detect.shown import as_rows, show_detected
from cdtool.commands.detecting.detection import Detected
from cdtool.commands.judging.judged_operation import Judged, contact_rows
from cdtool.detectors.detection import Signal
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.limit import Limit
from cdtool.truth.matching import match
from cdtool.truth.onset import OnsetRule, find_contacts

ONSET = 5.0


def detected(bursts: Sequence[tuple[int, float, float]], pressed: float = 0.4) -> Detected:
    """Two joints whose torque exceeds its limit in `bursts` (joint, from s, to s), with a contact from 5 s."""
    time = np.arange(0.0, 10.0, 2e-3)
    torque = np.zeros((len(time), 2))
    for joint, start, end in bursts:
        torque[(time >= start) & (time < end), joint] = 60.0
    force = np.where((time >= ONSET) & (time < ONSET + pressed), 100.0, 0.0)[:, np.newaxis]
    channels = {
        "torque": Series(time, torque, "N m"),
        "speed": Series(time, np.ones((len(time), 2)), "rad/s"),
        "force": Series(time, force, "N"),
    }
    recording = Recording("arm", "arm.csv", ("shoulder", "elbow"), channels)
    (operation,) = operations_of(recording)
    signal = Signal(time, torque, np.zeros(torque.shape, dtype=np.uint8), "N m", joints=recording.joints)
    detection = judge_alone(operation, "pure_torque", signal, (Limit.given((40.0,)),), Activation())
    contacts = tuple(find_contacts(recording, OnsetRule(above=20.0, back_to=8.0)))
    assert len(contacts) == 1
    matching = match(detection.verdict, contacts, detection.statistic)
    rows = contact_rows(Judged("", operation, contacts, (detection,), (matching,)), recording, contacts, {}, 0.0)
    return Detected(recording, (detection,), contacts, (matching,), "limit 40 N m", contact_rows=(tuple(rows),))


def whys(found: Detected, capsys: pytest.CaptureFixture[str]) -> list[str]:
    show_detected([found], {})
    return [line.strip() for line in capsys.readouterr().out.splitlines() if " alarm " in line]


def test_an_alarm_of_a_second_joint_belongs_to_the_same_contact(capsys):
    found = detected([(0, 5.05, 5.3), (1, 5.15, 5.35)])
    first, second = whys(found, capsys)
    signal, limit, latency = first.split()[-3:]
    assert (signal, limit) == ("60", "40") and 50 < float(latency) < 65
    assert second.endswith("same contact, also elbow")
    (row,) = as_rows([(None, found)], {})
    assert [item["contact_onset_s"] for item in row["alarms"]] == [pytest.approx(ONSET)] * 2
    assert [item["why_no_contact"] for item in row["alarms"]] == [None, None]


def test_a_repeated_alarm_during_a_contact_belongs_to_it(capsys):
    found = detected([(0, 5.05, 5.1), (0, 5.8, 5.9)])
    assert whys(found, capsys)[1].endswith("same contact, shoulder again")


def test_an_alarm_after_the_window_during_the_contact_is_late(capsys):
    found = detected([(0, 6.6, 6.9)], pressed=3.0)
    assert "contact at 5.000 s, more than 1 s after its onset" in whys(found, capsys)[0]


def test_an_alarm_far_from_any_contact_belongs_to_none(capsys):
    found = detected([(0, 5.05, 5.3), (1, 8.0, 8.2)])
    assert whys(found, capsys)[1].endswith("no contact")
    (row,) = as_rows([(None, found)], {})
    assert (row["alarms"][1]["contact_onset_s"], row["alarms"][1]["why_no_contact"]) == (None, "no contact")
