"""The HTML report is one harmless file that contains all results."""

from __future__ import annotations

import base64
import hashlib
import json
import math
import re
from dataclasses import dataclass, field
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base.plain_text import plain
from cdtool.report.html.page import to_html
from cdtool.report.html.traces import ABOVE_ALL, ALPHABET, BELOW_ALL, MISSING, packed
from cdtool.report.number_text import number, percent, with_interval
from cdtool.report.table import shown
from cdtool.report.writers.base import Report
from cdtool.results.evaluated import Evaluated
from cdtool.statistics.interval import Interval
from tests.report.hostile import HOSTILE
from tests.report.html.html_case import case

VOID = {"meta", "br", "input", "link", "img", "hr"}
TAGS = {
    *("html", "head", "meta", "title", "style", "body", "header", "main", "nav", "section", "h1", "h2", "h3", "p", "a"),
    *("strong", "small", "div", "table", "caption", "thead", "tbody", "tr", "th", "td", "figure", "figcaption", "svg"),
    *("span", "ul", "li", "details", "summary", "noscript", "script", "button", "link"),
}
ATTRIBUTES = {
    *("lang", "charset", "http-equiv", "content", "name", "id", "class", "href", "type", "hidden", "open", "title"),
    *("role", "aria-label", "tabindex", "scope", "height", "data-key", "data-table", "data-plot", "data-number"),
    *("data-for", "data-do", "rel", "blocking", "colspan"),
}


@dataclass
class Page(HTMLParser):
    """Tags with their attributes in order, scripts and styles, and the rows of tables by the table's id."""

    tags: list[str] = field(default_factory=list)
    attributes: list[tuple[str, str, str | None]] = field(default_factory=list)
    scripts: list[tuple[dict[str, str | None], str]] = field(default_factory=list)
    styles: list[str] = field(default_factory=list)
    tables: dict[str, list[list[str]]] = field(default_factory=dict)
    words: list[str] = field(default_factory=list)
    open_tags: list[str] = field(default_factory=list)
    cells: list[str] | None = None

    def __post_init__(self) -> None:
        HTMLParser.__init__(self)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]
        if tag in VOID:
            return
        self.open_tags.append(tag)
        if tag == "script":
            self.scripts.append((dict(attrs), ""))
        elif tag == "style":
            self.styles.append("")
        elif tag == "table":
            self.rows = self.tables.setdefault(str(dict(attrs)["id"]), [])
        elif tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open_tags.pop() == tag, f"{tag} closes another element"

    def handle_data(self, data: str) -> None:
        last = self.open_tags[-1] if self.open_tags else ""
        if last == "script":
            self.scripts[-1] = (self.scripts[-1][0], self.scripts[-1][1] + data)
        elif last == "style":
            self.styles[-1] += data
        else:
            self.words.append(data)
            if "td" in self.open_tags or "th" in self.open_tags:
                self.rows[-1][-1] += data

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())

    @property
    def data(self) -> dict[str, Any]:
        return strict(next(text for attrs, text in self.scripts if attrs.get("id") == "data"))


def strict(text: str) -> Any:
    def refuse(name: str) -> float:
        raise AssertionError(f"{name} is no JSON")

    return json.loads(text, parse_constant=refuse)


def parsed(text: str) -> Page:
    page = Page()
    page.feed(text)
    page.close()
    assert not page.open_tags
    return page


@pytest.fixture(scope="module")
def made() -> tuple[Evaluated, str]:
    evaluated, traces = case()
    return evaluated, to_html(Report(evaluated, traces))


@pytest.fixture(scope="module")
def page(made) -> Page:
    return parsed(made[1])


def test_the_page_loads_nothing_and_has_no_handlers_or_style_attributes(made, page):
    assert made[1].startswith('<!DOCTYPE html>\n<html lang="en">')
    assert set(page.tags) <= TAGS
    assert {name for _, name, _ in page.attributes} <= ATTRIBUTES
    links = [value for _, name, value in page.attributes if name == "href"]
    ids = {value for _, name, value in page.attributes if name == "id"}
    assert {value for _, name, value in page.attributes if name == "rel"} == {"expect"}
    assert links and all(link and link[0] == "#" and link[1:] in ids for link in links)
    assert "http:" not in re.sub(r"http://www\.w3\.org/2000/svg", "", made[1])
    assert "https:" not in made[1]


def test_the_policy_allows_this_script_and_this_style_alone(page):
    policy = next(
        value for tag, name, value in page.attributes if (tag, name) == ("meta", "content") and "src" in value
    )
    run = [text for attrs, text in page.scripts if attrs.get("type") is None]
    assert len(run) == 1 and len(page.styles) == 1
    for kind, text in (("script", run[0]), ("style", page.styles[0])):
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert f"{kind}-src 'sha256-{digest}';" in policy
    assert policy.startswith("default-src 'none';")
    assert "unsafe" not in policy


def test_every_other_script_is_a_block_of_strict_json(made, page):
    _, traces = case()
    blocks = [(attrs, text) for attrs, text in page.scripts if attrs.get("type") == "application/json"]
    assert [attrs.get("class") for attrs, _ in blocks] == [None, *["trace"] * len(traces)]
    assert len(page.scripts) == len(blocks) + 1
    for _, text in blocks:
        assert isinstance(strict(text), dict)
        assert not set("<>&\u2028\u2029") & set(text)


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_names_are_text_and_nothing_else(page, kind):
    hostile = HOSTILE[kind]
    # Names have to differ from one another, as those of detectors and groups do.
    text = to_html(Report(*case(lambda name: f"{hostile}{name}")))
    found = parsed(text)
    assert found.tags == page.tags
    assert [name for _, name, _ in found.attributes if name != "class"] == [
        name for _, name, _ in page.attributes if name != "class"
    ]
    assert all(character.isprintable() or character == "\n" for character in text)
    assert found.data["detectors"][0]["name"] == plain(f"{hostile}quick")
    assert found.data["recordings"][0] == plain(f"{hostile}stiff/{hostile}01.csv")
    assert found.tables["results-table"][2][0].strip() == plain(f"{hostile}quick").strip()


