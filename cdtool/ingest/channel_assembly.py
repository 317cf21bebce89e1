"""A file's columns -> channels in SI, the same for every format.

Times are cleaned (clock.clean_time) and values are scaled. Saturated, infinite and physically impossible values are
masked. All warnings are reported together. Nothing is resampled.
"""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cdtool.channels import ChannelMap, ChannelSource
from cdtool.clock import CleanTime, clean_time, differentiate, epoch_start, previous_value
from cdtool.clock.lower_rate import sampled_rows
from cdtool.clock.stamps import gaps_of, missing_findings
from cdtool.dynamics import Machine
from cdtool.errors import ConfigurationError, RecordingError
from cdtool.findings import Finding
from cdtool.formats.source import Source
from cdtool.ingest.header_units import check_clock_unit, guessed_units, time_unit_findings, unit_findings
from cdtool.kernels import READ_ONLY, kernel
from cdtool.log_names import log_stem
from cdtool.plausible import IMPOSSIBLE
from cdtool.recording import MEASURED, RIG_UNITS, UNITLESS, BoolArray, FloatArray, Recording, Series, TableRows
from cdtool.remote.remote_path import RemotePath

_TABLE = "Array(float64, 2, 'C', readonly=True)"
# A file of at most this many bytes is read at once for its digest.
_READ_AT_ONCE = 1 << 20
# A channel of a lower rate has empty cells in these first rows of a table.
_FIRST_ROWS = 1 << 12
Counts = npt.NDArray[np.int64]
# The kinds of masked values, in the order of convert_to_si.
_MASKED = ("infinite_values", "saturated_values", "impossible_values")


