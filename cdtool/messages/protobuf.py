"""One protobuf message (MCAP, "Well-known message encodings"; protobuf.dev, "Encoding" and "Field Presence").

The package `protobuf` reads the descriptors. A number that is not written is 0 if its schema does not track presence
(proto3, neither `optional` nor in a `oneof`) and the message that contains it is present. Otherwise it is NaN: an
`optional` field, a member of a `oneof` other than the chosen one, any field of proto2, and all fields of an absent
nested message. A field written as another type, a truncated field and a varint without an end damage the message.
"""

from __future__ import annotations

import math
from typing import Any

from cdtool.errors import installing
from cdtool.messages.alike import DamagedMessageError, Example, SchemaDecoder
from cdtool.messages.decoded_batch import UndecodableError
from cdtool.messages.fields import NO_MESSAGE
from cdtool.messages.layout import Array, Layout, Member, Message, Number, Schema, SchemaError, Tag, Text

# FieldDescriptor.TYPE_*: the names of the types by number, and numpy's code of those with a fixed size.
_TYPES = ("double", "float", "int64", "uint64", "int32", "fixed64", "fixed32", "bool", "string", "group", "message")
_MORE_TYPES = ("bytes", "uint32", "enum", "sfixed32", "sfixed64", "sint32", "sint64")
_FIXED = {"double": "<f8", "fixed64": "<u8", "sfixed64": "<i8", "float": "<f4", "fixed32": "<u4", "sfixed32": "<i4"}
# Wire types.
_VARINT, _EIGHT, _BLOCK, _GROUP, _END, _FOUR = range(6)
_DEEPEST, _LONGEST_VARINT = 100, 10  # as in the package


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
    layouts: dict[str, Layout] = {}
    _add_layout(root, layouts)
    return SchemaDecoder(Schema(layouts[root.full_name], layouts), walk_protobuf)


def _add(files: dict[str, Any], name: str, pool: Any) -> None:
    """Add a file to the pool, after those that it needs."""
    file = files.pop(name)
    for needed in file.dependency:
        if needed in files:
            _add(files, needed, pool)
    pool.Add(file)


def _add_layout(message: Any, layouts: dict[str, Layout]) -> None:
    entry = message.GetOptions().map_entry
    layouts[message.full_name] = Layout(message.full_name, tuple(map(_member, message.fields)), entry)
    for field in message.fields:
        if field.message_type is not None and field.message_type.full_name not in layouts:
            _add_layout(field.message_type, layouts)


def _member(field: Any) -> Member:
    wire = (*_TYPES, *_MORE_TYPES)[field.type - 1]
    kind: Number | Text | Message = Number(_FIXED.get(wire, "<i8")[1:])
    if field.message_type is not None:
        kind = Message(field.message_type.full_name)
    elif wire in ("string", "bytes"):
        kind = Text()
    oneof = field.containing_oneof
    others = () if oneof is None else tuple(other.name for other in oneof.fields if other.name != field.name)
    array = Array() if field.is_repeated else None
    return Member(field.name, kind, array, Tag(field.number, wire, field.has_presence, others))


def walk_protobuf(schema: Schema, payload: bytes) -> Example:
    """Return the layout of a message; raises DamagedMessageError."""
    walk = _Walk(schema, payload)
    walk.example.content = walk.empty(schema.root)
    walk.message(schema.root, walk.example.content, len(payload), 0)
    return walk.example


