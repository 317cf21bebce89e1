"""Read a decimal number from bytes as the nearest float64, identical to the result of Python's float().

For a mantissa up to 2^53 and a power of ten up to 22, one product or quotient of exact numbers rounds once (Clinger
1990); for others see decimal_kernel. Numbers that remain undecided (subnormal, overflow, more than 19 digits) are
passed to float() by the caller.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.decimal_kernel import POWERS, as_float, float_bits, powers_of_five
from cdtool.decimal_kernel import UNDECIDED as TOO_CLOSE
from cdtool.formats.csv.digits_kernel import BYTES, Bytes
from cdtool.kernels import kernel
from cdtool.recording import FloatArray

Words = npt.NDArray[np.uint64]

# Results in place of the byte where a number ends:
NOT_A_NUMBER, UNDECIDED = -1, -2
FLOATS = "Array(float64, 1, 'C', readonly=True)"

_U0, _U1, _U10, _TWICE_HIDDEN = map(np.uint64, (0, 1, 10, 2**53))
_NAN, _INF, _INITY, _TRUE, _FALSE = (int.from_bytes(word) for word in (b"nan", b"inf", b"inity", b"true", b"false"))


@cache
def powers() -> tuple[FloatArray, Words]:
    """Return 10^0 to 10^22, and the powers of five of decimal_kernel."""
    return np.array([float(10**k) for k in range(23)]), powers_of_five()


@kernel(f"int64({BYTES}, int64, int64)")
def letters(data: Bytes, at: int, count: int) -> int:
    """Return `count` letters (at most 8) as one integer, in lower case."""
    word: Any = 0
    for i in range(at, at + count):
        word = 256 * word + (np.int64(data[i]) | 32)
    return int(word)


@kernel(f"Tuple((float64, int64))({BYTES}, int64)")
def _word(data: Bytes, at: int) -> tuple[float, int]:
    """Read nan, inf, infinity, true (1) or false (0), in upper or lower case; return the value and its end."""
    word = letters(data, at, 3)
    if word == _NAN:
        return math.nan, at + 3
    if word == _INF:
        if data[at + 3] | 32 != 105:
            return math.inf, at + 3
        return math.inf, at + 8 if letters(data, at + 3, 5) == _INITY else NOT_A_NUMBER
    if letters(data, at, 4) == _TRUE:
        return 1.0, at + 4
    return 0.0, at + 5 if letters(data, at, 5) == _FALSE else NOT_A_NUMBER


@kernel(f"Tuple((float64, int64))({BYTES}, int64, int64, int64, {FLOATS}, {POWERS})")
def read_number(
    data: Bytes, at: int, decimal: int, thousands: int, tens: FloatArray, fives: Words
) -> tuple[float, int]:
    """Return the number that starts at `data[at]`, and where it ends (or NOT_A_NUMBER, UNDECIDED).

    `decimal` and `thousands` are bytes, -1 for none; groups of thousands have three digits. The last 16 bytes of `data`
    must not be parts of a number.
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
        bits = float_bits(mantissa, exponent, fives)
        if bits == TOO_CLOSE or (lost and float_bits(mantissa + _U1, exponent, fives) != bits):
            return 0.0, UNDECIDED
        value = as_float(bits)
    return -value if negative else value, p
