"""Writing a recording as MCAP: a topic a clock, a message a sample, in a ROS 2 type that its columns define.

A message's time is a whole number of nanoseconds; `time_s` in it is the exact one, so that nothing is lost.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.formats.groups import Group, Written, clock_of, stored
from cdtool.formats.source import Source
from cdtool.recording import FloatArray

METADATA = "cdtool.converted"
EXACT_TIME = "time_s"
_CDR_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
_SECOND = 10**9
_ROWS = 2**14


def write_mcap_topics(path: Path, groups: Sequence[Group], provenance: Mapping[str, str]) -> Written:
    """Write the groups, message by message in the order of their times; names are `/clock_1 torque`."""
    from mcap.writer import CompressionType, Writer

    times = [clock_of(path, group) for group in groups]
    stamps = _stamps(times, float(provenance.get("origin_s", "0")))
    fields = [_field_names([column.name for column in group.columns]) for group in groups]
    with path.open("wb") as file:
        writer: Any = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="ros2", library="cdtool")
        writer.add_metadata(METADATA, stored(provenance))
        channels = []
        for group, names in zip(groups, fields, strict=True):
            schema = writer.register_schema(_type_name(group), "ros2msg", _definition(group, names).encode())
            channels.append(writer.register_channel(f"/{group.name}", "cdr", schema))
        for which, row, payload in _messages(groups, times, stamps):
            stamp = int(stamps[which][row])
            writer.add_message(channels[which], log_time=stamp, data=payload, publish_time=stamp, sequence=row)
        writer.finish()
    return [
        [
            [f"/{group.name} {name}{'[:]' if column.values.ndim == 2 else ''}"]
            for column, name in zip(group.columns, names, strict=True)
        ]
        for group, names in zip(groups, fields, strict=True)
    ]


def exact_times(path: Path) -> dict[str, str] | None:
    """The metadata of a file that cdtool converted, else None: its topics then hold exact times."""
    from mcap.reader import make_reader

    try:
        with path.open("rb") as file:
            for record in make_reader(file).iter_metadata():
                if record.name == METADATA:
                    return dict(record.metadata)
    except Exception:  # a damaged file holds no metadata that could be relied on
        return None
    return None


def with_exact_times(source: Source, exact: Source, origin: float) -> Source:
    """A source of a converted file with the times that were written, where each message still has its own."""
    columns = {}
    for name, column in source.columns.items():
        topic = name.partition(" ")[0]
        clock = exact.columns.get(f"{topic} {EXACT_TIME}")
        if clock is None or len(clock.values) != len(column.values):
            return source
        columns[name] = type(column)(name, column.values, clock.values, column.unit)
    return Source(source.path, source.format, columns, origin, source.findings, source.details, source.names)


def _stamps(times: Sequence[FloatArray], origin: float) -> list[Any]:
    """Nanoseconds of each sample; an earlier time than 0 cannot be written, and moves all."""
    start = round(origin * _SECOND)
    earliest = min((float(time[0]) for time in times if len(time)), default=0.0)
    start = max(start, math.ceil(-earliest * _SECOND)) if earliest < 0.0 else start
    return [start + np.rint(time * _SECOND).astype(np.int64) for time in times]


def _messages(groups: Sequence[Group], times: Sequence[FloatArray], stamps: Sequence[Any]) -> Any:
    """(group, row, payload) in the order of the times; of each group only some rows are packed at once."""
    which = np.repeat(np.arange(len(groups)), [len(part) for part in stamps])
    order = np.lexsort((which, np.concatenate(stamps)))
    packed: list[list[bytes]] = [[] for _ in groups]
    done = [0] * len(groups)
    for group in which[order].tolist():
        row = done[group]
        if row % _ROWS == 0:
            rows = slice(row, row + _ROWS)
            parts = [times[group][rows], *(column.values[rows] for column in groups[group].columns)]
            table = np.column_stack(parts).astype("<f8")
            packed[group] = [_CDR_LITTLE_ENDIAN + line.tobytes() for line in table]
        done[group] = row + 1
        yield group, row, packed[group][row % _ROWS]


def _definition(group: Group, names: Sequence[str]) -> str:
    lines = [f"float64 {EXACT_TIME}  # [s] from the start, exact"]
    for column, name in zip(group.columns, names, strict=True):
        comment = f"{column.name}{f' [{column.unit}]' if column.unit else ''}"
        array = f"[{column.values.shape[1]}]" if column.values.ndim == 2 else ""
        lines.append(f"float64{array} {name}  # {' '.join(comment.split())}")
    return "\n".join(lines) + "\n"


def _type_name(group: Group) -> str:
    return f"cdtool_msgs/msg/{re.sub(r'[^A-Za-z0-9]', '', group.name.title())}"


def _field_names(names: Sequence[str]) -> list[str]:
    """Names as ROS 2 allows them: small letters, digits, single underscores; each once."""
    found: list[str] = []
    for name in names:
        plain = re.sub(r"_+", "_", re.sub(r"[^a-z0-9]", "_", name.lower())).strip("_")
        plain = plain if plain[:1].isalpha() else f"column_{plain}".rstrip("_")
        made, number = plain, 2
        while made in found or made == EXACT_TIME:
            made, number = f"{plain}_{number}", number + 1
        found.append(made)
    return found
