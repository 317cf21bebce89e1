"""Walk messages that have no tags: a small program locates each wanted member.

Plain CDR (OMG DDS-XTypes 1.3, 7.4.1, encoding version 1) and ROS 1's serialisation write numbers in the order of the
schema, and strings and sequences after their length. CDR aligns each number to its size, counted from the first byte
after the encapsulation header; ROS 1 does not align.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.kernels import kernel
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray

# A program has one row per step: operation, slot (-1: the selected one), elements (-1: given in the message), a, b.
ADVANCE = 0  # by a bytes
ALIGN = 1  # to a multiple of a
GUARD = 2  # the next SELECT applies only in element b of loop a
SELECT = 3  # slot for the next step that uses one
TAKE = 4  # elements that begin a bytes ahead
TEXT = 5
SEQUENCE = 6  # of elements of a bytes, aligned to b
LOOP = 7  # a: the step after its end
END = 8  # a: the loop's first step
STOP = 9  # end of the slot

COLUMNS = 5
DEEPEST = 8  # nested loops
WHOLE, CUT, OTHER_KIND, LONG = 0, 1, 2, 3  # status of a message
PADDING = 3  # bytes that may follow a CDR message: some writers fill it up to a multiple of 4

BYTES = "Array(uint8, 1, 'C', readonly=True)"
QUADS = "Array(uint32, 1, 'A', readonly=True, aligned=False)"
POSITIONS = "Array(int64, 1, 'A', readonly=True)"


@kernel(
    f"void({BYTES}, {QUADS}, {POSITIONS}, {POSITIONS}, int64[:,::1], int64, int64[:,::1], int64[:,::1], "
    "int64[::1], uint8[::1], uint8[::1], int64[:,::1])"
)
def walk(
    data: ByteArray,
    quads: npt.NDArray[np.uint32],
    start: IntArray,
    length: IntArray,
    program: IntArray,
    header: int,
    at: IntArray,
    count: IntArray,
    lengths: IntArray,
    status: ByteArray,
    swapped: ByteArray,
    loops: IntArray,
) -> None:
    """Fill `at` and `count` (n, slots): first byte and number of elements of every slot; count -1: absent.

    `header` is 4 with CDR's encapsulation and alignment, 0 without; `swapped` marks big-endian messages. Results of a
    message are valid only if its status is 0. `quads[p]` are the 4 bytes of `data` from p on. `lengths` receives, for
    the last message, the number of its lengths, its end, and the byte positions of as many lengths as fit; its size may
    be 2. `loops` (2, DEEPEST) is scratch memory. No byte outside of a message is read, and no loop has more iterations
    than the message has bytes.
    """
    for i in range(start.size):
        p = start[i]
        end = p + length[i]
        for s in range(count.shape[1]):
            count[i, s] = -1
        swapped[i] = 0
        status[i] = WHOLE
        lengths[0] = 0
        if header > 0:
            if length[i] < header or data[p] != 0 or data[p + 1] > 1:
                status[i] = OTHER_KIND
                continue
            swapped[i] = 1 - data[p + 1]
        p += header
        body = p
        level = -1
        selected = -1
        applies = True
        step = 0
        while step < program.shape[0]:
            what, slot, number, a, b = (
                program[step, 0],
                program[step, 1],
                program[step, 2],
                program[step, 3],
                program[step, 4],
            )
            step += 1
            if what == ADVANCE:
                p += a
                continue
            if what == ALIGN:
                p += (body - p) & (a - 1)
                continue
            if what == GUARD:
                applies = applies and loops[0, a] == b
                continue
            if what == SELECT:
                if applies:
                    selected = slot
                applies = True
                continue
            if what == END:
                if p > end:
                    break
                loops[0, level] += 1
                if loops[0, level] < loops[1, level]:
                    step = a
                else:
                    level -= 1
                continue
            if number < 0:  # the length is given in the message
                if header > 0:
                    p += (body - p) & 3
                if p + 4 > end:
                    status[i] = CUT
                    break
                lengths[0] += 1
                if lengths[0] + 1 < lengths.size:
                    lengths[lengths[0] + 1] = p
                number = np.int64(quads[p])
                if swapped[i]:
                    number = (
                        number >> 24 | (number >> 8 & 0xFF00) | (number << 8 & 0xFF0000) | (number << 24 & 0xFF000000)
                    )
                p += 4
            if what == TEXT:
                p += number
                continue
            if slot < 0:
                slot, selected = selected, -1
            if what == STOP:
                if slot >= 0:
                    at[i, slot + 1] = p
                continue
            if what == SEQUENCE:
                if header > 0 and number > 0:
                    p += (body - p) & (b - 1)
                if slot >= 0:
                    at[i, slot], count[i, slot] = p, number
                p += number * a
                if p > end:
                    break
                continue
            if slot >= 0:
                at[i, slot], count[i, slot] = p, number
            if what == TAKE:
                if slot >= 0:
                    at[i, slot] = p + a
                continue
            if number > end - p:  # every element of a loop has at least one byte
                status[i] = CUT
                break
            if number == 0:
                step = a
            else:
                level += 1
                loops[0, level], loops[1, level] = 0, number
        lengths[1] = p
        if p > end:
            status[i] = CUT
        elif status[i] == WHOLE and end - p > (PADDING if header > 0 else 0):
            status[i] = LONG


@kernel(f"b1({BYTES}, {POSITIONS}, {POSITIONS}, int64, uint8[::1], uint8[::1])")
def all_match(
    data: ByteArray, start: IntArray, length: IntArray, shortest: int, mask: ByteArray, pattern: ByteArray
) -> bool:
    """Return True if every message has `shortest` or more bytes, and the bits of `pattern` where `mask` is set.

    `pattern` has at most `shortest` bytes.
    """
    for i in range(start.size):
        if length[i] < shortest:
            return False
        # Unsigned indices avoid the check for negative ones, and byte arithmetic lets the compiler vectorise the loop.
        begin = np.uint64(start[i])
        differing = np.uint8(0)
        for k in range(np.uint64(pattern.size)):
            differing = np.uint8(differing | np.uint8(np.uint8(data[begin + k] ^ pattern[k]) & mask[k]))
        if differing:
            return False
    return True


@kernel(f"void({BYTES}, {POSITIONS}, int64, uint8[:,::1])")
def fetch(data: ByteArray, at: IntArray, offset: int, out: ByteArray) -> None:
    """Fill `out` (n, k) with the k bytes of `data` from `at[i] + offset` on, all of which must exist."""
    for i in range(at.size):
        begin = np.uint64(at[i] + offset)
        for k in range(np.uint64(out.shape[1])):
            out[i, k] = data[begin + k]
