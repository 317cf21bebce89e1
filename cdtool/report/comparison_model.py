"""The comparison of two builds as Markdown for a pull request, and as JSON."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

from cdtool.errors import UsageError
from cdtool.evaluation.builds.comparison import BuildComparison
from cdtool.evaluation.builds.questions import Figure
from cdtool.evaluation.builds.rows import BuildRow
from cdtool.files import write_text
from cdtool.foreign_files import Kind, refuse_other_kind
from cdtool.plain_text import plain
from cdtool.report.few_contacts import EXPLAINED
from cdtool.report.markdown.text import Table, escape
from cdtool.report.number_text import NOTHING, number
from cdtool.report.verdict_words import NO_CERTIFICATE
from cdtool.strict_json import strict_json

_HEADS = (
    *("group", "detector", "contacts", "latency ms", "missed", "not assessable", "false alarms", "force at alarm N"),
    "found",
)
_RANGE = "range ms"
_MEANS = ("latency_ms", "force_at_alarm_n")
_HOW_TO_READ = (
    "Two figures are old / new. Contacts: the same ones in both, unless there are two numbers. Latency is a mean (of "
    "fewer than ten contacts a median) and the force at the alarm a median, of the contacts that both detected; "
    "changes are means of their pairs. *No change shown* is not *no change*: the change in brackets would have been "
    "shown with 80 % power. A change has an interval from ten recordings or campaigns on."
)


def to_markdown(comparison: BuildComparison) -> str:
    """A table with a row a detector and group, the verdict above it, what differs below."""
    parts = [
        f"**cdtool compare: {escape(comparison.words)}**",
        _rows_table(comparison.rows),
        f"{_HOW_TO_READ} *Inconclusive*: these recordings could not have shown a change for the worse of "
        f"{100.0 * comparison.relevant_change:g} %. {NO_CERTIFICATE}",
    ]
    if any(row.few for row in comparison.rows):
        parts.append(EXPLAINED)
    if comparison.changed:
        rows = [tuple(escape(text) for text in (item.key, item.old, item.new)) for item in comparison.changed]
        parts += ["Under test, and different:", _table(("setting", "old", "new"), rows)]
    for which, names in (("old", comparison.only_old), ("new", comparison.only_new)):
        if names:
            parts.append(f"Only in {which}, not compared: {escape(', '.join(names))}.")
    parts += [f"{escape(note)}." for note in comparison.notes]
    return "\n\n".join(parts) + "\n"


def to_json(comparison: BuildComparison) -> str:
    """Strict JSON: null where there is no figure, or none that is finite."""
    return strict_json(asdict(comparison)) + "\n"


def both(row: BuildRow, figure: Figure, digits: int = 3) -> str:
    """A figure of both builds as "old / new", a mean with so many digits; a dash where it is nowhere known."""
    found = row.question(figure)
    if found is None or (math.isnan(found.old) and math.isnan(found.new)):
        return NOTHING
    if figure in _MEANS:
        return f"{number(found.old, digits)} / {number(found.new, digits)}"
    return f"{found.old:.0f} / {found.new:.0f}"


def ranges_of(row: BuildRow) -> str:
    """The shortest and longest latency of both builds as "25.0 to 28.0 / 30.0 to 34.0"; empty from ten contacts on."""
    latency = row.question("latency_ms")
    if latency is None or latency.ranges is None:
        return ""
    return " / ".join(" to ".join(dict.fromkeys(map(number, ends))) for ends in latency.ranges)


def contacts_of(row: BuildRow) -> str:
    """How many pairs; "old / new" where the contacts are others; a dash where there are none."""
    if not row.old_contacts and not row.new_contacts:
        return NOTHING
    return str(row.pairs) if row.paired else f"{row.old_contacts} / {row.new_contacts}"


_KINDS = {
    ".md": Kind(b"**cdtool compare: ", "comparison of cdtool"),
    ".json": Kind(b'{\n "verdict": "', "comparison of cdtool"),
}
_WRITERS: dict[str, Callable[[BuildComparison], str]] = {".md": to_markdown, ".json": to_json}


def check_outputs(targets: Sequence[Path], *, force: bool = False) -> None:
    """Raise UsageError where a target's name does not say what to write, its folder is missing, or it is not ours."""
    for target in targets:
        if target.suffix.lower() not in _WRITERS:
            raise UsageError(f"--output is '{plain(target)}'", f"a name that ends in {' or '.join(_WRITERS)}")
        if not target.parent.is_dir():
            raise UsageError(f"--output is '{plain(target)}': no folder {plain(target.parent)}", "make it first")
        refuse_other_kind(target, _KINDS[target.suffix.lower()], force=force)


def write_outputs(comparison: BuildComparison, targets: Sequence[Path]) -> None:
    """Write every target by its suffix, whatever is there; raises CdtoolError where one cannot be written."""
    check_outputs(targets, force=True)
    for target in targets:
        write_text(target, _WRITERS[target.suffix.lower()](comparison))


def _cells(row: BuildRow) -> tuple[str, ...]:
    return (
        escape(row.group),
        escape(row.detector),
        contacts_of(row),
        both(row, "latency_ms", 4),
        both(row, "missed"),
        both(row, "not_assessable"),
        both(row, "false_alarms"),
        both(row, "force_at_alarm_n", 4),
        escape(row.words),
    )


def _rows_table(rows: Sequence[BuildRow]) -> str:
    """One row per detector and group; the ranges of latency where any row has too few contacts for a mean."""
    few, at = any(row.few for row in rows), _HEADS.index("latency ms") + 1
    heads = [*_HEADS[:at], *([_RANGE] if few else []), *_HEADS[at:]]
    cells = [[*_cells(row)[:at], *([ranges_of(row) or NOTHING] if few else []), *_cells(row)[at:]] for row in rows]
    return _table(heads, cells)


def _table(headings: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    table = Table(headings, rows)
    return "\n".join([table.head, *table.lines])
