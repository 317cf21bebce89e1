"""What every report of a comparison of two builds shows, computed once as plain values: verdict, tables, notes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from cdtool.base.plain_text import LISTED
from cdtool.commands.compare.comparison import BuildComparison
from cdtool.commands.compare.questions import Figure
from cdtool.commands.compare.rows import BuildRow
from cdtool.report.few_contacts import EXPLAINED
from cdtool.report.model import NO_CERTIFICATE
from cdtool.report.number_text import NOTHING, number
from cdtool.report.table import Cell, Fields, Heading, Table, name_cell, shown, tabulate

_TONES = {"worse": "bad", "mixed": "bad", "inconclusive": "unknown"}
_HOW_TO_READ = (
    "Two values are old / new. Contacts: the same ones in both, unless there are two numbers. Latency is a mean (of "
    "fewer than ten contacts a median) and the force at the alarm a median, of the contacts that both detected; "
    "changes are means of their pairs. “No change shown” does not mean that there is no change: the change in brackets "
    "would have been shown with 80 % power. A change has an interval from ten or more recordings or campaigns."
)


@dataclass(frozen=True)
class ComparisonModel:
    """The plain values of a comparison. Texts from files are unchanged: renderers escape them.

    `changes`: what is shown to be worse or better, a sentence per detector and group, the first ten.
    """

    verdict: str
    short_results: Table
    changes: Sequence[str]
    results: Table
    changed: Table
    how_to_read: Sequence[str]
    notes: Sequence[str]


def comparison_model(comparison: BuildComparison) -> ComparisonModel:
    """Return everything that the report of a comparison shows."""
    inconclusive = (
        "“Inconclusive”: these recordings could not have shown a change for the worse of "
        f"{100.0 * comparison.relevant_change:g} %."
    )
    few = any(row.few for row in comparison.rows)
    changed_rows = [row for row in comparison.rows if row.outcome in ("worse", "mixed", "better")]
    changed: Fields[tuple[str, str, str]] = (
        (Heading("setting"), lambda item: Cell(item[0])),
        (Heading("old"), lambda item: Cell(item[1])),
        (Heading("new"), lambda item: Cell(item[2])),
    )
    only = (("old", comparison.only_old), ("new", comparison.only_new))
    return ComparisonModel(
        verdict=comparison.words,
        short_results=_short_table(comparison.rows),
        changes=[f"{shown(row.group)}, {shown(row.detector)}: {row.words}" for row in changed_rows[:LISTED]]
        + ([f"and {len(changed_rows) - LISTED} more changes"] if len(changed_rows) > LISTED else []),
        results=_results_table(comparison.rows, few),
        changed=tabulate(
            "changed",
            "Under test, and different",
            changed,
            [(item.key, item.old, item.new) for item in comparison.changed],
        ),
        how_to_read=(f"{_HOW_TO_READ} {inconclusive} {NO_CERTIFICATE}", *([EXPLAINED] if few else [])),
        notes=(
            *(f"Only in {which}, not compared: {', '.join(names)}." for which, names in only if names),
            *(f"{note}." for note in comparison.notes),
        ),
    )


def both(row: BuildRow, figure: Figure, digits: int = 3) -> str:
    """Return a value of both builds as "old / new", a mean with `digits` digits; a dash if neither is known."""
    answer = row.question(figure)
    if answer is None or (math.isnan(answer.old) and math.isnan(answer.new)):
        return NOTHING
    # Means of ten or more contacts can differ by less than the resolution of one.
    error = {"latency_ms": row.resolution_ms if answer.ranges else None, "force_at_alarm_n": None}.get(figure, 1.0)
    return f"{number(answer.old, digits, error)} / {number(answer.new, digits, error)}"


def ranges_of(row: BuildRow) -> str:
    """Return the ranges of latency of both builds as "25 to 28 / 30 to 34"; empty with ten or more contacts."""
    latency = row.question("latency_ms")
    if latency is None or latency.ranges is None:
        return ""
    texts = ([number(end, error=row.resolution_ms) for end in ends] for ends in latency.ranges)
    return " / ".join(" to ".join(dict.fromkeys(ends)) for ends in texts)


def contacts_of(row: BuildRow) -> str:
    """Return the number of pairs; "old / new" if the contacts are not the same; a dash without any contact."""
    if not row.old_contacts and not row.new_contacts:
        return NOTHING
    return str(row.pairs) if row.paired else f"{row.old_contacts} / {row.new_contacts}"


def _short_table(rows: Sequence[BuildRow]) -> Table:
    """Return the rows in seven columns, which fit a pull request; the result in one word."""
    fields: Fields[BuildRow] = (
        (Heading("group"), lambda row: name_cell(row.group)),
        (Heading("detector"), lambda row: name_cell(row.detector)),
        (Heading("latency ms"), lambda row: Cell(both(row, "latency_ms"))),
        (Heading("missed"), lambda row: Cell(both(row, "missed"))),
        (Heading("false alarms"), lambda row: Cell(both(row, "false_alarms"))),
        (Heading("force at alarm N"), lambda row: Cell(both(row, "force_at_alarm_n"))),
        (Heading("result", choice=True), lambda row: Cell(row.outcome, tone=_TONES.get(row.outcome, ""))),
    )
    return tabulate("short_results", "", fields, rows)


def _results_table(rows: Sequence[BuildRow], few: bool) -> Table:
    """Return a row per detector and group; `few`: with ranges of latency, as a row has too few contacts for a mean."""
    ranges: Fields[BuildRow] = ((Heading("range ms"), lambda row: Cell(ranges_of(row) or NOTHING)),)
    fields: Fields[BuildRow] = (
        (Heading("group"), lambda row: name_cell(row.group)),
        (Heading("detector"), lambda row: name_cell(row.detector)),
        (Heading("contacts"), lambda row: Cell(contacts_of(row))),
        (Heading("latency ms"), lambda row: Cell(both(row, "latency_ms", 4))),
        *(ranges if few else ()),
        (Heading("missed"), lambda row: Cell(both(row, "missed"))),
        (Heading("not assessable"), lambda row: Cell(both(row, "not_assessable"))),
        (Heading("false alarms"), lambda row: Cell(both(row, "false_alarms"))),
        (Heading("force at alarm N"), lambda row: Cell(both(row, "force_at_alarm_n", 4))),
        (Heading("result"), lambda row: Cell(row.words)),
    )
    return tabulate("results", "", fields, rows)
