"""The lag of the torque channel behind the motion: a low-pass of the drive, or a bus that delivers the torque late.

A mass from a torque that lags is too small: part of the force that accelerates is logged after the acceleration. To a
first-order lag T the equation of a rigid axis is

    F + T F' = M a + friction,        F: the logged force

in which T is one more coefficient. From noise and from a model that does not describe starts and stops it comes out too
small or too large, but it shows whether there is a lag. Its size and form, low-pass or delay, are those with which the
model, through the same lag, fits the logged force best (output error).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.filtered_regression import (
    FilteredRun,
    IntArray,
    LagForm,
    TorqueLag,
    block_covariance,
    fit_linear,
    shifted,
)

# A lag is there if it is this many times its standard error, and explains this share of the residual's variance.
_SIGNIFICANT, _LEAST_EXPLAINED = 3.0, 0.05
# Lags that are tried [s].
_LAGS = (0.002, 0.005, 0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2)
# Outputs of the lag are compared this many lags after a gap.
_SETTLING = 4.0


@dataclass(frozen=True, eq=False)
class MotionColumns:
    """The columns (n, p) of one run's equation of motion, that of the mass first, and the rows (m,) that are fitted."""

    run: FilteredRun
    columns: FloatArray
    rows: IntArray


@dataclass(frozen=True)
class ApparentLag:
    """The coefficient T of the force's derivative [s] with its standard error, for the runs as they are.

    `explained`: the share of the residual's variance that it explains. `mass_change` [kg, kg m2]: what it adds to the
    mass.
    """

    time: float
    standard_error: float
    explained: float
    mass_change: float

    @property
    def is_certain(self) -> bool:
        """Whether the torque lags the motion."""
        return self.time > _SIGNIFICANT * self.standard_error and self.explained >= _LEAST_EXPLAINED


def apparent_lag(motions: Sequence[MotionColumns], block: IntArray) -> ApparentLag:
    """Return the lag as one more coefficient of the least squares.

    `block` (m,): the stroke of each row of all runs. Raises IdentificationError if the columns depend on each other.
    """
    regressors = np.concatenate([item.columns[item.rows] for item in motions])
    force = np.concatenate([item.run.force[item.rows] for item in motions])
    slope = np.concatenate([item.run.force_slope[item.rows] for item in motions])
    without = fit_linear(regressors, force)
    lagged = fit_linear(np.column_stack((regressors, -slope)), force)
    variance = block_covariance(lagged, block)[-1, -1]
    left, before = float(np.mean(lagged.residuals**2)), float(np.mean(without.residuals**2))
    return ApparentLag(
        float(lagged.coefficients[-1]),
        math.sqrt(variance) if variance >= 0.0 else math.inf,
        1.0 - left / before if before > 0.0 else 0.0,
        float(lagged.coefficients[0] - without.coefficients[0]),
    )


def best_lag(motions: Sequence[MotionColumns]) -> TorqueLag:
    """Return the lag, at most 0.2 s, through which the model fits the logged force best.

    Raises IdentificationError if the columns depend on each other.
    """
    from scipy.optimize import minimize_scalar

    longest = max(len(item.rows) * item.run.low_pass.steps * item.run.run.period for item in motions) / _SETTLING
    lags = [lag for lag in _LAGS if lag <= max(longest, _LAGS[1])]
    found = []
    for form in LagForm:

        def cost(time: float, form: LagForm = form) -> float:
            return _cost(motions, TorqueLag(time, form))

        best = min(range(len(lags)), key=lambda index: cost(lags[index]))
        around = lags[best - 1] if best else 0.0, lags[min(best + 1, len(lags) - 1)]
        refined = minimize_scalar(cost, bounds=around, method="bounded", options={"xatol": 1e-4})
        found.append((float(refined.fun), TorqueLag(float(refined.x), form)))
    return min(found, key=lambda item: item[0])[1]


def _cost(motions: Sequence[MotionColumns], lag: TorqueLag) -> float:
    """Return the mean square of what the model through the lag leaves over of the force."""
    columns = np.concatenate([_lagged(item, lag)[item.rows] for item in motions])
    force = np.concatenate([item.run.force[item.rows] for item in motions])
    known = np.isfinite(columns).all(axis=1)
    return float(np.mean(fit_linear(columns[known], force[known]).residuals ** 2))


def _lagged(motion: MotionColumns, lag: TorqueLag) -> FloatArray:
    """Return a run's columns (n, p) through a lag, NaN at gaps and until a low-pass has settled after them."""
    period = motion.run.run.period
    if lag.form is LagForm.DELAY:
        return np.column_stack([shifted(column, -lag.time / period) for column in motion.columns.T])
    from scipy.signal import lfilter

    keep = math.exp(-period / lag.time) if lag.time > 0.0 else 0.0
    settling = round(_SETTLING * lag.time / period)
    known = np.isfinite(motion.columns).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], known, [False])).astype(np.int8)))
    result = np.full_like(motion.columns, np.nan)
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        if end - first > settling:
            piece = motion.columns[first:end]
            passed, _ = lfilter([1.0 - keep], [1.0, -keep], piece, axis=0, zi=keep * piece[:1])
            result[first + settling : end] = passed[settling:]
    return result
