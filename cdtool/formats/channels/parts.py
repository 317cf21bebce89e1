"""A log in parts, as rosbag2 splits one: joining the parts, and parts that metadata.yaml names but that are missing."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.files.bounded_loading import read_bytes
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.columns import Column
from cdtool.formats.source import Source, TopicDetails
from cdtool.recordings.clock import clean_time

# First and last time [s].
Span = tuple[float, float]

_METADATA = "metadata.yaml"
_COMPRESSED = (".zstd", ".zst", ".lz4")
# In metadata.yaml: a comment, the list of parts up to the next key, and the name of a part in it.
_COMMENT = re.compile(r"(?:^|[ \t])#.*", re.MULTILINE)
_LIST = re.compile(r"^[ \t]*relative_file_paths:(.*?)(?:^[ \t]*\w+:|\Z)", re.DOTALL | re.MULTILINE)
_PART = re.compile(r"[^\n,'\"\[\]/]{1,255}\.(?:mcap|db3)(?:\.\w{1,8})?")


def join_digests(digests: Sequence[str]) -> str:
    """Return the SHA-256 of a log: of a single part its own, else that of the concatenated hexadecimal digests."""
    return digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()


def missing_part_findings(folder: Path, parts: Sequence[Path]) -> list[Finding]:
    """Return findings on files that the folder's metadata.yaml names, but that are not among its `parts`."""
    read, findings = {part.name for part in parts}, []
    for name in named_parts(folder):
        plain = Path(name).stem if Path(name).suffix in _COMPRESSED else name
        if name in read or plain in read:
            continue
        exists = (folder / name).exists()
        kind = "part_missing" if not exists else "part_compressed" if name != plain else "part_of_other_kind"
        findings.append(Finding(kind, "", {"part": name, "metadata": _METADATA}))
    return findings


def loss_findings(folder: Path, parts: Sequence[Path], unread: Mapping[Path, RecordingError]) -> tuple[Finding, ...]:
    """Return the losses of a folder: `parts` are its files, `unread` those that cannot be read, with the reason."""
    findings = missing_part_findings(folder, parts)
    for part, fault in unread.items():
        reason = fault.message.removeprefix(f"{part}: ")
        findings.append(Finding("part_unreadable", "", {"part": part.name, "reason": reason}))
    return tuple(findings)


def join_sources(
    folder: Path, parts: Sequence[tuple[Source, Mapping[str, Span]]], unread: Mapping[Path, RecordingError]
) -> Source:
    """Return the columns of all parts without rows, and the findings of every part, in the order of their times.

    Each part has the time span [s] of each of its columns, on one clock. A column may be missing in some parts. A
    column whose array length differs between parts is left out and reported, as are parts that could not be read
    (`unread`).
    """
    sources = [source for source, _ in parts]
    lost = loss_findings(folder, [*(source.path for source in sources), *unread], unread)
    if len(parts) == 1:
        return replace(sources[0], path=folder, findings=(*lost, *sources[0].findings))
    findings = [*lost, *(found for source in sources for found in with_file_name(source.path, source.findings))]
    columns: dict[str, Column] = {}
    late: dict[Path, str] = {}
    for name in dict.fromkeys(name for source in sources for name in source.columns):
        containing = [(source, spans.get(name)) for source, spans in parts if name in source.columns]
        widths = sorted({source.columns[name].values.shape[1:] for source, _ in containing})
        if len(widths) > 1:
            lengths = {"lengths": tuple(width[0] if width else 1 for width in widths)}
            findings.append(Finding("array_lengths_differ", name, lengths))
            continue
        columns[name] = containing[0][0].columns[name]
        for (_, before), (source, span) in pairwise(containing):
            if before and span and span[0] < before[1]:
                late.setdefault(source.path, name)
    findings += [Finding("parts_overlap", "", {"part": path.name, "column": name}) for path, name in late.items()]
    first, names = sources[0], tuple(columns)
    details, topics = join_details(sources), join_topics(sources)
    return Source(folder, first.format, columns, first.origin, tuple(findings), details, names=names, topics=topics)


