"""`cdtool info` without a machine file: the guess of the clock column and its unit."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.formats.csv.number_clock import DAY_S
from cdtool.workflows.information import info


@pytest.mark.parametrize("rate_hz", [1.0, 10.0, 1000.0])
def test_excel_days_are_distinguished_from_seconds_at_any_rate(tmp_path, rate_hz):
    days = 45231.5 + np.arange(2000) / rate_hz / DAY_S
    path = tmp_path / "log.csv"
    path.write_text("time,torque\n" + "".join(f"{day:.12f},{i % 7}\n" for i, day in enumerate(days)))
    shown = info(path)
    assert any(getattr(finding.fact, "evidence", "") == "excel" for finding in shown.findings)
    assert [channel.rate_hz for channel in shown.channels] == [pytest.approx(rate_hz, rel=1e-3)] * 2
