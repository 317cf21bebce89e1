"""UR10e: limits learned from five seconds without contact, applied to three recordings of the real arm.

    python docs/examples/ur10e_collisions.py
    python docs/examples/ur10e_collisions.py --detectors momentum --factor 4 --block 0.25

The recordings are in sample_logs/ur10e. docs/real-recordings.md states what the results prove and what they do not.
Needs the extra cdtool[urdf].
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import cdtool
from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, detect_operation, run_detector
from cdtool.detectors.detection import Alarm
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.recordings.operations import Operation, operations_of
from cdtool.recordings.recording import Contact, Recording
from cdtool.thresholds.limit import Limit
from cdtool.truth.matching import Matching, match

FOLDER = Path(__file__).resolve().parents[2] / "sample_logs" / "ur10e"
DETECTORS = ("momentum", "kalman_momentum", "velocity", "direct", "energy")
LEARNED_FROM = "no_torque.csv.gz"
RECORDINGS = (LEARNED_FROM, "link4.csv.gz", "ur-static.csv.gz")

# Seconds after the first row: an abrupt stop begins there, and what follows is left out.
JUDGED_UNTIL = {"no_torque.csv.gz": 5.0, "link4.csv.gz": 16.93, "ur-static.csv.gz": math.inf}
# Contacts in seconds after the first row. They come from a momentum observer and the eye: no independent labels.
WINDOWS = {
    "no_torque.csv.gz": (),
    "link4.csv.gz": ((3.46, 4.14), (9.67, 9.96), (16.63, 16.93)),
    "ur-static.csv.gz": ((3.4, 5.7), (11.8, 15.9), (25.6, 31.0), (38.0, 43.0)),
}
# The windows open at 12 or 15 N m, a lower limit is crossed sooner; a push ends in a twitch of the arm [s].
BEFORE, AFTER = 0.25, 0.5

# Samples of 10 or 12 ms, so that one sample, the default's 9 ms, would be no debounce at all.
DEBOUNCE = 3

CAVEATS = """\
The windows are no independent labels: they come from a momentum observer and the eye; no force was measured.
Friction at rest is not known to the model: up to about the Coulomb value of a joint stays in its residual.
The limits come from five seconds of one fast motion: they know no rest, no creeping, no other pose and no other day.
Left out: no_torque from 5.00 s and link4 from 16.93 s (abrupt stops), columns 19-24 of link4 (not the target
currents). The steps are 10 or 12 ms, 94 to 96 Hz."""


@dataclass(frozen=True)
class Judged:
    """One recording with one detector, its alarms matched to the contacts."""

    recording: Recording
    detection: Detection
    matching: Matching


def load(folder: Path, name: str, machine: MachineFile) -> Recording:
    """A recording up to its stop."""
    recording = cdtool.read(folder / name, machine)
    return recording.between(recording.start, recording.start + JUDGED_UNTIL[name])


def learn_limit(recording: Recording, machine: MachineFile, detector: Any, factor: float, block: float) -> list[float]:
    """Return one limit per joint, rounded up to 0.1: the larger of both sides of `Limit`, with blocks [s] as runs.

    A push may come from either side, and five seconds do not visit both sides of a joint alike.
    """
    signal = run_detector(operations_of(recording)[0], machine.machine, detector)
    number = np.floor((signal.time - recording.start) / block).astype(int)
    runs = []
    for i in range(round(JUDGED_UNTIL[LEARNED_FROM] / block)):
        rows = number == i
        part = replace(signal, time=signal.time[rows], values=signal.values[rows], status=signal.status[rows])
        if part.valid.any(axis=0).all():  # else the detector is still starting up
            runs.append((recording, part))
    fitted = Limit(safety_factor=factor).fit(runs)
    sides = zip(fitted.lower, fitted.upper, strict=True)
    return [math.ceil(10.0 * max(-lower, upper)) / 10.0 for lower, upper in sides]


def judge(recording: Recording, name: str, machine: MachineFile, detector: Any, limit: list[float]) -> Judged:
    """The alarms of a recording, each contact with its first crossing within a second, and the false alarms."""
    operation: Operation = operations_of(recording)[0]
    detection = detect_operation(operation, machine.machine, detector, (Limit.given(limit),), Activation(DEBOUNCE))
    start = recording.start
    contacts = [Contact(start + a, start + b + AFTER, BEFORE, found_by="observer and eye") for a, b in WINDOWS[name]]
    return Judged(recording, detection, match(detection.verdict, contacts, detection.statistic, window=1.0))


def closest(judged: Judged) -> str:
    """The largest signal without contact, as a share of its limit."""
    signal, band = judged.detection.statistic, judged.detection.band
    near = np.zeros(len(signal.time), dtype=bool)
    for item in judged.matching.matches:
        near |= (signal.time >= item.contact.start - BEFORE) & (signal.time <= item.contact.end)
    share = np.where(signal.valid & ~near[:, np.newaxis], np.abs(signal.values) / band.upper, 0.0)
    row, joint = np.unravel_index(int(np.argmax(share)), share.shape)
    if share[row, joint] == 0.0:
        return "nothing assessable without contact"
    after = signal.time[row] - judged.recording.start
    return f"{share[row, joint]:.2f} of its limit ({signal.joints[joint]} at {after:.2f} s)"


def described(alarm: Alarm, judged: Judged) -> str:
    """Joint and time of an alarm; for one joint also its speed, since friction is worst known near rest."""
    name = alarm.joint
    text = f"{name} {alarm.time - judged.recording.start:.2f} s"
    if name not in judged.recording.joints:
        return text
    speed = judged.recording["speed"]
    row = int(np.searchsorted(speed.time, alarm.time))
    return f"{text} ({speed.values[row, alarm.column]:.3f} rad/s)"


def report(judged: Judged) -> None:
    """Print the outcome of a recording."""
    statistic, matching = judged.detection.statistic, judged.matching
    alarms = ", ".join(described(alarm, judged) for alarm in judged.detection.verdict.alarms) or "none"
    false = ", ".join(described(alarm, judged) for alarm in matching.false_alarms) or "none"
    print(f"  {Path(judged.recording.source).name}: not assessable {100.0 * (1.0 - statistic.valid.mean()):.0f} %")
    print(f"    alarms: {alarms}")
    for i, item in enumerate(matching.matches, 1):
        if item.alarm:
            late = item.alarm.time - item.contact.start
            found = f"{item.alarm.joint}, {late:+.2f} s after the window's start"
        else:
            found = item.outcome.replace("_", " ") + (f" ({item.reason})" if item.reason else "")
        print(f"    contact {i}: {found}")
    print(f"    false alarms: {len(matching.false_alarms)} ({false}); without contact at most {closest(judged)}")


def run(folder: Path, detectors: Sequence[str], factor: float, block: float) -> dict[str, list[Judged]]:
    """Learn, judge and print; return the judged recordings of each detector."""
    machine = read_machine_file(folder / "machine.toml")
    recordings = {name: load(folder, name, machine) for name in RECORDINGS}
    print(f"limits: mean of the extremes of blocks of {block:g} s, {factor:g} standard deviations further out")
    judged: dict[str, list[Judged]] = {}
    for name in detectors:
        detector = machine.detector(name)
        limit = learn_limit(recordings[LEARNED_FROM], machine, detector, factor, block)
        judged[name] = [judge(recording, log, machine, detector, limit) for log, recording in recordings.items()]
        limits = ",".join(f"{value:g}" for value in limit)
        print(f"\n{name}: --set threshold.limits={limits} {detector.unit(machine.machine)}")
        for item in judged[name]:
            report(item)
    print(f"\n{CAVEATS}")
    return judged


def main() -> int:
    """Return 1 if a momentum observer misses a contact."""
    parser = argparse.ArgumentParser(description="Limits from five seconds without contact, on a real UR10e.")
    parser.add_argument("folder", type=Path, nargs="?", default=FOLDER, help="folder of the recordings")
    parser.add_argument("--detectors", nargs="+", choices=DETECTORS, default=DETECTORS, help="default: all five")
    parser.add_argument("--factor", type=float, default=Limit().safety_factor, help="standard deviations beyond")
    parser.add_argument("--block", type=float, default=0.5, help="length of a block [s]")
    given = parser.parse_args()
    judged = run(given.folder, given.detectors, given.factor, given.block)
    observers = [item for name in ("momentum", "kalman_momentum") for item in judged.get(name, [])]
    return int(any(found.outcome != "detected" for item in observers for found in item.matching.matches))


if __name__ == "__main__":
    sys.exit(main())
