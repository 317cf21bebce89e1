"""The common layout of messages without tags: byte offsets learned from one message and used for all.

Nearly always all messages of a batch have strings, sequences and names of the same lengths. Then the lengths and names
of one message are compared with those of every other one, the byte offsets are common to all, and the numbers are
copied in the same pass. If one message differs, all are walked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.columns import as_float64
from cdtool.messages.batch import Batch
from cdtool.messages.columns import walk_kernel
from cdtool.messages.columns.copy_kernel import WORD, compared_words, copy_uniform, words_of
from cdtool.messages.columns.decoded_batch import IntArray
from cdtool.messages.columns.field_values import FieldPlan, select_elements
from cdtool.messages.columns.member_locations import FixedElementNames, MemberLocations, MemberPath, Slot
from cdtool.messages.columns.sequential_walk import SequentialSlot, SequentialWalk
from cdtool.messages.columns.walk_program import Program
from cdtool.messages.fast_path import FieldOffsets, FixedLayout, MessageTemplate, StampOffset, Words
from cdtool.messages.layouts.layout import Number
from cdtool.recording import FloatArray

_MOST_LENGTHS = 256  # lengths in the message that the layout is learned from
_MOST_COPIED = 64  # numbers of a member copied during the comparison: of a longer array few may be wanted
_MOST_NUMBERS = 1024  # of one member, on the fast path


@dataclass(frozen=True)
class CopiedSlot:
    """A slot of numbers copied out of the messages: `words` (n, uniform)."""

    words: Words
    dtype: str
    uniform: int

    @property
    def count(self) -> IntArray:
        """The number of elements (n,)."""
        return np.full(len(self.words), self.uniform)

    def numbers(self, rows: IntArray | None, first: int, width: int) -> FloatArray:
        """Return (rows, width) float64; an int64 beyond 2^53 is rounded to the nearest."""
        words = self.words[:, first : first + width]
        if words.shape[1] < width:  # no message has them, so that no rows are requested
            return np.empty((0, width))
        raw = _numbers_of(words if rows is None else words[rows], self.dtype)
        return as_float64(raw)


@dataclass(frozen=True)
class UniformLayout:
    """The members located in one message, and the template that other messages must match to have the same layout.

    `members` are byte offset, count and type by path, `names` the element names. `copied_members` are the paths whose
    numbers are copied, each with the number of words copied before it. `copied` to `step` (k,) are the parameters of
    copy_uniform: the words, their `shift`, and `first` and `step` for a single message.
    """

    members: dict[MemberPath, tuple[int, int, Number | None]]
    names: dict[MemberPath, FixedElementNames]
    copied_members: dict[MemberPath, int]
    template: MessageTemplate
    copied: Words
    shift: Words
    before: IntArray
    step: IntArray

    def locate(self, batch: Batch) -> MemberLocations | None:
        """Return the members of all messages; None if a message does not match the template."""
        # Member by member, so that the numbers of one member are contiguous.
        n, template = len(batch), self.template
        copied = np.empty(n * len(self.copied), dtype=np.uint64)
        all_match = copy_uniform(
            words_of(batch.data),
            batch.start,
            batch.length,
            template.shortest,
            template.longest,
            template.compared,
            template.mask,
            template.pattern,
            self.copied,
            self.shift,
            self.before * (n - 1) + np.arange(len(self.copied)),
            self.step,
            copied,
        )
        if not all_match:
            return None
        slots: dict[MemberPath, Slot] = {}
        for path, (offset, count, kind) in self.members.items():
            if path in self.copied_members and kind is not None:
                begin = n * self.copied_members[path]
                slots[path] = CopiedSlot(copied[begin : begin + n * count].reshape(n, count), dtype_of(kind), count)
            else:
                slots[path] = SequentialSlot(batch.data, batch.start, offset, kind, count)
        return MemberLocations(np.zeros(n, dtype=np.uint8), "", slots, self.names, intact=True)


def dtype_of(kind: Number) -> str:
    """Return numpy's code without byte order; `?` for a byte that is not 0."""
    return "?" if kind.name == "bool" else kind.dtype


