"""The page of a coverage map in a real browser: cells open trigger plots, by mouse and keyboard."""

from __future__ import annotations

import shutil
from typing import Any

import pytest

from cdtool.commands.inject.coverage.page import coverage_html
from tests.report.html.coverage_case import coverage_case
from tests.report.html.test_html_in_browser import all_of, browser, shown, texts  # noqa: F401

pytestmark = pytest.mark.skipif(
    not (shutil.which("chromium") and shutil.which("chromedriver")),
    reason="Chromium or chromedriver is absent: the page of a coverage map was not checked",
)


def cell_of(page: Any, title: str) -> Any:
    (found,) = [item for item in all_of(page, "td[data-cell] button") if item.get_attribute("title") == title]
    return found


def test_a_click_on_a_cell_shows_the_trigger_plot_of_its_worst_contact(shown: Any) -> None:  # noqa: F811
    page = shown(coverage_html(coverage_case()))
    assert page.get_log("browser") == []
    assert texts(page, "#cell-title") == ["slow: 1 m, 10 N/mm"]
    page.execute_script("arguments[0].click()", cell_of(page, "slow: 0.5 m, 10 N/mm"))
    assert texts(page, "#cell-title") == ["slow: 0.5 m, 10 N/mm"]
    assert texts(page, "#viewer-title") == ["10000_0.5_1.csv"]
    assert texts(page, "#cell-table tbody td:nth-child(2)") == ["missed", "200 ms"]
    assert "missed" in texts(page, "#viewer-plot text")
    assert len(all_of(page, "#viewer-plot path.line")) == 2
    paths = page.execute_script("return [...document.querySelectorAll('[d]')].map((item) => item.getAttribute('d'))")
    assert not [path for path in paths if any(word in path for word in ("NaN", "Inf", "und"))]
    assert page.execute_script("return performance.getEntriesByType('resource').length") == 0


def test_without_trigger_plots_a_cell_lists_its_contacts(shown: Any) -> None:  # noqa: F811
    from dataclasses import replace

    page = shown(coverage_html(replace(coverage_case(), traces={})))
    page.execute_script("arguments[0].click()", cell_of(page, "slow: 0.5 m, 10 N/mm"))
    assert texts(page, "#cell-table tbody tr > :first-child") == ["10000_0.5_1.csv", "10000_0.5_0.csv"]
    assert page.get_log("browser") == []
