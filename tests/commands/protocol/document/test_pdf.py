"""The protocol as PDF/A: tags, fonts, identification, page numbers, the hash on every page, no orphaned heading."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from typing import Any

import pytest

from cdtool.base.errors import UsageError
from cdtool.commands.protocol.document.blocks import HeadedTable
from cdtool.commands.protocol.document.document import protocol_document
from cdtool.commands.protocol.document.pdf import to_pdf
from tests.report.hostile import HOSTILE

CASES = ["pass", "fail", "incomplete", "pressure_en", "pressure_de"]


@pytest.fixture(scope="module")
def pypdf() -> Any:
    pytest.importorskip("typst", reason="needs the extra pdf")
    return pytest.importorskip("pypdf")


@pytest.mark.parametrize("name", CASES)
def test_it_is_a_tagged_pdf_a_with_its_language_and_title(name, documents, pypdf):
    document = documents[name]
    root = pypdf.PdfReader(io.BytesIO(to_pdf(document))).trailer["/Root"]
    assert root["/MarkInfo"]["/Marked"] and "/StructTreeRoot" in root
    assert root["/Lang"] == document.language
    xmp = root["/Metadata"].get_data().decode()
    assert re.search(r"pdfaid:part\D+2\b", xmp) and re.search(r"pdfaid:conformance\W+A\b", xmp)
    assert document.title in xmp


@pytest.mark.parametrize("name", CASES)
def test_every_page_has_the_hash_of_the_data_and_its_number(name, documents, protocols, pypdf):
    document = documents[name]
    pages = [page.extract_text() for page in pypdf.PdfReader(io.BytesIO(to_pdf(document))).pages]
    for number, text in enumerate(pages, 1):
        assert protocols[name].data_sha256 in re.sub(r"\s", "", text)
        assert document.page.format(page=number, pages=len(pages)) in text


def squeezed(text: str) -> str:
    """Return a text without white space, soft hyphens and places to break."""
    return re.sub(r"[\s\u00ad\u200b-]", "", text)


@pytest.mark.parametrize("name", CASES)
def test_the_text_holds_every_cell_of_the_document(name, documents, pypdf):
    document = documents[name]
    reader = pypdf.PdfReader(io.BytesIO(to_pdf(document)))
    text = squeezed("".join(page.extract_text() for page in reader.pages))
    cells = [cell for block in document.blocks if isinstance(block, HeadedTable) for row in block.rows for cell in row]
    assert len(cells) > 60
    assert [cell for cell in cells if squeezed(cell) not in text] == []


def test_hostile_names_are_text_and_the_same_document_gives_the_same_bytes(protocols, pypdf):
    hostile = "".join(HOSTILE.values()) + "#panic() $x$ *b* `c` \\"
    plan = replace(protocols["pass"].plan, machine=replace(protocols["pass"].plan.machine, maker=hostile))
    document = protocol_document(replace(protocols["pass"], plan=plan))
    made = to_pdf(document)
    assert made == to_pdf(document)
    assert "#panic()" in "".join(page.extract_text() for page in pypdf.PdfReader(io.BytesIO(made)).pages)


def test_without_the_library_one_line_says_what_to_install(documents, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "typst", None)
    with pytest.raises(UsageError, match=r"needs typst.*pip install '\.\[pdf\]'"):
        to_pdf(documents["pass"])
