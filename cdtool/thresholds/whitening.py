"""The signal's deviation from its signature, whitened: the part that previous samples do not predict.

Its autoregressive model is fitted by Burg's recursion over several sections of the runs.

The models learned last are kept (`_RECENT`): a search tries many rules on the same runs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.derived import Recent
from cdtool.base.errors import NothingValidError
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.detectors.detection import Signal, Status
from cdtool.recordings.clock.lost_samples import lost_samples
from cdtool.recordings.recording import Recording
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.sections import filtered, section_bounds, sections
from cdtool.thresholds.signature import Signature
from cdtool.thresholds.statistic_limit import common_period

# A cumulative statistic is kept over this many missing samples, or this long [s]: the evidence of a growing contact
# continues after a gap and does not restart.
_HELD_SAMPLES, _HELD_SECONDS = 20, 0.15
# The infinite sum is approximated by 2 to this power of its terms.
_DOUBLINGS = 24
# Sample periods differ from the learned one by at most this share: a model counts in samples.
PERIOD_TOLERANCE = 0.2
# The median of this many steps decides; while there are fewer than the second number, the rate is taken to be right.
_STEPS, _ENOUGH = 101, 20

# Two orders, each learned without one of five folds or from all runs.
_RECENT = Recent(12)


@dataclass(frozen=True)
class Whitening:
    """A signature for mean and spread, and an autoregressive model of the deviation from it.

    e = (i - mu(x)) / s(x), e_k = sum a_i e_{k-i} + nu_k: `coefficients` a (p, J), `spread` the standard deviation (J,)
    of nu, `period` the runs' sample period [s].
    """

    signature: FittedSignature
    coefficients: FloatArray
    spread: FloatArray
    period: float

    @classmethod
    def learned(cls, rule: Signature, order: int, pairs: Sequence[tuple[Recording, Signal]]) -> Self:
        """Learn from runs of one class; raises SignatureError as the signature does, and if nothing varies.

        Rules that differ in their statistic only, tried one after the other on the same signals, share one model.
        """
        return _RECENT.value(
            (cls, rule, order), [item for pair in pairs for item in pair], lambda: cls._of(rule, order, pairs)
        )

    @classmethod
    def _of(cls, rule: Signature, order: int, pairs: Sequence[tuple[Recording, Signal]]) -> Self:
        # Both sides and one spread: mean and spread are the middle and half the width of its band. A band that follows
        # its run would leave other innovations than those that were learned.
        signature = replace(rule, sides="two", safety_factor=1.0, adaptive_level=0.0, speed_range=False).fit(pairs)
        period = common_period(pairs)
        deviations = [_deviation(signature, recording, signal) for recording, signal in pairs]
        coefficients = np.zeros((order, deviations[0].values.shape[1]))
        spread = np.zeros(coefficients.shape[1])
        for j in range(len(spread)):
            parts = [part for deviation in deviations for part in _unbroken(deviation, j, period)]
            coefficients[:, j], spread[j] = burg(parts, order)
        if not (spread > 0.0).all():
            raise NothingValidError(
                "a joint's signal has no variation of its own in the runs", "another detector, or other joints"
            )
        return cls(signature, coefficients, spread, period)

    def innovations(self, recording: Recording, signal: Signal) -> Signal:
        """Return nu_k / sd(nu), in standard deviations, causal; NO_LIMIT where the signature has no limit.

        Samples based on a lost input or a lost position are missing (GAP). After a missing sample the model restarts
        from the normal spread: the first innovation is the deviation divided by that spread, and as many further ones
        as the order are divided by the remaining uncertainty, all VALID. At a start, as many samples as the order are
        START_UP. OTHER_RATE where the sample rate differs from that of the runs: learn from runs of the same rate.
        """
        at_rate = at_learned_rate(signal.time, self.period)
        deviation = _deviation(self.signature, recording, signal)
        off = deviation.valid & ~at_rate[:, np.newaxis]
        deviation = replace(deviation, status=np.where(off, Status.OTHER_RATE, deviation.status).astype(np.uint8))
        order = len(self.coefficients)
        columns = [self._column(deviation, j, order) for j in range(len(self.spread))]
        return replace(
            deviation,
            values=np.column_stack([item.values for item in columns]),
            status=np.column_stack([item.status for item in columns]),
            unit="1",
        )

    def _column(self, deviation: Signal, j: int, order: int) -> Signal:
        coefficients = np.ascontiguousarray(self.coefficients[:, j])
        # Where nothing is known, e varies as the signature says: at least by 1.
        stationary = _stationary_covariance(coefficients, least=1.0 / self.spread[j] ** 2)
        work = np.empty((2 * order, order))

        def whiten(values: FloatArray, step: FloatArray) -> FloatArray:
            slots = np.where(np.isinf(step), 0.0, np.clip(np.rint(step / self.period), 1.0, 2.0))
            result = np.empty(len(values))
            _whiten(values, slots.astype(np.int64), coefficients, self.spread[j], stationary, work, result)
            return result

        one = replace(deviation, values=deviation.values[:, [j]], status=deviation.status[:, [j]])
        return filtered(one, whiten, np.inf, (order - 0.5) * self.period, "1")

    @property
    def longest_gap(self) -> float:
        """The longest step over which the statistic of innovations continues [s]: 20 missing samples, or 0.15 s."""
        return max((_HELD_SAMPLES + 1.5) * self.period, _HELD_SECONDS)

    def to_dict(self) -> dict[str, Any]:
        """Return the model as JSON values."""
        return {
            "signature": self.signature.to_dict(),
            "coefficients": self.coefficients.tolist(),
            "spread": self.spread.tolist(),
            "period": self.period,
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the model that `to_dict` has written."""
        return cls(
            signature=FittedSignature.from_dict(values["signature"]),
            coefficients=np.array(values["coefficients"], dtype=np.float64),
            spread=np.array(values["spread"], dtype=np.float64),
            period=float(values["period"]),
        )