def assemble_recording(source: Source, channels: ChannelMap, machine: Machine, digest: str = "") -> Recording:
    """Return the channels in SI as logged, not yet referred to the load side; the map's columns are resolved.

    Each column is removed from the source after its last use, to limit the memory in use. `digest` is that of the
    content if the source is not a whole file.
    """
    work = _Assembly(source, channels)
    series = {}
    findings = (*source.findings, *work.findings)
    doubted = {item.channel for item in findings if item.kind == "unit_contradicted" and item.severity == "loss"}
    for number, item in enumerate(channels.sources):
        made = work.series(item)
        if item.channel not in doubted:
            series[item.channel] = made
        elif item.channel not in RIG_UNITS:  # present, so that nothing takes its place, but not assessable
            series[item.channel] = made.with_values(np.full(made.values.shape, np.nan), made.unit)
        work.drop_columns(item, channels.sources[number + 1 :])
    work.columns.clear()
    for item in channels.sources:
        if item.duty is not None:
            if "N m" not in machine.accepted_units("torque"):
                raise ConfigurationError(
                    f"{source.path}: torque of kind 'duty' is on the motor side, but the machine file states "
                    "coordinates = 'load'",
                    "describe the machine in motor coordinates",
                )
            series[item.channel] = _torque_from_duty(source.path, item, series, channels.speed_low_pass)
    return Recording(
        name=log_stem(source.path),
        source=str(source.path),
        joints=channels.joints,
        channels=series,
        origin=work.origin,
        findings=(
            *source.findings,
            *work.findings,
            *(Finding("confirmed", item.channel) for item in channels.sources if item.confirmed),
            *stuck_findings({name: _is_constant(series[name]) for name in MEASURED if name in series}, channels.joints),
            *disjoint_clock_findings(
                {name: (float(item.time[0]), float(item.time[-1])) for name, item in series.items()}
            ),
        ),
        digest=digest or file_digest(source.path),
        rows=work.rows,
        label_kinds=next((item.kinds for item in channels.sources if item.channel == "label"), ()),
    )


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, as hexadecimal digits.

    Of a file at a URL that is read by ranges it is "etag:" and the digest of its ETag and size: its version.
    """
    if isinstance(path, RemotePath) and path.is_read_by_ranges():
        return path.digest()
    with path.open("rb", buffering=0) as file:
        if os.fstat(file.fileno()).st_size <= _READ_AT_ONCE:
            return hashlib.sha256(file.readall()).hexdigest()
        return hashlib.file_digest(file, "sha256").hexdigest()


@dataclass(frozen=True)
class _TopicClock:
    """The clock that the channels of a topic share: its `stamps`, cleaned times, and findings on gaps between these."""

    stamps: FloatArray
    clean: CleanTime
    times: Series
    gaps: tuple[Finding, ...]


class _Assembly:
    """Assembles the series of one file, and collects the findings."""

    def __init__(self, source: Source, channels: ChannelMap) -> None:
        self.source = source
        self.channels = channels
        self.columns = source.columns if isinstance(source.columns, dict) else dict(source.columns)
        self.origin = source.origin
        self.findings: list[Finding] = []
        self.table: CleanTime | None = None
        self.clock: Series | None = None  # the table's times, which its channels share
        self._topic_clocks: dict[tuple[int, bool], _TopicClock] = {}  # by the identity of the stamps
        if not channels.topics:
            self.table = self._table_clock()
            self.findings += unit_findings(source, channels)
        self.findings += guessed_units(channels, {found.channel for found in self.findings})

    @property
    def rows(self) -> TableRows | None:
        """Return the rows of the table on its clock; None for channels with clocks of their own."""
        if self.table is None or self.clock is None:
            return None
        return TableRows(self.clock.time, None if self.table.keep.all() else self.table.keep)

    def drop_columns(self, item: ChannelSource, later: Sequence[ChannelSource]) -> None:
        """Remove the columns of a channel that no later channel needs."""
        needed = {key for other in later for key in other.keys}
        for key in item.keys:
            if key not in needed:
                self.columns.pop(key, None)
        present = {id(column.time) for column in self.columns.values()}
        self._topic_clocks = {key: clock for key, clock in self._topic_clocks.items() if key[0] in present}

    def series(self, item: ChannelSource) -> Series:
        """Return one channel: its values in SI at its own times."""
        if self.table is None:
            column = self.columns[item.keys[0]]
            stamps = column.time if column.time is not None else np.empty(0)
            topic = self._topic_clock(stamps, item)
            clean, clock, gaps, values = topic.clean, topic.times, topic.gaps, column.values
        else:
            assert self.clock is not None
            clean, clock, gaps = self.table, self.clock, ()  # the gaps of its times are reported once
            parts = [self.columns[key].values for key in item.keys]
            values = parts[0] if len(parts) == 1 else np.column_stack(parts)
            self._require_samples(clean, item)
        kept = self._select(item, values, clean.keep)
        if self.table is not None and item.channel not in UNITLESS and np.isnan(kept[:_FIRST_ROWS]).any():
            kept, clock, gaps = self._at_lower_rate(kept, clock, item.channel)
        scaled, masked = convert_to_si(item, kept)
        self.findings += masked_findings(masked, item, self.channels.joints)
        self.findings += [replace(finding, channel=item.channel) for finding in gaps]
        absent = scaled.size - int(np.count_nonzero(np.isfinite(scaled)))
        self.findings += missing_findings(absent, scaled.size, item.channel, int(masked.sum()))
        series = clock.with_values(component_along(item.direction, scaled) if item.direction else scaled, item.unit)
        return Series(series.time + item.time_offset, series.values, item.unit) if item.time_offset else series

    def _at_lower_rate(
        self, values: FloatArray, clock: Series, channel: str
    ) -> tuple[FloatArray, Series, tuple[Finding, ...]]:
        """Return a channel's rows (n, J) in a table, its times, and its gaps; fewer rows if its rate is lower."""
        rows = sampled_rows(values)
        if rows is None:
            return values, clock, ()
        time = clock.time[rows]
        own = Series(time, np.zeros(len(time)), "s")
        share = clock.period / own.period if own.period > 0.0 else np.nan
        self.findings.append(Finding("lower_rate", channel, {"rate": 1.0 / own.period, "share": share}))
        return values[rows], own, tuple(gaps_of(own.time, own.period, "time"))

    def _topic_clock(self, stamps: FloatArray, item: ChannelSource) -> _TopicClock:
        """Return a channel's clock, cleaned once for all channels of its topic, and add the findings on its stamps."""
        name, sampled = f"{item.channel} time", item.channel != "event"
        known = self._topic_clocks.get((id(stamps), sampled))
        if known is not None:
            self._add_clock_findings(known.clean, name)
            return known
        clean = self._clean(stamps, name, sampled=sampled)
        self._require_samples(clean, item)
        times = Series(clean.time, np.zeros(len(clean.time)), "s")
        known = _TopicClock(stamps, clean, times, tuple(gaps_of(times.time, times.period, "time")))
        self._topic_clocks[id(stamps), sampled] = known
        return known

    def _require_samples(self, clean: CleanTime, item: ChannelSource) -> None:
        if not len(clean.time):
            raise RecordingError(
                f"{self.source.path}: channel '{item.channel}' has no sample with a time", channel=item.channel
            )

    def _table_clock(self) -> CleanTime:
        time = self.channels.time
        if time.column is None:
            rows = {len(column.values) for column in self.columns.values()}
            clock = clean_time(np.arange(max(rows, default=0)) / (time.rate or 1.0))
            self.clock = Series(clock.time, np.zeros(len(clock.time)), "s")
            return clock
        column = self.columns[time.key]
        self.findings += check_clock_unit(self.source.path, time, column, self.origin)
        self.findings += time_unit_findings(time, column, self.origin)
        start = epoch_start(column.values, time.factor)
        if start:
            self.origin += start * time.factor
        clock = self._clean((column.values - start) * time.factor, "time", counted=column.values)
        if not len(clock.time):
            raise RecordingError(
                f"{self.source.path}: column '{column.name}' contains no time stamp", "see [channels] time"
            )
        self.clock = Series(clock.time, np.zeros(len(clock.time)), "s")
        self.findings += gaps_of(self.clock.time, self.clock.period, "time")
        return clock

    def _clean(
        self, stamps: FloatArray, clock: str, *, counted: FloatArray | None = None, sampled: bool = True
    ) -> CleanTime:
        """Return the cleaned times of a clock's stamps [s]; its findings have `clock` as their channel."""
        first = self.source.first_row
        row_name = "line" if first else "sample"
        try:
            clean = clean_time(stamps, first, row_name, counted=counted, sampled=sampled)
        except RecordingError as fault:
            raise RecordingError(f"{self.source.path}: {clock}: {fault.message}", fault.hint) from fault
        self._add_clock_findings(clean, clock)
        return clean

    def _add_clock_findings(self, clean: CleanTime, clock: str) -> None:
        self.findings += [replace(finding, channel=clock) for finding in clean.findings]

    def _select(self, item: ChannelSource, values: FloatArray, keep: BoolArray) -> FloatArray:
        """Return the kept rows (n, J) of a channel's values; raises RecordingError if their shape does not fit."""
        table = values.reshape(len(values), -1)
        if len(table) != len(keep):
            raise RecordingError(
                f"{self.source.path}: channel '{item.channel}' ({item.described}) has {len(table)} values, "
                f"its clock {len(keep)}",
                "all columns of a recording have the same length",
                channel=item.channel,
            )
        check_width(self.source.path, item, table.shape[1])
        return table if keep.all() else table[keep]


