"""ROS 2 bags in SQLite (.db3); their messages are decoded like those of MCAP files.

rosbag2_storage_sqlite3: a table `topics` (id, name, type, serialization_format), a table `messages` (id, topic_id,
timestamp [ns], data), and from ROS 2 Iron on `message_definitions`. Bags written before contain no definition of their
messages: those of the standard packages are known. Messages may be compressed with zstd, one by one.

A database is opened read-only and as immutable, so that neither it nor a file beside it is changed. One that was not
closed has a journal beside it, which SQLite can only apply to a copy: both are copied to a temporary folder.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Generator, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.base.remote.remote_path import location
from cdtool.formats.bags.bag import Bag, one_line
from cdtool.formats.bags.topic_log import IsWanted, TopicFormat
from cdtool.formats.containers.container_checks import one_line_errors
from cdtool.formats.messages.batch import Stream
from cdtool.formats.messages.schemas import DEFINITIONS

_SQLITE, _ZSTD = b"SQLite format 3\0", b"\x28\xb5\x2f\xfd"
_JOURNALS = ("-wal", "-journal")
# Largest message [bytes]: SQLite does not return a longer value.
_LARGEST = 2**28


@dataclass(frozen=True)
class Rosbag2(TopicFormat):
    """ROS 2 bags in SQLite: a column is a topic and a numeric field of its messages, as in an MCAP file."""

    name: ClassVar[str] = "rosbag2"
    suffixes: ClassVar[tuple[str, ...]] = (".db3",)

    def sniff(self, path: Path) -> bool:
        """Return whether the file is an SQLite database with a table of messages."""
        head = _head(path)
        if not head.startswith(_SQLITE):
            return False
        journal = location(f"{path}{_JOURNALS[0]}")  # of a bag that was not closed, it may have all but the first bytes
        return b"messages" in head or (_is_filled(journal) and b"messages" in _head(journal))

    def log(self, path: Path, is_wanted: IsWanted | None = None) -> Bag:
        """Open a bag."""
        return _Ros2Bag(path, is_wanted)


class _Ros2Bag(Bag):
    """A ROS 2 bag, read by SQLite in the order in which it was written."""

    format = Rosbag2.name

    def messages(self) -> Generator[tuple[Stream, int, bytes], None, None]:
        """Yield the messages to the bag's end or to the first damage."""
        with ExitStack() as stack:
            with one_line_errors("a ROS 2 bag"):
                file = stack.enter_context(self._database())
                base = stack.enter_context(closing(_connect(file)))
                tables = {name for (name,) in base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
                kinds = _topics(self.path, base, tables)
                self._count(base, kinds)
                streams = self._streams(kinds, _definitions(base) if "message_definitions" in tables else {})
            unwanted, damaged = kinds.keys() - streams.keys(), 0
            # A row of a table needs four bytes: more rows than the file has room for are a loop in damaged pages.
            for topic, time, raw in self._rows(base, file.stat().st_size // 4):
                if topic in unwanted:
                    continue
                is_message = topic in streams and _is_stamp(time) and isinstance(raw, bytes)
                content = _decompressed(raw) if is_message else None
                if content is None:
                    damaged += 1
                else:
                    yield streams[topic], time, content
            if damaged:
                self.noted.append(Finding("damaged_rows", "", {"count": damaged}))

    def _rows(self, base: sqlite3.Connection, most: int) -> Iterator[tuple[Any, Any, Any]]:
        """Yield the rows of the table of messages, to its end or to the first damage; at most `most`."""
        try:
            for number, row in enumerate(base.execute("SELECT topic_id, timestamp, data FROM messages")):
                if number == most:
                    raise sqlite3.DatabaseError(f"more than {most} rows")
                yield row
        except (sqlite3.Error, MemoryError, OverflowError) as fault:
            self.end = one_line(fault)

    @contextmanager
    def _database(self) -> Iterator[Path]:
        """Yield the database as a file: the bag itself, or a temporary copy if it was not closed."""
        journals = [path for path in (location(f"{self.path}{end}") for end in _JOURNALS) if _is_filled(path)]
        if not journals:
            yield self.path
            return
        with TemporaryDirectory(prefix="cdtool-") as folder:
            copy = Path(folder) / "bag.db3"
            shutil.copyfile(self.path, copy)
            for journal in journals:
                shutil.copyfile(journal, Path(folder) / f"bag.db3{journal.name.removeprefix(self.path.name)}")
            with closing(sqlite3.connect(copy)) as base:  # applies the journal
                base.execute("SELECT count(*) FROM sqlite_master").fetchone()
                base.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
            self.noted.append(Finding("bag_not_closed", "", {"journal": journals[0].name}))
            yield copy

    def _count(self, base: sqlite3.Connection, kinds: Mapping[int, tuple[str, str, str]]) -> None:
        """Set the topics with their numbers of messages (0 if the bag is too damaged), and the origin."""
        self.counts = {name: (kind, 0) for name, kind, _ in kinds.values()}
        try:
            counted = base.execute("SELECT topic_id, count(*), min(timestamp) FROM messages GROUP BY topic_id")
            rows = counted.fetchall()
        except sqlite3.DatabaseError:
            first = base.execute("SELECT timestamp FROM messages LIMIT 1").fetchone()
            self.origin = first[0] if first is not None and _is_stamp(first[0]) else 0
            return
        for topic, count, _ in rows:
            if topic in kinds:
                name, kind, _ = kinds[topic]
                self.counts[name] = (kind, self.counts[name][1] + count)
        self.origin = min((first for _, _, first in rows if _is_stamp(first)), default=0)

    def _streams(
        self, kinds: Mapping[int, tuple[str, str, str]], own: Mapping[str, tuple[str, str]]
    ) -> dict[int, Stream]:
        """Return the streams of the wanted topics by the topics' numbers, with the definitions of their messages."""
        streams: dict[int, Stream] = {}
        standard: dict[str, None] = {}
        for number, (topic, (name, kind, encoding)) in enumerate(kinds.items()):
            if self.is_wanted(name):
                language, text = own.get(kind) or ("ros2msg", _standard_definition(kind))
                standard |= {kind: None} if text and kind not in own else {}
                streams[topic] = Stream(number, name, encoding, (language if text else "", kind, text.encode()))
        if standard:
            self.noted.append(Finding("standard_definitions", "", {"types": tuple(standard)}))
        return streams


def _connect(file: Path) -> sqlite3.Connection:
    """Open a database for reading only; SQLite does not refuse a damaged one before it meets the damage."""
    base = sqlite3.connect(f"{Path(os.fspath(file)).absolute().as_uri()}?mode=ro&immutable=1", uri=True)
    base.text_factory = lambda text: text.decode("utf-8", "replace")
    base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LARGEST)
    base.execute("PRAGMA writable_schema=ON")  # nothing can be written in this mode of opening
    return base


def _topics(path: Path, base: sqlite3.Connection, tables: set[str]) -> dict[int, tuple[str, str, str]]:
    """Return name, message type and encoding of each topic by its number; raises RecordingError."""
    for name in sorted({"topics", "messages"} - tables):
        raise RecordingError(f"{path}: is not a ROS 2 bag: it has no table '{name}'", "see cdtool list formats")
    rows = base.execute("SELECT id, name, type, serialization_format FROM topics")
    return {row[0]: (str(row[1]), str(row[2]), str(row[3])) for row in rows}


def _definitions(base: sqlite3.Connection) -> dict[str, tuple[str, str]]:
    """Return language and text of the definitions in the bag by message type; those in IDL are not read."""
    rows = base.execute("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
    return {str(kind): (str(language), str(text)) for kind, language, text in rows if language == "ros2msg" and text}


def _standard_definition(kind: str) -> str:
    """Return the definition of a message of the standard packages; empty if it is unknown."""
    package, _, rest = kind.partition("/")
    name = kind if rest.startswith("msg/") else f"{package}/msg/{rest}"
    if name in DEFINITIONS:
        return DEFINITIONS[name]
    from rosbags.typesys import Stores, get_typestore

    try:
        text, _ = get_typestore(Stores.ROS2_HUMBLE).generate_msgdef(name, ros_version=2)
    except Exception:  # the package does not know the type
        return ""
    return str(text)


def _is_stamp(time: object) -> bool:
    return isinstance(time, int) and 0 <= time < 2**63


def _is_filled(path: Path) -> bool:
    return path.is_file() and path.stat().st_size > 0


def _decompressed(raw: bytes) -> bytes | None:
    """Return a message that may be a zstd frame; None if it is damaged or too large."""
    if not raw.startswith(_ZSTD):  # no representation of CDR starts with these bytes
        return raw
    import zstandard

    try:
        if zstandard.frame_content_size(raw) <= _LARGEST:
            return zstandard.ZstdDecompressor(max_window_size=_LARGEST).decompress(raw, max_output_size=_LARGEST)
    except zstandard.ZstdError:
        return None
    return None


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(2**16)  # SQLite's largest page; the first one has the names of the tables
