"""Public layouts of logs as small synthetic look-alikes, with the truth about each column."""

from __future__ import annotations

from tests.commands.init.layouts import axes, benches, loggers, robots, strangers, student_rigs
from tests.commands.init.layouts.layout import Layout, Truth

LAYOUTS: tuple[Layout, ...] = (
    *robots.LAYOUTS,
    *axes.LAYOUTS,
    *benches.LAYOUTS,
    *strangers.LAYOUTS,
    *loggers.LAYOUTS,
    *student_rigs.LAYOUTS,
)

__all__ = ["LAYOUTS", "Layout", "Truth"]
