"""Causality through the whole path; `python -m tests.contracts.prefixes` tries 2,000 prefixes, here are 60."""

from __future__ import annotations

import pytest

from cdtool.detectors import DETECTORS
from tests.contracts.prefixes import MACHINES, SETTINGS, Combination, combinations, try_prefixes

SHORT = [
    item
    for i, item in enumerate(combinations())
    if not item.settings
    and i % 10 == (i // 10) % 10
    and (item.machine != "robot" or item.detector in ("momentum", "energy"))
]


@pytest.mark.parametrize("item", SHORT, ids=str)
def test_no_verdict_changes_when_later_samples_do(item):
    if item.machine == "robot":
        pytest.importorskip("pinocchio")
    _, changes = try_prefixes(item, 2, 7)
    assert not changes


@pytest.mark.parametrize("machine", MACHINES[:2])
def test_signatures_are_tried_with_every_class_of_motion(machine):
    tried = [try_prefixes(Combination(machine, False, "momentum", name), 3, 11) for name in ("signature", "cusum")]
    assert all(count == 3 and not changes for count, changes in tried)
    assert "momentum" in DETECTORS.names()


@pytest.mark.parametrize("settings", SETTINGS)
@pytest.mark.parametrize("machine", MACHINES[:2])
def test_signatures_whose_band_follows_the_run_are_causal(machine, settings):
    count, changes = try_prefixes(Combination(machine, False, "momentum", "signature", settings), 6, 13)
    assert count == 6 and not changes
