"""No explanation of a sample impact log names a departure before the contact."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from cdtool.commands.detecting.prepared import prepared
from cdtool.commands.explain.explaining import explain_log

LOGS = Path(__file__).parents[3] / "sample_logs"


@pytest.mark.parametrize(("folder", "detector"), [("gate", "feekf"), ("arm/trial_1", "igm"), ("arm/trial_2", "igm")])
def test_no_channel_departs_before_the_onset_of_a_contact(folder, detector):
    ready = prepared(None, benchmark=LOGS / folder / "benchmark.toml", detector=detector)
    early, events = [], 0
    for log in sorted(path for group in ("stiff", "soft") for path in (LOGS / folder / group).iterdir()):
        for _, item in explain_log(log, ready).events:
            assert item.contact is not None
            events += 1
            earliest = item.contact.start - item.contact.uncertainty - 5e-3
            moved = [each for each in item.departed if not math.isnan(each.time)]
            early += [(log.name, each.channel, each.joint) for each in moved if each.time < earliest]
    assert events >= 6 and early == []
