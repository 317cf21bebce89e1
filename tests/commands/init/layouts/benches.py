"""Look-alikes of more logs: servo tools, test machines, small robots, topics, and files whose names say little."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.random import Generator

from cdtool.formats.mcap.write import Stream, write_mcap
from tests.commands.init.layouts.axes import LEAD, NOTHING, cell, single
from tests.commands.init.layouts.layout import Columns, Layout, Table, Truth, table_layout
from tests.commands.init.layouts.motion import RPM, arm_motion, quantised, stroke_motion
from tests.commands.init.layouts.robots import DEG, each, jittered, pose, wrench


def kollmorgen(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=1000.0, duration=4.0)
    return {
        "Time (ms)": (Truth("time", unit="ms"), m.time * 1e3),
        "PL.CMD (deg)": (Truth("reference_position", unit="deg"), single(m.reference_position) / LEAD * DEG),
        "PL.FB (deg)": (Truth("position", unit="deg"), single(m.position) / LEAD * DEG),
        "VL.CMD (rpm)": (Truth("reference_speed", unit="rpm"), single(m.reference_speed) / LEAD * RPM),
        "VL.FB (rpm)": (Truth("speed", unit="rpm"), single(m.noisy(m.speed, generator)) / LEAD * RPM),
        "IL.CMD (Arms)": (Truth("reference_torque", unit="A"), single(m.model_effort) * 0.02),
        "IL.FB (Arms)": (Truth("current", unit="A"), single(m.effort) * 0.02),
        "PL.ERR (deg)": (NOTHING, single(m.reference_position - m.position) / LEAD * DEG),
    }


def sigmawin(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=500.0)
    return {
        "Time[ms]": (Truth("time", unit="ms"), m.time * 1e3),
        "Feedback speed[min-1]": (Truth("speed", unit="rpm"), single(m.noisy(m.speed, generator)) / LEAD * RPM),
        "Speed reference[min-1]": (Truth("reference_speed", unit="rpm"), single(m.reference_speed) / LEAD * RPM),
        "Torque reference[%]": (Truth("reference_torque", unit="%"), single(m.effort) * 0.2),
        "Position error[reference units]": (NOTHING, np.round(single(m.reference_position - m.position) * 1e4)),
        "Accumulated load[%]": (NOTHING, 20.0 + 0.01 * m.time),
    }


def epos(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=1000.0, duration=4.0)
    return {
        "Time [ms]": (Truth("time", unit="ms"), m.time * 1e3),
        "Position Actual Value [inc]": (
            Truth("position", unit="count"), np.round(single(m.position) / LEAD * 2000 / 6.2832)),
        "Position Demand Value [inc]": (
            Truth("reference_position", unit="count"), np.round(single(m.reference_position) / LEAD * 2000 / 6.2832)),
        "Velocity Actual Value [rpm]": (Truth("speed", unit="rpm"), np.round(single(m.speed) / LEAD * RPM)),
        "Current Actual Value [mA]": (Truth("current", unit="mA"), np.round(single(m.effort) * 20.0)),
        "Following Error Actual Value [inc]": (NOTHING, np.round(single(m.reference_position - m.position) * 1e4)),
    }  # fmt: skip


def testing_machine(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=100.0, duration=12.0, travel=0.05, push=800.0)
    return {
        "Prüfzeit [s]": (Truth("time", unit="s"), m.time),
        "Standardweg [mm]": (Truth("position", unit="mm"), single(m.position) * 1e3),
        "Standardkraft [N]": (Truth("force", unit="N"), cell(m, generator)),
        "Traversengeschwindigkeit [mm/min]": (Truth("speed", unit="mm/min"), single(m.noisy(m.speed, generator)) * 6e4),
    }


def legged_motor(generator: Generator) -> Columns:
    m = arm_motion(generator, 3, rate=500.0, duration=6.0)
    names = ("FR_hip", "FR_thigh", "FR_calf")
    return {
        "t": (Truth("time", unit="s"), m.time),
        **each("{j}.q", "position", "rad", m.position, names),
        **each("{j}.dq", "speed", "rad/s", m.noisy(m.speed, generator), names),
        **each("{j}.tau_est", "torque", "N m", m.effort, names),
        **each("{j}.temperature", "", "", 40.0 + np.zeros(m.effort.shape), names),
        **each("{j}.q_des", "reference_position", "rad", m.reference_position, names),
    }


def desktop_arm(generator: Generator) -> Columns:
    m = arm_motion(generator, rate=100.0, duration=8.0)
    return {
        "timestamp": (Truth("time", unit="s"), jittered(m, generator, 1.71e9)),
        **each("joint_{n}_angle", "position", "deg", m.position * DEG),
        **each("joint_{n}_velocity", "speed", "deg/s", m.noisy(m.speed, generator) * DEG),
        **each("joint_{n}_torque", "torque", "N m", m.effort),
        **{f"ft_{axis}": (Truth("force" if k < 3 else ""), wrench(m, generator)[:, k])
           for k, axis in enumerate(("fx", "fy", "fz", "tx", "ty", "tz"))},
        **{f"pose_{axis}": (NOTHING, pose(m)[:, k]) for k, axis in enumerate(("x", "y", "z", "roll", "pitch", "yaw"))},
    }  # fmt: skip


def axes_only(generator: Generator) -> Columns:
    """A motion logger that writes only the joints' angles: `timestamp, cmd_num, J1 ... J6`."""
    m = arm_motion(generator, rate=250.0, duration=6.0)
    return {
        "timestamp": (Truth("time", unit="s"), m.time),
        "cmd_num": (NOTHING, np.floor(m.time / 1.2)),
        **each("J{n}", "position", "deg", m.position * DEG),
    }


