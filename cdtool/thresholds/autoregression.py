"""Autoregressive models: Burg's recursion over several sections of a signal, and the spread of a forecast."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdtool.recording import FloatArray

# The infinite sum is approximated by 2 to this power of its terms.
_DOUBLINGS = 24


def burg(parts: Sequence[FloatArray], order: int) -> tuple[FloatArray, float]:
    """Return coefficients (order,) of e_k = sum a_i e_{k-i} + nu_k and the standard deviation of nu, from parts of e.

    Burg's recursion with forward and backward errors summed over all sections; sections of at most `order` samples are
    left out. The model is stable by construction. The standard deviation is NaN if no section is long enough.
    """
    forward = [part for part in parts if len(part) > order]
    backward = forward
    polynomial = np.ones(1)
    for _ in range(order):
        ahead, behind = [part[1:] for part in forward], [part[:-1] for part in backward]
        crossed = sum(float(f @ b) for f, b in zip(ahead, behind, strict=True))
        energy = sum(float(f @ f + b @ b) for f, b in zip(ahead, behind, strict=True))
        reflection = -2.0 * crossed / energy if energy > 0.0 else 0.0
        forward = [f + reflection * b for f, b in zip(ahead, behind, strict=True)]
        backward = [b + reflection * f for f, b in zip(ahead, behind, strict=True)]
        longer = np.append(polynomial, 0.0)
        polynomial = longer + reflection * longer[::-1]
    number = sum(len(part) for part in forward)
    power = sum(float(part @ part) for part in forward)
    return -polynomial[1:], float(np.sqrt(power / number)) if number else float("nan")


def stationary_covariance(coefficients: FloatArray, least: float) -> FloatArray:
    """Covariance (p, p) of the last p values of e, that of nu being 1: P = F P F' + Q, solved by doubling.

    It is scaled up where the variance of e would be below `least`. The model is stable (see `burg`).
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
