"""No verdict, status or band up to a sample changes when later samples do, from the recording to the verdict.

`python -m tests.contracts.prefixes --count 2000 --seed 1` tries random prefixes over every detector and threshold, on
three machines, with and without reference channels. Each log holds strokes of several classes of motion, one of a
speed that was not learned, a contact, missing values, gaps, and channels on clocks of their own; what comes after the
prefix is cut off, or replaced by something else.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, detect_operations, run_detector_on_each
from cdtool.base.errors import CdtoolError
from cdtool.commands.learning.fitting import Fitted, fitting, for_machine
from cdtool.detectors import DETECTORS
from cdtool.machines.linear_axis import LinearAxis
from cdtool.machines.planar_arm import PlanarArm
from cdtool.recordings.motion import motion_class
from cdtool.recordings.operations import Operation, operations_of
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds import THRESHOLDS
from tests.synthetic.robots import six_joint_robot

PERIOD = 2e-3
RUNS = 10
# Forward and backward strokes of two speeds that are learned, and one that is not [rad/s or m/s].
LEARNED = (0.3, -0.3, 0.15)
TRIED = (0.3, -0.3, 0.22, 0.15)
MACHINES = ("axis", "arm", "robot")
# Settings of a signature that make its band depend on the run.
SETTINGS: tuple[tuple[tuple[str, Any], ...], ...] = (
    (("adaptive_level", 6.0),),
    (("speed_range", True),),
    (("adaptive_level", 6.0), ("speed_range", True)),
)


@cache
def machine_of(name: str) -> Any:
    """The machine of that name: one, two or six joints."""
    if name == "axis":
        values = {"motor_inertia": 9.5e-4, "load_mass": 620.0, "transmission_ratio": 1.333e-3, "viscous_friction": 2e-4}
        return LinearAxis.of(values)
    if name == "arm":
        keys = {
            "coordinates": "motor",
            "link_mass": [1.3, 1.6],
            "link_length": 0.30,
            "centre_of_mass": [0.14, 0.18],
            "link_inertia": [0.012, 0.018],
            "motor_inertia": 1.5e-5,
            "transmission_ratio": 1.0 / 60.0,
            "imu_position": [0.22, 0.20],
        }
        return PlanarArm.of(keys)
    return six_joint_robot(Path(tempfile.mkdtemp()))


def log(machine: Any, speeds: Sequence[float], rng: np.random.Generator, contact_at: float = np.inf) -> Recording:
    """Strokes one after another, each 0.4 s of rest, a ramp, 0.6 s at its speed and a ramp; all joints move alike.

    From `contact_at` [s] a contact presses for 0.3 s and slows the first joint to a third.
    """
    shape = np.concatenate((np.zeros(200), np.linspace(0.0, 1.0, 120), np.ones(300), np.linspace(1.0, 0.0, 120)))
    first = np.concatenate([speed * shape for speed in speeds] + [np.zeros(200)])
    time = PERIOD * np.arange(len(first))
    pressing = (time >= contact_at) & (time < contact_at + 0.3)
    first = first * np.where(pressing, 1.0 / 3.0, 1.0)
    joints = len(machine.joints)
    speed = first[:, np.newaxis] * np.linspace(1.0, 0.5, joints)
    position = np.cumsum(speed, axis=0) * PERIOD
    acceleration = np.gradient(speed, PERIOD, axis=0)
    torque = machine.required_torque(position, speed, acceleration)
    torque = torque + np.where(pressing[:, np.newaxis], 0.5 * np.std(torque, axis=0) + 5.0, 0.0)
    units = machine.load_units
    channels: dict[str, Series] = {}
    for name, values in (
        ("torque", torque),
        ("speed", speed),
        ("position", position),
        ("acceleration", acceleration),
    ):
        scatter = 0.02 * (np.std(values, axis=0) + 1e-3) * rng.standard_normal(values.shape)
        channels[name] = Series(time, values + scatter, units[name])
        if name in ("speed", "position", "torque"):
            channels[f"reference_{name}"] = Series(time, values, units[name])
    return Recording("log", "made up", machine.joints, channels)


def on_own_clocks(recording: Recording, rng: np.random.Generator) -> Recording:
    """Every channel resampled on a jittering clock of its own, by its last value."""
    channels = {}
    for name, series in recording.channels.items():
        steps = PERIOD * rng.uniform(0.7, 1.5, len(series.time))
        time = rng.uniform(0.0, PERIOD) + np.cumsum(steps)
        time = time[time < series.time[-1]]
        at = np.searchsorted(series.time, time, side="right") - 1
        channels[name] = Series(time, series.values[np.maximum(at, 0)], series.unit)
    return replace(recording, channels=channels)


def damaged(recording: Recording, rng: np.random.Generator) -> Recording:
    """Bursts of NaN and lost rows in every measured channel."""
    channels = dict(recording.channels)
    for name, series in recording.channels.items():
        values = series.values.copy()
        for start in rng.integers(0, len(values), 3):
            values[start : start + int(rng.integers(1, 30))] = np.nan
        kept = np.ones(len(values), dtype=bool)
        for start in rng.integers(0, len(values), 3):
            kept[start : start + int(rng.integers(1, 30))] = False
        channels[name] = Series(series.time[kept], values[kept], series.unit)
    return replace(recording, channels=channels)


def without_reference(recording: Recording) -> Recording:
    """The thesis's four channels alone."""
    channels = {name: item for name, item in recording.channels.items() if not name.startswith("reference")}
    return replace(recording, channels=channels)


