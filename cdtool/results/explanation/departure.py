"""When each channel left its normal band for the first time, and by how much.

A diagnosis after the event, for people: it uses the recording before and after the event; no detector, no threshold and
no latency depends on it. The normal band is that of impact-free runs at the same location of the stroke or, without
any, the straight line through the log's own half second before. Times are seconds on the recording's own clock. Load
cell and labels are not used.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.detectors.detection import WHOLE_MACHINE
from cdtool.recordings.recording import REFERENCES, Recording
from cdtool.statistics.spread import MAD_TO_STD
from cdtool.thresholds.normal_motion import CHANNELS, POSITIONS, NormalMotion, levels_of

#: Commands to the machine. The reference torque is not one: it is a controller's output and responds to a contact.
COMMANDS = ("reference_position", "reference_speed")

#: Spreads from the normal band at which a channel has left it: noise does so in 1 of 10^8 samples.
LEFT = 6.0
#: Consecutive samples that must be outside on one side: a spike of one or two is not a movement.
LASTING = 3
#: The time before an event that shows a run's own offset, and its line where nothing was learned [s].
PAST_SECONDS = 0.5
#: A line through less of it does not last to an alarm [s].
LEAST_PAST_SECONDS = 0.2
#: Fewer samples of the past determine neither.
ENOUGH = 10
#: A run's own offset counts up to this many spreads (friction varies from run to run); more is a departure.
OWN_OFFSET = 2.5
#: Computed values are as exact as this share of the largest.
ROUNDING = 1e-9
#: Uncertainty of the time at which a channel left [s]: of channels that leave within it, the cause comes first.
RESOLUTION = 0.02
#: Why a channel has no time of departure.
STAYED = "no departure"
#: It was outside when the search began.
OUTSIDE = "outside since before"
#: Too few samples of it, or of its normal band, are known.
UNKNOWN = "nothing to compare with"
# The channel that physically responds first.
_ORDER = ("acceleration", "speed", "torque", "position", *REFERENCES)


@dataclass(frozen=True)
class Departure:
    """When and to which side a channel of a joint left its normal band: `time` [s]; NaN if not, with the reason.

    Its `value` where it is farthest off, with normal `mean` and `spread` there, in `unit`; NaN if unknown.
    """

    channel: str
    joint: str
    unit: str
    time: float = math.nan
    direction: Literal["up", "down", ""] = ""
    reason: str = ""
    value: float = math.nan
    mean: float = math.nan
    spread: float = math.nan


def departures(
    recording: Recording, normal: NormalMotion | None, joint: str, leading: str, begin: float, end: float
) -> tuple[Departure, ...]:
    """Return the channels in the order in which they left their normal band.

    Parameters
    ----------
    recording : Recording
        The recording on the load side.
    normal : NormalMotion or None
        The impact-free runs to compare with; None: the log's own past.
    joint : str
        The signal's joint, or the whole machine (`WHOLE_MACHINE`).
    leading : str
        The joint that leads the motion.
    begin, end : float
        The time in which departures are searched for [s].

    Returns
    -------
    tuple of Departure
        Every channel of the joint and, compared with impact-free runs, those of other joints that left: first those
        that did, in order of time.

    Examples
    --------
    A leaf at constant speed is braked from 1 s; its torque stays constant.

    >>> from cdtool.recordings.recording import Series
    >>> time = np.arange(2000) * 1e-3
    >>> speed = Series(time, np.where(time < 1.0, 0.5, 0.5 - 2.0 * (time - 1.0)), "m/s")
    >>> run = Recording("run", "", ("leaf",), {"torque": Series(time, np.full(2000, 30.0), "N"), "speed": speed})
    >>> found = departures(run, None, "leaf", "leaf", 0.95, 1.5)
    >>> [(item.channel, item.direction, round(item.time, 3)) for item in found]
    [('speed', 'down', 1.001), ('torque', '', nan)]
    """
    found = []
    for channel in CHANNELS:
        if channel not in recording or (normal is not None and channel not in normal.channels):
            continue
        series = recording[channel]
        rows = slice(*np.searchsorted(series.time, (begin - PAST_SECONDS, end)))
        time = series.time[rows]
        for j, name in enumerate(recording.joints):
            if normal is not None and channel in POSITIONS and name == leading:
                continue  # the position of the leading joint is the location itself
            if normal is None:
                columns = own_past(time, levels_of(series)[rows, j], begin)
            else:
                columns = [part[rows, j] for part in normal.compare(recording, channel)]
            # The assumed start of the motion shifts a whole position: only a change of its distance counts.
            offset = 0.0 if normal is None else math.inf if channel in POSITIONS else OWN_OFFSET
            item = _departure(Departure(channel, name, series.unit), time, columns, begin, offset)
            if (joint,) == WHOLE_MACHINE or name == joint or (normal and not math.isnan(item.time)):
                found.append(item)
    return _in_order(found, joint)


def own_past(time: FloatArray, value: FloatArray, begin: float) -> list[FloatArray]:
    """Return a channel (n,) with the line through its past up to `begin` [s], and the spread about it.

    The spread grows ahead as lines through the first and the second half of the past diverge. NaN if the past is short.
    """
    past = np.flatnonzero((time >= begin - PAST_SECONDS) & (time < begin) & np.isfinite(value))
    if len(past) < ENOUGH or time[past[-1]] - time[past[0]] < LEAST_PAST_SECONDS:
        unknown = np.full(len(time), np.nan)
        return [value, unknown, unknown]
    ahead, known = time - begin, value[past]
    line, first, second = (np.polyfit(ahead[part], value[part], 1) for part in (past, *np.array_split(past, 2)))
    mean = np.asarray(np.polyval(line, ahead), dtype=np.float64)
    noise = max(MAD_TO_STD * float(np.median(np.abs(known - mean[past]))), quantisation(known))
    return [value, mean, noise + abs(first[0] - second[0]) * np.maximum(ahead, 0.0)]


def quantisation(value: FloatArray) -> float:
    """Return the rounding error of a channel (n,): its smallest step / sqrt(12), the deviation of even rounding."""
    smallest = ROUNDING * max(float(np.abs(value).max(initial=0.0)), 1e-200)
    steps = np.abs(np.diff(value))
    steps = steps[steps > smallest]
    return float(steps.min()) / math.sqrt(12.0) if len(steps) else smallest


def _departure(
    channel: Departure, time: FloatArray, columns: Sequence[FloatArray], begin: float, most_own: float
) -> Departure:
    value, mean, spread = columns
    start = int(np.searchsorted(time, begin))
    with np.errstate(divide="ignore", invalid="ignore"):
        off = (value - mean) / spread
    past = off[:start][np.isfinite(off[:start])]
    if len(past) >= ENOUGH:
        off = off - np.clip(np.median(past), -most_own, most_own)
    off = off[start:]
    if np.count_nonzero(np.isfinite(off)) < LASTING:
        return replace(channel, reason=UNKNOWN)

    def at(k: int, **more: Any) -> Departure:
        return replace(
            channel, value=float(value[start + k]), mean=float(mean[start + k]), spread=float(spread[start + k]), **more
        )

    # Where so many consecutive samples begin that are all outside: each is a byte 1.
    firsts = [((sign * off > LEFT).tobytes().find(b"\1" * LASTING), sign) for sign in (1.0, -1.0)]
    firsts = [(found, sign) for found, sign in firsts if found >= 0]
    if not firsts:
        return at(int(np.nanargmax(np.abs(off))), reason=STAYED)
    first, sign = min(firsts)
    farthest = first + int(np.nanargmax(sign * off[first:]))
    if first == 0:
        return at(farthest, reason=OUTSIDE, direction="up" if sign > 0 else "down")
    near = np.flatnonzero(~(sign * off[:first] > 0.5 * LEFT))
    half, left = time[start + (int(near[-1]) + 1 if len(near) else 0)], time[start + first]
    # The line through half of the limit and the limit meets the normal band where the departure began.
    began = float(half - min(left - half, RESOLUTION))
    return at(farthest, time=began, direction="up" if sign > 0 else "down")


def _in_order(found: Sequence[Departure], joint: str) -> tuple[Departure, ...]:
    """Sort by time, channels that did not leave last; a channel does not precede the one it follows.

    A position, an integral, follows its own speed; another joint follows the signal's.
    """
    speeds = {item.joint: item.time for item in found if item.channel == "speed" and not math.isnan(item.time)}

    def place(item: Departure) -> tuple[bool, float, int]:
        time = item.time
        if item.channel == "position" and 0.0 < speeds.get(item.joint, -math.inf) - time < RESOLUTION:
            time = speeds[item.joint]
        if (joint,) != WHOLE_MACHINE and item.joint != joint:
            time += RESOLUTION
        return math.isnan(time), time, _ORDER.index(item.channel)

    return tuple(sorted(found, key=place))
