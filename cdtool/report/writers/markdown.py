"""The report as Markdown, for a pull request."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from cdtool.base.files.foreign import Kind
from cdtool.base.files.writing import write_text
from cdtool.report.writers.base import Report, Writer


class Markdown(Writer[Report]):
    """Markdown: the tables as text; in a folder with links to the figures."""

    name: ClassVar[str] = "markdown"
    suffixes: ClassVar[tuple[str, ...]] = (".md",)
    in_folder: ClassVar[str] = "report.md"
    kinds: ClassVar[dict[str, Kind]] = {".md": Kind(b"# Collision detection: ", "Markdown report of cdtool")}

    def write(self, report: Report, target: Path) -> None:
        """Write it; raises CdtoolError."""
        from cdtool.report.markdown.report import to_markdown

        write_text(target, to_markdown(report))
