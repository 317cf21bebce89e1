"""Injected against recorded force pulses on a real linear axis (EMPS), at the momentum observer and in the position.

The axis repeats the same references twice. In DATA_EMPS_PULSES.mat a pulse of 5 V (176 N) for 0.5 s is added to its
command every second; with the pulse taken out of the torque channel again, it is an external force of known size and
time, which the controller did not command. `cdtool identify` sees only the recording without pulses, DATA_EMPS.mat. Its
model is simulated twice, without and with the force, and the difference is added to DATA_EMPS.mat. The momentum
observer then runs on this recording and on the one with real pulses.

python benchmarks/emps_pulses.py                    # the folder emps/ of $CDTOOL_DATA, by default of ../shared/data
python benchmarks/emps_pulses.py --data FOLDER
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
from timing import main, table

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import cdtool  # noqa: E402
from cdtool.commands.inject.channel_change import ChannelChange  # noqa: E402
from cdtool.commands.inject.injected_logs import injected_recording  # noqa: E402
from cdtool.detectors.momentum import Momentum  # noqa: E402
from cdtool.formats.channels.channel_assembly import LoggedRecording  # noqa: E402
from cdtool.formats.channels.reading import read_as_logged  # noqa: E402
from cdtool.formats.machine_file import MachineFile, read_machine_file  # noqa: E402
from cdtool.machines.axis import Axis  # noqa: E402
from cdtool.machines.axis_model.axis_run import AxisRun, axis_run  # noqa: E402
from cdtool.machines.axis_model.model_table import axis_model  # noqa: E402
from cdtool.machines.axis_model.parameters import AxisModel  # noqa: E402
from cdtool.machines.axis_model.simulation import AxisInputs, simulate_axis  # noqa: E402
from cdtool.recordings.recording import Recording  # noqa: E402

Array = npt.NDArray[np.float64]

DATA = Path(os.environ.get("CDTOOL_DATA", ROOT.parent / "shared" / "data")) / "emps"
MACHINE = ROOT / "docs" / "examples" / "emps.toml"
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
        sys.exit("error: the two recordings have different references")
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


def show_times(times: Sequence[CrossingTimes]) -> None:
    rows = []
    for item in times:
        difference = item.difference
        rows.append(
            (
                f"{item.threshold:.0f} N",
                f"{np.nanmean(item.recorded):.2f}",
                f"{np.nanmean(item.injected):.2f}",
                f"{np.nanmean(difference):+.2f}",
                f"{np.nanmin(difference):+.2f} to {np.nanmax(difference):+.2f}",
                f"{int(np.isnan(item.recorded).sum())} and {int(np.isnan(item.injected).sum())}",
                "ok" if item.is_met else "WORSE",
            )
        )
    table(("threshold", "recorded ms", "injected ms", "difference", "of each pulse", "not crossed", ""), rows)


def measure(folder: Path) -> bool:
    machine_file = identified(folder)
    _, model = model_of(machine_file)
    controller = model.controller
    if controller is None:
        print("WORSE no controller was identified")
        return False
    print(
        f"identified: {model.drive.total_mass:.2f} kg, viscous {model.friction.viscous:.1f} N s/m, Coulomb "
        f"{model.friction.coulomb_forward:.2f} and {model.friction.coulomb_backward:.2f} N, offset "
        f"{model.friction.offset:.2f} N, gains {controller.position_gain:.2f} 1/s and {controller.speed_gain:.0f} N s/m"
    )
    axes = compared(folder, machine_file, model)
    times, displaced = crossing_times(axes), list(displacements(axes))
    forces = np.unique(axes.pulses[axes.pulses != 0.0])
    print(f"{len(axes.sections)} pulses of {', '.join(f'{force:.1f}' for force in forces)} N, momentum observer with")
    print(f"K = {BANDWIDTH:g} rad/s; every time within {LARGEST_TIME:g} ms\n")
    show_times(times)
    errors = [item.error for item in displaced]
    good = max(errors) <= LARGEST_DISPLACEMENT
    print(
        f"\n{'ok   ' if good else 'WORSE'} largest displacement: recorded "
        f"{1e6 * min(item.recorded for item in displaced):.0f} to {1e6 * max(item.recorded for item in displaced):.0f} "
        f"micrometres, error {100 * min(errors):.1f} to {100 * max(errors):.1f} % (at most "
        f"{100 * LARGEST_DISPLACEMENT:g} %)"
    )
    shares = [100 * item.root_mean_square for item in displaced]
    print(f"      over the whole pulse: RMS {min(shares):.1f} to {max(shares):.1f} %")
    for item in sorted(displaced, key=lambda item: -item.largest)[:2]:
        print(f"      largest difference {100 * item.largest:.0f} % of the peak in the pulse at {item.start:.3f} s")
    return good and all(item.is_met for item in times)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=DATA)
    main("injected and recorded force pulses", partial(measure, parser.parse_args().data))
