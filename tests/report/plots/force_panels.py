"""Force curves of half sines with their verdicts, for figures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.results.traced_force import TracedForce
from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.limits import ForceProfile, profile_of, read_force_limits
from cdtool.truth.force.verdict import assess_force

GAP = profile_of(read_force_limits(), "en_12453_reducing_gap")
TIME = np.arange(6500) * 1e-3
ALARMS = {"momentum": 0.066, "friction_ekf": 0.034}


def half_sine(peak: float, rate: float = 28.4, until: float = 6.5) -> tuple[FloatArray, FloatArray]:
    time = TIME[until >= TIME]
    phase = rate * time
    return time, np.where(phase < np.pi, peak * np.sin(phase), 0.0)


def curve(
    name: str, peak: float, *, until: float = 6.5, alarms: Mapping[str, float] = ALARMS, profile: ForceProfile = GAP
) -> TracedForce:
    time, force = half_sine(peak, until=until)
    curve = ForceTimeCurve(time, force, np.zeros(len(time), dtype=bool), float(time[-1]))
    return TracedForce(name, "g", 1, time, force, assess_force(curve, profile), alarms)


def group_of(name: str, profile: ForceProfile) -> dict[str, tuple[TracedForce, ...]]:
    """A group of one curve with one alarm, all with that name."""
    return {name: (curve(name, 900.0, alarms={name: 0.02}, profile=profile),)}
