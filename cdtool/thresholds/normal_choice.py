"""Select the impact-free runs with which an explanation compares a run, or state why this is impossible."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum

import numpy as np

from cdtool.recordings.recording import Recording
from cdtool.thresholds.normal_motion import MotionComparison, NormalMotion

# A class of motion fits if the leading joint's speed is within this many spreads of it, in the median up to the event.
_FITS = 4.0
_BEFORE, _LEAST_SAMPLES = 1.0, 5
# Alarms of other detectors are explained in much the same time: so much more of a channel is compared at once [s].
_AROUND = 0.75


class Absence(StrEnum):
    """Why there are no learned runs to compare with."""

    BY_HAND = "limits set by hand"
    PER_RUN = "limits from the run itself"
    OLDER_FILE = "signature file without normal motions"
    FEW_RUNS = "too few runs learned from"
    NO_CLASS = "no learned class of motion fits"
    NO_CHANNELS = "no speed and position"


@dataclass(frozen=True)
class NormalMotions:
    """The normal motion of every class; `absent`: the reason if it is empty."""

    motions: tuple[NormalMotion, ...] = ()
    absent: Absence = Absence.BY_HAND

    def for_one_operation(self) -> NormalMotions:
        """Return a copy for the alarms of several detectors in one operation: it compares each channel only once."""
        known = fields(NormalMotion)
        return replace(
            self, motions=tuple(_OnceCompared(*(getattr(item, part.name) for part in known)) for item in self.motions)
        )

    def of(self, recording: Recording, until: float) -> NormalMotion | Absence:
        """Return the normal motion that best fits the leading speed in the 1 s up to `until` [s], or why none fits."""
        if not self.motions:
            return self.absent
        able = [item for item in self.motions if item.serves(recording)]
        if not able:
            return Absence.NO_CHANNELS
        distances = [_distance(item, recording, until) for item in able]
        best = int(np.argmin(distances))
        return able[best] if distances[best] <= _FITS else Absence.NO_CLASS


@dataclass(frozen=True)
class _OnceCompared(NormalMotion):
    """A normal motion for one operation, shared by all detectors; their alarms are close to each other."""

    compared: dict[str, tuple[float, float, MotionComparison]] = field(default_factory=dict, compare=False, repr=False)

    def compare(
        self, recording: Recording, channel: str, start: float = -math.inf, end: float = math.inf
    ) -> MotionComparison:
        """Compare as NormalMotion does, maybe more of the channel; the recording is always the same."""
        first, last, known = self.compared.get(channel, (math.inf, -math.inf, None))
        if known is not None and first <= start and end <= last:
            return known
        first, last = min(first, start - _AROUND), max(last, end + _AROUND)
        known = super().compare(recording, channel, first, last)
        self.compared[channel] = first, last, known
        return known


def _distance(normal: NormalMotion, recording: Recording, until: float) -> float:
    """Return the leading joint's speed deviation from a class of motion [spreads]; infinite without a motion."""
    if "speed" not in normal.channels:
        return math.inf
    begin, joint = until - _BEFORE, normal.motion.joint
    compared = normal.compare(recording, "speed", begin, until)
    part = slice(int(compared.time.searchsorted(begin)), int(compared.time.searchsorted(until)))
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.abs(compared.level - compared.level_mean)[part, joint] / compared.level_spread[part, joint]
    known = off[np.isfinite(off)]
    return float(np.median(known)) if len(known) >= _LEAST_SAMPLES else math.inf
