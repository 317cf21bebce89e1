"""A file's columns -> channels in SI, the same for every format.

Times are cleaned (clock.clean_time) and values are scaled. Saturated, infinite and physically impossible values are
masked. All warnings are reported together. Nothing is resampled.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import ConfigurationError, RecordingError
from cdtool.base.findings import Finding
from cdtool.base.log_names import log_stem
from cdtool.base.remote.remote_path import is_read_by_ranges, version_of
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource
from cdtool.formats.channels.header_units import clock_unit_findings, unit_findings
from cdtool.formats.columns import Column
from cdtool.formats.source import Source
from cdtool.machines.dynamics import Machine
from cdtool.recordings.clock import clean_time, differentiate, epoch_start, previous_value
from cdtool.recordings.clock.lower_rate import sampled_rows
from cdtool.recordings.clock.stamps import gaps_of, missing_findings
from cdtool.recordings.plausible import IMPOSSIBLE, PlausibleRanges
from cdtool.recordings.recording import MEASURED, RIG_UNITS, UNITLESS, Recording, Series, TableRows


@dataclass(frozen=True)
class LoggedRecording:
    """A log's channels as logged, in SI, not yet on the load side; `factors` converted the logged numbers to SI.

    `header` is the log without its rows: what it states.
    """

    recording: Recording
    factors: Mapping[str, tuple[float, ...]]
    speed_low_pass: float
    header: Source

    def on_load_side(
        self, machine: Machine, ranges: PlausibleRanges | None = None, *, to_learn: tuple[float, float] | None = None
    ) -> Recording:
        """Return the recording on the load side, without values outside the plausible ranges."""
        plausible = self.recording if ranges is None else ranges.masked(self.recording, self.factors, to_learn=to_learn)
        recording: Recording = machine.referred_to_load(plausible, self.speed_low_pass)
        return recording


def assemble_recording(
    source: Source, channels: ChannelMap, machine: Machine, digest: str, name: str = ""
) -> LoggedRecording:
    """Return the channels in SI as logged, not yet referred to the load side; the map's columns are resolved.

    Each column is removed from the source after its last use, to limit the memory in use. `digest` is that of the
    log's content; `name` is the recording's if it is not that of the file.
    """
    header = replace(source, columns={})
    columns = source.columns if isinstance(source.columns, dict) else dict(source.columns)
    findings: list[Finding] = []
    timed = channels.topics or any(column.time is not None for column in columns.values())
    table, origin = (None, source.origin) if timed else _table_clock(source, channels, findings)
    findings += unit_findings(source, channels)
    reported = (*source.findings, *findings)
    doubted = {item.channel for item in reported if item.kind == "unit_contradicted" and item.severity == "loss"}
    clocks: dict[tuple[int, bool], _Clock] = {}  # by the identity of the stamps
    series: dict[str, Series] = {}
    for number, item in enumerate(channels.sources):
        parts = [columns[key] for key in item.keys]
        if table is None:
            parts = [_on_one_clock(item, parts)]
        clock = table or _own_clock(item, parts[0], clocks, findings)
        made = _series(item, [part.values for part in parts], clock, channels.joints, findings)
        if item.channel not in doubted:
            series[item.channel] = made
        elif item.channel not in RIG_UNITS:  # present, so that nothing takes its place, but not assessable
            series[item.channel] = made.with_values(np.full(made.values.shape, np.nan), made.unit)
        needed = {key for later in channels.sources[number + 1 :] for key in later.keys}
        for key in {*item.keys} - needed:
            columns.pop(key, None)
        present = {id(column.time) for column in columns.values()}
        clocks = {key: clock for key, clock in clocks.items() if key[0] in present}
    columns.clear()
    for item in channels.sources:
        if item.duty is not None:
            if "N m" not in machine.accepted_units("torque"):
                raise ConfigurationError(
                    "torque of kind 'duty' is on the motor side, but the machine file states coordinates = 'load'",
                    "describe the machine in motor coordinates",
                )
            series[item.channel] = _torque_from_duty(item, series, channels.speed_low_pass)
    findings += [Finding("confirmed", item.channel) for item in channels.sources if item.confirmed]
    findings += [*_stuck_findings(series, channels.joints), *_disjoint_clock_findings(series)]
    recording = Recording(
        name=name or log_stem(source.path),
        source=str(source.path),
        joints=channels.joints,
        channels=series,
        origin=origin,
        findings=(*source.findings, *findings),
        digest=digest,
        rows=None if table is None else TableRows(table.times.time, None if table.keep.all() else table.keep),
        label_kinds=next((item.kinds for item in channels.sources if item.channel == "label"), ()),
    )
    factors = {item.channel: item.factor for item in channels.sources if item.duty is None}
    return LoggedRecording(recording, factors, channels.speed_low_pass, header)


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, as hexadecimal digits.

    Of a file at a URL that is read by ranges it is "etag:" and the digest of its ETag and size: its version.
    """
    if is_read_by_ranges(path):
        return version_of(path)
    with path.open("rb", buffering=0) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@dataclass(frozen=True)
