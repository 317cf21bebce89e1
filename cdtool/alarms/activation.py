"""Derive alarms from a statistic and its band by debounce and re-arming, identically for all detectors."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from msgspec import Meta

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.base.settings import NotNegative, check, setting
from cdtool.detectors.detection import Alarm, Band, Signal, Status, StatusArray
from cdtool.recordings.clock.recent_steps import usual_steps

# Default time outside the band before an alarm [s]: 9 samples at 1 kHz.
DEBOUNCE_TIME = 9e-3
#: More samples than any recording has.
_MOST_DEBOUNCE = 1_000_000_000

Debounce = Annotated[int, Meta(ge=1, le=_MOST_DEBOUNCE)]
ShareBelowOne = Annotated[float, Meta(ge=0.0, lt=1.0)]


@dataclass(frozen=True)
class Activation:
    """Settings: `debounce` consecutive samples outside the band raise an alarm; `rearm` seconds inside re-arm it.

    A missing sample is skipped: it neither counts nor interrupts the sequence, so that a flaky sensor cannot hide a
    contact. A sample to which the method does not apply interrupts it. The alarm's time is that of the last sample
    counted. `hysteresis` h: only samples within the band of (1 - h) times the safety factor count as inside, so that a
    signal at its limit raises a single alarm. `latch`: a joint's alarm remains until the operation ends and is its only
    one.
    """

    debounce: Annotated[
        Debounce | None, setting("consecutive samples outside the limits that raise the alarm; default: those of 9 ms")
    ] = None
    rearm: Annotated[
        NotNegative,
        setting(
            "time inside the limits after which the alarm re-arms",
            key="rearm_s",
            unit="s",
            hint="give seconds, at least 0; with latch an alarm is never re-armed",
        ),
    ] = 0.5
    hysteresis: Annotated[
        ShareBelowOne,
        setting(
            "to count as inside, the signal must be within the limits for (1 - hysteresis) times the safety factor: "
            "a signal that dwells at its limit is one alarm"
        ),
    ] = 0.0
    latch: Annotated[
        bool, setting("a joint's alarm remains active until the operation ends: at most one false alarm")
    ] = False

    def __post_init__(self) -> None:
        check(self)

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
        self,
        statistic: Signal,
        band: Band,
        inner: Band | None = None,
        begins: Sequence[float] = (),
        known_debounce: Callable[[], npt.NDArray[np.int64]] | None = None,
    ) -> tuple[tuple[Alarm, ...], tuple[Alarm, ...]]:
        """Return alarms and all crossings (debounced exits from the band, armed or not) of all joints, in time order.

        `inner`: the band within which an alarm is re-armed, with hysteresis; `begins` [s]: start of operations, at
        which every alarm is re-armed. `known_debounce` returns `needed` on the statistic's clock if it is stored; it is
        called where a value is outside.
        """
        alarms: list[Alarm] = []
        crossings: list[Alarm] = []
        time, nearer = statistic.time, inner or band
        for joint in range(statistic.values.shape[1]):
            value, lower, upper = (_column(item, joint) for item in (statistic.values, band.lower, band.upper))
            inner_lower, inner_upper = (_column(item, joint) for item in (nearer.lower, nearer.upper))
            outside = (value > upper) | (value < lower)
            if not outside.any():
                continue
            calm = ~(outside | (value > inner_upper) | (value < inner_lower))
            status = np.ascontiguousarray(statistic.status[:, joint])
            debounce = known_debounce() if known_debounce else self.needed(time)
            at, armed = crossings_of(time, outside, calm, status, debounce, self.wait, begins_at(time, begins))
            for k, was_armed in zip(at.tolist(), armed.tolist(), strict=True):
                statistic_then, highest = float(value[k]), float(upper[k])
                above = statistic_then > highest
                limit = highest if above else float(lower[k])
                side: Literal["above", "below"] = "above" if above else "below"
                crossing = Alarm(float(time[k]), statistic.name_of(joint), side, statistic_then, limit, joint)
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
        fresh = statistic.time[begins_at(statistic.time, begins)].tolist() if alarms and len(begins) else []
        again = []
        for alarm in alarms:
            begun = next((time for time in fresh if time > alarm.time), math.inf)
            again.append(min(self._calm_again(statistic, band, alarm, inner or band), begun))
        return tuple(again)

    def _calm_again(self, statistic: Signal, band: Band, alarm: Alarm, inner: Band) -> float:
        """Return when the value had been inside for long enough after an alarm [s]; usually soon after it."""
        if not math.isfinite(self.wait):
            return math.inf
        limits = (band.lower, band.upper, inner.lower, inner.upper)
        columns = (_column(item, alarm.column) for item in (statistic.values, *limits))
        status = np.ascontiguousarray(statistic.status[:, alarm.column])
        time = np.ascontiguousarray(statistic.time)
        return float(_calm_from(time, *columns, status, int(np.searchsorted(time, alarm.time)), self.wait))


def _column(values: FloatArray, joint: int) -> FloatArray:
    return np.ascontiguousarray(values[:, joint], dtype=np.float64)


@kernel(
    f"float64({READ_ONLY}, {READ_ONLY}, {READ_ONLY}, {READ_ONLY}, {READ_ONLY}, {READ_ONLY}, "
    "Array(uint8, 1, 'C', readonly=True), int64, float64)"
)
def _calm_from(  # noqa: PLR0913  kernels take arrays and scalars separately
    time: FloatArray,
    value: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    inner_lower: FloatArray,
    inner_upper: FloatArray,
    status: StatusArray,
    first: int,
    wait: float,
) -> float:
    """Return the first time from sample `first` on at which the value has been inside for `wait` [s]; else infinity."""
    inside = False
    inside_since = 0.0
    for k in range(first, len(time)):
        if status[k] == Status.GAP:
            continue
        beyond = value[k] > upper[k] or value[k] < lower[k] or value[k] > inner_upper[k] or value[k] < inner_lower[k]
        if beyond and status[k] == Status.VALID:
            inside = False
        elif not inside:
            inside = True
            inside_since = time[k]
        elif time[k] - inside_since >= wait:
            return float(time[k])
    return math.inf


def begins_at(time: FloatArray, begins: Sequence[float]) -> BoolArray:
    """Return (n,) True at the first sample of each operation that begins at `begins` [s]."""
    fresh = np.zeros(len(time), dtype=bool)
    at = np.searchsorted(time, begins, side="left") if len(begins) else np.empty(0, dtype=np.intp)
    fresh[at[at < len(time)]] = True
    return fresh


def _in_order(alarms: list[Alarm]) -> tuple[Alarm, ...]:
    return tuple(sorted(alarms, key=lambda alarm: (alarm.time, alarm.column)))


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
    # Nothing before the first sample outside counts: until then an alarm is armed.
    first = int(outside.argmax()) if len(outside) else 0
    at = np.empty(len(time) - first if len(outside) and outside[first] else 0, dtype=np.int64)
    armed = np.empty(len(at), dtype=np.bool_)
    clock = np.ascontiguousarray(time)
    count = _activate(clock, outside, calm, status, needed, rearm, fresh, first, at, armed) if len(at) else 0
    return at[:count], armed[:count]


@kernel(f"int64({READ_ONLY}, b1[::1], b1[::1], uint8[::1], int64[::1], float64, b1[::1], int64, int64[::1], b1[::1])")
def _activate(  # noqa: PLR0913  kernels take arrays and scalars separately
    time: FloatArray,
    outside: BoolArray,
    calm: BoolArray,
    status: StatusArray,
    needed: npt.NDArray[np.int64],
    rearm: float,
    fresh: BoolArray,
    first: int,
    at: npt.NDArray[np.int64],
    armed_at: BoolArray,
) -> int:
    crossings = 0
    count = 0
    raised = False
    armed = True
    inside = False
    inside_since = 0.0
    for k in range(first, len(time)):
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
