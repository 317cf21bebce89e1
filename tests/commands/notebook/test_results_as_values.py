"""Results as a notebook handles them: found by name, compared, copied, pickled; typos are answered."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest

import cdtool
from cdtool.base.notebook.same_values import same_values
from cdtool.recordings.recording import Series
from tests.commands.notebook.values import GATE, LOG, MACHINE

LOGS = [LOG, GATE / "stiff" / "04.csv", GATE / "holdout" / "03.csv"]


@pytest.fixture(scope="module")
def found():
    return cdtool.detect(LOGS, MACHINE, detector="gm", limit=[400.0])


@pytest.mark.parametrize("name", ["04.csv", "stiff/04.csv", LOGS[1], str(LOGS[1]), 1, -2])
def test_a_log_is_found_by_its_name_the_end_of_its_path_or_its_number(found, name):
    assert found[name] is found.runs[1]
    assert isinstance(name, int) or name in found


def test_a_name_that_two_logs_have_is_refused_with_both(found):
    with pytest.raises(KeyError) as caught:
        found["03.csv"]
    assert str(caught.value) == (
        "2 logs are named '03.csv' (give more of the path or the number: stiff/03.csv [0], holdout/03.csv [2])"
    )
    assert "03.csv" in found and "05.csv" not in found


def test_an_unknown_name_is_answered_with_the_nearest(found):
    with pytest.raises(
        KeyError, match=r"no log '05\.csv' in these results \(did you mean 0[34]\.csv or 0[34]\.csv\?\)"
    ):
        found["05.csv"]
    with pytest.raises(KeyError, match=r"known: 03\.csv, 04\.csv"):
        found["morning.mcap"]


def test_results_and_recordings_are_equal_after_pickling_and_copying(found):
    recording = cdtool.read(LOG, MACHINE)
    for value in (found, found[0], recording, recording["speed"], found[0].detections[0].statistic):
        assert pickle.loads(pickle.dumps(value)) == value == copy.deepcopy(value)
    assert found[0] != found[1] and found != found[:2] and recording != "recording"
    assert found == cdtool.detect(LOGS, MACHINE, detector="gm", limit=[400.0])


def test_a_check_and_an_identification_are_compared_by_their_contents(tmp_path):
    free = sorted((GATE / "free").iterdir())
    cdtool.learn_signature(free, MACHINE, "gm").save(tmp_path / "gm.json")
    values = (
        cdtool.check_signature(tmp_path / "gm.json", free, MACHINE),
        cdtool.identify(free, MACHINE, tmp_path / "identified.toml"),
    )
    for value in values:
        assert pickle.loads(pickle.dumps(value)) == value == copy.deepcopy(value)
    assert values[0] != replace(values[0], skipped=("one",))


def test_a_log_that_was_left_out_is_answered_with_the_reason(tmp_path):
    broken = tmp_path / "broken.csv"
    broken.write_text("a,b\n", encoding="utf-8")
    found = cdtool.detect([LOG, broken], MACHINE, detector="gm", limit=[400.0])
    with pytest.raises(KeyError, match=r"no log 'broken\.csv' in these results \(it was left out: .*broken\.csv"):
        found["broken.csv"]
    assert "broken.csv" not in found and found.skipped.recording.tolist() == [str(broken)]


def test_a_name_in_results_without_a_log_is_answered_in_words(found):
    with pytest.raises(KeyError, match=r"no log '03\.csv' in these results \(they are empty\)"):
        found[:0]["03.csv"]


def test_one_changed_sample_makes_two_channels_different():
    series = Series(np.arange(3.0), np.array([[1.0], [np.nan], [2.0]]), "m")
    assert series == Series(series.time.copy(), series.values.copy(), "m")
    assert series != replace(series, values=series.values + 1e-9)
    assert series != replace(series, unit="mm")


@pytest.mark.parametrize(
    ("first", "second", "same"),
    [
        (float("nan"), float("nan"), True),
        (np.float32("nan"), np.float32("nan"), True),
        (complex("nan"), complex("nan"), True),
        (float("nan"), 1.0, False),
        ([1, 2], (1, 2), False),
        ({"a": [1]}, {"a": [1]}, True),
        ({"a": 1}, {"b": 1}, False),
        (np.zeros(2), [0.0, 0.0], False),
        (np.zeros(2), np.zeros(2, dtype=int), False),
        ("ab", "ab", True),
    ],
)
def test_values_are_the_same_if_kind_and_content_are(first, second, same):
    assert same_values(first, second) is same


def test_a_benchmark_is_equal_to_its_repetition_whatever_time_it_took():
    first, second = (cdtool.benchmark(GATE / "benchmark.toml", detectors=["momentum"]) for _ in range(2))
    assert first == second == pickle.loads(pickle.dumps(first))
    with pytest.raises(AttributeError, match=r"no attribute 'contact' \(did you mean contacts\?\)"):
        first.contact  # noqa: B018
    with pytest.raises(AttributeError, match="did you mean latency"):
        first.plot.latencies  # noqa: B018


def test_typos_in_attributes_and_options_are_answered_with_the_nearest(found):
    with pytest.raises(AttributeError, match=r"DetectionResult has no attribute 'alarm' \(did you mean alarms\?\)"):
        found[0].alarm  # noqa: B018
    with pytest.raises(AttributeError, match=r"known: alarms, contacts"):
        found[0].xyz  # noqa: B018
    with pytest.raises(AttributeError, match="did you mean read"):
        cdtool.reed  # noqa: B018
    with pytest.raises(TypeError, match=r"no parameter 'detektor' \(did you mean detector"):
        cdtool.detect(LOG, MACHINE, detektor="gm")
    with pytest.raises(AttributeError, match=r"use recording\['speed'\]"):
        found[0].recording.speed  # noqa: B018


def test_an_error_inside_a_property_is_not_reported_as_a_typo(found, monkeypatch):
    def fails(runs):
        raise AttributeError("inside")

    monkeypatch.setattr("cdtool.commands.detect.result.alarms_frame", fails)
    with pytest.raises(AttributeError, match="inside"):
        copy.copy(found[1]).alarms  # noqa: B018


def test_reading_without_a_machine_file_says_what_to_pass_and_how_to_get_one():
    with pytest.raises(cdtool.CdtoolError) as caught:
        cdtool.read(LOG)
    assert "cdtool.read('03.csv') needs a machine file" in caught.value.message
    assert (
        caught.value.hint == "cdtool.read('03.csv', 'machine.toml'); cdtool.init('03.csv', 'machine.toml') drafts one"
    )


def test_an_unknown_detector_is_answered_with_the_nearest_and_where_the_list_is():
    with pytest.raises(cdtool.CdtoolError) as caught:
        cdtool.detect(LOG, MACHINE, detector="momentun", limit=[400.0])
    assert caught.value.hint == "did you mean momentum or kalman_momentum? cdtool list detectors shows all"
    with pytest.raises(cdtool.CdtoolError) as caught:
        cdtool.detect(LOG, MACHINE, detector="xyz", limit=[400.0])
    assert caught.value.hint == "cdtool list detectors shows all"
