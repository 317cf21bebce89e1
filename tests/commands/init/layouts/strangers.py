"""Look-alikes written after the guesser, to see what it does with names that it was not made for."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
from numpy.random import Generator

from tests.commands.init.layouts.axes import LEAD, NOTHING, cell, single
from tests.commands.init.layouts.layout import Columns, FloatArray, Layout, Table, Truth, table_layout
from tests.commands.init.layouts.motion import RPM, arm_motion, stroke_motion
from tests.commands.init.layouts.robots import DEG, each, pose, pose_rate, wrench


def of(channel: str, unit: str = "") -> Truth:
    """Return the truth about the column of a single joint."""
    return Truth(channel, unit=unit)


def by_name(pattern: str, channel: str, unit: str, values: FloatArray, names: Sequence[str]) -> Columns:
    """Return a column for each joint, by its name."""
    return {pattern.replace("#", name): (Truth(channel, name, unit), values[:, j]) for j, name in enumerate(names)}


def of_matrix(name: str, channel: str, unit: str) -> dict[str, Truth]:
    """Return the truth about the columns of a matrix with six joints."""
    return {f"{name}[{j}]": Truth(channel, str(j), unit) for j in range(6)}


def lab(g: Generator) -> Columns:
    m = stroke_motion(g, rate=500.0)
    return {
        "Zeit t / s": (of("time", "s"), m.time),
        "Weg s / mm": (of("position", "mm"), single(m.position) * 1e3),
        "Drehzahl n / min^-1": (of("speed", "rpm"), single(m.noisy(m.speed, g)) / LEAD * RPM),
        "Moment M / Nm": (of("torque", "N m"), single(m.effort) * LEAD),
        "Kraft F / N": (of("force", "N"), cell(m, g)),
        "Temperatur T / °C": (NOTHING, 20 + 0.1 * m.time),
    }


def paren(g: Generator) -> Columns:
    m = arm_motion(g, 2, rate=200.0)
    return {
        "time(s)": (of("time", "s"), m.time),
        **each("theta{n}_meas(rad)", "position", "rad", m.position),
        **each("theta{n}_cmd(rad)", "reference_position", "rad", m.reference_position),
        **each("omega{n}_meas(rad/s)", "speed", "rad/s", m.noisy(m.speed, g)),
        **each("tau{n}_meas(N.m)", "torque", "N m", m.effort),
    }


def spaced(g: Generator) -> Columns:
    m = arm_motion(g, 3, rate=100.0)
    return {
        "Sample Time": (of("time", "s"), m.time),
        **each("Axis {n} Position Actual", "position", "", m.position),
        **each("Axis {n} Velocity Actual", "speed", "", m.noisy(m.speed, g)),
        **each("Axis {n} Torque Actual", "torque", "", m.effort),
        **each("Axis {n} Position Command", "reference_position", "", m.reference_position),
        **each("Axis {n} Following Error", "", "", m.reference_position - m.position),
        "Axis Status": (NOTHING, np.ones(len(m.time))),
    }


def letters(g: Generator) -> Columns:
    m = stroke_motion(g, rate=500.0)
    return {
        "t": (of("time", "s"), m.time),
        "s": (of("position"), single(m.position)),
        "v": (of("speed"), single(m.noisy(m.speed, g))),
        "a": (of("acceleration"), single(m.noisy(m.acceleration, g, 0.01))),
        "F": (of("force"), cell(m, g)),
        "M": (of("torque"), single(m.effort)),
    }


def french(g: Generator) -> Columns:
    m = stroke_motion(g, rate=100.0, travel=1.5)
    return {
        "Temps (ms)": (of("time", "ms"), m.time * 1e3),
        "Angle porte (°)": (of("position", "deg"), single(m.position) * DEG),
        "Vitesse angulaire (°/s)": (of("speed", "deg/s"), single(m.noisy(m.speed, g)) * DEG),
        "Courant moteur (A)": (of("current", "A"), single(m.effort) * 0.05),
        "Effort fermeture (N)": (of("force", "N"), cell(m, g)),
        "Consigne vitesse (°/s)": (of("reference_speed", "deg/s"), single(m.reference_speed) * DEG),
    }


def embedded(g: Generator) -> Columns:
    m = stroke_motion(g, rate=50.0, duration=15.0, travel=2.0)
    return {
        "millis": (of("time", "ms"), np.round(m.time * 1e3) + 5000),
        "encoder_ticks": (of("position", "count"), np.round(single(m.position) * 3000)),
        "rpm": (of("speed", "rpm"), single(m.noisy(m.speed, g)) * 60),
        "pwm": (of("torque"), np.round(single(m.speed) * 100 + single(m.effort) * 0.5)),
        "current_mA": (of("current", "mA"), np.round(single(m.effort) * 20)),
        "battery_v": (NOTHING, 12 + g.normal(0, 0.02, len(m.time))),
        "button": (NOTHING, (m.time > 5).astype(float)),
    }


def ros2(g: Generator) -> Columns:
    m = arm_motion(g, rate=100.0)
    return {
        "header.stamp": (of("time", "s"), 1.7e9 + m.time),
        **each("position_{i}", "position", "rad", m.position),
        **each("velocity_{i}", "speed", "rad/s", m.noisy(m.speed, g)),
        **each("effort_{i}", "torque", "N m", m.effort),
        **each("tcp_position_{i}", "", "", pose(m)[:, :3]),
        **each("tcp_velocity_{i}", "", "", pose_rate(m)[:, :3]),
        **each("ft_raw_{i}", "", "", wrench(m, g)),
        "safety_mode": (NOTHING, np.ones(len(m.time))),
    }


def multirate(g: Generator) -> Columns:
    m = stroke_motion(g, rate=1000.0, duration=4.0)
    f = cell(m, g)
    pos = single(m.position) * 1e3
    pos = np.where(np.arange(len(pos)) % 4 == 0, pos, np.nan)
    return {
        "Time [s]": (of("time", "s"), m.time),
        "Position [mm]": (of("position", "mm"), pos),
        "Motor speed [rpm]": (of("speed", "rpm"), single(m.noisy(m.speed, g)) / LEAD * RPM),
        "Motor torque [Nm]": (of("torque", "N m"), single(m.effort) * LEAD),
        "Force sensor [N]": (of("force", "N"), f),
    }


def swiss(g: Generator) -> Columns:
    m = stroke_motion(g, rate=200.0)
    return {
        "Zeit_s": (of("time", "s"), m.time),
        "Soll_Pos_mm": (of("reference_position", "mm"), single(m.reference_position) * 1e3),
        "Ist_Pos_mm": (of("position", "mm"), single(m.position) * 1e3),
        "Soll_Geschw_mm/s": (of("reference_speed", "mm/s"), single(m.reference_speed) * 1e3),
        "Ist_Geschw_mm/s": (of("speed", "mm/s"), single(m.noisy(m.speed, g)) * 1e3),
        "Motorstrom_A": (of("current", "A"), single(m.effort) * 0.02),
        "Schleppabstand_mm": (NOTHING, single(m.reference_position - m.position) * 1e3),
        "Kontakt": (of("label"), (m.push > 0).astype(float)),
    }


def isotime(path: Path, g: Generator) -> None:
    m = stroke_motion(g, rate=100.0, duration=8.0)
    t0 = datetime(2024, 5, 1, 12)
    rows = ["timestamp,actual_position_mm,actual_velocity_mm_s,motor_torque_pct,load_N"]
    for k in range(len(m.time)):
        stamp = (t0 + timedelta(seconds=float(m.time[k]))).isoformat(sep=" ", timespec="milliseconds")
        values = (m.position[k, 0] * 1e3, m.speed[k, 0] * 1e3, m.effort[k, 0] * 0.1, m.push[k] + g.normal())
        rows.append(",".join((stamp, *(f"{value:.4f}" for value in values))))
    path.write_text("\n".join(rows) + "\n")


def h5(path: Path, g: Generator) -> None:
    import h5py

    m = arm_motion(g, rate=200.0, duration=5.0)
    with h5py.File(path, "w") as f:
        f["timestamps"] = m.time
        f["joint_positions"] = m.position
        f["joint_velocities"] = m.noisy(m.speed, g)
        f["joint_torques"] = m.effort
        f["ee_force"] = wrench(m, g)[:, :3]


def yaskawa(g: Generator) -> Columns:
    m = arm_motion(g, rate=250.0)
    return {
        "time_us": (of("time", "us"), np.round(m.time * 1e6)),
        **by_name("fb_pulse_#", "position", "count", np.round(m.position * 2e4), "SLURBT"),
        **by_name("cmd_pulse_#", "reference_position", "count", np.round(m.reference_position * 2e4), "SLURBT"),
        **by_name("fb_speed_#", "speed", "", m.noisy(m.speed, g) * 1e3, "SLURBT"),
        **by_name("torque_#", "torque", "", m.effort * 0.5, "SLURBT"),
    }


def staubli(g: Generator) -> Columns:
    m = arm_motion(g, rate=250.0)
    return {
        "Time": (of("time", "s"), m.time),
        **each("JntPosFbk.J{n}", "position", "rad", m.position),
        **each("JntVelFbk.J{n}", "speed", "rad/s", m.noisy(m.speed, g)),
        **each("JntTrqFbk.J{n}", "torque", "N m", m.effort),
        **each("JntPosCmd.J{n}", "reference_position", "rad", m.reference_position),
        **each("JntVelCmd.J{n}", "reference_speed", "rad/s", m.reference_speed),
    }


def denso(g: Generator) -> Columns:
    m = arm_motion(g, rate=125.0)
    return {
        "No": (NOTHING, np.arange(len(m.time)) + 0.0),
        "Time[msec]": (of("time", "ms"), m.time * 1e3),
        **each("CurJnt J{n}", "position", "deg", m.position * DEG),
        **each("DestJnt J{n}", "reference_position", "deg", m.reference_position * DEG),
        **each("MotorTorque J{n}[%]", "torque", "%", m.effort),
    }


def polish(g: Generator) -> Columns:
    m = stroke_motion(g, rate=200.0)
    return {
        "czas [s]": (of("time", "s"), m.time),
        "polozenie [mm]": (of("position", "mm"), single(m.position) * 1e3),
        "predkosc [mm/s]": (of("speed", "mm/s"), single(m.noisy(m.speed, g)) * 1e3),
        "sila [N]": (of("force", "N"), cell(m, g)),
        "prad [A]": (of("current", "A"), single(m.effort) * 0.02),
    }


LAYOUTS: tuple[Layout, ...] = (
    table_layout("quantity and symbol", "German laboratory: Weg s / mm", "linear axis", lab, Table("\t", ",")),
    table_layout("units in brackets", "theta1_meas(rad), tau1_meas(N.m)", "robot", paren),
    table_layout("axes with spaces", "Axis 1 Position Actual", "robot", spaced, Table(";")),
    table_layout("letters", "t, s, v, a, F, M", "linear axis", letters),
    table_layout("french door", "French: angle, courant, effort de fermeture", "rotary axis", french, Table(";", ",")),
    table_layout("embedded", "telemetry of a microcontroller: ticks, rpm, pwm, mA", "linear axis", embedded),
    table_layout("message dump", "JointState and a force sensor as columns", "robot", ros2, Table(digits=10)),
    table_layout("two rates", "a position in every fourth row only", "linear axis", multirate),
    table_layout("swiss", "Soll and Ist with units after an underscore", "linear axis", swiss, Table(";")),
    table_layout("pulses", "pulses of the axes S, L, U, R, B, T", "robot", yaskawa),
    table_layout("feedback and command", "JntPosFbk.J1, JntPosCmd.J1", "robot", staubli),
    table_layout("current joints", "CurJnt and DestJnt in degrees", "robot", denso),
    table_layout("polish", "a language that the lexicon does not contain, with units", "linear axis", polish),
    Layout(
        "dates", "dates and times, percent of the rated torque", ".csv", "linear axis", isotime,
        {
            "timestamp": of("time"), "actual_position_mm": of("position", "mm"),
            "actual_velocity_mm_s": of("speed", "mm/s"), "motor_torque_pct": of("torque", "%"),
            "load_N": of("force", "N"),
        },
    ),
    Layout(
        "hdf5 episode", "an episode of a robot data set as HDF5 matrices", ".h5", "robot", h5,
        {
            "timestamps": of("time", "s"),
            **of_matrix("joint_positions", "position", "rad"),
            **of_matrix("joint_velocities", "speed", "rad/s"),
            **of_matrix("joint_torques", "torque", "N m"),
        },
    ),
)  # fmt: skip
