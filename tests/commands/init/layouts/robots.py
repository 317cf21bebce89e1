"""Look-alikes of logs of robots: names, units, rates and ranges as their public makers and data sets describe them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.random import Generator

from tests.commands.init.layouts.layout import Columns, FloatArray, Layout, Table, Truth, table_layout
from tests.commands.init.layouts.motion import RPM, Motion, arm_motion, quantised

DEG = 180.0 / np.pi
UR_JOINTS = (
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
)  # fmt: skip
NOTHING = Truth()


def each(
    pattern: str, channel: str, unit: str, values: FloatArray, joints: Sequence[str] = ()
) -> dict[str, tuple[Truth, FloatArray]]:
    """Return a column for each joint; {i}, {n} and {j} in the pattern are its index from 0, from 1 and its name."""
    names = joints or [str(j) for j in range(1, values.shape[1] + 1)]
    return {
        pattern.replace("{i}", str(j)).replace("{n}", str(j + 1)).replace("{j}", name): (
            Truth(channel, name if channel else "", unit if channel else ""),
            values[:, j],
        )
        for j, name in enumerate(names)
    }


def pose(motion: Motion) -> FloatArray:
    """Return a tool's pose (n, 6) that depends on the joints: lengths in m, then angles."""
    q = motion.position
    c, s = np.cos(q), np.sin(q)
    return np.column_stack((c[:, 0] * s[:, 1], s[:, 0] * s[:, 1], 0.6 + c[:, 1], c[:, 2], s[:, 2] * c[:, 0], s[:, 1]))


def pose_rate(motion: Motion) -> FloatArray:
    """Return the derivative of the pose."""
    return np.gradient(pose(motion), motion.time, axis=0)


def wrench(motion: Motion, generator: Generator) -> FloatArray:
    """Return the force [N] and torque [N m] at the tool (n, 6), with noise and the push."""
    direction = np.array([0.6, -0.2, 0.7, 0.02, 0.05, 0.01])
    return motion.push[:, np.newaxis] * direction + generator.normal(0.0, 0.6, (len(motion.time), 6))


def jittered(motion: Motion, generator: Generator, start: float = 0.0) -> FloatArray:
    """Return the stamps with a jitter of a fifth of the period."""
    period = motion.time[1]
    return start + motion.time + generator.uniform(-0.1, 0.1, len(motion.time)) * period


def ur_rtde(generator: Generator) -> Columns:
    m = arm_motion(generator)
    ones = np.ones((len(m.time), 6))
    gain = np.array([0.13, 0.13, 0.13, 0.11, 0.11, 0.11])
    return {
        "timestamp": (Truth("time", unit="s"), quantised(m.time + 3512.208, 1e-3)),
        **each("target_q_{i}", "reference_position", "rad", m.reference_position),
        **each("target_qd_{i}", "reference_speed", "rad/s", m.reference_speed),
        **each("target_qdd_{i}", "", "", m.reference_acceleration),
        **each("target_current_{i}", "reference_torque", "A", m.model_effort * gain),
        **each("target_moment_{i}", "reference_torque", "N m", m.model_effort),
        **each("actual_q_{i}", "position", "rad", m.position),
        **each("actual_qd_{i}", "speed", "rad/s", m.noisy(m.speed, generator)),
        **each("actual_current_{i}", "current", "A", m.effort * gain),
        **each("joint_control_output_{i}", "", "", m.noisy(m.effort * gain, generator)),
        **each("actual_TCP_pose_{i}", "", "", pose(m)),
        **each("actual_TCP_speed_{i}", "", "", pose_rate(m)),
        **each("actual_TCP_force_{i}", "", "", wrench(m, generator)),
        **each("target_TCP_pose_{i}", "", "", pose(m)),
        **each("joint_temperatures_{i}", "", "", 32.0 + 0.1 * np.cumsum(np.abs(m.effort), axis=0) / len(m.time)),
        **each("joint_mode_{i}", "", "", 253.0 * ones),
        "robot_mode": (NOTHING, 7.0 * ones[:, 0]),
        "speed_scaling": (NOTHING, ones[:, 0]),
        "actual_main_voltage": (NOTHING, 48.0 + generator.normal(0.0, 0.1, len(m.time))),
        "actual_robot_current": (NOTHING, 0.6 + 0.01 * np.abs(m.effort).sum(axis=1)),
        **each("actual_joint_voltage_{i}", "", "", 47.9 + generator.normal(0.0, 0.1, ones.shape)),
    }


