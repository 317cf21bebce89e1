"""How a detector looks in figures: a colour that is safe for colour-blind readers, and a marker for grey print."""

from __future__ import annotations

import re
from dataclasses import dataclass

from cdtool.base.errors import ConfigurationError, nearest

# The colours of Okabe and Ito nearest to those of the thesis's figures 5.7 and 5.8, and five more.
RED, GREEN, BLUE, VIOLET = "#D55E00", "#009E73", "#0072B2", "#B0569B"
ORANGE, SKY, BROWN = "#E69F00", "#56B4E9", "#8C613C"
NAVY, OLIVE, GREY, UMBER = "#332288", "#7A7A00", "#595959", "#6B4E16"

# Markers that both the figures and the HTML page can draw, named as in matplotlib.
MARKERS = ("o", "s", "D", "^", "v", "<", ">", "p", "h", "P", "X")

_COLOUR = re.compile(r"#[0-9A-Fa-f]{6}")


@dataclass(frozen=True)
class Look:
    """Colour and marker of a detector in figures.

    Parameters
    ----------
    colour : str
        As `#rrggbb`.
    marker : str
        One of `MARKERS`, named as in matplotlib.

    Raises
    ------
    ConfigurationError
        The colour is not written as `#rrggbb`, or the marker is not one of `MARKERS`.

    Examples
    --------
    >>> Look("#332288", "o").colour
    '#332288'
    """

    colour: str
    marker: str

    def __post_init__(self) -> None:
        if not _COLOUR.fullmatch(self.colour):
            raise ConfigurationError(f"the colour of a detector is '{self.colour}'", "write it as #rrggbb")
        if self.marker not in MARKERS:
            raise ConfigurationError(f"the marker of a detector is '{self.marker}'", nearest(self.marker, MARKERS))