class _Walk:
    """A walk over the fields of one message; `at` is the byte that it has reached."""

    def __init__(self, schema: Schema, payload: bytes) -> None:
        self.example = Example(payload)
        self._schema, self._payload, self._at = schema, payload, 0

    def empty(self, layout: Layout) -> dict[str, Any]:
        """Return a message without any field."""
        return {member.name: self._absent(member) for member in layout.members}

    def _absent(self, member: Member) -> Any:
        if member.array is not None:
            # The entries of a map have no order: none can be selected by number.
            is_map = isinstance(member.kind, Message) and self._schema.layouts[member.kind.name].entry
            return {} if is_map else []
        if isinstance(member.kind, Number):
            return math.nan if member.tag is None or member.tag.presence else 0
        return NO_MESSAGE if isinstance(member.kind, Message) else ""

    def message(self, layout: Layout | None, content: dict[str, Any], end: int, depth: int, group: int = 0) -> None:
        """Read fields up to byte `end`, or to the end of the group of this number, into `content`."""
        if depth > _DEEPEST:
            raise self._not_protobuf()
        while self._at < end or group:
            key = self._varint(end)
            number, wire = key >> 3, key & 7
            if wire == _END and number == group:
                return
            if not number or wire in (_END, 6, 7):
                raise self._not_protobuf()
            member = layout.by_number.get(number) if layout is not None else None
            if layout is None or member is None or member.tag is None:
                self._skip(wire, number, end, depth)
                continue
            for other in member.tag.oneof:
                content[other] = self._absent(next(each for each in layout.members if each.name == other))
            if isinstance(member.kind, Number):
                self._number(member, wire, content, end)
            elif isinstance(member.kind, Text):
                self._text(member, wire, content, end)
            else:
                self._nested(member, member.kind, wire, content, end, depth)

    def _number(self, member: Member, wire: int, content: dict[str, Any], end: int) -> None:
        assert member.tag is not None
        is_packed = wire == _BLOCK and member.array is not None
        if is_packed:
            found: range | list[int] = self._packed(member.tag.wire, self._block(end)[1])
        else:
            found = self._one(member.tag.wire, wire, end)
        if member.array is None:
            content[member.name] = found[0]
        else:
            content[member.name] = found if not content[member.name] else [*content[member.name], *found]

    def _packed(self, kind: str, size: int) -> range | list[int]:
        end = self._at + size
        code = _FIXED.get(kind)
        if code is None:
            found: list[int] = []
            while self._at < end:
                found += self._one(kind, _VARINT, end)
            return found
        width = int(code[2])
        if size % width:
            raise self._not_protobuf()
        begin, self._at = self._at, end
        return self.example.numbers(begin, size // width, code, width) if size else range(0)

    def _one(self, kind: str, wire: int, end: int) -> range:
        code, begin = _FIXED.get(kind), self._at
        if wire != (_VARINT if code is None else _EIGHT if code[2] == "8" else _FOUR):
            raise self._other_type()
        if code is None:
            self._varint(end, 0x80)
        else:
            self._advance(int(code[2]), end)
        return self.example.numbers(begin, 1, code or kind, self._at - begin)

    def _text(self, member: Member, wire: int, content: dict[str, Any], end: int) -> None:
        if wire != _BLOCK:
            raise self._other_type()
        begin, size = self._block(end)
        self._at += size
        text = self._payload[begin : self._at].decode(errors="replace")
        if member.array is None:
            content[member.name] = text
        else:
            content[member.name].append(text)
            if member.name == "name":  # it may name the elements of an array
                self.example.share(begin, size)

    def _nested(self, member: Member, kind: Message, wire: int, content: dict[str, Any], end: int, depth: int) -> None:
        assert member.tag is not None
        layout = self._schema.layouts[kind.name]
        if wire != (_GROUP if member.tag.wire == "group" else _BLOCK):
            raise self._other_type()
        if member.array is None:
            if content[member.name] is NO_MESSAGE:
                content[member.name] = self.empty(layout)
            inner = content[member.name]
        else:
            inner = self.empty(layout)
            if not layout.entry:
                content[member.name].append(inner)
        if wire == _GROUP:
            self.message(layout, inner, end, depth + 1, member.tag.number)
        else:
            begin, size = self._block(end)
            self.message(layout, inner, begin + size, depth + 1)

    def _skip(self, wire: int, number: int, end: int, depth: int) -> None:
        if wire == _VARINT:
            self._varint(end, 0x80)
        elif wire == _GROUP:
            self.message(None, {}, end, depth + 1, number)
        else:
            self._advance({_EIGHT: 8, _FOUR: 4}.get(wire) or self._block(end)[1], end)

    def _block(self, end: int) -> tuple[int, int]:
        """Read a length, and return first byte and size of what follows."""
        size = self._varint(end)
        if size > end - self._at:
            raise self._not_protobuf()
        return self._at, size

    def _varint(self, end: int, shared_bits: int = 0xFF) -> int:
        value, begin = 0, self._at
        for k, byte in enumerate(self._payload[begin : min(begin + _LONGEST_VARINT, end)]):
            value |= (byte & 0x7F) << (7 * k)
            if byte < 0x80:
                self._at = begin + k + 1
                self.example.share(begin, k + 1, shared_bits)
                return value
        raise self._not_protobuf()

    def _advance(self, size: int, end: int) -> None:
        self._at += size
        if self._at > end:
            raise self._not_protobuf()

    def _not_protobuf(self) -> DamagedMessageError:
        size = len(self._payload)
        return DamagedMessageError(f"a decoding error: its {size} bytes end within a field, or are not protobuf")

    def _other_type(self) -> DamagedMessageError:
        return DamagedMessageError("a decoding error: a field is written as another type than the schema's")
