"""Compiled decoder of LZ4 frames (LZ4 Frame Format 1.6.x, LZ4 Block Format), straight into given memory.

The `lz4` package decodes into memory of its own, which it allocates and copies for every chunk; decoding straight into
the target takes a fifth less time. Damaged frames, and those with features that writers of MCAP do not use, are left to
the package and its error messages.

The package refuses blocks whose last bytes are not literals. Here they are decoded, so that a checksum
of the content must follow.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.instructions import copy_block, load, store
from cdtool.kernels import kernel

# The result for a frame that is damaged, has another size, or has features that writers of MCAP do not use.
NOT_DECODED = -1

_MAGIC = 0x184D2204
_SHORTEST = 11  # bytes of a frame without content: magic number, two descriptor bytes, their checksum, end mark
# The first descriptor byte: version 01, and flags. Only independent blocks and the content's size are handled.
_VERSION, _INDEPENDENT, _SIZED = 0x40, 0x20, 0x08
_SMALLEST_BLOCK, _LARGEST_BLOCK = 4, 7  # codes of 64 KiB to 4 MiB
_UNCOMPRESSED = 0x80000000
# The bytes that are copied at once, and those that copies may read and write beyond the end of a sequence.
_BLOCK, _MARGIN = 32, 64
# xxHash-32
_PRIME_1, _PRIME_2, _PRIME_3, _PRIME_4, _PRIME_5 = 0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D, 0x27D4EB2F, 0x165667B1
_LOW = 0xFFFFFFFF

Bytes = npt.NDArray[np.uint8]
_BYTES = "Array(uint8, 1, 'C', readonly=True)"


@kernel(f"uint64({_BYTES}, uint64, uint64)")
def _number(data: Bytes, at: np.uint64, size: np.uint64) -> np.uint64:
    """Return the little-endian number of some bytes."""
    number = np.uint64(0)
    for i in range(size):
        number |= np.uint64(data[at + np.uint64(i)]) << (np.uint64(8) * np.uint64(i))
    return number


@kernel("uint64(uint64, uint64)")
def _rotated(word: np.uint64, bits: np.uint64) -> np.uint64:
    """Return the lower 32 bits of a word, rotated to the left."""
    low = np.uint64(_LOW)
    return ((word << bits) | (word >> (np.uint64(32) - bits))) & low


@kernel(f"uint64({_BYTES}, uint64, uint64)")
def _short_hash(data: Bytes, at: np.uint64, size: np.uint64) -> np.uint64:
    """Return the xxHash-32 of fewer than 16 bytes."""
    low = np.uint64(_LOW)
    value = np.uint64(_PRIME_5) + size
    end = at + size
    while at + np.uint64(4) <= end:
        value = (value + _number(data, at, np.uint64(4)) * np.uint64(_PRIME_3)) & low
        value = (_rotated(value, np.uint64(17)) * np.uint64(_PRIME_4)) & low
        at += np.uint64(4)
    while at < end:
        value = (value + np.uint64(data[at]) * np.uint64(_PRIME_5)) & low
        value = (_rotated(value, np.uint64(11)) * np.uint64(_PRIME_1)) & low
        at += np.uint64(1)
    value = ((value ^ (value >> np.uint64(15))) * np.uint64(_PRIME_2)) & low
    value = ((value ^ (value >> np.uint64(13))) * np.uint64(_PRIME_3)) & low
    return value ^ (value >> np.uint64(16))


@kernel(f"uint64({_BYTES}, uint64, uint64)")
def _end_of_length(packed: Bytes, at: np.uint64, end: np.uint64) -> np.uint64:
    """Return the byte after the further bytes of a length: all of them 255 but the last; 0 if they do not end."""
    one, every = np.uint64(1), np.uint64(255)
    while at < end and np.uint64(packed[at]) == every:
        at += one
    return at + one if at < end else np.uint64(0)


@kernel(f"int64({_BYTES}, uint64, uint64, uint8[::1], uint64, uint64, uint64)")
def _decode_block(
    packed: Bytes,
    at: np.uint64,
    end: np.uint64,
    target: Bytes,
    first: np.uint64,
    filled: np.uint64,
    most: np.uint64,
) -> int:
    """Decode the block packed[at:end] into target[filled:most]; return the number of bytes in `target` afterwards.

    Matches refer to bytes from `first` on. NOT_DECODED if the block is damaged.
    """
    one, two, four, eight, sixteen = np.uint64(1), np.uint64(2), np.uint64(4), np.uint64(8), np.uint64(16)
    fifteen, every, block, margin = np.uint64(15), np.uint64(255), np.uint64(_BLOCK), np.uint64(_MARGIN)
    size = np.uint64(target.size)
    memory = np.uint64(target.ctypes.data)
    while at < end:
        token = np.uint64(packed[at])
        at += one
        count = token >> four
        if count == fifteen:
            more = at
            at = _end_of_length(packed, at, end)
            if not at:
                return NOT_DECODED
            count += every * (at - more - one) + np.uint64(packed[at - one])
        if at + count + margin <= end and filled + count + margin <= most:
            copy_block(memory + filled, packed, at)
            done = block
            while done < count:
                copy_block(memory + filled + done, packed, at + done)
                done += block
            at += count
            filled += count
            offset = load(packed, at) & np.uint64(0xFFFF)
            at += two
            count = (token & fifteen) + four
            if offset >= eight and offset <= filled - first and count < np.uint64(19):
                source = filled - offset
                store(memory + filled, load(target, source))
                store(memory + filled + eight, load(target, source + eight))
                store(memory + filled + sixteen, load(target, source + sixteen))
                filled += count
                continue
        else:
            if count > end - at or count > most - filled:
                return NOT_DECODED
            for i in range(count):
                target[filled + np.uint64(i)] = packed[at + np.uint64(i)]
            at += count
            filled += count
            if at == end:  # the last sequence has no match
                return int(np.int64(filled))
            if end - at < two:
                return NOT_DECODED
            offset = np.uint64(packed[at]) | np.uint64(packed[at + one]) << eight
            at += two
            count = (token & fifteen) + four
        if not offset or offset > filled - first:
            return NOT_DECODED
        if count == np.uint64(19):
            more = at
            at = _end_of_length(packed, at, end)
            if not at:
                return NOT_DECODED
            count += every * (at - more - one) + np.uint64(packed[at - one])
        if count > most - filled:
            return NOT_DECODED
        source = filled - offset
        if filled + count + margin > size:
            for i in range(count):
                target[filled + np.uint64(i)] = target[source + np.uint64(i)]
        elif offset >= block:
            done = np.uint64(0)
            while done < count:
                copy_block(memory + filled + done, target, source + done)
                done += block
        else:
            done = np.uint64(0)
            if offset < eight:  # repeat the bytes until the distance is a whole word
                while done < eight:
                    target[filled + done] = target[source + done]
                    done += one
                source -= offset * ((eight - one) // offset)
            while done < count:
                store(memory + filled + done, load(target, source + done))
                done += eight
        filled += count
    return NOT_DECODED


@kernel(f"int64({_BYTES}, uint8[::1])")
def decode_frame(packed: Bytes, target: Bytes) -> int:
    """Decode a frame that fills `target`; return its size, or NOT_DECODED, after which `target` has any content."""
    size, length = np.uint64(target.size), np.uint64(packed.size)
    if length < np.uint64(_SHORTEST) or _number(packed, np.uint64(0), np.uint64(4)) != np.uint64(_MAGIC):
        return NOT_DECODED
    flags, code = int(packed[4]), int(packed[5]) >> 4
    if flags & ~(_INDEPENDENT | _SIZED) != _VERSION or int(packed[5]) & 15:
        return NOT_DECODED
    if code < _SMALLEST_BLOCK or code > _LARGEST_BLOCK:
        return NOT_DECODED
    described = np.uint64(10) if flags & _SIZED else np.uint64(2)
    if flags & _SIZED and (length < np.uint64(_SHORTEST + 8) or _number(packed, np.uint64(6), np.uint64(8)) != size):
        return NOT_DECODED
    at = np.uint64(4) + described
    check = (_short_hash(packed, np.uint64(4), described) >> np.uint64(8)) & np.uint64(255)
    if check != np.uint64(packed[at]):
        return NOT_DECODED
    at += np.uint64(1)
    largest = np.uint64(1) << np.uint64(8 + 2 * code)
    filled = np.uint64(0)
    while length - at >= np.uint64(4):
        word = _number(packed, at, np.uint64(4))
        at += np.uint64(4)
        if not word:
            return int(np.int64(filled)) if at == length and filled == size else NOT_DECODED
        block = word & np.uint64(_UNCOMPRESSED - 1)
        if block > length - at or block > largest:
            return NOT_DECODED
        if word >= np.uint64(_UNCOMPRESSED):
            if block > size - filled:
                return NOT_DECODED
            for i in range(block):
                target[filled + np.uint64(i)] = packed[at + np.uint64(i)]
            filled += block
        else:
            first = filled if flags & _INDEPENDENT else np.uint64(0)
            end = _decode_block(packed, at, at + block, target, first, filled, min(size, filled + largest))
            if end < 0:
                return NOT_DECODED
            filled = np.uint64(end)
        at += block
    return NOT_DECODED
