"""The HTML report's tables of results: limits, detectors, comparisons, calibration, forces; and of their provenance."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from cdtool.evaluation.comparison import Comparison
from cdtool.evaluation.evaluated import Evaluated
from cdtool.evaluation.results import ForceResult, ForceStepResult, PointResult, Results
from cdtool.evaluation.statistics.interval import Interval
from cdtool.evaluation.summary import Summary
from cdtool.plain_text import counted
from cdtool.report.comparison_words import without_finding
from cdtool.report.few_contacts import LatencyColumn, latency_columns, latency_figure, latency_words
from cdtool.report.number_text import (
    NOT_ASSESSABLE,
    NOT_REACHED,
    NOTHING,
    missed,
    number,
    rate,
    spoken,
    with_interval,
)
from cdtool.report.table import Cell, Column, Row, Table, count_cell, figure_cell, key_of, nothing, shown
from cdtool.report.verdict_words import allowed, value_of

_TONES = {"met": "good", "pass": "good", "violated": "bad", "fail": "bad", "not_assessable": "unknown"}
_OPEN_END = f" to {NOT_REACHED}"
_WORST_FIRST = ("violated", "not_assessable", "met")
_PROVENANCE_WORDS = {
    "tool": "tool",
    "tool_version": "its version",
    "machine": "machine",
    "watched_joints": "joints watched, of all",
    "threshold": "threshold",
    "signature_rule": "how the normal band is made",
    "safety_factor_set": "safety factor or limits set",
    "false_alarm_budget": "false-alarm budget",
    "operations": "operations cut by",
    "window_s": "matching window [s]",
    "debounce_samples": "debounce [samples]",
    "rearm_s": "armed again after [s]",
    "hysteresis": "hysteresis, share of the safety factor",
    "latch": "alarms latch",
    "onset": "onset of a contact",
    "label_file": "label file",
    "synchronisation_s": "synchronisation of the load cell [s]",
    "mass_before_cell_kg": "mass before the load cell [kg]",
    "benchmark_sha256": "SHA-256 of the benchmark file",
    "machine_sha256": "SHA-256 of the machine file",
    "plugins": "plug-ins",
    "learned_runs": "operations learned from",
}
# Parts of the provenance that have tables of their own.
_TABLES_APART = ("gains", "signature_sha256", "learned_sha256", "units", "short_names", "force_profiles")


def part_of(provenance: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """A table of the provenance; empty where it has none, since a file may hold anything there."""
    found = provenance.get(key)
    return found if isinstance(found, Mapping) else {}


def detector_cell(results: Results, detector: str) -> Cell:
    """A detector's full name with its short one."""
    short = part_of(results.provenance, "short_names").get(detector)
    return Cell(shown(detector), (f"({shown(short)})",) if short else ())


def outcome_cell(outcome: str) -> Cell:
    """A verdict in words with its tone."""
    return Cell(spoken(outcome), tone=tone_of(outcome))


def tone_of(outcome: str) -> str:
    """Whether a verdict is good, bad or unknown."""
    return _TONES.get(outcome, "")


def limits_table(results: Results, *, met: bool) -> Table:
    """The limits that are met, or those that are not, the violated ones first."""
    columns = (
        Column("outcome", choice=True),
        Column("detector"),
        Column("group"),
        Column("figure"),
        Column("value", numeric=True),
        Column("allowed"),
        Column("why"),
        Column("limit"),
    )
    meant = [item for item in results.limits if (item.outcome == "met") == met]
    ordered = sorted(meant, key=lambda item: _WORST_FIRST.index(item.outcome))
    caption = f"{counted(len(meant), 'limit')} {'' if met else 'not '}met"
    rows = [
        (
            outcome_cell(item.outcome),
            Cell(shown(item.detector)),
            Cell(shown(item.group)),
            Cell(item.figure),
            Cell(value_of(item), key=key_of(item.value)),
            Cell(allowed(item)),
            Cell(item.reason or ""),
            Cell(item.limit),
        )
        for item in ordered
    ]
    return Table("met-table" if met else "limits-table", caption, columns, rows)


