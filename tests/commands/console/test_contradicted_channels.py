"""A channel that the mechanics of the machine contradict: every command says so, and no detector judges by it."""

from __future__ import annotations

import json

import pytest

from tests.command import cdtool

SAID = "torque: gives power to the machine where friction takes it"


@pytest.fixture(scope="module")
def reversed_torque(gate_folder):
    """Return a machine file whose torque has the wrong sign, beside the right one."""
    text = (gate_folder / "machine.toml").read_text(encoding="utf-8")
    path = gate_folder / "reversed.toml"
    path.write_text(text.replace("scale = 0.56 }  # scale", "scale = -0.56 }  # scale"), encoding="utf-8")
    return path


def test_every_command_says_it_and_none_judges_by_it(gate_folder, reversed_torque, tmp_path):
    free, hit = sorted((gate_folder / "free").glob("*.csv")), gate_folder / "stiff" / "01.csv"
    machine = ("-m", reversed_torque)
    info = cdtool("info", hit, *machine)
    assert info.status == 3 and f"loss: {SAID}" in info.out and "confirmed = true under torque" in info.out
    learned = cdtool("learn-signature", *free, *machine, "-d", "gm", "-o", tmp_path / "gm.json")
    assert learned.status == 3 and f"loss: reversed.toml: {SAID}" in learned.err
    right = ("-m", gate_folder / "machine.toml", "-d", "gm", "-o", tmp_path / "right.json")
    assert cdtool("learn-signature", *free, *right).status == 0
    signatures = [("--signature", tmp_path / name) for name in ("gm.json", "right.json")]
    for options in (*signatures, ("-d", "pt", "--set=threshold.limits=900")):
        done = cdtool("detect", hit, *machine, *options, "--json")
        (values,) = json.loads(done.out)
        assert done.status == 3 and SAID in done.err
        assert values["alarms"] == [] and values["verdict"] == "not_assessable"
    identified = cdtool("identify", *free, *machine, "-o", tmp_path / "machine.toml")
    assert identified.status == 2 and SAID in identified.err and not (tmp_path / "machine.toml").exists()


def test_a_benchmark_of_it_meets_no_limit_until_the_machine_file_confirms_it(gate_folder, reversed_torque, tmp_path):
    text = (gate_folder / "benchmark.toml").read_text(encoding="utf-8")
    assert 'machine = "machine.toml"' in text
    file = gate_folder / "reversed_benchmark.toml"
    file.write_text(text.replace('machine = "machine.toml"', 'machine = "reversed.toml"'), encoding="utf-8")
    done = cdtool("benchmark", file, "--json")
    values = json.loads(done.out)
    by_torque = [item for item in values["contacts"] if item["detector"] == "pure_torque"]
    assert by_torque and {item["outcome"] for item in by_torque} == {"not_assessable"}
    assert SAID in done.err and done.status in (1, 3)
    wrong = reversed_torque.read_text(encoding="utf-8")
    reversed_torque.write_text(wrong.replace("scale = -0.56 }  # scale", "scale = -0.56, confirmed = true }  # scale"))
    done = cdtool("benchmark", file, "--json")
    outcomes = {item["outcome"] for item in json.loads(done.out)["contacts"] if item["detector"] == "pure_torque"}
    assert SAID not in done.err and "not_assessable" not in outcomes
