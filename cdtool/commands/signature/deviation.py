"""How far one run is from a signature, along the stroke: what the audit of a season is made of.

Conventions: deviations are in spreads of the signature, place by place, pooled over its window, since a single sample
is noise. With one watched side they are positive towards its limit; with two they have the signal's sign.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection
from cdtool.base.arrays import FloatArray
from cdtool.detectors.detection import Status
from cdtool.results.curves.sweep import critical_factor
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.signature_curve import Curve

Axis = Literal["travel", "time"]
# A place counts where this share of its window holds valid samples.
_VALID_SHARE = 0.5


@dataclass(frozen=True)
class Deviations:
    """Of runs (r) and joints (J): `overall` (r, J) and, at the places (m,) along `axis`, `pooled` (r, m, J).

    `overall` is the median shift of the run over the stroke, in the stroke's median spread; `beyond` (r, m, J) is what
    a place's shift has more than that. NaN where a run is not valid. `window`: places are pooled over as much to either
    side.
    """

    axis: Axis
    places: FloatArray
    window: float
    overall: FloatArray
    pooled: FloatArray
    beyond: FloatArray


def axis_of(signature: FittedSignature) -> Axis:
    """Along what the audit looks for places: travel, or time where the signature knows nothing else."""
    return "time" if signature.alignment == "time" else "travel"


def deviations_of(signature: FittedSignature, detections: Sequence[Detection]) -> Deviations:
    """Return deviations of runs from the signature: z = (i - mean) / s, with its mean and spread s.

    Travel counts along the whole stroke here, while accelerating too.
    """
    axis = axis_of(signature)
    curve = signature.by_time if axis == "time" else signature.by_position
    mean, spread = curve.band(signature.pooled)
    sign = float(signature.watched or 1)
    samples = [_sample(signature, item, axis) for item in detections]
    shift = sign * (np.array(samples).reshape(len(samples), *mean.shape) - mean)
    typical = _median(shift, axis=1)  # (r, J) in the signal's unit
    places, pooled = _pooled(shift / spread, curve)
    beyond = _pooled((shift - typical[:, np.newaxis, :]) / spread, curve)[1]
    return Deviations(axis, places, curve.window, typical / _median(spread, axis=0), pooled, beyond)


def critical_of(detection: Detection, activation: Activation, joint: int) -> float:
    """Return the critical factor of one joint; -inf if it is nowhere assessable. See `critical_factor`."""
    status = detection.statistic.status
    hidden = (np.arange(status.shape[1]) != joint) & (status == Status.VALID)
    status = np.where(hidden, np.uint8(Status.NO_LIMIT), status)
    return critical_factor(replace(detection, statistic=replace(detection.statistic, status=status)), activation)


def _sample(signature: FittedSignature, detection: Detection, axis: Axis) -> FloatArray:
    """Return a run's values (g, J) on the grid of that axis, where it is assessable."""
    by_time, by_position = signature.samples(detection.operation.recording.without_ground_truth(), detection.statistic)
    return by_time if axis == "time" else by_position


def _pooled(values: FloatArray, curve: Curve) -> tuple[FloatArray, FloatArray]:
    """Places a window apart (m,), and values (r, g, J) averaged over the window to either side of each (r, m, J)."""
    reach = max(round(curve.window / curve.step), 1)
    centres = np.arange(reach, values.shape[1], reach)
    pooled: FloatArray = np.full((len(values), len(centres), values.shape[2]), np.nan)
    for i, centre in enumerate(centres):
        part = values[:, centre - reach : centre + reach + 1]
        valid = np.isfinite(part)
        number = valid.sum(axis=1)
        total = np.where(valid, part, 0.0).sum(axis=1)
        enough = number >= _VALID_SHARE * (2 * reach + 1)
        pooled[:, i] = np.where(enough, total / np.maximum(number, 1), np.nan)
    return np.asarray(centres * curve.step, dtype=np.float64), pooled


def _median(values: FloatArray, axis: int) -> FloatArray:
    """Median of what is not NaN; NaN where all is."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "All-NaN slice", RuntimeWarning)
        middle: FloatArray = np.nanmedian(values, axis=axis)
    return middle
