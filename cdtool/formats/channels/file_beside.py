"""Load cells that are logged in a file of their own beside the log: found, read, and aligned with the log's clock.

Conventions: times in s on the log's clock; shift = log time - file time. The samples of the load cell keep their own
times: nothing is interpolated. Samples outside the log are left out and counted. A load cell whose file is missing, or
cannot be aligned, is absent from the recording, with the file and the reason in a finding; nothing is guessed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding, Severity
from cdtool.base.remote.remote_path import location, relative_name
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, OwnFile
from cdtool.recordings.recording import SHOWS_CONTACTS, Recording, Series

# A trigger rises where it comes to the upper share of its range after the lower one. It has two levels: at most this
# tenth of its samples is between them, of noise most are.
_LOWER, _UPPER = 0.3, 0.7

# Returns a file beside the log as a recording of its own.
ReadFile = Callable[[Path, ChannelMap], Recording]
# Returns a channel of the log: the values of a trigger column, or of a topic and its field.
ReadTrigger = Callable[[str | int], Series]


def add_files_beside(
    recording: Recording, log: Path, channels: ChannelMap, read: ReadFile, trigger: ReadTrigger
) -> Recording:
    """Return a recording with the channels that are in files beside the log.

    Raises ConfigurationError for a map that does not fit. A file that cannot be used leaves its channel out: a note if
    it does not exist, otherwise a loss.
    """
    for item in channels.beside:
        own = item.own_file
        assert own is not None
        path = own.path_for(log)
        name = relative_name(path, log.parent)  # results do not depend on the current folder
        if path.resolve() == log.resolve():
            reason = "it is the log itself: map its column without 'file'"
            recording = _without(recording, item, name, reason)
            continue
        if not path.exists():
            recording = _without(recording, item, name)
            continue
        try:
            beside = read(path, _map_of(item, own, channels.joints))
            recording = _with_file(recording, item, own, beside, trigger)
        except RecordingError as fault:
            reason = str(fault).removeprefix(f"{path}: ")
            recording = _without(recording, item, name, reason)
    return recording


def _without(recording: Recording, item: ChannelSource, name: str, reason: str = "") -> Recording:
    numbers = {"name": name, "reason": reason}
    finding = Finding("absent_file", item.channel, numbers, "loss" if reason else "note")
    return replace(recording, findings=(*recording.findings, finding))


def _map_of(item: ChannelSource, own: OwnFile, joints: tuple[str, ...]) -> ChannelMap:
    """Return the map of a file beside the log: the channel, and its trigger."""
    triggers = [ChannelSource("trigger", columns=(own.file_trigger,))] if own.align == "trigger" else []
    return ChannelMap(own.time, (replace(item, own_file=None, time_offset=0.0), *triggers), joints)


@dataclass(frozen=True)
class _Shift:
    """How far the clock of a file is shifted to that of the log [s], within what that is known, and findings."""

    seconds: float
    within: float = 0.0
    findings: tuple[Finding, ...] = ()


def _with_file(
    recording: Recording, item: ChannelSource, own: OwnFile, beside: Recording, trigger: ReadTrigger
) -> Recording:
    name, path = item.channel, location(beside.source)
    findings = [replace(found, file=path.name) for found in beside.findings if found.kind != "clocks_apart"]
    if name not in beside:
        absent = [
            found.sentence
            for found in beside.findings
            if found.kind in ("absent_truth", "absent_file", "unit_contradicted")
        ]
        raise RecordingError(f"{path}: {absent[0]}" if absent else f"{path}: contains no {name}")
    shift = _shift(recording, item.channel, own, beside, trigger)
    shift = replace(shift, seconds=shift.seconds + item.time_offset)
    series = beside[name]
    moved = Series(series.time + shift.seconds, series.values, series.unit)
    inside = moved.between(recording.start, recording.end)
    if not len(inside):
        raise RecordingError(
            f"{path}: its samples, {moved.time[0]:.3f} to {moved.time[-1]:.3f} s on the log's clock, are outside "
            f"the log ({recording.start:.3f} to {recording.end:.3f} s)",
            "check how the clocks are aligned",
        )
    aligned = {
        "file_name": path.name,
        "shift": shift.seconds,
        "how": own.align,
        "within": shift.within,
        "cut": len(moved) - len(inside),
    }
    # More outside than inside: the clocks may have other units, or be aligned wrongly.
    severity: Severity = "warning" if 2 * len(inside) < len(moved) else "note"
    return replace(
        recording,
        channels={**recording.channels, name: inside},
        findings=(*recording.findings, *findings, *shift.findings, Finding("file_aligned", name, aligned, severity)),
        beside=(*recording.beside, (path.name, beside.digest)),
        # A pressure shows no onset: its clock does not concern a latency.
        truth_clock=max(recording.truth_clock, shift.within if name in SHOWS_CONTACTS else 0.0),
    )


def _shift(recording: Recording, channel: str, own: OwnFile, beside: Recording, trigger: ReadTrigger) -> _Shift:
    """Return the shift without the channel's time_offset; raises RecordingError if the clocks cannot be aligned."""
    if own.align == "offset":
        return _Shift(0.0)
    if own.align == "epoch":
        for which, each in (("log's", recording), ("file's", beside)):
            if not each.origin:
                raise RecordingError(
                    f"{beside.source}: the {which} clock does not count from 1970", "align by a trigger or time_offset"
                )
        return _Shift(beside.origin - recording.origin)
    if "trigger" not in beside:
        raise RecordingError(f"{beside.source}: its trigger '{own.file_trigger}' has no sample with a time")
    return _shift_by_rises(channel, beside.source, trigger(own.log_trigger), beside["trigger"])


