"""Layouts of test rigs and of loggers of students, by somebody who had not seen the guesser: it was improved on these.

`source` states what is exact and what is made up.
"""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.commands.init.layouts.layout import Layout, Truth
from tests.commands.init.layouts.simulators import arm_torque, axis, follow, low_pass, plan, poses, quantised

Array = np.ndarray
Rng = np.random.Generator
NO = Truth()
MAYBE = ("",)


def _save(path: Path, lines: Sequence[str], newline: str = "\n", encoding: str = "utf-8") -> None:
    path.write_bytes((newline.join(lines) + newline).encode(encoding))


def _lines(columns: Sequence[Sequence[str]], separator: str) -> list[str]:
    return [separator.join(row) for row in zip(*columns, strict=True)]


def _cells(values: Array, form: str) -> list[str]:
    return [form % value for value in values.tolist()]


def _short(values: Array, digits: int) -> list[str]:
    """Return cells as Python prints rounded floats."""
    return [repr(round(value, digits) + 0.0) for value in np.asarray(values, float).tolist()]


def _ints(values: Array) -> list[str]:
    return [str(round(value)) for value in values.tolist()]


def _bump(t: Array, at: float, width: float) -> Array:
    """Return a smooth push of height 1."""
    x = np.clip((t - at) / width, -1.0, 1.0)
    return np.cos(0.5 * np.pi * x) ** 2


def _sampled(t: Array, values: Array, times: Array) -> Array:
    if values.ndim == 1:
        return np.interp(times, t, values)
    return np.column_stack([np.interp(times, t, column) for column in values.T])


# EPFL rocket team: ball valve with an EPOS motor
EPFL = (
    "temp_1 [°C];temp_2 [°C];temp_3 [°C];pres_1 [RAW];pres_2 [RAW];sensor_time [ms];motor_pos [0.1 deg];motor_psu [V];"
    "motor_torque [mN];motor_position [inc];motor_position_demand [inc];motor_current [mA];motor_current_demand [mA];"
    "motor_velocity [rpm];motor_time [ms]"
)


def _epfl(path: Path, rng: Rng) -> None:
    dt = 0.002
    moves, at = [], 0.0
    for k in range(16):
        target = -rng.choice([0.0, 90.0, 45.0, 22.0, 70.0]) if k else -90.0
        if target == at:
            target = -30.0 if at != -30.0 else 0.0
        speed = rng.uniform(70.0, 130.0)
        moves.append((target, speed, rng.uniform(250.0, 400.0), rng.uniform(1.2, 2.6)))
        at = target
    ref = plan(moves, 0.0, dt, 0.06)[:, None] * (np.pi / 180.0) * 66.0
    x, v, a = (s[:, 0] for s in follow(ref, dt, 60.0))
    t = np.arange(len(x)) * dt
    n = min(int(t[-1] / 0.079), 780)
    motor = np.cumsum(rng.choice([50.0, 60.0, 72.0, 100.0], n, p=[0.2, 0.25, 0.3, 0.25])) / 1e3
    motor = motor[motor < t[-1]]
    n = len(motor)
    again = np.flatnonzero(rng.random(n) < 0.02)
    again = again[again > 0]
    stamp = np.round(2185933.0 + 1e3 * motor)
    stamp[again] = stamp[again - 1]
    motor[again] = motor[again - 1]
    sensor = np.round((2185933.0 + 1e3 * motor + rng.uniform(0, 36, n)) / 20.0) * 20.0 - 1.0
    sensor = np.maximum.accumulate(sensor)
    busy = low_pass((np.abs(v) > 1.0).astype(float), dt, 0.8) > 0.02
    pos, speed = np.interp(motor, t, x), np.interp(motor, t, v)
    acceleration, on = np.interp(motor, t, a), np.interp(motor, t, busy.astype(float)) > 0.5
    effort = 1.35e-5 * acceleration + 0.0105 * np.tanh(speed / 3.0) + 2.2e-5 * speed
    effort += 0.002 * np.sin(pos / 66.0 * 2.0) * np.tanh(speed / 3.0)
    current = np.where(on, effort / 0.0136 * 1e3 + rng.normal(0.0, 28.0, n), 0.0)
    demand = np.where(on, current + rng.normal(0.0, 25.0, n), 0.0)
    inc = pos / (2.0 * np.pi) * 4096.0 + rng.normal(0.0, 0.5, n)
    want = np.where(on, np.interp(motor + 0.008, t, ref[:, 0]) / (2.0 * np.pi) * 4096.0, 0.0)
    rpm = np.where(on, speed * 60.0 / (2.0 * np.pi) + rng.normal(0.0, 6.0, n), 0.0)
    torque = np.where(on, np.where(current < 0, 1.75, 0.002) + rng.integers(-2, 4, n) * 1e-3, 0.0)
    columns = [
        *(["-3276.8"] * n for _ in range(3)),
        _ints(3056 + rng.normal(0.0, 1.0, n)),
        _ints(2461 + rng.normal(0.0, 3.0, n)),
        _ints(sensor),
        _ints(np.trunc(pos / 66.0 * 1800.0 / np.pi)),
        _cells(16.3 - 0.1 * (np.abs(current) > 900), "%.1f"),
        _short(torque, 3),
        _ints(inc),
        _ints(want),
        _ints(current),
        _ints(demand),
        _ints(rpm),
        _ints(stamp),
    ]
    _save(path, [EPFL, *_lines(columns, ";")])


EPFL_LAYOUT = Layout(
    "epfl-valve-epos",
    "github.com/EPFLRocketTeam/PropulsionSoftware python/test0.csv (read): header, units, order, semicolons, "
    "-3276.8 for missing temperatures, 4096 inc a motor turn, gear 66:1 to motor_pos, demand/current/velocity 0 "
    "while disabled, senseless motor_torque (0.002 or 1.75), irregular stamps and repeated motor_time exact; "
    "moves made up and slower (source up to 6000 rpm), 60 s instead of 12 s.",
    ".csv",
    "rotary axis",
    _epfl,
    {
        **dict.fromkeys(EPFL.split(";"), NO),
        "sensor_time [ms]": Truth("time", "", "ms"),
        "motor_time [ms]": Truth("time", "", "ms"),
        "motor_pos [0.1 deg]": Truth("position"),
        "motor_position [inc]": Truth("position"),
        "motor_position_demand [inc]": Truth("reference_position"),
        "motor_current [mA]": Truth("current", "", "mA"),
        "motor_current_demand [mA]": Truth("reference_torque", "", "mA"),
        "motor_velocity [rpm]": Truth("speed", "", "rpm"),
    },
    {
        "sensor_time [ms]": MAYBE,
        "motor_pos [0.1 deg]": MAYBE,
        "motor_position_demand [inc]": MAYBE,
        "motor_current_demand [mA]": MAYBE,
        "motor_torque [mN]": ("torque",),
    },
)


# KIT milling machine DMC 60H, 50 Hz table
MILL = (
    "Unnamed: 0,time,pos_x,pos_y,pos_z,pos_sp,cmd_pos_x,cmd_pos_y,cmd_pos_z,cmd_pos_sp,cmd_v_x,cmd_v_y,cmd_v_z,"
    "cmd_v_sp,cont_dev_x,cont_dev_y,cont_dev_z,cont_dev_sp,v_x,a_x,v_y,a_y,v_z,a_z,v_sp,a_sp,time_diff,f_x,f_y,f_z,a_p,a_e,phi,"
    "curr_x,curr_y,curr_z,curr_sp,f_x_sim,f_y_sim,f_z_sim,f_sp_sim,materialremoved_sim"
)


