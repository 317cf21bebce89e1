"""Fifteen layouts more by somebody who had not seen the guesser: a fourth set that `cdtool init` is measured on.

`source` states what is exact and what is made up: all values are simulated.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.commands.init.layouts.layout import Layout, Truth, table_layout  # noqa: F401
from tests.commands.init.layouts.motion import RPM
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
)

Array = np.ndarray
Rng = np.random.Generator


def _save(
    path: Path,
    columns: dict[str, Sequence[str]],
    *,
    separator: str = ",",
    before: Sequence[str] = (),
    after: Sequence[str] = (),
    header: bool = True,
    end: str = "\n",
    tail: str = "",
    encoding: str = "utf-8",
) -> None:
    """Write text columns; `before` and `after` are lines around the names, `tail` ends every line."""
    lines = list(before)
    if header:
        lines.append(separator.join(columns) + tail)
    lines.extend(after)
    lines.extend(separator.join(row) + tail for row in zip(*columns.values(), strict=True))
    path.write_bytes((end.join(lines) + end).encode(encoding))


def _f(values: Array, form: str = "%.6f") -> list[str]:
    return [form % v for v in np.asarray(values, float).tolist()]


def _i(values: Array) -> list[str]:
    return [str(v) for v in np.round(np.asarray(values)).astype(np.int64).tolist()]


def _r(values: Array, digits: int = 6) -> list[str]:
    return [repr(round(v, digits)) for v in np.asarray(values, float).tolist()]


def _c(n: int, value: object) -> list[str]:
    return [str(value)] * n


def _bump(t: Array, at: float, width: float) -> Array:
    x = np.abs(t - at) / width
    return np.where(x < 1.0, np.cos(0.5 * np.pi * np.minimum(x, 1.0)) ** 2, 0.0)


class _Arm:
    """A moved arm: time, set values, positions, speeds, accelerations, torques, external torques (SI)."""

    def __init__(
        self,
        rng: Rng,
        joints: int,
        duration: float,
        *,
        rate: float = 500.0,
        reach: float = 1.1,
        quick: tuple[float, float] = (0.4, 1.3),
        scale: float = 1.0,
        pushes: Sequence[float] = (0.55, 0.85),
        push: float = 14.0,
    ) -> None:
        dt = 1.0 / rate
        n = round(duration * rate)
        home = rng.uniform(-0.4, 0.4, joints)
        points = [home + rng.uniform(-reach, reach, joints) for _ in range(60)]
        rates = rng.uniform(*quick, 59)
        rests = np.concatenate([[0.8], rng.uniform(0.2, 0.9, 58)])
        ref = poses(points, rates, rests, dt, 3.0, 0.12)[:n]
        q, _, _ = follow(ref, dt, 35.0)
        t = np.arange(n) * dt
        grow = 0.62 ** np.arange(joints)
        ext = np.zeros((n, joints))
        for share in pushes:
            at = share * duration + rng.uniform(-0.4, 0.4)
            ext += _bump(t, at, rng.uniform(0.07, 0.14))[:, None] * rng.choice([-1.0, 1.0]) * push * scale * grow
        ext[:, 4:] = 0.0
        q = q + low_pass(ext, dt, 8.0) / (2500.0 * scale)
        v = speed_of(q, dt)
        a = speed_of(v, dt)
        inertia = np.array([1.4, 1.6, 0.8, 0.12, 0.08, 0.04, 0.03])[:joints]
        coulomb = np.array([4.0, 5.0, 3.2, 1.1, 0.9, 0.6, 0.5])[:joints]
        viscous = np.array([5.0, 6.0, 4.0, 1.2, 1.0, 0.6, 0.5])[:joints]
        model = scale * arm_torque(
            q,
            v,
            a,
            inertia=inertia,
            coulomb=coulomb,
            viscous=viscous,
            lift=1,
            elbow=2,
            moments=(32.0, 13.0),
            coupling=0.7,
            wrist=(4, 1.1) if joints > 4 else None,
        )
        self.t, self.dt, self.n = t, dt, n
        self.ref, self.ref_v = ref, speed_of(ref, dt)
        self.q, self.v, self.a, self.model, self.ext = q, v, a, model, ext
        self.tau = model - ext + rng.normal(0.0, 0.012, q.shape) * np.std(model, axis=0)

    def every(self, step: int) -> None:
        """Keep every step-th sample."""
        for name in ("t", "ref", "ref_v", "q", "v", "a", "model", "ext", "tau"):
            setattr(self, name, getattr(self, name)[::step])
        self.n = len(self.t)


# 1
def _caster(path: Path, rng: Rng) -> None:
    m = _Arm(rng, 6, 35.0, rate=400.0, scale=0.4)
    m.every(4)
    v = m.v + rng.normal(0.0, 0.004, m.v.shape)
    columns: dict[str, Sequence[str]] = {"time": _r(m.t, 3)}
    columns |= {f"q{j}": _r(quantised(m.q[:, j], 25.0 / 65535), 5) for j in range(6)}
    columns |= {f"qd{j}": _r(v[:, j], 5) for j in range(6)}
    columns |= {f"tau{j}": _r(quantised(m.tau[:, j], 0.0049), 4) for j in range(6)}
    _save(path, columns, end="\r\n")


_CASTER = Layout(
    "Caster arm serial record",
    "GitHub file tools/serial_record.py (Caster robot arm MCU, VOFA FireWater): names, order, csv.writer line "
    "ends and 35 s duration exact; rate of 100 Hz, steps and motion made up.",
    ".csv",
    "robot",
    _caster,
    {"time": Truth("time", "", "s")}
    | {f"q{j}": Truth("position", str(j)) for j in range(6)}
    | {f"qd{j}": Truth("speed", str(j)) for j in range(6)}
    | {f"tau{j}": Truth("torque", str(j)) for j in range(6)},
)

# 2
_X2_SINGLE = ("enableJoints", "greenButton", "redButton", "yellowButton", "blueButton")
_X2_TAIL = ("JointVelDerivativeCutOffFreq", "BackpackVelDerivativeCutOffFreq", "DynamicParametersCutOffFreq")


def _legs(rng: Rng, t: Array, offsets: Sequence[float], sizes: Sequence[float], periods: tuple[float, float]) -> Array:
    """Return smooth moves of leg joints with pauses, one independent path each."""
    dt = t[1] - t[0]
    out = []
    for offset, size in zip(offsets, sizes, strict=True):
        moves, side = [], 1.0
        while len(moves) < 40:
            target = offset + side * size * rng.uniform(0.5, 1.0)
            moves.append((target, size * 2.0 / rng.uniform(*periods), size * 8.0, rng.uniform(0.1, 0.9)))
            side = -side
        path = plan(moves, offset, dt, 0.15)
        out.append(path[: len(t)])
    return np.column_stack(out)


def _x2(path: Path, rng: Rng) -> None:
    dt = 0.001
    t = np.arange(16000) * dt
    ref = _legs(rng, t, [0.35, -0.75, 0.3, -0.7], [0.35, 0.5, 0.35, 0.5], (0.9, 1.6))
    q, _, _ = follow(ref, dt, 22.0)
    ext = np.zeros_like(q)
    for j in range(4):
        for at in rng.uniform(3.0, 15.0, 2):
            ext[:, j] += rng.choice([-1.0, 1.0]) * rng.uniform(6.0, 14.0) * _bump(t, at, rng.uniform(0.15, 0.35))
    q = q + low_pass(ext, dt, 5.0) / 900.0
    v, a = speed_of(q, dt), speed_of(speed_of(q, dt), dt)
    gravity = np.column_stack(
        [
            22.0 * np.sin(q[:, 0]) + 9.0 * np.sin(q[:, 0] + q[:, 1]),
            9.0 * np.sin(q[:, 0] + q[:, 1]),
            22.0 * np.sin(q[:, 2]) + 9.0 * np.sin(q[:, 2] + q[:, 3]),
            9.0 * np.sin(q[:, 2] + q[:, 3]),
        ]
    )
    friction = np.array([3.5, 4.0, 3.5, 4.0]) * np.tanh(v / 0.03) + np.array([2.0, 2.0, 2.0, 2.0]) * v
    inertia = np.array([1.3, 0.45, 1.3, 0.45]) * a
    link = inertia + gravity - ext
    motor = link + friction
    back = low_pass(np.cumsum(rng.normal(0.0, 0.0008, len(t))), dt, 1.0)
    k = slice(0, None, 4)
    n = len(t[k])
    tau = quantised(motor[k] + rng.normal(0.0, 0.25, (n, 4)), 0.0735)
    wanted = motor[k] + rng.normal(0.0, 0.03, (n, 4))
    gauge = link[k] + rng.normal(0.0, 0.3, (n, 4)) + np.array([0.6, -0.4, 0.9, 0.2])
    guess = ext[k] * 0.85 + 0.12 * friction[k] + rng.normal(0.0, 0.5, (n, 4))
    load = np.column_stack([380.0 + 160.0 * np.sin(q[k, 0] * 3.0), 390.0 - 160.0 * np.sin(q[k, 2] * 3.0)])
    load = load + rng.normal(0.0, 4.0, load.shape)
    clock = t[k] + 0.0021 + np.abs(rng.normal(0.0, 4e-5, n))
    columns: dict[str, Sequence[str]] = {"time": _f(clock), "mode": _c(n, 3)}

    def put(name: str, values: Array, form: str = "%.5f") -> None:
        for j in range(values.shape[1]):
            columns[f"{name}_{j + 1}"] = _f(values[:, j], form)

    put("JointPositions", quantised(q[k], 2.0 * np.pi / (4096 * 122.5)))
    put("JointVelocities", v[k] + rng.normal(0.0, 0.006, (n, 4)))
    put("JointTorques", tau, "%.4f")
    put("DesiredJointTorques", wanted, "%.4f")
    put("DesiredJointVelocities", speed_of(ref, dt)[k])
    put("JointTorquesViaGauges", gauge, "%.3f")
    put("gravitationTorque", gravity[k], "%.4f")
    put("FrictionTorque", friction[k] * 0.92, "%.4f")
    put("InteractionForces", guess, "%.4f")
    put("SmoothedInteractionForces", low_pass(guess, 4 * dt, 4.0), "%.4f")
    put("EstimatedAcceleration", low_pass(np.column_stack([a[k], speed_of(speed_of(back, dt), dt)[k]]), 4 * dt, 12.0))
    columns["BackPackAngle"] = _f(back[k], "%.5f")
    columns["BackPackAngularVelocity"] = _f(speed_of(back, dt)[k], "%.5f")
    for name in _X2_SINGLE:
        columns[name] = _c(n, 1 if name == "enableJoints" else 0)
    put("GroundReactionForces", load, "%.1f")
    put("GRFThresholds", np.full((n, 2), 150.0), "%.1f")
    for name, value in zip(_X2_TAIL, (5, 5, 10), strict=True):
        columns[name] = _c(n, value)
    _save(path, columns)


def _x2_truth() -> tuple[dict[str, Truth], dict[str, tuple[str, ...]]]:
    truth = {"time": Truth("time", "", "s"), "mode": Truth()}
    accept: dict[str, tuple[str, ...]] = {}
    kinds = {
        "JointPositions": ("position", None),
        "JointVelocities": ("speed", None),
        "JointTorques": ("torque", None),
        "DesiredJointTorques": ("reference_torque", ("",)),
        "DesiredJointVelocities": ("reference_speed", ("",)),
        "JointTorquesViaGauges": ("torque", ("", "force")),
        "gravitationTorque": ("", ("reference_torque",)),
        "FrictionTorque": ("", ("reference_torque",)),
        "InteractionForces": ("", None),
        "SmoothedInteractionForces": ("", None),
        "EstimatedAcceleration": ("", ("acceleration",)),
    }
    for name, (channel, other) in kinds.items():
        for j in range(1, 5):
            truth[f"{name}_{j}"] = Truth(channel, str(j))
            if other:
                accept[f"{name}_{j}"] = other
    truth["EstimatedAcceleration_5"] = Truth()
    for name in ("BackPackAngle", "BackPackAngularVelocity", *_X2_SINGLE, *_X2_TAIL):
        truth[name] = Truth()
    for j in (1, 2):
        truth[f"GroundReactionForces_{j}"] = Truth()
        accept[f"GroundReactionForces_{j}"] = ("force",)
        truth[f"GRFThresholds_{j}"] = Truth()
    return truth, accept


_X2 = Layout(
    "CORC X2 exoskeleton log",
    "GitHub X2DemoMachine.cpp of CANOpenRobotController: logged quantities, names, order, time in s from "
    "steady_clock exact; suffixes _1.. of vectors, sizes of the vectors but the four joints, formats and values "
    "made up.",
    ".csv",
    "robot",
    _x2,
    *_x2_truth(),
)

# 3
_ARMAR = ("Shoulder 1 R", "Shoulder 2 R", "Upperarm R", "Elbow R", "Underarm R", "Wrist 1 R", "Wrist 2 R")
_COM = tuple(f"{name} {a}" for name in ("CoM", "CoMVelocity") for a in "XYZ")


def _simox(path: Path, rng: Rng) -> None:
    m = _Arm(rng, 7, 16.0, rate=500.0, scale=0.6, reach=0.9)
    m.every(5)
    columns: dict[str, Sequence[str]] = {"Timestamp": _f(m.t + 0.01, "%.6g")}
    weight = 9.81 * np.array([9.0, 7.5, 6.0, 4.0, 2.6, 1.4, 0.7])
    for j, name in enumerate(_ARMAR):
        columns["TargetAngle" + name] = _f(m.ref[:, j], "%.6g")
        columns["ActualAngle" + name] = _f(m.q[:, j], "%.6g")
        columns["TargetVelocity" + name] = _f(m.ref_v[:, j], "%.6g")
        columns["ActualVelocity" + name] = _f(m.v[:, j], "%.6g")
        columns["ActualTorque" + name] = _f(m.tau[:, j], "%.6g")
        pull = np.column_stack([weight[j] * 0.05 * m.a[:, 0], weight[j] * 0.05 * m.a[:, 1], np.full(m.n, weight[j])])
        pull = pull + m.ext[:, [j]] * 2.0 + rng.normal(0.0, 0.4, pull.shape)
        for axis_name, values in zip("XYZ", pull.T, strict=True):
            columns[f"ActualForce{axis_name}{name}"] = _f(values, "%.6g")
    com = np.column_stack([12.0 + 20.0 * np.sin(m.q[:, 0]), 30.0 * np.sin(m.q[:, 1]), 840.0 + 15.0 * np.cos(m.q[:, 3])])
    for name, values in zip(_COM, [*com.T, *speed_of(com, m.t[1] - m.t[0]).T], strict=True):
        columns[name] = _f(values, "%.6g")
    _save(path, columns, tail=",")


def _simox_truth() -> tuple[dict[str, Truth], dict[str, tuple[str, ...]]]:
    truth, accept = {"Timestamp": Truth("time", "", "s")}, {}
    for name in _ARMAR:
        truth["TargetAngle" + name] = Truth("reference_position", name)
        truth["ActualAngle" + name] = Truth("position", name)
        truth["TargetVelocity" + name] = Truth("reference_speed", name)
        truth["ActualVelocity" + name] = Truth("speed", name)
        truth["ActualTorque" + name] = Truth("torque", name)
        accept["TargetAngle" + name] = accept["TargetVelocity" + name] = ("",)
        for a in "XYZ":
            truth[f"ActualForce{a}{name}"] = Truth("", name)
            accept[f"ActualForce{a}{name}"] = ("force",)
    return truth | {name: Truth() for name in _COM}, accept


_SIMOX = Layout(
    "Simox BulletRobotLogger",
    "GitHub Simox SimDynamics BulletRobotLogger.cpp: names, order and the comma at every line's end exact (so a "
    "last column is empty, without a name); joint names of the right arm of ARMAR- III; 100 Hz, values and motion "
    "made up.",
    ".csv",
    "robot",
    _simox,
    *_simox_truth(),
)

# 4
_RH5 = tuple(s + p for s in ("LL", "LR") for p in ("Hip1", "Hip2", "Hip3", "Knee", "AnkleRoll", "AnklePitch"))


def _rh5(path: Path, rng: Rng) -> None:
    dt = 0.001
    t = np.arange(14000) * dt
    step = rng.uniform(1.3, 1.6)
    gain = np.clip(np.minimum((t - 1.0) / 1.5, (13.0 - t) / 1.5), 0.0, 1.0)
    gain = low_pass(gain**2 * (3.0 - 2.0 * gain), dt, 3.0)
    w = np.pi / step
    q = np.zeros((len(t), 12))
    stance = np.zeros((len(t), 2))
    for leg, shift in enumerate((0.0, np.pi)):
        p = w * (t - 1.0) + shift
        swing = np.maximum(np.sin(p), 0.0) ** 2
        stance[:, leg] = 1.0 - gain * np.clip(1.6 * swing, 0.0, 1.0)
        base = 6 * leg
        knee = 0.55 + gain * 0.5 * swing
        hip = -0.28 + gain * (0.2 * np.sin(p - 0.6) - 0.25 * swing)
        q[:, base] = gain * 0.02 * np.sin(p + 0.3)
        q[:, base + 1] = gain * 0.09 * np.sin(w * (t - 1.0) + 0.2)
        q[:, base + 2] = hip
        q[:, base + 3] = knee
        q[:, base + 4] = -gain * 0.09 * np.sin(w * (t - 1.0) + 0.2)
        q[:, base + 5] = -(hip + knee)
    q = low_pass(q, dt, 15.0)
    v, a = speed_of(q, dt), speed_of(speed_of(q, dt), dt)
    inertia = np.array([0.25, 1.6, 1.5, 0.5, 0.05, 0.06])
    tau = np.zeros_like(q)
    for leg in (0, 1):
        b = 6 * leg
        load = low_pass(stance[:, leg], dt, 20.0) * rng.uniform(0.96, 1.04)
        side = 1.0 if leg == 0 else -1.0
        own = np.column_stack(
            [
                0.0 * load,
                side * 34.0 * load * 0.5 + 8.0 * np.sin(q[:, b + 1]),
                -28.0 * load * np.sin(q[:, b + 2]) - 11.0 * np.sin(q[:, b + 2]),
                62.0 * load * np.sin(q[:, b + 3]) * 0.6 + 4.0 * np.sin(q[:, b + 2] + q[:, b + 3]),
                side * 7.0 * load,
                -22.0 * load * (0.35 + q[:, b + 2]),
            ]
        )
        six = slice(b, b + 6)
        tau[:, six] = inertia * a[:, six] + own + np.array([0.4, 1.2, 1.0, 0.8, 0.2, 0.2]) * v[:, six]
    k = slice(0, None, 10)
    columns: dict[str, Sequence[str]] = {"t[s]": [repr(round(0.01 * i, 2)) for i in range(len(t[k]))]}
    for head, values in (("q_", q), ("qd_", v), ("qdd_", a), ("Tau_", tau)):
        for j, name in enumerate(_RH5):
            columns[head + name] = [repr(x) for x in values[k, j].tolist()]
    _save(path, columns, end="\r\n")


_RH5_LOG = Layout(
    "RH5 legs joint states and effort",
    "GitHub crocoddyl walking of the RH5 legs, logJointStatesAndEffort.csv: names, order, time rounded to 2 "
    "digits, 10 ms steps, full digits of Python exact; gait and torques made up.",
    ".csv",
    "robot",
    _rh5,
    {"t[s]": Truth("time", "", "s")}
    | {
        h + j: Truth(c, j)
        for h, c in (("q_", "position"), ("qd_", "speed"), ("qdd_", "acceleration"), ("Tau_", "torque"))
        for j in _RH5
    },
    {"Tau_" + j: ("reference_torque",) for j in _RH5},
)

# 5
_PLAYER_HEAD = (
    "## Player version 2.1.3 ",
    "## File version 0.3.0 ",
    "## Format: ",
    "## - Messages are newline-separated",
    "## - Common header to each message is:",
    "##   time     host   robot  interface index  type   subtype",
    "##   (double) (uint) (uint) (string)  (uint) (uint) (uint)",
    "## - Following the common header is the message payload ",
)


def _player(path: Path, rng: Rng) -> None:
    m = _Arm(rng, 5, 30.0, rate=250.0, scale=0.25, reach=0.9)
    m.every(5)
    n = m.n
    clock = 1204638112.0 + round(rng.uniform(0, 9e5), 3) + m.t + np.abs(rng.normal(0.0, 0.0006, n))
    columns: dict[str, Sequence[str]] = {
        "0": _f(clock, "%14.3f"),
        "1": _c(n, 16777343),
        "2": _c(n, 6665),
        "3": _c(n, "actarray"),
        "4": _c(n, "00"),
        "5": _c(n, "001"),
        "6": _c(n, "001"),
        "7": _c(n, 5),
    }
    amps = m.tau / np.array([3.1, 3.4, 2.2, 0.9, 0.9])
    for j in range(5):
        b = 8 + 5 * j
        columns[str(b)] = _f(quantised(m.q[:, j], 2.0 * np.pi / 36000.0))
        columns[str(b + 1)] = _f(m.v[:, j] + rng.normal(0.0, 0.004, n))
        columns[str(b + 2)] = _f(low_pass(m.a[:, j] + rng.normal(0.0, 0.05, n), 0.02, 10.0))
        columns[str(b + 3)] = _f(quantised(amps[:, j] + rng.normal(0.0, 0.02, n), 0.01))
        columns[str(b + 4)] = _i(np.where(np.abs(m.v[:, j]) > 0.005, 3, 1))
    columns["33"] = _c(n, 1)
    _save(path, columns, separator=" ", before=_PLAYER_HEAD, header=False, tail=" ")


def _player_truth() -> dict[str, Truth]:
    truth = {str(i): Truth() for i in range(34)}
    truth["0"] = Truth("time", "", "s")
    for j in range(5):
        for i, channel in enumerate(("position", "speed", "acceleration", "current")):
            truth[str(8 + 5 * j + i)] = Truth(channel, str(j))
    return truth


_PLAYER = Layout(
    "Player writelog actarray",
    "Documentation of Player 2.1/3.0, data logging and actarray format (playerstage.sourceforge.net): fields, "
    "order, units (s, rad, A), lines with #, blanks as separators, no names exact; wording of the preamble and "
    "number formats from memory; five joints at 50 Hz, values and motion made up.",
    ".log",
    "robot",
    _player,
    _player_truth(),
    {str(8 + 5 * j + 2): ("",) for j in range(5)},
)


# 6
def _chinese(path: Path, rng: Rng) -> None:
    m = _Arm(rng, 6, 24.0, rate=500.0, scale=0.5, pushes=(0.4, 0.62, 0.88), push=20.0)
    m.every(5)
    n, deg = m.n, 180.0 / np.pi
    columns: dict[str, Sequence[str]] = {"时间(ms)": _i(m.t * 1000.0)}
    milliamps = m.tau / np.array([0.012, 0.012, 0.010, 0.006, 0.006, 0.005])
    for j in range(6):
        h = f"关节{j + 1}"
        columns[h + "目标位置(°)"] = _f(m.ref[:, j] * deg, "%.3f")
        columns[h + "位置(°)"] = _f(quantised(m.q[:, j] * deg, 0.005), "%.3f")
        columns[h + "速度(°/s)"] = _f(quantised(m.v[:, j] * deg + rng.normal(0.0, 0.12, n), 0.02), "%.2f")
        columns[h + "电流(mA)"] = _i(milliamps[:, j] + rng.normal(0.0, 8.0, n))
        columns[h + "温度(℃)"] = _i(36.0 + j + m.t / 20.0 + rng.normal(0.0, 0.15, n))
        columns[h + "输入电压(V)"] = _f(47.9 - 0.0002 * np.abs(milliamps[:, j]) + rng.normal(0.0, 0.03, n), "%.1f")
    columns["碰撞标志"] = _i((np.abs(m.ext[:, 0]) > 1.5).astype(float))
    _save(path, columns, end="\r\n", encoding="utf-8-sig")


_CHINESE = Layout(
    "机械臂关节反馈记录",
    "Composed from the words of a public Chinese arm controller in Python; the table itself, its units, the set "
    "values, the flag, 100 Hz and the values are made up.",
    ".csv",
    "robot",
    _chinese,
    {"时间(ms)": Truth("time", "", "ms"), "碰撞标志": Truth("label")}
    | {
        f"关节{j}{name}": Truth(channel, str(j), unit)
        for j in range(1, 7)
        for name, channel, unit in (
            ("目标位置(°)", "reference_position", "deg"),
            ("位置(°)", "position", "deg"),
            ("速度(°/s)", "speed", "deg/s"),
            ("电流(mA)", "current", "mA"),
            ("温度(℃)", "", ""),
            ("输入电压(V)", "", ""),
        )
    },
    {f"关节{j}目标位置(°)": ("",) for j in range(1, 7)},
)

# 7
_ELM = (
    "raw_sample",
    "number_of_samples",
    "input_cycle_counter",
    "error",
    "underrange",
    "overrange",
    "diag",
    "txpdo_state",
)
_CLEAR_TAIL = (
    "motor_statusword",
    "motor_mode_display",
    "motor_actual_position",
    "motor_actual_velocity",
    "motor_actual_torque",
    "motor_digital_inputs",
    "motor_negative_limit_reached",
    "motor_positive_limit_reached",
    "motor_raw_input_a_line_on",
    "motor_raw_input_b_line_on",
    "motor_controlword",
    "motor_mode_command",
    "motor_target_position",
    "motor_target_velocity",
    "motor_target_torque",
)


def _clearpath(path: Path, rng: Rng) -> None:
    dt = 0.001
    depth = [rng.uniform(0.0025, 0.004), rng.uniform(0.0015, 0.003)]
    wall = 0.040
    moves = [
        (0.030, 0.03, 0.2, 0.5),
        (0.010, 0.05, 0.3, 0.4),
        (wall + depth[0], 0.02, 0.2, 0.4),
        (0.020, 0.04, 0.3, 0.8),
        (0.0, 0.06, 0.3, 0.3),
        (wall + depth[1], 0.03, 0.2, 0.4),
        (0.005, 0.05, 0.3, 0.6),
        (0.025, 0.03, 0.2, 0.3),
    ]
    xr = plan(moves, 0.0, dt, 0.05)
    s = axis(
        xr,
        dt,
        inertia=14.0,
        coulomb=16.0,
        viscous=120.0,
        bandwidth=60.0,
        lead=0.9,
        stiction=0.003,
        obstacles=[(wall, 1, rng.uniform(18e3, 28e3), 40.0, 0.0, 1e9)],
    )
    n, counts = len(xr), 12800.0 / 5.0 * 1000.0
    start = int(rng.integers(6e13, 9e13))
    late = np.round(np.abs(rng.normal(3800.0, 900.0, n))).astype(np.int64)
    scheduled = start + np.arange(n, dtype=np.int64) * 1_000_000
    home = int(rng.integers(-4000, 90000))
    columns: dict[str, Sequence[str]] = {
        "sample_index": _i(np.arange(n)),
        "scheduled_time_ns": [str(x) for x in scheduled.tolist()],
        "actual_time_ns": [str(x) for x in (scheduled + late).tolist()],
        "wakeup_latency_ns": _i(late),
    }
    share, zero = {"x": 0.03, "y": -0.05, "z": 1.0}, {"x": 18200.0, "y": -7400.0, "z": -31500.0}
    for a in "xyz":
        raw = zero[a] + 5200.0 * share[a] * s.contact + 300.0 * s.a * share[a] + rng.normal(0.0, 420.0, n)
        cells = [_i(raw), _c(n, 1), _i((np.arange(n) + 1) % 4), *([_c(n, 0)] * 5)]
        columns |= {f"elm_{a}_{name}": values for name, values in zip(_ELM, cells, strict=True)}
    cells = [
        _c(n, 4663),
        _c(n, 8),
        _i(home + counts * s.x),
        _i(counts * s.v + rng.normal(0.0, 300.0, n)),
        _i(s.drive / 480.0 * 1000.0 + rng.normal(0.0, 2.0, n)),
        _c(n, 0),
        _c(n, 0),
        _c(n, 0),
        _c(n, 1),
        _c(n, 1),
        _c(n, 15),
        _c(n, 8),
        _i(home + counts * s.xr),
        _c(n, 0),
        _c(n, 0),
    ]
    columns |= dict(zip(_CLEAR_TAIL, cells, strict=True))
    before = (
        "# zero_force_controller",
        "# topology: 0:0 EK1100, 0:1 ELM3604-0002, 0:2 ClearPath EC",
        "# frequency_hz: 1000",
        f"# requested_duration_s: {n / 1000:.9g}",
        "# position_step_per_cycle: 8",
        "# elm_sample_entries: x=0x6001:01, y=0x6011:01, z=0x6021:01",
        "# elm_sample_type: signed 32-bit raw PDO",
        "# clearpath_mode: CSP",
        f"# samples: {n}",
        "# timing_overruns: 0",
    )
    _save(path, columns, before=before)


_CLEARPATH = Layout(
    "ClearPath EC zero force controller",
    "GitHub zero_force_controller in C++ (EtherCAT ClearPath EC and ELM3604): preamble, names, order, integers, "
    "ns clocks exact; a screw axis of 5 mm lead that presses on a specimen along z, scales, values made up. "
    "Encoder counts, counts/s and thousandths of the rated torque have no unit in the file.",
    ".csv",
    "linear axis",
    _clearpath,
    {
        "sample_index": Truth(),
        "scheduled_time_ns": Truth("time", "", "ns"),
        "actual_time_ns": Truth("time", "", "ns"),
        "wakeup_latency_ns": Truth(),
    }
    | {f"elm_{a}_{name}": Truth() for a in "xyz" for name in _ELM}
    | {name: Truth() for name in _CLEAR_TAIL}
    | {
        "elm_z_raw_sample": Truth("force"),
        "motor_actual_position": Truth("position"),
        "motor_actual_velocity": Truth("speed"),
        "motor_actual_torque": Truth("torque"),
        "motor_target_position": Truth("reference_position"),
    },
    {
        "sample_index": ("time",),
        "scheduled_time_ns": ("",),
        "elm_x_raw_sample": ("force",),
        "elm_y_raw_sample": ("force",),
        "elm_z_raw_sample": ("",),
        "motor_target_position": ("",),
        "motor_target_velocity": ("reference_speed",),
        "motor_target_torque": ("reference_torque",),
    },
)


# 8
def _elevator(path: Path, rng: Rng) -> None:
    dt, inch = 0.001, 0.0254
    heights = [20.0, 46.0, 5.0, 62.0, 30.0, 52.0, 2.0]
    heights = [h + rng.uniform(-1.5, 1.5) for h in heights]
    moves = [(h * inch, rng.uniform(0.7, 1.1), 2.2, rng.uniform(0.5, 1.1)) for h in heights]
    xr = plan(moves, 0.0, dt, 0.06)
    at = crossing(xr, dt, 40.0 * inch, 1, 1)
    s = axis(
        xr,
        dt,
        inertia=14.0,
        coulomb=22.0,
        viscous=14.0,
        gravity=75.0,
        bandwidth=16.0,
        lead=0.9,
        limit=420.0,
        obstacles=[(40.0 * inch, 1, 9e3, 60.0, at - 0.6, 0.25)],
        yields=True,
    )
    n_all = len(xr)
    tick = np.cumsum(0.02 + rng.normal(0.0, 0.0004, int(n_all * dt / 0.02) - 2))
    s = s.at(tick)
    n = len(tick)
    goal = np.zeros(n)
    ends = [float(m[0]) / inch for m in moves]
    moving = np.abs(s.vr) > 1e-6
    stage, was = -1, False
    for i in range(n):
        if moving[i] and not was and stage < len(ends) - 1:
            stage += 1
        was = bool(moving[i])
        goal[i] = ends[max(stage, 0)] if stage >= 0 else 0.0
    amps = quantised(np.abs(s.drive) * 0.11 + np.abs(rng.normal(0.0, 0.15, n)), 0.125)
    volts = s.drive * 0.022 + 6.2 * s.v + rng.normal(0.0, 0.03, n)
    columns = {
        "Time": [repr(x) for x in np.round(tick, 9).tolist()],
        "TrajPos": _i(s.xr / inch * 118.7),
        "TrajVel": _i(s.vr / inch * 11.87),
        "Tgt Ht": _r(goal, 3),
        "Act Ht": _r(quantised(s.x / inch, 1.0 / 118.7), 6),
        "Amps": _r(amps, 3),
        "Volts": _r(quantised(volts, 0.0117), 4),
        "Speed": _r(quantised(s.v / inch + rng.normal(0.0, 0.15, n), 10.0 / 118.7), 6),
    }
    _save(path, columns, after=["mS,Inches,Inches,Inches,Inches,Amps,Volts,In/Sec"])


_ELEVATOR = Layout(
    "FRC elevator run file",
    "GitHub fondyfire2194/Robot2019 LogElevatorData.java: names, row of units and the logged calls exact, also "
    "that the time is in s though the row says mS and that the trajectory is in sensor units though the row says "
    "inches; output current without a sign as of the Talon; separators, 20 ms and values made up.",
    ".csv",
    "linear axis",
    _elevator,
    {
        "Time": Truth("time", "", "s"),
        "TrajPos": Truth("reference_position"),
        "TrajVel": Truth("reference_speed"),
        "Tgt Ht": Truth("reference_position", "", "in"),
        "Act Ht": Truth("position", "", "in"),
        "Amps": Truth("current", "", "A"),
        "Volts": Truth(),
        "Speed": Truth("speed", "", "in/s"),
    },
    {"TrajPos": ("",), "TrajVel": ("",), "Tgt Ht": ("",)},
)


# 9
def _smac(path: Path, rng: Rng) -> None:
    dt = 0.00025
    touch, stiff = rng.uniform(0.0085, 0.0095), rng.uniform(2600.0, 3400.0)
    moves = []
    for c in range(4):
        moves += [
            (touch + 0.0003, 0.006, 0.1, 0.4 if c else 0.6),
            (touch - 4.9 / stiff * (1.0 + stiff / 3240.0), 0.002, 0.05, 0.0),
            (0.020, 0.015, 0.2, rng.uniform(2.4, 2.8)),
        ]
    xr = plan(moves, 0.020, dt, 0.03)
    s = axis(
        xr,
        dt,
        inertia=0.4,
        coulomb=0.5,
        viscous=6.0,
        gravity=0.6,
        bandwidth=90.0,
        lead=0.95,
        stiction=0.0006,
        obstacles=[(touch, -1, stiff, 6.0, 0.0, 1e9)],
    )
    steps = 0.0245 + np.abs(rng.normal(0.0, 0.0015, int(len(xr) * dt / 0.027)))
    clock = np.cumsum(steps)
    s = s.at(clock)
    n = len(clock)
    force = -s.contact
    volts = np.round((force + 8.175) / 0.0274 - 3.0 + rng.normal(0.0, 0.7, n))
    stage = np.zeros(n, int)
    hit = force > 0.08
    now = 0
    for i in range(n):
        if now == 0 and hit[i]:
            now = 1
        elif now == 1 and force[i] > 0.93 * force.max():
            now = 2
        elif now == 2 and s.v[i] > 0.004:
            now = 3
        elif now == 3 and s.x[i] > 0.0199:
            now = 0
        stage[i] = now
    columns = {
        "Timestamp (s)": _r(clock, 6),
        "Position (mm)": _r(np.round(s.x * 1e7) / 1e4, 4),
        "Velocity (mm/s)": _r(quantised(s.v * 1000.0 + rng.normal(0.0, 0.02, n), 0.007629), 6),
        "Force (N)": _r(0.0274 * volts - 8.175, 6),
        "Torque": _i(s.drive * 620.0 + rng.normal(0.0, 12.0, n)),
        "Stage": _i(stage),
    }
    _save(path, columns, end="\r\n")


_SMAC = Layout(
    "SMAC LCA50 tissue crush rig",
    "GitHub of CIGITI (SickKids Toronto), crush rig with a SMAC LAC-1: names, order, rounding, calibration of the "
    "load cell, csv.writer line ends, stages, 1 mm/s and loads exact; serial rate of 39 Hz, shorter holds, scale "
    "of the torque and values made up.",
    ".csv",
    "linear axis",
    _smac,
    {
        "Timestamp (s)": Truth("time", "", "s"),
        "Position (mm)": Truth("position", "", "mm"),
        "Velocity (mm/s)": Truth("speed", "", "mm/s"),
        "Force (N)": Truth("force", "", "N"),
        "Torque": Truth("torque"),
        "Stage": Truth(),
    },
    {"Stage": ("label",)},
)


# 10
def _gate(path: Path, rng: Rng) -> None:
    dt, far = 0.001, rng.uniform(3.6, 4.2)
    moves = [
        (far, 0.5, 0.5, 1.0),
        (0.0, 0.4, 0.4, 1.5),
        (far * 0.6, 0.5, 0.5, 1.0),
        (0.35, 0.3, 0.4, 1.2),
        (far * 0.5, 0.4, 0.5, 1.5),
        (0.3, 0.35, 0.4, 0.8),
        (far * 0.4, 0.4, 0.5, 1.2),
    ]
    xr = plan(moves, 0.0, dt, 0.15)
    where = 0.52
    starts = [crossing(xr, dt, where, -1, 1), crossing(xr, dt, where, -1, 2)]
    s = axis(
        xr,
        dt,
        inertia=260.0,
        coulomb=70.0,
        viscous=45.0,
        bandwidth=14.0,
        lead=0.85,
        limit=700.0,
        stiction=0.004,
        obstacles=[(where, -1, rng.uniform(2.5e4, 4e4), 400.0, t - 2.0, rng.uniform(0.35, 0.5)) for t in starts],
        yields=True,
    )
    k = slice(0, None, 10)
    n = len(s.t[k])
    amps = low_pass(s.drive, dt, 40.0)[k] / 95.0
    columns = {
        "Zeit [s]": _f(s.t[k], "%.2f"),
        "Torposition [mm]": _f(quantised(s.x[k] * 1000.0, 0.25), "%.2f"),
        "Sollgeschwindigkeit [mm/s]": _f(s.vr[k] * 1000.0, "%.1f"),
        "Istgeschwindigkeit [mm/s]": _f(quantised(s.v[k] * 1000.0 + rng.normal(0.0, 0.8, n), 0.5), "%.1f"),
        "Motorstrom [A]": _f(quantised(amps + rng.normal(0.0, 0.03, n), 0.01), "%.2f"),
        "Zwischenkreisspannung [V]": _f(323.0 - 0.9 * amps + rng.normal(0.0, 0.6, n), "%.1f"),
        "Motortemperatur [°C]": _f(31.0 + s.t[k] / 40.0, "%.1f"),
        "Schließkraft [N]": _f(quantised(-s.contact[k] + rng.normal(0.0, 1.2, n), 0.5), "%.1f"),
        "Lichtschranke": _i(np.ones(n)),
        "Endlage zu": _i((s.x[k] < 0.004).astype(float)),
    }
    _save(path, columns, end="\r\n", encoding="cp1252")


_GATE = Layout(
    "Schiebetor FB_CTRL_LOG_DATA",
    "Beckhoff Infosys, FB_CTRL_LOG_DATA of the Controller Toolbox (German pages): first line with the user's "
    "titles, time in s in the first column, then up to ten values, commas, equal steps exact; the titles, 10 ms, "
    "a sliding gate with a closing force gauge and all values made up.",
    ".csv",
    "linear axis",
    _gate,
    {
        "Zeit [s]": Truth("time", "", "s"),
        "Torposition [mm]": Truth("position", "", "mm"),
        "Sollgeschwindigkeit [mm/s]": Truth("reference_speed", "", "mm/s"),
        "Istgeschwindigkeit [mm/s]": Truth("speed", "", "mm/s"),
        "Motorstrom [A]": Truth("current", "", "A"),
        "Zwischenkreisspannung [V]": Truth(),
        "Motortemperatur [°C]": Truth(),
        "Schließkraft [N]": Truth("force", "", "N"),
        "Lichtschranke": Truth(),
        "Endlage zu": Truth(),
    },
    {"Sollgeschwindigkeit [mm/s]": ("",)},
)


# 11
def _aerotech(path: Path, rng: Rng) -> None:
    dt = 0.001
    xr = plan(alternate(rng, -0.075, 0.075, [0.1, 0.2, 0.15, 0.25], 2.0, 9.0, (0.2, 0.5), 0.4), -0.075, dt, 0.02)
    at = crossing(xr, dt, 0.02, 1, 2)
    s = axis(
        xr,
        dt,
        inertia=6.5,
        coulomb=5.0,
        viscous=9.0,
        bandwidth=110.0,
        lead=0.98,
        limit=320.0,
        stiction=0.004,
        obstacles=[(0.02, 1, rng.uniform(3e4, 6e4), 60.0, at - 0.3, rng.uniform(0.06, 0.1))],
    )
    n = len(xr)
    amps = s.drive / 21.3
    measured = quantised(s.x * 1000.0 + rng.normal(0.0, 2e-5, n), 1e-5)
    columns = {
        "Time (ms)": _i(s.t * 1000.0),
        "X Position Command (mm)": _f(s.xr * 1000.0, "%.6f"),
        "X Position Feedback (mm)": _f(measured, "%.6f"),
        "X Position Error (mm)": _f(s.xr * 1000.0 - measured, "%.6f"),
        "X Velocity Command (mm/s)": _f(s.vr * 1000.0, "%.5f"),
        "X Velocity Feedback (mm/s)": _f(s.v * 1000.0 + rng.normal(0.0, 0.05, n), "%.5f"),
        "X Acceleration Command (mm/s^2)": _f(speed_of(s.vr, dt) * 1000.0, "%.3f"),
        "X Acceleration Feedback (mm/s^2)": _f(s.a * 1000.0 + rng.normal(0.0, 15.0, n), "%.3f"),
        "X Current Command (A)": _f(amps, "%.5f"),
        "X Current Feedback (A)": _f(low_pass(amps, dt, 300.0) + rng.normal(0.0, 0.02, n), "%.5f"),
        "X Drive Status": _c(n, 1179649),
        "X Axis Fault": _c(n, 0),
    }
    _save(path, columns, end="\r\n")


_AEROTECH = Layout(
    "Aerotech Automation1 data collection",
    "Composed from help.aerotech.com, Automation1 data collection: the axis data signals (position, velocity, "
    "acceleration, current, each command and feedback, position error, drive status, fault) and 1 kHz are of the "
    "help; wording of the header, units and values made up.",
    ".csv",
    "linear axis",
    _aerotech,
    {
        "Time (ms)": Truth("time", "", "ms"),
        "X Position Command (mm)": Truth("reference_position", "", "mm"),
        "X Position Feedback (mm)": Truth("position", "", "mm"),
        "X Position Error (mm)": Truth(),
        "X Velocity Command (mm/s)": Truth("reference_speed", "", "mm/s"),
        "X Velocity Feedback (mm/s)": Truth("speed", "", "mm/s"),
        "X Acceleration Command (mm/s^2)": Truth("reference_acceleration", "", "mm/s^2"),
        "X Acceleration Feedback (mm/s^2)": Truth("acceleration", "", "mm/s^2"),
        "X Current Command (A)": Truth("reference_torque", "", "A"),
        "X Current Feedback (A)": Truth("current", "", "A"),
        "X Drive Status": Truth(),
        "X Axis Fault": Truth(),
    },
    {
        "X Position Command (mm)": ("",),
        "X Velocity Command (mm/s)": ("",),
        "X Acceleration Command (mm/s^2)": ("",),
        "X Current Command (A)": ("", "current"),
    },
)


# 12
def _screw(path: Path, rng: Rng) -> None:
    dt, turn = 0.001, 2.0 * np.pi
    moves, steps, seats, at = [], [], [], 0.0
    for _ in range(3):
        seat = at + turn * rng.uniform(6.6, 7.2)
        end = seat + rng.uniform(0.9, 1.1)
        seats.append((at, seat, end))
        moves += [
            (at + turn, 60.0 / RPM, 60.0, 0.25),
            (seat - 0.8, 500.0 / RPM, 500.0, 0.05),
            (end, 40.0 / RPM, 40.0, 0.03),
            (at + turn * 0.5, 300.0 / RPM, 300.0, 0.45),
        ]
        steps += [1, 2, 3, 5]
        at += turn * 0.5
    x = plan(moves, 0.0, dt, 0.02)
    v, a = speed_of(x, dt), speed_of(speed_of(x, dt), dt)
    # which move is on, by the order of the pauses and the targets
    number = np.zeros(len(x), int)
    k = 0
    for i in range(len(x)):
        if k < len(moves) and abs(x[i] - moves[k][0]) < 1e-4 and abs(v[i]) < 1e-3:
            k += 1
        number[i] = min(k, len(moves) - 1)
    torque = 0.00022 * a + 0.0006 * v
    for i in range(len(x)):
        c = number[i] // 4
        first, seat, end = seats[c]
        deep = max(x[i] - first - turn, 0.0)
        thread = 0.10 + 0.05 * min(deep / (6.0 * turn), 1.0)
        tight = 2.4 * max(x[i] - seat, 0.0) / (end - seat)
        step = steps[number[i]]
        if abs(v[i]) > 1e-3:
            torque[i] += np.sign(v[i]) * (thread if deep > 0.0 else 0.03) + (tight if v[i] > 0.0 else -0.75 * tight)
        elif step == 5 and x[i] > seat:
            torque[i] += tight * 0.97
    torque = low_pass(torque, dt, 120.0)
    n = len(x)
    program = np.asarray(steps)[number]
    program = np.where((program == 5) & (np.abs(v) < 1e-3) & (torque > 0.3), 4, program)

    def comma(values: Array, form: str) -> list[str]:
        return [c.replace(".", ",") for c in _f(values, form)]

    columns = {
        "Zeit [ms]": _i(np.arange(n)),
        "Drehzahl [1/min]": comma(quantised(v * RPM + rng.normal(0.0, 0.6, n), 0.1), "%.1f"),
        "Drehmoment [Nm]": comma(quantised(torque + rng.normal(0.0, 0.006, n), 0.001), "%.3f"),
        "Drehwinkel [°]": comma(quantised(np.degrees(x), 0.1), "%.1f"),
        "Programmschritt": _i(program),
    }
    _save(path, columns, separator=";", end="\r\n")


_SCREW = Layout(
    "DEPRAG AST6 Schraubkurve",
    "Manual of the DEPRAG AST6, section 12.2: the curve as CSV with speed, torque, angle and program step, "
    "semicolons and decimal commas for the German table program as it advises; German words, units in the names, "
    "the column of the time, 1 ms, three screws turned in and out in one file and all values made up.",
    ".csv",
    "rotary axis",
    _screw,
    {
        "Zeit [ms]": Truth("time", "", "ms"),
        "Drehzahl [1/min]": Truth("speed", "", "rpm"),
        "Drehmoment [Nm]": Truth("torque", "", "N m"),
        "Drehwinkel [°]": Truth("position", "", "deg"),
        "Programmschritt": Truth(),
    },
    {"Programmschritt": ("label",)},
)


# 13
def _ingenia(path: Path, rng: Rng) -> None:
    dt, turn = 0.001, 2.0 * np.pi
    xr = plan(alternate(rng, 0.0, 3.0 * turn, [12.0, 25.0, 18.0], 120.0, 14.0, (0.3, 0.8), 0.6), 0.0, dt, 0.03)
    at = crossing(xr, dt, 1.7 * turn, 1, 2)
    s = axis(
        xr,
        dt,
        inertia=0.004,
        coulomb=0.06,
        viscous=0.0016,
        bandwidth=50.0,
        lead=0.95,
        limit=1.6,
        stiction=0.5,
        obstacles=[(1.7 * turn, 1, rng.uniform(4.0, 8.0), 0.01, at - 0.3, rng.uniform(0.12, 0.2))],
        yields=True,
    )
    k = slice(0, None, 2)
    n = len(s.t[k])
    clock = s.t[k] + 0.0004 + np.abs(rng.normal(0.0, 3e-5, n))
    counts = 65536.0 / turn
    columns = {
        "timestamp": _f(clock, "%.6f"),
        "CL_POS_SET_POINT_VALUE": _i(s.xr[k] * counts),
        "CL_POS_FBK_VALUE": _i(s.x[k] * counts),
        "CL_VEL_SET_POINT_VALUE": _f(s.vr[k] / turn, "%.5f"),
        "CL_VEL_FBK_VALUE": _f(s.v[k] / turn + rng.normal(0.0, 0.006, n), "%.5f"),
        "CL_TOR_SET_POINT_VALUE": _f(s.drive[k], "%.5f"),
        "CL_TOR_FBK_VALUE": _f(low_pass(s.drive, dt, 200.0)[k] + rng.normal(0.0, 0.006, n), "%.5f"),
        "DRV_STATE_STATUS": _c(n, 5687),
        "DRV_PROT_VBUS_VALUE": _f(48.1 + rng.normal(0.0, 0.04, n), "%.3f"),
        "DRV_PROT_TEMP_VALUE": _f(34.2 + s.t[k] / 30.0 + rng.normal(0.0, 0.05, n), "%.2f"),
    }
    _save(path, columns, end="\r\n")


_INGENIA = Layout(
    "Ingenia servo registers",
    "Names of registers from the examples of ingeniamotion; the table itself, the voltage and temperature names, "
    "500 Hz, scales and values made up. No units in the file.",
    ".csv",
    "rotary axis",
    _ingenia,
    {
        "timestamp": Truth("time", "", "s"),
        "CL_POS_SET_POINT_VALUE": Truth("reference_position"),
        "CL_POS_FBK_VALUE": Truth("position"),
        "CL_VEL_SET_POINT_VALUE": Truth("reference_speed"),
        "CL_VEL_FBK_VALUE": Truth("speed"),
        "CL_TOR_SET_POINT_VALUE": Truth("reference_torque"),
        "CL_TOR_FBK_VALUE": Truth("torque"),
        "DRV_STATE_STATUS": Truth(),
        "DRV_PROT_VBUS_VALUE": Truth(),
        "DRV_PROT_TEMP_VALUE": Truth(),
    },
    dict.fromkeys(("CL_POS_SET_POINT_VALUE", "CL_VEL_SET_POINT_VALUE", "CL_TOR_SET_POINT_VALUE"), ("",)),
)

# 14
_HEBI_NAMES = (
    "name0",
    "position0",
    "velocity0",
    "effort0",
    "position_command0",
    "velocity_command0",
    "effort_command0",
    "accelerometer0.x",
    "accelerometer0.y",
    "accelerometer0.z",
    "gyro0.x",
    "gyro0.y",
    "gyro0.z",
    "orientation0.x",
    "orientation0.y",
    "orientation0.z",
    "orientation0.w",
    "deflection0",
    "deflection_velocity0",
    "motor_velocity0",
    "motor_current0",
    "motor_winding_current0",
    "motor_sensor_temperature0",
    "motor_winding_temperature0",
    "motor_housing_temperature0",
    "board_temperature0",
    "processor_temperature0",
    "voltage0",
    "led_color0.r",
    "led_color0.g",
    "led_color0.b",
    "led_color0.a",
    "sequence_number0",
    "receive_time0",
    "transmit_time0",
    "hardware_receive_time0",
    "hardware_transmit_time0",
)


def _hebi(path: Path, rng: Rng) -> None:
    dt = 0.001
    xr = plan(alternate(rng, -0.9, 0.8, [0.8, 1.6, 1.2], 5.0, 22.0, (0.4, 1.0), 1.0), -0.9, dt, 0.1)
    t = np.arange(len(xr)) * dt
    q = follow(xr[:, None], dt, 18.0)[0][:, 0]
    ext = sum(
        rng.choice([-1.0, 1.0]) * rng.uniform(2.0, 4.0) * _bump(t, share * t[-1], rng.uniform(0.1, 0.25))
        for share in (0.45, 0.7, 0.9)
    )
    q = q + low_pass(ext, dt, 6.0) / 90.0
    v, a = speed_of(q, dt), speed_of(speed_of(q, dt), dt)
    load = 0.05 * a + 0.02 * v + 3.2 * np.sin(q)
    effort = load - ext
    motor = effort + 0.35 * np.tanh(v / 0.05) + 0.25 * v
    k = slice(0, None, 10)
    n = len(t[k])
    bend = effort / 170.0
    q, v, a, effort, motor, now = q[k], v[k], a[k], effort[k], motor[k], t[k]
    epoch = 1.5379e9 + round(rng.uniform(0.0, 5e6), 6)
    stamp = epoch + now + np.abs(rng.normal(0.0, 0.0003, n))
    micro = np.round((epoch + now - 0.0006) * 1e6)
    boot = np.round((41.3 + now) * 1e6)
    acc = np.column_stack([9.81 * np.sin(q) + 0.25 * a, 9.81 * np.cos(q) - 0.25 * v**2, 0.1 + 0.0 * q])
    acc = acc + rng.normal(0.0, 0.05, acc.shape)
    cells = [
        _c(n, "Test Family/Test Actuator"),
        _r(quantised(q, 2 * np.pi / 65536), 9),
        _r(v + rng.normal(0, 0.006, n), 9),
        _r(effort + rng.normal(0.0, 0.03, n), 9),
        _r(xr[k], 9),
        _r(speed_of(xr, dt)[k], 9),
        _c(n, "nan"),
        *(_r(x, 9) for x in acc.T),
        *(_r(x, 9) for x in (rng.normal(0, 0.01, n), rng.normal(0, 0.01, n), v)),
        _c(n, "0.0"),
        _c(n, "0.0"),
        _r(np.sin(q / 2.0), 9),
        _r(np.cos(q / 2.0), 9),
        _r(bend[k], 9),
        _r(speed_of(bend, dt)[k], 9),
        _r((v + speed_of(bend, dt)[k]) * 272.22 + rng.normal(0.0, 1.5, n), 6),
        _r(motor / 9.5 + rng.normal(0.0, 0.01, n), 9),
        _r(motor / 6.1 + rng.normal(0.0, 0.015, n), 9),
        _r(quantised(31.0 + now / 60, 0.1), 4),
        _r(33.0 + now / 40, 6),
        _r(31.5 + now / 70, 6),
        _r(quantised(36.0 + now / 80, 0.25), 4),
        _r(quantised(41.0 + now / 50, 0.5), 4),
        _r(36.1 - 0.05 * np.abs(motor) + rng.normal(0, 0.02, n), 5),
        _c(n, "0.0"),
        _c(n, "0.0"),
        _c(n, "0.0"),
        _c(n, "0.0"),
        _i(np.arange(n) + 2191),
        _i(micro + 430.0),
        _i(micro),
        _i(boot),
        _i(boot + 95.0),
    ]
    stamps = [f"{int(x)}000" for x in np.floor(stamp * 1e6).tolist()]
    columns: dict[str, Sequence[str]] = {"%time": stamps}
    columns |= {"field." + name: values for name, values in zip(_HEBI_NAMES, cells, strict=True)}
    _save(path, columns)


def _hebi_truth() -> tuple[dict[str, Truth], dict[str, tuple[str, ...]]]:
    truth = {"%time": Truth("time", "", "ns")} | {"field." + name: Truth() for name in _HEBI_NAMES}
    required = {"position0": "position", "velocity0": "speed", "effort0": "torque"}
    optional = {
        "position_command0": "reference_position",
        "velocity_command0": "reference_speed",
        "motor_velocity0": "speed",
        "motor_current0": "current",
        "motor_winding_current0": "current",
    }
    clocks = ("receive_time0", "transmit_time0", "hardware_receive_time0", "hardware_transmit_time0")
    truth |= {"field." + name: Truth(channel) for name, channel in (required | optional).items()}
    truth |= {"field." + name: Truth("time", "", "us") for name in clocks}
    accept = {"field." + name: ("",) for name in (*optional, *clocks)}
    accept["field.effort_command0"] = ("reference_torque",)
    accept["field.sequence_number0"] = ("time",)
    accept["field.gyro0.z"] = ("speed",)
    return truth, accept


_HEBI = Layout(
    "HEBI feedback by rostopic echo",
    "docs.ros.org hebiros/FeedbackMsg: fields and order exact; header as `rostopic echo -p` of ROS 1 writes it "
    "(%time in ns, field.NAME0) from memory; one X5 module with a swinging link at 100 Hz, pushes by hand, values "
    "made up. No units.",
    ".csv",
    "rotary axis",
    _hebi,
    *_hebi_truth(),
)


# 15
def _shadow(path: Path, rng: Rng) -> None:
    dt = 0.001
    high = rng.uniform(1.2, 1.35)
    moves = [
        (high, 0.5, 3.0, 0.8),
        (0.1, 0.6, 3.0, 0.6),
        (0.8, 0.4, 3.0, 0.5),
        (0.0, 0.5, 3.0, 0.5),
        (high, 0.7, 3.0, 0.7),
        (0.3, 0.5, 3.0, 0.6),
        (1.0, 0.35, 3.0, 0.5),
        (0.0, 0.6, 3.0, 0.6),
    ]
    xr = plan(moves, 0.0, dt, 0.1)
    at = crossing(xr, dt, 0.9, 1, 1)
    s = axis(
        xr,
        dt,
        inertia=0.02,
        coulomb=0.12,
        viscous=0.06,
        bandwidth=25.0,
        lead=0.9,
        limit=1.2,
        stiction=0.03,
        obstacles=[(0.9, 1, rng.uniform(5.0, 8.0), 0.05, at - 0.5, rng.uniform(0.4, 0.6))],
        yields=True,
    )
    k = slice(0, None, 8)
    n = len(s.t[k])
    effort = (
        -40.0
        + 150.0 * low_pass(s.drive + 0.10 * np.sin(s.x), dt, 12.0)[k]
        + low_pass(rng.normal(0, 1.2, n), 0.008, 15.0)
    )
    base = 1620848263817079121 + int(rng.integers(0, 10**12))
    stamp = [base + 8_000_000 * i + (420_477 if i > 4 else 0) for i in range(n)]
    columns = {
        "timestamp": [str(x) for x in stamp],
        "position": [repr(x) for x in (s.x[k] + low_pass(rng.normal(0.0, 2e-5, n), 0.008, 30.0)).tolist()],
        "velocity": [repr(x) for x in (s.v[k] + rng.normal(0.0, 0.0006, n)).tolist()],
        "effort": [repr(x) for x in effort.tolist()],
    }
    _save(path, columns)


_SHADOW = Layout(
    "Shadow hand joint test",
    "GitHub shadow-robot/common_resources, sr_test_force_resolution/output/*/jointstate_position_FFJ3_*.csv: "
    "names, epoch in ns with 8 ms steps and a small slip, digits, noise of position and speed, an effort with an "
    "offset exact; longer, with more moves and a touched object, scale of the effort made up. No units in the "
    "file.",
    ".csv",
    "rotary axis",
    _shadow,
    {
        "timestamp": Truth("time", "", "ns"),
        "position": Truth("position"),
        "velocity": Truth("speed"),
        "effort": Truth("torque"),
    },
)

LAYOUTS: tuple[Layout, ...] = (
    _CASTER,
    _X2,
    _SIMOX,
    _RH5_LOG,
    _PLAYER,
    _CHINESE,
    _CLEARPATH,
    _ELEVATOR,
    _SMAC,
    _GATE,
    _AEROTECH,
    _SCREW,
    _INGENIA,
    _HEBI,
    _SHADOW,
)
