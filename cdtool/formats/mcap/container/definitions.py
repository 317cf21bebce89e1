"""Schemas (op=0x03) and channels (op=0x04): each id means one thing in a file, or its messages are not read."""

from __future__ import annotations

from dataclasses import dataclass

from cdtool.formats.mcap.container.damage import DamageError
from cdtool.formats.mcap.container.records import Channel, Schema
from cdtool.formats.mcap.container.summary import Summary
from cdtool.messages.stream import Stream


@dataclass(frozen=True)
class DefinedStream(Stream):
    """A channel with its schema as records; `covered`: a CRC covers both definitions, or copies of them."""

    channel: Channel
    schema: Schema | None
    covered: bool


class Definitions:
    """What the ids of a file stand for, as far as it was read. The summary's copies count where its CRC fits."""

    def __init__(self, summary: Summary) -> None:
        self._schemas = dict(summary.schemas) if summary.verified else {}
        self._channels = dict(summary.channels) if summary.verified else {}
        self._covered_schemas = set(self._schemas)
        self._covered_channels = set(self._channels)
        self._fallback = summary
        # Channels (by id) whose meaning changed, and why.
        self.ambiguous: dict[int, str] = {}
        self._ambiguous_schemas: dict[int, str] = {}
        self._streams: dict[int, DefinedStream | DamageError] = {}
        self._taken: dict[tuple[int, bytes, bool], bytes] = {}

    def is_known(self, opcode: int, body: bytes, covered: bool) -> bool:
        """True where one more look tells nothing new: writers repeat definitions, and half a million fit into 8 kB."""
        if opcode == Channel.opcode and len(body) > 1 and int.from_bytes(body[:2], "little") in self.ambiguous:
            return True
        return self._taken.get((opcode, body[:2], covered)) == body

    def take(self, opcode: int, body: memoryview, covered: bool) -> None:
        """One definition of the data section; raises DamageError where its bytes cannot be one."""
        self._taken[opcode, bytes(body[:2]), covered] = bytes(body)
        if opcode == Schema.opcode:
            schema = Schema.read(body)
            if schema.id == 0:  # invalid, to be ignored
                return
            if self._schemas.setdefault(schema.id, schema) != schema:
                reason = f"schema {schema.id} '{schema.name}' is defined twice, differently"
                self._ambiguous_schemas[schema.id] = reason
                users = [channel.id for channel in self._channels.values() if channel.schema_id == schema.id]
                self.ambiguous.update(dict.fromkeys(users, reason))
            elif covered:
                self._covered_schemas.add(schema.id)
        else:
            channel = Channel.read(body)
            if self._channels.setdefault(channel.id, channel) != channel:
                self.ambiguous[channel.id] = f"channel {channel.id} '{channel.topic}' is defined twice, differently"
            elif covered:
                self._covered_channels.add(channel.id)
            if channel.schema_id in self._ambiguous_schemas:
                self.ambiguous[channel.id] = self._ambiguous_schemas[channel.schema_id]
        self._streams.clear()

    def stream(self, channel_id: int) -> DefinedStream:
        """A channel and its schema; raises DamageError where either is not defined."""
        if channel_id not in self._streams:
            self._streams[channel_id] = self._find(channel_id)
        found = self._streams[channel_id]
        if isinstance(found, DamageError):
            raise found
        return found

    def streams(self) -> list[DefinedStream]:
        """All channels that are whole, in the order of their definitions."""
        found = (self._find(channel) for channel in self._channels | self._fallback.channels)
        return [stream for stream in found if isinstance(stream, DefinedStream)]

    def redefined_topics(self) -> list[str]:
        """Topics whose channel or schema the summary defines otherwise than the data."""
        known = {stream.id: stream for stream in self.streams()}
        return [
            channel.topic
            for channel in self._fallback.channels.values()
            if channel.id in known
            and (
                known[channel.id].channel != channel
                or (
                    (schema := known[channel.id].schema) is not None
                    and self._fallback.schemas.get(schema.id, schema) != schema
                )
            )
        ]

    def _find(self, channel_id: int) -> DefinedStream | DamageError:
        # A definition that was lost with its chunk may still stand in a summary without a CRC.
        channel = self._channels.get(channel_id) or self._fallback.channels.get(channel_id)
        if channel is None:
            return DamageError(f"a message names channel {channel_id}, which is not there")
        number = channel.schema_id
        schema = self._schemas.get(number) or self._fallback.schemas.get(number) if number else None
        if number and schema is None:
            return DamageError(f"channel '{channel.topic}' names schema {number}, which is not there")
        covered = channel_id in self._covered_channels and (not number or number in self._covered_schemas)
        definition = ("", "", b"") if schema is None else (schema.encoding, schema.name, schema.data)
        return DefinedStream(channel_id, channel.topic, channel.message_encoding, definition, channel, schema, covered)
