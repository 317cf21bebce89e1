"""Table of injected contacts: the range of the median latencies, and those of real contacts."""

from __future__ import annotations

from cdtool.base.plain_text import plain
from cdtool.report.number_text import number
from cdtool.report.table import Cell, Fields, Heading, Table, empty_cell, key_of, name_cell, number_cell, tabulate
from cdtool.report.tables.results import detector_cell
from cdtool.results.agreement import Agreement, agreements
from cdtool.results.evaluated import Evaluated


class InjectedSection:
    """The section of a report on injected contacts."""

    @staticmethod
    def table(evaluated: Evaluated) -> Table:
        """Return the latencies of injected contacts beside those of the real ones they are compared with."""
        fields: Fields[Agreement] = (
            (Heading("detector"), lambda item: detector_cell(evaluated.results, item.detector)),
            (Heading("injected"), lambda item: name_cell(item.injected_group)),
            (Heading("median [ms]", numeric=True), _injected),
            (Heading("n", numeric=True), lambda item: Cell(str(item.injected_count), key=item.injected_count)),
            (Heading("real"), lambda item: name_cell(item.real_group) if item.real_group else empty_cell()),
            (
                Heading("real median [ms]", numeric=True),
                lambda item: number_cell(item.real_ms, item.resolution_ms),
            ),
            (Heading("real n", numeric=True), lambda item: Cell(str(item.real_count), key=item.real_count)),
            (Heading("assumed"), lambda item: Cell("; ".join(item.assumed))),
        )
        return tabulate("injected", "Injected contacts", fields, agreements(evaluated))

    @staticmethod
    def lines(evaluated: Evaluated) -> list[str]:
        """Return the latencies that are compared with real ones, and those that are a range, for the terminal."""
        shown = [item for item in agreements(evaluated) if item.real_group or item.is_range]
        lines = []
        for item in shown:
            line = f"{item.detector}: {plain(item.injected_group)} {_median_range(item)}"
            if item.real_group:
                line += f", real ({plain(item.real_group)}) {number(item.real_ms, error=item.resolution_ms)}"
                lines.append(f"{line} ms, n = {item.injected_count} and {item.real_count}")
            else:
                lines.append(f"{line} ms, n = {item.injected_count}")
        assumed = dict.fromkeys(text for item in shown for text in item.assumed)
        return [*lines, *(f"bracket: {text}" for text in assumed)]


def _median_range(item: Agreement) -> str:
    """Return the range of the true median latency [ms] that injected contacts show."""
    low, high = (number(value, error=item.resolution_ms) for value in item.range_ms)
    return f"{low} to {high}" if low != high else low


def _injected(item: Agreement) -> Cell:
    return Cell(_median_range(item), key=key_of(item.injected_ms[0]))
