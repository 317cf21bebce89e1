"""Convert a decimal number to the nearest float64, exactly as Python's float().

Lemire, "Number parsing at a gigabyte per second", Software: Practice and Experience 51 (2021), algorithm 2: w 10^q with
w < 2^64 is w times the upper 128 bits of 5^q, rounded to even. Undecidable cases (subnormal, infinite) are left to
Python.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.kernels import kernel

SMALLEST, LARGEST = -342, 308
UNDECIDED = np.uint64(0xFFFFFFFFFFFFFFFF)  # the bits of a NaN
POWERS = "Array(uint64, 2, 'C', readonly=True)"

# Unsigned constants: numba converts a signed and an unsigned operand to float.
_0, _1, _3, _9, _32, _52, _63, _64 = map(np.uint64, (0, 1, 3, 9, 32, 52, 63, 64))
_LOW_WORD, _MASK = np.uint64(0xFFFFFFFF), np.uint64(0x1FF)
_HIDDEN, _TWICE_HIDDEN = np.uint64(2**52), np.uint64(2**53)


@cache
def powers_of_five() -> npt.NDArray[np.uint64]:
    """Return (651, 2): the upper and lower 64 bits of 5^q, q from -342 to 308, highest bit set; 5^-q rounded up."""
    rows = []
    for q in range(SMALLEST, LARGEST + 1):
        five = 5 ** abs(q)
        if q < 0:
            bits = five.bit_length() if five & (five - 1) else five.bit_length() - 1
            five = (1 << (bits + 127 if q >= -27 else 2 * bits + 128)) // five + 1
        length = five.bit_length()
        five = five << (128 - length) if length < 128 else five >> (length - 128)
        rows.append((five >> 64, five & (2**64 - 1)))
    return np.array(rows, dtype=np.uint64)


@kernel("UniTuple(uint64, 2)(uint64, uint64)")
def product(a: np.uint64, b: np.uint64) -> tuple[np.uint64, np.uint64]:
    """Return the upper and lower 64 bits of a b."""
    a1, a0, b1, b0 = a >> _32, a & _LOW_WORD, b >> _32, b & _LOW_WORD
    middle = a1 * b0 + (a0 * b0 >> _32)
    other = a0 * b1 + (middle & _LOW_WORD)
    return a1 * b1 + (middle >> _32) + (other >> _32), a * b


@kernel(f"uint64(uint64, int64, {POWERS})")
def float_bits(w: np.uint64, q: int, powers: npt.NDArray[np.uint64]) -> np.uint64:
    """Return the bits of the float64 nearest to w 10^q; UNDECIDED if subnormal, infinite or too close to decide."""
    if w == _0:
        return w
    if q < SMALLEST or q > LARGEST:
        return UNDECIDED
    zeros = _0
    step = _32
    while step > _0:
        if w >> (_64 - step) == _0:
            w = w << step
            zeros += step
        step = step >> _1
    high, low = product(w, powers[q - SMALLEST, 0])
    if high & _MASK == _MASK:
        second, _ = product(w, powers[q - SMALLEST, 1])
        low += second
        if second > low:
            high += _1
    if low == UNDECIDED and (q < -27 or q > 55):
        return UNDECIDED
    upper = high >> _63
    shift = upper + _9
    mantissa = high >> shift
    exponent = ((217706 * q) >> 16) + 1086 + np.int64(upper) - np.int64(zeros)
    if low <= _1 and q >= -4 and q <= 23 and mantissa & _3 == _1 and mantissa << shift == high:
        mantissa -= _1  # exactly between two float64: to the even one
    mantissa = (mantissa + (mantissa & _1)) >> _1
    if mantissa >= _TWICE_HIDDEN:
        mantissa = _HIDDEN
        exponent += 1
    if exponent <= 0 or exponent >= 0x7FF:
        return UNDECIDED
    bits: np.uint64 = (mantissa & (_HIDDEN - _1)) | (np.uint64(exponent) << _52)
    return bits


@kernel("float64(uint64)")
def as_float(bits: np.uint64) -> float:
    """Return the normal, positive float64 with these bits."""
    digits: Any = (bits & (_HIDDEN - _1)) | _HIDDEN
    power: Any = np.int64(bits >> _52)
    return math.ldexp(np.float64(digits), power - 1075)
