"""What the HTML report's plots show, as compact JSON: columns of numbers, names as places in a list."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cdtool.evaluation.evaluated import Evaluated
from cdtool.evaluation.results import ContactResult, Results, SweepResult
from cdtool.evaluation.statistics.kaplan_meier import survival
from cdtool.evaluation.statistics.rates import poisson_at_most
from cdtool.evaluation.statistics.small_sample import FEWEST
from cdtool.evaluation.summary import Summary, latencies
from cdtool.evaluation.traces.trace import Trace
from cdtool.plain_text import plain
from cdtool.report.few_contacts import draws_no_interval
from cdtool.report.html.traces import HEIGHTS
from cdtool.report.number_text import number, spoken, with_interval
from cdtool.report.plots.style import look_of
from cdtool.report.table import short, shown
from cdtool.report.tables.recordings import Log, log_of, logs_of
from cdtool.report.tables.results import part_of

# Heights [px] of a detector's lane in the latency plot and of the other plots.
LANE_HEIGHT, LANES_AXIS_HEIGHT, PLOT_HEIGHT = 66, 44, 300

Contacts = Mapping[tuple[str, str], Sequence[ContactResult]]


def plot_data(evaluated: Evaluated, traces: Sequence[Trace]) -> dict[str, Any]:
    """Everything that the plots need but the traces themselves."""
    results = evaluated.results
    contacts: dict[tuple[str, str], list[ContactResult]] = {}
    for item in results.scored_contacts:
        contacts.setdefault((item.group, item.detector), []).append(item)
    return {
        "detectors": [_detector(results, name) for name in results.detectors],
        "groups": [shown(group) for group in results.groups],
        "recordings": [shown(item.recording) for item in results.recordings],
        "heights": HEIGHTS,
        "latency": _latency(evaluated, contacts),
        "survival": _survival(results, contacts),
        "amoc": _amoc(results),
        "force": _force(results, traces),
    }


def _detector(results: Results, name: str) -> dict[str, str]:
    look = look_of(name)
    unit = part_of(results.provenance, "units").get(name, "")
    return {"name": shown(name), "unit": plain(unit), "colour": css_colour(look.colour), "marker": look.marker}


def css_colour(colour: str) -> str:
    """A colour of the figures as a page writes it; they also name greys by their lightness, as "0.35"."""
    if colour.startswith("#"):
        return colour
    return f"#{round(255.0 * float(colour)):02x}" + 2 * f"{round(255.0 * float(colour)):02x}"


def _latency(evaluated: Evaluated, contacts: Contacts) -> list[dict[str, Any]]:
    results = evaluated.results
    recordings = {(item.group, item.recording): i for i, item in enumerate(results.recordings)}
    detectors = {name: i for i, name in enumerate(results.detectors)}
    found: dict[str, dict[str, Any]] = {}
    for item in evaluated.summaries:
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


def _median(item: Summary) -> tuple[float, ...]:
    """The median with its interval; alone where a plot draws none."""
    median = item.median
    return (median.value,) if draws_no_interval(item) else (median.value, median.low, median.high)


def _survival(results: Results, contacts: Contacts) -> list[dict[str, Any]]:
    found = []
    for group in results.groups:
        rows = []
        for i, name in enumerate(results.detectors):
            latency, censored = latencies(contacts.get((group, name), ()))
            if not len(latency):
                continue
            curve = survival(latency, censored)
            # A step begins where the share changes; of the others only the band's end is worth keeping.
            kept = np.flatnonzero(np.diff(curve.share, prepend=2.0))
            keys = ("times", "share", *(("low", "high") if len(latency) >= FEWEST else ()))
            columns = {key: _numbers(getattr(curve, key)[kept]) for key in keys}
            rows.append({"detector": i, **columns, "until": short(float(latency.max())), "n": len(latency)})
        if rows:
            found.append({"group": shown(group), "rows": rows, "height": PLOT_HEIGHT})
    return found


def _amoc(results: Results) -> list[dict[str, Any]]:
    parts: dict[str, dict[str, list[SweepResult]]] = {}
    for item in results.sweep:
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
    """A detector's points by factor; `chosen` is the place of the factor in use."""
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


def _force(results: Results, traces: Sequence[Trace]) -> list[dict[str, Any]]:
    """For each group with a force profile its staircase, and which contacts of which traces have a verdict."""
    numbers = {(item.group, item.recording, item.onset_s): item.contact for item in results.contacts}
    verdicts = {(item.group, item.recording, item.contact): item for item in results.forces}
    logs = logs_of(results)
    curves: dict[str, list[dict[str, Any]]] = {}
    for i, trace in enumerate(traces):
        log: Log = log_of(trace.group, trace.recording, logs)
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
    found = []
    for group, profile in part_of(results.provenance, "force_profiles").items():
        if group in curves:
            steps = [
                [short(step["from_s"]), short(step["at_most_n"]), plain(step["name"])] for step in profile["steps"]
            ]
            count = sum(item.group == group for item in results.forces)
            words = {key: plain(profile.get(key) or "") for key in ("title", "source", "note")}
            found.append(
                {
                    "group": shown(group),
                    **words,
                    "checked": bool(profile.get("checked")),
                    "steps": steps,
                    "curves": curves[group],
                    "contacts": count,
                    "height": PLOT_HEIGHT,
                }
            )
    return found


def _numbers(values: np.ndarray) -> list[float | int | None]:
    return [short(float(value)) for value in values]