def summary_table(evaluated: Evaluated) -> Table:
    """A row a detector and group: latency with what it has to be read beside."""
    shown_columns = latency_columns(evaluated.summaries)
    columns = [
        Column("detector"),
        Column("group", choice=True),
        *(Column(f"{name} [ms]", numeric=True) for name in shown_columns),
        Column("contacts detected", numeric=True),
        Column("missed", numeric=True),
        Column("not assessable", numeric=True),
        Column("false alarms", numeric=True),
        Column("false alarms per operation, per hour", numeric=True),
        Column("force at alarm [N]", numeric=True),
        Column("peak force [N]", numeric=True),
    ]
    if evaluated.results.forces:
        columns.append(Column("force limit exceeded", numeric=True))
    rows = [_summary_row(evaluated.results, item, shown_columns)[: len(columns)] for item in evaluated.summaries]
    return Table("figures-table", "Latency, misses and false alarms by detector and group", columns, rows)


def comparisons_table(evaluated: Evaluated) -> Table:
    """Every pair of detectors on the contacts that both could assess."""
    columns = (
        Column("group", choice=True),
        Column("first"),
        Column("second"),
        Column("finding", choice=True),
        Column("contacts", numeric=True),
        Column("latency, first less second [ms]", numeric=True),
        Column("p", numeric=True),
        Column("missed by first only", numeric=True),
        Column("missed by second only", numeric=True),
        Column("p of misses", numeric=True),
    )
    found = without_finding(evaluated.comparisons)
    rows = [_comparison_row(item, none) for item, none in zip(evaluated.comparisons, found, strict=True)]
    return Table("comparisons-table", "Pairs of detectors on the same contacts", columns, rows)


def calibration_table(results: Results) -> Table:
    """How safety factors were set for a false-alarm budget."""
    names = ("detector", "false alarms allowed", "safety factor set", "alarms with it", "operations", "hours")
    columns = [Column(name, numeric=i > 1) for i, name in enumerate(names)]
    rows = [
        (
            Cell(shown(item.detector)),
            Cell(item.budget),
            figure_cell(item.safety_factor),
            count_cell(item.alarms),
            count_cell(item.operations),
            figure_cell(item.hours),
        )
        for item in results.calibration
    ]
    return Table("calibration-table", "Safety factors set for a false-alarm budget", columns, rows)


def interval_cell(interval: Interval) -> Cell:
    """A figure with its interval in small print."""
    return _split(with_interval(interval), interval.value)


def _latency_cell(item: Summary, column: LatencyColumn) -> Cell:
    """The range is sorted by its longer end."""
    if column == "range":
        return Cell(latency_words(item, column), key=key_of(item.max_ms))
    figure = latency_figure(item, column)
    return nothing() if figure is None else interval_cell(figure)


def _summary_row(results: Results, item: Summary, shown_columns: Sequence[LatencyColumn]) -> Row:
    hit = item.contacts > 0
    assessable = item.detected + item.missed
    return (
        detector_cell(results, item.detector),
        Cell(shown(item.group)),
        *(_latency_cell(item, column) for column in shown_columns),
        Cell(f"{item.detected} of {item.contacts}", key=item.detected) if hit else nothing(),
        _split(
            missed(item.missed, assessable, item.missed_at_most),
            float(item.missed) if assessable else math.nan,
            tone="bad" if item.missed else "",
        ),
        Cell(str(item.not_assessable), key=item.not_assessable, tone="unknown" if item.not_assessable else "")
        if hit
        else nothing(),
        *_false_alarm_cells(item),
        Cell(number(item.force_at_alarm), (f"largest {number(item.force_at_alarm_max)}",), key_of(item.force_at_alarm))
        if not math.isnan(item.force_at_alarm)
        else nothing(),
        figure_cell(item.peak_force),
        nothing() if math.isnan(item.force_failed) else _failed_cell(int(item.force_failed)),
    )


def _false_alarm_cells(item: Summary) -> tuple[Cell, Cell]:
    """The count with its exposure, and both rates; without any exposure no figure but a word."""
    if not (item.watched and item.judged_operations):
        if not item.operations:
            return nothing(), nothing()
        none = ("judged in none", f"of {counted(item.operations, 'operation')}")
        return Cell(NOT_ASSESSABLE, none, key_of(None), "unknown"), nothing()
    operations = counted(item.operations, "operation")
    some = item.judged_operations < item.operations
    exposure = (
        *((f"in {item.judged_operations} of", operations) if some else (f"in {operations}",)),
        f"{number(item.hours)} h",
    )
    tone = "bad" if item.false_alarms else ""
    per_operation = _split(
        rate(item.false_alarms, item.false_alarms_per_operation, item.at_most_per_operation),
        item.false_alarms_per_operation.value,
    )
    per_hour = _split(
        rate(item.false_alarms, item.false_alarms_per_hour, item.at_most_per_hour), item.false_alarms_per_hour.value
    )
    both = replace(per_operation, rest=(*per_operation.rest, f"per hour: {per_hour.text}", *per_hour.rest))
    return Cell(str(item.false_alarms), exposure, item.false_alarms, tone), both


