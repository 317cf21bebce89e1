"""Tables of a benchmark's results: limits, latencies and false alarms, pairs of detectors, false-alarm budgets."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from cdtool.base.plain_text import counted
from cdtool.report.few_contacts import LatencyColumn, latency_columns, latency_interval
from cdtool.report.number_text import (
    NOT_ASSESSABLE,
    NOT_REACHED,
    NOTHING,
    missed,
    number,
    rate,
    spoken,
)
from cdtool.report.table import (
    Cell,
    Fields,
    Heading,
    Table,
    count_cell,
    empty_cell,
    interval_cell,
    key_of,
    name_cell,
    number_cell,
    outcome_cell,
    shown,
    tabulate,
)
from cdtool.results.comparison import SIGNIFICANT, Comparison
from cdtool.results.evaluated import Evaluated
from cdtool.results.results import CalibrationResult, LimitResult, Results, grouped
from cdtool.results.summary import Summary
from cdtool.statistics.interval import Interval
from cdtool.statistics.paired import holm

_WORST_FIRST = ("violated", "not_assessable", "met")
TOO_FEW = "too few recordings to show one"
_NONE_SHOWN = "no difference shown"
MISSED, FALSE_ALARMS = "missed", "false alarms"


def part_of(provenance: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """Return a table of the provenance; empty where it has none, because a file may contain anything there."""
    found = provenance.get(key)
    return found if isinstance(found, Mapping) else {}


def detector_cell(results: Results, detector: str) -> Cell:
    """Return the cell of a detector's full name with its short name."""
    short = part_of(results.provenance, "short_names").get(detector)
    return Cell(shown(detector), (f" ({shown(short)})",) if short else ())


def limits_table(results: Results, *, met: bool) -> Table:
    """Return the limits that are met, or the others, violated ones first."""
    fields: Fields[LimitResult] = (
        (Heading("outcome", choice=True, names_row=False), lambda item: outcome_cell(item.outcome)),
        (Heading("detector"), lambda item: detector_cell(results, item.detector)),
        (Heading("group"), lambda item: name_cell(item.group)),
        (Heading("result"), lambda item: Cell(item.figure)),
        (Heading("value", numeric=True), lambda item: Cell(value_of(item), key=key_of(item.value))),
        (Heading("required"), lambda item: Cell(required(item))),
        (Heading("why"), lambda item: Cell(item.reason or "")),
    )
    name, title = ("met", "Limits met") if met else ("not_met", "Limits not met")
    return tabulate(name, title, fields, _limits(results, met=met), "limits")


def value_of(limit: LimitResult) -> str:
    """Return the value that a limit is compared with; one that was checked without a number is infinite."""
    if limit.value is None:
        return NOTHING if limit.outcome == "not_assessable" else NOT_REACHED
    return f"{limit.value:.6g}"


def limits_in_words(results: Results) -> list[str]:
    """Return what each limit that is not met is about, and why it is not, violated ones first."""
    return [
        f"{shown(item.detector)}, {shown(item.group)}, {item.figure}: {item.reason or spoken(item.outcome)}"
        for item in _limits(results, met=False)
    ]


def _limits(results: Results, *, met: bool) -> list[LimitResult]:
    items = [item for item in results.limits if (item.outcome == "met") == met]
    return sorted(items, key=lambda item: _WORST_FIRST.index(item.outcome))


def required(limit: LimitResult) -> str:
    """Return what a limit requires, with the digits of its file."""
    least, largest = limit.least, limit.largest
    if least is not None and largest is not None:
        return f"{least:.6g} to {largest:.6g}"
    if largest is not None:
        return f"at most {largest:.6g}"
    return NOTHING if least is None else f"at least {least:.6g}"


