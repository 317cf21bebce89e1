"""Colours in the terminal: they repeat what the words say, and are left out where nobody would see them.

Conventions: NO_COLOR (no-color.org) switches them off, FORCE_COLOR on, also in a pipe; NO_COLOR takes precedence.
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from typing import TextIO

# Bold red, yellow, green.
_COLOURS: dict[str, str] = {"bad": "red", "unknown": "yellow", "good": "green"}


@dataclass(frozen=True)
class Toned:
    """A cell of a table and whether it is bad, unknown or good."""

    text: object
    tone: str = ""

    def __str__(self) -> str:
        """Return the text of the cell."""
        return str(self.text)


def shows_colour(stream: TextIO | None = None) -> bool:
    """Return whether a stream shows colours: a terminal that is not dumb, unless the environment decides."""
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    return (stream or sys.stdout).isatty() and os.environ.get("TERM") != "dumb"


def coloured(text: str, tone: str, stream: TextIO | None = None) -> str:
    """Return a text with the colour of its tone, "heading" for bold; unchanged where the stream shows no colours."""
    if not (text and tone and shows_colour(stream)):
        return text
    from typer import style

    return style(text, fg=_COLOURS.get(tone), bold=tone in ("bad", "heading"))
