"""Fifteen layouts more by somebody who had not seen the guesser: a third set that `cdtool init` is measured on.

`source` states what is exact and what is made up: all values are simulated.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.commands.init.layouts.layout import Layout, Truth
from tests.commands.init.layouts.simulators import (
    alternate,
    arm_torque,
    axis,
    crossing,
    follow,
    low_pass,
    plan,
    poses,
    quantised,
    speed_of,
    text,
)

Array = np.ndarray
Rng = np.random.Generator


def _save(
    path: Path,
    names: Sequence[str],
    cells: Sequence[Sequence[str]],
    separator: str = ",",
    header: bool = True,
    before: Sequence[str] = (),
    encoding: str = "utf-8",
    heading: str | None = None,
    end: str = "\n",
) -> None:
    lines = list(before)
    if header:
        lines.append(heading if heading is not None else separator.join(names))
    lines += [separator.join(row) for row in zip(*cells, strict=True)]
    path.write_bytes((end.join(lines) + end).encode(encoding))


def _joints(channel: str, names: Sequence[str], joints: Sequence[str], unit: str) -> dict[str, Truth]:
    return {name: Truth(channel, joint, unit) for name, joint in zip(names, joints, strict=True)}


def _pulse(t: Array, at: float, width: float) -> Array:
    """Return a push: a half sine of `width` seconds that begins at `at`."""
    return np.where((t >= at) & (t <= at + width), np.sin(np.pi * np.clip((t - at) / width, 0.0, 1.0)), 0.0)


def _named(prefix: str, count: int, first: int = 0) -> list[str]:
    return [f"{prefix}{i}" for i in range(first, first + count)]


# robots


def _rokae(path: Path, rng: Rng) -> None:
    dt, n = 0.001, 60000
    t = np.arange(1, n + 1) * dt
    amplitude = np.array([0.45, 0.45, 0.45, 0.5, 0.5, 0.5, 0.5])
    rate = np.arange(2, 9) / 10.0
    phase = np.arange(7) * np.pi / 7.0
    rest = np.radians([-2.458, 20.651, -2.044, 78.492, 4.682, 47.719, -5.433])
    # the real arm starts smoothly although the first target is away from its rest
    share = np.clip(t / 1.5, 0.0, 1.0)[:, None]
    ref = rest + share**3 * (10.0 - 15.0 * share + 6.0 * share**2) * amplitude * np.sin(rate * t[:, None] + phase)
    q, v, a = follow(ref, dt, 90.0)
    tau = arm_torque(
        q,
        v,
        a,
        inertia=(2.6, 2.9, 0.9, 0.8, 0.25, 0.2, 0.08),
        coulomb=(5.5, 6.0, 3.8, 3.6, 1.6, 1.5, 0.9),
        viscous=(9.0, 10.0, 5.0, 5.0, 2.0, 2.0, 1.0),
        lift=1,
        elbow=3,
        moments=(46.0, 17.0),
        coupling=0.6,
        wrist=(5, 2.1),
    )
    touch = _pulse(t, rng.uniform(36.0, 42.0), 0.35) + 0.7 * _pulse(t, rng.uniform(50.0, 54.0), 0.5)
    tau += touch[:, None] * np.array([9.0, 14.0, 5.0, 8.0, 1.5, 2.0, 0.1])
    k = slice(0, n, 10)
    q, v, a, tau = (s[k] for s in (q, v, a, tau))
    m = len(q)
    q = quantised(q + rng.normal(0.0, 3e-6, q.shape), 1.2e-6)
    v = v + rng.normal(0.0, 1.5e-3, v.shape)
    a = a + rng.normal(0.0, 0.008, a.shape)
    tau = tau + rng.normal(0.0, 1.0, tau.shape) * np.array([0.15, 0.15, 0.1, 0.1, 0.05, 0.05, 0.03])
    cells = [text(t[k], "%.6f")]
    for s in (q, v, a, tau):
        cells += [text(s[:, j], "%.6f") for j in range(7)]
    names = ["time", *_named("q", 7), *_named("dq", 7), *_named("ddq", 7), *_named("tau", 7)]
    assert m == 6000
    _save(path, names, cells)


_SEVEN = _named("", 7)
ROKAE = Layout(
    "rokae_dynamics_collection",
    "ROKAE xCore SDK, user example step1_dynamics_data_collection.cpp on GitHub: header, order, fixed 6 digits, 1 "
    "ms loop with every 10th sample kept, 60 s of sines with the amplitudes and rates of the source are exact; "
    "the resting pose (a bent arm), the smooth start, dynamics, noise and the touches are made up. Units only in "
    "the source's comments.",
    ".csv",
    "robot",
    _rokae,
    {
        "time": Truth("time", "", "s"),
        **_joints("position", _named("q", 7), _SEVEN, "rad"),
        **_joints("speed", _named("dq", 7), _SEVEN, "rad/s"),
        **_joints("acceleration", _named("ddq", 7), _SEVEN, ""),
        **_joints("torque", _named("tau", 7), _SEVEN, ""),
    },
)


def _teach(path: Path, rng: Rng) -> None:
    dt = 0.001
    points = np.vstack([np.zeros(6), rng.uniform(-0.9, 0.9, (7, 6))])
    points[1:, 1] = rng.uniform(0.3, 1.2, 7)
    points[1:, 2] = rng.uniform(-1.3, -0.2, 7)
    points = np.vstack([points, np.zeros(6)])
    ref = poses(points, [0.9, 0.6, 1.1, 0.8, 0.5, 1.0, 0.7, 0.8], rng.uniform(0.5, 1.3, 8), dt, 2.0, 0.15)
    q, v, a = follow(ref, dt, 60.0)
    t = np.arange(len(q)) * dt
    tau = arm_torque(
        q,
        v,
        a,
        inertia=(0.32, 0.4, 0.2, 0.05, 0.04, 0.02),
        coulomb=(0.5, 0.7, 0.5, 0.16, 0.14, 0.1),
        viscous=(0.6, 0.8, 0.5, 0.15, 0.12, 0.08),
        lift=1,
        elbow=2,
        moments=(7.5, 4.0),
        coupling=0.09,
        wrist=(4, 0.35),
    )
    tau += _pulse(t, 0.62 * t[-1], 0.3)[:, None] * np.array([2.5, 3.0, 1.6, 0.3, 0.3, 0.05])
    at, stamps = 0.032444, []
    while at < t[-1] - 0.02:
        stamps.append(at)
        at += 0.01 + rng.choice([0.0, 0.001], p=[0.93, 0.07]) + rng.normal(0.0, 6e-5)
    s = np.array(stamps)
    q, v, tau = (np.column_stack([np.interp(s, t, c) for c in x.T]) for x in (q, v, tau))
    q = quantised(q, 3.8e-4) + rng.normal(0.0, 1e-6, q.shape)
    v = quantised(v + rng.normal(0.0, 4e-3, v.shape), 7.3e-3)
    tau = quantised(tau + rng.normal(0.0, 0.03, tau.shape), 2.93e-3)
    cells = [text(s, "%.6f")] + [text(x[:, j], "%.6f") for x in (q, v, tau) for j in range(6)]
    _save(path, ["timestamp", *_named("pos", 6), *_named("vel", 6), *_named("effort", 6)], cells)


_SIX = _named("", 6)
TEACH = Layout(
    "arm380_trajectory_record",
    "GitHub Ding-Kaiyue/universal-arm-controller, README of TrajectoryRecordController: header, 6 digits, start "
    "stamp, nominal 100 Hz from a 1 kHz topic, .txt are exact; README states rad, rad/s, N m, the file does not. "
    "Replayed moves instead of hand guiding, dynamics, quantisation and a push are made up.",
    ".txt",
    "robot",
    _teach,
    {
        "timestamp": Truth("time", "", "s"),
        **_joints("position", _named("pos", 6), _SIX, "rad"),
        **_joints("speed", _named("vel", 6), _SIX, "rad/s"),
        **_joints("torque", _named("effort", 6), _SIX, ""),
    },
)


_DH = (
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -1),
    (0.0, 0.316, 1),
    (0.0825, 0.0, 1),
    (-0.0825, 0.384, -1),
    (0.0, 0.0, 1),
    (0.088, 0.107, 1),
)


def _forward(q: Array) -> Array:
    """Return (n, 4, 4) poses of the flange of a seven-joint arm (modified DH)."""
    n = len(q)
    pose = np.tile(np.eye(4), (n, 1, 1))
    for j, (a, d, turn) in enumerate(_DH):
        c, s = np.cos(q[:, j]), np.sin(q[:, j])
        ca, sa = (1.0, 0.0) if turn == 0 else (0.0, float(turn))
        step = np.zeros((n, 4, 4))
        step[:, 0, 0], step[:, 0, 1], step[:, 0, 3] = c, -s, a
        step[:, 1, 0], step[:, 1, 1], step[:, 1, 2], step[:, 1, 3] = s * ca, c * ca, -sa, -d * sa
        step[:, 2, 0], step[:, 2, 1], step[:, 2, 2], step[:, 2, 3] = s * sa, c * sa, ca, d * ca
        step[:, 3, 3] = 1.0
        pose = pose @ step
    return pose


def _capsule(path: Path, rng: Rng) -> None:
    dt = 0.001
    home = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
    points = [home]
    for _ in range(3):
        points.append(home + rng.uniform(-1.0, 1.0, 7) * np.array([0.5, 0.35, 0.4, 0.4, 0.5, 0.4, 0.6]))
    points.append(home)
    ref = poses(points, [0.9, 1.1, 1.2, 1.0], [0.3, 0.25, 0.2, 0.3], dt, 4.0, 0.12)[:6200]
    q, v, a = follow(ref, dt, 120.0)
    t = np.arange(len(q)) * dt
    demand = speed_of(speed_of(ref, dt), dt)
    tau = arm_torque(
        q,
        v,
        a,
        inertia=(1.1, 1.3, 0.7, 0.6, 0.15, 0.12, 0.05),
        coulomb=(0.55, 0.7, 0.5, 0.6, 0.55, 0.35, 0.3),
        viscous=(0.5, 0.6, 0.4, 0.5, 0.3, 0.2, 0.2),
        lift=1,
        elbow=3,
        moments=(38.0, 9.0),
        coupling=0.5,
        wrist=(5, 1.6),
    )
    at = rng.uniform(2.0, 4.5)
    hit = _pulse(t, at, 0.18)
    lever = np.array([6.0, 9.0, 3.0, 5.0, 1.0, 1.2, 0.1])
    tau += hit[:, None] * lever
    drift = low_pass(rng.normal(0.0, 1.0, (len(t), 7)), dt, 1.5) * 6.0
    outer = low_pass(-hit, dt, 40.0)[:, None] * lever + drift * 0.12 + 0.2 * np.tanh(v / 0.05)
    force = np.column_stack(
        [low_pass(-hit, dt, 40.0) * 22.0, low_pass(-hit, dt, 40.0) * 9.0, low_pass(hit, dt, 40.0) * 5.0]
    )
    force = force + low_pass(rng.normal(0.0, 1.0, (len(t), 3)), dt, 1.5) * 9.0 + np.array([0.6, -0.4, 1.1])
    moment = force[:, ::-1] * 0.11 + low_pass(rng.normal(0.0, 1.0, (len(t), 3)), dt, 2.0)
    q = q + rng.normal(0.0, 4e-6, q.shape)
    v = v + rng.normal(0.0, 5e-4, v.shape)
    tau = tau + rng.normal(0.0, 0.05, tau.shape)
    pose = _forward(q).transpose(0, 2, 1).reshape(-1, 16)
    names = ["time", *_named("q", 7, 1), *_named("dq", 7, 1), *_named("ddq_d", 7, 1), *_named("O_T_EE_", 16, 1)]
    names += [*_named("tau_J", 7, 1), *_named("tau_ext", 7, 1)]
    names += ["O_F_ext_x", "O_F_ext_y", "O_F_ext_z", "O_T_ext_x", "O_T_ext_y", "O_T_ext_z"]
    cells = [text(t, "%.6g")]
    for block in (q, v, demand, pose, tau, outer, force, moment):
        cells += [text(block[:, j], "%.6g") for j in range(block.shape[1])]
    _save(path, names, cells)


_ONE = _named("", 7, 1)
_DECOYS = (*_named("O_T_EE_", 16, 1), *_named("tau_ext", 7, 1))
CAPSULE = Layout(
    "franka_capsule_save_log",
    "GitHub, save_log_to_csv of an Italian Franka project (header_capsuleStatiche.h): header, order, default "
    "6-digit stream output, time = 0, 0.001, ... are exact. Trajectory, dynamics, estimates and one collision are "
    "made up.",
    ".csv",
    "robot",
    _capsule,
    {
        "time": Truth("time", "", "s"),
        **_joints("position", _named("q", 7, 1), _ONE, "rad"),
        **_joints("speed", _named("dq", 7, 1), _ONE, "rad/s"),
        **_joints("reference_acceleration", _named("ddq_d", 7, 1), _ONE, ""),
        **{name: Truth() for name in _DECOYS},
        **_joints("torque", _named("tau_J", 7, 1), _ONE, ""),
        **{f"O_{kind}_ext_{d}": Truth() for kind in "FT" for d in "xyz"},
    },
    dict.fromkeys(_named("ddq_d", 7, 1), ("",)),
)


def _moe(path: Path, rng: Rng) -> None:
    dt, n = 0.001, 10000
    t = np.arange(n) * dt
    neutral = np.radians([-35.0, 0.0, 0.0, 0.0])
    low, high, size = 0.1, 0.75, np.radians(20.0)
    ref = np.tile(neutral, (n, 1))
    ref[:, 0] += size * np.sin(2 * np.pi * ((high - low) / 10.0 / 2.0 * t**2 + low * t))
    lag = np.zeros((n, 4))
    q, v, a = follow(ref, dt, 35.0)
    # the joints that hold are moved a little by the active one
    for j, share in ((1, 0.0022), (2, -0.0015), (3, 0.0011)):
        wander = low_pass(low_pass(low_pass(rng.normal(0.0, 1.0, n + 2000), dt, 2.0), dt, 2.0), dt, 2.0)[2000:]
        wander = wander - wander[0]
        lag[:, j] = low_pass(low_pass(a[:, 0] * share, dt, 5.0), dt, 5.0) + wander * 0.05
    q = q + lag
    v = v + speed_of(lag, dt)
    a = a + speed_of(speed_of(lag, dt), dt)
    mass = np.array([0.22, 0.06, 0.014, 0.012])
    rub = np.array([0.55, 0.3, 0.12, 0.12])
    damp = np.array([0.4, 0.12, 0.05, 0.05])
    tau = a * mass + rub * np.tanh(v / 0.03) + damp * v
    tau[:, 0] += 2.6 * np.sin(q[:, 0] + 1.9)
    tau[:, 1] += 0.35
    tau[:, 2] -= 0.22
    tau[:, 3] += 0.15
    step = 2 * np.pi / np.array([4 * 500 * 10.0, 4 * 500 * 9.0, 4 * 500 * 18.0, 4 * 500 * 20.0])
    measured = quantised(q, step)
    v = low_pass(v + rng.normal(0.0, 1.0, v.shape) * 4e-3, dt, 120.0)
    tau = tau + low_pass(rng.normal(0.0, 1.0, tau.shape), dt, 150.0) * np.array([0.08, 0.05, 0.02, 0.02])
    stamps = t + np.abs(rng.normal(0.0, 2e-5, n)) + 2.1e-6
    names = list(MOE_NAMES)
    cells = [text(stamps, "%.6g")]
    for block in (ref, measured, v, tau):
        cells += [text(block[:, j], "%.6g") for j in range(4)]
    _save(path, names, cells)


_DOF = ("EFE", "FPS", "WFE", "WRU")
MOE_NAMES = (
    "Time (s)",
    *(f"{d}Ref_rad_" for d in _DOF),
    *(f"{d}Act_rad_" for d in _DOF),
    *(f"{d}Act_rad_s_" for d in _DOF),
    *(f"{d}Trq_Nm_" for d in _DOF),
)
MOE = Layout(
    "mahi_open_exo_arm_properties",
    "GitHub, MAHI Open Exo, ex_arm_prop_data_collection.cpp: header, order, 1 kHz, the 10 s chirp (0.1 to 0.75 "
    "Hz, 20 deg, neutral pose) of one active joint are exact; encoder steps, dynamics and noise are made up. The "
    "torques are those the position controller commands; there is no measured one.",
    ".csv",
    "robot",
    _moe,
    {
        "Time (s)": Truth("time", "", "s"),
        **_joints("reference_position", [f"{d}Ref_rad_" for d in _DOF], _DOF, "rad"),
        **_joints("position", [f"{d}Act_rad_" for d in _DOF], _DOF, "rad"),
        **_joints("speed", [f"{d}Act_rad_s_" for d in _DOF], _DOF, "rad/s"),
        **_joints("torque", [f"{d}Trq_Nm_" for d in _DOF], _DOF, "N m"),
    },
    {
        **{f"{d}Ref_rad_": ("",) for d in _DOF},
        **{f"{d}Trq_Nm_": ("reference_torque",) for d in _DOF},
    },
)


def _twin(path: Path, rng: Rng) -> None:
    dt = 0.001
    axes = []
    for low, high, inertia, rub in ((0.0, 2.4, 1.3e-3, 0.030), (-1.6, 0.0, 1.0e-3, 0.024)):
        start, far = (low, high) if high > 0 else (high, low)
        moves = alternate(rng, start, far, [2.5, 4.0, 1.5, 5.0], 30.0, 30.0, (0.5, 1.4), 1.2)
        moves = [(x, s, acc, r) for x, s, acc, r in moves]
        xr = plan(moves, start, dt, 0.05)
        stop = start + 0.6 * (far - start)
        side = 1 if far > start else -1
        walls = [(stop, side, 0.5, 0.002, crossing(xr, dt, stop, side, 3) - 0.5, 0.4)]
        axes.append(
            axis(xr, dt, inertia=inertia, coulomb=rub, viscous=0.004, bandwidth=40.0, obstacles=walls, stiction=0.02)
        )
    end = min(a.t[-1] for a in axes)
    at, stamps = 6.67572021484375e-06, []
    slow = 0
    while at < end:
        stamps.append(at)
        slow = slow - 1 if slow > 0 else (400 if rng.random() < 0.002 else 0)
        at += (0.0094 if slow else 0.0052) + abs(rng.normal(0.0, 3.5e-4))
    s = np.array(stamps)
    cells = [[repr(float(x)) for x in s]]
    kt, part = 0.083, []
    for a in axes:
        b = a.at(s)
        force = b.drive + rng.normal(0.0, 2e-4, len(s))
        part.append(
            (
                np.round(b.xr, 9),
                b.v + rng.normal(0.0, 0.03, len(s)),
                quantised(b.x + rng.normal(0.0, 1.2e-5, len(s)), 3.814697265625e-06),
                force / kt + rng.normal(0.0, 0.16, len(s)),
                force,
            )
        )
    for ref, speed, position, _, _ in part:
        cells += [text(ref, "%.6g"), text(speed, "%.17g"), text(position, "%.10g")]
    cells += [
        text(part[0][3], "%.17g"),
        text(part[1][3], "%.17g"),
        text(part[0][4], "%.17g"),
        text(part[1][4], "%.17g"),
    ]
    _save(path, TWIN_NAMES, cells)


TWIN_NAMES = (
    "time",
    "ref_0",
    "Velocity_0",
    "Position_0",
    "ref_1",
    "Velocity_1",
    "Position_1",
    "current_0",
    "current_1",
    "input_torque_0",
    "input_torque_1",
)
TWIN = Layout(
    "klab_two_motor_position",
    "GitHub N-Iemura/klab_ws, ODRIVE_only/202412/csv/two_pos_*.csv: header, order, full double digits, first "
    "stamp, uneven clock of 5 to 10 ms, encoder step 1/262144 turn and noise of speed and current at rest as in "
    "the file; the motions (turns), friction and stops are made up. No unit in the file.",
    ".csv",
    "robot",
    _twin,
    {
        "time": Truth("time", "", "s"),
        **{f"ref_{j}": Truth("reference_position", f"{j}", "") for j in (0, 1)},
        **{f"Velocity_{j}": Truth("speed", f"{j}", "") for j in (0, 1)},
        **{f"Position_{j}": Truth("position", f"{j}", "") for j in (0, 1)},
        **{f"current_{j}": Truth("current", f"{j}", "") for j in (0, 1)},
        **{f"input_torque_{j}": Truth("reference_torque", f"{j}", "") for j in (0, 1)},
    },
    {"ref_0": ("",), "ref_1": ("",), "input_torque_0": ("", "torque"), "input_torque_1": ("", "torque")},
)


def _abb(path: Path, rng: Rng) -> None:
    dt = 0.004
    points = [np.array([0.0, 0.0, 0.0, 0.0, 30.0, 0.0])]
    for _ in range(7):
        points.append(rng.uniform(-1.0, 1.0, 6) * np.array([70, 35, 30, 80, 40, 120]) + np.array([0, 10, 5, 0, 45, 0]))
    points.append(points[0])
    rests = [0.4, 0.0, 0.5, 0.2, 0.0, 0.6, 0.3, 0.4]
    ref = poses(points, [60, 90, 45, 80, 110, 60, 75, 50], rests, dt, 250.0, 0.12)
    q, _, _ = follow(ref, dt, 40.0)
    n = len(q)
    t = np.arange(n) * dt + np.abs(rng.normal(0.0, 1.6e-4, n))
    t[1:] += np.where(rng.random(n - 1) < 0.004, 0.0013, 0.0)
    t = np.round(t, 6)
    goal = np.cumsum(
        [
            len(poses(points[i : i + 2], [r], [p], dt, 250.0, 0.12))
            for i, (r, p) in enumerate(zip([60, 90, 45, 80, 110, 60, 75, 50], rests, strict=True))
        ]
    )
    number = np.searchsorted(goal, np.arange(n), side="right") + 1.0
    q = q + rng.normal(0.0, 4e-4, q.shape)
    cells = [text(t, "%.6g"), text(number, "%d"), *(text(q[:, j], "%.6G") for j in range(6))]
    names = ["timestamp", "cmd_num", *_named("J", 6, 1)]
    _save(path, names, cells, separator=", ")


ABB = Layout(
    "abb_motion_program_log",
    "GitHub rpiRobotics/abb_motion_program_exec, robot/HOME/motion_program_logger.mod (RAPID): names, comma and "
    "blank, numbers as RAPID writes them (6 digits), 4 ms clock are exact; GetJointData gives degrees. Moves and "
    "jitter made up. Positions only.",
    ".csv",
    "robot",
    _abb,
    {
        "timestamp": Truth("time", "", "s"),
        "cmd_num": Truth(),
        **_joints("position", _named("J", 6, 1), _named("", 6, 1), "deg"),
    },
)


# rotary axes


def _jsdk(path: Path, rng: Rng) -> None:
    dt = 0.001
    moves = alternate(rng, -0.9, 1.1, [1.2, 2.4, 0.7, 3.0], 14.0, 36.0, (0.4, 1.2), 1.5)
    xr = plan(moves, -0.9, dt, 0.06)
    stop = 0.45
    walls = [(stop, 1, 260.0, 1.5, crossing(xr, dt, stop, 1, 4) - 0.4, 0.35)]
    s = axis(
        xr, dt, inertia=0.085, coulomb=0.75, viscous=0.32, bandwidth=35.0, obstacles=walls, limit=18.0, stiction=0.01
    )
    at, stamps = 0, []
    while at < s.t[-1] * 1000 - 20:
        stamps.append(at)
        at += int(rng.choice([10, 11, 12], p=[0.62, 0.35, 0.03]))
    ms = np.array(stamps, float)
    age = rng.integers(0, 3, len(ms))
    b = s.at(ms / 1000.0)
    n = len(ms)
    torque = b.drive + rng.normal(0.0, 0.06, n)
    position = quantised(b.x, 2 * np.pi / 16384 / 9)
    speed = b.v + rng.normal(0.0, 0.012, n)
    current = torque / 0.74 + rng.normal(0.0, 0.04, n)
    warm = quantised(31.0 + 4.0 * (1 - np.exp(-ms / 20000.0)) + rng.normal(0.0, 0.05, n), 0.1)
    fet = quantised(33.5 + 2.5 * (1 - np.exp(-ms / 9000.0)) + rng.normal(0.0, 0.08, n), 0.1)
    power = np.abs(torque * b.v) + 0.09 * current**2 + 1.9
    volts = 48.1 - 0.012 * power / 48.0 + rng.normal(0.0, 0.02, n)
    frames = np.cumsum(rng.integers(2, 4, n)) + 140
    cells = [
        text(ms, "%d"),
        ["5"] * n,
        text(position, "%.6f"),
        text(speed, "%.6f"),
        text(current, "%.6f"),
        text(torque, "%.6f"),
        text(warm, "%.2f"),
        text(fet, "%.2f"),
        text(volts, "%.3f"),
        text(power / 48.0 + rng.normal(0.0, 0.005, n), "%.3f"),
        ["CLOSED_LOOP"] * n,
        ["MIT"] * n,
        ["0"] * n,
        ["0"] * n,
        text(age.astype(float), "%d"),
        text(frames.astype(float), "%d"),
        ["0"] * n,
    ]
    _save(path, JSDK_NAMES, cells)


JSDK_NAMES = (
    "t_ms",
    "node",
    "pos_rad",
    "vel_rad_s",
    "current_A",
    "torque_Nm",
    "t_motor_C",
    "t_fet_C",
    "vbus_V",
    "ibus_A",
    "axis_state",
    "mode",
    "err_code",
    "hb_error",
    "age_ms",
    "tx_frames",
    "tx_rejected",
)
JSDK = Layout(
    "jsdk_cli_mon",
    "GitHub, jsdk-cli / jsdk_can of a joint module maker, `mon --csv` (CLI_MON_CSV_HEADER and its row format): "
    "header, order, digits and the drifting sleep clock are exact; the names of state and mode, motion, friction "
    "and the stop are made up.",
    ".csv",
    "rotary axis",
    _jsdk,
    {
        **{name: Truth() for name in JSDK_NAMES},
        "t_ms": Truth("time", "", "ms"),
        "pos_rad": Truth("position", "", "rad"),
        "vel_rad_s": Truth("speed", "", "rad/s"),
        "current_A": Truth("current", "", "A"),
        "torque_Nm": Truth("torque", "", "N m"),
    },
    {"current_A": ("",)},
)


def _csp(path: Path, rng: Rng) -> None:
    dt = 0.001
    turn = 131072.0
    moves = []
    for _ in range(3):
        far = rng.uniform(0.18, 0.30)
        moves += [(far, rng.uniform(0.22, 0.35), 1.6, 0.9), (0.0, rng.uniform(0.22, 0.35), 1.6, 1.1)]
    moves += [(-0.2, 0.4, 2.5, 0.6), (0.0, 0.3, 2.0, 0.7)]
    xr = plan(moves, 0.0, dt, 0.08)
    side = 0.11
    walls = [(side, 1, 4.5, 0.05, crossing(xr, dt, side, 1, 1) - 0.5, 0.5)]
    # in turns: N m per turn/s^2
    s = axis(
        xr, dt, inertia=0.02, coulomb=0.11, viscous=0.05, bandwidth=45.0, obstacles=walls, limit=2.4, stiction=0.004
    )
    n = len(s.t)
    base = int(rng.integers(200000, 900000))
    target = np.round(s.xr * turn) + base
    actual = np.round(s.x * turn + rng.normal(0.0, 1.2, n)) + base
    speed = np.round(low_pass(s.v * turn + rng.normal(0.0, 120.0, n), dt, 180.0))
    torque = np.round(s.drive / 1.27 * 1000.0 + rng.normal(0.0, 6.0, n))
    start = 51234 * 10**9 + int(rng.integers(0, 10**9))
    deadline = start + np.arange(n, dtype=np.int64) * 1_000_000
    late = np.abs(rng.normal(14000.0, 5000.0, n)).astype(np.int64) + 2100
    stamp = deadline + late
    names = list(CSP_NAMES)
    columns: dict[str, list[str]] = {
        "cycle": [str(i) for i in range(n)],
        "timestamp_ns": [str(x) for x in stamp.tolist()],
        "deadline_ns": [str(x) for x in deadline.tolist()],
        "lateness_ns": [str(x) for x in late.tolist()],
        "missed_cycles": ["0"] * n,
        "statusword_raw": ["0x1237"] * n,
        "statusword_masked": ["0x0027"] * n,
        "controlword": ["0x000F"] * n,
        "mode_command": ["8"] * n,
        "target_position": text(target, "%d"),
        "actual_position": text(actual, "%d"),
        "actual_velocity": text(speed, "%d"),
        "actual_torque": text(torque, "%d"),
        "working_counter": ["3"] * n,
        "wc_state": ["2"] * n,
        "slave_online": ["1"] * n,
        "slave_operational": ["1"] * n,
        "master_link_up": ["1"] * n,
    }
    moving = np.abs(s.vr) > 1e-6
    out = s.xr > 0.02
    phase = np.where(moving & (s.vr * np.sign(s.xr + 1e-9) > 0), 7, np.where(moving, 9, np.where(out, 8, 6)))
    columns["phase"] = text(phase.astype(float), "%d")
    angle = 2 * np.pi * s.x * 10.0
    iq = s.drive / 1.27 * 260.0
    raw = {
        "motor_int_pos_3005": np.round((s.x * 16384.0) % 16384.0),
        "current_a_ad_3006": np.round(2048 + iq * np.cos(angle) + rng.normal(0, 3, n)),
        "current_b_ad_3007": np.round(2051 + iq * np.cos(angle - 2.0944) + rng.normal(0, 3, n)),
        "current_c_ad_3008": np.round(2045 + iq * np.cos(angle + 2.0944) + rng.normal(0, 3, n)),
        "current_oos_ad_3009": np.round(2047 + rng.normal(0, 2, n)),
        "control_mode_300a": np.full(n, 8.0),
    }
    for i, (name, values) in enumerate(raw.items()):
        first = 3 + 20 * i
        last = np.maximum((np.arange(n) - first) // 120 * 120 + first, 0)
        valid = np.arange(n) >= first
        columns[name] = text(np.where(valid, values[last], 0.0), "%d")
        columns[name + "_valid"] = text(valid.astype(float), "%d")
        columns[name + "_age_cycles"] = text(np.where(valid, np.arange(n) - last, 0).astype(float), "%d")
    _save(path, names, [columns[name] for name in names])


_DIAG = (
    "motor_int_pos_3005",
    "current_a_ad_3006",
    "current_b_ad_3007",
    "current_c_ad_3008",
    "current_oos_ad_3009",
    "control_mode_300a",
)
CSP_NAMES = (
    "cycle",
    "timestamp_ns",
    "deadline_ns",
    "lateness_ns",
    "missed_cycles",
    "statusword_raw",
    "statusword_masked",
    "controlword",
    "mode_command",
    "target_position",
    "actual_position",
    "actual_velocity",
    "actual_torque",
    "working_counter",
    "wc_state",
    "slave_online",
    "slave_operational",
    "master_link_up",
    "phase",
    *(name + end for name in _DIAG for end in ("", "_valid", "_age_cycles")),
)
CSP = Layout(
    "igh_csp_internal_diag",
    "GitHub, EtherCAT (IgH) CSP test of a JE servo with internal diagnosis, write_csv: header, order, integer and "
    "0x formats, 1 kHz, monotonic ns clock, one SDO every 20 cycles in turn, phases are exact; several ramps "
    "instead of one, 17-bit counts, torque per mille, an obstacle and the values of diagnosis are made up.",
    ".csv",
    "rotary axis",
    _csp,
    {
        **{name: Truth() for name in CSP_NAMES},
        "timestamp_ns": Truth("time", "", "ns"),
        "deadline_ns": Truth("time", "", "ns"),
        "target_position": Truth("reference_position", "", ""),
        "actual_position": Truth("position", "", ""),
        "actual_velocity": Truth("speed", "", ""),
        "actual_torque": Truth("torque", "", ""),
        "motor_int_pos_3005": Truth("", "", ""),
    },
    {
        "cycle": ("time",),
        "deadline_ns": ("",),
        "target_position": ("",),
        "motor_int_pos_3005": ("position",),
    },
)


def _hanging(path: Path, rng: Rng) -> None:
    dt = 0.0005
    cmd, kind, param = [], [], []

    def add(values: Array, what: str, size: str) -> None:
        cmd.append(values)
        kind.extend([what] * len(values))
        param.extend([size] * len(values))

    for size in (0.05, -0.05, 0.1, -0.1):
        add(np.full(round(1.0 / dt), size), "step", f"{size}")
        add(np.zeros(round(1.0 / dt)), "step", f"{size}")
    for rate in (0.5, 1.0, 2.0):
        clock = np.arange(round(4.0 / dt)) * dt
        add(0.05 * np.sin(2 * np.pi * rate * clock), "sine", f"{rate}")
    wanted = np.concatenate(cmd)
    n = len(wanted)
    rest, mass, hang, rub, damp = rng.uniform(-0.12, -0.05), 0.9, 28.0, 0.8, 1.6
    q, v = rest, 0.0
    out = np.empty((n, 3))
    kp, kd = 190.0, 9.0
    for i in range(n):
        tau = kp * (rest + wanted[i] - q) - kd * v + hang * np.sin(rest)
        load = hang * np.sin(q) + rub * np.tanh(v / 0.01) + damp * v
        out[i] = q, v, tau
        v += (tau - load) / mass * dt
        q += v * dt
    t = np.arange(n) * dt
    at, stamps = 0.0, []
    while at < t[-1]:
        stamps.append(at)
        at += 0.002 + abs(rng.normal(0.0, 6e-5)) + 2e-5
    s = np.array(stamps)
    k = np.minimum((s / dt).astype(int), n - 1)
    m = len(s)
    epoch = 1770091200.0 + float(rng.uniform(0.0, 5000.0))
    cells = [
        [f"{epoch + x:.6f}" for x in s.tolist()],
        [kind[i] for i in k],
        [param[i] for i in k],
        text(rest + wanted[k], "%.6f"),
        text(quantised(np.interp(s, t, out[:, 0]) + rng.normal(0.0, 4e-5, m), 1e-4 * 0.958738), "%.6f"),
        text(quantised(np.interp(s, t, out[:, 1]) + rng.normal(0.0, 6e-3, m), 0.0036), "%.6f"),
        text(quantised(np.interp(s, t, out[:, 2]) + rng.normal(0.0, 0.08, m), 0.0293), "%.6f"),
    ]
    before = ["# experiment: hanging_test_01", "# joint_index: 11", "# joint_name: Left_Hip_Pitch"]
    _save(path, HANGING_NAMES, cells, before=before)


HANGING_NAMES = (
    "timestamp",
    "test_type",
    "test_param",
    "cmd_position",
    "actual_position",
    "actual_velocity",
    "actual_torque",
)
HANGING = Layout(
    "hanging_joint_sysid",
    "GitHub, sim2real joint dynamics of a hanging humanoid (Booster T1), README: three comment lines, header, "
    "step amplitudes and sine rates, durations are exact; that the stamp is an epoch, 500 Hz, quantisation and "
    "the leg's dynamics are made up. One joint.",
    ".csv",
    "rotary axis",
    _hanging,
    {
        "timestamp": Truth("time", "", "s"),
        "test_type": Truth(),
        "test_param": Truth(),
        "cmd_position": Truth("reference_position", "", ""),
        "actual_position": Truth("position", "", ""),
        "actual_velocity": Truth("speed", "", ""),
        "actual_torque": Truth("torque", "", ""),
    },
    {"test_type": ("label",), "cmd_position": ("",)},
)


def _sea(path: Path, rng: Rng) -> None:
    dt = 0.00025
    moves = alternate(rng, -0.3, 0.5, [0.8, 1.6, 0.5], 9.0, 11.0, (0.3, 0.8), 0.5)
    xr = plan(moves, -0.3, dt, 0.08)[: round(12.5 / dt)]
    wall = 0.12
    walls = [(wall, 1, 320.0, 1.5, crossing(xr, dt, wall, 1, 2) - 0.3, 0.3)]
    s = axis(xr, dt, inertia=0.26, coulomb=0.5, viscous=0.9, bandwidth=28.0, obstacles=walls, limit=9.0, stiction=0.006)
    stiff, rotor, gain = 420.0, 0.055, 2.05
    tau = s.drive
    smooth = low_pass(tau, dt, 60.0)
    motor = s.x + smooth / stiff
    motor_v = speed_of(motor, dt)
    motor_a = speed_of(motor_v, dt)
    effort = smooth + rotor * low_pass(motor_a, dt, 60.0) + 0.9 * np.tanh(motor_v / 0.03) + 0.35 * motor_v
    k = slice(0, len(s.t), 4)
    h = 4 * dt
    t = s.t[k]
    n = len(t)
    theta_m = quantised(motor[k], 2 * np.pi / (4 * 1024 * 80))
    theta_e = quantised(s.x[k], 2 * np.pi / 80000)

    def rate(x: Array) -> Array:
        return low_pass(speed_of(x, h), h, 50.0)

    vm, ve = rate(theta_m), rate(theta_e)
    spring = stiff * (theta_m - theta_e)
    current = effort[k] / gain
    ref_v, ref = s.vr[k], s.xr[k]
    columns = (
        t + 1e-5 * rng.random(n),
        current + rng.normal(0.0, 0.05, n),
        low_pass(current, h, 120.0),
        theta_m,
        vm,
        rate(vm),
        theta_e,
        ve,
        rate(ve),
        spring,
        rate(spring),
        rate(rate(spring)),
        ref,
        ref_v,
        speed_of(ref_v, h),
    )
    forms = ["%.6f"] * 15
    _save(
        path, [str(i) for i in range(15)], [text(c, f) for c, f in zip(columns, forms, strict=True)], " ", header=False
    )


SEA = Layout(
    "series_elastic_textscan",
    "GitHub, MATLAB identification script of a series elastic actuator (textscan of 15 %f: t, current, "
    "CurrentCommand, theta_m, dtheta_m, ddtheta_m, theta_e, dtheta_e, ddtheta_e, tau, dtau, ddtau, ref, dref, "
    "ddref): order, no header, blanks as separators are exact; 1 kHz, digits, actuator, reference of the load's "
    "position and a stop are made up. Both angles are at the output; theta_e is the load's.",
    ".txt",
    "rotary axis",
    _sea,
    {
        "0": Truth("time", "", "s"),
        "1": Truth("current", "", ""),
        "2": Truth("reference_torque", "", ""),
        "3": Truth("position", "", ""),
        "4": Truth("speed", "", ""),
        "5": Truth("acceleration", "", ""),
        "6": Truth("position", "", ""),
        "7": Truth("speed", "", ""),
        "8": Truth("acceleration", "", ""),
        "9": Truth("torque", "", ""),
        "10": Truth(),
        "11": Truth(),
        "12": Truth("reference_position", "", ""),
        "13": Truth("reference_speed", "", ""),
        "14": Truth("reference_acceleration", "", ""),
    },
    {
        "1": ("",),
        "2": ("", "current"),
        "3": ("",),
        "4": ("",),
        "5": ("",),
        "8": ("",),
        "12": ("",),
        "13": ("",),
        "14": ("",),
    },
)


# linear axes


def _comma(values: Array, form: str) -> list[str]:
    return [cell.replace(".", ",") for cell in text(values, form)]


def _door(path: Path, rng: Rng) -> None:
    dt = 0.001
    wide = 0.9
    hinder = rng.uniform(0.3, 0.45)
    moves = [
        (wide, 0.45, 0.25, 1.5),
        (0.0, 0.40, 0.25, 3.0),
        (wide, 0.45, 0.25, 2.0),
        (hinder - 0.03, 0.40, 0.25, 2.5),
        (wide, 0.20, 0.25, 0.4),
        (0.0, 0.40, 0.25, 3.0),
        (0.45, 0.45, 0.25, 1.5),
        (0.0, 0.30, 0.25, 2.0),
    ]
    xr = plan(moves, 0.0, dt, 0.15)
    begin = crossing(xr, dt, hinder + 0.15, -1, 1)
    walls = [(hinder, -1, 2600.0, 60.0, begin, 1.2)]
    s = axis(
        xr, dt, inertia=85.0, coulomb=24.0, viscous=14.0, bandwidth=16.0, obstacles=walls, limit=100.0, stiction=0.004
    )
    per_amp = 42.0
    k = slice(0, len(s.t), 10)
    n = len(s.t[k])
    current = low_pass(s.drive / per_amp * 1000.0, dt, 80.0)[k] + rng.normal(0.0, 14.0, n)
    wanted = (s.drive / per_amp * 1000.0)[k]
    position = quantised(s.x[k], 0.00031) * 1000.0
    speed = low_pass(speed_of(quantised(s.x, 0.00031), dt), dt, 6.0)[k] * 1000.0
    pwm = np.clip(speed / 9.0 + current / 110.0, -100.0, 100.0)
    moving = s.vr[k]
    where = s.x[k]
    state = np.select(
        [moving > 1e-4, moving < -1e-4, where < 0.01],
        ["DOORSTATE_opening", "DOORSTATE_closing", "DOORSTATE_closed"],
        "DOORSTATE_open",
    ).tolist()
    cause = [""] * n
    last = len(cause)
    for i in range(1, n):
        if abs(moving[i]) <= 1e-4 < abs(moving[i - 1]):
            stop = "STOP_REVERSE_REQUEST" if abs(where[i] - hinder) < 0.06 and i < last else "STOP_END_REACHED"
            cause[i] = stop
    volts = 24.1 - 0.0002 * np.abs(current) + rng.normal(0.0, 0.03, n)
    cells = [
        text(np.arange(n) * 10.0, "%d"),
        state,
        _comma(s.xr[k] * 1000.0, "%.1f"),
        _comma(position, "%.1f"),
        _comma(s.vr[k] * 1000.0, "%.0f"),
        _comma(speed, "%.0f"),
        _comma(wanted, "%.0f"),
        _comma(current, "%.0f"),
        _comma(pwm, "%.1f"),
        _comma(volts, "%.2f"),
        cause,
    ]
    _save(path, DOOR_NAMES, cells, ";", encoding="cp1252", end="\r\n")


DOOR_NAMES = (
    "Zeit [ms]",
    "Türzustand",
    "Sollposition [mm]",
    "Istposition [mm]",
    "Sollgeschwindigkeit [mm/s]",
    "Istgeschwindigkeit [mm/s]",
    "Sollstrom [mA]",
    "Iststrom [mA]",
    "Soll-PWM [%]",
    "Versorgungsspannung [V]",
    "Stoppursache",
)
DOOR = Layout(
    "schiebetuer_hyperion",
    "Composed from a German functional description on GitHub of a sliding door drive (Hyperion-i firmware): the "
    "names and units of the cascade (Sollposition [mm], Sollgeschwindigkeit [mm/s], Sollstrom/Iststrom [mA], "
    "Soll-PWM [%]), door states, stop causes, 250 mm/s^2, 2500 mA limit are exact; no such file is public: order, "
    "10 ms, semicolons, decimal commas, cp1252, supply voltage, door and obstacle are made up.",
    ".csv",
    "linear axis",
    _door,
    {
        "Zeit [ms]": Truth("time", "", "ms"),
        "Türzustand": Truth(),
        "Sollposition [mm]": Truth("reference_position", "", "mm"),
        "Istposition [mm]": Truth("position", "", "mm"),
        "Sollgeschwindigkeit [mm/s]": Truth("reference_speed", "", "mm/s"),
        "Istgeschwindigkeit [mm/s]": Truth("speed", "", "mm/s"),
        "Sollstrom [mA]": Truth("reference_torque", "", "mA"),
        "Iststrom [mA]": Truth("current", "", "mA"),
        "Soll-PWM [%]": Truth(),
        "Versorgungsspannung [V]": Truth(),
        "Stoppursache": Truth(),
    },
    {
        "Sollposition [mm]": ("",),
        "Sollgeschwindigkeit [mm/s]": ("",),
        "Sollstrom [mA]": ("",),
        "Stoppursache": ("label",),
    },
)


def _press(path: Path, rng: Rng) -> None:
    dt = 0.0005
    part = 0.0925
    moves = []
    for _ in range(4):
        deep = part + rng.uniform(0.0022, 0.0034)
        moves += [(0.085, 0.12, 1.2, 1.1), (deep, 0.012, 0.3, 0.15), (0.0, 0.15, 1.2, 0.8)]
    xr = plan(moves, 0.0, dt, 0.04)
    walls = [(part, 1, 1.6e6, 9000.0, 0.0, 1e9)]
    weight = -150.0
    s = axis(
        xr,
        dt,
        inertia=310.0,
        coulomb=210.0,
        viscous=900.0,
        gravity=weight,
        bandwidth=70.0,
        obstacles=walls,
        limit=9000.0,
        stiction=0.0008,
    )
    k = slice(0, len(s.t), 8)
    n = len(s.t[k])
    t = s.t[k]
    position = quantised(s.x[k] * 1000.0, 0.001)
    speed = quantised(low_pass(s.v, dt, 60.0)[k] * 1000.0 + rng.normal(0.0, 0.12, n), 0.01)
    force = quantised(s.contact[k] + rng.normal(0.0, 6.0, n) + 4.0, 1.0)
    torque = quantised(s.drive[k] / 6500.0 * 100.0 + rng.normal(0.0, 0.35, n), 0.1)
    warm = quantised(38.0 + t * 0.02 + rng.normal(0.0, 0.05, n), 0.1)
    deeper = s.x[k] > 0.0845
    state = np.where(
        np.abs(s.vr[k]) < 1e-4, "保持", np.where(s.vr[k] < 0, "返回", np.where(deeper, "压装", "快进"))
    ).tolist()
    names = list(PRESS_NAMES)
    cells = [
        [str(i + 1) for i in range(n)],
        text(np.round(t * 1000.0), "%d"),
        text(position, "%.3f"),
        text(speed, "%.2f"),
        text(force, "%.0f"),
        text(torque, "%.1f"),
        text(warm, "%.1f"),
        state,
    ]
    _save(path, names, cells, encoding="utf-8-sig", end="\r\n")


PRESS_NAMES = ("序号", "时间(ms)", "位移(mm)", "速度(mm/s)", "压力(N)", "电机扭矩(%)", "电机温度(℃)", "动作阶段")
PRESS = Layout(
    "servo_press_chinese",
    "Composed from Chinese public texts: names and units 压力(N), 位移(mm) of a press tester's CSV "
    "export on GitHub (AppendLine of 序号 ... 最大压力(N) ... 最大位移(mm)), 速度(mm/s) and 扭矩 as in drive "
    "and robot SDK documents; no such curve file is public: order, UTF-8 with BOM, 4 ms, values "
    "and the press are made up. 压力 is the ram's load cell.",
    ".csv",
    "linear axis",
    _press,
    {
        "序号": Truth(),
        "时间(ms)": Truth("time", "", "ms"),
        "位移(mm)": Truth("position", "", "mm"),
        "速度(mm/s)": Truth("speed", "", "mm/s"),
        "压力(N)": Truth("force", "", "N"),
        "电机扭矩(%)": Truth("torque", "", "%"),
        "电机温度(℃)": Truth(),
        "动作阶段": Truth(),
    },
    {"动作阶段": ("label",)},
)


def _strike(path: Path, rng: Rng) -> None:
    dt = 0.0002
    moves = []
    for i in range(5):
        far = 0.232 if i != 2 else 0.19
        moves += [(far, rng.uniform(0.5, 1.1), 9.0, rng.uniform(0.5, 0.8)), (0.0, 0.5, 6.0, rng.uniform(0.3, 0.5))]
    xr = plan(moves, 0.0, dt, 0.03)
    walls = [(0.226, 1, 60000.0, 120.0, 0.0, 1e9)]
    s = axis(
        xr, dt, inertia=5.2, coulomb=7.0, viscous=11.0, bandwidth=90.0, obstacles=walls, limit=420.0, stiction=0.002
    )
    k = slice(0, len(s.t), 5)
    n = len(s.t[k])
    t = np.arange(n) * 1.0
    cells = [
        text(t, "%.15g"),
        text(low_pass(s.a, dt, 400.0)[k] + rng.normal(0.0, 0.25, n), "%.9g"),
        text(s.v[k] + rng.normal(0.0, 1.2e-3, n), "%.9g"),
        text(s.drive[k] / 38.6 + rng.normal(0.0, 0.03, n), "%.9g"),
        text(quantised(27.4 + t * 6e-5 + rng.normal(0.0, 0.03, n), 0.0625), "%.9g"),
        text(quantised(s.contact[k] + rng.normal(0.0, 0.5, n) - 0.7, 0.061), "%.9g"),
        text(quantised(s.x[k], 1e-6), "%.9g"),
    ]
    _save(path, STRIKE_NAMES, cells)


STRIKE_NAMES = (
    "relative_time_ms",
    "acceleration_m_s2",
    "velocity_m_s",
    "motor_current",
    "motor_temperature",
    "force_n",
    "position_m",
)
STRIKE = Layout(
    "linear_motor_specimen_db",
    "GitHub, Qt acquisition program of a linear motor test stand (AcquisitionDatabaseService, one PostgreSQL "
    "table per repetition and specimen): column names and order, doubles, time = sample index times period in ms "
    "are exact; exported as CSV with 1 kHz, the motor, sensors and the strikes on the specimen are made up. "
    "force_n is taken as the load cell at the specimen.",
    ".csv",
    "linear axis",
    _strike,
    {
        "relative_time_ms": Truth("time", "", "ms"),
        "acceleration_m_s2": Truth("acceleration", "", ""),
        "velocity_m_s": Truth("speed", "", "m/s"),
        "motor_current": Truth("current", "", ""),
        "motor_temperature": Truth(),
        "force_n": Truth("force", "", "N"),
        "position_m": Truth("position", "", "m"),
    },
)


def _stage(path: Path, rng: Rng) -> None:
    dt = 0.001
    moves = [
        (4000.0, 800.0, 600.0, 2.0),
        (1200.0, 600.0, 600.0, 1.5),
        (6500.0, 1000.0, 800.0, 2.0),
        (0.0, 1000.0, 800.0, 1.2),
        (3000.0, 400.0, 400.0, 1.5),
        (500.0 + float(rng.integers(0, 400)), 500.0, 400.0, 1.0),
        (0.0, 300.0, 400.0, 1.5),
    ]
    x = plan(moves, 0.0, dt, 0.02)
    v = speed_of(x, dt)
    t = np.arange(len(x)) * dt
    at, stamps = 2.1e-4, []
    while at < t[-1] - 0.1:
        stamps.append(at)
        at += 0.05 + 0.0031 + abs(rng.normal(0.0, 6e-4))
    s = np.array(stamps)
    position = np.round(np.interp(s + 0.0026, t, x))
    speed = np.round(np.interp(s + 0.0012, t, v))
    cells = [[repr(float(c)) for c in s], text(position, "%d"), text(speed, "%d")]
    for i in np.flatnonzero(rng.random(len(s)) < 0.003):
        cells[1][i] = cells[2][i] = "ERROR"
    _save(path, ("Temps_s", "Position_steps", "Vitesse_steps_s"), cells, end="\r\n")


STAGE = Layout(
    "platine_arcus_vitesse",
    "GitHub, French script that checks the speed profiles of an Arcus Performax stage (VelocityProfileAnalyzer): "
    "names, order, full digits of the clock, 20 Hz sleep loop, the cells ERROR where a reading fails are exact; "
    "the moves and rates are made up. No effort.",
    ".csv",
    "linear axis",
    _stage,
    {
        "Temps_s": Truth("time", "", "s"),
        "Position_steps": Truth("position", "", ""),
        "Vitesse_steps_s": Truth("speed", "", ""),
    },
)


def _touch(path: Path, rng: Rng) -> None:
    dt = 0.005
    start, rate, rise = 121.79, 1.5, 1.0
    rows: list[tuple[int, str, float, float, int, float]] = []
    now, strokes, zero = 6.4, 0, rng.normal(0.0, 0.01)
    x, v = start, 0.0
    for cycle in range(1, 11):
        metal = start + 3.1 + rng.normal(0.0, 0.004)
        for direction in ("FWD", "BWD"):
            due, seen = now + 0.012, None
            while True:
                # constant speed with ramps towards the metal, or back to the start
                if direction == "FWD":
                    wanted = rate
                else:
                    left = x - start
                    wanted = -min(rate, np.sqrt(max(2 * rise * left, 0.0)) + 0.004)
                v += np.clip(wanted - v, -rise * dt * 1.2, rise * dt)
                x += v * dt
                now += dt
                deep = x - metal
                force = 38.0 * max(deep, 0.0) + 60.0 * max(deep, 0.0) ** 2
                if direction == "FWD" and seen is None and force > 0.8:
                    seen = now
                    strokes += 1
                if now >= due:
                    value = round(force + zero + rng.normal(0.0, 0.006), 2)
                    rows.append(
                        (cycle, direction, round(x, 5), float("nan") if rng.random() < 0.004 else value, strokes, now)
                    )
                    due = now + 0.05 + 0.031 + abs(rng.normal(0.0, 0.004))
                if direction == "FWD" and seen is not None and now > seen + 0.07:
                    break
                if direction == "BWD" and x - start < 0.004:
                    break
            # StopImmediate, and the set-up of the next move
            v = 0.0
            now += 0.3 + 0.02
    cells = [
        [f"{r[0]}" for r in rows],
        [r[1] for r in rows],
        [f"{r[2]:.5f}" for r in rows],
        ["NaN" if r[3] != r[3] else f"{r[3]:.5f}" for r in rows],
        [f"{r[4]}" for r in rows],
        [f"{r[5]:.3f}" for r in rows],
    ]
    _save(path, TOUCH_NAMES, cells)


TOUCH_NAMES = ("Cycle", "Direction", "Position_mm", "Force_N", "StrokeCount", "Time_s")
TOUCH = Layout(
    "contact_metal_stage",
    "GitHub, MATLAB test that drives a Thorlabs stage against metal until a detector fires and logs a force gauge "
    "(contact_metal.csv): header, order, digits, start position, 1.5 mm/s, 1 mm/s^2, sleep of 0.05 s plus the "
    "gauge's answer, NaN for a failed reading are exact; distance, stiffness, noise and ten cycles are made up. "
    "No speed, no effort.",
    ".csv",
    "linear axis",
    _touch,
    {
        "Cycle": Truth(),
        "Direction": Truth(),
        "Position_mm": Truth("position", "", "mm"),
        "Force_N": Truth("force", "", "N"),
        "StrokeCount": Truth(),
        "Time_s": Truth("time", "", "s"),
    },
)


LAYOUTS: tuple[Layout, ...] = (
    ROKAE,
    TEACH,
    CAPSULE,
    MOE,
    TWIN,
    ABB,
    JSDK,
    CSP,
    HANGING,
    SEA,
    DOOR,
    PRESS,
    STRIKE,
    STAGE,
    TOUCH,
)
