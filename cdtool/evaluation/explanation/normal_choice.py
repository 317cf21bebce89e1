"""Which impact-free runs an explanation compares a run with, or why with none."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from cdtool.recording import Recording
from cdtool.thresholds.normal_motion import NormalMotion

# A class of motion fits if the leading joint's speed is within this many spreads of it, in the median up to the event.
_FITS = 4.0
_BEFORE, _LEAST_SAMPLES = 1.0, 5


class Absence(StrEnum):
    """Why there is nothing learned to compare with."""

    BY_HAND = "limits set by hand"
    OLDER_FILE = "signature file without normal courses"
    FEW_RUNS = "too few runs learned from"
    NO_CLASS = "no learned class of motion fits"
    NO_CHANNELS = "no speed and position"


@dataclass(frozen=True)
class NormalMotions:
    """What was learned of every class of motion; `absent`: why there is nothing, if there is nothing."""

    motions: tuple[NormalMotion, ...] = ()
    absent: Absence = Absence.BY_HAND

    def of(self, recording: Recording, until: float) -> NormalMotion | Absence:
        """The normal motion whose leading speed fits the run best in the second up to `until` [s], or why none does."""
        if not self.motions:
            return self.absent
        able = [item for item in self.motions if item.serves(recording)]
        if not able:
            return Absence.NO_CHANNELS
        distances = [_distance(item, recording, until) for item in able]
        best = int(np.argmin(distances))
        return able[best] if distances[best] <= _FITS else Absence.NO_CLASS


def _distance(normal: NormalMotion, recording: Recording, until: float) -> float:
    """How far the leading joint's speed is from that of a class of motion [spreads]; infinite where it never began."""
    if "speed" not in normal.channels:
        return math.inf
    compared = normal.compare(recording, "speed")
    part = slice(*np.searchsorted(compared.time, (until - _BEFORE, until)))
    joint = normal.motion.joint
    with np.errstate(invalid="ignore", divide="ignore"):
        off = np.abs(compared.level - compared.level_mean)[part, joint] / compared.level_spread[part, joint]
    known = off[np.isfinite(off)]
    return float(np.median(known)) if len(known) >= _LEAST_SAMPLES else math.inf
