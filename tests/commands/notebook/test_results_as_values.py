"""Results as a notebook handles them: found by name, copied, pickled; typos are answered."""

from __future__ import annotations

import copy
import pickle

import pytest

import cdtool
from tests.commands.notebook.values import GATE, LOG, MACHINE

LOGS = [LOG, GATE / "stiff" / "04.csv", GATE / "holdout" / "03.csv"]


@pytest.fixture(scope="module")
def found():
    return cdtool.detect(LOGS, MACHINE, detector="gm", settings={"threshold.limits": 400.0})


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


def test_a_log_that_was_left_out_is_answered_with_the_reason(tmp_path):
    broken = tmp_path / "broken.csv"
    broken.write_text("a,b\n", encoding="utf-8")
    found = cdtool.detect([LOG, broken], MACHINE, detector="gm", settings={"threshold.limits": 400.0})
    with pytest.raises(KeyError, match=r"no log 'broken\.csv' in these results \(it was left out: .*broken\.csv"):
        found["broken.csv"]
    assert "broken.csv" not in found and found.skipped.recording.tolist() == [str(broken)]


def test_a_name_in_results_without_a_log_is_answered_in_words(found):
    with pytest.raises(KeyError, match=r"no log '03\.csv' in these results \(they are empty\)"):
        found[:0]["03.csv"]


def test_reading_without_a_machine_file_says_what_to_pass_and_how_to_get_one():
    with pytest.raises(cdtool.CdtoolError) as caught:
        cdtool.read(LOG)
    assert "cdtool.read('03.csv') needs a machine file" in caught.value.message
    assert (
        caught.value.hint == "cdtool.read('03.csv', 'machine.toml'); cdtool.init('03.csv', 'machine.toml') drafts one"
    )


def test_results_and_recordings_are_pickled_and_copied(found):
    recording = cdtool.read(LOG, MACHINE)
    for copied in (pickle.loads(pickle.dumps((found, recording))), copy.deepcopy((found, recording))):
        assert copied[0].summary().equals(found.summary()) and copied[0].contacts.equals(found.contacts)
        assert copied[1].to_frame().equals(recording.to_frame())


def test_typos_are_answered_by_python_with_the_nearest_name(found):
    """Python proposes names when it prints the error: the error must know the name and the object."""
    for value, typo in ((found[0], "alarm"), (cdtool, "reed")):
        with pytest.raises(AttributeError) as caught:
            getattr(value, typo)
        assert (caught.value.name, caught.value.obj) == (typo, value)
    with pytest.raises(TypeError, match="'detektor'"):
        cdtool.detect(LOG, MACHINE, detektor="gm")
    with pytest.raises(AttributeError, match=r"use recording\['speed'\]"):
        found[0].recording.speed  # noqa: B018
