"""How detectors and marks look, the same in every figure: colours safe for the colour-blind, shapes for grey print."""

from __future__ import annotations

from dataclasses import dataclass
from zlib import crc32

from cdtool.detection import Status

# The colours of Okabe and Ito nearest to those of the thesis's figures 5.7 and 5.8.
_RED, _GREEN, _BLUE, _VIOLET = "#D55E00", "#009E73", "#0072B2", "#B0569B"
_ORANGE, _SKY, _BROWN = "#E69F00", "#56B4E9", "#8C613C"
_NAVY, _OLIVE = "#332288", "#7A7A00"

FORCE = "black"
LIMIT = "0.25"
BAND = "#DCE6EE"
UNJUDGED = "0.72"
# From far below the mean to far above it, pale in the middle; told apart by the colour-blind and, by hue, in print.
DEVIATION_COLOURS = ("#003F6B", _BLUE, "#9CCBE6", "#F7F7F7", "#F2B48A", _RED, "#7A2E00")
ONSET_DASHES = (0, (6, 2, 1.5, 2))
# The reason not to judge, told apart without colour.
HATCHES = {
    Status.START_UP: "////",
    Status.NOT_APPLICABLE: "xxxx",
    Status.GAP: "....",
    Status.NO_LIMIT: "\\\\\\\\",
    Status.OTHER_SPEED: "||||",
    Status.OTHER_RATE: "----",
}


@dataclass(frozen=True)
class Look:
    """Colour and marker of a detector."""

    colour: str
    marker: str


_KNOWN = {
    "friction_ekf": Look(_RED, "o"),
    "pure_inertia": Look(_GREEN, "^"),
    "pure_torque": Look(_BLUE, "s"),
    "momentum": Look(_VIOLET, "D"),
    "inertial_momentum": Look(_ORANGE, "v"),
    "kalman_momentum": Look(_NAVY, ">"),
    "velocity": Look(_SKY, "<"),
    "energy": Look(_OLIVE, "p"),
    "direct": Look(_BROWN, "X"),
    "desired_dynamics": Look("0.35", "P"),
}
_OTHERS = (Look(_SKY, "P"), Look(_BROWN, "X"), Look("0.35", "p"), Look(_SKY, "<"), Look(_BROWN, ">"))


def look_of(detector: str) -> Look:
    """The look of a detector; one that is not known here keeps a look that its name decides."""
    return _KNOWN.get(detector) or _OTHERS[crc32(detector.encode("utf-8", "replace")) % len(_OTHERS)]
