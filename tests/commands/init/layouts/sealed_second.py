"""Fifteen layouts more by somebody who had not seen the guesser: a second set that `cdtool init` is measured on.

`source` states what is exact (names, order, separators) and what is made up: all values are simulated.
"""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.commands.init.layouts.layout import Layout, Truth
from tests.commands.init.layouts.simulators import (
    Axis,
    Rng,
    alternate,
    arm_torque,
    axis,
    crossing,
    follow,
    low_pass,
    plan,
    poses,
    quantised,
)

Array = np.ndarray


def _lines(path: Path, lines: Sequence[str], end: str = "\n", encoding: str = "utf-8") -> None:
    path.write_bytes((end.join(lines) + end).encode(encoding))


def _rows(columns: Sequence[Sequence[str]], separator: str = ",") -> list[str]:
    return [separator.join(cells) for cells in zip(*columns, strict=True)]


def _f(values: Array, form: str) -> list[str]:
    return [form % v for v in (np.asarray(values) + 0.0).tolist()]


def _r(values: Array, digits: int = 17) -> list[str]:
    """Return Python's shortest form of floats."""
    return [repr(round(float(v), digits) + 0.0) for v in np.asarray(values).tolist()]


def _at(t: Array, x: Array, times: Array) -> Array:
    """Return samples of x (n,) or (n, J) at other times."""
    if x.ndim == 1:
        return np.interp(times, t, x)
    return np.column_stack([np.interp(times, t, c) for c in x.T])


def _rate(x: Array, dt: float) -> Array:
    return np.gradient(x, dt, axis=0)


def _jitter(rng: Rng, n: int, period: float, spread: float, late: float = 0.0, by: float = 0.0) -> Array:
    """Return sample times of a loop: period with a spread, and a share of late samples."""
    steps = np.maximum(rng.normal(period, spread, n), 0.3 * period)
    steps[rng.random(n) < late] += by
    return np.cumsum(steps) - steps[0]


# 1: two-joint leg that presses on a load cell

LEG = [
    "Episode",
    "Timestamp",
    "Position_Shan",
    "Position_Thigh",
    "Velocity_Shank",
    "Velocity_Thigh",
    "Torque_Shank",
    "Torque_Thigh",
    "Force",
]


def _write_leg(path: Path, rng: Rng) -> None:
    dt = 0.002
    crouch, stand = (-1.55, 0.85), (-0.55, 0.30)
    points, rates, rests = [crouch], [], []
    for k in range(8):
        deep = rng.uniform(-0.1, 0.1)
        swing = k in (2, 5)  # a swing in the air instead of a push
        goal = (-1.9 + deep, 0.35) if swing else (stand[0] + deep, stand[1] - 0.5 * deep)
        points += [goal, (crouch[0] - deep, crouch[1])]
        rates += [rng.uniform(2.0, 4.5), rng.uniform(1.5, 3.0)]
        rests += [rng.uniform(0.4, 0.8), rng.uniform(0.3, 0.6)]
    ref = poses(points, rates, rests, dt, 25.0, 0.06)
    q, v, a = follow(ref, dt, 55.0)  # column 0 the shank, 1 the thigh
    n = len(q)
    t = np.arange(n) * dt
    l1, l2 = 0.25, 0.25
    th, both = q[:, 1], q[:, 1] + q[:, 0]
    x, z = -l1 * np.sin(th) - l2 * np.sin(both), -l1 * np.cos(th) - l2 * np.cos(both)
    deep = np.maximum(-z - 0.455, 0.0)
    force = low_pass(9000.0 * deep, dt, 40.0)
    tau = np.empty((n, 2))
    tau[:, 1] = 0.11 * a[:, 1] + 0.035 * (a[:, 0] + a[:, 1]) + 0.5 * np.tanh(v[:, 1] / 0.03) + 0.12 * v[:, 1]
    tau[:, 0] = 0.035 * (a[:, 0] + a[:, 1]) + 0.4 * np.tanh(v[:, 0] / 0.03) + 0.08 * v[:, 0]
    tau[:, 1] += 9.81 * (0.9 * 0.1 * np.sin(th) + 0.35 * (l1 * np.sin(th) + 0.1 * np.sin(both)))
    tau[:, 0] += 9.81 * 0.35 * 0.1 * np.sin(both)
    # the plate pushes the foot up: torque = -J^T f
    tau[:, 1] += x * force
    tau[:, 0] += -l2 * np.sin(both) * force
    times = _jitter(rng, int(t[-1] / 0.01), 0.01, 0.0004, 0.004, 0.011)
    times = times[times < t[-1]]
    qs, vs, ts, fs = (_at(t, s, times) for s in (q, v, tau, force))
    # an episode is a stroke out and back; it counts on when the leg is back
    lengths = [
        len(poses(points[k : k + 3], rates[k : k + 2], rests[k : k + 2], dt, 25.0, 0.06)) for k in range(0, 16, 2)
    ]
    episode = 1 + np.searchsorted(np.cumsum(lengths)[:-1] * dt, times)
    qs = quantised(qs, 2 * np.pi / 16384) + 0.0
    vs = vs + rng.normal(0, 0.015, vs.shape)
    ts = ts + rng.normal(0, 0.12, ts.shape)
    fs = quantised(fs + rng.normal(0, 0.9, fs.shape) + 1.3, 0.1)
    stamps = 1713170000.0 + rng.uniform(0, 9000) + times
    columns = [
        _f(episode, "%d"),
        _r(stamps, 7),
        _r(qs[:, 0], 8),
        _r(qs[:, 1], 8),
        _r(vs[:, 0], 6),
        _r(vs[:, 1], 6),
        _r(ts[:, 0], 6),
        _r(ts[:, 1], 6),
        _r(fs, 1),
    ]
    _lines(path, [",".join(LEG), *_rows(columns)], "\r\n")


leg = Layout(
    "two-joint leg, Dataset_15_04",
    "GitHub Python script that writes Dataset_15_04.csv: names, order and the misprint Position_Shan exact; "
    "csv.writer line ends (CR LF). Made up: units (rad, rad/s, N m, N), time.time stamps at 100 Hz, all values.",
    ".csv",
    "robot",
    _write_leg,
    {
        "Episode": Truth(),
        "Timestamp": Truth("time", "", "s"),
        "Position_Shan": Truth("position", "shank"),
        "Position_Thigh": Truth("position", "thigh"),
        "Velocity_Shank": Truth("speed", "shank"),
        "Velocity_Thigh": Truth("speed", "thigh"),
        "Torque_Shank": Truth("torque", "shank"),
        "Torque_Thigh": Truth("torque", "thigh"),
        "Force": Truth("force"),
    },
)


# 2: TriFinger platform, one finger


def _finger_names() -> list[str]:
    names = ["#time_index", "timestamp", "status_action_repetitions", "status_error_status"]
    names += [f"observation_{s}_{i}" for s in ("position", "velocity", "torque") for i in range(3)]
    names += ["observation_tip_force_0"]
    for kind in ("applied_action", "desired_action"):
        names += [f"{kind}_{s}_{i}" for s in ("torque", "position", "position_kp", "position_kd") for i in range(3)]
    return names


