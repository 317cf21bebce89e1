"""The simulated arm's latencies: order, misses, false alarms and what cannot be assessed, on a seed of its own.

benchmarks/accuracy.py compares five whole seeds with the reference; this is a smaller one for every test run.
"""

from __future__ import annotations

from pathlib import Path

import pytest

import cdtool
from cdtool.commands.simulate.arm_recordings import simulate_arm
from cdtool.results.summary import Summary, summarise

COUNTS = {"free": 14, "holdout": 10, "stiff": 15, "soft": 15}
SEED = 777
# Means of physics of three reference seeds [ms].
REFERENCE = {
    (1, "stiff"): {"friction_ekf": 12.0, "inertial_momentum": 14.0, "momentum": 28.3},
    (1, "soft"): {"friction_ekf": 85.7, "inertial_momentum": 103.7, "momentum": 113.0},
    (2, "soft"): {"inertial_momentum": 349.0, "momentum": 388.7},
}


@pytest.fixture(scope="module")
def rows(tmp_path_factory) -> dict[tuple[int, str, str], Summary]:
    found = {}
    for trial in (1, 2):
        folder: Path = tmp_path_factory.mktemp("arm") / f"trial_{trial}"
        simulate_arm(folder, COUNTS, SEED, 1 if trial == 1 else 2)
        for row in summarise(cdtool.benchmark(folder / "benchmark.toml").results):
            found[trial, row.group, row.detector] = row
    return found


@pytest.mark.parametrize(("trial", "group"), REFERENCE)
def test_every_mean_is_near_the_reference(rows, trial, group):
    for detector, mean in REFERENCE[trial, group].items():
        row = rows[trial, group, detector]
        assert row.detected == 15 and row.mean_ms == pytest.approx(mean, rel=0.25), detector


def test_the_order_is_the_thesiss(rows):
    means = {key: row.mean_ms for key, row in rows.items()}
    assert means[1, "stiff", "friction_ekf"] < means[1, "stiff", "inertial_momentum"] < means[1, "stiff", "momentum"]
    assert means[1, "soft", "friction_ekf"] < means[1, "soft", "inertial_momentum"]
    stiff = {key[2]: row.median_ms for key, row in rows.items() if key[:2] == (2, "stiff")}
    assert stiff["inertial_momentum"] < stiff["momentum"]
    assert means[2, "soft", "inertial_momentum"] < means[2, "soft", "momentum"]


def test_the_friction_of_a_held_joint_is_not_assessable_never_missed_never_an_alarm(rows):
    for group in ("stiff", "soft"):
        row = rows[2, group, "friction_ekf"]
        assert (row.detected, row.missed, row.not_assessable, row.false_alarms) == (0, 0, 15, 0)


def test_nothing_is_missed_and_nothing_raises_a_false_alarm(rows):
    assert all(row.missed == 0 and row.false_alarms == 0 for row in rows.values())