def ros_plotjuggler(generator: Generator) -> Columns:
    m = arm_motion(generator, rate=500.0, duration=6.0)
    order = sorted(range(6), key=lambda j: UR_JOINTS[j])
    found: dict[str, tuple[Truth, FloatArray]] = {
        "__time": (Truth("time", unit="s"), jittered(m, generator, 1.68e9)),
        "/joint_states/header/stamp": (Truth("time", unit="s"), 1.68e9 + m.time),
    }
    for j in order:
        name = UR_JOINTS[j]
        found[f"/joint_states/{name}/effort"] = (Truth("torque", name), m.effort[:, j])
        found[f"/joint_states/{name}/position"] = (Truth("position", name, "rad"), m.position[:, j])
        found[f"/joint_states/{name}/velocity"] = (Truth("speed", name, "rad/s"), m.speed[:, j])
    for j, axis in enumerate("xyz"):
        found[f"/wrench/wrench/force/{axis}"] = (Truth("force", unit="N"), wrench(m, generator)[:, j])
        found[f"/wrench/wrench/torque/{axis}"] = (NOTHING, wrench(m, generator)[:, 3 + j])
    return found


def ur10e_identification(generator: Generator) -> Columns:
    m = arm_motion(generator, rate=500.0, duration=6.0, push=0.0)
    return {
        "t": (Truth("time", unit="s"), m.time),
        **each("q{n}", "position", "rad", m.position),
        **each("qd{n}", "speed", "rad/s", m.noisy(m.speed, generator)),
        **each("i{n}", "current", "A", m.effort * 0.1),
        **each("i_des{n}", "reference_torque", "A", m.model_effort * 0.1),
        **each("tau_des{n}", "reference_torque", "N m", m.model_effort),
    }


def ur_no_header(generator: Generator) -> Columns:
    """40 columns without names: time, 6 positions, 6 speeds, 6 currents, and 21 others."""
    m = arm_motion(generator, rate=50.0, duration=20.0)
    return {
        "t": (Truth("time", unit="s"), jittered(m, generator)),
        **each("q{n}", "position", "rad", m.position),
        **each("qd{n}", "speed", "rad/s", m.noisy(m.speed, generator)),
        **each("i{n}", "current", "A", m.effort * 0.1),
        **each("w{n}", "", "", wrench(m, generator)),
        **each("T{n}", "", "", 30.0 + generator.normal(0.0, 0.1, m.effort.shape)),
        **each("p{n}", "", "", pose(m)),
        **{f"b{i}": (NOTHING, np.full(len(m.time), float(i))) for i in range(3)},
    }


def ur_set_values_first(generator: Generator) -> Columns:
    """31 columns without names: time, set positions and speeds, then the measured ones and the currents."""
    m = arm_motion(generator, rate=125.0, duration=8.0)
    return {
        "t": (Truth("time", unit="s"), m.time),
        **each("q_des{n}", "reference_position", "rad", m.reference_position),
        **each("qd_des{n}", "reference_speed", "rad/s", m.reference_speed),
        **each("q{n}", "position", "rad", m.position),
        **each("qd{n}", "speed", "rad/s", m.noisy(m.speed, generator)),
        **each("i{n}", "current", "A", m.effort * 0.1),
    }


def libfranka(generator: Generator) -> Columns:
    m = arm_motion(generator, 7, rate=1000.0, duration=3.0)
    external = 0.3 * m.push[:, np.newaxis] * np.array([1, 1, 1, 0, 0, 0, 0]) + generator.normal(
        0.0, 0.3, m.effort.shape
    )
    transform = np.column_stack([pose(m)[:, k % 6] for k in range(16)])
    return {
        "duration": (Truth("time", unit="ms"), m.time * 1e3 + 4000.0),
        "success_rate": (NOTHING, np.ones(len(m.time))),
        **each("q[{i}]", "position", "rad", m.position),
        **each("q_d[{i}]", "reference_position", "rad", m.reference_position),
        **each("dq[{i}]", "speed", "rad/s", m.noisy(m.speed, generator)),
        **each("dq_d[{i}]", "reference_speed", "rad/s", m.reference_speed),
        **each("tau_J[{i}]", "torque", "N m", m.effort),
        **each("tau_J_d[{i}]", "reference_torque", "N m", m.model_effort),
        **each("dtau_J[{i}]", "", "", np.gradient(m.effort, m.time, axis=0)),
        **each("tau_ext_hat_filtered[{i}]", "", "", external),
        **each("O_T_EE[{i}]", "", "", transform),
        **each("O_F_ext_hat_K[{i}]", "", "", wrench(m, generator)),
    }