def _write_finger(path: Path, rng: Rng) -> None:
    dt = 0.001
    points = [(0.0, 0.75, -1.7)]
    for _k in range(7):
        points.append((rng.uniform(-0.35, 0.45), rng.uniform(0.45, 1.2), rng.uniform(-2.2, -1.1)))
    points[4] = (0.05, 1.15, -1.25)  # onto the table
    ref = poses(points, rng.uniform(2.0, 3.5, 7), rng.uniform(0.15, 0.3, 7), dt, 40.0, 0.03)[:6600]
    q, v, a = follow(ref, dt, 60.0)
    n = len(q)
    m, c, b = np.array([0.006, 0.006, 0.003]), np.array([0.02, 0.02, 0.015]), np.array([0.012, 0.012, 0.01])
    load = np.zeros((n, 3))
    load[:, 1] = 0.11 * np.sin(q[:, 1]) + 0.03 * np.sin(q[:, 1] + q[:, 2])
    load[:, 2] = 0.03 * np.sin(q[:, 1] + q[:, 2])
    load[:, 0] = 0.05 * np.sin(q[:, 0])
    free = m * a + c * np.tanh(v / 0.02) + b * v + load
    height = 0.29 - 0.16 * np.cos(q[:, 1]) - 0.16 * np.cos(q[:, 1] + q[:, 2])
    order = np.sort(height)
    table = order[int(0.12 * n)]
    push = low_pass(rng.uniform(0.9, 1.4) * np.clip((table - height) / (table - order[0]), 0.0, 1.0), dt, 60.0)
    tau = free.copy()
    tau[:, 1] -= push * 0.16 * (np.sin(q[:, 1]) + np.sin(q[:, 1] + q[:, 2]))  # -J^T f of the table's force upwards
    tau[:, 2] -= push * 0.16 * np.sin(q[:, 1] + q[:, 2])
    command = np.clip(tau + rng.normal(0, 0.003, tau.shape), -0.36, 0.36)
    measured = low_pass(command, dt, 150.0) + rng.normal(0, 0.004, tau.shape)
    tip = np.clip(0.072 + 0.21 * push + rng.normal(0, 0.0016, n), 0, 1)
    start = 1607522233.0 + rng.uniform(0, 5000)
    stamp = start + np.arange(n) * dt + np.abs(rng.normal(0, 3e-5, n))
    qs = quantised(q, 2 * np.pi / (4 * 5000 * 9))
    vs = low_pass(v, dt, 90.0) + rng.normal(0, 0.02, v.shape)
    gone = np.full((n, 3), np.nan)
    goal = ref.copy()
    zero = np.zeros((n, 3))
    index = np.arange(n) + 1000.0
    data = np.column_stack(
        [
            index,
            stamp,
            np.zeros(n),
            np.zeros(n),
            qs,
            vs,
            measured,
            tip,
            command,
            goal,
            gone,
            gone,
            zero,
            goal,
            gone,
            gone,
        ]
    )
    data[:, 2] = (rng.random(n) < 0.004) * 1.0
    np.savetxt(path, data, header=" ".join(_finger_names()), comments="")


_finger_truth = {name: Truth() for name in _finger_names()}
_finger_accept: dict[str, tuple[str, ...]] = {"#time_index": ("time",)}
_finger_truth["timestamp"] = Truth("time", "", "s")
_finger_truth["observation_tip_force_0"] = Truth("force")
for _i in "012":
    _finger_truth[f"observation_position_{_i}"] = Truth("position", _i)
    _finger_truth[f"observation_velocity_{_i}"] = Truth("speed", _i)
    _finger_truth[f"observation_torque_{_i}"] = Truth("torque", _i)
    _finger_truth[f"applied_action_torque_{_i}"] = Truth("reference_torque", _i)
    _finger_accept[f"applied_action_torque_{_i}"] = ("",)
    _finger_accept[f"desired_action_torque_{_i}"] = ("reference_torque",)
    for _kind in ("applied", "desired"):
        _finger_truth[f"{_kind}_action_position_{_i}"] = Truth("reference_position", _i)
        _finger_accept[f"{_kind}_action_position_{_i}"] = ("",)

finger = Layout(
    "TriFinger one finger, robot_log_dat2csv",
    "open-dynamic-robot-initiative robot_log_dat2csv.py (--number-of-fingers 1): names, order, the # of the first "
    "name, blanks as separator and numpy.savetxt's %.18e exact; 1 kHz, Unix stamps, nan gains, tip force 0..1 as "
    "documented. Made up: all values.",
    ".csv",
    "robot",
    _write_finger,
    _finger_truth,
    _finger_accept,
)


# 3: Unitree A1, motorstate.csv

LEGS = ("FL", "FR", "RL", "RR")
A1 = ["x_value", "tick", *(f"{leg_}{j}_{s}" for s in ("torque", "pos") for j in range(3) for leg_ in LEGS)]


def _write_a1(path: Path, rng: Rng) -> None:
    dt, n = 0.002, 6000
    t = np.arange(n) * dt

    def ramp(begin: float, end: float) -> Array:
        s = np.clip((t - begin) / (end - begin), 0, 1)
        return s**3 * (10 - 15 * s + 6 * s * s)

    height = 0.12 + 0.18 * (ramp(0.8, 2.3) - ramp(9.6, 11.0))
    trot = ramp(4.6, 5.0) - ramp(8.4, 8.8)
    sway = (ramp(2.6, 3.0) - ramp(4.0, 4.4)) * np.sin(2 * np.pi * 0.7 * t)
    nod = (ramp(2.6, 3.0) - ramp(4.0, 4.4)) * np.sin(2 * np.pi * 0.45 * t + 0.4)
    swing = {}
    share = {}
    for leg_ in LEGS:
        phase = (t / 0.5 + (0.5 if leg_ in ("FR", "RL") else 0.0)) % 1.0
        up = np.where(phase < 0.5, np.sin(2 * np.pi * phase), 0.0) ** 2 * (phase < 0.5)
        swing[leg_] = up * trot
        share[leg_] = 1.0 - np.clip(4.0 * up, 0, 1) * trot
    total = sum(share.values())
    link, weight = 0.2, 12.4 * 9.81
    q = {}
    tau = {}
    for leg_ in LEGS:
        side = 1.0 if leg_[1] == "L" else -1.0
        front = 1.0 if leg_[0] == "F" else -1.0
        z = -(height + 0.02 * side * sway + 0.02 * front * nod) + 0.06 * swing[leg_]
        x = -0.01 * front + 0.025 * trot * np.sin(2 * np.pi * t / 0.5 + (np.pi if leg_ in ("FR", "RL") else 0.0))
        r = np.hypot(x, z)
        knee = -2.0 * np.arccos(np.clip(r / (2 * link), -1, 1))
        hip = np.arctan2(-x, -z) - knee / 2
        roll = 0.06 * side + 0.10 * sway + 0.01 * side * trot
        angles = low_pass(np.column_stack([roll, hip, knee]), dt, 12.0)
        v = _rate(angles, dt)
        a = _rate(low_pass(v, dt, 40.0), dt)
        # stance: the ground carries the leg's share of the weight, once the belly is off the ground
        lifted = np.clip((height - 0.13) / 0.03, 0, 1)
        fz = lifted * weight * share[leg_] / total * (1 + 0.06 * front * nod)
        fx = 0.04 * fz * trot * np.sin(2 * np.pi * t / 0.5)
        th, both = angles[:, 1], angles[:, 1] + angles[:, 2]
        fx_z = -link * np.cos(th) - link * np.cos(both)
        fx_x = -link * np.sin(th) - link * np.sin(both)
        effort = np.empty((n, 3))
        effort[:, 0] = side * 0.0838 * -fz * 0.35 + fz * 0.25 * np.sin(angles[:, 0]) + 0.016 * a[:, 0]
        effort[:, 1] = -(fx_z * fx - fx_x * fz) + 0.018 * a[:, 1] + 0.25 * np.tanh(v[:, 1] / 0.05)
        effort[:, 2] = -(-link * np.cos(both) * fx + link * np.sin(both) * fz) + 0.009 * a[:, 2]
        effort[:, 2] += 0.25 * np.tanh(v[:, 2] / 0.05) + 0.05 * v[:, 2]
        effort[:, 1] += 0.05 * v[:, 1]
        effort[:, 0] += 0.25 * np.tanh(v[:, 0] / 0.05) + 0.05 * v[:, 0]
        q[leg_] = angles + rng.normal(0, 0.0003, angles.shape)
        tau[leg_] = quantised(low_pass(effort, dt, 60.0) + rng.normal(0, 0.09, effort.shape), 1.0 / 42.0)
    tick = np.round(184022 + rng.integers(0, 90000) + t * 1000).astype(int)
    keep = rng.random(n) > 0.003
    columns = [_f(np.arange(keep.sum()), "%d"), _f(tick[keep], "%d")]
    columns += [_r(tau[leg_][keep, j], 7) for j in range(3) for leg_ in LEGS]
    columns += [_r(q[leg_][keep, j], 7) for j in range(3) for leg_ in LEGS]
    _lines(path, [",".join(A1), *_rows(columns)], "\r\n")


_a1_truth = {"x_value": Truth(), "tick": Truth("time", "", "ms")}
for _name in A1[2:]:
    _joint, _what = _name.split("_")
    _a1_truth[_name] = Truth("position" if _what == "pos" else "torque", _joint)

a1 = Layout(
    "Unitree A1 motorstate.csv",
    "GitHub Python script that writes motorstate.csv from a quadruped's low state: the 26 names and their order "
    "(torque before position, by joint then leg) exact, csv.DictWriter. Made up: values (stand up, sway, trot on "
    "the spot, lie down), tick in ms with lost samples.",
    ".csv",
    "robot",
    _write_a1,
    _a1_truth,
)


# 4: Mecademic Meca500


