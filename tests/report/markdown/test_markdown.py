"""The Markdown report: verdict first, correct numbers, cut to a length without losing the verdict, names as text."""

from __future__ import annotations

import re
from collections.abc import Sequence
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
    CalibrationResult,
    ExposureResult,
    FalseAlarmResult,
    LimitResult,
    RecordingFinding,
    RecordingResult,
    Results,
    Skipped,
)
from tests.report.bench import contact, contacts_of
from tests.report.hostile import HOSTILE
from tests.report.named_results import forces, named

OWN_TAGS = re.compile(r"<details>\n<summary>[A-Za-z -]+ \(\d+\)</summary>\n?|</details>\n?")
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
    assert "momentum, stiff, mean_ms: 65 is more than 50; momentum, stiff, force_at_alarm_n: no load cell." in head
    assert [row[0] for row in rows(text)[2:4]] == ["**violated**", "**not assessable**"]
    assert len(rows(text)[0]) == 7
    assert rows(text)[2][3:6] == ["mean_ms", "65", "at most 50"]
    assert text.index("## Limits not met") < text.index("## Results") < text.index("Limits met (1)")


def test_a_table_contains_the_results_of_each_group(evaluated):
    text = to_markdown(Report(evaluated))
    stiff = rows(text.split("<summary>All results (")[1])
    ekf = next(row for row in stiff if row[:2] == ["friction_ekf (feekf)", "stiff"])
    assert ekf[2:] == [
        "–",
        "–",
        "34.0 (–)",
        "30.0 to 38.0",
        "–",
        "3 of 4",
        "0 of 3: at most 63 %",
        "1",
        "0 in 3 of 4 operations, 0.0100 h",
        "0: at most 0.999",
        "0: at most 300",
        "3600",
    ]
    momentum = next(row for row in stiff if row[:2] == ["momentum", "stiff"])
    assert momentum[4:6] == ["70.0 (–)", "60.0 to not reached"]
    assert momentum[7:9] == ["2 of 3", "1 of 3: at most 86 %"]
    assert "Fewer than 10 contacts detected: median and range, no mean, std or P95." in text
    assert [line for line in text.splitlines() if line.startswith("## ")][:2] == ["## Results", "## Comparisons"]


def test_the_first_table_fits_a_pull_request_and_ends_with_the_force(results):
    made, points = forces()
    felt = tuple(replace(item, force_at_alarm_n=100.0 + i) for i, item in enumerate(results.contacts))
    text = to_markdown(Report(evaluate(replace(results, contacts=felt, forces=made, points=points))))
    head, *table = rows(text.split("## Results\n")[1])
    assert head[:5] == ["group", "detector", "median [ms]", "missed", "false alarms"]
    assert head[5:] == ["force at alarm [N]", "force limit exceeded"]
    momentum = next(row for row in table if row[:2] == ["stiff", "momentum"])
    assert momentum[2:6] == ["70.0", "**1 of 3: at most 86 %**", "0", "104"]
    ekf = next(row for row in table if row[:2] == ["stiff", "friction_ekf"])
    assert ekf[3] == "**0 of 3: at most 63 %; 1 not assessable**"
    soft = next(row for row in table if row[:2] == ["soft", "momentum"])
    assert soft[2].startswith("350") or "(" in soft[2], "thirty contacts have an interval"


def test_false_alarms_are_shown_with_their_exposure_and_bounds(evaluated):
    text = to_markdown(Report(evaluated))
    shown, every = [row for row in rows(text) if "holdout" in row[:2] and "momentum" in row[:2]][:2]
    assert shown == ["holdout", "momentum", "–", "–", "**1**"]
    assert every[-4:] == [
        "1 in 40 operations, 0.100 h",
        "0.0250 (0.0006 to 0.1393): at most 0.119",
        "10.0 (0.3 to 55.7): at most 47.4",
        "–",
    ]


def test_a_detector_that_assessed_nothing_has_no_rate_and_no_bound(results):
    blind = replace(results, exposure=(ExposureResult("holdout", "momentum", 40, 40, 0.0, 40),), false_alarms=())
    text = to_markdown(Report(evaluate(blind)))
    shown, every = [row for row in rows(text) if "holdout" in row[:2] and "momentum" in row[:2]][:2]
    assert shown[4] == "**not assessable in any of 40 operations**"
    assert every[-4:-1] == ["not assessable in any of 40 operations", "–", "–"]
    assert "0 in 40" not in text
    assert "false alarms not assessable" in text


def test_onset_rule_skipped_recordings_and_provenance_are_shown(evaluated):
    text = to_markdown(Report(evaluated))
    assert "(above 20 N, back to 8 N)" in text
    assert "1 entry left out" in text.splitlines()[0]
    assert ["broken.csv", "empty file"] in rows(text)
    assert "evidence from recordings, not a certificate" in text
    for expected in ("9.8.7", "c0ffee" * 10, "5eed" * 16, "ab12" * 16, "cd34" * 16, "bandwidth = 30.0"):
        assert expected in text


