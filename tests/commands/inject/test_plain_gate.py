"""Injected against true contacts of gates that another simulator makes, whose physics are not those of the model."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.project.pages import benchmark_script
from tests.synthetic.plain_gate import PlainGate, drawn_gate

SOFT, STIFF = 5e3, 500e3


@pytest.mark.parametrize(
    ("gate", "names"),
    [
        (drawn_gate(0), ("inertial_momentum", "friction_ekf", "momentum", "pure_torque")),
        (PlainGate(stiffness=math.inf), ("momentum", "pure_torque")),
    ],
    ids=["elastic", "rigid, logged at the load"],
)
def test_the_true_mean_is_within_the_stated_range(gate: PlainGate, names: tuple[str, ...]) -> None:
    found = benchmark_script("injection").compare_plain(gate, 0, (SOFT, STIFF), 4, names)
    for name in names:
        for stiffness in (SOFT, STIFF):
            item = found[stiffness][name]
            assert not np.isnan([*item.injected.ravel(), *item.true]).any(), (stiffness, name)
            assert item.is_in_stated_range, (stiffness, name, item)
        # The range of one obstacle does not contain the latency of the other.
        assert np.min(found[SOFT][name].injected) > 1.5 * np.max(found[STIFF][name].true)
