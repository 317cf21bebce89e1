"""Order of findings in `info` and other commands, and findings on unusable clocks."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cdtool.base.findings import Finding
from cdtool.commands.console.console import print_skipped
from cdtool.commands.judging.information import info
from cdtool.formats.mcap.write import Stream, write_mcap
from cdtool.results.results import RecordingFinding
from tests.command import cdtool


def table(path, stamps):
    path.write_text("time,torque\n" + "".join(f"{stamp},{np.sin(i):.4f}\n" for i, stamp in enumerate(stamps)))
    return path


@pytest.mark.parametrize(
    ("stamps", "told"),
    [
        ([5] * 400, "time: named as a clock, but all of its 400 stamps are the same: the clock stands still"),
        ([i // 100 for i in range(4000)], "time: named as a clock, but 99 % of its stamps repeat: a coarse clock"),
        ([0.01 * (i // 2) for i in range(400)], "time: named as a clock, but 50.1 % of its stamps repeat"),
        (np.random.default_rng(1).permutation(400).tolist(), "time: named as a clock, but it runs backward at"),
    ],
    ids=["constant", "coarse", "half", "shuffled"],
)
def test_an_unusable_clock_is_reported(tmp_path, stamps, told):
    done = cdtool("info", table(tmp_path / "log.csv", stamps))
    assert f"warning: {told}" in done.out and "no warnings" not in done.out
    assert "no column looks like a clock: rates, gaps and times are unknown" in done.out


def test_a_table_without_a_clock_is_reported(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("torque,speed\n" + "".join(f"{np.sin(i):.4f},{np.cos(i):.4f}\n" for i in range(300)))
    assert "warning: no column looks like a clock" in cdtool("info", path).out


def test_topics_whose_stamps_repeat_are_reported(tmp_path):
    path, time = tmp_path / "log.mcap", np.repeat(np.arange(10.0), 30)
    write_mcap(path, [Stream("/drive", "sensor_msgs/msg/JointState", time, {"velocity[0]": time})], start_ns=10**9)
    assert any(item.kind == "coarse_stamps" for item in info(path).findings)


def test_a_valid_clock_causes_no_finding(tmp_path):
    shown = info(table(tmp_path / "log.csv", [f"{0.01 * i:.2f}" for i in range(400)]))
    assert {item.severity for item in shown.findings} == {"note"}


def test_losses_come_first(tmp_path):
    path = tmp_path / "log.csv"
    lines = ["t,a", *(f"{0.01 * i:.2f},{i % 7}.0" for i in range(500))]
    lines[300] = "2.99,#?"
    lines[400] = "0.5,1.0"
    path.write_text("\n".join(lines) + "\n")
    words = [item.severity for item in info(path).findings]
    assert words[0] == "loss" and words == sorted(words, key=("loss", "warning", "note").index)
    shown = [
        line.split(":")[0] for line in cdtool("info", path).out.splitlines() if line[:4] in ("loss", "warn", "note")
    ]
    assert shown == words


def test_many_warnings_do_not_hide_a_loss_on_screen(capsys):
    warnings = [
        RecordingFinding.of(f"free/{i:02d}.csv", Finding("jitter", "time", {"share": 0.01 * i, "period": 0.01}))
        for i in range(46)
    ]
    lost = Finding(
        "backward_stamps",
        "time",
        {"count": 3, "rows": 100, "first": (4, 5, 6), "row_name": "line", "restart": None},
        "loss",
    )
    print_skipped((), [*warnings, RecordingFinding.of("free/07.csv", lost)])
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2 and lines[0].startswith("loss: free/07.csv: time: 3")
    assert lines[1].endswith("; 45 more like it (free/01.csv, free/02.csv, free/03.csv, ...)")


def test_a_log_gives_the_same_findings_whatever_the_hashes_of_texts_are():
    gate = Path(__file__).parents[3] / "sample_logs" / "gate"
    command = [sys.executable, "-m", "cdtool", "info", gate / "free" / "09.csv", "-m", gate / "machine.toml"]
    said = {
        subprocess.run(command, env={**os.environ, "PYTHONHASHSEED": seed}, capture_output=True, check=True).stdout
        for seed in "123"
    }
    assert len(said) == 1 and b"latency against the position not assessable in 6 events" in said.pop()
