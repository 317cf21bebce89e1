"""Colours in the terminal: they repeat what the words say, and are left out where nobody would see them.

Conventions: NO_COLOR (no-color.org) switches them off, FORCE_COLOR on, also in a pipe; NO_COLOR takes precedence.
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass

# Bold red, yellow, green: the names that rich and typer share.
_COLOURS: dict[str, str] = {"bad": "red", "unknown": "yellow", "good": "green"}


@dataclass(frozen=True)
class Toned:
    """A cell of a table and whether it is bad, unknown or good."""

    text: object
    tone: str = ""

    def __str__(self) -> str:
        """Return the text of the cell."""
        return str(self.text)


def shows_colour() -> bool:
    """Return whether standard output shows colours: a terminal that is not dumb, unless the environment decides."""
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    return sys.stdout.isatty() and os.environ.get("TERM") != "dumb"


def style_of(cell: object) -> str:
    """Return the style that rich gives a cell; empty without a tone."""
    colour = _COLOURS.get(cell.tone, "") if isinstance(cell, Toned) else ""
    return f"bold {colour}" if colour == "red" else colour


def coloured(line: str, tone: str) -> str:
    """Return a line with the colour of its tone; unchanged where colours are not shown."""
    if not tone or not shows_colour():
        return line
    from typer import style

    return style(line, fg=_COLOURS[tone], bold=tone == "bad")
