"""Results, their file, and the statistics derived from them."""

from __future__ import annotations

import json
import math
import re
from dataclasses import asdict, replace

import pytest

from cdtool.base.errors import RecordingError
from cdtool.base.files.strict_json import strict_json
from cdtool.results.files.results_file import read_results, to_json
from cdtool.results.results import SCHEMA_VERSION, FalseAlarmResult, RecordingResult, Results, tables
from cdtool.results.summary import summarise
from tests.report.html.html_case import case
from tests.results.full_results import FULL, RESULTS, STEP
from tests.synthetic.many_results import many_results


def test_a_summary_counts_contacts_not_in_its_mean():
    momentum, torque, holdout, _ = summarise(RESULTS)
    assert (momentum.mean_ms, momentum.median_ms, momentum.std_ms) == pytest.approx((30.0, 40.0, 26.4575), rel=1e-5)
    assert (momentum.contacts, momentum.detected, momentum.missed, momentum.not_assessable) == (5, 3, 1, 1)
    assert math.isnan(torque.mean_ms) and torque.missed == 1
    assert (holdout.false_alarms, holdout.operations, holdout.hours) == (1, 9, 0.5)


@pytest.mark.parametrize("results", [FULL, RESULTS, many_results(30, 3), case()[0].results], ids=range(4))
def test_the_json_has_all_of_it_and_a_line_for_each_row(results):
    text = to_json(results)
    assert json.loads(text) == json.loads(strict_json(asdict(results)))
    lines = [json.loads(line.removesuffix(",")) for line in text.splitlines() if line.startswith("  {")]
    rows = [row for name in tables() for row in getattr(results, name)]
    assert lines == json.loads(strict_json([asdict(row) for row in rows]))


def test_results_survive_writing_and_reading(tmp_path):
    path = tmp_path / "results.json"
    path.write_text(to_json(FULL), encoding="utf-8")
    again = read_results(path)
    assert to_json(again) == to_json(FULL)
    assert again.forces[0].steps[1] == replace(STEP, peak_n=None)
    assert again.provenance == {**FULL.provenance, "gain": None}
    assert (again.limits, again.sweep, again.points[0].steps[0].name) == (FULL.limits, FULL.sweep, "dynamic")


@pytest.mark.parametrize(
    "content", ["", "{}", "[]", '{"schema_version": 4}', '{"schema_version": 1}', '{"schema_version": NaN}', "\x00"]
)
def test_an_invalid_results_file_is_one_clear_error(tmp_path, content):
    path = tmp_path / "results.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(RecordingError, match=r"results\.json"):
        read_results(path)


def version_4(recording: str, operations: int, *more: str) -> Results:
    """Results with a false alarm as a file of version 4 has it, without the number of the operation."""
    logs = tuple(RecordingResult(name, "holdout", "", 7.0, operations, 0) for name in ("cut", *more))
    return replace(
        FULL, recordings=logs, false_alarms=(FalseAlarmResult(recording, "holdout", "momentum", "gate", 1.0),)
    )


@pytest.mark.parametrize(
    ("old", "recording", "operation"),
    [
        (version_4("cut#2", 3), "cut", 2),
        (version_4("cut", 3), "cut", None),
        (version_4("cut", 1), "cut", 1),
        (version_4("cut#2", 1, "cut#2"), "cut#2", 1),  # the name of a run
        (version_4("gone#2", 1), "gone#2", None),
    ],
)
def test_a_false_alarm_of_version_4_names_its_recording_as_a_contact_does(tmp_path, old, recording, operation):
    values = json.loads(to_json(old))
    del values["false_alarms"][0]["operation"]
    path = tmp_path / "results.json"
    path.write_text(json.dumps({**values, "schema_version": 4}), encoding="utf-8")
    read = read_results(path)
    alarm = replace(old.false_alarms[0], recording=recording, operation=operation)
    assert (read.schema_version, read.false_alarms) == (SCHEMA_VERSION, (alarm,))


def test_another_version_is_named_with_a_hint(tmp_path):
    path = tmp_path / "results.json"
    path.write_text(to_json(RESULTS).replace(f'"schema_version": {SCHEMA_VERSION}', '"schema_version": 99'))
    with pytest.raises(RecordingError, match=r"schema_version is 99; this version of cdtool reads 4 and 5") as fault:
        read_results(path)
    assert "benchmark" in fault.value.hint


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            '"latency_ms": 10.0',
            '"latency_ms": "10"',
            r"results\.contacts\[0\]\.latency_ms: expected a number or null, got a text$",
        ),
        ('"contact": 1', '"contact": true', r"contacts\[0\]\.contact: expected a whole number, got true or false$"),
        ('"onset_s": 5.0,', "", r"results\.contacts\[0\]: object missing required field `onset_s`$"),
        (
            '"detector": "momentum"',
            '"detector": "m"',
            r"contacts\[0\]\.detector is 'm', which .*detectors does not",
        ),
        ('"group": "stiff"', '"group": "stif"', r"contacts\[0\]\.group is 'stif', which .*groups does not list$"),
    ],
)
def test_a_wrong_field_is_named(tmp_path, old, new, words):
    path = tmp_path / "results.json"
    text = to_json(FULL)
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(RecordingError) as fault:
        read_results(path)
    assert re.search(words, fault.value.message)