def test_single_contacts_and_alarms_are_folded_with_their_reason(results):
    budget = CalibrationResult("momentum", "1/1000op", 6.5, 3000, 6.0, 1)
    findings = (RecordingFinding("a.csv", "a gap"), RecordingFinding("b.csv", "its end is cut off", "loss"))
    text = to_markdown(Report(evaluate(replace(results, calibration=(budget,), findings=findings))))
    assert ["b.csv", "its end is cut off"] in rows(text) and "1 entry left out; data lost in 1 recording" in text
    assert folded(text) == [
        "All results",
        "Contacts missed",
        "False alarms",
        "Contacts not assessable",
        "Samples not assessable",
        "Left out",
        "Damaged but used",
        "Warnings",
        "False-alarm budget",
        "Recordings scored",
        "Provenance",
        "Detectors",
        "Recordings learned from",
    ]
    found = rows(text)
    assert ["stiff/03.csv", "stiff", "1", "5.000", "momentum", "1000", "3600", "no alarm in its window"] in found
    assert ["holdout/01.csv", "holdout", "momentum", "gate", "1.000", "above", "25.0 N", "20.0 N"] in found
    assert ["stiff/04.csv", "stiff", "1", "5.000", "friction_ekf (feekf)", "1000", "3600", "standing still"] in found
    assert ["stiff", "friction_ekf (feekf)", "1 of 4", "25 %", "standing still 25 %"] in found
    assert ["momentum", "1/1000op", "6.50", "1", "3000", "6.00"] in found


def test_differences_that_are_shown_are_listed_and_their_absence_is_not_a_proof(results):
    text = to_markdown(Report(evaluate(results)))
    assert "No difference can be shown between 1 pair of detectors: there are too few recordings of the same" in text
    alike = contacts_of("friction_ekf", "stiff", [30.0] * 12) + contacts_of("momentum", "stiff", [30.0] * 12)
    enough = to_markdown(Report(evaluate(replace(results, contacts=tuple(alike)))))
    assert "1 pair of detectors on the same contacts; p corrected" in enough
    assert "No difference is shown; this is not a proof of none." in enough
    fast, slow = [30.0 + i % 3 for i in range(12)], [60.0 + i % 5 for i in range(12)]
    contacts = [*contacts_of("friction_ekf", "stiff", fast), *contacts_of("momentum", "stiff", slow)]
    contacts += contacts_of("friction_ekf", "soft", fast) + contacts_of("momentum", "soft", [None] * 12)
    shown = [
        row
        for row in rows(to_markdown(Report(evaluate(replace(results, contacts=tuple(contacts))))))
        if "than" in row[1]
    ]
    assert [row[:2] for row in shown] == [
        ["stiff", "friction_ekf (feekf) is faster than momentum"],
        ["soft", "friction_ekf (feekf) misses fewer contacts than momentum"],
    ]
    assert re.fullmatch(r"30\.8 \(\d\d\.\d to \d\d\.\d\) ms", shown[0][2])
    assert shown[1][2:4] == ["missed by only one: 0 to 12", "12"]


def test_the_slower_detector_named_first_makes_the_same_sentence(results):
    fast, slow = [30.0 + i % 3 for i in range(12)], [60.0 + i % 5 for i in range(12)]
    contacts = (*contacts_of("friction_ekf", "stiff", slow), *contacts_of("momentum", "stiff", fast))
    text = to_markdown(Report(evaluate(replace(results, contacts=contacts))))
    (shown,) = [row for row in rows(text) if "than" in row[1]]
    assert shown[1] == "momentum is faster than friction_ekf (feekf)"
    assert shown[2].startswith("30.8 (")


def test_force_verdicts_say_what_was_exceeded_when_and_against_which_source(results):
    made, points = forces()
    profile = {"title": "EN 1: a gap", "source": "EN 1, table 1", "checked": False}
    provenance = {**results.provenance, "force_profiles": {"stiff": profile, "soft": profile}}
    text = to_markdown(Report(evaluate(replace(results, forces=made, points=points, provenance=provenance))))
    assert text.count("EN 1: a gap (source: EN 1, table 1). **Values to be checked against the standard.**") == 1
    found = rows(text)
    assert ["stiff", "reducing gap", "1", "1", "0", "500", "12.0"] in found
    assert any(row[3:5] == ["**fail**", "mean of 3 tests"] for row in found)
    assert any("reducing gap 500 of 400 N: fail; static – of 150 N: not assessable" in row for row in found)
    assert "Force limits not met" in folded(text)


