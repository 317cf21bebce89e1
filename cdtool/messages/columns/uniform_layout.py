"""Messages without tags that are alike: what was found in one holds for all.

Nearly always all messages of a batch have the same lengths (of texts, sequences and names) at the same places. Then
lengths and names of one message are compared with those of every other one, the offsets are common, and the numbers are
copied on the way. Where one message differs, all are walked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.messages.batch import Batch
from cdtool.messages.columns import walk_kernel
from cdtool.messages.columns.copy_kernel import WORD, compared_words, take_alike, words_of
from cdtool.messages.columns.decoded_batch import IntArray
from cdtool.messages.columns.field_values import Plan, elements_of
from cdtool.messages.columns.member_locations import FixedNames, Found, Place, Slot
from cdtool.messages.columns.sequential_walk import Walked, WalkedSlot
from cdtool.messages.columns.walk_program import Program
from cdtool.messages.fast_path import Alike, Numbers, Recipe, Stamp, Words
from cdtool.messages.layouts.layout import Number
from cdtool.recording import FloatArray

_MOST_LENGTHS = 256  # of a message that others are compared with
_MOST_TAKEN = 64  # numbers of a place that are copied while messages are compared: of more, few may be wanted
_MOST_NUMBERS = 1024  # of one place


@dataclass(frozen=True)
class TakenSlot:
    """Numbers that were copied out of the messages: `words` (n, uniform)."""

    words: Words
    dtype: str
    uniform: int

    @property
    def count(self) -> IntArray:
        """(n,)."""
        return np.full(len(self.words), self.uniform)

    def numbers(self, rows: IntArray | None, first: int, width: int) -> FloatArray:
        """(rows, width) float64; an int64 beyond 2^53 is rounded to the nearest."""
        words = self.words[:, first : first + width]
        if words.shape[1] < width:  # no message has them: no rows are asked for
            return np.empty((0, width))
        raw = _numbers_of(words if rows is None else words[rows], self.dtype)
        return raw if raw.dtype == np.float64 else raw.astype(np.float64)


@dataclass(frozen=True)
class Pattern:
    """What was found in one message, and what another one must have for the same to hold.

    `places` are offset, count and type, `names` the texts, `taken` the places whose numbers are copied, each with how
    many words of a message are copied before it. `copied` to `step` (k,) are take_alike's: the words, moved by
    `shift`, and for one message its `first` and `step`.
    """

    places: dict[Place, tuple[int, int, Number | None]]
    names: dict[Place, FixedNames]
    taken: dict[Place, int]
    alike: Alike
    copied: Words
    shift: Words
    before: IntArray
    step: IntArray

    def found(self, batch: Batch) -> Found | None:
        """The places of all messages; None where it does not hold for all."""
        # Place by place, so that each one's numbers lie side by side.
        n, alike = len(batch), self.alike
        copied = np.empty(n * len(self.copied), dtype=np.uint64)
        all_alike = take_alike(
            words_of(batch.data),
            batch.start,
            batch.length,
            alike.shortest,
            alike.longest,
            alike.compared,
            alike.mask,
            alike.pattern,
            self.copied,
            self.shift,
            self.before * (n - 1) + np.arange(len(self.copied)),
            self.step,
            copied,
        )
        if not all_alike:
            return None
        slots: dict[Place, Slot] = {}
        for place, (offset, count, kind) in self.places.items():
            if place in self.taken and kind is not None:
                begin = n * self.taken[place]
                slots[place] = TakenSlot(copied[begin : begin + n * count].reshape(n, count), dtype_of(kind), count)
            else:
                slots[place] = WalkedSlot(batch.data, batch.start, offset, kind, count)
        return Found(np.zeros(n, dtype=np.uint8), "", slots, self.names, whole=True)


def dtype_of(kind: Number) -> str:
    """numpy's code without byte order; `?`: a byte that is not 0."""
    return "?" if kind.name == "bool" else kind.dtype


