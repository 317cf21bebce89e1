"""Compare messages with a template and copy their numbers out of the file's bytes in one pass."""

from __future__ import annotations

import numpy as np

from cdtool.instructions import prefetch
from cdtool.kernels import kernel
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray
from cdtool.messages.columns.walk_kernel import POSITIONS
from cdtool.messages.fast_path import Words

WORD = 8  # bytes
_CACHE_LINE = 64  # bytes
_PREFETCHED_MESSAGES = 8
_PREFETCHED_BYTES = 1024  # of one message, at most


@kernel(
    f"b1(Array(uint64, 1, 'A', readonly=True, aligned=False), {POSITIONS}, {POSITIONS}, int64, int64, "
    "uint64[::1], uint64[::1], uint64[::1], uint64[::1], uint64[::1], int64[::1], int64[::1], uint64[::1])"
)
def copy_uniform(
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
    out: Words,
) -> bool:
    """Copy words of all messages to `out`; return False if a message does not match the template (MessageTemplate).

    `words[p]` are the 8 bytes from byte p on. The word at `copied[k]` of message i, shifted down by `shift[k]` bits, is
    written to `out[first[k] + i step[k]]`.
    """
    span = min(shortest, _PREFETCHED_BYTES)
    for i in range(start.size):
        if length[i] < shortest or length[i] > longest:
            return False
        if i + _PREFETCHED_MESSAGES < start.size:
            ahead = start[i + _PREFETCHED_MESSAGES]
            for byte in range(ahead, ahead + span, _CACHE_LINE):
                prefetch(words, byte)
        begin = np.uint64(start[i])
        differing = np.uint64(0)
        for k in range(compared.size):
            differing |= (words[begin + compared[k]] ^ pattern[k]) & mask[k]
        if differing:
            return False
        for k in range(copied.size):
            out[np.uint64(first[k] + i * step[k])] = words[begin + copied[k]] >> shift[k]
    return True


def words_of(data: ByteArray) -> Words:
    """Return the 8 bytes from every byte on, as overlapping numbers without a copy."""
    return np.ndarray((max(0, len(data) - WORD + 1),), np.uint64, data, strides=(1,))


def compared_words(mask: ByteArray, pattern: ByteArray) -> tuple[Words, Words, Words]:
    """Return offsets (m,), masks and patterns of the words that cover all nonzero bytes of `mask` (8 bytes or more)."""
    offsets: list[int] = []
    for at in np.flatnonzero(mask).tolist():
        if not offsets or at >= offsets[-1] + WORD:
            offsets.append(min(at, len(mask) - WORD))
    chosen = np.array(offsets, dtype=np.uint64)
    return chosen, words_of(mask)[chosen].copy(), words_of(pattern)[chosen].copy()
