"""Colours and marks of detectors, the same in all figures: safe for colour-blind readers, shapes for grey print."""

from __future__ import annotations

from contextlib import suppress
from zlib import crc32

from cdtool.base.errors import CdtoolError
from cdtool.detectors import DETECTORS
from cdtool.detectors.detection import Status
from cdtool.detectors.look import BROWN, GREY, SKY, Look

FORCE = "black"
LIMIT = "0.25"
BAND = "#DCE6EE"
# At least 3 : 1 on white and on the normal band (WCAG 2.2, 1.4.11).
NOT_ASSESSED = "0.5"
ONSET_DASHES = (0, (6, 2, 1.5, 2))
# Why a sample is not assessable; distinct without colour.
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
    """Return the look of the detector's class; for any other name it depends only on the name.

    Other names are plug-ins without a look, and detectors in results that are not installed here.
    """
    look = None
    if detector in DETECTORS.table or detector in DETECTORS.names(plugins=True):
        with suppress(CdtoolError):
            look = getattr(DETECTORS.load(detector), "look", None)
    return look or _OTHERS[crc32(detector.encode("utf-8", "replace")) % len(_OTHERS)]