def franka_states(generator: Generator) -> Columns:
    """A dump of the states of franka_ros, with both sides of the joints' springs."""
    m = arm_motion(generator, 7, rate=100.0, duration=8.0, at_rest=(4,))
    return {
        "time": (Truth("time", unit="s"), m.time),
        **each("q_{i}", "position", "rad", m.position),
        **each("q_d_{i}", "reference_position", "rad", m.reference_position),
        **each("dq_{i}", "speed", "rad/s", m.noisy(m.speed, generator)),
        **each("dq_d_{i}", "reference_speed", "rad/s", m.reference_speed),
        **each("ddq_d_{i}", "", "", m.reference_acceleration),
        **each("theta_{i}", "position", "rad", m.position + 1e-4 * m.effort),
        **each("dtheta_{i}", "speed", "rad/s", m.noisy(m.speed, generator, 0.004)),
        **each("tau_J_{i}", "torque", "N m", m.effort),
        **each("tau_J_d_{i}", "reference_torque", "N m", m.model_effort),
        **each("tau_ext_hat_filtered_{i}", "", "", generator.normal(0.0, 0.3, m.effort.shape)),
        **each("joint_contact_{i}", "", "", np.zeros(m.effort.shape)),
        **each("cartesian_collision_{i}", "", "", np.zeros((len(m.time), 6))),
        "control_command_success_rate": (NOTHING, np.ones(len(m.time))),
    }


def kuka_data_recorder(generator: Generator) -> Columns:
    m = arm_motion(generator, 7, rate=200.0, duration=6.0)
    robot = "LBR_iiwa_7_R800_1"
    return {
        "ZeitInSec": (NOTHING, np.floor(m.time + 0.5) + 1492433000.0),
        "ZeitInNanoSec": (NOTHING, np.mod(m.time + 0.5, 1.0) * 1e9),
        **each(f"axisQMsr_{robot}[{{i}}]", "position", "rad", m.position),
        **each(f"axisQCmd_{robot}[{{i}}]", "reference_position", "rad", m.reference_position),
        **each(f"axisTauMsr_{robot}[{{i}}]", "torque", "N m", m.effort),
        **each(f"axisTauExtMsr_{robot}[{{i}}]", "", "", generator.normal(0.0, 0.4, m.effort.shape)),
        **each(f"cartPosMsr_{robot}[{{i}}]", "", "", pose(m) * 1e3),
    }


def kuka_fri(generator: Generator) -> Columns:
    m = arm_motion(generator, 7, rate=200.0, duration=6.0)
    return {
        "time_sec": (Truth("time", unit="s"), m.time),
        **each("measured_joint_position.A{n}", "position", "rad", m.position),
        **each("commanded_joint_position.A{n}", "reference_position", "rad", m.reference_position),
        **each("ipo_joint_position.A{n}", "", "", m.reference_position),
        **each("measured_torque.A{n}", "torque", "N m", m.effort),
        **each("commanded_torque.A{n}", "reference_torque", "N m", m.model_effort),
        **each("external_torque.A{n}", "", "", generator.normal(0.0, 0.4, m.effort.shape)),
        "session_state": (NOTHING, np.full(len(m.time), 4.0)),
        "tracking_performance": (NOTHING, np.ones(len(m.time))),
    }


def kuka_rsi(generator: Generator) -> Columns:
    m = arm_motion(generator, rate=250.0, duration=6.0)
    cartesian = pose(m) * np.array([1e3, 1e3, 1e3, DEG, DEG, DEG])
    found: dict[str, tuple[Truth, FloatArray]] = {"IPOC": (Truth("time", unit="ms"), 680309708.0 + m.time * 1e3)}
    for k, axis in enumerate("XYZABC"):
        found[f"RIst.{axis}"] = (NOTHING, cartesian[:, k])
    for k, axis in enumerate("XYZABC"):
        found[f"RSol.{axis}"] = (NOTHING, cartesian[:, k])
    return {
        **found,
        **each("AIPos.A{n}", "position", "deg", quantised(m.position * DEG, 1e-4)),
        **each("ASPos.A{n}", "reference_position", "deg", quantised(m.reference_position * DEG, 1e-4)),
        **each("MACur.A{n}", "current", "", m.effort * 0.05),
        "Delay.D": (NOTHING, np.zeros(len(m.time))),
    }


