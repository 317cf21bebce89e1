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
    known_sections,
    shifted,
)

# A lag is there if it is this many times its standard error, and explains this share of the residual's variance.
_SIGNIFICANT, _LEAST_EXPLAINED = 3.0, 0.05
# The shortest lag from which the search begins, and the longest that is looked for [s].
_SHORTEST, _LONGEST = 2e-3, 0.2
# Step of the derivative by the lag [-]: a delay is interpolated between samples, and has bends.
_STEP = 0.05
# Outputs of the lag are compared this many lags after a gap.
_SETTLING = 4.0


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


def apparent_lag(
    motions: Sequence[FilteredRun], rows: Sequence[IntArray], chosen: list[int], block: IntArray
) -> ApparentLag:
    """Return the lag as one more coefficient of the least squares.

    `rows` (m,) of each run that are fitted, the `chosen` columns of its motion, that of the mass first; `block` (m,):
    the stroke of each row of all runs. Raises IdentificationError if the columns depend on each other.
    """
    regressors = np.concatenate([run.columns[own][:, chosen] for run, own in zip(motions, rows, strict=True)])
    force = np.concatenate([run.force[own] for run, own in zip(motions, rows, strict=True)])
    slope = np.concatenate([run.force_slope[own] for run, own in zip(motions, rows, strict=True)])
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


def best_lag(motions: Sequence[FilteredRun], rows: Sequence[IntArray], chosen: list[int], apparent: float) -> TorqueLag:
    """Return the lag, at most 0.2 s, through which the model fits the logged force best, from the `apparent` one [s].

    Raises IdentificationError if the columns depend on each other.
    """
    from scipy.optimize import least_squares

    force = np.concatenate([run.force[own] for run, own in zip(motions, rows, strict=True)])
    longest = max(len(own) * run.low_pass.steps * run.run.period for run, own in zip(motions, rows, strict=True))
    highest = min(longest / _SETTLING, _LONGEST)
    found = []
    for form in LagForm:

        def left_over(time: FloatArray, form: LagForm = form) -> FloatArray:
            lag = TorqueLag(float(time[0]), form)
            columns = np.concatenate([_lagged(run, chosen, lag)[own] for run, own in zip(motions, rows, strict=True)])
            known = np.isfinite(columns).all(axis=1)
            residual = np.zeros(len(force))
            # The longer a lag, the fewer samples have settled: the mean square counts.
            residual[known] = fit_linear(columns[known], force[known]).residuals / math.sqrt(np.count_nonzero(known))
            return residual

        start = [min(max(apparent, _SHORTEST), 0.9 * highest)]
        best = least_squares(left_over, start, bounds=(0.0, highest), diff_step=[_STEP], x_scale=start)
        found.append((float(best.cost), TorqueLag(float(best.x[0]), form)))
    return min(found, key=lambda item: item[0])[1]


def _lagged(motion: FilteredRun, chosen: list[int], lag: TorqueLag) -> FloatArray:
    """Return a run's columns (n, p) through a lag, NaN at gaps and until a low-pass has settled after them."""
    period, columns = motion.run.period, motion.columns[:, chosen]
    if lag.form is LagForm.DELAY:
        return np.column_stack([shifted(column, -lag.time / period) for column in columns.T])
    from scipy.signal import lfilter

    keep = math.exp(-period / lag.time) if lag.time > 0.0 else 0.0
    settling = round(_SETTLING * lag.time / period)
    known = np.asarray(np.isfinite(columns).all(axis=1))
    result = np.full_like(columns, np.nan)
    for first, end in known_sections(known):
        if end - first > settling:
            piece = columns[first:end]
            passed, _ = lfilter([1.0 - keep], [1.0, -keep], piece, axis=0, zi=keep * piece[:1])
            result[first + settling : end] = passed[settling:]
    return result
