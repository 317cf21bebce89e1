"""The content of a log: channels, units, rates, gaps and findings, and why a clock is missing or doubtful.

Find placeholders of `cdtool init` that are still in a machine file.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdtool.base.errors import ConfigurationError, RecordingError
from cdtool.base.files.bounded_loading import read_text
from cdtool.base.findings import Finding, worst_first
from cdtool.base.plain_text import counted
from cdtool.base.remote.remote_path import location
from cdtool.commands.judging.log_findings import before_contact, log_findings
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.commands.judging.true_contacts import any_contacts
from cdtool.formats.channels.channel_map import AXES, ChannelSource
from cdtool.formats.channels.clock_guess import ReadColumn, TableClock, is_clock_name
from cdtool.formats.channels.log_statistics import ClockStatistics, ColumnStatistics
from cdtool.formats.columns import Column
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.formats.source import Source, in_words
from cdtool.machines.plausibility import check_channels
from cdtool.recordings.clock.stamps import COARSE_SHARE, missing_findings
from cdtool.recordings.distribution import Distribution
from cdtool.recordings.recording import Recording, Series
from cdtool.recordings.units import RAW_UNITS, find_unit
from cdtool.truth.force_vector import with_scalar_force

if TYPE_CHECKING:
    from cdtool.formats.channels.log_statistics import LogStatistics
    from cdtool.truth.synchronisation.channel_delay import ChannelDelay


_KEY = re.compile(r"^\s*([A-Za-z_]\w*)\s*=")
_MARK = re.compile(r"#.*\bCHECK\b")


def placeholder_findings(recording: Recording, machine_file: MachineFile) -> list[Finding]:
    """Return a warning for each placeholder that is still in a machine file, and for the marks of `cdtool init`.

    Parameters
    ----------
    recording : Recording
        A log on the load side: the load's speed shows what a placeholder does.
    machine_file : MachineFile
        The machine file with which it was read.

    Returns
    -------
    list of Finding
        Empty for a machine file without placeholders. A rotary axis may have the ratio 1.
    """
    machine = machine_file.machine
    found = []
    of_motor = getattr(machine, "ratio_unit", "") == "m/rad" and getattr(machine, "coordinates", "") == "motor"
    if of_motor and any(ratio == 1.0 for ratio in getattr(machine, "transmission_ratio", ())):
        found.append(Finding("placeholder_ratio", "", {"speed": _top_speed(recording)}))
    maps = machine_file.topics if machine_file.topics.sources else machine_file.columns
    found += [
        Finding("placeholder_scale", channel, {"raw": raw, "unit": unit, "per": per})
        for channel, (raw, unit, per) in _scales(maps.sources)
    ]
    key = getattr(machine, "inertia_key", "")
    load = getattr(machine, "load_inertia", (1.0,))
    if key and not any(load) and not any(getattr(machine, "motor_inertia", (1.0,))):
        found.append(Finding("placeholder_inertia", "", {"key": key}))
    count, keys = _marked_keys(machine_file)
    return [*found, Finding("unchecked_lines", "", {"count": count, "keys": keys})] if count else found


def _top_speed(recording: Recording) -> float:
    speed = np.abs(recording["speed"].values) if "speed" in recording else np.empty(0)
    known = speed[np.isfinite(speed)]
    return float(known.max()) if len(known) else math.nan


def _scales(sources: tuple[ChannelSource, ...]) -> Iterator[tuple[str, tuple[str, str, str]]]:
    """Yield the channels in a raw unit with the scale 1, and the units of both and of the scale."""
    for source in sources:
        known = find_unit(source.stated) if source.stated else None
        if known is None or known.si not in RAW_UNITS or source.duty is not None or source.unit in RAW_UNITS:
            continue
        if all(factor == known.factor for factor in source.factor):
            yield source.channel, (source.stated, source.unit, known.si)


def _marked_keys(machine_file: MachineFile) -> tuple[int, tuple[str, ...]]:
    """Return how many keys have a comment with the mark CHECK, after the key or before it, and which."""
    try:
        lines = read_text(machine_file.path, ConfigurationError).splitlines()
    except ConfigurationError:  # a machine file that was read and is gone since, as that of a trial draft
        return 0, ()
    keys, marked = [], False
    for line in lines:
        if line.lstrip().startswith("#"):
            marked = marked or bool(_MARK.search(line))
            continue
        key = _KEY.match(line)
        if key and (marked or _MARK.search(line)):
            keys.append(key[1])
        marked = False
    return len(keys), tuple(dict.fromkeys(keys))


@dataclass(frozen=True)
class ChannelInfo:
    """One channel or column: number of samples, rate and range."""

    name: str
    unit: str
    samples: int
    missing: int
    rate_hz: float | None
    start_s: float | None
    duration_s: float | None
    minimum: float | None
    maximum: float | None


@dataclass(frozen=True, repr=False)
class Info:
    """A log: its columns as they are in the file, or with a machine file its channels on the load side.

    `dialect` is the format of a text table, as `[csv]` of a machine file; empty for other formats. `latencies` are
    those of the sync audit, with a machine file; `origin` [s] is added to a log's times to obtain its own clock.
    """

    source: str
    format: str
    details: Mapping[str, str]
    channels: tuple[ChannelInfo, ...]
    findings: tuple[Finding, ...]
    dialect: str = ""
    latencies: tuple[ChannelDelay, ...] = ()
    origin: float = 0.0

    def __repr__(self) -> str:
        return f"Info({self.source!r}, {self.format}, {counted(len(self.channels), 'channel')})"


def info(log: str | Path, *, machine: str | Path | MachineFile | None = None) -> Info:
    """Survey a log: channels, units, sample rates, gaps and findings.

    Parameters
    ----------
    log : str or Path
        The log, or a folder with its parts.
    machine : str, Path or MachineFile, optional
        With a machine file the mapped channels are surveyed on the load side, cut into operations, and checked against
        each other, also how late they are; they are held in memory. Without one, the columns as logged, piece by piece.

    Returns
    -------
    Info
        One entry per channel or column, and the findings, the most severe first.

    Raises
    ------
    RecordingError
        The log cannot be read.
    ConfigurationError
        The machine file is wrong.

    Examples
    --------
    >>> import cdtool
    >>> survey = cdtool.info("sample_logs/gate/stiff/03.csv")
    >>> survey.format, survey.channels[0].name, survey.channels[0].samples
    ('csv', 't', 7200)
    """
    if machine is None:
        return _survey(location(log))
    return _mapped(location(log), machine if isinstance(machine, MachineFile) else read_machine_file(machine))


def _survey(log: Path) -> Info:
    from cdtool.formats.channels.clock_guess import find_clock
    from cdtool.formats.channels.log_statistics import LogStatistics
    from cdtool.formats.channels.reading import log_pieces, needs_time_order

    statistics = LogStatistics(partial(log_pieces, log), needs_time_order(log))
    source = statistics.source
    clock = find_clock(source, statistics.columns, statistics.values_of)
    channels = [
        _described(column, statistics, clock.statistics if clock else None) for column in source.columns.values()
    ]
    findings = [*source.findings, *(clock.findings if clock else ())]
    findings += _clock_doubts(source, statistics.columns, statistics.clocks, statistics.values_of, clock)
    for channel in channels:
        findings += missing_findings(channel.missing, channel.samples, channel.name)
    details = in_words(source.details, source.topics)
    return Info(str(log), source.format, details, tuple(channels), worst_first(findings), source.dialect)


def _described(column: Column, statistics: LogStatistics, table_clock: ClockStatistics | None) -> ChannelInfo:
    """Return a column with its statistics; the columns of a table share the table's clock."""
    known, samples = statistics.columns[column.name], statistics.rows(column.name)
    clock = table_clock if column.time is None else statistics.clocks[statistics.clock_of[column.name]]
    timed = clock is not None and clock.rows > 0
    rate = clock.rate if clock else None
    if column.time is None and known.is_of_lower_rate:  # its empty cells are no samples
        rate = None if rate is None else rate * known.present / samples
        samples = known.present
    return ChannelInfo(
        name=column.name,
        unit=column.unit or "",
        samples=samples,
        missing=samples * math.prod(column.values.shape[1:]) - known.present,
        rate_hz=rate,
        start_s=clock.first if clock and timed else None,
        duration_s=clock.last - clock.first if clock and timed else None,
        minimum=known.minimum if known.present else None,
        maximum=known.maximum if known.present else None,
    )


