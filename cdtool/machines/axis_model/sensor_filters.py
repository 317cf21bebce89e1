"""The causal low-passes of a log's channels, from rest."""

from __future__ import annotations

import math

import numpy as np

from cdtool.base.arrays import FloatArray


def first_order_low_pass(values: FloatArray, time_constant: float, period: float) -> FloatArray:
    """Return y_k = a y_(k-1) + (1 - a) u_k, a = exp(-period / time_constant) [s]: exact for a held input."""
    if time_constant <= 0.0:
        return values
    from scipy.signal import lfilter

    keep = math.exp(-period / time_constant)
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values), dtype=np.float64)


def second_order_low_pass(values: FloatArray, frequency: float, damping: float, period: float) -> FloatArray:
    """Return the low-pass w^2 / (s^2 + 2 damping w s + w^2), w = 2 pi frequency [Hz], bilinear and prewarped.

    A corner above the Nyquist frequency passes everything.
    """
    from scipy.signal import lfilter

    if frequency * period >= 0.5:
        return values
    angle = 2.0 * math.pi * frequency
    rate = angle / math.tan(0.5 * angle * period)
    square, cross = rate * rate, 2.0 * damping * angle * rate
    numerator = angle * angle * np.array([1.0, 2.0, 1.0])
    denominator = np.array(
        [square + cross + angle * angle, 2.0 * (angle * angle - square), square - cross + angle * angle]
    )
    return np.asarray(lfilter(numerator, denominator, values), dtype=np.float64)
