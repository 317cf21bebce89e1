"""Limits on the value that a polynomial predicts a few samples ahead (thesis 2.3.1)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from msgspec import Meta

from cdtool.base.arrays import FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.base.settings import NotNegative, check, setting
from cdtool.detectors.detection import Signal
from cdtool.recordings.recording import Recording
from cdtool.thresholds.sections import filtered
from cdtool.thresholds.settings import SafetyFactor, SidesOfMachine
from cdtool.thresholds.statistic_limit import FittedStatisticLimit, fit_statistic_limit

# What is left of the first samples' weight when the prediction is trusted.
_SETTLED = 0.01


@dataclass(frozen=True)
class PredictedLimit:
    """Constant limits on the prediction of the signal, by a polynomial fitted recursively.

    Raises
    ------
    UsageError
        A setting is unknown or outside its range.

    Notes
    -----
    Thesis 2.3.1. i(n) = theta_0 + theta_1 n + theta_2 n^2 with n = 0 at the newest sample, least squares with weight
    forgetting^age; the statistic is sum theta_j ahead^j, in the signal's unit. Steps are measured. Limits are learned
    as those of `Limit`, on the predicted signal. The longer the prediction, the more noise: of the standard deviation
    of white noise, order 1 with forgetting 0.95 passes 0.25 without prediction and 0.30 at 10 samples ahead; order 2
    passes 0.32 and 0.47. A gap after which less than 1 % of the weight is left (90 samples by default) restarts it.
    Fails at bends of the normal signal, where it overshoots; it gains nothing in an impact shorter than its memory.

    Examples
    --------
    A ramp of 100 N/s, at 49.9 N, is 1 N higher 10 samples later.

    >>> import numpy as np
    >>> time = np.arange(500) * 1e-3
    >>> ramp = Signal(time, 100.0 * time[:, np.newaxis], np.zeros((500, 1), dtype=np.uint8), "N")
    >>> PredictedLimit(ahead=10.0).statistic(ramp, 1e-3).values[-1, 0].round(3).item()
    50.9
    """

    safety_factor: SafetyFactor = 5.5
    sides: SidesOfMachine = None
    order: Annotated[Literal[1, 2], setting("1: a line, 2: a parabola")] = 1
    forgetting: Annotated[
        Annotated[float, Meta(ge=0.5, lt=1.0)],
        setting("weight of a sample relative to the next one; the memory is 1 / (1 - forgetting) samples"),
    ] = 0.95
    ahead: Annotated[NotNegative, setting("how far ahead the signal is predicted", unit="sample periods")] = 10.0

    name: ClassVar[str] = "predicted_limit"
    needs: ClassVar[tuple[str, ...]] = ()
    fitted: ClassVar[tuple[type, ...]] = (FittedStatisticLimit,)

    def __post_init__(self) -> None:
        check(self)

    @property
    def by_class(self) -> bool:
        """True if one side is monitored: which side opposes the motion depends on its class."""
        return self.sides == "one"

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedStatisticLimit:
        """Learn limits of the predicted signal from at least 2 impact-free runs; see `Threshold.fit`."""
        return fit_statistic_limit(self, pairs)

    def statistic(self, signal: Signal, period: float) -> Signal:
        """Return the prediction, in the signal's unit; `period` [s] is the length of a sample."""

        def predict(values: FloatArray, step: FloatArray) -> FloatArray:
            result = np.empty(len(values))
            _predict(values, step / period, self.forgetting, self.order, self.ahead, result)
            return result

        # After a gap in which some of their weight is left, earlier samples still count; after a longer one the fit
        # restarts.
        start_up = period * np.log(_SETTLED) / np.log(self.forgetting)
        return filtered(signal, predict, start_up, start_up, signal.unit)


@kernel(f"void({READ_ONLY}, {READ_ONLY}, float64, int64, float64, float64[::1])")
def _predict(
    values: FloatArray, step: FloatArray, forgetting: float, order: int, ahead: float, result: FloatArray
) -> None:
    """theta <- S theta, P <- S P S' / lam^h, S the upper Pascal matrix of the step h; K = P[:, 0] / (P_00 + 1)."""
    a0 = a1 = a2 = 0.0
    p00 = p01 = p02 = p11 = p12 = p22 = 0.0
    for k in range(len(values)):
        h = step[k]
        if h == math.inf:
            a0, a1, a2 = values[k], 0.0, 0.0
            p00, p01, p02, p11, p12 = 1e6, 0.0, 0.0, 1e6, 0.0
            # Without variance the square term stays 0: a line.
            p22 = 1e6 if order == 2 else 0.0
        else:
            a0 += h * (a1 + h * a2)
            a1 += 2.0 * h * a2
            b00 = p00 + h * (p01 + h * p02)
            b01 = p01 + h * (p11 + h * p12)
            b02 = p02 + h * (p12 + h * p22)
            b11 = p11 + 2.0 * h * p12
            b12 = p12 + 2.0 * h * p22
            grow = forgetting**-h
            p00 = grow * (b00 + h * (b01 + h * b02))
            p01 = grow * (b01 + 2.0 * h * b02)
            p02 = grow * b02
            p11 = grow * (b11 + 2.0 * h * b12)
            p12 = grow * b12
            p22 = grow * p22
        k0, k1, k2 = p00 / (p00 + 1.0), p01 / (p00 + 1.0), p02 / (p00 + 1.0)
        fault = values[k] - a0
        a0 += k0 * fault
        a1 += k1 * fault
        a2 += k2 * fault
        p22 -= k2 * p02
        p12 -= k1 * p02
        p11 -= k1 * p01
        p02 -= k0 * p02
        p01 -= k0 * p01
        p00 -= k0 * p00
        result[k] = a0 + ahead * (a1 + ahead * a2)
