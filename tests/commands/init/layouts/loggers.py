"""Layouts of public loggers, by somebody who had not seen the guesser: it was improved on these.

`source` states what is exact and what is made up.
"""

from __future__ import annotations

import datetime
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from tests.commands.init.layouts.layout import Layout, Truth
from tests.commands.init.layouts.simulators import (
    Array,
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
    text,
)

Spec = list[tuple[str, Truth, "tuple[str, ...] | None"]]
Cells = list[list[str]]

POS, VEL, ACC, TAU, CUR = "position", "speed", "acceleration", "torque", "current"
RPOS, RVEL, RACC, RTAU = "reference_position", "reference_speed", "reference_acceleration", "reference_torque"
OPEN = ("",)
NONE = Truth("")


def _layout(
    name: str,
    source: str,
    suffix: str,
    machine: str,
    spec: Spec,
    data: Callable[[Rng], Cells],
    *,
    separator: str = ",",
    before: Sequence[str] = (),
    header: str | None = "",
    after_header: Sequence[str] = (),
    after: Sequence[str] = (),
    encoding: str = "utf-8",
    line_end: str = "\n",
    quote: bool = False,
    trailing: str = "",
) -> Layout:
    """Return a layout that writes text; `header` None: no names, "": the names of `spec`, else this line."""

    def write(path: Path, generator: Rng) -> None:
        cells = data(generator)
        if len(cells) != len(spec) or len({len(c) for c in cells}) != 1:
            raise ValueError(f"{name}: columns do not fit: {len(cells)} of {len(spec)}, {[len(c) for c in cells]}")
        lines = list(before)
        if header is not None:
            lines.append(header or separator.join(column for column, _, _ in spec))
        lines += after_header
        if quote:
            cells = [[f'"{cell}"' for cell in column] for column in cells]
        lines += [separator.join(row) + trailing for row in zip(*cells, strict=True)]
        lines += after
        path.write_bytes((line_end.join(lines) + line_end).encode(encoding))

    keys = [column for column, _, _ in spec] if header is not None else [str(i) for i in range(len(spec))]
    truth = {key: t for key, (_, t, _) in zip(keys, spec, strict=True)}
    if len(truth) != len(spec):
        raise ValueError(f"{name}: a name is repeated")
    accept = {key: a for key, (_, _, a) in zip(keys, spec, strict=True) if a is not None}
    return Layout(name, source, suffix, machine, write, truth, accept)


def _bump(t: Array, at: float, half: float) -> Array:
    """Return a smooth push of height 1 around a time."""
    inside = np.abs(t - at) < half
    return np.where(inside, np.cos(0.5 * np.pi * np.clip((t - at) / half, -1.0, 1.0)) ** 2, 0.0)


def _tour(
    rng: Rng,
    dt: float,
    duration: float,
    home: Sequence[float],
    reach: Sequence[float],
    rate: float,
    smooth: float = 0.12,
) -> Array:
    """Return the reference (n, J) of moves between random poses around `home`, with pauses, for `duration`."""
    home, reach = np.asarray(home, float), np.asarray(reach, float)
    parts, at, spent, sign = [], home, 0.0, rng.choice([-1.0, 1.0], len(home))
    while spent < duration:
        sign = np.where(rng.random(len(home)) < 0.75, -sign, sign)
        goal = home + reach * sign * rng.uniform(0.25, 1.0, len(home))
        if rng.random() < 0.2 and np.abs(at - home).max() > 0.1:
            goal = home.copy()
        if np.abs(goal - at).max() < 0.1:
            goal = home + reach * np.where(at > home, -0.6, 0.6)
        piece = poses([at, goal], [rate * rng.uniform(0.5, 1.1)], [rng.uniform(0.2, 0.5)], dt, 3.0 * rate, smooth)
        parts.append(piece)
        at, spent = goal, spent + len(piece) * dt
    return np.concatenate(parts)[: round(duration / dt)]


def _pushed(
    rng: Rng, t: Array, v: Array, levers: Sequence[float], count: int, size: float, stiff: Sequence[float]
) -> tuple[Array, Array]:
    """Return external torques (n, J) of `count` short contacts while the arm moves, and the deflection they cause."""
    busy = np.convolve(np.abs(v).max(axis=1), np.ones(60) / 60.0, "same")
    possible = np.flatnonzero((busy > 0.5 * busy.max()) & (t > t[-1] * 0.3) & (t < t[-1] - 1.0))
    torque = np.zeros_like(v)
    for i in rng.choice(possible, count, replace=False):
        way = -np.sign(v[i]) * (np.abs(v[i]) > 0.02)
        torque -= np.outer(_bump(t, t[i], rng.uniform(0.07, 0.16)), np.asarray(levers) * way) * size
    return torque, -torque / np.asarray(stiff)


# Panda friction models

_SEVEN = [str(j) for j in range(1, 8)]
_PANDA: Spec = [("time", Truth("time", "", "s"), None)]
_PANDA += [(f"q{j}", Truth(POS, j), None) for j in _SEVEN]
_PANDA += [(f"dq{j}", Truth(VEL, j), None) for j in _SEVEN]
_PANDA += [(f"ddq{j}", Truth(ACC, j), (RACC, "")) for j in _SEVEN]
_PANDA += [(f"tau_measured_compensate{j}", Truth(TAU, j), None) for j in _SEVEN]
for _model in ("CV", "Dahl", "Stribeck", "LuGre", "NNFM"):
    _PANDA += [(f"{_model}_friction{j}", NONE, None) for j in _SEVEN]


def _panda(rng: Rng) -> Cells:
    dt, n = 0.001, 12000
    t = np.arange(1, n + 1) * dt
    rate = rng.uniform(1.5, 1.9) * np.clip(t / 2.0, 0.0, 1.0)
    angle = np.cumsum(rate) * dt
    home = np.array([0.0, -np.pi / 4, 0.0, -3 * np.pi / 4, 0.0, np.pi / 2, np.pi / 4])
    a = np.array([0.16, 0.05, 0.10, 0.04, 0.06, 0.05, 0.08]) * rng.uniform(0.8, 1.3, 7)
    b = np.array([0.03, 0.22, 0.05, 0.30, 0.07, 0.24, 0.06]) * rng.uniform(0.8, 1.2, 7)
    c = rng.uniform(-0.02, 0.02, 7)
    q = home + np.outer(1.0 - np.cos(angle), a) + np.outer(np.sin(angle), b) + np.outer(np.sin(2 * angle), c)
    v = np.gradient(q, dt, axis=0)
    acc = np.gradient(v, dt, axis=0)
    inertia = np.array([1.1, 1.6, 0.9, 1.0, 0.12, 0.09, 0.03])
    fc = np.array([0.62, 0.75, 0.48, 0.66, 0.42, 0.30, 0.26]) * rng.uniform(0.9, 1.1, 7)
    fv = np.array([0.9, 1.1, 0.8, 0.9, 0.45, 0.30, 0.25])
    friction = fc * np.tanh(v / 0.03) + fv * v
    tau = acc * inertia + friction + 0.25 * np.sin(q - home) * inertia + rng.normal(0.0, 0.035, q.shape)
    lag = np.column_stack([low_pass(x, dt, 6.0) for x in np.tanh(v / 0.03).T])
    models = [
        fc * np.sign(v) + fv * v,
        1.05 * fc * lag,
        (fc + 0.2 * fc * np.exp(-((v / 0.05) ** 2))) * np.sign(v) + 0.95 * fv * v,
        fc * lag + 0.9 * fv * v,
        0.97 * friction + 0.02 * fc * np.sin(3.0 * q),
    ]
    keep = np.cumsum(rng.choice([1, 2, 3], n, p=[0.25, 0.55, 0.2]))
    keep = keep[keep < n]
    q = q + rng.normal(0.0, 4e-6, q.shape)
    v = v + rng.normal(0.0, 6e-4, v.shape)
    cells = [text(t[keep], "%.6g")]
    for block in (q, v, acc, tau, *models):
        cells += [text(column, "%.6g") for column in block[keep].T]
    return cells


