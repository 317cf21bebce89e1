"""MCAP: topics of messages (JSON, ROS 2 CDR, ROS 1, protobuf), read piece by piece with every CRC checked."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from cdtool.formats.bags.topic_log import IsWanted, TopicFormat, survey
from cdtool.formats.mcap.exact_times import with_exact_times
from cdtool.formats.mcap.log import Log
from cdtool.formats.mcap.records import MAGIC
from cdtool.formats.pieces import Pieces

__all__ = ["Mcap"]


@dataclass(frozen=True)
class Mcap(TopicFormat):
    """MCAP logs: a column is a topic and a numeric field of its messages, `/joint_states position[0]`."""

    name: ClassVar[str] = "mcap"
    suffixes: ClassVar[tuple[str, ...]] = (".mcap",)

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts with MCAP's magic bytes."""
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC

    def log(self, path: Path, is_wanted: IsWanted | None = None) -> Log:
        """Open a file; raises RecordingError."""
        return Log(path, is_wanted)

    def exact_pieces(self, path: Path) -> Pieces:
        """Yield the same as `pieces`; for a log that cdtool converted, with the exact times that were written."""
        log = self.log(path)
        pieces = survey(log)
        return (yield from with_exact_times(pieces, log.exact_origin) if log.exact else pieces)
