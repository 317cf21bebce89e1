"""The comparison of two builds as Markdown, for a pull request."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import ClassVar

from cdtool.base.files.foreign import Kind
from cdtool.base.files.writing import write_text
from cdtool.commands.compare.comparison import BuildComparison
from cdtool.commands.compare.comparison_model import comparison_model
from cdtool.report.markdown.text import Section, escape, table_lines
from cdtool.report.writers.base import Subject, Writer


class ComparisonMarkdown(Writer[BuildComparison]):
    """Comparison of two builds: Markdown with the verdict and a row per detector and group."""

    name: ClassVar[str] = "comparison_markdown"
    subject: ClassVar[Subject] = "comparison"
    suffixes: ClassVar[tuple[str, ...]] = (".md",)
    kinds: ClassVar[dict[str, Kind]] = {".md": Kind(b"**cdtool compare: ", "comparison of cdtool")}

    def write(self, report: BuildComparison, target: Path) -> None:
        """Write it; raises CdtoolError."""
        write_text(target, to_markdown(report))


def to_markdown(comparison: BuildComparison) -> str:
    """Return the verdict, a table of the results, all of them in words (folded), and what differs."""
    model = comparison_model(comparison)
    parts = [f"**cdtool compare: {escape(model.verdict)}**", "\n".join(table_lines(model.short_results))]
    parts += [escape(change, None) for change in model.changes]
    every = replace(model.results, title="Every result in words")
    read = "\n\n".join(escape(text, None) for text in model.how_to_read)
    parts.append(Section(every.counted_title, table=every, tail=read, folded=True).whole)
    if model.changed.rows:
        parts += [f"{model.changed.title}:", "\n".join(table_lines(model.changed))]
    parts += [escape(note) for note in model.notes]
    return "\n\n".join(parts) + "\n"