# UR5 of the NIST

_SIX = [str(j) for j in range(1, 7)]
_POSE = ("x", "y", "z", "rx", "ry", "rz")
_NIST: Spec = [("ROBOT_TIME", Truth("time", "", "s"), None)]
_NIST += [(f"ROBOT_TARGET_JOINT_POSITIONS_J{j}", Truth(RPOS, j), OPEN) for j in _SIX]
_NIST += [(f"ROBOT_ACTUAL_JOINT_POSITIONS_J{j}", Truth(POS, j), None) for j in _SIX]
_NIST += [(f"ROBOT_TARGET_JOINT_VELOCITIES_J{j}", Truth(RVEL, j), OPEN) for j in _SIX]
_NIST += [(f"ROBOT_ACTUAL_JOINT_VELOCITIES_J{j}", Truth(VEL, j), None) for j in _SIX]
_NIST += [(f"ROBOT_TARGET_JOINT_CURRENT_J{j}", NONE, (RTAU,)) for j in _SIX]
_NIST += [(f"ROBOT_ACTUAL_JOINT_CURRENT_J{j}", Truth(CUR, j), None) for j in _SIX]
_NIST += [(f"ROBOT_TARGET_JOINT_ACCELERATIONS_J{j}", Truth(RACC, j), OPEN) for j in _SIX]
_NIST += [(f"ROBOT_TARGET_JOINT_TORQUES_J{j}", Truth(RTAU, j), OPEN) for j in _SIX]
_NIST += [(f"ROBOT_JOINT_CONTROL_CURRENT_J{j}", NONE, (RTAU,)) for j in _SIX]
_NIST += [(f"ROBOT_CARTESIAN_COORD_TOOL_{a}", NONE, None) for a in _POSE]
_NIST += [(f"ROBOT_TCP_FORCE_{a}", NONE, ("force",) if len(a) == 1 else None) for a in _POSE]
_NIST += [(f"ROBOT_JOINT_TEMP_J{j}", NONE, None) for j in _SIX]

_UR = {
    "inertia": [3.6, 3.2, 1.5, 0.35, 0.3, 0.15],
    "coulomb": [7.5, 8.0, 5.0, 1.3, 1.2, 1.0],
    "viscous": [11.0, 12.0, 7.0, 1.2, 1.0, 0.9],
    "lift": 1,
    "elbow": 2,
    "moments": (52.0, 17.0),
    "coupling": 0.9,
    "wrist": (3, 1.4),
    "upright": -np.pi / 2,
}
_UR_KT = np.array([12.2, 12.2, 11.8, 9.4, 9.3, 9.2])


def _ur_motion(rng: Rng, duration: float, rate: float, pushes: int) -> dict[str, Array]:
    dt = 0.004
    ref = _tour(rng, dt, duration, [0.3, -1.7, 1.6, -1.4, -1.57, 0.2], [0.7, 0.45, 0.6, 0.5, 0.5, 0.9], rate)
    vr = np.gradient(ref, dt, axis=0)
    ar = np.gradient(vr, dt, axis=0)
    q, v, a = follow(ref, dt, 70.0)
    t = np.arange(len(ref)) * dt
    ext, bend = _pushed(rng, t, v, [0.5, 0.6, 0.4, 0.1, 0.05, 0.0], pushes, 45.0, [9e3, 9e3, 6e3, 2e3, 2e3, 2e3])
    tau = arm_torque(q, v, a, **_UR) + ext
    q = q + bend
    v = np.gradient(q, dt, axis=0)
    model = arm_torque(ref, vr, ar, **_UR)
    free = model - np.tanh(vr / 0.02) * _UR["coulomb"] - vr * np.asarray(_UR["viscous"])
    pick = slice(None, None, 2)
    parts = {
        "t": t,
        "q": q,
        "v": v,
        "a": a,
        "tau": tau,
        "ref": ref,
        "vr": vr,
        "ar": ar,
        "model": model,
        "free": free,
        "ext": ext,
    }
    return {key: value[pick] for key, value in parts.items()}


def _tool(q: Array) -> Array:
    """Return a pose of the tool [m, rad] that fits the joints."""
    reach = 0.425 * np.cos(q[:, 1] + np.pi / 2) + 0.39 * np.sin(q[:, 1] + q[:, 2]) + 0.1
    height = 0.09 - 0.425 * np.sin(q[:, 1]) + 0.39 * np.cos(q[:, 1] + q[:, 2])
    x, y = reach * np.cos(q[:, 0]), reach * np.sin(q[:, 0])
    turn = q[:, 1] + q[:, 2] + q[:, 3]
    return np.column_stack([x, y, height, 2.2 + 0.2 * q[:, 5], -2.1 + 0.3 * q[:, 0], 0.1 * turn])


