"""Read a log that contains several runs: cut its columns into runs before their clocks are checked.

Each run becomes a recording of its own, named FILE#ID, with its own clock. In a table a run is some consecutive rows.
Where columns have clocks of their own, the id that was logged last at or before a sample holds for it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, RecordingError, naming
from cdtool.base.findings import Finding
from cdtool.base.log_names import log_stem
from cdtool.base.plain_text import counted, first_of
from cdtool.base.remote.remote_path import location
from cdtool.formats.channels.channel_assembly import LoggedRecording, assemble_recording
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource
from cdtool.formats.channels.reading import log_digest, mapped_source
from cdtool.formats.channels.run_segments import Rows, Segments, segments_by_id, segments_by_reset
from cdtool.formats.columns import Column
from cdtool.formats.machine_file import MachineFile
from cdtool.formats.source import Source
from cdtool.machines.dynamics import Machine
from cdtool.recordings.operations import RunCut
from cdtool.recordings.recording import GROUND_TRUTH

# A run with fewer samples than this is left out: too few for a clock's usual step.
FEWEST_SAMPLES = 8
_ID = "run id"
_MARK = "#"


@dataclass(frozen=True)
class LogRuns:
    """The runs of a log in its order; `findings` are about the log, `left_out` are runs with the reason."""

    runs: tuple[LoggedRecording, ...]
    findings: tuple[Finding, ...] = ()
    left_out: tuple[tuple[Path, str], ...] = ()


def split_run(log: Path) -> tuple[Path, str]:
    """Return the file of LOG#ID, and the id.

    Parameters
    ----------
    log : Path
        A log, or LOG#ID. A file whose name contains the mark is a log.

    Returns
    -------
    file : Path
        The log.
    ids : str
        The id of a run, or a pattern such as `free*`; empty for a whole log.

    Examples
    --------
    >>> file, ids = split_run(Path("cycles.csv#7*"))
    >>> file.name, ids
    ('cycles.csv', '7*')
    """
    text = str(log)
    if _MARK not in text or log.exists():
        return log, ""
    places = [i for i, character in enumerate(text) if character == _MARK]
    place = next((i for i in places if location(text[:i]).exists()), places[-1])
    return location(text[:place]), text[place + 1 :]


def read_runs(log: Path, machine_file: MachineFile, cut: RunCut) -> LogRuns:
    """Return the runs of a log, or of LOG#ID only those with this id, which may be a pattern.

    Parameters
    ----------
    log : Path
        A file, or a folder of parts written by rosbag2.
    machine_file : MachineFile
        The machine and its map of channels.
    cut : RunCut
        How the log is cut.

    Returns
    -------
    LogRuns
        The recordings as logged, each with the log's path and its id as `source`.

    Raises
    ------
    RecordingError
        The log cannot be read or has no such column, or no run of it can be used.
    ConfigurationError
        The machine file does not fit the log.
    """
    path, pattern = split_run(log)
    if machine_file.files_beside(path):
        raise ConfigurationError(
            f"{machine_file.path}: a channel in a file of its own cannot be divided into the runs of {path}",
            "write each run to a log of its own, or map a channel of the log",
        )
    by_reset = cut.by == "clock-reset"
    source, channels = mapped_source(path, machine_file if by_reset else _with_ids(machine_file, cut.column))
    with naming(path):
        whole = _by_reset(source, channels, cut) if by_reset else _by_id(source, channels, cut)
        return whole.runs(pattern, machine_file.machine, log_digest(path))


def _fits(name: str, pattern: str) -> bool:
    return not pattern or name == pattern or fnmatchcase(name, pattern)


def _too_short(segments: Segments, short: Rows, lengths: Rows) -> str:
    names = first_of(segments.names(short[:4])) if len(short) <= 4 else ", ".join(segments.names(short[:3])) + ", ..."
    samples = int(lengths[short].sum())
    what = "is" if len(short) == 1 else "are"
    return (
        f"{counted(len(short), 'run')} ({names}) with {counted(samples, 'sample')} in all {what} shorter than "
        f"{FEWEST_SAMPLES} samples: left out"
    )


def _with_ids(machine_file: MachineFile, column: str) -> MachineFile:
    """Return the machine file with the ids of a cut as a further source, of topics only if it names a field of one."""
    number = int(column) if column.isdecimal() else column  # as in [channels]
    topic, _, field_name = column.partition(" ")
    columns, topics = machine_file.columns, machine_file.topics
    if columns.sources:
        columns = replace(columns, sources=(*columns.sources, ChannelSource(_ID, (number,), words=True)))
    if topics.sources and field_name.strip():
        by_topic = ChannelSource(_ID, topic=topic, field=field_name.strip(), words=True)
        topics = replace(topics, sources=(*topics.sources, by_topic))
    return replace(machine_file, columns=columns, topics=topics)


@dataclass(frozen=True)
class _CutLog:
    """The columns of a log, and where its runs are.

    `rows` are the rows of each run in the order of the file, by clock; a clock is known by its identity, that of a
    table by 0. `begins` (r,) is when the runs begin [s], where ids have a clock of their own.
    """

    source: Source
    channels: ChannelMap
    cut: RunCut
    segments: Segments
    rows: Mapping[int, Sequence[Rows]]
    begins: FloatArray | None = None

    def runs(self, pattern: str, machine: Machine, digest: str) -> LogRuns:
        """Return the runs whose ids fit a pattern; raises RecordingError if none can be used."""
        path, segments = self.source.path, self.segments
        counts = [list(map(len, rows)) for rows in self.rows.values()]  # a run is as long as its longest channel
        lengths = np.max(counts, axis=0) if counts else np.zeros(0, dtype=np.intp)
        long_enough = np.flatnonzero(lengths >= FEWEST_SAMPLES)
        if not len(long_enough):
            raise self.no_run(int(lengths.max(initial=0)))
        names = segments.names(long_enough)
        chosen = [(int(run), name) for run, name in zip(long_enough, names, strict=True) if _fits(name, pattern)]
        if not chosen:
            raise RecordingError(f"no run '{pattern}'", f"its runs are {first_of(names)}")
        runs: list[LoggedRecording] = []
        left_out: list[tuple[Path, str]] = []
        for run, name in chosen:
            try:
                runs.append(self.recording(run, name, machine, digest))
            except RecordingError as fault:
                left_out.append((location(f"{path}{_MARK}{name}"), str(fault)))
        if not runs:
            raise RecordingError(f"{left_out[0][0]}: {left_out[0][1]}", "check the log with cdtool info")
        findings = [*self.source.findings, *self.outside()]
        later = tuple(name for (run, name) in chosen if segments.number[run])
        if later and self.cut.by == "column":
            findings.append(Finding("returning_ids", "", {"names": later, "column": self.cut.column}))
        short = np.flatnonzero(lengths < FEWEST_SAMPLES)
        if pattern:
            fits = [_fits(name, pattern) for name in segments.names(short)]
            short = short[np.array(fits, dtype=bool)]
        if len(short):
            left_out.append((path, _too_short(segments, short, lengths)))
        return LogRuns(tuple(runs), tuple(findings), tuple(left_out))

    def recording(self, run: int, name: str, machine: Machine, digest: str) -> LoggedRecording:
        """Return a run as logged; raises RecordingError if a channel has no sample in it."""
        source, channels, first_row = self.source, self.channels, self.source.first_row
        rows = {clock: of_clock[run] for clock, of_clock in self.rows.items()}
        clocks = {clock: time[rows[clock]] for clock, time in _clocks(source, channels).items() if clock in rows}
        first = self._first(run, clocks)
        times = {clock: time - first for clock, time in clocks.items()}
        columns = {
            key: replace(column, values=column.values[rows[clock]], time=times[clock] if clock else None)
            for key, column in source.columns.items()
            if (clock := _clock_of(column)) in rows  # of a channel
        }
        if 0 in times:
            columns[channels.time.key] = replace(columns[channels.time.key], values=times[0])
        if 0 in rows and first_row:
            first_row += int(self.segments.start[run])
        channels, absent = self._present(columns)
        path, origin = location(f"{source.path}{_MARK}{name}"), source.origin + first * channels.time.factor
        part = replace(source, path=path, columns=columns, origin=origin, first_row=first_row, findings=tuple(absent))
        mark = hashlib.sha256(f"{digest}{_MARK}{name}".encode()).hexdigest()
        return assemble_recording(part, channels, machine, mark, f"{log_stem(source.path)}{_MARK}{name}")

    def _first(self, run: int, clocks: Mapping[int, FloatArray]) -> float:
        """Return the time stamp, in its unit, from which the clocks of a run count; 0 if they count as in the log.

        A message's time, and one that counts from an epoch, is what it is in a file with this run alone.
        """
        if not self.source.origin and not any(item.topic for item in self.channels.sources):
            return 0.0
        if self.begins is not None:
            return float(self.begins[run])
        return min((float(known[0]) for time in clocks.values() if len(known := time[np.isfinite(time)])), default=0.0)

    def _present(self, columns: Mapping[str, Column]) -> tuple[ChannelMap, list[Finding]]:
        """Return the map without ground truth that has no sample in a run, each with a note."""
        absent = [
            item
            for item in self.channels.sources
            if item.channel in GROUND_TRUTH and not all(len(columns[key].values) for key in item.keys)
        ]
        notes = [
            Finding("absent_truth", item.channel, {"what": "column", "name": item.described, "similar": ""})
            for item in absent
        ]
        sources = tuple(item for item in self.channels.sources if item not in absent)
        return replace(self.channels, sources=sources), notes

    def outside(self) -> Iterator[Finding]:
        """Yield a warning for each clock with samples that are in no run."""
        if self.cut.by == "clock-reset":
            return
        columns = self.source.columns
        channels = {_clock_of(columns[item.keys[0]]): item.channel for item in reversed(self.channels.sources)}
        totals = {_clock_of(column): len(column.values) for column in columns.values()}
        for clock, rows in self.rows.items():
            if outside := totals[clock] - sum(map(len, rows)):
                fact = {"count": outside, "total": totals[clock], "column": self.cut.column}
                yield Finding("samples_outside_runs", channels[clock] if clock else "", fact)

    def no_run(self, longest: int) -> RecordingError:
        """Return the error for a log without a run that can be used."""
        if not len(self.segments):
            return RecordingError(
                f"column '{self.cut.column}' has no value in any sample", "name the column of the runs"
            )
        return RecordingError(
            f"none of {counted(len(self.segments), 'run')} by {_described(self.cut)} has "
            f"{FEWEST_SAMPLES} samples: the longest has {longest}",
            "see cdtool info" if self.cut.by == "clock-reset" else "name a column whose value stays the same in a run",
        )


def _by_id(source: Source, channels: ChannelMap, cut: RunCut) -> _CutLog:
    """Cut a log by the column of ids, which is in the map beside the channels; raises RecordingError."""
    if _ID not in channels:
        raise RecordingError(
            f"operations '{cut.by}:{cut.column}': does not name a field of a topic", f"write {cut.by}:TOPIC FIELD"
        )
    key = next(item.keys[0] for item in channels.sources if item.channel == _ID)
    channels = replace(channels, sources=tuple(item for item in channels.sources if item.channel != _ID))
    ids = source.columns[key]
    if ids.words and any(key in other.keys for other in channels.sources):
        raise RecordingError(f"column '{cut.column}' has texts", "map another column to the channel")
    values = ids.values.reshape(len(ids.values), -1)
    if values.shape[1] != 1:
        raise RecordingError(
            f"column '{cut.column}' (channel '{_ID}') has {values.shape[1]} values per sample",
            "select one element, e.g. data[0]",
        )
    time, id_values = ids.time, values[:, 0]
    if time is not None and np.any(time[1:] < time[:-1]):
        order = np.argsort(time, kind="stable")
        time, id_values = time[order], id_values[order]
    segments = segments_by_id(id_values, ids.words, cut.by == "column")
    if time is None:
        return _CutLog(source, channels, cut, segments, {0: _consecutive(segments)})
    begins, ends = time[segments.start], np.append(time, np.inf)[segments.stop]
    rows = {clock: _between(stamps, begins, ends) for clock, stamps in _clocks(source, channels).items()}
    return _CutLog(source, channels, cut, segments, rows, begins)


def _by_reset(source: Source, channels: ChannelMap, cut: RunCut) -> _CutLog:
    """Cut a log where its clocks start again; raises RecordingError."""
    if any(item.topic for item in channels.sources):
        raise RecordingError(
            "messages are in the order of their times: their clock cannot start again",
            'cut them by a field: by = "column:TOPIC FIELD"',
        )
    if not channels.topics and channels.time.column is None:
        raise RecordingError(
            "has no clock that could start again: [channels] time states a rate",
            'cut it by a column: by = "column:NAME"',
        )
    found = {clock: segments_by_reset(time) for clock, time in _clocks(source, channels).items()}
    counts = sorted({len(item) for item in found.values()})
    if len(counts) > 1:
        raise RecordingError(
            f"its clocks start again at different numbers of places: "
            f"{' and '.join(str(count - 1) for count in counts)}",
            'cut it by a column: by = "column:NAME"',
        )
    rows = {clock: _consecutive(segments) for clock, segments in found.items()}
    return _CutLog(source, channels, cut, next(iter(found.values())), rows)


def _clock_of(column: Column) -> int:
    return 0 if column.time is None else id(column.time)


def _clocks(source: Source, channels: ChannelMap) -> dict[int, FloatArray]:
    """Return the clocks of the channels; that of a table in its unit, none if [channels] time states a rate."""
    columns = (source.columns[key] for item in channels.sources for key in item.keys)
    clocks = {id(column.time): column.time for column in columns if column.time is not None}
    return {0: source.columns[channels.time.key].values} if not clocks and channels.time.key else clocks


def _consecutive(segments: Segments) -> list[Rows]:
    """Return the rows of runs of consecutive rows."""
    return [np.arange(start, stop) for start, stop in zip(segments.start, segments.stop, strict=True)]


def _between(time: FloatArray, begins: FloatArray, ends: FloatArray) -> list[Rows]:
    """Return the rows whose time [s] is at least the beginning of a run (r,) and below its end (r,)."""
    run = np.searchsorted(begins, time, side="right") - 1
    inside = (run >= 0) & (time < np.append(ends, -np.inf)[run])  # run -1 is the last one, which is -inf
    run[~inside] = len(begins)
    order = np.argsort(run, kind="stable")
    return np.split(order, np.searchsorted(run[order], np.arange(1, len(begins) + 1)))[: len(begins)]


def _described(cut: RunCut) -> str:
    return cut.by if cut.by == "clock-reset" else f"{cut.by} '{cut.column}'"
