"""Names of columns in several languages: their quantity, set values, measured values, and other quantities."""

from __future__ import annotations

import pytest

from cdtool.commands.init.names.joint_names import families_by_name
from cdtool.commands.init.names.units_in_names import unit_in_name
from cdtool.commands.init.names.words import is_actual, is_current, says, what_else, word_for
from cdtool.recordings.recording import MEASURED
from cdtool.recordings.units import find_unit


def quantity_of(name):
    strengths = {quantity: word_for(quantity, name)[0] for quantity in (*MEASURED, "force")}
    best = max(strengths, key=strengths.get)
    return best if strengths[best] else ""


@pytest.mark.parametrize(
    ("quantity", "names"),
    [
        ("position", ["Türwinkel", "déplacement", "Posizione", "posición", "实际位置", "現在位置"]),
        ("position", ["ActPos", "standardhub", "actual.positions", "Extension", "height"]),
        ("position", ["Öffnungsweite", "ouverture", "ストローク"]),
        ("speed", ["joint_velocities", "actual.velocities"]),
        ("speed", ["Drehzahl", "vitesse", "Velocità", "velocidad", "电机转速", "回転数", "ActVelo", "dq_3"]),
        ("acceleration", ["Beschl.", "accélération", "accelerazione", "aceleración", "加速度", "qdd1"]),
        ("torque", ["Motorstrom", "couple moteur", "coppia", "par_motor", "力矩", "电流", "トルク", "tau_J"]),
        ("force", ["Kraft", "Force capteur", "Cella di carico", "fuerza", "接触力", "荷重", "fz", "ロードセル"]),
        ("torque", ["present_load", "spindle load", "intensité moteur", "Auslastung", "thrust"]),
        ("speed", ["q_dot", "theta_dot", "angular_rate"]),
        ("", ["level", "id", "Druck"]),
    ],
)  # fmt: skip
def test_a_quantity_is_recognised_in_seven_languages(quantity, names):
    assert {name: quantity_of(name) for name in names} == dict.fromkeys(names, quantity)


@pytest.mark.parametrize("name", ["current_pos", "CurrentVelocity", "current_joint_angle"])
def test_a_present_value_is_no_current(name):
    assert not is_current(name) and quantity_of(name) in ("position", "speed") and is_actual(name)


@pytest.mark.parametrize(
    "name",
    [
        "q_d[3]",
        "tau_J_d",
        "Sollhub",
        "setpos",
        "指令位置",
        "目標速度",
        "consigne",
        "posición_deseada",
        "planned_q1",
        "ideal_pos",
        "profile_velocity",
    ],
)
def test_set_values_are_recognised(name):
    assert says("reference", name)


@pytest.mark.parametrize("name", ["i_d", "motor_id", "actual_q_0", "settings", "speed"])
def test_other_values_are_no_set_values(name):
    assert not says("reference", name)


@pytest.mark.parametrize(
    "name",
    ["computed_torque_1", "gravity_model_effort", "tau_ext_hat_filtered", "跟随误差", "温度", "Spannung",
     "errore_inseguimento", "溜りパルス", "erpm", "robot_current", "actual_TCP_force_0", "tau_dot", "i_d",
     "M1_CURRENT_FEEDRATE"],
)  # fmt: skip
def test_other_quantities_than_those_of_a_joint_are_recognised(name):
    assert what_else(name)


@pytest.mark.parametrize("name", ["upper_arm/position", "robot_state/q_0", "external_axis_position", "lower_leg_speed"])
def test_names_of_links_and_messages_do_not_exclude_a_channel(name):
    assert not what_else(name)


@pytest.mark.parametrize("name", ["Tempo", "temps_ms", "tiempo", "时间", "時間[s]", "tm_ms", "duration"])
def test_clocks_are_recognised_in_seven_languages(name):
    assert says("clock", name)


def test_joints_are_found_by_the_part_of_the_names_that_differs():
    names = [
        f"/states/{joint}_joint/{field}" for joint in ("elbow", "wrist_1", "base") for field in ("position", "effort")
    ]
    families = families_by_name(names)
    joints = ("elbow_joint", "wrist_1_joint", "base_joint")
    assert {part[0] for part in families.values()} == {joints}
    assert {part[1] for part in families.values()} == {
        tuple(f"/states/{joint}/{field}" for joint in joints) for field in ("position", "effort")
    }


@pytest.mark.parametrize(
    "names",
    [
        ["motor_position", "load_position", "motor_speed", "load_speed"],
        ["field.gear_position", "field.joint_position", "field.gear_velocity", "field.joint_velocity"],
        ["pose_x", "pose_y", "velocity_x", "velocity_y", "position_x", "position_y"],
        ["actual_position", "target_position", "actual_speed", "target_speed"],
        ["position", "speed", "torque"],
    ],
    ids=["two sides of a gear", "two sides in messages", "Cartesian axes", "set values", "one joint"],
)
def test_other_differences_are_no_joints(names):
    assert families_by_name(names) == {}


def test_joints_of_a_body_are_joints_by_one_quantity_alone():
    families = families_by_name(["time_ms", "theta_toe", "theta_ankle", "theta_knee", "force"])
    assert families["theta_#"][0] == ("toe", "ankle", "knee")
    assert families_by_name(["angle_leaf", "angle_handle"]) == {}


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("PositionMeters", "position", "m"),
        ("VelocityMetersPerSec", "speed", "m/s"),
        ("StatorCurrentAmps", "torque", "A"),
        ("joint velocity radians_per_second", "speed", "rad/s"),
        ("MotorA", "torque", ""),
        ("positionM", "position", ""),
    ],
)
def test_units_that_are_written_out_end_a_name_in_mixed_case(name, quantity, unit):
    assert find_unit(unit_in_name(quantity, name)) == find_unit(unit)
