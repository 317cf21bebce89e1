"""The HTML page of a coverage map: a coloured table per detector, whose cells open the trigger plot of their contacts.

One file in the style of the benchmark report, with its trigger plots. Without script the tables remain readable. Text
from logs is escaped by the template or put into the page as text by the script; a content security policy allows only
this script and this style, by their hashes.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cdtool.base.plain_text import counted
from cdtool.commands.inject.coverage.coverage import Coverage
from cdtool.commands.inject.coverage.coverage_map import (
    CellContact,
    CellKey,
    CoverageMap,
    SpeedClass,
    TellingCell,
    TellingReason,
)
from cdtool.commands.inject.coverage.coverage_map import MapCell as MapCell
from cdtool.detectors.detection import REASONS
from cdtool.report.html.page_tables import classes, visible
from cdtool.report.html.sections_page import left_out_sections
from cdtool.report.html.self_contained import content_policy, page_part, page_template, script_json, style_sheet
from cdtool.report.html.traces import HEIGHTS, trace_data
from cdtool.report.model import AXES, NO_CERTIFICATE
from cdtool.report.number_text import NOTHING, number, short, spoken
from cdtool.report.plots.latency_axis import FLOOR_MS
from cdtool.report.plots.style import page_look
from cdtool.report.table import Cell, Heading, Table, count_cell, name_cell, number_cell, tabulate
from cdtool.results.traces.trace import Trace

_SCRIPTS = ("scales.js", "chart.js", "trace.js", "tables.js", "coverage.js")
# Colours of the style sheet, pale for fast to dark for slow, on a logarithmic scale that all maps share.
_LEVELS = 10
# A share of missed contacts to plan for, as `cdtool plan` takes it.
_MISSED_TO_SHOW = "5%"


@dataclass(frozen=True)
class PageCell:
    """A cell of a map as the template shows it: its number in the page's data, style classes, text and small print."""

    number: int
    style: str
    text: str
    details: tuple[str, ...]


@dataclass(frozen=True)
class PageMap:
    """The map of a detector: a row per stiffness, the stiffest first, and a column per position; None: no contact."""

    detector: str
    speed: str
    rows: tuple[tuple[str, tuple[PageCell | None, ...]], ...]


@dataclass(frozen=True)
class _Scale:
    """The logarithmic scale of latency [ms] that all maps share."""

    low: float
    high: float

    @classmethod
    def of(cls, made: CoverageMap) -> _Scale:
        values = [cell.latency_ms for cells in made.cells.values() for cell in cells.values()]
        known = [max(value, FLOOR_MS) for value in values if math.isfinite(value)] or [FLOOR_MS]
        return cls(min(known), max(known))

    def level(self, latency: float) -> int:
        """Return the number of the colour of a latency."""
        if self.high <= self.low:
            return 0
        share = math.log(max(latency, FLOOR_MS) / self.low) / math.log(self.high / self.low)
        return min(max(int(_LEVELS * share), 0), _LEVELS - 1)

    @property
    def steps(self) -> list[tuple[int, str]]:
        """Return the number of each colour with its lowest latency."""
        if self.high <= self.low:
            return [(0, number(self.low))]
        edges = np.geomspace(self.low, self.high, _LEVELS + 1)
        return [(level, number(float(edge))) for level, edge in enumerate(edges[:-1])]


