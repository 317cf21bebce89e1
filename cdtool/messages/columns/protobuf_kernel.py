"""Walking protobuf messages by their tags (protobuf.dev, "Encoding"): every wanted number, wherever its tag comes.

The last one of a field wins, messages that come in parts are one, repeated numbers come packed or one by one.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.kernels import kernel
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray

# A wanted tag, a row for each: its number, what it holds, slot, node of a nested message, its element (-1: any), oneof
# (-1: none), and the slots and nodes of all that it nests: first, and the one after the last.
NUMBER, HOLDS, SLOT, NODE, ELEMENT, ONEOF, FIRST_SLOT, LAST_SLOT, FIRST_NODE, LAST_NODE = range(10)
COLUMNS = 10
# What a tag holds: a varint, 8 or 4 bytes (+ REPEATED), texts, a message, one of which only the count is wanted, or
# nothing that is wanted.
VARINT, EIGHT, FOUR = 0, 1, 5  # as the wire type
REPEATED = 16
TEXTS, MESSAGE, GROUP, COUNT, UNWANTED = range(32, 37)
DEEPEST = 100
# Rows of `scratch`: places held in the pool by each slot, the chosen tag of each oneof, how often a tag of an array
# came, and of each level its end, node and group.
_ROOM, _CHOSEN, _TIMES, _ENDS, _NODE_AT, _GROUP_AT = range(6)
SCRATCH = DEEPEST + 1
WHOLE, CUT, WRONG = 0, 1, 2  # what becomes of a message; WRONG: written as another type

_BYTES = "Array(uint8, 1, 'C', readonly=True)"
_PLACES = "Array(int64, 1, 'A', readonly=True)"


@kernel(f"Tuple((uint64, int64))({_BYTES}, int64, int64)")
def varint(data: ByteArray, p: int, end: int) -> tuple[np.uint64, int]:
    """The number whose first byte is p, and the first byte after it; -1: it is cut off or longer than ten bytes."""
    value, shift = np.uint64(0), np.uint64(0)
    while p < end and shift < np.uint64(70):
        byte = np.uint64(data[np.uint64(p)])
        value |= (byte & np.uint64(0x7F)) << shift
        p += 1
        if byte < np.uint64(0x80):
            return value, p
        shift += np.uint64(7)
    return value, -1


@kernel(
    f"int64({_BYTES}, {_PLACES}, {_PLACES}, int64[:,::1], int64[:,::1], int64, int64[:,::1], int64[:,::1], "
    "uint8[:,::1], uint64[::1], uint8[::1], int64[:,::1])"
)
def read_tags(
    data: ByteArray,
    start: IntArray,
    length: IntArray,
    nodes: IntArray,
    tags: IntArray,
    oneofs: int,
    begin: IntArray,
    count: IntArray,
    seen: ByteArray,
    pool: npt.NDArray[np.uint64],
    status: ByteArray,
    scratch: IntArray,
) -> int:
    """Fill `begin`, `count` (n, slots), `seen` (n, nodes), `pool`; gives how much of it is used, -1: it is too small.

    What is wanted of slot s in message i are `pool[begin[i, s]]` and the following `count[i, s]`: a varint itself, of
    fixed-width numbers the first byte, of texts the first byte, counted from the message's, times 2^32 plus the size.
    `scratch` (6, SCRATCH and as many as slots, tags and oneofs) is overwritten. `nodes` (m, 2) are the first of its
    rows in `tags` and the one after the last.
    """
    used = 0
    for i in range(start.size):
        p = start[i]
        fate = WHOLE
        for s in range(count.shape[1]):
            count[i, s] = scratch[_ROOM, s] = 0
        for s in range(nodes.shape[0]):
            seen[i, s] = s == 0
        for s in range(oneofs):
            scratch[_CHOSEN, s] = -1
        for s in range(tags.shape[0]):
            scratch[_TIMES, s] = 0
        depth = 0
        scratch[_ENDS, 0], scratch[_NODE_AT, 0], scratch[_GROUP_AT, 0] = p + length[i], 0, 0
        while True:
            end, node, group = scratch[_ENDS, depth], scratch[_NODE_AT, depth], scratch[_GROUP_AT, depth]
            if p >= end:
                if group > 0:
                    fate = CUT
                    break
                depth -= 1
                if depth < 0:
                    break
                continue
            key, p = varint(data, p, end)
            number, wire = np.int64(key >> np.uint64(3)), np.int64(key & np.uint64(7))
            if p < 0 or number == 0 or key > np.uint64(0xFFFFFFFF) or wire > 5 or (wire == 4 and group != number):
                fate = CUT
                break
            if wire == 4:
                depth -= 1
                continue
            value = np.uint64(0)
            size = 8 if wire == 1 else 4 if wire == 5 else 0
            at = p
            if wire == 0 or wire == 2:
                value, at = varint(data, p, end)
                size = np.int64(value) if wire == 2 else 0  # type: ignore[assignment]
            if at < 0 or size < 0 or size > end - at:
                fate = CUT
                break
            p = at + size
            inner = -1
            first_tag, last_tag = (nodes[node, 0], nodes[node, 1]) if node >= 0 else (0, 0)
            for t in range(first_tag, last_tag):
                if tags[t, NUMBER] != number:
                    continue
                holds, slot, oneof = tags[t, HOLDS], tags[t, SLOT], tags[t, ONEOF]
                if oneof >= 0:
                    # Another member of the oneof, and all that it nests, is gone.
                    other = scratch[_CHOSEN, oneof]
                    if other >= 0 and other != t:
                        for s in range(tags[other, FIRST_SLOT], tags[other, LAST_SLOT]):
                            count[i, s] = scratch[_ROOM, s] = 0
                        for s in range(tags[other, FIRST_NODE], tags[other, LAST_NODE]):
                            seen[i, s] = 0
                    scratch[_CHOSEN, oneof] = t
                if holds == UNWANTED:
                    continue
                if MESSAGE <= holds <= COUNT:
                    if (holds != COUNT and (wire == 3) != (holds == GROUP)) or (wire != 2 and wire != 3):
                        fate = WRONG
                    times, element = scratch[_TIMES, t], tags[t, ELEMENT]
                    if holds == COUNT:
                        count[i, slot] += 1
                    elif element < 0 or element == times:
                        inner = tags[t, NODE]
                        seen[i, inner] = 1
                    scratch[_TIMES, t] = times + 1
                    continue
                expected = 2 if holds == TEXTS else holds & 15
                packed = wire == 2 and holds < TEXTS and holds >= REPEATED
                if wire != expected and not packed:
                    fate = WRONG
                    continue
                first, held, room = begin[i, slot], count[i, slot], scratch[_ROOM, slot]
                width = 8 if expected == EIGHT else 4
                q = at
                if packed and expected != VARINT and held == 0 and size > 0:
                    # The usual case at once: all elements of an array.
                    held = room = size // width
                    if held * width != size:
                        fate = CUT
                        break
                    first = used
                    used += held
                    if used > pool.size:
                        return -1
                    for k in range(held):
                        pool[first + k] = at + k * width
                    q = p
                while q < p or not packed:
                    if packed and expected == VARINT:
                        value, q = varint(data, q, p)
                    elif packed:
                        value = np.uint64(q)
                        q += width
                    elif expected == 2:
                        value = np.uint64(at - start[i]) << np.uint64(32) | np.uint64(size)
                    elif expected != VARINT:
                        value = np.uint64(at)
                    if q < 0 or q > p:
                        fate = CUT
                        break
                    if holds < REPEATED:
                        held = 0
                    if held == room:
                        further = room == 0 or first + room != used
                        moved, first = first, used if further else first
                        room = 2 * room + 1 if further else room + 1
                        used = first + room
                        if used > pool.size:
                            return -1
                        if further:  # elements that come between those of another field move to the pool's end
                            for k in range(held):
                                pool[first + k] = pool[moved + k]
                    pool[first + held] = value
                    held += 1
                    if not packed:
                        break
                begin[i, slot], count[i, slot], scratch[_ROOM, slot] = first, held, room
            if fate != WHOLE:
                break
            if inner >= 0 or wire == 3:
                if depth == DEEPEST:
                    fate = CUT
                    break
                depth += 1
                scratch[_NODE_AT, depth] = inner
                scratch[_GROUP_AT, depth] = number if wire == 3 else 0
                scratch[_ENDS, depth] = end if wire == 3 else p
                if wire != 3:
                    p = at
        status[i] = fate
    return used
