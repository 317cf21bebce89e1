"""`cdtool init`: a look at a log becomes a draft of a machine file, with every guess marked."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from cdtool.errors import CdtoolError, RecordingError, UsageError
from cdtool.formats.element_names import element_names
from cdtool.formats.reading import choose_format, has_topics, log_parts
from cdtool.formats.source import Source
from cdtool.machine_file import read_machine_file
from cdtool.recording import CHANNELS, Finding
from cdtool.units import find_unit
from cdtool.workflows.clock_guess import GuessedClock, guess_clock
from cdtool.workflows.draft_guess import guess_channels
from cdtool.workflows.draft_streams import Channels, streams_of
from cdtool.workflows.draft_text import Clock, Draft, draft_text
from cdtool.workflows.draft_units import side_of
from cdtool.workflows.information import info
from cdtool.workflows.written_file import written_file

_CHANNEL = re.compile(r"channels\.(?:mcap\.)?(\w+)|channel '(\w+)'")
# What accelerometer_check says of a sensor that is mounted the other way round.
_TURNED = "opposite sign"


@dataclass(frozen=True)
class Drafted:
    """The draft's text, the channels that it maps, those that stand in it as comments, and what is odd."""

    path: str
    text: str
    channels: tuple[str, ...]
    left_out: tuple[str, ...]
    findings: tuple[Finding, ...]


def init(log: str | Path, output: str | Path = "machine.toml", *, force: bool = False) -> Drafted:
    """Write a draft of a machine file for a log; `cdtool info` runs with it. Raises CdtoolError.

    A channel whose guess the log contradicts is left in the file as a comment. An existing file is not overwritten
    without `force`.
    """
    target = Path(output)
    if target.exists() and not force:
        raise UsageError(f"{target}: is there already", "choose another name with -o, or overwrite it with --force")
    drafted = replace(_settled(Path(log), _drafted(Path(log))), path=str(target))
    with written_file(target) as part:
        part.write_text(drafted.text, encoding="utf-8")
    return drafted


def _settled(log: Path, draft: Draft) -> Drafted:
    """The draft with which `cdtool info` reads the log: what the log contradicts is taken back, one after another."""
    left_out: list[str] = []
    turned = False
    with TemporaryDirectory() as folder:
        trial = Path(folder) / "draft.toml"
        while True:
            text = draft_text(draft, left_out, turned)
            trial.write_text(text, encoding="utf-8")
            mapped = tuple(name for name in draft.channels.found if name not in left_out)
            try:
                findings = info(log, machine=read_machine_file(trial)).findings
            except CdtoolError as fault:
                bad = _blamed(fault, mapped)
                if bad is None:
                    raise
                left_out.append(bad)
                continue
            if turned or not any(_TURNED in found.message for found in findings if found.channel == "acceleration"):
                return Drafted("", text, mapped, tuple(left_out), findings)
            turned = True


def _drafted(log: Path) -> Draft:
    path = log_parts(log)[0]
    found = choose_format(path)
    source = found.columns(path)
    topics = has_topics(found)
    clock = None if topics else guess_clock(source)
    own = any(column.time is not None for column in source.columns.values())
    streams = streams_of(source, clock.time if clock else None, clock.column if clock else None, topics)
    channels = guess_channels(streams, topics)
    if not channels.found:
        raise RecordingError(
            f"{log}: no column's name or course tells of a torque, speed or position",
            "see cdtool info for what it holds, and write [channels] by hand",
        )
    side = side_of(channels, topics)
    joints, why = _joints(path, channels, topics)
    time = Clock("time", "s", "the file's own clock") if own and not topics else _clock(source, clock)
    return Draft(log.stem, log.name, side, joints, why, time, channels, topics)


def _joints(path: Path, channels: Channels, topics: bool) -> tuple[tuple[str, ...], str]:
    if channels.joints == 1:
        return ("axis",), ""
    if topics:
        for found in channels.found.values():
            names = element_names(path, found.stream.topic) if found.stream.field.endswith("[:]") else ()
            if len(names) == channels.joints and len(set(names)) == len(names):
                return names, f"as the messages of {found.stream.topic} name them"
    return tuple(f"joint_{j}" for j in range(1, channels.joints + 1)), "guessed: numbered in the order of the columns"


def _clock(source: Source, clock: GuessedClock | None) -> Clock:
    if clock is None:
        return Clock(why="no column looks like a clock: give the rate, or the column and its unit")
    column = source.columns[clock.column]
    unit, why = _time_unit(column.values, clock), "its name or its steps"
    name: str | int = int(clock.column) if clock.column.isdigit() else clock.column
    told = find_unit(column.unit) if column.unit else None
    if told is not None and told.si == "s":
        return Clock(name, str(column.unit), "the header, which names the unit")
    return Clock(name, unit, f"{why}; unit: steps of {np.median(np.diff(column.values)):.4g} {unit}")


def _time_unit(values: np.ndarray, clock: GuessedClock) -> str:
    """The unit with which the guess made seconds of the column."""
    known = np.flatnonzero(np.isfinite(values))
    if len(known) < 2 or values[known[-1]] == values[known[0]]:
        return "s"
    factor = (clock.time[-1] - clock.time[0]) / (values[known[-1]] - values[known[0]])
    return min(("s", "ms", "us", "ns", "min"), key=lambda unit: abs(np.log(abs(factor) / _seconds(unit))))


def _seconds(unit: str) -> float:
    known = find_unit(unit)
    assert known is not None
    return known.factor


def _blamed(fault: CdtoolError, mapped: tuple[str, ...]) -> str | None:
    """The channel that an error names, if the draft can do without it."""
    for match in _CHANNEL.finditer(fault.message):
        name = match[1] or match[2]
        if name in CHANNELS and name in mapped and len(mapped) > 1:
            return name
    return None
