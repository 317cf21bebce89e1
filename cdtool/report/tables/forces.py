"""Tables of contact forces against their limits: by group, by test point, by contact."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from cdtool.report.many import most_rows
from cdtool.report.number_text import NOTHING, beside, spoken
from cdtool.report.table import (
    Cell,
    Fields,
    Heading,
    Row,
    Table,
    count_cell,
    key_of,
    name_cell,
    number_cell,
    outcome_cell,
    tabulate,
    tone_of,
)
from cdtool.results.results import ForceResult, ForceStepResult, PointResult, Results, grouped

_VERDICTS = ("pass", "fail", "not_assessable")


def groups_table(results: Results) -> Table:
    """Return how many contacts of each group meet their force profile."""
    columns = [Heading("group"), Heading("profile"), *(Heading(spoken(verdict), numeric=True) for verdict in _VERDICTS)]
    columns += [Heading("largest peak [N]", numeric=True), Heading("earliest exceeded after [ms]", numeric=True)]
    parts = grouped(results.forces, "group", "profile")
    return Table("force", "Force", columns, [_group_row(*part) for part in parts.items()], "forces")


def points_table(results: Results) -> Table:
    """Return the test points, averaged as their profile requires."""
    fields: Fields[PointResult] = (
        (Heading("test point"), lambda item: name_cell(item.point)),
        (Heading("group"), lambda item: name_cell(item.group)),
        (Heading("profile"), lambda item: name_cell(item.profile)),
        (Heading("verdict", choice=True), lambda item: outcome_cell(item.verdict)),
        (Heading("tests"), lambda item: Cell(item.note)),
        (Heading("steps"), lambda item: _steps(item.steps)),
        (Heading("why"), lambda item: Cell(item.reason or "")),
    )
    return tabulate("points", "Force by test point", fields, results.points, "points", (), most_rows(results))


def contacts_table(results: Results, *, only_exceptions: bool = False) -> Table:
    """Return every contact against its force profile, or only those that do not pass."""
    fields: Fields[ForceResult] = (
        (Heading("recording"), lambda item: name_cell(item.recording)),
        (Heading("group", choice=True), lambda item: name_cell(item.group)),
        (Heading("contact", numeric=True), lambda item: count_cell(item.contact)),
        (Heading("profile", choice=True), lambda item: name_cell(item.profile)),
        (Heading("verdict", choice=True), lambda item: outcome_cell(item.verdict)),
        (Heading("peak [N]", numeric=True), lambda item: number_cell(item.peak_n)),
        (Heading("first exceeded after [ms]", numeric=True), lambda item: _budget(item.time_budget_ms)),
        (Heading("steps"), lambda item: _steps(item.steps)),
        (Heading("test point", choice=True), lambda item: Cell(item.point or NOTHING)),
        (Heading("why"), lambda item: Cell(item.reason or "")),
    )
    name, title = ("force_exceptions", "Force limits not met") if only_exceptions else ("forces", "Force by contact")
    items = [item for item in results.forces if not only_exceptions or item.verdict != "pass"]
    logs = [(item.group, item.recording) for item in items]
    return tabulate(name, title, fields, items, "forces", logs, most_rows(results))


def _group_row(key: tuple[str, ...], forces: Sequence[ForceResult]) -> Row:
    counts = Counter[str](item.verdict for item in forces)
    peaks = [item.peak_n for item in forces if item.peak_n is not None]
    budgets = [item.time_budget_ms for item in forces if item.time_budget_ms is not None]
    return (
        *map(name_cell, key),
        *(count_cell(counts[verdict], tone_of(verdict)) for verdict in _VERDICTS),
        number_cell(max(peaks, default=None)),
        _budget(min(budgets, default=None)),
    )


def _budget(after_ms: float | None) -> Cell:
    """Return when the first limit was exceeded, after the onset of the contact."""
    return Cell("never", key=key_of(math.inf)) if after_ms is None else number_cell(after_ms)


def _steps(steps: Sequence[ForceStepResult]) -> Cell:
    return Cell(
        "; ".join(
            f"{item.name} {beside(item.peak_n, item.at_most_n)} of {item.at_most_n:g} N: {spoken(item.verdict)}"
            for item in steps
        )
    )
