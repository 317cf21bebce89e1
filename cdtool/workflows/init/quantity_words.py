"""Guess the quantity of a column from its name: English, German, French, Italian, Spanish, Chinese and Japanese.

Names are compared in lower case and without accents (`Velocità` is `velocita`, `Türwinkel` is `turwinkel`).
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from functools import lru_cache

# Words that are sufficient alone, also inside a longer one (`motordrehzahl`), and short ones that must be separate.
_LONG: Mapping[str, tuple[str, ...]] = {
    "position": (
        "position", "angle", "winkel", "stellung", "travel", "displacement", "posizione", "posicion",
        "angolo", "angulo", "corsa", "deplacement", "desplazamiento", "spostamento", "位置", "角度", "位移", "変位", "行程",
    ),
    "speed": (
        "speed", "velocity", "geschw", "drehzahl", "omega", "vitesse", "velocita", "velocidad", "regime", "rotspeed",
        "速度", "转速", "轉速", "回転数", "角速",
    ),
    "acceleration": (
        "accel", "beschl", "acelerac", "加速",
    ),
    "torque": (
        "torque", "drehmoment", "moment", "effort", "current", "strom", "antriebskraft", "driveforce", "couple",
        "courant", "coppia", "corrente", "corriente", "转矩", "轉矩", "扭矩", "力矩", "电流", "電流", "トルク",
    ),
    "force": (
        "loadcell", "kraftmess", "messdose", "wagezelle", "waegezelle", "kraft", "force", "wrench", "forza", "fuerza",
        "celladicarico", "celdadecarga", "celuladecarga", "capteurdeffort", "dynamometer", "力", "荷重",
    ),
    "label": ("label", "contact", "kontakt", "collision", "kollision", "contatto", "contacto", "碰撞", "接触", "衝突"),
    "trigger": ("trigger",),
}  # fmt: skip
_SHORT: Mapping[str, tuple[str, ...]] = {
    "position": ("pos", "posn", "phi", "theta", "q", "enc", "encoder", "geber", "drehgeber", "weg", "lage", "hub", "qm", "x", "s", "ang", "qmsr", "pose"),
    "speed": (
        "qd", "dq", "dphi", "dtheta", "w", "n", "v", "vx", "vel", "velo", "spd", "rpm", "qp", "qdot", "thetad", "thetadot",
    ),
    "acceleration": ("acc", "acel", "qdd", "ddq", "qddot", "ddtheta", "ax", "ay", "az", "a"),
    "torque": (
        "tau", "trq", "tor", "tq", "iq", "isq", "i", "m", "pwm", "duty", "u", "amps", "amp", "curr", "cur",
    ),
    "force": ("cell", "f", "fx", "fy", "fz", "dms"),
    "label": (),
    "trigger": ("trig",),
}  # fmt: skip
_REFERENCE_LONG = (
    "target", "soll", "desired", "command", "setpoint", "reference", "nominal", "planned", "consigne", "riferimento",
    "obiettivo", "impostat", "consigna", "desead", "referencia", "objetivo", "指令", "目标", "目標", "给定", "設定", "设定", "参考",
)  # fmt: skip
_REFERENCE_SHORT = ("ref", "des", "cmd", "sp", "goal", "qg", "set", "demand", "dem", "ipo", "cons", "traj", "trajectory")
_ACTUAL = (
    "actual", "measured", "feedback", "gemessen", "mesure", "misurat", "medid", "attuale", "effettiv", "estimate",
    "实际", "實際", "反馈", "現在", "実際", "测量",
)  # fmt: skip
_ACTUAL_SHORT = ("act", "meas", "msr", "fb", "fbk", "present", "real", "reel", "reale")
_LOAD_CELL = (
    "loadcell", "kraftmess", "messdose", "wagezelle", "waegezelle", "kraftsensor", "forcesensor", "wrench",
    "celladicarico", "celdadecarga", "celuladecarga", "capteur", "dynamometer", "接触力", "荷重",
)  # fmt: skip
_DRIVES = ("drive", "antrieb", "motor", "moteur", "motore", "actuator", "电机", "電機", "モータ")
FORCES = ("force", "kraft", "forza", "fuerza", "effort")
_ANGLES = ("winkel", "angle", "angular", "drehzahl", "omega", "motor", "encoder", "angolo", "angulo", "角", "转速", "回転")
# A generalised coordinate (q, qd) may be either.
_ANGLES_SHORT = (
    "phi", "theta", "rot", "ang", "enc", "n", "rpm", "w", "dphi", "dtheta", "deg", "rad", "joint", "rev", "turns",
)  # fmt: skip
_LENGTHS = ("travel", "displacement", "stroke", "linear", "deplacement", "spostamento", "corsa", "desplazamiento", "行程")
_LENGTHS_SHORT = ("weg", "hub", "x", "s")
_CLOCKS = re.compile(r"time|zeit|stamp|clock|时间|時間|時刻|时刻|タイム")
_CLOCKS_SHORT = ("t", "ts", "ticks", "tick", "tempo", "temps", "tiempo", "duration", "tm", "sec", "seconds", "ipoc")
_COUNTERS = ("tick", "count", "zahler", "zaehler", "sample", "index", "cycle", "zyklus", "seqno")
# What is in logs of machines without being a channel of a joint; the reason that a draft states.
_OTHER: tuple[tuple[str, re.Pattern[str]], ...] = (
    ("a tool or Cartesian value", re.compile(r"tcp|tool|(?:^|_)(?:ee|eef|flange|cart|orientation|rpy|quat|twist|cartesian)"
                                             r"|(?:^|_)cartpos|o_t_e|(?:^|_)[ok]_f(?:_|$)|orientation|pose(?:_|$)")),
    ("a temperature", re.compile(r"temp(?:_|$|s|er)|温度")),
    ("a following error", re.compile(
        r"schlepp|following|deviation|abweichung|error|err(?:_|$)|(?:^|_)lag(?:_|$)|diff(?:_|$)|(?:^|_)dev(?:_|$)"
        r"|ecart|erreur|errore|inseguimento|seguimiento|误差|誤差|偏差")),
    ("a voltage", re.compile(r"volt|spannung|tension|voltaj|电压|電圧|(?:^|_)u_?dc|(?:^|_)v?bus(?:_|$)|(?:^|_)u_q|(?:^|_)u_d|(?:^|_)uq|(?:^|_)ud(?:_|$)")),
    ("a power", re.compile(r"power|leistung|puissance|potenza|potencia|功率|電力")),
    ("a modelled or external effort", re.compile(
        r"(?:^|_)(?:computed|gravity|hysteresis|crosstalk|ffw?|feedforward|disturbance|friction|residual|inertia|coriolis"
        r"|storung|perturba)(?:_|$)"
        r"|^(?=.*(?:torque|tau|effort|force|moment|wrench|couple|coppia|(?:^|_)f(?:_|$))).*(?:ext(?:_|$|msr)|external"
        r"|(?:^|_)hat(?:_|$)|(?:^|_)model(?:_|$))")),
    ("the current of the cabinet", re.compile(r"(?:robot|io|system|bus|supply|battery|main|input)_current")),
    ("a flux-forming current", re.compile(r"(?:^|_)(?:i_?s?d|motor_id)(?:_|$)")),
    ("a rate of an effort", re.compile(r"(?:^|_)(?:dtau|taud|tau_dot|torque_rate|jerk)(?:_|$)")),
    ("a state of the controller", re.compile(
        r"covariance|layout|register|bits|mode(?:_|$)|payload|momentum|(?:status|state)(?:_?d?_?word)?$|valid|program"
        r"|sequence|feed_?rate|success|performance|scaling|delay|control_output|limit")),
)  # fmt: skip
# Nouns after `current` that make it an adjective: the present one.
_PRESENT = (
    "feed", "feedrate", "program", "line", "block", "state", "mode", "step", "tool", "time", "cycle", "pose", "value",
    "location", "target",
)  # fmt: skip
# Words of one quantity inside those of another one.
_LONGER: Mapping[str, tuple[str, ...]] = {
    "力": ("力矩", "电力", "電力", "压力", "圧力"), "速度": ("加速度",), "角速": ("角加速",), "moment": ("momentan", "momentum"),
    "couple": ("coupled", "coupler"), "travel": ("traveltime",),
}  # fmt: skip
_STRONG, _WEAK = 3.0, 2.0
_LETTERS = 2  # a one-letter word is weak evidence
_SPLIT = re.compile(r"[\W\d_]+")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")


def words(name: str) -> list[str]:
    """Return the words of a name, in lower case, without accents and numbers."""
    return list(_words(name))


@lru_cache(maxsize=4096)
def _words(name: str) -> tuple[str, ...]:
    plain = "".join(
        letter for letter in unicodedata.normalize("NFKD", name) if not 0x300 <= ord(letter) <= 0x36F
    )  # accents only: Japanese voicing marks belong to their letters
    plain = unicodedata.normalize("NFC", plain)
    return tuple(word for word in _SPLIT.split(_CAMEL.sub(" ", plain).lower()) if word)


def is_reference(name: str) -> bool:
    """Whether the name is that of a set value: `n_ref`, `target_q_0`, `Solldrehzahl`, `tau_J_d`, `指令位置`."""
    parts = words(name)
    whole = "".join(parts)
    if any(long in whole for long in _REFERENCE_LONG) or any(part in _REFERENCE_SHORT for part in parts):
        return True
    # A d at the end stands for "desired", except after a current or voltage: the direct axis.
    return len(parts) > 1 and parts[-1] == "d" and parts[-2] in ("q", "dq", "ddq", "j", "tau", "theta", "x", "pos", "vel")


def is_actual(name: str) -> bool:
    """Whether the name is that of a measured value: `actual_q_0`, `Istposition`, `Drehzahl Ist`, `n_act`, `实际位置`."""
    parts = words(name)
    if any(long in "".join(parts) for long in _ACTUAL) or "current" in parts and _is_adjective(parts):
        return True
    return any(part.startswith("ist") or part.endswith("istwert") or part in _ACTUAL_SHORT for part in parts)


def is_load_cell(name: str) -> bool:
    """Whether the name is that of a load cell or force sensor: ground truth, never an input of a detector."""
    parts = words(name)
    if any(long in "".join(parts) for long in _LOAD_CELL) or "dms" in parts:
        return True
    return "cell" in parts and all(part in ("cell", *_LONG["force"], *_SHORT["force"]) for part in parts)


def is_something_else(name: str) -> bool:
    """Whether the name cannot be a joint's channel: a tool's pose, a temperature, a covariance, a following error."""
    return what_else(name) != ""


@lru_cache(maxsize=4096)
def what_else(name: str) -> str:
    """Return what a name indicates instead of a channel: "a temperature"; an empty text if nothing does."""
    joined = "_".join(words(name))
    return next((reason for reason, pattern in _OTHER if pattern.search(joined)), "")


def is_clock(name: str) -> bool:
    """Whether the name is that of a time: `Zeit`, `LogTime`, `timestamp`, `t`, `temps`, `时间`."""
    parts = words(name)
    return _CLOCKS.search("".join(parts)) is not None or any(part in _CLOCKS_SHORT for part in parts)


def is_counter(name: str) -> bool:
    """Whether the name is that of a counter: `ticks`, `sample_index`."""
    whole = "".join(words(name))
    return any(word in whole for word in _COUNTERS)


def motion_of(name: str) -> str:
    """Return "angle" or "length" for a name of a rotation or a travel, else an empty text."""
    parts = words(name)
    if any(long in "".join(parts) for long in _ANGLES) or any(part in _ANGLES_SHORT for part in parts):
        return "angle"
    if any(long in "".join(parts) for long in _LENGTHS) or any(part in _LENGTHS_SHORT for part in parts):
        return "length"
    return ""


def is_current(name: str) -> bool:
    """Whether the name is that of a motor's current; not `current_pos`, the present position."""
    parts = words(name)
    whole = "".join(parts)
    if any(part in ("i", "iq", "isq", "amps", "amp", "curr", "cur") for part in parts):
        return True
    if any(long in whole for long in ("strom", "courant", "corrente", "corriente", "电流", "電流")):
        return True
    return "current" in whole and not _is_adjective(parts)


