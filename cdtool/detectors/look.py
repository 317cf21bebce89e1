"""How a detector looks in figures and pages: colour, marker and dashes, told apart also by colour-blind readers."""

from __future__ import annotations

import re
from dataclasses import dataclass

from cdtool.base.errors import ConfigurationError, nearest

# The first five, of the detectors that are used most, differ by a CIEDE2000 of at least 25 from one another, for normal
# eyes, without red cones and without green ones; all have a contrast of at least 3 : 1 on white (WCAG 2.2, 1.4.11).
BLUE, TEAL, PLUM, OCHRE, RUST = "#0070CE", "#679A95", "#781D4E", "#C38700", "#873C01"
NAVY, OLIVE, GREY, UMBER, STEEL, BROWN = "#332288", "#7A7A00", "#595959", "#6B4E16", "#2E86B8", "#8C613C"
# The first five on a dark page, where the same holds; it mixes the others with white.
DARK = {BLUE: "#6BB5FB", TEAL: "#C9E6DD", PLUM: "#89657E", OCHRE: "#FFDD4C", RUST: "#B18565"}

# Markers that both the figures and the HTML page can draw, named as in matplotlib, each with the dashes and gaps of its
# curves in widths of the line.
MARKERS: dict[str, tuple[float, ...]] = {
    "o": (),
    "s": (6.0, 1.8),
    "D": (6.0, 1.6, 1.3, 1.6),
    "^": (1.3, 1.3),
    "v": (3.2, 1.4),
    "<": (9.0, 1.6, 3.0, 1.6),
    ">": (6.0, 1.6, 1.3, 1.6, 1.3, 1.6),
    "p": (12.0, 2.5),
    "h": (3.0, 1.4, 1.3, 1.4),
    "P": (1.3, 2.8),
    "X": (12.0, 1.6, 1.3, 1.6),
}

_COLOUR = re.compile(r"#[0-9A-Fa-f]{6}")


@dataclass(frozen=True)
class Look:
    """Colour and marker of a detector in figures; the marker decides the dashes of its curves.

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

    @property
    def dashes(self) -> tuple[float, ...]:
        """Dashes and gaps of its curves in widths of the line; empty for a solid line."""
        return MARKERS[self.marker]
