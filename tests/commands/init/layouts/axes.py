"""Look-alikes of logs of single axes and of machine tools: benches, drives, gates, presses, in several languages."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.random import Generator

from tests.commands.init.layouts.layout import Columns, FloatArray, Layout, Table, Truth, table_layout
from tests.commands.init.layouts.motion import RPM, Motion, arm_motion, quantised, stroke_motion

NOTHING = Truth()
LEAD = 0.010 / (2.0 * np.pi)  # travel per motor angle [m/rad] of a spindle with 10 mm per turn


def single(values: FloatArray) -> FloatArray:
    """Return the only joint's values (n,)."""
    return values[:, 0]


def cell(motion: Motion, generator: Generator, offset: float = 2.0) -> FloatArray:
    """Return what a load cell shows [N]: the push, an offset and noise."""
    return motion.push + offset + generator.normal(0.0, 0.8, len(motion.time))


def named(generator: Generator, motion: Motion, names: Sequence[str], units: Sequence[str]) -> Columns:
    """Return columns time, position, speed, torque, force, reference position of an axis in SI-near units."""
    values = (
        motion.time, single(motion.position), single(motion.noisy(motion.speed, generator)), single(motion.effort),
        cell(motion, generator), single(motion.reference_position),
    )  # fmt: skip
    factors = {"s": 1.0, "ms": 1e3, "mm": 1e3, "m": 1.0, "mm/s": 1e3, "m/s": 1.0, "N": 1.0}
    channels = ("time", "position", "speed", "torque", "force", "reference_position")
    return {
        name: (Truth(channel, unit=unit), value * factors[unit])
        for name, channel, unit, value in zip(names, channels, units, values, strict=True)
    }


def german_gate(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=1000.0)
    return {
        "Zeit [s]": (Truth("time", unit="s"), m.time),
        "Drehmoment [Nm]": (Truth("torque", unit="N m"), single(m.effort) * LEAD),
        "Drehzahl [1/min]": (Truth("speed", unit="rpm"), single(m.noisy(m.speed, generator)) / LEAD * RPM),
        "Beschl. [m/s²]": (Truth("acceleration", unit="m/s2"), single(m.noisy(m.acceleration, generator, 0.01))),
        "Kraft [N]": (Truth("force", unit="N"), cell(m, generator)),
    }


def german_door(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=200.0, travel=1.6, inertia=30.0)
    return {
        "Messzeit/ms": (Truth("time", unit="ms"), m.time * 1e3),
        "Türwinkel/°": (Truth("position", unit="deg"), quantised(single(m.position) * 180 / np.pi, 0.05)),
        "Winkelgeschw./°/s": (Truth("speed", unit="deg/s"), single(m.noisy(m.speed, generator)) * 180 / np.pi),
        "Motorstrom/A": (Truth("current", unit="A"), single(m.effort) * 0.05),
        "Sollwinkel/°": (Truth("reference_position", unit="deg"), single(m.reference_position) * 180 / np.pi),
        "Schließkraft/N": (Truth("force", unit="N"), cell(m, generator)),
        "Spannung/V": (NOTHING, 24.0 + generator.normal(0.0, 0.1, len(m.time))),
        "Temperatur/°C": (NOTHING, 31.0 + 0.01 * m.time),
    }


def french_bench(generator: Generator) -> Columns:
    m = stroke_motion(generator)
    names = (
        "Temps (s)",
        "Position (mm)",
        "Vitesse (mm/s)",
        "Effort moteur (N)",
        "Force capteur (N)",
        "Consigne position (mm)",
    )
    return named(generator, m, names, ("s", "mm", "mm/s", "N", "N", "mm"))


def french_motor(generator: Generator) -> Columns:
    m = stroke_motion(generator)
    return {
        "temps_ms": (Truth("time", unit="ms"), m.time * 1e3),
        "deplacement_mm": (Truth("position", unit="mm"), single(m.position) * 1e3),
        "vitesse_rotation_tr_min": (Truth("speed", unit="rpm"), single(m.noisy(m.speed, generator)) / LEAD * RPM),
        "couple_moteur_Nm": (Truth("torque", unit="N m"), single(m.effort) * LEAD),
        "courant_A": (Truth("current", unit="A"), single(m.effort) * 0.02),
        "temperature": (NOTHING, 30.0 + 0.1 * m.time),
    }


