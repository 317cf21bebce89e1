"""Limits from the run's own first seconds in motion: no impact-free run is needed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, ClassVar, Self

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.base.settings import Positive, check, setting
from cdtool.detectors.detection import Band, Signal, Status
from cdtool.recordings.motion.evident_motion import evident_speed
from cdtool.recordings.recording import Recording
from cdtool.thresholds.settings import SafetyFactor, SidesOfMachine

# Below this share of the highest speed so far, a joint rests or starts: that is not its motion.
_SHARE = 0.1
# A sample stands for at most this long [s]: the signal between samples further apart was not seen.
_LONGEST_STEP = 0.25
# Quantiles need this many samples.
_FEWEST = 10
# The quantiles of a normal distribution that are one standard deviation from its mean.
_BELOW, _ABOVE = 0.158655, 0.841345
# Rounding of a sum of time steps [s].
_ROUNDING = 1e-9


@dataclass(frozen=True)
class FittedBaseline:
    """Median -+ `safety_factor` spreads of the signal in the joint's first `warm_up` [s] in motion, run by run.

    `per_run`: in a log that is cut, the limits are determined for each stroke.

    Parameters
    ----------
    warm_up : float
        How long a joint has to move before its limits are known [s].
    safety_factor : float
        Number of spreads from the median to the limit.
    sides : {"one", "two"}
        "one" monitors the side on which an obstacle opposes the present motion; at rest, the last one.
    widen : bool
        The limits widen with the square root of the time since the warm-up.

    Examples
    --------
    >>> from cdtool.recordings.recording import Series
    >>> time = 0.01 * np.arange(300)
    >>> run = Recording("run", "", ("axis",), {"speed": Series(time, np.full(300, 0.5), "m/s")})
    >>> values = np.where(np.arange(300) % 2 == 0, 9.0, 11.0)[:, np.newaxis]
    >>> signal = Signal(time, values, np.zeros((300, 1), dtype=np.uint8), "N")
    >>> statistic, band = FittedBaseline(warm_up=1.0, safety_factor=8.0).evaluate(run, signal)
    >>> round(float(time[statistic.valid[:, 0]][0]), 2), float(band.lower[-1, 0]), float(band.upper[-1, 0])
    (1.02, 2.0, 18.0)
    """

    warm_up: float
    safety_factor: float
    sides: str = "two"
    widen: bool = False

    per_run: ClassVar[bool] = True

    def with_safety_factor(self, factor: float) -> FittedBaseline:
        """Return the threshold with its limits at `factor` spreads."""
        return replace(self, safety_factor=factor)

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """Return the signal and its band.

        START_UP until a joint has moved for `warm_up`, and again if it later moves more than 10 times as fast as in
        that time. NO_LIMIT if the signal had no spread there. Raises RecordingError without a speed.
        """
        shape = signal.values.shape
        centre, spread = np.empty(shape), np.empty(shape)
        status = signal.status.copy()
        speeds = _speeds(recording, signal)
        opposed = np.zeros(shape)
        for j in range(shape[1]):
            values = np.ascontiguousarray(signal.values[:, j])
            usable = (status[:, j] == Status.VALID) & np.isfinite(values)
            status[(status[:, j] == Status.VALID) & ~usable, j] = Status.GAP
            column = np.empty((2, shape[0]))
            speed = np.abs(speeds[j])
            _first_seconds(signal.time, values, usable, speed, self.warm_up, self.widen, column[0], column[1])
            column[1][column[1] <= 1e-12 * np.abs(column[0])] = 0.0  # rounding errors
            opposed[:, j] = _last_direction(speeds[j]) if signal.signed else 1.0
            centre[:, j], spread[:, j] = column
            status[usable & np.isnan(column[0]), j] = Status.START_UP
            status[usable & (column[1] == 0.0), j] = Status.NO_LIMIT
        unknown = np.isnan(centre) | (spread == 0.0)
        width = np.where(unknown, np.nan, self.safety_factor * spread)
        one = self.sides == "one"
        lower = np.where(one & (opposed > 0.0) & ~unknown, -np.inf, centre - width)
        upper = np.where(one & (opposed < 0.0) & ~unknown, np.inf, centre + width)
        return signal.changed(status=status), Band(lower, upper)

    def to_dict(self) -> dict[str, Any]:
        """Return the threshold as JSON values."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the threshold that `to_dict` has written."""
        return cls(
            float(values["warm_up"]), float(values["safety_factor"]), str(values["sides"]), bool(values["widen"])
        )