def another_future(recording: Recording, end: float, rng: np.random.Generator) -> Recording:
    """The same up to `end` [s]; then nothing, or other values, at other times."""
    kind = rng.integers(3)
    channels = {}
    for name, series in recording.channels.items():
        past = series.between(-np.inf, end)
        if kind == 0 or len(past) == len(series):
            channels[name] = past
            continue
        later = series.time[len(past) :]
        values = series.values[len(past) :]
        if kind == 1:
            values = 7.0 * values[::-1] + 3.0 * np.std(values, axis=0) + 1.0
        else:
            later = end + np.cumsum(rng.uniform(0.2, 9.0, len(later)) * PERIOD)
            values = np.where(rng.random(values.shape) < 0.3, np.nan, rng.standard_normal(values.shape) * 1e3)
        channels[name] = Series(np.concatenate((past.time, later)), np.concatenate((past.values, values)), series.unit)
    return replace(recording, channels={name: item for name, item in channels.items() if len(item)})


@dataclass(frozen=True)
class Combination:
    """A detector and a threshold on a machine, with or without reference channels."""

    machine: str
    reference: bool
    detector: str
    threshold: str
    settings: tuple[tuple[str, Any], ...] = ()

    def __str__(self) -> str:
        reference = "with" if self.reference else "without"
        settings = "".join(f", {name} {value}" for name, value in self.settings)
        return f"{self.machine}, {reference} reference, {self.detector} x {self.threshold}{settings}"


def combinations() -> Iterator[Combination]:
    """Every one that is registered."""
    for machine in MACHINES:
        for reference in (False, True):
            for detector in DETECTORS.names(plugins=True):
                for threshold in THRESHOLDS.names(plugins=True):
                    yield Combination(machine, reference, detector, threshold)
    for machine in MACHINES:
        for settings in SETTINGS:
            yield Combination(machine, False, "momentum", "signature", settings)


@cache
def runs(machine: str, reference: bool) -> tuple[Operation, ...]:
    """Strokes to learn from, several classes in each log."""
    rng = np.random.default_rng(5)
    logs = [log(machine_of(machine), LEARNED, rng) for _ in range(RUNS)]
    logs = [replace(item, name=f"run{i}", digest=f"run{i}") for i, item in enumerate(logs)]
    chosen = [item if reference else without_reference(item) for item in logs]
    return tuple(stroke for item in chosen for stroke in operations_of(item, "motion"))


@cache
def signals(machine: str, reference: bool, detector: str) -> tuple[Any, ...]:
    """The detector's signal of each stroke to learn from."""
    found: list[Any] = []
    strokes = runs(machine, reference)
    for number in range(0, len(strokes), len(LEARNED)):
        cut = strokes[number : number + len(LEARNED)]
        found += run_detector_on_each(cut, machine_of(machine), DETECTORS.load(detector)())
    return tuple(found)


