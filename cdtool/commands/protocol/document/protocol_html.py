"""The test protocol as one HTML page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from cdtool.base.files.foreign import Kind
from cdtool.base.files.writing import write_text
from cdtool.report.writers.base import Subject, Writer

if TYPE_CHECKING:
    from cdtool.commands.protocol.document.blocks import Document


class ProtocolHtml(Writer["Document"]):
    """Test protocol: HTML, one page without script that loads no other file and prints as A4."""

    name: ClassVar[str] = "protocol_html"
    subject: ClassVar[Subject] = "protocol"
    suffixes: ClassVar[tuple[str, ...]] = (".html",)
    kinds: ClassVar[dict[str, Kind]] = {".html": Kind(b'content="cdtool test protocol"', "test protocol of cdtool")}

    def write(self, report: Document, target: Path) -> None:
        """Write it; raises CdtoolError."""
        from cdtool.commands.protocol.document.html import to_html

        write_text(target, to_html(report))
