"""What the motion of impact-free runs excites."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.filtered_regression import FilteredRun

# A speed is held within this relative distance of it.
SAME_SPEED = 0.1
# With one or two speeds, the viscous friction of a real axis came out 20-60 % wrong.
SPEEDS_NEEDED = 3


@dataclass(frozen=True)
class Excitation:
    """What the motion of the runs excites; linear axes in m, rotary ones in rad.

    `speeds`: distinct speeds at which at least 5 % of the moving time is spent, in ascending order, without sign
    [m/s]. `forward_share`: of the moving time [-]. `highest_speed` [m/s]: the 99 % quantile of |speed|.
    `acceleration` [m/s2]: the root mean square while moving, and `acceleration_noise` that of the noise in it.
    `moving_time` [s]: of all runs.
    """

    speeds: tuple[float, ...]
    forward_share: float
    highest_speed: float
    acceleration: float
    acceleration_noise: float
    moving_time: float

    @property
    def is_one_way(self) -> bool:
        """Whether less than 5 % of the moving time is spent in one of the directions."""
        return min(self.forward_share, 1.0 - self.forward_share) < 0.05

    @property
    def is_accelerated(self) -> bool:
        """Whether the acceleration is more than its noise."""
        # The root mean square, noise included, must be 10 % above that of the noise.
        return self.acceleration > 1.1 * self.acceleration_noise


def measure_excitation(runs: Sequence[FilteredRun]) -> Excitation:
    """Return what the motion of the runs excites; without any motion, speeds is empty and every number is 0.

    A sample moves where the regression can use it: the sign of the speed is known within reach of the low-pass.
    """
    columns = [np.zeros((4, 0))]
    for run in runs:
        moving = run.usable
        count = int(np.count_nonzero(moving))
        duration, noise = np.full(count, run.run.period), np.full(count, run.acceleration_noise)
        columns.append(np.vstack((run.speed[moving], run.acceleration[moving], duration, noise)))
    return excitation_of(*np.concatenate(columns, axis=1))


def excitation_of(speed: FloatArray, acceleration: FloatArray, duration: FloatArray, noise: FloatArray) -> Excitation:
    """Return what samples of motion excite (n,): speed, acceleration, time that each lasts [s], its noise or NaN."""
    total = float(np.sum(duration))
    if total <= 0.0:
        return Excitation((), 0.0, 0.0, 0.0, 0.0, 0.0)
    size, share = np.abs(speed), duration / total
    highest = float(np.quantile(size, 0.99))
    return Excitation(
        distinct_speeds(size, share),
        float(np.sum(share[speed > 0.0])),
        highest,
        math.sqrt(float(share @ acceleration**2)),
        math.sqrt(float(share @ noise**2)),
        total,
    )


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
        first = np.searchsorted(speed, speed * (1.0 - SAME_SPEED), side="left")
        last = np.searchsorted(speed, speed * (1.0 + SAME_SPEED), side="right")
        weight = cumulated[last] - cumulated[first]
        best = int(np.argmax(weight))
        if weight[best] < 0.05:  # a speed is held if 5 % of the moving time are spent within 10 % of it
            break
        near = slice(first[best], last[best])
        centre = float(np.average(speed[near], weights=share[near]))
        held.append(centre)
        # Held speeds are distinct if they differ by a quarter.
        kept = (speed < centre / 1.25) | (speed > centre * 1.25)
        speed, share = speed[kept], share[kept]
    return tuple(sorted(held))
