"""Statistics by kind of contact: from labels to summaries, limits and reports."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace

import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.base.settings import Place
from cdtool.results.evaluated import evaluate
from cdtool.results.files.results_file import read_results, to_json
from cdtool.results.limits import Bounds, limit_rules
from cdtool.results.results import ContactResult, ExposureResult, Results
from cdtool.results.summary import summarise_kinds
from tests.synthetic.builds import MISSED, contact

KINDS = ("stiff/hard", "stiff/soft", "stiff/(no kind)")


def contact_of(number: int, kind: str | None, outcome: float | str, detector: str = "momentum") -> ContactResult:
    return replace(contact("a.csv", "stiff", detector, outcome, 5.0, 100.0), contact=number, kind=kind)


def results(*kinds: str | None) -> Results:
    rows = [contact_of(k, kind, 10.0 * k) for k, kind in enumerate(kinds, 1)]
    rows += [contact_of(k, kind, MISSED, "pure_torque") for k, kind in enumerate(kinds, 1)]
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


def limits(text: str, known: tuple[str, ...] = KINDS):
    place = Place("b.toml", "limits.")
    bounds = {key: Bounds(**value) for key, value in tomllib.loads(text).items()}
    found = limit_rules(bounds, place, [("momentum", "gm"), ("pure_torque", "pt")], ("stiff", "holdout"), known)
    place.finish()
    return found


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
