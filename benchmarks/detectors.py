"""Samples/s of every registered detector through its public path, on one joint, a planar arm and a robot of six joints.

The robot needs pinocchio (extra cdtool[urdf]); without it that column is left out. No target: the numbers show the
cost of each detector compared with the others.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from arrays import PERIOD, Array, gate
from timing import Spread, interleaved, main, table

from cdtool.detection import Signal
from cdtool.detectors import DETECTORS
from cdtool.machines.planar_arm import PlanarArm
from cdtool.machines.urdf_robot import UrdfRobot
from cdtool.recording import Recording, Series
from cdtool.tables import Table

# Samples of the log of each machine: the slowest detector on it takes a quarter of a second.
SAMPLES = {"gate": 300_000, "arm": 200_000, "robot": 40_000}
ROUNDS = 5

_ARM = {
    "coordinates": "load",
    "link_mass": [1.3, 1.6],
    "link_length": 0.3,
    "centre_of_mass": [0.14, 0.18],
    "link_inertia": [0.012, 0.018],
    "viscous_friction": 0.4,
}
_ROBOT_JOINTS = 6
_LINK = """<link name="link{k}"><inertial><origin xyz="0.02 0.01 0.12"/><mass value="{mass}"/><inertia ixx="{inertia}"
iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="joint{k}" type="revolute">
<parent link="{parent}"/><child link="link{k}"/><origin xyz="0.05 0 0.3" rpy="{turn} 0.1 0.2"/><axis xyz="0 0 1"/>
<limit effort="100" velocity="3" lower="-3" upper="3"/></joint>"""


def measure() -> bool:
    logs = {"gate": gate(), "arm": PlanarArm.from_table(Table(_ARM, "benchmark"))} | _robots()
    recordings = {name: _swinging(machine, SAMPLES[name]) for name, machine in logs.items()}
    detectors = {name: DETECTORS.load(name)() for name in DETECTORS.names()}
    rows: dict[str, list[object]] = {name: [detector.short_name] for name, detector in detectors.items()}
    for name, machine in logs.items():
        log = recordings[name]
        tasks: dict[str, Callable[[], Signal]] = {
            key: partial(detector.signal, log, machine) for key, detector in detectors.items()
        }
        for key, task in tasks.items():
            _check(f"{key} on {name}", task())
        for key, seconds in interleaved(tasks, ROUNDS).items():
            rows[key].append(Spread.of([1e-6 * SAMPLES[name] / second for second in seconds]))
    heads = [
        f"{name}: {len(machine.joints)} joints" if name != "gate" else "gate: 1 joint" for name, machine in logs.items()
    ]
    table(("detector", "short", *heads), [(key, *row) for key, row in rows.items()])
    print("M samples/s, median (low-high); a sample has all joints. Each gave a finite value for every sample.")
    return True


def _robots() -> dict[str, Any]:
    if find_spec("pinocchio") is None:
        print("the robot is left out: pinocchio is not installed (pip install 'cdtool[urdf]')")
        return {}
    joints = [f"joint{k}" for k in range(_ROBOT_JOINTS)]
    parts = ['<robot name="six"><link name="base"/>']
    for k in range(_ROBOT_JOINTS):
        mass = 6.0 - 0.9 * k
        parent, turn = f"link{k - 1}" if k else "base", (0.0, 1.5708, 0.0, -1.5708, 1.5708, -1.5708)[k]
        parts.append(_LINK.format(k=k, mass=mass, inertia=0.01 * mass, parent=parent, turn=turn))
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "six.urdf").write_text("\n".join([*parts, "</robot>"]), encoding="utf-8")
        values = {"urdf": "six.urdf", "joints": joints, "drive_inertia": 0.3, "viscous_friction": 5.0}
        return {"robot": UrdfRobot.from_table(Table(values, str(Path(folder) / "machine.toml")))}


def _swinging(machine: Any, samples: int) -> Recording:
    """Every joint oscillates at a different frequency; torque as required by the motion; noise on the measurements."""
    rng = np.random.default_rng(4)
    joints = len(machine.joints)
    time = np.arange(samples) * PERIOD
    rate, amplitude = rng.uniform(0.5, 2.0, joints), rng.uniform(0.2, 0.6, joints)
    phase = time[:, np.newaxis] * rate
    position, speed = amplitude * np.sin(phase), amplitude * rate * np.cos(phase)
    acceleration = -amplitude * rate**2 * np.sin(phase)
    torque = machine.required_torque(position, speed, acceleration)
    units = machine.load_units

    def measured(values: Array, noise: float) -> Array:
        return values + noise * rng.standard_normal(values.shape)

    channels = {
        "torque": Series(time, measured(torque, 0.1), units["torque"]),
        "speed": Series(time, measured(speed, 1e-3), units["speed"]),
        "position": Series(time, measured(position, 1e-4), units["position"]),
        "acceleration": Series(time, measured(acceleration, 0.1), units["acceleration"]),
        "reference_position": Series(time, position, units["position"]),
        "reference_speed": Series(time, speed, units["speed"]),
    }
    return Recording("swinging", "benchmark", machine.joints, channels)


def _check(name: str, signal: Signal) -> None:
    if not np.isfinite(signal.values).all():
        sys.exit(f"error: {name}: values that are not finite")
    if not signal.valid.any():
        sys.exit(f"error: {name}: no sample that may be judged ({signal.why_not()})")


if __name__ == "__main__":
    main("every detector, samples/s", measure)
