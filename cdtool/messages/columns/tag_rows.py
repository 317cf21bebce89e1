"""The rows of protobuf messages: the wanted tags in ascending order, learned from one message, and read from others.

Numbers of varying size, absent zeros and other tags may differ between messages; the lengths of arrays and the names of
their elements may not. Any message that does not match is decoded by protobuf_kernel.py: also one with a wanted tag
twice or out of order, as serialisers do not write them, with groups, or with another type than the schema's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from cdtool.instructions import load
from cdtool.kernels import kernel
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray
from cdtool.messages.columns.field_values import FieldPlan, select_elements
from cdtool.messages.columns.member_locations import MemberPath
from cdtool.messages.columns.protobuf_kernel import varint
from cdtool.messages.fast_path import FieldOffsets, StampValues, TokenLayout, TokenTemplate
from cdtool.messages.layouts.layout import Layout, Member, Message, Schema, Text

# A row of tokens, depth first and by ascending number: number and wire type as written; what it contains; the first of
# its values, and the type of a number; the size of its content [bytes]; its first byte in `literals`; the token after
# it and after those nested in it; whether an absent number is 0.
KEY, CONTENT, VALUE, TYPE, SIZE, LITERAL, AFTER, OPTIONAL, TOKEN = range(9)
NUMBER, ARRAY, STRING, MESSAGE = range(4)
DOUBLE, SINGLE, UINT64, INT64, UINT32, INT32, BOOL, SINT64, SINT32 = range(9)
# A row of `levels` for each level of nesting: the message's end, its first and last token, and the next one.
DEEPEST, LEVEL = 32, 4

_1, _8 = map(np.uint64, (1, 8))
_LOW = np.uint64(0xFFFFFFFF)
_Words = npt.NDArray[np.uint64]
_BYTES = "Array(uint8, 1, 'C', readonly=True)"
_TOKENS = "Array(int64, 2, 'C', readonly=True)"
_MOST_VALUES = 1024  # of one message
_MOST_NAMES = 256
_VARINT, _EIGHT, _LENGTH, _FOUR = 0, 1, 2, 5  # wire types
_FIXED = {
    "double": (_EIGHT, DOUBLE),
    "fixed64": (_EIGHT, UINT64),
    "sfixed64": (_EIGHT, INT64),
    "float": (_FOUR, SINGLE),
    "fixed32": (_FOUR, UINT32),
    "sfixed32": (_FOUR, INT32),
}
_VARINTS = {
    "int32": INT32,
    "enum": INT32,
    "uint32": UINT32,
    "int64": INT64,
    "uint64": UINT64,
    "bool": BOOL,
    "sint32": SINT32,
    "sint64": SINT64,
}


@dataclass(frozen=True)
class ExampleMessage:
    """What a layout is learned from: the number of elements of each array, and the names of elements, by path."""

    counts: Mapping[MemberPath, int]
    names: Mapping[MemberPath, tuple[str, ...]]


def tag_layout(
    schema: Schema,
    example: ExampleMessage,
    plans: Sequence[FieldPlan],
    joints: Sequence[str],
    stamp: tuple[MemberPath, ...],
) -> TokenLayout | None:
    """Return the row layout of the fields and of a header stamp at the paths `stamp`; None if one has no tokens."""
    if any(plan.arrays for plan in plans):
        return None
    paths = dict.fromkeys((*(path for plan in plans for path in plan.paths), *stamp))
    tokens = _Tokens(example)
    if not tokens.add_message(schema, schema.root, (), tuple(paths), 1) or tokens.count > _MOST_VALUES:
        return None
    fields = []
    for plan in plans:
        count = example.counts[plan.path]
        names = () if plan.names is None else example.names[plan.names]
        elements = select_elements(plan, count, names, joints)
        if elements is None:
            return None
        chosen = tokens.first[plan.path] + np.arange(count)[elements]
        # Whether a number was rounded is checked in the column, as for messages that are decoded one by one.
        fields.append(FieldOffsets(tuple(chosen.ravel().tolist()), "f8", single=chosen.ndim == 0, exact=False))
    literals = np.frombuffer(bytes(tokens.literals), np.uint8)
    table = np.array(tokens.rows, np.int64).reshape(-1, TOKEN)
    template = TokenTemplate(table, literals, tokens.count, tagged=True)
    return TokenLayout(template, tuple(fields), StampValues(*(tokens.first[path] for path in stamp)) if stamp else None)


@dataclass
class _Tokens:
    """The tokens of the wanted members, depth first; `first` are the indices of their first values, by path."""

    example: ExampleMessage
    rows: list[list[int]] = field(default_factory=list)
    literals: bytearray = field(default_factory=bytearray)
    first: dict[MemberPath, int] = field(default_factory=dict)
    count: int = 0

    def add_message(
        self, schema: Schema, layout: Layout, above: MemberPath, paths: tuple[MemberPath, ...], depth: int
    ) -> bool:
        """Add the members of a message that `paths` contain; return False if one has no tokens."""
        names = {path[len(above)] for path in paths}
        members = [member for member in layout.members if member.name in names]
        if len(members) < len(names) or depth >= DEEPEST:
            return False
        return all(
            self._add(schema, member, (*above, member.name), paths, depth)
            for member in sorted(members, key=lambda member: member.tag.number if member.tag is not None else 0)
        )

    def _add(self, schema: Schema, member: Member, path: MemberPath, paths: tuple[MemberPath, ...], depth: int) -> bool:
        within = tuple(each for each in paths if each[: len(path)] == path)
        if member.tag is None or member.tag.oneof >= 0:
            return False
        if isinstance(member.kind, Message):
            if member.array is not None or path in within or member.tag.wire == "group":
                return False
            row = self._row(member.tag.number, _LENGTH, MESSAGE)
            complete = self.add_message(schema, schema.nested(member.kind), path, within, depth + 1)
            row[AFTER] = len(self.rows)
            return complete
        if isinstance(member.kind, Text):
            return self._add_names(member.tag.number, self.example.names[path])
        return self._add_numbers(member, path)

    def _add_names(self, number: int, names: tuple[str, ...]) -> bool:
        for name in names:
            row = self._row(number, _LENGTH, STRING)
            row[LITERAL], row[SIZE] = len(self.literals), len(name.encode())
            self.literals += name.encode()
        return 0 < len(names) <= _MOST_NAMES

    def _add_numbers(self, member: Member, path: MemberPath) -> bool:
        assert member.tag is not None
        count, tag = self.example.counts[path], member.tag
        wire, kind = _FIXED.get(tag.wire) or (_VARINT, _VARINTS.get(tag.wire, -1))
        if kind < 0 or count <= 0 or self.count + count > _MOST_VALUES:
            return False
        self.first[path] = self.count
        if member.array is None:
            row = self._row(tag.number, wire, NUMBER)
            row[OPTIONAL] = not tag.presence
        elif wire == _VARINT:
            return False
        else:
            row = self._row(tag.number, _LENGTH, ARRAY)
            row[SIZE] = count * (8 if wire == _EIGHT else 4)
        row[VALUE], row[TYPE] = self.count, kind
        self.count += count
        return True

    def _row(self, number: int, wire: int, content: int) -> list[int]:
        row = [0] * TOKEN
        row[KEY], row[CONTENT], row[AFTER] = number << 3 | wire, content, len(self.rows) + 1
        self.rows.append(row)
        return row


@kernel("uint64(int64, uint64)")
def _float_bits(kind: int, word: np.uint64) -> np.uint64:
    """Return the bits of a number as float64; `word` is a varint, or the bytes of a number of fixed width."""
    if kind == DOUBLE:
        return word
    if kind == SINGLE:
        number = np.float64(np.uint32(word).view(np.float32))
    elif kind == UINT64:
        number = np.float64(word)
    elif kind == INT64:
        number = np.float64(np.int64(word))
    elif kind == UINT32:
        number = np.float64(np.uint32(word))
    elif kind == INT32:
        number = np.float64(np.int32(word))
    elif kind == BOOL:
        number = np.float64(word != np.uint64(0))
    else:
        if kind == SINT32:
            word &= _LOW
        word = (word >> _1) ^ (~(word & _1) + _1)
        number = np.float64(np.int64(word)) if kind == SINT64 else np.float64(np.int32(word))
    return np.float64(number).view(np.uint64)


@kernel(f"int64({_BYTES}, int64, int64, int64)")
def _after_value(data: ByteArray, p: int, end: int, wire: int) -> int:
    """Return the byte after a value of this wire type; -1 if it is missing, or a group."""
    if wire == 0:
        _, p = varint(data, p, end)
        return p
    size = 8 if wire == 1 else 4
    if wire == 2:
        count, p = varint(data, p, end)
        size = np.int64(count)  # type: ignore[assignment]
        if p < 0 or size < 0:
            return -1
    elif wire != 1 and wire != 5:
        return -1
    return p + size if size <= end - p else -1


@kernel(
    f"b1({_BYTES}, int64, int64, {_TOKENS}, int64, int64, {_BYTES}, int64[:, ::1], uint64[::1])",
)
def read_tagged(  # noqa: C901, PLR0913  a kernel: one loop, arrays one by one
    data: ByteArray,
    p: int,
    end: int,
    tokens: IntArray,
    token: int,
    last: int,
    literals: ByteArray,
    levels: IntArray,
    values: _Words,
) -> bool:
    """Read the message of the bytes [p, end) into `values`; return False if it does not match tokens [token, last).

    The values are bits of float64. `levels` (DEEPEST, LEVEL) is overwritten.
    """
    depth, first = 0, token
    while True:
        if p >= end:
            while token < last:  # the absent ones
                if tokens[token, OPTIONAL] == 0:
                    return False
                values[tokens[token, VALUE]] = np.uint64(0)
                token = tokens[token, AFTER]
            if depth == 0:
                return True
            depth -= 1
            end, first, last, token = levels[depth, 0], levels[depth, 1], levels[depth, 2], levels[depth, 3]
            continue
        key = np.int64(data[np.uint64(p)])
        p += 1
        if key >= 0x80:
            long_key, p = varint(data, p - 1, end)
            if p < 0 or long_key > _LOW:
                return False
            key = np.int64(long_key)
        if key < 8:
            return False
        present = token
        while present < last and tokens[present, KEY] != key:
            present = tokens[present, AFTER]
        if present == last:
            other = first
            while other < last:
                if tokens[other, KEY] >> 3 == key >> 3:
                    return False
                other = tokens[other, AFTER]
            p = _after_value(data, p, end, key & 7)
            if p < 0:
                return False
            continue
        while token != present:
            if tokens[token, OPTIONAL] == 0:
                return False
            values[tokens[token, VALUE]] = np.uint64(0)
            token = tokens[token, AFTER]
        content, value, kind = tokens[present, CONTENT], tokens[present, VALUE], tokens[present, TYPE]
        token = tokens[present, AFTER]
        wire = key & 7
        if content == NUMBER:
            word = np.uint64(0)
            if wire == 0:
                word, p = varint(data, p, end)
                if p < 0:
                    return False
            else:
                width = 8 if wire == 1 else 4
                if width > end - p:
                    return False
                if width == 8:
                    word = load(data, p)
                else:
                    for i in range(4):
                        word |= np.uint64(data[p + i]) << np.uint64(8 * i)
                p += width
            values[value] = _float_bits(kind, word)
            continue
        length, p = varint(data, p, end)
        if p < 0 or length > np.uint64(end - p):
            return False
        size = np.int64(length)
        if content == MESSAGE:
            levels[depth, 0], levels[depth, 1], levels[depth, 2], levels[depth, 3] = end, first, last, token
            depth += 1
            end, first, token, last = p + size, present + 1, present + 1, token  # type: ignore[assignment]
            continue
        if size != tokens[present, SIZE]:
            return False
        if content == STRING:
            differing = np.uint8(0)
            begin, literal = np.uint64(p), np.uint64(tokens[present, LITERAL])
            for i in range(np.uint64(size)):
                differing = np.uint8(differing | np.uint8(data[begin + i] ^ literals[literal + i]))
            if differing:
                return False
        elif kind == DOUBLE:
            for i in range(size >> 3):
                values[value + i] = load(data, p + 8 * i)
        else:
            width = 4 if kind in (SINGLE, UINT32, INT32) else 8
            for i in range(size // width):
                word = np.uint64(0)
                for j in range(width):
                    word |= np.uint64(data[p + i * width + j]) << np.uint64(8 * j)
                values[value + i] = _float_bits(kind, word)
        p += size  # type: ignore[assignment]