def join_parts(folder: Path, parts: Sequence[tuple[Source, ChannelMap]]) -> tuple[Source, ChannelMap]:
    """Return the rows of the parts of a log, in the order of their times, on the clock of the first, and their map.

    Each column is removed from its part, to limit the memory in use. Ground truth, such as the events of a stroke, may
    be in some parts only. Raises RecordingError if a part begins before the previous one ends.
    """
    parts = sorted(parts, key=lambda part: part[0].origin)
    sources = [source for source, _ in parts]
    first, items = sources[0], {item.channel: item for _, channels in parts for item in channels.sources}
    columns: dict[str, Column] = {}
    clocks: dict[tuple[int, ...], FloatArray] = {}
    for key in dict.fromkeys(key for item in items.values() for key in item.keys):
        containing = [(source, source.columns[key]) for source in sources if key in source.columns]
        if len({column.values.shape[1:] for _, column in containing}) > 1:
            raise RecordingError(f"the length of '{key}' differs between its parts", "select one element")
        clock = tuple(id(column.time) for _, column in containing)
        if clock not in clocks:
            clocks[clock] = _joined_times(key, containing, first.origin)
        values = np.concatenate([column.values for _, column in containing])
        columns[key] = replace(containing[0][1], values=values, time=clocks[clock])
        for source in sources:
            if isinstance(source.columns, dict):
                source.columns.pop(key, None)
    findings = tuple(found for source in sources for found in with_file_name(source.path, source.findings))
    details, topics = join_details(sources), join_topics(sources)
    joined = replace(first, path=folder, columns=columns, findings=findings, details=details, topics=topics)
    return joined, replace(parts[0][1], sources=tuple(items.values()))


def _joined_times(key: str, parts: Sequence[tuple[Source, Column]], origin: float) -> FloatArray:
    """Return the times [s] after `origin` of a column in the parts of a log; raises RecordingError if they overlap."""
    times = [column.time + (source.origin - origin) for source, column in parts if column.time is not None]
    cleaned = [clean_time(time, sampled=False).time for time in times]  # a stray stamp is no overlap
    filled = [(source, time) for (source, _), time in zip(parts, cleaned, strict=True) if len(time)]
    for (_, before), (source, time) in pairwise(filled):
        if time[0] <= before[-1]:
            raise RecordingError(
                f"{source.path}: overlaps the previous part ({key}: starts at {time[0]:g} s, before {before[-1]:g} s)",
                "the parts of a log share one clock and do not overlap",
            )
    return np.concatenate(times)


def with_file_name(path: Path, findings: Sequence[Finding]) -> Iterator[Finding]:
    """Yield the findings of a part, with the name of its file."""
    return (replace(finding, file=path.name) for finding in findings)


def join_details(parts: Sequence[Source]) -> dict[str, str]:
    """Return the details of a log from those of its parts."""
    if len(parts) == 1:
        return dict(parts[0].details)
    by_key: dict[str, list[str]] = {}
    for part in parts:
        for key, text in part.details.items():
            by_key.setdefault(key, []).append(text)
    joined = {"parts": f"{len(parts)}, {parts[0].path.name} to {parts[-1].path.name}"}
    return joined | {key: " or ".join(dict.fromkeys(texts)) for key, texts in by_key.items()}


def join_topics(parts: Sequence[Source]) -> dict[str, TopicDetails]:
    """Return the details of each topic from those of the parts of a log."""
    by_name: dict[str, list[TopicDetails]] = {}
    for part in parts:
        for name, topic in part.topics.items():
            by_name.setdefault(name, []).append(topic)
    return {name: TopicDetails.of_parts(topics) for name, topics in by_name.items()}


def named_parts(folder: Path) -> list[str]:
    """Return the file names listed in `relative_file_paths` of a folder's metadata.yaml; empty without this file.

    The first versions of rosbag2 wrote the bag's folder before each name.
    """
    metadata = folder / _METADATA
    try:
        content = read_bytes(metadata, RecordingError) if metadata.is_file() else b""
    except RecordingError:  # the list is only used for a check
        return []
    listed = _LIST.search(_COMMENT.sub("", content.decode("utf-8", "replace")))
    return [name.lstrip("- ") for name in _PART.findall(listed[1])] if listed else []
