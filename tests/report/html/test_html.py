"""The HTML report is one harmless file that contains all results."""

from __future__ import annotations

import base64
import hashlib
import json
import math
import re
from dataclasses import dataclass, field, replace
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
from cdtool.report.writers.base import Report
from cdtool.results.evaluated import Evaluated, evaluate
from cdtool.results.results import ContactResult, RecordingResult, Results
from cdtool.statistics.interval import Interval
from tests.report.hostile import HOSTILE
from tests.report.html.html_case import case, trace_of

VOID = {"meta", "br", "input", "link", "img", "hr"}
TAGS = {
    *("html", "head", "meta", "title", "style", "body", "header", "main", "nav", "section", "h1", "h2", "h3", "p", "a"),
    *("strong", "small", "div", "table", "caption", "thead", "tbody", "tr", "th", "td", "figure", "figcaption", "svg"),
    *("span", "ul", "li", "details", "summary", "noscript", "script", "button", "link"),
}
ATTRIBUTES = {
    *("lang", "charset", "http-equiv", "content", "name", "id", "class", "href", "type", "hidden", "open", "title"),
    *("role", "aria-label", "tabindex", "scope", "height", "data-key", "data-table", "data-plot", "data-number"),
    *("data-for", "data-do", "rel", "blocking"),
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


def test_the_same_input_gives_the_same_bytes(made):
    assert to_html(Report(*case())) == made[1]


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
    assert found.tables["results-table"][1][0].split(" (")[0].strip() == plain(f"{hostile}quick").strip()


def test_every_value_of_the_summaries_is_in_the_table(made, page):
    evaluated, _ = made
    rows = page.tables["results-table"][1:]
    assert len(rows) == len(evaluated.summaries)
    for row, item in zip(rows, evaluated.summaries, strict=True):
        assert row[0].startswith(item.detector) and row[1] == item.group
        std = Interval(item.std_ms, math.nan, math.nan)
        for cell, figure in zip(row[2:6], (item.mean, std, item.median, item.p95), strict=True):
            assert cell == with_interval(figure)
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
        per_operation, per_hour = row[10].split(" per hour: ")
        assert per_operation.endswith(f"at most {number(item.at_most_per_operation)}")
        assert per_hour.endswith(f"at most {number(item.at_most_per_hour)}")


def test_a_detector_that_assessed_nothing_has_no_count_of_false_alarms():
    evaluated, _ = case(limits=False)
    quick, *others = evaluated.results.detectors
    exposure = tuple(
        replace(item, not_assessable=item.operations, hours=0.0) if item.detector == quick else item
        for item in evaluated.results.exposure
    )
    found = parsed(to_html(Report(evaluate(replace(evaluated.results, exposure=exposure)))))
    rows = found.tables["results-table"][1:]
    assert {tuple(row[9:11]) for row in rows if row[0].startswith(quick)} == {
        ("not assessable in any of 12 operations", "–")
    }
    assert all("at most" in row[10] for row in rows if row[0] == others[0])
    assert found.tables["recordings-table"][-1][3:5] == ["not assessable", "1 false alarm"]
    blind = tuple(replace(item, not_assessable=item.operations, hours=0.0) for item in exposure)
    text = parsed(to_html(Report(evaluate(replace(evaluated.results, exposure=blind, false_alarms=()))))).text
    assert "false alarms not assessable" in text
    assert "0 false alarms" not in text


def test_a_row_of_latencies_includes_missed_and_not_assessable_contacts(page):
    slow = next(row for row in page.tables["results-table"] if row[:2] == ["slow", "stiff"])
    assert slow[6:9] == ["10 of 12", "1 of 11 at most 36 %", "1"]
    assert "not reached" in slow[5]
    lane = page.data["latency"][0]["rows"][1]
    assert lane["counts"] == "10 detected, 1 missed, 1 not assessable"
    assert lane["watched"] == [1000]


def test_the_verdict_names_violated_limits_first_and_folds_those_that_are_met(made, page):
    outcomes = [row[0] for row in page.tables["not-met-table"][1:]]
    assert outcomes == ["violated"]
    assert len(page.tables["met-table"]) - 1 == len(made[0].results.limits) - 1
    assert "1 of 8 limits not met (1 violated)" in page.text
    assert page.text.index("limits not met") < page.text.index("Mean and std are those of the detected contacts")
    assert "not a certificate" in page.text


def test_a_report_without_scored_recordings_states_this_and_has_no_plots():
    found = parsed(to_html(Report(evaluate(Results({}, (), (), (), (), ())))))
    assert "Nothing was scored." in found.text
    assert "svg" not in found.tags
    assert not found.tables


def test_a_force_curve_has_the_verdict_of_its_contact(page):
    panel = page.data["force"][0]
    assert panel["steps"] == [[0, 400, "dynamic"], [0.75, 150, "static"]]
    assert panel["curves"][0] == {"trace": 0, "contact": 0, "verdict": "fail", "peak": 900, "budget": 12.5}
    assert "Values to be checked against the standard." in page.text
    assert page.tables["forces-table"][1][7] == "dynamic 500 of 400 N: fail; static 750 of 150 N: not assessable"


def test_every_recording_has_a_row_without_script_and_opens_its_own_trace(made, page):
    evaluated, _ = made
    rows = page.tables["recordings-table"][1:]
    assert [row[0] for row in rows] == [item.recording for item in evaluated.results.recordings]
    assert rows[0][4] == "missed" and rows[1][4] == "not assessable"
    assert rows[-1][3:5] == ["0 false alarms", "1 false alarm"]
    table = next(item for item in page.data["tables"] if item["name"] == "recordings-table")
    assert table["opens"] == {"0": [0], "1": [1], "23": [2], "24": [3]}
    assert table["marks"]["with a missed contact"] == [0, 12]


def test_what_was_left_out_and_the_provenance_are_shown(page):
    assert page.tables["skipped-table"][1:] == [["broken.csv", "empty file"]]
    assert page.tables["damaged-table"][1:] == [["cut.csv", "its end"]]
    assert page.tables["findings-table"][1:] == [["odd.csv", "a gap of 2 s"]]
    assert page.tables["not-assessable-table"][1][3:] == ["6.0 %", "start-up 5.0 %, missing samples 1.0 %"]
    assert page.tables["calibration-table"][1] == ["quick (q)", "1/15op", "5.50", "2", "30", "0.0600"]
    assert ["cdtool version", "9.8.7"] in page.tables["provenance-table"]
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


def test_five_thousand_recordings_stay_below_fifteen_megabytes():
    evaluated, _ = case()
    rng = np.random.default_rng(1)
    detectors = tuple(f"detector_{i}" for i in range(5))
    logs = [f"stiff/2024-05-17_gate_left_{i:05d}.mcap" for i in range(5000)]
    contacts = tuple(
        ContactResult(log, "stiff", name, "gate", 2.0, 5e-4, 2.1, late, "detected", 812.34, 2911.5, watched_ms=1000.0)
        for log in logs
        for name, late in zip(detectors, np.round(rng.gamma(9.0, 8.0, 5), 1).tolist(), strict=True)
    )
    results = replace(
        evaluated.results,
        detectors=detectors,
        groups=("stiff",),
        recordings=tuple(RecordingResult(log, "stiff", "ab" * 32, 7.2, 1, 1) for log in logs),
        contacts=contacts,
    )
    traces = [
        replace(trace_of(str, "stiff", log), panels=tuple(replace(panel, detector=name) for name in detectors))
        for log in logs[:120]
        for panel in trace_of(str, "stiff", log).panels[:1]
    ]
    summaries = tuple(replace(evaluated.summaries[0], detector=name) for name in detectors)
    text = to_html(Report(Evaluated(results, summaries, ()), tuple(traces)))
    assert 2e6 < len(text.encode()) < 15e6
    assert all(log in text for log in (logs[0], logs[-1]))


def test_the_first_section_names_the_failed_recordings_and_contains_the_viewer(made, page):
    text = made[1]
    sections = re.findall(r'<section id="([a-z-]+)"', text)
    assert sections[:2] == ["attention", "limits"]
    first = text[text.index('<section id="attention"') : text.index('<section id="limits"')]
    assert 'data-table="attention-table"' in first and 'id="viewer"' in first and 'id="not-met-table"' in first
    head, worst, *others = page.tables["attention-table"]
    assert head == ["recording", "group", "missed by", "force limit exceeded", "false alarms", "violates limits"]
    assert worst[0] == "soft/01.csv" and worst[2].startswith("slow")
    assert others[-1][0] == "free.csv", "a false alarm only"


def test_failed_recordings_without_a_trigger_plot_are_counted(made):
    evaluated, traces = case()
    text = to_html(Report(evaluated, traces[:1]))
    assert "1 of 25 failed recordings have trigger plots. The others are listed above" in text
