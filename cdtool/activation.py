"""Statistic x band -> alarms: debounce and re-arming. The same logic for every detector and threshold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.detection import Alarm, Band, Signal, StatusArray
from cdtool.errors import UsageError
from cdtool.kernels import READ_ONLY, kernel
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

    def alarms(self, statistic: Signal, band: Band) -> tuple[tuple[Alarm, ...], tuple[Alarm, ...]]:
        """Alarms, and all crossings (debounced exits from the band, armed or not), in order of time over all joints."""
        period = statistic.period
        alarms: list[Alarm] = []
        crossings: list[Alarm] = []
        for joint in range(statistic.values.shape[1]):
            value = np.ascontiguousarray(statistic.values[:, joint])
            lower = np.ascontiguousarray(band.lower[:, joint])
            upper = np.ascontiguousarray(band.upper[:, joint])
            status = np.ascontiguousarray(statistic.status[:, joint])
            outside = (value > upper) | (value < lower)
            at, armed = crossings_of(statistic.time, outside, status, self.samples(period), self.rearm)
            for k, was_armed in zip(at, armed, strict=True):
                above = bool(value[k] > upper[k])
                limit = float(upper[k] if above else lower[k])
                side = "above" if above else "below"
                crossing = Alarm(float(statistic.time[k]), joint, side, float(value[k]), limit)  # type: ignore[arg-type]
                crossings.append(crossing)
                if was_armed:
                    alarms.append(crossing)
        return _in_order(alarms), _in_order(crossings)


def _in_order(alarms: list[Alarm]) -> tuple[Alarm, ...]:
    return tuple(sorted(alarms, key=lambda alarm: (alarm.time, alarm.joint)))


def crossings_of(
    time: FloatArray, outside: BoolArray, status: StatusArray, debounce: int, rearm: float
) -> tuple[npt.NDArray[np.int64], BoolArray]:
    """The samples at which one joint's debounced exits from the band are raised, and whether each was armed."""
    at = np.empty(len(time) if outside.any() else 0, dtype=np.int64)
    armed = np.empty(len(at), dtype=np.bool_)
    count = _activate(np.ascontiguousarray(time), outside, status, debounce, rearm, at, armed) if len(at) else 0
    return at[:count], armed[:count]


@kernel(f"int64({READ_ONLY}, b1[::1], uint8[::1], int64, float64, int64[::1], b1[::1])")
def _activate(
    time: FloatArray,
    outside: BoolArray,
    status: StatusArray,
    debounce: int,
    rearm: float,
    at: npt.NDArray[np.int64],
    armed_at: BoolArray,
) -> int:
    crossings = 0
    count = 0
    armed = True
    inside = False
    inside_since = 0.0
    for k in range(len(time)):
        if status[k] == 3:
            continue
        if outside[k] and status[k] == 0:
            inside = False
            count += 1
            if count == debounce:
                at[crossings] = k
                armed_at[crossings] = armed
                crossings += 1
                armed = False
            continue
        count = 0
        if not inside:
            inside = True
            inside_since = time[k]
        elif time[k] - inside_since >= rearm:
            armed = True
    return crossings
