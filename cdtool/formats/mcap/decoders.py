"""The decoders of a topic's channels, and what they could not decode."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from cdtool.formats.mcap.batch import Batch
from cdtool.formats.mcap.columns import Decoder, Gathered, UndecodableError, decoder_for
from cdtool.formats.mcap.columns.gathered import DECODED
from cdtool.formats.mcap.container.definitions import Stream
from cdtool.formats.mcap.fields import Field
from cdtool.formats.mcap.taken import Recipe
from cdtool.recording import Finding


class Decoders:
    """One decoder a channel, made when its first messages come; what cannot be decoded is counted, with a reason."""

    def __init__(self) -> None:
        self._made: dict[int, Decoder | UndecodableError] = {}
        self.decoded = 0
        self.failed = 0
        self.reason = ""

    def of(self, stream: Stream, batch: Batch) -> Decoder | None:
        """The decoder of a channel; None, and its messages counted, where there is none."""
        number = stream.channel.id
        if number not in self._made:
            schema = stream.schema
            described = (schema.encoding, schema.name, schema.data) if schema is not None else ("", "", b"")
            try:
                self._made[number] = decoder_for(stream.channel.message_encoding, *described)
            except UndecodableError as fault:
                self._made[number] = fault
        made = self._made[number]
        if isinstance(made, UndecodableError):
            self._fail(len(batch), str(made))
            return None
        return made

    def recipe(self, channel: int, wanted: Sequence[Field], joints: Sequence[str], stamps: bool) -> Recipe | None:
        """How more messages of a channel (by id) become these fields; None where they do not at once."""
        made = self._made.get(channel)
        return None if made is None or isinstance(made, UndecodableError) else made.recipe(wanted, joints, stamps)

    def give_up(self, stream: Stream, batch: Batch, fault: UndecodableError) -> None:
        """What only the wanted places show: a channel's messages cannot be decoded; they are counted."""
        self._made[stream.channel.id] = fault
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

    def failure(self, topic: str, severity: str = "loss") -> list[Finding]:
        """The finding about messages that could not be decoded."""
        if not self.failed:
            return []
        text = f"{self.failed} of {self.failed + self.decoded} messages cannot be decoded: {self.reason}"
        return [Finding(text, topic, "warning" if severity == "warning" else "loss")]