def italian_gate(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=250.0)
    names = (
        "Tempo [ms]",
        "Posizione [mm]",
        "Velocità [mm/s]",
        "Forza motore [N]",
        "Cella di carico [N]",
        "Posizione target [mm]",
    )
    return named(generator, m, names, ("ms", "mm", "mm/s", "N", "N", "mm"))


def italian_axis(generator: Generator) -> Columns:
    m = stroke_motion(generator, travel=2.0, inertia=3.0, friction=2.0)
    return {
        "tempo": (Truth("time", unit="s"), m.time),
        "angolo": (Truth("position", unit="rad"), single(m.position)),
        "velocita": (Truth("speed", unit="rad/s"), single(m.noisy(m.speed, generator))),
        "coppia": (Truth("torque", unit="N m"), single(m.effort)),
        "coppia_riferimento": (Truth("reference_torque", unit="N m"), single(m.model_effort)),
        "errore_inseguimento": (NOTHING, single(m.reference_position - m.position)),
    }


def spanish_door(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=100.0)
    names = ("tiempo_s", "posición_m", "velocidad_m_s", "fuerza_motor_N", "celda_de_carga_N", "posición_deseada_m")
    return named(generator, m, names, ("s", "m", "m/s", "N", "N", "m"))


def chinese_servo(generator: Generator) -> Columns:
    m = stroke_motion(generator)
    return {
        "时间(ms)": (Truth("time", unit="ms"), m.time * 1e3),
        "实际位置(mm)": (Truth("position", unit="mm"), single(m.position) * 1e3),
        "指令位置(mm)": (Truth("reference_position", unit="mm"), single(m.reference_position) * 1e3),
        "实际速度(mm/s)": (Truth("speed", unit="mm/s"), single(m.noisy(m.speed, generator)) * 1e3),
        "电机电流(A)": (Truth("current", unit="A"), single(m.effort) * 0.02),
        "跟随误差(mm)": (NOTHING, single(m.reference_position - m.position) * 1e3),
        "温度(℃)": (NOTHING, 35.0 + 0.05 * m.time),
        "接触力(N)": (Truth("force", unit="N"), cell(m, generator)),
    }


def japanese_servo(generator: Generator) -> Columns:
    m = stroke_motion(generator)
    return {
        "時間[s]": (Truth("time", unit="s"), m.time),
        "指令位置[mm]": (Truth("reference_position", unit="mm"), single(m.reference_position) * 1e3),
        "現在位置[mm]": (Truth("position", unit="mm"), single(m.position) * 1e3),
        "速度[mm/s]": (Truth("speed", unit="mm/s"), single(m.noisy(m.speed, generator)) * 1e3),
        "トルク[%]": (Truth("torque", unit="%"), single(m.effort) * 0.3),
        "荷重[N]": (Truth("force", unit="N"), cell(m, generator)),
        "位置偏差[mm]": (NOTHING, single(m.reference_position - m.position) * 1e3),
    }


def twincat(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=500.0, duration=4.0)
    return {
        "Time [ms]": (Truth("time", unit="ms"), m.time * 1e3),
        "Axis 1.NcToPlc.ActPos": (Truth("position", unit="mm"), single(m.position) * 1e3),
        "Axis 1.NcToPlc.ActVelo": (Truth("speed", unit="mm/s"), single(m.noisy(m.speed, generator)) * 1e3),
        "Axis 1.NcToPlc.SetPos": (Truth("reference_position", unit="mm"), single(m.reference_position) * 1e3),
        "Axis 1.NcToPlc.SetVelo": (Truth("reference_speed", unit="mm/s"), single(m.reference_speed) * 1e3),
        "Axis 1.NcToPlc.PosDiff": (NOTHING, single(m.reference_position - m.position) * 1e3),
        "Drive 1.Torque actual value": (Truth("torque"), np.round(single(m.effort) * 5.0)),
        "Axis 1.NcToPlc.StateDWord": (NOTHING, np.full(len(m.time), 32775.0)),
        "GVL.fLoadCell": (Truth("force", unit="N"), cell(m, generator)),
    }


