"""A resolver's speed from the true position, apart from the simulators' loops: their logs are compared with it."""

from __future__ import annotations

import math

import numpy as np

from cdtool.commands.simulate.sensors import Array
from cdtool.machines.axis_model.sensor_filters import first_order_low_pass


def resolver_speed(position: Array, step: float, frequency: float, period: float) -> Array:
    """The position rounded down to a multiple of `step`, its difference, two first-order low-passes of `frequency` Hz.

    The first sample has no predecessor and counts as standstill. Units are those of `position` per second.
    """
    counted = np.floor(position / step) * step
    speed = np.diff(counted, prepend=counted[0]) / period
    time_constant = 1.0 / (2.0 * math.pi * frequency)
    return first_order_low_pass(first_order_low_pass(speed, time_constant, period), time_constant, period)
