"""Read an MCAP log piece by piece, with findings on losses, unverified messages and inconsistencies."""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.bags.topic_log import IsWanted, Messages, TopicLog
from cdtool.formats.mcap.data_section import DataSection
from cdtool.formats.mcap.definitions import Definitions
from cdtool.formats.mcap.exact_times import EXACT_TIME, exact_origin
from cdtool.formats.mcap.file_bytes import FileBytes
from cdtool.formats.mcap.losses import Loss
from cdtool.formats.mcap.records import MAGIC, PREFIX, DamageError, Opcode, parse
from cdtool.formats.mcap.summary import between_chunks, matches_header, read_summary, unwanted_chunks
from cdtool.formats.source import TopicDetails


class Log(TopicLog):
    """An MCAP file; `counts` are the messages by channel.

    `wanted` selects topics: messages of other topics are only counted, and chunks without wanted topics are skipped if
    the summary is verified. If not `strict`, a file without any readable message, or with values that are known to be
    wrong, is a finding instead of an error.
    """

    format = "mcap"

    def __init__(self, path: Path, wanted: IsWanted | None = None, strict: bool = True) -> None:
        super().__init__(path, wanted)
        self._strict = strict
        self._file = FileBytes(path)
        self.summary = read_summary(self._file)
        unwanted = unwanted_chunks(self.summary, wanted) if wanted else set()
        if unwanted:
            self._file.expect(between_chunks(self.summary))
        self._definitions = Definitions(self.summary)
        self.section = DataSection(self._file, self.summary, self._definitions, unwanted)
        self.profile, after = header_of(self._file)
        origin = exact_origin(self._file, self.summary, after)
        if origin is not None:
            self.exact, self.exact_origin = EXACT_TIME, origin
        self.counts: Counter[int] = Counter()
        self.unverified = 0

    def blocks(self) -> Generator[Sequence[Messages], None, None]:
        """Yield the wanted messages, one memory block after the other in the file's order, channel by channel in each.

        Raises RecordingError if no message can be read, or if a CRC shows that values are wrong but not which ones.
        """
        with closing(self._file):
            try:
                for number, block in enumerate(self.section.blocks()):
                    self.origin = self.origin if number else self.section.first_time or 0
                    yield [each for each in block if self._is_read(each)]
                self._finish()
            except (OSError, DamageError) as fault:  # a lost drive, or a file that shrinks while it is read
                raise RecordingError(f"{self.path}: cannot be read to its end: {fault}", "read a copy of it") from fault

    @property
    def count(self) -> int:
        """Return the number of messages that were read."""
        return sum(self.counts.values())

    def _is_read(self, messages: Messages) -> bool:
        """Count the messages, and return whether they are wanted."""
        self.counts[messages.stream.id] += len(messages.batch)
        self.unverified += 0 if messages.covered else len(messages.batch)
        return self.is_wanted(messages.stream.topic)

    def _finish(self) -> None:
        self._file.check_unchanged()
        section = self.section
        self.counts.update(section.skipped)
        details: dict[str, TopicDetails] = {}
        for stream in self._definitions.streams():
            schema = stream.schema.name if stream.schema is not None else "no schema"
            topic = details.get(stream.topic, TopicDetails(schema, 0, stream.encoding))
            details[stream.topic] = replace(topic, messages=topic.messages + self.counts[stream.id])
        self.topic_details = details
        self._check_data_crc()
        self._check_appended_data()
        if self._strict and not self.count and section.losses:
            self._raise_nothing_left()

    def _check_data_crc(self) -> None:
        stated = self.section.data_crc
        if not stated or (self.section.is_partly_read and not self.unverified):
            return
        if self._file.crc(0, self.section.end_at) == stated:
            self.unverified = 0
        elif self._strict and self.unverified:
            raise RecordingError(
                f"{self.path}: the checksum of the data does not match: values are damaged, and it is unknown which",
                "copy the file again from its source",
            )
        elif self.unverified or not self.section.losses:
            text = "the checksum of the data section does not match"
            text += "" if self.unverified else " (those of all chunks with messages match)"
            self.section.losses.add(Loss(self.section.end_at, 0, text))

    def _check_appended_data(self) -> None:
        """Add the bytes after the log's end as a loss: another file was appended, whose summary is not this log's."""
        if not self.summary.problem or not self.section.is_ended:
            return
        end = end_of_log(self._file, self.section.end_at)
        if end is not None and end < self._file.size:
            self.section.losses.add(Loss(end, self._file.size - end, "the log ends here: was another file appended?"))
            self.summary = replace(self.summary, problem="")

    def _raise_nothing_left(self) -> None:
        losses = self.section.losses
        first = losses.entries[0] if losses.entries else Loss(8, 0, next(iter(losses.messages)))
        reason = " ".join(first.reason.split())[:200]
        raise RecordingError(
            f"{self.path}: damaged at byte {first.at}, before its first message: {reason}",
            "copy the file again from its source; no message in it can be read",
        )

    def findings(self) -> list[Finding]:
        """Return findings on losses, then on differences from the summary, then on messages without a checksum."""
        section, statistics = self.section, self.summary.statistics
        findings = section.losses.findings(self.count, self.origin)
        if self.summary.problem and not section.losses.stopped:
            findings.append(Finding("summary_damaged", "", {"reason": self.summary.problem, "messages": self.count}))
        if statistics is not None and statistics.message_count != self.count:
            findings.append(
                Finding("message_count_differs", "", {"stated": statistics.message_count, "read": self.count})
            )
        findings += self._differences()
        if self.unverified:
            findings.append(Finding("unverified", "", {"count": self.unverified, "messages": self.count}))
        writers = Counter(stream.topic for stream in self._definitions.streams() if self.counts[stream.id])
        findings += [
            Finding("several_writers", topic, {"channels": channels})
            for topic, channels in writers.items()
            if channels > 1 and self.is_wanted(topic)
        ]
        if not self.count:
            findings.append(Finding("no_message"))
        return findings

    def _differences(self) -> list[Finding]:
        """Return the differences between summary and data, unless a loss may explain them."""
        section, summary = self.section, self.summary
        if section.losses or summary.problem:
            return []
        findings: list[Finding] = []
        chunks, indexes = section.chunks, summary.chunks
        if indexes:
            other = sum(not matches_header(indexes[at], chunks[at]) for at in chunks.keys() & indexes.keys())
            differences = {
                "not indexed": len(chunks.keys() - indexes.keys()),
                "only indexed": len(indexes.keys() - chunks.keys()),
                "other values": other,
            }
            findings += [
                Finding("index_disagrees", "", {"count": count, "how": how})
                for how, count in differences.items()
                if count
            ]
        statistics = summary.statistics
        if statistics is not None and statistics.message_count == self.count:
            stated = Counter(statistics.channel_message_counts)
            findings += [Finding("channel_counts_differ")] if stated and stated != self.counts else []
        return findings + [Finding("defined_otherwise", topic) for topic in self._definitions.redefined_topics()]


def header_of(file: FileBytes) -> tuple[str, int]:
    """Return the profile that the file's header states, such as `ros2`, and the byte after the header."""
    head = file.read(len(MAGIC), PREFIX)
    length, at = int.from_bytes(head[1:], "little"), len(MAGIC) + PREFIX
    if len(head) < PREFIX or head[0] != Opcode.HEADER or length > 1 << 12:  # two short texts
        return "", len(MAGIC)
    try:
        return str(parse(Opcode.HEADER, file.read(at, length)).profile), at + length
    except DamageError:
        return "", at + length


def end_of_log(file: FileBytes, at: int) -> int | None:
    """Return the end of a log whose data end record is at byte `at`: the byte after the footer and magic bytes."""
    while True:
        head = file.read(at, PREFIX)
        length = PREFIX + int.from_bytes(head[1:], "little")
        if len(head) < PREFIX or not head[0] or length > file.size - at:
            return None
        at += length
        if head[0] == Opcode.FOOTER:
            return at + len(MAGIC) if bytes(file.read(at, len(MAGIC))) == MAGIC else None
