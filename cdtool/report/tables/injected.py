"""Table of injected contacts: the range of the median latencies, and those of real contacts."""

from __future__ import annotations

import math

from cdtool.evaluation.agreement import Agreement, agreements
from cdtool.evaluation.evaluated import Evaluated
from cdtool.report.number_text import NOT_REACHED, NOTHING, number
from cdtool.report.table import Cell, Column, Fields, Table, empty_cell, key_of, name_cell, tabulate
from cdtool.report.tables.results import detector_cell


def injected_table(evaluated: Evaluated) -> Table:
    """Return the latencies of injected contacts beside those of the real ones they are compared with."""
    fields: Fields[Agreement] = (
        (Column("detector"), lambda item: detector_cell(evaluated.results, item.detector)),
        (Column("injected"), lambda item: name_cell(item.injected_group)),
        (Column("median [ms]", numeric=True), _injected),
        (Column("n", numeric=True), lambda item: Cell(str(item.injected_count), key=item.injected_count)),
        (Column("real"), lambda item: name_cell(item.real_group) if item.real_group else empty_cell()),
        (
            Column("real median [ms]", numeric=True),
            lambda item: Cell(milliseconds(item.real_ms), key=key_of(item.real_ms)),
        ),
        (Column("real n", numeric=True), lambda item: Cell(str(item.real_count), key=item.real_count)),
        (Column("assumed"), lambda item: Cell("; ".join(item.assumed))),
    )
    return tabulate("injected", "Injected contacts", fields, agreements(evaluated))


def milliseconds(value: float) -> str:
    """Return a median latency in ms, "not reached" where most contacts are missed."""
    return NOT_REACHED if math.isinf(value) else NOTHING if math.isnan(value) else number(value)


def median_range(item: Agreement) -> str:
    """Return the range of the true median latency [ms] that injected contacts show."""
    low, high = map(milliseconds, item.range_ms)
    return f"{low} to {high}" if low != high else low


def _injected(item: Agreement) -> Cell:
    return Cell(median_range(item), key=key_of(item.injected_ms[0]))
