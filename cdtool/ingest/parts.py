"""A log in parts, as rosbag2 splits one: its parts put together, and those that its metadata.yaml names in vain."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cdtool.bounded_loading import read_bytes
from cdtool.columns import Column
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.messages import ArrayLengthsDiffer
from cdtool.findings.parts import PartCompressed, PartMissing, PartOfOtherKind, PartsOverlap, PartUnreadable
from cdtool.formats.source import Source, TopicDetails
from cdtool.ingest.part_gaps import PartSpan, gaps_between
from cdtool.recording import GROUND_TRUTH, Recording, Series

_METADATA = "metadata.yaml"
_COMPRESSED = (".zstd", ".zst", ".lz4")


def joined_digest(digests: Sequence[str]) -> str:
    """SHA-256 of a log by those of its parts: of their hexadecimal digits one after the other; of one part its own."""
    return digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()


def lost_parts(folder: Path, parts: Sequence[Path]) -> list[Finding]:
    """Files that the folder's metadata.yaml names and that are none of its `parts`; none without a metadata.yaml."""
    read, found = {part.name for part in parts}, []
    for name in _named_parts(folder / _METADATA):
        plain = Path(name).stem if Path(name).suffix in _COMPRESSED else name
        if name in read or plain in read:
            continue
        is_there = (folder / name).exists()
        kind = PartMissing if not is_there else PartCompressed if name != plain else PartOfOtherKind
        found.append(Finding(kind(name, _METADATA), severity="loss"))
    return found


def lost_findings(folder: Path, parts: Sequence[Path], unread: Mapping[Path, RecordingError]) -> tuple[Finding, ...]:
    """The losses of a folder: `parts` are its files, `unread` those of them that cannot be read, with the reason."""
    found = lost_parts(folder, parts)
    for part, fault in unread.items():
        why = fault.message.removeprefix(f"{part}: ")
        found.append(Finding(PartUnreadable(part.name, why), severity="loss"))
    return tuple(found)


def joined_sources(
    folder: Path, parts: Sequence[Source], unread: Mapping[Path, RecordingError] | None = None
) -> Source:
    """The columns of all parts, each in the order of its times, with what is odd about every part.

    A column may be absent in some of them; one whose arrays differ in length is left out, and that is said, as are
    parts that could not be read (`unread`).
    """
    unread = unread or {}
    lost = lost_findings(folder, [*(part.path for part in parts), *unread], unread)
    if len(parts) == 1:
        return replace(parts[0], path=folder, findings=(*lost, *parts[0].findings))
    parts = sorted(parts, key=_start)
    findings = [*lost, *(found for part in parts for found in of_part(part.path, part.findings))]
    columns: dict[str, Column] = {}
    late: dict[Path, list[str]] = {}
    for name in dict.fromkeys(name for part in parts for name in part.columns):
        holding = [part for part in parts if name in part.columns]
        widths = sorted({part.columns[name].values.shape[1:] for part in holding})
        if len(widths) > 1:
            lengths = ArrayLengthsDiffer(tuple(width[0] if width else 1 for width in widths))
            findings.append(Finding(lengths, name, "note"))
            continue
        columns[name], overlapping = _joined_column(name, holding, parts[0].origin)
        for path in overlapping:
            late.setdefault(path, []).append(name)
    for path, names in late.items():
        findings.append(Finding(PartsOverlap(path.name, names[0])))
    return Source(
        folder,
        parts[0].format,
        columns,
        parts[0].origin,
        tuple(findings),
        joined_details(parts),
        tuple(columns),
        topics=joined_topics(parts),
    )


def joined_recordings(parts: Sequence[Recording], name: str) -> Recording:
    """Parts of one log, as logged, as one recording; raises RecordingError where they overlap or are not alike.

    Ground truth may be in some of them only, such as the events of a stroke.
    """
    parts = sorted(parts, key=lambda part: part.origin + part.start)
    first = parts[0]
    joined: dict[str, Series] = {}
    for channel in dict.fromkeys(name for part in parts for name in part.channels):
        pieces: list[Series] = []
        for part in parts:
            if channel in GROUND_TRUTH and channel not in part:
                continue
            if channel not in part or (pieces and part[channel].unit != pieces[0].unit):
                raise not_alike(part.source, channel, first.source)
            shift = part.origin - first.origin
            series = part[channel]
            if pieces and series.time[0] + shift <= pieces[-1].time[-1]:
                raise overlapping(part.source, channel, series.time[0] + shift, pieces[-1].time[-1])
            pieces.append(Series(series.time + shift, series.values, series.unit))
        time = np.concatenate([piece.time for piece in pieces])
        joined[channel] = Series(time, np.concatenate([piece.values for piece in pieces]), pieces[0].unit)
    findings = tuple(found for part in parts for found in of_part(Path(part.source), part.findings))
    findings += tuple(gaps_between([PartSpan.of(part) for part in parts]))
    source = ", ".join(part.source for part in parts)
    digest = joined_digest([part.digest for part in parts])
    return Recording(name, source, first.joints, joined, first.origin, findings, digest)


