"""The Markdown report: verdict first, correct numbers, cut to a length without losing the verdict, names as text."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from markdown_it import MarkdownIt

from cdtool.base.errors import UsageError
from cdtool.report.markdown.report import to_markdown
from cdtool.report.markdown.text import escape
from cdtool.report.writers.base import Image, Report
from cdtool.results.evaluated import Evaluated, evaluate
from cdtool.results.limits import LimitRule
from cdtool.results.results import (
    ExposureResult,
    LimitResult,
    Results,
)
from tests.report.hostile import HOSTILE
from tests.report.html.html_case import case
from tests.synthetic.many_results import many_results

OWN_TAGS = re.compile(r"<details>\n<summary>[A-Za-z, -]+ \(\d+\)</summary>\n?|</details>\n?")
NO_WIDTH = "\u200b"


def parsed(text: str) -> list[Any]:
    return MarkdownIt("commonmark", {"html": True}).enable(["table", "strikethrough"]).parse(text)


def rows(text: str) -> list[list[str]]:
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in text.splitlines() if line[:1] == "|"]


def folded(text: str) -> list[str]:
    return re.findall(r"<summary>(.*) \(", text)


def limited(results: Results, *rules: LimitRule) -> Evaluated:
    return evaluate(results, rules)


def rule(figure: str, most: float, detector: str = "momentum", group: str = "stiff") -> LimitRule:
    return LimitRule(f"{detector}.{group}.{figure}", detector, group, figure, largest=most)


def test_limits_that_are_not_met_are_named_first_and_are_on_top_of_their_table(results):
    rules = (rule("missed", 1), rule("mean_ms", 50), rule("peak_force_n", 400, group="holdout"))
    limits = limited(results, *rules[:2]).results.limits
    unknown = LimitResult("a", "momentum", "stiff", "force_at_alarm_n", None, None, 9, "not_assessable", "no load cell")
    text = to_markdown(Report(evaluate(replace(results, limits=(*limits, unknown)))))
    assert text.startswith("# Collision detection: 2 of 3 limits not met (1 violated, 1 not assessable); 1 ")
    head = text.split("## ")[0]
    assert (
        "**Why:** momentum, stiff, mean_ms: 65 is more than 50; momentum, stiff, force_at_alarm_n: no load cell;"
        in head
    )
    assert [row[0] for row in rows(text)[2:4]] == ["**violated**", "**not assessable**"]
    assert len(rows(text)[0]) == 7
    assert rows(text)[2][3:6] == ["mean_ms", "65", "at most 50"]
    assert text.index("## Limits not met") < text.index("## Results") < text.index("Limits met (1)")


def test_few_contacts_have_a_range_and_no_mean(evaluated):
    text = to_markdown(Report(evaluated))
    row = next(row for row in rows(text.split("<summary>All results (")[1]) if row[:2] == ["momentum", "stiff"])
    assert row[2:9] == ["–", "–", "70.0", "60.0 to not reached", "–", "2 of 3", "1 of 3: at most 86 %"]
    assert "Fewer than 10 contacts detected: median and range, no mean, std or P95." in text
    assert "imulated" not in text


def test_a_detector_that_assessed_nothing_has_no_rate_and_no_bound(results):
    blind = replace(results, exposure=(ExposureResult("holdout", "momentum", 40, 40, 0.0, 40),), false_alarms=())
    text = to_markdown(Report(evaluate(blind)))
    short = rows(text.split("## Results")[1].split("## ")[0])
    every = rows(text.split("<summary>All results (")[1])
    assert short[-1][:1] == ["momentum"] and short[-1][4] == "**not assessable in any of 40 operations**"
    assert every[[row[:2] for row in every].index(["momentum", "hold-out"])][-3:-1] == [short[-1][4].strip("*"), "–"]
    assert "0 in 40" not in text
    assert "false alarms not assessable" in text


def test_force_verdicts_say_what_was_exceeded_and_against_which_source():
    text = to_markdown(Report(case()[0]))
    assert text.count("door (source: a standard). **Values to be checked against the standard.**") == 1
    found = rows(text)
    assert any(row[3:5] == ["**fail**", "mean of 3 tests"] for row in found)
    assert any("dynamic 500 of 400 N: fail; static 750 of 150 N: not assessable" in row for row in found)


def nothing_is_active(text: str, tables: int) -> None:
    tokens = parsed(text)
    inline = [child for token in tokens for child in token.children or ()]
    assert [image.attrs["src"] for image in inline if image.type == "image"] == ["a.png"]
    own = {"text", "text_special", "softbreak", "image", "strong_open", "strong_close", "em_open", "em_close"}
    assert {child.type for child in inline} <= own | {"code_inline"}
    assert {child.content for child in inline if child.type == "code_inline"} <= {"contacts", "forces", "limits"}
    for token in tokens:
        assert not token.type.startswith("html") or OWN_TAGS.fullmatch(token.content), token.content
        assert token.type not in ("fence", "code_block", "blockquote_open", "bullet_list_open", "ordered_list_open")
    assert sum(token.type == "table_open" for token in tokens) == tables
    assert sum("<details>" in token.content for token in tokens) == text.count("</details>")
    shown = "".join(child.content for child in inline if child.type != "image")
    assert not re.search(r"[@#]\w", shown)
    assert not re.search(r"www\.[a-z]", text)


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_names_are_shown_as_text(kind):
    hostile = HOSTILE[kind]
    evaluated, _ = case(lambda name: f"{hostile}{name}", contacts=4)
    nothing_is_active(to_markdown(Report(evaluated, images=(Image("a.png", hostile, hostile),))), 21)


@settings(max_examples=60, deadline=None)
@given(st.text(alphabet=st.sampled_from(list("<>|\\`*_[]()!#@&~:;$=+- \n\tawx1./\"'{}^%")), max_size=40))
def test_no_text_is_ever_markup(text):
    shown = parsed(f"# {escape(text)}x\n\n| a | b |\n| --- | --- |\n| {escape(text)} | c |\n")
    assert [token.type for token in shown if token.type.startswith(("html", "td_open", "heading_open"))] == [
        "heading_open",
        "td_open",
        "td_open",
    ]
    (cell, _) = [shown[i + 1].children or [] for i, token in enumerate(shown) if token.type == "td_open"]
    assert {child.type for child in cell} <= {"text", "text_special"}
    plain = "".join(child.content for child in cell).replace(NO_WIDTH, "")
    assert plain == text.replace("\n", "?").replace("\t", "?").strip()


@pytest.fixture(scope="module")
def of_many() -> Evaluated:
    """More recordings than a comment can list, with a missed contact in every detector's stiff group."""
    return evaluate(many_results(900), [LimitRule("*.*.missed", "*", "*", "missed", largest=0)])


