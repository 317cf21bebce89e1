"""Compiled loops over a channel's values: the conversion to SI with the masks, and whether a value ever changes."""

from __future__ import annotations

import math

import numpy as np

from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray

_TABLE = "Array(float64, 2, 'C', readonly=True)"


@kernel(f"void({_TABLE}, {READ_ONLY}, {READ_ONLY}, float64[:, ::1], int64[:, ::1])")
def convert_and_mask(
    values: FloatArray, factor: FloatArray, limits: FloatArray, scaled: FloatArray, masked: FloatArray
) -> None:
    """Fill `scaled` (n, J) with values times `factor` (J,), NaN where masked; count the masked ones in `masked` (3, J).

    Masked are infinite values, saturated ones (up to the first limit, from the second), and impossible ones: below the
    third limit, above the fourth, or from the fifth when scaled. No value exceeds a limit that is NaN.
    """
    low, high, least, most, impossible = limits[0], limits[1], limits[2], limits[3], limits[4]
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            value = values[i, j]
            scaled[i, j] = value * factor[j]
            if math.isinf(value):
                kind = 0
            elif value <= low or value >= high:
                kind = 1
            elif value < least or value > most or abs(scaled[i, j]) >= impossible:
                kind = 2
            else:
                continue
            masked[kind, j] += 1
            scaled[i, j] = math.nan


@kernel(f"void({_TABLE}, b1[::1])")
def find_constant(values: FloatArray, constant: BoolArray) -> None:
    """Set `constant` (J,) where a joint has at least two finite values (n, J), which are all equal."""
    for j in range(values.shape[1]):
        first = math.nan
        for i in range(values.shape[0]):
            value = values[i, j]
            if not math.isfinite(value):
                continue
            if math.isnan(first):
                first = value
            else:
                constant[j] = value == first
                if not constant[j]:
                    break


def as_table(values: FloatArray) -> FloatArray:
    """Return values (n, J) as these kernels read them: as float64, row by row."""
    return np.ascontiguousarray(values, dtype=np.float64)
