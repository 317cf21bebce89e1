"""Samples/s of every registered detector through `signal()`: three machines, each on three kinds of clocks.

One joint, a planar arm and a robot of six joints; every channel on one clock, on one jittered clock, and on its own
jittered clock, as with a topic per channel. Targets: on own clocks at least a seventh of the speed on one clock (numpy
searches the value before each sample), and on six joints at least 1.5 M samples/s for the friction EKF, 0.7 M
for desired dynamics, 0.2 M for the velocity observer.

python benchmarks/detectors.py [machine ...] [--detectors NAME ...] [--rounds N]

The robot needs pinocchio (extra cdtool[urdf]); without it that machine is left out.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np
from arrays import PERIOD, Array, gate
from timing import Spread, main, ratio, table, verdict

from cdtool.detectors import DETECTORS
from cdtool.detectors.detection import Signal
from cdtool.machines.planar_arm import PlanarArm
from cdtool.machines.urdf_robot import UrdfRobot
from cdtool.recordings.recording import Recording, Series

# Samples of the log of each machine: the slowest detector on it takes a quarter of a second.
SAMPLES = {"gate": 300_000, "arm": 200_000, "robot": 40_000}
CLOCKS = ("one clock", "jittered clock", "own clocks")
ROUNDS = 7
AT_LEAST_OF_ONE_CLOCK = 0.15
# M samples/s on six joints, on one clock.
AT_LEAST_ON_SIX_JOINTS = {"velocity": 0.2, "desired_dynamics": 0.7, "friction_ekf": 1.5}
# Standard deviation of the stamps, as a share of the period.
_JITTER = 0.05

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


def measure(machines: list[str], names: list[str], rounds: int) -> bool:
    detectors = {name: DETECTORS.load(name)() for name in names or DETECTORS.names()}
    known = {"gate": gate, "arm": lambda: PlanarArm.of(_ARM), "robot": _robot}
    held = True
    for name in machines or known:
        machine = known[name]()
        if machine is not None:
            held &= _measure_machine(name, machine, detectors, rounds)
    print("M samples/s, median (low-high); a sample has all joints. Every value was finite. No detector finds what")
    print("another one computed: each call has a new recording. The verdicts are based on CPU time.")
    return held


def _measure_machine(name: str, machine: Any, detectors: Mapping[str, Any], rounds: int) -> bool:
    recordings = {clocks: _swinging(machine, SAMPLES[name], clocks) for clocks in CLOCKS}
    tasks = {(key, clocks): (detectors[key], recordings[clocks]) for key in detectors for clocks in CLOCKS}
    for (key, clocks), (detector, log) in tasks.items():
        _check(f"{key} on {name}, {clocks}", detector.signal(log, machine))
    cpu, wall = _interleaved(tasks, machine, rounds)
    print(f"{name}, {len(machine.joints)} joint{'s' if len(machine.joints) > 1 else ''}, {SAMPLES[name]} samples")
    held, rows = True, []
    for key, detector in detectors.items():
        speeds = {task: Spread.of([1e-6 * SAMPLES[name] / value for value in cpu[task]]) for task in tasks}
        walls = [1e-6 * SAMPLES[name] / Spread.of(wall[key, clocks]).median for clocks in CLOCKS]
        share = ratio(cpu[key, "one clock"], cpu[key, "own clocks"])
        held &= verdict(f"{name}, {key}: own clocks / one clock, samples/s", share, AT_LEAST_OF_ONE_CLOCK)
        if name == "robot" and key in AT_LEAST_ON_SIX_JOINTS:
            target = AT_LEAST_ON_SIX_JOINTS[key]
            held &= verdict(f"{name}, {key}: M samples/s on one clock", speeds[key, "one clock"], target)
        rows.append(
            (key, detector.short_name, *(speeds[key, clocks] for clocks in CLOCKS), *(f"{each:.3g}" for each in walls))
        )
    print()
    table(("detector", "short", *(f"{clocks}, CPU" for clocks in CLOCKS), *("wall clock",) * len(CLOCKS)), rows)
    print(flush=True)
    return held


Times = dict[tuple[str, str], list[float]]


def _interleaved(
    tasks: Mapping[tuple[str, str], tuple[Any, Recording]], machine: Any, rounds: int
) -> tuple[Times, Times]:
    """CPU and wall-clock seconds of every task in every round; one round before them is not counted.

    A new recording of the same values has no cached step or period. The order of the clocks changes each round.
    """
    cpu: Times = {task: [] for task in tasks}
    wall: Times = {task: [] for task in tasks}
    names = list(tasks)
    for number in range(-1, rounds):
        turn = number % len(names)
        for name in names[turn:] + names[:turn]:
            detector, log = tasks[name]
            channels = {key: Series(item.time, item.values, item.unit) for key, item in log.channels.items()}
            task = partial(detector.signal, replace(log, channels=channels), machine)
            begin, begin_cpu = perf_counter(), process_time()
            task()
            if number >= 0:
                cpu[name].append(process_time() - begin_cpu)
                wall[name].append(perf_counter() - begin)
    return cpu, wall


def _robot() -> Any:
    """Return a robot of six joints; None without pinocchio."""
    if find_spec("pinocchio") is None:
        print("the robot is left out: pinocchio is not installed (pip install 'cdtool[urdf]')")
        return None
    joints = [f"joint{k}" for k in range(_ROBOT_JOINTS)]
    parts = ['<robot name="six"><link name="base"/>']
    for k in range(_ROBOT_JOINTS):
        mass = 6.0 - 0.9 * k
        parent, turn = f"link{k - 1}" if k else "base", (0.0, 1.5708, 0.0, -1.5708, 1.5708, -1.5708)[k]
        parts.append(_LINK.format(k=k, mass=mass, inertia=0.01 * mass, parent=parent, turn=turn))
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "six.urdf").write_text("\n".join([*parts, "</robot>"]), encoding="utf-8")
        values = {"urdf": "six.urdf", "joints": joints, "drive_inertia": 0.3, "viscous_friction": 5.0}
        return UrdfRobot.of(values, str(Path(folder) / "machine.toml"))


def _swinging(machine: Any, samples: int, clocks: str) -> Recording:
    """Every joint oscillates at a different frequency; torque as required by the motion; noise on the measurements."""
    rng = np.random.default_rng(4)
    joints = len(machine.joints)
    rate, amplitude = rng.uniform(0.5, 2.0, joints), rng.uniform(0.2, 0.6, joints)
    units, channels, shared = machine.load_units, {}, _clock(samples, clocks, rng)
    noises = {"torque": 0.1, "speed": 1e-3, "position": 1e-4, "acceleration": 0.1}
    for channel in (*noises, "reference_position", "reference_speed"):
        time = _clock(samples, clocks, rng) if clocks == "own clocks" else shared
        phase = time[:, np.newaxis] * rate
        motion = {
            "position": amplitude * np.sin(phase),
            "speed": amplitude * rate * np.cos(phase),
            "acceleration": -amplitude * rate**2 * np.sin(phase),
        }
        quantity = channel.removeprefix("reference_")
        values: Array = machine.required_torque(*motion.values()) if quantity == "torque" else motion[quantity]
        noise = noises.get(channel, 0.0) * rng.standard_normal(values.shape)
        channels[channel] = Series(time, values + noise, units[quantity])
    return Recording("swinging", "benchmark", machine.joints, channels)


def _clock(samples: int, clocks: str, rng: np.random.Generator) -> Array:
    """Return the times of a clock [s]; own clocks have their own phase, and all but one clock jitter."""
    time: Array = np.arange(samples) * PERIOD
    if clocks == "own clocks":
        time = time + PERIOD * rng.random()
    if clocks != "one clock":
        time = time + PERIOD * np.clip(_JITTER * rng.standard_normal(samples), -0.4, 0.4)
    return time


def _check(name: str, signal: Signal) -> None:
    if not np.isfinite(signal.values).all():
        sys.exit(f"error: {name}: values that are not finite")
    if not signal.valid.any():
        sys.exit(f"error: {name}: no sample that may be judged ({signal.why_not()})")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("machines", nargs="*", choices=[*SAMPLES, []])
    parser.add_argument("--detectors", nargs="+", default=[])
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    options = parser.parse_args()
    main("every detector, samples/s", lambda: measure(options.machines, options.detectors, options.rounds))
