"""Decode JSON messages of a known shape: the text between the values is the same in all of them.

A shape is a sequence of tokens, each a literal text and what follows it: a number (or true, false, null), a string
without escapes, or the end. A message that matches is JSON with the same members (RFC 8259); any other message is
decoded elsewhere.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.decimal_kernel import POWERS, UNDECIDED, float_bits
from cdtool.instructions import load, trailing_zeros
from cdtool.kernels import kernel
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray

VALUE, TEXT, END = 0, 1, 2
# The result for a message: it does not match, it matches, or it matches but Python must convert a number.
OTHER, MATCHES, UNCLEAR = 0, 1, 2

# Unsigned constants: a signed and an unsigned operand would both be converted to float.
_0, _1, _3, _4, _5, _8, _9, _10, _16, _32, _48, _63, _64 = map(np.uint64, (0, 1, 3, 4, 5, 8, 9, 10, 16, 32, 48, 63, 64))
_ZEROS, _SIXES, _HIGH = np.uint64(0x3030303030303030), np.uint64(0x4646464646464646), np.uint64(0x8080808080808080)
_QUOTES, _SLASHES = np.uint64(0x2222222222222222), np.uint64(0x5C5C5C5C5C5C5C5C)
_ONES, _SPACES = np.uint64(0x0101010101010101), np.uint64(0x2020202020202020)
_PAIRS, _UPPER, _LOWER = np.uint64(0x000000FF000000FF), np.uint64(0x000F424000000064), np.uint64(0x0000271000000001)
_NULL, _TRUE, _FALSE = (np.uint64(int.from_bytes(word)) for word in (b"null", b"true", b"false"))
_NAN, _ONE = np.uint64(0x7FF8000000000000), np.uint64(0x3FF0000000000000)  # as float64
_TENS = np.array([10**n for n in range(9)], dtype=np.uint64)
_LARGEST = np.array([(2**64 - 10**n) // 10**n for n in range(9)], dtype=np.uint64)  # to which n digits can be appended
# Below 2^53, a number with up to 22 digits after the point is a quotient of two exact float64: one division rounds it.
_EXACT, _MOST_PLACES = np.uint64(2**53), 22
_POWERS_OF_TEN = np.array([10.0**n for n in range(_MOST_PLACES + 1)])
_MOST_DIGITS = np.uint64(4000)  # Python limits the digits of an int


_TOKENS = "Array(int64, 2, 'C', readonly=True)"
_BYTES = "Array(uint8, 1, 'C', readonly=True)"


@kernel(f"int64({_BYTES}, int64, int64, {_BYTES}, {_TOKENS}, int64, int64, {POWERS}, uint64[::1])")
def read_message(
    data: ByteArray,
    begin_byte: int,
    end_byte: int,
    literals: ByteArray,
    tokens: IntArray,
    first: int,
    last: int,
    powers: npt.NDArray[np.uint64],
    bits: npt.NDArray[np.uint64],
) -> int:
    """Return whether the message of the bytes [begin_byte, end_byte) matches the tokens [first, last), and read it.

    `tokens` (m, 4): first byte and size of the preceding literal, kind, column of a wanted value (-1: not wanted). The
    wanted values are written to `bits` as float64. After the last literal, `literals` has at least 8 bytes. Digits are
    converted eight at a time: Lemire 2021 (decimal_kernel.py).
    """
    p, end, most = np.uint64(begin_byte), np.uint64(end_byte), np.uint64(data.size)
    unclear = False
    for t in range(first, last):
        literal, size, kind, column = np.uint64(tokens[t, 0]), np.uint64(tokens[t, 1]), tokens[t, 2], tokens[t, 3]
        if p + size > end:
            return OTHER
        differing = _0
        while size >= _8:
            differing |= load(data, p) ^ load(literals, literal)
            p, literal, size = p + _8, literal + _8, size - _8
        if size > _0 and p + _8 <= most:
            differing |= (load(data, p) ^ load(literals, literal)) << (_64 - _8 * size)
        else:
            for k in range(size):
                differing |= np.uint64(data[p + k] ^ literals[literal + k])
        if differing:
            return OTHER
        p += size
        if kind == END:
            return OTHER if p != end else UNCLEAR if unclear else MATCHES
        if p >= end:
            return OTHER
        byte = data[p]
        if kind == TEXT:
            while p + _8 <= end:
                word = load(data, p)
                quote, slash = word ^ _QUOTES, word ^ _SLASHES
                found = ((quote - _ONES) & ~quote) | ((slash - _ONES) & ~slash) | ((word - _SPACES) & ~word)
                count = trailing_zeros((found | word) & _HIGH) >> _3
                p += count
                if count != _8:
                    break
            while p < end:
                byte = data[p]
                if byte < 0x20 or byte >= 0x80 or byte == 0x22 or byte == 0x5C:
                    break
                p += _1
            continue  # the next literal begins with the closing quote
        if byte >= 0x61:  # null, true, false
            size = _5 if byte == 0x66 else _4
            if p + size > end:
                return OTHER
            word = _0
            for k in range(size):
                word = word << _8 | data[p + k]
            if word != _NULL and word != _TRUE and word != _FALSE:
                return OTHER
            p += size
            if column >= 0:
                bits[column] = _NAN if word == _NULL else _ONE if word == _TRUE else _0
            continue
        # -? (0 | [1-9][0-9]*) (. [0-9]+)? ([eE] [+-]? [0-9]+)?
        negative = np.uint64(byte == 0x2D)
        p += negative
        w = _0
        overflow = False
        begin = p
        whole = True
        sound = False
        after = p  # the first byte after the decimal point
        while True:
            # The digits of a fraction: 8 at a time, the last ones together.
            while not whole and p + _8 <= end:
                word = load(data, p)
                low = word - _ZEROS
                count = trailing_zeros(((word + _SIXES) | low) & _HIGH) >> _3
                if count == _0:
                    break
                low <<= _64 - _8 * count
                overflow = overflow or w > _LARGEST[count]
                low = low * _10 + (low >> _8)
                upper = (low & _PAIRS) * _UPPER
                lower = ((low >> _16) & _PAIRS) * _LOWER
                w = w * _TENS[count] + ((upper + lower) >> _32)
                p += count
                if count != _8:
                    break
            while p < end:
                digit = np.uint64(data[p]) - _48
                if digit > _9:
                    break
                overflow = overflow or w > _LARGEST[1]
                w = w * _10 + digit
                p += _1
            if not whole:
                break
            sound = p > begin and (data[begin] != 0x30 or p == begin + _1)  # type: ignore[assignment]
            if not sound or p >= end or data[p] != 0x2E:
                break
            whole = False
            p += _1
            after = p
        if not sound or (p - begin > _MOST_DIGITS if whole else p == after):
            return OTHER
        q = np.int64(0) if whole else np.int64(after) - np.int64(p)
        if p < end and data[p] | 0x20 == 0x65:
            whole = False
            p += _1
            down = p < end and data[p] == 0x2D
            if down or (p < end and data[p] == 0x2B):
                p += _1
            after = p
            power = 0
            while p < end:
                digit = np.uint64(data[p]) - _48
                if digit > _9:
                    break
                power = min(power * 10 + np.int64(digit), 100000)  # type: ignore[assignment]
                p += _1
            if p == after:
                return OTHER
            q += -power if down else power
        if column >= 0:
            if overflow:
                value = UNDECIDED
            elif w <= _EXACT and -_MOST_PLACES <= q <= 0:
                value = np.float64(np.float64(w) / _POWERS_OF_TEN[-q]).view(np.uint64)
            else:
                value = float_bits(w, q, powers)
            unclear = unclear or value == UNDECIDED
            # An integer has no negative zero.
            bits[column] = value if whole and w == _0 else value | negative << _63
    return OTHER


@kernel(
    f"void({_BYTES}, Array(int64, 1, 'A', readonly=True), Array(int64, 1, 'A', readonly=True), {_BYTES}, {_TOKENS}, "
    f"{POWERS}, uint64[:,::1], uint8[::1])"
)
def read_matching(
    data: ByteArray,
    start: IntArray,
    length: IntArray,
    literals: ByteArray,
    tokens: IntArray,
    powers: npt.NDArray[np.uint64],
    bits: npt.NDArray[np.uint64],
    matches: ByteArray,
) -> None:
    """Fill `matches` (n,) and, for messages that match, `bits` (n, columns) with the wanted values as float64.

    The parameters are those of `read_message`.
    """
    for i in range(start.size):
        begin = start[i]
        matches[i] = read_message(data, begin, begin + length[i], literals, tokens, 0, tokens.shape[0], powers, bits[i])
