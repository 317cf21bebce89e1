"""The results of a benchmark in the terminal: tables, limits, and the exit status."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import typer

from cdtool.base.exit_status import Fact
from cdtool.base.plain_text import LISTED, counted
from cdtool.commands.console.colour import Toned
from cdtool.commands.console.console import detector_table, leave, print_line, say
from cdtool.report.number_text import NOTHING, number, percent
from cdtool.report.table import shown

if TYPE_CHECKING:
    from cdtool.report.few_contacts import LatencyColumn
    from cdtool.report.table import Cell
    from cdtool.results.evaluated import Evaluated
    from cdtool.results.results import CalibrationResult
    from cdtool.results.summary import Summary

_HEADINGS = {
    "mean": "mean ms\n(95 %)",
    "std": "std\nms",
    "median": "median\nms",
    "range": "range\nms",
    "P95": "P95\nms",
}
_COUNTED = ("missed", "not\nassessable", "false\nalarms")
# Shorter headings of changed conditions, and what precedes the value of the unchanged machine in a cell.
_CONDITION_HEADINGS = {
    "alarming impact-free runs": "alarming",
    "contacts not assessable": "n.a.",
    "samples not assessable": "samples\nn.a.",
}
_UNCHANGED = "; unchanged "


def show_table(evaluated: Evaluated) -> None:
    """Print the thesis's table 5.1 for each group, with the notes needed to read its numbers."""
    from cdtool.report.model import onset_words
    from cdtool.report.tables.results import part_of
    from cdtool.results.conclusion import partly_unassessed

    provenance = evaluated.results.provenance
    short = part_of(provenance, "short_names")
    say(f"latency from contact onset to alarm; onset: {onset_words(provenance)}")
    used = _show_summaries(evaluated.summaries, "group", short)
    if evaluated.kinds:
        typer.echo()
        used |= _show_summaries(evaluated.kinds, "group/kind", short)
    if evaluated.conditions:
        used |= _show_conditions(evaluated, short)
    if used:
        say("; ".join(f"{short[name]}: {name}" for name in evaluated.results.detectors if name in used))
    _show_statistics(evaluated.summaries)
    if provenance.get("watched_joints"):
        say(f"joints monitored, of all: {provenance['watched_joints']}")
    for item in evaluated.results.calibration:
        say(
            f"{item.detector}: safety factor {item.safety_factor:.3g} for a budget of {item.budget}: "
            f"{item.alarms} {_what(item)} {item.operations} operations ({item.hours:.3g} h) used to set it"
        )
    if provenance.get("learned_until"):
        say(f"learned from each log until {provenance['learned_until']}")
    if others := provenance.get("scored_without_own_part"):
        say(f"{counted(len(others), 'recording')} scored with thresholds learned from the other recordings")
    for line in partly_unassessed(evaluated.results, evaluated.summaries)[:LISTED]:
        say(line)
    _show_forces(evaluated.results)


def _show_summaries(items: Sequence[Summary], heading: str, short: Mapping[str, str]) -> set[str]:
    """Print one row per detector and group or kind of contact; false alarms belong to no kind."""
    from cdtool.report.few_contacts import latency_columns

    latencies = latency_columns(items)
    bounded = any(item.few and not math.isnan(item.median.low) for item in items)
    headings = _HEADINGS | ({"median": "median ms\n(95 %)"} if bounded else {})
    columns = [(heading, "left"), ("detector", "left")]
    columns += [(name, "right") for name in (*(headings[name] for name in latencies), *_COUNTED)]
    return detector_table(columns, [_row(item, latencies) for item in items], short)


def _show_conditions(evaluated: Evaluated, short: Mapping[str, str]) -> set[str]:
    """Print one row per changed condition and detector, each value with that of the unchanged machine in brackets."""
    from cdtool.report.tables.conditions import conditions_table

    found = conditions_table(evaluated)
    columns = [
        (_CONDITION_HEADINGS.get(column.heading, column.heading), "right" if column.numeric else "left")
        for column in found.columns
    ]
    rows = [[_with_unchanged(cell) for cell in row] for row in found.rows]
    names = [row[0].text for row in found.rows]
    ordered = [[row[1], name, *row[2:]] for row, name in zip(rows, names, strict=True)]
    typer.echo()
    used = detector_table([columns[1], columns[0], *columns[2:]], ordered, short)
    say(
        "changed conditions, in brackets the unchanged machine; alarming: impact-free operations with a false alarm; "
        "ms: mean latency, or the median where fewer than ten contacts were detected; n.a.: not assessable"
    )
    return used


def _with_unchanged(cell: Cell) -> Toned | str:
    """Return the text of a cell and, in brackets, the value of the unchanged machine."""
    before = next((detail.removeprefix(_UNCHANGED) for detail in cell.details if detail.startswith(_UNCHANGED)), "")
    text = f"{cell.text} ({before})" if before else cell.text
    return Toned(text, cell.tone) if cell.tone else text


