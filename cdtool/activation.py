"""Derive alarms from a statistic and its band by debounce and re-arming, identically for all detectors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypedDict

import numpy as np
import numpy.typing as npt

from cdtool.clock.recent_steps import usual_steps
from cdtool.detection import Alarm, Band, Signal, Status, StatusArray
from cdtool.errors import UsageError
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray

# Default time outside the band before an alarm [s]: 9 samples at 1 kHz.
DEBOUNCE_TIME = 9e-3
# Number of samples searched first for the re-arming of an alarm.
_LOOKED_AT = 4096
_MOST_DEBOUNCE = 1_000_000_000


class ActivationSettings(TypedDict, total=False):
    """Settings that differ from those of an Activation; None leaves a setting unchanged."""

    debounce: int | None
    rearm: float | None
    hysteresis: float | None
    latch: bool | None


@dataclass(frozen=True)
class Activation:
    """Settings: `debounce` consecutive samples outside the band raise an alarm; `rearm` seconds inside re-arm it.

    A missing sample is skipped: it neither counts nor interrupts the sequence, so that a flaky sensor cannot hide a
    contact. A sample to which the method does not apply interrupts it. The alarm's time is that of the last sample
    counted. `hysteresis` h: only samples within the band of (1 - h) times the safety factor count as inside, so that a
    signal at its limit raises a single alarm. `latch`: a joint's alarm remains until the operation ends and is its only
    one.
    """

    debounce: int | None = None
    rearm: float = 0.5
    hysteresis: float = 0.0
    latch: bool = False

    def __post_init__(self) -> None:
        if self.debounce is not None and not 1 <= self.debounce <= _MOST_DEBOUNCE:
            raise UsageError(
                f"debounce is {self.debounce}", f"give a whole number of samples from 1 to {_MOST_DEBOUNCE}"
            )
        if not 0.0 <= self.rearm < math.inf:
            raise UsageError(
                f"rearm is {self.rearm:g}", "give seconds, at least 0; with latch an alarm is never re-armed"
            )
        if not 0.0 <= self.hysteresis < 1.0:
            raise UsageError(
                f"hysteresis is {self.hysteresis:g}", "give a share of the safety factor, from 0 to below 1"
            )

    @property
    def wait(self) -> float:
        """Return the seconds inside the band after which an alarm is re-armed; infinite if it latches."""
        return math.inf if self.latch else self.rearm

    @property
    def described(self) -> dict[str, int | float | bool | None]:
        """Return the settings as stored in results; None for the default debounce."""
        return {
            "debounce_samples": self.debounce,
            "rearm_s": self.rearm,
            "hysteresis": self.hysteresis,
            "latch": self.latch,
        }

    def changed(self, settings: ActivationSettings) -> Activation:
        """Return the activation changed by `settings`."""
        given: dict[str, Any] = {name: value for name, value in settings.items() if value is not None}
        return replace(self, **given)

    def samples(self, period: float) -> int:
        """Return the nominal debounce in samples for a signal of that period [s]; `needed` has the actual one."""
        if self.debounce is not None:
            return self.debounce
        return max(1, round(DEBOUNCE_TIME / period)) if period > 0.0 else 1

    def needed(self, time: FloatArray) -> npt.NDArray[np.int64]:
        """Return the debounce in samples (n,) at each time [s] of a signal, from the sample period so far.

        The first sample, before which no period is known, never suffices.
        """
        if self.debounce is not None:
            return np.full(len(time), self.debounce, dtype=np.int64)
        needed = np.full(len(time), 2, dtype=np.int64)
        if len(time) > 1:
            needed[1:] = np.maximum(np.rint(DEBOUNCE_TIME / usual_steps(time)[1:]), 1.0)
        return needed

    def alarms(
        self, statistic: Signal, band: Band, inner: Band | None = None, begins: Sequence[float] = ()
    ) -> tuple[tuple[Alarm, ...], tuple[Alarm, ...]]:
        """Return alarms and all crossings (debounced exits from the band, armed or not) of all joints, in time order.

        `inner`: the band within which an alarm is re-armed, with hysteresis; `begins` [s]: start of operations, at
        which every alarm is re-armed.
        """
        needed = self.needed(statistic.time)
        fresh = begins_at(statistic.time, begins)
        alarms: list[Alarm] = []
        crossings: list[Alarm] = []
        for joint in range(statistic.values.shape[1]):
            value = np.ascontiguousarray(statistic.values[:, joint])
            lower = np.ascontiguousarray(band.lower[:, joint])
            upper = np.ascontiguousarray(band.upper[:, joint])
            status = np.ascontiguousarray(statistic.status[:, joint])
            outside = (value > upper) | (value < lower)
            calm = ~outside
            if inner is not None:
                calm &= ~((value > inner.upper[:, joint]) | (value < inner.lower[:, joint]))
            at, armed = crossings_of(statistic.time, outside, calm, status, needed, self.wait, fresh)
            for k, was_armed in zip(at, armed, strict=True):
                above = bool(value[k] > upper[k])
                limit = float(upper[k] if above else lower[k])
                side = "above" if above else "below"
                crossing = Alarm(float(statistic.time[k]), joint, side, float(value[k]), limit)  # type: ignore[arg-type]
                crossings.append(crossing)
                if was_armed:
                    alarms.append(crossing)
        return _in_order(alarms), _in_order(crossings)

    def rearmed(
        self,
        statistic: Signal,
        band: Band,
        alarms: Sequence[Alarm],
        inner: Band | None = None,
        begins: Sequence[float] = (),
    ) -> tuple[float, ...]:
        """Return when each of its alarms was re-armed [s], by the rule of `alarms`; infinite if it was not."""
        fresh = statistic.time[begins_at(statistic.time, begins)].tolist()
        again = []
        for alarm in alarms:
            begun = next((time for time in fresh if time > alarm.time), math.inf)
            again.append(min(self._calm_again(statistic, band, alarm, inner), begun))
        return tuple(again)

    def _calm_again(self, statistic: Signal, band: Band, alarm: Alarm, inner: Band | None) -> float:
        """Return when the value had been inside for long enough after an alarm [s]; usually soon after it."""
        first, count, length = int(np.searchsorted(statistic.time, alarm.time)), len(statistic.time), _LOOKED_AT
        while math.isfinite(self.wait):
            rows = slice(first, min(first + length, count))
            at = self._calm_within(statistic, band, alarm.joint, inner, rows)
            if math.isfinite(at) or rows.stop == count:
                return at
            length *= 4
        return math.inf

    def _calm_within(self, statistic: Signal, band: Band, joint: int, inner: Band | None, rows: slice) -> float:
        known = rows.start + np.flatnonzero(statistic.status[rows, joint] != Status.GAP)
        value, time = statistic.values[known, joint], statistic.time[known]
        outside = (value > band.upper[known, joint]) | (value < band.lower[known, joint])
        if inner is not None:
            outside |= (value > inner.upper[known, joint]) | (value < inner.lower[known, joint])
        outside &= statistic.status[known, joint] == Status.VALID
        # For each sample inside, the first one since the value was last outside.
        places = np.arange(len(known))
        since = np.minimum(np.maximum.accumulate(np.where(outside, places, -1)) + 1, len(known) - 1)
        armed = np.flatnonzero(~outside & (places > since) & (time - time[since] >= self.wait))
        return float(time[armed[0]]) if len(armed) else math.inf


def begins_at(time: FloatArray, begins: Sequence[float]) -> BoolArray:
    """Return (n,) True at the first sample of each operation that begins at `begins` [s]."""
    fresh = np.zeros(len(time), dtype=bool)
    at = np.searchsorted(time, begins, side="left") if len(begins) else np.empty(0, dtype=np.intp)
    fresh[at[at < len(time)]] = True
    return fresh


def _in_order(alarms: list[Alarm]) -> tuple[Alarm, ...]:
    return tuple(sorted(alarms, key=lambda alarm: (alarm.time, alarm.joint)))


def crossings_of(
    time: FloatArray,
    outside: BoolArray,
    calm: BoolArray,
    status: StatusArray,
    needed: npt.NDArray[np.int64],
    rearm: float,
    fresh: BoolArray,
) -> tuple[npt.NDArray[np.int64], BoolArray]:
    """Return the samples at which a joint's debounced exits from the band are raised, and whether each was armed.

    `calm`: where the value is far enough inside to count towards the `rearm` seconds; `needed` (n,): the debounce in
    samples; `fresh`: where an operation begins.
    """
    at = np.empty(len(time) if outside.any() else 0, dtype=np.int64)
    armed = np.empty(len(at), dtype=np.bool_)
    clock = np.ascontiguousarray(time)
    count = _activate(clock, outside, calm, status, needed, rearm, fresh, at, armed) if len(at) else 0
    return at[:count], armed[:count]


@kernel(f"int64({READ_ONLY}, b1[::1], b1[::1], uint8[::1], int64[::1], float64, b1[::1], int64[::1], b1[::1])")
def _activate(  # noqa: PLR0913  kernels take arrays and scalars separately
    time: FloatArray,
    outside: BoolArray,
    calm: BoolArray,
    status: StatusArray,
    needed: npt.NDArray[np.int64],
    rearm: float,
    fresh: BoolArray,
    at: npt.NDArray[np.int64],
    armed_at: BoolArray,
) -> int:
    crossings = 0
    count = 0
    raised = False
    armed = True
    inside = False
    inside_since = 0.0
    for k in range(len(time)):
        if fresh[k]:
            armed = True
        if status[k] == Status.GAP:
            continue
        if outside[k] and status[k] == Status.VALID:
            inside = False
            count += 1
            if count >= needed[k] and not raised:
                raised = True
                at[crossings] = k
                armed_at[crossings] = armed
                crossings += 1
                armed = False
            continue
        count = 0
        raised = False
        # A value that is not assessable is not known to be outside: that time counts as before.
        if status[k] == Status.VALID and not calm[k]:
            inside = False
        elif not inside:
            inside = True
            inside_since = time[k]
        elif time[k] - inside_since >= rearm:
            armed = True
    return crossings
