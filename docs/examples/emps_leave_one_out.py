"""EMPS: each stroke against a signature from the other three of its direction; then the recording with force pulses.

    python docs/examples/emps_leave_one_out.py FOLDER_OF_EMPS

FOLDER_OF_EMPS holds DATA_EMPS.mat and DATA_EMPS_PULSES.mat. Three runs are far too few for a signature; it takes
force = True, and the limits are less sure than those from ten runs.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

import cdtool
from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, detect_operation
from cdtool.commands.learning.fitting import fit_operations
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.recordings.operations import Operation, operations_of
from cdtool.thresholds.signature import Signature

DETECTORS = ("gm", "pt")
RULE = Signature(force=True)


def strokes_of(path: Path, machine: MachineFile) -> list[Operation]:
    """The strokes of a recording, cut by motion."""
    return operations_of(cdtool.read(path, machine), "motion")


def judge(stroke: Operation, runs: list[Operation], machine: MachineFile, detector: Any) -> Detection:
    """What the detector says of a stroke, its normal band learned from `runs`."""
    fitted = fit_operations(runs, machine.machine, detector, RULE).thresholds
    return detect_operation(stroke, machine.machine, detector, fitted, Activation())


def beyond(found: Detection) -> float:
    """By how much the signal leaves its band at most on the side that opposes the motion; negative: it stays inside."""
    signal, band = found.statistic, found.band
    forward = found.operation.motion.direction > 0
    outside = signal.values - band.upper if forward else band.lower - signal.values
    return float(np.max(outside[signal.valid]))


def main(folder: Path) -> int:
    """Print both tables; returns the number of strokes with a false alarm in the first."""
    machine = read_machine_file(Path(__file__).with_name("emps.toml"))
    strokes = strokes_of(folder / "DATA_EMPS.mat", machine)
    false_alarms = 0
    print("detector  stroke  direction  verdict    beyond its limit by (negative: inside)")
    for name in DETECTORS:
        detector = machine.detector(name)
        for stroke in strokes:
            found = judge(stroke, [other for other in strokes if other is not stroke], machine, detector)
            false_alarms += found.verdict.outcome == "alarm"
            way = "forward" if stroke.motion.direction > 0 else "backward"
            unit = found.statistic.unit
            print(f"{name:8}  {stroke.number:6}  {way:9}  {found.verdict.outcome:9}  {beyond(found):6.2f} {unit}")
    print(f"{false_alarms} strokes with a false alarm")

    pulses = folder / "DATA_EMPS_PULSES.mat"
    if pulses.exists():
        print("with force pulses in the command: detector, stroke, alarms, beyond its limit by")
        for name in DETECTORS:
            for stroke in strokes_of(pulses, machine):
                found = judge(stroke, strokes, machine, machine.detector(name))
                alarms = len(found.verdict.alarms)
                print(f"{name:8}  {stroke.number:6}  {alarms:6}  {beyond(found):6.1f} {found.statistic.unit}")
    return false_alarms


if __name__ == "__main__":
    sys.exit(1 if main(Path(sys.argv[1])) else 0)
