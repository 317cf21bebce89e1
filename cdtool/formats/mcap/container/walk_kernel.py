"""Compiled walk over records (section "Records" of the specification): messages into arrays, then sorted by channel."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.instructions import prefetch
from cdtool.kernels import kernel

# Why a walk ended.
DONE, FULL, OTHER_KIND, NO_KIND, TOO_LONG, SHORT_MESSAGE = range(6)

_AHEAD = 1024  # bytes: some records

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
    """The records in data[at:end]: messages into arrays from `messages` on, schemas and channels into `others`.

    A row of `others` (m, 3) is opcode, start and length of the content. Returns how many messages and others there are
    now, where the walk ended, and why. At the top level a record of any other kind ends it; in a chunk, where there
    should be none, it is passed over.
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
        prefetch(data, at + _AHEAD)
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
    """Counting sort, stable; `place` holds where each channel's messages begin, by its id, and then where they end."""
    for i in range(len(channel)):
        k = place[channel[i]]
        place[channel[i]] = k + 1
        start_out[k] = start[i]
        length_out[k] = length[i]
        log_time_out[k] = log_time[i]
