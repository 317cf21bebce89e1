"""Schema -> the program that locates the wanted members of its messages (walk_kernel.py)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from cdtool.messages.columns import walk_kernel as steps
from cdtool.messages.columns.decoded_batch import IntArray, UndecodableError
from cdtool.messages.columns.member_locations import MemberPath
from cdtool.messages.layouts.layout import Layout, Member, Message, Number, Schema, Text

_KEPT = 32  # programs
_LONGEST_PROGRAM = 20_000
_LARGEST_MESSAGE = 2**40
_LARGEST_ELEMENT = 2**24
# A wanted member, seen from a nested message: its slot, the elements of the enclosing loops, the rest of its path.
_Want = tuple[int, tuple[tuple[int, int], ...], MemberPath]


@dataclass(frozen=True)
class Program:
    """The steps (m, 5), the number of slots, and each member's slot and number type (None: strings or messages)."""

    steps: IntArray
    slots: int
    members: dict[MemberPath, tuple[int, Number | None]]


@lru_cache(_KEPT)
def compile_program(schema: Schema, paths: tuple[MemberPath, ...], aligned: bool) -> Program:
    """Return the program that locates the members `paths` in a message of `schema`; raises UndecodableError.

    `aligned` is True for CDR, in which a message without members takes one byte; in ROS 1 it takes none. The last
    programs are kept for logs with the same schemas.
    """
    compiler = _Compiler(schema, aligned)
    wants: list[_Want] = []
    for path in paths:
        wants.append((compiler.slots, (), path))
        compiler.slots += 2  # the second one is for the end of an array of strings
    compiler.message(schema.root, wants, 0)
    compiler.flush()
    rows = np.array(compiler.rows, dtype=np.int64).reshape(-1, steps.COLUMNS)
    return Program(rows, compiler.slots, {path: (2 * i, compiler.kinds.get(2 * i)) for i, path in enumerate(paths)})


