"""The force at a known point, from a joint residual."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import detect_operation
from cdtool.base.errors import ConfigurationError, UsageError
from cdtool.commands.detect.contact_force import ContactPoint, contact_force, summarise_force
from cdtool.commands.simulate.arm_recordings import simulate_arm
from cdtool.detectors.energy import Energy
from cdtool.detectors.momentum import Momentum
from cdtool.detectors.pure_torque import PureTorque
from cdtool.recordings.operations import operations_of
from cdtool.thresholds.limit import Limit
from tests.command import cdtool
from tests.synthetic.motions import moving_recording

POINT = ContactPoint("forearm", (0.2, 0.0, 0.0))


def hit(machine, force, at=2.0):
    """A recording in which a force, constant in the base's axes, acts at the point from `at` s."""
    free = moving_recording(
        machine, seconds=5.0, amplitude=0.15, seed=4
    )  # the elbow stays bent: both directions are observable
    torque, position = free["torque"], free["position"].values
    pushed = np.zeros((len(position), 6))
    pushed[torque.time >= at, :3] = force
    values = torque.values + machine.contact_torque(position, pushed, POINT.link, POINT.point)
    return replace(free, channels={**free.channels, "torque": replace(torque, values=values)})


def detected(machine, recording, detector):
    return detect_operation(operations_of(recording)[0], machine, detector, (Limit.given([1.0]),), Activation(5))


def test_a_force_in_the_plane_is_found_from_the_residual_once_it_has_settled(arm):
    force = np.array([6.0, 0.0, -9.0])
    detection = detected(arm, hit(arm, force), Momentum(bandwidth=80.0))
    found = contact_force(detection, arm, POINT)
    settled = found.values[found.time > 2.5]
    assert np.abs(settled - force).max() < 0.3  # the residual follows a changing torque with 1/80 s
    before = found.values[(found.time > 0.6) & (found.time < 1.9)]
    assert np.abs(before).max() < 1e-3
    summary = summarise_force(detection, arm, POINT)
    assert summary.largest == pytest.approx(np.linalg.norm(force), rel=0.1)
    assert 0.0 < summary.at_alarm < summary.largest


def test_near_a_singular_pose_unobservable_forces_are_zero(arm):
    position, residual = np.array([[0.5, 0.501]]), np.array([[1.0, 2.0]])
    found = arm.contact_force(position, residual, POINT.link, POINT.point)[0]
    along = np.array([np.cos(0.5), 0.0, np.sin(0.5)])
    assert abs(found @ along) < 0.05 * np.linalg.norm(found) and np.linalg.norm(found) < 20.0


def test_unassessable_samples_have_no_force(arm):
    recording = hit(arm, np.array([6.0, 0.0, -9.0]))
    speed = recording["speed"].values.copy()
    speed[3000:3100] = np.nan
    holed = {**recording.channels, "speed": replace(recording["speed"], values=speed)}
    found = contact_force(detected(arm, replace(recording, channels=holed), Momentum(80.0)), arm, POINT)
    assert np.isnan(found.values[3010:3090]).all() and np.isnan(found.values[:30]).all()
    assert np.isfinite(found.values[4000:]).all()


def test_a_signal_that_is_not_the_contact_torque_of_all_joints_is_refused(arm, gate, simulated):
    recording = hit(arm, np.array([6.0, 0.0, -9.0]))
    with pytest.raises(UsageError, match="energy of whole machine is not the contact torque"):
        contact_force(detected(arm, recording, Energy()), arm, POINT)
    with pytest.raises(UsageError, match="is not the contact torque") as refused:
        contact_force(detected(arm, recording, PureTorque()), arm, POINT)
    assert "direct, desired_dynamics, velocity or kalman_momentum" in str(refused.value)
    operation = operations_of(recording)[0]
    one = detect_operation(operation, arm, Momentum(), (Limit.given([1.0]),), Activation(5), watched=("arm",))
    with pytest.raises(UsageError, match="momentum of arm is not the contact torque of all joints"):
        contact_force(one, arm, POINT)
    with pytest.raises(UsageError, match="no links"):
        contact_force(detected(gate, simulated("stiff", 1), Momentum()), gate, POINT)
    with pytest.raises(ConfigurationError, match="did you mean forearm"):
        contact_force(detected(arm, recording, Momentum()), arm, ContactPoint("foream", POINT.point))


@pytest.mark.parametrize("text", ["forearm", "forearm:1,2", "forearm:1,2,x", ":1,2,3", "forearm:1,2,nan"])
def test_an_invalid_point_is_refused(text):
    with pytest.raises(UsageError, match="LINK:X,Y,Z"):
        ContactPoint.parse(text)


def test_detect_shows_the_force_with_its_alarms(tmp_path):
    simulate_arm(tmp_path / "logs", {"free": 1, "holdout": 0, "stiff": 1, "soft": 0}, seed=1)
    command = ("detect", tmp_path / "logs/stiff/01.csv", "-m", tmp_path / "logs/machine.toml", "-d", "gm")
    done = cdtool(*command, "--set=threshold.limits=6,inf", "--contact-at", "arm:0.28,0,0")
    assert done.status == 0 and "estimated force at arm (0.28, 0, 0) m" in done.out
    values = json.loads(cdtool(*command, "--set=threshold.limits=6,inf", "--contact-at", "arm:0.28,0,0", "--json").out)[
        0
    ]
    estimate = values["estimated_force"]
    assert estimate["contact"] == {"link": "arm", "point": [0.28, 0.0, 0.0]}
    # The load cell's peak, plus what the joint's dry friction, unknown to the machine file, adds at this lever.
    assert 20.0 < estimate["largest"] < 60.0
    assert values["alarms"] and 0.0 < estimate["at_alarm"] <= estimate["largest"]
