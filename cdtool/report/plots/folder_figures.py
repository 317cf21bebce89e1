"""The figures of a report folder."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from cdtool.report.writers.base import Image, Report

FOLDER_FIGURES = (
    "cdtool.report.plots.latency_plot:write_latencies",
    "cdtool.report.plots.survival_plot:write_survival",
    "cdtool.report.plots.amoc_plot:write_amoc",
    "cdtool.report.plots.force_plot:write_forces",
    "cdtool.report.plots.trigger_plot:write_triggers",
)
"""Functions that write a figure into a folder if there is something to show, in the order of a report."""


def write_figures(report: Report, folder: Path, drawn: Callable[[], None] = lambda: None) -> list[Image]:
    """Draw all figures that have something to show; raises CdtoolError (see `save`). `drawn` is called after each."""
    images: list[Image] = []
    for place in FOLDER_FIGURES:
        module, _, name = place.partition(":")
        images += getattr(import_module(module), name)(report, folder)
        drawn()
    return images