def _meca_names() -> list[str]:
    axes = range(6)
    names = ["timestamp", *(f"TargetJointPos_{i}" for i in axes), *(f"TargetJointVel_{i}" for i in axes)]
    names += [f"JointPos_{i}" for i in axes]
    names += [f"CartPos_{s}" for s in ("X", "Y", "Z", "Alpha", "Beta", "Gamma")]
    names += [*(f"JointVel_{i}" for i in axes), *(f"JointTorq_{i}" for i in axes)]
    names += ["Conf_Shoulder", "Conf_Elbow", "Conf_Wrist", "Accel_X", "Accel_Y", "Accel_Z", "Checkpoint"]
    return names


def _write_meca(path: Path, rng: Rng) -> None:
    dt = 0.002
    points = [np.radians([0, 0, 0, 0, 30, 0])]
    for _ in range(9):
        points.append(
            np.radians(
                [
                    rng.uniform(-95, 95),
                    rng.uniform(-35, 55),
                    rng.uniform(-55, 35),
                    rng.uniform(-80, 80),
                    rng.uniform(-60, 70),
                    rng.uniform(-120, 120),
                ]
            )
        )
    points[5] = points[4] + np.radians([0, 14, 9, 0, -12, 0])  # down onto a plate, slowly
    points[6] = points[4].copy()
    rates = rng.uniform(0.8, 1.7, 9)
    rates[4:6] = 0.12
    ref = poses(points, rates, rng.uniform(0.35, 0.8, 9), dt, 6.0, 0.08)
    q, v, a = follow(ref, dt, 70.0)
    n = len(q)
    t = np.arange(n) * dt
    rated = np.array([2.4, 2.4, 1.3, 0.42, 0.42, 0.22])
    tau = arm_torque(
        q,
        v,
        a,
        inertia=(0.05, 0.06, 0.02, 0.003, 0.003, 0.001),
        coulomb=(0.22, 0.24, 0.13, 0.05, 0.05, 0.03),
        viscous=(0.12, 0.13, 0.07, 0.02, 0.02, 0.01),
        lift=1,
        elbow=2,
        moments=(0.75, 0.42),
        coupling=0.012,
        wrist=(4, 0.03),
    )
    # contact on the way to point 5: grows with the depth
    near = np.linalg.norm(ref - points[5], axis=1) / np.linalg.norm(points[5] - points[4])
    calm = (np.arange(n) > np.argmin(np.linalg.norm(ref - points[4], axis=1))) & (near < 1.02)
    push = low_pass(np.where(calm, np.clip(0.55 - near, 0, 1), 0.0), dt, 25.0) * 16.0
    tau[:, 1] += 0.055 * push  # the drives push on in the direction of their motion
    tau[:, 2] += 0.045 * push
    tau[:, 4] -= 0.012 * push
    percent = low_pass(tau, dt, 60.0) / rated * 100.0
    period = 0.005
    times = np.arange(0, t[-1], period)
    refs, rv, qs, vs, ps, acc = (_at(t, s, times) for s in (ref, _rate(ref, dt), q, v, percent, a))
    m = len(times)
    reach = 0.19 + 0.135 * np.sin(qs[:, 1]) + 0.12 * np.cos(qs[:, 1] + qs[:, 2])
    cart = np.column_stack(
        [
            reach * np.cos(qs[:, 0]) * 1000,
            reach * np.sin(qs[:, 0]) * 1000,
            308 + 135 * np.cos(qs[:, 1]) - 120 * np.sin(qs[:, 1] + qs[:, 2]) - 135,
            np.degrees(qs[:, 3]),
            np.degrees(qs[:, 4]) + 90,
            np.degrees(qs[:, 5]),
        ]
    )
    deg = np.degrees
    accel = 16000.0 * np.column_stack([0.02 * acc[:, 0], 0.02 * acc[:, 1], 1.0 + 0.02 * acc[:, 2]])
    accel = np.round(accel + rng.normal(0, 60, accel.shape))
    stamp = 51_400_000 + int(rng.integers(0, 9_000_000)) + np.arange(m) * 5000
    values = [
        *deg(refs).T,
        *deg(rv).T,
        *deg(quantised(qs, 2 * np.pi / 2**22)).T,
        *cart.T,
        *(deg(vs) + rng.normal(0, 0.12, vs.shape)).T,
        *(ps + rng.normal(0, 0.35, ps.shape)).T,
    ]
    columns = [[f"{s:15.0f}" for s in stamp.tolist()]]
    columns += [[f"{round(float(x), 5):10}" for x in c.tolist()] for c in values]
    for sign in (1, 1, 1):
        columns.append([f"{sign:10}"] * m)
    columns += [[f"{float(x):10}" for x in c.tolist()] for c in accel.T]
    marks = np.searchsorted(np.linspace(0, times[-1], 10), times)
    columns.append([f"{int(k):10}" for k in marks])
    _lines(path, [",".join(_meca_names()), *_rows(columns)])


_meca_truth = {name: Truth() for name in _meca_names()}
_meca_accept: dict[str, tuple[str, ...]] = {"Checkpoint": ("label",)}
_meca_truth["timestamp"] = Truth("time", "", "us")
for _i in "012345":
    _meca_truth[f"TargetJointPos_{_i}"] = Truth("reference_position", _i, "deg")
    _meca_truth[f"TargetJointVel_{_i}"] = Truth("reference_speed", _i, "deg/s")
    _meca_accept[f"TargetJointPos_{_i}"] = _meca_accept[f"TargetJointVel_{_i}"] = ("",)
    _meca_truth[f"JointPos_{_i}"] = Truth("position", _i, "deg")
    _meca_truth[f"JointVel_{_i}"] = Truth("speed", _i, "deg/s")
    _meca_truth[f"JointTorq_{_i}"] = Truth("torque", _i)

meca = Layout(
    "Mecademic Meca500 trajectory logger",
    "mecademicpy _robot_trajectory_logger.py: names (joints from 0), the index label timestamp, padding to 15 and "
    "10 characters exact; a choice of its fields as a user makes with fields=[...]. Units by the manual: deg, "
    "deg/s, % of the rated torque, stamps in us; made up: 200 Hz, all values.",
    ".csv",
    "robot",
    _write_meca,
    _meca_truth,
    _meca_accept,
)


# 5: HeRoS leg bench, only angles and a force

HEROS = ["time_ms", "theta_toe", "theta_ankle", "theta_knee", "theta_hip", "force"]


def _write_heros(path: Path, rng: Rng) -> None:
    dt = 0.002
    rest = (4.0, -8.0, 35.0, 12.0)
    points, rates, rests = [rest], [], []
    for _k in range(9):
        bent = (rng.uniform(-6, 22), rng.uniform(-22, 14), rng.uniform(55, 112), rng.uniform(20, 55))
        points += [bent, tuple(np.array(rest) + rng.normal(0, 2.0, 4))]
        rates += [rng.uniform(50, 110), rng.uniform(40, 90)]
        rests += [rng.uniform(0.3, 1.0), rng.uniform(0.1, 0.7)]
    ref = poses(points, rates, rests, dt, 500.0, 0.25)
    q, v, _ = follow(ref, dt, 18.0)
    n = len(q)
    t = np.arange(n) * dt
    pull = 18.0 + 2.1 * np.maximum(q[:, 2] - 40, 0) + 0.35 * v[:, 2] + 25.0 * np.tanh(v[:, 2] / 4.0)
    force = low_pass(np.maximum(pull, 3.0), dt, 15.0)
    times = np.arange(0, min(t[-1], 38.0), 0.01)
    qs, fs = _at(t, q, times), _at(t, force, times)
    qs = quantised(qs + rng.normal(0, 0.012, qs.shape), 360 / 16384)
    fs = fs + rng.normal(0, 0.8, fs.shape)
    stamp = np.floor(times * 1000 + rng.uniform(0, 0.9, len(times)) + 1.0)
    body = [
        ", ".join((f"{row[0]:.0f}", *(f"{x:f}" for x in row[1:])))
        for row in zip(stamp.tolist(), *qs.T.tolist(), fs.tolist(), strict=True)
    ]
    _lines(path, [", ".join(HEROS), *body])


heros = Layout(
    "HeRoS leg test bench (mbed)",
    "os.mbed.com heros_leg_readout_torque_addition main.cpp: header with blanks after the commas exact; four "
    "AS5048 encoders of 14 bit in degrees, load cell LCM101 of 100 kgf. Made up: %f cells, 100 Hz, all values; "
    "there is no effort and no speed.",
    ".txt",
    "robot",
    _write_heros,
    {
        "time_ms": Truth("time", "", "ms"),
        "theta_toe": Truth("position", "toe", "deg"),
        "theta_ankle": Truth("position", "ankle", "deg"),
        "theta_knee": Truth("position", "knee", "deg"),
        "theta_hip": Truth("position", "hip", "deg"),
        "force": Truth("force"),
    },
    {"force": ("",)},
)


