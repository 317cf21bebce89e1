"""Facts about values of a machine file that `cdtool init` wrote as placeholders and nobody has replaced yet."""

from __future__ import annotations

import math

from cdtool.findings.finding import Fact, TemplateFact
from cdtool.frozen import frozen
from cdtool.plain_text import counted


@frozen
class PlaceholderRatio(Fact):
    """A transmission ratio of exactly 1 m/rad; `speed` [m/s] is the largest load speed with it, NaN without one."""

    speed: float

    def sentence(self) -> str:
        """Return the ratio, and the speed that follows from it."""
        reached = f": with it the load moves at {self.speed:.3g} m/s" if not math.isnan(self.speed) else ""
        return f"transmission_ratio = 1 m/rad is a placeholder of cdtool init{reached}; give the travel per motor angle"


@frozen
class PlaceholderScale(TemplateFact):
    """A scale of exactly 1 for a raw unit."""

    raw: str
    unit: str
    per: str

    words = "scale = 1 for '{raw}' is a placeholder of cdtool init; give the {unit} per {per}"


@frozen
class PlaceholderInertia(TemplateFact):
    """No inertia in the machine file."""

    key: str

    words = "{key} is 0, a placeholder of cdtool init: detectors with a model refuse it"


@frozen
class UncheckedLines(Fact):
    """Lines of the machine file that still have the mark CHECK."""

    count: int
    keys: tuple[str, ...]

    def sentence(self) -> str:
        """Return how many, and their keys."""
        named = f" ({', '.join(self.keys)})" if self.keys else ""
        return (
            f"{counted(self.count, 'key')} of the machine file with the mark CHECK{named}: delete a mark after checking"
        )
