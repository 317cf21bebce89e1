"""Normal bands of every channel along a stroke, learned from impact-free runs as a detector's signature is.

Here because it is made of signatures. No detector and no threshold uses it: an explanation compares a run with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Self

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import CdtoolError
from cdtool.detectors.detection import Signal, Status
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.recording import MEASURED, REFERENCES, Recording, Series
from cdtool.thresholds.common_class import SPEED_TOLERANCE
from cdtool.thresholds.fitted_signature import FittedSignature, progress_of
from cdtool.thresholds.signature import Signature

CHANNELS = (*MEASURED, *REFERENCES)
#: Their normal band is over time: along the travel they are the travel itself.
POSITIONS = ("position", "reference_position")
#: A channel is compared by its level, the mean over this long before a sample [s]: it shows small lasting shifts.
LEVEL_SECONDS = 0.05
#: A level is known where this share of its usual number of samples is.
FILLED = 0.5
#: Fewer runs do not determine a spread.
LEAST_RUNS = 3
#: Grid of the curves [s at the nominal speed]: a stroke of 1000 s has as many places as a signature may have.
STEP_SECONDS = 0.05
#: Neighbours within this time [s at the nominal speed] are pooled: with 3 runs a spread comes from 15 samples.
WINDOW_SECONDS = 0.1
#: A spread is at least this share of the largest mean: a channel that is computed may not vary at all.
SMALLEST_SPREAD = 1e-3
#: The same for a command, which varies by no more than when the motion is taken to have begun.
SMALLEST_OF_COMMAND = 0.02


class Absence(StrEnum):
    """Why there are no learned runs to compare with."""

    BY_HAND = "limits set by hand"
    PER_RUN = "limits from the run itself"
    OLDER_FILE = "signature file without normal motions"
    FEW_RUNS = "too few runs learned from"
    NO_CLASS = "no learned class of motion fits"
    NO_CHANNELS = "no speed and position"


@dataclass(frozen=True)
class NormalMotion:
    """The normal band of every channel of impact-free runs of one class of motion; the speed always has one."""

    channels: Mapping[str, FittedSignature]

    @property
    def motion(self) -> MotionClass:
        """Return the class of motion."""
        return self.channels["speed"].motion

    @property
    def joints(self) -> tuple[str, ...]:
        """Return the joints of the machine."""
        return self.channels["speed"].joints

    @property
    def runs(self) -> int:
        """Return the number of runs learned from."""
        return self.channels["speed"].runs

    def serves(self, recording: Recording) -> bool:
        """Whether a recording has these joints, and the channels that locate it in its stroke."""
        return recording.joints == self.joints and "speed" in recording and "position" in recording

    def compare(self, recording: Recording, channel: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return a recording's values, and the mean and spread of the impact-free runs at the same location.

        Each (n, J), positions from the start of the motion; NaN before the motion and where too few runs were. Raises
        RecordingError without speed and position.
        """
        return recording.derived(("normal band", channel), lambda: self._compared(recording, channel), self)

    def _compared(self, recording: Recording, channel: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        curve, signal = self.channels[channel], _signal(recording, channel, self.motion)
        at = curve.progress(recording, signal.time)
        mean, spread = curve.normal(at, np.zeros(signal.values.size, dtype=np.uint8))
        share = SMALLEST_OF_COMMAND if channel in REFERENCES else SMALLEST_SPREAD
        largest = np.max([np.abs(part.mean).max(axis=0) for part in (curve.by_time, curve.by_travel)], axis=0)
        return signal.values, mean, np.maximum(spread, share * largest)

    def with_run(self, recording: Recording, cap: float, effective_runs: float | None = None) -> NormalMotion:
        """Return the bands with one more impact-free run, updated and clipped like a signature."""
        return NormalMotion(
            {
                name: curve.with_run(recording, _signal(recording, name, self.motion), effective_runs, cap)
                if name in recording
                else curve
                for name, curve in self.channels.items()
            }
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the bands as JSON values."""
        return {name: curve.to_dict() for name, curve in self.channels.items()}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the inverse of `to_dict`; raises ValueError if the bands do not belong together."""
        channels = {name: FittedSignature.from_dict(item) for name, item in values.items()}
        motion, joints = channels["speed"].motion, channels["speed"].joints
        for name, curve in channels.items():
            if name not in CHANNELS:
                raise ValueError(f"a normal band of '{name}'")
            if (curve.motion, curve.joints, curve.by_time.mean.shape[1]) != (motion, joints, len(joints)):
                raise ValueError(f"a normal band of '{name}' for another motion, or for other joints")
        if motion.direction not in (-1, 1) or not 0 <= motion.joint < len(joints) or not motion.nominal_speed > 0.0:
            raise ValueError(f"class of motion {motion}")
        return cls(channels)


@dataclass(frozen=True)
class NormalMotions:
    """The normal motion of every class; `absent`: the reason if it is empty."""

    motions: tuple[NormalMotion, ...] = ()
    absent: Absence = Absence.BY_HAND

    def of(self, recording: Recording, motion: MotionClass) -> NormalMotion | Absence:
        """Return the normal motion of the class nearest to a recording's `motion`, or why none fits."""
        if not self.motions:
            return self.absent
        able = [item for item in self.motions if item.serves(recording)]
        if not able:
            return Absence.NO_CHANNELS
        fitting = [item for item in able if item.motion.matches(motion, SPEED_TOLERANCE)]
        distances = [abs(item.motion.nominal_speed - motion.nominal_speed) for item in fitting]
        return fitting[int(np.argmin(distances))] if fitting else Absence.NO_CLASS


def learn_normal_motion(recordings: Sequence[Recording], motion: MotionClass) -> NormalMotion | None:
    """Learn the normal band of every channel from impact-free recordings of one class of motion.

    Parameters
    ----------
    recordings : sequence of Recording
        Impact-free recordings on the load side.
    motion : MotionClass
        Their class: direction, leading joint and nominal speed.

    Returns
    -------
    NormalMotion or None
        None if fewer than 3 of them have speed and position, or if the class does not move.

    Examples
    --------
    >>> import numpy as np
    >>> from cdtool.recordings.recording import Series
    >>> time, valid = np.arange(2001) * 1e-3, np.zeros((2001, 1), dtype=np.uint8)
    >>> channels = {"speed": Series(time, np.full(2001, 0.2), "m/s"), "position": Series(time, 0.2 * time, "m")}
    >>> strokes = [Recording(f"{i}", "", ("axis",), channels) for i in range(10)]
    >>> from cdtool.recordings.motion import measured_class
    >>> normal = learn_normal_motion(strokes, measured_class(strokes[0]))
    >>> normal.runs, sorted(normal.channels)
    (10, ['position', 'speed'])
    """
    usable = [item for item in recordings if "speed" in item and "position" in item]
    usable = [item for item in usable if item.joints == usable[0].joints]
    if motion.direction == 0 or len(usable) < LEAST_RUNS:
        return None
    channels: dict[str, FittedSignature] = {}
    for name in CHANNELS:
        having = [item for item in usable if name in item]
        if len(having) < LEAST_RUNS:
            continue
        rule = Signature(
            alignment="time" if name in POSITIONS else "time_then_position",
            sides="two",
            position_step=STEP_SECONDS * motion.nominal_speed,
            position_window=WINDOW_SECONDS * motion.nominal_speed,
        )
        pairs = [(item, _signal(item, name, motion)) for item in having]
        try:
            channels[name] = rule.fit_class(pairs, motion.without_course)
        except CdtoolError:  # the runs share no part of the stroke with values of this channel
            continue
    return NormalMotion(channels) if "speed" in channels else None


def _signal(recording: Recording, channel: str, motion: MotionClass) -> Signal:
    """Return a channel as a signal whose missing values are gaps; positions from where the motion began."""
    series = recording[channel]
    values = levels_of(series)
    if channel in POSITIONS:
        moves = np.isfinite(progress_of(recording, series.time, motion).elapsed)
        known = np.isfinite(values) & moves[:, np.newaxis]
        first = values[known.argmax(axis=0), np.arange(values.shape[1])]
        values = np.where(known, values - first, np.nan)
    status = np.where(np.isfinite(values), Status.VALID, Status.GAP).astype(np.uint8)
    return Signal(series.time, values, status, series.unit, joints=recording.joints)


def levels_of(series: Series) -> FloatArray:
    """Return at each sample the mean of a channel over the last `LEVEL_SECONDS`, computed once and stored with it.

    Parameters
    ----------
    series : Series
        The channel; a lone spike of one sample does not count.

    Returns
    -------
    ndarray of float, shape (n, J)
        Its level, in the unit of the channel; NaN where more than half of the usual number of samples is missing.

    Examples
    --------
    >>> time = np.arange(100) * 1e-3
    >>> series = Series(time, np.where(time < 0.05, 0.0, 10.0), "N")
    >>> levels_of(series)[[49, 99], 0].round(6).tolist()
    [0.0, 10.0]
    """
    return series.derived("levels", lambda: _levels(series))


def _levels(series: Series) -> FloatArray:
    own, known = series.values, np.isfinite(series.values)
    # The median with both neighbours, where they are known: a spike of one sample is not a level.
    before, after = np.concatenate((own[:1], own[:-1])), np.concatenate((own[1:], own[-1:]))
    median = np.maximum(np.minimum(before, own), np.minimum(np.maximum(before, own), after))
    values = np.where(np.isfinite(median), median, np.where(known, own, 0.0))
    # Sums about the mean keep their digits at any offset.
    about = values.sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    first = np.searchsorted(series.time, series.time - LEVEL_SECONDS, side="right")
    sums = (np.cumsum(part, axis=0) for part in (np.where(known, values - about, 0.0), known))
    until = (np.concatenate((np.zeros((1, series.joint_count)), part)) for part in sums)
    total, count = (part[1:] - part[first] for part in until)
    enough = max(FILLED * min(LEVEL_SECONDS / series.period, len(series)), 1.0) if len(series) > 1 else 1.0
    return np.where(count >= enough, total / np.maximum(count, 1.0) + about, np.nan)
