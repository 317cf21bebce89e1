"""The test protocol as one HTML page."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from cdtool.evaluation.protocol.protocol import Protocol
from cdtool.files import write_text
from cdtool.foreign_files import Kind
from cdtool.report.writers.base import Subject, Writer


class ProtocolHtml(Writer[Protocol]):
    """Test protocol: HTML, one page without script that loads no other file and prints as A4."""

    name: ClassVar[str] = "protocol_html"
    subject: ClassVar[Subject] = "protocol"
    suffixes: ClassVar[tuple[str, ...]] = (".html",)
    kinds: ClassVar[dict[str, Kind]] = {".html": Kind(b'content="cdtool test protocol"', "test protocol of cdtool")}

    def write(self, report: Protocol, target: Path) -> None:
        """Write it; raises CdtoolError."""
        from cdtool.report.protocol.document import protocol_document
        from cdtool.report.protocol.html import to_html

        write_text(target, to_html(protocol_document(report)))
