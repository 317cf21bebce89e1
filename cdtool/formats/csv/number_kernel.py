"""A decimal number in bytes -> the nearest float64, bit for bit what Python's float() gives.

Up to 2^53 with a power of ten up to 22 one exact product or quotient rounds once (Clinger 1990). Beyond, the mantissa
is multiplied by a 128-bit power of five, whose upper bits decide the rounding (Lemire 2021, "Number parsing at a
gigabyte per second"). What neither decides (subnormal, overflow, more than 19 digits) the caller leaves to float().
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.kernels import kernel
from cdtool.recording import FloatArray

Bytes = npt.NDArray[np.uint8]
Words = npt.NDArray[np.uint64]

# Where a number ends is its second result; instead of it:
NOT_A_NUMBER, UNDECIDED = -1, -2
_SMALLEST, _LARGEST = -342, 308
BYTES = "Array(uint8, 1, 'C', readonly=True)"
WORDS = "Array(uint64, 1, 'C', readonly=True)"
FLOATS = "Array(float64, 1, 'C', readonly=True)"

_U0, _U1, _U3, _U9, _U48 = np.uint64(0), np.uint64(1), np.uint64(3), np.uint64(9), np.uint64(48)
_U10, _U32, _U63 = np.uint64(10), np.uint64(32), np.uint64(63)
_LOW_WORD, _ALL, _MASK = np.uint64(0xFFFFFFFF), np.uint64(0xFFFFFFFFFFFFFFFF), np.uint64(0x1FF)
_TOP_BIT, _HIDDEN, _TWICE_HIDDEN = np.uint64(1 << 63), np.uint64(1 << 52), np.uint64(1 << 53)


@cache
def powers() -> tuple[FloatArray, Words, Words]:
    """10^0 to 10^22, and the upper and lower halves of 5^-342 to 5^308, scaled to 128 bits."""
    fives = [_scaled_five(exponent) for exponent in range(_SMALLEST, _LARGEST + 1)]
    high = np.array([five >> 64 for five in fives], dtype=np.uint64)
    low = np.array([five & (2**64 - 1) for five in fives], dtype=np.uint64)
    return np.array([float(10**k) for k in range(23)]), high, low


def _scaled_five(exponent: int) -> int:
    """5^exponent times a power of two in [2^127, 2^128): rounded down, its reciprocal up."""
    if exponent >= 0:
        power: int = 5**exponent
        bits = power.bit_length()
        return power << (128 - bits) if bits <= 128 else power >> (bits - 128)
    power = int(5**-exponent)
    bits = (power - 1).bit_length()
    if exponent >= -27:
        return int((1 << (bits + 127)) // power + 1)
    reciprocal = (1 << (2 * bits + 128)) // power + 1
    return int(reciprocal >> (reciprocal.bit_length() - 128))


@kernel("UniTuple(uint64, 2)(uint64, uint64)")
def _product(a: np.uint64, b: np.uint64) -> tuple[np.uint64, np.uint64]:
    """Upper and lower half of a product of two 64-bit words."""
    a_high, a_low = a >> _U32, a & _LOW_WORD
    b_high, b_low = b >> _U32, b & _LOW_WORD
    low = a_low * b_low
    left, right = a_high * b_low, a_low * b_high
    middle = (low >> _U32) + (left & _LOW_WORD) + (right & _LOW_WORD)
    high = a_high * b_high + (left >> _U32) + (right >> _U32) + (middle >> _U32)
    return high, (middle << _U32) | (low & _LOW_WORD)


@kernel(f"Tuple((float64, boolean))(uint64, int64, {WORDS}, {WORDS})")
def _nearest(mantissa: np.uint64, exponent: int, high5: Words, low5: Words) -> tuple[float, bool]:
    """mantissa * 10^exponent rounded to the nearest float64, and whether that is decided; mantissa > 0."""
    if exponent < -307 or exponent > 288:
        return 0.0, False
    shift = 0
    word = mantissa
    while word & _TOP_BIT == _U0:
        word = word << _U1
        shift += 1
    at = exponent + 342
    high, low = _product(word, high5[at])
    if high & _MASK == _MASK:
        second, _ = _product(word, low5[at])
        low = low + second
        if second > low:
            high = high + _U1
    if low == _ALL and (exponent < -27 or exponent > 55):
        return 0.0, False
    upper = high >> _U63
    drop = upper + np.uint64(9)
    digits = high >> drop
    power: Any = ((217706 * exponent) >> 16) + 63 + np.int64(upper) - shift + 1023
    if power <= 0 or power >= 2046:
        return 0.0, False
    if low <= _U1 and -4 <= exponent <= 23 and digits & _U3 == _U1 and digits << drop == high:
        digits = digits - _U1  # exactly between two: to the even one
    digits = (digits + (digits & _U1)) >> _U1
    if digits >= _TWICE_HIDDEN:
        digits = _HIDDEN
        power += 1
    return math.ldexp(np.float64(digits), power - 1075), True


@kernel(f"Tuple((float64, int64))({BYTES}, int64)")
def _word(data: Bytes, at: int) -> tuple[float, int]:
    """nan, inf, infinity, true (1) and false (0), in any case."""
    first, second, third = data[at] | 32, data[at + 1] | 32, data[at + 2] | 32
    if first == 110 and second == 97 and third == 110:
        return math.nan, at + 3
    if first == 105 and second == 110 and third == 102:
        end = at + 3
        if data[end] | 32 == 105:
            for i, letter in enumerate((105, 110, 105, 116, 121)):
                if data[end + i] | 32 != letter:
                    return 0.0, NOT_A_NUMBER
            end += 5
        return math.inf, end
    if first == 116 and second == 114 and third == 117 and data[at + 3] | 32 == 101:
        return 1.0, at + 4
    if first == 102 and second == 97 and third == 108 and data[at + 3] | 32 == 115 and data[at + 4] | 32 == 101:
        return 0.0, at + 5
    return 0.0, NOT_A_NUMBER


@kernel(f"Tuple((float64, int64))({BYTES}, int64, int64, {FLOATS})")
def quick_number(data: Bytes, at: int, decimal: int, tens: FloatArray) -> tuple[float, int]:
    """A plain number whose value one division gives, and where it ends; UNDECIDED for any other."""
    p = np.uint64(at)  # unsigned: no index is ever taken from the end
    negative = data[p] == 45
    if negative:
        p += _U1
    first = p
    mantissa = _U0
    while True:
        digit = np.uint64(data[p]) - _U48
        if digit > _U9:
            break
        mantissa = mantissa * _U10 + digit
        p += _U1
    digits: Any = np.int64(p - first)
    decimals: Any = 0
    if data[p] == decimal:
        p += _U1
        point = p
        while True:
            digit = np.uint64(data[p]) - _U48
            if digit > _U9:
                break
            mantissa = mantissa * _U10 + digit
            p += _U1
        decimals = np.int64(p - point)
        digits += decimals
    if digits == 0 or digits > 19 or mantissa > _TWICE_HIDDEN:
        return 0.0, UNDECIDED
    value = np.float64(np.int64(mantissa)) / tens[decimals]
    end: Any = np.int64(p)
    return -value if negative else value, end


@kernel(f"Tuple((float64, int64))({BYTES}, int64, int64, int64, {FLOATS}, {WORDS}, {WORDS})")
def read_number(
    data: Bytes, at: int, decimal: int, thousands: int, tens: FloatArray, high5: Words, low5: Words
) -> tuple[float, int]:
    """The number that starts at `data[at]`, and where it ends (or NOT_A_NUMBER, UNDECIDED).

    `decimal` and `thousands` are bytes, -1 for none; groups of thousands hold three digits. The bytes must end in 16
    that are of no number.
    """
    p = at
    negative = data[p] == 45
    if negative or data[p] == 43:
        p += 1
    mantissa = _U0
    digits = 0
    seen = 0
    exponent = 0
    lost = False
    group = 0
    groups = 0
    while True:
        digit = np.int64(data[p]) - 48
        if 0 <= digit <= 9:
            seen += 1
            group += 1
            if digits < 19:
                mantissa = mantissa * _U10 + np.uint64(digit)
                if mantissa != _U0:
                    digits += 1
            else:
                exponent += 1
                lost = lost or digit != 0
        elif thousands >= 0 and data[p] == thousands:
            if group == 0 or group > 3 or (groups > 0 and group != 3):
                return 0.0, NOT_A_NUMBER
            groups += 1
            group = 0
        else:
            break
        p += 1
    if groups > 0 and group != 3:
        return 0.0, NOT_A_NUMBER
    if data[p] == decimal:
        p += 1
        while True:
            digit = np.int64(data[p]) - 48
            if digit < 0 or digit > 9:
                break
            seen += 1
            if digits < 19:
                mantissa = mantissa * _U10 + np.uint64(digit)
                exponent -= 1
                if mantissa != _U0:
                    digits += 1
            else:
                lost = lost or digit != 0
            p += 1
    if seen == 0:
        value, end = _word(data, p)
        return -value if negative else value, end
    if data[p] | 32 == 101:
        q = p + 1
        down = data[q] == 45
        if down or data[q] == 43:
            q += 1
        power: Any = 0
        first = q
        while True:
            digit = np.int64(data[q]) - 48
            if digit < 0 or digit > 9:
                break
            if power < 100000:
                power = 10 * power + digit
            q += 1
        if q == first:
            return 0.0, NOT_A_NUMBER
        exponent += -power if down else power
        p = q
    if mantissa == _U0:
        value = 0.0
    elif not lost and mantissa <= _TWICE_HIDDEN and -22 <= exponent <= 22:
        value = np.float64(mantissa) * tens[exponent] if exponent >= 0 else np.float64(mantissa) / tens[-exponent]
    else:
        value, sure = _nearest(mantissa, exponent, high5, low5)
        if sure and lost:
            above, sure = _nearest(mantissa + _U1, exponent, high5, low5)
            sure = sure and above == value
        if not sure:
            return 0.0, UNDECIDED
    return -value if negative else value, p
