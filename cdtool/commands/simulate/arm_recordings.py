"""Simulated arm runs as files, as a test bench would log them, with machine.toml, benchmark.toml and contacts.csv."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from cdtool.base.errors import UsageError
from cdtool.commands.simulate.arm_model import ArmRun, Array, simulate_arm_run
from cdtool.commands.simulate.arm_parameters import ArmParameters, Trial, require_trial
from cdtool.commands.simulate.changed_machine import ChangedMachine
from cdtool.commands.simulate.recording_folder import (
    EPOCH_NS,
    GROUPS,
    IMPACT_OF,
    Bench,
    without_references,
    write_folder,
)
from cdtool.recordings.units import UNITS

_JOINTS = ("arm", "forearm")
# CSV: torque, speed, acceleration and force to steps far below their noise; encoders in whole counts.
_DECIMALS = {
    "t": "%.0f",
    "tau_1": "%.1f",
    "tau_2": "%.1f",
    "n_1": "%.1f",
    "n_2": "%.1f",
    "phi_1": "%.0f",
    "phi_2": "%.0f",
    "az_1": "%.2f",
    "az_2": "%.2f",
    "load_cell": "%.2f",
    "n_ref_1": "%.1f",
    "n_ref_2": "%.0f",
    "phi_ref_1": "%.0f",
    "phi_ref_2": "%.0f",
}
# MCAP: a fieldbus's fixed-point numbers; their short mantissas are what makes the files small.
_BUS_STEP = {
    "effort": 2.0**-17,  # N m
    "velocity": 2.0**-8,  # rad/s
    "position": 2.0**-12,  # rad
    "acceleration": 2.0**-10,  # m/s2
    "force": 2.0**-7,  # N
}
# Joint watched in each trial: the one whose link is hit.
_WATCHED = {1: "arm", 2: "forearm"}
_BENCHMARK_RULES = (
    "[signature]",
    "position_step = 2e-3             # rad of the arm",
    "position_window = 22e-3",
    'sides = "one"',
    "",
    "[activation]",
    "debounce = 7",
    "",
    "[onset]",
    "above_n = 0.5",
    "back_to_n = 0.5",
    "hold_s = 0.003",
)


def simulate_arm(  # noqa: PLR0913  # the public function: a keyword for each setting
    folder: Path,
    counts: Mapping[str, int],
    seed: int,
    trial: Trial = 1,
    *,
    file_format: str = "csv",
    progress: Callable[[int, int], None] | None = None,
    parameters: ArmParameters | None = None,
    references: bool = True,
    changed: ChangedMachine | None = None,
) -> int:
    """Write recordings of a simulated two-link arm to a folder, with a machine file and a benchmark file.

    Parameters
    ----------
    folder : Path
        An empty or new folder.
    counts : mapping of str to int
        Number of recordings of each group: free, holdout (both impact-free), stiff, soft.
    seed : int
        Seed of the noise and of the variations between runs. A run depends only on seed, trial, group and number; the
        same seed writes the same bytes.
    trial : {1, 2}, optional
        Trial of the thesis, chapter 6: the link that is hit is the arm (1) or the forearm (2).
    file_format : {"csv", "mcap", "mixed"}, optional
        "mixed": the first two of each group as MCAP, the others as CSV.
    progress : callable, optional
        Called after each recording with the number done and the total.
    parameters : ArmParameters, optional
        Parameters of the arm.
    references : bool, optional
        Log reference channels.
    changed : ChangedMachine, optional
        What has changed since the machine file was written; it is that of the unchanged arm.

    Returns
    -------
    int
        The number of recordings written.

    Raises
    ------
    UsageError
        No recording is requested, the folder is not empty, the trial is unknown, or the encoders are ideal.

    Examples
    --------
    >>> import cdtool
    >>> from pathlib import Path
    >>> cdtool.simulate_arm(Path("myarm"), {"stiff": 1}, seed=1, trial=2)
    1
    >>> sorted(path.name for path in Path("myarm/stiff").iterdir())
    ['01.csv']
    """
    require_trial(trial)
    arm, machine = parameters or ArmParameters(), changed or ChangedMachine()
    if arm.encoder_counts < 1:
        raise UsageError(f"encoder_counts is {arm.encoder_counts}", "The logs hold counts: 1 or more per revolution.")

    def simulate(group: str, number: int) -> ArmRun:
        rng = np.random.default_rng([seed, trial, GROUPS.index(group), number])
        run = simulate_arm_run(machine.arm(arm), rng, trial, IMPACT_OF[group])
        return machine.logged_arm(run, arm.torque_constant)

    settings = (
        f"# Made by cdtool simulate arm --trial {trial}. Paths are relative to this file.",
        'machine = "machine.toml"',
        'detectors = ["feekf", "igm", "gm"]',
        f'joints = ["{_WATCHED[trial]}"]                 # the link that is hit',
    )
    count = 2.0 * math.pi / arm.encoder_counts
    log_csv = partial(_write_csv, count=count, references=references)
    log_mcap = partial(_write_mcap, references=references)
    text = _machine_toml(arm, count) if references else without_references(_machine_toml(arm, count))
    bench = Bench(simulate, log_csv, log_mcap, text, settings, _BENCHMARK_RULES)
    return write_folder(folder, counts, file_format, bench, progress)


def _write_csv(path: Path, run: ArmRun, count: float, references: bool) -> None:
    from cdtool.formats.csv import write_csv

    rpm, milli = UNITS["rpm"].factor, UNITS["mN m"].factor
    by_joint = {
        "tau": run.motor_torque / milli,
        "n": run.motor_speed / rpm,
        "phi": run.motor_position / count,
        "az": run.imu,
    }
    wanted = {"n_ref": run.reference_speed / rpm, "phi_ref": run.reference_position / count} if references else {}
    columns = {"t": run.time * 1e3, **_split(by_joint), "load_cell": run.load_cell, **_split(wanted)}
    write_csv(path, columns, _DECIMALS)


def _split(by_joint: Mapping[str, Array]) -> dict[str, Array]:
    return {f"{name}_{joint + 1}": values[:, joint] for name, values in by_joint.items() for joint in (0, 1)}


def _write_mcap(path: Path, run: ArmRun, references: bool) -> None:
    from cdtool.formats.mcap.write import Stream, write_mcap

    measured = {"position": run.motor_position, "velocity": run.motor_speed, "effort": run.motor_torque}
    wanted = {"position": run.reference_position, "velocity": run.reference_speed}
    imu, force = _on_bus("acceleration", run.imu), _on_bus("force", run.load_cell)
    streams = [
        Stream("/joint_states", "sensor_msgs/msg/JointState", run.time, _all_on_bus(measured), _JOINTS),
        Stream("/imu", "std_msgs/msg/Float64MultiArray", run.time, {"data": imu}),
        Stream("/load_cell", "geometry_msgs/msg/WrenchStamped", run.time, {"wrench.force.x": force}),
    ]
    if references:
        streams.append(Stream("/reference", "sensor_msgs/msg/JointState", run.time, _all_on_bus(wanted), _JOINTS))
    write_mcap(path, streams, start_ns=EPOCH_NS)


def _on_bus(name: str, values: Array) -> Array:
    return np.asarray(np.rint(values / _BUS_STEP[name]) * _BUS_STEP[name], dtype=np.float64)


def _all_on_bus(fields: Mapping[str, Array]) -> dict[str, Array]:
    return {name: _on_bus(name, values) for name, values in fields.items()}


def _machine_toml(arm: ArmParameters, count: float) -> str:
    viscous = [arm.viscous_friction * ratio**2 for ratio in arm.transmission_ratio]
    scale = f"{count:.10g}"
    return f"""simulated = true  # a robot arm by cdtool simulate arm: what its maker would know of it
