"""The protocol as a page: its text in both languages, and that it is one harmless file."""

from __future__ import annotations

import html
import re
from dataclasses import replace
from pathlib import Path

import pytest

from cdtool.commands.protocol.assessment.plan import MachineParticulars
from cdtool.commands.protocol.document.document import protocol_document
from cdtool.commands.protocol.document.html import to_html
from tests.report.hostile import HOSTILE
from tests.report.table_headings import unnamed

GOLDEN = Path(__file__).with_name("golden")


def text_of(page: str) -> str:
    """Return the text of a page, a line for each part, with hashes and the version as words."""
    body = page[page.index("<body>") :].replace("<wbr>", "")
    body = re.sub(r'<img [^>]*alt="([^"]*)">', r"\1", body)
    lines = [html.unescape(re.sub("<[^>]*>", "|", line)).strip("| ") for line in body.splitlines()]
    text = "\n".join(line for line in lines if line) + "\n"
    return re.sub(r"cdtool \d[\w.+]*", "cdtool VERSION", re.sub(r"\b[0-9a-f]{64}\b", "HASH", text))


@pytest.mark.parametrize("name", ["pass", "fail", "incomplete", "pressure_en", "pressure_de"])
def test_the_text_of_a_protocol_is_as_approved(name, documents):
    """To approve a new text, read it and write it to the file that the message names."""
    path = GOLDEN / f"{name}.txt"
    assert text_of(to_html(documents[name])) == path.read_text(encoding="utf-8"), path


def test_it_loads_nothing_runs_nothing_and_shows_hostile_names_as_text(protocols):
    hostile = "".join(HOSTILE.values())
    plan = replace(protocols["pass"].plan, machine=MachineParticulars(*[f"<script>alert(1)</script>{hostile}"] * 5))
    page = to_html(protocol_document(replace(protocols["pass"], plan=plan)))
    assert "<script" not in page and "&lt;script" in page.replace("<wbr>", "")
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert "default-src 'none'; style-src 'sha256-" in html.unescape(page)


def test_every_table_is_named_by_the_heading_above_it_and_every_row_by_its_first_cell(documents):
    page = to_html(documents["fail"])
    assert unnamed(page) == []
    ids = re.findall(r' id="([^"]*)"', page)
    assert len(set(ids)) == len(ids) and set(re.findall(r'aria-labelledby="([^"]*)"', page)) <= set(ids)
