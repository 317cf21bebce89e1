"""The results of a benchmark in the terminal: tables, limits, and the exit status."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import typer

from cdtool.base.exit_status import Fact
from cdtool.base.plain_text import LISTED, counted
from cdtool.commands.console.colour import Toned
from cdtool.commands.console.console import fits_terminal, leave, print_line, say, table
from cdtool.commands.console.truth_shown import show_truth

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
# Shorter headings of changed conditions, and what precedes the value of the unchanged machine in a cell.
_CONDITION_HEADINGS = {
    "alarming impact-free runs": "alarming",
    "contacts not assessable": "n.a.",
    "samples not assessable": "samples\nn.a.",
}
_UNCHANGED = "; unchanged "


def show_table(evaluated: Evaluated) -> None:
    """Print the thesis's table 5.1 for each group, with the notes needed to read its numbers."""
    from cdtool.report.few_contacts import explained, latency_columns
    from cdtool.report.model import onset_words
    from cdtool.report.tables.results import part_of
    from cdtool.results.conclusion import partly_unassessed

    shown = latency_columns(evaluated.summaries)
    bounded = any(item.few and not math.isnan(item.median.low) for item in evaluated.summaries)
    headings = _HEADINGS | ({"median": "median ms\n(95 %)"} if bounded else {})
    columns = [("group", "left"), ("detector", "left")]
    names = (*(headings[name] for name in shown), "n", "missed", "n.a.", "false\nalarms", "ops")
    columns += [(name, "right") for name in names]
    short = part_of(evaluated.results.provenance, "short_names")
    used = _detector_table(columns, [_row(item, shown) for item in evaluated.summaries], short)
    if evaluated.kinds:
        used |= _show_kinds(evaluated.kinds, short)
    if evaluated.conditions:
        used |= _show_conditions(evaluated, short)
    if used:
        say("; ".join(f"{short[name]}: {name}" for name in evaluated.results.detectors if name in used))
    provenance = evaluated.results.provenance
    # Mean and spread are those of the detected contacts.
    *most, last = (name for name in shown if name in ("median", "range", "P95"))
    with_misses = f"{', '.join(most)} and {last}" if most else last
    say(
        "latency from contact onset to alarm, debounce included; n: contacts detected; n.a.: not assessable; "
        f"{with_misses} count missed contacts; ops: operations scored; onset: {onset_words(provenance)}"
    )
    few = explained(evaluated.summaries)
    if few:
        say(few)
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
    show_truth(evaluated)
    _show_bounds(evaluated)
    _show_forces(evaluated.results)


def _detector_table(
    columns: Sequence[tuple[str, str]], rows: Sequence[Sequence[Any]], short: Mapping[str, str]
) -> set[str]:
    """Print a table with a detector in its second column; return those that have their short names in it."""
    used = set() if fits_terminal(columns, rows) else {row[1] for row in rows} & set(short)
    table(columns, [[row[0], short[row[1]] if row[1] in used else row[1], *row[2:]] for row in rows])
    return used


def _show_kinds(kinds: Sequence[Summary], short: Mapping[str, str]) -> set[str]:
    """Print one row per detector and kind of contact; false alarms belong to no kind."""
    from cdtool.report.few_contacts import latency_columns

    shown = latency_columns(kinds)
    columns = [("group/kind", "left"), ("detector", "left")]
    columns += [(name, "right") for name in (*(_HEADINGS[name] for name in shown), "n", "missed", "n.a.")]
    typer.echo()
    return _detector_table(columns, [_row(item, shown)[:-2] for item in kinds], short)


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
    used = _detector_table([columns[1], columns[0], *columns[2:]], ordered, short)
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


def _row(item: Summary, shown: Sequence[LatencyColumn]) -> tuple[Any, ...]:
    if not item.contacts:
        return item.group, item.detector, *(("-",) * (len(shown) + 3)), _false_alarms(item), item.operations
    return (
        item.group,
        item.detector,
        *(_latency(item, column) for column in shown),
        item.detected,
        _counted(item.missed, "bad") if item.assessable else "-",
        _counted(item.not_assessable, "unknown"),
        _false_alarms(item),
        item.operations,
    )


def _latency(item: Summary, column: LatencyColumn) -> str:
    """Return a latency as the report shows it; quantiles have their interval only if they replace the mean."""
    from cdtool.report.number_text import NOTHING
    from cdtool.report.tables.results import latency_cell

    cell = latency_cell(column, item)
    if cell.text == NOTHING:
        return "-"
    bounded = column == "mean" or (column == "median" and item.few and not math.isnan(item.median.low))
    return cell.line if bounded else cell.text


def _what(item: CalibrationResult) -> str:
    return "false alarms in" if item.budget.endswith("h") else "alarming of"


def _false_alarms(item: Summary) -> Toned | int | str:
    """Return the false alarms, or a dash if the detector could not assess anything."""
    return _counted(item.false_alarms, "bad") if item.watched else "-"


def _counted(count: int, tone: str) -> Toned | int:
    """Return a number that has a tone unless it is 0."""
    return Toned(count, tone) if count else 0


def _show_bounds(evaluated: Evaluated) -> None:
    """Print upper bounds where a group shows no missed contact or no false alarm."""
    for group in evaluated.results.groups:
        items = [item for item in evaluated.summaries if item.group == group]
        clean = [item for item in items if item.contacts and not item.missed and not math.isnan(item.missed_at_most)]
        if clean:
            least = max(item.missed_at_most for item in clean)
            say(f"{group}: 0 missed ({_named(clean, items)}) means at most {100.0 * least:.2g} % (95 %)")
        quiet = [item for item in items if not item.contacts and not item.false_alarms and item.watched]
        if quiet:
            rate = max(item.at_most_per_operation for item in quiet)
            who = _named(quiet, items)
            say(f"{group}: 0 false alarms ({who}) means at most {rate:.2g} per operation (95 %)")


def _named(some: Sequence[Summary], of: Sequence[Summary]) -> str:
    return "all detectors" if len(some) == len(of) else ", ".join(item.detector for item in some)


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