# 6: small hydraulic excavator

EXCAVATOR = [
    "timestamp",
    *(f"{s}_{i}" for s in ("valve_cmd", "joint_pos", "joint_vel") for i in range(3)),
    *(f"{p}_{s}" for p in ("pext", "pret") for s in ("lift", "tilt", "scoop")),
    "pressure_ts",
]


def _write_excavator(path: Path, rng: Rng) -> None:
    dt, n = 0.002, 20000
    t = np.arange(n) * dt
    command = np.zeros((n, 3))
    for j in range(3):
        at, sign = int(rng.uniform(0.8, 2.5) / dt), 1.0
        while at < n - 900:
            length = int(rng.uniform(0.9, 2.2) / dt)
            command[at : at + length, j] = sign * rng.uniform(0.35, 0.95)
            pause = int(rng.uniform(0.4, 1.6) / dt)
            at += length + pause
            sign = -sign
    command = low_pass(command, dt, 2.2)
    gain, low, high = (0.42, 0.5, 0.75), (-0.25, -1.9, -2.4), (0.95, -0.35, 0.5)
    start = (0.1, -1.1, -0.9)
    q, v = np.empty((n, 3)), np.empty((n, 3))
    x, s = np.array(start), np.zeros(3)
    for i in range(n):
        wanted = np.where(np.abs(command[i]) < 0.08, 0.0, command[i] - 0.08 * np.sign(command[i])) * gain
        margin = np.where(wanted > 0, high - x, x - low)
        wanted = wanted * np.clip(margin / 0.12, 0.0, 1.0)
        s = s + (wanted - s) * dt / 0.09
        x = x + s * dt
        q[i], v[i] = x, s
    a = _rate(low_pass(v, dt, 8.0), dt)
    dig = np.zeros(n)
    for begin in (9.0, 21.0, 31.0):
        dig += np.exp(-(((t - begin) / 0.7) ** 2)) * rng.uniform(0.5, 1.0)
    moment = np.column_stack(
        [
            np.cos(q[:, 0]) + 0.5 * np.cos(q[:, 0] + q[:, 1]),
            0.6 * np.cos(q[:, 0] + q[:, 1]),
            0.25 * np.cos(q.sum(axis=1)),
        ]
    )
    load = moment + 0.5 * a + 0.25 * np.tanh(v / 0.02) + 0.3 * v + dig[:, None] * (0.3, 0.6, 0.7)
    extend = 1.05 + np.maximum(0.55 * load, -0.3) + 0.25 * np.abs(v)
    retract = 1.0 + np.maximum(-0.45 * load, -0.25) + 0.3 * np.abs(v)
    times = _jitter(rng, 3900, 0.01, 0.00025, 0.002, 0.004)
    times = times[times < t[-1]]
    cs, qs, vs = (_at(t, w, times) for w in (command, q, v))
    ticks = np.floor(times / 0.02) * 0.02 + 0.0013
    es, rs = _at(t, extend, ticks), _at(t, retract, ticks)
    es, rs = es + _at(np.unique(ticks), rng.normal(0, 0.006, (len(np.unique(ticks)), 3)), ticks), rs
    qs = qs + low_pass(rng.normal(0, 0.003, qs.shape), 0.01, 5.0)
    vs = vs + rng.normal(0, 0.006, vs.shape)
    cs = quantised(cs, 1 / 127)
    lsb = 4.096 / 2048
    columns = [
        _r(times, 9),
        *(_r(c, 9) for c in cs.T),
        *(_r(c, 12) for c in qs.T),
        *(_r(c, 12) for c in vs.T),
        *(_r(quantised(c, lsb), 6) for c in es.T),
        *(_r(quantised(c, lsb), 6) for c in rs.T),
        _r(ticks, 9),
    ]
    _lines(path, [",".join(EXCAVATOR), *_rows(columns)])


_exc_truth = {name: Truth() for name in EXCAVATOR}
_exc_accept: dict[str, tuple[str, ...]] = {"pressure_ts": ("time",)}
_exc_truth["timestamp"] = Truth("time", "", "s")
for _i in "012":
    _exc_accept[f"valve_cmd_{_i}"] = ("reference_speed",)
    _exc_truth[f"joint_pos_{_i}"] = Truth("position", _i)
    _exc_truth[f"joint_vel_{_i}"] = Truth("speed", _i)

excavator = Layout(
    "hydraulic excavator drive_log",
    "GitHub DataLogger of a small excavator (drive_log_*.csv by pandas): names and order exact, 100 Hz loop with "
    "jitter, angles (IMU, rad) and rates (rad/s) of lift, tilt, scoop, chamber pressures as sensor volts at a "
    "slower rate, their own stamp. Made up: all values.",
    ".csv",
    "robot",
    _write_excavator,
    _exc_truth,
    _exc_accept,
)


# 7: CoMax (French teaching axis), motor side


def _servo_speed(
    rng: Rng,
    ref: Array,
    dt: float,
    gain: float,
    limit: float,
    inertia: float,
    coulomb: float,
    viscous: float,
    gravity: float,
    block: tuple[float, float],
) -> tuple[Array, Array, Array]:
    """Return angle [rev], speed [rpm] and current [mA] of a proportional speed control with a stop (begin, end) [s]."""
    n = len(ref)
    x = v = twist = 0.0
    out = np.empty((n, 3))
    where = None
    for i in range(n):
        now = i * dt
        u = min(max(gain * (ref[i] - v), -limit), limit)
        push = 0.0
        if block[0] <= now < block[1]:
            where = x if where is None else where
            push = max(0.0, 1400.0 * (x - where) + 0.9 * v) if x > where else 0.0
        twist = 220.0 * np.sin(2 * np.pi * x * 0.31)
        drive = u - gravity - viscous * v - push - (twist if abs(v) > 30 else 0.0)
        if abs(v) < 4.0 and abs(drive) < coulomb:
            acc, v = 0.0, v * 0.4
        else:
            acc = (drive - coulomb * np.tanh(v / 6.0)) / inertia
            v += acc * dt
        x += v / 60.0 * dt
        out[i] = x, v, u
    return out[:, 0], out[:, 1], out[:, 2]


def _write_comax(path: Path, rng: Rng) -> None:
    dt = 0.0005
    parts = [np.zeros(int(0.05 / dt))]
    for level in (3000, -2500, 1500, -2000, 3000, -3000, 2000, -1000):
        level *= rng.uniform(0.9, 1.0)
        up = np.minimum(np.arange(int(rng.uniform(0.45, 0.7) / dt)) * dt * 100000, abs(level)) * np.sign(level)
        parts += [np.round(up / 10) * 10, np.zeros(int(rng.uniform(0.3, 0.5) / dt))]
    ref = np.concatenate(parts)
    fourth = sum(len(p) for p in parts[:9]) * dt + 0.25
    _, v, i = _servo_speed(rng, ref, dt, 6.1, 7430.0, 0.16, 1150.0, 0.26, 620.0, (fourth, fourth + 0.12))
    step = 10
    ref, v, i = ref[::step], v[::step], low_pass(i, dt, 300.0)[::step]
    n = len(ref)
    day, month, run = rng.integers(1, 28), rng.integers(1, 12), rng.integers(1, 20)
    name = f"e:\\comax\\{day:02d}-{month:02d}-mesure{run}.eposacq"
    head = [
        "FICHIER :;" + name,
        "Date :;07/02/2017",
        "Heure :;08:53:48",
        "",
        "DESCRIPTION :",
        "ACQUISITION AXE 1 : CoMax",
        "SOLLICITATION en VITESSE avec consigne de 3000 rpm.",
        f"{n} mesures avec période de 5.0 ms",
        "",
        "",
        "COMMENTAIRE :",
        "",
        "",
        "MESURES :",
        "Index;Temps;;Consigne de Vitesse;Vitesse Moteur;Courant Moteur;",
        ";ms;;rpm;rpm;mA;",
    ]
    tail = [
        "",
        "Paramètre AXE :;CoMax",
        "PID AXE :;KP;KI;KD;KV;KA",
        "Position :;2420;8340;3230;0;0",
        "Vitesse :;3000;0;;0;0",
        "Courant :;200;75",
        "Sécurité",
        "Acc. max.:;100000;rpm/s",
        "Vit. max.:;6000;rpm",
        "",
    ]
    v = np.round(v + rng.normal(0, 1.2, n)).astype(int)
    i = np.round(i + rng.normal(0, 9.0, n)).astype(int)
    body = []
    for k in range(n):
        when = ("%.1f" % (5.0 * k)).replace(".", ",")
        body.append(f"{k:10d};{when:>10s};;{ref[k]:10.0f};{v[k]:10d};{i[k]:10d};")
    _lines(path, [*head, *body, *tail], "\r\n")


