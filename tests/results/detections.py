"""A detection with a statistic set by the test."""

from __future__ import annotations

import numpy as np

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, judge_alone
from cdtool.detectors.detection import Signal, Status
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.limit import FittedLimit

TIME = np.arange(8000) * 1e-3
RECORDING = Recording("r", "r", ("a", "b"), {"speed": Series(TIME, np.ones((8000, 2)), "m/s")})
OPERATION = Operation(RECORDING, MotionClass(1, 1.0))
ACTIVATION = Activation(3, rearm=0.2)
LIMIT = FittedLimit((0.0,), (0.0,), (1.0,), (1.0,), safety_factor=3.0)


def detection(seed: int, factor: float = 3.0, activation: Activation = ACTIVATION) -> Detection:
    """Coloured noise on two joints with steps for contacts, a gap and a section that is not applicable."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(0.0, 0.2, (8100, 2)).cumsum(axis=0)
    values = noise[100:] - noise[:-100]
    values[3000:3200, 0] += 8.0
    values[6000:6100, 1] -= 9.0
    status = np.zeros((8000, 2), dtype=np.uint8)
    status[1000:1050] = Status.GAP
    status[4000:4500] = Status.NOT_APPLICABLE
    signal = Signal(TIME, values, status, "N", joints=("a", "b"))
    return judge_alone(OPERATION, "d", signal, (LIMIT.with_safety_factor(factor),), activation)
