"""`cdtool plan`: the required size of a test."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import cdtool as api
from cdtool.base.errors import UsageError
from cdtool.commands.compare.planning import measured_std
from cdtool.results.files.results_file import to_json
from cdtool.statistics.sample_size import (
    exposure_for_rate,
    impacts_for_difference,
    impacts_for_missed_share,
    impacts_for_unpaired,
)
from tests.command import cdtool
from tests.synthetic.builds import Outcome, build_results

FIRST = np.random.default_rng(1).normal(40.0, 6.0, 30).tolist()
SECOND = [x + y for x, y in zip(FIRST, np.random.default_rng(2).normal(20.0, 2.0, 30), strict=True)]


def earlier(first: list[Outcome] = FIRST, second: list[Outcome] = SECOND, **options: object):
    return build_results({("momentum", "stiff"): first, ("pure_torque", "stiff"): second}, **options)  # type: ignore[arg-type]


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "results.json"
    path.write_text(to_json(earlier()), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("arguments", "amounts"),
    [
        (("--missed-at-most", "5%"), [59, 93]),
        (("--false-alarms-at-most", "1/1000op"), [999, 2996, 4744]),
        (("--false-alarms-at-most", "0.1/h"), [10, 30, 47.5]),
        (("--difference-ms", "5", "--std-ms", "8"), [23]),
        (("--difference-ms", "5", "--std-ms", "8", "--unpaired", "--power", "0.9"), [55]),
    ],
)
def test_each_question_is_answered_in_one_sentence_with_its_amounts(arguments, amounts):
    done = cdtool("plan", *arguments)
    assert (done.status, done.out.count("\n"), done.err) == (0, 1, "")
    (answer,) = json.loads(cdtool("plan", *arguments, "--json").out)["answers"]
    assert [need["amount"] for need in answer["needs"]] == pytest.approx(amounts, rel=1e-2)
    assert all(f"{amount:g}" in done.out for amount in amounts) and answer["words"] == done.out.rstrip()


def test_the_amounts_are_never_too_small():
    found = api.plan(missed_at_most="3%", false_alarms_at_most="0.03/h", allowed=4, significance=0.01)
    missed, alarms = found.answers
    assert [need.amount for need in missed.needs] == [impacts_for_missed_share(0.03, n, 0.99) for n in (0, 4)]
    for need in alarms.needs[1:]:
        exact = exposure_for_rate(0.03, need.allowed, 0.99)
        assert exact <= need.amount < 1.01 * exact


def test_the_spread_of_an_earlier_test_is_measured_in_pairs(source):
    done = cdtool("plan", "--difference-ms", 1, "--std-ms", source, "--detectors", "gm,pt", "--group", "stiff")
    std = float(np.std(np.subtract(FIRST, SECOND), ddof=1))
    assert done.out == (
        f"to detect a difference of 1 ms with 80 % power (standard deviation of the differences {std:.3g} ms, "
        "measured: momentum minus pure_torque in stiff, 30 contacts, one per recording): "
        f"{impacts_for_difference(1.0, std)} impacts, each with both builds or detectors\n"
    )


def test_unpaired_the_spread_is_that_of_the_latencies(source):
    one = measured_std(source, ["gm"], unpaired=True)
    assert one.std == pytest.approx(np.std(FIRST, ddof=1))
    both = measured_std(source, ["gm", "pt"], unpaired=True)
    assert both.std == pytest.approx(math.sqrt(0.5 * (np.var(FIRST, ddof=1) + np.var(SECOND, ddof=1))))
    done = cdtool("plan", "--difference-ms", 5, "--std-ms", source, "--detectors", "gm", "--unpaired", "--json")
    (answer,) = json.loads(done.out)["answers"]
    assert (
        answer["needs"][0]["amount"] == impacts_for_unpaired(5.0, one.std) and "in each of two sets" in answer["words"]
    )


def test_contacts_of_one_campaign_count_as_one():
    shift = np.repeat(np.random.default_rng(5).normal(0.0, 10.0, 6), 5)
    alike = earlier(FIRST, (np.array(FIRST) + shift).tolist(), campaigns=[f"day {i // 5}" for i in range(30)])
    found = measured_std(alike, ["gm", "pt"])
    assert found.std == pytest.approx(np.std(shift[::5], ddof=1))
    assert "30 contacts, in 6 campaigns" in found.source
    (answer,) = api.plan(difference_ms=5.0, std_ms=found).answers
    assert answer.needs[0].unit == "recordings or campaigns"
    assert answer.needs[0].amount == impacts_for_difference(5.0, found.std)
    assert answer.words.endswith("each with both builds or detectors, with as many contacts in each as measured")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "there is no question (give --difference-ms 5 --std-ms 8, --missed-at-most 5% or --false-alarms-at-most"),
        (("--difference-ms", 5), "a difference of 5 ms without a standard deviation"),
        (("--difference-ms", 0, "--std-ms", 8), "difference is 0"),
        (("--difference-ms", 5, "--std-ms", 8, "--level", 0), "significance level is 0"),
        (("--std-ms", 8), "--std-ms has no effect (use it with --difference-ms)"),
        (("--missed-at-most", "5%", "--unpaired"), "--unpaired has no effect"),
        (("--missed-at-most", "5%", "--group", "stiff"), "--group has no effect (use it with --std-ms results.json)"),
        (("--missed-at-most", "5"), "missed share is '5' (give 5% or 0.05"),
        (("--false-alarms-at-most", "often"), "false-alarm budget is 'often'"),
        (("--difference-ms", 5, "--std-ms", "absent.json"), "absent.json: no such file"),
        (("--difference-ms", 5, "--std-ms", "results.json"), "0 detectors are given (give two detectors of momentum"),
        (("--difference-ms", 5, "--std-ms", "results.json", "--detectors", "gm,momentum"), "1 detectors are given"),
        (
            ("--difference-ms", 5, "--std-ms", "results.json", "--detectors", "gm,ptt"),
            "detector 'ptt' is not in the results",
        ),
        (
            ("--difference-ms", 5, "--std-ms", "results.json", "--detectors", "gm,pt", "--group", "stif"),
            "group 'stif' has no contacts (did you mean stiff?",
        ),
    ],
)
def test_an_incomplete_question_exits_with_2_and_names_the_option(source, monkeypatch, arguments, message):
    monkeypatch.chdir(source.parent)
    done = cdtool("plan", *arguments)
    assert done.status == 2 and message in done.err and done.out == ""


def test_a_group_is_required_if_there_are_several():
    results = build_results(
        {(name, group): FIRST for name in ("momentum", "pure_torque") for group in ("stiff", "soft")}
    )
    with pytest.raises(UsageError, match=r"no group is given \(known: soft, stiff\)"):
        measured_std(results, ["gm", "pt"])
