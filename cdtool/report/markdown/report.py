"""The report as Markdown for a pull request: verdict, limits, results, and the rest collapsed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from urllib.parse import quote

from cdtool.errors import UsageError
from cdtool.report.markdown.text import Section, escape, fitted
from cdtool.report.model import NO_CERTIFICATE, TITLES, Model
from cdtool.report.table import Table
from cdtool.report.writers.base import Image, Report

# Room for the verdict and how to read the results, whatever the names.
_LEAST = 4_000
_LIMITS_NAMED = 5
_REASONS_NAMED = 4
_LONGEST_NAME = 40
# With more limits than this, those that are met are collapsed, so that the results are not far below.
_LIMITS_OPEN = 12
# The model's tables below the results, collapsed; its tables of the provenance follow.
_FOLDED = (
    *("missed", "false_alarms", "not_assessable_contacts", "in_progress", "not_assessable", "force_exceptions"),
    *("skipped", "damaged", "findings", "calibration", "scored"),
)


def to_markdown(report: Report, most: int = 60_000) -> str:
    """Return the report as GitHub-flavoured Markdown in at most `most` characters; text from files is never markup.

    If it would be longer, tables are cut and state how many rows results.json has; the verdict and the limits take
    precedence over results, results over collapsed tables. Raises UsageError for `most` below 4,000.
    """
    if most < _LEAST:
        raise UsageError(f"a report of at most {most} characters", f"set at least {_LEAST}")
    model = report.model
    limits, met = _limits(model)
    results = []
    if "injected" in model.tables:
        results.append(_section(model.tables["injected"], escape(model.notes["injected"], None)))
    results.append(Section("", escape(model.notes["results"], None)))
    results += [Section("", _image(image)) for image in report.images if image.group is None]
    for group, table in model.groups:
        own = [_image(image) for image in report.images if image.group == group]
        results.append(_section(table, tail="\n\n".join(own)))
    if "kinds" in model.tables:
        results.append(_section(model.tables["kinds"]))
    if "conditions" in model.tables:
        results.append(_section(model.tables["conditions"], escape(model.notes["conditions"], None)))
    if model.notes["differences"]:
        lead = escape(model.notes["differences"], None)
        differences = model.tables.get("differences")
        results.append(_section(differences, lead) if differences else Section(TITLES["comparisons"], lead))
    results += [_section(model.tables[name], lead) for name, lead in _forces(model) if name in model.tables]
    tables = [model.tables[name] for name in _FOLDED if name in model.tables]
    folded = [_section(table, folded=True) for table in (*tables, *model.provenance)]
    return fitted(_head(model), (limits, met, results, folded), most)


def _head(model: Model) -> str:
    parts = [f"# Collision detection: {model.headline}", f"{model.counts}."]
    if failing := _failing(model):
        parts.append(f"**{model.tables['not_met'].title}:** {'; '.join(failing)}.")
    if model.reasons:
        reasons = "; ".join(map(escape, model.first_reasons(_REASONS_NAMED)))
        parts.append(f"**Force, missed contacts, not assessable:** {reasons}.")
    if model.left_out:
        parts.append(f"**{model.left_out}**, listed below.")
    return "\n\n".join([*parts, NO_CERTIFICATE])


def _failing(model: Model) -> list[str]:
    """Return the first limits that are not met, with names short enough to leave room for the results."""
    if "not_met" not in model.tables:
        return []
    cells = [model.tables["not_met"].cells(name) for name in ("detector", "group", "result", "why", "outcome")]
    named = [
        f"{', '.join(escape(cell.text, _LONGEST_NAME) for cell in names)}: {escape(why.text or outcome.text, 80)}"
        for *names, why, outcome in zip(*cells, strict=True)
    ]
    more = len(named) - _LIMITS_NAMED
    return [*named[:_LIMITS_NAMED], *([f"and {more} more"] if more > 0 else [])]


def _limits(model: Model) -> tuple[list[Section], list[Section]]:
    """Return the limits, violated ones first; if they are many, those that are met separately and collapsed."""
    tables = [model.tables[name] for name in ("not_met", "met") if name in model.tables]
    rows = [row for table in tables for row in table.rows]
    if rows and len(rows) <= _LIMITS_OPEN:
        return [_section(replace(tables[0], title=TITLES["limits"], rows=rows))], []
    met = [_section(table, folded=True) for table in tables if table.name == "met"]
    return [_section(table) for table in tables if table.name != "met"], met


def _forces(model: Model) -> Sequence[tuple[str, str]]:
    """Return the tables of forces, the first with the sources of the limits and whether they have been checked."""
    profiles = dict.fromkeys(
        f"{escape(item.source, None)}{f' **{item.unchecked}**' if item.unchecked else ''}"
        for item in model.profiles.values()
    )
    return ("force", " ".join(profiles)), ("points", "")


def _section(table: Table, lead: str = "", tail: str = "", *, folded: bool = False) -> Section:
    return Section(table.counted_title if folded else escape(table.title), lead, table, tail, folded)


def _image(image: Image) -> str:
    return f"![{escape(image.caption)}]({quote(image.name)})"
