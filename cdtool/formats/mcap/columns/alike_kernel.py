"""Messages that are laid out as one before them: compared and copied out of the file's bytes in one pass."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.formats.mcap.columns.gathered import ByteArray, IntArray
from cdtool.formats.mcap.columns.walk_kernel import PLACES
from cdtool.kernels import kernel
from cdtool.prefetch import prefetch

WordArray = npt.NDArray[np.uint64]

WORD = 8  # bytes
_LINE = 64  # bytes of the cache's lines
_AHEAD = 8  # messages
_MOST_AHEAD = 1024  # bytes of a message


@kernel(
    f"b1(Array(uint64, 1, 'A', readonly=True, aligned=False), {PLACES}, {PLACES}, int64, int64, "
    "uint64[::1], uint64[::1], uint64[::1], uint64[::1], int64[::1], int64[::1], uint64[::1])"
)
def take_alike(
    words: WordArray,
    start: IntArray,
    length: IntArray,
    shortest: int,
    longest: int,
    compared: WordArray,
    mask: WordArray,
    pattern: WordArray,
    copied: WordArray,
    first: IntArray,
    step: IntArray,
    taken: WordArray,
) -> bool:
    """Copy the word at `copied[k]` of message i to `taken[first[k] + i step[k]]`; False where a message is not alike.

    `words[p]` are the 8 bytes from byte p on. Alike: from `shortest` to `longest` bytes, and at `compared` (m,) the
    bits of `mask` as in `pattern`. All these places begin at least 8 bytes before `shortest`.
    """
    span = min(shortest, _MOST_AHEAD)
    for i in range(start.size):
        if length[i] < shortest or length[i] > longest:
            return False
        if i + _AHEAD < start.size:
            for place in range(start[i + _AHEAD], start[i + _AHEAD] + span, _LINE):
                prefetch(words, place)
        begin = np.uint64(start[i])
        differing = np.uint64(0)
        for k in range(compared.size):
            differing |= (words[begin + compared[k]] ^ pattern[k]) & mask[k]
        if differing:
            return False
        for k in range(copied.size):
            taken[np.uint64(first[k] + i * step[k])] = words[begin + copied[k]]
    return True


def words_of(data: ByteArray) -> WordArray:
    """The 8 bytes from every byte on, as overlapping numbers."""
    return np.ndarray((max(0, len(data) - WORD + 1),), np.uint64, data, strides=(1,))


def compared_words(mask: ByteArray, pattern: ByteArray) -> tuple[WordArray, WordArray, WordArray]:
    """Places (m,), masks and patterns of the words that hold all bytes of `mask` (at least 8 bytes) that are not 0."""
    places: list[int] = []
    for at in np.flatnonzero(mask).tolist():
        if not places or at >= places[-1] + WORD:
            places.append(min(at, len(mask) - WORD))
    chosen = np.array(places, dtype=np.uint64)
    return chosen, words_of(mask)[chosen].copy(), words_of(pattern)[chosen].copy()
