"""ULog files of PX4, by pyulog. https://docs.px4.io/main/en/dev_log/ulog_file_format.html"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from os import SEEK_CUR
from pathlib import Path
from typing import Any, BinaryIO, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError, naming
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.column_names import requested_keys
from cdtool.formats.columns import Column
from cdtool.formats.containers.container_checks import (
    as_numbers,
    check_size,
    left_out_finding,
    library,
    one_line_errors,
)
from cdtool.formats.epoch_clock import EpochClock, common_origin
from cdtool.formats.source import Source

_MAGIC = b"ULog\x01\x12\x35"
_CLOCK, _PADDING = "timestamp", "_padding"
# The fields of a message, those of the messages inside of it included; PX4's largest has some hundred.
_MOST_FIELDS = 20_000
_HEADER, _DETAIL, _MOST_MESSAGES = 3, 80, 5


@dataclass(frozen=True)
class Ulog:
    """ULog files of PX4: a column is a topic and a field, `vehicle_attitude/q[0]`; instance 1 is `sensor_accel[1]/x`.

    The clock of a topic is the time stamp in its messages, in s since the start of the autopilot.
    """

    name: ClassVar[str] = "ulog"
    suffixes: ClassVar[tuple[str, ...]] = (".ulg", ".ulog")

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like a ULog file."""
        with path.open("rb") as file:
            return file.read(len(_MAGIC)) == _MAGIC

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """Return the columns that `wanted` names, or all columns of numbers; raises RecordingError."""
        with naming(path):
            pyulog = library("pyulog", "ulog")
            with one_line_errors("a ULog file"), redirect_stdout(StringIO()) as printed:
                _check_formats(path, pyulog)
                with path.open("rb") as file:
                    ends = _EndCheck(file)
                    log = pyulog.ULog(ends)
            findings = _losses(log, ends, printed.getvalue())
            topics = _Topics(log.data_list, findings)
            keys = requested_keys(wanted, topics.names)
            if not keys:
                raise RecordingError("contains no message with numbers", "was the logger stopped at once?")
            check_size(path, sum(len(topics.fields[key][1]) for key in keys))
            columns, origin = topics.columns(keys)
        return Source(path, self.name, columns, origin, tuple(findings), _details(log), topics.names)