def _failed_cell(count: int) -> Cell:
    return Cell(str(count), key=count, tone="bad" if count else "")


def _comparison_row(item: Comparison, none: str) -> Row:
    words = [f"{shown(item.faster)} is faster"] if item.faster else []
    words += [f"{shown(item.misses_less)} misses less"] if item.misses_less else []
    return (
        Cell(shown(item.group)),
        Cell(shown(item.first)),
        Cell(shown(item.second)),
        Cell("; ".join(words) or none, tone="" if words else "unknown"),
        count_cell(item.contacts),
        interval_cell(item.latency.mean),
        _p(item.latency_p),
        count_cell(item.only_first_missed),
        count_cell(item.only_second_missed),
        _p(item.missed_p),
    )


def _p(value: float) -> Cell:
    return Cell(NOTHING if math.isnan(value) else f"{value:.2g}", key=key_of(value))


def _split(words: str, value: float, tone: str = "") -> Cell:
    """Words such as "84.3 (17.4 to 246): at most 218": what follows the figure goes into lines of small print."""
    figures, _, bound = words.partition(": ")
    text, bracket, interval = figures.partition(" (")
    # The column would be as wide as both ends together.
    low, _, _ = interval.partition(_OPEN_END)
    ends = (f"({low}", _OPEN_END.strip() + ")") if interval.endswith(_OPEN_END + ")") else (f"({interval}",)
    rest = (ends if bracket else ()) + ((bound,) if bound else ())
    return Cell(text, rest, key_of(value), tone)


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


def provenance_tables(results: Results) -> list[Table]:
    """Every entry of the provenance, those that this version does not know under their own names."""
    provenance = results.provenance
    entries = [
        (key, value) for key, value in provenance.items() if key not in _TABLES_APART and value not in (None, "", {})
    ]
    made = [
        _table(
            "provenance-table",
            "How the figures came about",
            ("what", "value"),
            [(Cell(_PROVENANCE_WORDS.get(key, shown(key))), Cell(_in_words(value))) for key, value in entries],
        ),
        _table(
            "gains-table",
            "Detectors",
            ("detector", "compared in", "gains", "SHA-256 of its threshold"),
            _gains(results),
        ),
        _table(
            "profiles-table", "Force profiles", ("group", "profile", "limits", "source", "note"), _profiles(provenance)
        ),
        _table(
            "learned-table",
            "Recordings learned from",
            ("recording", "SHA-256"),
            [(Cell(shown(name)), Cell(str(digest))) for name, digest in part_of(provenance, "learned_sha256").items()],
        ),
    ]
    return [table for table in made if table.rows]


def _table(name: str, caption: str, headings: Sequence[str], rows: Sequence[Sequence[Cell]]) -> Table:
    return Table(name, caption, [Column(heading) for heading in headings], rows)


def _gains(results: Results) -> list[Sequence[Cell]]:
    units, digests = (part_of(results.provenance, key) for key in ("units", "signature_sha256"))
    return [
        (
            detector_cell(results, name),
            Cell(str(units.get(name, NOTHING))),
            Cell(_in_words(gains)),
            Cell(str(digests.get(name, NOTHING))),
        )
        for name, gains in part_of(results.provenance, "gains").items()
    ]


def _profiles(provenance: Mapping[str, Any]) -> list[Sequence[Cell]]:
    return [
        (
            Cell(shown(group)),
            *(Cell(_in_words(profile.get(key, NOTHING))) for key in ("title", "steps", "source", "note")),
        )
        for group, profile in part_of(provenance, "force_profiles").items()
        if isinstance(profile, Mapping)
    ]


def _in_words(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} = {_in_words(item)}" for key, item in value.items()) or NOTHING
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "; ".join(map(_in_words, value)) or NOTHING
    return str(value) or NOTHING