def learned(item: Combination) -> Fitted:
    """What the combination learns; raises CdtoolError where it cannot be used on these logs."""
    made = signals(item.machine, item.reference, item.detector)
    rule = for_machine(THRESHOLDS.load(item.threshold)(**dict(item.settings)), machine_of(item.machine))
    return fitting(rule)(list(zip(runs(item.machine, item.reference), made, strict=True)))


def tried_log(item: Combination, rng: np.random.Generator) -> Recording:
    """A log to judge, without its comforts."""
    recording = log(machine_of(item.machine), TRIED, rng, contact_at=float(rng.uniform(0.5, 5.0)))
    recording = recording if item.reference else without_reference(recording)
    if rng.random() < 0.5:
        recording = damaged(recording, rng)
    return on_own_clocks(recording, rng) if rng.random() < 0.5 else recording


def verdict(item: Combination, recording: Recording, fitted: Fitted, how: str, activation: Activation) -> Detection:
    """The verdict on a whole log that is cut by `how`."""
    operation = Operation(recording, motion_class(recording), 1, recording, how)
    machine, detector = machine_of(item.machine), DETECTORS.load(item.detector)()
    return detect_operations([operation], machine, detector, fitted.thresholds, activation)[0]


def difference(whole: Detection, other: Detection, end: float) -> str:
    """What differs up to `end` [s]; empty where nothing does."""
    n = int(np.searchsorted(whole.statistic.time, end, side="right"))
    if n != int(np.searchsorted(other.statistic.time, end, side="right")):
        return "the number of samples"
    for name, ours, theirs in (
        ("status", whole.statistic.status, other.statistic.status),
        ("statistic", whole.statistic.values, other.statistic.values),
        ("lower limit", whole.band.lower, other.band.lower),
        ("upper limit", whole.band.upper, other.band.upper),
    ):
        judged = whole.statistic.valid[:n] if name != "status" else np.ones(ours[:n].shape, dtype=bool)
        unequal = judged & (ours[:n] != theirs[:n])
        if unequal.any():
            first = int(np.flatnonzero(unequal.any(axis=1))[0])
            return f"the {name} at {whole.statistic.time[first]:.3f} s of {end:.3f} s"
    alarms = [
        [(alarm.time, alarm.joint, alarm.side, alarm.statistic, alarm.limit) for alarm in found if alarm.time <= end]
        for found in (whole.verdict.alarms, other.verdict.alarms)
    ]
    return "the alarms" if alarms[0] != alarms[1] else ""


def try_prefixes(item: Combination, count: int, seed: int) -> tuple[int, list[str]]:
    """How many prefixes were tried of a combination, and what changed; none where it cannot be used on these logs."""
    try:
        fitted = learned(item)
    except CdtoolError:
        return 0, []
    if not fitted.thresholds:
        return 0, []
    rng = np.random.default_rng([seed, sum(map(ord, str(item)))])
    changes = []
    for _ in range(count):
        recording = tried_log(item, rng)
        how = "motion" if rng.random() < 0.7 else "whole"
        activation = Activation(latch=bool(rng.random() < 0.3), hysteresis=0.2 if rng.random() < 0.3 else 0.0)
        whole = verdict(item, recording, fitted, how, activation)
        end = float(rng.uniform(recording.start + 0.6, recording.end))
        other = verdict(item, another_future(recording, end, rng), fitted, how, activation)
        if words := difference(whole, other, end):
            changes.append(f"{item}, cut by {how}: {words} changed")
    return count, changes


def main() -> int:
    """Try them all; 1 where one changed, or a combination was tried less than `--least` times."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=2000, help="prefixes in all")
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    everything = list(combinations())
    usable = [item for item in everything if _usable(item)]
    each = -(-chosen.count // len(usable))
    tried, changes = 0, []
    for item in usable:
        done, found = try_prefixes(item, max(3, each), chosen.seed)
        tried += done
        changes += found
    print(f"{len(usable)} of {len(everything)} combinations can be used on these logs")
    print(f"{tried} prefixes tried, at least {max(3, each)} per combination: {len(changes)} changes")
    print("\n".join(changes[:20]))
    return 1 if changes else 0


def _usable(item: Combination) -> bool:
    try:
        return bool(learned(item).thresholds)
    except CdtoolError:
        return False


if __name__ == "__main__":
    sys.exit(main())