def coverage_html(done: Coverage) -> str:
    """Return the whole page; the same text for the same input."""
    from markupsafe import Markup

    made = done.map
    scale, numbers = _Scale.of(made), _numbers(made)
    traces = _traces(done)
    style, script = style_sheet(page_part("coverage.css")), "\n".join(page_part(name) for name in _SCRIPTS)
    missed, telling = made.missed(), made.most_telling(20)
    return page_template("coverage.html.j2").render(
        policy=content_policy(style, script),
        style=Markup(style),
        script=Markup(script),
        data=script_json(_data(made, list(traces))),
        traces=[script_json(item) for item in traces.values()],
        scope=_scope(done),
        headline=coverage_headline(made),
        tone=coverage_tone(made),
        counts=coverage_counts(made),
        certificate=NO_CERTIFICATE,
        maps=[_map(made, name, speed, scale, numbers) for name in made.cells for speed in made.speeds],
        steps=scale.steps,
        positions=[short(item) for item in made.positions],
        unit=made.unit,
        missed=_missed_table(made, missed) if missed else None,
        few=len(missed) <= 12,
        telling=_telling_table(made, telling) if telling else None,
        left_out=left_out_sections(tuple(dict.fromkeys(done.skipped)), tuple(dict.fromkeys(done.findings)))[0].tables,
        classes=classes,
    )


def _numbers(made: CoverageMap) -> dict[tuple[str, CellKey], int]:
    """Return the number of each cell in the page's data."""
    keys = [(name, key) for name, cells in made.cells.items() for key in cells]
    return {key: place for place, key in enumerate(keys)}


def _scope(done: Coverage) -> list[str]:
    made = done.map
    contacts = {item.recording for cells in made.cells.values() for cell in cells.values() for item in cell.recordings}
    speeds = [item for item in made.speeds if math.isfinite(item.lowest)]
    words = [
        done.machine,
        counted(len(contacts), "injected contact"),
        f"{counted(len(made.positions), 'position')} from {_between(made.positions)} {made.unit}",
        f"{_between([item / 1e3 for item in made.stiffnesses])} N/mm",
    ]
    if speeds:
        words.append(f"{_between([*(item.lowest for item in speeds), speeds[-1].highest])} {made.speed_unit}")
    return [visible(word) for word in words]


def _between(values: Sequence[float]) -> str:
    low, high = short(min(values)), short(max(values))
    return low if low == high else f"{low} to {high}"


def _totals(made: CoverageMap) -> tuple[int, int]:
    """Return the numbers of missed and of assessable contacts of all detectors."""
    cells = [cell for of_detector in made.cells.values() for cell in of_detector.values()]
    return sum(cell.missed for cell in cells), sum(cell.assessable for cell in cells)


def coverage_headline(made: CoverageMap) -> str:
    """Return which detectors miss contacts."""
    missed, assessable = _totals(made)
    if not assessable:
        return "No contact is assessable"
    if not missed:
        return "No assessable contact is missed"
    names = [visible(name) for name, cells in made.cells.items() if any(cell.missed for cell in cells.values())]
    return f"Contacts are missed by {', '.join(names)}"


def coverage_tone(made: CoverageMap) -> str:
    """Return whether that is good, bad or unknown."""
    missed, assessable = _totals(made)
    return "unknown" if not assessable else "bad" if missed else "good"


def coverage_counts(made: CoverageMap) -> str:
    """Return how many contacts each detector misses."""
    parts = []
    for name, cells in made.cells.items():
        missed, assessable = (
            sum(cell.missed for cell in cells.values()),
            sum(cell.assessable for cell in cells.values()),
        )
        contacts = sum(cell.contacts for cell in cells.values())
        rest = f", {contacts - assessable} not assessable" if contacts > assessable else ""
        parts.append(f"{visible(name)}: {missed} of {assessable} missed{rest}")
    return "; ".join(parts)


def _map(
    made: CoverageMap, name: str, speed: SpeedClass, scale: _Scale, numbers: Mapping[tuple[str, CellKey], int]
) -> PageMap:
    rows = []
    for stiffness in reversed(made.stiffnesses):
        keys = [CellKey(position, stiffness, speed.speed) for position in made.positions]
        cells = [
            _page_cell(made.cells[name][key], numbers[name, key], scale) if key in made.cells[name] else None
            for key in keys
        ]
        rows.append((in_n_per_mm(stiffness), tuple(cells)))
    return PageMap(visible(name), _speed_words(made, speed), tuple(rows))


