"""What a column's name says of its quantity, in English and German."""

from __future__ import annotations

import re
from collections.abc import Mapping

# Words that say it alone, also inside a longer one (`motordrehzahl`), and short ones that must stand for themselves.
_LONG: Mapping[str, tuple[str, ...]] = {
    "position": ("position", "angle", "winkel", "stellung", "encoder", "travel", "displacement"),
    "speed": ("speed", "velocity", "geschwindigkeit", "drehzahl", "omega"),
    "acceleration": ("accel", "beschleunigung"),
    "torque": ("torque", "drehmoment", "moment", "effort", "current", "strom", "antriebskraft", "driveforce"),
    "force": ("loadcell", "kraftmess", "messdose", "kraft", "force", "wrench"),
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
_OTHER = re.compile(
    r"tcp|tool|temp|covariance|orientation|layout|register|bits|mode|payload|momentum|status|error|voltage|robot_current"
)
_STRONG, _WEAK = 3.0, 2.0
_LETTERS = 2  # a short word of one letter says little
_SPLIT = re.compile(r"[^a-zäöüß]+")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])")


def words(name: str) -> list[str]:
    """The words of a name, in lower case, numbers left out."""
    return [word for word in _SPLIT.split(_CAMEL.sub(" ", name).lower()) if word]


def is_reference(name: str) -> bool:
    """True for a set value: `n_ref`, `target_q_0`, `Solldrehzahl`."""
    parts = words(name)
    return any(long in name.lower() for long in _REFERENCE_LONG) or any(part in _REFERENCE_SHORT for part in parts)


def is_something_else(name: str) -> bool:
    """True for what a joint's channel never is: a tool's pose, a temperature, a covariance."""
    return _OTHER.search("_".join(words(name))) is not None


def word_for(quantity: str, name: str) -> tuple[float, str]:
    """How strongly a name speaks for a quantity, and the word that does; 0 and no word where none does."""
    parts = words(name)
    whole = "".join(parts)
    for long in _LONG[quantity]:
        if long in whole:
            return _STRONG, long
    for part in parts:
        if part in _SHORT[quantity]:
            return (_WEAK if len(part) >= _LETTERS else _WEAK - 1.0), part
    return 0.0, ""
