"""Tables of every page: a caption or a name, headings of columns, and one heading in each row."""

from __future__ import annotations

import pytest

from cdtool.commands.inject.coverage.page import coverage_html
from cdtool.report.html.page import to_html
from cdtool.report.html.sections_page import PageSection, SectionsPage
from cdtool.report.table import Cell, Heading, Table
from cdtool.report.writers.base import Report
from tests.report.html.coverage_case import coverage_case
from tests.report.html.html_case import case
from tests.report.table_headings import unnamed


def benchmark_page() -> str:
    return to_html(Report(*case()))


def coverage_page() -> str:
    return coverage_html(coverage_case())


def sections_page() -> str:
    table = Table("one", "One table", (Heading("name"), Heading("value")), [[Cell("a"), Cell("1")]])
    return SectionsPage("Kind", "title", "headline", "", "good", (), (PageSection("Section", (table,)),)).html()


@pytest.mark.parametrize("page", [benchmark_page, coverage_page, sections_page])
def test_every_table_has_a_name_and_every_row_a_heading(page):
    assert unnamed(page()) == []