def abb_egm(generator: Generator) -> Columns:
    m = arm_motion(generator, rate=250.0, duration=6.0)
    return {
        "seqno": (NOTHING, np.arange(len(m.time)) + 17.0),
        "tm_ms": (Truth("time", unit="ms"), np.round(m.time * 1e3) + 812345.0),
        **each("feedback_joint_{n}_deg", "position", "deg", m.position * DEG),
        **each("planned_joint_{n}_deg", "reference_position", "deg", m.reference_position * DEG),
        "motor_state": (NOTHING, np.ones(len(m.time))),
        "mci_state": (NOTHING, np.full(len(m.time), 2.0)),
        **{f"measured_force_{k + 1}": (Truth("force" if k < 3 else ""), wrench(m, generator)[:, k]) for k in range(6)},
    }


def fanuc(generator: Generator) -> Columns:
    m = arm_motion(generator, rate=125.0, duration=8.0)
    return {
        "Time[ms]": (Truth("time", unit="ms"), np.round(m.time * 1e3)),
        **each("J{n} Pos[deg]", "position", "deg", quantised(m.position * DEG, 1e-3)),
        **each("J{n} Cmd Pos[deg]", "reference_position", "deg", quantised(m.reference_position * DEG, 1e-3)),
        **each("J{n} Current[A]", "current", "A", m.effort * 0.08),
        **each("J{n} Disturbance[%]", "", "", generator.normal(0.0, 2.0, m.effort.shape)),
    }


def doosan(generator: Generator) -> Columns:
    m = arm_motion(generator, rate=100.0, duration=10.0)
    external = generator.normal(0.0, 0.5, m.effort.shape)
    return {
        "time_stamp": (Truth("time", unit="s"), 55.3 + m.time),
        **each("actual_joint_position_{i}", "position", "deg", m.position * DEG),
        **each("actual_joint_velocity_{i}", "speed", "deg/s", m.noisy(m.speed, generator) * DEG),
        **each("actual_joint_position_abs_{i}", "position", "deg", m.position * DEG + 0.01),
        **each("actual_tcp_position_{i}", "", "", pose(m) * 1e3),
        **each("actual_tcp_velocity_{i}", "", "", pose_rate(m) * 1e3),
        **each("actual_motor_torque_{i}", "torque", "N m", m.effort),
        **each("actual_joint_torque_{i}", "torque", "N m", m.noisy(m.effort, generator)),
        **each("raw_joint_torque_{i}", "torque", "N m", m.noisy(m.effort, generator, 0.01)),
        **each("external_joint_torque_{i}", "", "", external),
        **each("external_tcp_force_{i}", "", "", wrench(m, generator)),
        **each("target_joint_position_{i}", "reference_position", "deg", m.reference_position * DEG),
        **each("target_joint_velocity_{i}", "reference_speed", "deg/s", m.reference_speed * DEG),
        **each("gravity_torque_{i}", "", "", m.noisy(m.model_effort, generator)),
        **each("motor_temperature_{i}", "", "", 40.0 + generator.normal(0.0, 0.1, m.effort.shape)),
    }


def kinova(generator: Generator) -> Columns:
    m = arm_motion(generator, 7, rate=100.0, duration=10.0)
    return {
        "t_us": (Truth("time", unit="us"), np.round(m.time * 1e6)),
        **each("actuators[{i}].position", "position", "deg", m.position * DEG + 180.0),
        **each("actuators[{i}].velocity", "speed", "deg/s", m.noisy(m.speed, generator) * DEG),
        **each("actuators[{i}].torque", "torque", "N m", m.effort),
        **each("actuators[{i}].current_motor", "current", "A", m.effort * 0.06),
        **each("actuators[{i}].voltage", "", "", 24.0 + generator.normal(0.0, 0.05, m.effort.shape)),
        **each("actuators[{i}].temperature_motor", "", "", 35.0 + generator.normal(0.0, 0.05, m.effort.shape)),
        **each("base.tool_pose_{i}", "", "", pose(m)),
        **each("base.tool_external_wrench_force_{i}", "", "", wrench(m, generator)[:, :3]),
    }


