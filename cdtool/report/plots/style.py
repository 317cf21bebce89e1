"""How detectors and marks look, the same in every figure: colours safe for the colour-blind, shapes for grey print."""

from __future__ import annotations

from contextlib import suppress
from zlib import crc32

from cdtool.detection import Status
from cdtool.detectors import DETECTORS
from cdtool.detectors.look import BLUE, BROWN, GREY, RED, SKY, Look
from cdtool.errors import CdtoolError

FORCE = "black"
LIMIT = "0.25"
BAND = "#DCE6EE"
UNJUDGED = "0.72"
# From far below the mean to far above it, pale in the middle; told apart by the colour-blind and, by hue, in print.
DEVIATION_COLOURS = ("#003F6B", BLUE, "#9CCBE6", "#F7F7F7", "#F2B48A", RED, "#7A2E00")
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


_OTHERS = (Look(SKY, "P"), Look(BROWN, "X"), Look(GREY, "p"), Look(SKY, "<"), Look(BROWN, ">"))


def look_of(detector: str) -> Look:
    """Return the look that the detector's class gives; that of any other name depends on nothing but the name.

    Others are plug-ins without a look, and names in results of detectors that are not installed here.
    """
    look = None
    if detector in DETECTORS.table or detector in DETECTORS.names(plugins=True):
        with suppress(CdtoolError):
            look = getattr(DETECTORS.load(detector), "look", None)
    return look or _OTHERS[crc32(detector.encode("utf-8", "replace")) % len(_OTHERS)]