class _Clock:
    """A clock that channels share: its times, which rows are kept, findings on its stamps, and those on its gaps."""

    times: Series
    keep: BoolArray
    findings: tuple[Finding, ...]
    gaps: tuple[Finding, ...]
    of_table: bool = False


def _clean(
    name: str, stamps: FloatArray, first_row: int = 0, *, counted: FloatArray | None = None, sampled: bool = True
) -> _Clock:
    """Return the clock of stamps [s]; an error names it."""
    try:
        clean = clean_time(stamps, first_row, counted=counted, sampled=sampled)
    except RecordingError as fault:
        raise RecordingError(f"{name}: {fault.message}", fault.hint) from fault
    times = Series(clean.time, np.zeros(len(clean.time)), "s")
    return _Clock(times, clean.keep, clean.findings, tuple(gaps_of(times.time, times.period, "time")))


def _on_one_clock(item: ChannelSource, parts: Sequence[Column]) -> Column:
    """Return the columns of a channel as one column; raises RecordingError if they have different clocks."""
    first = parts[0]
    other = next((part for part in parts if not _same(part.time, first.time)), None)
    if other is not None:
        raise RecordingError(
            f"'{first.name}' and '{other.name}' of channel '{item.channel}' have different clocks",
            "all joints of a channel, and all axes of a force, must have the same clock",
            channel=item.channel,
        )
    return first if len(parts) == 1 else Column(item.channel, np.column_stack([p.values for p in parts]), first.time)


def _same(time: FloatArray | None, other: FloatArray | None) -> bool:
    return time is other or (time is not None and other is not None and np.array_equal(time, other))


def _table_clock(source: Source, channels: ChannelMap, findings: list[Finding]) -> tuple[_Clock, float]:
    """Return the clock of a table and what it counts from [s]; the findings on it are added, once for all channels."""
    time, origin = channels.time, source.origin
    if time.column is None:
        rows = {len(column.values) for column in source.columns.values()}
        clock = _clean("time", np.arange(max(rows, default=0)) / (time.rate or 1.0))
    else:
        column = source.columns[time.key]
        findings += clock_unit_findings(time, column, origin)
        start = epoch_start(column.values, time.factor)
        origin += start * time.factor
        clock = _clean("time", (column.values - start) * time.factor, source.first_row, counted=column.values)
        if not len(clock.times):
            raise RecordingError(f"column '{column.name}' contains no time stamp", "see [channels] time")
        findings += [*clock.findings, *clock.gaps]
    return replace(clock, gaps=(), of_table=True), origin