def _deviation(signature: FittedSignature, recording: Recording, signal: Signal) -> Signal:
    """Return (i - mu(x)) / s(x), NO_LIMIT where no band is known.

    START_UP at the sample where the signature changes from one curve to another: the model restarts after it, because a
    jump of the mean would look like a contact.
    """
    statistic, band = signature.evaluate(recording, signal)
    middle, reach = 0.5 * (band.upper + band.lower), 0.5 * (band.upper - band.lower)
    status = statistic.status.copy()
    lost = lost_in_deviation(signature, recording, signal)
    if lost is not None:
        status[lost & (status == Status.VALID)] = Status.GAP
    status[signature.changes_curve(recording, signal.time)] = Status.START_UP
    with np.errstate(invalid="ignore", divide="ignore"):
        return replace(statistic, values=(signal.values - middle) / reach, status=status)


def lost_in_deviation(signature: FittedSignature, recording: Recording, signal: Signal) -> BoolArray | None:
    """Return where the deviation is based on held values (n, J): a detector input, or the position along the stroke.

    A model that predicts each sample to a small fraction of the normal spread distinguishes a held value from a true
    one.
    """
    lost = signal.lost
    if signature.alignment != "time":
        at = lost_samples(recording, ("position",), signal.time)
        if at is not None:
            where = np.repeat(at[:, [signature.motion.joint]], signal.values.shape[1], axis=1)
            lost = where if lost is None else lost | where
    return lost


def _unbroken(deviation: Signal, j: int, period: float) -> list[FloatArray]:
    """Return the sections of one column without a missing sample."""
    usable = (deviation.status[:, j] == Status.VALID) & np.isfinite(deviation.values[:, j])
    part = sections(deviation.time, usable, ~usable, 1.5 * period)
    values = deviation.values[part.index, j]
    return [values[first:last] for first, last in section_bounds(part.step)]


@kernel(f"void({READ_ONLY}, int64[::1], {READ_ONLY}, float64, float64[:, ::1], float64[:, ::1], float64[::1])")
def _whiten(  # noqa: C901  a kernel is one loop
    values: FloatArray,
    slots: npt.NDArray[np.int64],
    coefficients: FloatArray,
    spread: float,
    stationary: FloatArray,
    work: FloatArray,
    result: FloatArray,
) -> None:
    """Fill the innovations over their normal spread; `work` (2 p, p) is overwritten.

    `slots`: periods since the sample before: 0 at a start, 1, or 2 for more than one.

    The last p values of e are the state of a Kalman filter; where all of them were samples it is known exactly. After
    a lost sample it is not: the detector has missed it too, and deviates from the model. The state restarts from the
    normal spread, `stationary` (p, p), and each sample corrects it: after p consecutive samples it is exact again.
    Covariances are in units of the variance of nu; that of the innovation is P[0, 0].
    """
    order = len(coefficients)
    past = np.zeros(order)
    covariance, moved = work[:order], work[order:]
    observed = order
    for k in range(len(values)):
        if slots[k] != 1:
            for i in range(order):
                past[i] = 0.0
            observed = order
        if slots[k] > 1:
            for i in range(order):
                for j in range(order):
                    covariance[i, j] = stationary[i, j]
            observed = 0
        forecast = 0.0
        for i in range(order):
            forecast += coefficients[i] * past[i]
        if 0 < observed < order:
            # P <- F P F' + Q. F shifts the state by one and puts the forecast on top: first from the left.
            for j in range(order):
                top = 0.0
                for i in range(order):
                    top += coefficients[i] * covariance[i, j]
                moved[0, j] = top
                for i in range(1, order):
                    moved[i, j] = covariance[i - 1, j]
            for i in range(order):
                top = 0.0
                for j in range(order):
                    top += coefficients[j] * moved[i, j]
                covariance[i, 0] = top
                for j in range(1, order):
                    covariance[i, j] = moved[i, j - 1]
            covariance[0, 0] += 1.0
        fault = values[k] - forecast
        for i in range(order - 1, 0, -1):
            past[i] = past[i - 1]
        if observed >= order:
            result[k] = fault / spread
        else:
            variance = covariance[0, 0]
            result[k] = fault / (spread * math.sqrt(variance))
            for i in range(1, order):
                past[i] += covariance[i, 0] / variance * fault
            for i in range(order - 1, -1, -1):
                gain = covariance[i, 0] / variance
                for j in range(order - 1, -1, -1):
                    covariance[i, j] -= gain * covariance[0, j]
            observed += 1
        past[0] = values[k]


