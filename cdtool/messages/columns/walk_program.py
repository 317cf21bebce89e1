"""Schema -> the program that finds the wanted places of its messages (walk_kernel.py)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cdtool.messages.columns import walk_kernel as steps
from cdtool.messages.columns.decoded_batch import IntArray, UndecodableError
from cdtool.messages.columns.member_locations import Place
from cdtool.messages.layouts.layout import Layout, Member, Message, Number, Schema, Text

_LONGEST_PROGRAM = 20_000
_LARGEST_MESSAGE = 2**40
_LARGEST_ELEMENT = 2**24
# A wanted place from here on: its slot, the elements of the loops around it, what is left of it.
_Want = tuple[int, tuple[tuple[int, int], ...], Place]


@dataclass(frozen=True)
class Program:
    """The steps (m, 5), how many slots they fill, and each place's slot and number type (None: texts or messages)."""

    steps: IntArray
    slots: int
    places: dict[Place, tuple[int, Number | None]]


def compile_program(schema: Schema, places: Sequence[Place], aligned: bool) -> Program:
    """The program that finds `places` in a message of `schema`; raises UndecodableError.

    `aligned`: CDR. A message without members is one byte there, and none in ROS 1.
    """
    compiler = _Compiler(schema, aligned)
    wants: list[_Want] = []
    for place in places:
        wants.append((compiler.slots, (), place))
        compiler.slots += 2  # the second one is for the end of an array of texts
    compiler.message(schema.root, wants, 0)
    compiler.flush()
    rows = np.array(compiler.rows, dtype=np.int64).reshape(-1, steps.COLUMNS)
    return Program(rows, compiler.slots, {place: (2 * i, compiler.kinds.get(2 * i)) for i, place in enumerate(places)})


