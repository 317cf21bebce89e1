"""The report as one HTML page."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from cdtool.base.files.foreign import Kind
from cdtool.base.files.writing import write_text
from cdtool.report.writers.base import Report, Writer


class Html(Writer[Report]):
    """HTML: one page with tables, plots and the viewer of traces; it loads no other file."""

    name: ClassVar[str] = "html"
    suffixes: ClassVar[tuple[str, ...]] = (".html",)
    in_folder: ClassVar[str] = "report.html"
    kinds: ClassVar[dict[str, Kind]] = {".html": Kind(b"<title>Collision detection", "HTML report of cdtool")}

    def write(self, report: Report, target: Path) -> None:
        """Write it; raises CdtoolError."""
        from cdtool.report.html.page import to_html

        write_text(target, to_html(report))
