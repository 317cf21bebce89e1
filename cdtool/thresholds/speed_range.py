"""A signature for all speeds between those learned: the bands of neighbouring classes, interpolated over speed.

At the speed v that the run has had so far (see `recordings.motion.speed_range`), between classes with nominal speeds
n_1 and n_2, at the same location of the stroke::

    w = (v - n_1) / (n_2 - n_1)
    mean = (1 - w) m_1 + w m_2
    spread^2 = ((1 - w) s_1 + w s_2)^2 + (c w (1 - w) (m_2 - m_1))^2,   c = 4 * 0.5 / 5.5

The last term is for friction that is not linear in speed: halfway, at the default safety factor, the limit is half of
the means' difference further, which no friction that only rises or only falls from one speed to the other exceeds.
Between its minimum and a learned speed, friction may be lower than that: a contact is then detected later.

While the speed is not known, and where the classes do not run alike, the band holds the bands of all of them: from the
lowest mean to the highest, with the largest spread. From when the slowest class runs, it returns to that from what it
was before with a time constant of 0.05 s: a run at another speed ends its acceleration at another time, in between.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.derived import SendsFields
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.detectors.detection import Band, Signal, Status
from cdtool.recordings.motion.progress import Progress
from cdtool.recordings.motion.speed_range import SpeedRange, in_ranges
from cdtool.recordings.recording import Recording
from cdtool.thresholds.base import Evaluable
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.running_level_kernel import follow_level

# Spread for friction that is not linear: this times w (1 - w) times the difference of the means.
CURVATURE = 4.0 * 0.5 / 5.5
# What was held of the band is released with this time constant [s].
RELEASE = 0.05

_TABLES = "Array(float64, 3, 'C', readonly=True)"


@dataclass(frozen=True)
class SignatureOverSpeeds(SendsFields):
    """The signatures of two or more classes of one direction and joint, and the speeds between them.

    It is made of what a signature file holds, see `over_speeds`, and not stored itself.
    """

    signatures: tuple[FittedSignature, ...]
    safety_factor: float

    @cached_property
    def motion(self) -> SpeedRange:
        """The classes and the speeds between them."""
        return SpeedRange(tuple(item.motion for item in self.signatures))

    def with_safety_factor(self, factor: float) -> SignatureOverSpeeds:
        """Return it with its limits at `factor` spreads from the mean."""
        return replace(self, safety_factor=factor)

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """Return the signal and its band on the signal's clock; as `FittedSignature.evaluate`.

        An adaptive level learns only while the speed is known.
        """
        slowest = self.signatures[0]
        slowest.check_joints(signal)
        shape = signal.values.shape
        flat = np.ascontiguousarray(signal.status).reshape(-1)
        means, spreads = np.empty((2, len(self.signatures), *shape))
        for number, item in enumerate(self.signatures):
            at = item.progress(recording, signal.time)
            running = at.elapsed >= self.motion.running_from(number)
            means[number], spreads[number] = item.normal(Progress(at.elapsed, at.travel, running), flat)
            if not number:
                slowest_runs = running
        speed = self.motion.speed_so_far(recording, signal.time)
        lowest, highest, spread = np.empty(shape), np.empty(shape), np.empty(shape)
        interpolate(signal.time, speed, slowest_runs, self._nominal, means, spreads, lowest, highest, spread)
        reach = self.safety_factor * spread
        lower, upper = lowest - reach, highest + reach
        known = np.isfinite(spread)
        status = np.where(known | (signal.status != Status.VALID), signal.status, np.uint8(Status.NO_LIMIT))
        if slowest.side > 0:
            lower[known] = -np.inf
        elif slowest.side < 0:
            upper[known] = np.inf
        if slowest.adaptive_level > 0.0:
            teaches = np.where(np.isnan(speed)[:, np.newaxis], np.uint8(Status.NO_LIMIT), status)
            values, middle = np.ascontiguousarray(signal.values), 0.5 * (lowest + highest)
            follow_level(signal.time, values, middle, spread, teaches, slowest.adaptive_level, lower, upper)
        return signal.changed(status=status), Band(lower, upper)

    @cached_property
    def _nominal(self) -> FloatArray:
        return np.array([item.motion.nominal_speed for item in self.signatures])


def over_speeds(thresholds: Sequence[Evaluable]) -> tuple[Evaluable, ...]:
    """Return the thresholds that apply to a log: signatures of neighbouring speeds with `speed_range` become one.

    Parameters
    ----------
    thresholds : sequence of Evaluable
        The fitted thresholds of a signature file, one per class of motion.

    Returns
    -------
    tuple of Evaluable
        Those of a direction and joint with a single class, and those without `speed_range`, as they are.

    Examples
    --------
    >>> from cdtool.thresholds.limit import Limit
    >>> limit = Limit.given([400.0])
    >>> over_speeds([limit]) == (limit,)
    True
    """
    own = [item for item in thresholds if isinstance(item, FittedSignature) and item.speed_range and item.motion.course]
    ranges: dict[int, SignatureOverSpeeds] = {}
    for numbers in in_ranges([item.motion for item in own]):
        # A file that holds a class twice has no speeds between the two.
        if len({own[number].motion.nominal_speed for number in numbers}) == len(numbers) > 1:
            members = tuple(own[number] for number in numbers)
            made = SignatureOverSpeeds(members, members[0].safety_factor)
            ranges.update((id(item), made) for item in members)
    applied: list[Evaluable] = []
    for item in thresholds:
        found = ranges.get(id(item), item)
        if not any(found is other for other in applied):
            applied.append(found)
    return tuple(applied)


@kernel(
    f"void({READ_ONLY}, {READ_ONLY}, Array(bool, 1, 'C', readonly=True), {READ_ONLY}, {_TABLES}, {_TABLES}, "
    "float64[:,::1], float64[:,::1], float64[:,::1])",
)
def interpolate(  # noqa: PLR0913  a kernel: one loop, arrays one by one
    time: FloatArray,
    speed: FloatArray,
    slowest_runs: BoolArray,
    nominal: FloatArray,
    means: FloatArray,
    spreads: FloatArray,
    lowest: FloatArray,
    highest: FloatArray,
    spread: FloatArray,
) -> None:
    """Fill lowest and highest mean and the spread (n, J) at a `speed` (n,) between the `nominal` ones (m,).

    `means` and `spreads` (m, n, J): those of the classes at each sample. Without a speed those of all of them count,
    and once the slowest class runs, a rest of what counted since then.
    """
    for j in range(lowest.shape[1]):
        held_low, held_high, held_spread = np.inf, -np.inf, 0.0
        for k in range(len(speed)):
            if np.isnan(speed[k]):
                low, high, wide = means[0, k, j], means[0, k, j], spreads[0, k, j]
                for i in range(1, len(nominal)):
                    # NaN if any is, whatever the order.
                    low = means[i, k, j] if means[i, k, j] < low or np.isnan(means[i, k, j]) else low
                    high = means[i, k, j] if means[i, k, j] > high or np.isnan(means[i, k, j]) else high
                    wide = spreads[i, k, j] if spreads[i, k, j] > wide or np.isnan(spreads[i, k, j]) else wide
                if slowest_runs[k] and not np.isnan(wide):
                    # What was held returns to what counts now, by a first-order lag.
                    past = math.exp((time[k - 1] - time[k]) / RELEASE) if k else 0.0
                    held_low = min(low, low + past * (held_low - low)) if held_spread > 0.0 else low
                    held_high = max(high, high + past * (held_high - high)) if held_spread > 0.0 else high
                    held_spread = max(wide, wide + past * (held_spread - wide))
                    low, high, wide = held_low, held_high, held_spread
            else:
                held_low, held_high, held_spread = np.inf, -np.inf, 0.0
                i = 1
                while i < len(nominal) - 1 and nominal[i] < speed[k]:
                    i += 1
                weight = (speed[k] - nominal[i - 1]) / (nominal[i] - nominal[i - 1])
                if weight <= 0.0 or weight >= 1.0:
                    at = i if weight >= 1.0 else i - 1
                    low, wide = means[at, k, j], spreads[at, k, j]
                else:
                    step = means[i, k, j] - means[i - 1, k, j]
                    low = means[i - 1, k, j] + weight * step
                    even = spreads[i - 1, k, j] + weight * (spreads[i, k, j] - spreads[i - 1, k, j])
                    wide = np.hypot(even, CURVATURE * weight * (1.0 - weight) * step)
                high = low
            lowest[k, j], highest[k, j], spread[k, j] = low, high, wide
