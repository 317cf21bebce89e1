"""The HTML report's tables of forces: each contact and each test point against its profile."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence

from cdtool.evaluation.results import ForceResult, ForceStepResult, PointResult, Results
from cdtool.report.figure_text import NOTHING, number, spoken
from cdtool.report.html.table import Cell, Column, Row, Table, count_cell, figure_cell, key_of, shown
from cdtool.report.html.tables import outcome_cell, tone_of


def force_table(results: Results, opens: Mapping[tuple[str, str], Sequence[int]]) -> Table:
    """Every contact against its force profile; `opens`: the traces of each recording in its group."""
    columns = (
        Column("recording"),
        Column("group", choice=True),
        Column("contact", numeric=True),
        Column("verdict", choice=True),
        Column("peak [N]", numeric=True),
        Column("first exceeded after [ms]", numeric=True),
        Column("steps"),
        Column("test point", choice=True),
    )
    rows = [
        (
            Cell(shown(item.recording)),
            Cell(shown(item.group)),
            count_cell(item.contact),
            outcome_cell(item.verdict),
            figure_cell(item.peak_n),
            Cell("never" if item.time_budget_ms is None else number(item.time_budget_ms), key=_budget_key(item)),
            Cell(_steps(item.steps)),
            Cell(item.point or NOTHING),
        )
        for item in results.forces
    ]
    return Table(
        "forces-table",
        "Every contact against its force limits",
        columns,
        rows,
        opens=[opens.get((item.group, item.recording), ()) for item in results.forces],
    )


def force_counts(results: Results) -> Table:
    """How many contacts of each group keep their profile."""
    names = ("group", "profile", "pass", "fail", "not assessable", "largest peak [N]")
    columns = [Column(name, numeric=i > 1) for i, name in enumerate(names)]
    parts: dict[tuple[str, str], list[ForceResult]] = {}
    for item in results.forces:
        parts.setdefault((item.group, item.profile), []).append(item)
    return Table("force-counts", "Contacts by force verdict", columns, [_force_count(*part) for part in parts.items()])


def points_table(results: Results) -> Table:
    """Test points, averaged as their profile asks."""
    names = ("test point", "group", "profile", "verdict", "tests", "steps", "why")
    rows = [_point_row(item) for item in results.points]
    return Table("points-table", "Test points against their force limits", [Column(name) for name in names], rows)


def _force_count(key: tuple[str, str], forces: Sequence[ForceResult]) -> Row:
    counts = Counter(item.verdict for item in forces)
    peaks = [item.peak_n for item in forces if item.peak_n is not None]
    verdicts = [
        Cell(str(counts[verdict]), key=counts[verdict], tone=tone_of(verdict) if counts[verdict] else "")
        for verdict in ("pass", "fail", "not_assessable")
    ]
    return (*(Cell(shown(name)) for name in key), *verdicts, figure_cell(max(peaks, default=None)))


def _point_row(item: PointResult) -> Row:
    return (
        Cell(shown(item.point)),
        Cell(shown(item.group)),
        Cell(item.profile),
        outcome_cell(item.verdict),
        Cell(item.note),
        Cell(_steps(item.steps)),
        Cell(item.reason or ""),
    )


def _steps(steps: Sequence[ForceStepResult]) -> str:
    return "; ".join(
        f"{item.name} {number(item.peak_n)} of {item.at_most_n:g} N: {spoken(item.verdict)}" for item in steps
    )


def _budget_key(item: ForceResult) -> float:
    return key_of(math.inf if item.time_budget_ms is None else item.time_budget_ms)
