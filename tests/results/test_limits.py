"""[limits]: the quantities they name, and their outcomes."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace

import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.base.settings import Place, read
from cdtool.results.limits import Bounds, check_limits, limit_rules, not_met
from cdtool.results.results import ContactResult, ExposureResult, FalseAlarmResult, Results
from cdtool.results.summary import FIGURES, summarise
from tests.synthetic.builds import MISSED, NOT_ASSESSABLE, contact

DETECTORS = [("momentum", "gm"), ("friction_ekf", "feekf")]
GROUPS = ("stiff", "soft.2", "holdout")


def contact_in(detector: str, group: str, outcome: float | str) -> ContactResult:
    return contact(f"{group}-{outcome}", group, detector, outcome, 5.0, 300.0)


def results() -> Results:
    contacts = [contact_in("momentum", "stiff", x) for x in (10.0, 20.0, 30.0, 40.0)]
    contacts += [contact_in("friction_ekf", "stiff", item) for item in (10.0, MISSED)]
    contacts += [contact_in("momentum", "soft.2", NOT_ASSESSABLE)]
    contacts += [contact_in("friction_ekf", "soft.2", 70.0)]
    exposure = [ExposureResult(group, name, 4, 4, 0.5) for group in GROUPS for name, _ in DETECTORS]
    alarm = FalseAlarmResult("h", "holdout", "momentum", "gate", 1.0)
    return Results({}, ("momentum", "friction_ekf"), GROUPS, tuple(contacts), (alarm,), tuple(exposure))


SUMMARIES = summarise(results())


@dataclass(frozen=True)
class Limits:
    limits: dict[str, Bounds]


def rules(text: str):
    place = Place("b.toml")
    file = read(Limits, {"limits": tomllib.loads(text)}, place)
    found = limit_rules(file.limits, place.below("limits"), DETECTORS, GROUPS)
    place.finish()
    return found


def check(text: str):
    return check_limits(rules(text), SUMMARIES)


def test_above_the_largest_and_below_the_least_are_not_met_with_the_reason():
    (high,) = check('"gm.stiff.max_ms" = { max = 39.9 }')
    assert high.outcome == "violated" and high.reason == "40 is more than 39.9"
    (low,) = check('"feekf.stiff.detected" = { min = 2 }')
    assert low.outcome == "violated" and low.reason == "1 is less than 2"


def test_a_star_selects_every_detector_and_every_group_with_contacts():
    limits = check('"*.*.missed" = { max = 0 }')
    assert [(item.detector, item.group, item.outcome) for item in limits] == [
        ("momentum", "stiff", "met"),
        ("friction_ekf", "stiff", "violated"),
        ("momentum", "soft.2", "not_assessable"),
        ("friction_ekf", "soft.2", "met"),
    ]


def test_unassessable_values_do_not_pass():
    (limit,) = check('"gm.soft.2.mean_ms" = { max = 100 }')
    assert limit.outcome == "not_assessable" and limit.value is None
    assert limit.reason == "none of 1 contacts could be assessed"
    assert not_met([limit]) == [limit]


def test_an_unreached_quantile_violates_its_limit():
    (limit,) = check('"feekf.stiff.p95_ms" = { max = 1000 }')
    assert limit.outcome == "violated" and limit.value is None and "not reached" in limit.reason


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('"gmm.stiff.mean_ms" = { max = 1 }', "unknown detector 'gmm'.*gm"),
        ('"gm.stif.mean_ms" = { max = 1 }', "unknown group 'stif'.*stiff"),
        ('"gm.stiff.mean" = { max = 1 }', "unknown metric 'mean'.*mean_ms"),
        ('"gm" = { max = 1 }', "does not name a metric"),
        ('"gm.stiff.mean_ms" = { }', "has no bound"),
        ('"gm.stiff.mean_ms" = 5', "a table"),
        ('"gm.stiff.mean_ms" = { max = 1, min = 2 }', "min: is 2, above max 1"),
        ('"gm.stiff.mean_ms" = { maximum = 1, max = 2 }', "unknown key"),
        ('"gm.stiff.mean_ms" = { max = "fast" }', "a number"),
    ],
)
def test_a_wrong_limit_is_one_line_that_names_its_key(text, said):
    with pytest.raises(ConfigurationError, match=rf"(?s)b\.toml: limits\..*{said}"):
        rules(text)


def test_a_figure_of_contacts_in_a_group_without_any_is_an_error():
    with pytest.raises(ConfigurationError, match="not available in these results"):
        check('"gm.holdout.p95_ms" = { max = 1 }')


def test_without_monitored_time_a_limit_on_false_alarms_does_not_pass():
    blind = replace(results(), exposure=(ExposureResult("holdout", "friction_ekf", 4, 50, 0.0, 50),))
    summaries = [item for item in summarise(blind) if item.detector == "friction_ekf" and item.group == "holdout"]
    for figure in ("false_alarms", "false_alarms_per_operation_at_most", "false_alarms_per_hour"):
        (limit,) = check_limits(rules(f'"feekf.holdout.{figure}" = {{ max = 9 }}'), summaries)
        assert limit.outcome == "not_assessable" and limit.reason == "nothing was monitored"
    assert FIGURES["operations"](summaries[0]) == 0


def test_force_limits_do_not_pass_without_a_verdict():
    (limit,) = check('"gm.stiff.force_failed" = { max = 0 }')
    assert limit.outcome == "not_assessable" and "force profile" in limit.reason


def test_a_group_of_which_no_log_could_be_scored_does_not_pass():
    empty = replace(results(), contacts=(), exposure=(), false_alarms=())
    (limit,) = check_limits(rules('"gm.stiff.p95_ms" = { max = 50 }'), summarise(empty))
    assert limit.outcome == "not_assessable" and limit.reason == "no recording of the group was scored"


def test_a_missed_contact_makes_the_largest_force_at_the_alarm_infinite():
    (limit,) = check('"feekf.stiff.force_at_alarm_max_n" = { max = 1e9 }')
    assert limit.outcome == "violated"


@pytest.mark.parametrize("figure", ["mean_ms_upper", "median_ms_upper", "p95_ms_upper"])
def test_the_upper_end_of_an_interval_of_few_contacts_is_not_assessable_and_says_why(figure):
    (found,) = check(f'"gm.stiff.{figure}" = {{ max = 900 }}')
    assert (found.outcome, found.value) == ("not_assessable", None)
    assert "needs 10 recordings" in found.reason or "needs 6 contacts" in found.reason
    (value,) = check(f'"gm.stiff.{figure.removesuffix("_upper")}" = {{ max = 900 }}')
    assert value.outcome == "met" and value.value > 0.0


def test_campaigns_widen_the_interval_of_the_mean():
    from cdtool.results.results import RecordingResult

    base = results()
    rows = [contact_in("momentum", "stiff", 10.0 * (i // 5) + 0.1 * (i % 5)) for i in range(60)]
    alone = replace(base, contacts=tuple(rows))
    recordings = tuple(
        RecordingResult(row.recording, "stiff", "", 8.0, 1, 1, campaign=f"day {i // 5}") for i, row in enumerate(rows)
    )
    by_day = replace(alone, recordings=recordings)
    width = [next(s.mean for s in summarise(item) if s.contacts) for item in (alone, by_day)]
    assert width[1].high - width[1].low > 1.3 * (width[0].high - width[0].low)
