"""A transfer function: its poles, gain, frequency response, and its responses to an impulse, a step and a ramp."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError

if TYPE_CHECKING:
    pass

ComplexArray = npt.NDArray[np.complex128]


@dataclass(frozen=True)
class Transfer:
    """G(s) = numerator / denominator, each from the highest power of s down; `unit` is that of output by input."""

    numerator: tuple[float, ...]
    denominator: tuple[float, ...]
    unit: str

    @property
    def poles(self) -> ComplexArray:
        """Roots of the denominator [rad/s]."""
        return np.asarray(np.roots(self.denominator), dtype=np.complex128)

    @property
    def zeros(self) -> ComplexArray:
        """Roots of the numerator [rad/s]."""
        return np.asarray(np.roots(self.numerator), dtype=np.complex128)

    @property
    def gain(self) -> float:
        """The generalised gain: G(0), or the limit of s^k G(s) for k poles (or -k zeros) at the origin."""
        return _lowest(self.numerator) / _lowest(self.denominator)

    def response(self, frequency: FloatArray) -> ComplexArray:
        """G(j w) (n,) at frequencies (n,) [rad/s]."""
        s = 1j * np.asarray(frequency, dtype=np.float64)
        return np.asarray(np.polyval(self.numerator, s) / np.polyval(self.denominator, s), dtype=np.complex128)

    @property
    def reduced(self) -> Transfer:
        """Return the function without leading zeros, and without the poles and zeros at the origin that cancel."""
        numerator, denominator = self.numerator, self.denominator
        while numerator[-1] == denominator[-1] == 0.0:
            numerator, denominator = numerator[:-1], denominator[:-1]
        return Transfer(_trimmed(numerator), _trimmed(denominator), self.unit)

    @property
    def _coefficients(self) -> tuple[FloatArray, FloatArray]:
        return np.array(self.numerator, dtype=np.float64), np.array(self.denominator, dtype=np.float64)

    def impulse(self, time: FloatArray) -> FloatArray:
        """Return the response (n,) to a unit impulse at 0; `time` (n,) evenly spaced from 0 [s]."""
        from scipy.signal import impulse

        return np.asarray(impulse(self._coefficients, T=np.ravel(time))[1], dtype=np.float64)

    def step(self, time: FloatArray) -> FloatArray:
        """Return the response (n,) to a unit step at 0; `time` (n,) evenly spaced from 0 [s]."""
        from scipy.signal import step

        return np.asarray(step(self._coefficients, T=np.ravel(time))[1], dtype=np.float64)

    def ramp(self, time: FloatArray) -> FloatArray:
        """Return the response (n,) to a ramp of slope 1/s from 0; `time` (n,) evenly spaced from 0 [s]."""
        return Transfer(self.numerator, (*self.denominator, 0.0), self.unit).step(time)


@dataclass(frozen=True)
class SecondOrder:
    """(1/K) wn^2 / (s^2 + 2 xi wn s + wn^2) (thesis 4.19 corrected): wn [rad/s], xi, and the gain 1/K."""

    natural_frequency: float
    damping_ratio: float
    gain: float


def second_order(transfer: Transfer) -> SecondOrder:
    """Natural frequency, damping ratio and gain of b0 / (a2 s^2 + a1 s + a0); raises UsageError for any other."""
    if len(transfer.denominator) != 3 or len(transfer.numerator) != 1 or transfer.denominator[2] <= 0.0:
        raise UsageError("the transfer function is no second order with a stiffness", "give b0 / (a2 s^2 + a1 s + a0)")
    a2, a1, a0 = transfer.denominator
    natural = float(np.sqrt(a0 / a2))
    return SecondOrder(natural, a1 / (2.0 * a2 * natural), transfer.numerator[0] / a0)


def _lowest(coefficients: tuple[float, ...]) -> float:
    return next(value for value in reversed(coefficients) if value != 0.0)


def _trimmed(coefficients: tuple[float, ...]) -> tuple[float, ...]:
    first = next(i for i, value in enumerate(coefficients) if value != 0.0)
    return coefficients[first:]
