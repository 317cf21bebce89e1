"""Report writers, one per file: results or comparisons -> a file. `--output` chooses by the suffix of its name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cdtool.base.registry import Registry
from cdtool.report.writers.base import Subject, Writer

WRITERS = Registry(
    kind="writer",
    table={
        "json": "cdtool.report.writers.json:Json",
        "html": "cdtool.report.writers.html:Html",
        "markdown": "cdtool.report.writers.markdown:Markdown",
        "junit": "cdtool.report.writers.junit:Junit",
        "parquet": "cdtool.report.writers.parquet:ParquetFolder",
        "contacts": "cdtool.report.writers.contacts:Contacts",
        "forces": "cdtool.report.writers.forces:Forces",
        "figure": "cdtool.report.writers.figure:Figure",
        "comparison_markdown": "cdtool.commands.compare.comparison_markdown:ComparisonMarkdown",
        "comparison_json": "cdtool.commands.compare.comparison_json:ComparisonJson",
        "protocol_html": "cdtool.commands.protocol.document.protocol_html:ProtocolHtml",
        "protocol_pdf": "cdtool.commands.protocol.document.protocol_pdf:ProtocolPdf",
    },
    contract=("name", "suffixes", "in_folder", "subject", "kinds", "files", "has_content", "write"),
)


def own_writers(subject: Subject) -> list[Writer[Any]]:
    """Return cdtool's own writers of a subject, in the order of the table."""
    return _writers(WRITERS.names(), subject)


def writer_of(target: Path, subject: Subject) -> Writer[Any] | None:
    """Return the writer of a name's suffix, cdtool's own before those of plug-ins; None if there is no such writer."""
    suffix = target.suffix.lower()
    own = (writer for writer in own_writers(subject) if suffix in writer.suffixes)
    return next(own, None) or next((writer for writer in _plugins(subject) if suffix in writer.suffixes), None)


def known_suffixes(subject: Subject) -> list[str]:
    """Return every suffix that can be written, cdtool's own first."""
    writers = (*own_writers(subject), *_plugins(subject))
    return list(dict.fromkeys(suffix for writer in writers for suffix in writer.suffixes))


def _plugins(subject: Subject) -> list[Writer[Any]]:
    return _writers([name for name in WRITERS.usable_names() if name not in WRITERS.table], subject)


def _writers(names: list[str], subject: Subject) -> list[Writer[Any]]:
    return [made for made in (WRITERS.load(name)() for name in names) if made.subject == subject]
