"""Words for quantities in names of columns: English, German, French, Italian, Spanish, Chinese and Japanese.

All are in lower case and without accents, as `quantity_words.words` returns them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping


def _listed(*lines: str) -> tuple[str, ...]:
    return tuple(word for line in lines for word in line.split())


# Words that are sufficient alone, also inside a longer one: `motordrehzahl`.
LONG: Mapping[str, tuple[str, ...]] = {
    "position": _listed(
        "position angle travel displacement extension elongation stroke crosshead opening height azimuth",
        "winkel stellung lageist offnung hohe",
        "deplacement ouverture hauteur",
        "posizione angolo corsa spostamento apertura altezza",
        "posicion angulo desplazamiento carrera recorrido altura",
        "位置 角度 转角 位移 行程 开度 高度",
        "変位 エンコーダ ストローク 移動量",
    ),
    "speed": _listed(
        "speed velocit omega qdot thetadot phidot angularrate jointrate yawrate",
        "geschw drehzahl",
        "vitesse regime",
        "velocidad",
        "速度 转速 轉速 角速",
        "回転数",
    ),
    "acceleration": _listed("accel", "beschl", "acelerac", "加速"),
    "torque": _listed(
        "torque moment effort current driveforce thrust presentload motorload driveload axisload spindleload servoload",
        "drehmoment strom antriebskraft auslastung",
        "couple courant intensite",
        "coppia corrente",
        "corriente esfuerzo",
        "扭力 转矩 轉矩 扭矩 力矩 电流 電流",
        "トルク",
    ),
    "force": _listed(
        "loadcell force wrench dynamometer",
        "kraft messdose wagezelle waegezelle",
        "capteurdeffort capteureffort effortcapteur",
        "forza celladicarico cellacarico spinta",
        "fuerza celdadecarga celuladecarga celdacarga",
        "力",
        "荷重 ロードセル",
    ),
    "label": _listed(
        "label contact collision", "kontakt kollision", "contatto", "contacto colision", "碰撞 接触", "衝突"
    ),
    "trigger": ("trigger",),
}
# Words that must be separate.
SHORT: Mapping[str, tuple[str, ...]] = {
    "position": _listed(
        "pos posn phi theta th q qm qmsr x s p mp jp ip ang enc encoder", "weg lage hub geber drehgeber", "course quota"
    ),
    "speed": _listed("mv jv qd dq qp qdot dphi dtheta thetad thetadot w n v vx vel velo spd rpm vit", "giri"),
    "acceleration": _listed("acc acel qdd ddq qddot ddtheta ax ay az a"),
    "torque": _listed("tau trq tor tq eff mt jt iq isq i m pwm duty u amps amp curr cur iist im", "par"),
    "force": _listed("cell f fx fy fz", "dms"),
    "label": (),
    "trigger": ("trig",),
}
# Endings of words that are written together: `actpos`, `sollhub`, `motorweg`.
ENDINGS: Mapping[str, tuple[str, ...]] = {
    "position": _listed("pos weg hub lage"),
    "speed": _listed("vel velo spd rpm drehz"),
    "acceleration": ("acc",),
    "torque": _listed("torq trq curr"),
}
# Words of one quantity inside those of another one.
LONGER: Mapping[str, tuple[str, ...]] = {
    "力": _listed("力矩 扭力 动力 电力 電力 压力 圧力"),
    "速度": ("加速度",),
    "角速": ("角加速",),
    "moment": _listed("momentum momentan"),
    "couple": _listed("coupled coupler coupling"),
    "vel": ("level",),
}
REFERENCE_LONG = _listed(
    "target desired command setpoint reference nominal planned ideal theoretic profile interpolat",
    "soll vorgabe fuhrungs",
    "consigne",
    "riferimento obiettivo impostat",
    "consigna desead referencia objetivo",
    "指令 目标 给定 设定 参考 期望 规划",
    "目標 設定",
)
REFERENCE_SHORT = _listed("ref des dest cmd sp ip goal qg set demand dem ipo cons traj trajectory action")
REFERENCE_STARTS = _listed("set cmd ref des tgt goal dem")
ACTUAL_LONG = _listed(
    "actual measured feedback estimate",
    "gemessen ruckmeld",
    "mesure",
    "misurat attuale effettiv rilevat",
    "medid",
    "实际 實際 反馈 测量 实测 当前",
    "現在 実際 実測",
)
ACTUAL_SHORT = _listed("act meas msr fb fbk present real reel reale")
ACTUAL_STARTS = _listed("act meas fb ist")
LOAD_CELL = _listed(
    "loadcell forcesensor wrench dynamometer",
    "kraftmess kraftsensor messdose wagezelle waegezelle",
    "capteur",
    "celladicarico cellacarico",
    "celdadecarga celuladecarga celdacarga",
    "接触力",
    "荷重 ロードセル",
)
CONTACT_PRESSURES = _listed(
    "contactpressure peakpressure pressurefilm impactpressure",
    "kontaktdruck spitzendruck druckspitze flachenpressung flachendruck druckfolie",
    "pressioncontact pressiondecontact pressionedicontatto pressionecontatto presiondecontacto presioncontacto",
    "接触压力 接触圧",
)
DRIVES = _listed("drive motor actuator", "antrieb", "moteur", "motore", "电机 電機", "モータ")
FORCES = _listed("force kraft forza fuerza effort")
CURRENTS = _listed("strom courant corrente corriente 电流 電流")
CURRENTS_SHORT = _listed("i iq isq amps amp curr cur")
ANGLES = _listed("angle angular omega motor encoder", "winkel drehzahl", "angolo", "angulo", "角 转速 回転")
# A generalised coordinate (q, qd) may be either.
ANGLES_SHORT = _listed("phi theta rot ang enc n rpm w dphi dtheta deg rad joint rev turns")
LENGTHS = _listed("travel displacement stroke linear deplacement spostamento corsa desplazamiento 行程")
LENGTHS_SHORT = _listed("weg hub x s")
CLOCKS = re.compile(r"time|zeit|stamp|clock|elapsed|epoch|时间|時間|時刻|时刻|タイム")
CLOCKS_SHORT = _listed("t ts tps ticks tick tempo temps tiempo duration tm sec secs seconds millis micros utc")
COUNTERS = _listed("tick count zahler zaehler sample index cycle zyklus seqno 序号 サンプル")
# Nouns after `current` that make it an adjective: the present one.
PRESENT = _listed("feed feedrate program line block state mode step tool time cycle pose value location target")
PRESENT_EFFORTS = _listed("torque effort force q angle")
# Names of joints without a quantity: `J1`, `Achse 3`.
JOINTS = _listed("j jnt joint joints axis achse a axe asse eje 轴 軸")
# Joints of arms, legs and hands.
LIMBS = frozenset(
    _listed(
        "hip knee ankle toe foot thigh shank calf leg trunk waist torso neck head shoulder elbow forearm wrist hand",
        "finger thumb index base lift pan tilt gripper roll pitch yaw left right front rear",
    )
)
# Sides and versions of one joint, which are not joints, and the axes of space.
SIDES = _listed(
    "motor load link joint drive gear shaft raw filtered filt smooth smoothed mean min max in out input output",
    "real sim simulated model",
)
# Inertial sensors: of a trunk, a tool or a leg, rarely of a joint.
INERTIAL = _listed("imu gyro gyr gyroscope")
# Sides of a gear or a spring, of which each may have an encoder.
GEAR_SIDES = _listed("motor load link joint drive gear shaft input output rotor")
# Efforts of a rotation.
TWISTS = _listed(
    "torque moment",
    "drehmoment",
    "couple",
    "coppia",
    "转矩 轉矩 扭矩 力矩",
    "トルク",
)
AXES = _listed("x y z a b c u v w rx ry rz roll pitch yaw")
# What is in logs of machines without being a channel of a joint, and patterns of it in words joined by `_`.
OTHERS: tuple[tuple[str, re.Pattern[str]], ...] = (
    (
        "a tool or Cartesian value",
        re.compile(
            r"tcp|tool|(?:^|_)(?:ee|eef|flange|cart|cartpos|rpy|quat|quaternion|twist|cartesian)(?:_|$)"
            r"|o_t_e|(?:^|_)[ok]_f(?:_|$)|orientation|pose(?:_|$)"
        ),
    ),
    ("a temperature", re.compile(r"temp(?:_|$|s|er)|温度")),
    (
        "a following error",
        re.compile(
            r"schlepp|following|deviation|abweichung|error|err(?:_|$)|(?:^|_)lag(?:_|$)|diff(?:_|$)|(?:^|_)dev(?:_|$)"
            r"|ecart|erreur|errore|inseguimento|seguimiento|误差|誤差|偏差|溜り|溜まり|滞留"
        ),
    ),
    (
        "a voltage",
        re.compile(
            r"volt|spannung|(?:^|_)tension|voltaj|电压|電圧|(?:^|_)u_?dc|(?:^|_)v?bus(?:_|$)|(?:^|_)u_?[qd](?:_|$)|(?:^|_)uz?k(?:_|$)"
        ),
    ),
    ("a pressure", re.compile(r"(?:^|_)(?:pressure|druck|pression|pressione|presion)(?:_|$)")),
    ("a power", re.compile(r"power|leistung|puissance|potenza|potencia|功率|電力")),
    (
        "a modelled or external value",
        re.compile(
            r"(?:^|_)(?:computed|predicted|expected|simulated|sim|gravity|hysteresis|crosstalk|ffw?|feedforward|disturbance|friction|residual|inertia"
            r"|coriolis|storung|perturba)(?:_|$)"
            r"|^(?=.*(?:torque|tau|effort|force|moment|wrench|couple|coppia|(?:^|_)f(?:_|$)))"
            r".*(?:ext(?:_|$|msr)|external|(?:^|_)hat(?:_|$)|(?:^|_)model(?:_|$))"
        ),
    ),
    ("an electrical speed", re.compile(r"(?:^|_)erpm(?:_|$)")),
    ("the current of the cabinet", re.compile(r"(?:robot|io|system|bus|supply|battery|main|input)_current")),
    ("a flux-forming current", re.compile(r"(?:^|_)(?:i_?s?d|motor_id)(?:_|$)")),
    ("a rate of an effort", re.compile(r"(?:^|_)(?:dtau|taud|tau_dot|torque_rate|jerk)(?:_|$)")),
    (
        "a state of the controller",
        re.compile(
            r"covariance|layout|register|bits|mode(?:_|$)|payload|momentum|(?:status|state)(?:_?d?_?word)?$|valid|program"
            r"|sequence|feed_?rate|success|performance|scaling|delay|control_output|limit"
        ),
    ),
)
