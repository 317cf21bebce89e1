"""The decoder of a channel, by the encodings of its messages and of its schema."""

from __future__ import annotations

from cdtool.formats.messages.alike import SchemaDecoder
from cdtool.formats.messages.decoded_batch import Decoder, UndecodableError
from cdtool.formats.messages.layout import SchemaError


def decoder_for(message_encoding: str, schema_encoding: str, schema_name: str, schema_data: bytes) -> Decoder:
    """Return the decoder for a channel's message and schema encoding; raises UndecodableError."""
    try:
        return _decoder(message_encoding, schema_encoding, schema_name, schema_data)
    except SchemaError as fault:
        raise UndecodableError(f"schema '{schema_name}' cannot be parsed: {fault}") from fault


def _decoder(message_encoding: str, schema_encoding: str, schema_name: str, schema_data: bytes) -> Decoder:
    match message_encoding, schema_encoding:
        case "json", _:
            from cdtool.formats.messages.json_messages import JsonDecoder

            return JsonDecoder()
        case ("cdr", "ros2msg") | ("ros1", "ros1msg"):
            from cdtool.formats.messages.ros_definitions import parse_definitions
            from cdtool.formats.messages.sequential import walk_cdr, walk_ros1

            is_cdr = message_encoding == "cdr"
            schema = parse_definitions(schema_name, schema_data, 2 if is_cdr else 1)
            return SchemaDecoder(schema, walk_cdr if is_cdr else walk_ros1)
        case "protobuf", "protobuf":
            from cdtool.formats.messages.protobuf import protobuf_decoder

            return protobuf_decoder(schema_name, schema_data)
        case "cdr", "" if schema_name:
            raise UndecodableError(
                f"the log has no definition of the message type '{schema_name}' (`ros2 bag convert` to MCAP adds it)"
            )
    described = f"schema encoding '{schema_encoding}'" if schema_encoding else "no schema"
    raise UndecodableError(
        f"message encoding '{message_encoding}' with {described} is not supported (supported: json, ROS 1, ROS 2 cdr "
        "with ros2msg, protobuf)"
    )
