"""Collisions of a six-joint robot, logged as strangers log them: python docs/examples/robot_collisions.py FOLDER

34 CSV files without a header: 40 columns, steps of 17 to 33 ms with jitter, one motion per file that ends in a
collision somewhere on its way, no impact-free run. Columns: time [s], then for six joints position [rad], speed [rad/s]
and motor current [A], the same three as commanded, and the force on the tool [N] in three axes with an offset.
`onsets.csv` contains the true onset of each file [s], which no tool receives.

The robot follows a trapezoidal profile of speed; a contact is a spring of 3 to 12 N/mm on the tool's way; the robot
stops after the force has passed 60 to 120 N. Currents follow from inertia, Coulomb and viscous friction, gravity with
the pose, and the contact through the joints' levers.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdtool.base.arrays import FloatArray

FILES = 34
JOINTS = 6
# Standard deviations of position [rad], speed [rad/s] and current [A].
NOISE = (2e-5, 8e-4, 0.04)
# The motion is computed at this step [s].
_STEP = 1e-3
# How long it takes to stop [s].
_BRAKING = 0.06
# How far the robot is behind its command [s].
_LAG = 0.02
_TORQUE_CONSTANT = np.array([9.5, 9.5, 9.5, 7.0, 7.0, 7.0])  # N m per A, at the joint
_INERTIA = np.array([6.0, 5.0, 2.0, 0.3, 0.2, 0.1])  # kg m2
_VISCOUS = np.array([12.0, 12.0, 8.0, 2.0, 2.0, 1.5])  # N m s/rad
_COULOMB = np.array([9.0, 9.0, 6.0, 2.0, 2.0, 1.5])  # N m
_LEVER = np.array([0.62, 0.48, 0.35, 0.11, 0.08, 0.02])  # m, of the contact force about each joint
_POSE = np.array([0.3, -1.4, 1.6, -1.7, -1.5, 0.2])  # rad


@dataclass(frozen=True)
class Collision:
    """One log: `rows` (n, 40), the true `onset` of its contact [s] and the longest step of its clock before it [s]."""

    rows: FloatArray
    onset: float

    @property
    def time(self) -> FloatArray:
        """Return the times of the rows [s]."""
        return self.rows[:, 0]


def collisions(seed: int = 34) -> list[Collision]:
    """Return all logs of the set."""
    return [_collision(np.random.default_rng([seed, number])) for number in range(FILES)]


def write_collisions(folder: Path, seed: int = 34) -> list[Path]:
    """Write the set as CSV files and `onsets.csv`; return the CSV files of the logs."""
    folder.mkdir(parents=True, exist_ok=True)
    names, onsets = [], ["recording,onset_s"]
    for number, item in enumerate(collisions(seed), 1):
        path = folder / f"hit_{number:02d}.csv"
        np.savetxt(path, item.rows, fmt="%.6g", delimiter=",")
        onsets.append(f"{path.name},{item.onset:.6f}")
        names.append(path)
    (folder / "onsets.csv").write_text("\n".join(onsets) + "\n", encoding="utf-8")
    return names


def _collision(rng: np.random.Generator) -> Collision:
    rest, ramp, cruise = rng.uniform(0.3, 1.0), rng.uniform(0.25, 0.4), rng.uniform(3.5, 6.0)
    time = np.arange(0.0, rest + 2.0 * ramp + cruise, _STEP)
    top = np.array([0.35, 0.22, 0.18, 0.2, 0.1, 0.15]) * rng.choice([-1.0, 1.0], JOINTS) * rng.uniform(0.6, 1.2, JOINTS)
    share = np.clip(np.minimum((time - rest) / ramp, (rest + 2.0 * ramp + cruise - time) / ramp), 0.0, 1.0)
    onset = rest + ramp + rng.uniform(0.45, 0.85) * cruise
    tool_speed = float(np.abs(top) @ _LEVER)
    force, stop = _contact(time, onset, tool_speed, rng)
    # The controller stops the robot, which follows the command with a lag.
    commanded = share * np.clip(1.0 - (time - stop) / _BRAKING, 0.0, 1.0)
    followed = np.interp(time - _LAG, time, commanded)
    speed = followed[:, np.newaxis] * top
    command = commanded[:, np.newaxis] * top
    position = _POSE + np.cumsum(speed, axis=0) * _STEP
    wanted = _POSE + np.cumsum(command, axis=0) * _STEP
    current = _current(position, speed, np.gradient(speed, _STEP, axis=0))
    target = _current(wanted, command, np.gradient(command, _STEP, axis=0)) * rng.uniform(0.85, 0.95)
    current += force[:, np.newaxis] * _LEVER * np.sign(top) / _TORQUE_CONSTANT
    measured, computed = (position, speed, current), (wanted, command, target)
    return Collision(_logged(time, measured, computed, force, rng), onset)


def _contact(time: FloatArray, onset: float, speed: float, rng: np.random.Generator) -> tuple[FloatArray, float]:
    """Return the force (n,) [N] of a spring on the tool's way, and when the robot begins to stop [s]."""
    stiffness, limit = rng.uniform(3e3, 12e3), rng.uniform(60.0, 120.0)
    stop = onset + limit / (stiffness * speed) + rng.uniform(0.01, 0.03)
    after = np.clip(time - onset, 0.0, None)
    braking = np.clip(time - stop, 0.0, _BRAKING)
    depth = speed * (np.minimum(after, max(stop - onset, 0.0)) + braking - 0.5 * braking**2 / _BRAKING)
    release = np.exp(-np.clip(time - stop - 0.3, 0.0, None) / 0.2)
    return stiffness * depth * release, stop


def _current(position: FloatArray, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
    """Return the motor currents (n, 6) [A] without contact."""
    gravity = np.zeros_like(position)
    shoulder, elbow = position[:, 1], position[:, 1] + position[:, 2]
    gravity[:, 2] = 22.0 * np.cos(elbow)
    gravity[:, 1] = 48.0 * np.cos(shoulder) + gravity[:, 2]
    gravity[:, 3] = 4.0 * np.cos(elbow + position[:, 3])
    friction = _COULOMB * np.tanh(speed / 0.01) + _VISCOUS * speed
    return (_INERTIA * acceleration + friction + gravity) / _TORQUE_CONSTANT


def _logged(
    time: FloatArray,
    measured: Sequence[FloatArray],
    computed: Sequence[FloatArray],
    force: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Return the rows (n, 40): samples on a jittered clock, with the sensors' noise, steps and offsets."""
    steps = rng.uniform(1 / 60, 1 / 30, int(time[-1] * 60))
    stamps = np.cumsum(steps)
    stamps = stamps[stamps < time[-1]]
    at = np.searchsorted(time, stamps)
    rows = len(at)
    direction = rng.standard_normal(3)
    direction /= np.linalg.norm(direction)
    tool = force[at, np.newaxis] * direction + rng.uniform(-6.0, 6.0, 3) + 0.6 * rng.standard_normal((rows, 3))
    noisy = [
        values[at] + noise * rng.standard_normal((rows, JOINTS)) for values, noise in zip(measured, NOISE, strict=True)
    ]
    columns = [stamps, *noisy, *(values[at] for values in computed), tool]
    return np.column_stack(columns)


def main() -> int:
    """Write the set to the folder that is given; 2 without one."""
    if len(sys.argv) != 2:
        print(__doc__)
        return 2
    written = write_collisions(Path(sys.argv[1]))
    print(f"{len(written)} logs and onsets.csv written to {sys.argv[1]}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
