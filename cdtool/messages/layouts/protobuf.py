"""protobuf: a FileDescriptorSet (MCAP, appendix "Well-known schema encodings"; google/protobuf/descriptor.proto).

A descriptor is itself a protobuf message, so a small reader of the wire format (protobuf.dev, "Encoding") suffices: the
protobuf package would not read more, and importing it takes longer than analysing a short log.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from cdtool.messages.layouts.layout import Array, Layout, Member, Message, Number, Schema, SchemaError, Tag, Text

# FieldDescriptorProto.Type: the name of the type, and of the number that it represents.
_TYPES = {
    1: ("double", "float64"),
    2: ("float", "float32"),
    3: ("int64", "int64"),
    4: ("uint64", "uint64"),
    5: ("int32", "int32"),
    6: ("fixed64", "uint64"),
    7: ("fixed32", "uint32"),
    8: ("bool", "bool"),
    9: ("string", ""),
    10: ("group", ""),
    11: ("message", ""),
    12: ("bytes", ""),
    13: ("uint32", "uint32"),
    14: ("enum", "int32"),
    15: ("sfixed32", "int32"),
    16: ("sfixed64", "int64"),
    17: ("sint32", "int32"),
    18: ("sint64", "int64"),
}
_REPEATED = 3  # FieldDescriptorProto.Label
_MAP_ENTRY = 7  # of MessageOptions
_IMPLICIT = 2  # FeatureSet.FieldPresence
_DELIMITED = 2  # FeatureSet.MessageEncoding
_Fields = dict[int, list[int | bytes]]


@dataclass(frozen=True)
class _Features:
    """Defaults that a message or field may override: proto2, proto3 and editions differ in them."""

    implicit: bool
    delimited: bool = False

    def with_options(self, options: list[int | bytes], number: int) -> _Features:
        """Return these features, overridden by those of options (whose field `number` is a FeatureSet)."""
        features = self
        for option in options:
            for value in _fields(option).get(number, []):
                found = _fields(value)
                presence, encoding = found.get(1, [None])[-1], found.get(5, [None])[-1]
                features = _Features(
                    features.implicit if presence is None else presence == _IMPLICIT,
                    features.delimited if encoding is None else encoding == _DELIMITED,
                )
        return features


def parse_protobuf(name: str, data: bytes) -> Schema:
    """Return the layouts of the message `name` and of its nested messages; raises SchemaError."""
    layouts: dict[str, Layout] = {}
    for file in _fields(data).get(1, []):
        found = _fields(file)
        syntax = _text(found.get(12, [b"proto2"])[-1])
        # Editions: presence is explicit unless features say otherwise.
        features = _Features(syntax == "proto3").with_options(found.get(8, []), 50)
        package = _text(found.get(2, [b""])[-1])
        for message in found.get(4, []):
            layouts.update(_layouts(message, f"{package}." if package else "", features))
    root = layouts.get(name.lstrip("."))
    if root is None:
        raise SchemaError(f"its descriptors do not define '{name}'")
    schema = Schema(root, layouts)
    for member in schema.walk():
        if isinstance(member.kind, Message) and member.kind.name not in layouts:
            raise SchemaError(f"its descriptors do not define '{member.kind.name}' of field '{member.name}'")
    return schema


def _layouts(message: int | bytes, prefix: str, features: _Features) -> Iterator[tuple[str, Layout]]:
    found = _fields(message)
    name = prefix + _text(found.get(1, [b""])[-1])
    options = found.get(7, [])
    features = features.with_options(options, 12)
    entry = any(_fields(option).get(_MAP_ENTRY, [0])[-1] for option in options)
    members = tuple(_member(field, features) for field in found.get(2, []))
    if len({member.name for member in members}) < len(members):
        raise SchemaError(f"{name} has two fields of the same name")
    yield name, Layout(name, members, entry)
    for nested in found.get(3, []):
        yield from _layouts(nested, f"{name}.", features)


def _member(field: int | bytes, features: _Features) -> Member:
    found = _fields(field)
    name = _text(found.get(1, [b""])[-1])
    number, kind = found.get(3, [0])[-1], found.get(5, [0])[-1]
    if not isinstance(number, int) or not 0 < number < 2**29 or kind not in _TYPES or not isinstance(kind, int):
        raise SchemaError(f"field '{name}' has the number {number!r} and the type {kind!r}")
    features = features.with_options(found.get(8, []), 21)
    wire, number_name = _TYPES[kind]
    if wire == "message" and features.delimited:
        wire = "group"
    repeated = found.get(4, [1])[-1] == _REPEATED
    oneof = found.get(9, [-1])[-1]
    tag = Tag(
        number,
        wire,
        presence=not features.implicit or 9 in found or wire in ("message", "group"),
        oneof=oneof if isinstance(oneof, int) and 17 not in found else -1,
    )
    array = Array() if repeated else None
    if number_name:
        return Member(name, Number(number_name), array, tag)
    if wire in ("string", "bytes"):
        return Member(name, Text(), array, tag)
    return Member(name, Message(_text(found.get(6, [b""])[-1]).lstrip(".")), array, tag)


def _text(value: int | bytes) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else ""


def _fields(message: int | bytes) -> _Fields:
    """Return the fields of a message by number, each with its values in order; raises SchemaError."""
    if not isinstance(message, bytes):
        raise SchemaError("its descriptors are damaged")
    found: _Fields = {}
    at = 0
    while at < len(message):
        key, at = _varint(message, at)
        wire = key & 7
        if wire == 0:
            value, at = _varint(message, at)
            found.setdefault(key >> 3, []).append(value)
            continue
        size = {1: 8, 5: 4}.get(wire)
        if wire == 2:
            size, at = _varint(message, at)
        if size is None or at + size > len(message):
            raise SchemaError("its descriptors are damaged")
        found.setdefault(key >> 3, []).append(message[at : at + size])
        at += size
    return found


def _varint(message: bytes, at: int) -> tuple[int, int]:
    value = 0
    for k, byte in enumerate(message[at : at + 10]):
        value |= (byte & 0x7F) << (7 * k)
        if byte < 0x80:
            return value, at + k + 1
    raise SchemaError("its descriptors are damaged")
