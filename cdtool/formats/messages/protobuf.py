"""One protobuf message (MCAP, "Well-known message encodings"; protobuf.dev, "Encoding" and "Field Presence").

The package `protobuf` reads the descriptors. A number that is not written is 0 if its schema does not track presence
(proto3, neither `optional` nor in a `oneof`) and the message that contains it is present. Otherwise it is NaN: an
`optional` field, a member of a `oneof` other than the chosen one, any field of proto2, and all fields of an absent
nested message. A field written as another type, a truncated field, a varint without an end, and a group (which no
writer has used since 2008) damage the message.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from cdtool.base.errors import installing
from cdtool.formats.messages.alike import DamagedMessageError, Example, SchemaDecoder
from cdtool.formats.messages.decoded_batch import UndecodableError
from cdtool.formats.messages.fields import NO_MESSAGE
from cdtool.formats.messages.layout import TEXT, Layout, Member, SchemaError

# FieldDescriptor.TYPE_*: the names of the types by number, and numpy's code of those with a fixed size.
_TYPES = (
    *("double", "float", "int64", "uint64", "int32", "fixed64", "fixed32", "bool", "string", "group", "message"),
    *("bytes", "uint32", "enum", "sfixed32", "sfixed64", "sint32", "sint64"),
)
_FIXED = {"double": "<f8", "fixed64": "<u8", "sfixed64": "<i8", "float": "<f4", "fixed32": "<u4", "sfixed32": "<i4"}
# Wire types.
_VARINT, _EIGHT, _BLOCK, _FOUR = 0, 1, 2, 5


def protobuf_decoder(name: str, data: bytes) -> SchemaDecoder:
    """Return the decoder of the message `name` of a FileDescriptorSet; raises UndecodableError or SchemaError."""
    try:
        from google.protobuf import descriptor_pb2, descriptor_pool
    except ImportError as fault:
        raise UndecodableError(f"the package protobuf is not installed: {installing('protobuf')}") from fault
    try:
        files = {file.name: file for file in descriptor_pb2.FileDescriptorSet.FromString(data).file}
    except Exception as fault:  # its own error, or one of the implementation in C
        raise SchemaError("its descriptors are damaged") from fault
    pool = descriptor_pool.DescriptorPool()
    try:
        while files:
            _add(files, next(iter(files)), pool)
        root = pool.FindMessageTypeByName(name.lstrip("."))
    except Exception as fault:
        reason = " ".join(str(fault).split())[:120]
        raise SchemaError(f"its descriptors do not define '{name}': {reason}") from fault
    return SchemaDecoder(_layout(root, {}), walk_protobuf)


def _add(files: dict[str, Any], name: str, pool: Any) -> None:
    """Add a file to the pool, after those that it needs."""
    file = files.pop(name)
    for needed in file.dependency:
        if needed in files:
            _add(files, needed, pool)
    pool.Add(file)


def _layout(message: Any, layouts: dict[str, Layout]) -> Layout:
    if message.full_name in layouts:
        return layouts[message.full_name]
    layout = layouts[message.full_name] = Layout(message.full_name, is_entry=message.GetOptions().map_entry)
    for field in message.fields:
        wire = _TYPES[field.type - 1]
        kind: str | Layout = _FIXED.get(wire, "<i8")[1:]
        if field.message_type is not None:
            kind = _layout(field.message_type, layouts)
        elif wire in ("string", "bytes"):
            kind = TEXT
        layout.members.append(Member(field.name, kind, field.is_repeated, descriptor=field))
    return layout


def walk_protobuf(layout: Layout, payload: bytes) -> Example:
    """Return the layout of a message; raises DamagedMessageError."""
    walk = _FieldWalk(payload)
    walk.example.content = walk.empty(layout)
    walk.message(layout, walk.example.content, len(payload), 0)
    return walk.example


class _FieldWalk:
    """A walk over the fields of one message; `at` is the byte that it has reached."""

    def __init__(self, payload: bytes) -> None:
        self.example = Example(payload)
        self._payload, self._at = payload, 0

    def empty(self, layout: Layout) -> dict[str, Any]:
        """Return a message without any field."""
        return {member.name: self._absent(member) for member in layout.members}

    def _absent(self, member: Member) -> Any:
        if member.array:
            # The entries of a map have no order: none can be selected by number.
            return {} if isinstance(member.kind, Layout) and member.kind.is_entry else []
        if member.is_number:
            return math.nan if member.descriptor.has_presence else 0
        return "" if member.kind == TEXT else NO_MESSAGE

    def message(self, layout: Layout, content: dict[str, Any], end: int, depth: int) -> None:
        """Read fields up to byte `end` into `content`."""
        if depth > 100:  # as in the package
            raise self._not_protobuf()
        while self._at < end:
            key = self._varint(end)
            begin, size = self._value(key & 7 if key >> 3 else -1, end)
            member = layout.by_number.get(key >> 3)
            if member is None:
                continue
            content.update({other.name: self._absent(other) for other in layout.alternatives(member)})
            if member.is_number:
                found = self._numbers(_TYPES[member.descriptor.type - 1], member.array, key & 7, begin, size)
                before = content[member.name] if member.array else None
                content[member.name] = found[0] if before is None else [*before, *found] if before else found
            elif key & 7 != _BLOCK:
                raise self._other_type()
            elif isinstance(member.kind, Layout):
                self._nested(member, member.kind, content, begin, size, depth)
            elif not member.array:
                content[member.name] = self._payload[begin : self._at].decode(errors="replace")
            else:
                content[member.name].append(self._payload[begin : self._at].decode(errors="replace"))
                if member.name == "name":  # it may name the elements of an array
                    self.example.share(begin, size)

    def _numbers(self, kind: str, is_array: bool, wire: int, begin: int, size: int) -> Sequence[int]:
        code = _FIXED.get(kind)
        if wire == (_VARINT if code is None else _EIGHT if code[2] == "8" else _FOUR):
            return self.example.numbers(begin, 1, code or kind, size)
        if wire != _BLOCK or not is_array:
            raise self._other_type()
        end = self._at
        if code is None:
            found: list[int] = []
            self._at = begin
            while self._at < end:
                at, length = self._value(_VARINT, end)
                found += self.example.numbers(at, 1, kind, length)
            return found
        if size % int(code[2]):
            raise self._not_protobuf()
        return self.example.numbers(begin, size // int(code[2]), code, int(code[2])) if size else ()

    def _nested(
        self, member: Member, layout: Layout, content: dict[str, Any], begin: int, size: int, depth: int
    ) -> None:
        inner = content[member.name]
        if member.array or inner is NO_MESSAGE:
            inner = self.empty(layout)
            if not member.array:
                content[member.name] = inner
            elif not layout.is_entry:
                content[member.name].append(inner)
        self._at = begin
        self.message(layout, inner, begin + size, depth + 1)

    def _value(self, wire: int, end: int) -> tuple[int, int]:
        """Return first byte and size of a value, and go to the byte after it."""
        begin, size = self._at, {_EIGHT: 8, _FOUR: 4}.get(wire)
        if wire == _VARINT:
            self._varint(end, 0x80)
            return begin, self._at - begin
        if wire == _BLOCK:
            size = self._varint(end)
            begin = self._at
        if size is None or size > end - begin:
            raise self._not_protobuf()
        self._at = begin + size
        return begin, size

    def _varint(self, end: int, shared_bits: int = 0xFF) -> int:
        value, begin = 0, self._at
        for k, byte in enumerate(self._payload[begin : min(begin + 10, end)]):  # bytes of 64 bits
            value |= (byte & 0x7F) << (7 * k)
            if byte < 0x80:
                self._at = begin + k + 1
                self.example.share(begin, k + 1, shared_bits)
                return value
        raise self._not_protobuf()

    def _not_protobuf(self) -> DamagedMessageError:
        size = len(self._payload)
        return DamagedMessageError(f"a decoding error: its {size} bytes end within a field, or are not protobuf")

    def _other_type(self) -> DamagedMessageError:
        return DamagedMessageError("a decoding error: a field is written as another type than the schema's")