def _mill_path(rng: Rng, dt: float) -> tuple[Array, Array]:
    """Return the reference of x, y, z [mm] and whether the tool cuts."""
    at = np.array([-47.5, 209.5, 402.2])
    parts, cuts = [np.tile(at, (round(0.6 / dt), 1))], [np.zeros(round(0.6 / dt))]

    def go(goal: Sequence[float], speed: float, cut: bool) -> None:
        nonlocal at
        goal = np.asarray(goal, float)
        far = float(np.linalg.norm(goal - at))
        if far < 1e-6:
            return
        s = plan([(1.0, speed / far, 900.0 / far, 0.1)], 0.0, dt, 0.04)[: -round(0.6 / dt)]
        parts.append(at + (goal - at) * s[:, None])
        moving = np.gradient(s, dt) * far > 0.5 * speed
        cuts.append(moving.astype(float) * cut)
        at = goal

    y = 209.5
    for k in range(4):
        feed = rng.uniform(11.0, 22.0)
        depth = 380.0 - 1.5 * k
        go([-47.5, y, 402.2], 160.0, False)
        go([-47.5, y, depth], 120.0, False)
        go([12.0 + rng.uniform(-4, 4), y, depth], feed, True)
        go([at[0], y - 24.0, depth], feed, True)
        go([-30.0, y - 24.0, depth], feed, True)
        go([at[0], at[1], 402.2], 140.0, False)
        y -= rng.uniform(-6.0, 9.0)
    return np.concatenate(parts), np.concatenate(cuts)


def _mill(path: Path, rng: Rng) -> None:
    dt = 0.002
    ref, cut = _mill_path(rng, dt)
    keep = min(len(ref), round(58.0 / dt))
    ref, cut = ref[:keep], cut[:keep]
    q, v, a = follow(ref, dt, 61.0)
    t = np.arange(keep) * dt
    spin_ref = 22800.0 * np.clip(t / 0.5, 0.0, 1.0)
    spin = low_pass(spin_ref, dt, 4.0)
    phase = 70651.0 + np.cumsum(spin) * dt
    direction = v / np.maximum(np.linalg.norm(v, axis=1), 1e-3)[:, None]
    # cutting forces in kN: along the feed, across, and up
    size = low_pass(cut, dt, 3.0) * np.linalg.norm(v, axis=1) / 20.0
    ripple = 1.0 + 0.25 * np.sin(np.deg2rad(phase) * 4.0)
    force = 0.28 * direction * (size * ripple)[:, None]
    force += 0.11 * (size * ripple)[:, None] * np.column_stack([-direction[:, 1], direction[:, 0], 0.5 + 0.0 * size])
    mass, coulomb, viscous = np.array([9.5, 8.0, 7.0]), np.array([2.6, 2.9, 2.2]), np.array([0.012, 0.012, 0.014])
    current = mass * a / 1e3 + coulomb * np.tanh(v / 0.8) + viscous * v + np.array([0.0, -5.68, 0.0]) + 9.0 * force
    times = np.arange(0.0, t[-1], 0.02)
    n = len(times)

    def at(values: Array) -> Array:
        return _sampled(t, values, times)

    pos, speed, acc, com = at(q), at(v), at(a), at(ref)
    com_v = at(np.gradient(ref, dt, axis=0))
    amps, f = at(current) + rng.normal(0.0, 0.05, (n, 3)), at(force) + rng.normal(0.0, 0.004, (n, 3)) + 0.004
    sp, sp_v = at(phase), at(spin)
    sp_a = at(np.gradient(spin, dt)) + rng.normal(0.0, 180.0, n)
    cutting = at(cut) * np.linalg.norm(speed, axis=1) / 20.0
    curr_sp = -0.6 + 0.0004 * at(np.gradient(spin, dt)) + 3.4 * at(size) + rng.normal(0.0, 0.03, n)
    sim = at(0.9 * force) * (cutting[:, None] > 0.02)
    values = [
        times + 4.28,
        *(pos + rng.normal(0.0, 5e-5, pos.shape)).T,
        sp,
        *com.T,
        at(70765.9 + np.cumsum(spin_ref) * dt),
        *(com_v + rng.normal(0.0, 2e-3, com_v.shape)).T,
        at(spin_ref),
        *(com_v * 4e-5 + rng.normal(0.0, 5e-5, com_v.shape)).T,
        np.zeros(n),
        speed[:, 0] + rng.normal(0.0, 0.025, n),
        acc[:, 0] + rng.normal(0.0, 5.0, n),
        speed[:, 1] + rng.normal(0.0, 0.018, n),
        acc[:, 1] + rng.normal(0.0, 5.0, n),
        speed[:, 2] + rng.normal(0.0, 0.014, n),
        acc[:, 2] + rng.normal(0.0, 4.5, n),
        sp_v + rng.normal(0.0, 0.6, n),
        sp_a,
        np.full(n, 0.002),
        *f.T,
        np.full(n, 3.0),
        np.full(n, 10.0),
        np.full(n, 180.0),
        *amps.T,
        curr_sp,
        *sim.T,
        0.05 * np.linalg.norm(sim, axis=1),
        cutting * 0.6,
    ]
    columns = [[str(214 + i) for i in range(n)], *(_cells(column, "%.13g") for column in values)]
    _save(path, [MILL, *_lines(columns, ",")])


def _mill_truth() -> tuple[dict[str, Truth], dict[str, tuple[str, ...]]]:
    truth = dict.fromkeys(MILL.split(","), NO)
    truth["time"] = Truth("time", "", "s")
    accept: dict[str, tuple[str, ...]] = {f"f_{k}": ("force",) for k in "xyz"}
    for k in ("x", "y", "z", "sp"):
        for name, channel in (("pos", "position"), ("v", "speed"), ("a", "acceleration"), ("curr", "current")):
            truth[f"{name}_{k}"] = Truth(channel, k)
            if k == "sp":
                accept[f"{name}_{k}"] = MAYBE
        truth[f"cmd_pos_{k}"], truth[f"cmd_v_{k}"] = Truth("reference_position", k), Truth("reference_speed", k)
        accept[f"cmd_pos_{k}"] = accept[f"cmd_v_{k}"] = MAYBE
    return truth, accept


MILL_LAYOUT = Layout(
    "kit-dmc60h-50hz",
    "github.com/EnKJneer/Masters-thesis Data/DMC_AL2007T4_Gear_Depth_1.csv (read; from the KIT data set of a DMC "
    "60H): header, order, first column, start 4.28 s at 50 Hz, mm, mm/s, mm/s^2, spindle in deg and deg/s at "
    "22800, ranges and noise of currents (y holds the weight), forces in kN, simulated and constant columns "
    "exact; tool path, currents and forces made up, feed 2-4 times faster.",
    ".csv",
    "robot",
    _mill,
    *_mill_truth(),
)