def _mapped(log: Path, machine_file: MachineFile) -> Info:
    from cdtool.commands.judging.synchronisation import delay_findings
    from cdtool.formats.channels.reading import read_as_logged
    from cdtool.truth.synchronisation.audit import audit

    logged = read_as_logged(log, machine_file, unread="loss")
    recording = logged.on_load_side(machine_file.machine)
    logged = replace(logged, recording=recording)  # the one as logged need not be held any longer
    channels = [
        _channel(_label(name, recording, j), series, j)
        for name, series in recording.channels.items()
        for j in range(series.joint_count)
    ]
    rules = ScoringRules()
    recording = with_scalar_force(recording, rules.onset)
    contacts = any_contacts(recording, rules)
    findings = list(log_findings(recording, contacts, rules.onset))
    findings += [Finding("in_progress", "force", {"end": item.end}) for item in contacts if item.in_progress]
    findings += check_channels([before_contact(recording, contacts)], machine_file.machine)
    findings += placeholder_findings(recording, machine_file)
    findings += _steady_header(log, machine_file, findings)
    delays = audit(recording, machine_file.machine, contacts)
    findings += delay_findings(delays)
    found = worst_first(findings)
    header, origin = logged.header, recording.origin
    details = in_words(header.details, header.topics)
    return Info(str(log), header.format, details, tuple(channels), found, header.dialect, delays, origin)