def test_every_value_of_the_summaries_is_in_the_table(made, page):
    evaluated, _ = made
    rows = page.tables["all-results-table"][1:]
    assert len(rows) == len(evaluated.summaries)
    for row, item in zip(rows, evaluated.summaries, strict=True):
        assert row[0].startswith(item.detector) and row[1] == shown(item.group)
        std = Interval(item.std_ms, math.nan, math.nan)
        for cell, figure in zip(row[2:6], (item.mean, std, item.median, item.p95), strict=True):
            assert cell == with_interval(figure, item.resolution_ms)
        if item.contacts:
            assert row[6] == f"{item.detected} of {item.contacts}"
            assert row[7] == f"{item.missed} of {item.detected + item.missed} at most {percent(item.missed_at_most)}"
            assert row[8] == str(item.not_assessable)
            assert row[11].startswith(number(item.force_at_alarm)) and row[11].endswith(number(item.force_at_alarm_max))
            assert row[12] == number(item.peak_force)
        else:
            assert set(row[2:9]) == {"–"}
        judged = f"in {item.judged_operations} of {item.operations} operations"
        assert row[9] == f"{item.false_alarms} {judged} {number(item.hours)} h"
        assert row[10].endswith(f"at most {number(item.at_most_per_operation)}")


def test_the_results_say_once_for_a_group_what_all_its_detectors_share(page):
    rows = page.tables["results-table"]
    assert rows[0] == ["detector", "median [ms]", "P95 [ms]", "missed", "false alarms", "force at alarm [N]"]
    shared = "false alarms in 11 of 12 operations: at most 0.272 per operation"
    assert [row for row in rows if len(row) == 1] == [
        [f"stiff {shared}; force limit exceeded by 12 contacts"],
        [f"soft {shared}; force limit exceeded by 12 contacts"],
        ["hold-out "],
    ]
    assert [row[3] for row in rows[2:4]] == ["0 of 12 at most 22 %", "1 of 11 at most 36 % 1 not assessable"]


def test_a_force_curve_has_the_verdict_of_its_contact(page):
    panel = page.data["force"][0]
    assert panel["steps"] == [[0, 400, "dynamic"], [0.75, 150, "static"]]
    curve = panel["curves"][0]
    assert (curve["trace"], curve["verdict"], curve["budget"]) == (0, "fail", 12.5)
    assert curve["exceeded"] == "limit exceeded after 12.5 ms"
    assert "Values to be checked against the standard." in page.text
    assert page.tables["forces-table"][1][7] == "dynamic 500 of 400 N: fail; static 750 of 150 N: not assessable"


def test_what_was_left_out_and_the_provenance_are_shown(page):
    assert page.tables["skipped-table"][1:] == [["broken.csv", "empty file"]]
    assert page.tables["damaged-table"][1:] == [["cut.csv", "its end"]]
    assert page.tables["findings-table"][1:] == [["odd.csv", "a gap of 2 s"]]
    assert page.tables["not-assessable-table"][1][3:] == ["6.0 %", "start-up 5.0 %, missing samples 1.0 %"]
    assert page.tables["calibration-table"][1] == ["quick (q)", "1/15op", "5.50", "2", "30", "0.0600"]
    assert ["cdtool version", "9.8.7"] in page.tables["provenance-table"]
    assert "simulated recordings" in page.text
    assert page.tables["learned-table"][1] == ["learn.csv", "ef" * 32]


def unpacked(text: str) -> list[float]:
    """As the page's script reads it."""
    found: list[float] = []
    last = rest = shift = 0
    for letter in text:
        if letter in (MISSING, ABOVE_ALL, BELOW_ALL):
            found.append({MISSING: math.nan, ABOVE_ALL: math.inf, BELOW_ALL: -math.inf}[letter])
            continue
        digit = ALPHABET.index(letter)
        rest |= (digit & 31) << shift
        shift += 5
        if digit < 32:
            last += -(rest + 1) // 2 if rest % 2 else rest // 2
            found.append(last)
            rest = shift = 0
    return found


@given(st.lists(st.one_of(st.sampled_from([math.nan, math.inf, -math.inf]), st.integers(-(10**9), 10**9).map(float))))
def test_a_packed_curve_is_read_as_it_was(numbers):
    np.testing.assert_array_equal(unpacked(packed(np.array(numbers, dtype=np.float64))), numbers)


def test_a_curve_of_the_page_is_that_of_the_trace(page):
    _, traces = case()
    panel = strict(page.scripts[1][1])["panels"][0]
    curve = panel["value"]
    read = [curve["from"] + curve["step"] * n for n in unpacked(curve["at"])]
    np.testing.assert_allclose(read, traces[0].panels[0].course.value, atol=curve["step"])
    assert unpacked(panel["lower"]["at"]) == [-math.inf] * 300
    assert panel["status"] == [[1, 30], [0, 170], [3, 10], [0, 90]]
    assert panel["why"] == ["the torque moved first"]