[machine]
type = "planar_arm"
name = "robot arm"
joints = ["arm", "forearm"]
coordinates = "motor"              # logs hold motor torque, angle and speed; q = n theta + position_offset
link_mass = {_pair(arm.link_mass)}             # kg, the forearm with the wrist
link_length = {arm.arm_length:.6g}                  # m, first link: shoulder to elbow
centre_of_mass = {_pair(arm.centre_of_mass)}      # m, from the joint along the link
link_inertia = {_pair(arm.link_inertia)}      # kg m2, about the centre of mass
motor_inertia = {_pair(arm.motor_inertia)}  # kg m2
transmission_ratio = {_pair(arm.transmission_ratio)}  # rad/rad: link angle per motor angle
position_offset = [0.0, 0.0]       # rad
imu_position = {_pair(arm.imu_position)}         # m, from the joint along the link
viscous_friction = {_pair(viscous)}  # N m s/rad at the motor
stick_speed = 0.01                 # rad/s: the encoders' speed is noisy at rest
gravity = {arm.gravity:.6g}                     # m/s2

[channels]                         # CSV: columns
time = {{ column = "t", unit = "ms" }}
torque = {{ columns = ["tau_1", "tau_2"], unit = "mN m" }}  # from the motors' PWM
speed = {{ columns = ["n_1", "n_2"], unit = "rpm" }}
position = {{ columns = ["phi_1", "phi_2"], unit = "count", scale = {scale} }}  # rad per count
acceleration = {{ columns = ["az_1", "az_2"], unit = "m/s2" }}  # inertial sensors, across the links
force = {{ column = "load_cell", unit = "N" }}                 # ground truth only
reference_speed = {{ columns = ["n_ref_1", "n_ref_2"], unit = "rpm" }}
reference_position = {{ columns = ["phi_ref_1", "phi_ref_2"], unit = "count", scale = {scale} }}

