"""What is in a log: channels, units, rates, gaps and all findings; and why a clock is missing or doubtful."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.clock.stamps import COARSE_SHARE, missing_findings
from cdtool.columns import Column
from cdtool.distribution import Distribution
from cdtool.findings import Fact, Finding, worst_first
from cdtool.findings.clocks import BackwardClock, CoarseStamps, EmptyClock, NoClock, StandingClock
from cdtool.findings.truth import InProgress
from cdtool.formats.source import Source, TopicDetails
from cdtool.ingest.clock_guess import Reread, TableClock, is_clock_name
from cdtool.ingest.log_figures import ClockFigures, ColumnFigures
from cdtool.machine_file import MachineFile, read_machine_file
from cdtool.recording import Recording, Series
from cdtool.workflows.contacts.scoring_rules import ScoringRules
from cdtool.workflows.contacts.true_contacts import any_contacts
from cdtool.workflows.log_checks.log_findings import log_findings
from cdtool.workflows.log_checks.motion_check import bandwidth_findings

if TYPE_CHECKING:
    from cdtool.ingest.log_figures import LogFigures


@dataclass(frozen=True)
class ChannelInfo:
    """One channel or column: how many samples, how fast, from where to where."""

    name: str
    unit: str
    samples: int
    missing: int
    rate_hz: float | None
    start_s: float | None
    duration_s: float | None
    minimum: float | None
    maximum: float | None


@dataclass(frozen=True)
class Info:
    """A log: without a machine file its columns as they stand, with one its channels on the load side.

    `dialect` is how a table of text is written, as `[csv]` of a machine file; empty for other formats.
    """

    source: str
    format: str
    details: Mapping[str, str]
    channels: tuple[ChannelInfo, ...]
    findings: tuple[Finding, ...]
    dialect: str = ""


def info(log: str | Path, *, machine: str | Path | MachineFile | None = None) -> Info:
    """Survey a log, piece by piece; with a machine file map it instead, cut it and check the accelerometer.

    Then the mapped channels are held in memory. Raises RecordingError.
    """
    if machine is None:
        return _survey(Path(log))
    return _mapped(Path(log), machine if isinstance(machine, MachineFile) else read_machine_file(machine))


def _survey(log: Path) -> Info:
    from cdtool.formats.csv import TableSource
    from cdtool.ingest.clock_guess import find_clock
    from cdtool.ingest.log_figures import LogFigures
    from cdtool.ingest.part_pieces import in_time_order, log_pieces

    figures = LogFigures(partial(log_pieces, log), in_time_order(log))
    source = figures.source
    clock = find_clock(source, figures.columns, figures.values_of)
    channels = [_described(column, figures, clock.figures if clock else None) for column in source.columns.values()]
    findings = [*source.findings, *(clock.findings if clock else ())]
    findings += _clock_doubts(source, figures.columns, figures.clocks, figures.values_of, clock)
    for channel in channels:
        findings += missing_findings(channel.missing, channel.samples, channel.name)
    dialect = source.dialect if isinstance(source, TableSource) else ""
    details = _details(source.details, source.topics)
    return Info(str(log), source.format, details, tuple(channels), worst_first(findings), dialect)


def _described(column: Column, figures: LogFigures, table_clock: ClockFigures | None) -> ChannelInfo:
    """A column by its figures; those of a table are on the table's clock."""
    known, samples = figures.columns[column.name], figures.rows(column.name)
    clock = table_clock if column.time is None else figures.clocks[figures.clock_of[column.name]]
    timed = clock is not None and clock.rows > 0
    return ChannelInfo(
        name=column.name,
        unit=column.unit or "",
        samples=samples,
        missing=samples * math.prod(column.values.shape[1:]) - known.present,
        rate_hz=clock.rate if clock else None,
        start_s=clock.first if clock and timed else None,
        duration_s=clock.last - clock.first if clock and timed else None,
        minimum=known.minimum if known.present else None,
        maximum=known.maximum if known.present else None,
    )


