"""Decimal number -> nearest float64, exactly as Python's float() does it.

Lemire, "Number parsing at a gigabyte per second", Software: Practice and Experience 51 (2021), algorithm 2: w 10^q with
w < 2^64 is w times the upper 128 bits of 5^q, rounded to even. What it cannot tell (subnormal, infinite) is left to
Python.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from cdtool.kernels import kernel

SMALLEST, LARGEST = -342, 308
UNDECIDED = np.uint64(0xFFFFFFFFFFFFFFFF)  # the bits of a NaN


@cache
def powers_of_five() -> npt.NDArray[np.uint64]:
    """(651, 2): the upper and lower 64 bits of 5^q, q from -342 to 308, with their highest bit set; 5^-q rounded up."""
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
    """The upper and lower 64 bits of a b."""
    half, low = np.uint64(32), np.uint64(0xFFFFFFFF)
    a1, a0, b1, b0 = a >> half, a & low, b >> half, b & low
    first = a0 * b0
    middle = a1 * b0 + (first >> half)
    other = a0 * b1 + (middle & low)
    return a1 * b1 + (middle >> half) + (other >> half), a * b


@kernel("uint64(uint64, int64, Array(uint64, 2, 'C', readonly=True))")
def float_bits(w: np.uint64, q: int, powers: npt.NDArray[np.uint64]) -> np.uint64:
    """The bits of the float64 nearest to w 10^q; UNDECIDED where that is subnormal, infinite or too close to call."""
    one = np.uint64(1)
    if w == np.uint64(0):
        return w
    if q < SMALLEST or q > LARGEST:
        return UNDECIDED
    zeros = 0
    for step in (32, 16, 8, 4, 2, 1):
        if w >> np.uint64(64 - step) == np.uint64(0):
            w = w << np.uint64(step)
            zeros += step
    high, low = product(w, powers[q - SMALLEST, 0])
    if high & np.uint64(0x1FF) == np.uint64(0x1FF):
        second, _ = product(w, powers[q - SMALLEST, 1])
        low += second
        if second > low:
            high += one
    if low == UNDECIDED and (q < -27 or q > 55):
        return UNDECIDED
    upper = np.int64(high >> np.uint64(63))
    shift = np.uint64(upper + 9)
    mantissa = high >> shift
    exponent = ((217706 * q) >> 16) + 63 + upper - zeros + 1023
    if low <= one and q >= -4 and q <= 23 and mantissa & np.uint64(3) == one and mantissa << shift == high:
        mantissa -= one  # exactly between two float64: to the even one
    mantissa = (mantissa + (mantissa & one)) >> one
    if mantissa >= np.uint64(2**53):
        mantissa = np.uint64(2**52)
        exponent += 1
    if exponent <= 0 or exponent >= 0x7FF:
        return UNDECIDED
    bits: np.uint64 = (mantissa & np.uint64(2**52 - 1)) | (np.uint64(exponent) << np.uint64(52))
    return bits
