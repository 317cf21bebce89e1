"""The signal's deviation from its signature, whitened: what the samples before do not foretell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from cdtool.detection import Signal, Status
from cdtool.errors import NothingValidError
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import FloatArray, Recording
from cdtool.thresholds.autoregression import burg, forecast_spread
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.sample_rate import at_learned_rate
from cdtool.thresholds.signature import Signature
from cdtool.thresholds.statistic_limit import common_period
from cdtool.thresholds.stretches import filtered, stretch_bounds, stretches

# A forecast over more missing samples than this says nothing: the model starts anew.
LONGEST_GAP = 20


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
        """From impact-free runs of one class; raises SignatureError as the signature does, and where nothing varies."""
        # Both sides and one spread: mean and spread are the middle and half the width of its band.
        signature = replace(rule, sides="two", safety_factor=1.0).fit(pairs)
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
        """nu_k / sd(nu), in standard deviations, causal; NO_LIMIT where the signature knows none.

        A missing sample is forecast, and the sample behind it divided by the forecast's larger spread; a gap above 20
        periods starts the model anew, with as many START_UP samples as its order. OTHER_RATE where the log is sampled
        at another rate than the runs so far: learn from runs of the same rate.
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
        spread = self.spread[j] * forecast_spread(coefficients, LONGEST_GAP + 1)

        def whiten(values: FloatArray, step: FloatArray) -> FloatArray:
            slots = np.where(np.isinf(step), 0.0, np.clip(np.rint(step / self.period), 1.0, LONGEST_GAP + 1.0))
            result = np.empty(len(values))
            _whiten(values, slots.astype(np.int64), coefficients, spread, result)
            return result

        one = replace(deviation, values=deviation.values[:, [j]], status=deviation.status[:, [j]])
        return filtered(one, whiten, self.longest_gap, (order - 0.5) * self.period, "1")

    @property
    def longest_gap(self) -> float:
        """The step over 20 missing samples and a half: a longer one starts the model anew [s]."""
        return (LONGEST_GAP + 1.5) * self.period

    def to_dict(self) -> dict[str, Any]:
        """As JSON values."""
        return {
            "signature": self.signature.to_dict(),
            "coefficients": self.coefficients.tolist(),
            "spread": self.spread.tolist(),
            "period": self.period,
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse of `to_dict`."""
        return cls(
            signature=FittedSignature.from_dict(values["signature"]),
            coefficients=np.array(values["coefficients"], dtype=np.float64),
            spread=np.array(values["spread"], dtype=np.float64),
            period=float(values["period"]),
        )


def _deviation(signature: FittedSignature, recording: Recording, signal: Signal) -> Signal:
    """(i - mu(x)) / s(x), NO_LIMIT where no band is known.

    START_UP at the sample where the signature changes from one curve to another: the model starts anew behind it, since
    a jump of the mean would look like a contact.
    """
    statistic, band = signature.evaluate(recording, signal)
    middle, reach = 0.5 * (band.upper + band.lower), 0.5 * (band.upper - band.lower)
    status = statistic.status.copy()
    status[signature.changes_curve(recording, signal.time)] = Status.START_UP
    with np.errstate(invalid="ignore", divide="ignore"):
        return replace(statistic, values=(signal.values - middle) / reach, status=status)


def _unbroken(deviation: Signal, j: int, period: float) -> list[FloatArray]:
    """The stretches of one column without a missing sample."""
    usable = (deviation.status[:, j] == Status.VALID) & np.isfinite(deviation.values[:, j])
    part = stretches(deviation.time, usable, ~usable, 1.5 * period)
    values = deviation.values[part.index, j]
    return [values[first:last] for first, last in stretch_bounds(part.step)]


@kernel(f"void({READ_ONLY}, int64[::1], {READ_ONLY}, {READ_ONLY}, float64[::1])")
def _whiten(
    values: FloatArray,
    slots: npt.NDArray[np.int64],
    coefficients: FloatArray,
    spread: FloatArray,
    result: FloatArray,
) -> None:
    """`slots`: periods since the sample before, 0 at a start. In the past a forecast stands for a missing sample."""
    order = len(coefficients)
    past = np.zeros(order)
    for k in range(len(values)):
        if slots[k] == 0:
            past[:] = 0.0
        forecast = 0.0
        for slot in range(max(slots[k], 1)):
            if slot > 0:
                for i in range(order - 1, 0, -1):
                    past[i] = past[i - 1]
                past[0] = forecast
            forecast = 0.0
            for i in range(order):
                forecast += coefficients[i] * past[i]
        result[k] = (values[k] - forecast) / spread[max(slots[k], 1) - 1]
        for i in range(order - 1, 0, -1):
            past[i] = past[i - 1]
        past[0] = values[k]
