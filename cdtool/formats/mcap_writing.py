"""Writing a recording as MCAP: a topic a clock, a message a sample, in a ROS 2 type that its columns define.

A message's time is a whole number of nanoseconds; `time_s` in it is the exact one, so that nothing is lost.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.formats.groups import UNVERIFIED, Group, Part, Parts, Written, need_clocks, stored
from cdtool.formats.mcap.exact_times import EXACT_TIME, METADATA, PACKAGE
from cdtool.recording import FloatArray

_CDR_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
_SECOND = 10**9
_ROWS = 2**14


def write_mcap_topics(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> Written:
    """Write the groups, message by message in the order of their times; names are `/clock_1 torque`."""
    from mcap.writer import CompressionType, Writer

    need_clocks(path, groups)
    start = _start(groups, float(provenance.get("origin_s", "0")))
    fields = [_field_names([column.name for column in group.columns]) for group in groups]
    with path.open("wb") as file:
        # What no checksum covered in the log gets none here: it would be stamped as good.
        checked = UNVERIFIED not in provenance
        writer: Any = Writer(file, compression=CompressionType.ZSTD, enable_crcs=checked)
        writer.start(profile="ros2", library="cdtool")
        writer.add_metadata(METADATA, stored(provenance))
        channels = []
        for group, names in zip(groups, fields, strict=True):
            schema = writer.register_schema(_type_name(group), "ros2msg", _definition(group, names).encode())
            channels.append(writer.register_channel(f"/{group.name}", "cdr", schema))
        done = [0] * len(groups)
        for ready in parts:
            for which, stamp, payload in _messages(ready, start):
                writer.add_message(channels[which], stamp, payload, stamp, done[which])
                done[which] += 1
        writer.finish()
    return [
        [
            [f"/{group.name} {name}{'[:]' if column.values.ndim == 2 else ''}"]
            for column, name in zip(group.columns, names, strict=True)
        ]
        for group, names in zip(groups, fields, strict=True)
    ]


def _start(groups: Sequence[Group], origin: float) -> int:
    """Nanoseconds of time 0; an earlier time than 0 ns cannot be written, and moves all."""
    earliest = min((group.start for group in groups if group.rows), default=0.0)
    start = round(origin * _SECOND)
    return max(start, math.ceil(-earliest * _SECOND)) if earliest < 0.0 else start


def _messages(ready: Sequence[Part | None], start: int) -> Iterator[tuple[int, int, bytes]]:
    """(group, stamp, payload) in the order of the stamps; at equal ones in the order of the groups."""
    stamps = [start + np.rint(_time(part) * _SECOND).astype(np.int64) for part in ready]
    which = np.repeat(np.arange(len(ready)), [len(part) for part in stamps])
    row = np.concatenate([np.arange(len(part)) for part in stamps])
    joined = np.concatenate(stamps)
    order = np.lexsort((which, joined))
    for first in range(0, len(order), _ROWS):
        some = order[first : first + _ROWS]
        packed = [_packed(part, row[some[which[some] == group]]) for group, part in enumerate(ready)]
        for group, stamp in zip(which[some].tolist(), joined[some].tolist(), strict=True):
            yield group, stamp, next(packed[group])


def _time(part: Part | None) -> FloatArray:
    return np.empty(0) if part is None or part.time is None else part.time


def _packed(part: Part | None, rows: np.ndarray[tuple[int], np.dtype[np.intp]]) -> Iterator[bytes]:
    """CDR of those rows."""
    if part is None:
        return iter(())
    table = np.column_stack([_time(part)[rows], *(column[rows] for column in part.values)]).astype("<f8")
    return (_CDR_LITTLE_ENDIAN + line.tobytes() for line in table)


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