def results_table(items: Sequence[Summary]) -> Table:
    """Return the results in at most six columns, a part for each group; what all of its rows share is in its heading.

    Columns that no row fills are left out.
    """
    fields: list[tuple[Heading, Callable[[Summary], Cell]]] = [
        (Heading("detector"), lambda item: name_cell(item.detector))
    ]
    if any(item.contacts for item in items):
        columns = latency_columns(items)
        kept = [name for name in columns if name in ("median", "range" if "range" in columns else "P95")]
        fields += [
            *((Heading(f"{name} [ms]", numeric=True), partial(latency_cell, name)) for name in kept),
            (Heading(MISSED, numeric=True, choice=True), _short_missed),
        ]
    fields.append((Heading(FALSE_ALARMS, numeric=True, choice=True), _short_false_alarms))
    if any(not math.isnan(item.force_at_alarm) for item in items):
        fields.append((Heading("force at alarm [N]", numeric=True), lambda item: number_cell(item.force_at_alarm)))
    rows: list[list[Cell]] = []
    parts = {}
    for group, of_group in grouped(items, "group").items():
        own = [[make(item) for _, make in fields] for item in of_group]
        if len(own) > 1 and not of_group[0].contacts and all(row[1:] == own[0][1:] for row in own):
            own = [[Cell(f"all {len(own)} detectors" if len(own) > 2 else "both detectors"), *own[0][1:]]]
        shared = [_taken_out(own, place, field.heading) for place, (field, _) in enumerate(fields)]
        failed = of_group[0].force_failed
        shared += [f"; force limit exceeded by {counted(int(failed), 'contact')}"] if failed > 0.0 else []
        parts[len(rows)] = Cell(shown(group), tuple(filter(None, shared)))
        rows += own
    return Table("results", "Results", [column for column, _ in fields], rows, "contacts", parts=parts)


def _taken_out(rows: Sequence[list[Cell]], place: int, heading: str) -> str:
    """Take out of the rows what all of them say of their counts, and return it; empty if they differ."""
    details = {row[place].details for row in rows}
    if heading not in (MISSED, FALSE_ALARMS) or len(details) > 1 or not any(details):
        return ""
    for row in rows:
        row[place] = replace(row[place], details=())
    return f"; {heading}{''.join(*details)}"


def every_result_table(results: Results, items: Sequence[Summary], *, kinds: bool = False) -> Table:
    """Return all latencies with what they must be read with, a row per summary, of groups or of kinds of contacts.

    Columns that no row fills are left out; so is a rate per hour where less than an hour was recorded.
    """
    fields: list[tuple[Heading, Callable[[Summary], Cell]]] = [
        (Heading("detector"), lambda item: detector_cell(results, item.detector)),
        (Heading("group/kind" if kinds else "group", choice=True), lambda item: name_cell(item.group)),
        *_of_contacts(items),
    ]
    if not kinds:  # a false alarm belongs to none
        fields.append((Heading(FALSE_ALARMS, numeric=True), _false_alarms))
        fields.append((Heading("false alarms per operation", numeric=True), _per_operation))
    if any(map(_has_hour, items)):
        fields.append((Heading("per hour", numeric=True), _per_hour))
    name, title = ("kinds", "Latency and misses by kind of contact") if kinds else ("all_results", "All results")
    return tabulate(name, title, [*fields, *_of_force(items)], items, "contacts")


def _of_contacts(items: Sequence[Summary]) -> list[tuple[Heading, Callable[[Summary], Cell]]]:
    """Return the columns of latencies and outcomes; empty without a contact."""
    fields: list[tuple[Heading, Callable[[Summary], Cell]]] = []
    if any(item.contacts for item in items):
        fields += [
            *((Heading(f"{name} [ms]", numeric=True), partial(latency_cell, name)) for name in latency_columns(items)),
            (Heading("contacts detected", numeric=True), _detected),
            (Heading("missed", numeric=True), _missed),
            (Heading("not assessable", numeric=True), _not_assessable),
        ]
    return fields


def _of_force(items: Sequence[Summary]) -> list[tuple[Heading, Callable[[Summary], Cell]]]:
    """Return the columns of the force that a row fills."""
    fields: list[tuple[Heading, Callable[[Summary], Cell]]] = []
    if any(not math.isnan(item.force_at_alarm) for item in items):
        fields.append((Heading("force at alarm [N]", numeric=True), _force_at_alarm))
    if any(not math.isnan(item.peak_force) for item in items):
        fields.append((Heading("peak force [N]", numeric=True), lambda item: number_cell(item.peak_force)))
    if any(not math.isnan(item.force_failed) for item in items):
        fields.append((Heading("force limit exceeded", numeric=True), _force_failed))
    return fields


