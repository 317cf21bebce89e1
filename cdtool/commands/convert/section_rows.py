"""The rows of a section of a log, as `cdtool convert` writes them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from cdtool.base.errors import RecordingError, UsageError
from cdtool.base.findings import Finding
from cdtool.base.plain_text import digits
from cdtool.commands.judging.runs import read
from cdtool.formats.groups import Group, Part, Parts
from cdtool.formats.machine_file import MachineFile
from cdtool.recordings.log_section import LogSection


class Rows(Protocol):
    """The groups of a log and their rows; `parts` can be called repeatedly."""

    @property
    def groups(self) -> Sequence[Group]:
        """The groups, without their rows."""
        ...

    @property
    def origin(self) -> float:
        """The origin of the times [s]."""
        ...

    @property
    def findings(self) -> Sequence[Finding]:
        """What was found while reading."""
        ...

    def parts(self, groups: Sequence[Group]) -> Parts:
        """Yield the rows of these groups."""
        ...


class SectionRows:
    """The groups of a log that have rows in a section, and these rows; they keep their times.

    A distance travelled is determined from the log's channels, so that it needs a machine file. Raises UsageError for a
    distance without one and for columns without a clock, RecordingError if no row is in the section.
    """

    def __init__(self, log: Path, rows: Rows, section: LogSection, machine_file: MachineFile | None) -> None:
        if untimed := [group for group in rows.groups if not group.timed]:
            name = untimed[0].columns[0].name
            raise UsageError(f"{log}: no clock is known for {name}, so that it cannot be cut {section}", "pass -m")
        self._rows, self._begin, self._end = rows, *_times(log, section, machine_file)
        self.origin, self.findings = rows.origin, rows.findings
        counts, starts = [0] * len(rows.groups), [np.inf] * len(rows.groups)
        for ready in self.parts(rows.groups):
            for i, part in enumerate(ready):
                if part is not None and part.time is not None:
                    counts[i] += len(part)
                    starts[i] = min(starts[i], float(part.time.min()))
        numbered = zip(rows.groups, counts, starts, strict=True)
        self.groups = [replace(group, rows=count, start=start) for group, count, start in numbered if count]
        if not self.groups:
            start = min(group.start for group in rows.groups)
            raise RecordingError(
                f"{log}: no sample {section}: the log starts at {digits(start)} s", "change from and to"
            )

    def parts(self, groups: Sequence[Group]) -> Iterator[list[Part | None]]:
        """Yield the rows of these groups that are in the section, part by part."""
        whole = {group.name: group for group in self._rows.groups}
        for ready in self._rows.parts([whole[group.name] for group in groups]):
            yield [None if part is None else self._inside(part) for part in ready]

    def _inside(self, part: Part) -> Part | None:
        assert part.time is not None, "groups without a clock are refused"
        inside = (part.time >= self._begin) & (part.time <= self._end)
        if inside.all():
            return part
        return Part(part.time[inside], tuple(item[inside] for item in part.values)) if inside.any() else None


def _times(log: Path, section: LogSection, machine_file: MachineFile | None) -> tuple[float, float]:
    by_distance = [mark for mark in (section.begin, section.end) if mark and mark.unit != "s"]
    if by_distance and machine_file is None:
        raise UsageError(f"{by_distance[0]} needs the log's position", "pass a machine file with -m, or give a time")
    if machine_file is not None and by_distance:
        return section.times(read(log, machine_file))
    begin, end = section.begin, section.end
    return -np.inf if begin is None else begin.value, np.inf if end is None else end.value
