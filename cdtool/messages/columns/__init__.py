"""Messages -> columns: every wanted field of a whole batch at once; one module per message encoding."""

from __future__ import annotations

from cdtool.messages.columns.decoded_batch import DecodedBatch, Decoder, FieldValues, UndecodableError
from cdtool.messages.layouts.layout import SchemaError

__all__ = ["DecodedBatch", "Decoder", "FieldValues", "UndecodableError", "decoder_for"]


def decoder_for(message_encoding: str, schema_encoding: str, schema_name: str, schema_data: bytes) -> Decoder:
    """Return the decoder for a channel's message and schema encoding; raises UndecodableError."""
    try:
        return _decoder(message_encoding, schema_encoding, schema_name, schema_data)
    except SchemaError as fault:
        raise UndecodableError(f"schema '{schema_name}' cannot be parsed: {fault}") from fault


def _decoder(message_encoding: str, schema_encoding: str, schema_name: str, schema_data: bytes) -> Decoder:
    match message_encoding, schema_encoding:
        case "json", _:
            from cdtool.messages.columns.json import json_decoder

            return json_decoder()
        case "cdr", "ros2msg":
            from cdtool.messages.columns.cdr import cdr_decoder
            from cdtool.messages.layouts.ros2msg import parse_ros2msg

            return cdr_decoder(parse_ros2msg(schema_name, schema_data))
        case "ros1", "ros1msg":
            from cdtool.messages.columns.cdr import ros1_decoder
            from cdtool.messages.layouts.ros1msg import parse_ros1msg

            return ros1_decoder(parse_ros1msg(schema_name, schema_data))
        case "protobuf", "protobuf":
            from cdtool.messages.columns.protobuf import protobuf_decoder
            from cdtool.messages.layouts.protobuf import parse_protobuf

            return protobuf_decoder(parse_protobuf(schema_name, schema_data))
        case "cdr", "" if schema_name:
            raise UndecodableError(
                f"the log has no definition of the message type '{schema_name}' (`ros2 bag convert` to MCAP adds it)"
            )
    described = f"schema encoding '{schema_encoding}'" if schema_encoding else "no schema"
    raise UndecodableError(
        f"message encoding '{message_encoding}' with {described} is not supported (supported: json, ROS 1, ROS 2 cdr "
        "with ros2msg, protobuf)"
    )