@dataclass
class _Compiler:
    """Compiles a schema member by member.

    The position in the message is known to be `residue` modulo `modulus`; an advance by `pending` bytes is pending.
    """

    schema: Schema
    aligned: bool
    rows: list[tuple[int, int, int, int, int]] = field(default_factory=list)
    kinds: dict[int, Number] = field(default_factory=dict)
    slots: int = 0
    pending: int = 0
    modulus: int = 8
    residue: int = 0
    visited: int = 0
    sizes: dict[str, tuple[int, int]] = field(default_factory=dict)

    def add_step(self, what: int, slot: int = -1, elements: int = 0, a: int = 0, b: int = 0) -> None:
        self.check_size(len(self.rows), _LONGEST_PROGRAM)
        self.rows.append((what, slot, elements, a, b))

    def check_size(self, value: int, limit: int) -> None:
        # A schema of a hundred lines can nest arrays of arrays into more bytes or fields than any memory can store.
        if value >= limit:
            raise UndecodableError(f"schema '{self.schema.root.name}' is too large")

    def flush(self) -> None:
        if self.pending:
            self.add_step(steps.ADVANCE, a=self.pending)
        self.pending = 0

    def align(self, size: int) -> None:
        if not self.aligned or size == 1:
            return
        if self.modulus % size:
            self.flush()
            self.add_step(steps.ALIGN, a=size)
            self.modulus, self.residue = size, 0
        else:
            self.advance(-self.residue % size)

    def advance(self, count: int) -> None:
        self.check_size(count, _LARGEST_MESSAGE)
        self.pending += count
        self.residue = (self.residue + count) % self.modulus

    def forget_position(self, modulus: int = 1) -> None:
        self.modulus, self.residue = (modulus if self.aligned else 1), 0

    def slot_of(self, wants: Sequence[_Want]) -> int:
        """Return the slot of the member that ends here; -1: it is not wanted, or the enclosing loops select it."""
        if len(wants) == 1 and not wants[0][1]:
            return wants[0][0]
        for slot, guards, _ in wants:
            for loop, element in guards:
                self.add_step(steps.GUARD, a=loop, b=element)
            self.add_step(steps.SELECT, slot)
        return -1

    def message(self, layout: Layout, wants: Sequence[_Want], depth: int) -> None:
        if not layout.members and self.aligned:
            self.advance(1)
        self.visited += len(layout.members)
        self.check_size(self.visited, _LONGEST_PROGRAM)
        for member in layout.members:
            mine = [want for want in wants if want[2][0] == member.name]
            if isinstance(member.kind, Number):
                self.number(member.kind, member, mine)
            elif isinstance(member.kind, Text):
                self.text(member, mine, depth)
            elif member.array is None:
                inner = [(slot, guards, path[1:]) for slot, guards, path in mine if len(path) > 1]
                self.message(self.schema.nested(member.kind), inner, depth)
            else:
                self.messages(member.kind, member.array.length, mine, depth)

    def number(self, kind: Number, member: Member, wants: Sequence[_Want]) -> None:
        for slot, _, _ in wants:
            self.kinds[slot] = kind
        elements = 1 if member.array is None else member.array.length
        if elements is None:
            self.flush()
            slot = self.slot_of(wants)
            self.add_step(steps.SEQUENCE, slot, -1, kind.size, kind.size)
            self.forget_position(min(kind.size, 4))
            return
        self.align(kind.size)
        if wants:
            slot = self.slot_of(wants)
            self.add_step(steps.TAKE, slot, elements, self.pending)
        self.advance(elements * kind.size)

    def text(self, member: Member, wants: Sequence[_Want], depth: int) -> None:
        self.flush()
        if member.array is None:
            self.add_step(steps.TEXT, elements=-1)
        else:
            begin = self.loop(member.array.length, wants, depth)
            self.add_step(steps.TEXT, elements=-1)
            self.end(begin)
            if wants:
                self.add_step(steps.STOP, self.slot_of(wants))
        self.forget_position()

    def loop(self, length: int | None, wants: Sequence[_Want], depth: int) -> int:
        if depth >= steps.DEEPEST:
            raise UndecodableError(f"more than {steps.DEEPEST} nested arrays of messages")
        self.flush()
        slot = self.slot_of(wants)
        begin = len(self.rows)
        self.add_step(steps.LOOP, slot, -1 if length is None else length)
        self.forget_position()
        return begin

    def end(self, begin: int) -> None:
        self.flush()
        self.add_step(steps.END, a=begin + 1)
        self.rows[begin] = (*self.rows[begin][:3], len(self.rows), 0)
        self.forget_position()

    def messages(self, kind: Message, length: int | None, wants: Sequence[_Want], depth: int) -> None:
        layout = self.schema.nested(kind)
        size, alignment = self.element_size(layout)
        inside = [want for want in wants if len(want[2]) > 1]
        here = [want for want in wants if len(want[2]) == 1]
        if alignment and not inside:
            self.elements(length, size, alignment, here)
            return
        begin = self.loop(length, here, depth)
        inner = [(slot, (*guards, (depth, int(path[1]))), path[2:]) for slot, guards, path in inside if len(path) > 2]
        self.message(layout, inner, depth + 1)
        self.end(begin)

    def elements(self, length: int | None, size: int, alignment: int, wants: Sequence[_Want]) -> None:
        """Add an array of messages without padding between them, skipped as a whole."""
        if length is None:
            self.check_size(size, _LARGEST_ELEMENT)
            self.flush()
            slot = self.slot_of(wants)
            self.add_step(steps.SEQUENCE, slot, -1, size, alignment)
            self.forget_position(min(alignment, 4))
            return
        self.align(alignment)
        if wants:
            self.add_step(steps.TAKE, self.slot_of(wants), length, self.pending)
        self.advance(length * size)

    def element_size(self, layout: Layout) -> tuple[int, int]:
        """Return size and alignment of a message that needs no padding in an array; alignment 0: it may need some."""
        if layout.name not in self.sizes:
            self.sizes[layout.name] = self.measure_element(layout)
        return self.sizes[layout.name]

    def measure_element(self, layout: Layout) -> tuple[int, int]:
        size, alignments = (0 if layout.members or not self.aligned else 1), set()
        for member in layout.members:
            if isinstance(member.kind, Text) or (member.array is not None and member.array.length is None):
                return 0, 0
            each = alignment = member.kind.size if isinstance(member.kind, Number) else 0
            if isinstance(member.kind, Message):
                each, alignment = self.element_size(self.schema.nested(member.kind))
            size += each * (member.array.length or 1 if member.array is not None else 1)
            alignments.add(alignment if self.aligned or not alignment else 1)
        return (size, max(alignments, default=1)) if len(alignments) < 2 and 0 not in alignments else (0, 0)