def lift_door(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=100.0, duration=10.0, travel=0.9)
    return {
        "ms": (Truth("time", unit="ms"), np.round(m.time * 1e3)),
        "DoorPos_mm": (Truth("position", unit="mm"), np.round(single(m.position) * 1e3)),
        "DoorSpd_mm_s": (Truth("speed", unit="mm/s"), np.round(single(m.speed) * 1e3, 1)),
        "MotCur_mA": (Truth("current", unit="mA"), np.round(single(m.effort) * 20.0)),
        "CmdSpd_mm_s": (Truth("reference_speed", unit="mm/s"), np.round(single(m.reference_speed) * 1e3, 1)),
        "LightCurtain": (NOTHING, np.zeros(len(m.time))),
        "State": (NOTHING, np.floor(m.time / 2.0)),
    }


def amplifier(generator: Generator) -> Columns:
    """A measuring amplifier: the names say nothing, the units what is measured."""
    m = stroke_motion(generator, rate=1200.0, duration=4.0)
    return {
        "Zeit 1 - Standardmessrate [s]": (Truth("time", unit="s"), m.time),
        "MX840B CH 1 [mm]": (Truth("position", unit="mm"), single(m.noisy(m.position, generator, 1e-5)) * 1e3),
        "MX840B CH 2 [mm/s]": (Truth("speed", unit="mm/s"), single(m.noisy(m.speed, generator)) * 1e3),
        "MX840B CH 3 [N]": (Truth("force", unit="N"), cell(m, generator)),
        "MX840B CH 4 [A]": (Truth("current", unit="A"), single(m.effort) * 0.02),
        "MX840B CH 5 [°C]": (NOTHING, 22.0 + generator.normal(0.0, 0.02, len(m.time))),
    }


def no_words(generator: Generator) -> Columns:
    """Columns A to D: only the physics tells position from speed."""
    m = stroke_motion(generator, rate=200.0)
    return {
        "time": (Truth("time", unit="s"), m.time),
        "A": (Truth("force"), cell(m, generator)),
        "B": (Truth("speed"), single(m.noisy(m.speed, generator))),
        "C": (Truth("position"), single(m.position)),
        "D": (Truth("torque"), single(m.effort)),
    }


def spanish_robot(generator: Generator) -> Columns:
    m = arm_motion(generator, rate=100.0, duration=8.0)
    return {
        "tiempo": (Truth("time", unit="s"), m.time),
        **each("posicion_articular_{n}", "position", "rad", m.position),
        **each("velocidad_articular_{n}", "speed", "rad/s", m.noisy(m.speed, generator)),
        **each("par_motor_{n}", "torque", "N m", m.effort),
        **each("posicion_consigna_{n}", "reference_position", "rad", m.reference_position),
        "temperatura_ambiente": (NOTHING, 22.0 + 0.001 * m.time),
    }


def chinese_robot(generator: Generator) -> Columns:
    m = arm_motion(generator, rate=100.0, duration=8.0)
    return {
        "时间戳": (Truth("time", unit="s"), m.time),
        **each("关节{n}实际位置", "position", "deg", m.position * DEG),
        **each("关节{n}实际速度", "speed", "deg/s", m.noisy(m.speed, generator) * DEG),
        **each("关节{n}目标位置", "reference_position", "deg", m.reference_position * DEG),
        **each("关节{n}电流", "current", "A", m.effort * 0.1),
        **each("关节{n}温度", "", "", 35.0 + np.zeros(m.effort.shape)),
    }


def mat_robot(path: Path, generator: Generator) -> None:
    import scipy.io

    m = arm_motion(generator, rate=100.0, duration=8.0)
    content = {"time": m.time[:, np.newaxis], "q_meas": m.position, "qd_meas": m.noisy(m.speed, generator)}
    scipy.io.savemat(path, {**content, "tau_meas": m.effort, "q_ref": m.reference_position})