def check_width(path: Path, item: ChannelSource, width: int) -> None:
    """Raise RecordingError if the samples of a channel do not have one value per joint."""
    if width != len(item.factor):
        raise RecordingError(
            f"{path}: channel '{item.channel}' ({item.described}) has {width} values "
            f"per sample for {len(item.factor)} {'axes' if item.axes else 'joints'}",
            "name one element per axis" if item.axes else "name one element per joint, in the order of machine.joints",
            channel=item.channel,
        )


def masked_findings(masked: Counts, item: ChannelSource, joints: Sequence[str]) -> list[Finding]:
    """Return the findings on masked values by joint, or by axis of a force; `masked` (3, J): as of convert_to_si."""
    if item.axes:
        return [
            Finding(kind, f"{item.channel} {item.axes[j]}", {"count": count, "joint": ""})
            for kind, counts in zip(_MASKED, masked.tolist(), strict=True)
            for j, count in enumerate(counts)
            if count
        ]
    return [
        Finding(kind, item.channel, {"count": count, "joint": joint_name(joints, j, len(counts))})
        for kind, counts in zip(_MASKED, masked.tolist(), strict=True)
        for j, count in enumerate(counts)
        if count
    ]


def component_along(direction: Sequence[float], values: FloatArray) -> FloatArray:
    """Return the component (n, 1) of vectors (n, axes) along a unit vector; NaN where an axis that it needs is NaN."""
    used = np.flatnonzero(direction)
    along: FloatArray = values[:, used] @ np.array(direction)[used]
    return along[:, np.newaxis]


