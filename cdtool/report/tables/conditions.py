"""Table of the detectors under changed conditions of the machine, each value with that of the unchanged machine."""

from __future__ import annotations

from collections.abc import Callable

from cdtool.base.plain_text import plain
from cdtool.report.number_text import NOTHING, number, percent, value_and_interval
from cdtool.report.table import Cell, Heading, Table, empty_cell, key_of, name_cell, shown, tabulate
from cdtool.report.tables.results import detector_cell
from cdtool.results.changed_conditions import ConditionRow, condition_rows
from cdtool.results.evaluated import Evaluated


def conditions_table(evaluated: Evaluated) -> Table:
    """Return a row per changed condition and detector; without rows if there is no such condition."""
    rows = condition_rows(evaluated)
    groups = dict.fromkeys(name for item in rows for name in item.changed.struck)

    def latency_of(group: str) -> Callable[[ConditionRow], Cell]:
        return lambda item: latency_cell(item, group)

    fields: list[tuple[Heading, Callable[[ConditionRow], Cell]]] = [
        (Heading("detector", choice=True), lambda item: detector_cell(evaluated.results, item.detector)),
        (Heading("condition", choice=True), lambda item: name_cell(item.condition)),
    ]
    if any(item.changed.free for item in rows):
        fields.append((Heading("alarming impact-free runs", numeric=True), alarming_cell))
    fields += [(Heading(f"{shown(group)} [ms]", numeric=True), latency_of(group)) for group in groups]
    if groups:
        fields += [
            (Heading("missed", numeric=True), missed_cell),
            (Heading("contacts not assessable", numeric=True), not_assessable_cell),
        ]
    fields.append((Heading("samples not assessable", numeric=True), samples_cell))
    return tabulate("conditions", "Changed conditions", fields, rows, "conditions")


def alarming_cell(row: ConditionRow) -> Cell:
    """Return the alarming impact-free runs with the interval of their share."""
    if row.changed.free is None:
        return empty_cell()
    count, of = row.changed.alarming
    share = row.changed.alarming_share
    bounds = (f": {percent(share.low)} to {percent(share.high)}",) if share.known else ()
    return Cell(_of(count, of), (*bounds, _before(row.unchanged.alarming)), count, "bad" if count else "")


def latency_cell(row: ConditionRow, group: str) -> Cell:
    """Return the latency in a group of impacts."""
    if group not in row.changed.struck:
        return empty_cell()
    changed, before, statistic = row.latency(group)
    resolution = row.changed.struck[group].resolution_ms
    value, *bounds = value_and_interval(changed, resolution)
    median = (" (median)",) if statistic == "median" and changed.known else ()
    unchanged = NOTHING if before is None else number(before.value, error=resolution)
    return Cell(value, (*bounds, *median, f"; unchanged {unchanged}"), key_of(changed.value))


def missed_cell(row: ConditionRow) -> Cell:
    """Return the missed contacts of all groups."""
    return _count_cell(row.changed.missed, row.unchanged.missed, "bad")


def not_assessable_cell(row: ConditionRow) -> Cell:
    """Return the contacts that were not assessable, of all groups."""
    return _count_cell(row.changed.not_assessable, row.unchanged.not_assessable, "unknown")


def samples_cell(row: ConditionRow) -> Cell:
    """Return the share of the samples that were not assessable."""
    share, before = row.changed.not_assessable_share, row.unchanged.not_assessable_share
    return Cell(percent(share), (f"; unchanged {percent(before)}",), key_of(share))


def condition_words(row: ConditionRow) -> str:
    """Return the results of a detector under a changed condition in one line."""
    named = [("alarming impact-free runs", alarming_cell(row))] if row.changed.free else []
    named += [(f"{group} [ms]", latency_cell(row, group)) for group in row.changed.struck]
    if row.changed.struck:
        named += [("missed", missed_cell(row)), ("contacts not assessable", not_assessable_cell(row))]
    named.append(("samples not assessable", samples_cell(row)))
    return plain("; ".join(f"{name}: {cell.line.replace('; ', ', ')}" for name, cell in named))


def _count_cell(changed: tuple[int, int], before: tuple[int, int], tone: str) -> Cell:
    count, of = changed
    if not of:
        return empty_cell()
    return Cell(_of(count, of), (_before(before),), count, tone if count else "")


def _before(counts: tuple[int, int]) -> str:
    return f"; unchanged {_of(*counts)}"


def _of(count: int, of: int) -> str:
    return f"{count} of {of}" if of else NOTHING