class _EndCheck:
    """A file whose reader sees whether the last message is complete: an incomplete one has `left` bytes.

    The library reads a message's header and then its content, as many bytes as the header declares.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file, self._is_content, self._missing = file, False, 0
        self.left: int | None = None
        self.tell, self.close = file.tell, file.close

    def read(self, size: int) -> bytes:
        """Return the next bytes."""
        content = self._file.read(size)
        self._missing = size - len(content)
        if self._missing and (content or self._is_content):
            self.left = len(content) + (_HEADER if self._is_content else 0)
        self._is_content = size == _HEADER and not self._is_content
        return content

    def seek(self, offset: int, whence: int = 0) -> int:
        """Go to another byte, where a header is read next.

        The library goes back by as many bytes as a damaged message declares, also where the file has fewer; without the
        difference it would read the same bytes for ever.
        """
        self._is_content = False
        return self._file.seek(offset + (self._missing if whence == SEEK_CUR else 0), whence)


def _check_formats(path: Path, pyulog: Any) -> None:
    """Raise RecordingError if a message has more fields than any of PX4; messages inside of messages multiply them."""
    with path.open("rb") as file:
        header = pyulog.ULog(_EndCheck(file), parse_header_only=True)
    formats: Mapping[str, Any] = header.message_formats
    known: dict[str, int] = {}

    def count(name: str, inside: tuple[str, ...]) -> int:
        if name in inside or len(inside) > _MOST_FIELDS:
            raise RecordingError(f"damaged: message '{name}' contains itself", "copy it again")
        if name not in known:
            sizes = (
                max(1, size) * (count(kind, (*inside, name)) if kind in formats else 1)
                for kind, size, _ in formats[name].fields
            )
            known[name] = sum(sizes)
        if known[name] > _MOST_FIELDS:
            raise RecordingError(f"message '{name}' has more than {_MOST_FIELDS} fields: refused", "is it a log?")
        return known[name]

    for name in formats:
        count(name, ())


def _losses(log: Any, ends: _EndCheck, printed: str) -> list[Finding]:
    """Return what the log or its logger lost."""
    findings = []
    if log.file_corruption:
        findings.append(Finding("messages_damaged"))
    elif ends.left is not None:
        findings.append(Finding("cut_within_message", "", {"size": ends.left}))
    lines = dict.fromkeys(" ".join(line.split())[:200] for line in printed.splitlines() if line.strip())
    findings += [
        Finding("library_message", "", {"library": "pyulog", "text": line}) for line in list(lines)[:_MOST_MESSAGES]
    ]
    if log.dropouts:
        lengths = [dropout.duration / 1000.0 for dropout in log.dropouts]
        findings.append(
            Finding("logger_dropouts", "", {"count": len(lengths), "total": sum(lengths), "longest": max(lengths)})
        )
    return findings


def _details(log: Any) -> dict[str, str]:
    """Return what the log states about itself, and how many parameters and texts it contains."""
    details = {key: " ".join(str(value).split())[:_DETAIL] for key, value in log.msg_info_dict.items()}
    counts = {
        "parameters": len(log.initial_parameters),
        "changed parameters": len(log.changed_parameters),
        "logged texts": len(log.logged_messages),
    }
    return details | {name: str(count) for name, count in counts.items() if count}


class _Topics:
    """The topics of a log: `fields` maps a column to its topic and its values."""

    def __init__(self, topics: list[Any], findings: list[Finding]) -> None:
        self._findings = findings
        self.fields: dict[str, tuple[str, Any]] = {}
        self._stamps: dict[str, Any] = {}
        count: Counter[str] = Counter()
        for topic in topics:
            name = topic.name if not topic.multi_id else f"{topic.name}[{topic.multi_id}]"
            count[name] += 1  # a topic that was subscribed again
            self._add(topic, name if count[name] == 1 else f"{name}#{count[name]}")
        self.names = tuple(self.fields)

    def _add(self, topic: Any, name: str) -> None:
        stamps = topic.data.get(_CLOCK)
        if stamps is None or stamps.dtype.kind not in "iu":
            self._findings.append(left_out_finding(name, "a topic without time stamps"))
            return
        self._stamps[name] = stamps
        texts = []
        for field in topic.field_data:
            if field.type_str == "char":
                texts.append(field.field_name.partition("[")[0])
            elif field.field_name != _CLOCK and not field.field_name.rpartition(".")[2].startswith(_PADDING):
                self.fields[f"{name}/{field.field_name}"] = name, topic.data[field.field_name]
        self._findings += [left_out_finding(f"{name}/{text}", "a text") for text in dict.fromkeys(texts)]

    def columns(self, keys: list[str]) -> tuple[dict[str, Column], float]:
        """Return these columns with their times [s], and the origin of the times [s]."""
        clocks = dict(self._clocks(keys))
        origin = common_origin(clocks.values())
        times: dict[str, FloatArray] = {
            topic: clock.times(0, len(self._stamps[topic]), origin) for topic, clock in clocks.items()
        }
        columns = {}
        for key in keys:
            topic, values = self.fields[key]
            columns[key] = Column(key, as_numbers(key, values, self._findings), times[topic])
        return columns, float(origin)

    def _clocks(self, keys: list[str]) -> Iterator[tuple[str, EpochClock]]:
        for topic in dict.fromkeys(self.fields[key][0] for key in keys):
            stamps = np.ascontiguousarray(self._stamps[topic])
            yield topic, EpochClock(lambda start, end, stamps=stamps: stamps[start:end], 1e-6)  # type: ignore[misc]