def _speed_words(made: CoverageMap, speed: SpeedClass) -> str:
    if speed.speed is None:
        return ""
    return f"contact speed {_between([speed.lowest, speed.highest])} {made.speed_unit}"


def _page_cell(cell: MapCell, place: int, scale: _Scale) -> PageCell:
    style = "unassessed" if math.isnan(cell.latency_ms) else f"level-{scale.level(cell.latency_ms)}"
    if cell.misses_most:
        style = "misses-most"
    elif cell.missed:
        style += " misses-some"
    lines = []
    if cell.missed:
        lines.append(f"{cell.missed} of {cell.assessable} missed")
    if not math.isnan(cell.latency_ms):
        lines.append("–".join(dict.fromkeys(number(value, 2) for value in cell.range_ms)))
        if cell.two_standard_errors_ms:
            lines.append(f"± {number(cell.two_standard_errors_ms, 2)}")
    if math.isfinite(cell.force_n):
        lines.append(f"{number(cell.force_n)} N")
    if cell.not_assessable:
        lines.append(f"{cell.not_assessable} of {cell.contacts} not assessable")
    return PageCell(place, style, lines[0] if lines else NOTHING, tuple(lines[1:]))


def _latency(cell: MapCell) -> str:
    """Return the mean latency, or the range of the assumptions, with two standard errors."""
    words = "–".join(dict.fromkeys(number(value) for value in cell.range_ms))
    return f"{words} ± {number(cell.two_standard_errors_ms, 2)}" if cell.two_standard_errors_ms else words


def in_n_per_mm(stiffness: float) -> str:
    """Return a stiffness [N/m] in N/mm, as a text."""
    return short(stiffness / 1e3)


def _place_fields(made: CoverageMap) -> list[tuple[Heading, Any]]:
    """Return the columns that name a cell, for items (detector, key, cell)."""
    fields: list[tuple[Heading, Any]] = [
        (Heading("detector"), lambda item: name_cell(visible(item[0]))),
        (Heading(f"position [{made.unit}]", numeric=True), lambda item: number_cell(item[1].position)),
        (
            Heading("stiffness [N/mm]", numeric=True),
            lambda item: Cell(in_n_per_mm(item[1].stiffness), key=item[1].stiffness),
        ),
    ]
    if len(made.speeds) > 1:
        fields.append((Heading(f"speed [{made.speed_unit}]", numeric=True), lambda item: number_cell(item[1].speed)))
    return fields


def _missed_table(made: CoverageMap, items: Sequence[tuple[str, CellKey, MapCell]]) -> Table:
    fields = [
        *_place_fields(made),
        (Heading("missed", numeric=True), lambda item: count_cell(item[2].missed, "bad")),
        (Heading("of", numeric=True), lambda item: count_cell(item[2].assessable)),
        (Heading("latency of the others [ms]", numeric=True), lambda item: Cell(_latency_or_nothing(item[2]))),
    ]
    return tabulate("missed", "Cells with missed contacts, the largest share first", fields, items)


def _latency_or_nothing(cell: MapCell) -> str:
    return NOTHING if math.isnan(cell.latency_ms) else _latency(cell)


def _telling_table(made: CoverageMap, items: Sequence[TellingCell]) -> Table:
    fields = [
        *_place_fields(made),
        (Heading("why"), lambda item: Cell(_reason(item[3]))),
        (Heading("missed", numeric=True), lambda item: Cell(f"{item[2].missed} of {item[2].assessable}")),
        (Heading("latency [ms]", numeric=True), lambda item: Cell(_latency_or_nothing(item[2]))),
        (Heading("std [ms]", numeric=True), lambda item: number_cell(item[2].standard_deviation_ms)),
        (Heading("size of the test"), lambda item: Cell(_plan(item[3]))),
    ]
    rows = [(item.detector, item.key, item.cell, item) for item in items]
    return tabulate(
        "telling", "Cells that a test at the rig would tell most about, missed contacts first", fields, rows
    )


