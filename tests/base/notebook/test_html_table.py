"""A small table as HTML."""

from __future__ import annotations

import math

from cdtool.base.notebook.html_table import html_table


def test_texts_are_escaped_and_unknown_numbers_are_dashes():
    text = html_table("a < b", ["log & run", "ms"], [["<i>", math.nan], ["b", None], ["c", 12.3456]], "see <x>")
    assert "<caption>a &lt; b</caption>" in text and "log &amp; run" in text
    assert '<th scope="row">&lt;i&gt;</th><td>–</td>' in text and "<td>–</td>" in text and "<td>12.35</td>" in text
    assert text.endswith("<p>see &lt;x&gt;</p>")


def test_more_rows_than_a_notebook_should_show_are_counted():
    text = html_table("logs", ["log"], [[number] for number in range(23)])
    assert text.count('scope="row"') == 20 and "<p>3 more rows</p>" in text


def test_a_table_without_rows_has_its_headings():
    assert "<tbody></tbody>" in html_table("logs", ["log", "alarms"], [])