comax = Layout(
    "CoMax acquisition (eposacq, French)",
    "GitHub emiliendurif/TP_sujets 1_comax/essais/07-02-mesure1.csv: preamble, names, unit row, a column without "
    "a name, decimal comma, padding, lines of parameters at the end, 5 ms, level and ripple of the currents exact "
    "as in the file. Made up: the sequence of set speeds (the original has one step), values.",
    ".csv",
    "rotary axis",
    _write_comax,
    {
        "Index": Truth(),
        "Temps": Truth("time", "", "ms"),
        "Consigne de Vitesse": Truth("reference_speed", "", "rpm"),
        "Vitesse Moteur": Truth("speed", "", "rpm"),
        "Courant Moteur": Truth("current", "", "mA"),
    },
    {"Consigne de Vitesse": ("",)},
)


# 8: Axe numérique (French), position steps


def _write_axenum(path: Path, rng: Rng) -> None:
    dt = 0.0005
    x, v = 24.0, 0.0
    goals = [(0.1, 34.0), (1.9, 60.0), (3.8, 20.0), (5.6, 75.0), (7.6, 45.0), (9.2, 110.0), (11.6, 30.0), (14.0, 52.0)]
    n = int(16.0 / dt)
    out = np.empty((n, 3))
    stop = 102.0  # a rubber stop that is there only once
    for i in range(n):
        now = i * dt
        goal = 24.0
        for begin, level in goals:
            if now >= begin:
                goal = level
        error = goal - x
        u = 30.0 * error - 3.1 * v
        current = min(max(u, -505.0), 505.0)
        push = max(0.0, 90.0 * (x - stop) + 0.8 * v) if 9.2 <= now < 11.6 and x > stop else 0.0
        drive = current - 1.2 * v - push
        if abs(v) < 0.6 and abs(drive) < 42.0:
            v *= 0.5
        else:
            v += (drive - 40.0 * np.tanh(v / 0.8)) / 0.6 * dt
        x += v * dt
        out[i] = goal, x, current
    step = int(0.01 / dt)
    goal, x, current = (low_pass(out[:, 2], dt, 120.0) if k == 2 else out[:, k] for k in range(3))
    goal, x, current = goal[::step] - 0.001, np.round(x[::step], 3), current[::step]
    m = len(x)
    current = quantised(current + rng.normal(0, 13.0, m), 1000 / 2048)
    error = goal - np.concatenate([x[:1], x[:-1]])
    columns = [_f(np.arange(m) * 0.01, "%.3f"), _f(goal, "%.3f"), _f(current, "%.3f"), _f(x, "%.3f"), _f(error, "%.3f")]
    _lines(path, ["Temps,Consigne,I moteur,position,Ecart", "s,mm,mA,mm,mm", *_rows(columns)])


axenum = Layout(
    "Axe numérique, position loop (French)",
    "GitHub emiliendurif/TP_sujets TP_simulation/axenum/axnum/PackEleves/mesBFPVI.csv: names, unit row, 10 ms, "
    "current quantised to 1000/2048 mA and limited to about 500 mA, error one sample late, stiction: exact as in "
    "the file. Made up: sequence of steps with one run onto a stop, values.",
    ".csv",
    "linear axis",
    _write_axenum,
    {
        "Temps": Truth("time", "", "s"),
        "Consigne": Truth("reference_position", "", "mm"),
        "I moteur": Truth("current", "", "mA"),
        "position": Truth("position", "", "mm"),
        "Ecart": Truth(),
    },
    {"Consigne": ("",)},
)


# 9: FRC elevator by AdvantageKit / AdvantageScope

FRC = [
    "Timestamp",
    "/DriverStation/Enabled",
    "/DriverStation/MatchTime",
    "/Elevator/AppliedVolts",
    "/Elevator/PositionMeters",
    "/Elevator/StatorCurrentAmps",
    "/Elevator/SupplyCurrentAmps",
    "/Elevator/TempCelsius",
    "/Elevator/VelocityMetersPerSec",
    "/RealOutputs/Elevator/Goal",
    "/RealOutputs/Elevator/SetpointPosition",
    "/RealOutputs/Elevator/SetpointVelocity",
    "/SystemStats/BatteryVoltage",
]


def _write_frc(path: Path, rng: Rng) -> None:
    dt = 0.001
    moves = alternate(rng, 0.02, 1.28, (1.6, 2.4, 1.1), 6.0, 38.0, (0.6, 1.6), 1.5)
    xr = plan(moves, 0.02, dt, 0.08)
    begin = crossing(xr, dt, 0.8, 1, 2) - 0.05
    s: Axis = axis(
        xr,
        dt,
        inertia=9.5,
        coulomb=9.0,
        viscous=7.0,
        gravity=78.0,
        bandwidth=32.0,
        limit=330.0,
        obstacles=[(0.8, 1, 9000.0, 120.0, begin, 0.25)],
    )
    drum, ratio, kt, resistance, kv = 0.0223, 6.0, 0.0194, 0.04, 51.0
    motor = s.drive * drum / ratio
    stator = motor / kt
    volts = stator * resistance + s.v / drum * ratio / kv
    battery = 12.6 - 0.018 * np.maximum(stator * volts / 12.0, 0) - 0.2
    supply = np.maximum(stator * volts / battery, 0.0)
    times = _jitter(rng, int(s.t[-1] / 0.02), 0.02, 0.0003, 0.003, 0.02)
    times = times[times < s.t[-1]]
    m = len(times)
    g = {
        k: np.interp(times, s.t, w)
        for k, w in {
            "v": volts,
            "x": s.x,
            "i": stator,
            "s": supply,
            "w": s.v,
            "xr": s.xr,
            "vr": s.vr,
            "b": battery,
        }.items()
    }
    goals = np.zeros(m)
    target = [0.02, *[x[0] for x in moves]]
    k = 0
    for i in range(m):
        if k < len(moves) and abs(g["vr"][i]) > 1e-3 and (i == 0 or abs(g["vr"][i - 1]) <= 1e-3):
            k += 1
        goals[i] = target[k]
    stamps = times + rng.uniform(8.0, 25.0)
    on = times > 0.8
    remaining = np.where(on, np.floor(135 - times), -1)
    cells = [
        _f(stamps, "%.6f"),
        ["true" if e else "false" for e in on],
        _f(remaining, "%d"),
        _r(g["v"] + rng.normal(0, 0.02, m), 6),
        _r(quantised(g["x"], 0.0223 * 2 * np.pi / 6 / 2048), 9),
        _r(quantised(g["i"] + rng.normal(0, 0.5, m), 0.01953125), 8),
        _r(quantised(g["s"] + np.abs(rng.normal(0, 0.1, m)), 0.01953125), 8),
        _f(np.floor(31.0 + 4.0 * times / times[-1]), "%d"),
        _r(g["w"] + rng.normal(0, 0.004, m), 9),
        _r(goals, 6),
        _r(g["xr"], 9),
        _r(g["vr"], 9),
        _r(quantised(g["b"] + rng.normal(0, 0.02, m), 0.01), 5),
    ]
    for c in range(9, 12):  # outputs exist only once the first loop has run
        cells[c][:3] = ["null"] * 3
    _lines(path, [",".join(FRC), *_rows(cells)])


frc = Layout(
    "FRC elevator, AdvantageKit CSV table",
    "AdvantageScope 'CSV (Table)' export (docs/EXPORT.md: one column a field, first the time stamp) of the "
    "AdvantageKit fields of an ElevatorIOInputs found on GitHub (positionMeters, velocityMetersPerSec, "
    "appliedVolts, statorCurrentAmps, supplyCurrentAmps, tempCelsius) and outputs Goal, SetpointPosition, "
    "SetpointVelocity. Made up: choice and order of the fields, null of the first rows, values.",
    ".csv",
    "linear axis",
    _write_frc,
    {
        **{name: Truth() for name in FRC},
        "Timestamp": Truth("time", "", "s"),
        "/Elevator/PositionMeters": Truth("position", "", "m"),
        "/Elevator/StatorCurrentAmps": Truth("current", "", "A"),
        "/Elevator/VelocityMetersPerSec": Truth("speed", "", "m/s"),
        "/RealOutputs/Elevator/SetpointPosition": Truth("reference_position", "", "m"),
        "/RealOutputs/Elevator/SetpointVelocity": Truth("reference_speed", "", "m/s"),
    },
    {
        "/RealOutputs/Elevator/Goal": ("reference_position",),
        "/RealOutputs/Elevator/SetpointPosition": ("",),
        "/RealOutputs/Elevator/SetpointVelocity": ("",),
    },
)


