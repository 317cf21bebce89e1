"""EMPS: force pulses as external forces, and how soon detectors notice them after signatures of four strokes.

    python docs/examples/emps_pulses_as_forces.py FOLDER_OF_EMPS

The pulses in DATA_EMPS_PULSES.mat were added to the command. Taken out of the torque channel they are forces from
outside, of known size and time, on a real machine: 5 V, 176 N, for 0.5 s. They rise in one sample, as a hard contact
does, but they do not stop the axis. The start of a pulse opposes a backward stroke, its end a forward one.
Signatures are learned from the four strokes of each direction in DATA_EMPS.mat, which are too few: force = True.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

import cdtool
from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, detect_operation
from cdtool.base.arrays import FloatArray
from cdtool.commands.learning.fitting import fit_operations
from cdtool.formats.machine_file import read_machine_file
from cdtool.recordings.operations import Operation, operations_of
from cdtool.recordings.recording import Recording
from cdtool.thresholds.signature import Signature

DETECTORS = ("gm", "pt")
RULE = Signature(sides="one", force=True)
# An alarm belongs to a step of the force up to this long after it [s].
WINDOW = 0.3


def opposing_steps(time: FloatArray, pulse: FloatArray, direction: int) -> FloatArray:
    """Return the times at which a step of the force opposes a motion [s]."""
    change = np.diff(pulse)
    return time[1:][change > 0.0] if direction < 0 else time[1:][change < 0.0]


def without_pulses(recording: Recording, pulse: FloatArray, volt: float) -> Recording:
    """Return the recording with the pulses (n,) [V] taken out of its torque; `volt`: the force of one volt [N]."""
    torque = recording["torque"]
    known = torque.with_values(torque.values - volt * pulse[:, np.newaxis], torque.unit)
    return replace(recording, channels={**recording.channels, "torque": known})


def in_words(found: Detection, steps: FloatArray) -> str:
    """Return the alarm and the time since the step before it."""
    if not found.verdict.alarms:
        return found.verdict.outcome
    first = found.verdict.alarms[0].time
    since = first - steps[steps <= first]
    near = len(since) and since.min() <= WINDOW
    return f"alarm, {1e3 * since.min():.0f} ms after a step" if near else "alarm without a step before it"


def main(folder: Path) -> int:
    """Print the verdict of each detector on each stroke."""
    machine = read_machine_file(Path(__file__).with_name("emps.toml"))
    free = operations_of(cdtool.read(folder / "DATA_EMPS.mat", machine), "motion")
    values = loadmat(folder / "DATA_EMPS_PULSES.mat")
    time, pulse = values["t"].ravel(), values["pulses_N"].ravel().astype(float)
    logged = cdtool.read(folder / "DATA_EMPS_PULSES.mat", machine)
    struck = operations_of(without_pulses(logged, pulse, 35.15), "motion")
    for name in DETECTORS:
        detector: Any = machine.detector(name)

        def verdict(stroke: Operation, runs: list[Operation], detector: Any = detector) -> Detection:
            fitted = fit_operations(runs, machine.machine, detector, RULE).thresholds
            return detect_operation(stroke, machine.machine, detector, fitted, Activation(debounce=3))

        quiet = [verdict(stroke, [other for other in free if other is not stroke]) for stroke in free]
        alarms = sum(item.verdict.outcome == "alarm" for item in quiet)
        print(f"{name}: {alarms} of {len(quiet)} strokes without a force alarm, each judged by the other three")
        for number, stroke in enumerate(struck, 1):
            steps = opposing_steps(time, pulse, stroke.motion.direction)
            way = "forward" if stroke.motion.direction > 0 else "backward"
            print(f"  stroke {number}  {way:8}  {in_words(verdict(stroke, free), steps)}")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
