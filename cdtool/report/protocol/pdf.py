"""The protocol as PDF/A-2a and PDF/UA-1: tagged, with embedded fonts. Typeset by typst, a wheel of its own."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from cdtool.errors import OutputError, UsageError
from cdtool.report.protocol.blocks import Document
from cdtool.report.protocol.html import page_file

# Level A: tagged, so that a reader without sight hears headings, tables and descriptions of the curves.
_STANDARDS = ["a-2a", "ua-1"]


def check_typst() -> None:
    """Raise UsageError if the library that typesets is not installed."""
    try:
        import typst  # noqa: F401
    except ImportError as fault:
        raise UsageError(
            "a protocol as PDF needs typst", "pip install 'cdtool[pdf]', or write -o protocol.html and print it"
        ) from fault


def to_pdf(document: Document) -> bytes:
    """Return the PDF of a document; the same bytes for the same document and version of typst.

    Raises UsageError without typst, OutputError if it cannot typeset the document.
    """
    check_typst()
    import typst
    from matplotlib import get_data_path

    # Only fonts that are installed with the libraries: the same pages on every computer.
    fonts = Path(get_data_path()) / "fonts" / "ttf"
    try:
        made = typst.compile(
            page_file("protocol.typ").encode(),
            format="pdf",
            sys_inputs={"document": json.dumps(asdict(document), ensure_ascii=False)},
            pdf_standards=_STANDARDS,
            font_paths=[str(fonts)],
            ignore_system_fonts=True,
        )
    except Exception as fault:
        raise OutputError(f"typst cannot typeset the protocol: {fault}", "write -o protocol.html") from fault
    return bytes(made)