# DFKI double pendulum
DFKI = (
    "time,pos_meas1,pos_meas2,vel_meas1,vel_meas2,pos_filt1,pos_filt2,vel_filt1,vel_filt2,tau_con1,tau_con2,tau_fric1,"
    "tau_fric2,tau_meas1,tau_meas2"
)


def _dfki(path: Path, rng: Rng) -> None:
    steps = np.full(7600, 0.0020001) + np.abs(rng.normal(0.0, 2e-6, 7600))
    steps[:7] = rng.uniform(0.0029, 0.0036, 7)
    time = np.concatenate([[0.0], np.cumsum(steps)])
    dt = 0.001
    t = np.arange(0.0, time[-1] + 0.2, dt)
    swell = np.clip((t - 0.4) / 2.0, 0.0, 1.0) * (1.0 - _bump(t, 7.6, 1.2)) * np.clip((t[-1] - 1.2 - t) / 1.5, 0.0, 1.0)
    f = rng.uniform(0.9, 1.1, 4)
    ref = np.column_stack(
        [
            swell * (1.1 * np.sin(2 * np.pi * 0.33 * f[0] * t) + 0.5 * np.sin(2 * np.pi * 0.71 * f[1] * t + 1.0)),
            swell * (1.3 * np.sin(2 * np.pi * 0.45 * f[2] * t + 2.0) - 0.4 * np.sin(2 * np.pi * 0.95 * f[3] * t)),
        ]
    )
    ref -= ref[0]
    q, v, a = follow(ref, dt, 40.0)
    tau = arm_torque(
        q, v, a, inertia=(0.058, 0.019), coulomb=(0.093, 0.078), viscous=(0.004, 0.006), lift=0, elbow=1,
        moments=(1.55, 0.95), coupling=0.026,
    )  # fmt: skip
    tau[:, 0] += 0.6 * _bump(t, 11.0, 0.12)
    q, v, tau = (_sampled(t, s, time) for s in (q, v, tau))
    n = len(time)
    pos = (np.floor(q / 3.8147554e-4) + 0.5) * 3.8147554e-4
    vel = quantised(v + rng.normal(0.0, 0.05, (n, 2)), 0.032967033) + 0.0055
    meas = quantised(tau + rng.normal(0.0, 0.02, (n, 2)), 0.0058608) + 0.00293
    command = tau + 0.02 * np.column_stack([np.sin(9.0 * time), np.cos(7.0 * time)]) + rng.normal(0.0, 0.004, (n, 2))
    values = [time, *pos.T, *vel.T, *pos.T, *vel.T, *command.T, np.zeros(n), np.zeros(n), *meas.T]
    _save(path, [DFKI, *_lines([_cells(column, "%.18e") for column in values], ",")])


DFKI_LAYOUT = Layout(
    "dfki-double-pendulum",
    "github.com/dfki-ric-underactuated-lab/double_pendulum "
    "data/experiment_records/design_A.0/20220815/sys_id/trajectory_03.csv (read) and its docs: header, %.18e, "
    "about 500 Hz with slow first steps, steps of position, speed and torque, filtered = measured, zero friction "
    "columns exact; motion and pendulum made up.",
    ".csv",
    "robot",
    _dfki,
    {
        "time": Truth("time", "", "s"),
        **{f"pos_{k}{j}": Truth("position", j, "rad") for k in ("meas", "filt") for j in "12"},
        **{f"vel_{k}{j}": Truth("speed", j, "rad/s") for k in ("meas", "filt") for j in "12"},
        **{f"tau_con{j}": Truth("reference_torque", j) for j in "12"},
        **{f"tau_fric{j}": NO for j in "12"},
        **{f"tau_meas{j}": Truth("torque", j) for j in "12"},
    },
    {f"{k}{j}": MAYBE for k in ("pos_filt", "vel_filt", "tau_con") for j in "12"},
)


# hexapod leg
HEX = (
    "timestamp,joint_hip_pos,joint_knee_pos,joint_ankle_pos,joint_hip_vel,joint_knee_vel,joint_ankle_vel,"
    "joint_hip_target,joint_knee_target,joint_ankle_target,joint_hip_target_vel,joint_knee_target_vel,"
    "joint_ankle_target_vel,ee_pos_x,ee_pos_y,ee_pos_z,ee_vel_x,ee_vel_y,ee_vel_z,ee_target_x,ee_target_y,ee_target_z,"
    "ee_target_vel_x,ee_target_vel_y,ee_target_vel_z"
)


def _foot(q: Array) -> Array:
    reach = 0.052 + 0.066 * np.cos(q[:, 1]) + 0.133 * np.cos(q[:, 1] + q[:, 2])
    high = 0.066 * np.sin(q[:, 1]) + 0.133 * np.sin(q[:, 1] + q[:, 2])
    return np.column_stack([reach * np.cos(q[:, 0]), reach * np.sin(q[:, 0]), high])


def _hexapod(path: Path, rng: Rng) -> None:
    dt = 0.002
    t = np.arange(0.0, 42.0, dt)
    walk = np.zeros_like(t)
    for begin, end, way in ((1.5, 11.0, 1.0), (13.0, 22.0, -1.0), (24.0, 32.0, 0.6), (34.0, 40.5, -0.8)):
        walk += way * ((t > begin) & (t < end))
    walk = low_pass(walk, dt, 0.8)
    phase = np.cumsum(walk * 2.0 * np.pi * 0.5 * rng.uniform(0.9, 1.1)) * dt
    size = np.clip(np.abs(walk) * 1.6, 0.0, 1.0)
    lift = np.maximum(np.sin(phase), 0.0) ** 2
    ref = np.column_stack(
        [
            0.35 * size * np.cos(phase),
            0.35 + 0.45 * size * lift,
            -1.25 - 0.3 * size * lift + 0.12 * size * np.cos(phase),
        ]
    )
    q, v, _ = follow(ref, dt, 30.0)
    ref_v = np.gradient(ref, dt, axis=0)
    foot, goal = _foot(q), _foot(ref)
    times = np.arange(0.0, 42.0 - 0.05, 0.02) + rng.uniform(0.0, 0.002, len(np.arange(0.0, 42.0 - 0.05, 0.02)))

    def at(values: Array) -> Array:
        return _sampled(t, values, times)

    n = len(times)
    values = [
        *(at(q) + rng.normal(0.0, 2e-4, (n, 3))).T,
        *(at(v) + rng.normal(0.0, 4e-3, (n, 3))).T,
        *at(ref).T,
        *at(ref_v).T,
        *at(foot).T,
        *at(np.gradient(foot, dt, axis=0)).T,
        *at(goal).T,
        *at(np.gradient(goal, dt, axis=0)).T,
    ]
    columns = [_short(times + 31.42, 6), *(_short(column, 15) for column in values)]
    _save(path, [HEX, *_lines(columns, ",")], "\r\n")


HEX_LAYOUT = Layout(
    "hexapod-leg-logger",
    "data_logger.py of a ROS 2 hexapod and its guide: header and order of the leg file, 50 Hz, rad, csv line ends "
    "exact; gait, lag, stamps (simulated clock) and noise made up.",
    ".csv",
    "robot",
    _hexapod,
    {
        **dict.fromkeys(HEX.split(","), NO),
        "timestamp": Truth("time", "", "s"),
        **{f"joint_{j}_pos": Truth("position", j, "rad") for j in ("hip", "knee", "ankle")},
        **{f"joint_{j}_vel": Truth("speed", j, "rad/s") for j in ("hip", "knee", "ankle")},
        **{f"joint_{j}_target": Truth("reference_position", j, "rad") for j in ("hip", "knee", "ankle")},
        **{f"joint_{j}_target_vel": Truth("reference_speed", j, "rad/s") for j in ("hip", "knee", "ankle")},
    },
    {f"joint_{j}_{k}": MAYBE for j in ("hip", "knee", "ankle") for k in ("target", "target_vel")},
)


