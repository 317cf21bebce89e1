"""The data of the HTML report's plots as compact JSON: columns of numbers, names as positions in a list."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.plain_text import plain
from cdtool.detectors.detection import REASONS
from cdtool.report.few_contacts import draws_no_interval, open_end
from cdtool.report.html.page_tables import short, visible
from cdtool.report.html.traces import HEIGHTS
from cdtool.report.many import is_many, plotted_groups
from cdtool.report.model import AXES
from cdtool.report.number_text import number, spoken, with_interval
from cdtool.report.plots.style import look_of
from cdtool.report.table import Log
from cdtool.report.table import shown as named
from cdtool.report.tables.results import part_of
from cdtool.report.writers.base import Report
from cdtool.results.results import ContactResult, ForceResult, Results, SweepResult, grouped
from cdtool.results.summary import Summary, latencies
from cdtool.results.traces.trace import Trace
from cdtool.statistics.kaplan_meier import survival
from cdtool.statistics.rates import poisson_at_most
from cdtool.statistics.small_sample import FEWEST

# Heights [px] of a detector's lane in the latency plot and of the other plots.
LANE_HEIGHT, LANES_AXIS_HEIGHT, PLOT_HEIGHT = 66, 44, 300
HISTOGRAM_HEIGHT = 96

# Classes of a histogram, and the most points of a curve.
CLASSES, MOST_STEPS = 60, 400
# A plot of latencies has no mark below this [ms].
_FLOOR_MS = 1.0

Contacts = Mapping[tuple[str, str], Sequence[ContactResult]]


def plot_data(report: Report) -> dict[str, Any]:
    """Return everything that the plots need except the traces themselves."""
    results = report.evaluated.results
    contacts = grouped(results.scored_contacts, "group", "detector")
    many = is_many(results)
    groups = plotted_groups(report.evaluated) if many else results.groups
    of_groups = [item for item in report.evaluated.summaries if item.group in groups]
    return {
        "detectors": [_detector(results, name) for name in results.detectors],
        "groups": [shown(group) for group in results.groups],
        "recordings": [] if many else [shown(item.recording) for item in results.recordings],
        "heights": HEIGHTS,
        "axes": AXES,
        "reasons": REASONS,
        "latency": (_histograms if many else _latency)(results, of_groups, contacts),
        "survival": _survival(results, groups, contacts, MOST_STEPS if many else None),
        "amoc": _amoc(results, groups),
        "force": _force(report),
    }


def _detector(results: Results, name: str) -> dict[str, str]:
    look = look_of(name)
    unit = part_of(results.provenance, "units").get(name, "")
    return {"name": shown(name), "unit": plain(unit), "colour": css_colour(look.colour), "marker": look.marker}


def css_colour(colour: str) -> str:
    """Return a colour of the figures in CSS; the figures also name greys by their lightness, as "0.35"."""
    if colour.startswith("#"):
        return colour
    return f"#{round(255.0 * float(colour)):02x}" + 2 * f"{round(255.0 * float(colour)):02x}"


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
    detectors = {name: i for i, name in enumerate(results.detectors)}
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
                "detector": detectors[item.detector],
                "median": [short(value) for value in _median(item)],
                "open": _open_end(item),
                "words": f"median {with_interval(item.median)} ms",
                "counts": f"{item.detected} detected, {item.missed} missed, {item.not_assessable} not assessable",
                "latency": [short(row.latency_ms) for row in detected],
                "recording": [recordings.get((row.group, row.recording), -1) for row in detected],
                "contact": [row.contact for row in detected],
                "watched": [short(row.watched_ms) for row in missed],
                "missed_recording": [recordings.get((row.group, row.recording), -1) for row in missed],
                "missed_contact": [row.contact for row in missed],
            }
        )
    return [{**group, "height": LANE_HEIGHT * len(group["rows"]) + LANES_AXIS_HEIGHT} for group in found.values()]


def _histograms(results: Results, summaries: Sequence[Summary], contacts: Contacts) -> list[dict[str, Any]]:
    """Return for each group the numbers of contacts in classes of latency, which all its detectors share."""
    detectors = {name: i for i, name in enumerate(results.detectors)}
    found = []
    for group in results.groups:
        items = [item for item in summaries if item.group == group and item.contacts]
        if not items:
            continue
        columns = [[row.latency_ms for row in contacts[group, item.detector]] for item in items]
        latency = [np.array([value for value in column if value is not None], dtype=np.float64) for column in columns]
        edges = _edges(np.concatenate(latency))
        rows = [
            {
                "detector": detectors[item.detector],
                "median": [short(value) for value in _median(item)],
                "open": _open_end(item),
                "words": f"median {with_interval(item.median)} ms",
                "counts": f"{item.detected} detected, {item.missed} missed, {item.not_assessable} not assessable",
                "numbers": np.histogram(np.clip(of_detector, edges[0], edges[-1]), edges)[0].tolist(),
            }
            for item, of_detector in zip(items, latency, strict=True)
        ]
        height = HISTOGRAM_HEIGHT * len(rows) + LANES_AXIS_HEIGHT
        found.append({"group": shown(group), "rows": rows, "edges": _numbers(edges), "height": height})
    return found


def _edges(latency: FloatArray) -> FloatArray:
    """Return the edges of the classes of all latencies [ms]: of equal width, or of equal ratio over a wide range."""
    highest = float(latency.max(initial=_FLOOR_MS))
    lowest = max(float(latency.min(initial=highest)), _FLOOR_MS)
    if highest > 10.0 * lowest:
        return np.geomspace(lowest, highest * 1.0001, CLASSES + 1)
    return np.linspace(0.0, highest * 1.0001, CLASSES + 1)


def _median(item: Summary) -> tuple[float, ...]:
    """Return the median with its interval; only the median if a plot draws none."""
    median = item.median
    return (median.value,) if draws_no_interval(item) else (median.value, median.low, median.high)


def _open_end(item: Summary) -> tuple[float | int | None, str] | None:
    """Return where an open interval begins [ms], and it in words; null if both ends are drawn."""
    least = open_end(item)
    return (short(least[0]), least[1]) if least else None


def _survival(results: Results, groups: Sequence[str], contacts: Contacts, most: int | None) -> list[dict[str, Any]]:
    found = []
    for group in groups:
        rows = []
        for i, name in enumerate(results.detectors):
            latency, censored = latencies(contacts.get((group, name), ()))
            if not len(latency):
                continue
            curve = survival(latency, censored)
            # A step begins where the share changes; the other points show nothing new.
            kept = np.flatnonzero(np.diff(curve.share, prepend=2.0))
            if most and len(kept) > most:
                kept = kept[np.unique(np.linspace(0, len(kept) - 1, most).round().astype(np.intp))]
            keys = ("times", "share", *(("low", "high") if len(latency) >= FEWEST else ()))
            columns = {key: _numbers(getattr(curve, key)[kept]) for key in keys}
            rows.append({"detector": i, **columns, "until": short(float(latency.max())), "n": len(latency)})
        if rows:
            found.append({"group": shown(group), "rows": rows, "height": PLOT_HEIGHT})
    return found


def _amoc(results: Results, groups: Sequence[str]) -> list[dict[str, Any]]:
    parts: dict[str, dict[str, list[SweepResult]]] = {}
    for item in (row for row in results.sweep if row.group in groups):
        parts.setdefault(item.group, {}).setdefault(item.detector, []).append(item)
    found = []
    for group, detectors in parts.items():
        rows = []
        for i, name in enumerate(results.detectors):
            points = detectors.get(name, [])
            if points and points[0].hours and points[0].operations:
                rows.append({"detector": i, **_curve(points)})
        if rows:
            found.append({"group": shown(group), "rows": rows, "height": PLOT_HEIGHT + 20})
    return found


def _curve(points: Sequence[SweepResult]) -> dict[str, Any]:
    """Return a detector's points by factor; `chosen` is the position of the factor in use."""
    first = points[0]
    factors = np.array([item.safety_factor for item in points])
    return {
        "factor": _numbers(factors),
        "alarms": [item.false_alarms for item in points],
        "median": [short(item.median_ms) for item in points],
        "detected": [item.detected for item in points],
        "missed": [item.missed for item in points],
        "not_assessable": first.not_assessable,
        "chosen": next((i for i, item in enumerate(points) if item.in_use), -1),
        "operations": first.operations,
        "hours": short(first.hours),
        "none": {
            "operation": number(poisson_at_most(0, float(first.operations))),
            "hour": number(poisson_at_most(0, first.hours)),
        },
    }