def _numbers_of(words: Words, dtype: str) -> npt.NDArray[Any]:
    """Return the numbers in the lower bytes of words."""
    size = np.dtype(dtype).itemsize
    if dtype == "?":
        return np.not_equal(words.astype(np.uint8), 0)
    return (words if size == WORD else words.astype(f"<u{size}")).view(f"<{dtype}")


def learn_layout(program: Program, batch: Batch, header: int) -> UniformLayout | None:
    """Return the layout of a batch's first message; None if it is damaged, big-endian, tiny or has too many lengths."""
    one = replace(batch, start=batch.start[:1], length=batch.length[:1])
    walk = SequentialWalk(program, one, header, _MOST_LENGTHS)
    lengths, begin = walk.lengths, int(batch.start[0])
    size = int(lengths[1]) - begin
    if walk.status[0] or walk.swapped[0] or lengths[0] > _MOST_LENGTHS or size < WORD:
        return None
    mask = np.zeros(size, dtype=np.uint8)
    mask[: 2 if header else 0] = 255  # the representation and the byte order
    for at in (lengths[2 : 2 + int(lengths[0])] - begin).tolist():
        mask[at : at + 4] = 255
    members, names, copied_members = {}, {}, {}
    numbers: list[int] = []  # byte offsets of the copied numbers
    before: list[int] = []
    step: list[int] = []
    for path, (slot, kind) in program.members.items():
        at, count = int(walk.at[0, slot]) - begin, int(walk.count[0, slot])
        members[path] = at, count, kind
        if kind is None:
            names[path] = FixedElementNames(walk.names(slot, one).of(0))
            mask[at : int(walk.at[0, slot + 1]) - begin if count >= 0 else at] = 255
        elif 0 < count <= _MOST_COPIED:
            copied_members[path] = len(numbers)
            before += count * [len(numbers)]
            step += count * [count]
            numbers += range(at, at + count * kind.size, kind.size)
    # A number at the end is read as part of the last whole word, so that no byte after the message is read.
    copied = np.minimum(np.array(numbers, dtype=np.uint64), np.uint64(size - WORD))
    template = MessageTemplate(
        size, size + (walk_kernel.PADDING if header else 0), *compared_words(mask, batch.data[begin : begin + size])
    )
    shift = (np.array(numbers, dtype=np.uint64) - copied) * np.uint64(8)
    order = (np.array(before, dtype=np.int64), np.array(step, dtype=np.int64))
    return UniformLayout(members, names, copied_members, template, copied, shift, *order)


def row_layout_of(
    layout: UniformLayout, plans: Sequence[FieldPlan], joints: Sequence[str], stamp: tuple[MemberPath, ...]
) -> FixedLayout | None:
    """Return the row layout of the plans' fields and of a header stamp at the paths `stamp`, for the fast path.

    None if the layout alone does not determine all of them.
    """
    fields = [_field_offsets(layout, plan, joints) for plan in plans]
    known = [each for each in fields if each is not None]
    stamp_offset = _stamp_offset(layout, stamp) if stamp else None
    if len(known) < len(fields) or (stamp and stamp_offset is None):
        return None
    return FixedLayout(layout.template, tuple(known), stamp_offset)


def _field_offsets(layout: UniformLayout, plan: FieldPlan, joints: Sequence[str]) -> FieldOffsets | None:
    offset, count, kind = layout.members[plan.path]
    if kind is None or not 0 < count <= _MOST_NUMBERS or plan.arrays:
        return None
    names = () if plan.names is None else layout.names[plan.names].names
    elements = select_elements(plan, count, names, joints)
    if elements is None:
        return None
    chosen = np.arange(count)[elements]
    at = tuple((offset + kind.size * chosen).ravel().tolist())
    return FieldOffsets(at, dtype_of(kind), single=chosen.ndim == 0, exact=kind.dtype not in ("i8", "u8"))


def _stamp_offset(layout: UniformLayout, stamp: tuple[MemberPath, ...]) -> StampOffset | None:
    """Return the offset of 4-byte seconds directly followed by nanoseconds, as in ROS 1 and 2; None if they differ."""
    (at, count, seconds), (next_at, next_count, rest) = (layout.members[path] for path in stamp)
    if seconds is None or rest is None or (count, next_count, next_at) != (1, 1, at + 4):
        return None
    return StampOffset(at, seconds.dtype == "i4") if seconds.dtype in ("i4", "u4") and rest.dtype == "u4" else None
