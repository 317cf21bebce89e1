"""The figures of a report folder: latencies, survival, latency against false alarms, forces, triggers of each group."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from pathlib import Path

from cdtool.evaluation.force.traced import TracedForce, force_profiles, traced_forces
from cdtool.evaluation.results import Results
from cdtool.evaluation.traces.trace import Trace
from cdtool.report.markdown.markdown import Image
from cdtool.report.plots.amoc_plot import plot_amoc
from cdtool.report.plots.force_plot import ForceCurve, ForcePanel, plot_forces
from cdtool.report.plots.latency_plot import plot_latencies
from cdtool.report.plots.survival_plot import plot_survival
from cdtool.report.plots.trigger_plot import plot_triggers
from cdtool.report.writers.base import Report

_LONGEST_NAME = 40


def write_figures(report: Report, folder: Path) -> list[Image]:
    """Draw every figure for which there is something to show; raises CdtoolError (see `save`).

    latency.png always; survival.png where there are contacts, amoc.png where limits were moved, forces.png where there
    are force limits and curves (forces_<profile>.png with several profiles), triggers_<group>.png of one operation.
    """
    evaluated, results = report.evaluated, report.evaluated.results
    images = [Image("latency.png", "latency of every detector in every group")]
    plot_latencies(evaluated, folder / images[0].name)
    if results.contacts:
        images.append(Image("survival.png", "share of the contacts that are still undetected over time"))
        plot_survival(evaluated, folder / images[-1].name)
    if results.sweep:
        images.append(Image("amoc.png", "median latency against false alarms, with the limits of each detector moved"))
        plot_amoc(evaluated, folder / images[-1].name)
    images += _write_forces(results, report.traces, folder)
    return [*images, *_write_triggers(results, report.traces, folder)]


def most_telling(traces: Sequence[Trace]) -> Trace:
    """The trace with a contact, then that of most detectors, then where most of them could judge; the first of equals.

    There is at least one.
    """
    return max(
        traces,
        key=lambda trace: (trace.shown is not None, len(trace.panels), sum(not panel.blind for panel in trace.panels)),
    )


def _write_forces(results: Results, traces: Sequence[Trace], folder: Path) -> list[Image]:
    curves = traced_forces(results, traces)
    used = {name: [item for item in curves if item.verdict.profile == name] for name in force_profiles(results)}
    shown = {name: items for name, items in used.items() if items}
    images, taken = [], set[str]()
    for name, items in shown.items():
        file = "forces.png" if len(shown) == 1 else f"forces_{slug(name, taken)}.png"
        judged = sum(row.profile == name for row in results.forces)
        images.append(Image(file, _force_caption(results, name, len(items), judged)))
        plot_forces(_panels(items), force_profiles(results)[name], folder / file)
    return images


def _force_caption(results: Results, profile: str, drawn: int, judged: int) -> str:
    caption = f"contact force over time against {profile}"
    if drawn < judged:
        caption += f": the {drawn} of {judged} contacts whose curves were kept"
    if results.provenance.get("mass_before_cell_kg"):
        caption += "; curves as the load cell saw them, verdicts corrected for the mass before it"
    return caption


def _panels(items: Sequence[TracedForce]) -> list[ForcePanel]:
    groups: dict[str, list[ForceCurve]] = {}
    for item in items:
        name = item.recording if item.contact == 1 else f"{item.recording}, contact {item.contact}"
        groups.setdefault(item.group, []).append(ForceCurve(name, item.time, item.force, item.verdict, item.alarms))
    return [ForcePanel(group, tuple(curves)) for group, curves in groups.items()]


def _write_triggers(results: Results, traces: Sequence[Trace], folder: Path) -> list[Image]:
    images, taken = [], set[str]()
    for group in results.groups:
        of_group = [trace for trace in traces if trace.group == group]
        if of_group:
            trace = most_telling(of_group)
            name = f"triggers_{slug(group, taken)}.png"
            images.append(Image(name, f"{trace.recording}: all detectors", group))
            plot_triggers(trace, folder / name)
    return images


def slug(name: str, taken: set[str]) -> str:
    """A file name's part for a group or detector: letters, digits, hyphens; unlike any in `taken`, and added to it."""
    letters = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    base = re.sub(r"[^a-z0-9]+", "-", letters.lower())[:_LONGEST_NAME].strip("-") or "unnamed"
    found, number = base, 1
    while found in taken:
        number += 1
        found = f"{base}-{number}"
    taken.add(found)
    return found