def joint_name(joints: Sequence[str], joint: int, count: int) -> str:
    """Return the name of a joint if the channel has several joints, else an empty string."""
    return joints[joint] if count > 1 else ""


def convert_to_si(item: ChannelSource, values: FloatArray) -> tuple[FloatArray, Counts]:
    """Return the values (n, J) of a channel in its SI unit, with masked ones as NaN, and the counts of masked ones.

    The counts are (3, J): infinite, saturated, and physically impossible values.
    """
    low, high = item.valid_range or (np.nan, np.nan)
    impossible = np.nan if item.channel in UNITLESS else IMPOSSIBLE
    limits = np.array([low, high, item.least, item.most, impossible])
    table, masked = as_table(values), np.zeros((3, values.shape[1]), dtype=np.int64)
    scaled = np.empty(table.shape)
    convert_and_mask(table, np.array(item.factor, dtype=np.float64), limits, scaled, masked)
    return scaled, masked


def _torque_from_duty(path: Path, item: ChannelSource, series: dict[str, Series], low_pass: float) -> Series:
    """Return tau = k_t (u - k_e omega) / R (thesis 6.2.2); omega is the last motor speed at or before each sample."""
    duty, logged = item.duty, series[item.channel]
    assert duty is not None
    if "speed" in series and series["speed"].unit == "rad/s":
        speed = series["speed"]
    elif "position" in series and series["position"].unit == "rad" and "speed" not in series:
        speed = differentiate(series["position"], low_pass, "rad/s")
    else:
        raise ConfigurationError(
            f"{path}: torque of kind 'duty' needs the motor's speed [rad/s] or angle [rad]",
            "map speed or position of the motor in [channels]",
        )
    voltage = logged.values * (duty.supply_voltage if logged.unit == "1" else 1.0)
    omega = previous_value(speed, logged.time)
    torque = duty.torque_constant * (voltage - duty.back_emf_constant * omega) / duty.resistance
    return Series(logged.time, torque, "N m")


def stuck_findings(constant: Mapping[str, Sequence[bool]], joints: Sequence[str]) -> list[Finding]:
    """Return a finding for each measured channel that is constant while its joint moves.

    `constant` states, channel by channel and joint by joint, whether the value never changes.
    """
    findings = []
    for name in (item for item in MEASURED if item in constant):
        others = [constant[other] for other in ("speed", "position") if other in constant and other != name]
        for joint, is_constant in enumerate(constant[name]):
            if is_constant and not all(other[joint] for other in others):
                findings.append(
                    Finding("stuck_channel", name, {"joint": joint_name(joints, joint, len(constant[name]))})
                )
    return findings


def disjoint_clock_findings(first_and_last: Mapping[str, tuple[float, float]]) -> list[Finding]:
    """Return a finding for each channel whose times [s] do not overlap with those of the others.

    Such channels cannot be compared. Channels that are logged only at events may be outside the time span of the
    others, by at most the length of the log.
    """
    spans = sorted((first, last, name) for name, (first, last) in first_and_last.items())
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


@kernel(f"void({_TABLE}, {READ_ONLY}, {READ_ONLY}, float64[:, ::1], int64[:, ::1])")
def convert_and_mask(
    values: FloatArray, factor: FloatArray, limits: FloatArray, scaled: FloatArray, masked: FloatArray
) -> None:
    """Fill `scaled` (n, J) with values times `factor` (J,), NaN where masked; count the masked ones in `masked` (3, J).

    Masked are infinite values, saturated ones (up to the first limit, from the second), and impossible ones: below the
    third limit, above the fourth, or from the fifth when scaled. No value exceeds a limit that is NaN.
    """
    low, high, least, most, impossible = limits[0], limits[1], limits[2], limits[3], limits[4]
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            value = values[i, j]
            scaled[i, j] = value * factor[j]
            if math.isinf(value):
                kind = 0
            elif value <= low or value >= high:
                kind = 1
            elif value < least or value > most or abs(scaled[i, j]) >= impossible:
                kind = 2
            else:
                continue
            masked[kind, j] += 1
            scaled[i, j] = math.nan


def as_table(values: FloatArray) -> FloatArray:
    """Return values (n, J) as these kernels read them: as float64, row by row."""
    return np.ascontiguousarray(values, dtype=np.float64)