# OpenMANIPULATOR-X
OMX = ("joint1", "joint2", "joint3", "joint4", "gripper_left_joint")


def _omx(path: Path, rng: Rng) -> None:
    dt = 0.002
    points = [np.array([0.0, -1.0, 0.7, 0.3])]
    for _ in range(11):
        points.append(np.array([0.0, -0.4, 0.35, 0.5]) + rng.uniform(-1, 1, 4) * np.array([1.2, 0.6, 0.6, 0.7]))
    ref = poses(points, rng.uniform(0.6, 1.3, 11), rng.uniform(0.2, 0.9, 11), dt, 3.0, 0.06)
    q, v, a = follow(ref, dt, 35.0)
    n = len(q)
    t = np.arange(n) * dt
    tau = arm_torque(
        q, v, a, inertia=(0.02, 0.02, 0.012, 0.004), coulomb=(0.06, 0.08, 0.07, 0.05), viscous=(0.05, 0.05, 0.04, 0.03),
        lift=1, elbow=2, moments=(1.05, 0.5), coupling=0.005, wrist=(3, 0.14),
    )  # fmt: skip
    hit = rng.uniform(0.45, 0.6) * t[-1]
    tau[:, 0] += 0.45 * _bump(t, hit, 0.15)
    tau[:, 1] -= 0.5 * _bump(t, hit, 0.15)
    # the gripper closes on a part of which the jaw stops at 4 mm
    grip_ref = np.full(n, 0.019)
    for begin, end in ((0.12, 0.3), (0.45, 0.62), (0.75, 0.9)):
        grip_ref[int(begin * n) : int(end * n)] = -0.01
    grip_ref = low_pass(grip_ref, dt, 0.9)
    grip = np.maximum(grip_ref, 0.004)
    grip_v = np.gradient(grip, dt)
    squeeze = (grip - grip_ref) * 14.0
    grip_tau = 0.05 * np.tanh(grip_v / 0.002) - squeeze
    times = np.arange(0.0, t[-1], 0.01)
    times = times + np.abs(rng.normal(0.0, 4e-4, len(times)))
    pos = quantised(_sampled(t, np.column_stack([q, grip]), times), np.array([np.pi / 2048] * 4 + [2.3e-5]))
    speed = _sampled(t, np.column_stack([v, grip_v]), times)
    speed = quantised(
        speed + rng.normal(0.0, 1.0, speed.shape) * ([4e-3] * 4 + [3e-4]), np.array([0.0239808] * 4 + [3.6e-4])
    )
    # current of the XM430 in steps of 2.69 mA
    effort = _sampled(t, np.column_stack([tau, grip_tau]), times) / 1.78e-3
    effort = quantised(effort + rng.normal(0.0, 3.0, effort.shape), 2.69)
    header = ["t", *(f"{j}_pos" for j in OMX), *(f"{j}_vel" for j in OMX), *(f"{j}_eff" for j in OMX)]
    columns = [
        _short(times + 0.0123, 12),
        *(_short(s, 16) for s in pos.T),
        *(_short(s, 16) for s in speed.T),
        *(_short(s, 2) for s in effort.T),
    ]
    _save(path, [",".join(header), *_lines(columns, ",")], "\r\n")


OMX_LAYOUT = Layout(
    "omx-joint-log",
    'github.com/mekala-2405/omx_ws_back src/omx_demos/omx_log_joint_states.py: t and <joint>_pos, _vel, _eff of '
    'all joints of the message, seconds from the start, csv line ends exact; joint names of the OpenMANIPULATOR-X '
    'description, steps of the XM430 (pi/2048 rad, 0.229 rpm, 2.69 mA) from its manual; motion, 100 Hz, a push '
    'and grasps made up.',
    ".csv",
    "robot",
    _omx,
    {
        "t": Truth("time", "", "s"),
        **{f"{j}_pos": Truth("position", j, "rad" if "gripper" not in j else "") for j in OMX},
        **{f"{j}_vel": Truth("speed", j, "rad/s" if "gripper" not in j else "") for j in OMX},
        **{f"{j}_eff": Truth("torque", j) for j in OMX},
    },
    {f"gripper_left_joint_{k}": MAYBE for k in ("pos", "vel", "eff")} | {f"{j}_eff": ("current",) for j in OMX[:4]}
    | {"gripper_left_joint_eff": ("current", "")},
)  # fmt: skip


# Franka with a load cell on a serial line
FRANKA = [
    "time", "trial", "encoder_deg", "force", "ee_x", "ee_y", "ee_z", "K_y", "delay_jacobian", "delay_cartesian",
    "noise_jacobian", "noise_cartesian", *(f"joint_pos_{i}" for i in range(7)), *(f"joint_eff_{i}" for i in range(7)),
    "force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z",
]  # fmt: skip


def _franka(path: Path, rng: Rng) -> None:
    dt = 0.002
    home = np.array([0.0, -0.55, 0.05, -2.1, 0.02, 1.6, 0.8])
    points = [home]
    for k in range(9):
        points.append(home + rng.uniform(-1, 1, 7) * np.array([0.6, 0.35, 0.35, 0.45, 0.4, 0.4, 0.5]) * (k % 3 != 2))
    ref = poses(points, rng.uniform(0.35, 0.7, 9), rng.uniform(0.4, 1.2, 9), dt, 1.6, 0.1)
    q, v, a = follow(ref, dt, 25.0)
    n = len(q)
    t = np.arange(n) * dt
    tau = arm_torque(
        q, v, a, inertia=(1.6, 1.9, 0.7, 0.9, 0.06, 0.07, 0.02), coulomb=(0.55, 0.6, 0.5, 0.5, 0.35, 0.3, 0.3),
        viscous=(0.4, 0.4, 0.3, 0.3, 0.15, 0.15, 0.1), lift=1, elbow=3, moments=(-33.0, -16.0), coupling=0.35,
        wrist=(5, 2.1),
    )  # fmt: skip
    press = np.zeros(n)
    for k, share in enumerate((0.25, 0.5, 0.72, 0.88)):
        press += rng.uniform(12.0, 32.0) * _bump(t, (share + rng.uniform(-0.04, 0.04)) * t[-1], 0.35 + 0.1 * (k % 2))
    lever = np.array([0.45, 0.12, 0.33, 0.2, 0.1, 0.08, 0.02])
    tau += press[:, None] * lever
    times = np.arange(0.0, t[-1], 0.01)
    times = times + rng.uniform(0.0, 6e-4, len(times))
    m = len(times)
    pos = _sampled(t, q, times) + rng.normal(0.0, 3e-6, (m, 7))
    effort = _sampled(t, tau, times) + rng.normal(0.0, 0.06, (m, 7))
    # the load cell comes with about 12 values per second over the serial line; the encoder is that of the handle
    late = np.floor(times / 0.0833) * 0.0833
    force = np.round(np.interp(late, t, press) + rng.normal(0.0, 0.12, m)[np.searchsorted(times, late)], 2)
    handle = np.round(np.interp(late, t, low_pass(press, dt, 0.4)) * 0.7 / 0.088) * 0.088
    reach = np.column_stack(
        [
            0.45 + 0.25 * np.sin(pos[:, 1]) + 0.1 * np.cos(pos[:, 3]),
            0.5 * np.sin(pos[:, 0]),
            0.5 + 0.2 * np.cos(pos[:, 1]) - 0.2 * np.sin(pos[:, 3]),
        ]
    )
    push = np.interp(times, t, press)
    wrench = np.column_stack([0.15 * push, -0.95 * push, 0.1 * push, 0.02 * push, 0.03 * push, 0.01 * push])
    drift = np.array([0.9, 0.7, 1.2, 0.2, 0.2, 0.1])
    wrench += drift * np.sin(np.outer(times, [0.3, 0.4, 0.25, 0.5, 0.45, 0.35])) + rng.normal(0, 0.15, (m, 6)) * drift
    columns = [
        _cells(times + 1.7181e9 + 0.1317, "%.7f"),
        ["3"] * m,
        _short(handle, 3),
        _short(force, 2),
        *(_short(s, 16) for s in reach.T),
        *([[value] * m for value in ("200.0", "0", "0", "0.0", "0.0")]),
        *(_short(s, 16) for s in pos.T),
        *(_short(s, 15) for s in effort.T),
        *(_short(s, 15) for s in wrench.T),
    ]
    _save(path, [",".join(FRANKA), *_lines(columns, ",")], "\r\n")


