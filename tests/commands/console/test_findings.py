"""Findings on a log are the same in every command, and reported once."""

from __future__ import annotations

import pytest

from tests.command import cdtool
from tests.commands.console.damaged_copies import damaged


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


def test_wrong_units_are_found_together_with_a_leap_of_the_clock(gate_folder, tmp_path):
    machine = tmp_path / "machine.toml"
    text = (gate_folder / "machine.toml").read_text(encoding="utf-8")
    machine.write_text(text.replace('"n_motor", unit = "rpm"', '"n_motor", unit = "rad/s"'), encoding="utf-8")
    log = gate_folder / "stiff" / "01.csv"
    leapt = damaged(log, tmp_path / "leapt.csv", shifted=lambda row, stamp: stamp + 5000.0 * (row > 4000))
    assert "as between rpm and rad/s" in cdtool("info", leapt, "-m", machine).out
