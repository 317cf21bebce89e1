"""The data of the HTML report's plots as compact JSON: columns of numbers, names as positions in a list."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from cdtool.base.plain_text import plain
from cdtool.detectors.detection import REASONS
from cdtool.report.few_contacts import draws_no_interval, open_end
from cdtool.report.html.page_tables import short, visible
from cdtool.report.html.traces import HEIGHTS, packed_curve
from cdtool.report.many import is_many, plotted_groups
from cdtool.report.model import AXES
from cdtool.report.number_text import number, percent, spoken, with_interval
from cdtool.report.plots.amoc_plot import amoc_axis
from cdtool.report.plots.figures import unit_label
from cdtool.report.plots.force_plot import badness
from cdtool.report.plots.latency_plot import latency_axis
from cdtool.report.plots.style import page_look
from cdtool.report.plots.survival_plot import survival_axis
from cdtool.report.plots.trace_words import LatencyTexts
from cdtool.report.table import Log
from cdtool.report.table import shown as named
from cdtool.report.tables.results import part_of
from cdtool.report.writers.base import Report
from cdtool.results.curves.amoc import AmocCurve, amoc_curves
from cdtool.results.curves.survival_curves import SurvivalCurve, survival_curves
from cdtool.results.results import ContactResult, Results, grouped
from cdtool.results.summary import Summary
from cdtool.results.traced_force import TracedForce, traced_forces
from cdtool.results.traces.trace import Trace
from cdtool.statistics.rates import poisson_at_most
from cdtool.statistics.small_sample import FEWEST

# Heights [px], chosen by eye, of a detector's lane in the latency plot, its axis, other plots and a histogram.
LANE_HEIGHT, LANES_AXIS_HEIGHT, PLOT_HEIGHT, HISTOGRAM_HEIGHT = 66, 44, 300, 96

# Classes of a histogram, and the most points of a curve: as many as a panel has pixels for.
CLASSES, MOST_STEPS = 60, 400

Contacts = Mapping[tuple[str, str], Sequence[ContactResult]]


def plot_data(report: Report) -> dict[str, Any]:
    """Return everything that the plots need except the traces themselves."""
    results = report.evaluated.results
    contacts = grouped(results.scored_contacts, "group", "detector")
    many = is_many(results)
    groups = plotted_groups(report.evaluated) if many else results.groups
    survival, amoc = survival_curves(results), amoc_curves(results)
    scales = {"latency": latency_axis(results), "survival": survival_axis(survival), "amoc": amoc_axis(amoc)}
    of_groups = [item for item in report.evaluated.summaries if item.group in groups]
    return {
        "detectors": [_detector(results, name) for name in results.detectors],
        "groups": [shown(group) for group in results.groups],
        "recordings": [] if many else [shown(item.recording) for item in results.recordings],
        "heights": HEIGHTS,
        "axes": AXES,
        "scales": {name: {"ticks": axis.ticks, "log": axis.logarithmic} for name, axis in scales.items()},
        "per": amoc[0].per if amoc else "",
        "reasons": REASONS,
        "latency": (_histograms if many else _latency)(results, of_groups, contacts),
        "survival": _survival(results, survival, groups, MOST_STEPS if many else None),
        "amoc": _amoc(results, amoc, report.evaluated.summaries, groups),
        "force": _force(report),
    }


def _detector(results: Results, name: str) -> dict[str, str]:
    unit = part_of(results.provenance, "units").get(name, "")
    return {"name": shown(name), "unit": unit_label(unit), **page_look(name)}


def traces_of(traces: Sequence[Trace]) -> dict[Log, list[int]]:
    """Return the numbers of the traces of each log: one per operation that was kept."""
    numbers: dict[Log, list[int]] = {}
    for number_of, trace in enumerate(traces):
        numbers.setdefault((trace.group, trace.log), []).append(number_of)
    return numbers


def shown(name: object) -> str:
    """Return a name from a file as a visible text."""
    return visible(named(name))


def _latency(results: Results, summaries: Sequence[Summary], contacts: Contacts) -> list[dict[str, Any]]:
    recordings = {(item.group, item.recording): i for i, item in enumerate(results.recordings)}
    found: dict[str, dict[str, Any]] = {}
    for item in summaries:
        if not item.contacts:
            continue
        rows = contacts[item.group, item.detector]
        group = found.setdefault(item.group, {"group": shown(item.group), "rows": []})
        detected = [row for row in rows if row.latency_ms is not None]
        missed = [row for row in rows if row.outcome == "missed"]
        group["rows"].append(
            {
                **_about(results, item),
                "latency": [short(row.latency_ms) for row in detected],
                "texts": [number(row.latency_ms, error=row.resolution_ms) for row in detected],
                "recording": [recordings.get((row.group, row.recording), -1) for row in detected],
                "contact": [row.contact for row in detected],
                "watched": [short(row.watched_ms) for row in missed],
                "missed_recording": [recordings.get((row.group, row.recording), -1) for row in missed],
                "missed_contact": [row.contact for row in missed],
            }
        )
    return [{**group, "height": LANE_HEIGHT * len(group["rows"]) + LANES_AXIS_HEIGHT} for group in found.values()]


def _histograms(results: Results, summaries: Sequence[Summary], contacts: Contacts) -> list[dict[str, Any]]:
    """Return for each group the numbers of contacts in classes of latency: of equal width, or of equal ratio."""
    axis = latency_axis(results)
    edges = (np.geomspace if axis.logarithmic else np.linspace)(axis.low, axis.high, CLASSES + 1)
    found = []
    for group in results.groups:
        items = [item for item in summaries if item.group == group and item.contacts]
        if not items:
            continue
        columns = [[row.latency_ms for row in contacts[group, item.detector]] for item in items]
        latency = [np.array([value for value in column if value is not None], dtype=np.float64) for column in columns]
        rows = [
            {
                **_about(results, item),
                "numbers": np.histogram(np.clip(of_detector, edges[0], edges[-1]), edges)[0].tolist(),
            }
            for item, of_detector in zip(items, latency, strict=True)
        ]
        height = HISTOGRAM_HEIGHT * len(rows) + LANES_AXIS_HEIGHT
        found.append({"group": shown(group), "rows": rows, "edges": _numbers(edges), "height": height})
    return found


def _about(results: Results, item: Summary) -> dict[str, Any]:
    """Return what a row of latencies says of a detector: its median with the interval, and its outcomes.

    The interval is left out if a plot draws none; `open` is where one without an upper end begins [ms], and in words.
    """
    median, least = item.median, open_end(item)
    shown_ends = (median.value,) if draws_no_interval(item) else (median.value, median.low, median.high)
    return {
        "detector": results.detectors.index(item.detector),
        "median": [short(value) for value in shown_ends],
        "open": (short(least[0]), least[1]) if least else None,
        "words": f"median {with_interval(median, item.resolution_ms)} ms",
        "counts": f"{item.detected} detected, {item.missed} missed, {item.not_assessable} not assessable",
    }


def _survival(
    results: Results, curves: Sequence[SurvivalCurve], groups: Sequence[str], most: int | None
) -> list[dict[str, Any]]:
    seen = grouped([item for item in curves if item.contacts > item.not_assessable], "group")
    found = []
    for group in (group for group in groups if group in seen):
        rows = []
        for item in seen[group]:
            # A step begins where the share changes; the other points show nothing new.
            kept = np.flatnonzero(np.diff(item.curve.share, prepend=2.0))
            if most and len(kept) > most:
                kept = kept[np.unique(np.linspace(0, len(kept) - 1, most).round().astype(np.intp))]
            keys = ("times", "share", *(("low", "high") if item.contacts - item.not_assessable >= FEWEST else ()))
            columns = {key: _numbers(getattr(item.curve, key)[kept]) for key in keys}
            number_of = results.detectors.index(item.detector)
            words = _share_words(item, kept, banded="low" in keys)
            rows.append({"detector": number_of, **columns, "words": words, "until": short(item.end)})
        found.append({"group": shown(group), "rows": rows, "height": PLOT_HEIGHT})
    return found


def _share_words(item: SurvivalCurve, kept: np.ndarray, *, banded: bool) -> list[str]:
    """Return in words which share is undetected from each of the `kept` times on."""
    count, curve = item.contacts - item.not_assessable, item.curve
    words = []
    for share, low, high in zip(curve.share[kept], curve.low[kept], curve.high[kept], strict=True):
        band = f" (95 %: {percent(low)} to {percent(high)})" if banded else ""
        is_last = share == 0.0 and item.detected == count
        words.append(f"all {count} detected" if is_last else f"{percent(share)} of {count} undetected{band}")
    return words


def _amoc(
    results: Results, curves: Sequence[AmocCurve], summaries: Sequence[Summary], groups: Sequence[str]
) -> list[dict[str, Any]]:
    known = [item for item in curves if item.group in groups and item.detector in results.detectors]
    errors = {(item.group, item.detector): item.resolution_ms for item in summaries}
    return [
        {
            "group": shown(group),
            "rows": [
                {"detector": results.detectors.index(item.detector), **_curve(item, errors[group, item.detector])}
                for item in items
            ],
            "height": PLOT_HEIGHT + 20,
        }
        for group, items in grouped(known, "group").items()
    ]


def _curve(item: AmocCurve, error: float | None) -> dict[str, Any]:
    """Return a detector's points by factor; `chosen` is the position of the factor in use."""
    return {
        "factor": [short(point.safety_factor) for point in item.points],
        "alarms": [point.false_alarms for point in item.points],
        "median": [short(point.median_ms) for point in item.points],
        "texts": [number(point.median, error=error) for point in item.points],
        "detected": [point.detected for point in item.points],
        "missed": [point.missed for point in item.points],
        "not_assessable": item.not_assessable,
        "chosen": item.in_use,
        "operations": item.operations,
        "hours": short(item.hours),
        "none": {
            "operation": number(poisson_at_most(0, float(item.operations))),
            "hour": number(poisson_at_most(0, item.hours)),
        },
    }


