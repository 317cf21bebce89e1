"""The DataFrames of results: names, types, values, and all of it without any row."""

from __future__ import annotations

import copy
import dataclasses
import pickle

import numpy as np
import pandas as pd
import pytest

import cdtool
from cdtool.base.errors import UsageError
from cdtool.report.tables.results import results_table
from cdtool.results.evaluated import evaluate
from cdtool.results.results import Results, tables
from cdtool.results.summary import FIGURES
from tests.commands.notebook.values import FREE, GATE, LOG, MACHINE

EMPTY = cdtool.BenchmarkResult(
    evaluate(Results(provenance={}, detectors=("pt",), groups=("stiff",), contacts=(), false_alarms=(), exposure=()))
)


@pytest.fixture(scope="module")
def result():
    return cdtool.benchmark(GATE / "benchmark.toml", detectors=["momentum", "pure_torque"])


@pytest.fixture(scope="module")
def found():
    return cdtool.detect(LOG, MACHINE, detector="momentum", settings={"threshold.limits": 400.0})


def test_every_table_of_the_results_has_a_frame_with_its_fields_with_and_without_rows(result):
    for name, kind in tables().items():
        full, empty = result.frame(name), EMPTY.frame(name)
        assert full.columns.tolist() == empty.columns.tolist() == [item.name for item in dataclasses.fields(kind)]
        assert len(full) == len(getattr(result.results, name)) and len(empty) == 0
        assert [str(kind) for kind in full.dtypes] == [str(kind) for kind in empty.dtypes]
    assert set(result.contacts) < set(result.frame("contacts"))
    with pytest.raises(UsageError, match="no table 'contact'"):
        result.frame("contact")


def test_the_columns_are_typed_and_hold_the_values_of_the_rows(result):
    frame, rows = result.frame("contacts"), result.results.contacts
    kinds = {name: str(frame[name].dtype) for name in ("recording", "detector", "outcome", "latency_ms", "contact")}
    assert kinds == {
        "recording": "string", "detector": "category", "outcome": "category", "latency_ms": "float64",
        "contact": "int64",
    }  # fmt: skip
    assert frame.clipped.dtype == bool
    for name in ("recording", "detector", "latency_ms", "outcome", "side", "reason"):
        shown = [None if pd.isna(value) else value for value in frame[name]]
        assert shown == [getattr(row, name) for row in rows], name


def test_few_contacts_have_median_and_range_and_no_mean_as_in_the_reports(result):
    row = result.summary().loc[("stiff", "momentum")]
    assert row[["median_ms", "min_ms", "max_ms"]].notna().all() and row[["mean_ms", "p95_ms"]].isna().all()
    every = result.summary(every=True)
    assert set(FIGURES) <= set(every) and every.columns[: len(row)].tolist() == row.index.tolist()
    table, shown = results_table(result.evaluated.summaries), result._repr_html_()
    assert all(cell.line in shown for row in table.rows for cell in row)
    assert all(part.text in shown and all(line in shown for line in part.lines) for part in table.parts.values())


def test_a_recording_becomes_a_frame_with_the_names_of_convert(tmp_path):
    recording = cdtool.read(LOG, MACHINE)
    frame = recording.to_frame()
    cdtool.convert(LOG, tmp_path / "log.csv", machine=MACHINE)
    converted = pd.read_csv(tmp_path / "log.csv", comment="#")
    # The file has the columns of the log, on the drive's side; the frame the channels on the load side.
    names = [{column.partition(" [")[0] for column in columns} for columns in (converted.columns, frame.columns)]
    assert names[0] - {"time"} <= names[1]
    assert frame.index.name == "time_s" and len(frame) == len(recording["speed"])
    assert np.array_equal(frame["speed [m/s]"], recording["speed"].values[:, 0], equal_nan=True)
    assert recording.to_frame(["force"]).columns.tolist() == ["force [N]"]
    with pytest.raises(cdtool.CdtoolError, match="no channel 'forse'"):
        recording.to_frame(["forse"])


def test_channels_with_clocks_of_their_own_are_not_interpolated():
    speed = cdtool.Series(np.array([0.0, 0.2]), np.array([[1.0, 2.0], [3.0, 4.0]]), "rad/s")
    force = cdtool.Series(np.array([0.0, 0.1]), np.array([5.0, 6.0]), "N")
    frame = cdtool.Recording("two", "", ("arm", "forearm"), {"speed": speed, "force": force}).to_frame()
    assert frame.columns.tolist() == ["speed arm [rad/s]", "speed forearm [rad/s]", "force [N]"]
    assert frame.index.tolist() == [0.0, 0.1, 0.2]
    assert frame.isna().to_numpy().tolist() == [[False] * 3, [True, True, False], [False, False, True]]


def test_the_alarms_of_a_log_name_their_joint_and_contact(found):
    (alarm,) = found.detections[0].verdict.alarms
    assert alarm.joint == "gate" and found.alarms.joint.tolist() == ["gate"]
    assert found.alarms.time_s[0] == alarm.time
    assert found.alarms.contact_onset_s[0] == found.contacts.onset_s[0] == found.detected.contacts[0].start
    assert found.contacts.latency_ms[0] == pytest.approx(1e3 * (alarm.time - found.contacts.onset_s[0]))


def test_detect_takes_one_log_or_many_and_lists_what_cannot_be_read(tmp_path):
    learned = cdtool.learn_signature(FREE, MACHINE, "gm")
    broken = tmp_path / "broken.csv"
    broken.write_text("no log\n", encoding="utf-8")
    logs = [LOG, broken, GATE / "holdout" / "03.csv"]
    found = cdtool.detect(logs, MACHINE, signature=learned)
    assert [log.outcome for log in found] == ["alarm", "no alarm"]
    assert found.skipped.recording.tolist() == [str(broken)]
    one = cdtool.detect(LOG, MACHINE, signature=learned)
    pd.testing.assert_frame_equal(one.contacts, found[0].contacts)
    assert found.summary().verdict.tolist() == ["alarm", "no alarm"]
    assert found[:1].alarms.equals(one.alarms) and len(found.contacts) == 1
    with pytest.raises(cdtool.CdtoolError, match=r"none of 1 log can be used, the first: .*broken"):
        cdtool.detect([broken], MACHINE, signature=learned)
    with pytest.raises(cdtool.CdtoolError, match="unknown detector"):
        cdtool.detect(logs, MACHINE, detector="momentun", settings={"threshold.limits": 1.0})


def test_results_are_read_back_from_their_file(result, tmp_path):
    assert [path.name for path in result.save(tmp_path / "results.json")] == ["results.json"]
    again = cdtool.read_results(tmp_path / "results.json")
    pd.testing.assert_frame_equal(again.contacts, result.contacts)
    pd.testing.assert_frame_equal(again.summary(), result.summary())
    with pytest.raises(UsageError):
        result.save(GATE / "benchmark.toml", force=True)


LOGS = [LOG, GATE / "stiff" / "04.csv", GATE / "holdout" / "03.csv"]


@pytest.fixture(scope="module")
def many():
    return cdtool.detect(LOGS, MACHINE, detector="gm", settings={"threshold.limits": 400.0})


def test_results_and_recordings_are_pickled_and_copied(many):
    recording = cdtool.read(LOG, MACHINE)
    for copied in (pickle.loads(pickle.dumps((many, recording))), copy.deepcopy((many, recording))):
        assert copied[0].summary().equals(many.summary()) and copied[0].contacts.equals(many.contacts)
        assert copied[1].to_frame().equals(recording.to_frame())
