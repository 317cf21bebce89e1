"""Injected against recorded force pulses on a real linear axis (EMPS), at the momentum observer and in the position.

The axis repeats the same references twice. In DATA_EMPS_PULSES.mat a pulse of 5 V (176 N) for 0.5 s is added to its
command every second; with the pulse taken out of the torque channel again, it is an external force of known size and
time, which the controller did not command. `cdtool identify` sees only the recording without pulses, DATA_EMPS.mat. Its
model is simulated twice, without and with the force, and the difference is added to DATA_EMPS.mat. The momentum
observer then runs on this recording and on the one with real pulses.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

import cdtool
from cdtool.commands.inject.channel_change import ChannelChange
from cdtool.commands.inject.injected_logs import injected_recording
from cdtool.detectors.momentum import Momentum
from cdtool.formats.channels.channel_assembly import LoggedRecording
from cdtool.formats.channels.reading import read_as_logged
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.machines.axis import Axis
from cdtool.machines.axis_model.axis_run import AxisRun, axis_run
from cdtool.machines.axis_model.model_table import axis_model
from cdtool.machines.axis_model.parameters import AxisModel
from cdtool.machines.axis_model.simulation import AxisInputs, simulate_axis
from cdtool.recordings.recording import Recording
from tests.project.pages import DOCS

Array = npt.NDArray[np.float64]

MACHINE = DOCS / "examples" / "emps.toml"
FREE, PULSES, PULSE_COLUMN = "DATA_EMPS.mat", "DATA_EMPS_PULSES.mat", "pulses_N"
THRESHOLDS = (15.0, 40.0, 80.0, 120.0, 160.0)  # N
BANDWIDTH = 100.0  # rad/s: the observer's residual reaches each of the thresholds
LARGEST_TIME, LARGEST_DISPLACEMENT = 1.5, 0.06  # ms; share of the recorded displacement
_BEFORE = 0.02  # s before a pulse: the two recordings differ by their mean here without any pulse
_SAME_REFERENCE = 1e-9  # m


@dataclass(frozen=True, eq=False)
class Axes:
    """The three recordings on the load side on one clock, the axis, and the pulses' force (n,) [N] on the load."""

    machine: Axis
    free: Recording
    injected: Recording
    recorded: Recording
    pulses: Array

    @property
    def sections(self) -> list[slice]:
        """The samples of each pulse."""
        edges = np.diff(self.pulses != 0.0, prepend=False, append=False)
        begin, end = np.flatnonzero(edges).reshape(-1, 2).T
        return [slice(int(first), int(last)) for first, last in zip(begin, end, strict=True)]


@dataclass(frozen=True, eq=False)
class CrossingTimes:
    """When the residual crosses a threshold [ms after the onset of each pulse]; NaN where it does not."""

    threshold: float
    injected: Array
    recorded: Array

    @property
    def difference(self) -> Array:
        return self.injected - self.recorded

    @property
    def is_met(self) -> bool:
        """Whether every pulse crosses in both recordings, within the time allowed."""
        return bool(np.all(np.abs(self.difference) <= LARGEST_TIME))


@dataclass(frozen=True)
class Displacement:
    """What a pulse from `start` [s] displaces at most [m], and how the whole courses over time differ.

    `root_mean_square` of the difference over that of the recorded course; `largest` difference over the recorded peak.
    """

    start: float
    injected: float
    recorded: float
    root_mean_square: float
    largest: float

    @property
    def error(self) -> float:
        """Share of the recorded peak."""
        return abs(self.injected - self.recorded) / self.recorded


def identified(folder: Path) -> MachineFile:
    """The machine file that `cdtool identify` writes from the recording without pulses."""
    with tempfile.TemporaryDirectory() as written:
        target = Path(written) / "emps.toml"
        cdtool.identify([folder / FREE], MACHINE, target)
        return read_machine_file(target)


def model_of(machine_file: MachineFile) -> tuple[Axis, AxisModel]:
    machine = machine_file.machine
    if not isinstance(machine, Axis):
        raise TypeError(f"{machine_file.path} describes no axis")
    return machine, axis_model(machine, machine_file.model)


def read_pulses(path: Path, factor: float) -> Array:
    """The force (n,) [N]; the column is in V, in spite of its name."""
    from scipy.io import loadmat

    pulses: Array = factor * loadmat(path)[PULSE_COLUMN].ravel().astype(np.float64)
    return pulses


