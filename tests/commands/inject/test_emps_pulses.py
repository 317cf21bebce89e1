"""Injected against recorded force pulses on a real linear axis (EMPS), at the momentum observer and in the position.

The axis repeats the same references twice. In DATA_EMPS_PULSES.mat a pulse of 5 V (176 N) for 0.5 s is added to its
command every second; with the pulse taken out of the torque channel again, it is an external force of known size and
time, which the controller did not command. `cdtool identify` sees only the recording without pulses, DATA_EMPS.mat. Its
model is simulated twice, without and with the force, and the difference is added to DATA_EMPS.mat. The momentum
observer then runs on this recording and on the one with real pulses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import cdtool
from cdtool.commands.inject.assumption import ControllerReaction
from cdtool.commands.inject.axis_contact import axis_contact
from cdtool.commands.inject.channel_change import ChannelChange
from cdtool.commands.inject.injected_logs import injected_recording
from cdtool.commands.inject.with_injected import refusal
from cdtool.detectors.momentum import Momentum
from cdtool.formats.channels.channel_assembly import LoggedRecording
from cdtool.formats.channels.reading import read_as_logged
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.machines.axis import Axis
from cdtool.machines.axis_model.axis_run import AxisRun, axis_run
from cdtool.machines.axis_model.model_table import axis_model
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.axis_model.parameters import AxisModel
from cdtool.machines.axis_model.simulation import AxisInputs, simulate_axis
from cdtool.recordings.recording import Recording
from tests.data_folder import data, needs_data
from tests.project.pages import DOCS

Array = npt.NDArray[np.float64]

FREE, PULSES, PULSE_COLUMN = "DATA_EMPS.mat", "DATA_EMPS_PULSES.mat", "pulses_N"
THRESHOLDS = (15.0, 40.0, 80.0, 120.0, 160.0)  # N
OBSERVER = Momentum(bandwidth=100.0)  # its residual reaches each of the thresholds
BEFORE = 0.02  # s before a pulse: the two recordings differ by their mean here without any pulse
recordings = needs_data(f"emps/{FREE}", f"emps/{PULSES}")


@dataclass(frozen=True, eq=False)
class Axes:
    """The three recordings on the load side on one clock, the axis, and the samples of each pulse."""

    machine: Axis
    free: Recording
    injected: Recording
    recorded: Recording
    pulses: list[slice]


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> tuple[MachineFile, AxisModel]:
    """What `cdtool identify` writes from the recording without pulses."""
    target = tmp_path_factory.mktemp("identified") / "emps.toml"
    cdtool.identify([data("emps") / FREE], DOCS / "examples" / "emps.toml", target)
    machine_file = read_machine_file(target)
    assert isinstance(machine_file.machine, Axis)
    return machine_file, axis_model(machine_file.machine, machine_file.model)


@pytest.fixture(scope="module")
def axes(identified: tuple[MachineFile, AxisModel]) -> Axes:
    return compared(data("emps"), *identified)


def compared(folder: Path, machine_file: MachineFile, model: AxisModel) -> Axes:
    """The recording without pulses, with injected pulses, and with recorded ones."""
    from scipy.io import loadmat

    machine = machine_file.machine
    assert isinstance(machine, Axis)
    free, hit = (read_as_logged(folder / name, machine_file) for name in (FREE, PULSES))
    references = [log.recording["reference_position"].values for log in (free, hit)]
    assert np.allclose(*references, rtol=0.0, atol=1e-9), "comparable only with the same references"
    # The column is in V, in spite of its name.
    force: Array = hit.factors["torque"][0] * loadmat(folder / PULSES)[PULSE_COLUMN].ravel().astype(np.float64)
    torque = hit.recording["torque"]
    without = torque.with_values(torque.values - force[:, np.newaxis], torque.unit)
    recorded = replace(hit.recording, channels={**hit.recording.channels, "torque": without})
    injected = with_force(free, machine, model, force)
    edges = np.flatnonzero(np.diff(force != 0.0, prepend=False, append=False)).reshape(-1, 2)
    return Axes(
        machine,
        free.on_load_side(machine),
        replace(free, recording=injected).on_load_side(machine),
        replace(hit, recording=recorded).on_load_side(machine),
        [slice(int(first), int(last)) for first, last in edges],
    )


def with_force(free: LoggedRecording, machine: Axis, model: AxisModel, force: Array) -> Recording:
    """The recording as logged, with what a force (n,) [N] on the load changes: the difference of two simulations."""
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


def crossing_times(axes: Axes) -> tuple[Array, Array]:
    """When the residual crosses each threshold [ms after the onset of each pulse]: injected, recorded."""
    time = axes.recorded["speed"].time
    # A force in the direction of positive travel gives a negative residual.
    injected, recorded = (-OBSERVER.signal(item, axes.machine).values[:, 0] for item in (axes.injected, axes.recorded))
    injected_at, recorded_at = (
        np.array([[first_crossing(time[part], of[part], least) for part in axes.pulses] for least in THRESHOLDS])
        for of in (injected, recorded)
    )
    return injected_at, recorded_at


def first_crossing(time: Array, values: Array, threshold: float) -> float:
    """The time [ms] after the first sample, linear between two; NaN if it is never crossed or was before."""
    beyond = np.flatnonzero(values >= threshold)
    if not len(beyond) or beyond[0] == 0:
        return math.nan
    at = int(beyond[0])
    return 1e3 * float(np.interp(threshold, values[at - 1 : at + 1], time[at - 1 : at + 1]) - time[0])


def displacements(axes: Axes) -> tuple[Array, Array, Array]:
    """Of every pulse: the recorded peak [m], the error of the injected one and the root mean square, as shares."""
    count = round(BEFORE / axes.free["position"].period)
    # The injected recording ends with the simulation, a sample earlier.
    end = len(axes.injected["position"])
    free, injected, recorded = (item["position"].values[:end, 0] for item in (axes.free, axes.injected, axes.recorded))
    found = []
    for part in axes.pulses:
        before = slice(max(part.start - count, 0), part.start)
        one, other = ((item - free)[part] - float(np.mean((item - free)[before])) for item in (injected, recorded))
        share = np.linalg.norm(one - other) / np.linalg.norm(other)
        found.append((np.max(other), abs(np.max(one) / np.max(other) - 1.0), share))
    peak, error, share = np.array(found).T
    return peak, error, share


@recordings
def test_the_residual_crosses_every_threshold_when_the_recorded_one_does(axes: Axes) -> None:
    injected, recorded = crossing_times(axes)
    late = injected - recorded
    assert late.shape == (5, 25)
    # Near its plateau the residual rises slowly.
    assert np.max(np.abs(late[:4])) <= 1.5 and np.max(np.abs(late[4])) <= 2.0
    assert np.max(np.abs(np.mean(late, axis=1))) <= 0.75
    # An observer that did not follow the force would cross all thresholds at once, or none.
    assert np.all(np.diff(np.mean(recorded, axis=1)) > 1.5)


@recordings
def test_the_displacement_is_within_six_percent_of_the_recorded_one(axes: Axes) -> None:
    peak, error, share = displacements(axes)
    assert len(peak) == 25 and np.all((peak > 140e-6) & (peak < 180e-6))
    assert np.max(error) <= 0.06 and np.max(share) <= 0.04


@recordings
@pytest.mark.parametrize("wrong", ["soft controller", "heavy load"])
def test_a_wrong_model_does_not_meet_the_limits(identified: tuple[MachineFile, AxisModel], wrong: str) -> None:
    machine_file, model = identified
    if wrong == "soft controller":
        assert model.controller is not None
        model = replace(model, controller=replace(model.controller, speed_gain=0.8 * model.controller.speed_gain))
    else:
        model = replace(model, drive=replace(model.drive, load_mass=1.5 * model.drive.load_mass))
    axes = compared(data("emps"), machine_file, model)
    injected, recorded = crossing_times(axes)
    assert np.max(displacements(axes)[1]) > 0.06
    assert wrong == "soft controller" or not np.all(np.abs(injected - recorded) <= 1.5)


@recordings
@pytest.mark.parametrize("at", [5.0, 7.5])  # s, in either direction
def test_an_obstacle_can_be_put_before_the_real_axis(
    identified: tuple[MachineFile, AxisModel], axes: Axes, at: float
) -> None:
    _, model = identified
    assert refusal(Momentum.needs, model, ControllerReaction.KNOWN) is None
    delays = []
    for stiffness in (5e3, 500e3):
        contact = axis_contact(axis_run(axes.free), model, Obstacle.spring(stiffness), at, 0.3)
        recording = injected_recording(axes.free, axes.machine, contact.changes, contact.force, (0,))
        signal = OBSERVER.signal(axes.machine.referred_to_load(recording), axes.machine)
        opposed = np.sign(contact.speed) * signal.values[:, 0]
        assert np.max(opposed[(signal.time > at - 0.5) & (signal.time <= at)]) < 25.0
        delays.append(1e3 * (signal.time[np.argmax((signal.time > at) & (opposed > 40.0))] - at))
    assert 3.0 < delays[1] < 12.0 < delays[0] < 100.0
