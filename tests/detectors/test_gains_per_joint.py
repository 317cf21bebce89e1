"""Gains may be one number, or one per joint: the thesis's diagonal gain matrix (2.13, 2.19)."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from cdtool.base.errors import ConfigurationError, FieldsError
from cdtool.detectors import DETECTORS
from cdtool.detectors.energy import Energy
from cdtool.detectors.momentum import Momentum
from cdtool.formats.machine_file import read_machine_file
from tests.synthetic.machines import GATE, machine_of
from tests.synthetic.motions import moving_recording

NAMES = [name for name in DETECTORS.names() if fields(DETECTORS.load(name))]


@pytest.fixture(scope="module")
def axes():
    return machine_of({**GATE, "joints": ["x", "y"]})


@pytest.mark.parametrize("name", NAMES)
def test_each_joint_has_its_own_gains(name, axes):
    recording = moving_recording(axes, seconds=4.0, noise=1e-3, contact=[300.0, 200.0], contact_at=3.0)
    detector = DETECTORS.load(name)
    shared = detector()
    own = {item.name: (item.default, 1.5 * item.default) for item in fields(detector)}
    signal = detector(**own).signal(recording, axes)
    for j in (0, 1):
        alone = detector(**{gain: values[j] for gain, values in own.items()}).signal(recording, axes)
        np.testing.assert_array_equal(signal.values[:, j], alone.values[:, j])
        np.testing.assert_array_equal(signal.status[:, j], alone.status[:, j])
    assert np.abs(signal.values - shared.signal(recording, axes).values)[:, 1].max() > 0.0


@pytest.mark.parametrize("name", NAMES)
def test_a_wrong_number_of_values_and_a_wrong_value_are_refused(name, arm):
    recording = moving_recording(arm, seconds=1.0)
    detector = DETECTORS.load(name)
    first = fields(detector)[0]
    with pytest.raises(ConfigurationError, match="3 values for"):
        detector(**{first.name: (first.default,) * 3}).signal(recording, arm)
    with pytest.raises(FieldsError, match=first.name):
        detector(**{first.name: (first.default, -1.0)})
    with pytest.raises(FieldsError, match=first.name):
        detector(**{first.name: ()})


def test_a_whole_machines_energy_has_one_gain(arm):
    with pytest.raises(ConfigurationError, match="2 values for the whole machine"):
        Energy(bandwidth=(10.0, 20.0)).signal(moving_recording(arm, seconds=1.0), arm)


def test_the_machine_file_accepts_one_number_or_one_per_joint(tmp_path):
    text = """
[machine]
type = "rotary_axis"
joints = ["a", "b"]
coordinates = "load"
load_inertia = 1.0
[detectors.gm]
bandwidth = BANDWIDTH
"""
    path = tmp_path / "machine.toml"
    path.write_text(text.replace("BANDWIDTH", "[10, 20.0]"))
    assert read_machine_file(path).detector("gm") == Momentum(bandwidth=(10.0, 20.0))
    for wrong, words in (
        ("[10, 20, 30]", "has 3 values"),
        ("[10, 'x']", "is 'x'"),
        ("[10, -1]", r"detectors\.gm\.bandwidth: is \[10, -1\]"),
    ):
        path.write_text(text.replace("BANDWIDTH", wrong))
        with pytest.raises(ConfigurationError, match=words):
            read_machine_file(path)
