"""The decoders of a topic's channels, and the count of messages that could not be decoded.

The decoder of a channel, by the encodings of its messages and of its schema.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.messages.alike import SchemaDecoder
from cdtool.formats.messages.batch import Batch, Stream
from cdtool.formats.messages.decoded_batch import DECODED, DecodedBatch, Decoder, UndecodableError
from cdtool.formats.messages.fields import element_names
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
            layout = parse_definitions(schema_name, schema_data, 2 if is_cdr else 1)
            return SchemaDecoder(layout, walk_cdr if is_cdr else walk_ros1)
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


Result = TypeVar("Result")


class Decoders:
    """One decoder per channel, created when its first messages arrive.

    Messages that cannot be decoded are counted in `failed`; `reason` is that of the first one.
    """

    def __init__(self) -> None:
        self._by_channel: dict[int, Decoder | UndecodableError] = {}
        self.decoded = 0
        self.failed = 0
        self.reason = ""

    def attempt(self, stream: Stream, batch: Batch, read: Callable[[Decoder], Result]) -> Result | None:
        """Return what `read` returns; if the channel has no decoder, count the batch as failed and return None."""
        try:
            if stream.id not in self._by_channel:
                self._by_channel[stream.id] = decoder_for(stream.encoding, *stream.definition)
            decoder = self._by_channel[stream.id]
            if isinstance(decoder, UndecodableError):
                raise decoder
            return read(decoder)
        except UndecodableError as fault:  # `read` may raise it for a reason that only its messages reveal
            self._by_channel[stream.id] = fault
            self._fail(len(batch), str(fault))
            return None

    def contents(self, stream: Stream, batch: Batch) -> list[dict[str, Any]]:
        """Return the messages that can be decoded, as objects of the field language."""
        return self.attempt(stream, batch, lambda decoder: decoder.contents(batch)) or []

    def element_names(self, stream: Stream, batch: Batch) -> tuple[str, ...] | None:
        """Return the texts of the array `name` of the first decodable message; None if no message is decodable."""
        for row in range(len(batch)):
            for content in self.contents(stream, batch.rows(slice(row, row + 1))):
                return tuple(element_names(content))
        return None

    def keep(self, decoded: DecodedBatch) -> npt.NDArray[np.bool_]:
        """Return which messages of a batch are decoded (n,), and count both kinds."""
        whole: npt.NDArray[np.bool_] = decoded.status == DECODED
        count = int(np.count_nonzero(whole))
        self.decoded += count
        if count < len(whole):
            self._fail(len(whole) - count, decoded.reason)
        return whole

    def _fail(self, count: int, reason: str) -> None:
        self.failed += count
        self.reason = self.reason or " ".join(reason.split())[:200]

    def failure(self, topic: str) -> list[Finding]:
        """Return the finding on messages that could not be decoded, if there are any."""
        fact = {"count": self.failed, "messages": self.failed + self.decoded, "reason": self.reason}
        return [Finding("undecodable_messages", topic, fact)] if self.failed else []

    def checked_failure(self, path: str, topic: str) -> list[Finding]:
        """Return the same as `failure`; raises RecordingError if no message could be decoded."""
        if not self.decoded:
            raise RecordingError(
                f"{path}: no message of {topic} can be decoded: {self.reason}",
                "record the topic as JSON, ROS 2 CDR, ROS 1 or protobuf, with its message definition",
            )
        return self.failure(topic)