def _mapped(log: Path, machine_file: MachineFile) -> Info:
    from cdtool.formats.csv import TableSource
    from cdtool.ingest.logged import read_logged
    from cdtool.ingest.parts import joined_details, joined_topics

    read = read_logged(log, machine_file)
    files, low_pass = read.files, read.speed_low_pass
    recording: Recording = machine_file.machine.referred_to_load(read.recording, low_pass)
    del read
    channels = [
        _channel(_label(name, recording, j), series, j)
        for name, series in recording.channels.items()
        for j in range(series.joint_count)
    ]
    rules = ScoringRules()
    contacts = any_contacts(recording, rules)
    findings = [*log_findings(recording, contacts, rules.onset), *bandwidth_findings(recording, machine_file)]
    findings += [Finding(InProgress(item.end), "force") for item in contacts if item.in_progress]
    dialect = files[0].dialect if isinstance(files[0], TableSource) else ""
    found = worst_first(findings)
    details = _details(joined_details(files), joined_topics(files))
    return Info(str(log), files[0].format, details, tuple(channels), found, dialect)


def _details(details: Mapping[str, str], topics: Mapping[str, TopicDetails]) -> dict[str, str]:
    """What a log says of itself and of its topics, in words."""
    return {**details, **{name: str(topic) for name, topic in topics.items()}}


def _label(name: str, recording: Recording, joint: int) -> str:
    many = recording[name].joint_count > 1
    return f"{name} [{recording.joints[joint]}]" if many else name


def _channel(name: str, series: Series, joint: int) -> ChannelInfo:
    values, time = series.values[:, joint], series.time
    present = values[np.isfinite(values)]
    return ChannelInfo(
        name=name,
        unit=series.unit,
        samples=len(values),
        missing=len(values) - len(present),
        rate_hz=1.0 / series.period if len(time) > 1 else None,
        start_s=float(time[0]) if len(time) else None,
        duration_s=float(time[-1] - time[0]) if len(time) else None,
        minimum=float(present.min()) if len(present) else None,
        maximum=float(present.max()) if len(present) else None,
    )


def _clock_doubts(
    source: Source,
    figures: Mapping[str, ColumnFigures],
    clocks: Mapping[str, ClockFigures],
    reread: Reread,
    clock: TableClock | None,
) -> list[Finding]:
    """Of a table the columns that are named as clocks and are none, and that there is no clock; of topics coarse ones.

    `figures` are those of the columns, `clocks` those of the topics' own clocks.
    """
    tables = [column for column in source.columns.values() if column.time is None and column.values.ndim == 1]
    found = list(_named_ones(tables, figures, reread, clock))
    if tables and clock is None:
        found.append(Finding(NoClock()))
    for name, known in clocks.items():
        doubt = _doubt(known.steps, named=False) if name and known.rows > 2 else None
        if doubt:
            found.append(Finding(doubt, f"{name} time"))
    return found


def _named_ones(
    tables: list[Column], figures: Mapping[str, ColumnFigures], reread: Reread, clock: TableClock | None
) -> Iterator[Finding]:
    for column in tables:
        if not is_clock_name(column.name) or (clock is not None and column.name == clock.column):
            continue
        steps, last = Distribution(), np.empty(0)
        for piece in reread(column.name):
            known = np.concatenate((last, piece[np.isfinite(piece)]))
            steps.add(np.diff(known))
            last = known[-1:]
        forward = figures[column.name]
        if doubt := _doubt(steps, named=True):
            yield Finding(doubt, column.name)
        elif forward.present == 0:
            yield Finding(EmptyClock(), column.name)
        elif clock is None and forward.forward < forward.steps:
            yield Finding(BackwardClock(forward.steps - forward.forward), column.name)


def _doubt(steps: Distribution, *, named: bool) -> Fact | None:
    """What is odd about the steps of a clock, or of a column that is `named` as one."""
    repeated = steps.share(0.0, 0.0) if steps.count else 0.0
    if repeated >= 1.0:
        return StandingClock(steps.count + 1, named)
    return CoarseStamps(repeated, named) if repeated > COARSE_SHARE else None
