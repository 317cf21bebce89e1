"""Walk protobuf messages by their tags (protobuf.dev, "Encoding") and locate every wanted number, in any tag order.

If a field is repeated without being an array, the last value is used. The parts of a split message are merged. Repeated
numbers may be packed or written one by one.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.kernels import kernel
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray

# One row per wanted tag: its number, its content, slot, node of a nested message, its element (-1: any), oneof (-1:
# none), and the slots and nodes nested in it: the first, and the one after the last.
NUMBER, CONTENT, SLOT, NODE, ELEMENT, ONEOF, FIRST_SLOT, LAST_SLOT, FIRST_NODE, LAST_NODE = range(10)
COLUMNS = 10
# The content of a tag: a varint, 8 or 4 bytes (+ REPEATED), strings, a message, a message that is only counted, or
# content that is not wanted.
VARINT, EIGHT, FOUR = 0, 1, 5  # equal to the wire type
REPEATED = 16
TEXTS, MESSAGE, GROUP, COUNT, UNWANTED = range(32, 37)
DEEPEST = 100
# Rows of `scratch`: capacity of each slot in the pool, the chosen tag of each oneof, the occurrences of each tag, and
# for each level its end, node and group.
_CAPACITY, _CHOSEN, _OCCURRENCES, _ENDS, _NODE_AT, _GROUP_AT = range(6)
SCRATCH = DEEPEST + 1
WHOLE, CUT, WRONG = 0, 1, 2  # status of a message; WRONG: a field is written as another type

_BYTES = "Array(uint8, 1, 'C', readonly=True)"
_POSITIONS = "Array(int64, 1, 'A', readonly=True)"


@kernel(f"Tuple((uint64, int64))({_BYTES}, int64, int64)")
def varint(data: ByteArray, p: int, end: int) -> tuple[np.uint64, int]:
    """Return the number that begins at byte p, and the first byte after it; -1: it is truncated or too long."""
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
    f"int64({_BYTES}, {_POSITIONS}, {_POSITIONS}, int64[:,::1], int64[:,::1], int64, int64[:,::1], int64[:,::1], "
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
    """Fill `begin`, `count` (n, slots), `seen` (n, nodes), `pool`; return the entries used, -1 if it is too small.

    The entries of slot s in message i are the `count[i, s]` ones from `pool[begin[i, s]]` on. An entry is a varint's
    value, a fixed-width number's first byte, or a string's first byte, relative to the message, times 2^32 plus its
    size. `nodes` (m, 2) are a node's first row in `tags` and the one after its last. `scratch` (6, SCRATCH plus slots,
    tags and oneofs) is overwritten.
    """
    used = 0
    for i in range(start.size):
        p = start[i]
        outcome = WHOLE
        for s in range(count.shape[1]):
            count[i, s] = scratch[_CAPACITY, s] = 0
        for s in range(nodes.shape[0]):
            seen[i, s] = s == 0
        for s in range(oneofs):
            scratch[_CHOSEN, s] = -1
        for s in range(tags.shape[0]):
            scratch[_OCCURRENCES, s] = 0
        depth = 0
        scratch[_ENDS, 0], scratch[_NODE_AT, 0], scratch[_GROUP_AT, 0] = p + length[i], 0, 0
        while True:
            end, node, group = scratch[_ENDS, depth], scratch[_NODE_AT, depth], scratch[_GROUP_AT, depth]
            if p >= end:
                if group > 0:
                    outcome = CUT
                    break
                depth -= 1
                if depth < 0:
                    break
                continue
            key, p = varint(data, p, end)
            number, wire = np.int64(key >> np.uint64(3)), np.int64(key & np.uint64(7))
            if p < 0 or number == 0 or key > np.uint64(0xFFFFFFFF) or wire > 5 or (wire == 4 and group != number):
                outcome = CUT
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
                outcome = CUT
                break
            p = at + size
            inner = -1
            first_tag, last_tag = (nodes[node, 0], nodes[node, 1]) if node >= 0 else (0, 0)
            for t in range(first_tag, last_tag):
                if tags[t, NUMBER] != number:
                    continue
                content, slot, oneof = tags[t, CONTENT], tags[t, SLOT], tags[t, ONEOF]
                if oneof >= 0:
                    # This discards another member of the oneof, with everything nested in it.
                    other = scratch[_CHOSEN, oneof]
                    if other >= 0 and other != t:
                        for s in range(tags[other, FIRST_SLOT], tags[other, LAST_SLOT]):
                            count[i, s] = scratch[_CAPACITY, s] = 0
                        for s in range(tags[other, FIRST_NODE], tags[other, LAST_NODE]):
                            seen[i, s] = 0
                    scratch[_CHOSEN, oneof] = t
                if content == UNWANTED:
                    continue
                if MESSAGE <= content <= COUNT:
                    if (content != COUNT and (wire == 3) != (content == GROUP)) or (wire != 2 and wire != 3):
                        outcome = WRONG
                    occurrences, element = scratch[_OCCURRENCES, t], tags[t, ELEMENT]
                    if content == COUNT:
                        count[i, slot] += 1
                    elif element < 0 or element == occurrences:
                        inner = tags[t, NODE]
                        seen[i, inner] = 1
                    scratch[_OCCURRENCES, t] = occurrences + 1
                    continue
                expected = 2 if content == TEXTS else content & 15
                packed = wire == 2 and content < TEXTS and content >= REPEATED
                if wire != expected and not packed:
                    outcome = WRONG
                    continue
                first, stored, capacity = begin[i, slot], count[i, slot], scratch[_CAPACITY, slot]
                width = 8 if expected == EIGHT else 4
                q = at
                if packed and expected != VARINT and stored == 0 and size > 0:
                    # The usual case: all elements of an array at once.
                    stored = capacity = size // width
                    if stored * width != size:
                        outcome = CUT
                        break
                    first = used
                    used += stored
                    if used > pool.size:
                        return -1
                    for k in range(stored):
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
                        outcome = CUT
                        break
                    if content < REPEATED:
                        stored = 0
                    if stored == capacity:
                        moves = capacity == 0 or first + capacity != used
                        old_first, first = first, used if moves else first
                        capacity = 2 * capacity + 1 if moves else capacity + 1
                        used = first + capacity
                        if used > pool.size:
                            return -1
                        if moves:  # elements interleaved with those of another field move to the end of the pool
                            for k in range(stored):
                                pool[first + k] = pool[old_first + k]
                    pool[first + stored] = value
                    stored += 1
                    if not packed:
                        break
                begin[i, slot], count[i, slot], scratch[_CAPACITY, slot] = first, stored, capacity
            if outcome != WHOLE:
                break
            if inner >= 0 or wire == 3:
                if depth == DEEPEST:
                    outcome = CUT
                    break
                depth += 1
                scratch[_NODE_AT, depth] = inner
                scratch[_GROUP_AT, depth] = number if wire == 3 else 0
                scratch[_ENDS, depth] = end if wire == 3 else p
                if wire != 3:
                    p = at
        status[i] = outcome
    return used
