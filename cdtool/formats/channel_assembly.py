"""A file's columns -> channels in SI: the same for every format.

Times are cleaned (clock.clean_time), values scaled, saturated and infinite ones masked; what was odd is told, all at
once. Nothing is resampled.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.channels import ChannelMap, ChannelSource
from cdtool.clock import CleanTime, clean_time, differentiate, epoch_start, gap_findings, previous_value
from cdtool.errors import ConfigurationError, RecordingError
from cdtool.formats.header_units import time_unit_findings, unit_findings
from cdtool.formats.source import Column, Source, find_key
from cdtool.recording import MEASURED, UNITLESS, BoolArray, Finding, FloatArray, Recording, Series


def assemble(source: Source, channels: ChannelMap, machine: Any) -> Recording:
    """A file's recording, referred to the load side; raises RecordingError or ConfigurationError."""
    recording: Recording = machine.referred_to_load(as_logged(source, channels, machine), channels.speed_low_pass)
    return recording


def as_logged(source: Source, channels: ChannelMap, machine: Any) -> Recording:
    """The channels in SI as the machine logs them, not yet referred to the load side."""
    work = _Assembly(source, channels)
    series = {item.channel: work.series(item) for item in channels.sources}
    for item in channels.sources:
        if item.duty is not None:
            if "N m" not in machine.accepted_units("torque"):
                raise ConfigurationError(
                    f"{source.path}: torque of kind 'duty' is a motor's, the machine file says coordinates = 'load'",
                    "describe the machine in motor coordinates",
                )
            series[item.channel] = _torque_from_duty(source.path, item, series, channels.speed_low_pass)
    return Recording(
        name=source.path.stem,
        source=str(source.path),
        joints=channels.joints,
        channels=series,
        origin=work.origin,
        findings=(*source.findings, *work.findings, *_stuck(series), *_apart(series)),
        digest=file_digest(source.path),
    )