def not_alike(part: str, channel: str, first: str) -> RecordingError:
    """A part lacks a channel that the first one has."""
    return RecordingError(
        f"{part}: channel '{channel}' is not logged as in {first}", "parts of one log are alike", channel=channel
    )


def overlapping(part: str, channel: str, start: float, before: float) -> RecordingError:
    """A channel starts [s] in a part before it ends [s] in the one before."""
    return RecordingError(
        f"{part}: overlaps the part before it ({channel}: starts at {start:g} s, before {before:g} s)",
        "parts of one log share one clock and follow one another",
    )


def of_part(path: Path, findings: Sequence[Finding]) -> Iterator[Finding]:
    """What is odd about a part, with its name."""
    return (replace(found, file=path.name) for found in findings)


def _start(part: Source) -> tuple[float, str]:
    """The time of a part's first sample on the clock of its log; parts without any come last."""
    starts = [float(c.time[0]) for c in part.columns.values() if c.time is not None and len(c.time)]
    return part.origin + min(starts) if starts else np.inf, part.path.name


def _joined_column(name: str, parts: Sequence[Source], origin: float) -> tuple[Column, list[Path]]:
    """One column of the parts that hold it, and those of them that begin before the one before them ends."""
    times, values, late = [], [], []
    for part in parts:
        column = part.columns[name]
        time = column.time if column.time is not None else np.empty(0)
        times.append(time + (part.origin - origin))
        values.append(column.values)
        if len(times) > 1 and len(times[-2]) and len(time) and times[-1][0] < times[-2][-1]:
            late.append(part.path)
    time, joined = np.concatenate(times), np.concatenate(values)
    if late:
        order = np.argsort(time, kind="stable")
        time, joined = time[order], joined[order]
    return Column(name, joined, time, parts[0].columns[name].unit), late


def joined_details(parts: Sequence[Source]) -> dict[str, str]:
    """What the parts of a log say of themselves."""
    if len(parts) == 1:
        return dict(parts[0].details)
    said: dict[str, list[str]] = {}
    for part in parts:
        for key, text in part.details.items():
            said.setdefault(key, []).append(text)
    joined = {"parts": f"{len(parts)}, {parts[0].path.name} to {parts[-1].path.name}"}
    return joined | {key: " or ".join(dict.fromkeys(texts)) for key, texts in said.items()}


def joined_topics(parts: Sequence[Source]) -> dict[str, TopicDetails]:
    """What the parts of a log say of each topic."""
    said: dict[str, list[TopicDetails]] = {}
    for part in parts:
        for name, topic in part.topics.items():
            said.setdefault(name, []).append(topic)
    return {name: TopicDetails.of_parts(topics) for name, topics in said.items()}


def _named_parts(metadata: Path) -> list[str]:
    """The names below `relative_file_paths`, read line by line: rosbag2 writes plain lists of plain texts there.

    The first versions of rosbag2 wrote the bag's folder before each name.
    """
    try:
        content = read_bytes(metadata, RecordingError) if metadata.is_file() else b""
    except RecordingError:  # what it says is no more than a check
        return []
    lines = content.decode("utf-8", "replace").splitlines()
    for i, line in enumerate(lines):
        key, colon, rest = line.partition(":")
        if key.strip() == "relative_file_paths" and colon:
            listed = _flow_list(rest, lines[i + 1 :]) if "[" in rest else _block_list(lines[i + 1 :])
            return [Path(name).name for name in map(_plain, listed) if name]
    return []


def _flow_list(rest: str, below: Sequence[str]) -> list[str]:
    """`[bag_0.mcap, bag_1.mcap]`, in one line or over several."""
    return "\n".join([rest, *below]).partition("[")[2].partition("]")[0].split(",")


def _block_list(below: Sequence[str]) -> Iterator[str]:
    """Lines `- bag_0.mcap`, until one that is no item."""
    for line in below:
        text = line.strip()
        if not text or text.startswith("#"):
            continue
        if not text.startswith("- "):
            return
        yield text[2:]


def _plain(item: str) -> str:
    """An item without its quotes, or without the comment behind it."""
    text = item.strip()
    if text[:1] in ("'", '"'):
        return text[1:].partition(text[0])[0]
    return text.partition(" #")[0].strip()