def sinamics(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=250.0)
    return {
        "Zeit [ms]": (Truth("time", unit="ms"), m.time * 1e3),
        "r0062: Drehzahlsollwert nach Filter [1/min]": (
            Truth("reference_speed", unit="rpm"),
            single(m.reference_speed) / LEAD * RPM,
        ),
        "r0063: Drehzahlistwert geglättet [1/min]": (
            Truth("speed", unit="rpm"),
            single(m.noisy(m.speed, generator)) / LEAD * RPM,
        ),
        "r0079: Drehmomentsollwert gesamt [Nm]": (Truth("reference_torque", unit="N m"), single(m.model_effort) * LEAD),
        "r0080: Drehmomentistwert [Nm]": (Truth("torque", unit="N m"), single(m.effort) * LEAD),
        "r0078: Stromistwert momentenbildend [A]": (Truth("current", unit="A"), single(m.effort) * LEAD * 2.0),
        "r0026: Zwischenkreisspannung geglättet [V]": (NOTHING, 560.0 + generator.normal(0.0, 1.0, len(m.time))),
    }


def sinumerik(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=250.0)
    return {
        "time": (Truth("time", unit="s"), m.time),
        "/Channel/MachineAxis/actToolBasePos[u1]": (NOTHING, single(m.position) * 1e3 + 3.0),
        "ENC1_POS|1": (Truth("position", unit="mm"), single(m.position) * 1e3),
        "DES_POS|1": (Truth("reference_position", unit="mm"), single(m.reference_position) * 1e3),
        "VEL_FFW|1": (NOTHING, single(m.reference_speed) * 1e3),
        "CURRENT|1": (Truth("current", unit="A"), single(m.effort) * 0.02),
        "TORQUE|1": (Truth("torque", unit="N m"), single(m.effort) * LEAD),
        "CONT_DEV|1": (NOTHING, single(m.reference_position - m.position) * 1e3),
        "POWER|1": (NOTHING, single(m.effort * m.speed)),
        "LOAD|1": (NOTHING, np.abs(single(m.effort)) * 0.3),
    }


def ctrlx(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=500.0)
    return {
        "Time/us": (Truth("time", unit="us"), m.time * 1e6),
        "Axis1/S-0-0051 Position feedback value 1/mm": (Truth("position", unit="mm"), single(m.position) * 1e3),
        "Axis1/S-0-0047 Position command value/mm": (
            Truth("reference_position", unit="mm"),
            single(m.reference_position) * 1e3,
        ),
        "Axis1/S-0-0040 Velocity feedback value/mm/min": (
            Truth("speed", unit="mm/min"),
            single(m.noisy(m.speed, generator)) * 6e4,
        ),
        "Axis1/S-0-0084 Torque feedback value/%": (Truth("torque", unit="%"), single(m.effort) * 0.2),
        "Axis1/S-0-0189 Following distance/mm": (NOTHING, single(m.reference_position - m.position) * 1e3),
    }


def br_trace(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=400.0)
    return {
        "Time": (Truth("time", unit="s"), m.time),
        "gAxis01:PCTRL_S_ACT [Units]": (Truth("position", unit="mm"), np.round(single(m.position) * 1e3, 2)),
        "gAxis01:PCTRL_S_SET [Units]": (Truth("reference_position", unit="mm"), single(m.reference_position) * 1e3),
        "gAxis01:PCTRL_LAG_ERROR [Units]": (NOTHING, single(m.reference_position - m.position) * 1e3),
        "gAxis01:SCTRL_SPEED_ACT [1/s]": (
            Truth("speed", unit="rev/s"),
            single(m.noisy(m.speed, generator)) / LEAD / (2 * np.pi),
        ),
        "gAxis01:ICTRL_ISQ_ACT [A]": (Truth("current", unit="A"), single(m.effort) * LEAD * 2.0),
        "gAxis01:ICTRL_ISD_ACT [A]": (NOTHING, generator.normal(0.0, 0.02, len(m.time))),
        "gAxis01:TORQUE_ACT [Nm]": (Truth("torque", unit="N m"), single(m.effort) * LEAD),
        "gAxis01:UDC_ACT [V]": (NOTHING, 560.0 + generator.normal(0.0, 1.0, len(m.time))),
        "gAxis01:TEMP_MOTOR [°C]": (NOTHING, 40.0 + 0.01 * m.time),
    }


