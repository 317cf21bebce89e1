"""A position in a log at which a named joint is at a given angle or place."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdtool.base.errors import RecordingError, UsageError, nearest
from cdtool.base.plain_text import digits
from cdtool.machines.dynamics import Machine
from cdtool.recordings.log_section import Mark
from cdtool.recordings.recording import Recording
from cdtool.recordings.units import find_unit

_HINT = 'give a joint and its position, as "elbow = 62deg" or "lift = 0.3m"'


@dataclass(frozen=True)
class JointMark(Mark):
    """The first time at which the joint `joint` passes its position `value` in `unit` (m, rad), from either side."""

    joint: str = ""

    @classmethod
    def of_machine(cls, text: str, machine: Machine) -> JointMark:
        """Return the mark that a text such as `elbow = 62deg` describes; raises UsageError."""
        name, _, place = (part.strip() for part in text.partition("="))
        if name not in machine.joints:
            raise UsageError(f"names the joint '{name[:40]}'", nearest(name, machine.joints))
        number = place.rstrip("abcdefghijklmnopqrstuvwxyz° ")
        unit = find_unit(place[len(number) :].strip())
        expected = machine.load_units["position"]
        try:
            value = float(number) * unit.factor if unit else math.nan
        except ValueError:
            value = math.nan
        if (
            unit is None
            or not math.isfinite(value)
            or unit.si not in (("m", "rad") if expected == "SI" else (expected,))
        ):
            raise UsageError(f"is '{text[:40]}'", _HINT)
        return cls(value, unit.si, name)

    def __str__(self) -> str:
        return f"{self.joint} = {digits(self.value)} {self.unit}"

    def time_in(self, recording: Recording) -> float:
        """Return the time [s] at which the joint first passes the position; infinite if it never does.

        Raises RecordingError without positions.
        """
        if "position" not in recording:
            raise RecordingError(f"{recording.name}: no position", "map position in [channels], or use a time")
        position = recording["position"]
        column = position.values[:, recording.joints.index(self.joint)]
        known = np.isfinite(column)
        beyond = column[known] >= self.value
        passed = np.flatnonzero(beyond[1:] != beyond[:-1])
        return float(position.time[known][passed[0] + 1]) if len(passed) else math.inf