def _own_clock(
    item: ChannelSource, column: Column, known: dict[tuple[int, bool], _Clock], findings: list[Finding]
) -> _Clock:
    """Return the clock of a channel's column, cleaned once for all its channels; add the findings on its stamps."""
    stamps = np.empty(0) if column.time is None else column.time
    name, sampled = f"{item.channel} time", item.channel != "event"
    clock = known.get((id(stamps), sampled))
    if clock is None:
        clock = known[id(stamps), sampled] = _clean(name, stamps, sampled=sampled)
    findings += [replace(finding, channel=name) for finding in clock.findings]
    return clock


def _series(
    item: ChannelSource, parts: Sequence[FloatArray], clock: _Clock, joints: Sequence[str], findings: list[Finding]
) -> Series:
    """Return one channel: its values in SI at its own times; `parts` are its columns. The findings on it are added."""
    if not len(clock.times):
        raise RecordingError(f"channel '{item.channel}' has no sample with a time", channel=item.channel)
    values = _kept_rows(item, parts, clock.keep)
    times, gaps = clock.times, clock.gaps
    # A channel of a lower rate has empty cells in the first rows of a table.
    if clock.of_table and item.channel not in UNITLESS and np.isnan(values[: 1 << 12]).any():
        rows = sampled_rows(values)
        if rows is not None:  # its rate is lower than that of the table
            values, times = values[rows], Series(times.time[rows], values[rows], item.unit)
            share = clock.times.period / times.period if times.period > 0.0 else np.nan
            findings.append(Finding("lower_rate", item.channel, {"rate": 1.0 / times.period, "share": share}))
            gaps = tuple(gaps_of(times.time, times.period, "time"))
    scaled, masked = convert_to_si(item, values)
    findings += _masked_findings(masked, item, joints)
    findings += [replace(finding, channel=item.channel) for finding in gaps]
    absent = scaled.size - int(np.count_nonzero(np.isfinite(scaled)))
    findings += missing_findings(absent, scaled.size, item.channel, sum(map(sum, masked.values())))
    series = times.with_values(component_along(item.direction, scaled) if item.direction else scaled, item.unit)
    return Series(series.time + item.time_offset, series.values, item.unit) if item.time_offset else series


def _kept_rows(item: ChannelSource, parts: Sequence[FloatArray], keep: BoolArray) -> FloatArray:
    """Return the kept rows (n, J) of a channel's columns; raises RecordingError if their shape does not fit."""
    count = next((len(part) for part in parts if len(part) != len(keep)), len(keep))
    if count != len(keep):
        raise RecordingError(
            f"channel '{item.channel}' ({item.described}) has {count} values, its clock {len(keep)}",
            "all columns of a recording have the same length",
            channel=item.channel,
        )
    table = parts[0].reshape(count, -1) if len(parts) == 1 else np.column_stack(parts)
    if table.shape[1] != len(item.factor):
        raise RecordingError(
            f"channel '{item.channel}' ({item.described}) has {table.shape[1]} values "
            f"per sample for {len(item.factor)} {'axes' if item.axes else 'joints'}",
            f"name one element per {'axis' if item.axes else 'joint, in the order of machine.joints'}",
            channel=item.channel,
        )
    return table if keep.all() else table[keep]


def _masked_findings(masked: Mapping[str, list[int]], item: ChannelSource, joints: Sequence[str]) -> list[Finding]:
    """Return the findings on masked values by joint, or by axis of a force; `masked`: as of convert_to_si."""
    parts = [(f"{item.channel} {axis}", "") for axis in item.axes]
    parts = parts or [(item.channel, joint if len(item.factor) > 1 else "") for joint in joints]
    return [
        Finding(kind, channel, {"count": count, "joint": joint})
        for kind, counts in masked.items()
        for (channel, joint), count in zip(parts, counts, strict=False)
        if count
    ]


def component_along(direction: Sequence[float], values: FloatArray) -> FloatArray:
    """Return the component (n, 1) of vectors (n, axes) along a unit vector; NaN where an axis that it needs is NaN."""
    used = np.flatnonzero(direction)
    along: FloatArray = values[:, used] @ np.array(direction)[used]
    return along[:, np.newaxis]