def labview(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=1000.0, duration=4.0)
    return {
        "X_Value": (Truth("time", unit="s"), m.time),
        "Drive/Position (Formula)": (Truth("position", unit="mm"), single(m.position) * 1e3),
        "Drive/Velocity": (Truth("speed", unit="mm/s"), single(m.noisy(m.speed, generator)) * 1e3),
        "Drive/MotorCurrent": (Truth("current", unit="A"), single(m.effort) * 0.02),
        "cDAQ1Mod1/ai0 LoadCell": (Truth("force", unit="N"), cell(m, generator)),
        "cDAQ1Mod1/ai1": (NOTHING, generator.normal(0.0, 1e-3, len(m.time))),
        "Comment": (NOTHING, np.zeros(len(m.time))),
    }


def matlab_table(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=200.0, travel=2.2, inertia=2.0, friction=1.0)
    return {
        "t": (Truth("time", unit="s"), m.time),
        "theta": (Truth("position", unit="rad"), quantised(single(m.position), 2 * np.pi / 2048)),
        "theta_ref": (Truth("reference_position", unit="rad"), single(m.reference_position)),
        "omega": (Truth("speed", unit="rad/s"), single(m.noisy(m.speed, generator, 0.01))),
        "i_q": (Truth("current", unit="A"), single(m.effort) * 0.4),
        "i_d": (NOTHING, generator.normal(0.0, 0.02, len(m.time))),
        "u_q": (NOTHING, single(m.speed) * 2.0 + single(m.effort) * 0.1),
    }


def cnc_mill(generator: Generator) -> Columns:
    """Four axes without a clock; CurrentFeedback is a current, CURRENT_FEEDRATE the present one."""
    m = arm_motion(generator, 4, rate=10.0, duration=90.0, push=0.0)
    found: dict[str, tuple[Truth, FloatArray]] = {}
    for j, axis in enumerate(("X1", "Y1", "Z1", "S1")):
        groups = {
            "ActualPosition": ("position", "mm", m.position * 50.0),
            "ActualVelocity": ("speed", "mm/s", m.noisy(m.speed, generator) * 50.0),
            "ActualAcceleration": ("acceleration", "mm/s2", m.noisy(m.acceleration, generator, 0.02) * 50.0),
            "CommandPosition": ("reference_position", "mm", m.reference_position * 50.0),
            "CommandVelocity": ("reference_speed", "mm/s", m.reference_speed * 50.0),
            "CommandAcceleration": ("", "", m.reference_acceleration * 50.0),
            "CurrentFeedback": ("current", "A", m.effort * 0.3),
            "DCBusVoltage": ("", "", 0.07 + 1e-3 * np.abs(m.effort)),
            "OutputCurrent": ("current", "A", 327.0 + 0.01 * m.effort),
            "OutputVoltage": ("", "", np.abs(m.speed) * 10.0),
            "OutputPower": ("", "", m.effort * m.speed * 1e-3),
        }
        for name, (channel, unit, values) in groups.items():
            found[f"{axis}_{name}"] = (Truth(channel, axis if channel else "", unit), values[:, j])
    found["M1_CURRENT_PROGRAM_NUMBER"] = (NOTHING, np.ones(len(m.time)))
    found["M1_sequence_number"] = (NOTHING, np.floor(m.time / 3.0))
    found["M1_CURRENT_FEEDRATE"] = (NOTHING, 6.0 + 44.0 * (m.time > 5.0))
    return found


