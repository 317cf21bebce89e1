"""The test protocol as PDF/A."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from cdtool.base.files.foreign import Kind
from cdtool.base.files.writing import write_bytes
from cdtool.report.writers.base import Subject, Writer

if TYPE_CHECKING:
    from cdtool.commands.protocol.document.blocks import Document


class ProtocolPdf(Writer["Document"]):
    """Test protocol: PDF/A-2a, tagged, with embedded fonts; needs the extra `pdf`."""

    name: ClassVar[str] = "protocol_pdf"
    subject: ClassVar[Subject] = "protocol"
    suffixes: ClassVar[tuple[str, ...]] = (".pdf",)
    kinds: ClassVar[dict[str, Kind]] = {".pdf": Kind(b"cdtool test protocol", "test protocol of cdtool", anywhere=True)}
    needs: ClassVar[str] = "typst"

    def check(self, target: Path) -> None:  # noqa: ARG002 - the same for every target
        """Raise UsageError if the library that typesets is not installed."""
        from cdtool.commands.protocol.document.pdf import check_typst

        check_typst()

    def write(self, report: Document, target: Path) -> None:
        """Write it; raises CdtoolError."""
        from cdtool.commands.protocol.document.pdf import to_pdf

        write_bytes(target, to_pdf(report))
