"""Compiled fast path for a chunk: compare the layout of its messages with a pattern, and copy numbers into columns.

It runs directly after the decompression of the chunk, while the content is in the processor's cache.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.instructions import load, store
from cdtool.kernels import kernel
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray
from cdtool.messages.columns.json_kernel import MATCHES, read_message
from cdtool.messages.columns.tag_rows import read_tagged

# Reason of the end: the chunk's end, a definition, or any other record that does not match.
DONE, DEFINITION, OTHER = range(3)
# The form of a channel's messages: their numbers are not wanted, are at fixed bytes, or have tokens (fast_path.py).
COUNTED, FIXED, TAGGED, TEXT = range(4)
# A row of `bounds`: the form; shortest and longest message at fixed bytes; the channel's rows in the tables of compared
# words and of numbers, with float64 first; where seconds and nanoseconds of the header's stamp are (-1: use the
# record's time); its tokens and its first literal. At fixed bytes, NANOSECONDS is whether the seconds are signed.
(
    FORM,
    SHORTEST,
    LONGEST,
    COMPARED,
    COMPARED_END,
    NUMBERS,
    OTHERS,
    NUMBERS_END,
    STAMP,
    NANOSECONDS,
    TOKENS,
    TOKENS_END,
    BOUNDS,
) = range(13)
# A row of `numbers`: the address of its column, the bytes between two rows of the column, its byte in a message, and
# how many float64 follow each other there. A number of another type than float64 also has a kind, the word that
# contains it, and shifts of that word up and down. In messages with tokens, all are float64, in an array of values.
ADDRESS, STRIDE, BYTE, COUNT, KIND, WORD, UP, DOWN, NUMBER = range(9)
DOUBLE, SINGLE, SIGNED_INTEGER, UNSIGNED_INTEGER, TRUTH = range(5)
# The rows of `progress`, with a column per channel.
ROW, LIMIT, LATEST = range(3)
# Size of a record's prefix, and of the header in a message's content [bytes].
PREFIX, _HEADER = 9, 22
# Positions of log time and publish time in a message's content [bytes].
LOG_TIME, PUBLISH_TIME = 6, 14

NO_DATE = 1 << 63  # times from here [ns] are invalid, or before 1970
_SECOND = 10**9
_LATEST, _MOST_NANOSECONDS = 9_223_372_035.0, 2.0**53  # beyond these, a header's stamp is not used

_Words = npt.NDArray[np.uint64]
_Floats = npt.NDArray[np.float64]
_BYTES = "Array(uint8, 1, 'C', readonly=True)"
_TABLE = "Array(uint64, 1, 'C', readonly=True)"
_ROWS = "Array(uint64, 2, 'C', readonly=True)"
_TOKENS = "Array(int64, 2, 'C', readonly=True)"


@kernel(f"b1({_BYTES}, uint64, int64, int64, {_TABLE}, {_TABLE}, {_TABLE})")
def _matches(
    data: ByteArray, begin: np.uint64, first: int, last: int, compared: _Words, mask: _Words, pattern: _Words
) -> bool:
    """Return True if the compared words of the message that begins at a byte are as in the pattern."""
    differing = np.uint64(0)
    for i in range(first, last):
        k = np.uint64(i)
        differing |= (load(data, begin + compared[k]) ^ pattern[k]) & mask[k]
    return not differing


@kernel(f"void({_BYTES}, uint64, int64, int64, {_ROWS}, uint64)")
def _copy_doubles(data: ByteArray, begin: np.uint64, first: int, last: int, numbers: _Words, row: np.uint64) -> None:
    """Copy float64 that follow each other into a row of their columns."""
    for i in range(first, last):
        k = np.uint64(i)
        place = numbers[k, ADDRESS] + row * numbers[k, STRIDE]
        byte = begin + numbers[k, BYTE]
        for j in range(numbers[k, COUNT]):
            at = np.uint64(8) * np.uint64(j)
            store(place + at, load(data, byte + at))


@kernel(f"void({_BYTES}, uint64, int64, int64, {_ROWS}, uint64)")
def _copy_others(data: ByteArray, begin: np.uint64, first: int, last: int, numbers: _Words, row: np.uint64) -> None:
    """Copy numbers of other types than float64 into a row of their columns."""
    for i in range(first, last):
        k = np.uint64(i)
        place = numbers[k, ADDRESS] + row * numbers[k, STRIDE]
        kind = numbers[k, KIND]
        word = load(data, begin + numbers[k, WORD]) << numbers[k, UP]
        number = word >> numbers[k, DOWN]
        if kind == np.uint64(SINGLE):
            store(place, np.float64(np.uint32(number).view(np.float32)))
        elif kind == np.uint64(SIGNED_INTEGER):
            store(place, np.float64(np.int64(word) >> np.int64(numbers[k, DOWN])))
        elif kind == np.uint64(TRUTH):
            store(place, np.float64(number != np.uint64(0)))
        else:
            store(place, np.float64(number))


@kernel(
    f"UniTuple(int64, 2)({_BYTES}, int64, int64, "
    "Array(int64, 1, 'C', readonly=True), Array(int64, 2, 'C', readonly=True), "
    f"{_TABLE}, {_TABLE}, {_TABLE}, {_ROWS}, {_TABLE}, {_TOKENS}, {_TOKENS}, {_BYTES}, {_ROWS}, "
    "float64[::1], int64[:, ::1], int64, uint64[:, ::1], uint64[::1])"
)
def take_messages(
    data: ByteArray,
    at: int,
    end: int,
    slots: IntArray,
    bounds: IntArray,
    compared: _Words,
    mask: _Words,
    pattern: _Words,
    numbers: _Words,
    stamps: _Words,
    tags: IntArray,
    texts: IntArray,
    literals: ByteArray,
    powers: _Words,
    values: _Floats,
    levels: IntArray,
    time: int,
    progress: _Words,
    times: _Words,
) -> tuple[int, int]:
    """Read the messages of the bytes [at, end) of `data`; return the byte where that ends, and the reason.

    `slots[channel]` is the channel's row of `bounds` (m, BOUNDS), or -1 for an unknown channel. The numbers (k, NUMBER)
    of the next message are written to row `progress[ROW, slot]` of their columns, and its time to that row of the
    column at the address `stamps[slot]`; rows from `progress[LIMIT, slot]` are not written. `tags` and `texts` are the
    tokens of protobuf and JSON, which refer to `literals`. `values` and `levels` are overwritten by messages with
    tokens. `time` selects the time of the record. Outputs: rows in `progress` are increased; `progress[LATEST, slot]`
    is the time of the last message, or NO_DATE after a backward step or an invalid time; `times` (3,) are the earliest,
    latest and first log time of all messages.
    """
    # Unsigned, so that the compiled code does not test indices for negative values.
    eight, low, no_date = np.uint64(8), np.uint64(0xFFFFFFFF), np.uint64(NO_DATE)
    bits = values.view(np.uint64)
    copied = values.view(np.uint8)
    while at < end:
        if end - at < PREFIX:
            return at, OTHER
        opcode, size = data[at], load(data, at + 1)
        if size > np.uint64(end - at - PREFIX):
            return at, OTHER
        if opcode == 3 or opcode == 4:
            return at, DEFINITION
        if opcode != 5 or size < np.uint64(_HEADER):
            return at, OTHER
        body = np.uint64(at + PREFIX)
        channel = np.uint64(data[body]) | np.uint64(data[body + np.uint64(1)]) << eight
        if channel >= np.uint64(slots.size) or slots[channel] < 0:
            return at, OTHER
        slot = np.uint64(slots[channel])
        begin = body + np.uint64(_HEADER)
        row = progress[ROW, slot]
        form = bounds[slot, FORM]
        if form != COUNTED:
            length = np.int64(size) - _HEADER
            if row >= progress[LIMIT, slot]:
                return at, OTHER
            stamp = load(data, body + np.uint64(time))
            first, others, last = bounds[slot, NUMBERS], bounds[slot, OTHERS], bounds[slot, NUMBERS_END]
            if form == FIXED:
                if length < bounds[slot, SHORTEST] or length > bounds[slot, LONGEST]:
                    return at, OTHER
                if not _matches(
                    data, begin, bounds[slot, COMPARED], bounds[slot, COMPARED_END], compared, mask, pattern
                ):
                    return at, OTHER
                _copy_doubles(data, begin, first, others, numbers, row)
                _copy_others(data, begin, others, last, numbers, row)
                if bounds[slot, STAMP] >= 0:
                    word = load(data, begin + np.uint64(bounds[slot, STAMP]))
                    seconds = np.int64(word & low)
                    if bounds[slot, NANOSECONDS] and seconds >= 1 << 31:
                        seconds -= 1 << 32
                    stamp = np.uint64(seconds * _SECOND + np.int64(word >> np.uint64(32)))
            else:
                p, token, tokens_end = np.int64(begin), bounds[slot, TOKENS], bounds[slot, TOKENS_END]
                if form == TAGGED:
                    if not read_tagged(data, p, p + length, tags, token, tokens_end, literals, levels, bits):
                        return at, OTHER
                elif read_message(data, p, p + length, literals, texts, token, tokens_end, powers, bits) != MATCHES:
                    return at, OTHER
                if bounds[slot, STAMP] >= 0:
                    whole, rest = values[bounds[slot, STAMP]], values[bounds[slot, NANOSECONDS]]
                    if not (abs(whole) <= _LATEST and abs(rest) <= _MOST_NANOSECONDS):
                        return at, OTHER
                    stamp = np.uint64(np.int64(whole) * _SECOND + np.int64(rest))
                _copy_doubles(copied, np.uint64(0), first, last, numbers, row)
            store(stamps[slot] + row * eight, stamp)
            progress[LATEST, slot] = min(stamp, no_date) if stamp >= progress[LATEST, slot] else no_date
        progress[ROW, slot] = row + np.uint64(1)
        logged = load(data, body + np.uint64(LOG_TIME))
        if times[0] > times[1]:
            times[2] = logged
        times[0] = min(times[0], logged)
        times[1] = max(times[1], logged)
        at = int(np.int64(body + size))
    return at, DONE
