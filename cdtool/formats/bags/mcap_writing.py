"""Write a recording as MCAP: one topic per clock, one message per sample, with a ROS 2 type defined by the columns.

A message's log time is a whole number of nanoseconds; its field `time_s` is the exact time, so that nothing is lost.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.formats.groups import UNVERIFIED, Group, Part, Parts, WrittenNames, prefix_keys, require_clocks
from cdtool.formats.mcap.exact_times import EXACT_TIME, METADATA, PACKAGE
from cdtool.formats.mcap.write import merged

_CDR_LITTLE_ENDIAN = b"\x00\x01\x00\x00"


def write_mcap_topics(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> WrittenNames:
    """Write the groups, message by message in the order of their times; the names have the form `/clock_1 torque`."""
    from mcap.writer import CompressionType, Writer

    require_clocks(groups)
    start = _start(groups, float(provenance.get("origin_s", "0")))
    fields = [_field_names([column.name for column in group.columns]) for group in groups]
    with path.open("wb") as file:
        # Messages without a checksum in the log get none here: a checksum would mark them as verified.
        checked = UNVERIFIED not in provenance
        writer: Any = Writer(file, compression=CompressionType.ZSTD, enable_crcs=checked)
        writer.start(profile="ros2", library="cdtool")
        writer.add_metadata(METADATA, prefix_keys(provenance))
        channels = []
        for group, names in zip(groups, fields, strict=True):
            schema = writer.register_schema(_type_name(group), "ros2msg", _definition(group, names).encode())
            channels.append(writer.register_channel(f"/{group.name}", "cdr", schema))
        done = [0] * len(groups)
        for ready in parts:
            for number, stamp, payload in _messages(ready, start):
                writer.add_message(channels[number], stamp, payload, stamp, done[number])
                done[number] += 1
        writer.finish()
    return [
        [
            [f"/{group.name} {name}{'[:]' if column.values.ndim == 2 else ''}"]
            for column, name in zip(group.columns, names, strict=True)
        ]
        for group, names in zip(groups, fields, strict=True)
    ]


def _start(groups: Sequence[Group], origin: float) -> int:
    """Return the log time [ns] of time 0; it is later than the origin if the earliest log time would be negative."""
    earliest = min((group.start for group in groups if group.rows), default=0.0)
    start = round(origin * 10**9)
    return max(start, math.ceil(-earliest * 10**9)) if earliest < 0.0 else start


def _messages(ready: Sequence[Part | None], start: int) -> Iterator[tuple[int, int, bytes]]:
    """Yield (group, stamp, payload) in the order of the stamps; equal stamps in the order of the groups."""
    times = [np.empty(0) if part is None or part.time is None else part.time for part in ready]
    stamps = [start + np.rint(time * 10**9).astype(np.int64) for time in times]
    rows = [
        np.column_stack([time, *(part.values if part is not None else ())]).astype("<f8")
        for time, part in zip(times, ready, strict=True)
    ]
    for group, row, stamp in merged(stamps):
        yield group, stamp, _CDR_LITTLE_ENDIAN + rows[group][row].tobytes()


def _definition(group: Group, names: Sequence[str]) -> str:
    lines = [f"float64 {EXACT_TIME}  # [s] from the start, exact"]
    for column, name in zip(group.columns, names, strict=True):
        comment = f"{column.name}{f' [{column.unit}]' if column.unit else ''}"
        array = f"[{column.values.shape[1]}]" if column.values.ndim == 2 else ""
        lines.append(f"float64{array} {name}  # {' '.join(comment.split())}")
    return "\n".join(lines) + "\n"


def _type_name(group: Group) -> str:
    return f"{PACKAGE}/{re.sub(r'[^A-Za-z0-9]', '', group.name.title())}"


def _field_names(names: Sequence[str]) -> list[str]:
    """Return unique names that ROS 2 allows: lower-case letters, digits, single underscores."""
    fields: list[str] = []
    for name in names:
        plain = re.sub(r"_+", "_", re.sub(r"[^a-z0-9]", "_", name.lower())).strip("_")
        plain = plain if plain[:1].isalpha() else f"column_{plain}".rstrip("_")
        field, number = plain, 2
        while field in fields or field == EXACT_TIME:
            field, number = f"{plain}_{number}", number + 1
        fields.append(field)
    return fields
