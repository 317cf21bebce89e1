"""The decoders of a topic's channels, and what they could not decode."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.messages import UndecodableMessages
from cdtool.messages.batch import Batch
from cdtool.messages.columns import Decoder, Gathered, UndecodableError, decoder_for
from cdtool.messages.columns.decoded_batch import DECODED
from cdtool.messages.fast_path import Recipe
from cdtool.messages.fields import Field, FieldMissingError, missing
from cdtool.messages.stamp_order import Stamps
from cdtool.messages.stream import Stream


class Decoders:
    """One decoder a channel, made when its first messages come; what cannot be decoded is counted, with a reason."""

    def __init__(self) -> None:
        self._made: dict[int, Decoder | UndecodableError] = {}
        self.decoded = 0
        self.failed = 0
        self.reason = ""

    def of(self, stream: Stream, batch: Batch) -> Decoder | None:
        """The decoder of a channel; None, and its messages counted, where there is none."""
        if stream.id not in self._made:
            try:
                self._made[stream.id] = decoder_for(stream.encoding, *stream.definition)
            except UndecodableError as fault:
                self._made[stream.id] = fault
        made = self._made[stream.id]
        if isinstance(made, UndecodableError):
            self._fail(len(batch), str(made))
            return None
        return made

    def recipe(self, channel: int, wanted: Sequence[Field], joints: Sequence[str], stamps: bool) -> Recipe | None:
        """How more messages of a channel (by id) become these fields; None where they do not at once."""
        made = self._made.get(channel)
        return None if made is None or isinstance(made, UndecodableError) else made.recipe(wanted, joints, stamps)

    def gather(
        self, where: str, stream: Stream, batch: Batch, wanted: Sequence[Field], joints: Sequence[str], clock: str
    ) -> tuple[Decoder, Gathered, Stamps] | None:
        """The fields of a batch and its stamps [ns] by the clock; None, and counted, where it cannot be decoded.

        Raises RecordingError, which `where` begins, where a field or the header's stamp is not there.
        """
        decoder = self.of(stream, batch)
        if decoder is None:
            return None
        try:
            gathered = decoder.gather(batch, wanted, joints, stamps=clock == "header")
        except FieldMissingError as fault:
            raise missing(where, _absent(decoder, batch, wanted, joints), fault) from fault
        except UndecodableError as fault:
            self.give_up(stream, batch, fault)
            return None
        return decoder, gathered, _stamps(where, batch, gathered, clock)

    def give_up(self, stream: Stream, batch: Batch, fault: UndecodableError) -> None:
        """What only the wanted places show: a channel's messages cannot be decoded; they are counted."""
        self._made[stream.id] = fault
        self._fail(len(batch), str(fault))

    def keep(self, gathered: Gathered) -> npt.NDArray[np.bool_]:
        """Which messages of a batch were decoded; the others are counted."""
        whole: npt.NDArray[np.bool_] = gathered.status == DECODED
        count = int(np.count_nonzero(whole))
        self.decoded += count
        if count < len(whole):
            self._fail(len(whole) - count, gathered.reason)
        return whole

    def _fail(self, count: int, reason: str) -> None:
        self.failed += count
        self.reason = self.reason or " ".join(reason.split())[:200]

    def failure(self, topic: str) -> list[Finding]:
        """The finding about messages that could not be decoded."""
        fact = UndecodableMessages(self.failed, self.failed + self.decoded, self.reason)
        return [Finding(fact, topic, "loss")] if self.failed else []

    def told(self, path: str, topic: str) -> list[Finding]:
        """The finding about messages that could not be decoded; raises RecordingError where none could."""
        if not self.decoded:
            raise RecordingError(
                f"{path}: no message of {topic} can be decoded: {self.reason}",
                "record it as JSON, ROS 2 CDR, ROS 1 or protobuf with its message definition",
            )
        return self.failure(topic)


def _stamps(where: str, batch: Batch, gathered: Gathered, clock: str) -> Stamps:
    if clock != "header":
        return batch.log_time if clock == "log" else batch.publish_time
    whole = gathered.status == DECODED
    if gathered.stamps is None or gathered.has_stamp is None or not gathered.has_stamp[whole].all():
        raise RecordingError(
            f"{where}: a message has no header.stamp", "use time = { clock = 'log' } in [channels.mcap]"
        )
    return gathered.stamps


def _absent(decoder: Decoder, batch: Batch, wanted: Sequence[Field], joints: Sequence[str]) -> str:
    """The field that the schema does not have."""
    for field in wanted:
        try:
            decoder.gather(batch.first(1), [field], joints)
        except FieldMissingError:
            return field.text
    return wanted[0].text
