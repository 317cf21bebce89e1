"""Protobuf files with every numeric type, and strategies for the contents of their messages."""

from __future__ import annotations

import pytest
from hypothesis import strategies as st

from cdtool.formats.messages.decoders import decoder_for

descriptor_pb2 = pytest.importorskip("google.protobuf.descriptor_pb2")
from google.protobuf import descriptor_pool, message_factory  # noqa: E402

Field = descriptor_pb2.FieldDescriptorProto
KINDS = {
    "double": st.floats(),
    "float": st.floats(width=32),
    "int32": st.integers(-(2**31), 2**31 - 1),
    "sint32": st.integers(-(2**31), 2**31 - 1),
    "sfixed32": st.integers(-(2**31), 2**31 - 1),
    "int64": st.integers(-(2**63), 2**63 - 1),
    "sint64": st.integers(-(2**63), 2**63 - 1),
    "sfixed64": st.integers(-(2**63), 2**63 - 1),
    "uint32": st.integers(0, 2**32 - 1),
    "fixed32": st.integers(0, 2**32 - 1),
    "uint64": st.integers(0, 2**64 - 1),
    "fixed64": st.integers(0, 2**64 - 1),
    "bool": st.booleans(),
    "enum": st.sampled_from([0, 1, 7]),
}


def add(message, name, number, kind, *, repeated=False, optional=False, oneof=None, packed=None, inner=""):
    field = message.field.add(name=name, number=number, type=getattr(Field, f"TYPE_{kind.upper()}"))
    field.label = Field.LABEL_REPEATED if repeated else Field.LABEL_OPTIONAL
    if kind in ("message", "group", "enum"):
        field.type_name = inner or ".pkg.Mode"
    if packed is not None:
        field.options.packed = packed
    if oneof is not None:
        field.oneof_index = oneof
    if optional:
        field.proto3_optional = True
        field.oneof_index = len(message.oneof_decl)
        message.oneof_decl.add(name=f"_{name}")


def every_type_file(syntax="proto3", packed=None):
    """Return a file with every numeric type: singular, optional, repeated, nested, in a oneof and in a map."""
    file = descriptor_pb2.FileDescriptorProto(name="every_type.proto", package="pkg")
    if syntax == "proto3":
        file.syntax = syntax
    mode = file.enum_type.add(name="Mode")
    for name, number in (("OFF", 0), ("ON", 1), ("UP", 7)):
        mode.value.add(name=name, number=number)
    inner = file.message_type.add(name="Inner")
    outer = file.message_type.add(name="Outer")
    for message in (inner, outer):
        message.oneof_decl.add(name="choice")
        add(message, "left", 60, "double", oneof=0)
        add(message, "right", 61, "message", oneof=0, inner=".pkg.Leaf")
        add(message, "other", 62, "string", oneof=0)
        for i, kind in enumerate(KINDS):
            add(message, f"one_{kind}", 1 + i, kind)
            add(message, f"many_{kind}", 20 + i, kind, repeated=True, packed=packed)
        add(message, "name", 70, "string", repeated=True)
        if syntax == "proto3":
            add(message, "maybe", 80, "double", optional=True)
    leaf = file.message_type.add(name="Leaf")
    add(leaf, "x", 1, "double")
    add(leaf, "y", 2000, "sint32")
    add(outer, "inner", 90, "message", inner=".pkg.Inner")
    add(outer, "inners", 91, "message", repeated=True, inner=".pkg.Inner")
    add(outer, "again", 92, "message", inner=".pkg.Outer")
    entry = outer.nested_type.add(name="TableEntry")
    entry.options.map_entry = True
    add(entry, "key", 1, "string")
    add(entry, "value", 2, "double")
    add(outer, "table", 93, "message", repeated=True, inner=".pkg.Outer.TableEntry")
    return file


def make_decoder(file, name="pkg.Outer"):
    """Return cdtool's decoder and the protobuf package's class of a message type."""
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    data = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
    return decoder_for("protobuf", "protobuf", name, data), message_factory.GetMessageClass(
        pool.FindMessageTypeByName(name)
    )


CASES = {
    "proto3": make_decoder(every_type_file()),
    "proto3 unpacked": make_decoder(every_type_file(packed=False)),
    "proto2": make_decoder(every_type_file("proto2")),
    "proto2 packed": make_decoder(every_type_file("proto2", packed=True)),
}


def leaves():
    return st.fixed_dictionaries({}, optional={"x": st.floats(), "y": st.integers(-(2**31), 2**31 - 1)})


def contents(proto3, depth=0):
    numbers = {f"one_{kind}": values for kind, values in KINDS.items()}
    numbers |= {f"many_{kind}": st.lists(values, max_size=3) for kind, values in KINDS.items()}
    numbers |= {"name": st.lists(st.text("aé", max_size=3), max_size=3)}
    choice = st.one_of(
        st.fixed_dictionaries({"left": st.floats()}),
        st.fixed_dictionaries({"right": leaves()}),
        st.fixed_dictionaries({"other": st.text(max_size=3)}),
        st.just({}),
    )
    if proto3:
        numbers["maybe"] = st.floats()
    if depth == 0:
        inner = contents(proto3, 1)
        numbers |= {"inner": inner, "inners": st.lists(inner, max_size=2), "again": inner}
        numbers["table"] = st.dictionaries(st.text(max_size=2), st.floats(), max_size=2)
    some = st.lists(st.sampled_from(sorted(numbers)), unique=True, max_size=8)
    return st.tuples(
        some.flatmap(lambda names: st.fixed_dictionaries({name: numbers[name] for name in names})), choice
    ).map(lambda both: both[0] | both[1])
