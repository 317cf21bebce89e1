"""Results as a notebook handles them: copied, pickled; typos are answered."""

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


def test_a_log_is_found_by_its_number_and_one_that_was_left_out_is_listed(tmp_path):
    broken = tmp_path / "broken.csv"
    broken.write_text("a,b\n", encoding="utf-8")
    found = cdtool.detect([LOG, broken], MACHINE, detector="gm", settings={"threshold.limits": 400.0})
    assert len(found) == 1 and found[-1] is found.runs[0] and found[0] in found and len(found[1:]) == 0
    assert found.skipped.recording.tolist() == [str(broken)]


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
