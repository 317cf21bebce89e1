"""The signature file: round trip, refusals, atomic writes, concurrent updates."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from cdtool.alarms.activation import Activation
from cdtool.base.errors import SignatureError
from cdtool.detectors.momentum import Momentum
from cdtool.formats.machine_file import fingerprint, machine_parameters
from cdtool.formats.signature_file import FactorOrigin, LearnedRun, SignatureFile
from cdtool.formats.signature_store import read_signature, rewrite_signature, write_signature
from cdtool.thresholds.normal_motion import learn_normal_motion
from cdtool.thresholds.signature import Signature

DETECTOR = Momentum(10.0)
RULE = Signature(position_step=0.02, position_window=0.1)


@pytest.fixture(scope="module")
def learned(gate, simulated) -> SignatureFile:
    recordings = [simulated("none", seed) for seed in range(10, 22)]
    fitted = RULE.fit([(item, DETECTOR.signal(item, gate)) for item in recordings])
    runs = tuple(LearnedRun(item.name, item.digest) for item in recordings)
    return SignatureFile(
        machine="gate",
        machine_fingerprint=fingerprint(gate),
        detector="momentum",
        gains={"bandwidth": DETECTOR.bandwidth},
        unit="N",
        joints=fitted.joints,
        rule=RULE,
        origin=FactorOrigin(),
        activation=Activation(5, 0.3, 0.2, True),
        current=(fitted,),
        first=(fitted,),
        runs=runs,
    )


def test_on_another_machine_the_parameters_that_differ_are_named(tmp_path, learned, gate):
    path = tmp_path / "s.json"
    write_signature(path, replace(learned, machine_parameters=machine_parameters(gate)))
    loaded = read_signature(path)
    loaded.check(gate, DETECTOR)
    lighter = replace(gate, load_inertia=(500.0,))
    with pytest.raises(SignatureError) as raised:
        loaded.check(lighter, DETECTOR)
    was = f"load_mass was {gate.load_inertia[0]:g}, is 500"
    assert raised.value.message == f"{path}: learned on another machine ({was})"
    with pytest.raises(SignatureError, match=f"{was}, name was 'axis', is 'door'"):
        loaded.check(replace(lighter, name="door"), DETECTOR)
    write_signature(path, learned)  # of an earlier version
    with pytest.raises(SignatureError, match="'gate', with other parameters than 'axis'"):
        read_signature(path).check(lighter, DETECTOR)


def test_what_normal_runs_look_like_is_stored_with_it(tmp_path, learned, simulated):
    recordings = [simulated("none", seed) for seed in range(10, 14)]
    normal = learn_normal_motion(recordings, learned.current[0].motion.without_course)
    assert normal is not None
    path = tmp_path / "s.json"
    write_signature(path, replace(learned, normal=(normal,)))
    (loaded,) = read_signature(path).normal or ()
    one, other = (item.compare(recordings[0], "torque") for item in (normal, loaded))
    assert (loaded.motion, loaded.runs, loaded.joints) == (normal.motion, 4, normal.joints)
    assert (one[1][3000], one[2][3000]) == (other[1][3000], other[2][3000])


@pytest.mark.parametrize("version", [3, 4])
def test_a_file_of_an_earlier_version_is_read_without_normal_motions(tmp_path, learned, version):
    path = tmp_path / "s.json"
    write_signature(path, learned)
    values = json.loads(path.read_text())
    # Version 4 had other ones.
    values["normal_motion"] = [{"direction": 1, "channels": {"torque": {"unit": "N", "samples": {}, "level": {}}}}]
    path.write_text(json.dumps({**values, "schema_version": version}))
    loaded = read_signature(path)
    assert loaded.normal is None and loaded.current[0].to_dict() == learned.current[0].to_dict()
    write_signature(path, loaded)  # an update: now version 5, still without normal motions
    assert json.loads(path.read_text())["schema_version"] == 5 and read_signature(path).normal is None


def test_another_machine_detector_or_gain_is_refused(learned, gate):
    learned.check(gate, DETECTOR)
    with pytest.raises(SignatureError, match=r"bandwidth = 10\.0, but the machine file has 12\.0"):
        learned.check(gate, Momentum(12.0))
    with pytest.raises(SignatureError, match="another machine"):
        learned.check(replace(gate, load_inertia=(621.0,)), DETECTOR)
    from cdtool.detectors.pure_torque import PureTorque

    with pytest.raises(SignatureError, match="learned with momentum"):
        learned.check(gate, PureTorque())


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "not a signature file"),
        ("[1, 2]", "not a signature file"),
        ('{"kind": "other"}', "not a signature file"),
        ('{"kind": "cdtool signature", "schema_version": 99}', "schema_version is 99"),
        ('{"kind": "cdtool signature", "schema_version": 3}', "damaged"),
        ("\x00\x01", "not a signature file"),
    ],
)
def test_a_file_that_is_not_a_signature_is_one_clear_error(tmp_path, content, message):
    path = tmp_path / "s.json"
    path.write_text(content)
    with pytest.raises(SignatureError, match=message):
        read_signature(path)


def test_a_missing_file_and_a_missing_folder_are_named(tmp_path, learned):
    with pytest.raises(SignatureError, match="no such file"):
        read_signature(tmp_path / "none.json")
    with pytest.raises(SignatureError, match="no folder"):
        write_signature(tmp_path / "no" / "s.json", learned)


WORKER = """
import sys
from dataclasses import replace
from cdtool.formats.signature_file import LearnedRun
from cdtool.formats.signature_store import rewrite_signature
for k in range(int(sys.argv[3])):
    run = LearnedRun(f"{sys.argv[2]}.{k}", "x")
    rewrite_signature(sys.argv[1], lambda file: replace(file, runs=(*file.runs, run)))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="links as POSIX has them")
