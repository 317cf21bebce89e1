"""ROS 1 bags, by rosbags; their messages are decoded like those of MCAP files."""

from __future__ import annotations

import os
from collections.abc import Collection, Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from cdtool.channels import ChannelMap
from cdtool.errors import RecordingError
from cdtool.formats.bag_messages import Bag, IsWanted, one_line
from cdtool.formats.container_checks import one_line_errors
from cdtool.formats.pieces import Pieces, join_pieces
from cdtool.formats.source import Source
from cdtool.messages.batch import Stream

_BAG = b"#ROSBAG V2.0"


@dataclass(frozen=True)
class Rosbag:
    """ROS 1 bags: a column is a topic and a numeric field of its messages, as in an MCAP file."""

    name: ClassVar[str] = "rosbag"
    suffixes: ClassVar[tuple[str, ...]] = (".bag",)
    topics: ClassVar[bool] = True

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like a ROS 1 bag."""
        with path.open("rb") as file:
            return file.read(len(_BAG)) == _BAG

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """Return the fields that `wanted` names, or all numeric fields; raises RecordingError."""
        if wanted is None:
            return join_pieces(self.pieces(path), sort=True)
        bag = self._bag(path)
        return bag.source(*bag.wanted(wanted))

    def pieces(self, path: Path, _: Collection[str] | None = None) -> Pieces:
        """Yield all numeric fields, some thousand messages of a topic at a time; raises RecordingError."""
        bag = self._bag(path)
        return bag.source(*(yield from bag.pieces()))

    def element_names(self, path: Path, topic: str) -> tuple[str, ...]:
        """Return the names of array elements in a topic's first decodable message; () if it has none."""
        return self._bag(path).element_names(topic)

    def _bag(self, path: Path) -> _Ros1Bag:
        if not self.sniff(path):
            raise RecordingError(f"{path}: is not a ROS bag", "see cdtool list formats")
        return _Ros1Bag(path, self.name)


class _Ros1Bag(Bag):
    """A ROS 1 bag, read by rosbags."""

    def messages(self, is_wanted: IsWanted) -> Generator[tuple[Stream, int, bytes], None, None]:
        """Yield the messages to the bag's end or to the first damage."""
        from rosbags.highlevel import AnyReader

        with one_line_errors(self.path, "a ROS bag"):
            reader = AnyReader([Path(os.fspath(self.path))])
            reader.open()
        try:
            with one_line_errors(self.path, "a ROS bag"):
                streams = {connection.id: _stream(connection) for connection in reader.connections}
                for connection in reader.connections:
                    count = self.topics.get(connection.topic, ("", 0))[1] + connection.msgcount
                    self.topics[connection.topic] = (connection.msgtype, count)
                self.origin = int(reader.start_time) if reader.message_count else 0
            wanted = [connection for connection in reader.connections if is_wanted(connection.topic)]
            messages = iter(reader.messages(connections=wanted))
            while wanted:
                try:
                    connection, time, raw = next(messages)
                except StopIteration:
                    return
                except Exception as fault:  # damaged bytes cause errors of any type
                    self.end = one_line(fault)
                    return
                yield streams[connection.id], time, bytes(raw)
        finally:
            reader.close()


def _stream(connection: Any) -> Stream:
    """Return the stream of a connection, with the definition of its messages."""
    definition = ("ros1msg", connection.msgtype, connection.msgdef.data.encode())
    return Stream(connection.id % 2**16, connection.topic, "ros1", definition)
