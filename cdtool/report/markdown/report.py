"""The report as Markdown for a pull request: verdict, limits, results, and the rest collapsed."""

from __future__ import annotations

from urllib.parse import quote

from cdtool.base.errors import UsageError
from cdtool.report.markdown.text import Section, escape, fitted
from cdtool.report.model import TITLES, Model
from cdtool.report.table import Table, shown
from cdtool.report.writers.base import Image, Report

# Room for the verdict and how to read the results, whatever the names.
_LEAST = 4_000
#: A comment in a pull request is short.
_REASONS, _LONGEST_REASON = 5, 160
# The model's tables that are collapsed, because they are wider than a comment; its tables of the provenance follow.
_FOLDED = (
    *("attention", "all_results", "kinds", "conditions", "injected", "comparisons", "points"),
    *("missed", "false_alarms", "not_assessable_contacts", "in_progress", "not_assessable", "force_exceptions"),
    *("skipped", "damaged", "findings", "calibration", "met"),
)


def to_markdown(report: Report, most: int = 60_000) -> str:
    """Return the report as GitHub-flavoured Markdown in at most `most` characters; text from files is never markup.

    If it would be longer, tables are cut and state how many rows results.json has; the verdict and the limits take
    precedence over results, results over collapsed tables. Raises UsageError for `most` below 4,000.
    """
    if most < _LEAST:
        raise UsageError(f"a report of at most {most} characters", f"set at least {_LEAST}")
    model = report.model
    first = [_section(model.tables["not_met"])] if "not_met" in model.tables else []
    first.append(Section("", table=model.tables.get("best"), tail=escape(model.notes["best"], None)))
    results = []
    if "results" in model.tables:
        results.append(_section(model.tables["results"], escape(model.notes["results"], None)))
    results += [Section("", _image(image)) for image in report.images if image.group is None]
    for group in dict.fromkeys(image.group for image in report.images if image.group is not None):
        own = [_image(image) for image in report.images if image.group == group]
        results.append(Section(escape(shown(group)), tail="\n\n".join(own)))
    if model.notes["pairs"]:
        results.append(Section(TITLES["comparisons"], escape(model.notes["pairs"], None)))
    if "force" in model.tables:
        results.append(_section(model.tables["force"], _force_sources(model)))
    tables = [model.tables[name] for name in _FOLDED if name in model.tables]
    folded = [
        _section(table, escape(model.notes.get(table.name, ""), None), folded=True)
        for table in (*tables, *model.provenance)
    ]
    return fitted(_head(model), (first, results, folded), most)


def _head(model: Model) -> str:
    parts = [f"# Collision detection: {model.headline}"]
    parts.append(f"{model.counts}.{f' **{model.simulated.capitalize()}.**' if model.simulated else ''}")
    if model.reasons:
        parts.append(f"**Why:** {'; '.join(escape(line, _LONGEST_REASON) for line in model.first_reasons(_REASONS))}.")
    return "\n\n".join(parts)


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
