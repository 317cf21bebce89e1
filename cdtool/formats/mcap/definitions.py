"""Schemas (op=0x03) and channels (op=0x04): messages with an ambiguous id are not read."""

from __future__ import annotations

from dataclasses import dataclass

from mcap.records import Channel, Schema

from cdtool.formats.mcap.records import DamageError, Opcode, parse
from cdtool.formats.mcap.summary import McapSummary
from cdtool.formats.messages.batch import Stream


@dataclass(frozen=True)
class DefinedStream(Stream):
    """A channel with its schema as records; `covered`: a CRC covers both definitions, or copies of them."""

    channel: Channel
    schema: Schema | None
    covered: bool


class Definitions:
    """The schemas and channels by id, as far as the file was read; copies in a summary with a CRC are also used."""

    def __init__(self, summary: McapSummary) -> None:
        self._schemas = dict(summary.schemas) if summary.verified else {}
        self._channels = dict(summary.channels) if summary.verified else {}
        self._covered_schemas = set(self._schemas)
        self._covered_channels = set(self._channels)
        self._fallback = summary
        # Channels (by id) whose meaning changed, with the reason.
        self.ambiguous: dict[int, str] = {}
        self._ambiguous_schemas: dict[int, str] = {}
        self._streams: dict[int, DefinedStream | DamageError] = {}
        self._latest: dict[tuple[int, bytes, bool], bytes] = {}

    def add(self, opcode: int, body: bytes, covered: bool) -> None:
        """Add a definition of the data section; raises DamageError if its bytes are not a definition.

        Writers repeat definitions, and half a million of them can be compressed to 8 kB: only the first is parsed.
        """
        is_ambiguous = (
            opcode == Opcode.CHANNEL and len(body) > 1 and int.from_bytes(body[:2], "little") in self.ambiguous
        )
        if is_ambiguous or self._latest.get((opcode, body[:2], covered)) == body:
            return
        self._latest[opcode, body[:2], covered] = body
        record = parse(opcode, body)
        if opcode == Opcode.SCHEMA:
            schema: Schema = record
            if schema.id == 0:  # invalid by the specification, and ignored
                return
            if self._schemas.setdefault(schema.id, schema) != schema:
                reason = f"schema {schema.id} '{schema.name}' is defined twice, differently"
                self._ambiguous_schemas[schema.id] = reason
                users = [channel.id for channel in self._channels.values() if channel.schema_id == schema.id]
                self.ambiguous.update(dict.fromkeys(users, reason))
            elif covered:
                self._covered_schemas.add(schema.id)
        else:
            channel: Channel = record
            if self._channels.setdefault(channel.id, channel) != channel:
                self.ambiguous[channel.id] = f"channel {channel.id} '{channel.topic}' is defined twice, differently"
            elif covered:
                self._covered_channels.add(channel.id)
            if channel.schema_id in self._ambiguous_schemas:
                self.ambiguous[channel.id] = self._ambiguous_schemas[channel.schema_id]
        self._streams.clear()

    def stream(self, channel_id: int) -> DefinedStream:
        """Return a channel and its schema; raises DamageError if one of them is not defined."""
        if channel_id not in self._streams:
            self._streams[channel_id] = self._find(channel_id)
        stream = self._streams[channel_id]
        if isinstance(stream, DamageError):
            raise stream
        return stream

    def streams(self) -> list[DefinedStream]:
        """Return all channels that are completely defined, in the order of their definitions."""
        streams = (self._find(channel) for channel in self._channels | self._fallback.channels)
        return [stream for stream in streams if isinstance(stream, DefinedStream)]

    def redefined_topics(self) -> list[str]:
        """Return the topics whose channel or schema differs between the summary and the data section."""
        schemas, channels = self._fallback.schemas, self._fallback.channels.values()
        return [
            channel.topic
            for channel in channels
            if self._channels.get(channel.id, channel) != channel
            or ((own := self._schemas.get(channel.schema_id)) and schemas.get(channel.schema_id, own) != own)
        ]

    def _find(self, channel_id: int) -> DefinedStream | DamageError:
        # A definition that is lost with its chunk may exist in a summary without a CRC.
        channel = self._channels.get(channel_id) or self._fallback.channels.get(channel_id)
        if channel is None:
            return DamageError(f"a message names channel {channel_id}, which is not defined")
        number = channel.schema_id
        schema = self._schemas.get(number) or self._fallback.schemas.get(number) if number else None
        if number and schema is None:
            return DamageError(f"channel '{channel.topic}' names schema {number}, which is not defined")
        covered = channel_id in self._covered_channels and (not number or number in self._covered_schemas)
        definition = ("", "", b"") if schema is None else (schema.encoding, schema.name, schema.data)
        return DefinedStream(channel_id, channel.topic, channel.message_encoding, definition, channel, schema, covered)
