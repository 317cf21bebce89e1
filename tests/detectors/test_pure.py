"""Pure torque, pure inertia and torque deviation: what is logged, referred to the load."""

from __future__ import annotations

import numpy as np

from cdtool.detectors.detection import Status
from cdtool.detectors.pure_inertia import PureInertia
from cdtool.detectors.pure_torque import PureTorque
from cdtool.detectors.torque_deviation import TorqueDeviation
from cdtool.recordings.recording import Recording, Series


def test_pure_torque_is_the_drive_force_and_pure_inertia_the_deceleration(gate):
    time = np.arange(4) * 1e-3
    channels = {
        "torque": Series(time, np.array([1.0, np.nan, 3.0, 4.0]), "N"),
        "acceleration": Series(time + 2e-4, np.array([0.5, -0.5, np.nan, 1.0]), "m/s2"),
    }
    recording = Recording("r", "r", ("gate",), channels)
    torque, inertia = PureTorque().signal(recording, gate), PureInertia().signal(recording, gate)
    np.testing.assert_array_equal(torque.values[:, 0], [1.0, np.nan, 3.0, 4.0])
    np.testing.assert_array_equal(inertia.values[:, 0], [-0.5, 0.5, np.nan, -1.0])
    np.testing.assert_array_equal(inertia.time, time + 2e-4)
    assert torque.status[1, 0] == inertia.status[2, 0] == Status.GAP
    assert (torque.unit, inertia.unit) == ("N", "m/s2")


def test_torque_deviation_is_the_effort_beyond_the_last_known_reference(gate):
    time = np.arange(6) * 1e-3
    channels = {
        "torque": Series(time, np.array([1.0, 2.0, np.nan, 4.0, 5.0, 6.0]), "N"),
        "reference_torque": Series(time[1:4] + 2e-4, np.array([1.0, np.nan, 3.0]), "N"),
    }
    signal = TorqueDeviation().signal(Recording("r", "r", ("gate",), channels), gate)
    np.testing.assert_array_equal(signal.values[:, 0], [np.nan, np.nan, np.nan, np.nan, 2.0, 3.0])
    assert signal.status[:, 0].tolist() == [Status.GAP] * 4 + [Status.VALID] * 2 and signal.unit == "N"
