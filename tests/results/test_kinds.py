"""Statistics by kind of contact: from labels to summaries, limits and reports."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace

import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.base.settings import Place
from cdtool.report.markdown.report import to_markdown
from cdtool.report.model import report_model
from cdtool.report.writers.base import Report
from cdtool.report.writers.junit import to_junit
from cdtool.results.evaluated import evaluate
from cdtool.results.files.results_file import read_results, to_json
from cdtool.results.limits import Bounds, limit_rules
from cdtool.results.results import ContactResult, ExposureResult, Results
from cdtool.results.summary import FIGURES, kind_group, summarise, summarise_kinds

KINDS = ("stiff/hard", "stiff/soft", "stiff/(no kind)")


def contact(number: int, kind: str | None, latency: float | None, detector: str = "momentum") -> ContactResult:
    outcome = "missed" if latency is None else "detected"
    alarm = None if latency is None else 5.0 + 1e-3 * latency
    return ContactResult(
        "a.csv",
        "stiff",
        detector,
        "gate",
        5.0,
        0.001,
        alarm,
        latency,
        outcome,
        100.0,
        900.0,
        contact=number,
        kind=kind,
        watched_ms=1000.0,
    )


def results(*kinds: str | None) -> Results:
    rows = [contact(k, kind, 10.0 * k) for k, kind in enumerate(kinds, 1)]
    rows += [contact(k, kind, None, "pure_torque") for k, kind in enumerate(kinds, 1)]
    exposure = tuple(ExposureResult(group, "momentum", 1, 1, 0.5) for group in ("stiff", "holdout"))
    return Results({}, ("momentum", "pure_torque"), ("stiff", "holdout"), tuple(rows), (), exposure)


THREE = results("hard", "soft", None, "hard")


def test_each_kind_of_a_group_has_a_summary_per_detector():
    found = summarise_kinds(THREE)
    assert [(item.group, item.detector) for item in found] == [
        (group, name) for group in KINDS for name in ("momentum", "pure_torque")
    ]
    hard = found[0]
    assert (hard.contacts, hard.detected, hard.min_ms, hard.max_ms) == (2, 2, 10.0, 40.0)
    assert (found[1].missed, found[1].max_ms) == (2, math.inf)


def test_the_contacts_of_all_kinds_are_those_of_the_group():
    whole = {item.detector: item for item in summarise(THREE) if item.group == "stiff"}
    for name, item in whole.items():
        kinds = [kind for kind in summarise_kinds(THREE) if kind.detector == name]
        for figure in ("contacts", "detected", "missed", "not_assessable"):
            assert sum(getattr(kind, figure) for kind in kinds) == getattr(item, figure)


def test_false_alarms_belong_to_no_kind():
    for item in summarise_kinds(THREE):
        assert not item.watched and math.isnan(FIGURES["false_alarms"](item))


def test_without_a_kind_there_is_nothing_by_kind():
    assert summarise_kinds(results(None, None)) == []
    model = report_model(evaluate(results(None, None)))
    assert "kinds" not in model.tables


def limits(text: str, known: tuple[str, ...] = KINDS):
    place = Place("b.toml", "limits.")
    bounds = {key: Bounds(**value) for key, value in tomllib.loads(text).items()}
    found = limit_rules(bounds, place, [("momentum", "gm"), ("pure_torque", "pt")], ("stiff", "holdout"), known)
    place.finish()
    return found


def test_a_limit_may_name_a_kind_and_a_star_does_not():
    rules = limits('"gm.stiff/hard.max_ms" = { max = 30 }\n"gm.*.max_ms" = { max = 50 }\n')
    found = evaluate(THREE, rules).results.limits
    assert [(item.group, item.outcome) for item in found] == [("stiff/hard", "violated"), ("stiff", "met")]


def test_a_limit_on_a_kind_is_read_back_from_results_json(tmp_path):
    done = evaluate(THREE, limits('"*.stiff/soft.missed" = { max = 0 }\n')).results
    (tmp_path / "r.json").write_text(to_json(done), encoding="utf-8")
    assert read_results(tmp_path / "r.json") == done


def test_a_limit_on_a_kind_without_a_scored_contact_does_not_pass(tmp_path):
    known = (*KINDS, "stiff/head")
    done = evaluate(THREE, limits('"*.stiff/head.missed" = { max = 0 }\n', known)).results
    assert [(item.detector, item.outcome) for item in done.limits] == [
        (name, "not_assessable") for name in ("momentum", "pure_torque")
    ]
    (tmp_path / "r.json").write_text(to_json(done), encoding="utf-8")
    assert read_results(tmp_path / "r.json") == done


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('"gm.stiff/hrad.max_ms" = { max = 1 }', "unknown group 'stiff/hrad'.*stiff/hard"),
        ('"gm.stiff/hard.false_alarms" = { max = 1 }', "false_alarms of one kind of contacts"),
    ],
)
def test_a_wrong_limit_on_a_kind_names_its_key(text, said):
    with pytest.raises(ConfigurationError, match=said):
        limits(text)


def test_every_report_shows_each_kind():
    report = Report(evaluate(THREE), ())
    markdown, junit = to_markdown(report), to_junit(report)
    for group in KINDS:
        assert group.replace("(", r"\(").replace(")", r"\)") in markdown or group in markdown
        assert f'name="momentum.{group}"' in junit
    assert "contact 1 (hard) at" in junit
    assert [row[1].text for row in report.model.tables["kinds"].rows][::2] == list(KINDS)


def test_a_group_of_results_is_not_confused_with_a_kind():
    twice = replace(THREE, groups=("stiff", "stiff/hard", "holdout"))
    (found,) = evaluate(twice, limits('"gm.stiff/hard.contacts" = { max = 0 }\n')).results.limits
    assert found.value == 0.0  # the group has no contact; the kind has two
    assert kind_group("stiff", "hard") == "stiff/hard"
