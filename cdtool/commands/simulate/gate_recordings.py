"""Simulated gate runs as files, as a test bench would log them, with machine.toml, benchmark.toml and contacts.csv."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from cdtool.commands.simulate.changed_machine import ChangedMachine
from cdtool.commands.simulate.gate_model import GateParameters, GateRun, simulate_gate_run
from cdtool.commands.simulate.recording_folder import (
    EPOCH_NS,
    GROUPS,
    IMPACT_OF,
    Bench,
    without_references,
    write_folder,
)
from cdtool.recordings.units import UNITS

__all__ = ["GROUPS", "gate_bench", "simulate_gate"]

# What the fictitious drive and sensors log: motor current, revolutions, an accelerometer mounted backward.
_TORQUE_CONSTANT = 0.56  # N m/A
_DECIMALS = {
    "t": "%.0f",
    "i_motor": "%.4f",
    "n_motor": "%.3f",
    "phi": "%.5f",
    "acc_x": "%.6f",
    "load_cell": "%.5f",
    "n_ref": "%.3f",
    "i_ref": "%.4f",
}
_BENCHMARK_SETTINGS = (
    "# Made by cdtool simulate gate. Paths are relative to this file.",
    'machine = "machine.toml"',
    'detectors = ["pi", "feekf", "gm", "igm", "pt"]',
)
_BENCHMARK_RULES = ("[onset]", "above_n = 20.0", "back_to_n = 8.0")


def simulate_gate(  # noqa: PLR0913  # the public function: a keyword for each setting
    folder: Path,
    counts: Mapping[str, int],
    seed: int,
    *,
    file_format: str = "csv",
    progress: Callable[[int, int], None] | None = None,
    parameters: GateParameters | None = None,
    references: bool = True,
    changed: ChangedMachine | None = None,
) -> int:
    """Write recordings of a simulated sliding gate to a folder, with a machine file and a benchmark file.

    Parameters
    ----------
    folder : Path
        An empty or new folder.
    counts : mapping of str to int
        Number of recordings of each group: free, holdout (both impact-free), stiff, soft.
    seed : int
        Seed of the noise and of the variations between runs. A run depends only on seed, group and number; the same
        seed writes the same bytes.
    file_format : {"csv", "mcap", "mixed"}, optional
        "mixed": the first two of each group as MCAP, the others as CSV.
    progress : callable, optional
        Called after each recording with the number done and the total.
    parameters : GateParameters, optional
        Parameters of the gate.
    references : bool, optional
        Log reference channels.
    changed : ChangedMachine, optional
        What has changed since the machine file was written; it is that of the unchanged gate.

    Returns
    -------
    int
        The number of recordings written.

    Raises
    ------
    UsageError
        No recording is requested, or the folder is not empty.

    Examples
    --------
    >>> import cdtool
    >>> from pathlib import Path
    >>> cdtool.simulate_gate(Path("mygate"), {"stiff": 1}, seed=1)
    1
    >>> sorted(path.name for path in Path("mygate").iterdir())
    ['contacts.csv', 'machine.toml', 'stiff']
    """
    new, changed = parameters or GateParameters(), changed or ChangedMachine()
    gate = changed.gate(new)

    def simulate(group: str, number: int) -> GateRun:
        rng = np.random.default_rng([seed, GROUPS.index(group), number])
        return changed.logged_gate(simulate_gate_run(gate, rng, IMPACT_OF[group]), _TORQUE_CONSTANT)

    bench = gate_bench(new, simulate, references)
    return write_folder(folder, counts, file_format, bench, progress)


def gate_bench(
    gate: GateParameters, simulate: Callable[[str, int], GateRun], references: bool = True
) -> Bench[GateRun]:
    """Return how runs of the gate are logged, for any function `simulate` of group and number."""
    log_csv, log_mcap = partial(_write_csv, references=references), partial(_write_mcap, references=references)
    text = _machine_toml(gate) if references else without_references(_machine_toml(gate))
    return Bench(simulate, log_csv, log_mcap, text, _BENCHMARK_SETTINGS, _BENCHMARK_RULES)


def _write_csv(path: Path, run: GateRun, references: bool) -> None:
    from cdtool.formats.csv import write_csv

    rpm, gravity = UNITS["rpm"].factor, UNITS["g"].factor
    columns = {
        "t": run.time * 1e3,
        "i_motor": run.motor_torque / _TORQUE_CONSTANT,
        "n_motor": run.motor_speed / rpm,
        "phi": run.motor_position,
        "acc_x": -run.acceleration / gravity,
        "load_cell": run.load_cell * 1e-3,
    }
    if references:
        columns |= {"n_ref": run.reference_speed / rpm, "i_ref": run.reference_torque / _TORQUE_CONSTANT}
    write_csv(path, columns, _DECIMALS)


def _write_mcap(path: Path, run: GateRun, references: bool) -> None:
    from cdtool.formats.mcap.write import Stream, write_mcap

    streams = [
        Stream(
            "/joint_states",
            "sensor_msgs/msg/JointState",
            run.time,
            {"position[0]": run.motor_position, "velocity[0]": run.motor_speed, "effort[0]": run.motor_torque},
        ),
        Stream("/imu", "sensor_msgs/msg/Imu", run.time, {"linear_acceleration.x": -run.acceleration}),
        Stream("/load_cell", "geometry_msgs/msg/WrenchStamped", run.time, {"wrench.force.x": run.load_cell}),
    ]
    if references:
        fields = {"data[0]": run.reference_speed, "data[1]": run.reference_torque}
        streams.append(Stream("/reference", "std_msgs/msg/Float64MultiArray", run.time, fields))
    write_mcap(path, streams, start_ns=EPOCH_NS)


def _machine_toml(gate: GateParameters) -> str:
    viscous = gate.viscous_friction * gate.transmission_ratio**2
    return f"""simulated = true  # a sliding gate by cdtool simulate gate: what its maker would know of it
[machine]
type = "linear_axis"
name = "gate"
motor_inertia = {gate.motor_inertia:.4g}           # kg m2
load_mass = {gate.leaf_mass:.6g}                 # kg
transmission_ratio = {gate.transmission_ratio:.6g}  # m/rad: load travel per motor angle
viscous_friction = {viscous:.5g}    # N m s/rad at the motor
coulomb_friction = 0.0          # N m at the motor: not known, it goes into the signature

[channels]                      # CSV: columns
time = {{ column = "t", unit = "ms" }}
torque = {{ column = "i_motor", unit = "A", scale = {_TORQUE_CONSTANT} }}  # scale: N m per A
speed = {{ column = "n_motor", unit = "rpm" }}
position = {{ column = "phi", unit = "rad" }}
acceleration = {{ column = "acc_x", unit = "g", scale = -1 }}     # mounted backward
force = {{ column = "load_cell", unit = "kN" }}                   # ground truth only
reference_speed = {{ column = "n_ref", unit = "rpm" }}
reference_torque = {{ column = "i_ref", unit = "A", scale = {_TORQUE_CONSTANT} }}

[channels.mcap]                 # MCAP: topics, SI units
torque = {{ topic = "/joint_states", field = "effort[0]" }}
speed = {{ topic = "/joint_states", field = "velocity[0]" }}
position = {{ topic = "/joint_states", field = "position[0]" }}
acceleration = {{ topic = "/imu", field = "linear_acceleration.x", scale = -1 }}
force = {{ topic = "/load_cell", field = "wrench.force.x" }}
reference_speed = {{ topic = "/reference", field = "data[0]" }}
reference_torque = {{ topic = "/reference", field = "data[1]" }}
"""