def burg(parts: Sequence[FloatArray], order: int) -> tuple[FloatArray, float]:
    """Return coefficients (order,) of e_k = sum a_i e_{k-i} + nu_k and the standard deviation of nu, from parts of e.

    Burg's recursion with forward and backward errors summed over all sections; sections of at most `order` samples are
    left out. The model is stable by construction. The standard deviation is NaN if no section is long enough.
    """
    long = [part for part in parts if len(part) > order]
    if not long:
        return np.zeros(order), math.nan
    ends = np.cumsum([len(part) for part in long])
    coefficients = np.empty(order)
    return coefficients, _burg(np.concatenate(long), np.concatenate(long), ends, coefficients)


@kernel("float64(float64[::1], float64[::1], int64[::1], float64[::1])")
def _burg(forward: FloatArray, backward: FloatArray, ends: npt.NDArray[np.int64], coefficients: FloatArray) -> float:
    """Fill the coefficients (order,), and return the standard deviation of the forward errors that are left.

    `forward` and `backward`: the sections one after the other, overwritten by their errors; `ends`: one past the last
    sample of each.
    """
    order = len(coefficients)
    before = np.empty(order)
    power, number = 0.0, 0
    for p in range(1, order + 1):
        # The error of order p - 1 at sample k and, backward, at the sample before.
        crossed = energy = 0.0
        begin = 0
        for end in ends:
            for k in range(begin + p, end):
                f, b = forward[k], backward[k - 1]
                crossed += f * b
                energy += f * f + b * b
            begin = end
        reflection = -2.0 * crossed / energy if energy > 0.0 else 0.0
        for i in range(p - 1):
            before[i] = coefficients[i]
        for i in range(p - 1):
            coefficients[i] = before[i] + reflection * before[p - 2 - i]
        coefficients[p - 1] = -reflection
        power, number, begin = 0.0, 0, 0
        for end in ends:
            for k in range(end - 1, begin + p - 1, -1):
                f, b = forward[k], backward[k - 1]
                forward[k] = f + reflection * b
                backward[k] = b + reflection * f
                power += forward[k] * forward[k]
                number += 1
            begin = end
    return math.sqrt(power / number)


def _stationary_covariance(coefficients: FloatArray, least: float) -> FloatArray:
    """Return the covariance (p, p) of the last p values of e for a variance of 1 of nu.

    P = F P F' + Q is solved by doubling, and scaled up if the variance of e is below `least`. The model is stable.
    """
    order = len(coefficients)
    transition = np.eye(order, k=-1)
    transition[0] = coefficients
    covariance = np.zeros((order, order))
    covariance[0, 0] = 1.0
    for _ in range(_DOUBLINGS):
        covariance = covariance + transition @ covariance @ transition.T
        transition = transition @ transition
    scaled: FloatArray = covariance * max(1.0, least / float(covariance[0, 0]))
    return scaled


def at_learned_rate(time: FloatArray, period: float) -> BoolArray:
    """Return (n,) where the median of the steps so far, the last 101, lies within 20 % of `period` [s]. Causal.

    A median: lost samples and jitter do not move it.
    """
    steps = np.diff(time)
    long, short = steps > (1.0 + PERIOD_TOLERANCE) * period, steps < (1.0 - PERIOD_TOLERANCE) * period
    count = np.arange(1, len(steps) + 1)
    recent = np.minimum(count, _STEPS)
    right = np.ones(len(time), dtype=bool)
    for odd in (long, short):
        total = np.concatenate(([0], np.cumsum(odd)))
        right[1:] &= total[1:] - total[count - recent] <= 0.5 * np.maximum(recent, _ENOUGH)
    return right
