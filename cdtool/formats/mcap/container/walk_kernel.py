"""Compiled walk over records (section "Records" of the specification), and sorting of messages by channel."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.instructions import prefetch
from cdtool.kernels import kernel

# Reasons of the end of a walk.
DONE, FULL, OTHER_KIND, NO_KIND, TOO_LONG, SHORT_MESSAGE = range(6)

_PREFETCH = 1024  # distance of prefetching [bytes]: some records

Bytes = npt.NDArray[np.uint8]
_Array = npt.NDArray[Any]

_COLUMNS = "uint16[::1], int64[::1], int64[::1], uint64[::1]"


@kernel(
    "UniTuple(int64, 4)(Array(uint8, 1, 'C', readonly=True), int64, int64, boolean, int64, "
    f"{_COLUMNS}, int64, int64[:, ::1])"
)
def walk(
    data: Bytes,
    at: int,
    end: int,
    top_level: bool,
    messages: int,
    channel: _Array,
    start: _Array,
    length: _Array,
    log_time: _Array,
    definitions: int,
    others: _Array,
) -> tuple[int, int, int, int]:
    """Write the messages in data[at:end] to arrays, from row `messages`, and schemas and channels to `others`.

    A row of `others` (m, 3) is opcode, start and length of the content. Return the number of messages, the number of
    others, the byte where the walk ended, and the reason. At the top level a record of any other kind ends the walk; in
    a chunk, which must not contain such records, it is skipped.
    """
    why = DONE
    while at < end:
        if end - at < 9:
            why = TOO_LONG
            break
        opcode = data[at]
        size = np.uint64(0)
        for i in range(8):
            size |= np.uint64(data[at + 1 + i]) << np.uint64(8 * i)
        if opcode == 0:
            why = NO_KIND
            break
        if top_level and opcode != 3 and opcode != 4 and opcode != 5:
            why = OTHER_KIND
            break
        if size > np.uint64(end - at - 9):
            why = TOO_LONG
            break
        body = at + 9
        prefetch(data, at + _PREFETCH)
        if opcode == 5:
            if size < np.uint64(22):
                why = SHORT_MESSAGE
                break
            if messages == len(channel):
                why = FULL
                break
            logged = np.uint64(0)
            for i in range(8):
                logged |= np.uint64(data[body + 6 + i]) << np.uint64(8 * i)
            channel[messages] = np.uint16(data[body]) | (np.uint16(data[body + 1]) << np.uint16(8))
            start[messages] = body + 22
            length[messages] = np.int64(size) - 22
            log_time[messages] = logged
            messages += 1
        elif opcode == 3 or opcode == 4:
            if definitions == len(others):
                why = FULL
                break
            others[definitions, 0] = opcode
            others[definitions, 1] = body
            others[definitions, 2] = np.int64(size)
            definitions += 1
        at = body + int(np.int64(size))
    return messages, definitions, at, why


@kernel(f"void({_COLUMNS}, int64[::1], int64[::1], uint64[::1], int64[::1])")
def sort_by_channel(
    channel: _Array,
    start: _Array,
    length: _Array,
    log_time: _Array,
    start_out: _Array,
    length_out: _Array,
    log_time_out: _Array,
    place: _Array,
) -> None:
    """Sort messages by channel (stable counting sort).

    `place` is, by channel id, the first row of a channel's messages; it is changed to the row after its last message.
    """
    for i in range(len(channel)):
        k = place[channel[i]]
        place[channel[i]] = k + 1
        start_out[k] = start[i]
        length_out[k] = length[i]
        log_time_out[k] = log_time[i]
