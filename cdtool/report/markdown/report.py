"""The report as Markdown for a pull request: verdict, limits, results, and the rest collapsed."""

from __future__ import annotations

from dataclasses import replace
from urllib.parse import quote

from cdtool.base.errors import UsageError
from cdtool.base.plain_text import counted
from cdtool.report.markdown.text import Section, escape, fitted
from cdtool.report.model import NO_CERTIFICATE, TITLES, Model
from cdtool.report.table import Table
from cdtool.report.writers.base import Image, Report

# Room for the verdict and how to read the results, whatever the names.
_LEAST = 4_000
#: A comment in a pull request is short.
_LIMITS_NAMED = 5
#: Two names and an outcome fit in one line of a comment.
_LONGEST_NAME = 40
# The model's tables with all other results, collapsed because they are wider than a comment.
_DETAILS = ("kinds", "conditions", "injected", "points")
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
    not_met, met = (_limits(model.tables[name]) if name in model.tables else None for name in ("not_met", "met"))
    limits = [_section(not_met)] if not_met else []
    results = []
    if "short_results" in model.tables:
        results.append(_section(model.tables["short_results"], escape(model.notes["short_results"], None)))
    else:
        results.append(Section("", escape(model.notes["results"], None)))
    results += [Section("", _image(image)) for image in report.images if image.group is None]
    for group in dict.fromkeys(image.group for image in report.images if image.group is not None):
        own = [_image(image) for image in report.images if image.group == group]
        results.append(Section(escape(group), tail="\n\n".join(own)))
    if model.notes["differences"]:
        lead = escape(model.notes["differences"], None)
        differences = model.tables.get("differences")
        results.append(_section(differences, lead) if differences else Section(TITLES["comparisons"], lead))
    if "force" in model.tables:
        results.append(_section(model.tables["force"], _force_sources(model)))
    details = [_section(met, folded=True)] if met else []
    if "results" in model.tables:
        every = replace(model.tables["results"], title="All results")
        details.append(_section(every, escape(model.notes["results"], None), folded=True))
    for name in _DETAILS:
        if name in model.tables:
            details.append(_section(model.tables[name], escape(model.notes.get(name, ""), None), folded=True))
    tables = [model.tables[name] for name in _FOLDED if name in model.tables]
    folded = [_section(table, folded=True) for table in (*tables, *model.provenance)]
    return fitted(_head(model), (limits, results, details, folded), most)


def _head(model: Model) -> str:
    parts = [f"# Collision detection: {model.headline}", f"{model.counts}."]
    if failing := _failing(model):
        parts.append(f"**{model.tables['not_met'].title}:** {'; '.join(failing)}.")
    if model.reasons:
        reasons = "; ".join(map(escape, model.first_reasons(4)))  # one line of a comment
        parts.append(f"**Reasons:** {reasons}.")
    if "attention" in model.tables:
        parts.append(_worst(model))
    return "\n\n".join([*parts, NO_CERTIFICATE])


def _worst(model: Model) -> str:
    """Return the worst recording and what needs attention in it, with texts short enough for the head."""
    table = model.tables["attention"]
    name, group, *cells = table.rows[0]
    told = [
        f"{column.heading}: {escape(cell.line, 160)}"
        for column, cell in zip(table.columns[2:], cells, strict=True)
        if cell.tone
    ]
    where = f"{escape(name.text, _LONGEST_NAME)} ({escape(group.text, _LONGEST_NAME)})"
    return f"**Worst of {counted(len(table.rows), 'failed recording')}:** {where}; {'; '.join(told)}."


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


def _limits(table: Table) -> Table:
    """Return a table of limits without their keys: detector, group and result say the same in less width."""
    kept = [i for i, column in enumerate(table.columns) if column.heading != "limit"]
    columns = [table.columns[i] for i in kept]
    return replace(table, columns=columns, rows=[[row[i] for i in kept] for row in table.rows])


def _force_sources(model: Model) -> str:
    """Return the sources of the force limits and whether they have been checked."""
    return " ".join(
        dict.fromkeys(
            f"{escape(item.source, None)}{f' **{item.unchecked}**' if item.unchecked else ''}"
            for item in model.profiles.values()
        )
    )


def _section(table: Table, lead: str = "", tail: str = "", *, folded: bool = False) -> Section:
    return Section(table.counted_title if folded else escape(table.title), lead, table, tail, folded)


def _image(image: Image) -> str:
    return f"![{escape(image.caption)}]({quote(image.name)})"
