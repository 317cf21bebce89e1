"""Guess the quantity of a column from its name, in English and German."""

from __future__ import annotations

import re
from collections.abc import Mapping

# Words that are sufficient alone, also inside a longer one (`motordrehzahl`), and short ones that must be separate.
_LONG: Mapping[str, tuple[str, ...]] = {
    "position": ("position", "angle", "winkel", "stellung", "encoder", "travel", "displacement"),
    "speed": ("speed", "velocity", "geschwindigkeit", "drehzahl", "omega"),
    "acceleration": ("accel", "beschleunigung"),
    "torque": ("torque", "drehmoment", "moment", "effort", "current", "strom", "antriebskraft", "driveforce"),
    "force": ("loadcell", "kraftmess", "messdose", "wägezelle", "waegezelle", "kraft", "force", "wrench"),
    "label": ("label", "contact", "kontakt", "collision", "kollision"),
    "trigger": ("trigger",),
}
_SHORT: Mapping[str, tuple[str, ...]] = {
    "position": ("pos", "posn", "phi", "theta", "q", "enc", "weg", "lage", "hub", "qm", "x", "s", "ang"),
    "speed": ("qd", "dq", "dphi", "w", "n", "v", "vel", "spd", "rpm", "qp"),
    "acceleration": ("acc", "qdd", "ddq", "ax", "ay", "az", "a"),
    "torque": ("tau", "trq", "iq", "i", "m", "pwm", "duty", "u", "amps"),
    "force": ("cell", "f", "fx", "fy", "fz", "dms"),
    "label": (),
    "trigger": ("trig",),
}
_REFERENCE_LONG = ("target", "soll", "desired", "command", "setpoint", "reference", "nominal")
_REFERENCE_SHORT = ("ref", "des", "cmd", "sp", "goal", "qg", "set")
_ACTUAL = ("actual", "measured", "feedback", "gemessen")
_ACTUAL_SHORT = ("act", "meas", "fb", "fbk")
_LOAD_CELL = ("loadcell", "kraftmess", "messdose", "wägezelle", "waegezelle", "kraftsensor", "forcesensor", "wrench")
_DRIVES = ("drive", "antrieb", "motor", "actuator")
_ANGLES = ("winkel", "angle", "angular", "drehzahl", "omega", "motor", "encoder")
# A generalised coordinate (q, qd) may be either.
_ANGLES_SHORT = ("phi", "theta", "rot", "ang", "enc", "n", "rpm", "w", "dphi", "deg", "rad")
_LENGTHS = ("travel", "displacement", "stroke", "linear")
_LENGTHS_SHORT = ("weg", "hub", "x", "s")
_CLOCKS = re.compile(r"time|zeit|stamp|clock")
_CLOCKS_SHORT = ("t", "ts", "ticks", "tick", "tempo", "temps")
_COUNTERS = ("tick", "count", "zähler", "zaehler", "sample", "index", "cycle", "zyklus")
_OTHER = re.compile(
    r"tcp|tool|temp|covariance|orientation|layout|register|bits|mode|payload|momentum|status|error|voltage|robot_current"
    r"|schlepp|following|deviation|abweichung|(?:^|_)lag(?:_|$)"
)
_STRONG, _WEAK = 3.0, 2.0
_LETTERS = 2  # a one-letter word is weak evidence
_SPLIT = re.compile(r"[^a-zäöüß]+")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])")


def words(name: str) -> list[str]:
    """Return the words of a name, in lower case, without numbers."""
    return [word for word in _SPLIT.split(_CAMEL.sub(" ", name).lower()) if word]


def is_reference(name: str) -> bool:
    """Whether the name is that of a set value: `n_ref`, `target_q_0`, `Solldrehzahl`."""
    parts = words(name)
    return any(long in name.lower() for long in _REFERENCE_LONG) or any(part in _REFERENCE_SHORT for part in parts)


def is_actual(name: str) -> bool:
    """Whether the name is that of a measured value: `actual_q_0`, `Istposition`, `Drehzahl Ist`, `n_act`."""
    parts = words(name)
    return any(long in name.lower() for long in _ACTUAL) or any(
        part.startswith("ist") or part in _ACTUAL_SHORT for part in parts
    )


def is_load_cell(name: str) -> bool:
    """Whether the name is that of a load cell or force sensor: ground truth, never an input of a detector."""
    parts = words(name)
    if any(long in "".join(parts) for long in _LOAD_CELL) or "dms" in parts:
        return True
    return "cell" in parts and all(part in ("cell", *_LONG["force"], *_SHORT["force"]) for part in parts)


def is_something_else(name: str) -> bool:
    """Whether the name cannot be a joint's channel: a tool's pose, a temperature, a covariance, a following error."""
    return _OTHER.search("_".join(words(name))) is not None


def is_clock(name: str) -> bool:
    """Whether the name is that of a time: `Zeit`, `LogTime`, `timestamp`, `t`."""
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


def word_for(quantity: str, name: str) -> tuple[float, str]:
    """Return how strongly a name indicates a quantity, and the word that does; 0 and an empty word without one."""
    parts = words(name)
    whole = "".join(parts)
    if quantity == "torque" and is_load_cell(name):
        return 0.0, ""
    if quantity == "torque" and any(word in whole for word in _DRIVES) and ("force" in whole or "kraft" in whole):
        return _STRONG, "drive force"
    for long in _LONG[quantity]:
        if long in whole:
            return _STRONG, long
    for part in parts:
        if part in _SHORT[quantity]:
            return (_WEAK if len(part) >= _LETTERS else _WEAK - 1.0), part
    return 0.0, ""
