"""Messages that are laid out as one before them: compared and copied out of the file's bytes in one pass."""

from __future__ import annotations

import numpy as np

from cdtool.instructions import prefetch
from cdtool.kernels import kernel
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray
from cdtool.messages.columns.walk_kernel import PLACES
from cdtool.messages.fast_path import Words

WORD = 8  # bytes
_LINE = 64  # bytes of the cache's lines
_AHEAD = 8  # messages
_MOST_AHEAD = 1024  # bytes of a message


@kernel(
    f"b1(Array(uint64, 1, 'A', readonly=True, aligned=False), {PLACES}, {PLACES}, int64, int64, "
    "uint64[::1], uint64[::1], uint64[::1], uint64[::1], uint64[::1], int64[::1], int64[::1], uint64[::1])"
)
def take_alike(
    words: Words,
    start: IntArray,
    length: IntArray,
    shortest: int,
    longest: int,
    compared: Words,
    mask: Words,
    pattern: Words,
    copied: Words,
    shift: Words,
    first: IntArray,
    step: IntArray,
    taken: Words,
) -> bool:
    """Copy a message's words to `taken`; False where one is not alike (Alike; fast_path.py).

    `words[p]` are the 8 bytes from byte p on. The word at `copied[k]` of message i, moved down by `shift[k]` bits,
    becomes `taken[first[k] + i step[k]]`.
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
            taken[np.uint64(first[k] + i * step[k])] = words[begin + copied[k]] >> shift[k]
    return True


def words_of(data: ByteArray) -> Words:
    """The 8 bytes from every byte on, as overlapping numbers."""
    return np.ndarray((max(0, len(data) - WORD + 1),), np.uint64, data, strides=(1,))


def compared_words(mask: ByteArray, pattern: ByteArray) -> tuple[Words, Words, Words]:
    """Places (m,), masks and patterns of the words that hold all bytes of `mask` (at least 8 bytes) that are not 0."""
    places: list[int] = []
    for at in np.flatnonzero(mask).tolist():
        if not places or at >= places[-1] + WORD:
            places.append(min(at, len(mask) - WORD))
    chosen = np.array(places, dtype=np.uint64)
    return chosen, words_of(mask)[chosen].copy(), words_of(pattern)[chosen].copy()
