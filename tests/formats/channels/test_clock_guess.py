"""`cdtool info` without a machine file: the guess of the clock column and its unit."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.commands.judging.information import info
from cdtool.recordings.units import DAY_S


@pytest.mark.parametrize("rate_hz", [1.0, 10.0, 1000.0])
def test_excel_days_are_distinguished_from_seconds_at_any_rate(tmp_path, rate_hz):
    days = 45231.5 + np.arange(2000) / rate_hz / DAY_S
    path = tmp_path / "log.csv"
    path.write_text("time,torque\n" + "".join(f"{day:.12f},{i % 7}\n" for i, day in enumerate(days)))
    shown = info(path)
    assert any(finding.numbers.get("evidence", "") == "excel" for finding in shown.findings)
    assert [channel.rate_hz for channel in shown.channels] == [pytest.approx(rate_hz, rel=1e-3)] * 2


@pytest.mark.parametrize(("name", "is_one"), [("time", True), ("travel", False)])
def test_uneven_steps_are_those_of_a_clock_only_if_its_name_says_so(tmp_path, name, is_one):
    steps = np.random.default_rng(1).choice([0.005, 0.016, 0.031, 0.047], 2000)
    path = tmp_path / "log.csv"
    path.write_text(f"{name},torque\n" + "".join(f"{time:.3f},{i % 7}\n" for i, time in enumerate(np.cumsum(steps))))
    assert any(finding.numbers.get("evidence", "") == "steps" for finding in info(path).findings) is is_one


@pytest.mark.parametrize(
    ("first", "evidence"),
    [("23:59:5", "digits"), ("12:00:0", "digits"), ("08:30:0", "steps")],
    ids=["near midnight", "noon", "fewer seconds than a day has"],
)
def test_times_of_day_without_colons_are_said(tmp_path, first, evidence):
    start = first.replace(":", "")
    path = tmp_path / "log.csv"
    path.write_text("Time,torque\n" + "".join(f"{start}{i / 100:.2f},{i % 7}\n" for i in range(900)))
    assert [finding.numbers["evidence"] for finding in info(path).findings if finding.kind == "assumed_clock"] == [
        evidence
    ]


def test_seconds_of_more_than_a_day_are_no_times_of_day(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("Time,torque\n" + "".join(f"{120000 + i / 10:.1f},{i % 7}\n" for i in range(900)))
    assert [finding.numbers["evidence"] for finding in info(path).findings if finding.kind == "assumed_clock"] == [
        "steps"
    ]