def convert_to_si(item: ChannelSource, values: FloatArray) -> tuple[FloatArray, dict[str, list[int]]]:
    """Return the values (n, J) of a channel in its SI unit, with masked ones as NaN, and the counts of masked ones.

    The counts are by kind of finding, for each joint; none if no value is masked.
    """
    low, high = item.valid_range or (np.nan, np.nan)
    with np.errstate(over="ignore", invalid="ignore"):  # of values that are masked
        scaled = np.multiply(values, item.factor, order="C")
    infinite = np.isinf(values)
    saturated = ((values <= low) | (values >= high)) & ~infinite
    impossible = (values < item.least) | (values > item.most)
    if item.channel not in UNITLESS:
        impossible |= np.abs(scaled) >= IMPOSSIBLE
    impossible &= ~(infinite | saturated)
    masked = infinite | saturated | impossible
    if not masked.any():  # the usual case
        return scaled, {}
    scaled[masked] = np.nan
    masks = {"infinite_values": infinite, "saturated_values": saturated, "impossible_values": impossible}
    return scaled, {kind: np.count_nonzero(mask, axis=0).tolist() for kind, mask in masks.items()}


def _torque_from_duty(item: ChannelSource, series: dict[str, Series], low_pass: float) -> Series:
    """Return tau = k_t (u - k_e omega) / R (thesis 6.2.2); omega is the last motor speed at or before each sample."""
    duty, logged = item.duty, series[item.channel]
    assert duty is not None
    if "speed" in series and series["speed"].unit == "rad/s":
        speed = series["speed"]
    elif "position" in series and series["position"].unit == "rad" and "speed" not in series:
        speed = differentiate(series["position"], low_pass, "rad/s")
    else:
        raise ConfigurationError(
            "torque of kind 'duty' needs the motor's speed [rad/s] or angle [rad]",
            "map speed or position of the motor in [channels]",
        )
    voltage = logged.values * (duty.supply_voltage if logged.unit == "1" else 1.0)
    omega = previous_value(speed, logged.time)
    torque = duty.torque_constant * (voltage - duty.back_emf_constant * omega) / duty.resistance
    return Series(logged.time, torque, "N m")


def _stuck_findings(series: Mapping[str, Series], joints: Sequence[str]) -> list[Finding]:
    """Return a finding for each measured channel that is constant while its joint moves."""
    constant = {name: _is_constant(series[name]) for name in MEASURED if name in series}
    return [
        Finding("stuck_channel", name, {"joint": joints[joint] if len(by_joint) > 1 else ""})
        for name, by_joint in constant.items()
        for joint, is_constant in enumerate(by_joint)
        if is_constant
        and not all(constant[other][joint] for other in ("speed", "position") if other in constant and other != name)
    ]


def _disjoint_clock_findings(series: Mapping[str, Series]) -> list[Finding]:
    """Return a finding for each channel whose times [s] do not overlap with those of the others.

    Such channels cannot be compared. Channels that are logged only at events may be outside the time span of the
    others, by at most the length of the log.
    """
    spans = sorted((float(each.time[0]), float(each.time[-1]), name) for name, each in series.items())
    longest = max((end - start for start, end, _ in spans), default=0.0)
    findings = []
    latest, before = (spans[0][1], spans[0][2]) if spans else (0.0, "")
    for start, end, name in spans[1:]:
        distance = start - latest
        if distance > (longest if {name, before} & set(UNITLESS) else 0.0):
            findings.append(Finding("clocks_apart", name, {"distance": distance, "before": before}))
        if end > latest:
            latest, before = end, name
    return findings


def _is_constant(series: Series) -> list[bool]:
    """Return, joint by joint, whether the value never changes."""
    known = np.isfinite(series.values)
    lowest = np.where(known, series.values, np.inf).min(axis=0, initial=np.inf)
    highest = np.where(known, series.values, -np.inf).max(axis=0, initial=-np.inf)
    found: list[bool] = ((lowest == highest) & (known.sum(axis=0) > 1)).tolist()
    return found