def comparisons_table(evaluated: Evaluated) -> Table:
    """Return the pairs of detectors on the contacts that both could assess, as far as a difference could be shown."""
    results, without = evaluated.results, without_difference(evaluated.comparisons)
    fields: Fields[tuple[Comparison, str]] = (
        (Heading("group", choice=True), lambda pair: name_cell(pair[0].group)),
        (Heading("first"), lambda pair: detector_cell(results, pair[0].first)),
        (Heading("second"), lambda pair: detector_cell(results, pair[0].second)),
        (Heading("difference", choice=True), lambda pair: _difference_cell(*pair)),
        (Heading("contacts", numeric=True), lambda pair: count_cell(pair[0].contacts)),
        (Heading("latency, first minus second [ms]", numeric=True), lambda pair: interval_cell(pair[0].latency.mean)),
        (Heading("p", numeric=True), lambda pair: _p(pair[0].latency_p)),
        (Heading("missed only by first", numeric=True), lambda pair: count_cell(pair[0].only_first_missed)),
        (Heading("missed only by second", numeric=True), lambda pair: count_cell(pair[0].only_second_missed)),
        (Heading("p of misses", numeric=True), lambda pair: _p(pair[0].missed_p)),
    )
    pairs = [pair for pair in zip(evaluated.comparisons, without, strict=True) if pair[1] != TOO_FEW]
    return tabulate("comparisons", "Pairs of detectors on the same contacts", fields, pairs, "contacts")


def comparisons_note(evaluated: Evaluated) -> str:
    """Return how many pairs of detectors show a difference, and how many could not have shown one; empty if none."""
    without = without_difference(evaluated.comparisons)
    if not without:
        return ""
    words = f"A difference is shown in {without.count('')} of {counted(len(without), 'pair')} of detectors"
    few = f"; in {without.count(TOO_FEW)} there are {TOO_FEW}, those of one campaign counted as one"
    return f"{words}{few if TOO_FEW in without else ''}."


def calibration_table(results: Results) -> Table:
    """Return how safety factors were set for a false-alarm budget."""
    fields: Fields[CalibrationResult] = (
        (Heading("detector"), lambda item: detector_cell(results, item.detector)),
        (Heading("false alarms allowed"), lambda item: Cell(item.budget)),
        (Heading("safety factor set", numeric=True), lambda item: number_cell(item.safety_factor)),
        (Heading("alarms with it", numeric=True), lambda item: count_cell(item.alarms)),
        (Heading("operations", numeric=True), lambda item: count_cell(item.operations)),
        (Heading("hours", numeric=True), lambda item: number_cell(item.hours)),
    )
    return tabulate("calibration", "False-alarm budget", fields, results.calibration, "calibration")


def latency_cell(column: LatencyColumn, item: Summary) -> Cell:
    """Return a column of the latency; the range is sorted by its longer end."""
    if column != "range":
        interval = latency_interval(item, column)
        return empty_cell() if interval is None else interval_cell(interval, item.resolution_ms)
    ends = dict.fromkeys(number(end, error=item.resolution_ms) for end in (item.min_ms, item.max_ms))
    return Cell(" to ".join(ends), key=key_of(item.max_ms))


def _short_missed(item: Summary) -> Cell:
    cell = _missed(item)
    unseen = (f"; {item.not_assessable} {NOT_ASSESSABLE}",) if item.not_assessable else ()
    return replace(cell, details=(*cell.details, *unseen), tone=cell.tone or ("unknown" if unseen else ""))


def _short_false_alarms(item: Summary) -> Cell:
    if not has_exposure(item):
        return _false_alarms(item)
    return replace(_false_alarms(item), details=(f" in {_operations(item)}", f": {at_most(item)}"))


def _detected(item: Summary) -> Cell:
    return Cell(f"{item.detected} of {item.contacts}", key=item.detected) if item.contacts else empty_cell()


def _missed(item: Summary) -> Cell:
    count, *bound = missed(item.missed, item.detected + item.missed, item.missed_at_most)
    return Cell(count, tuple(bound), item.missed if bound else key_of(None), "bad" if item.missed else "")


def _not_assessable(item: Summary) -> Cell:
    return count_cell(item.not_assessable, "unknown") if item.contacts else empty_cell()


