"""Real machines: the EMPS ball-screw axis and the UR10e arm."""

from __future__ import annotations

import gzip
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import detect_operation
from cdtool.commands.learning.fitting import fit_operations
from cdtool.formats.machine_file import read_machine_file
from cdtool.recordings.operations import operations_of
from cdtool.thresholds.signature import Signature
from tests.command import FEW
from tests.command import cdtool as run
from tests.data_folder import DATA, UR10E_LOGS, needs_data

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
CONTACTS = ((3.46, 4.14), (9.67, 9.96), (16.63, 17.08))


@pytest.fixture(scope="module")
def emps():
    machine_file = read_machine_file(EXAMPLES / "emps.toml")
    return machine_file, cdtool.read(DATA / "emps" / "DATA_EMPS.mat", machine_file)


@needs_data("emps/DATA_EMPS.mat")
def test_the_emps_log_is_cut_into_eight_strokes_of_two_classes(emps):
    _, recording = emps
    strokes = operations_of(recording, "motion")
    assert [stroke.motion.direction for stroke in strokes] == [1, -1] * 4
    assert [stroke.motion.nominal_speed for stroke in strokes] == pytest.approx([0.1247] * 8, rel=0.01)
    assert any("derived causally from position" in str(item) for item in recording.findings)


@needs_data("emps/DATA_EMPS.mat")
@pytest.mark.parametrize("name", ["momentum", "pure_torque"])
def test_each_emps_stroke_raises_no_alarm_with_a_signature_of_the_others(emps, name):
    machine_file, recording = emps
    strokes = operations_of(recording, "motion")
    detector = machine_file.detector(name)
    for stroke in strokes:
        others = [other for other in strokes if other is not stroke]
        fitted = fit_operations(others, machine_file.machine, detector, Signature(force=True))
        assert len(fitted.thresholds) == 2 and not fitted.skipped
        detection = detect_operation(stroke, machine_file.machine, detector, fitted.thresholds, Activation())
        assert detection.verdict.outcome == "no alarm", stroke.name
        assert detection.statistic.valid.mean() > 0.8


@needs_data("emps/DATA_EMPS.mat")
def test_an_added_force_on_an_emps_stroke_is_found(emps):
    """The counterpart of the test without alarms: an unmodelled force of 60 N must raise an alarm."""
    machine_file, recording = emps
    strokes = operations_of(recording, "motion")
    detector = machine_file.detector("momentum")
    fitted = fit_operations(strokes[1:], machine_file.machine, detector, Signature(force=True)).thresholds
    torque = strokes[0].recording["torque"]
    pushed = replace(torque, values=torque.values + 60.0 * (torque.time > 1.2)[:, np.newaxis])
    channels = {**strokes[0].recording.channels, "torque": pushed}
    hit = replace(strokes[0], recording=replace(strokes[0].recording, channels=channels), log=None, cut="whole")
    detection = detect_operation(hit, machine_file.machine, detector, fitted, Activation())
    assert 1.2 < detection.verdict.alarms[0].time < 1.3


@needs_data("emps/DATA_EMPS.mat")
def test_four_strokes_per_direction_require_force(tmp_path):
    arguments = ("learn-signature", DATA / "emps" / "DATA_EMPS.mat", "-m", EXAMPLES / "emps.toml", "-d", "gm")
    done = run(*arguments, "--set=operations=motion", "-o", tmp_path / "s.json")
    assert done.status == 2 and "6 more are needed" in done.err
    done = run(*arguments, "--set=operations=motion", FEW, "-o", tmp_path / "s.json")
    assert done.status == 0 and done.err.count("fewer than 10") == 2


def test_the_contacts_of_the_arm_are_found_in_the_torques_of_two_joints():
    log = UR10E_LOGS / "link4.csv.gz"
    keys = ("--set=threshold.limits=33,inf,53,inf,inf,inf", "--set=activation.debounce=2")
    arguments = ("-m", EXAMPLES / "ur10e.toml", "-d", "pt", *keys)
    (values,) = json.loads(run("detect", log, *arguments, "--json").out)
    first_row = float(gzip.decompress(log.read_bytes()).split(b",", 1)[0])
    alarms = [(alarm["time_s"] - first_row, alarm["joint"]) for alarm in values["alarms"]]
    for start, end in CONTACTS:
        assert any(start - 0.02 <= time <= end for time, _ in alarms), (start, alarms)
    assert {joint for _, joint in alarms} == {"shoulder_pan", "elbow"}
    outside = [time for time, _ in alarms if not any(start - 0.02 <= time <= end for start, end in CONTACTS)]
    assert outside == pytest.approx([4.208], abs=0.02)


@needs_data("ur_collisions/onsets.csv")
@pytest.mark.parametrize("stated", [True, False], ids=["uncertainty stated", "uncertainty not stated"])
def test_all_collisions_of_a_jittering_arm_are_found_with_three_edits_of_a_draft(tmp_path, stated):
    """Labels between two samples: an alarm of the sample just before one is that of its contact.

    The labels are there before the draft, which keeps them; the other edits are those that it names.
    """
    folder = DATA / "ur_collisions"
    rows = (folder / "onsets.csv").read_text(encoding="utf-8").splitlines()
    kept = rows if stated else [row.rpartition(",")[0] for row in rows]
    (tmp_path / "labels.csv").write_text("\n".join(kept) + "\n", encoding="utf-8")
    cdtool.init_study(sorted(folder.glob("Drift*.csv")), tmp_path)
    file = tmp_path / "benchmark.toml"
    edited = file.read_text(encoding="utf-8").replace('# operations = "motion"', 'operations = "motion"')
    edited = edited.replace('# from = "0.5s"', 'from = "0.5s"').replace(
        "[impacts.Drift]", '[impacts.Drift]\nfrom = "0.5s"'
    )
    file.write_text(edited, encoding="utf-8")
    result = cdtool.benchmark(file)
    assert list(result.contacts.outcome) == ["detected"] * 16 and len(result.false_alarms) == 0
    assert sum(contact.clipped for contact in result.results.contacts) == 3
    assert not [item for item in result.results.findings if item.is_loss]  # no peak of a contact is a spike
