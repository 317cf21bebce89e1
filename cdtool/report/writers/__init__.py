"""Report writers: results and traces -> a file. One file a writer; `--output` chooses by the suffix of its name."""

from __future__ import annotations

from pathlib import Path

from cdtool.registry import Registry
from cdtool.report.writers.base import Writer

WRITERS = Registry(
    kind="writer",
    table={
        "json": "cdtool.report.writers.json:Json",
        "html": "cdtool.report.writers.html:Html",
        "markdown": "cdtool.report.writers.markdown:Markdown",
        "junit": "cdtool.report.writers.junit:Junit",
        "contacts": "cdtool.report.writers.contacts:Contacts",
        "forces": "cdtool.report.writers.forces:Forces",
        "figure": "cdtool.report.writers.figure:Figure",
    },
    contract=("name", "suffixes", "in_folder", "kinds", "files", "has_content", "write"),
)


def own_writers() -> list[Writer]:
    """Return cdtool's own writers, in the order of the table."""
    return [WRITERS.load(name)() for name in WRITERS.names()]


def writer_of(target: Path) -> Writer | None:
    """Return the writer of a name's suffix, those of plug-ins included; None where there is none."""
    suffix = target.suffix.lower()
    own = (writer for writer in own_writers() if suffix in writer.suffixes)
    return next(own, None) or next((writer for writer in _plugins() if suffix in writer.suffixes), None)


def known_suffixes() -> list[str]:
    """Return every suffix that can be written, cdtool's own first."""
    return list(dict.fromkeys(suffix for writer in (*own_writers(), *_plugins()) for suffix in writer.suffixes))


def _plugins() -> list[Writer]:
    return [WRITERS.load(name)() for name in WRITERS.usable_names() if name not in WRITERS.table]
