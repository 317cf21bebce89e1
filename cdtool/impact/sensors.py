"""The response of a sensor to the deviation that an impact causes: low-pass, sampling, noise and resolution."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.impact.checks import require_not_negative, require_positive

QUANTITIES = ("contact_force", "drive_force", "load_acceleration", "motor_position", "motor_force")
"""What a sensor may measure: each on the load side [N, N, m/s2, m, N]."""


@dataclass(frozen=True)
class Sensor:
    """A sensor of a `quantity`, on the load side; `noise` and `resolution` in its unit, in the data as logged.

    `noise` is the standard deviation of white noise after the low-pass; `resolution` one step of the converter; `noise`
    grows with the root of the bandwidth. `bandwidth` [Hz] of its first-order low-pass, infinite without one;
    `sample_rate` [Hz].
    `differentiated`: the logged signal is the difference of the quantity over one sample, after the low-pass; its
    `resolution` is still a step of the quantity, its `noise` that of the derivative. Raises UsageError for values
    without meaning.
    """

    name: str
    place: str
    quantity: str
    unit: str
    noise: float
    resolution: float
    bandwidth: float
    sample_rate: float
    differentiated: bool = False

    def __post_init__(self) -> None:
        require_positive("sample rate", self.sample_rate, "Hz")
        if self.bandwidth != math.inf:
            require_positive("bandwidth", self.bandwidth, "Hz")
        require_not_negative("noise", self.noise, self.unit)
        require_not_negative("resolution", self.resolution)

    @property
    def step(self) -> float:
        """The largest error of the logged signal by the resolution [unit].

        A step of the quantity; differentiated, a count one sample early: (1 - a) q/T with
        a = exp(-2 pi f T). It is bounded, so no multiple of it is taken.
        """
        if not self.differentiated:
            return self.resolution
        keep = math.exp(-2.0 * math.pi * self.bandwidth / self.sample_rate)
        return (1.0 - keep) * self.resolution * self.sample_rate

    def threshold(self, factor: float) -> float:
        """Return k sigma + step: a larger deviation cannot be noise or a count [unit]."""
        return factor * self.noise + self.step

    def half_the_noise(self) -> Sensor:
        """Return the sensor with half the noise."""
        return replace(self, noise=0.5 * self.noise)

    def half_the_step(self) -> Sensor:
        """Return the sensor with twice as many counts."""
        return replace(self, resolution=0.5 * self.resolution)

    def twice_the_bandwidth(self) -> Sensor:
        """Return the sensor with a low-pass twice as fast, which passes more noise."""
        return replace(self, bandwidth=2.0 * self.bandwidth, noise=math.sqrt(2.0) * self.noise)

    def twice_the_rate(self) -> Sensor:
        """Return the sensor sampled twice as often."""
        return replace(self, sample_rate=2.0 * self.sample_rate)

    def time_to_see(self, time: FloatArray, deviation: FloatArray, factor: float) -> float | None:
        """Return when the logged deviation first exceeds the threshold, for the least favourable sampling instants [s].

        `deviation` (n,) of the quantity over `time` (n,) from the touch at 0. None: not within `time`, at least for
        some sampling instants.
        """
        logged, period, fine = self.logged(time, deviation)
        beyond = np.abs(logged) >= self.threshold(factor)
        beyond &= logged != 0.0
        if not beyond.any(axis=1).all():
            return None
        late = np.argmax(beyond, axis=1) * period + np.arange(len(logged)) * fine
        return float(np.max(late))

    def logged(self, time: FloatArray, deviation: FloatArray) -> tuple[FloatArray, float, float]:
        """(phases, samples): what is logged when sampling begins at each of several instants within a period.

        Also the sample period and the step between these instants [s]. Nothing deviates before the touch.
        """
        from scipy.signal import lfilter

        period = 1.0 / self.sample_rate
        phases = max(8, math.ceil(period / 5e-5))  # instants at most 50 us apart
        fine = period / phases
        samples = max(1, int(time[-1] / period))
        at = np.arange(samples * phases) * fine
        values = np.interp(at, time, deviation)
        if not self.differentiated:
            keep = math.exp(-2.0 * math.pi * self.bandwidth * fine)
            values = lfilter([1.0 - keep], [1.0, -keep], values)
            return np.ascontiguousarray(values.reshape(samples, phases).T), period, fine
        keep = math.exp(-2.0 * math.pi * self.bandwidth * period)
        rate = np.diff(values.reshape(samples, phases).T, axis=1, prepend=0.0) / period
        return np.asarray(lfilter([1.0 - keep], [1.0, -keep], rate, axis=1), dtype=np.float64), period, fine