def servo_press(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=500.0, duration=3.0, travel=0.12, inertia=80.0, friction=120.0, push=2500.0)
    return {
        "Time (s)": (Truth("time", unit="s"), m.time),
        "Ram position (mm)": (Truth("position", unit="mm"), single(m.position) * 1e3),
        "Ram speed (mm/s)": (Truth("speed", unit="mm/s"), single(m.noisy(m.speed, generator)) * 1e3),
        "Press force (kN)": (Truth("force", unit="kN"), cell(m, generator, 20.0) * 1e-3),
        "Motor torque (%)": (Truth("torque", unit="%"), single(m.effort) * 0.02),
        "Step": (NOTHING, np.floor(m.time)),
    }


def px4_actuator(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=50.0, duration=12.0, travel=1.2)
    return {
        "timestamp": (Truth("time", unit="us"), np.round(m.time * 1e6) + 181422000.0),
        "x": (Truth("position", unit="m"), single(m.position)),
        "y": (NOTHING, generator.normal(0.0, 0.01, len(m.time))),
        "z": (NOTHING, -2.0 + generator.normal(0.0, 0.01, len(m.time))),
        "vx": (Truth("speed", unit="m/s"), single(m.noisy(m.speed, generator))),
        "vy": (NOTHING, generator.normal(0.0, 0.01, len(m.time))),
        "vz": (NOTHING, generator.normal(0.0, 0.01, len(m.time))),
        "ax": (Truth("acceleration", unit="m/s2"), single(m.noisy(m.acceleration, generator, 0.01))),
        "ay": (NOTHING, generator.normal(0.0, 0.05, len(m.time))),
        "az": (NOTHING, generator.normal(0.0, 0.05, len(m.time))),
        "heading": (NOTHING, 0.3 + generator.normal(0.0, 0.001, len(m.time))),
        "eph": (NOTHING, np.full(len(m.time), 0.4)),
        "xy_valid": (NOTHING, np.ones(len(m.time))),
    }


def odrive(generator: Generator) -> Columns:
    m = stroke_motion(generator, rate=100.0, duration=10.0, travel=9.0, inertia=0.02, friction=0.3, push=0.0)
    return {
        "time": (Truth("time", unit="s"), m.time),
        "axis0.encoder.pos_estimate": (Truth("position", unit="rev"), single(m.position)),
        "axis0.encoder.vel_estimate": (Truth("speed", unit="rev/s"), single(m.noisy(m.speed, generator))),
        "axis0.controller.pos_setpoint": (Truth("reference_position", unit="rev"), single(m.reference_position)),
        "axis0.motor.current_control.Iq_measured": (Truth("current", unit="A"), single(m.effort) * 5.0),
        "axis0.motor.current_control.Iq_setpoint": (Truth("reference_torque", unit="A"), single(m.model_effort) * 5.0),
        "axis0.motor.current_control.Id_measured": (NOTHING, generator.normal(0.0, 0.05, len(m.time))),
        "vbus_voltage": (NOTHING, 24.0 + generator.normal(0.0, 0.02, len(m.time))),
    }


def sampled_at_rest(generator: Generator) -> Columns:
    """A bench with a clock that counts samples and a second axis that stands still and only quivers."""
    m = stroke_motion(generator, rate=500.0)
    return {
        "Sample": (Truth("time"), np.arange(len(m.time), dtype=float)),
        "Axis A position [mm]": (Truth("position", unit="mm"), single(m.position) * 1e3),
        "Axis A velocity [mm/s]": (Truth("speed", unit="mm/s"), single(m.noisy(m.speed, generator)) * 1e3),
        "Axis A drive force [N]": (Truth("torque", unit="N"), single(m.effort)),
        "Axis B position [mm]": (NOTHING, 120.0 + 0.2 * np.exp(-(((m.time - 2.0) / 0.02) ** 2))),
        "force_x [N]": (Truth("force", unit="N"), cell(m, generator)),
    }


def emps(path: Path, generator: Generator) -> None:
    """Write a MAT file with the names of the EMPS data set: set value qg, position qm, force vir, time t, pulses."""
    import scipy.io

    m = stroke_motion(generator, rate=1000.0, duration=6.0, travel=0.24, inertia=95.0, friction=20.0, push=0.0)
    content = {
        "qg": m.reference_position,
        "qm": quantised(m.position, 1e-5),
        "vir": m.effort,
        "t": m.time[:, np.newaxis],
    }
    scipy.io.savemat(path, {**content, "gtau": 35.15})