def whole_blocks(text: str) -> None:
    """Check that every opened block is closed, none is inside another, and no row is cut."""
    assert re.findall(r"</?details>", text) == ["<details>", "</details>"] * text.count("<details>")
    assert all(line.endswith(" |") for line in text.splitlines() if line.startswith("|"))


def test_a_report_of_many_recordings_fits_a_comment_and_says_what_it_left_out(of_many):
    text = to_markdown(Report(of_many), most=16_000)
    assert 15_000 < len(text) <= 16_000
    assert text.startswith("# Collision detection: 4 of 4 limits not met (4 violated)")
    assert "## Results" in text and "All results (6)" in text and "## Comparisons" in text
    cut = re.search(r"Cut here: (\d+) of 26 rows; all of them are in results.json \(`contacts`\)", text)
    listed = rows(text.split("Contacts missed (26)")[1].split("</details>")[0])
    assert cut and int(cut[1]) == len(listed) - 2 > 2
    whole_blocks(text)


@pytest.mark.parametrize("most", [4000, 4444, 9000, 30_000])
def test_no_report_is_longer_than_it_may_be(of_many, most):
    text = to_markdown(Report(of_many), most=most)
    assert len(text) <= most
    assert text.startswith("# Collision detection: 4 of 4 limits not met")
    assert sum(row[0] == "**violated**" for row in rows(text)) == 4
    assert most > 5_000 or "of this report left out for its length; results.json has everything" in text
    whole_blocks(text)


@pytest.mark.parametrize("kind", HOSTILE)
def test_long_and_hostile_names_do_not_push_the_verdict_out(kind):
    hostile = HOSTILE[kind] * 40
    report = Report(case(lambda name: f"{hostile}{name}")[0], images=(Image("a.png", hostile, hostile),))
    text = to_markdown(report, most=4000)
    assert len(text) <= 4000
    assert text.startswith("# Collision detection: 1 of 8 limits not met (1 violated); force profile violated by ")
    whole_blocks(text)


def test_a_report_too_short_for_its_verdict_is_refused(evaluated):
    with pytest.raises(UsageError, match="at most 3999 characters"):
        to_markdown(Report(evaluated), most=3999)