# 10: servo press, German

PRESSE = [
    "Zeit [s]",
    "Sollweg [mm]",
    "Istweg [mm]",
    "Istgeschwindigkeit [mm/s]",
    "Motorstrom [A]",
    "Presskraft [kN]",
    "Schleppfehler [mm]",
    "Motortemperatur [°C]",
    "Schritt",
]


def _write_press(path: Path, rng: Rng) -> None:
    dt = 0.001
    moves = []
    for k in range(5):
        depth = rng.uniform(116, 121) if k != 2 else 95.0  # one stroke without a part
        moves += [
            (0.095, 0.25, 1.8, 1.0 if k == 0 else rng.uniform(0.6, 0.9)),
            (depth / 1000, rng.uniform(0.012, 0.022), 0.4, 0.12),
            (0.0, 0.25, 1.8, rng.uniform(0.3, 0.5)),
        ]
    xr = plan(moves, 0.0, dt, 0.03)
    begins = [crossing(xr, dt, 0.1, 1, k) for k in range(4)]
    part = [(rng.uniform(0.1005, 0.1015), 1, rng.uniform(2.4e5, 3.2e5), 900.0, begin, 3.0) for begin in begins]
    s = axis(
        xr, dt, inertia=210.0, coulomb=160.0, viscous=420.0, gravity=-60.0, bandwidth=60.0, limit=9000.0, obstacles=part
    )
    amps = s.drive / 520.0
    times = np.arange(0, s.t[-1], 0.002)
    g = s.at(times)
    amps = np.interp(times, s.t, low_pass(amps, dt, 250.0)) + rng.normal(0, 0.03, len(times))
    force = np.interp(times, s.t, low_pass(s.contact, dt, 180.0)) / 1000 + rng.normal(0, 0.004, len(times)) + 0.012
    x = quantised(g.x * 1000, 0.001)
    v = g.v * 1000 + rng.normal(0, 0.12, len(times))
    step = np.where(np.abs(g.vr) < 1e-6, 10, np.where(g.vr < 0, 40, np.where(g.vr < 0.03, 30, 20)))
    cells = [
        _f(times, "%.3f"),
        _f(g.xr * 1000, "%.3f"),
        _f(x, "%.3f"),
        _f(v, "%.2f"),
        _f(quantised(amps, 0.01), "%.2f"),
        _f(quantised(force, 0.002), "%.3f"),
        _f(g.xr * 1000 - x, "%.3f"),
        _f(np.round(38.0 + 0.1 * times, 1), "%.1f"),
        _f(step, "%d"),
    ]
    cells = [[c.replace(".", ",") for c in column] for column in cells]
    head = [
        "Servopresse;Messprotokoll",
        "Datum;14.03.2023",
        "Uhrzeit;10:42:17",
        "Programm;3;Einpressen Buchse",
        "Abtastzeit [ms];2",
        "",
    ]
    _lines(path, [*head, ";".join(PRESSE), *_rows(cells, ";")], "\r\n", "cp1252")


press = Layout(
    "servo press, German protocol",
    "Composed: no file of a German servo press is public; terms of German press and drive manuals (Istweg, "
    "Schleppfehler, Presskraft, Schritt), semicolons, decimal comma, preamble and cp1252 as such exports have "
    "them. Made up: everything else; press-fits with one stroke without a part.",
    ".csv",
    "linear axis",
    _write_press,
    {
        "Zeit [s]": Truth("time", "", "s"),
        "Sollweg [mm]": Truth("reference_position", "", "mm"),
        "Istweg [mm]": Truth("position", "", "mm"),
        "Istgeschwindigkeit [mm/s]": Truth("speed", "", "mm/s"),
        "Motorstrom [A]": Truth("current", "", "A"),
        "Presskraft [kN]": Truth("force", "", "kN"),
        "Schleppfehler [mm]": Truth(),
        "Motortemperatur [°C]": Truth(),
        "Schritt": Truth(),
    },
    {"Sollweg [mm]": ("",), "Schritt": ("label",)},
)


# 11: ball screw module, Chinese drive software

MODULE = [
    "时间(ms)",
    "位置指令(mm)",
    "位置反馈(mm)",
    "速度指令(rpm)",
    "速度反馈(rpm)",
    "转矩反馈(%)",
    "位置偏差(p)",
    "母线电压(V)",
    "负载率(%)",
]


def _write_module(path: Path, rng: Rng) -> None:
    dt = 0.0005
    moves = alternate(rng, 0.0, 0.42, (0.25, 0.4, 0.12), 2.5, 13.0, (0.3, 0.7), 0.5)
    xr = plan(moves, 0.0, dt, 0.05)
    begin = crossing(xr, dt, 0.3, 1, 1) - 0.02
    s = axis(
        xr,
        dt,
        inertia=26.0,
        coulomb=38.0,
        viscous=45.0,
        bandwidth=55.0,
        limit=720.0,
        obstacles=[(0.3, 1, 60000.0, 400.0, begin, 0.12)],
    )
    lead = 0.010
    torque = s.drive * lead / (2 * np.pi * 0.92)
    percent = torque / 1.27 * 100
    times = np.arange(0, s.t[-1], 0.001)
    g = s.at(times)
    percent = np.interp(times, s.t, low_pass(percent, dt, 400.0))
    n = len(times)
    x = quantised(g.x * 1000, lead * 1000 / 131072 * 8)
    rpm = g.v / lead * 60
    load = low_pass(np.abs(percent), 0.001, 0.3)
    cells = [
        _f(times * 1000, "%.3f"),
        _f(g.xr * 1000, "%.4f"),
        _f(x, "%.4f"),
        _f(g.vr / lead * 60, "%.1f"),
        _f(np.round(rpm + rng.normal(0, 0.8, n)), "%.0f"),
        _f(quantised(percent + rng.normal(0, 0.5, n), 0.1), "%.1f"),
        _f(np.round((g.xr - g.x) / lead * 10000), "%d"),
        _f(quantised(311 + rng.normal(0, 0.6, n), 0.1), "%.1f"),
        _f(quantised(load, 0.1), "%.1f"),
    ]
    head = ["驱动器型号,伺服驱动器 400W", "采样周期(us),1000", "触发方式,手动"]
    _lines(path, [*head, ",".join(MODULE), *_rows(cells)], "\r\n", "utf-8-sig")


module = Layout(
    "ball screw module, Chinese drive software",
    "Composed: channel names of Chinese servo manuals (位置指令, 位置反馈, 速度反馈, 转矩反馈, 位置偏差, 母线电压, 负载率), "
    "no such file is public; UTF-8 with a byte order mark. Position in mm of the load, speed in "
    "rpm of the motor (lead 10 mm). Made up: preamble, values; one run into an obstacle.",
    ".csv",
    "linear axis",
    _write_module,
    {
        "时间(ms)": Truth("time", "", "ms"),
        "位置指令(mm)": Truth("reference_position", "", "mm"),
        "位置反馈(mm)": Truth("position", "", "mm"),
        "速度指令(rpm)": Truth("reference_speed", "", "rpm"),
        "速度反馈(rpm)": Truth("speed", "", "rpm"),
        "转矩反馈(%)": Truth("torque", "", "%"),
        "位置偏差(p)": Truth(),
        "母线电压(V)": Truth(),
        "负载率(%)": Truth(),
    },
    {"位置指令(mm)": ("",), "速度指令(rpm)": ("",)},
)


# 12: LEGO EV3 motor, without a header


