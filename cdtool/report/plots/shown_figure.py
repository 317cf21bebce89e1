"""A figure that a notebook shows without pyplot, as the same picture that reports contain."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from matplotlib.figure import Figure


class ShownFigure(Figure):
    """A matplotlib figure that displays itself.

    Jupyter shows a bare `Figure` only after `matplotlib.pyplot` has been imported with the inline backend. This one has
    the method that Jupyter asks for: no pyplot, no backend, nothing to close. `encode` returns a figure in the format
    of a suffix: the picture is that of the reports. `description` is what a screen reader reads in its place.
    """

    def __init__(self, encode: Callable[[Figure, str], bytes], description: str = "", **settings: Any) -> None:
        super().__init__(**settings)
        self.encode, self.description = encode, description

    def _repr_png_(self) -> tuple[bytes, dict[str, Any]]:
        """Return the figure as PNG with its description, as Jupyter asks for it."""
        return self.encode(self, ".png"), {"alt": self.description} if self.description else {}