def _false_alarms(item: Summary) -> Cell:
    """Return the count with its exposure; without any exposure no number but words."""
    if not has_exposure(item):
        nowhere = f" in any of {counted(item.operations, 'operation')}"
        return Cell(NOT_ASSESSABLE, (nowhere,), key_of(None), "unknown") if item.operations else empty_cell()
    within = (f" in {_operations(item)}", f", {number(item.hours)} h")
    return Cell(str(item.false_alarms), within, item.false_alarms, "bad" if item.false_alarms else "")


def _operations(item: Summary) -> str:
    """Return the operations in which an alarm would have counted."""
    of_all = f"{item.judged_operations} of " if item.judged_operations < item.operations else ""
    return of_all + counted(item.operations, "operation")


def at_most(item: Summary) -> str:
    """Return the bound of the rate of false alarms; that per hour only where at least an hour was recorded."""
    per_hour = f", {number(item.at_most_per_hour)} per hour" if _has_hour(item) else ""
    return f"at most {number(item.at_most_per_operation)} per operation{per_hour}"


def _per_operation(item: Summary) -> Cell:
    return _rate(item, item.false_alarms_per_operation, item.at_most_per_operation)


def _per_hour(item: Summary) -> Cell:
    return _rate(item, item.false_alarms_per_hour, item.at_most_per_hour) if _has_hour(item) else empty_cell()


def _rate(item: Summary, interval: Interval, at_most: float) -> Cell:
    if not has_exposure(item):
        return empty_cell()
    text, *details = rate(item.false_alarms, interval, at_most)
    return Cell(text, tuple(details), key_of(interval.value))


def has_exposure(item: Summary) -> bool:
    """Return whether an alarm would have counted anywhere: otherwise their absence means nothing."""
    return item.watched and item.judged_operations > 0


def _has_hour(item: Summary) -> bool:
    return item.hours >= 1.0


def _force_at_alarm(item: Summary) -> Cell:
    if math.isnan(item.force_at_alarm):
        return empty_cell()
    return Cell(
        number(item.force_at_alarm), (f", largest {number(item.force_at_alarm_max)}",), key_of(item.force_at_alarm)
    )


def _force_failed(item: Summary) -> Cell:
    return empty_cell() if math.isnan(item.force_failed) else count_cell(int(item.force_failed), "bad")


def _difference_cell(item: Comparison, without: str) -> Cell:
    words = [f"{shown(item.faster)} is faster"] if item.faster else []
    words += [f"{shown(item.misses_less)} misses fewer contacts"] if item.misses_less else []
    return Cell("; ".join(words) or without, tone="" if words else "unknown")


def _p(value: float) -> Cell:
    return Cell(NOTHING if math.isnan(value) else f"{value:.2g}", key=key_of(value))


def without_difference(comparisons: Sequence[Comparison]) -> list[str]:
    """Return for each pair why it shows no difference: there are too few recordings, or none is shown; else ""."""
    too_few: dict[int, bool] = {}
    for group in dict.fromkeys(item.group for item in comparisons):
        places = [i for i, item in enumerate(comparisons) if item.group == group]
        too_few |= dict(zip(places, _too_few([comparisons[i] for i in places]), strict=True))
    return [
        "" if item.faster or item.misses_less else TOO_FEW if too_few[i] else _NONE_SHOWN
        for i, item in enumerate(comparisons)
    ]


def _too_few(group: Sequence[Comparison]) -> list[bool]:
    """Return whether no outcome could have been below the level: each test of a group with its least p, then Holm's.

    Least p: 2 / 2^k of k recordings for latency, of k contacts for misses. A corrected p falls only if others do.
    """
    latency = [_least_p(item.latency.clusters) if item.latency.clusters > 1 else math.nan for item in group]
    tested = [not math.isnan(item.missed_p) or not item.latency.n for item in group]
    missed_p = [_least_p(item.contacts) if known else math.nan for item, known in zip(group, tested, strict=True)]
    least = holm(latency + missed_p)
    return [not (least[i] < SIGNIFICANT or least[len(group) + i] < SIGNIFICANT) for i, item in enumerate(group)]


def _least_p(count: int) -> float:
    return float(min(1.0, 2.0 ** (1 - count)))
