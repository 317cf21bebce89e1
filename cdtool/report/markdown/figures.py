"""The Markdown report's tables of figures: limits, groups, comparisons, forces."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from cdtool.evaluation.comparison import SIGNIFICANT, Comparison
from cdtool.evaluation.evaluated import Evaluated
from cdtool.evaluation.results import ForceResult, ForceStepResult, LimitResult, Results
from cdtool.evaluation.statistics.interval import Interval
from cdtool.evaluation.summary import Summary
from cdtool.plain_text import counted
from cdtool.report.comparison_words import TOO_FEW, without_finding
from cdtool.report.few_contacts import LatencyColumn, latency_columns, latency_words
from cdtool.report.markdown.text import Section, Table, escape
from cdtool.report.number_text import (
    NOT_ASSESSABLE,
    NOTHING,
    missed,
    number,
    rate,
    spoken,
    with_interval,
)
from cdtool.report.verdict_words import allowed, value_of

_COUNTS = ("n", "missed", "not assessable")
_FALSE_ALARMS = ("false alarms", "per hour", "per operation")
_FORCE = "force at alarm, largest [N]"
# More rows of limits than this would push the figures out of sight.
_LIMITS_OPEN = 12
_WORST_FIRST = ("violated", "not_assessable", "met")


def part_of(provenance: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """A table of the provenance; empty where it has none, since a file may hold anything there."""
    found = provenance.get(key)
    return found if isinstance(found, Mapping) else {}


def named(results: Results, detector: str) -> str:
    """A detector's full name with its short one."""
    short = part_of(results.provenance, "short_names").get(detector)
    return escape(f"{detector} ({short})" if short else detector)


def limit_sections(results: Results) -> tuple[list[Section], list[Section]]:
    """The limits, violated ones first; where they are many, those that are met apart and folded."""
    ordered = sorted(results.limits, key=lambda item: _WORST_FIRST.index(item.outcome))
    failing = [item for item in ordered if item.outcome != "met"]
    if len(ordered) <= _LIMITS_OPEN:
        return ([Section("Limits", table=_limits_table(results, ordered), source="limits")] if ordered else []), []
    met = ordered[len(failing) :]
    folded = Section(f"Limits met ({len(met)})", table=_limits_table(results, met), folded=True, source="limits")
    opened = Section("Limits not met", table=_limits_table(results, failing), source="limits")
    return ([opened] if failing else []), ([folded] if met else [])


def _limits_table(results: Results, limits: Sequence[LimitResult]) -> Table:
    headings = ("outcome", "detector", "group", "figure", "value", "allowed", "why")
    rows = [
        (
            item.outcome if item.outcome == "met" else f"**{escape(spoken(item.outcome))}**",
            named(results, item.detector),
            escape(item.group),
            escape(item.figure),
            value_of(item),
            allowed(item),
            escape(item.reason or ""),
        )
        for item in limits
    ]
    return Table(headings, rows)


def group_section(evaluated: Evaluated, group: str, tail: str) -> Section:
    """A row a detector; a group without contacts has false alarms only."""
    rows = [item for item in evaluated.summaries if item.group == group]
    hit = any(item.contacts for item in rows)
    felt = any(not math.isnan(item.force_at_alarm) for item in rows)
    shown = latency_columns(rows)
    latency = (*(f"{name} [ms]" for name in shown), *_COUNTS) if hit else ()
    headings = ("detector", *latency, *_FALSE_ALARMS, *((_FORCE,) if felt else ()))
    cells = [
        (
            named(evaluated.results, item.detector),
            *(_latency_cells(item, shown) if hit else ()),
            *_false_alarm_cells(item),
            *((_force_cell(item),) if felt else ()),
        )
        for item in rows
    ]
    title = escape(group) if hit else f"{escape(group)}: no contacts, false alarms only"
    return Section(title, table=Table(headings, cells, numeric=True), tail=tail, source="contacts")


def comparison_section(evaluated: Evaluated) -> list[Section]:
    """What is shown about pairs of detectors on the same contacts."""
    if not evaluated.comparisons:
        return []
    rows = [row for item in evaluated.comparisons for row in _shown(evaluated.results, item)]
    asked = f"{counted(len(evaluated.comparisons), 'pair')} of detectors on the same contacts"
    how = f"p corrected by Holm over a group's questions; shown: p below {SIGNIFICANT:g}"
    few = without_finding(evaluated.comparisons).count(TOO_FEW)
    of = "" if few == len(evaluated.comparisons) else f" in {few} of them"
    too_few = f" There are {TOO_FEW}{of}; those of one campaign count as one." if few else ""
    if not rows:
        words = f"{asked}: no difference is shown ({how}). That is not a proof of none.{too_few}"
        return [Section("Comparisons", words)]
    table = Table(("group", "shown", "by", "contacts", "p"), rows)
    return [Section("Comparisons", f"{asked}; {how}.{too_few}", table, source="contacts")]


