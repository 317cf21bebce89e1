"""Which recordings need attention, and which of them is the worst."""

from __future__ import annotations

from dataclasses import replace

from cdtool.report.tables.attention import attention_table, failed_recordings
from cdtool.results.evaluated import evaluate
from cdtool.results.limits import LimitRule
from cdtool.results.results import FalseAlarmResult, ForceResult
from tests.report.bench import contact


def force(recording: str, verdict: str, peak: float) -> ForceResult:
    return ForceResult(recording, "stiff", 1, "gap", verdict, peak, (), None, 10.0, f"{peak:.0f} N where 400 N")


def names_of(results) -> list[str]:
    return [item.log[1] for item in failed_recordings(results)]


def test_force_limits_come_before_misses_and_misses_before_false_alarms(results):
    rows = tuple(contact("momentum", "stiff", None, "missed", name) for name in ("b", "c"))
    alarms = (FalseAlarmResult("a", "stiff", "momentum", "gate", 1.0),)
    found = replace(results, contacts=rows, false_alarms=alarms, forces=(force("c", "fail", 500.0),), recordings=())
    assert names_of(found) == ["c", "b", "a"]


def test_the_larger_peak_and_more_detectors_that_missed_are_worse(results):
    rows = [contact("momentum", "stiff", None, "missed", name) for name in ("a", "b", "c")]
    rows[1] = replace(rows[1], peak_force_n=9000.0)
    rows.append(contact("friction_ekf", "stiff", None, "missed", "c"))
    assert names_of(replace(results, contacts=tuple(rows), false_alarms=(), recordings=())) == ["c", "b", "a"]


def test_a_recording_that_meets_everything_is_not_listed(results):
    rows = (contact("momentum", "stiff", 40.0, name="a"), contact("momentum", "stiff", None, "not_assessable", "b"))
    found = replace(results, contacts=rows, false_alarms=(), forces=(force("a", "pass", 100.0),), recordings=())
    assert failed_recordings(found) == []
    assert attention_table(found, []).rows == []


def test_a_slow_contact_is_listed_only_if_it_violates_a_limit(results):
    rows = (contact("momentum", "stiff", 40.0, name="a"), contact("momentum", "stiff", 90.0, name="b"))
    slow = replace(results, contacts=rows, false_alarms=(), recordings=())
    assert names_of(slow) == []
    limit = LimitRule("gm.stiff.p95_ms", "momentum", "stiff", "p95_ms", largest=50.0)
    found = evaluate(slow, [limit]).results
    assert names_of(found) == ["b"]
    table = attention_table(found, failed_recordings(found))
    assert [column.heading for column in table.columns] == ["recording", "group", "violates limits"]
    assert table.rows[0][2].text == "momentum: contact 1 is detected after 90 ms (gm.stiff.p95_ms: at most 50)"
