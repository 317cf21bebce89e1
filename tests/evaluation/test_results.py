"""Results and the statistics that are derived from them."""

from __future__ import annotations

import json
import math

import pytest

from cdtool.errors import RecordingError
from cdtool.evaluation.results import (
    ContactResult,
    ExposureResult,
    FalseAlarmResult,
    Results,
    Skipped,
    read_results,
)
from cdtool.evaluation.statistics import summarise


def contact(latency: float | None, outcome: str = "detected", detector: str = "momentum") -> ContactResult:
    alarm = None if latency is None else 5.0 + 1e-3 * latency
    return ContactResult("a.csv", "stiff", detector, "gate", 5.0, 0.001, alarm, latency, outcome, 100.0, math.nan)


RESULTS = Results(
    provenance={"tool": "cdtool", "gain": math.inf},
    detectors=("momentum", "pure_torque"),
    groups=("stiff", "holdout"),
    contacts=(
        contact(10.0),
        contact(20.0),
        contact(60.0),
        contact(None, "missed"),
        contact(None, "not_assessable"),
        contact(None, "missed", "pure_torque"),
    ),
    false_alarms=(FalseAlarmResult("b.csv", "holdout", "momentum", "gate", 1.0),),
    exposure=(ExposureResult("stiff", "momentum", 5, 5, 0.01), ExposureResult("holdout", "momentum", 7, 9, 0.5)),
    skipped=(Skipped("c.csv", "empty"),),
)


def test_a_summary_counts_what_its_mean_leaves_out():
    momentum, torque, holdout, _ = summarise(RESULTS)
    assert (momentum.mean_ms, momentum.median_ms, momentum.std_ms) == pytest.approx((30.0, 20.0, 26.4575), rel=1e-5)
    assert (momentum.contacts, momentum.detected, momentum.missed, momentum.not_assessable) == (5, 3, 1, 1)
    assert math.isnan(torque.mean_ms) and torque.missed == 1
    assert (holdout.false_alarms, holdout.operations, holdout.hours) == (1, 9, 0.5)


def test_the_json_is_strict_and_has_null_where_there_is_no_figure():
    values = json.loads(RESULTS.to_json(), parse_constant=lambda name: pytest.fail(name))
    assert values["contacts"][0]["peak_force_n"] is None and values["contacts"][3]["latency_ms"] is None
    assert values["provenance"]["gain"] is None and values["schema_version"] == 1


def test_results_survive_writing_and_reading(tmp_path):
    path = tmp_path / "results.json"
    path.write_text(RESULTS.to_json())
    again = read_results(path)
    assert again.to_json() == RESULTS.to_json() and again.detectors == RESULTS.detectors


@pytest.mark.parametrize("content", ["", "{}", '{"schema_version": 2}', "[]", '{"schema_version": 1}'])
def test_what_is_no_results_file_is_one_clear_error(tmp_path, content):
    path = tmp_path / "results.json"
    path.write_text(content)
    with pytest.raises(RecordingError, match=r"results\.json"):
        read_results(path)
