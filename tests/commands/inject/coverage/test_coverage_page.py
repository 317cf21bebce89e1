"""The page of a coverage map: one harmless file, readable without script, below a stated size."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
from typing import Any

import pytest

from cdtool.base.plain_text import plain
from cdtool.commands.inject.coverage.page import coverage_html
from tests.report.hostile import HOSTILE
from tests.report.html.coverage_case import coverage_case


def data_of(text: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    assert found
    values: dict[str, Any] = json.loads(found[1])
    return values


def traces_of(text: str) -> list[dict[str, Any]]:
    return [json.loads(item) for item in re.findall(r'json" class="trace">(.*?)</script>', text, re.DOTALL)]


def cells_of(text: str) -> dict[int, tuple[str, str]]:
    """Return style and words of the cells of the maps by number."""
    found = re.findall(r'<td class="([^"]*)" data-cell="(\d+)"><span class="inner">(.*?)</span></td>', text)
    return {int(number): (style, re.sub(r"<[^>]*>", "|", words)) for style, number, words in found}


def test_a_cell_opens_its_worst_contact_that_has_a_trigger_plot() -> None:
    text = coverage_html(coverage_case())
    data, traces = data_of(text), traces_of(text)
    cells = {item["title"]: item for item in data["cells"]}
    cell = cells["slow: 0.5 m, 10 N/mm"]
    assert [contact[:2] for contact in cell["contacts"]] == [
        ["10000_0.5_1.csv", "missed"],
        ["10000_0.5_0.csv", "200 ms"],
    ]
    assert traces[cell["traces"][0]]["recording"] == "10000_0.5_1.csv"
    slowest = cells["quick: 0.5 m, 100 N/mm"]
    assert slowest["contacts"][0][:2] == ["100000_0.5_1.csv", "22.0 ms"]
    assert slowest["traces"][0] == -1 and traces[slowest["traces"][1]]["recording"] == "100000_0.5_0.csv"
    assert data["cells"][data["first"]]["title"] == "slow: 1 m, 10 N/mm"


def test_the_list_of_tests_has_commands_that_exist() -> None:
    text = coverage_html(coverage_case())
    table = text[text.index('id="telling-table"') : text.index('id="contacts"')]
    lines = re.findall(r"<tr>(.*?)</tr>", table, re.DOTALL)
    rows = [re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", line) for line in lines[1:]]
    assert rows[0][:2] == ["slow", "0.500"] and rows[0][-1] == "cdtool plan --missed-at-most 5%"
    assert rows[-1][-1].startswith("cdtool plan --difference-ms ")
    from tests.command import cdtool as command

    for row in (rows[0], rows[-1]):
        assert command(*row[-1].split()[1:]).status == 0


def test_clearly_different_speeds_have_maps_of_their_own() -> None:
    text = coverage_html(coverage_case(speeds=(0.1, 0.3)))
    assert re.findall(r"<h3>(\w+) <small>contact speed ([\d.]+) m/s</small></h3>", text) == [
        ("quick", "0.1"),
        ("quick", "0.3"),
        ("slow", "0.1"),
        ("slow", "0.3"),
    ]
    assert len(cells_of(text)) == 16
    assert ">speed [m/s]</th>" in text
    assert "slow: 1 m, 10 N/mm, 0.300 m/s" in {item["title"] for item in data_of(text)["cells"]}


@pytest.mark.parametrize("kind", HOSTILE)
def test_names_from_files_are_text(kind: str) -> None:
    case = coverage_case(lambda name: f"{HOSTILE[kind]}{name}")
    text = coverage_html(case)
    assert "<script>alert" not in text
    assert all(letter.isprintable() or letter == "\n" for letter in text)
    assert plain(f"{HOSTILE[kind]}lost.csv") in html.unescape(text)
    assert len(traces_of(text)) == len(case.traces)


def test_the_policy_allows_only_this_script_and_this_style() -> None:
    text = coverage_html(coverage_case())
    policy = html.unescape(re.search(r'Policy" content="(.*?)">', text)[1])  # type: ignore[index]
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    styles = re.findall(r"<style>(.*?)</style>", text, re.DOTALL)
    assert len(scripts) == len(styles) == 1
    for kind, content in (("script", scripts[0]), ("style", styles[0])):
        digest = base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
        assert f"{kind}-src 'sha256-{digest}'" in policy
    assert not re.search(r'\b(src|href)="(?!#)', text)
    assert 'style="' not in text