def _force(report: Report) -> list[dict[str, Any]]:
    """Return for each group with a force profile its limits and the curves with a verdict, the worst one first."""
    results, texts = report.evaluated.results, LatencyTexts.of(report.evaluated.results)
    curves = grouped(sorted(traced_forces(results, report.traces), key=badness), "group")
    panels = []
    for group, profile in part_of(results.provenance, "force_profiles").items():
        if group in curves:
            steps = [
                [short(step["from_s"]), short(step["at_most_n"]), plain(step["name"])] for step in profile["steps"]
            ]
            count = sum(item.group == group for item in results.forces)
            panels.append(
                {
                    "group": shown(group),
                    "profile": {key: plain(text) for key, text in asdict(report.model.profiles[group]).items()},
                    "steps": steps,
                    "curves": [_force_curve(results, item, texts) for item in curves[group]],
                    "contacts": count,
                    "height": PLOT_HEIGHT,
                }
            )
    return panels


def _force_curve(results: Results, item: TracedForce, texts: LatencyTexts) -> dict[str, Any]:
    budget = 1e3 * item.verdict.time_budget
    return {
        "trace": item.trace,
        "name": shown(item.name),
        "verdict": spoken(item.verdict.outcome),
        "times": packed_curve(1e3 * item.time),
        "force": packed_curve(item.force),
        "budget": short(budget),
        "exceeded": f"limit exceeded after {number(budget)} ms",
        "alarms": [
            {
                "detector": results.detectors.index(name),
                "late": short(1e3 * late),
                "text": texts.text(item.group, item.recording, name, late),
            }
            for name, late in item.alarms.items()
        ],
    }


def _numbers(values: np.ndarray) -> list[float | int | None]:
    return [short(float(value)) for value in values]
