"""Colours and marks of all figures and pages: no other place names one."""

from __future__ import annotations

from contextlib import suppress
from typing import Any
from zlib import crc32

from cdtool.base.errors import CdtoolError
from cdtool.detectors import DETECTORS
from cdtool.detectors.detection import Status
from cdtool.detectors.look import BROWN, DARK, GREY, STEEL, Look

FORCE = "black"
# What is not a detector's: at least 3 : 1 on the page, lines also on the normal band (WCAG 2.2, 1.4.11).
_COMMON = {"band": "#DCE6EE", "limit": "#404040", "not-assessed": "#808080", "worst": "#A3123F"}
_COMMON_DARK = {"band": "#263746", "limit": "#B9C0C7", "not-assessed": "#7D8792", "worst": "#FF7FA5"}
BAND, LIMIT, NOT_ASSESSED, WORST = _COMMON.values()
ONSET_DASHES = (0, (6, 2, 1.5, 2))
LIMIT_LINE: dict[str, Any] = {"color": LIMIT, "linestyle": (0, (4, 2)), "linewidth": 1.0}
# Why a sample is not assessable; distinct without colour.
HATCHES = {
    Status.START_UP: "////",
    Status.NOT_APPLICABLE: "xxxx",
    Status.GAP: "....",
    Status.NO_LIMIT: "\\\\\\\\",
    Status.OTHER_SPEED: "||||",
    Status.OTHER_RATE: "----",
}


_OTHERS = (Look(STEEL, "P"), Look(BROWN, "X"), Look(GREY, "p"), Look(STEEL, "<"), Look(BROWN, ">"))


def look_of(detector: str) -> Look:
    """Return the look of the detector's class; for any other name it depends only on the name.

    Other names are plug-ins without a look, and detectors in results that are not installed here.
    """
    look = None
    if detector in DETECTORS.table or detector in DETECTORS.names(plugins=True):
        with suppress(CdtoolError):
            look = getattr(DETECTORS.load(detector), "look", None)
    return look or _OTHERS[crc32(detector.encode("utf-8", "replace")) % len(_OTHERS)]


def line_of(look: Look) -> dict[str, Any]:
    """Return colour and dashes of a detector's curve in a figure."""
    return {"color": look.colour, "linestyle": (0, look.dashes or None)}


def page_look(detector: str) -> dict[str, str]:
    """Return the look of a detector for a page: its colours on a light and a dark page, marker and dashes in pixels."""
    look = look_of(detector)
    dashes = " ".join(f"{1.5 * length:g}" for length in look.dashes)
    return {"colour": look.colour, "dark": DARK.get(look.colour, ""), "marker": look.marker, "dashes": dashes or "none"}


def page_colours() -> str:
    """Return a style sheet with the colours that are not a detector's, as the variables of the pages."""
    light, dark = ("".join(f"--{key}:{value};" for key, value in of.items()) for of in (_COMMON, _COMMON_DARK))
    return f":root{{{light}}}\n@media screen and (prefers-color-scheme: dark){{:root{{{dark}}}}}\n"
