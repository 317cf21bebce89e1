"""Maps of protobuf: repeated messages on the wire, whose order has no meaning."""

from __future__ import annotations

import pytest

from cdtool.formats.messages.decoders import decoder_for
from cdtool.formats.messages.fields import FieldMissingError, parse_field
from tests.formats.messages.batches import batch_of

pytest.importorskip("google.protobuf")


def test_an_entry_of_a_map_cannot_be_selected_by_number():
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    kinds = descriptor_pb2.FieldDescriptorProto
    file = descriptor_pb2.FileDescriptorProto(name="a.proto", package="a", syntax="proto3")
    log = file.message_type.add(name="Log")
    entry = log.nested_type.add(name="ValsEntry")
    entry.options.map_entry = True
    entry.field.add(name="key", number=1, type=kinds.TYPE_STRING, label=kinds.LABEL_OPTIONAL)
    entry.field.add(name="value", number=2, type=kinds.TYPE_DOUBLE, label=kinds.LABEL_OPTIONAL)
    log.field.add(
        name="vals", number=1, type=kinds.TYPE_MESSAGE, label=kinds.LABEL_REPEATED, type_name=".a.Log.ValsEntry"
    )
    log.field.add(name="data", number=2, type=kinds.TYPE_DOUBLE, label=kinds.LABEL_OPTIONAL)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    message_class = message_factory.GetMessageClass(pool.FindMessageTypeByName("a.Log"))
    message = message_class(data=3.0)
    message.vals["f"] = 20.0
    message.vals["g"] = 1001.0
    described = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
    decoder = decoder_for("protobuf", "protobuf", "a.Log", described)
    wanted = [parse_field("vals[0].value", ""), parse_field("data", "")]
    refused, data = decoder.decode(batch_of([message.SerializeToString()]), wanted).fields
    assert isinstance(refused.fault, FieldMissingError)
    assert refused.fault.problem == "'vals' is not an array"
    assert data.values.tolist() == [3.0]