def joint_state_topics(path: Path, generator: Generator) -> None:
    m = arm_motion(generator, rate=200.0, duration=6.0)
    names = tuple(f"joint{j + 1}" for j in range(6))
    state = {"position": m.position, "velocity": m.noisy(m.speed, generator), "effort": m.effort}
    force = {f"wrench.force.{axis}": wrench(m, generator)[:, k] for k, axis in enumerate("xyz")}
    streams = [
        Stream("/joint_states", "sensor_msgs/msg/JointState", m.time, state, names),
        Stream("/ft_sensor/wrench", "geometry_msgs/msg/WrenchStamped", m.time, force),
    ]
    write_mcap(path, streams, start_ns=1)


def gear_bench(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=500.0)
    return {
        "t_s": (Truth("time", unit="s"), m.time),
        "motor_angle_rad": (Truth("position", unit="rad"), single(m.position) / LEAD),
        "motor_speed_rad_s": (Truth("speed", unit="rad/s"), single(m.noisy(m.speed, generator)) / LEAD),
        "motor_torque_Nm": (Truth("torque", unit="N m"), single(m.effort) * LEAD),
        "slide_accel_g": (Truth("acceleration", unit="g"), single(m.noisy(m.acceleration, generator, 0.01)) / 9.80665),
        "loadcell_N": (Truth("force", unit="N"), cell(m, generator)),
        "contact": (Truth("label"), (m.push > 0.0).astype(float)),
        "trigger": (Truth("trigger"), (np.abs(single(m.speed)) > 0.01).astype(float)),
    }


def coarse_camera(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=30.0, duration=20.0)
    return {
        "frame": (NOTHING, np.arange(len(m.time)) + 1.0),
        "time_s": (Truth("time", unit="s"), jittered(m, generator)),
        "x_mm": (Truth("position", unit="mm"), quantised(single(m.position) * 1e3, 0.5)),
    }


LAYOUTS: tuple[Layout, ...] = (
    table_layout("kollmorgen", "Kollmorgen Workbench scope: PL.FB, VL.FB, IL.FB", "linear axis", kollmorgen),
    table_layout("sigmawin", "Yaskawa SigmaWin trace: no measured torque", "linear axis", sigmawin),
    table_layout("epos", "maxon EPOS Studio recorder in increments", "linear axis", epos, Table(";")),
    table_layout(
        "testing machine", "Zwick testXpert: Standardweg, Standardkraft",
        "linear axis", testing_machine, Table(";", ","),
    ),
    table_layout("legged motor", "Unitree motor states of one leg", "robot", legged_motor),
    table_layout("desktop arm", "xArm with a force sensor at the wrist", "robot", desktop_arm, Table(digits=10)),
    table_layout("axes only", "a motion logger of an ABB arm: timestamp, cmd_num, J1 to J6", "robot", axes_only),
    table_layout("lift door", "trace of a lift's door drive", "linear axis", lift_door, Table(";")),
    table_layout(
        "amplifier", "catman export of a measuring amplifier: units only",
        "linear axis", amplifier, Table("\t"),
    ),
    table_layout("no words", "columns A to D", "linear axis", no_words),
    table_layout("spanish robot", "Spanish names of joints", "robot", spanish_robot),
    table_layout("chinese robot", "Chinese names of joints", "robot", chinese_robot),
    table_layout(
        "gear bench", "motor side with an accelerometer in g, contact and trigger",
        "linear axis", gear_bench,
    ),
    table_layout("camera", "positions of a camera at 30 Hz with frame numbers", "linear axis", coarse_camera),
    Layout(
        "mat robot", "MATLAB matrices with a column for each joint", ".mat", "robot", mat_robot,
        {
            "time": Truth("time", unit="s"),
            **{f"{name}[{j}]": Truth(channel, str(j + 1), unit) for name, channel, unit in (
                ("q_meas", "position", "rad"), ("qd_meas", "speed", "rad/s"), ("tau_meas", "torque", "N m"),
                ("q_ref", "reference_position", "rad"),
            ) for j in range(6)},
        },
    ),
    Layout(
        "joint state topics", "MCAP with JointState and a wrench", ".mcap", "robot", joint_state_topics,
        {
            "/joint_states position[:]": Truth("position", unit="rad"),
            "/joint_states velocity[:]": Truth("speed", unit="rad/s"),
            "/joint_states effort[:]": Truth("torque", unit="N m"),
            **{f"/ft_sensor/wrench wrench.force.{axis}": Truth("force", unit="N") for axis in "xyz"},
        },
    ),
)  # fmt: skip