def _write_ev3(path: Path, rng: Rng) -> None:
    dt = 0.001
    position, lines = float(rng.integers(-400, 400)), []
    for duty in (10, -15, 20, -25, 30, -35, 40, -45, 50, -50):
        now, v, when = 0.0, 0.0, rng.uniform(0.001, 0.004)
        top = duty * 9.6 - np.sign(duty) * 24.0
        history = []
        jam = duty == 40
        while now <= 3.02:
            wanted = top * (0.25 if jam and 1.7 < now < 2.2 else 1.0)
            v += (wanted - v) * dt / 0.075
            position += v * dt
            history.append(v)
            if now >= when:
                speed = np.mean(history[-60:]) if len(history) > 60 else np.mean(history)
                lines.append(
                    f"{duty}, {now + rng.uniform(0, 2e-4)!r}, {round(speed + rng.normal(0, 1.5))},"
                    f" {int(np.floor(position))}"
                )
                when = now + max(rng.normal(0.0135, 0.0015), 0.008) + (0.03 if rng.random() < 0.01 else 0.0)
            now += dt
        position += v * 0.05  # coasts on during the pause of 1 s, which is not logged
    _lines(path, lines)


ev3 = Layout(
    "EV3 motor lab, no header",
    "GitHub decadeos/ITMO 1_course/VPD/2/LABS/lab2/robot.py (lab1.csv): format '{}, {}, {}, {}' of duty cycle, "
    "time, speed (deg/s), position (deg, whole numbers) exact, time starts again with every duty cycle, the pause "
    "is not logged. Made up: duty cycles of both signs (the original has only positive ones), values.",
    ".csv",
    "rotary axis",
    _write_ev3,
    {"0": Truth(), "1": Truth("time", "", "s"), "2": Truth("speed"), "3": Truth("position")},
    {"0": ("reference_torque", "reference_speed")},
)


# 13: Dephy ExoBoot

EXO = [
    "state_time",
    "loop_time",
    "accel_x",
    "accel_y",
    "accel_z",
    "gyro_x",
    "gyro_y",
    "gyro_z",
    "motor_angle",
    "motor_velocity",
    "motor_current",
    "ankle_angle",
    "ankle_velocity",
    "ankle_torque_from_current",
    "did_heel_strike",
    "gait_phase",
    "did_toe_off",
    "commanded_current",
    "commanded_position",
    "commanded_torque",
    "slack",
    "temperature",
    "sync",
]


def _write_exo(path: Path, rng: Rng) -> None:
    dt, total = 0.001, 26.0
    t = np.arange(int(total / dt)) * dt
    phase = np.full(len(t), np.nan)
    strikes, at = [], 3.0
    while at < 22.5:
        length = rng.normal(1.12, 0.02)
        strikes.append(at)
        inside = (t >= at) & (t < at + length)
        phase[inside] = (t[inside] - at) / length
        at += length
    p = np.nan_to_num(phase, nan=0.0)
    # positive is plantar flexion: down after the strike, dorsiflexion to mid stance, push-off, swing
    knots = np.array([0, 0.08, 0.2, 0.45, 0.62, 0.75, 0.9, 1.0])
    angle = np.array([0.0, 5.5, -2.0, -9.5, 17.0, 2.0, -1.5, 0.0])
    dense = np.linspace(0, 1, 2000)
    wave = np.interp(dense, knots, angle)
    kernel = np.hanning(161)
    wave = np.convolve(np.tile(wave, 3), kernel / kernel.sum(), "same")[2000:4000]
    ankle = np.interp(p, dense, wave) * ~np.isnan(phase) + np.where(np.isnan(phase), wave[0], 0.0)
    wander = rng.normal(0, 6.0, len(t))
    wander[0] = 0.0
    ankle = low_pass(ankle + low_pass(wander, dt, 0.6), dt, 14.0)
    rise = np.clip((p - 0.28) / 0.24, 0, 1)
    fall = np.clip((p - 0.52) / 0.12, 0, 1)
    profile = 17.0 * (np.sin(0.5 * np.pi * rise) ** 2 * (rise < 1) + np.cos(0.5 * np.pi * fall) ** 2 * (rise >= 1))
    stance = ~np.isnan(phase) & (p < 0.64) & (t > 5.0)
    wanted = np.where(stance, np.maximum(profile, 2.0), 0.0)
    ratio = 12.5 - 0.12 * (ankle + 5)
    current = np.where(stance, wanted / (ratio * 0.14 * 0.9) * 1000 * 0.9, 0.0)
    actual = low_pass(current, dt, 18.0)
    clicks_per_degree = 16384 / 360
    wound = 110.0 * actual / 10000 * ratio / 12
    motor = (ankle * ratio + wound - np.where(stance, 0.0, 18.0)) * clicks_per_degree
    motor = low_pass(motor, dt, 9.0)
    times = _jitter(rng, int(total / 0.0055), 0.0055, 0.00025, 0.003, 0.006)
    times = times[times < t[-1]]
    n = len(times)
    s = {
        k: np.interp(times, t, w)
        for k, w in {"a": ankle, "m": motor, "i": actual, "c": current, "w": wanted, "r": ratio}.items()
    }
    boot = rng.uniform(300, 2000)
    state = np.round((boot + times) * 1000) / 1000
    a = quantised(s["a"] + rng.normal(0, 0.01, n), 360 / 16384)
    raw = np.gradient(a, state)
    # Butterworth of second order at 10 Hz, causal as on the boot
    period = 0.0055
    k = np.tan(np.pi * 10 * period)
    norm = 1 / (1 + np.sqrt(2) * k + k * k)
    b0, a1_, a2 = k * k * norm, 2 * (k * k - 1) * norm, (1 - np.sqrt(2) * k + k * k) * norm
    av = np.zeros(n)
    for i in range(2, n):
        av[i] = b0 * (raw[i] + 2 * raw[i - 1] + raw[i - 2]) - a1_ * av[i - 1] - a2 * av[i - 2]
    mv = np.round(np.gradient(s["m"], times) / clicks_per_degree + rng.normal(0, 3, n))
    milli = np.round(s["i"] + rng.normal(0, 90, n))
    torque = milli / 1000 * 0.14 * 0.9 * s["r"] / 0.9
    ph = np.interp(times, t, p)
    shank = np.where(np.interp(times, t, np.isnan(phase)) > 0.5, 0.0, np.sin(2 * np.pi * ph))
    strike, off, done = np.zeros(n, bool), np.zeros(n, bool), np.isnan(np.interp(times, t, phase))
    for begin in strikes:
        strike[min(np.searchsorted(times, begin), n - 1)] = True
        off[min(np.searchsorted(times, begin + 0.64 * 1.12), n - 1)] = True
    booleans = lambda flags: ["True" if f else "False" for f in flags]  # noqa: E731
    in_stance = np.interp(times, t, stance * 1.0) > 0.5
    sync = ((times > 2.0) & (times < 24.0)) & True
    cells = [
        _r(state, 3),
        _r(times, 9),
        _r(quantised(0.25 * np.sin(2 * np.pi * ph) * ~done + rng.normal(0, 0.02, n), 1 / 8192), 9),
        _r(quantised(1 + 0.3 * strike + rng.normal(0, 0.03, n), 1 / 8192), 9),
        _r(quantised(0.05 + rng.normal(0, 0.02, n), 1 / 8192), 9),
        _r(quantised(rng.normal(0, 3, n), 1 / 32.8), 6),
        _r(quantised(rng.normal(0, 3, n), 1 / 32.8), 6),
        _r(quantised(180 * shank + rng.normal(0, 3, n), 1 / 32.8), 6),
        _f(np.round(s["m"]) - 4200, "%d"),
        _f(mv, "%d"),
        _f(milli, "%d"),
        _r(a, 9),
        _r(av, 9),
        _r(torque, 9),
        booleans(strike),
        ["" if d else repr(round(float(x), 6)) for x, d in zip(ph, done, strict=True)],
        booleans(off),
        _f(np.round(s["c"]), "%d"),
        [""] * n,
        [repr(round(float(w), 6)) if f else "" for w, f in zip(s["w"], in_stance, strict=True)],
        _f(np.where(in_stance, 0, 7000) + rng.integers(-60, 60, n), "%d"),
        _f(np.floor(33 + 5 * times / total), "%d"),
        booleans(sync),
    ]
    _lines(path, [",".join(EXO), *_rows(cells)], "\r\n")


