"""The figure of a season: runs, limit, trend, the map of the stroke over the runs, and the verdicts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.signature.drift import DriftAudit, audit_drift
from cdtool.commands.signature.drift_plot import plot_drift
from tests.commands.signature.seasons import ACTIVATION, learned, season
from tests.report.hostile import HOSTILE
from tests.report.plots.svg import assert_harmless

FITTED = learned(season(20, seed=100))


def audit(change=None, count: int = 30) -> DriftAudit:
    return audit_drift(FITTED, season(count, change, 1), ACTIVATION)


def obstructed(number: int, travel: np.ndarray) -> np.ndarray:
    return 0.3 * number * (np.abs(travel - 0.4) < 0.03)


@pytest.fixture(scope="module")
def growing() -> DriftAudit:
    return audit(obstructed)


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_names_are_drawn_as_plain_text(growing, tmp_path, kind):
    name = HOSTILE[kind]
    (joint,) = growing.joints
    runs = tuple(replace(run, name=name) for run in joint.runs)
    hostile = replace(joint, joint=name, runs=runs)
    plot_drift(replace(growing, joints=(hostile, joint)), tmp_path / "a.svg")
    assert_harmless(tmp_path / "a.svg", kind)