def file_digest(path: Path) -> str:
    """SHA-256 of a file's bytes."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


class _Assembly:
    """The series of one file, with the findings made on the way."""

    def __init__(self, source: Source, channels: ChannelMap) -> None:
        self.source = source
        self.channels = channels
        self.origin = source.origin
        self.findings: list[Finding] = []
        self.gaps: set[str] = set()  # what was said of the table's clock is not repeated for each channel
        self.table: CleanTime | None = None
        if not channels.topics:
            self.table = self._table_clock()
            self.findings += unit_findings(source, channels)

    def series(self, item: ChannelSource) -> Series:
        """One channel: its values in SI at its own times."""
        if self.table is None:
            column = self.source.columns[find_key(self.source.path, item.channel, item.described, self._names())]
            stamps = column.time if column.time is not None else np.empty(0)
            clock = self._clean(stamps, f"{item.channel} time", sampled=item.channel != "event")
            values = column.values
        else:
            clock = self.table
            values = np.column_stack([self._column(item.channel, column).values for column in item.columns])
        if not len(clock.time):
            raise RecordingError(f"{self.source.path}: channel '{item.channel}' has no sample with a time")
        series = Series(clock.time, self._scaled(item, self._kept(item, values, clock.keep)), item.unit)
        self.findings += [found for found in gap_findings(series, item.channel) if found.message not in self.gaps]
        return Series(series.time + item.time_offset, series.values, item.unit) if item.time_offset else series

    def _table_clock(self) -> CleanTime:
        time = self.channels.time
        if time.column is None:
            rows = {len(column.values) for column in self.source.columns.values()}
            return clean_time(np.arange(max(rows, default=0)) / (time.rate or 1.0))
        column = self._column("time", time.column)
        self.findings += time_unit_findings(time, column)
        start = epoch_start(column.values, time.factor)
        if start:
            self.origin = start * time.factor
        clock = self._clean((column.values - start) * time.factor, "time", counted=column.values)
        if not len(clock.time):
            raise RecordingError(
                f"{self.source.path}: column '{column.name}' holds no time stamp", "see [channels] time"
            )
        told_gaps = gap_findings(Series(clock.time, np.zeros(len(clock.time)), "s"), "time")
        self.gaps = {found.message for found in told_gaps}
        self.findings += told_gaps
        return clock

    def _clean(
        self, stamps: FloatArray, clock: str, *, counted: FloatArray | None = None, sampled: bool = True
    ) -> CleanTime:
        """The times of a clock's stamps [s]; what is odd about them is told under its name."""
        first = self.source.first_row
        row_name = "line" if first else "sample"
        try:
            clean = clean_time(stamps, first, row_name, counted=counted, sampled=sampled)
        except RecordingError as fault:
            raise RecordingError(f"{self.source.path}: {clock}: {fault.message}", fault.hint) from fault
        self.findings += [replace(found, channel=clock) for found in clean.findings]
        return clean

    def _names(self) -> tuple[str, ...]:
        return self.source.names or tuple(self.source.columns)

    def _column(self, channel: str, column: str | int) -> Column:
        return self.source.columns[find_key(self.source.path, channel, column, self._names())]

    def _kept(self, item: ChannelSource, values: FloatArray, keep: BoolArray) -> FloatArray:
        table = values.reshape(len(values), -1)
        if len(table) != len(keep):
            raise RecordingError(
                f"{self.source.path}: channel '{item.channel}' ({item.described}) has {len(table)} values, "
                f"its clock {len(keep)}",
                "columns of one recording are equally long",
            )
        if table.shape[1] != len(item.factor):
            raise RecordingError(
                f"{self.source.path}: channel '{item.channel}' ({item.described}) gives {table.shape[1]} values "
                f"a sample for {len(item.factor)} joints",
                "name one element a joint, in the order of machine.joints",
            )
        return np.array(table[keep], dtype=np.float64)

    def _scaled(self, item: ChannelSource, values: FloatArray) -> FloatArray:
        infinite = np.isinf(values)
        if infinite.any():
            values[infinite] = np.nan
            self._found(item, f"{np.count_nonzero(infinite)} values are infinite: masked")
        if item.valid_range is not None:
            low, high = item.valid_range
            saturated = (values <= low) | (values >= high)
            if saturated.any():
                values[saturated] = np.nan
                self._found(item, f"{np.count_nonzero(saturated)} values are at the sensor's limit: masked")
        scaled: FloatArray = values * np.array(item.factor)
        return scaled

    def _found(self, item: ChannelSource, text: str) -> None:
        self.findings.append(Finding(text, item.channel))


def _torque_from_duty(path: Path, item: ChannelSource, series: dict[str, Series], low_pass: float) -> Series:
    """tau = k_t (u - k_e omega) / R (thesis 6.2.2), omega being the motor's speed at or before each sample."""
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


def _stuck(series: dict[str, Series]) -> list[Finding]:
    """A measured channel that never changes while its joint moves."""
    found = []
    for name in MEASURED:
        if name not in series:
            continue
        for joint in range(series[name].joint_count):
            others = [series[other] for other in ("speed", "position") if other in series and other != name]
            if _constant(series[name], joint) and any(not _constant(other, joint) for other in others):
                found.append(Finding("the value never changes while the machine moves: stuck?", name))
    return found


def _apart(series: dict[str, Series]) -> list[Finding]:
    """Channels on clocks of their own that have no time in common: between them nothing can be compared.

    What is logged at events only may lie beside the rest, by no more than the log is long.
    """
    spans = sorted((float(s.time[0]), float(s.time[-1]), name) for name, s in series.items())
    longest = max((end - start for start, end, _ in spans), default=0.0)
    found = []
    latest, before = (spans[0][1], spans[0][2]) if spans else (0.0, "")
    for start, end, name in spans[1:]:
        distance = start - latest
        if distance > (longest if {name, before} & set(UNITLESS) else 0.0):
            text = f"begins {distance:.6g} s after {before} ends: their clocks have no time in common"
            found.append(Finding(f"{text}; choose another clock in the machine file, or a time_offset", name))
        if end > latest:
            latest, before = end, name
    return found


def _constant(series: Series, joint: int) -> bool:
    values = series.values[:, joint]
    finite = values[np.isfinite(values)]
    return len(finite) > 1 and bool(np.all(finite == finite[0]))
