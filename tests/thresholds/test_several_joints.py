"""What holds for every threshold on a machine of several joints: each column is judged by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import detect_operation
from cdtool.commands.learning.fitting import fit_operations
from cdtool.detectors.detection import Signal, Status
from cdtool.formats.machine_file import read_machine_file
from cdtool.recordings.operations import Operation, operations_of
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.signature import Signature
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


@pytest.mark.parametrize("towards", [1.0, -1.0])
def test_a_contact_is_found_whatever_joint_leads(tmp_path, towards):
    """Axis b leads backward, axis a moves forward and hits: by the leading joint's side the force is a relief."""
    (tmp_path / "machine.toml").write_text(
        '[machine]\ntype = "linear_axis"\njoints = ["a", "b"]\ncoordinates = "load"\nload_mass = [10.0, 10.0]\n',
        encoding="utf-8",
    )
    machine_file = read_machine_file(tmp_path / "machine.toml")
    detector, noise = machine_file.detector("pure_torque"), np.random.default_rng(1)
    time = np.arange(0.0, 3.0, 2e-3)

    def run(hit: float) -> Operation:
        speed = np.column_stack([np.full(len(time), 0.1 * towards), np.full(len(time), -0.5)])
        torque = 2.0 * np.sign(speed) + 0.1 * noise.standard_normal(speed.shape)
        torque[:, 0] += hit * towards * (time > 2.0)
        channels = {
            "torque": Series(time, torque, "N"),
            "speed": Series(time, speed, "m/s"),
            "position": Series(time, np.cumsum(speed, axis=0) * 2e-3, "m"),
        }
        (operation,) = operations_of(Recording("run", "run.csv", ("a", "b"), channels), "whole")
        return operation

    fitted = fit_operations([run(0.0) for _ in range(10)], machine_file.machine, detector, Signature()).thresholds
    detection = detect_operation(run(24.0), machine_file.machine, detector, fitted, Activation())
    assert [(alarm.joint, alarm.time > 2.0) for alarm in detection.verdict.alarms[:1]] == [("a", True)]