def _nist(rng: Rng) -> Cells:
    m = _ur_motion(rng, 30.0, rng.uniform(0.9, 1.2), 3)
    n, shape = len(m["t"]), m["q"].shape
    current = m["tau"] / _UR_KT + rng.normal(0.0, 1.0, shape) * [0.05, 0.06, 0.05, 0.02, 0.02, 0.02]
    control = current + rng.normal(0.0, 0.03, shape)
    force = np.column_stack([low_pass(m["ext"][:, j] / 0.5, 0.008, 8.0) for j in (0, 1, 2)])
    force = np.column_stack([force, 0.1 * force]) + np.cumsum(rng.normal(0.0, 0.05, (n, 6)), axis=0) * 0.3
    warm = rng.uniform(27.0, 35.0, 6) + np.outer(m["t"], rng.uniform(0.003, 0.01, 6))
    cells = [text(rng.uniform(800, 9000) // 1 + m["t"], "%.3f")]
    blocks = [
        m["ref"],
        quantised(m["q"] + rng.normal(0.0, 1.2e-5, shape), 1.2e-5),
        m["vr"],
        m["v"] + rng.normal(0.0, 1.5e-3, shape),
        m["model"] / _UR_KT,
        current,
        m["ar"],
        m["free"],
        control,
        _tool(m["q"]),
        force + rng.normal(0.0, 0.8, force.shape),
        quantised(warm, 0.0625),
    ]
    for block in blocks:
        cells += [text(column, "%.6g") for column in block.T]
    return cells


# UR5 log without header

_MOOSE: Spec = [("robotTime", Truth("time", "", "s"), None), ("sysTime", Truth("time", "", "us"), OPEN)]
_MOOSE += [(f"qActual{j}", Truth(POS, j), None) for j in _SIX]
_MOOSE += [(f"qdActual{j}", Truth(VEL, j), None) for j in _SIX]
_MOOSE += [(f"qddTarget{j}", Truth(RACC, j), OPEN) for j in _SIX]
_MOOSE += [(f"qdTarget{j}", Truth(RVEL, j), OPEN) for j in _SIX]
_MOOSE += [(f"qTarget{j}", Truth(RPOS, j), OPEN) for j in _SIX]
_MOOSE += [(f"tool{a}", NONE, None) for a in _POSE]
_MOOSE += [("cameraDistXpx", NONE, None), ("cameraDistXm", NONE, None)]


def _moose(rng: Rng) -> Cells:
    m = _ur_motion(rng, 26.0, rng.uniform(0.7, 1.0), 0)
    n, shape = len(m["t"]), m["q"].shape
    system = rng.integers(2_000_000, 900_000_000) + m["t"] * 1e6 + rng.exponential(90.0, n)
    swing = 0.03 * np.sin(2 * np.pi * 0.9 * m["t"]) - 0.05 * low_pass(m["v"][:, 0], 0.008, 2.0)
    pixels = np.round(swing * 1500.0 + 320.0)
    cells = [text(rng.integers(900, 9000) + m["t"], "%.15g"), text(np.round(system), "%d")]
    blocks = [
        quantised(m["q"] + rng.normal(0.0, 1.0e-5, shape), 1.19842e-5),
        m["v"] + rng.normal(0.0, 1.5e-3, shape),
        m["ar"],
        m["vr"],
        m["ref"],
        _tool(m["q"]),
    ]
    for block in blocks:
        cells += [text(column, "%.12g") for column in block.T]
    return [*cells, text(pixels, "%d"), text((pixels - 320.0) / 1500.0, "%.9g")]


# legs of a quadruped

_LEGS = [f"{leg}_{part}" for leg in ("FL", "FR", "RL", "RR") for part in ("hip", "thigh", "calf")]
_GO1: Spec = [("time", Truth("time", "", "s"), None)]
_GO1 += [(f"q_{j}", Truth(POS, j), None) for j in _LEGS]
_GO1 += [(f"dq_{j}", Truth(VEL, j), None) for j in _LEGS]
_GO1 += [(f"tau_{j}", Truth(TAU, j), None) for j in _LEGS]
_GO1 += [(f"IMU_{k}_{a}", NONE, None) for k in ("acc", "gyro") for a in "xyz"]
_GO1 += [(f"{leg}_force", NONE, ("force",)) for leg in ("FL", "FR", "RL", "RR")]


def _go1(rng: Rng) -> Cells:
    dt, duration = 0.002, 13.0
    home, reach = [0.0, 0.75, -1.6] * 4, [0.3, 0.45, 0.5] * 4
    ref = np.concatenate(
        [_tour(rng, dt, duration, home[3 * k : 3 * k + 3], reach[:3], 2.2, 0.08) for k in range(4)], axis=1
    )
    q, v, a = follow(ref, dt, 55.0)
    t = np.arange(len(ref)) * dt
    torque = np.empty_like(q)
    feet = rng.normal(0.0, 1.0, (len(t), 4)) + rng.integers(3, 25, 4)
    for k in range(4):
        s = slice(3 * k, 3 * k + 3)
        ext, bend = _pushed(rng, t, v[:, s], [0.0, 1.0, 1.0], 1, 3.0, [90.0, 120.0, 120.0])
        h, th, cf = q[:, 3 * k], q[:, 3 * k + 1], q[:, 3 * k + 2]
        weight = np.column_stack([1.9 * np.sin(h), 1.6 * np.sin(th) + 0.7 * np.sin(th + cf), 0.7 * np.sin(th + cf)])
        inner = a[:, s] * [0.06, 0.075, 0.03] + np.tanh(v[:, s] / 0.05) * [0.35, 0.35, 0.3] + v[:, s] * 0.09
        torque[:, s] = inner + weight + ext
        feet[:, k] += 18.0 * np.abs(ext).max(axis=1)
        q[:, s] += bend
    v = np.gradient(q, dt, axis=0)
    imu = rng.normal(0.0, 1.0, (len(t), 6)) * [0.05, 0.05, 0.06, 0.004, 0.004, 0.004] + [0.15, -0.1, 9.78, 0, 0, 0]
    blocks = [
        quantised(q + rng.normal(0.0, 2e-5, q.shape), 6.0e-5),
        quantised(v + rng.normal(0.0, 0.012, v.shape), 0.0077),
        quantised(torque + rng.normal(0.0, 0.03, q.shape), 0.0247),
        imu,
        np.round(feet),
    ]
    table = np.concatenate(blocks, axis=1)
    late = rng.random(len(t)) < 0.01  # no new packet came: the old state again
    for i in np.flatnonzero(late)[1:]:
        table[i] = table[i - 1]
    return [text(np.arange(1, len(t) + 1) * dt, "%.6g"), *(text(column + 0.0, "%.6g") for column in table.T)]


# hip exoskeleton

_H10: Spec = [
    ("LoopCnt", NONE, ("time",)),
    ("H10Mode", NONE, None),
    ("H10AssistLevel", NONE, None),
    ("SmartAssist", NONE, None),
    ("LeftHipAngle", Truth(POS, "LeftHip"), None),
    ("RightHipAngle", Truth(POS, "RightHip"), None),
    ("LeftThighAngle", NONE, None),
    ("RightThighAngle", NONE, None),
    ("LeftHipTorque", Truth(TAU, "LeftHip"), None),
    ("RightHipTorque", Truth(TAU, "RightHip"), None),
    ("LeftHipMotorAngle", Truth(POS, "LeftHip"), OPEN),
    ("RightHipMotorAngle", Truth(POS, "RightHip"), OPEN),
]
_H10 += [(f"{s}HipImuGlobal{k}{a}", NONE, None) for s in ("Left", "Right") for k in ("Acc", "Gyr") for a in "XYZ"]
_H10 += [(f"TrunkIMU_Local{k}{a}", NONE, None) for k in ("Acc", "Gyr") for a in "XYZ"]
_H10 += [(f"TrunkIMU_Quat{a}", NONE, None) for a in "WXYZ"]
_H10 += [(f"{s}FSR{i}", NONE, ("force",)) for s in ("Left", "Right") for i in range(1, 15)]


def _swing(rng: Rng, dt: float, n: int) -> tuple[Array, Array, Array, Array]:
    """Return angle, speed, acceleration [rad] and torque of a hip on a stand that is driven by pulses of torque."""
    t = np.arange(n) * dt
    wanted = np.zeros(n)
    at = rng.uniform(0.8, 1.4)
    while at < t[-1] - 1.5:
        size, width = rng.choice([-1.0, 1.0]) * rng.uniform(4.0, 10.0), rng.uniform(0.25, 0.5)
        wanted += size * np.clip(np.minimum((t - at) / 0.08, (at + width - t) / 0.12), 0.0, 1.0)
        at += width + rng.uniform(0.7, 1.8)
    x = v = 0.0
    out = np.empty((n, 4))
    for i in range(n):
        stop = max(x - 0.62, 0.0) * 900.0 + (12.0 * max(v, 0.0) if x > 0.62 else 0.0)
        stop += min(x + 0.5, 0.0) * 900.0 + (12.0 * min(v, 0.0) if x < -0.5 else 0.0)
        a = (wanted[i] - 0.9 * np.tanh(v / 0.03) - 1.6 * v - 13.0 * np.sin(x) - stop) / 0.75
        out[i] = x, v, a, wanted[i]
        v += a * dt
        x += v * dt
    return out[:, 0], out[:, 1], out[:, 2], out[:, 3]


def _h10(rng: Rng) -> Cells:
    dt, n = 0.002, 8000
    left, right = _swing(rng, dt, n), _swing(rng, dt, n)
    deg = np.degrees
    noise = lambda s: rng.normal(0.0, s, n)  # noqa: E731
    angles = [deg(left[0]) + noise(0.03), deg(right[0]) + noise(0.03)]
    thighs = [deg(side[0]) * 0.98 + rng.uniform(-3, 3) + noise(0.05) for side in (left, right)]
    torques = [side[3] + noise(0.06) for side in (left, right)]
    motors = [quantised(deg(side[0]) + side[3] * 0.12, 0.0055) for side in (left, right)]
    imus = []
    for side in (left, right):
        imus += [
            9.81 * np.sin(side[0]) + 0.3 * side[2] + noise(0.06),
            noise(0.05),
            9.81 * np.cos(side[0]) + noise(0.06),
        ]
        imus += [noise(0.2), deg(side[1]) + noise(0.4), noise(0.2)]
    trunk = [noise(0.03), noise(0.03), 9.8 + noise(0.03), noise(0.1), noise(0.1), noise(0.1)]
    quat = [0.9998 + noise(1e-5), 0.01 + noise(1e-4), -0.015 + noise(1e-4), 0.002 + noise(1e-4)]
    soles = [np.abs(noise(0.002)) * (rng.random() < 0.3) for _ in range(28)]
    count = np.arange(n) + int(rng.integers(100, 20000))
    ints = [text(count, "%d"), *(text(np.full(n, k), "%d") for k in (2, 5, 0))]
    floats = [*angles, *thighs, *torques, *motors, *imus, *trunk, *quat, *soles]
    return [*ints, *(text(column, "%.4f") for column in floats)]


# Denso control log, Japanese

_DENSO: Spec = [("時間[ms]", Truth("time", "", "ms"), None)]
_DENSO += [(f"J{j}指令値[deg]", Truth(RPOS, j, "deg"), OPEN) for j in _SIX]
_DENSO += [(f"J{j}エンコーダ値[deg]", Truth(POS, j, "deg"), None) for j in _SIX]
_DENSO += [(f"J{j}モータ電流値[%]", Truth(CUR, j, "%"), None) for j in _SIX]
_DENSO += [(f"J{j}負荷率[%]", NONE, None) for j in _SIX]


def _denso(rng: Rng) -> Cells:
    dt = 0.004
    ref = _tour(rng, dt, 36.0, [0.0, 0.25, 1.5, 0.1, 0.6, 0.0], [1.0, 0.5, 0.5, 0.8, 0.6, 1.4], rng.uniform(1.3, 1.9))
    q, v, a = follow(ref, dt, 60.0)
    t = np.arange(len(ref)) * dt
    ext, bend = _pushed(rng, t, v, [0.5, 0.6, 0.45, 0.1, 0.1, 0.0], 3, 40.0, [1e4, 1e4, 8e3, 3e3, 3e3, 3e3])
    tau = ext + arm_torque(
        q,
        v,
        a,
        inertia=[2.2, 2.0, 0.9, 0.12, 0.1, 0.05],
        coulomb=[8.0, 9.0, 6.0, 2.2, 2.0, 1.5],
        viscous=[7.0, 7.5, 5.0, 1.4, 1.2, 0.8],
        lift=1,
        elbow=2,
        moments=(38.0, 14.0),
        coupling=0.7,
        wrist=(4, 1.2),
    )
    q = q + bend
    rated = np.array([62.0, 66.0, 38.0, 11.0, 9.5, 6.5])
    percent = 100.0 * tau / rated + rng.normal(0.0, 1.2, q.shape)
    load = np.column_stack(
        [100.0 * np.sqrt(low_pass((x / r) ** 2, dt, 0.03)) for x, r in zip(tau.T, rated, strict=True)]
    )
    pick = slice(None, None, 2)
    cells = [text(np.round(t[pick] * 1000.0), "%d")]
    cells += [text(np.degrees(x), "%.4f") for x in ref[pick].T]
    cells += [text(quantised(np.degrees(x), 0.0007), "%.4f") for x in q[pick].T]
    cells += [text(x, "%.1f") for x in percent[pick].T]
    return [*cells, *(text(x, "%.1f") for x in load[pick].T)]


# compression test of Bluehill

_INSTRON: Spec = [
    ("Time", Truth("time", "", "s"), None),
    ("Extension", Truth(POS, "", "mm"), None),
    ("Load", Truth("force", "", "N"), None),
    ("Compressive strain (Extension)", NONE, None),
    ("Compressive stress", NONE, None),
    ("Cycle count", NONE, None),
]


def _instron(rng: Rng) -> Cells:
    dt, depth, gap, rate = 0.1, rng.uniform(0.85, 0.95), rng.uniform(0.05, 0.15), rng.uniform(0.11, 0.13)
    parts, count = [np.zeros(1)], [np.zeros(1)]
    for k in range(3):
        down = np.arange(rate * dt, depth, rate * dt)
        hold = np.full(int(rng.integers(8, 20)), depth)
        parts += [down, hold, down[::-1], np.zeros(int(rng.integers(6, 15)))]
        count += [np.full(len(down) + len(hold) + len(down), k), np.full(len(parts[-1]), k + 1)]
    x, cycles = np.concatenate(parts), np.concatenate(count)
    deep = np.maximum(x - gap, 0.0)
    load = 420.0 * deep + 900.0 * deep**3
    load = load + 35.0 * np.gradient(x, dt) / rate * np.tanh(deep / 0.05)
    load = low_pass(np.maximum(load, 0.0), dt, 2.5) + rng.normal(0.0, 0.15, len(x))
    x = x + rng.normal(0.0, 3e-5, len(x))
    form = lambda values, digits: [c.replace(".", ",") for c in text(values, f"%.{digits}f")]  # noqa: E731
    t = np.arange(len(x)) * dt
    return [form(t, 5), form(x, 5), form(load, 5), form(x / 3.11, 5), form(load / 153.9, 5), form(cycles, 5)]


# data log of an S7: sliding gate

_GATE: Spec = [
    ("Record", NONE, None),
    ("Date", NONE, None),
    ("UTC Time", NONE, ("time",)),
    ("Zeit_ms", Truth("time", "", "ms"), None),
    ("Tor_Sollposition_mm", Truth(RPOS, "", "mm"), OPEN),
    ("Tor_Istposition_mm", Truth(POS, "", "mm"), None),
    ("Tor_Istgeschwindigkeit_mm_s", Truth(VEL, "", "mm/s"), None),
    ("Wirkstrom_A", Truth(CUR, "", "A"), None),
    ("Schliesskraft_N", Truth("force", "", "N"), None),
    ("Statuswort", NONE, None),
    ("Lichtschranke", NONE, None),
    ("Umrichter_Temperatur", NONE, None),
]


def _gate(rng: Rng) -> Cells:
    dt, step = 0.002, 10
    xr = plan(alternate(rng, 0.0, 3.6, [0.42, 0.5, 0.36], 0.45, 54.0, (0.8, 2.0)), 0.0, dt, 0.25)
    where = rng.uniform(1.2, 2.2)
    begin = crossing(xr, dt, where + 0.05, -1, 1)
    m = axis(
        xr,
        dt,
        inertia=320.0,
        coulomb=110.0,
        viscous=90.0,
        bandwidth=14.0,
        limit=900.0,
        obstacles=[(where, -1, 1.6e4, 250.0, begin, rng.uniform(1.0, 1.6))],
        yields=True,
    )
    pick = slice(None, None, step)
    t = m.t[pick]
    n = len(t)
    start = datetime.datetime(2024, 3, 14, 9, 26, 41) + datetime.timedelta(seconds=float(rng.integers(0, 3000)))
    stamps = [start + datetime.timedelta(seconds=float(s)) for s in t]
    current = low_pass(m.drive, dt, 60.0)[pick] / 165.0 + rng.normal(0.0, 0.03, n)
    force = np.abs(low_pass(m.contact, dt, 80.0)[pick]) + rng.normal(1.5, 1.2, n)
    moving = np.abs(m.v[pick]) > 0.005
    beam = ((t > t[-1] * 0.55) & (t < t[-1] * 0.58)).astype(float)
    return [
        [str(i) for i in range(1, n + 1)],
        [f"{s.month}/{s.day}/{s.year}" for s in stamps],
        [s.strftime("%H:%M:%S") for s in stamps],
        text(np.round(t * 1000.0) + int(rng.integers(100000, 900000)), "%d"),
        text(m.xr[pick] * 1000.0, "%.3f"),
        text(quantised(m.x[pick] * 1000.0, 0.05), "%.3f"),
        text(m.v[pick] * 1000.0 + rng.normal(0.0, 0.8, n), "%.3f"),
        text(quantised(current, 0.01), "%.3f"),
        text(quantised(force, 0.5), "%.3f"),
        [str(1591 if go else 567) for go in moving],
        text(beam, "%d"),
        text(41.0 + quantised(0.01 * t, 0.1), "%.1f"),
    ]


# trend of Studio 5000

_TREND: Spec = [
    ("Header:", NONE, None),
    ("Date", NONE, None),
    ("Time", Truth("time"), None),
    ("Hoist_Axis.CommandPosition", Truth(RPOS), OPEN),
    ("Hoist_Axis.ActualPosition", Truth(POS), None),
    ("Hoist_Axis.CommandVelocity", Truth(RVEL), OPEN),
    ("Hoist_Axis.ActualVelocity", Truth(VEL), None),
    ("Hoist_Axis.CurrentFeedback", Truth(CUR), None),
    ("Hoist_Axis.DCBusVoltage", NONE, None),
    ("Hoist_Axis.PositionError", NONE, None),
    ("Hoist_Overload", NONE, ("label",)),
]


def _trend(rng: Rng) -> Cells:
    dt, step = 0.001, 5
    xr = plan(alternate(rng, 0.05, 1.5, [0.45, 0.6, 0.35], 1.2, 26.0), 0.05, dt, 0.12)
    where = rng.uniform(0.7, 1.1)
    begin = crossing(xr, dt, where - 0.02, 1, 1)
    m = axis(
        xr,
        dt,
        inertia=190.0,
        coulomb=160.0,
        viscous=220.0,
        gravity=150.0 * 9.81,
        bandwidth=38.0,
        limit=5200.0,
        obstacles=[(where, 1, 6.0e4, 800.0, begin, 0.35)],
        yields=True,
    )
    pick = slice(None, 19000, step)
    n = len(m.t[pick])
    start = datetime.datetime(2023, 9, 20, 14, 5, 11, 480000)
    stamps = [start + datetime.timedelta(milliseconds=5 * i) for i in range(n)]
    current = low_pass(m.drive, dt, 100.0)[pick] / 240.0 + rng.normal(0.0, 0.05, n)
    x = quantised(m.x[pick] * 1000.0, 0.0005)
    return [
        ["Data"] * n,
        [s.strftime("%Y/%m/%d") for s in stamps],
        [s.strftime("%H:%M:%S;") + f"{s.microsecond // 1000:03d}" for s in stamps],
        text(m.xr[pick] * 1000.0, "%.9g"),
        text(x, "%.9g"),
        text(m.vr[pick] * 1000.0, "%.9g"),
        text(m.v[pick] * 1000.0 + rng.normal(0.0, 0.6, n), "%.9g"),
        text(current, "%.9g"),
        text(565.0 - 0.0009 * m.v[pick] * m.drive[pick] + rng.normal(0.0, 0.8, n), "%.9g"),
        text(m.xr[pick] * 1000.0 - x, "%.9g"),
        text((np.abs(m.contact[pick]) > 600.0).astype(float), "%d"),
    ]


# halsampler of LinuxCNC, no header

_HAL: Spec = [
    ("sample", NONE, ("time",)),
    ("pos-cmd", Truth(RPOS), OPEN),
    ("pos-fb", Truth(POS), None),
    ("velocity-cmd", Truth(RVEL), OPEN),
    ("velocity-fb", Truth(VEL), None),
    ("drv-actual-torque", Truth(TAU), None),
    ("stat-op-enabled", NONE, None),
]


def _hal(rng: Rng) -> Cells:
    dt = 0.001
    xr = plan(alternate(rng, 0.0, 0.28, [0.12, 0.2, 0.08], 1.5, 11.0, (0.25, 0.6)), 0.0, dt, 0.03)
    m = axis(xr, dt, inertia=140.0, coulomb=70.0, viscous=260.0, bandwidth=70.0, limit=3000.0)
    n = len(xr)
    v = np.convolve(m.v, np.ones(3) / 3, "same") * 1000.0 + rng.normal(0.0, 0.12, n)
    torque = low_pass(m.drive, dt, 200.0) / 8.0 + rng.normal(0.0, 0.5, n)
    return [
        text(np.arange(n), "%d"),
        text(m.xr * 1000.0, "%.6f"),
        text(quantised(m.x * 1000.0, 10.0 / 131072), "%.6f"),
        text(m.vr * 1000.0, "%.6f"),
        text(quantised(v, 0.01), "%.6f"),
        text(quantised(torque, 0.1), "%.6f"),
        ["1"] * n,
    ]


# French axis of a laboratory

_AXE: Spec = [
    ("Temps (s)", Truth("time", "", "s"), None),
    ("Consigne de position (mm)", Truth(RPOS, "", "mm"), OPEN),
    ("Position (mm)", Truth(POS, "", "mm"), None),
    ("Vitesse (mm/s)", Truth(VEL, "", "mm/s"), None),
    ("Courant moteur (A)", Truth(CUR, "", "A"), None),
    ("Tension moteur (V)", NONE, None),
    ("Effort capteur (N)", Truth("force", "", "N"), None),
    ("Température moteur (°C)", NONE, None),
]


def _axe(rng: Rng) -> Cells:
    dt, step = 0.001, 5
    xr = plan(alternate(rng, 0.02, 0.6, [0.35, 0.5, 0.25], 2.0, 20.0, (0.3, 0.9)), 0.02, dt, 0.05)
    stop = rng.uniform(0.562, 0.58)
    m = axis(
        xr,
        dt,
        inertia=7.5,
        coulomb=14.0,
        viscous=18.0,
        bandwidth=30.0,
        limit=140.0,
        obstacles=[(stop, 1, 1.3e3, 12.0, t, 30.0) for t in (xr.size * dt * 0.45,)],
    )
    pick = slice(None, None, step)
    n = len(m.t[pick])
    current = low_pass(m.drive, dt, 80.0) / 16.5
    tension = 1.4 * current + 24.0 * m.v
    form = lambda values, digits: [c.replace(".", ",") for c in text(values, f"%.{digits}f")]  # noqa: E731
    return [
        form(m.t[pick], 3),
        form(m.xr[pick] * 1000.0, 2),
        form(quantised(m.x[pick] * 1000.0, 0.05), 2),
        form(m.v[pick] * 1000.0 + rng.normal(0.0, 1.2, n), 2),
        form(current[pick] + rng.normal(0.0, 0.03, n), 3),
        form(tension[pick] + rng.normal(0.0, 0.05, n), 3),
        form(low_pass(m.contact, dt, 60.0)[pick] + 0.6 + rng.normal(0.0, 0.25, n), 2),
        form(24.5 + 0.02 * m.t[pick] + rng.normal(0.0, 0.05, n), 1),
    ]


# moteus, CsvLogger

_MOTEUS: Spec = [
    ("timestamp", Truth("time", "", "s"), None),
    ("id", NONE, None),
    ("mode", NONE, None),
    ("position", Truth(POS), None),
    ("velocity", Truth(VEL), None),
    ("torque", Truth(TAU), None),
    ("voltage", NONE, None),
    ("temperature", NONE, None),
    ("fault", NONE, None),
]


def _single(rng: Rng, dt: float, duration: float, reach: float, rate: float, bandwidth: float) -> list[Array]:
    """Return time, position, speed, acceleration [rad] of one joint that moves between random goals."""
    ref = _tour(rng, dt, duration, [0.0], [reach], rate, 0.1)
    q, v, a = follow(ref, dt, bandwidth)
    return [np.arange(len(ref)) * dt, q[:, 0], v[:, 0], a[:, 0]]


def _moteus(rng: Rng) -> Cells:
    dt = 0.001
    t, q, v, a = _single(rng, dt, 30.0, 2.4, 3.0, 60.0)
    push, bend = _pushed(rng, t, v[:, None], [1.0], 2, 1.1, [60.0])
    tau = 0.03 * a + 0.12 * np.tanh(v / 0.05) + 0.03 * v + 1.3 * np.sin(q) + push[:, 0]
    q = q + bend[:, 0]
    v = np.gradient(q, dt)
    at = np.cumsum(0.01 + np.abs(rng.normal(0.0, 6e-4, 2990)))
    at = at[at < t[-1]]
    n = len(at)
    pick = lambda x: np.interp(at, t, x)  # noqa: E731
    single = lambda x: [repr(float(np.float32(value))) for value in x]  # noqa: E731
    turn = 2.0 * np.pi
    offset = rng.uniform(-0.4, 0.4)
    return [
        text(at, "%.6f"),
        ["1"] * n,
        ["10"] * n,
        single(quantised(pick(q) / turn + offset, 1.0 / 65536.0)),
        single(pick(v) / turn + rng.normal(0.0, 0.004, n)),
        single(pick(tau) + rng.normal(0.0, 0.012, n)),
        [repr(24.0 + 0.5 * (value > 0.985) - 0.5 * (value < 0.05)) for value in rng.random(n).tolist()],
        [repr(float(30 + int(value / 9.0))) for value in at.tolist()],
        ["0"] * n,
    ]


# Feetech gripper that finds contact

_FEETECH: Spec = [
    ("t", Truth("time", "", "s"), None),
    ("target", NONE, (RPOS,)),
    ("commanded", Truth(RPOS), OPEN),
    ("present_pos", Truth(POS), None),
    ("present_load", Truth(TAU), None),
    ("in_contact", Truth("label"), None),
]


def _feetech(rng: Rng) -> Cells:
    dt, n = 0.001, 40000
    opened, closed, thing = 1500.0, 2620.0, rng.uniform(2150.0, 2300.0)
    goals, at = np.full(n, opened), rng.uniform(0.8, 1.4)
    state, events = opened, []
    while at < n * dt - 1.0:
        state = (closed if rng.random() < 0.8 else rng.uniform(1800, 2100)) if state == opened else opened
        goals[int(at / dt) :] = state
        events.append(at)
        at += rng.uniform(1.7, 2.8)
    present = np.cumsum(rng.random(n) < 0.0) > 0  # an object lies in the gripper in about half of the closings
    for k, begin in enumerate(events):
        present[int(begin / dt) :] = (k // 2) % 3 != 1
    x, v, profile, pace = opened, 0.0, opened, 0.0
    commanded, contact, load_seen = opened, False, 0.0
    rows, next_row, freeze = [], 0.0, 0.0
    for i in range(n):
        t, target = i * dt, goals[i]
        if contact and target < freeze - 50.0:
            contact = False
        commanded = freeze if contact else target
        error = commanded - profile
        wanted = np.sign(error) * min(900.0, np.sqrt(2.0 * 5000.0 * abs(error)))
        pace += min(max(wanted - pace, -5000.0 * dt), 5000.0 * dt)
        profile += pace * dt
        duty = min(max(9.0 * (profile - x) + 0.12 * pace, -1000.0), 1000.0)
        grip = max(x - thing, 0.0) * 11.0 + (0.4 * max(v, 0.0) if x > thing else 0.0) if present[i] else 0.0
        a = (duty - 0.13 * v - 55.0 * np.tanh(v / 8.0) - grip) / 0.004
        v = v + a * dt
        x += v * dt
        load_seen += 0.08 * (duty - load_seen)
        if not contact and present[i] and load_seen > 420.0 and target > x + 20.0:
            contact, freeze = True, round(x) + 25.0
        if t >= next_row:
            seen = abs(round((load_seen + (rng.normal(0.0, 7.0) if abs(load_seen) > 8.0 else 0.0)) / 4.0) * 4)
            ticks = round(x + rng.normal(0.0, 0.3))
            rows.append((t + rng.uniform(0.0, 0.0009), target, round(commanded), ticks, seen, int(contact)))
            next_row = t + 0.012 + abs(rng.normal(0.0, 0.0012))
    table = np.array(rows, float)
    return [text(table[:, 0], "%.4f"), *(text(column, "%d") for column in table[:, 1:].T)]


# ANYdrive by rostopic echo -p

_IMU = ["seq", "stamp", "frame_id"]
_ANY: Spec = [
    ("%time", Truth("time", "", "ns"), None),
    ("field.header.seq", NONE, None),
    ("field.header.stamp", Truth("time", "", "ns"), OPEN),
    ("field.header.frame_id", NONE, None),
    ("field.statusword", NONE, None),
    ("field.current", Truth(CUR), OPEN),
    ("field.gear_position", Truth(POS), OPEN),
    ("field.gear_velocity", Truth(VEL), OPEN),
    ("field.joint_position", Truth(POS), None),
    ("field.joint_velocity", Truth(VEL), None),
    ("field.joint_acceleration", Truth(ACC), OPEN),
    ("field.joint_torque", Truth(TAU), None),
    ("field.imu.header.seq", NONE, None),
    ("field.imu.header.stamp", NONE, None),
    ("field.imu.header.frame_id", NONE, None),
]
_ANY += [(f"field.imu.orientation.{a}", NONE, None) for a in "xyzw"]
_ANY += [(f"field.imu.orientation_covariance{i}", NONE, None) for i in range(9)]
_ANY += [(f"field.imu.angular_velocity.{a}", NONE, None) for a in "xyz"]
_ANY += [(f"field.imu.angular_velocity_covariance{i}", NONE, None) for i in range(9)]
_ANY += [(f"field.imu.linear_acceleration.{a}", NONE, None) for a in "xyz"]
_ANY += [(f"field.imu.linear_acceleration_covariance{i}", NONE, None) for i in range(9)]


def _anydrive(rng: Rng) -> Cells:
    dt = 0.0025
    t, q, v, a = _single(rng, dt, 15.0, 1.0, 2.4, 35.0)
    push, bend = _pushed(rng, t, v[:, None], [1.0], 2, 14.0, [500.0])
    q = q + bend[:, 0]
    v, n = np.gradient(q, dt), len(t)
    a = np.gradient(v, dt)
    tau = 0.35 * a + 0.25 * v + 0.3 * np.tanh(v / 0.05) + 9.0 * np.sin(q) + push[:, 0]
    smooth = np.hanning(41) / np.hanning(41).sum()
    spring = np.convolve(np.pad(tau, 20, mode="edge"), smooth, "valid") / 240.0
    gear = q + spring
    gear_v = np.gradient(gear, dt)
    rotor = tau + 0.25 * np.gradient(gear_v, dt) + 1.1 * np.tanh(gear_v / 0.05) + 0.8 * gear_v
    current = low_pass(rotor / 4.2, dt, 60.0) + rng.normal(0.0, 0.06, n)
    start = 1519223000 * 10**9 + int(rng.integers(0, 10**12))
    stamp = [start + i * 2_500_000 + int(k) for i, k in enumerate(rng.integers(-30000, 30000, n))]
    seen = [s + 400_000 + int(k) for s, k in zip(stamp, rng.integers(0, 250000, n), strict=True)]
    seq = int(rng.integers(1000, 90000))
    form = lambda x: text(x, "%.12g")  # noqa: E731
    zero = ["0.0"] * n
    tick = 2.0 * np.pi / 2**17
    gyro = [form(rng.normal(0.0, 0.003, n)), form(v + rng.normal(0.0, 0.01, n)), form(rng.normal(0.0, 0.003, n))]
    accel = [9.81 * np.sin(q) + 0.05 * a, np.zeros(n), 9.81 * np.cos(q)]
    return [
        [str(s) for s in seen],
        [str(seq + i) for i in range(n)],
        [str(s) for s in stamp],
        [""] * n,
        ["1155"] * n,
        form(current),
        form(quantised(gear, tick)),
        form(gear_v + rng.normal(0.0, 0.02, n)),
        form(quantised(q, tick)),
        form(v + rng.normal(0.0, 0.012, n)),
        form(a + rng.normal(0.0, 0.6, n)),
        form((quantised(gear, tick) - quantised(q, tick)) * 240.0 + rng.normal(0.0, 0.01, n)),
        ["0"] * n,
        ["0"] * n,
        [""] * n,
        *([zero] * 4),
        *([zero] * 9),
        *gyro,
        *([zero] * 9),
        *(form(x + rng.normal(0.0, 0.05, n)) for x in accel),
        *([zero] * 9),
    ]


# Chinese servo oscilloscope

_SERVO: Spec = [
    ("时间(ms)", Truth("time", "", "ms"), None),
    ("位置指令(p)", Truth(RPOS), OPEN),
    ("位置反馈(p)", Truth(POS), None),
    ("位置偏差(p)", NONE, None),
    ("速度指令(rpm)", Truth(RVEL, "", "rpm"), OPEN),
    ("速度反馈(rpm)", Truth(VEL, "", "rpm"), None),
    ("转矩指令(%)", Truth(RTAU, "", "%"), (TAU, "")),
    ("转矩反馈(%)", Truth(TAU, "", "%"), None),
    ("母线电压(V)", NONE, None),
]


def _servo(rng: Rng) -> Cells:
    dt, step = 0.0005, 2
    turn = 2.0 * np.pi
    xr = plan(alternate(rng, 0.0, 12.0 * turn, [100.0, 160.0, 70.0], 900.0, 9.5, (0.2, 0.5)), 0.0, dt, 0.02)
    where = rng.uniform(5.0, 8.0) * turn
    m = axis(
        xr,
        dt,
        inertia=6.5e-4,
        coulomb=0.11,
        viscous=7e-4,
        bandwidth=90.0,
        limit=3.8,
        stiction=0.4,
        obstacles=[(where, -1, 0.12, 0.003, crossing(xr, dt, where + 2.0, -1, 1), 0.12)],
    )
    pick = slice(None, None, step)
    n = len(m.t[pick])
    counts = 8388608.0 / turn
    fb = np.round(m.x[pick] * counts)
    torque = low_pass(m.drive, dt, 300.0)
    bus = 311.0 + 0.004 * m.v[pick] * m.drive[pick] * -1.0 + rng.normal(0.0, 0.6, n)
    return [
        text(m.t[pick] * 1000.0, "%.1f"),
        text(np.round(m.xr[pick] * counts), "%d"),
        text(fb, "%d"),
        text(np.round(m.xr[pick] * counts) - fb, "%d"),
        text(np.round(m.vr[pick] * 60.0 / turn), "%d"),
        text(np.round(m.v[pick] * 60.0 / turn + rng.normal(0.0, 0.8, n)) + 0.0, "%d"),
        text(m.drive[pick] / 1.27 * 100.0, "%.1f"),
        text(torque[pick] / 1.27 * 100.0 + rng.normal(0.0, 0.4, n), "%.1f"),
        text(bus, "%.1f"),
    ]


LAYOUTS: tuple[Layout, ...] = (
    _layout(
        "panda friction models csv",
        "A GitHub C++ program with libfranka that writes test_data_yuan_YZ_with_friction_models.csv; header lines "
        "in Chinese comments. Exact: header (64 names, order), default precision of 6 digits, 'ddq' is ddq_d of "
        "the robot, 'tau_measured_compensate' is tau_J minus gravity minus its first value, rows skipped by a "
        "printing thread (1 to 3 ms). Made up: the values (a Cartesian circle as the source drives).",
        ".csv",
        "robot",
        _PANDA,
        _panda,
    ),
    _layout(
        "nist ur5 flat csv",
        "NIST 'Degradation Measurement of Robot Arm Position Accuracy' (UR5), as flattened by normalize.py: the "
        "73 names are UR5_COLUMNS of a GitHub loader, positions in rad. Exact: names, order. Made up: values, the "
        "8 ms period, the digits.",
        ".csv",
        "robot",
        _NIST,
        _nist,
    ),
    _layout(
        "project moose ur5 camswing no header",
        "GitHub swiatecki/ProjectMoose, Code/Tests/camSwing/logging.cpp and logging.h: a CSV without header: "
        "robotTime, sysTime (unsigned long), qActual[6], qdActual[6], qddTarget[6], qdTarget[6], qTarget[6], "
        "tool[6], cameraDistXpx, cameraDistXm, precision 15. Exact: columns and order. Made up: values, sysTime "
        "as us.",
        ".csv",
        "robot",
        _MOOSE,
        _moose,
        header=None,
    ),
    _layout(
        "go1 low level log",
        "A GitHub logger for unitree_legged_sdk (LOWLEVEL, go1.log). Exact: header, blanks as separators, time = "
        "motiontime * 0.002, 6 digits, suffix .log, foot forces as integers. Made up: values (legs of a robot "
        "that hangs; two or more touches), repeated packets.",
        ".log",
        "robot",
        _GO1,
        _go1,
        separator=" ",
    ),
    _layout(
        "angel h10 exoskeleton cdc monitor",
        "A GitHub logger for the hip exoskeleton H10 of Angel Robotics (cdc_monitoring_data_log.csv). Exact: "
        "CSV_HEADER, integers first, then %.4f; no time column, only LoopCnt; torque pulses as F-vectors. Made "
        "up: values (exoskeleton with dummy legs on a stand, end stops), 2 ms a loop.",
        ".csv",
        "robot",
        _H10,
        _h10,
    ),
    _layout(
        "denso rc8 control log japanese",
        "Composed from DENSO's RC8 manual, 'Control log' (制御ログ: movement of axes, current values, "
        "load ratios). Exact: nothing but the kinds of channels; names, 8 ms, BOM and values are "
        "made up.",
        ".csv",
        "robot",
        _DENSO,
        _denso,
        encoding="utf-8-sig",
        line_end="\r\n",
    ),
    _layout(
        "instron bluehill compression decimal comma",
        "README of a GitHub converter for CSV of an Instron 5967: preamble 'Specimen properties : ...', blank "
        "line, names, units in parentheses, every number in quotes with a decimal comma. Exact: that form and the "
        "names; 0.1 s. Made up: values (three cycles on a rubber disc), number of digits.",
        ".csv",
        "linear axis",
        _INSTRON,
        _instron,
        before=[
            'Specimen properties : Anvil height,"3,11",mm',
            "Specimen properties : Geometry,Circular",
            'Specimen properties : Area,"153,9",mm^2',
            'Specimen properties : Final anvil height,"2,22",mm',
            'Specimen properties : Specimen label,""',
            'Specimen properties : Diameter,"14,0",mm',
            "",
        ],
        after_header=["(s),(mm),(N),(mm/mm),(MPa),"],
        quote=True,
    ),
    _layout(
        "siemens s7 datalog schiebetor",
        "CSV of the S7-1200/1500 instructions DataLogCreate/DataLogWrite: header 'Record,Date,UTC Time,<tags>' "
        "(as in a GitHub reader), line //END at the end (S7-1200 manual, from memory). Made up: the tags of a "
        "sliding gate, values, 20 ms, a load cell at the closing edge.",
        ".csv",
        "linear axis",
        _GATE,
        _gate,
        after=["//END"],
        line_end="\r\n",
    ),
    _layout(
        "studio 5000 trend hoist",
        "CSV of a trend of Rockwell Studio 5000 as written by ICS Studio and read by parseStudio5000CSV on GitHub "
        "). Exact: preamble, 'Header:' and 'Data' in the first column, time HH:MM:SS;fff, quotes around the "
        "names. Made up: pens of a vertical CIP axis (names of the Logix attributes), values, 5 ms.",
        ".csv",
        "linear axis",
        _TREND,
        _trend,
        before=[
            'Controller Name:,"Hoist_PLC"',
            'Trend Name:,"Hoist_Trend"',
            "Trend Tags:,8",
            "Sample Period:,5 ms",
            "Description:",
            "Start Trigger:,No Trigger",
            "",
            "Stop Trigger:,No Trigger",
            "",
            "Start Time:,2023/09/20,14:05:11;480",
            "Stop Time:,2023/09/20,14:05:30;475",
            "Pre-Samples:,0",
            "Post-Samples:,0",
        ],
        header=",".join(["Header:", *(f'"{name}"' for name, _, _ in _TREND[1:])]),
        line_end="\r\n",
    ),
    _layout(
        "linuxcnc halsampler cia402 axis",
        "LinuxCNC manual pages sampler(9), halsampler(1) and a GitHub test of cia402 with 'halsampler -t > "
        "trace_a.txt' ). Exact: no header, sample number first, %f and blanks (one at the end of a line), bit as "
        "0/1, pin names of cia402. Made up: which pins (cfg=fffffb), values of a ball screw [mm, mm/s, %], 1 ms.",
        ".txt",
        "linear axis",
        _HAL,
        _hal,
        separator=" ",
        header=None,
        trailing=" ",
    ),
    _layout(
        "axe lineaire de laboratoire",
        "Composed after French laboratory exports on GitHub ('Temps (s);Consigne (tr/min);...;Courant (A)', "
        "preamble 'Date Essai;..'; not the Uhing columns). Exact: nothing but that style. Made up: names, values "
        "of a belt axis that presses a spring with a force sensor, decimal comma, Latin-1.",
        ".csv",
        "linear axis",
        _AXE,
        _axe,
        separator=";",
        before=["Date essai;12/03/2022;;;;;;", "Heure essai;14:37;;;;;;", "Fréquence (Hz);200;;;;;;", ";;;;;;;"],
        encoding="latin-1",
        line_end="\r\n",
    ),
    _layout(
        "moteus csv logger",
        "CsvLogger of a moteus GUI on GitHub (moteus.app). Exact: fields, timestamp %.6f since start, revolutions "
        "and rev/s (never said in the file), float32 as printed by Python, voltage in 0.5 V, temperature in 1 °C. "
        "Made up: values (an arm with a weight, two pushes), 100 Hz.",
        ".csv",
        "rotary axis",
        _MOTEUS,
        _moteus,
    ),
    _layout(
        "feetech gripper keyboard stream",
        "keyboard_stream.py/plot_stream.py for Feetech sms_sts servos on GitHub. Exact: header, ticks, load as "
        "magnitude 0..1023 (PWM duty x10), in_contact 0/1 and commanded that freezes at contact. Made up: values, "
        "about 80 Hz.",
        ".csv",
        "rotary axis",
        _FEETECH,
        _feetech,
    ),
    _layout(
        "anydrive state rostopic echo",
        "anydrive_msgs/State (comments with units; ANYbotics/RSL) as 'rostopic echo -p' prints it. Exact: fields, "
        "order, %time and stamps in ns, empty frame ids, zeros of unused IMU fields. Made up: values of a series "
        "elastic joint, 400 Hz, status word.",
        ".txt",
        "rotary axis",
        _ANY,
        _anydrive,
    ),
    _layout(
        "chinese servo oscilloscope",
        "Composed from Chinese terms of drives in GitHub sources (速度指令, 速度反馈, 转矩指令, 转矩反馈, 位置反馈) "
        "as an oscilloscope of a servo tool would export them. Exact: these terms; the form of "
        "the file, preamble, 1 ms, 23 bit encoder and values are made up.",
        ".csv",
        "rotary axis",
        _SERVO,
        _servo,
        before=["驱动器型号,SV660N", "采样周期,1.0ms", "通道数,8"],
        encoding="utf-8-sig",
        line_end="\r\n",
    ),
)
