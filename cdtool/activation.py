"""Statistic x band -> alarms: debounce and re-arming. The same logic for every detector and threshold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.detection import Alarm, Band, Signal, StatusArray
from cdtool.errors import UsageError
from cdtool.kernels import kernel
from cdtool.recording import BoolArray, FloatArray

# Without a number of samples, an alarm needs this long outside the band [s]: 9 samples at 1 kHz.
DEBOUNCE_TIME = 9e-3


@dataclass(frozen=True)
class Activation:
    """`debounce` samples in succession outside the band raise an alarm; `rearm` seconds inside arm it again.

    A missing sample is skipped: it neither counts nor breaks the succession, so that a flaky sensor cannot hide a
    contact. A sample where the method does not apply breaks it. The alarm's time is that of the last sample counted.
    """

    debounce: int | None = None
    rearm: float = 0.5

    def __post_init__(self) -> None:
        if self.debounce is not None and self.debounce < 1:
            raise UsageError(f"debounce is {self.debounce}", "a whole number of samples, at least 1")

    def samples(self, period: float) -> int:
        """The debounce in samples for a signal of that period [s]."""
        if self.debounce is not None:
            return self.debounce
        return max(1, round(DEBOUNCE_TIME / period)) if period > 0.0 else 1

    def alarms(self, statistic: Signal, band: Band) -> tuple[Alarm, ...]:
        """All alarms in order of time, over all joints."""
        period = float(np.median(np.diff(statistic.time))) if len(statistic.time) > 1 else 0.0
        found: list[Alarm] = []
        for joint in range(statistic.values.shape[1]):
            value = np.ascontiguousarray(statistic.values[:, joint])
            lower = np.ascontiguousarray(band.lower[:, joint])
            upper = np.ascontiguousarray(band.upper[:, joint])
            status = np.ascontiguousarray(statistic.status[:, joint])
            outside = (value > upper) | (value < lower)
            for k in _raise_alarms(statistic.time, outside, status, self.samples(period), self.rearm):
                above = bool(value[k] > upper[k])
                limit = float(upper[k] if above else lower[k])
                side = "above" if above else "below"
                found.append(Alarm(float(statistic.time[k]), joint, side, float(value[k]), limit))  # type: ignore[arg-type]
        return tuple(sorted(found, key=lambda alarm: (alarm.time, alarm.joint)))


def _raise_alarms(
    time: FloatArray, outside: BoolArray, status: StatusArray, debounce: int, rearm: float
) -> npt.NDArray[np.int64]:
    if not outside.any():
        return np.empty(0, dtype=np.int64)
    at = np.empty(len(time), dtype=np.int64)
    count = _activate(np.ascontiguousarray(time), outside, status, debounce, rearm, at)
    return at[:count]


@kernel("int64(Array(float64, 1, 'C', readonly=True), b1[::1], uint8[::1], int64, float64, int64[::1])")
def _activate(
    time: FloatArray,
    outside: BoolArray,
    status: StatusArray,
    debounce: int,
    rearm: float,
    at: npt.NDArray[np.int64],
) -> int:
    alarms = 0
    count = 0
    armed = True
    inside_since = -1.0
    inside = False
    for k in range(len(time)):
        if status[k] == 3:
            continue
        out = outside[k] and status[k] == 0
        if armed:
            count = count + 1 if out else 0
            if count >= debounce:
                at[alarms] = k
                alarms += 1
                armed = False
                inside = False
        elif out:
            inside = False
        elif not inside:
            inside = True
            inside_since = time[k]
        elif time[k] - inside_since >= rearm:
            armed = True
            count = 0
    return alarms