exo = Layout(
    "Dephy ExoBoot controller log",
    "GitHub exoboot code, class Exo.DataContainer written by csv.DictWriter: the names and their order exact "
    "(with a sync detector, without FSRs), True/False, None as empty cells, motor in encoder clicks and mA, ankle "
    "in deg and deg/s through a Butterworth of 10 Hz. Made up: values; stand, walk (assistance from the third "
    "step), stand.",
    ".csv",
    "rotary axis",
    _write_exo,
    {
        **{name: Truth() for name in EXO},
        "state_time": Truth("time", "", "s"),
        "loop_time": Truth("time", "", "s"),
        "motor_angle": Truth("position"),
        "motor_velocity": Truth("speed"),
        "motor_current": Truth("current"),
        "ankle_angle": Truth("position"),
        "ankle_velocity": Truth("speed"),
        "ankle_torque_from_current": Truth("torque"),
        "commanded_torque": Truth("reference_torque"),
        "sync": Truth("trigger"),
    },
    {
        "loop_time": ("",),
        "motor_angle": ("",),
        "motor_velocity": ("",),
        "motor_current": ("",),
        "commanded_torque": ("",),
        "commanded_current": ("reference_torque",),
        "did_heel_strike": ("label",),
        "did_toe_off": ("label",),
        "sync": ("",),
    },
)


# 14: telescope mount azimuth (Rubin Observatory)

MOUNT = [
    "actualAcceleration",
    "actualAccelerationTimestamp",
    "actualJerk",
    "actualJerkTimestamp",
    "actualPosition",
    "actualPositionTimestamp",
    "actualTorque",
    "actualTorqueTimestamp",
    "actualVelocity",
    "actualVelocityTimestamp",
    "demandJerk",
    "demandJerkTimestamp",
    "demandPosition",
    "demandPositionTimestamp",
    "demandVelocity",
    "demandVelocityTimestamp",
    "private_efdStamp",
    "private_identity",
    "private_kafkaStamp",
    "private_origin",
    "private_rcvStamp",
    "private_revCode",
    "private_seqNum",
    "private_sndStamp",
    "timestamp",
]


def _write_mount(path: Path, rng: Rng) -> None:
    dt = 0.005
    at = rng.uniform(-120, -40)
    moves = []
    for k, distance in enumerate((3.5, -3.5, 7.0, -12.0, 3.5, 10.0)):
        at += distance * rng.uniform(0.9, 1.1)
        moves.append((at, rng.uniform(2.5, 3.8), 2.2, 4.0 if k == 0 else rng.uniform(4.0, 6.0)))
    xr = plan(moves, moves[0][0] - 3.5, dt, 0.6)
    n = len(xr)
    t = np.arange(n) * dt
    xr = xr + 0.0042 * t  # sidereal tracking between the slews
    q, v, a = follow(xr[:, None], dt, 9.0)
    q, v, a = q[:, 0], v[:, 0], a[:, 0]
    torque = 8200.0 * a + 3100.0 * np.tanh(v / 0.02) + 900.0 * v + 260.0 * np.sin(q * 6.0)
    vr = _rate(xr, dt)
    jr = _rate(_rate(vr, dt), dt)
    times = np.arange(0, t[-1], 0.05) + rng.uniform(0, 0.004)
    g = {
        k: np.interp(times, t, w)
        for k, w in {"q": q, "v": v, "a": a, "f": torque, "xr": xr, "vr": vr, "jr": low_pass(jr, dt, 4.0)}.items()
    }
    m = len(times)
    start = 1687576402.0 + rng.uniform(0, 20000)
    tai = start + times + np.abs(rng.normal(0, 0.0006, m))
    jerk = np.gradient(g["a"] + rng.normal(0, 0.01, m), times)
    send = tai + 0.004 + np.abs(rng.normal(0, 0.002, m))
    utc = [datetime.datetime.fromtimestamp(x - 37.0, datetime.UTC).isoformat(" ", "microseconds") for x in send]
    stamp = [repr(round(float(x), 6)) for x in tai]
    cells = [
        utc,
        _r(g["a"] + rng.normal(0, 0.008, m), 9),
        stamp,
        _r(jerk, 9),
        stamp,
        _r(g["q"] + rng.normal(0, 1.5e-6, m), 10),
        stamp,
        _r(g["f"] + rng.normal(0, 160, m), 4),
        stamp,
        _r(g["v"] + rng.normal(0, 0.0008, m), 9),
        stamp,
        _r(g["jr"], 9),
        stamp,
        _r(g["xr"], 10),
        stamp,
        _r(g["vr"], 9),
        stamp,
        _r(send - 37.0, 6),
        ["MTMount"] * m,
        _r(send - 37.0 + 0.012, 6),
        ["3918"] * m,
        _r(send + 0.011, 6),
        ["d2ed1a3e"] * m,
        _f(np.arange(m) + 81000, "%d"),
        _r(send, 6),
        stamp,
    ]
    _lines(path, [",".join(["", *MOUNT]), *_rows(cells)])


_mount_truth = {name: Truth() for name in MOUNT}
_mount_accept: dict[str, tuple[str, ...]] = {}
for _name in MOUNT:
    if _name.endswith("Timestamp"):
        _mount_truth[_name] = Truth("time", "", "s")
        _mount_accept[_name] = ("",)
    if _name.endswith("Stamp"):
        _mount_accept[_name] = ("time",)
_mount_truth["timestamp"] = Truth("time", "", "s")
_mount_truth["actualPosition"] = Truth("position")
_mount_truth["actualVelocity"] = Truth("speed")
_mount_truth["actualAcceleration"] = Truth("acceleration")
_mount_truth["actualTorque"] = Truth("torque")
_mount_truth["demandPosition"] = Truth("reference_position")
_mount_truth["demandVelocity"] = Truth("reference_speed")
_mount_accept["demandPosition"] = _mount_accept["demandVelocity"] = ("",)

mount = Layout(
    "telescope mount azimuth (EFD query)",
    "lsst-ts/ts_mtmount azimuth telemetry (names of the mock controller's dictionary; actualTorque in N m), "
    "queried from the EFD as a DataFrame and written by to_csv: fields in alphabetic order, private_ fields of "
    "SAL, unnamed UTC index. Known from the observatory's notes: 20 Hz, deg, TAI stamps. Made up: values.",
    ".csv",
    "rotary axis",
    _write_mount,
    _mount_truth,
    _mount_accept,
)


# 15: MyActuator motor feedback

MYACTUATOR = ["time (s)", "motor_id", "position (deg)", "velocity (rpm)", "current (A)", "temperature(C)"]


def _write_myactuator(path: Path, rng: Rng) -> None:
    dt = 0.001
    moves = alternate(rng, -1.2, 1.5, (2.2, 4.0, 1.2), 14.0, 27.0, (0.4, 1.1), 1.0)
    xr = plan(moves, -1.2, dt, 0.05)
    begin = crossing(xr, dt, 0.6, 1, 2) - 0.05
    s = axis(
        xr,
        dt,
        inertia=0.16,
        coulomb=0.7,
        viscous=0.28,
        bandwidth=38.0,
        limit=11.0,
        stiction=0.01,
        obstacles=[(0.6, 1, 120.0, 1.2, begin, 0.3)],
    )
    times = _jitter(rng, int(s.t[-1] / 0.01), 0.0101, 0.0003, 0.006, 0.01)
    times = times[times < s.t[-1]]
    g = s.at(times)
    n = len(times)
    degrees = quantised(np.degrees(g.x) + rng.normal(0, 0.004, n), 0.01)
    rpm = np.round(np.degrees(g.v) + rng.normal(0, 0.8, n)) / 6.0
    amps = quantised(np.interp(times, s.t, low_pass(s.drive, dt, 120.0)) / 1.9 + rng.normal(0, 0.03, n), 0.01)
    warm = np.floor(31 + 3.0 * times / times[-1])
    cells = [
        _r(1731400000.0 + rng.uniform(0, 50000) + times, 7),
        ["1"] * n,
        _r(degrees, 2),
        _r(rpm, 15),
        _r(amps, 2),
        _f(warm, "%d"),
    ]
    _lines(path, [",".join(MYACTUATOR), *_rows(cells)], "\r\n")


myactuator = Layout(
    "MyActuator motor_feedback.csv",
    "GitHub yukunlin1124/Orin-Motor-Control motor_logger.py: header with its inconsistent blanks exact, "
    "time.time, one motor. Made up: 100 Hz, resolution (0.01 deg, 1 deg/s, 0.01 A), values; one run into an "
    "obstacle.",
    ".csv",
    "rotary axis",
    _write_myactuator,
    {
        "time (s)": Truth("time", "", "s"),
        "motor_id": Truth(),
        "position (deg)": Truth("position", "", "deg"),
        "velocity (rpm)": Truth("speed", "", "rpm"),
        "current (A)": Truth("current", "", "A"),
        "temperature(C)": Truth(),
    },
)


LAYOUTS: tuple[Layout, ...] = (
    leg,
    finger,
    a1,
    meca,
    heros,
    excavator,
    comax,
    axenum,
    frc,
    press,
    module,
    ev3,
    exo,
    mount,
    myactuator,
)
