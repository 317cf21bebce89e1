"""Read up to eight digits at once, from eight bytes of text in one 64-bit word.

A loop over the digits of a number ends in a jump that the processor cannot predict, as the length of numbers varies;
this takes longer than reading the digits. In a word, the number of digits takes a few operations, and their value three
products (Lemire, "Number parsing at a gigabyte per second", Software: Practice and Experience 51, 2021).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.instructions import trailing_zeros
from cdtool.kernels import kernel

Bytes = npt.NDArray[np.uint8]
BYTES = "Array(uint8, 1, 'C', readonly=True)"
# A word of text has the value 0 to 9 in place of each digit after an exclusive or with this one.
ZEROS = np.uint64(0x3030303030303030)

_2, _3, _8, _10, _16, _32 = map(np.uint64, (2, 3, 8, 10, 16, 32))
# Added to a byte up to 9 the second one leaves the byte's highest bit 0, added to a larger one it sets it.
_LOW_BITS, _ABOVE_NINE, _HIGH_BITS = map(np.uint64, (0x7F7F7F7F7F7F7F7F, 0x7676767676767676, 0x8080808080808080))
# Pairs of digits at bytes 0 and 4, and their weights: 100 and 10^6, then 1 and 10^4.
_PAIRS, _UPPER, _LOWER = map(np.uint64, (0x000000FF000000FF, 0x000F424000000064, 0x0000271000000001))


@kernel("uint64(uint64)")
def digit_count(word: np.uint64) -> np.uint64:
    """Return the number of digits at the start of a word, 0 to 8."""
    count: np.uint64 = trailing_zeros((((word & _LOW_BITS) + _ABOVE_NINE) | word) & _HIGH_BITS) >> _3
    return count


@kernel("int64(uint64, uint64)")
def first_digits(word: np.uint64, count: np.uint64) -> np.int64:
    """Return the number of the first `count` digits of a word; 0 for none."""
    # Shifted up, so that zeros precede them; in two steps, as no word can be shifted by 64 bits.
    half = _32 - (count << _2)
    eight = word << half << half
    pairs = eight * _10 + (eight >> _8)
    return np.int64(((pairs & _PAIRS) * _UPPER + (pairs >> _16 & _PAIRS) * _LOWER) >> _32)
