"""ROS 1 bags, by rosbags; their messages are decoded like those of MCAP files."""

from __future__ import annotations

import os
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from cdtool.formats.bags.bag import Bag, one_line
from cdtool.formats.bags.topic_log import IsWanted, TopicFormat
from cdtool.formats.containers.container_checks import one_line_errors
from cdtool.formats.messages.batch import Stream

_BAG = b"#ROSBAG V2.0"


@dataclass(frozen=True)
class Rosbag(TopicFormat):
    """ROS 1 bags: a column is a topic and a numeric field of its messages, as in an MCAP file."""

    name: ClassVar[str] = "rosbag"
    suffixes: ClassVar[tuple[str, ...]] = (".bag",)

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like a ROS 1 bag."""
        with path.open("rb") as file:
            return file.read(len(_BAG)) == _BAG

    def log(self, path: Path, is_wanted: IsWanted | None = None) -> Bag:
        """Open a bag."""
        return _Ros1Bag(path, is_wanted)


class _Ros1Bag(Bag):
    """A ROS 1 bag, read by rosbags."""

    format = Rosbag.name

    def messages(self) -> Generator[tuple[Stream, int, bytes], None, None]:
        """Yield the messages to the bag's end or to the first damage."""
        from rosbags.highlevel import AnyReader

        with one_line_errors("a ROS bag"):
            reader = AnyReader([Path(os.fspath(self.path))])
            reader.open()
        try:
            with one_line_errors("a ROS bag"):
                streams = {connection.id: _stream(connection) for connection in reader.connections}
                for connection in reader.connections:
                    count = self.counts.get(connection.topic, ("", 0))[1] + connection.msgcount
                    self.counts[connection.topic] = (connection.msgtype, count)
                self.origin = int(reader.start_time) if reader.message_count else 0
            wanted = [connection for connection in reader.connections if self.is_wanted(connection.topic)]
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