[channels.mcap]                    # MCAP: topics, SI units
torque = {{ topic = "/joint_states", field = "effort[:]" }}
speed = {{ topic = "/joint_states", field = "velocity[:]" }}
position = {{ topic = "/joint_states", field = "position[:]" }}
acceleration = {{ topic = "/imu", field = "data[:]" }}
force = {{ topic = "/load_cell", field = "wrench.force.x" }}
reference_speed = {{ topic = "/reference", field = "velocity[:]" }}
reference_position = {{ topic = "/reference", field = "position[:]" }}

[detectors.momentum]
bandwidth = 86.0                   # rad/s

[detectors.inertial_momentum]
bandwidth = 86.0
crossover = 7.0710678              # rad/s: k2 = crossover^2 = 50
damping = 1.7677670                # k1 = 2 damping crossover = 25

[detectors.friction_ekf]
sigma_acceleration = 0.4           # rad/s2
sigma_speed = 0.01                 # rad/s
sigma_position = 1e-3              # rad
friction_drift = 2.5               # N m s/rad per sqrt(s)
drift_acceleration = 0.0375        # rad/s2 per sample
drift_speed = 1e-3                 # rad/s per sample
drift_position = 1e-4              # rad per sample
minimum_speed = 0.05               # rad/s

# Not in the thesis: the same bandwidth of 86 rad/s for the others.
[detectors.velocity]
bandwidth = 86.0                   # rad/s

[detectors.energy]
bandwidth = 86.0                   # rad/s

[detectors.direct]
cutoff = 13.7                      # Hz

[detectors.desired_dynamics]
cutoff = 13.7                      # Hz
tracking_limit = 0.1               # rad

[detectors.kalman_momentum]
sigma_speed = 0.01                 # rad/s
sigma_torque = 0.1                 # N m
contact_drift = 0.35               # N m per sqrt(s)
"""


def _pair(values: Sequence[float]) -> str:
    return f"[{values[0]!r}, {values[1]!r}]"
