"""Warnings about a load cell as ground truth: it follows the torque without lag, or its rest level drifted."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.recordings.recording import Recording, Series
from cdtool.truth.doubts import follows_torque, truth_findings
from cdtool.truth.onset import OnsetRule, find_contacts
from tests.base.findings.facts import fact_of
from tests.data_folder import UR10E_LOGS

RULE = OnsetRule(above=20.0, back_to=8.0)
TIME = np.arange(6000) * 1e-3


def press(time: FloatArray) -> FloatArray:
    return np.where(time > 4.0, 300.0 * (1.0 - np.exp(-np.clip(time - 4.0, 0.0, None) / 0.1)), 0.0)


def noise(sigma: float, seed: int) -> FloatArray:
    return np.random.default_rng(seed).normal(0.0, sigma, len(TIME))


def log(force: FloatArray, torque: FloatArray, clock: FloatArray = TIME) -> Recording:
    channels = {"force": Series(TIME, force, "N"), "torque": Series(clock, torque, "N m")}
    return Recording("r", "r", ("a", "b"), channels)


def warnings_of(recording: Recording) -> list[Any]:
    found = truth_findings(recording, find_contacts(recording, RULE), RULE)
    assert all((item.channel, item.severity) == ("force", "warning") for item in found)
    return [fact_of(item) for item in found]


@pytest.mark.parametrize("scale", [0.8, -25.0])
@pytest.mark.parametrize("rate", [1e-3, 3e-3])
def test_a_force_computed_from_the_torque_is_not_independent_truth(scale, rate):
    clock = np.arange(0.0, 6.0, rate)
    torque = np.column_stack((np.sin(clock), 2.0 + press(clock) / abs(scale)))
    force = np.sign(scale) * press(TIME) + noise(2.0, 1)
    (fact,) = warnings_of(log(force, torque, clock))
    assert fact == ("follows_torque", {"joint": "b", "r": pytest.approx(np.sign(scale), abs=0.05)})


@pytest.mark.parametrize("lag", [0.01, 0.03, 0.08])
def test_a_drive_that_responds_to_the_contact_is_not_a_source_of_the_force(lag):
    torque = np.column_stack((np.sin(TIME), 2.0 + press(TIME - lag)))
    recording = log(press(TIME) + noise(2.0, 1), torque)
    assert warnings_of(recording) == []
    assert np.isnan(follows_torque(recording, find_contacts(recording, RULE))[1])


def test_without_contacts_or_required_channels_nothing_is_reported():
    torque = np.column_stack((np.sin(TIME), np.cos(TIME)))
    assert warnings_of(log(noise(2.0, 1), torque)) == []
    assert warnings_of(log(np.zeros(6000), torque)) == []
    assert warnings_of(log(np.full(6000, np.nan), torque)) == []
    only = log(press(TIME), torque)
    assert warnings_of(Recording("r", "r", ("a", "b"), {"force": only["force"]})) == []


def test_a_rest_level_that_drifted_beyond_the_lower_level_is_reported():
    torque = np.column_stack((np.sin(TIME), np.cos(TIME)))
    (fact,) = warnings_of(log(press(TIME) + noise(2.0, 1) + 30.0 * TIME / 7.0, torque))
    assert fact.kind == "rest_level_shifted" and fact.numbers["drift"]
    assert (fact.numbers["shift"], fact.numbers["onset"]) == (
        pytest.approx(16.5, abs=1.5),
        pytest.approx(4.05, abs=0.05),
    )
    assert warnings_of(log(press(TIME) + noise(2.0, 1) + 7.0 * TIME / 7.0, torque)) == []


def test_a_force_next_to_nothing_that_stays_to_the_end_of_the_log_is_named():
    torque = np.column_stack((np.sin(TIME), np.cos(TIME)))
    hit = np.where((TIME > 3.0) & (TIME < 3.2), 900.0, 0.0) + noise(2.0, 1)
    assert warnings_of(log(hit, torque)) == []
    (fact,) = warnings_of(log(hit + 25.0 * (TIME > 3.1), torque))
    assert fact == ("force_left", {"force": pytest.approx(25.0, abs=0.5), "onset": pytest.approx(3.0, abs=0.05)})
    assert warnings_of(log(press(TIME) + noise(2.0, 1), torque)) == []


@pytest.mark.parametrize("joint", [0, 1, 2])
def test_of_a_real_arm_a_force_made_from_a_motor_current_is_named(joint):
    """UR10e pushed by hand, one sample per 10 and 12 ms: the "force" is the shoulder's or elbow's own torque."""
    table = np.loadtxt(UR10E_LOGS / "ur-static.csv.gz", delimiter=",")
    time, current = table[:, 0] - table[0, 0], table[:, 13:19]
    force = 10.0 * current[:, joint] + np.random.default_rng(1).normal(0.0, 0.5, len(time))
    channels = {"force": Series(time, force, "N"), "torque": Series(time, current, "N m")}
    recording = Recording("ur-static", "", tuple("abcdef"), channels)
    found = find_contacts(recording, OnsetRule(8.0, 4.0))
    assert found and not any(item.in_progress for item in found)
    assert found[0].start == pytest.approx(3.3, abs=0.3)  # first push according to the observer: 3.4 s
    name, r = follows_torque(recording, found)
    assert (name, r) == ("abcdef"[joint], pytest.approx(1.0, abs=0.02))
