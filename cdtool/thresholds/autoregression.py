"""Autoregressive models: Burg's recursion over several stretches, and how a forecast spreads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdtool.recording import FloatArray

# The sum of so many powers of 2 of terms stands for the infinite one.
_DOUBLINGS = 24


def burg(parts: Sequence[FloatArray], order: int) -> tuple[FloatArray, float]:
    """Coefficients (order,) of e_k = sum a_i e_{k-i} + nu_k, and the standard deviation of nu, from stretches of e.

    Burg's recursion with forward and backward errors summed over all stretches; those of at most `order` samples are
    left out. The model is stable by construction. Standard deviation NaN where no stretch is long enough.
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
