"""Findings on a log are the same in every command, and reported once."""

from __future__ import annotations

import json

import pytest

from tests.command import cdtool
from tests.commands.console.changed_logs import damaged


@pytest.mark.parametrize(("value", "what"), [("1e306", "outside the possible range"), ("inf", "infinite")])
def test_a_masked_value_is_counted_once(gate_folder, tmp_path, value, what):
    cells = {("i_motor", 700): value, ("i_motor", 701): "nan"}
    log = damaged(gate_folder / "stiff" / "01.csv", tmp_path / "damaged.csv", cells)
    done = cdtool("info", log, "-m", gate_folder / "machine.toml")
    assert f"torque: 1 value is {what}, masked" in done.out
    assert "torque: 1 of 7200 values is missing (NaN)" in done.out
    done = cdtool(
        "info", damaged(log, tmp_path / "one.csv", {("i_motor", 701): "0.5"}), "-m", gate_folder / "machine.toml"
    )
    assert f"torque: 1 value is {what}, masked" in done.out and "missing (NaN)" not in done.out


def _of(text: str, word: str) -> set[str]:
    """The lines about one log that begin with a word, without the log's name."""
    lines = (line for line in text.splitlines() if line.startswith(f"{word}: "))
    return {line.removeprefix(f"{word}: ").partition(".csv: ")[2] or line.removeprefix(f"{word}: ") for line in lines}


def test_info_detect_explain_and_learning_report_the_same_findings(gate_folder, tmp_path, feekf_signature):
    cells = {("i_motor", row): "nan" for row in range(500, 560)}
    cells |= {("t", row): "399" for row in range(400, 403)}
    cells |= {("i_motor", 700): "1e306"}
    cells |= {("acc_x", row): "-9" for row in range(7200)}
    log = damaged(gate_folder / "stiff" / "01.csv", tmp_path / "damaged.csv", cells, range(1500, 1600))
    machine = ("-m", gate_folder / "machine.toml")
    info = cdtool("info", log, *machine)
    lost, warned = _of(info.out, "loss"), _of(info.out, "warning")
    assert lost == {"torque: 1 value is outside the possible range, masked"}
    assert "acceleration: the value never changes while the machine moves: stuck?" in warned
    assert {words.split(":")[0] for words in warned} >= {"time", "torque", "acceleration"}
    for command in ("detect", "explain"):
        done = cdtool(command, log, *machine, "--signature", feekf_signature)
        assert (_of(done.err, "loss"), _of(done.err, "warning")) == (lost, warned), command
        first = [line.partition(":")[0] for line in done.err.splitlines()]
        assert first.index("loss") < first.index("warning")


@pytest.mark.parametrize("units", ["m_per_s", "none"])
def test_a_wrong_unit_is_reported_by_every_command_that_reads_the_log(gate_folder, tmp_path, units):
    text = (gate_folder / "machine.toml").read_text(encoding="utf-8")
    machine = tmp_path / "machine.toml"
    wrong = text.replace('column = "n_motor", unit = "rpm"', 'column = "n_motor", unit = "rad/s"')
    machine.write_text(wrong if units == "m_per_s" else text, encoding="utf-8")
    log, free = gate_folder / "stiff" / "01.csv", sorted((gate_folder / "free").glob("*.csv"))
    words = "times the derivative of the position (a factor as between rpm and rad/s)"
    info = _of(cdtool("info", log, "-m", machine).out, "loss")
    assert any(words in text for text in info) == (units == "m_per_s")
    detect = cdtool("detect", log, "-m", machine, "-d", "gm", "--set=threshold.limits=400")
    assert _of(detect.err, "loss") == info and detect.status == (3 if info else 0)
    learned = cdtool("learn-signature", *free, "-m", machine, "-d", "pt", "-o", tmp_path / "pt.json")
    assert (words in learned.err) == (units == "m_per_s") and learned.status == (3 if info else 0)


def test_info_names_a_contact_in_progress_that_detect_does_not_score(gate_folder, tmp_path):
    log = gate_folder / "stiff" / "01.csv"
    machine = ("-m", gate_folder / "machine.toml")
    rows = log.read_text(encoding="utf-8").splitlines()[1:]
    pressed = next(i for i, row in enumerate(rows) if float(row.split(",")[5]) > 0.5)
    begun = damaged(log, tmp_path / "begun.csv", without=range(pressed + 20))
    words = "a contact is in progress when it begins"
    assert words in cdtool("detect", begun, *machine, "-d", "gm", "--set=threshold.limits=400").err
    assert words in cdtool("info", begun, *machine).out


@pytest.mark.parametrize("rows", [1, 100, 3000])
def test_a_leap_of_the_clock_is_not_reported_as_wrong_units(gate_folder, tmp_path, rows):
    def leaps(row: int, stamp: float) -> float:
        return stamp + (100_000.0 if row >= 7200 - rows else 0.0)

    log = damaged(gate_folder / "stiff" / "01.csv", tmp_path / "damaged.csv", shifted=leaps)
    done = cdtool("info", log, "-m", gate_folder / "machine.toml")
    assert "warning: time: 1 gap after" in done.out and "not assessable: correct the unit" not in done.out


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
