"""The audit on simulated contacts with known clocks, and where it cannot know anything."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.truth.synchronisation.audit import audit
from cdtool.truth.synchronisation.channel_delay import ChannelDelay, pooled, preferred
from tests.synthetic.shifted_clocks import Clocks, axis, collisions


def load_cell(found: tuple[ChannelDelay, ...]) -> ChannelDelay:
    (own,) = [item for item in preferred(found) if item.channel == "force"]
    return own


def test_offset_and_drift_of_a_load_cell_are_found_with_jitter_and_other_rates():
    clocks = Clocks(0.0123, 60e-6, machine_rate=500.0, cell_rate=2000.0, jitter=1e-4)
    recording, contacts = collisions(np.random.default_rng(1), np.arange(10) * 60.0, clocks)
    found = load_cell(audit(recording, axis(), contacts))
    assert found.offset.value == pytest.approx(clocks.at(found.at), abs=1e-3)
    assert found.offset.low < found.offset.value < found.offset.high < found.offset.low + 1.5e-3
    assert found.drift.low < found.drift.value < found.drift.high and abs(found.drift.value - 60e-6) < 1e-5


@pytest.mark.parametrize(("count", "assessable"), [(1, False), (4, False), (12, True)])
def test_a_load_cell_is_not_assessable_below_five_contacts(count, assessable):
    recording, contacts = collisions(np.random.default_rng(3), np.arange(count) * 5.0, Clocks())
    found = load_cell(audit(recording, axis(), contacts))
    assert (found.assessable, found.offset.known, bool(found.reason)) == (assessable, assessable, not assessable)
    assert assessable or found.reason.endswith("with a delay, at least 5 are needed")


def test_stiff_and_soft_contacts_are_told_apart():
    rng = np.random.default_rng(4)
    stiff, one = collisions(rng, np.arange(4) * 5.0, Clocks(0.006), rises=(0.004, 0.005))
    soft, two = collisions(rng, 30.0 + np.arange(4) * 5.0, Clocks(0.006), rises=(0.04, 0.05))
    channels = {
        name: Series(
            np.concatenate((stiff[name].time, soft[name].time)),
            np.concatenate((stiff[name].values, soft[name].values)),
            stiff[name].unit,
        )
        for name in stiff.channels
    }
    found = load_cell(audit(replace(stiff, channels=channels), axis(), [*one, *two]))
    assert found.stiff.value == pytest.approx(0.006, abs=1e-3)
    assert found.soft.value == pytest.approx(0.006, abs=2e-3)


def test_missing_samples_and_a_gap_do_not_displace_the_result():
    clocks = Clocks(0.004)
    recording, contacts = collisions(np.random.default_rng(6), np.arange(5) * 5.0, clocks)
    force = recording["force"].values.copy()
    force[::7] = np.nan
    speed = recording["speed"]
    kept = (speed.time < 0.5) | (speed.time > 0.9)
    channels = {
        **recording.channels,
        "force": recording["force"].with_values(force, "N"),
        "speed": Series(speed.time[kept], speed.values[kept], "m/s"),
    }
    found = load_cell(audit(replace(recording, channels=channels), axis(), contacts))
    assert found.offset.value == pytest.approx(clocks.at(found.at), abs=2e-3)


def test_a_late_speed_is_found_against_the_position():
    time = np.arange(8000) * 1e-3
    position = np.sin(2.0 * time) + 0.3 * np.sin(7.0 * time)
    speed = 2.0 * np.cos(2.0 * time) + 2.1 * np.cos(7.0 * time)
    speed += 1e-3 * np.random.default_rng(8).standard_normal(len(time))
    channels = {"position": Series(time, position, "m"), "speed": Series(time + 0.0042, speed, "m/s")}
    (found,) = audit(Recording("log", "log", ("axis",), channels), axis(), [])
    assert found.channel == "speed"
    assert found.offset.value == pytest.approx(0.0042, abs=1e-4)


@pytest.mark.parametrize("values", [np.nan, 0.0, np.inf, 1e200])
@pytest.mark.parametrize("count", [0, 1, 5, 1500])
def test_unusable_channels_are_not_assessable(count, values):
    time = np.arange(count) * 1e-3
    units = {"position": "m", "speed": "m/s", "acceleration": "m/s2", "torque": "N", "force": "N"}
    channels = {name: Series(time, np.full(count, values), unit) for name, unit in units.items()}
    found = audit(Recording("log", "log", ("axis",), channels), axis(), [Contact(0.5, 0.6, 1e-3, 10.0)])
    assert found and not any(item.assessable for item in found) and all(item.reason for item in found)


def test_logs_with_one_contact_each_are_pooled():
    each = []
    for seed in range(5):
        recording, contacts = collisions(np.random.default_rng(seed), np.array([0.0]), Clocks(0.009))
        each.append(load_cell(audit(recording, axis(), contacts)))
    found = pooled(each, [0.0] * 5)
    assert found.offset.value == pytest.approx(0.009, abs=2e-3) and len(found.events) == 5
    assert found.offset.high - found.offset.low < 4e-3


def test_drift_of_pooled_logs_needs_their_starts():
    each, starts = [], [1.6e9 + 200.0 * number for number in range(5)]
    for number in range(5):
        clocks = Clocks(0.002 + 50e-6 * 200.0 * number)
        recording, contacts = collisions(np.random.default_rng(number), np.array([0.0]), clocks)
        each.append(load_cell(audit(recording, axis(), contacts)))
    assert pooled(each, starts).drift.value == pytest.approx(50e-6, abs=5e-6)