def position_only(generator: Generator) -> Columns:
    """An encoder's coarse counts on a clock that jitters: the speed must be derived."""
    m = stroke_motion(generator, rate=200.0)
    return {
        "t_ms": (Truth("time", unit="ms"), np.sort(m.time * 1e3 + generator.uniform(-0.8, 0.8, len(m.time)))),
        "encoder_counts": (Truth("position", unit="count"), np.round(single(m.position) * 4000.0)),
        "motor_current_mA": (Truth("current", unit="mA"), single(m.effort) * 20.0),
        "loadcell": (Truth("force"), cell(m, generator)),
    }


LAYOUTS: tuple[Layout, ...] = (
    table_layout(
        "german gate", "bench of a gate: Zeit, Drehmoment, Drehzahl, Beschl., Kraft",
        "linear axis", german_gate, Table(";", ","),
    ),
    table_layout(
        "german door", "door drive with units after a slash and a temperature",
        "rotary axis", german_door, Table(";", ",", encoding="cp1252"),
    ),
    table_layout(
        "french bench", "French bench: Temps, Vitesse, Effort moteur, Consigne",
        "linear axis", french_bench, Table(";", ","),
    ),
    table_layout("french motor", "French motor log with units at the ends of names", "linear axis", french_motor),
    table_layout(
        "italian gate", "Italian gate: Tempo, Posizione, Velocità, Cella di carico",
        "linear axis", italian_gate, Table(";", ","),
    ),
    table_layout("italian axis", "Italian rotary axis without units", "rotary axis", italian_axis),
    table_layout("spanish door", "Spanish sliding door with units at the ends of names", "linear axis", spanish_door),
    table_layout("chinese servo", "export of a Chinese servo tool", "linear axis", chinese_servo),
    table_layout("japanese servo", "export of a Japanese servo tool", "linear axis", japanese_servo),
    table_layout(
        "twincat scope", "TwinCAT Scope: NcToPlc names, one time column",
        "linear axis", twincat, Table("\t"),
    ),
    table_layout(
        "sinamics trace", "SINAMICS trace with parameter numbers, German",
        "linear axis", sinamics, Table(";", ","),
    ),
    table_layout("sinumerik trace", "SINUMERIK trace: ENC1_POS, DES_POS, CURRENT, TORQUE", "linear axis", sinumerik),
    table_layout("ctrlx", "Bosch Rexroth oscilloscope with S parameters", "linear axis", ctrlx, Table(";")),
    table_layout("b&r trace", "B&R trace of ACOPOS parameters", "linear axis", br_trace, Table(";")),
    table_layout("labview", "LabVIEW bench: X_Value and DAQ channels", "linear axis", labview, Table("\t")),
    table_layout("matlab table", "writetable of a rotary bench: theta, omega, i_q", "rotary axis", matlab_table),
    table_layout(
        "cnc mill", "CNC mill tool wear of the University of Michigan: four axes, no clock, 10 Hz",
        "robot", cnc_mill,
    ),
    table_layout("servo press", "servo press: ram position, speed, force in kN", "linear axis", servo_press),
    table_layout("px4", "vehicle_local_position of PX4 as CSV", "linear axis", px4_actuator),
    table_layout("odrive", "ODrive telemetry in turns", "rotary axis", odrive),
    table_layout(
        "axis at rest", "two-axis bench, one axis at rest, a sample counter",
        "linear axis", sampled_at_rest, Table(";"),
    ),
    table_layout("counts only", "encoder counts and current on a jittered clock", "linear axis", position_only),
    Layout(
        "emps", "EMPS identification data of a servo slide, MAT", ".mat", "linear axis", emps,
        {
            "qg": Truth("reference_position", unit="m"), "qm": Truth("position", unit="m"),
            "vir": Truth("torque"), "t": Truth("time", unit="s"), "gtau": NOTHING,
        },
    ),
)  # fmt: skip
