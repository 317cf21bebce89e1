"""Compiled fast path for a chunk: compare the layout of its messages with a pattern, and copy numbers into columns.

It runs directly after the decompression of the chunk, while the content is in the processor's cache.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.instructions import store
from cdtool.kernels import kernel
from cdtool.messages.columns.decoded_batch import IntArray

# Reason of the end: the chunk's end, a definition, or any other record that does not match.
DONE, DEFINITION, OTHER = range(3)
# A row of `bounds`: shortest and longest message; the channel's rows in the tables of compared words and of numbers,
# with float64 first; the byte of the header's stamp (-1: use the record's time); whether its seconds are signed.
SHORTEST, LONGEST, COMPARED, COMPARED_END, NUMBERS, OTHERS, NUMBERS_END, STAMP, SIGNED, BOUNDS = range(10)
# A row of `numbers`: the address of its column, the bytes between two rows of the column, and its byte in a message. A
# number of another type than float64 also has a kind, the word that contains it, and shifts of that word up and down.
ADDRESS, STRIDE, BYTE, KIND, WORD, UP, DOWN, NUMBER = range(8)
DOUBLE, SINGLE, SIGNED_INTEGER, UNSIGNED_INTEGER, TRUTH = range(5)
# Size of a record's prefix, and of the header in a message's content [bytes].
PREFIX, _HEADER = 9, 22
# Positions of log time and publish time in a message's content [bytes].
LOG_TIME, PUBLISH_TIME = 6, 14

NO_DATE = 1 << 63  # times from here [ns] are invalid, or before 1970
_SECOND = 10**9

_Words = npt.NDArray[np.uint64]
_Singles = npt.NDArray[np.float32]
_TABLE = "Array(uint64, 1, 'C', readonly=True)"
_ROWS = "Array(uint64, 2, 'C', readonly=True)"


def _overlapping(dtype: str) -> str:
    return f"Array({dtype}, 1, 'A', readonly=True, aligned=False)"


@kernel(
    f"UniTuple(int64, 2)({_overlapping('uint64')}, {_overlapping('float32')}, int64, int64, "
    "Array(int64, 1, 'C', readonly=True), Array(int64, 2, 'C', readonly=True), "
    f"{_TABLE}, {_TABLE}, {_TABLE}, {_ROWS}, {_TABLE}, int64, {_TABLE}, uint64[::1], uint64[::1], uint64[::1])"
)
def take_messages(
    words: _Words,
    singles: _Singles,
    at: int,
    end: int,
    slots: IntArray,
    bounds: IntArray,
    compared: _Words,
    mask: _Words,
    pattern: _Words,
    numbers: _Words,
    stamps: _Words,
    time: int,
    limits: _Words,
    rows: _Words,
    latest: _Words,
    times: _Words,
) -> tuple[int, int]:
    """Read the messages of the bytes [at, end); return the byte where that ends, and the reason.

    `words[p]` and `singles[p]` are read from byte p. `slots[channel]` is the channel's row of `bounds` (m, BOUNDS), or
    -1 for an unknown channel; messages of a channel without numbers are only counted. The numbers (k, NUMBER) of the
    next message are written to row `rows[slot]` of their columns, and its time to that row of the column at the address
    `stamps[slot]`; rows from `limits[slot]` are not written. `time` selects the time of the record. Outputs: `rows`
    (m,) are increased; `latest` (m,) is the time of the last message, or NO_DATE after a backward step or an invalid
    time; `times` (3,) are the earliest, latest and first log time of all messages.
    """
    # Unsigned, so that the compiled code does not test indices for negative values.
    eight, low, no_date = np.uint64(8), np.uint64(0xFFFFFFFF), np.uint64(NO_DATE)
    while at < end:
        if end - at < PREFIX:
            return at, OTHER
        opcode, size = words[at] & np.uint64(255), words[at + 1]
        if size > np.uint64(end - at - PREFIX):
            return at, OTHER
        if opcode == np.uint64(3) or opcode == np.uint64(4):
            return at, DEFINITION
        if opcode != np.uint64(5) or size < np.uint64(_HEADER):
            return at, OTHER
        body = np.uint64(at + PREFIX)
        channel = words[body] & np.uint64(0xFFFF)
        if channel >= np.uint64(slots.size) or slots[channel] < 0:
            return at, OTHER
        slot = np.uint64(slots[channel])
        begin = body + np.uint64(_HEADER)
        row = rows[slot]
        if bounds[slot, NUMBERS_END] > bounds[slot, NUMBERS]:
            length = np.int64(size) - _HEADER
            if length < bounds[slot, SHORTEST] or length > bounds[slot, LONGEST] or row >= limits[slot]:
                return at, OTHER
            differing = np.uint64(0)
            for i in range(bounds[slot, COMPARED], bounds[slot, COMPARED_END]):
                k = np.uint64(i)
                differing |= (words[begin + compared[k]] ^ pattern[k]) & mask[k]
            if differing:
                return at, OTHER
            for i in range(bounds[slot, NUMBERS], bounds[slot, OTHERS]):
                k = np.uint64(i)
                store(numbers[k, ADDRESS] + row * numbers[k, STRIDE], words[begin + numbers[k, BYTE]])
            for i in range(bounds[slot, OTHERS], bounds[slot, NUMBERS_END]):
                k = np.uint64(i)
                place = numbers[k, ADDRESS] + row * numbers[k, STRIDE]
                kind = numbers[k, KIND]
                if kind == np.uint64(SINGLE):
                    store(place, np.float64(singles[begin + numbers[k, BYTE]]))
                    continue
                word = words[begin + numbers[k, WORD]] << numbers[k, UP]
                number = word >> numbers[k, DOWN]
                if kind == np.uint64(SIGNED_INTEGER):
                    store(place, np.float64(np.int64(word) >> np.int64(numbers[k, DOWN])))
                elif kind == np.uint64(TRUTH):
                    store(place, np.float64(number != np.uint64(0)))
                else:
                    store(place, np.float64(number))
            stamp = words[body + np.uint64(time)]
            if bounds[slot, STAMP] >= 0:
                word = words[begin + np.uint64(bounds[slot, STAMP])]
                seconds = np.int64(word & low)
                if bounds[slot, SIGNED] and seconds >= 1 << 31:
                    seconds -= 1 << 32
                stamp = np.uint64(seconds * _SECOND + np.int64(word >> np.uint64(32)))
            store(stamps[slot] + row * eight, stamp)
            latest[slot] = min(stamp, no_date) if stamp >= latest[slot] else no_date
        rows[slot] = row + np.uint64(1)
        logged = words[body + np.uint64(LOG_TIME)]
        if times[0] > times[1]:
            times[2] = logged
        times[0] = min(times[0], logged)
        times[1] = max(times[1], logged)
        at = int(np.int64(body + size))
    return at, DONE
