"""What holds for every threshold on a machine of several joints: each column is judged by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.detection import Signal, Status
from cdtool.recording import Recording, Series
from cdtool.thresholds import THRESHOLDS
from tests.thresholds.strokes import TIME, N, stroke

JOINTS = ("shoulder", "elbow")


def arm_stroke() -> Recording:
    """The first joint leads, the second moves half as fast."""
    one = stroke()
    channels = {
        name: Series(TIME, series.values * np.array([[1.0, 0.5]]), "rad/s") for name, series in one.channels.items()
    }
    return Recording("arm", "arm", JOINTS, channels)


def arm_signal(rng: np.random.Generator) -> Signal:
    values = np.array([100.0, -7.0]) + np.array([1.0, 0.02]) * rng.normal(size=(N, 2))
    return Signal(TIME, values, np.zeros((N, 2), dtype=np.uint8), "N m", True, JOINTS)


@pytest.mark.parametrize("name", THRESHOLDS.names())
def test_each_joint_is_judged_as_if_it_were_alone(name):
    rng = np.random.default_rng(0)
    recording = arm_stroke()
    signals = [arm_signal(rng) for _ in range(13)]
    status = signals[-1].status.copy()
    status[2500:2600, 1] = Status.GAP
    probe = replace(signals[-1], status=status)
    rule = THRESHOLDS.load(name)()
    statistic, band = rule.fit([(recording, item) for item in signals[:12]]).evaluate(recording, probe)
    for j, joint in enumerate(JOINTS):
        alone = rule.fit([(recording, item.watching([joint])) for item in signals[:12]])
        one, limits = alone.evaluate(recording, probe.watching([joint]))
        np.testing.assert_allclose(statistic.values[:, [j]], one.values, rtol=1e-9, atol=1e-12)
        np.testing.assert_array_equal(statistic.status[:, [j]], one.status)
        np.testing.assert_allclose(band.upper[:, [j]], limits.upper, rtol=1e-9)
        np.testing.assert_allclose(band.lower[:, [j]], limits.lower, rtol=1e-9)
    assert statistic.valid[2500:2600, 0].all() and not statistic.valid[2500:2600, 1].any()