def compared(folder: Path, machine_file: MachineFile, model: AxisModel) -> Axes:
    """The recording without pulses, with injected pulses, and with recorded ones; stops if they are not comparable."""
    machine, _ = model_of(machine_file)
    free = read_as_logged(folder / FREE, machine_file)
    hit = read_as_logged(folder / PULSES, machine_file)
    references = [log.recording["reference_position"] for log in (free, hit)]
    if len(references[0]) != len(references[1]) or not np.allclose(
        references[0].values, references[1].values, rtol=0.0, atol=_SAME_REFERENCE
    ):
        raise ValueError("the two recordings have different references")
    pulses = read_pulses(folder / PULSES, hit.factors["torque"][0])
    torque = hit.recording["torque"]
    without = torque.with_values(torque.values - pulses[:, np.newaxis], torque.unit)
    recorded = replace(hit.recording, channels={**hit.recording.channels, "torque": without})
    injected = with_force(free, machine, model, pulses)
    return Axes(
        machine,
        free.on_load_side(machine),
        replace(free, recording=injected).on_load_side(machine),
        replace(hit, recording=recorded).on_load_side(machine),
        pulses,
    )


def with_force(free: LoggedRecording, machine: Axis, model: AxisModel, force: Array) -> Recording:
    """The recording as logged, with what a force (n,) [N] on the load changes: the difference of two simulations.

    The force is one per sample of the log.
    """
    run = axis_run(free.on_load_side(machine))
    assert run.reference_position is not None
    clock = free.recording["torque"].time
    inputs = AxisInputs(np.zeros(len(run)), reference_position=run.reference_position)
    disturbance = mean_force(clock, force, run)
    quiet, pushed = (simulate_axis(model, item) for item in (inputs, replace(inputs, disturbance=disturbance)))
    start = float(clock[np.flatnonzero(force)[0]])
    change = {
        channel: ChannelChange(run.time, (pushed[row] - quiet[row])[:, np.newaxis], start)
        for channel, row in (("torque", "drive_force"), ("position", "motor_position"))
    }
    # The axis pushes back with the opposite force.
    external = ChannelChange(run.time, -disturbance[:, np.newaxis], start, held=True)
    return injected_recording(free.recording, machine, change, external, (0,))


def mean_force(clock: Array, force: Array, run: AxisRun) -> Array:
    """The mean of a held force (n,) over each period of a run: the model's samples are not those of the log.

    The steps of the log are quantised, so that the two clocks are 0.4 ms apart after 25 s.
    """
    impulse = np.concatenate(([0.0], np.cumsum(force[:-1] * np.diff(clock))))
    edges = run.start + run.period * np.arange(len(run) + 1)
    mean: Array = np.diff(np.interp(edges, clock, impulse)) / run.period
    return mean


def crossing_times(axes: Axes) -> list[CrossingTimes]:
    """The times of every threshold, of all pulses."""
    observer = Momentum(bandwidth=BANDWIDTH)
    time = axes.recorded["speed"].time
    # A force in the direction of positive travel gives a negative residual.
    residuals = [-observer.signal(item, axes.machine).values[:, 0] for item in (axes.injected, axes.recorded)]
    found = []
    for threshold in THRESHOLDS:
        both = [
            np.array([_first_crossing(time[part], residual[part], threshold) for part in axes.sections])
            for residual in residuals
        ]
        found.append(CrossingTimes(threshold, *both))
    return found


def _first_crossing(time: Array, values: Array, threshold: float) -> float:
    """The time [ms] after the first sample, linear between two; NaN if it is never crossed or was before."""
    beyond = np.flatnonzero(values >= threshold)
    if not len(beyond) or beyond[0] == 0:
        return math.nan
    at = int(beyond[0])
    return 1e3 * float(np.interp(threshold, values[at - 1 : at + 1], time[at - 1 : at + 1]) - time[0])


def displacements(axes: Axes) -> Iterator[Displacement]:
    """What every pulse displaces."""
    time = axes.free["position"].time
    count = round(_BEFORE / axes.free["position"].period)
    # The injected recording ends with the simulation, a sample earlier.
    end = len(axes.injected["position"])
    free, injected, recorded = (item["position"].values[:end, 0] for item in (axes.free, axes.injected, axes.recorded))
    for part in axes.sections:
        before = slice(max(part.start - count, 0), part.start)
        courses = [(item - free)[part] - float(np.mean((item - free)[before])) for item in (injected, recorded)]
        error = courses[0] - courses[1]
        peak = float(np.max(courses[1]))
        share = float(np.linalg.norm(error) / np.linalg.norm(courses[1]))
        yield Displacement(
            float(time[part.start]), float(np.max(courses[0])), peak, share, float(np.max(np.abs(error))) / peak
        )