FRANKA_LAYOUT = Layout(
    "franka-load-cell-logger",
    "FrankaSensorLogger of a ROS node of IIT Gandhinagar: header, order, epoch seconds, constants of the trial, "
    "load cell and encoder from a serial line beside joint states and F_ext exact; motion, pushes, 100 Hz, 12 Hz "
    "of the serial values and all numbers made up.",
    ".csv",
    "robot",
    _franka,
    {
        **dict.fromkeys(FRANKA, NO),
        "time": Truth("time", "", "s"),
        "force": Truth("force"),
        **{f"joint_pos_{i}": Truth("position", str(i), "rad") for i in range(7)},
        **{f"joint_eff_{i}": Truth("torque", str(i)) for i in range(7)},
    },
)


# arm support robot, no header
def _arm_support(path: Path, rng: Rng) -> None:
    dt = 0.002
    points = [np.array([0.2, 0.1, 1.1])]
    for _ in range(14):
        points.append(np.array([0.3, 0.05, 1.2]) + rng.uniform(-1, 1, 3) * np.array([0.9, 0.35, 0.7]))
    goal = poses(points, rng.uniform(0.4, 0.9, 14), rng.uniform(0.2, 0.7, 14), dt, 1.5, 0.25)[: round(55.0 / dt)]
    q, v, _ = follow(goal, dt, 14.0)
    goal_v = np.gradient(goal, dt, axis=0)
    across = 0.419 * np.cos(goal[:, 0]) * np.cos(goal[:, 1]) + 0.52 * np.cos(goal[:, 0] + goal[:, 2])
    along = 0.419 * np.sin(goal[:, 0]) * np.cos(goal[:, 1]) + 0.52 * np.sin(goal[:, 0] + goal[:, 2])
    xyz = np.column_stack([across, along, 0.419 * np.sin(goal[:, 1])])
    uvw = np.gradient(xyz, dt, axis=0)
    # the admittance model turns the force of the hand into the motion of the goal
    force = 5.0 * np.gradient(uvw, dt, axis=0) + 25.0 * uvw
    t = np.arange(len(goal)) * dt
    ticks = np.cumsum(rng.choice([8, 9], round(t[-1] / 0.0085), p=[0.9, 0.1]))
    ticks = ticks[ticks / 1e3 < t[-1]]
    times = ticks / 1e3

    def at(values: Array, noise: float) -> Array:
        sampled = _sampled(t, values, times)
        return sampled + rng.normal(0.0, noise, sampled.shape)

    values = [
        *at(force, 0.12).T,
        *at(q, 0.0008).T,
        *at(v, 0.008).T,
        *at(xyz, 0.0).T,
        *at(uvw, 0.0).T,
        *at(goal, 0.0).T,
        *at(goal_v, 0.0).T,
    ]
    columns = [_ints(ticks + 2000), *(_cells(s, "%.2f") for s in values), _ints(np.diff(ticks, prepend=ticks[0] - 8))]
    _save(path, _lines(columns, "\t"), "\r\n")


ARM_SUPPORT_LAYOUT = Layout(
    "arm-support-serial",
    "UtilityFunctions.cpp of Erick Nunez' arm support robot: the packet reference [time, F, q, qDot, xyz, uvw, Q, "
    "QDot, dT], tabs, no header, CR LF, two decimals of Serial.print exact (the versions of the code print "
    "subsets of it); milliseconds, 8 ms, motion and admittance made up.",
    ".txt",
    "robot",
    _arm_support,
    {
        "0": Truth("time", "", "ms"),
        **{str(1 + i): NO for i in range(3)},
        **{str(4 + i): Truth("position", str(i + 1), "rad") for i in range(3)},
        **{str(7 + i): Truth("speed", str(i + 1), "rad/s") for i in range(3)},
        **{str(10 + i): NO for i in range(6)},
        **{str(16 + i): Truth("reference_position", str(i + 1), "rad") for i in range(3)},
        **{str(19 + i): Truth("reference_speed", str(i + 1), "rad/s") for i in range(3)},
        "22": NO,
    },
    {**{str(1 + i): ("force",) for i in range(3)}, **{str(16 + i): MAYBE for i in range(6)}},
)


# camber actuator, no header
def _camber(path: Path, rng: Rng) -> None:
    dt = 0.0005
    moves, _at, targets = [], 0.0, []
    for k in range(30):
        target = (4.99e-3 if k % 2 == 0 else -5.0e-3) * (1.0 if k < 14 else rng.uniform(0.3, 1.0))
        targets.append(target)
        moves.append((target, 0.038, 0.19, 0.02 if k else 0.0))
    demand, square = [], []
    where = 0.0
    for (target, speed, ramp, _), goal in zip(moves, targets, strict=True):
        part = plan([(target, speed, ramp, 0.01)], where, dt, 0.01)
        part = np.concatenate([part, np.full(max(round(1.0 / dt) - len(part), 0), target)])
        demand.append(part)
        square.append(np.full(len(part), goal))
        where = target
    ref, goal = np.concatenate(demand), np.concatenate(square)
    run = axis(
        ref, dt, inertia=10.0, coulomb=16.0, viscous=120.0, gravity=0.0, bandwidth=90.0, lead=0.97, stiction=0.001
    )
    times = np.arange(0.0, run.t[-1], 0.01)
    s = run.at(times)
    n = len(times)
    wanted = np.interp(times, np.arange(len(goal)) * dt, goal) * 1e3
    load = 2.5e3 * (s.x + 0.001)
    current = (s.drive + load) * 24.0 + rng.normal(0.0, 110.0, n)
    speed = s.v * 1e3 + rng.normal(0.0, 1.3, n)
    columns = [_ints(times * 1e3)]
    for values in (quantised(wanted, 0.01), s.xr * 1e3, s.x * 1e3 + rng.normal(0.0, 0.008, n), speed):
        columns.append(["%g" % (round(value, 2) + 0.0) for value in values.tolist()])
    columns.append(_ints(current))
    _save(path, _lines(columns, "\t"))