def _steady_header(log: Path, machine_file: MachineFile, findings: Sequence[Finding]) -> list[Finding]:
    """Return the advice to use the stamps in the headers of messages, if these are regular and the log's are not."""
    from cdtool.formats.channels.reading import read_recording

    jittery = [item.channel for item in findings if item.kind == "jitter" and item.channel != "time"]
    time = machine_file.topics.time
    if not jittery or time.clock == "header":
        return []
    topics = replace(machine_file.topics, time=replace(time, clock="header"))
    try:
        found = read_recording(log, replace(machine_file, topics=topics)).findings
    except RecordingError:  # messages without a header, or with one that is never set
        return []
    is_steady = not any(
        item.kind
        in (
            "jitter",
            "coarse_clock",
            "repeated_stamps",
            "unknown_stamps",
            "stray_stamps",
            "stuck_stamps",
            "backward_stamps",
        )
        for item in found
    )
    return [Finding("steady_header", ", ".join(jittery))] if is_steady else []


def common_delays(surveys: Sequence[Info]) -> list[Finding]:
    """Return how late channels are over several logs that were recorded with the same clocks.

    Parameters
    ----------
    surveys : sequence of Info
        The logs, surveyed with a machine file.

    Returns
    -------
    list of Finding
        One per pair of channels that at least two of the logs show.
    """
    if not any(survey.latencies for survey in surveys):
        return []
    from cdtool.commands.judging.synchronisation import delay_findings, pooled_delays

    logs, origins = [survey.latencies for survey in surveys], [survey.origin for survey in surveys]
    return delay_findings(pooled_delays(logs, origins))


def _label(name: str, recording: Recording, joint: int) -> str:
    many = recording[name].joint_count > 1
    columns = AXES if name == "force" else recording.joints
    return f"{name} [{columns[joint]}]" if many else name


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
    statistics: Mapping[str, ColumnStatistics],
    clocks: Mapping[str, ClockStatistics],
    read_column: ReadColumn,
    clock: TableClock | None,
) -> list[Finding]:
    """Return doubts about clocks: unusable clock columns of a table, a missing clock, and coarse clocks of topics.

    `statistics` are those of the columns, `clocks` those of the topics' own clocks.
    """
    tables = [column for column in source.columns.values() if column.time is None and column.values.ndim == 1]
    found = list(_named_ones(tables, statistics, read_column, clock))
    if tables and clock is None:
        found.append(Finding("no_clock"))
    for name, known in clocks.items():
        if name and known.rows > 2 and (doubt := _doubt(known.steps, f"{name} time", named=False)):
            found.append(doubt)
    return found


def _named_ones(
    tables: list[Column], statistics: Mapping[str, ColumnStatistics], read_column: ReadColumn, clock: TableClock | None
) -> Iterator[Finding]:
    for column in tables:
        if not is_clock_name(column.name) or (clock is not None and column.name == clock.column):
            continue
        steps, last = Distribution(), np.empty(0)
        for piece in read_column(column.name):
            known = np.concatenate((last, piece[np.isfinite(piece)]))
            steps.add(np.diff(known))
            last = known[-1:]
        forward = statistics[column.name]
        if doubt := _doubt(steps, column.name, named=True):
            yield doubt
        elif forward.present == 0:
            yield Finding("empty_clock", column.name)
        elif clock is None and forward.forward < forward.steps:
            yield Finding("backward_clock", column.name, {"steps": forward.steps - forward.forward})


def _doubt(steps: Distribution, name: str, *, named: bool) -> Finding | None:
    """Return the problem with the steps of a clock, or None; `named`: a column with the name of a clock."""
    repeated = steps.share(0.0, 0.0) if steps.count else 0.0
    if repeated >= 1.0:
        return Finding("standing_clock", name, {"stamps": steps.count + 1, "named": named})
    return Finding("coarse_stamps", name, {"share": repeated, "named": named}) if repeated > COARSE_SHARE else None
