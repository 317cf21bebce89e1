"""The simulated sensors against their definitions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from cdtool.commands.simulate import sensors
from cdtool.commands.simulate.gate_model import Array


def test_coloured_noise_and_resonance_have_the_stated_deviation_and_colour() -> None:
    white = np.random.default_rng(0).standard_normal(400_000)
    coloured = sensors.coloured_noise(white, 15.0, 60.0, 1e-3)
    assert np.std(coloured) == pytest.approx(15.0, rel=0.02)
    assert np.corrcoef(coloured[:-10], coloured[10:])[0, 1] == pytest.approx(np.exp(-0.6), abs=0.02)
    mode = sensors.resonance(white, 0.16, 18.0, 0.06, 1e-3)
    assert np.std(mode) == pytest.approx(0.16, rel=0.05)
    crossings = np.count_nonzero(np.diff(np.sign(mode))) / 2.0 / 400.0
    assert crossings == pytest.approx(18.0, rel=0.05)


def test_no_sensor_looks_ahead() -> None:
    values = np.random.default_rng(0).standard_normal(200)
    changed = values.copy()
    changed[120:] += 1.0
    models: dict[str, Callable[[Array], Array]] = {
        "coloured": lambda x: sensors.coloured_noise(x, 1.0, 60.0, 1e-3),
        "resonance": lambda x: sensors.resonance(x, 1.0, 18.0, 0.06, 1e-3),
    }
    for name, model in models.items():
        first, second = model(values), model(changed)
        np.testing.assert_array_equal(first[:120], second[:120], err_msg=name)
        assert first[120] != second[120], name