def test_eight_processes_that_update_by_three_paths_one_of_them_a_link_lose_no_run(tmp_path, learned):
    """48 runs, six per process; without following the link, 20 of them were lost."""
    (tmp_path / "store").mkdir()
    path = tmp_path / "store" / "s.json"
    write_signature(path, learned)
    (tmp_path / "link.json").symlink_to("store/s.json")
    paths = (path, tmp_path / "link.json", tmp_path / "store" / ".." / "store" / "s.json")
    workers = [
        subprocess.Popen([sys.executable, "-c", WORKER, str(paths[k % 3]), str(k), "6"], cwd=Path(__file__).parents[2])
        for k in range(8)
    ]
    assert [worker.wait(300) for worker in workers] == [0] * 8
    added = {run.name for run in read_signature(path).runs[len(learned.runs) :]}
    assert added == {f"{worker}.{k}" for worker in range(8) for k in range(6)}
    assert (tmp_path / "link.json").is_symlink()
    assert {item.name for item in tmp_path.rglob("*")} == {"store", "s.json", "link.json"}


def _set(values, path, value):
    for key in path[:-1]:
        values = values[key]
    values[path[-1]] = value


CURVE = ("current", 0, "by_position")


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("detector", "gains"), None),
        (("threshold", "settings"), None),
        (("threshold", "rule"), ["a"]),
        (("current",), []),
        (("first",), []),
        (("joints",), ["a", "b"]),
        (("operations",), "sometimes"),
        (("safety_factor_set", "by"), "x"),
        (("activation", "debounce"), 2.5),
        (("activation", "debounce"), True),
        (("activation", "hysteresis"), 3.0),
        (("current", 0, "safety_factor"), -3.0),
        (("current", 0, "safety_factor"), float("nan")),
        (("current", 0, "nominal_speed"), 0.0),
        (("current", 0, "direction"), 7),
        ((*CURVE, "step"), 0),
        ((*CURVE, "count"), []),
        ((*CURVE, "count"), [[1.0], [2.0]]),
        ((*CURVE, "mean", 0), [float("nan")]),
        ((*CURVE, "squares", 0), [-1.0]),
    ],
    ids=lambda item: ".".join(map(str, item)) if isinstance(item, tuple) else None,
)
def test_a_wrong_value_in_the_file_is_one_clear_error(tmp_path, learned, path, value):
    file = tmp_path / "s.json"
    write_signature(file, learned)
    values = json.loads(file.read_text())
    _set(values, path, value)
    file.write_text(json.dumps(values))
    with pytest.raises(SignatureError, match=r"s\.json: "):
        read_signature(file)


def test_an_update_without_a_change_does_not_write_the_file(tmp_path, learned):
    path = tmp_path / "s.json"
    write_signature(path, learned)
    before = path.stat()
    rewrite_signature(path, lambda file: file)
    assert path.stat().st_ino == before.st_ino