def baxter(generator: Generator) -> Columns:
    m = arm_motion(generator, 7, rate=100.0, duration=10.0)
    joints = ("left_s0", "left_s1", "left_e0", "left_e1", "left_w0", "left_w1", "left_w2")
    return {
        "time": (Truth("time", unit="s"), jittered(m, generator, 0.5)),
        **each("{j}_commanded_position", "reference_position", "rad", m.reference_position, joints),
        **each("{j}_commanded_velocity", "reference_speed", "rad/s", m.reference_speed, joints),
        **each("{j}_commanded_effort", "reference_torque", "N m", m.model_effort, joints),
        **each("{j}_actual_position", "position", "rad", m.position, joints),
        **each("{j}_actual_velocity", "speed", "rad/s", m.noisy(m.speed, generator), joints),
        **each("{j}_actual_effort", "torque", "N m", m.effort, joints),
        **each("{j}_gravity_model_effort", "", "", m.model_effort, joints),
        **each("{j}_hysteresis_model_effort", "", "", 0.1 * m.effort, joints),
        "collision": (Truth("label"), (m.push > 0.0).astype(float)),
    }


def voraus(generator: Generator) -> Columns:
    m = arm_motion(generator, rate=100.0, duration=10.0)
    ones = np.ones(len(m.time))
    found: dict[str, tuple[Truth, FloatArray]] = {
        "time": (Truth("time", unit="s"), m.time), "sample": (NOTHING, 3.0 * ones), "anomaly": (NOTHING, 0.0 * ones),
        "category": (NOTHING, 12.0 * ones), "setting": (NOTHING, 0.0 * ones),
        "action": (NOTHING, np.floor(m.time / 2.5)), "active": (NOTHING, ones),
        "robot_voltage": (NOTHING, 48.0 + generator.normal(0.0, 0.1, len(m.time))),
        "robot_current": (NOTHING, 0.6 + 0.01 * np.abs(m.effort).sum(axis=1)),
        "io_current": (NOTHING, 0.2 + generator.normal(0.0, 0.01, len(m.time))),
        "system_current": (NOTHING, 1.2 + 0.01 * np.abs(m.effort).sum(axis=1)),
    }  # fmt: skip
    groups: Mapping[str, tuple[str, str, FloatArray]] = {
        "target_position": ("reference_position", "rad", m.reference_position),
        "target_velocity": ("reference_speed", "rad/s", m.reference_speed),
        "target_acceleration": ("", "", m.reference_acceleration),
        "target_torque": ("reference_torque", "N m", m.model_effort),
        "computed_inertia": ("", "", 2.0 + np.cos(m.position)),
        "computed_torque": ("", "", m.model_effort),
        "motor_position": ("position", "rad", m.position),
        "motor_velocity": ("speed", "rad/s", m.noisy(m.speed, generator)),
        "joint_position": ("position", "rad", m.position + 1e-4 * m.effort),
        "joint_velocity": ("speed", "rad/s", m.noisy(m.speed, generator, 0.004)),
        "motor_torque": ("torque", "N m", m.effort),
        "torque_sensor_a": ("torque", "N m", m.noisy(m.effort, generator, 0.01)),
        "torque_sensor_b": ("torque", "N m", m.noisy(m.effort, generator, 0.01)),
        "motor_iq": ("current", "A", m.effort * 0.1),
        "motor_id": ("", "", generator.normal(0.0, 0.05, m.effort.shape)),
        "power_motor_el": ("", "", m.effort * m.speed * 1.2),
        "power_motor_mech": ("", "", m.effort * m.speed),
        "motor_voltage": ("", "", 3.0 * m.speed + 0.1 * m.effort),
        "brake_voltage": ("", "", np.full(m.effort.shape, 23.9)),
    }
    for j in range(6):
        for name, (channel, unit, values) in groups.items():
            found[f"{name}_{j + 1}"] = (Truth(channel, str(j + 1) if channel else "", unit), values[:, j])
    return found


def flexiv(generator: Generator) -> Columns:
    m = arm_motion(generator, 7, rate=200.0, duration=6.0)
    return {
        "timestamp": (Truth("time", unit="s"), 1.7e9 + m.time),
        **each("q{n}", "position", "rad", m.position),
        **each("theta{n}", "position", "rad", m.position + 1e-4 * m.effort),
        **each("dq{n}", "speed", "rad/s", m.noisy(m.speed, generator)),
        **each("dtheta{n}", "speed", "rad/s", m.noisy(m.speed, generator, 0.004)),
        **each("tau{n}", "torque", "N m", m.effort),
        **each("tau_des{n}", "reference_torque", "N m", m.model_effort),
        **each("tau_dot{n}", "", "", np.gradient(m.effort, m.time, axis=0)),
        **each("tau_ext{n}", "", "", generator.normal(0.0, 0.3, m.effort.shape)),
    }


