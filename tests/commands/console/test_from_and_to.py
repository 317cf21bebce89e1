"""A part of a log: the keys from and to of detect and learn-signature."""

import json

import pytest

from tests.command import cdtool, one_line


@pytest.fixture
def log(gate_folder):
    return gate_folder / "stiff" / "01.csv"


@pytest.fixture
def machine(gate_folder):
    return gate_folder / "machine.toml"


def detected(log, machine, *arguments):
    done = cdtool("detect", log, "-m", machine, "-d", "gm", "--set=threshold.limits=400", "--json", *arguments)
    (row,) = json.loads(done.out)
    return row


def test_detect_uses_only_the_part(log, machine):
    whole = detected(log, machine)
    (alarm,) = whole["alarms"][:1]
    part = detected(log, machine, "--set=from=1s", f"--set=to={alarm['time_s'] + 0.3:.3f}s")
    assert part["alarms"][0]["time_s"] == pytest.approx(alarm["time_s"], abs=0.002)
    before = detected(log, machine, f"--set=to={1000 * alarm['time_s'] - 400:.0f} ms")
    assert before["verdict"] == "no alarm" and not before["alarms"]


@pytest.mark.parametrize(
    ("marks", "words"),
    [
        ({"from": "3s", "to": "2s"}, "the end, 2 s, is not after the begin, 3 s"),
        ({"to": "2"}, "give a number with its unit"),
        ({"from": "99s"}, "no sample from 99 s"),
        ({"to": "1rad"}, "1 rad of travel"),
    ],
)
def test_a_wrong_part_is_one_line(log, machine, marks, words):
    by_key = [f"--set={name}={mark}" for name, mark in marks.items()]
    done = cdtool("detect", log, "-d", "gm", "--set=threshold.limits=400", *by_key, "-m", machine)
    assert done.status == 2 and words in one_line(done.err) and "Traceback" not in done.err


def test_a_signature_is_learned_from_what_is_before_the_contacts(gate_folder, machine, tmp_path):
    logs = [*sorted((gate_folder / "free").glob("*.csv")), gate_folder / "stiff" / "01.csv"]
    plain = cdtool("learn-signature", *logs, "-m", machine, "-d", "gm", "-o", tmp_path / "a.json", "--json")
    assert plain.status == 3 and "set learn.until" in one_line(plain.err)
    part = ("--json", "--set=learn.until=onset")
    guarded = cdtool("learn-signature", *logs, "-m", machine, "-d", "gm", "-o", tmp_path / "b.json", *part)
    assert guarded.status == 0, guarded.err
    runs = [json.loads(done.out)["classes"][0]["runs"] for done in (plain, guarded)]
    assert runs[1] == runs[0] + 1
