"""Merge findings of one kind about many logs or channels into one, with a count."""

from __future__ import annotations

import re
from collections.abc import Hashable, Sequence
from typing import NamedTuple

from cdtool.base.findings import Finding
from cdtool.base.plain_text import NAMED
from cdtool.results.results import RecordingFinding, Skipped

_NUMBERS = re.compile(r"[-+]?\d[\d.e+-]*")


class AlikeText(NamedTuple):
    """A text about a recording or channel `name`; entries of one `kind` are merged, and their subjects are listed."""

    name: str
    text: str
    kind: Hashable
    subject: str


class RecordingReason(NamedTuple):
    """A recording with a reason or a finding."""

    recording: str
    reason: str


def grouped(items: Sequence[AlikeText]) -> list[tuple[str, str]]:
    """Merge entries of one kind, with a count.

    Parameters
    ----------
    items : sequence of AlikeText
        Names with texts and their kinds.

    Returns
    -------
    list of (str, str)
        Names with texts, in order of occurrence; four or more entries of one kind become one.

    Examples
    --------
    >>> gaps = [Entry(name, f"{count} gaps", "gaps", name) for name, count in zip("abcd", (3, 1, 9, 2))]
    >>> grouped([*gaps, Entry("a", "stuck", "stuck", "a")])
    [('a', '3 gaps; 3 more like it (b, c, d)'), ('a', 'stuck')]
    """
    groups: dict[Hashable, list[AlikeText]] = {}
    for item in items:
        groups.setdefault(item.kind, []).append(item)
    found: list[tuple[str, str]] = []
    for first, *others in groups.values():
        if len(others) < NAMED:
            found += [(item.name, item.text) for item in (first, *others)]
            continue
        names = list(dict.fromkeys(item.subject for item in others if item.subject not in ("", first.subject)))
        listed = ", ".join(names[:NAMED]) + (", ..." if len(names) > NAMED else "")
        found.append((first.name, f"{first.text}; {len(others)} more like it{f' ({listed})' if listed else ''}"))
    return found


def grouped_findings(items: Sequence[Finding]) -> list[tuple[str, str]]:
    """Merge the findings of one log that are of one kind.

    Parameters
    ----------
    items : sequence of Finding
        The findings of a log.

    Returns
    -------
    list of (str, str)
        Channels with sentences, as `grouped` merges them.

    Examples
    --------
    >>> stuck = [Finding("stuck_channel", name, {"joint": ""}) for name in ("speed", "torque", "force", "position")]
    >>> grouped_findings(stuck)
    [('speed', 'the value never changes while the machine moves: stuck?; 3 more like it (torque, force, position)')]
    """
    return grouped(
        [
            AlikeText(item.channel, item.message, (item.kind, item.variant), item.channel or item.subject)
            for item in items
        ]
    )


def alike(items: Sequence[Skipped | RecordingFinding]) -> list[RecordingReason]:
    """Merge findings of one kind about one channel, and reasons that differ only in numbers.

    Parameters
    ----------
    items : sequence of Skipped or RecordingFinding
        Recordings with reasons or findings. Reasons come from errors, which have no kind.

    Returns
    -------
    list of Reason
        As `grouped` merges them.

    Examples
    --------
    >>> [item.reason for item in alike([Skipped(name, f"{n} gaps") for n, name in enumerate("abcd", 1)])]
    ['1 gaps; 3 more like it (b, c, d)']
    """
    return [RecordingReason(*item) for item in grouped([_entry(item) for item in items])]


def _entry(item: Skipped | RecordingFinding) -> AlikeText:
    kind: Hashable = _NUMBERS.sub("#", item.reason)
    if isinstance(item, RecordingFinding) and item.kind not in ("", "remark"):
        kind = item.kind, item.channel, item.severity
    return AlikeText(item.recording, item.reason, kind, item.recording)
