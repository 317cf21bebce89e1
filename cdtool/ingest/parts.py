"""A log in parts, as rosbag2 splits one: its parts put together, and those that its metadata.yaml names in vain."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cdtool.bounded_loading import read_bytes
from cdtool.clock import GAP_PERIODS
from cdtool.columns import Column
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.messages import ArrayLengthsDiffer
from cdtool.findings.parts import PartCompressed, PartGap, PartMissing, PartOfOtherKind, PartsOverlap, PartUnreadable
from cdtool.formats.source import Source, TopicDetails
from cdtool.recording import GROUND_TRUTH, Recording, Series

# First and last time [s].
Span = tuple[float, float]

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
    folder: Path, parts: Sequence[tuple[Source, Mapping[str, Span]]], unread: Mapping[Path, RecordingError]
) -> Source:
    """Return the columns of all parts without rows, with the findings of every part, in the order of their times.

    Each part comes with what its columns span [s], on one clock. A column may be absent in some of them; one whose
    arrays differ in length is left out, and that is said, as are parts that could not be read (`unread`).
    """
    sources = [source for source, _ in parts]
    lost = lost_findings(folder, [*(source.path for source in sources), *unread], unread)
    if len(parts) == 1:
        return replace(sources[0], path=folder, findings=(*lost, *sources[0].findings))
    findings = [*lost, *(found for source in sources for found in of_part(source.path, source.findings))]
    columns: dict[str, Column] = {}
    late: dict[Path, str] = {}
    for name in dict.fromkeys(name for source in sources for name in source.columns):
        holding = [(source, spans.get(name)) for source, spans in parts if name in source.columns]
        widths = sorted({source.columns[name].values.shape[1:] for source, _ in holding})
        if len(widths) > 1:
            lengths = ArrayLengthsDiffer(tuple(width[0] if width else 1 for width in widths))
            findings.append(Finding(lengths, name, "note"))
            continue
        columns[name] = holding[0][0].columns[name]
        for (_, before), (source, span) in pairwise(holding):
            if before and span and span[0] < before[1]:
                late.setdefault(source.path, name)
    findings += [Finding(PartsOverlap(path.name, name)) for path, name in late.items()]
    first, names = sources[0], tuple(columns)
    details, topics = joined_details(sources), joined_topics(sources)
    return Source(folder, first.format, columns, first.origin, tuple(findings), details, names=names, topics=topics)


class ChannelSpan(NamedTuple):
    """A channel's first and last time in a part, and its median step [s]; the unit of its values."""

    first: float
    last: float
    step: float
    unit: str


@dataclass(frozen=True)
class PartSpan:
    """What the channels of a part span, in times counted from `origin` [s]."""

    path: str
    origin: float
    channels: Mapping[str, ChannelSpan]

    @classmethod
    def of(cls, part: Recording) -> PartSpan:
        """Return that of a part which is in memory."""
        spans = {}
        for name, series in part.channels.items():
            time = series.time
            step = float(np.median(np.diff(time))) if len(time) > 1 else np.inf
            spans[name] = ChannelSpan(float(time[0]), float(time[-1]), step, series.unit)
        return cls(part.source, part.origin, spans)


def check_parts(parts: Sequence[PartSpan]) -> None:
    """Raise RecordingError where a part has no such channel, or begins before the one before it ends.

    Ground truth may be in some of them only, such as the events of a stroke.
    """
    first = parts[0]
    for name in dict.fromkeys(name for part in parts for name in part.channels):
        end, unit = -np.inf, None
        for part in parts:
            if name not in part.channels and name in GROUND_TRUTH:
                continue
            span = part.channels.get(name)
            if span is None or unit not in (None, span.unit):
                raise RecordingError(
                    f"{part.path}: channel '{name}' is not logged as in {first.path}",
                    "parts of one log are alike",
                    channel=name,
                )
            start = span.first + (part.origin - first.origin)
            if start <= end:
                raise RecordingError(
                    f"{part.path}: overlaps the part before it ({name}: starts at {start:g} s, before {end:g} s)",
                    "parts of one log share one clock and follow one another",
                )
            end, unit = span.last + (part.origin - first.origin), span.unit


def gaps_between(parts: Sequence[PartSpan]) -> Iterator[Finding]:
    """Yield one finding for each part that begins later than its channels' steps explain; `parts` follow one another.

    Between them nothing was logged: a recorder that was stopped, or a part that nobody names. Ground truth may be in
    some parts only. Where not all channels pause, the finding names those that do.
    """
    for before, after in pairwise(parts):
        channels = [name for name in before.channels if name in after.channels and name not in GROUND_TRUTH]
        gaps = {}
        for name in channels:
            gap = after.channels[name].first + (after.origin - before.origin) - before.channels[name].last
            if gap > GAP_PERIODS * before.channels[name].step:
                gaps[name] = gap
        if gaps:
            paused = () if len(gaps) == len(channels) else tuple(gaps)
            yield Finding(PartGap(min(gaps.values()), paused), file=Path(after.path).name)


def joined_recordings(parts: Sequence[Recording], name: str) -> Recording:
    """Return parts of one log, as logged, as one recording; raises RecordingError as check_parts does."""
    parts = sorted(parts, key=lambda part: part.origin + part.start)
    spans = [PartSpan.of(part) for part in parts]
    check_parts(spans)
    first = parts[0]
    joined: dict[str, Series] = {}
    for channel in dict.fromkeys(name for part in parts for name in part.channels):
        holding = [part for part in parts if channel in part]
        time = np.concatenate([part[channel].time + (part.origin - first.origin) for part in holding])
        values = np.concatenate([part[channel].values for part in holding])
        joined[channel] = Series(time, values, holding[0][channel].unit)
    findings = tuple(found for part in parts for found in of_part(Path(part.source), part.findings))
    findings += tuple(gaps_between(spans))
    source = ", ".join(part.source for part in parts)
    digest = joined_digest([part.digest for part in parts])
    return Recording(name, source, first.joints, joined, first.origin, findings, digest)


def of_part(path: Path, findings: Sequence[Finding]) -> Iterator[Finding]:
    """The findings of a part, with its name."""
    return (replace(found, file=path.name) for found in findings)


def joined_details(parts: Sequence[Source]) -> dict[str, str]:
    """Return what the parts of a log state about themselves."""
    if len(parts) == 1:
        return dict(parts[0].details)
    said: dict[str, list[str]] = {}
    for part in parts:
        for key, text in part.details.items():
            said.setdefault(key, []).append(text)
    joined = {"parts": f"{len(parts)}, {parts[0].path.name} to {parts[-1].path.name}"}
    return joined | {key: " or ".join(dict.fromkeys(texts)) for key, texts in said.items()}


def joined_topics(parts: Sequence[Source]) -> dict[str, TopicDetails]:
    """Return what the parts of a log state about each topic."""
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
    """Lines `- bag_0.mcap`, until one that is not an item."""
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