def nothing_is_active(text: str, tables: int) -> None:
    tokens = parsed(text)
    inline = [child for token in tokens for child in token.children or ()]
    assert [image.attrs["src"] for image in inline if image.type == "image"] == ["a.png"]
    own = {"text", "text_special", "softbreak", "image", "strong_open", "strong_close", "em_open", "em_close"}
    assert {child.type for child in inline} <= own | {"code_inline"}
    assert {child.content for child in inline if child.type == "code_inline"} <= {"contacts", "limits"}
    for token in tokens:
        assert not token.type.startswith("html") or OWN_TAGS.fullmatch(token.content), token.content
        assert token.type not in ("fence", "code_block", "blockquote_open", "bullet_list_open", "ordered_list_open")
    assert sum(token.type == "table_open" for token in tokens) == tables
    assert sum("<details>" in token.content for token in tokens) == text.count("</details>")
    shown = "".join(child.content for child in inline if child.type != "image")
    assert not re.search(r"[@#]\w", shown)
    assert not re.search(r"www\.[a-z]", text)


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_names_are_shown_as_text(results, kind):
    name = HOSTILE[kind]
    nothing_is_active(to_markdown(Report(named(results, name), images=(Image("a.png", name, name),))), 19)


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


def many(recordings: int, detectors: Sequence[str], rules: Sequence[LimitRule]) -> Evaluated:
    """Every fourth contact missed, every fifth hold-out run with a false alarm, and much left out."""
    names = [f"campaign 1/stiff/recording_{i:05}.mcap" for i in range(recordings)]
    exposure = [
        ExposureResult(group, name, recordings, recordings, 9.0) for group in ("stiff", "holdout") for name in detectors
    ]
    results = Results(
        provenance={"learned_sha256": dict.fromkeys(names, "ab12" * 16)},
        detectors=tuple(detectors),
        groups=("stiff", "holdout"),
        contacts=tuple(
            contact(
                detector, "stiff", None if i % 4 == 0 else 30.0 + i % 7, "missed" if i % 4 == 0 else "detected", name
            )
            for detector in detectors
            for i, name in enumerate(names)
        ),
        false_alarms=tuple(FalseAlarmResult(name, "holdout", detectors[0], "gate", 1.0) for name in names[::5]),
        exposure=tuple(exposure),
        recordings=tuple(RecordingResult(name, "stiff", "cd34" * 16, 7.0, 1, 1, "campaign 1") for name in names),
        skipped=tuple(Skipped(name, "half of it is missing") for name in names[::9]),
    )
    return evaluate(results, rules)


@pytest.fixture(scope="module")
def five_thousand() -> Evaluated:
    rules = [LimitRule("*.*.missed", "*", "stiff", "missed", largest=0), LimitRule("*.n", "*", "*", "hours", least=1)]
    return many(5000, ["feekf", "gm", "igm", "pi", "pt"], rules)


def whole_blocks(text: str) -> None:
    """Check that every opened block is closed, none is inside another, and no row is cut."""
    assert re.findall(r"</?details>", text) == ["<details>", "</details>"] * text.count("<details>")
    assert all(line.endswith(" |") for line in text.splitlines() if line.startswith("|"))


def test_a_report_of_5000_recordings_fits_a_comment_and_says_what_it_left_out(five_thousand):
    text = to_markdown(Report(five_thousand))
    assert 50_000 < len(text) <= 60_000
    assert text.startswith("# Collision detection: 5 of 15 limits not met (5 violated); 1000 false alarms")
    assert len([row for row in rows(text) if row[0] in ("met", "**violated**")]) == 15
    assert "## Results" in text and "All results (10)" in text and "## Comparisons" in text
    missed = re.search(r"Cut here: (\d+) of 6250 rows; all of them are in results.json \(`contacts`\)", text)
    assert missed and int(missed[1]) == sum("no alarm in its window" in row for row in rows(text)) > 10
    whole_blocks(text)
    assert "Contacts missed (6250)" in text
    left_out = [row for row in rows(text) if row[-1].startswith("half of it is missing")]
    assert len(left_out) == 1 and "recording_00000.mcap" in left_out[0][0]


@pytest.mark.parametrize("most", [4000, 4444, 6000, 9000, 15_000, 30_000])
def test_no_report_is_longer_than_it_may_be(five_thousand, most):
    text = to_markdown(Report(five_thousand), most=most)
    assert len(text) <= most
    assert text.startswith("# Collision detection: 5 of 15 limits not met")
    assert "| **violated** | feekf | stiff | missed | 1250 | at most 0 |" in text
    assert most > 5_000 or "of this report left out for its length; results.json has everything" in text
    whole_blocks(text)


@pytest.mark.parametrize("kind", HOSTILE)
def test_long_and_hostile_names_do_not_push_the_verdict_out(results, kind):
    name = HOSTILE[kind] * 40
    text = to_markdown(Report(named(results, name), images=(Image("a.png", name, name),)), most=4000)
    assert len(text) <= 4000
    assert text.startswith("# Collision detection: 9 of 9 limits not met (9 violated); force profile violated by ")
    assert "and 4 more" in text
    whole_blocks(text)


def test_a_report_too_short_for_its_verdict_is_refused(evaluated):
    with pytest.raises(UsageError, match="at most 3999 characters"):
        to_markdown(Report(evaluated), most=3999)


def test_a_report_without_results_states_this():
    nothing = Results({}, (), (), (), (), ())
    text = to_markdown(Report(evaluate(nothing)))
    assert text.startswith("# Collision detection: nothing was scored; no limits are set\n\nnothing was scored.\n")
    assert "(rule not stated)" in text