CAMBER_LAYOUT = Layout(
    "camber-control-linear",
    "github.com/nicolazande/camber-control actuators/LinA/data/pp-square-wave-10mm-0.5Hz.txt (read) and "
    "get_experiment.m for the names: time [ms], target position, position demand, actual position [mm], actual "
    "speed [mm/s], current [mA]; tabs, no header, 10 ms, two decimals, square wave of +-5 mm exact; later "
    "amplitudes, spring load and friction made up, less limit cycle than the source.",
    ".txt",
    "linear axis",
    _camber,
    {
        "0": Truth("time", "", "ms"),
        "1": Truth("reference_position"),
        "2": Truth("reference_position"),
        "3": Truth("position"),
        "4": Truth("speed"),
        "5": Truth("current"),
    },
    {"1": MAYBE, "2": MAYBE},
)


# VIFCON: lift drive of a crystal growth machine, German
VIFCON = "time_abs,time_rel,Position,Geschwindigkeit,Soll-Geschwindigkeit,Soll-Position,max.Pos.,min.Pos,"


def _vifcon(path: Path, rng: Rng) -> None:
    dt = 0.01
    moves, at = [], 12.0
    for _k in range(14):
        target = rng.uniform(2.0, 25.0)
        if abs(target - at) < 3.0:
            target = at + 6.0 if at < 14.0 else at - 6.0
        speed = rng.uniform(0.9, 2.0)
        moves.append((target, speed, 2.5, rng.uniform(0.8, 2.0)))
        at = target
    ref = plan(moves, 12.0, dt, 0.2)[: round(60.0 / dt)]
    x, v, _ = (s[:, 0] for s in follow(ref[:, None], dt, 12.0))
    t = np.arange(len(ref)) * dt
    wanted = np.gradient(ref, dt)
    times = np.arange(0.0, min(t[-1], 59.9), 0.15)
    times = times + np.abs(rng.normal(0.0, 0.006, len(times)))
    start = datetime.datetime(2024, 7, 16, 10, 12, 1, 254000, datetime.timezone(datetime.timedelta(hours=2)))
    stamps = [
        (start + datetime.timedelta(seconds=s)).isoformat(sep=" ", timespec="milliseconds") for s in times.tolist()
    ]
    n = len(times)
    position = np.interp(times, t, x) + rng.normal(0.0, 0.002, n)
    speed = np.interp(times, t, v) * 60.0 + rng.normal(0.0, 0.15, n)
    columns = [
        stamps,
        _short(times, 3),
        _short(position, 3),
        _short(speed, 2),
        _short(np.interp(times, t, wanted) * 60.0, 2),
        _short(np.interp(times, t, ref), 3),
        ["40.0"] * n,
        ["-5.0"] * n,
    ]
    _save(path, ["# datetime,s,mm,mm/min,mm/min,mm,mm,mm", VIFCON, *(line + "," for line in _lines(columns, ","))])


VIFCON_LAYOUT = Layout(
    "vifcon-nemo-hubachse",
    "VIFCON of the IKZ Berlin, nemoAchseLin.py: the line of units with #, the German header with its trailing "
    "comma, the order of the values exact; the form of time_abs, the trailing comma of the rows, 0.15 s interval, "
    "moves and noise made up.",
    ".csv",
    "linear axis",
    _vifcon,
    {
        "time_abs": Truth("time"),
        "time_rel": Truth("time", "", "s"),
        "Position": Truth("position", "", "mm"),
        "Geschwindigkeit": Truth("speed", "", "mm/min"),
        "Soll-Geschwindigkeit": Truth("reference_speed", "", "mm/min"),
        "Soll-Position": Truth("reference_position", "", "mm"),
        "max.Pos.": NO,
        "min.Pos": NO,
    },
    {"time_abs": MAYBE, "Soll-Geschwindigkeit": MAYBE, "Soll-Position": MAYBE},
)


# servo press, Chinese
PRESS = "序号,时间(s),位移(mm),速度(mm/s),压力(kN),电机转矩(%),设定位置(mm),电机温度(℃),报警代码"


def _press(path: Path, rng: Rng) -> None:
    dt = 0.001
    moves, begins = [], []
    for _ in range(6):
        depth = rng.uniform(146.5, 149.5)
        moves += [
            (130.0, rng.uniform(90.0, 130.0), 600.0, rng.uniform(0.5, 1.0)),
            (depth, rng.uniform(8.0, 16.0), 150.0, 0.05),
            (20.0, rng.uniform(110.0, 160.0), 700.0, rng.uniform(0.4, 0.8)),
        ]
        begins.append(depth)
    ref = plan(moves, 20.0, dt, 0.04)[: round(40.0 / dt)]
    x, v, a = (s[:, 0] for s in follow(ref[:, None], dt, 50.0))
    # the part yields above 8 kN and springs back when the ram leaves
    contact = 138.0 + rng.uniform(-0.4, 0.4)
    force, rest = np.zeros_like(x), contact
    for i, here in enumerate(x.tolist()):
        if here < 60.0:
            rest = contact
        deep = here - rest
        if deep > 0.0:
            press = 1.9 * deep
            limit = 8.0 + 1.1 * (here - contact)
            if press > limit:
                rest = here - limit / 1.9
                press = limit
            force[i] = press
    torque = 0.012 * a + 5.5 * np.tanh(v / 1.5) + 0.03 * v + 4.2 * force - 2.5
    times = np.arange(0.0, len(x) * dt - dt, 0.005)
    t = np.arange(len(x)) * dt
    n = len(times)

    def at(values: Array) -> Array:
        return np.interp(times, t, values)

    columns = [
        [str(i + 1) for i in range(n)],
        _cells(times, "%.3f"),
        _cells(at(x) + rng.normal(0.0, 0.001, n), "%.3f"),
        _cells(at(v) + rng.normal(0.0, 0.12, n), "%.2f"),
        _cells(quantised(at(force) + rng.normal(0.0, 0.012, n) + 0.02, 0.005), "%.3f"),
        _cells(at(torque) + rng.normal(0.0, 0.35, n), "%.1f"),
        _cells(at(ref), "%.3f"),
        _cells(38.0 + 0.03 * times + 0.1 * np.sin(times), "%.1f"),
        ["0"] * n,
    ]
    head = ["设备名称,伺服压机", "产品型号,ZB-20", "日期,2024/05/17 14:03:22", "采样周期,5ms"]
    _save(path, [*head, PRESS, *_lines(columns, ",")], "\r\n", "utf-8-sig")


