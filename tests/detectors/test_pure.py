"""Pure torque and pure inertia: what is logged, referred to the load."""

from __future__ import annotations

import numpy as np

from cdtool.detection import Status
from cdtool.detectors.pure_inertia import PureInertia
from cdtool.detectors.pure_torque import PureTorque
from cdtool.recording import Recording, Series


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