def force_sections(results: Results) -> list[Section]:
    """The verdicts on force by group and by test point; nothing where no profile is set."""
    sections = []
    if results.forces:
        headings = ("group", "profile", "pass", "fail", "not assessable", "largest peak [N]", "earliest exceeded")
        keys = dict.fromkeys((item.group, item.profile) for item in results.forces)
        rows = [_force_row(key, [item for item in results.forces if (item.group, item.profile) == key]) for key in keys]
        lead = " ".join(_sources(results))
        sections.append(Section("Force", lead, Table(headings, rows), source="forces"))
    if results.points:
        point_headings = ("test point", "group", "profile", "verdict", "tests", "steps", "why")
        point_rows = [
            (
                escape(item.point),
                escape(item.group),
                escape(item.profile),
                force_verdict(item.verdict),
                escape(item.note),
                steps_words(item.steps),
                escape(item.reason or ""),
            )
            for item in results.points
        ]
        sections.append(Section("Force by test point", table=Table(point_headings, point_rows), source="points"))
    return sections


def steps_words(steps: Sequence[ForceStepResult]) -> str:
    """Each step's force against what is allowed."""
    seen = [f"{number(item.peak_n)} of" if item.peak_n is not None else "not seen," for item in steps]
    return ", ".join(f"{escape(item.name)} {peak} {item.at_most_n:g} N" for item, peak in zip(steps, seen, strict=True))


def force_verdict(verdict: str) -> str:
    """A verdict, bold where it is no pass."""
    return verdict if verdict == "pass" else f"**{escape(spoken(verdict))}**"


def time_budget(item: ForceResult | ForceStepResult) -> str:
    """When a limit was exceeded."""
    return "never" if item.time_budget_ms is None else f"{number(item.time_budget_ms)} ms after the onset"


def _latency_cells(item: Summary, shown: Sequence[LatencyColumn]) -> tuple[object, ...]:
    if not item.contacts:
        return (NOTHING,) * (len(shown) + len(_COUNTS))
    return (
        *(latency_words(item, column) for column in shown),
        item.detected,
        missed(item.missed, item.detected + item.missed, item.missed_at_most),
        item.not_assessable,
    )


def _false_alarm_cells(item: Summary) -> tuple[str, ...]:
    if not (item.watched and item.judged_operations):
        return (NOT_ASSESSABLE if item.operations else NOTHING, NOTHING, NOTHING)
    judged = f"{item.judged_operations} of " if item.judged_operations < item.operations else ""
    return (
        f"{item.false_alarms} in {judged}{counted(item.operations, 'operation')}",
        rate(item.false_alarms, item.false_alarms_per_hour, item.at_most_per_hour),
        rate(item.false_alarms, item.false_alarms_per_operation, item.at_most_per_operation),
    )


def _force_cell(item: Summary) -> str:
    if math.isnan(item.force_at_alarm):
        return NOTHING
    return f"{number(item.force_at_alarm)}, {number(item.force_at_alarm_max)}"


def _shown(results: Results, item: Comparison) -> list[tuple[object, ...]]:
    group = escape(item.group)
    rows: list[tuple[object, ...]] = []
    if item.faster:
        first = item.faster == item.first
        slower, mean = item.second if first else item.first, item.latency.mean
        gain = Interval(-mean.value, -mean.high, -mean.low, mean.level) if first else mean
        words = f"{named(results, item.faster)} is faster than {named(results, slower)}"
        rows.append((group, words, f"{with_interval(gain)} ms", item.latency.n, f"{item.latency_p:.2g}"))
    if item.misses_less:
        first = item.misses_less == item.first
        other = item.second if first else item.first
        counts = (item.only_first_missed, item.only_second_missed)
        words = f"{named(results, item.misses_less)} misses less than {named(results, other)}"
        only = f"only one missed: {min(counts)} to {max(counts)}"
        rows.append((group, words, only, item.contacts, f"{item.missed_p:.2g}"))
    return rows


def _force_row(key: tuple[str, str], forces: Sequence[ForceResult]) -> tuple[object, ...]:
    counts = Counter(item.verdict for item in forces)
    exceeded = [item for item in forces if item.time_budget_ms is not None]
    first = min(exceeded, key=lambda item: item.time_budget_ms or 0.0, default=forces[0])
    return (
        *map(escape, key),
        *(counts[verdict] for verdict in ("pass", "fail", "not_assessable")),
        number(max((item.peak_n for item in forces if item.peak_n is not None), default=None)),
        time_budget(first),
    )


def _sources(results: Results) -> list[str]:
    """Where each profile's limits come from, and whether anyone checked them."""
    words: dict[str, None] = {}
    for profile in part_of(results.provenance, "force_profiles").values():
        if not isinstance(profile, Mapping):
            continue
        unchecked = "" if profile.get("checked") else "; values to be checked against the standard"
        words[f"{escape(profile.get('title', ''))} (source: {escape(profile.get('source', ''))}{unchecked})."] = None
    return list(words)
