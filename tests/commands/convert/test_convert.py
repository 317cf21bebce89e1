"""`cdtool convert` from a user's view."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.command import cdtool

LOGS = Path(__file__).parents[3] / "sample_logs"


def test_a_converted_log_is_read_with_its_new_machine_file(tmp_path):
    machine = LOGS / "gate/machine.toml"
    out = tmp_path / "run.mcap"
    done = cdtool("convert", LOGS / "gate/stiff/03.csv", out, "-m", machine)
    assert done.status == 0 and "7 columns on 1 clock" in done.out
    arguments = ("-d", "gm", "--set=threshold.limits=400", "--json")
    before = cdtool("detect", LOGS / "gate/stiff/03.csv", "-m", machine, *arguments)
    after = cdtool("detect", out, "-m", f"{out}.machine.toml", *arguments)
    assert before.status == after.status == 0
    alarms = [json.loads(text.out)[0]["alarms"] for text in (before, after)]
    assert alarms[0] and [item["time_s"] for item in alarms[0]] == pytest.approx([item["time_s"] for item in alarms[1]])


def test_a_truncated_log_is_converted_up_to_the_cut_with_status_3(tmp_path):
    data = (LOGS / "gate/stiff/01.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) * 2 // 3])
    done = cdtool("convert", tmp_path / "cut.mcap", tmp_path / "out.mcap", "-m", LOGS / "gate/machine.toml")
    assert done.status == 3 and "loss:" in done.err and (tmp_path / "out.mcap").exists()


def test_wrong_use_is_one_line(tmp_path):
    log = LOGS / "gate/stiff/03.csv"
    for arguments, text in (
        ((log, tmp_path / "out.xlsx"), "cannot be written"),
        ((log, tmp_path / "no" / "out.csv"), "no folder"),
        ((tmp_path / "no.csv", tmp_path / "out.csv"), "no such file"),
    ):
        done = cdtool("convert", *arguments)
        assert done.status == 2 and text in done.err and done.err.count("\n") == 1
