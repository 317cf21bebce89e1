"""Facts about the motion in a log, and whether its channels agree with each other."""

from __future__ import annotations

from typing import Literal

from cdtool.findings.finding import Fact, TemplateFact
from cdtool.frozen import frozen
from cdtool.plain_text import counted


@frozen
class NoMotionMapped(TemplateFact):
    """Neither speed nor position is mapped."""

    words = "neither speed nor position is mapped: no operation can be cut or classed"


@frozen
class NoMotion(TemplateFact):
    """The axis stands still."""

    words = "the axis does not move"


@frozen
class Motion(Fact):
    """Strokes, nominal speed and main direction; `joint` leads the motion, empty where there is but one."""

    strokes: int
    nominal_speed: float
    unit: str
    direction: Literal["forward", "backward"]
    joint: str = ""

    def sentence(self) -> str:
        """Return all of it."""
        of = f" of {self.joint}" if self.joint else ""
        return (
            f"{counted(self.strokes, 'stroke')} by motion; nominal speed{of} {self.nominal_speed:.4g} {self.unit}, "
            f"mainly {self.direction}"
        )