def _numbers_of(words: Words, dtype: str) -> npt.NDArray[Any]:
    """The numbers in the lower bytes of words."""
    size = np.dtype(dtype).itemsize
    if dtype == "?":
        return np.not_equal(words.astype(np.uint8), 0)
    return (words if size == WORD else words.astype(f"<u{size}")).view(f"<{dtype}")


def pattern_of(program: Program, batch: Batch, header: int) -> Pattern | None:
    """The pattern of the batch's first message; None where it is damaged, big-endian, tiny or has too many lengths."""
    one = replace(batch, start=batch.start[:1], length=batch.length[:1])
    walked = Walked(program, one, header, _MOST_LENGTHS)
    lengths, begin = walked.lengths, int(batch.start[0])
    size = int(lengths[1]) - begin
    if walked.status[0] or walked.swapped[0] or lengths[0] > _MOST_LENGTHS or size < WORD:
        return None
    mask = np.zeros(size, dtype=np.uint8)
    mask[: 2 if header else 0] = 255  # the kind and the byte order
    for at in (lengths[2 : 2 + int(lengths[0])] - begin).tolist():
        mask[at : at + 4] = 255
    places, names, taken = {}, {}, {}
    numbers: list[int] = []  # where each one that is copied begins
    before: list[int] = []
    step: list[int] = []
    for place, (slot, kind) in program.places.items():
        at, count = int(walked.at[0, slot]) - begin, int(walked.count[0, slot])
        places[place] = at, count, kind
        if kind is None:
            names[place] = FixedNames(walked.names(slot, one).of(0))
            mask[at : int(walked.at[0, slot + 1]) - begin if count >= 0 else at] = 255
        elif 0 < count <= _MOST_TAKEN:
            taken[place] = len(numbers)
            before += count * [len(numbers)]
            step += count * [count]
            numbers += range(at, at + count * kind.size, kind.size)
    # The last words of a message are read whole, too.
    copied = np.minimum(np.array(numbers, dtype=np.uint64), np.uint64(size - WORD))
    alike = Alike(
        size, size + (walk_kernel.PADDING if header else 0), *compared_words(mask, batch.data[begin : begin + size])
    )
    shift = (np.array(numbers, dtype=np.uint64) - copied) * np.uint64(8)
    layout = (np.array(before, dtype=np.int64), np.array(step, dtype=np.int64))
    return Pattern(places, names, taken, alike, copied, shift, *layout)


def recipe_of(
    pattern: Pattern, plans: Sequence[Plan], joints: Sequence[str], stamp: tuple[Place, ...]
) -> Recipe | None:
    """Return the recipe of the plans' fields and of a stamp's places: how more such messages become rows (uniform.py).

    None where the pattern alone does not tell all.
    """
    fields = [_numbers(pattern, plan, joints) for plan in plans]
    there = [each for each in fields if each is not None]
    seconds = _stamp(pattern, stamp) if stamp else None
    if len(there) < len(fields) or (stamp and seconds is None):
        return None
    return Recipe(pattern.alike, tuple(there), seconds)


def _numbers(pattern: Pattern, plan: Plan, joints: Sequence[str]) -> Numbers | None:
    offset, count, kind = pattern.places[plan.place]
    if kind is None or not 0 < count <= _MOST_NUMBERS or plan.arrays:
        return None
    names = () if plan.names is None else pattern.names[plan.names].names
    elements = elements_of(plan, count, names, joints)
    if elements is None:
        return None
    chosen = np.arange(count)[elements]
    at = tuple((offset + kind.size * chosen).ravel().tolist())
    return Numbers(at, dtype_of(kind), single=chosen.ndim == 0)


def _stamp(pattern: Pattern, stamp: tuple[Place, ...]) -> Stamp | None:
    """Seconds of 4 bytes with nanoseconds right behind them, as in both ROS; None where it is otherwise."""
    (at, count, seconds), (behind, other, rest) = (pattern.places[place] for place in stamp)
    if seconds is None or rest is None or (count, other, behind) != (1, 1, at + 4):
        return None
    return Stamp(at, seconds.dtype == "i4") if seconds.dtype in ("i4", "u4") and rest.dtype == "u4" else None