PRESS_LAYOUT = Layout(
    "servo-press-chinese",
    "Composed: no public file. Words of Chinese servo press and data logger texts (Panasonic "
    "FPWIN infohub zh on CSV logs with comment lines and UTF-8; 相对时间,位置,速度,力 of a public train "
    "log; 位移, 压力, 转矩 of test machine manuals); layout, cycle, part and all values made up.",
    ".csv",
    "linear axis",
    _press,
    {
        "序号": NO,
        "时间(s)": Truth("time", "", "s"),
        "位移(mm)": Truth("position", "", "mm"),
        "速度(mm/s)": Truth("speed", "", "mm/s"),
        "压力(kN)": Truth("force", "", "kN"),
        "电机转矩(%)": Truth("torque", "", "%"),
        "设定位置(mm)": Truth("reference_position", "", "mm"),
        "电机温度(℃)": NO,
        "报警代码": NO,
    },
    {"设定位置(mm)": MAYBE},
)


# Thomson Electrak HD over CAN
ELECTRAK = (
    ",time,C position,C speed,C current max,F position,F pos check,F speed,F current,F voltage err,F temp err,F motion,"
    "F overload,F backdrive,F parameter,F saturation,F fatal err"
)


def _electrak(path: Path, rng: Rng) -> None:
    n = 560
    time = 0.23 + np.cumsum(rng.uniform(0.098, 0.111, n))
    wish = 150.0 + 100.0 * np.sin(2.0 * np.pi * time / rng.uniform(17.0, 21.0))
    dt = 0.005
    t = np.arange(0.0, time[-1] + 0.2, dt)
    command = np.interp(t, time, wish)
    hold = np.maximum.accumulate(np.where(np.diff(np.floor(t / 0.42), prepend=-1.0) > 0, np.arange(len(t)), 0))
    command = command[hold]
    x, v, going = 141.4, 0.0, 0
    out = np.empty((len(t), 3))
    pause = 0.0
    for i, goal in enumerate(command.tolist()):
        error = goal - x
        if going == 0 and abs(error) > 3.0 and t[i] > pause:
            going = 1 if error > 0 else -1
        elif going != 0 and going * error < 0.8:
            going, pause = 0, t[i] + 0.35
        aim = going * min(33.0, 8.0 + 3.0 * abs(error))
        step = (aim - v) / 0.06
        v += step * dt
        x += v * dt
        out[i] = x, v, step
    pos, speed, push = (np.interp(time, t, s) for s in out.T)
    # a spring load at the rod end and an obstacle for a while
    block = 1.8 * _bump(time, 34.0, 1.2)
    drive = (
        2.0 * np.tanh(speed / 1.5) + 0.018 * speed + 0.0016 * push + 0.004 * (pos - 60.0) * np.tanh(np.abs(speed) / 2.0)
    )
    drive += block * np.sign(speed)
    current = np.abs(drive) * (np.abs(speed) > 0.5) + np.abs(rng.normal(0.0, 0.06, n))
    running = np.abs(speed) > 1.0
    starts = np.flatnonzero(running & ~np.roll(running, 1))
    shown = np.where(np.abs(speed) > 25.0, 50, np.where(running, 35, 0))
    shown[starts] = 10
    current[starts[rng.random(len(starts)) < 0.15]] = 25.7
    check = np.repeat(np.interp(time[::4] * 0.7, time, 126.0 + 0.45 * np.cumsum(np.abs(speed)) * 0.03), 4)[:n]
    flags = [str(bool(value)) for value in (np.roll(running, 3) & ~running)]
    columns = [
        [str(i) for i in range(n)],
        _short(time, 6),
        _short(wish, 13),
        ["50"] * n,
        ["10"] * n,
        _short(quantised(pos + rng.normal(0.0, 0.05, n), 0.1), 1),
        _short(check, 13),
        _ints(shown.astype(float)),
        _short(quantised(current, 0.1), 1),
        ["0"] * n,
        ["0"] * n,
        *(["False"] * n for _ in range(3)),
        flags,
        *(["False"] * n for _ in range(2)),
    ]
    _save(path, [ELECTRAK, *_lines(columns, ",")])


ELECTRAK_LAYOUT = Layout(
    "electrak-hd-can",
    'github.com/collinbrake/electrakHDCAN log1/electrakhd_can_data_fields_2021-06-03_19h39m22s.csv (read): header '
    'with an empty first name, order, about 0.105 s, position in 0.1 mm steps, speed in percent without sign, '
    "current in 0.1 A without sign with lone spikes of 25.7, flags as True/False, staircase of 'F pos check' "
    'exact; motion, load and an obstacle made up, no dropped readings.',
    ".csv",
    "linear axis",
    _electrak,
    {
        **{name: NO for name in ELECTRAK.split(",") if name},
        "time": Truth("time", "", "s"),
        "C position": Truth("reference_position"),
        "F position": Truth("position"),
        "F current": Truth("current"),
    },
    {"C position": MAYBE, "C speed": ("reference_speed",), "F speed": ("speed",)},
)  # fmt: skip


# T-Motor AK80-9 by TMotorCANControl
TMOTOR = (
    "pi_time,output_angle,output_velocity,output_acceleration,current,output_torque,motor_angle,motor_velocity,"
    "motor_acceleration,motor_torque,mosfet_temperature"
)


def _tmotor(path: Path, rng: Rng) -> None:
    dt = 0.001
    moves = []
    for k in range(13):
        target = rng.uniform(-1.4, 1.4) if k < 12 else 0.0
        moves.append((target, rng.uniform(1.0, 3.5), rng.uniform(8.0, 20.0), rng.uniform(0.3, 1.0)))
    ref = plan(moves, 0.0, dt, 0.05)
    q, v, a = (s[:, 0] for s in follow(ref[:, None], dt, 40.0))
    t = np.arange(len(q)) * dt
    tau = 0.095 * a + 0.32 * np.tanh(v / 0.04) + 0.05 * v + 2.4 * np.sin(q)
    for share in (0.35, 0.63, 0.85):
        tau += rng.choice([-1.0, 1.0]) * rng.uniform(1.5, 3.0) * _bump(t, share * t[-1], 0.2)
    times = np.arange(0.0, t[-1], 0.005)
    times = times + np.abs(rng.normal(0.0, 6e-5, len(times)))
    n = len(times)
    pos = quantised(np.interp(times, t, q), 25.0 / 65535)
    speed = quantised(np.interp(times, t, v) + rng.normal(0.0, 0.02, n), 100.0 / 4095)
    torque = quantised(np.interp(times, t, tau) + rng.normal(0.0, 0.03, n), 36.0 / 4095)
    acceleration = np.diff(speed, prepend=speed[0]) / np.diff(times, prepend=times[0] - 0.005)
    amps = torque / (0.115 * 9.0)
    temperature = quantised(29.0 + 0.08 * times, 1.0)
    values = [
        times + 0.0042,
        pos,
        speed,
        acceleration,
        amps,
        torque,
        9.0 * pos,
        9.0 * speed,
        9.0 * acceleration,
        torque / 9.0,
    ]
    columns = [*(_short(s, 15) for s in values), _ints(temperature)]
    _save(path, [TMOTOR, *_lines(columns, ",")], "\r\n")


