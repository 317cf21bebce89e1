"""Group impact-free runs by class of motion, and leave out runs that differ from their class."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.recordings.motion import MotionClass, measured_class
from cdtool.recordings.motion.motion_class import AVERAGED_SAMPLES, AVERAGED_SECONDS, averaged
from cdtool.recordings.motion.speed_course import stroke_progress
from cdtool.recordings.operations import Operation
from cdtool.results.results import Skipped
from cdtool.thresholds.common_class import SPEED_TOLERANCE

# A run is left out if its speed is off by a tenth of the nominal one over this share of the stroke.
_OFF_SHARE = 0.1
# With fewer runs no common speed along the stroke can be determined.
_ENOUGH = 3
# Points along the stroke at which the speeds of runs are compared: every 1 % of it.
_POINTS = 100


@dataclass(frozen=True)
class _ClassedRun:
    """An impact-free operation and its class by the measured speed."""

    operation: Operation
    motion: MotionClass


def by_class(operations: Sequence[Operation]) -> tuple[list[list[Operation]], list[Skipped]]:
    """Return the runs by class of motion, in order of the first of each, and the runs left out as different.

    A class: one leading joint and direction, nominal speeds close together and at most 10 % from their median.
    """
    kinds: dict[tuple[int, int], list[_ClassedRun]] = {}
    for operation in operations:
        motion = measured_class(operation.recording)
        kinds.setdefault((motion.joint, motion.direction), []).append(_ClassedRun(operation, motion))
    classes: list[list[Operation]] = []
    odd: list[Skipped] = []
    for members in (group for kind in kinds.values() for group in _by_speed(kind)):
        usual, others = _alike(members)
        usual, far = _near_their_median(usual)
        classes.append([run.operation for run in usual])
        odd += [*others, *far]
    place = {id(operation): i for i, operation in enumerate(operations)}
    for group in classes:
        group.sort(key=lambda operation: place[id(operation)])
    return sorted(classes, key=lambda group: place[id(group[0])]), odd


def _by_speed(operations: Sequence[_ClassedRun]) -> list[list[_ClassedRun]]:
    ordered = sorted(operations, key=lambda run: run.motion.nominal_speed)
    groups: list[list[_ClassedRun]] = [[ordered[0]]]
    for before, run in pairwise(ordered):
        # Nominal speeds that differ from the next one by more than 5 % belong to two classes.
        if run.motion.nominal_speed > 1.05 * before.motion.nominal_speed:
            groups.append([])
        groups[-1].append(run)
    made: list[list[_ClassedRun]] = []
    for group in groups:
        median = float(np.median([run.motion.nominal_speed for run in group]))
        common = replace(group[0].motion, nominal_speed=median)
        near = [run for run in group if run.motion.matches(common, SPEED_TOLERANCE)]
        far = [run for run in group if not run.motion.matches(common, SPEED_TOLERANCE)]
        made += [near, *(_by_speed(far) if far and near else [])]
    return [group for group in made if group]


def _alike(runs: list[_ClassedRun]) -> tuple[list[_ClassedRun], list[Skipped]]:
    """Return the runs of a class with the common speed along the stroke, and the others with the reason."""
    if len(runs) < _ENOUGH or runs[0].motion.direction == 0:
        return runs, []
    nominal = float(np.median([run.motion.nominal_speed for run in runs]))
    courses = [_course(run, nominal) for run in runs]
    furthest = float(np.median([travel[-1] if len(travel) else 0.0 for travel, _ in courses]))
    grid, nowhere = np.linspace(0.0, furthest, _POINTS), np.full(_POINTS, np.nan)
    speeds = np.array([np.interp(grid, *course, right=np.nan) if len(course[0]) else nowhere for course in courses])
    # Without the ends: each stroke begins and stops at different positions.
    inner = slice(1, -max(1, _POINTS // 20))
    known = np.isfinite(speeds[:, inner])
    usual = np.array(
        [np.median(column[np.isfinite(column)]) if np.isfinite(column).any() else 0.0 for column in speeds.T]
    )
    off = known & (np.abs(np.nan_to_num(speeds - usual))[:, inner] > 0.1 * nominal)
    share = off.sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    alike = [run for run, part in zip(runs, share, strict=True) if part <= _OFF_SHARE]
    if len(alike) < max(_ENOUGH, len(runs) // 2):
        return runs, []
    odd = []
    for run, where, speed, part in zip(runs, off, speeds, share, strict=True):
        if part > _OFF_SHARE:
            first = 1 + int(np.flatnonzero(where)[0])
            log = run.operation.recording
            unit = f" {log['position'].unit}" if "position" in log else ""
            its, theirs = (run.motion.speed_in_words(item[first]) for item in (speed, usual))
            odd.append(
                Skipped(
                    run.operation.name,
                    f"left out: its speed differs from that of {len(alike)} other runs over {100.0 * part:.0f} % of "
                    f"the stroke, first after {grid[first]:.3g}{unit} of travel: {its}, not {theirs}",
                )
            )
    return alike, odd


def _near_their_median(runs: list[_ClassedRun]) -> tuple[list[_ClassedRun], list[Skipped]]:
    """Return the runs with a nominal speed near the median of those that remain, and the others with the reason."""
    left_out: list[Skipped] = []
    while True:
        median = float(np.median([run.motion.nominal_speed for run in runs]))
        far = [
            run for run in runs if not replace(run.motion, nominal_speed=median).matches(run.motion, SPEED_TOLERANCE)
        ]
        if not far:
            return runs, left_out
        worst = max(far, key=lambda run: abs(run.motion.nominal_speed - median))
        usual = worst.motion.speed_in_words(median)
        words = f"left out: runs {worst.motion.described}, the other {len(runs) - 1} at {usual}"
        left_out.append(Skipped(worst.operation.name, words))
        runs = [run for run in runs if run is not worst]


def _course(run: _ClassedRun, nominal: float) -> tuple[FloatArray, FloatArray]:
    """Return the averaged forward speed over increasing travel."""
    motion, recording = run.motion, run.operation.recording
    series = recording["speed"]
    at = stroke_progress(recording, motion.direction, nominal, motion.joint)
    speed = motion.direction * series.values[:, motion.joint]
    use = np.isfinite(at.travel) & np.isfinite(speed)
    travel, smooth = (
        at.travel[use],
        averaged(series.time[use], speed[use], max(AVERAGED_SECONDS, AVERAGED_SAMPLES * series.period)),
    )
    rising = np.concatenate(([True], np.diff(travel) > 0.0)) if len(travel) else np.empty(0, dtype=bool)
    return travel[rising], smooth[rising]
