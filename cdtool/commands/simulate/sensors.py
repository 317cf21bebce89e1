"""Causal sensor models: a resolver, a torque estimate and an accelerometer.

Every filter starts from rest and uses only past values, so that latencies are not too small. Noise is passed in as
standard normal samples: the caller owns the random generator.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.machines.axis_model.sensor_filters import first_order_low_pass, second_order_low_pass

Array = npt.NDArray[np.float64]


def coloured_noise(white: Array, deviation: float, rate: float, period: float) -> Array:
    """Ornstein-Uhlenbeck noise x' = -rate x + w of std `deviation`, from x = 0; `rate` in rad/s.

    x_k = a x_(k-1) + deviation sqrt(1 - a^2) white_k with a = exp(-rate period): exact at the samples.
    """
    from scipy.signal import lfilter

    keep = math.exp(-rate * period)
    return np.asarray(lfilter([deviation * math.sqrt(1.0 - keep * keep)], [1.0, -keep], white), dtype=np.float64)


def resonance(white: Array, deviation: float, frequency: float, damping: float, period: float) -> Array:
    """Response y'' + 2 damping w y' + w^2 y = noise of a structural mode, of std `deviation`.

    y_k = b1 y_(k-1) + b2 y_(k-2) + gain white_k has the poles of the mode; the gain is that of the stationary
    variance (1 - b2) / ((1 + b2) ((1 - b2)^2 - b1^2)). `frequency` in Hz.
    """
    from scipy.signal import lfilter

    angle = 2.0 * math.pi * frequency * period
    radius = math.exp(-damping * angle)
    first = 2.0 * radius * math.cos(angle * math.sqrt(1.0 - damping * damping))
    second = -radius * radius
    variance = (1.0 - second) / ((1.0 + second) * ((1.0 - second) ** 2 - first * first))
    gain = deviation / math.sqrt(variance)
    return np.asarray(lfilter([gain], [1.0, -first, -second], white), dtype=np.float64)


def measured_torque(torque: Array, white: Array, noise: float, time_constant: float, period: float) -> Array:
    """Torque from the motor current: a low-pass of `time_constant` s over torque + noise white."""
    return first_order_low_pass(torque + noise * white, time_constant, period)


@dataclass(frozen=True, kw_only=True)
class Accelerometer:
    """A MEMS sensor: its white `noise` [m/s2 rms] and `bias` [m/s2], and the `resolution` [m/s2] of what it logs.

    `frequency` [Hz] and `damping` are its low-pass's; `resolution` 0 is unquantised. It is read every `period` [s].
    """

    noise: float
    bias: float
    frequency: float
    damping: float
    resolution: float
    period: float

    def reading(self, acceleration: Array, vibration: Array, white: Array, settled: float = 0.0) -> Array:
        """Return LP2(acceleration + vibration + noise white + bias), rounded to the resolution [m/s2].

        The low-pass starts at rest on the value `settled` [m/s2] (gravity's share, on a sensor that has been on for
        long).
        """
        sensed = acceleration + vibration + self.noise * white + self.bias
        reading = settled + second_order_low_pass(sensed - settled, self.frequency, self.damping, self.period)
        rounded = np.rint(reading / self.resolution) * self.resolution if self.resolution > 0.0 else reading
        return np.asarray(rounded, dtype=np.float64)