def _reason(item: TellingCell) -> str:
    words: str = item.reason.value
    return f"{words}: {number(item.cell.limit_ms)} ms" if item.reason is TellingReason.NEAR_LIMIT else words


def _plan(item: TellingCell) -> str:
    """Return the command that calculates how many impacts a test of this cell needs."""
    if item.reason is TellingReason.MISSED_IN_PART:
        return f"cdtool plan --missed-at-most {_MISSED_TO_SHOW}"
    std = item.cell.standard_deviation_ms
    if not std > 0.0:
        return NOTHING
    return f"cdtool plan --difference-ms {number(item.cell.uncertainty_ms)} --std-ms {number(std)} --unpaired"


def _traces(done: Coverage) -> dict[str, dict[str, Any]]:
    """Return the trigger plots by recording in the order in which they matter, as many as the page may hold."""
    detectors = {name: place for place, name in enumerate(done.map.cells)}
    found, size = {}, 0
    for recording, trace in done.traces.items():
        values = trace_data(_around_contact(trace), detectors)
        size += len(json.dumps(values, ensure_ascii=False, separators=(",", ":")))
        if size > 4_200_000:  # characters of JSON: the page stays below 5 MB
            break
        found[recording] = values
    return found


def _around_contact(trace: Trace) -> Trace:
    """Return a trace without the approach long before its contact."""
    contact = trace.shown
    if contact is None:
        return trace
    # Half a second before the contact: the approach is the same in all recordings of a log.
    start = max(trace.start, min(trace.view[0], contact.start - 0.5))
    kept = trace.force_time >= start
    panels = tuple(replace(panel, course=panel.course.within((start, trace.end))) for panel in trace.panels)
    return replace(trace, start=start, force_time=trace.force_time[kept], force=trace.force[kept], panels=panels)


def _data(made: CoverageMap, traced: Sequence[str]) -> dict[str, Any]:
    """Return what the script needs: detectors for the trigger plots, and of each cell its contacts, the worst first."""
    numbers = {recording: place for place, recording in enumerate(traced)}
    items = [(name, key, cell) for name, cells in made.cells.items() for key, cell in cells.items()]
    worst = [(name, key) for name, key, _ in made.missed()] + [(i.detector, i.key) for i in made.most_telling(1)]
    return {
        "detectors": [{"name": visible(name), **page_look(name)} for name in made.cells],
        "heights": HEIGHTS,
        "axes": AXES,
        "reasons": REASONS,
        "cells": [
            {
                "title": _title(made, name, key),
                "contacts": [[visible(item.recording), *_words(item, made.speed_unit)] for item in cell.recordings],
                "traces": [numbers.get(item.recording, -1) for item in cell.recordings],
            }
            for name, key, cell in items
        ],
        "first": _numbers(made)[worst[0]] if worst else 0,
    }


def _title(made: CoverageMap, name: str, key: CellKey) -> str:
    speed = "" if key.speed is None else f", {number(key.speed)} {made.speed_unit}"
    return f"{visible(name)}: {short(key.position)} {made.unit}, {in_n_per_mm(key.stiffness)} N/mm{speed}"


def _words(contact: CellContact, speed_unit: str) -> list[str]:
    """Return the outcome, force, speed and assumption of a contact."""
    outcome = f"{number(contact.latency_ms)} ms" if math.isfinite(contact.latency_ms) else spoken(contact.outcome)
    if not contact.reliable:
        outcome += ", later than the injected contact is reliable"
    force = f"{number(contact.force_n)} N" if math.isfinite(contact.force_n) else NOTHING
    speed = f"{number(contact.speed)} {speed_unit}" if math.isfinite(contact.speed) else NOTHING
    return [outcome, force, speed, visible(spoken(contact.assumption)) or NOTHING]
