"""The decoders of a topic's channels, and the count of messages that could not be decoded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.messages.batch import Batch
from cdtool.messages.columns import DecodedBatch, Decoder, UndecodableError, decoder_for
from cdtool.messages.columns.decoded_batch import DECODED
from cdtool.messages.fast_path import RowLayout
from cdtool.messages.fields import Field, FieldMissingError, missing_field
from cdtool.messages.stream import Stream


class Decoders:
    """One decoder per channel, created when its first messages arrive.

    Messages that cannot be decoded are counted in `failed`; `reason` is that of the first one.
    """

    def __init__(self) -> None:
        self._by_channel: dict[int, Decoder | UndecodableError] = {}
        self.decoded = 0
        self.failed = 0
        self.reason = ""

    def of(self, stream: Stream, batch: Batch) -> Decoder | None:
        """Return the decoder of a channel; if the channel has no decoder, count the batch as failed and return None."""
        if stream.id not in self._by_channel:
            try:
                self._by_channel[stream.id] = decoder_for(stream.encoding, *stream.definition)
            except UndecodableError as fault:
                self._by_channel[stream.id] = fault
        decoder = self._by_channel[stream.id]
        if isinstance(decoder, UndecodableError):
            self._fail(len(batch), str(decoder))
            return None
        return decoder

    def row_layout(
        self, channel: int, wanted: Sequence[Field], joints: Sequence[str], stamps: bool
    ) -> RowLayout | None:
        """Return the row layout of further messages of a channel (by id); None if they must be decoded in full."""
        decoder = self._by_channel.get(channel)
        if decoder is None or isinstance(decoder, UndecodableError):
            return None
        return decoder.row_layout(wanted, joints, stamps)

    def decode(
        self, where: str, stream: Stream, batch: Batch, wanted: Sequence[Field], joints: Sequence[str], stamps: bool
    ) -> tuple[Decoder, DecodedBatch] | None:
        """Return the decoder and the decoded batch, with the time stamps of the headers if `stamps`.

        If the batch cannot be decoded, its messages are counted as failed and the result is None. Raises
        RecordingError, with `where` as its subject, if the message definition does not have a field.
        """
        decoder = self.of(stream, batch)
        if decoder is None:
            return None
        try:
            decoded = decoder.decode(batch, wanted, joints, stamps)
        except FieldMissingError as fault:
            raise missing_field(where, _absent(decoder, batch, wanted, joints), fault) from fault
        except UndecodableError as fault:
            self.give_up(stream, batch, fault)
            return None
        return decoder, decoded

    def give_up(self, stream: Stream, batch: Batch, fault: UndecodableError) -> None:
        """Mark a channel as undecodable, for a reason that only the wanted fields reveal, and count its batch."""
        self._by_channel[stream.id] = fault
        self._fail(len(batch), str(fault))

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


def _absent(decoder: Decoder, batch: Batch, wanted: Sequence[Field], joints: Sequence[str]) -> str:
    """Return the first field that the schema does not have."""
    for field in wanted:
        try:
            decoder.decode(batch.first(1), [field], joints)
        except FieldMissingError:
            return field.text
    return wanted[0].text