def _shift_by_rises(channel: str, file: str, in_log: Series, in_file: Series) -> _Shift:
    ours, theirs = rises(in_log), rises(in_file)
    for which, found in (("log", ours), ("file", theirs)):
        if not len(found):
            raise RecordingError(
                f"{file}: the trigger in the {which} never rises from one level to another", "name the column that does"
            )
    step = max(float(np.nanmax([series.period for series in (in_log, in_file)])), 0.0)
    if len(ours) != len(theirs):
        differ = Finding("triggers_differ", channel, {"in_log": len(ours), "in_file": len(theirs)})
        return _Shift(float(ours[0] - theirs[0]), step, (differ,))
    shifts = ours - theirs
    middle = 0.5 * float(shifts.min() + shifts.max())
    spread, span = float(np.ptp(shifts)), float(ours[-1] - ours[0])
    if spread <= 2.0 * step or span <= 0.0:
        return _Shift(middle, step)
    ppm = 1e6 * float(shifts[-1] - shifts[0]) / span
    return _Shift(
        middle,
        step + 0.5 * spread,
        (Finding("triggers_drift", channel, {"spread": 1e3 * spread, "span": span, "ppm": ppm}),),
    )


def rises(trigger: Series) -> FloatArray:
    """Return the times [s] at which a trigger comes to the upper 30 % of its range after it was in the lower 30 %.

    Empty if more than a tenth of its samples is between the two, as of noise.

    >>> rises(Series(np.arange(6.0), np.array([5.0, 0.0, 0.5, 5.0, 4.9, 0.1]), "1")).tolist()
    [3.0]
    """
    present = np.isfinite(trigger.values[:, 0])
    time, level = trigger.time[present], trigger.values[present, 0]
    if not len(level) or np.ptp(level) == 0.0:
        return np.empty(0)
    share = (level - level.min()) / np.ptp(level)
    decided = (share <= _LOWER) | (share >= _UPPER)
    if np.count_nonzero(decided) < 0.9 * len(share):
        return np.empty(0)
    high = share[decided] >= _UPPER
    found: FloatArray = time[decided][1:][high[1:] & ~high[:-1]]
    return found