def dynamixel(generator: Generator) -> Columns:
    """A small servo arm: "present current" is the measured current, "present position" is no current."""
    m = arm_motion(generator, 3, rate=50.0, duration=16.0, push=0.0)
    return {
        "time_ms": (Truth("time", unit="ms"), np.round(m.time * 1e3)),
        **each("present_position_{n}", "position", "count", np.round(m.position * 4096 / (2 * np.pi)) + 2048.0),
        **each("present_velocity_{n}", "speed", "", np.round(m.speed * RPM / 0.229)),
        **each("present_current_{n}", "current", "", np.round(m.effort * 20.0)),
        **each(
            "goal_position_{n}",
            "reference_position",
            "count",
            np.round(m.reference_position * 4096 / (2 * np.pi)) + 2048.0,
        ),
        **each("present_input_voltage_{n}", "", "", np.full(m.effort.shape, 118.0)),
    }


def joints_only(generator: Generator) -> Columns:
    """A recorder of joint states with ambiguous "current_pos" and "current_vel": the present ones."""
    m = arm_motion(generator, rate=60.0, duration=15.0)
    return {
        "sec": (Truth("time", unit="s"), jittered(m, generator)),
        **each("current_pos_j{n}", "position", "rad", m.position),
        **each("current_vel_j{n}", "speed", "rad/s", m.noisy(m.speed, generator)),
        **each("desired_pos_j{n}", "reference_position", "rad", m.reference_position),
        "force_x": (Truth("force", unit="N"), wrench(m, generator)[:, 0]),
        "force_y": (Truth("force", unit="N"), wrench(m, generator)[:, 1]),
        "force_z": (Truth("force", unit="N"), wrench(m, generator)[:, 2]),
    }


LAYOUTS: tuple[Layout, ...] = (
    table_layout(
        "ur rtde",
        "record.py of Universal Robots' RTDE client: names of the RTDE outputs, 125 Hz",
        "robot",
        ur_rtde,
        Table(" "),
    ),
    table_layout(
        "ros plotjuggler",
        "joint_states of ur_robot_driver as exported by PlotJuggler, 500 Hz",
        "robot",
        ros_plotjuggler,
        Table(digits=9),
    ),
    table_layout(
        "ur10e identification",
        "identification data of a UR10e: q, qd, motor currents, 500 Hz",
        "robot",
        ur10e_identification,
    ),
    table_layout(
        "ur without names",
        "collisions of a UR arm: 40 columns without names, about 50 Hz",
        "robot",
        ur_no_header,
        Table(header=False),
    ),
    table_layout(
        "set values without names",
        "a UR log by URScript: set values first, no names",
        "robot",
        ur_set_values_first,
        Table(header=False),
    ),
    table_layout("libfranka log", "logToCSV of libfranka: names of the robot state, 1 kHz", "robot", libfranka),
    table_layout("franka states", "franka_ros states with underscores, one joint at rest", "robot", franka_states),
    table_layout(
        "kuka data recorder",
        "DataRecorder of KUKA Sunrise: two columns of time",
        "robot",
        kuka_data_recorder,
        Table(" "),
    ),
    table_layout("kuka fri", "lbr_fri_ros2 states of a KUKA iiwa", "robot", kuka_fri),
    table_layout("kuka rsi", "KUKA RSI: AIPos, ASPos, MACur, IPOC in ms, 4 ms", "robot", kuka_rsi, Table(digits=10)),
    table_layout("abb egm", "ABB EGM: feedback and planned joints in degrees, 250 Hz", "robot", abb_egm),
    table_layout("fanuc", "Fanuc joint positions, currents and disturbances", "robot", fanuc, Table(";")),
    table_layout("doosan", "real-time data of Doosan: degrees, motor and joint torques", "robot", doosan),
    table_layout("kinova", "BaseCyclic feedback of a Kinova Gen3", "robot", kinova),
    table_layout("baxter", "SEAJointState of a Baxter with collisions: seven joints by name, 100 Hz", "robot", baxter),
    table_layout(
        "voraus", "voraus-AD: motor and joint side, computed torques, currents of the cell, 100 Hz", "robot", voraus
    ),
    table_layout(
        "flexiv", "RobotStates of Flexiv: q, theta, tau, tau_des, tau_dot, tau_ext", "robot", flexiv, Table(digits=9)
    ),
    table_layout("dynamixel", "control table of Dynamixel servos, raw counts, 50 Hz", "robot", dynamixel),
    table_layout(
        "present values", "a recorder that calls the present position current_pos, about 60 Hz", "robot", joints_only
    ),
)
