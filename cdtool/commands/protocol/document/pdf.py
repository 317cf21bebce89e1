"""The protocol as PDF/A-2a and PDF/UA-1: tagged, with embedded fonts. Typeset by typst, a wheel of its own."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from cdtool.base.errors import OutputError, UsageError, installing
from cdtool.commands.protocol.document.blocks import Document
from cdtool.commands.protocol.document.html import page_file

# The font of every character that the text's own font does not have; it comes with matplotlib.
_FALLBACK = "DejaVuSans.ttf"


def check_typst() -> None:
    """Raise UsageError if the library that typesets is not installed."""
    try:
        import typst  # noqa: F401
    except ImportError as fault:
        raise UsageError(
            "a protocol as PDF needs typst", f"{installing('pdf')}, or write -o protocol.html and print it"
        ) from fault


def to_pdf(document: Document) -> bytes:
    """Return the PDF of a document; the same bytes for the same document and version of typst.

    Raises UsageError without typst, OutputError if it cannot typeset the document.
    """
    check_typst()
    import typst
    from matplotlib import get_data_path

    folder = Path(get_data_path()) / "fonts" / "ttf"
    text = json.dumps(asdict(document), ensure_ascii=False)
    # Fonts that are installed with the libraries give the same pages on every computer.
    has_every = _has_every_character(folder / _FALLBACK, text)
    fonts = typst.Fonts(include_system_fonts=not has_every, font_paths=[str(folder)])
    try:
        made = typst.compile(
            page_file("protocol.typ").encode(),
            format="pdf",
            sys_inputs={"document": text},
            # Level A: tagged, so that a reader without sight hears headings, tables and descriptions of the curves.
            pdf_standards=["a-2a", "ua-1"],
            font_paths=fonts,
        )
    except Exception as fault:
        raise OutputError(
            f"typst cannot typeset the protocol: {fault}",
            f"update it, {installing('pdf')} --upgrade, or write -o protocol.html",
        ) from fault
    return bytes(made)


def _has_every_character(font: Path, text: str) -> bool:
    """Return whether a font has all characters of a text, as it has not of Chinese."""
    from matplotlib.ft2font import FT2Font

    known = FT2Font(str(font)).get_charmap()
    return all(ord(character) in known for character in set(text) if character.isprintable())