TMOTOR_LAYOUT = Layout(
    "tmotor-can-control",
    "github.com/neurobionics/TMotorCANControl (header written as ['pi_time'] + log_vars; names and order of the "
    'log functions read in a fork): names, steps of the MIT protocol of the AK80-9 (16 bit +-12.5 rad, 12 bit '
    '+-50 rad/s, +-18 N m), acceleration by differences, motor side = 9:1 exact; pendulum load, moves, pushes and '
    '200 Hz made up.',
    ".csv",
    "rotary axis",
    _tmotor,
    {
        "pi_time": Truth("time", "", "s"),
        "output_angle": Truth("position"),
        "output_velocity": Truth("speed"),
        "output_acceleration": Truth("acceleration"),
        "current": Truth("current"),
        "output_torque": Truth("torque"),
        "motor_angle": Truth("position"),
        "motor_velocity": Truth("speed"),
        "motor_acceleration": Truth("acceleration"),
        "motor_torque": Truth("torque"),
        "mosfet_temperature": NO,
    },
    dict.fromkeys(
        ("output_acceleration", "current", "motor_angle", "motor_velocity", "motor_acceleration", "motor_torque"), MAYBE
    ),
)  # fmt: skip


# ERICC robot, yaw axis, French, without time
def _ericc(path: Path, rng: Rng) -> None:
    dt = 0.0005
    moves = []
    for target in (30.0, 0.0, 45.0, -20.0, 10.0, 35.0, -5.0, 0.0):
        moves.append(
            (target + rng.uniform(-4, 4), rng.uniform(90.0, 120.0), rng.uniform(260.0, 420.0), rng.uniform(0.1, 0.4))
        )
    ref = plan(moves, 0.0, dt, 0.02)
    run = axis(
        ref, dt, inertia=0.0052, coulomb=0.26, viscous=0.0035, bandwidth=22.0, lead=0.85, limit=1.7, stiction=0.8
    )
    times = np.arange(0.0, run.t[-1], 0.004862)
    s = run.at(times)
    n = len(times)
    current = np.clip(s.drive + rng.normal(0.0, 0.006, n) + 0.02, -1.656, 1.7305)
    columns = [
        _cells(quantised(s.x, 1.69e-5), "%.6f"),
        _cells(quantised(s.v + rng.normal(0.0, 0.25, n), 0.00477), "%.6f"),
        _cells(quantised(current, 5.733e-4), "%.6f"),
    ]
    head = [
        "Position - Lacet;Vitesse - Lacet;Courant moteur - Lacet",
        "PL02_256.CRB;VL02_256.CRB;CL02_256.CRB",
        "4.862000;4.862000;4.862000",
        "deg.;deg./s;A",
    ]
    _save(path, [*head, *(line.replace(".", ",") for line in _lines(columns, ";"))])


ERICC_LAYOUT = Layout(
    "ericc-lacet",
    "github.com/emiliendurif/TP_sujets TP_simulation/ericc3/modele_matlab/donnees_exp/brut/conf1_1e6.csv (read): "
    "header in French, line of curve files, line of the period 4.862 ms (with a point), line of units, "
    "semicolons, decimal commas, no time column, steps and the limits of the current +1.73/-1.655 A exact; moves "
    "and dynamics made up (ranges alike).",
    ".csv",
    "rotary axis",
    _ericc,
    {
        "Position - Lacet": Truth("position", "", "deg"),
        "Vitesse - Lacet": Truth("speed", "", "deg/s"),
        "Courant moteur - Lacet": Truth("current", "", "A"),
    },
)


# Arduino log of an oscillating motor
OSCILLATOR = (
    "Time (ms), Position (count), Velocity (count/s), Acceleration (count/s2), Desired Vel, Desired Acc, control"
    " signal, motorCurrent (raw):Kp=0.10,Kd=0.00,Ki=0.00"
)


def _oscillator(path: Path, rng: Rng) -> None:
    dt = 0.002
    t = np.arange(0.0, 45.0, dt)
    size = np.interp(
        t, [0, 1.5, 3, 14, 15.5, 18, 19.5, 31, 32.5, 34.5, 36, 43, 44], [0, 0, 1, 1, 0, 0, 1.7, 1.7, 0, 0, 0.7, 0.7, 0]
    )
    phase = 2.0 * np.pi * 0.5 * rng.uniform(0.95, 1.05) * t
    ref = 2048.0 + 256.0 * size * np.sin(phase)
    x, v, a = (s[:, 0] for s in follow(ref[:, None], dt, 30.0))
    effort = 0.009 * a + 22.0 * np.tanh(v / 20.0) + 0.02 * v
    block = 60.0 * _bump(t, 26.3, 0.3)
    effort += block
    times = np.arange(0.0, 44.9, 0.01)
    n = len(times)
    stamps = np.round(times * 1e3 + 1204.0)
    pos = np.round(np.interp(times, t, x) + rng.normal(0.0, 0.3, n))
    speed = low_pass(np.gradient(pos, 0.01), 0.01, 9.0)
    speed = np.concatenate([speed[1:], speed[-1:]])
    acc = low_pass(np.gradient(speed, 0.01), 0.01, 7.0)
    want_v = np.interp(times, t, np.gradient(ref, dt))
    want_a = np.interp(times, t, np.gradient(np.gradient(ref, dt), dt))
    drive = np.interp(times, t, effort)
    current = np.clip(np.round(512.0 + 1.6 * drive + rng.normal(0.0, 3.0, n)), 0, 1023)
    signal = 15000.0 + 60.0 * drive + 2.2 * np.interp(times, t, v) + rng.normal(0.0, 40.0, n)
    columns = [
        _ints(stamps), _ints(pos), _cells(speed, "%.2f"), _cells(acc, "%.2f"), _ints(np.trunc(want_v)),
        _ints(np.trunc(want_a)), _ints(signal), _cells(current, "%.2f"),
    ]  # fmt: skip
    _save(path, [OSCILLATOR, *_lines(columns, ",")], "\r\n")


OSCILLATOR_LAYOUT = Layout(
    "arduino-oscillator-sd",
    "Sketch that writes Test_Log_05Hz_256pts_OSC_<n>.txt to an SD card, and its MATLAB reader: header with the "
    "gains behind the last name (two names more than values), blanks after commas, types of the values, 0.5 Hz, "
    "256 counts, range 5000-25000 of the control signal exact; 10 ms, amplitudes, pauses, a block, offset 512 of "
    "the current made up.",
    ".txt",
    "rotary axis",
    _oscillator,
    {
        "Time (ms)": Truth("time", "", "ms"),
        "Position (count)": Truth("position"),
        "Velocity (count/s)": Truth("speed"),
        "Acceleration (count/s2)": Truth("acceleration"),
        "Desired Vel": Truth("reference_speed"),
        "Desired Acc": Truth("reference_acceleration"),
        "control signal": NO,
        "motorCurrent (raw):Kp=0.10": Truth("current"),
        "Kd=0.00": NO,
        "Ki=0.00": NO,
    },
    {"Desired Vel": MAYBE, "Desired Acc": MAYBE, "control signal": ("reference_torque",)},
)

LAYOUTS: tuple[Layout, ...] = (
    EPFL_LAYOUT,
    MILL_LAYOUT,
    DFKI_LAYOUT,
    HEX_LAYOUT,
    OMX_LAYOUT,
    FRANKA_LAYOUT,
    ARM_SUPPORT_LAYOUT,
    CAMBER_LAYOUT,
    VIFCON_LAYOUT,
    PRESS_LAYOUT,
    ELECTRAK_LAYOUT,
    TMOTOR_LAYOUT,
    ERICC_LAYOUT,
    OSCILLATOR_LAYOUT,
)
