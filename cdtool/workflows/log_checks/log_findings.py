"""Findings about a log itself, independent of the detector and identical in every command.

The sign and scale of the accelerometer are checked against the derivative of the speed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from cdtool.evaluation.results import RecordingFinding
from cdtool.evaluation.statistics.correlation import correlation
from cdtool.evaluation.truth.doubts import truth_findings
from cdtool.evaluation.truth.onset import OnsetRule
from cdtool.findings import Fact, Finding, worst_first
from cdtool.findings.clocks import ClockFactor
from cdtool.findings.motion import (
    AccelerometerFit,
    AccelerometerScaleUncheckable,
    AccelerometerScaleWrong,
    AccelerometerTurned,
    AccelerometerUncheckable,
    SpeedUnitDoubtful,
)
from cdtool.recording import Contact, FloatArray, Recording, Series
from cdtool.workflows.log_checks.motion_check import motion_findings, units_apart

# Length of the windows over which the change of speed and the mean acceleration are compared [s].
_WINDOW = 0.2
# Least correlation at which the sign, or the scale, can be checked.
_LEAST_FOR_SIGN, _LEAST_FOR_SCALE = 0.5, 0.8
# Below this share of the fastest joint's speed range a joint hardly moves: the accelerometer shows only vibration.
_HARDLY = 0.1
_STANDARD_GRAVITY = 9.80665
# Units of a clock among those that two channels may differ by.
_TIMES = {
    "mm and m, or ms and s": "ms and s",
    "um and m, or us and s": "us and s",
    "min and s": "min and s",
    "h and s": "h and s",
}
# A log shorter than the first number of windows, or of longer sample periods, has other ones, as its clock may have the
# wrong unit: of so many sample periods, and at least so many windows.
_FEWEST, _PERIODS, _PARTS = 3.0, 200.0, 20
# A log with a long gap has at most so many windows: memory and time are bounded.
_MOST = 1_000_000
# A factor between units is named if the slope is within this share of it.
_NEAR = 0.15


def log_findings(recording: Recording, contacts: Sequence[Contact], rule: OnsetRule) -> tuple[Finding, ...]:
    """Return the findings of reading a log, and those about its motion, accelerometer and load cell, worst first.

    `contacts` are the log's contacts by `rule`.
    """
    motion = [*motion_findings(recording), *accelerometer_findings(recording, contacts)]
    found = [*recording.findings, *clock_findings(motion), *motion]
    return worst_first(dict.fromkeys([*found, *truth_findings(recording, contacts, rule)]))


def clock_findings(motion: Sequence[Finding]) -> list[Finding]:
    """Return one finding per joint whose speed and acceleration both disagree by the same factor of units of time.

    `motion` are the findings about speed and accelerometer.
    """
    speeds = {item.fact.joint: item.fact for item in motion if isinstance(item.fact, SpeedUnitDoubtful)}
    found = []
    for fact in (item.fact for item in motion):
        if not isinstance(fact, AccelerometerScaleWrong) or fact.joint not in speeds:
            continue
        factor = speeds[fact.joint].integrated / speeds[fact.joint].spanned
        units = _TIMES.get(units_apart(max(factor, 1.0 / factor)), "")
        if units and _fits(fact.slope / factor):
            found.append(Finding(ClockFactor(fact.joint, factor, fact.slope, units), "time"))
    return found


def log_warnings(recording: Recording, contacts: Sequence[Contact], rule: OnsetRule) -> list[RecordingFinding]:
    """Return the warnings among the findings of a log, with its name; `runs.lost` returns the losses."""
    found = log_findings(recording, contacts, rule)
    return [RecordingFinding.of(recording.name, item) for item in found if item.severity == "warning"]


def accelerometer_findings(recording: Recording, contacts: Sequence[Contact]) -> list[Finding]:
    """Return one finding per joint: the measured acceleration against the derivative of the speed before contact."""
    if "acceleration" not in recording or "speed" not in recording:
        return []
    speed, acceleration = (_before_contact(recording[name], contacts) for name in ("speed", "acceleration"))
    if not len(speed) or not len(acceleration):
        return []
    found = []
    # A single joint is not compared with others.
    ranges = [_range(speed.values[:, j]) for j in range(len(recording.joints))] if len(recording.joints) > 1 else [0.0]
    window = _window(speed, acceleration)
    for j, joint in enumerate(recording.joints):
        name = joint if len(recording.joints) > 1 else ""
        if ranges[j] < _HARDLY * max(ranges):
            found.append(Finding(AccelerometerUncheckable(name, "joint hardly moves"), "acceleration", "note"))
            continue
        fact = _compare(*_pairs(speed, acceleration, j, window), name)
        is_wrong = isinstance(fact, AccelerometerTurned | AccelerometerScaleWrong)
        found.append(Finding(fact, "acceleration", "warning" if is_wrong else "note"))
    return found


def _range(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) if len(known) else 0.0


def _before_contact(series: Series, contacts: Sequence[Contact]) -> Series:
    """Return the part before the first contact: during contact the elastic drive separates motor and load."""
    since = contacts[0].end if contacts and contacts[0].in_progress else -np.inf
    first = next((contact.start for contact in contacts if not contact.in_progress), np.inf)
    return series.between(since, first) if contacts else series


def _compare(expected: FloatArray, measured: FloatArray, joint: str) -> Fact:
    r = correlation(expected, measured)
    if len(expected) < 5 or math.isnan(r):
        return AccelerometerUncheckable(joint, "speed hardly changes")
    slope = float(np.polyfit(expected, measured, 1)[0])
    if abs(r) < _LEAST_FOR_SIGN:
        return AccelerometerUncheckable(joint, "correlation", r)
    if slope < 0.0:
        return AccelerometerTurned(joint, slope, r)
    if _fits(slope):
        return AccelerometerFit(joint, slope, r)
    if r < _LEAST_FOR_SCALE:
        return AccelerometerScaleUncheckable(joint, slope, r)
    if _fits(slope / _STANDARD_GRAVITY):
        return AccelerometerScaleWrong(joint, slope, r, "m/s2")
    if _fits(slope * _STANDARD_GRAVITY):
        return AccelerometerScaleWrong(joint, slope, r, "g")
    return AccelerometerScaleWrong(joint, slope, r, as_between=units_apart(max(slope, 1.0 / slope), _NEAR))


def _fits(slope: float) -> bool:
    """Whether the slope is that of a correct scale."""
    return 0.7 < slope < 1.4


def _window(speed: Series, acceleration: Series) -> float:
    """Return the length of the windows to compare [s]; 0 if the log is too short."""
    length = min(speed.time[-1], acceleration.time[-1]) - max(speed.time[0], acceleration.time[0])
    period = float(np.nanmax((speed.period, acceleration.period, 0.0)))
    if length > _FEWEST * _WINDOW and period <= _WINDOW:
        return max(_WINDOW, float(length) / _MOST)
    window = min(_PERIODS * period, float(length) / _PARTS)
    return window if window > 2.0 * period else 0.0


def _pairs(speed: Series, acceleration: Series, joint: int, window: float) -> tuple[FloatArray, FloatArray]:
    """Return the change of speed per time and the mean acceleration in consecutive windows [s], (w,) each."""
    start, end = max(speed.time[0], acceleration.time[0]), min(speed.time[-1], acceleration.time[-1])
    if window <= 0.0:
        return np.empty(0), np.empty(0)
    edges = np.arange(start, end, window)
    if len(edges) < 3:
        return np.empty(0), np.empty(0)
    known = np.isfinite(speed.values[:, joint])
    if np.count_nonzero(known) < 2:
        return np.empty(0), np.empty(0)
    gained = np.diff(np.interp(edges, speed.time[known], speed.values[known, joint])) / window
    measured = acceleration.values[:, joint]
    present = np.isfinite(measured)
    before = np.searchsorted(acceleration.time, edges)
    if not present.all():
        # Where a window begins among the samples that are not missing.
        before = np.concatenate(([0], np.cumsum(present)))[before]
        measured = measured[present]
    means = np.full(len(edges) - 1, np.nan)
    for i, (start, end) in enumerate(pairwise(before.tolist())):
        if end > start:
            means[i] = np.add.reduce(measured[start:end]) / (end - start)
    good = np.isfinite(means) & np.isfinite(gained)
    return gained[good], means[good]
