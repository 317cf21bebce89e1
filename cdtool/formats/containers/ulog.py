"""ULog files of PX4, by pyulog. https://docs.px4.io/main/en/dev_log/ulog_file_format.html"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from functools import cache, partial
from io import StringIO
from os import SEEK_CUR
from pathlib import Path
from typing import Any, BinaryIO, ClassVar

import numpy as np

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.containers.container_checks import library, messages_of, one_line_errors
from cdtool.formats.epoch_clock import EpochClock
from cdtool.formats.slices import Container, SlicedColumn, SlicedFormat, rows_of

_MAGIC = b"ULog\x01\x12\x35"
_CLOCK, _PADDING = "timestamp", "_padding"
# The fields of a message, those of the messages inside of it included; PX4's largest has some hundred.
_MOST_FIELDS = 20_000
_HEADER, _DETAIL = 3, 80


@dataclass(frozen=True)
class Ulog(SlicedFormat):
    """ULog files of PX4: a column is a topic and a field, `vehicle_attitude/q[0]`; instance 1 is `sensor_accel[1]/x`.

    The clock of a topic is the time stamp in its messages, in s since the start of the autopilot.
    """

    name: ClassVar[str] = "ulog"
    suffixes: ClassVar[tuple[str, ...]] = (".ulg", ".ulog")

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like a ULog file."""
        with path.open("rb") as file:
            return file.read(len(_MAGIC)) == _MAGIC

    @contextmanager
    def _open(self, container: Container) -> Iterator[None]:
        pyulog = library("pyulog", "ulog")
        with one_line_errors("a ULog file"), redirect_stdout(StringIO()) as printed:
            _check_formats(container.path, pyulog)
            with container.path.open("rb") as file:
                ends = _EndCheck(file)
                log = pyulog.ULog(ends)
        container.findings += [*_losses(log, ends), *messages_of("pyulog", printed.getvalue())]
        container.details = _details(log)
        count: Counter[str] = Counter()
        for topic in log.data_list:
            name = topic.name if not topic.multi_id else f"{topic.name}[{topic.multi_id}]"
            count[name] += 1  # a topic that was subscribed again
            _add_topic(container, topic, name if count[name] == 1 else f"{name}#{count[name]}")
        yield


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
    """Raise RecordingError if a message has more fields than any of PX4; messages inside of messages multiply them.

    Raises RecursionError if a message contains itself.
    """
    with path.open("rb") as file:
        header = pyulog.ULog(_EndCheck(file), parse_header_only=True)
    formats: Mapping[str, Any] = header.message_formats

    @cache
    def count(name: str) -> int:
        fields = formats[name].fields
        return sum(max(1, size) * (count(kind) if kind in formats else 1) for kind, size, _ in fields)

    widest = max(formats, key=count, default="")
    if widest and count(widest) > _MOST_FIELDS:
        raise RecordingError(f"message '{widest}' has more than {_MOST_FIELDS} fields: refused", "is it a log?")


def _losses(log: Any, ends: _EndCheck) -> list[Finding]:
    """Return what the log or its logger lost."""
    findings = []
    if log.file_corruption:
        findings.append(Finding("messages_damaged"))
    elif ends.left is not None:
        findings.append(Finding("cut_within_message", "", {"size": ends.left}))
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


def _add_topic(container: Container, topic: Any, name: str) -> None:
    stamps = topic.data.get(_CLOCK)
    if stamps is None or stamps.dtype.kind not in "iu":
        container.leave_out(name, "a topic without time stamps")
        return
    clock = EpochClock(partial(rows_of, np.ascontiguousarray(stamps)), 1e-6)
    texts = []
    for field in topic.field_data:
        values = topic.data[field.field_name]
        if field.type_str == "char":
            texts.append(field.field_name.partition("[")[0])
        elif field.field_name != _CLOCK and not field.field_name.rpartition(".")[2].startswith(_PADDING):
            container.columns[f"{name}/{field.field_name}"] = partial(SlicedColumn.of, values, clock)
    for text in dict.fromkeys(texts):
        container.leave_out(f"{name}/{text}", "a text")
