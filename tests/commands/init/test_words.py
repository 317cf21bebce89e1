"""Names of columns in several languages: their quantity, set values, measured values, and other quantities."""

from __future__ import annotations

import pytest

from cdtool.commands.init.names.words import says, what_else, word_for
from cdtool.recordings.recording import MEASURED


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


@pytest.mark.parametrize(
    "name",
    ["computed_torque_1", "gravity_model_effort", "tau_ext_hat_filtered", "跟随误差", "温度", "Spannung",
     "errore_inseguimento", "溜りパルス", "erpm", "robot_current", "actual_TCP_force_0", "tau_dot", "i_d",
     "M1_CURRENT_FEEDRATE"],
)  # fmt: skip
def test_other_quantities_than_those_of_a_joint_are_recognised(name):
    assert what_else(name)


@pytest.mark.parametrize("name", ["Tempo", "temps_ms", "tiempo", "时间", "時間[s]", "tm_ms", "duration"])
def test_clocks_are_recognised_in_seven_languages(name):
    assert says("clock", name)