@dataclass(frozen=True)
class Baseline:
    """Constant limits per run and joint, from the run's own first seconds in motion; nothing is learned before.

    Raises
    ------
    UsageError
        A number is not above 0, or `sides` is unknown.

    Notes
    -----
    |i - median| < safety_factor * spread, in the signal's unit, both over the first `warm_up` seconds in which the
    joint moves: robust against single outliers, causal, and frozen afterwards. For logs without impact-free runs of the
    same machine. Motion is a mean speed that its noise does not explain, above 10 % of the highest one so far. Fails
    (false alarms) if the signal varies more along the stroke than in its first seconds, as with unmodelled friction
    that changes sign, gravity, or a load; fails (no alarm) if the contact is within the warm-up: it is then part of
    what counts as normal, and a long contact as well as its end is not assessable.

    Examples
    --------
    >>> Baseline(warm_up=0.5).fit([])
    FittedBaseline(warm_up=0.5, safety_factor=10.0, sides='two', widen=False)
    """

    safety_factor: SafetyFactor = 10.0
    warm_up: Annotated[
        Positive,
        setting("how long a joint has to move before its limits are known", unit="s"),
    ] = 1.5
    sides: SidesOfMachine = None
    widen: Annotated[
        bool,
        setting(
            "multiply the spread by sqrt(1 + time since the warm-up / `warm_up`), as a random walk grows: fewer false "
            "alarms of a signal that wanders, and later alarms"
        ),
    ] = False

    name: ClassVar[str] = "baseline"
    needs: ClassVar[tuple[str, ...]] = ("speed",)
    fitted: ClassVar[tuple[type, ...]] = (FittedBaseline,)
    per_run: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check(self)

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedBaseline:  # noqa: ARG002  the contract's
        """Return the threshold; it needs no runs."""
        return FittedBaseline(self.warm_up, self.safety_factor, self.sides or "two", self.widen)


def _last_direction(speed: FloatArray) -> FloatArray:
    """Return the sign (n,) of the last speed that is not 0; 0 before the first one."""
    moving = np.maximum.accumulate(np.where(speed != 0.0, np.arange(len(speed)), 0))
    return np.sign(speed[moving])


def _speeds(recording: Recording, signal: Signal) -> list[FloatArray]:
    """Return for each column of the signal the speed (n,) of its joint where it moves, and 0 elsewhere.

    A column of the whole machine has the speed of its fastest joint.
    """
    speed = recording["speed"]
    evident: FloatArray = speed.derived("evident speed", lambda: evident_speed(speed))
    at = np.searchsorted(speed.time, signal.time, side="right") - 1
    recent = (at >= 0) & (signal.time - speed.time[np.maximum(at, 0)] <= _LONGEST_STEP) if len(speed) else at >= 0
    moving = np.where(recent[:, np.newaxis], evident[at], 0.0) if len(speed) else np.zeros((len(at), speed.joint_count))
    names = signal.joints or recording.joints
    if set(names) <= set(recording.joints) and len(names) == signal.values.shape[1]:
        return [np.ascontiguousarray(moving[:, recording.joints.index(name)]) for name in names]
    fastest = np.argmax(np.abs(moving), axis=1)
    return [moving[np.arange(len(moving)), fastest]] * signal.values.shape[1]


@kernel(
    f"void({READ_ONLY}, {READ_ONLY}, Array(bool, 1, 'C', readonly=True), {READ_ONLY}, float64, b1, "
    "float64[::1], float64[::1])",
)
def _first_seconds(  # noqa: C901, PLR0913  a kernel: one loop, arrays and scalars one by one
    time: FloatArray,
    values: FloatArray,
    usable: BoolArray,
    level: FloatArray,
    warm_up: float,
    widen: bool,
    centre: FloatArray,
    spread: FloatArray,
) -> None:
    """Fill median and spread (n,) of the first `warm_up` [s] in motion before each sample; NaN where unknown.

    A slower sample is dropped once the joint has moved faster. With `widen` the spread grows with the time since then.
    """
    picked = np.empty(len(time))
    picked_level = np.empty(len(time))
    picked_step = np.empty(len(time))
    count, seconds, highest = 0, 0.0, 0.0
    middle, width, since = math.nan, math.nan, 0.0
    for k in range(len(time)):
        centre[k], spread[k] = middle, width
        if widen:
            spread[k] = width * math.sqrt(1.0 + (time[k] - since) / warm_up)
        if not math.isnan(middle):
            if level[k] <= highest / _SHARE:
                continue
            middle, width = math.nan, math.nan
            centre[k], spread[k] = middle, width
            count, seconds = 0, 0.0
        if not usable[k] or level[k] <= 0.0:
            continue
        highest = max(highest, level[k])
        if level[k] < _SHARE * highest:
            continue
        step = min(time[k] - time[k - 1], _LONGEST_STEP) if k > 0 else 0.0
        picked[count], picked_level[count], picked_step[count] = values[k], level[k], step
        count += 1
        seconds += step
        if seconds < warm_up - _ROUNDING or count < _FEWEST:
            continue
        kept, seconds = 0, 0.0
        for i in range(count):
            if picked_level[i] >= _SHARE * highest:
                picked[kept], picked_level[kept], picked_step[kept] = picked[i], picked_level[i], picked_step[i]
                kept += 1
                seconds += picked_step[i]
        count = kept
        if seconds >= warm_up - _ROUNDING and count >= _FEWEST:
            middle = np.quantile(picked[:count], 0.5)
            since = time[k]
            width = 0.5 * (np.quantile(picked[:count], _ABOVE) - np.quantile(picked[:count], _BELOW))
