"""The latencies as a figure."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from cdtool.base.files.foreign import FIGURES, Kind
from cdtool.report.plots.figures import SUFFIXES
from cdtool.report.writers.base import Report, Writer


class Figure(Writer[Report]):
    """PNG, SVG or PDF: the latencies of every detector in every group."""

    name: ClassVar[str] = "figure"
    suffixes: ClassVar[tuple[str, ...]] = SUFFIXES
    kinds: ClassVar[dict[str, Kind]] = FIGURES

    def write(self, report: Report, target: Path) -> None:
        """Draw it; raises CdtoolError."""
        from cdtool.report.plots.figures import save
        from cdtool.report.plots.latency_plot import latency_figure

        save(latency_figure(report.evaluated), target)