def word_for(quantity: str, name: str) -> tuple[float, str]:
    """Return how strongly a name indicates a quantity, and the word that does; 0 and an empty word without one."""
    parts = words(name)
    whole = "".join(parts)
    if quantity == "torque" and is_load_cell(name):
        return 0.0, ""
    if quantity == "torque" and any(word in whole for word in _DRIVES) and any(word in whole for word in FORCES):
        return _STRONG, "drive force"
    for long in _LONG[quantity]:
        if long in whole and not _is_part_of_another(long, whole):
            if long == "current" and _is_adjective(parts):
                continue
            return _STRONG, long
    for part in parts:
        if part in _SHORT[quantity]:
            return (_WEAK if len(part) >= _LETTERS else _WEAK - 1.0), part
    return 0.0, ""


def _is_part_of_another(word: str, whole: str) -> bool:
    """Whether a word is only part of another quantity's: 力 in 力矩, 速度 in 加速度."""
    return any(other in whole for other in _LONGER.get(word, ()))


def _is_adjective(parts: list[str]) -> bool:
    """Whether `current` in a name means the present one: `current_pos`, `CURRENT_FEEDRATE`."""
    others = [
        part
        for quantity in ("position", "speed", "acceleration")
        for part in parts
        if part in _SHORT[quantity] and len(part) >= _LETTERS or any(long in part for long in _LONG[quantity])
    ]
    if others:
        return True
    later = parts[parts.index("current") + 1 :] if "current" in parts else []
    return bool(later) and later[0] in (*_PRESENT, "torque", "effort", "force", "q", "angle")