def show_conclusion(evaluated: Evaluated) -> None:
    """Print the conclusion, then limits, force profiles and contacts with a problem."""
    from cdtool.report.model import counts_text

    conclusion = evaluated.results.conclusion
    tone = conclusion.tone
    say(conclusion.headline, tone=tone)
    say(counts_text(evaluated), indent="  ")
    for reason in conclusion.reasons[:LISTED]:
        say(reason, indent="  ", tone="unknown" if tone == "unknown" else "bad")
    if len(conclusion.reasons) > LISTED:
        print_line(f"  and {len(conclusion.reasons) - LISTED} more")
    _show_limits(evaluated)


def _show_limits(evaluated: Evaluated) -> None:
    """Print one line per limit that is not met, and how many are met."""
    from cdtool.results.limits import not_met

    limits = evaluated.results.limits
    if not limits:
        return
    failed = not_met(limits)
    for item in failed[:LISTED]:
        name = f"{item.detector}.{item.group}.{item.figure}"
        outcome = item.outcome.replace("_", " ")
        tone = "bad" if item.outcome == "violated" else "unknown"
        say(f"limit {outcome}: {name}: {item.reason} (limit {item.limit})", indent="  ", tone=tone)
    if len(failed) > LISTED:
        print_line(f"  limits not met: and {len(failed) - LISTED} more")


def finish(evaluated: Evaluated) -> None:
    """Exit with the status of the results' conclusion."""
    results = evaluated.results
    leave(results.skipped, results.findings, [Fact[name.upper()] for name in results.conclusion.facts])


def _row(item: Summary, columns: Sequence[LatencyColumn]) -> tuple[Any, ...]:
    if not item.contacts:
        return shown(item.group), item.detector, *(("-",) * (len(columns) + 1)), "", _false_alarms(item)
    return (
        shown(item.group),
        item.detector,
        *(_latency(item, column) for column in columns),
        _counted(item.missed, f"of {item.assessable}", "bad") if item.assessable else "-",
        _counted(item.not_assessable, f"of {item.contacts}", "unknown") if item.not_assessable else "",
        _false_alarms(item),
    )


def _latency(item: Summary, column: LatencyColumn) -> str:
    """Return a latency as the report shows it; quantiles have their interval only if they replace the mean."""
    from cdtool.report.tables.results import latency_cell

    cell = latency_cell(column, item)
    if cell.text == NOTHING:
        return "-"
    bounded = column == "mean" or (column == "median" and item.few and not math.isnan(item.median.low))
    return cell.line if bounded else cell.text


def _what(item: CalibrationResult) -> str:
    return "false alarms in" if item.budget.endswith("h") else "alarming of"


def _false_alarms(item: Summary) -> Toned | str:
    """Return the false alarms, or a dash if the detector could not assess anything; nothing for a kind of contact."""
    if not item.operations:
        return ""
    return _counted(item.false_alarms, f"in {item.judged_operations}", "bad") if item.watched else "-"


def _counted(count: int, among: str, tone: str) -> Toned:
    """Return a number with what it is counted among; it has a tone unless it is 0."""
    return Toned(f"{count} {among}", tone if count else "")


def _show_statistics(summaries: Sequence[Summary]) -> None:
    """Print what no missed contact and no false alarm can mean at most, then how far the latencies can be trusted."""
    from cdtool.report.few_contacts import explained

    missed, alarms = defaultdict(list), defaultdict(list)
    for item in summaries:
        if item.assessable and not item.missed and not math.isnan(item.missed_at_most):
            missed[item.assessable].append(item.missed_at_most)
        if not item.contacts and item.watched and not item.false_alarms:
            alarms[item.judged_operations].append(item.at_most_per_operation)
    parts = [f"0 of {of} missed: up to {percent(max(missed[of]))}" for of in _ends(missed)]
    parts += [f"0 false alarms in {of}: up to {number(max(alarms[of]))} per operation" for of in _ends(alarms)]
    if parts:
        say(f"{'; '.join(parts)} (95 %)")
    for sentence in filter(None, explained(summaries).split(". ")[:1]):
        say(sentence)


def _ends(counts: Iterable[int]) -> list[int]:
    """Return the smallest and the largest number, once if they are equal."""
    numbers = sorted(counts)
    return list(dict.fromkeys((*numbers[:1], *numbers[-1:])))


def _show_forces(results: Any) -> None:
    rows = [(f"{item.group}, point {item.point}", item) for item in results.points]
    counted: dict[tuple[str, str], list[str]] = {}
    for item in results.forces:
        counted.setdefault((item.group, item.profile), []).append(item.verdict)
    for (group, profile), verdicts in counted.items():
        counts = ", ".join(
            f"{verdicts.count(word)} {word.replace('_', ' ')}" for word in ("pass", "fail", "not_assessable")
        )
        say(f"force, {group}, {profile}: {counts}", tone="bad" if "fail" in verdicts else "")
    for where, item in rows:
        reason = f": {item.reason}" if item.reason else ""
        verdict = item.verdict.replace("_", " ")
        tone = "bad" if item.verdict == "fail" else ""
        say(f"force, {where}, {item.profile}: {verdict} ({item.note}){reason}", tone=tone)
    if results.forces:
        say("force verdicts are evidence about the recordings, not a certificate")