@dataclass
class _Compiler:
    """`modulus` and `residue` are what is known of the position in the message; `ahead` bytes are not yet written."""

    schema: Schema
    aligned: bool
    rows: list[tuple[int, int, int, int, int]] = field(default_factory=list)
    kinds: dict[int, Number] = field(default_factory=dict)
    slots: int = 0
    ahead: int = 0
    modulus: int = 8
    residue: int = 0
    visited: int = 0
    sizes: dict[str, tuple[int, int]] = field(default_factory=dict)

    def step(self, what: int, slot: int = -1, elements: int = 0, a: int = 0, b: int = 0) -> None:
        self.bound(len(self.rows), _LONGEST_PROGRAM)
        self.rows.append((what, slot, elements, a, b))

    def bound(self, value: int, limit: int) -> None:
        # A schema of a hundred lines can nest arrays of arrays into more bytes or fields than any machine holds.
        if value >= limit:
            raise UndecodableError(f"schema '{self.schema.root.name}' is too large")

    def flush(self) -> None:
        if self.ahead:
            self.step(steps.ADVANCE, a=self.ahead)
        self.ahead = 0

    def align(self, size: int) -> None:
        if not self.aligned or size == 1:
            return
        if self.modulus % size:
            self.flush()
            self.step(steps.ALIGN, a=size)
            self.modulus, self.residue = size, 0
        else:
            self.advance(-self.residue % size)

    def advance(self, count: int) -> None:
        self.bound(count, _LARGEST_MESSAGE)
        self.ahead += count
        self.residue = (self.residue + count) % self.modulus

    def unknown(self, modulus: int = 1) -> None:
        self.modulus, self.residue = (modulus if self.aligned else 1), 0

    def chosen(self, wants: Sequence[_Want]) -> int:
        """The slot of the place that ends here; -1: none, or selected by the loops around it."""
        if len(wants) == 1 and not wants[0][1]:
            return wants[0][0]
        for slot, guards, _ in wants:
            for loop, element in guards:
                self.step(steps.GUARD, a=loop, b=element)
            self.step(steps.SELECT, slot)
        return -1

    def message(self, layout: Layout, wants: Sequence[_Want], depth: int) -> None:
        if not layout.members and self.aligned:
            self.advance(1)
        self.visited += len(layout.members)
        self.bound(self.visited, _LONGEST_PROGRAM)
        for member in layout.members:
            mine = [want for want in wants if want[2][0] == member.name]
            if isinstance(member.kind, Number):
                self.number(member.kind, member, mine)
            elif isinstance(member.kind, Text):
                self.text(member, mine, depth)
            elif member.array is None:
                inner = [(slot, guards, place[1:]) for slot, guards, place in mine if len(place) > 1]
                self.message(self.schema.nested(member.kind), inner, depth)
            else:
                self.messages(member.kind, member.array.length, mine, depth)

    def number(self, kind: Number, member: Member, wants: Sequence[_Want]) -> None:
        for slot, _, _ in wants:
            self.kinds[slot] = kind
        elements = 1 if member.array is None else member.array.length
        if elements is None:
            self.flush()
            slot = self.chosen(wants)
            self.step(steps.SEQUENCE, slot, -1, kind.size, kind.size)
            self.unknown(min(kind.size, 4))
            return
        self.align(kind.size)
        if wants:
            slot = self.chosen(wants)
            self.step(steps.TAKE, slot, elements, self.ahead)
        self.advance(elements * kind.size)

    def text(self, member: Member, wants: Sequence[_Want], depth: int) -> None:
        self.flush()
        if member.array is None:
            self.step(steps.TEXT, elements=-1)
        else:
            begin = self.loop(member.array.length, wants, depth)
            self.step(steps.TEXT, elements=-1)
            self.end(begin)
            if wants:
                self.step(steps.STOP, self.chosen(wants))
        self.unknown()

    def loop(self, length: int | None, wants: Sequence[_Want], depth: int) -> int:
        if depth >= steps.DEEPEST:
            raise UndecodableError(f"more than {steps.DEEPEST} arrays of messages within one another")
        self.flush()
        slot = self.chosen(wants)
        begin = len(self.rows)
        self.step(steps.LOOP, slot, -1 if length is None else length)
        self.unknown()
        return begin

    def end(self, begin: int) -> None:
        self.flush()
        self.step(steps.END, a=begin + 1)
        self.rows[begin] = (*self.rows[begin][:3], len(self.rows), 0)
        self.unknown()

    def messages(self, kind: Message, length: int | None, wants: Sequence[_Want], depth: int) -> None:
        layout = self.schema.nested(kind)
        size, alignment = self.uniform(layout)
        inside = [want for want in wants if len(want[2]) > 1]
        here = [want for want in wants if len(want[2]) == 1]
        if alignment and not inside:
            self.elements(length, size, alignment, here)
            return
        begin = self.loop(length, here, depth)
        inner = [
            (slot, (*guards, (depth, int(place[1]))), place[2:]) for slot, guards, place in inside if len(place) > 2
        ]
        self.message(layout, inner, depth + 1)
        self.end(begin)

    def elements(self, length: int | None, size: int, alignment: int, wants: Sequence[_Want]) -> None:
        """An array of messages that lie without gaps, passed over as a whole."""
        if length is None:
            self.bound(size, _LARGEST_ELEMENT)
            self.flush()
            slot = self.chosen(wants)
            self.step(steps.SEQUENCE, slot, -1, size, alignment)
            self.unknown(min(alignment, 4))
            return
        self.align(alignment)
        if wants:
            self.step(steps.TAKE, self.chosen(wants), length, self.ahead)
        self.advance(length * size)

    def uniform(self, layout: Layout) -> tuple[int, int]:
        """Size and alignment of a message whose copies lie without gaps; alignment 0: they may not."""
        if layout.name not in self.sizes:
            self.sizes[layout.name] = self.measured(layout)
        return self.sizes[layout.name]

    def measured(self, layout: Layout) -> tuple[int, int]:
        size, alignments = (0 if layout.members or not self.aligned else 1), set()
        for member in layout.members:
            if isinstance(member.kind, Text) or (member.array is not None and member.array.length is None):
                return 0, 0
            each = alignment = member.kind.size if isinstance(member.kind, Number) else 0
            if isinstance(member.kind, Message):
                each, alignment = self.uniform(self.schema.nested(member.kind))
            size += each * (member.array.length or 1 if member.array is not None else 1)
            alignments.add(alignment if self.aligned or not alignment else 1)
        return (size, max(alignments, default=1)) if len(alignments) < 2 and 0 not in alignments else (0, 0)
