"""What the motion of impact-free runs excites, and what is missing for each parameter of a rigid axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.identification.estimate import Missing
from cdtool.identification.filtered_regression import FilteredRun
from cdtool.recording import FloatArray

# A speed is held if this share of the moving time is spent within this relative distance of it.
_HELD_SHARE, _SAME_SPEED = 0.05, 0.1
# Two held speeds are distinct if they differ by this factor.
_DISTINCT = 1.25
# With one or two speeds, the viscous friction of a real axis came out 20-60 % wrong.
SPEEDS_NEEDED = 3
# A direction counts if this share of the moving time is spent in it.
_DIRECTION_SHARE = 0.05
# The root mean square of the acceleration, noise included, must be this many times that of the noise.
_ABOVE_NOISE = 1.1
# Slow motion: below this share of the highest speed, for this share of the moving time.
_SLOW_SPEED, _SLOW_SHARE = 0.1, 0.01


@dataclass(frozen=True)
class Excitation:
    """What the motion of the runs excites; linear axes in m, rotary ones in rad.

    `speeds`: distinct speeds at which at least 5 % of the moving time is spent, in ascending order, without sign
    [m/s]. `forward_share`, `slow_share`: of the moving time [-]. `highest_speed` [m/s]: the 99 % quantile of |speed|.
    `acceleration` [m/s2]: the root mean square while moving, and `acceleration_noise` that of the noise in it.
    `travel` [m], `moving_time` [s]: of all runs. `strokes`: motions between rests and reversals; `reversals`: changes
    of direction within a run.
    """

    speeds: tuple[float, ...]
    forward_share: float
    slow_share: float
    highest_speed: float
    acceleration: float
    acceleration_noise: float
    travel: float
    moving_time: float
    strokes: int
    reversals: int

    @property
    def is_one_way(self) -> bool:
        """Whether less than 5 % of the moving time is spent in one of the directions."""
        return min(self.forward_share, 1.0 - self.forward_share) < _DIRECTION_SHARE

    @property
    def missing(self) -> tuple[Missing, ...]:
        """Return what the runs would need so that all parameters of a rigid axis could be identified."""
        missing: list[Missing] = []
        if len(self.speeds) < SPEEDS_NEEDED:
            missing.append(Missing.SECOND_SPEED)
        if self.is_one_way:
            missing.append(Missing.REVERSALS)
        if not self.acceleration > _ABOVE_NOISE * self.acceleration_noise:
            missing.append(Missing.ACCELERATION)
        if self.slow_share < _SLOW_SHARE:
            missing.append(Missing.SLOWER_MOTION)
        return tuple(missing)


def measure_excitation(runs: Sequence[FilteredRun]) -> Excitation:
    """Return what the motion of the runs excites; without any motion, speeds is empty and every number is 0.

    A sample moves where the regression can use it: the sign of the speed is known within reach of the low-pass.
    """
    columns = [np.zeros((4, 0))]
    strokes = reversals = 0
    for run in runs:
        moving = run.usable
        count = int(np.count_nonzero(moving))
        duration, noise = np.full(count, run.run.period), np.full(count, run.acceleration_noise)
        columns.append(np.vstack((run.speed[moving], run.acceleration[moving], duration, noise)))
        strokes += len(np.unique(run.stroke[moving]))
        reversals += _reversals(run)
    speed, acceleration, duration, noise = np.concatenate(columns, axis=1)
    return _measured(speed, acceleration, duration, noise, strokes, reversals)


def _measured(
    speed: FloatArray,
    acceleration: FloatArray,
    duration: FloatArray,
    noise: FloatArray,
    strokes: int,
    reversals: int,
) -> Excitation:
    total = float(np.sum(duration))
    if total <= 0.0:
        return Excitation((), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0)
    size, share = np.abs(speed), duration / total
    highest = float(np.quantile(size, 0.99))
    return Excitation(
        distinct_speeds(size, share),
        float(np.sum(share[speed > 0.0])),
        float(np.sum(share[size < _SLOW_SPEED * highest])),
        highest,
        math.sqrt(float(share @ acceleration**2)),
        math.sqrt(float(share @ noise**2)),
        float(size @ duration),
        total,
        strokes,
        reversals,
    )


def _reversals(run: FilteredRun) -> int:
    stroke = run.stroke
    direction = np.sign(run.inner_speed[stroke >= 0])
    return int(np.count_nonzero(np.diff(direction)))


def distinct_speeds(speed: FloatArray, share: FloatArray) -> tuple[float, ...]:
    """Return the distinct speeds that are held, ascending, from |speed| (n,) and the share of time (n,) of each sample.

    The speed with the most time within +-10 % comes first; what is within a factor 1.25 of it is taken out.

    Examples
    --------
    >>> import numpy as np
    >>> distinct_speeds(np.array([0.1, 0.1, 0.2, 0.2]), np.full(4, 0.25))
    (0.1, 0.2)
    """
    order = np.argsort(speed)
    speed, share = speed[order], share[order]
    held: list[float] = []
    while len(speed):
        cumulated = np.concatenate(([0.0], np.cumsum(share)))
        first = np.searchsorted(speed, speed * (1.0 - _SAME_SPEED), side="left")
        last = np.searchsorted(speed, speed * (1.0 + _SAME_SPEED), side="right")
        weight = cumulated[last] - cumulated[first]
        best = int(np.argmax(weight))
        if weight[best] < _HELD_SHARE:
            break
        near = slice(first[best], last[best])
        centre = float(np.average(speed[near], weights=share[near]))
        held.append(centre)
        kept = (speed < centre / _DISTINCT) | (speed > centre * _DISTINCT)
        speed, share = speed[kept], share[kept]
    return tuple(sorted(held))