def _force(report: Report) -> list[dict[str, Any]]:
    """Return for each group with a force profile its limits, and which contacts of which traces have a verdict."""
    results = report.evaluated.results
    traced = {(trace.group, trace.log) for trace in report.traces}
    numbers = {(*log, item.onset_s): item.contact for item in results.contacts if (log := _log(item)) in traced}
    verdicts = {(*log, item.contact): item for item in results.forces if (log := _log(item)) in traced}
    curves: dict[str, list[dict[str, Any]]] = {}
    for i, trace in enumerate(report.traces):
        log = trace.group, trace.log
        for place, contact in enumerate(trace.contacts):
            verdict = verdicts.get((*log, numbers.get((*log, contact.start), 0)))
            if verdict is None or not len(trace.force):
                continue
            curves.setdefault(trace.group, []).append(
                {
                    "trace": i,
                    "contact": place,
                    "verdict": spoken(verdict.verdict),
                    "peak": short(verdict.peak_n),
                    "budget": short(verdict.time_budget_ms),
                }
            )
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
                    "curves": curves[group],
                    "contacts": count,
                    "height": PLOT_HEIGHT,
                }
            )
    return panels


def _log(row: ContactResult | ForceResult) -> Log:
    return row.group, row.recording


def _numbers(values: np.ndarray) -> list[float | int | None]:
    return [short(float(value)) for value in values]
